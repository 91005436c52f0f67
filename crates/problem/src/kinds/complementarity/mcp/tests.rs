use super::*;
use crate::field::{Binary, Graph};

/// Josephy's problem of 1979, its rows multiplied by powers of `row`, its variables in units of powers of `column`.
fn josephy(row: f64, column: f64) -> (Mcp, [f64; 4]) {
    // Coefficients of x1², x1x2, x2², x1, x2, x3, x4, 1.
    let rows: [[f64; 8]; 4] = [
        [3.0, 2.0, 2.0, 0.0, 0.0, 1.0, 3.0, -6.0],
        [2.0, 0.0, 1.0, 1.0, 0.0, 3.0, 2.0, -2.0],
        [3.0, 1.0, 2.0, 0.0, 0.0, 2.0, 3.0, -1.0],
        [1.0, 0.0, 3.0, 0.0, 0.0, 2.0, 3.0, -3.0],
    ];
    let unit = |j: usize| column.powi(j as i32);
    let mut g = Graph::new(4);
    let x: Vec<_> = (0..4)
        .map(|j| {
            let (x, c) = (g.variable(j), g.constant(unit(j)));
            g.binary(Binary::Mul, c, x)
        })
        .collect();
    let squares = [(0, 0), (0, 1), (1, 1)].map(|(a, b)| g.binary(Binary::Mul, x[a], x[b]));
    let one = g.constant(1.0);
    let basis = [squares[0], squares[1], squares[2], x[0], x[1], x[2], x[3], one];
    let rows = rows.iter().enumerate().map(|(i, of)| {
        let terms = of.iter().zip(basis).filter(|(c, _)| **c != 0.0);
        let terms = terms.map(|(c, b)| {
            let c = g.constant(c * row.powi(i as i32));
            g.binary(Binary::Mul, c, b)
        });
        let terms = terms.collect();
        g.sum(terms)
    });
    let rows = rows.collect();
    let f = Expressions::new(g, rows).unwrap();
    let solution = [6f64.sqrt() / 2.0, 0.0, 0.0, 0.5];
    let scaled: Vec<f64> = (0..4).map(|j| solution[j] / unit(j)).collect();
    let start = (0..4).map(|j| 1.0 / unit(j)).collect();
    (Mcp::ncp(f, start).unwrap(), scaled.try_into().unwrap())
}

#[test]
fn the_solution_of_josephy_is_one() {
    let (problem, x) = josephy(1.0, 1.0);
    let verdict = problem.judge(&LcpPoint { z: x.into() }, 1e-12).unwrap();
    assert!(verdict.solved, "{:?}", verdict.measure);
    // The third pair is not degenerate: F3 > 0.
    assert_eq!((verdict.counts.inside, verdict.counts.lower), (2, 2));
    assert!(verdict.measure.absolute < 1e-14);
}

#[test]
fn scaling_rows_and_variables_changes_no_verdict() {
    let (plain, x) = josephy(1.0, 1.0);
    for (row, column) in [(1024.0, 1.0), (1.0, 0.0009765625), (1048576.0, 1024.0)] {
        let (scaled, y) = josephy(row, column);
        for error in [0.0, 1e-9, 1e-7, 1e-5] {
            let at = |x: [f64; 4]| LcpPoint { z: x.map(|x| x * (1.0 + error)).into() };
            let [a, b] =
                [plain.judge(&at(x), 1e-8), scaled.judge(&at(y), 1e-8)].map(Result::unwrap);
            assert_eq!(a.measure.relative, b.measure.relative, "{row} {column} {error}");
            assert_eq!(a.solved, b.solved);
            assert_eq!(a.statuses, b.statuses);
        }
    }
}

#[test]
fn what_runs_away_solves_nothing() {
    // x − y − 1 = 0, y − x = 0: the larger the point, the smaller the error in units of the terms.
    let mut g = Graph::new(2);
    let (x, y, one) = (g.variable(0), g.variable(1), g.constant(1.0));
    let d = g.binary(Binary::Sub, x, y);
    let r0 = g.binary(Binary::Sub, d, one);
    let r1 = g.binary(Binary::Sub, y, x);
    let f = Expressions::new(g, vec![r0, r1]).unwrap();
    let free = f64::INFINITY;
    let problem = Mcp::new(f, vec![-free; 2], vec![free; 2], vec![0.0; 2]).unwrap();
    for size in [1e3, 1e10, 1e15, 1e17, 1e200] {
        let verdict = problem.judge(&LcpPoint { z: vec![size; 2] }, 1e-8).unwrap();
        assert!(!verdict.solved, "{size:e} {:?}", verdict.measure);
    }
    assert!(problem.affine().is_some_and(|(_, exact)| exact));
    let y = vec![1.0, 1.0];
    assert!(problem.verify(&Certificate::Farkas { y }));
}

#[test]
fn undefined_points_are_no_solutions() {
    let mut g = Graph::new(1);
    let x = g.variable(0);
    let row = g.unary(crate::field::Unary::Log, x);
    let f = Expressions::new(g, vec![row]).unwrap();
    let problem = Mcp::ncp(f, vec![0.0]).unwrap();
    assert!(!problem.judge(&LcpPoint { z: vec![0.0] }, 1e-8).unwrap().solved);
    assert!(problem.judge(&LcpPoint { z: vec![1.0] }, 1e-8).unwrap().solved);
}

#[test]
fn callers_mistakes_are_errors() {
    let f = || {
        let mut g = Graph::new(1);
        let x = g.variable(0);
        Expressions::new(g, vec![x]).unwrap()
    };
    let said = |lower: &[f64], upper: &[f64], start: &[f64]| {
        Mcp::new(f(), lower.into(), upper.into(), start.into()).unwrap_err().to_string()
    };
    assert!(said(&[0.0], &[1.0], &[0.0, 1.0]).contains("start"));
    assert!(said(&[0.0], &[1.0], &[f64::NAN]).contains("start[0]"));
    assert!(said(&[2.0], &[1.0], &[0.0]).contains("[l, u][0]"));
    assert!(Expressions::new(Graph::new(1), vec![]).is_err());
}

#[test]
fn rows_that_vanish_with_all_their_terms_have_units_of_their_neighbours() {
    // As Pyomo writes x² − 2 ⟂ x ≥ 0: b − (x² − 2) = 0, b ⟂ x. At the solution b is zero but for rounding.
    let mut g = Graph::new(2);
    let (x, b, two) = (g.variable(0), g.variable(1), g.constant(2.0));
    let square = g.binary(Binary::Mul, x, x);
    let f = g.binary(Binary::Sub, square, two);
    let equation = g.binary(Binary::Sub, b, f);
    let field = Expressions::new(g, vec![b, equation]).unwrap();
    let (lower, upper) = (vec![0.0, f64::NEG_INFINITY], vec![f64::INFINITY; 2]);
    let problem = Mcp::new(field, lower, upper, vec![1.0, 0.0]).unwrap();
    let at = |b: f64| problem.judge(&LcpPoint { z: vec![2f64.sqrt(), b] }, 1e-10).unwrap();
    assert!(at(4.4e-16).solved && at(0.0).solved);
    assert!(!at(1e-9).solved);
}

/// `(F, J)` of two like rows in the form that closures have.
fn closures(f: fn(f64) -> f64, j: fn(f64) -> f64) -> crate::field::Closures {
    let pattern = crate::field::Pattern::new([vec![0], vec![1]].into_iter().map(Vec::into_iter));
    let all = |rule: fn(f64) -> f64| {
        move |x: &[f64], out: &mut [f64]| {
            out.iter_mut().zip(x).for_each(|(out, x)| *out = rule(*x));
        }
    };
    crate::field::Closures::new(pattern, all(f), all(j)).unwrap()
}

#[test]
fn a_jacobian_makes_no_error_small() {
    let free = f64::INFINITY;
    let solved = |j: fn(f64) -> f64, start: f64, x: f64| {
        let field = closures(|x| x.powi(3) - 1.0, j);
        let problem = Mcp::new(field, vec![-free; 2], vec![free; 2], vec![start; 2]).unwrap();
        problem.judge(&LcpPoint { z: vec![x; 2] }, 1e-8).unwrap().solved
    };
    for wrong in [|_: f64| 1e9, |_: f64| -1e9, |x: f64| 1e20 * x] {
        assert!(
            !solved(wrong, 3.0, 3.0) && !solved(wrong, 3.0, 1.001) && !solved(wrong, 1.0, 1.001)
        );
        assert!(solved(wrong, 3.0, 1.0));
    }
    let right = |x: f64| 3.0 * x * x;
    assert!(
        solved(right, 3.0, 1.0)
            && solved(right, 3.0, 1.0 + 1e-9)
            && !solved(right, 3.0, 1.0 + 1e-7)
    );
    // That of a method with a matrix of its own is no worse than none.
    assert!(solved(|_| 0.5, 3.0, 1.0));
}

#[test]
fn a_start_makes_no_error_small() {
    let free = f64::INFINITY;
    for start in [50.0, 300.0, 700.0, -700.0, 0.0] {
        let field = closures(|x| x.exp() - 2.0, f64::exp);
        let problem = Mcp::new(field, vec![-free; 2], vec![free; 2], vec![start; 2]).unwrap();
        let mut gauge = problem.gauge().unwrap();
        let mut solved =
            |x: f64| problem.certify(&LcpPoint { z: vec![x; 2] }, &mut gauge).passes(1e-8);
        let ln2 = 2f64.ln();
        for x in [0.0, start, -5.0, ln2 + 1e-3, ln2 - 1e-6] {
            assert!(!solved(x), "from {start} at {x}");
        }
        assert!(solved(ln2));
    }
    // As for expressions: x² vanishes with all its terms, and has the unit of the start.
    let field = closures(|x| x * x, |x| 2.0 * x);
    let problem = Mcp::new(field, vec![-free; 2], vec![free; 2], vec![1.0; 2]).unwrap();
    assert!(problem.judge(&LcpPoint { z: vec![1e-7; 2] }, 1e-8).unwrap().solved);
}

/// Near a pole, and where a derivative hardly feels a variable, F is small beside its terms, or a distance beside F, at points that solve nothing.
#[test]
fn a_pole_makes_no_error_small() {
    /// F, bounds, start, points that are none, the solution.
    type Case = (&'static str, [f64; 2], f64, &'static [f64], f64);
    let inf = f64::INFINITY;
    let all: [Case; 12] = [
        ("3 - 1/(x - 1)", [1.0, inf], 1.0, &[1.0 + 5.8e-11, 1.0 + 1e-13], 4.0 / 3.0),
        ("3 - 1/(x - 1)^2", [1.0, inf], 1.0, &[1.0 + 1e-11, 3.0], 1.577_350_269_189_625_8),
        ("1/(1 - x) - 3", [-inf, 1.0], 1.0, &[1.0 - 1e-12, 0.0], 2.0 / 3.0),
        ("-log(1 - x) - 3", [-inf, 1.0], 1.0, &[1.0 - 1e-12], 1.0 - (-3f64).exp()),
        ("1/(1 - x) - 1e8", [-inf, 1.0], 0.0, &[0.0, 0.5], 1.0 - 1e-8),
        ("1 - 1e-9/x", [0.0, inf], 1.0, &[1.0, 0.5], 1e-9),
        ("1 - 1e-20/x^2", [0.0, inf], 1.0, &[1.0, 1e-2], 1e-10),
        ("1e9 - 1/x", [0.0, inf], 1000.0, &[1000.0], 1e-9),
        ("1/x^2 - 3", [-inf, inf], 1e-12, &[0.0656, 1e-12], 3f64.sqrt().recip()),
        ("x^4 - 10/x^4", [0.0, inf], 1e-6, &[0.979697, 1.3], 10f64.powf(0.125)),
        ("x^3 - 10/x^3", [0.0, inf], 1e-8, &[0.5, 1.4], 10f64.powf(1.0 / 6.0)),
        ("x^2 - 10/x^2", [1e-12, inf], 1e-12, &[0.0658, 1.7], 10f64.powf(0.25)),
    ];
    for (f, [lower, upper], start, none, solution) in all {
        let f = Expressions::parse(&[f.into()], &["x".into()]).unwrap();
        let problem = Mcp::new(f.clone(), vec![lower], vec![upper], vec![start]).unwrap();
        let solved = |x: f64| problem.judge(&LcpPoint { z: vec![x] }, 1e-8).unwrap().solved;
        // Nor does it matter where the judge has been before.
        let mut gauge = problem.gauge().unwrap();
        let mut on_the_way = |x: f64| {
            [x, start, x].map(|x| {
                let point = LcpPoint { z: vec![x] };
                problem.measure(&point, &mut gauge).passes(1e-8)
                    && problem.certify(&point, &mut gauge).passes(1e-8)
            })[2]
        };
        assert!(!on_the_way(start));
        for &x in none {
            assert!(!solved(x) && !on_the_way(x), "{f:?} at {x}");
        }
        assert!(solved(solution) && on_the_way(solution), "{f:?}");
    }
}

/// Wherever a start is: what is as large as all of its terms on the way from there to zero is no error.
#[test]
fn a_start_far_off_or_at_a_pole_makes_no_error_small() {
    let inf = f64::INFINITY;
    for start in [1.0, 1e4, 2e9, 1e10, 1e15, 1e50] {
        let field = closures(|x| x * x + 1.0, |x| 2.0 * x);
        let problem = Mcp::new(field, vec![-inf; 2], vec![inf; 2], vec![start; 2]).unwrap();
        for x in [-0.148, 0.0, 1e-3] {
            let point = LcpPoint { z: vec![x; 2] };
            assert!(!problem.judge(&point, 1e-8).unwrap().solved, "from {start} at {x}");
        }
        let field = closures(|x| x - 1.0, |_| 1.0);
        let problem = Mcp::new(field, vec![-inf; 2], vec![inf; 2], vec![start; 2]).unwrap();
        let solved = |x: f64| problem.judge(&LcpPoint { z: vec![x; 2] }, 1e-8).unwrap().solved;
        assert!(!solved(0.0) && !solved(1.0 + 1e-6) && solved(1.0), "from {start}");
    }
    for (f, lower, start, x) in [
        ("-1/x^2 - 1", 1e-6, 1e-6, 1e3),
        ("-1/x^2 - 1", 1e-6, 1e-6, 1e30),
        ("x^2 + 1 + 1e-30/x", -inf, 1e10, -0.148),
    ] {
        let field = Expressions::parse(&[f.into()], &["x".into()]).unwrap();
        let problem = Mcp::new(field, vec![lower], vec![inf], vec![start]).unwrap();
        assert!(!problem.judge(&LcpPoint { z: vec![x] }, 1e-8).unwrap().solved, "{f} at {x}");
    }
}

/// A bound that nothing asks for is no unit, however far, nor a pole or a start that is farther than the largest powers of two that are stepped through.
#[test]
fn far_bounds_and_extreme_starts_make_no_error_small() {
    let inf = f64::INFINITY;
    for (f, [lower, upper], start, wrong, right) in [
        ("1 - x^2", [-5.0, 1e20], 0.0, 0.0, 1.0),
        ("x^2 - 1", [-1e9, 5.0], 0.0, 0.0, -1.0),
        ("1/x - 1", [-inf, inf], 1e-20, 0.0207, 1.0),
        ("x - 1/x", [-inf, inf], 1e102, 2.1e52, 1.0),
        ("x - 1/x", [-inf, inf], 1e102, 100.0, 1.0),
        ("x - 1", [-inf, inf], 1e180, 1e100, 1.0),
    ] {
        let field = Expressions::parse(&[f.into()], &["x".into()]).unwrap();
        let problem = Mcp::new(field, vec![lower], vec![upper], vec![start]).unwrap();
        let solved = |x: f64| problem.judge(&LcpPoint { z: vec![x] }, 1e-8).unwrap().solved;
        assert!(!solved(wrong) && solved(right), "{f} at {wrong}");
    }
    let pole = closures(|x| 1.0 / x - 1.0, |x| -1.0 / (x * x));
    let line = closures(|x| x - 1.0, |_| 1.0);
    for (field, start, all) in [(pole, 1e-15, [-1e16, 1e-3]), (line, 1e180, [1e100, 1e3])] {
        let problem = Mcp::new(field, vec![-inf; 2], vec![inf; 2], vec![start; 2]).unwrap();
        let solved = |x: f64| problem.judge(&LcpPoint { z: vec![x; 2] }, 1e-8).unwrap().solved;
        assert!(!all.into_iter().any(solved) && solved(1.0), "from {start}");
    }
}

/// Where F hardly feels a distance from a bound, as in a flat tail, F may be another on the bound, or feel it there.
#[test]
fn a_flat_tail_makes_no_distance_small() {
    let inf = f64::INFINITY;
    for (f, [lower, upper], start, wrong, right) in [
        ("0.4 - exp(-2.2*(x + 0.0023)^2)", [0.0, inf], 0.0, 3.7055, 0.643_064_848_140_588_6),
        ("0.25 - exp(-(x + 0.002)^2)", [0.0, inf], 0.0, 5.86, 4f64.ln().sqrt() - 0.002),
        ("exp(-(x - 0.002)^2) - 0.25", [-inf, 0.0], 0.0, -5.86, 0.002 - 4f64.ln().sqrt()),
        (
            "0.3 - 1/(1 + (x + 0.1)^6)",
            [0.0, inf],
            0.0,
            1.1e4,
            (0.7_f64 / 0.3).powf(1.0 / 6.0) - 0.1,
        ),
        ("(x - 1)^9 + 0.4", [0.0, inf], 1.02, 1.02, 1.0 - 0.4_f64.powf(1.0 / 9.0)),
        ("2*x^3 - 5.4*x^2 + 4.8*x - 1", [0.0, inf], 1000.0, 1.0, 0.296_215_085_956_981_8),
        // Beyond a bound.
        ("1 + x^2", [1.0, inf], 1e9, 0.0, 1.0),
        ("1 + (x + 1)^2", [0.0, inf], 1e9, -1.0, 0.0),
        ("1 + (x + 1)^2", [0.0, inf], 1e9, -1.0 + 1e-9, 1e-12),
        ("1 + 0*x", [1.0, inf], 1e9, 0.0, 1.0),
        // Near a bound.
        ("1 + x", [0.0, inf], 0.0, 1e-7, 1e-12),
        ("-1 + x", [-inf, 0.5], 0.0, 0.5 - 1e-7, 0.5 - 1e-12),
    ] {
        let field = Expressions::parse(&[f.into()], &["x".into()]).unwrap();
        let problem = Mcp::new(field, vec![lower], vec![upper], vec![start]).unwrap();
        let mut gauge = problem.gauge().unwrap();
        let mut judged = |x: f64| problem.certify(&LcpPoint { z: vec![x] }, &mut gauge);
        assert!(!judged(wrong).passes(1e-8), "{f} at {wrong}: {:?}", judged(wrong));
        assert!(judged(right).passes(1e-8), "{f} at {right}: {:?}", judged(right));
    }
}

/// Nor a start far off where F ends on the way to zero: its rows are as large as they are up to there.
#[test]
fn where_f_ends_no_error_is_small() {
    let inf = f64::INFINITY;
    for (f, start, all) in [
        ("(x - 1)^2.5*log(x - 1) + 1", 1e5, [1.634, 1.001]),
        ("(x - 1)^2.5 + 1", 1e5, [1.0, 1.2]),
        ("sqrt(x - 1)*x^2 + 0.5", 1e6, [1.0, 1.0 + 1e-9]),
        ("exp(sqrt(x - 1)) - 0.9", 1600.0, [1.0, 1.0 + 1e-12]),
        ("(1e-3 - x)^2.5 + 1e-7", -1e5, [1e-3, 0.999e-3]),
    ] {
        let field = Expressions::parse(&[f.into()], &["x".into()]).unwrap();
        let problem = Mcp::new(field, vec![-inf], vec![inf], vec![start]).unwrap();
        for x in all {
            let point = LcpPoint { z: vec![x] };
            assert!(!problem.judge(&point, 1e-8).unwrap().solved, "{f} at {x}");
        }
    }
    let f = |x: f64| if x < 1.0 { f64::NAN } else { (x - 1.0).powf(2.5) + 1.0 };
    let field = closures(f, |x| 2.5 * (x - 1.0).powf(1.5));
    let problem = Mcp::new(field, vec![-inf; 2], vec![inf; 2], vec![1e5; 2]).unwrap();
    assert!(!problem.judge(&LcpPoint { z: vec![1.0; 2] }, 1e-8).unwrap().solved);
    // Where there is a solution it passes.
    let field = Expressions::parse(&["sqrt(x - 1) - 1e-3".into()], &["x".into()]).unwrap();
    let problem = Mcp::new(field, vec![-inf], vec![inf], vec![1e5]).unwrap();
    assert!(problem.judge(&LcpPoint { z: vec![1.0 + 1e-6] }, 1e-8).unwrap().solved);
}

/// Rows that vanish with all their terms at zero, or far off, have the unit that their last power makes at the start, or that the variables have where other rows tie them: not
/// what larger powers, or an exponential, make at a start far off.
#[test]
fn larger_powers_at_a_start_far_off_make_no_error_small() {
    let inf = f64::INFINITY;
    let judged = |f: &[&str], lower: f64, start: &[f64], z: &[f64]| {
        let f: Vec<String> = f.iter().map(|f| f.to_string()).collect();
        let n = start.len();
        let field = Expressions::parse(&f, &[]).unwrap();
        let problem = Mcp::new(field, vec![lower; n], vec![inf; n], start.to_vec()).unwrap();
        problem.judge(&LcpPoint { z: z.to_vec() }, 1e-8).unwrap().solved
    };
    type Case<'a> = (&'a [&'a str], f64, &'a [f64], &'a [f64]);
    let wrong: [Case; 11] = [
        (&["x1^5*(x1 - 1)^2"], -inf, &[1e5], &[1.693]),
        (&["x1^3 + x1^2"], -inf, &[1e8], &[2.32]),
        (&["6/x1^7 - 12/x1^13"], 0.05, &[0.05], &[35.5]),
        (&["x1*exp(x1^2)"], -inf, &[10.0], &[6.94]),
        (&["x1*exp(x1)"], -inf, &[50.0], &[1.03]),
        (&["x1^9 + x1"], -inf, &[100.0], &[3.0]),
        (&["x1^5 + x1"], -inf, &[1000.0], &[3.0]),
        (&["x1^3 + x1"], -inf, &[1e6], &[50.0]),
        (&["x1*cosh(x1) + x2", "x2 - x1"], -inf, &[60.0, 3.0], &[3.0, 3.0]),
        (&["x1^2*x2 - x2^2", "x1 + x2 - 5"], -inf, &[1e9, 1e9], &[-89.1, 94.1]),
        (&["6/x1^7 - 12/x1^13"], 0.01, &[0.1], &[0.907]),
    ];
    for (f, lower, start, z) in wrong {
        assert!(!judged(f, lower, start, z), "{f:?} at {z:?}");
    }
    let right: [Case; 9] = [
        // What a row ties by other variables is not smaller for that.
        (&["x2", "x2 - (x1^2 - 2)"], -inf, &[1e5, 1.0], &[std::f64::consts::SQRT_2, -4.4e-16]),
        (&["x2", "x2 - (x1^2 - 2)"], -inf, &[1e6, 10.0], &[std::f64::consts::SQRT_2, -4.4e-16]),
        (&["x1^9 + x1^8*x2", "x2 - 1"], -inf, &[1000.0, 1000.0], &[-1.0, 1.0]),
        (&["x1*exp(x1^2)"], -inf, &[10.0], &[1e-13]),
        (&["x1^9 + x1"], -inf, &[100.0], &[1e-13]),
        // Of one power alone nobody knows the unit but the start.
        (&["x1^3"], -inf, &[1e6], &[1.0]),
        (&["x1^2*x2 - x2^2", "x1 + x2 - 5"], -inf, &[1e9, 1e9], &[5.0, 0.0]),
        (&["x1^2*x2 - x2^2", "x1 + x2 - 5"], -inf, &[1e9, 1e9], &[5.0, 1e-13]),
        (&["6/x1^7 - 12/x1^13"], 0.01, &[0.1], &[2.0_f64.powf(1.0 / 6.0)]),
    ];
    for (f, lower, start, z) in right {
        assert!(judged(f, lower, start, z), "{f:?} at {z:?}");
    }
}

#[test]
fn a_point_is_asked_once() {
    use std::sync::Arc;
    use std::sync::atomic::{AtomicUsize, Ordering};
    let asked = Arc::new(AtomicUsize::new(0));
    let counter = asked.clone();
    let value = move |x: &[f64], f: &mut [f64]| {
        counter.fetch_add(1, Ordering::Relaxed);
        f.copy_from_slice(&[x[0] * x[0] - 2.0 + x[1], x[1] + x[0]]);
    };
    let field = crate::field::Differences::new(crate::field::Pattern::dense(2), value).unwrap();
    let problem = Mcp::ncp(field, vec![1.0; 2]).unwrap();
    let mut gauge = problem.gauge().unwrap();
    let point = LcpPoint { z: vec![2.0, 0.5] };
    let before = asked.load(Ordering::Relaxed);
    let certified = problem.certify(&point, &mut gauge);
    // F, two sides of two columns, and two values that the Jacobian is held against.
    assert_eq!(asked.load(Ordering::Relaxed) - before, 7);
    assert_eq!(problem.measure(&point, &mut gauge).relative, certified.relative);
    assert_eq!(problem.certify(&point, &mut gauge).relative, certified.relative);
    assert_eq!(asked.load(Ordering::Relaxed) - before, 7);
}

/// A row that vanishes at the start has a unit of its neighbours', as far as the variables that they share reach, and no larger than they are elsewhere.
#[test]
fn what_no_variable_reaches_is_no_unit() {
    /// F, bounds of x2 (x1 is free), start, a point that is none, one that is.
    type Case = ([&'static str; 2], [f64; 2], [f64; 2], [f64; 2], Option<[f64; 2]>);
    let inf = f64::INFINITY;
    let all: [Case; 7] = [
        (["x2", "1e14 + x1^2 - x2"], [-1.0, 1.0], [0.0; 2], [0.0, -1.0], None),
        (["x2", "1e14 + x1^2 - x2"], [-1.0, inf], [0.0; 2], [0.0, -1.0], None),
        (["x2", "1e14 + 0.001*x1 - x2"], [-1.0, 1.0], [0.0; 2], [0.0, -1.0], Some([-1e17, 0.0])),
        (["x2", "x1^2 - x2 + 2"], [-1.0, 1.0], [1e7, 0.0], [0.0, -1.0], None),
        (["x2", "x1^2 - x2 + 2"], [-inf, inf], [1e7, 0.0], [0.0, 2.0], None),
        (
            ["x2", "x1^2 - x2 - 2"],
            [-inf, inf],
            [1e7, 0.0],
            [0.0, -2.0],
            Some([2_f64.sqrt(), 4e-16]),
        ),
        (["-x2", "exp(x1) - x2 - 1"], [-inf, 0.0], [100.0, 0.0], [-30.0, -1.0], Some([0.0, 0.0])),
    ];
    for (f, [lower, upper], start, wrong, right) in all {
        let field = Expressions::parse(&f.map(String::from), &[]).unwrap();
        let problem = Mcp::new(field, vec![-inf, lower], vec![inf, upper], start.to_vec()).unwrap();
        let judged = |z: [f64; 2]| problem.judge(&LcpPoint { z: z.to_vec() }, 1e-8).unwrap();
        let verdict = judged(wrong);
        assert!(!verdict.solved, "{f:?} at {wrong:?}: {:?}", verdict.measure);
        if let Some(right) = right {
            let verdict = judged(right);
            assert!(verdict.solved, "{f:?} at {right:?}: {:?}", verdict.measure);
        }
    }
}

/// A limit of time that is over leaves nothing out of what decides.
#[test]
fn the_time_makes_no_error_small() {
    use nonsmooth_linalg::budget::Budget;
    let late = || Budget { deadline: Some(std::time::Instant::now()), ..Budget::default() };
    let inf = f64::INFINITY;
    // The Jacobian makes its terms large, of plain arithmetic 1/∞ is zero, and of a start near a pole the units are on the way.
    let expression = |f: &str, lower: f64, upper: f64, start: f64| {
        let field = Expressions::parse(&[f.into()], &["x".into()]).unwrap();
        Mcp::new(field, vec![lower], vec![upper], vec![start]).unwrap()
    };
    let field = closures(|x| x - 8.0, |_| 1e12);
    let of_functions = Mcp::new(field, vec![-inf; 2], vec![inf; 2], vec![1.0; 2]).unwrap();
    for (problem, x) in [
        (of_functions, 1.0),
        (expression("1/(1 + 1/x)", -1.0, 1.0, 0.0), 0.0),
        (expression("x^2 - 10/x^2", 1e-12, inf, 1e-12), 0.0658),
    ] {
        let point = LcpPoint { z: vec![x; problem.dim()] };
        for early in [true, false] {
            let mut gauge = problem.gauge().unwrap();
            if early {
                let _ = problem.measure(&point, &mut gauge);
            }
            let scope = late().enter();
            let _ = problem.measure(&point, &mut gauge);
            assert!(!problem.certify(&point, &mut gauge).passes(1e-8), "{problem:?}");
            drop(scope);
            assert!(!problem.certify(&point, &mut gauge).passes(1e-8), "{problem:?}");
        }
    }
    // And what is a solution is one.
    let problem = expression("x^2 - 2", -inf, inf, 1.0);
    let mut gauge = problem.gauge().unwrap();
    let _scope = late().enter();
    let point = LcpPoint { z: vec![2_f64.sqrt()] };
    assert!(problem.certify(&point, &mut gauge).passes(1e-8));
}
