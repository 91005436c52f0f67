//! Nonlinear problems without a solution are proved to have none, where bounds of their terms show it; those with one are not refuted.

use nonsmooth_problem::check::{Certificate, Evidence, Judged};
use nonsmooth_problem::field::Expressions;
use nonsmooth_problem::{LcpPoint, Mcp, Problem};
use nonsmooth_solve::existence::of;
use nonsmooth_solve::{Limits, Solve, Status};
use rand::{RngExt, SeedableRng};
use rand_pcg::Pcg64;

const INF: f64 = f64::INFINITY;

fn mcp(rows: &[String], bounds: &[[f64; 2]]) -> Mcp {
    let f = Expressions::parse(rows, &[]).unwrap();
    let (lower, upper) =
        (bounds.iter().map(|b| b[0]).collect(), bounds.iter().map(|b| b[1]).collect());
    Mcp::new(f, lower, upper, vec![0.5; bounds.len()]).unwrap()
}

fn texts(rows: &[&str]) -> Vec<String> {
    rows.iter().map(ToString::to_string).collect()
}

/// That `auto` proves it, that its certificate verifies alone, and that `exists` knows.
fn check(problem: &Mcp, what: &str) {
    let answer = Solve::new().time_limit(20.0).run(problem).unwrap();
    let Status::Infeasible(proof) = &answer.status else {
        panic!("{what}: {} {:?}", answer.status, answer.account)
    };
    assert!(problem.verify(proof.certificate()), "{what}");
    let known = of(&problem.clone().into(), &Limits::default());
    assert_eq!(known.name(), "no_solution", "{what}: {known}");
}

#[test]
fn what_bounds_refute_is_proved() {
    let (free, pair) = ([-INF, INF], [0.0, INF]);
    let cases: Vec<(&[&str], Vec<[f64; 2]>)> = vec![
        (&["x1^2 + 1"], vec![free]),
        (&["exp(x1) + 0.01"], vec![free]),
        (&["-1 - x1^2"], vec![pair]),
        // From above: F_1 > 0 where x1 has no lower bound.
        (&["0.5 + abs(x1) + sqrt(x2)", "x2"], vec![[-INF, 3.0], pair]),
        // A sum of rows, along which terms that are not linear cancel, and so does what is linear.
        (&["exp(x1) - 0.1*x2 - 1", "0.2*x2 - 2*exp(x1) + 1", "x3"], vec![pair, pair, free]),
        (&["x1 - x2^3 - 1 - exp(x3)", "x2^3 - x1", "x3^3"], vec![pair, pair, free]),
        // An equation makes the box smaller: x2 = 0.
        (&["x1*x2 - 1", "x2"], vec![free, free]),
        (&["x1*x2 - 1", "2*x2 + 3*x3 + x2^2", "x3 - 1"], vec![free, pair, [1.0, INF]]),
        // x1 is held at its bound, and then the other row has no solution.
        (&["1 + x2^2", "x1*x2 - 1"], vec![pair, free]),
        // Terms that together have a sign which none has: squares completed, tangents, products of bounded variables.
        (&["x1^2 - x1 + 1"], vec![free]),
        (&["x1^2 + x2^2 - x1*x2 - x1 + 1", "x1 - x2"], vec![free, free]),
        (&["-(2*x1 - 3)^2 + x1*x2 - x2^2 - 20", "x2"], vec![pair, pair]),
        (&["exp(x1) - 2*x1 - 0.5"], vec![free]),
        (&["log(x1) - 3*x1 + 2"], vec![pair]),
        (&["sqrt(x1) - x1 - 0.26", "x2"], vec![pair, free]),
        (&["x1 - x3", "x2 + x3", "x1*x2 - x1 - 0.01"], vec![[0.0, 1.0], [0.0, 1.0], free]),
        (&["abs(x1 - x2) - x1 + x2 + 0.1", "x2"], vec![free, free]),
        // Two cases, each refuted by another vector: x1 = 0, or F_1 = 0.
        (&["x2", "x2 - 1 + 0.001*cos(x3)", "x1 - 1 + 0.1*sin(x3)"], vec![pair, free, free]),
    ];
    for (rows, bounds) in cases {
        check(&mcp(&texts(rows), &bounds), &format!("{rows:?}"));
    }
}

/// Rows with whole coefficients of random terms; the last makes the weighted sum negative on the whole box.
#[test]
fn planted_directions_are_found() {
    let mut random = Pcg64::seed_from_u64(8);
    for trial in 0..30 {
        let n = 3 + trial % 4;
        let mut whole = |from: i32, to: i32| random.random_range(from..=to);
        let term = |k: i32, i: usize, j: usize| match k {
            0 => format!("x{i}^3"),
            1 => format!("x{i}*x{j}"),
            2 => format!("exp(x{i})"),
            3 => format!("sin(x{i} + x{j})"),
            _ => format!("x{i}"),
        };
        let mut rows: Vec<String> = (1..n)
            .map(|_| {
                let each = (0..3).map(|_| {
                    let (k, i, j) = (whole(0, 4), whole(1, n), whole(1, n));
                    format!("({})*{}", whole(-3, 3), term(k, i as usize, j as usize))
                });
                format!("{} + ({})", each.collect::<Vec<_>>().join(" + "), whole(-3, 3))
            })
            .collect();
        let weights: Vec<i32> = (1..n).map(|_| whole(0, 3)).collect();
        let sum: Vec<_> =
            rows.iter().zip(&weights).map(|(row, w)| format!("{w}*({row})")).collect();
        rows.push(format!("-0.25 - x1^2 - ({})", sum.join(" + ")));
        // Without lower bounds the direction would have another sign.
        let bounds: Vec<[f64; 2]> = (0..n).map(|_| [f64::from(whole(-1, 0)), INF]).collect();
        check(&mcp(&rows, &bounds), &format!("{trial}: {rows:?}"));
    }
}

/// Whole numbers throughout, so that what is planted is a solution exactly.
#[test]
fn what_has_a_solution_is_not_refuted() {
    let mut random = Pcg64::seed_from_u64(21);
    for trial in 0..120 {
        let n = 2 + trial % 3;
        let mut whole = |from: i32, to: i32| random.random_range(from..=to);
        let bounds: Vec<[f64; 2]> = (0..n)
            .map(|_| [[0.0, INF], [-INF, INF], [-INF, 1.0], [0.0, 1.0]][whole(0, 3) as usize])
            .collect();
        // At a bound, or at 0 or 1 between or outside none.
        let x: Vec<i32> = (0..n).map(|_| whole(0, 1)).collect();
        let rows: Vec<String> = (0..n)
            .map(|i| {
                let [l, u] = bounds[i];
                let at = f64::from(x[i]);
                let w = match () {
                    () if at == l => whole(0, 2),
                    () if at == u => -whole(0, 2),
                    () => 0,
                };
                let mut value = 0;
                let mut terms = vec![];
                for _ in 0..3 {
                    let (c, j, k) = (
                        whole(-2, 2),
                        whole(0, n as i32 - 1) as usize,
                        whole(0, n as i32 - 1) as usize,
                    );
                    let (text, there) = match whole(0, 4) {
                        0 => (format!("x{}^3", j + 1), x[j].pow(3)),
                        1 => (format!("x{}*x{}", j + 1, k + 1), x[j] * x[k]),
                        2 => (format!("abs(x{} - 2*x{})", j + 1, k + 1), (x[j] - 2 * x[k]).abs()),
                        3 => (format!("max(x{}, 1 - x{})", j + 1, k + 1), x[j].max(1 - x[k])),
                        _ => (format!("x{}", j + 1), x[j]),
                    };
                    terms.push(format!("({c})*{text}"));
                    value += c * there;
                }
                format!("{} + ({})", terms.join(" + "), w - value)
            })
            .collect();
        let problem = mcp(&rows, &bounds);
        let point = LcpPoint { z: x.iter().map(|x| f64::from(*x)).collect() };
        assert!(problem.judge(&point, 1e-14).unwrap().solved, "{trial}: {rows:?}");
        let limits = Limits { time_limit: Some(2.0), ..Limits::default() };
        let known = of(&problem.clone().into(), &limits);
        assert!(!known.name().contains("no_solution"), "{trial}: {known} {rows:?}");
        for y in [vec![1.0; n], vec![-1.0; n]] {
            assert!(!problem.verify(&Certificate::Farkas { y }));
        }
    }
}

#[test]
fn certificates_that_prove_nothing_are_refused() {
    let free = [-INF, INF];
    let one = |row: &str, bounds: [f64; 2]| mcp(&texts(&[row]), &[bounds]);
    let says = |problem: &Mcp, y: f64| problem.evidence(&Certificate::Farkas { y: vec![y] });
    assert!(matches!(says(&one("x1^2 + 1", free), -1.0), Evidence::Proved(_)));
    assert_eq!(says(&one("x1^2 + 1", free), 1.0), Evidence::Nothing);
    // 0 solves it, at the end of the range.
    assert_eq!(says(&one("x1^2", free), -1.0), Evidence::Nothing);
    // Bounded above, x1 = 1 solves it.
    assert_eq!(says(&one("-1 - x1^2", [0.0, 1.0]), 1.0), Evidence::Nothing);
    assert!(matches!(says(&one("-1 - x1^2", [0.0, INF]), 1.0), Evidence::Proved(_)));
    // Nowhere defined: nothing is said.
    assert_eq!(says(&one("log(-1 - x1^2)", free), 1.0), Evidence::Nothing);
    // A table of values that is no continuous function.
    assert!(matches!(says(&one("1 + (x1 > 0)", free), -1.0), Evidence::Proved(_)));
    let wrong = one("x1^2 + 1", free).evidence(&Certificate::Farkas { y: vec![-1.0, 0.0] });
    assert_eq!(wrong, Evidence::Nothing);
}
