//! Variational inequalities: projections, solvers on problems with known solutions, multipliers, what ends badly.

use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};

use nonsmooth_linalg::Csc;
use nonsmooth_problem::check::{Judged, SetStatus};
use nonsmooth_problem::field::{Closures, Differences, Expressions, Field, Pattern, is_tentative};
use nonsmooth_problem::{LcpPoint, Problem, Set, Vi};
use nonsmooth_solve::variational::Projector;
use nonsmooth_solve::variational::reform::Multipliers;
use nonsmooth_solve::{Answer, Limit, Limits, Reformulation, Solve, SolveError, Status};
use rand::{RngExt, SeedableRng};
use rand_pcg::Pcg64;

fn expressions(rows: impl IntoIterator<Item = String>) -> Expressions {
    Expressions::parse(&rows.into_iter().collect::<Vec<_>>(), &[]).unwrap()
}

/// `{x ≥ 0, Σ x ≥ total}`
fn simplex_like(n: usize, total: f64) -> Set {
    let signs = (0..n).map(|i| (i, i, -1.0));
    let rows = Csc::from_triplets(n + 1, n, signs.chain((0..n).map(|j| (n, j, -1.0)))).unwrap();
    let rhs = (0..=n).map(|i| if i == n { -total } else { 0.0 });
    Set::inequalities(rows, rhs.collect())
}

/// A problem of TajiFukushimaIbaraki1993: `F = M x + ρ arctan(x − 2) + q`; the solution is (2, 2, 2, 2, 2), with the multiplier 2 of Σ x ≥ 10.
fn taji(rho: f64, start: [f64; 5]) -> Vi {
    const M: [[f64; 5]; 5] = [
        [0.726, -0.949, 0.266, -1.193, -0.504],
        [1.645, 0.678, 0.333, -0.217, -1.443],
        [-1.016, -0.225, 0.769, 0.934, 1.007],
        [1.063, 0.567, -1.144, 0.55, -0.548],
        [-0.259, 1.453, -1.073, 0.509, 1.026],
    ];
    const Q: [f64; 5] = [5.308, 0.008, -0.938, 1.024, -1.312];
    let rows = (0..5).map(|i| {
        let sum: Vec<_> = (0..5).map(|j| format!("({})*x{}", M[i][j], j + 1)).collect();
        format!("{} + {rho}*atan(x{} - 2) + ({})", sum.join(" + "), i + 1, Q[i])
    });
    Vi::new(expressions(rows), simplex_like(5, 10.0), start.to_vec()).unwrap()
}

const METHODS: [&str; 7] = [
    "auto",
    "fixed_point",
    "extragradient",
    "hyperplane",
    "multipliers/semismooth",
    "multipliers/path",
    "multipliers/proxi",
];

fn solve(name: &str, problem: &Vi, tolerance: f64) -> Answer<Vi> {
    Solve::new().solver(name).tolerance(tolerance).max_iterations(200_000).run(problem).unwrap()
}

fn close(found: &[f64], known: &[f64], tolerance: f64, what: &str) {
    for (i, (a, b)) in found.iter().zip(known).enumerate() {
        assert!((a - b).abs() <= tolerance, "{what}: [{i}] = {a}, known {b}");
    }
}

#[test]
fn a_polyhedron_of_the_literature_is_solved_from_all_its_starts() {
    for rho in [10.0, 20.0] {
        for start in [[25.0, 0.0, 0.0, 0.0, 0.0], [10.0, 0.0, 10.0, 0.0, 10.0], [0.0; 5]] {
            let problem = taji(rho, start);
            for name in METHODS {
                let answer = solve(name, &problem, 1e-10);
                assert!(answer.is_solved(), "{name} {rho} {start:?}: {}", answer.status);
                close(&answer.point.z, &[2.0; 5], 1e-7, name);
                let statuses = &answer.verdict.statuses;
                assert!(statuses[..5].iter().all(|s| *s == SetStatus::Inside), "{statuses:?}");
                assert_eq!(statuses[5], SetStatus::Border);
            }
        }
    }
}

/// The test of Siconos: `F_i = x_i − i + 4` over x ≥ 1, i = 0, …, 9.
#[test]
fn a_box_is_solved_by_all() {
    let rows = (0..10).map(|i| format!("x{} - {i} + 4", i + 1));
    let set = Set::Box { lower: vec![1.0; 10], upper: vec![f64::INFINITY; 10] };
    let problem = Vi::new(expressions(rows), set, vec![0.0; 10]).unwrap();
    let known: Vec<f64> = (0..10).map(|i| (f64::from(i) - 4.0).max(1.0)).collect();
    for name in METHODS {
        let answer = solve(name, &problem, 1e-12);
        assert!(answer.is_solved(), "{name}: {}", answer.status);
        close(&answer.point.z, &known, 1e-9, name);
        assert_eq!(answer.verdict.counts.border, 6);
    }
}

/// A strongly monotone F over a product of cones, a ball and a box, with the solution planted: w in the normal cone's opposite.
fn planted() -> (Vi, Vec<f64>) {
    // On the border of a cone, at the point of another, inside a third; on the sphere; at a bound.
    let x = [5.0, 3.0, 4.0, 0.0, 0.0, 0.0, 3.0, 1.0, 1.0, 1.6, 0.8, 0.0, 0.7];
    let w = [2.5, -1.5, -2.0, 4.0, -1.0, 2.0, 0.0, 0.0, 0.0, -1.2, 0.4, 2.0, 0.0];
    let n = x.len();
    let cone = Set::SecondOrderCone { dimension: 3 };
    // centre + (−0.6 … ): (x − c) ∥ −w with ‖x − c‖ = 1
    let ball = Set::Ball {
        centre: vec![1.6 - 1.2 / 1.6f64.sqrt(), 0.8 + 0.4 / 1.6f64.sqrt()],
        radius: 1.0,
    };
    let bounds = Set::Box { lower: vec![0.0, -1.0], upper: vec![1.0, f64::INFINITY] };
    let set =
        Set::Product(vec![Set::Product(vec![cone.clone(), cone.clone()]), cone, ball, bounds]);
    let mut random = Pcg64::seed_from_u64(5);
    let mut m = vec![vec![0.0; n]; n];
    for i in 0..n {
        m[i][i] = random.random_range(1.0..2.0);
        for j in 0..i {
            m[i][j] = random.random_range(-0.5..0.5);
            m[j][i] = -m[i][j];
        }
    }
    let known = x.to_vec();
    let field = Differences::new(Pattern::dense(n), move |z, f| {
        for i in 0..n {
            let linear: f64 = (0..n).map(|j| m[i][j] * (z[j] - x[j])).sum();
            f[i] = linear + z[i].atan() - x[i].atan() + w[i];
        }
    });
    (Vi::new(field.unwrap(), set, vec![-1.0; n]).unwrap(), known)
}

#[test]
fn cones_and_balls_are_solved_by_projections() {
    let (problem, known) = planted();
    let verdict = problem.judge(&LcpPoint { z: known.clone() }, 1e-12).unwrap();
    assert!(verdict.solved, "{:?}", verdict.measure);
    use SetStatus::{Apex, Border, Inside};
    assert_eq!(verdict.statuses, [Border, Apex, Inside, Border, Border, Inside]);
    for (name, set) in [
        ("auto", None),
        ("fixed_point", None),
        ("extragradient", None),
        ("extragradient", Some(("rule", "solodov_tseng"))),
        ("hyperplane", None),
        ("hyperplane", Some(("rule", "khobotov"))),
    ] {
        let how = Solve::new().solver(name).tolerance(1e-11);
        let how = set.map_or(how.clone(), |(key, value)| how.set(key, value));
        let answer = how.run(&problem).unwrap();
        assert!(answer.is_solved(), "{name} {set:?}: {} {:?}", answer.status, answer.account);
        close(&answer.point.z, &known, 1e-9, name);
    }
    let refused = Solve::new().solver("multipliers/path").run(&problem).unwrap_err();
    assert!(matches!(refused, SolveError::Needs { .. }), "{refused}");
}

/// `F = (x_2, −x_1)` turns about its solution: extragradient methods come to it, the fixed point does not.
#[test]
fn what_turns_needs_the_extragradient() {
    let field = expressions(["x2".to_owned(), "-x1".to_owned()]);
    let disk = Set::Ball { centre: vec![0.0; 2], radius: 1.0 };
    let problem = Vi::new(field, disk, vec![1.0, 0.0]).unwrap();
    for name in ["extragradient", "hyperplane", "auto"] {
        let answer = solve(name, &problem, 1e-9);
        assert!(answer.is_solved(), "{name}: {}", answer.status);
        close(&answer.point.z, &[0.0; 2], 1e-8, name);
    }
    let short = Solve::new().solver("fixed_point").time_limit(0.1).max_iterations(usize::MAX);
    let begun = std::time::Instant::now();
    let answer = short.run(&problem).unwrap();
    assert_eq!(answer.status, Status::Limit(Limit::Time));
    assert!(begun.elapsed().as_secs_f64() < 5.0 && answer.point.z.iter().all(|x| x.is_finite()));
}

/// The projections of the solvers are solutions of `F = x − p` to the judge, whose projections are others.
#[test]
fn projections_agree_with_those_of_the_judge() {
    let mut random = Pcg64::seed_from_u64(1);
    for trial in 0..40 {
        let n = 2 + trial % 6;
        let m = 3 * n;
        let entries: Vec<_> =
            (0..m * n).map(|k| (k / n, k % n, f64::from(random.random_range(-2..3)))).collect();
        let a = Csc::from_triplets(m, n, entries.iter().copied()).unwrap();
        let (mut b, inside) = (vec![0.0; m], vec![0.3; n]);
        a.mul_add(1.0, &inside, &mut b);
        b.iter_mut().skip(n).for_each(|b| *b += random.random_range(0.0..2.0));
        // An equality through the same point, twice.
        let twice = (0..n).flat_map(|j| [(0, j, 1.0), (1, j, 3.0)]);
        let c = Csc::from_triplets(2, n, twice).unwrap();
        let total = 0.3 * n as f64;
        let polyhedron = Set::Polyhedron { A: a, b, C: c, d: vec![total, 3.0 * total] };
        let ball = Set::Ball { centre: vec![0.1; n], radius: 0.4 };
        let cone = Set::SecondOrderCone { dimension: n };
        for set in [Set::Product(vec![polyhedron, ball.clone()]), cone, ball, simplex_like(n, 2.0)]
        {
            let n = set.dim();
            let p: Vec<f64> = (0..n).map(|_| random.random_range(-3.0..3.0)).collect();
            let mut y = vec![0.0; n];
            assert!(Projector::new(&set).onto(&p, &mut y));
            let rows = p.iter().enumerate().map(|(i, p)| format!("x{} - ({p})", i + 1));
            let problem = Vi::new(expressions(rows), set, vec![0.0; n]).unwrap();
            let measure = problem.judge(&LcpPoint { z: y }, 1e-10).unwrap().measure;
            assert!(measure.relative < 1e-12 && measure.primal < 1e-12, "{trial}: {measure:?}");
        }
    }
}

/// At the start x − ρ F(x) rounds to x.
#[test]
fn values_far_smaller_than_variables_are_no_end_of_the_way() {
    for size in [1e-10, 1e-17, 1e-40] {
        let rows = ["0.25", "0.125"].iter().enumerate();
        let rows = rows.map(|(i, x)| format!("{size:e}*(x{} - {x})", i + 1));
        let ball = Set::Ball { centre: vec![0.0; 2], radius: 1.0 };
        let problem = Vi::new(expressions(rows), ball, vec![0.5, 0.25]).unwrap();
        for name in ["auto", "fixed_point", "extragradient", "hyperplane"] {
            let answer = solve(name, &problem, 1e-8);
            assert!(answer.is_solved(), "{name}, {size:e}: {}", answer.status);
            assert!(answer.iterations < 1000, "{name}, {size:e}: {}", answer.iterations);
        }
    }
}

/// What fails aloud beyond its domain, but where it is only asked whether it is defined.
#[test]
fn trial_steps_ask_in_silence() {
    let loud = Arc::new(AtomicBool::new(false));
    let told = loud.clone();
    let root = move |x: &[f64], f: &mut [f64]| {
        if x[0] < 0.0 && !is_tentative() {
            told.store(true, Ordering::Relaxed);
        }
        // From 4 the first step leads to −3.6.
        f[0] = if x[0] < 0.0 { f64::NAN } else { 4.0 * x[0].sqrt() - 0.4 };
    };
    let field = Differences::new(Pattern::dense(1), root).unwrap();
    let line = Set::Box { lower: vec![f64::NEG_INFINITY], upper: vec![f64::INFINITY] };
    let problem = Vi::new(field, line, vec![4.0]).unwrap();
    // `hyperplane` goes beyond its prediction, and out of the domain where no set holds it back.
    for name in ["fixed_point", "extragradient"] {
        let answer = solve(name, &problem, 1e-8);
        assert!(answer.is_solved(), "{name}: {}", answer.status);
        close(&answer.point.z, &[0.01], 1e-6, name);
        assert!(!loud.load(Ordering::Relaxed), "{name}");
    }
}

#[test]
fn multipliers_are_the_same_of_expressions_and_of_closures() {
    let by_expressions = taji(10.0, [1.0, 2.0, 3.0, 4.0, 5.0]);
    let [f, g] = [by_expressions.F.clone(), by_expressions.F.clone()];
    let pattern = f.pattern().clone();
    let value = move |x: &[f64], out: &mut [f64]| {
        f.evaluator().value(x, out);
    };
    let jacobian = move |x: &[f64], out: &mut [f64]| {
        g.evaluator().jacobian(x, &mut [0.0; 5], out);
    };
    let closures = Closures::new(pattern, value, jacobian).unwrap();
    let mut equality = by_expressions.set.clone();
    if let Set::Polyhedron { C, d, .. } = &mut equality {
        *C = Csc::from_triplets(1, 5, [(0, 1, 2.0), (0, 4, -1.0)].into_iter()).unwrap();
        d.push(0.5);
    }
    let reduced = |f: std::sync::Arc<dyn Field>| {
        let set = equality.clone();
        Multipliers.reduce(&Vi::of(f, set, vec![1.0; 5]).unwrap()).unwrap().0
    };
    let problems = [reduced(by_expressions.F.clone()), reduced(std::sync::Arc::new(closures))];
    assert_eq!(problems[0].F.pattern(), problems[1].F.pattern());
    assert_eq!((problems[0].dim(), &problems[0].lower), (7, &problems[1].lower));
    assert_eq!(problems[0].lower[..5], [0.0; 5]);
    assert_eq!(problems[1].F.source(), "closures for F and for its Jacobian, with multipliers");
    let x: Vec<f64> = (0..7).map(|i| 0.3 * f64::from(i) - 1.0).collect();
    let all = problems.each_ref().map(|problem| {
        let (mut f, mut j) = (vec![0.0; 7], vec![0.0; problem.F.pattern().len()]);
        assert!(problem.F.evaluator().jacobian(&x, &mut f, &mut j));
        (f, j)
    });
    close(&all[0].0, &all[1].0, 1e-13, "F");
    close(&all[0].1, &all[1].1, 1e-13, "J");
}

#[test]
fn what_has_no_answer_ends_with_a_reason() {
    // x ≤ −1 and x ≥ 0
    let rows = Csc::from_triplets(2, 1, [(0, 0, 1.0), (1, 0, -1.0)].into_iter()).unwrap();
    let set = Set::inequalities(rows, vec![-1.0, 0.0]);
    let empty = Vi::new(expressions(["x1".to_owned()]), set, vec![0.0]).unwrap();
    let answer = solve("auto", &empty, 1e-8);
    assert!(matches!(answer.status, Status::Infeasible(_)), "{}", answer.status);
    for name in ["fixed_point", "extragradient", "hyperplane"] {
        let answer = solve(name, &empty, 1e-8);
        let Status::Stalled(why) = &answer.status else { panic!("{name}: {}", answer.status) };
        assert!(why.contains("empty"), "{name}: {why}");
    }
    // Not defined at the start: methods begin inside.
    let log = || expressions(["log(x1)".to_owned()]);
    let problem = Vi::new(log(), Set::orthant(1), vec![0.0]).unwrap();
    for name in ["auto", "extragradient"] {
        let answer = solve(name, &problem, 1e-10);
        assert!(answer.is_solved(), "{name}: {}", answer.status);
        close(&answer.point.z, &[1.0], 1e-8, "log");
    }
    // Nor anywhere.
    let nowhere = expressions(["sqrt(-1 - x1^2)".to_owned()]);
    let problem = Vi::new(nowhere, Set::orthant(1), vec![0.0]).unwrap();
    let answer = solve("extragradient", &problem, 1e-10);
    assert!(matches!(&answer.status, Status::Stalled(why) if why.contains("not defined")));
    assert_eq!(answer.point, problem.origin());
    // From where it is defined, steps beyond the border are shortened.
    let problem = Vi::new(log(), Set::Ball { centre: vec![0.0], radius: 9.0 }, vec![5.0]).unwrap();
    let answer = solve("extragradient", &problem, 1e-10);
    assert!(answer.is_solved(), "{}", answer.status);
}

/// X without a point, or a direction d that leads to infinity in it with `F(x)ᵀd < 0` on the whole of it: proved, by multipliers in fractions where F is affine, by bounds of its terms else.
/// The last point of a method that has no best one is judged when the time is over, where no projection comes to an end.
#[test]
fn a_limit_of_time_leaves_the_residuals_of_what_was_judged() {
    let rows = ["x1+x2", "x1+x2-1", "x3"].map(String::from);
    let plane = Csc::from_triplets(1, 3, [(0, 2, 1.0)].into_iter()).unwrap();
    let set = Set::Polyhedron { A: Csc::zeros(0, 3), b: vec![], C: plane, d: vec![1.0] };
    let problem = Vi::new(expressions(rows), set, vec![0.0; 3]).unwrap();
    for name in ["fixed_point", "extragradient", "hyperplane"] {
        let how = Solve::new().solver(name).max_iterations(usize::MAX).time_limit(0.1);
        let answer = how.run(&problem).unwrap();
        assert_eq!(answer.status, Status::Limit(Limit::Time), "{name}");
        assert!(answer.verdict.measure.relative < 1.0, "{name} {:?}", answer.verdict.measure);
    }
}

#[test]
fn what_has_no_solution_is_proved_to_have_none() {
    let rows = |rows: &[&[f64]], rhs: &[f64]| {
        let entries = rows.iter().enumerate();
        let entries =
            entries.flat_map(|(i, row)| row.iter().enumerate().map(move |(j, a)| (i, j, *a)));
        let a = Csc::from_triplets(rows.len(), rows[0].len(), entries.filter(|e| e.2 != 0.0));
        Set::inequalities(a.unwrap(), rhs.to_vec())
    };
    let strip = || rows(&[&[0.1, -0.1], &[-0.3, 0.3], &[-1.0, -0.7]], &[1.0, 1.0, 5.0]);
    let empty = || rows(&[&[1.0, 1.0], &[-3.0, -3.0]], &[-1.0, 2.0]);
    let cone = || Set::SecondOrderCone { dimension: 3 };
    let product = || Set::Product(vec![cone(), Set::orthant(1)]);
    let cases: Vec<(&[&str], Set)> = vec![
        (&["-1", "0.3"], strip()),
        (&["x1 - x2 - 30", "x2 - x1 - 1"], strip()),
        (&["x1 - x2 - 30 - exp(x1)", "x2 - x1 + exp(x1)"], strip()),
        (&["x1 - 7", "x2"], empty()),
        (&["x1^3 - 7 - exp(x2)", "x2"], empty()),
        (&["-0.5 - x2^2", "x2", "x3"], cone()),
        (&["x1 + x2^2", "-2 - x1 - x2^2", "x3"], cone()),
        (&["-0.5 - x2^2 - x4", "x2", "x3", "x4 - 5"], product()),
    ];
    for (f, set) in cases {
        let start = vec![0.5; set.dim()];
        let problem = Vi::new(expressions(f.iter().map(ToString::to_string)), set, start).unwrap();
        let answer = Solve::new().time_limit(20.0).run(&problem).unwrap();
        let Status::Infeasible(proof) = &answer.status else {
            panic!("{f:?}: {} {:?}", answer.status, answer.account)
        };
        assert!(problem.verify(proof.certificate()), "{f:?}");
        let all = nonsmooth_problem::AnyProblem::from(problem);
        let known = nonsmooth_solve::existence::of(&all, &Limits::default());
        assert_eq!(known.name(), "no_solution", "{f:?}: {known}");
    }
}

/// Whole numbers, so that the planted solution is one exactly: nothing may refute it.
#[test]
fn what_has_a_solution_is_not_refuted() {
    let mut random = Pcg64::seed_from_u64(11);
    for trial in 0..60 {
        let n = 3;
        let mut whole = |from: i32, to: i32| random.random_range(from..=to);
        let x: Vec<i32> = (0..n).map(|_| whole(0, 2)).collect();
        let a: Vec<Vec<i32>> = (0..2).map(|_| (0..n).map(|_| whole(-2, 2)).collect()).collect();
        let tight = [whole(0, 1), whole(0, 1)];
        let lambda = [tight[0] * whole(0, 3), tight[1] * whole(0, 3)];
        let dot = |row: &[i32]| row.iter().zip(&x).map(|(a, x)| a * x).sum::<i32>();
        let b: Vec<f64> = (0..2).map(|k| f64::from(dot(&a[k]) + 1 - tight[k])).collect();
        // F(x) = −Aᵀλ there, in terms that are not linear: products, squares and cubes.
        let f: Vec<String> = (0..n)
            .map(|i| {
                let (p, q, r, s) = (whole(-2, 2), whole(-2, 2), whole(-1, 1), whole(-2, 2));
                let (j, k) = (whole(0, 2) as usize, whole(0, 2) as usize);
                let there = p * x[j] * x[k] + q * x[i] + r * x[i].pow(3) + s * x[j] * x[j];
                let force: i32 = (0..2).map(|k| lambda[k] * a[k][i]).sum();
                let terms = [(p, format!("x{}*x{}", j + 1, k + 1)), (q, format!("x{}", i + 1))];
                let more = [(r, format!("x{}^3", i + 1)), (s, format!("x{}^2", j + 1))];
                let sum: Vec<_> =
                    terms.iter().chain(&more).map(|(c, t)| format!("({c})*{t}")).collect();
                format!("{} + ({})", sum.join(" + "), -there - force)
            })
            .collect();
        let entries = (0..2).flat_map(|k| (0..n).map(move |j| (k, j)));
        let entries = entries.map(|(k, j)| (k, j, f64::from(a[k][j]))).filter(|e| e.2 != 0.0);
        let set = Set::inequalities(Csc::from_triplets(2, n, entries).unwrap(), b);
        let problem = Vi::new(expressions(f), set, vec![0.0; n]).unwrap();
        let point = LcpPoint { z: x.iter().map(|x| f64::from(*x)).collect() };
        assert!(problem.judge(&point, 1e-12).unwrap().solved, "{trial}");
        let limits = Limits { time_limit: Some(2.0), ..Limits::default() };
        let known = nonsmooth_solve::existence::of(&problem.into(), &limits);
        assert!(!known.name().contains("no_solution"), "{trial}: {known}");
    }
}

/// Random half-spaces around the origin, far more than variables, and a strongly monotone F that is not affine where `cubic` is not zero.
fn among_many_rows(n: usize, m: usize, cubic: f64, seed: u64) -> Vi {
    let mut random = Pcg64::seed_from_u64(seed);
    let mut number = |from: f64, to: f64| random.random_range(from..to);
    let entries: Vec<_> = (0..m * n).map(|k| (k / n, k % n, number(-1.0, 1.0))).collect();
    let b = (0..m).map(|_| number(0.2, 1.5)).collect();
    let f = (0..n).map(|i| {
        let (d, c, j) = (number(0.5, 2.0), number(-3.0, 3.0), (i + 1) % n);
        let turn = format!("0.3*x{} - 0.3*x{}", j + 1, (i + n - 1) % n + 1);
        let i = i + 1;
        format!("{d}*x{i} + {turn} + {cubic}*x{i}^3 + ({c})")
    });
    let f = expressions(f.collect::<Vec<_>>());
    let a = Csc::from_triplets(m, n, entries.into_iter()).unwrap();
    Vi::new(f, Set::inequalities(a, b), vec![0.0; n]).unwrap()
}

#[test]
fn of_many_dense_rows_those_that_matter_are_taken() {
    for (seed, cubic) in [(1, 0.0), (2, 0.0), (3, 0.1), (4, 1.0)] {
        let problem = among_many_rows(24, 400, cubic, seed);
        let answer = solve("auto", &problem, 1e-10);
        assert!(answer.is_solved(), "{seed}: {} {:?}", answer.status, answer.account);
        let said = &answer.account[0];
        assert!(said.starts_with("rows as they are needed"), "{seed}: {:?}", answer.account);
        let taken: usize = said.split(' ').find_map(|word| word.parse().ok()).unwrap();
        assert!((1..300).contains(&taken), "{said}");
        let all = solve("multipliers/auto", &problem, 1e-10);
        assert!(all.is_solved(), "{seed}: {}", all.status);
        close(&answer.point.z, &all.point.z, 1e-8, "rows");
    }
}

#[test]
fn rows_that_contradict_each_other_among_many_have_no_solution() {
    let problem = among_many_rows(20, 300, 0.1, 5);
    let Set::Polyhedron { A, b, C, d } = problem.set else { unreachable!() };
    // Row 299 once more, on the other side and beyond.
    let twice = A.triplets().map(|(i, j, a)| if i == 298 { (i, j, 0.0) } else { (i, j, a) });
    let opposite = A.triplets().filter(|e| e.0 == 299).map(|(_, j, a)| (298, j, -a));
    let rows = Csc::from_triplets(300, 20, twice.chain(opposite).filter(|e| e.2 != 0.0)).unwrap();
    let mut rhs = b;
    rhs[298] = -rhs[299] - 0.5;
    let set = Set::Polyhedron { A: rows, b: rhs, C, d };
    let empty = Vi { F: problem.F, set, start: problem.start };
    // Whether it is proved depends on how soon both rows are among those that matter; it is never called solved, and a proof is one of the whole problem.
    let answer = Solve::new().time_limit(3.0).run(&empty).unwrap();
    assert!(!answer.is_solved(), "{:?}", answer.account);
    if let Status::Infeasible(proof) = &answer.status {
        assert!(empty.verify(proof.certificate()));
    }
}

/// A start whose projection is the apex of a cone, where the logarithm is not defined, is moved inside.
#[test]
fn projections_begin_where_f_is_defined() {
    let f = || expressions(["log(x1) - 1", "x2 - 2", "x3 - 2"].map(String::from));
    for start in [[-1.0, 0.0, 0.0], [0.0; 3], [-100.0, 3.0, -4.0]] {
        let set = Set::SecondOrderCone { dimension: 3 };
        let problem = Vi::new(f(), set, start.to_vec()).unwrap();
        for name in ["auto", "extragradient", "hyperplane"] {
            let answer = solve(name, &problem, 1e-8);
            assert!(answer.is_solved(), "{name} {start:?}: {}", answer.status);
        }
    }
}
