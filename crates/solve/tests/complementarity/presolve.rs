//! The presolve of nonlinear problems: planted rows go, answers stay.

use nonsmooth_problem::field::Expressions;
use nonsmooth_problem::{LcpPoint, Mcp};
use nonsmooth_solve::complementarity::reform::Presolve;
use nonsmooth_solve::complementarity::reform::presolve::{Counts, counts, reduces};
use nonsmooth_solve::{Reformulation, Solve};
use rand::{RngExt, SeedableRng};
use rand_pcg::Pcg64;

const INF: f64 = f64::INFINITY;

fn mcp(rows: &[String], bounds: &[[f64; 2]]) -> Mcp {
    let f = Expressions::parse(rows, &[]).unwrap();
    let (lower, upper) =
        (bounds.iter().map(|b| b[0]).collect(), bounds.iter().map(|b| b[1]).collect());
    Mcp::new(f, lower, upper, vec![0.25; bounds.len()]).unwrap()
}

fn of(rows: &[&str], bounds: &[[f64; 2]]) -> Mcp {
    mcp(&rows.iter().map(ToString::to_string).collect::<Vec<_>>(), bounds)
}

fn solve(name: &str, problem: &Mcp) -> LcpPoint {
    let answer = Solve::new().solver(name).tolerance(1e-13).time_limit(20.0).run(problem).unwrap();
    assert!(answer.is_solved(), "{name}: {} {:?}", answer.status, answer.account);
    answer.point
}

/// A strongly monotone F of n variables between bounds of all sorts, and around it one row of each sort that goes.
#[test]
fn planted_rows_go_and_the_answers_stay() {
    let mut random = Pcg64::seed_from_u64(3);
    for trial in 0..25 {
        let n = 4 + trial % 5;
        // After x: a variable that is held, two twins that are free, two that are bounded, one that five rows use.
        let [held, free, twin, least, other, b] = [0, 1, 2, 3, 4, 5].map(|k| n + k);
        let x = |j: usize| format!("x{}", j + 1);
        let mut number = |size: f64| random.random_range(-size..size);
        let a: Vec<f64> = (0..n).map(|_| number(1.0)).collect();
        let c: Vec<f64> = (0..n).map(|_| number(1.0)).collect();
        let mut skew = vec![vec![0.0; n]; n];
        for i in 0..n {
            for j in 0..i {
                skew[i][j] = number(1.0);
                skew[j][i] = -skew[i][j];
            }
        }
        let mut rows: Vec<String> = (0..n)
            .map(|i| {
                let linear: Vec<_> = (0..n).map(|j| format!("({})*{}", skew[i][j], x(j))).collect();
                let own = format!("2*{0} + atan({0}) + ({1})", x(i), number(4.0));
                let twins = format!("({})*({} + 2*{})", a[i], x(free), x(twin));
                let bounded = format!("({})*({} + 0.5*{})", c[i], x(least), x(other));
                format!(
                    "{} + {own} - {twins} - {bounded} + 0.125*{} - 0.5*{}",
                    linear.join(" + "),
                    x(held),
                    x(b)
                )
            })
            .collect();
        let sum = |a: &[f64], rhs: f64| {
            let terms: Vec<_> = (0..n).map(|j| format!("({})*{}", a[j], x(j))).collect();
            format!("{} + {rhs}", terms.join(" + "))
        };
        rows.push(format!("0.01 + {}^2 + exp({})", x(0), x(1)));
        let (g, h) = (sum(&a, 0.1), sum(&c, 0.2));
        rows.extend([g.clone(), format!("-4*({g})"), h.clone(), format!("0.5*({h})")]);
        rows.push(format!("4*{} - {} + 1", x(b), x(held)));
        let mut bounds: Vec<[f64; 2]> =
            (0..n).map(|i| [[-INF, INF], [-1.0, INF], [-2.0, 2.0], [-INF, 0.5]][i % 4]).collect();
        bounds.extend([[0.5, INF], [-INF, INF], [-INF, INF], [0.0, INF], [0.0, INF], [-INF, INF]]);
        let problem = mcp(&rows, &bounds);
        let found = counts(&problem);
        // x_b is known where x_held is, so its equation goes as well.
        let expected = Counts { fixed: 0, held: 1, twins: 2, defined: found.defined };
        assert_eq!(found, expected, "{trial}");
        assert!(found.defined >= 1, "{trial}: {found:?}");
        let left = Presolve.reduce(&problem).unwrap().0;
        assert_eq!(left.dim(), n + 6 - 3 - found.defined);
        let plain = solve("semismooth", &problem);
        for name in ["presolve/semismooth", "presolve/path", "auto"] {
            let point = solve(name, &problem);
            let near = |of: &dyn Fn(&[f64]) -> f64, what: &str| {
                let [p, q] = [of(&plain.z), of(&point.z)];
                assert!(
                    (p - q).abs() <= 1e-10 * p.abs().max(1.0),
                    "{trial} {name} {what}: {p} {q}"
                );
            };
            (0..=n).for_each(|j| near(&|z| z[j], &format!("x{j}")));
            near(&|z| z[b], "b");
            // The twins' sums are all that is determined.
            near(&|z| z[free] + 2.0 * z[twin], "free");
            near(&|z| z[least] + 0.5 * z[other], "bounded");
        }
    }
}

#[test]
fn a_variable_that_many_rows_use_goes_where_nothing_fills_in() {
    let rows = ["x1^3 + x4 - 1", "x2^3 + x4 - 2", "x3^3 + x4 + x1 - 3", "2*x4 - x1 + 0.5"];
    let free = [[-INF, INF]; 4];
    let problem = of(&rows, &free);
    assert_eq!(counts(&problem).defined, 1);
    let plain = solve("semismooth", &problem);
    let point = solve("presolve/semismooth", &problem);
    assert!(plain.z.iter().zip(&point.z).all(|(a, b)| (a - b).abs() < 1e-10));
    // Used in an exponential it stays: what defines it would be computed there, and loses its range.
    let rows =
        ["x1^3 + x4 + x2*x3", "x2^3 + x1*x3 - 2", "x3^3 + exp(x4) + x1*x2", "2*x4 - x1 - x2 - x3"];
    assert_eq!(counts(&of(&rows, &free)), Counts::default());
}

/// Where a theorem does not hold nothing goes.
#[test]
fn what_is_not_valid_is_left_alone() {
    let free = [-INF, INF];
    // Multiples, but of variables that are no twins: no number for x1 is the right one beforehand. By squares, so that nothing is an equation for anything.
    let rows = ["x1^2 + x2^2 - 34", "2*x1^2 + 2*x2^2 - 68", "x2^3 - 125"];
    let problem = of(&rows, &[free; 3]);
    assert!(!reduces(&problem));
    // A row that is zero on the border of the box holds nothing: x1 = 1 solves the problem, and so does x1 = 0.
    let touching = of(&["x2^2", "x2^3 + x1 - x1"], &[[0.0, INF], [0.0, INF]]);
    assert_eq!(counts(&touching).held, 0);
    // Positive, but not defined everywhere: nobody would look at it again.
    let partly = of(&["1 + sqrt(x2)", "x2^3 - x1 + 8"], &[[0.0, INF], free]);
    assert_eq!(counts(&partly).held, 0);
    let defined = of(&["1 + sqrt(x2)", "x2^3 - x1 - 8"], &[[0.0, INF], [0.0, INF]]);
    assert_eq!(counts(&defined).held, 1);
    // Positive, but the bound is not there.
    let unbounded = of(&["1 + x2^2", "x2^3 - x1 + 8"], &[[-INF, 3.0], free]);
    assert_eq!(counts(&unbounded).held, 0);
    // Twins whose rows, or whose variables, have opposite signs.
    let bounds = [[0.0, INF], [0.0, INF], free];
    let twins = |rows: [&str; 3]| counts(&of(&rows, &bounds)).twins;
    assert_eq!(twins(["x3 - 1", "2*x3 - 2", "x3^3 - x1 - x2"]), 1);
    assert_eq!(twins(["x3 - 1", "2 - 2*x3", "x3^3 - x1 - x2"]), 0);
    assert_eq!(twins(["x3 - 1", "2*x3 - 2", "x3^3 - x1 + x2"]), 0);
    // With one free variable the sign does not matter, nor the other's bounds.
    let rows = ["x3 - 1", "2 - 2*x3", "x3^3 - x1 + x2"].map(str::to_owned);
    assert_eq!(counts(&mcp(&rows, &[[0.0, 5.0], free, free])).twins, 1);
}

/// A chain in which each variable that is known holds the next; when all are known, one is left to be solved.
#[test]
fn what_is_known_makes_the_box_smaller() {
    let rows = ["1 + x1", "1 - x1 + x2^2", "1 - 3*x2 + x3", "2 + x3^2 - x4^2"];
    let problem = of(&rows, &[[0.0, INF]; 4]);
    assert_eq!(counts(&problem), Counts { held: 3, ..Counts::default() });
    assert_eq!(Presolve.reduce(&problem).unwrap().0.dim(), 1);
    let z = solve("presolve/path", &problem).z;
    assert_eq!(z[..3], [0.0; 3]);
    assert!(z[3] == 0.0 || (z[3] - 2f64.sqrt()).abs() < 1e-12);
    let all = of(&["1 + x1", "1 + x2"], &[[0.0, INF]; 2]);
    assert_eq!(counts(&all).held, 2);
    assert_eq!(Presolve.reduce(&all).unwrap().0.dim(), 1);
    assert_eq!(solve("presolve/semismooth", &all).z, [0.0, 0.0]);
}
