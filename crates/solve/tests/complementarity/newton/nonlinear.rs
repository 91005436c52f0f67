//! Newton's methods on the functions of the lecture, for nonlinear problems: the linearisation against differences, solutions against planted ones and another method.

use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};

use nonsmooth_problem::field::{Differences, Expressions, is_tentative};
use nonsmooth_problem::planted::{HarkerPang, NashCournot};
use nonsmooth_problem::{LcpPoint, Mcp};
use nonsmooth_solve::Solve;
use nonsmooth_solve::complementarity::functions::{
    EvtushenkoPurtov, FischerBurmeister, Min, MinRho, Penalised, ScalarFunction, Side, boxed,
};

const METHODS: [(&str, &str, &str); 8] = [
    ("newton_min", "", ""),
    ("newton_min_rho", "", ""),
    ("newton_min_rho", "side", "w"),
    ("newton_fb", "", ""),
    ("newton_pfb", "", ""),
    ("newton_ep", "", ""),
    ("newton_ep", "line_search", "armijo"),
    ("newton_min_rho", "line_search", "armijo"),
];

/// One variable of each sort of bounds: below, above, both, none, fixed. F is monotone, smooth and of every row.
fn of_all_bounds() -> Mcp {
    let rows = [
        "x1 + exp(x1)/4 - x2 + x4 - 1",
        "x2 + x1 + x2^3/3 - x3 + 1",
        "2*x3 + x2 - x5 + atan(x3) + 2",
        "x4 - x1 + x5 + x4^3 - 1",
        "x5 + x3 - x4",
    ];
    let rows: Vec<String> = rows.iter().map(|row| (*row).to_owned()).collect();
    let inf = f64::INFINITY;
    let f = Expressions::parse(&rows, &[]).unwrap();
    let (lower, upper) = (vec![0.0, -inf, -0.25, -inf, 0.5], vec![inf, 1.0, 0.75, inf, 0.5]);
    Mcp::new(f, lower, upper, vec![0.3, 0.2, 0.1, -0.4, 0.5]).unwrap()
}

/// `B = diag(∂Φ/∂x) + diag(∂Φ/∂F) JF` is the Jacobian of `x ↦ Φ(x, F(x))` wherever it has one.
fn linearisation_agrees<S: ScalarFunction>(name: &str, function: &S) {
    let problem = of_all_bounds();
    let n = problem.dim();
    let mut run = problem.F.evaluator();
    let pattern = problem.F.pattern().clone();
    let (mut f, mut values) = (vec![0.0; n], vec![0.0; pattern.len()]);
    let h = 1e-6;
    let mut compared = 0;
    for k in 0..60 {
        let spread = |i: usize| ((k * n + i) as f64 * 0.618_033_988_75 + 0.123).fract();
        let x: Vec<f64> = (0..n).map(|i| 3.0 * spread(i) - 1.5).collect();
        let mut phi = |x: &[f64]| -> Vec<f64> {
            let mut f = vec![0.0; n];
            assert!(run.value(x, &mut f));
            let of = |i| boxed(function, x[i], f[i], problem.lower[i], problem.upper[i]).value;
            (0..n).map(of).collect()
        };
        for j in 0..n {
            let step = |t: f64| {
                let mut y = x.clone();
                y[j] += t;
                y
            };
            let [left, here, right] = [phi(&step(-h)), phi(&x), phi(&step(h))];
            let mut exact = problem.F.evaluator();
            assert!(exact.jacobian(&x, &mut f, &mut values));
            for i in 0..n {
                let slope = boxed(function, x[i], f[i], problem.lower[i], problem.upper[i]);
                let place = pattern.row(i).iter().position(|&column| column == j);
                let of_f = place.map_or(0.0, |at| values[pattern.range(i)][at]);
                let stated = slope.w * of_f + if i == j { slope.z } else { 0.0 };
                let (before, after) = ((here[i] - left[i]) / h, (right[i] - here[i]) / h);
                // Where the two sides differ there is a kink.
                if (before - after).abs() < 1e-4 {
                    let difference = 0.5 * (before + after);
                    let size = 1.0 + stated.abs();
                    assert!(
                        (stated - difference).abs() < 1e-4 * size,
                        "{name}: row {i}, column {j} at {x:?}: {stated}, {difference}"
                    );
                    compared += 1;
                }
            }
        }
    }
    assert!(compared > 1200, "{name}: {compared}");
}

#[test]
fn linearisations_agree_with_differences() {
    linearisation_agrees("min", &Min {});
    linearisation_agrees("min(w, 3z)", &MinRho { rho: 3.0, side: Side::Z });
    linearisation_agrees("min(z, 3w)", &MinRho { rho: 3.0, side: Side::W });
    linearisation_agrees("fischer_burmeister", &FischerBurmeister {});
    linearisation_agrees("penalised", &Penalised { lambda: 0.8 });
    linearisation_agrees("evtushenko_purtov", &EvtushenkoPurtov {});
}

fn check(problem: &Mcp, known: &LcpPoint, name: &str, what: &str) {
    let other = Solve::new().solver("path").tolerance(1e-10).run(problem).unwrap();
    assert!(other.is_solved(), "path {what}");
    for (solver, key, value) in METHODS {
        let how = Solve::new().solver(solver).tolerance(1e-10).max_iterations(2000);
        let how = if key.is_empty() { how } else { how.set(key, value) };
        let answer = how.run(problem).unwrap();
        assert!(answer.is_solved(), "{solver} {key}={value} {what}: {}", answer.status);
        for (i, x) in answer.point.z.iter().enumerate() {
            for (source, y) in [(name, known.z[i]), ("path", other.point.z[i])] {
                assert!(
                    (x - y).abs() <= 1e-6 * (1.0 + y.abs()),
                    "{solver} {what}: [{i}] {x}, {source} {y}"
                );
            }
        }
    }
}

#[test]
fn all_functions_lead_to_the_solution() {
    for seed in 0..3 {
        let (problem, known) = HarkerPang { n: 12, seed, ..HarkerPang::default() }.mcp();
        check(&problem, &known, "planted", &format!("harker_pang {seed}"));
    }
    let (problem, known) = NashCournot::default().mcp();
    check(&problem, &known, "planted", "nash_cournot");
    let problem = of_all_bounds();
    let known = Solve::new().tolerance(1e-12).run(&problem).unwrap();
    assert!(known.is_solved());
    check(&problem, &known.point, "auto", "all bounds");
}

#[test]
fn rho_is_positive() {
    let refused = Solve::new().solver("newton_min_rho").set("rho", 0.0).run(&of_all_bounds());
    let said = refused.unwrap_err().to_string();
    assert!(said.contains("rho: expected a positive number, found 0"), "{said}");
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
        // From 4 Newton's step leads to −3.6.
        f[0] = if x[0] < 0.0 { f64::NAN } else { 4.0 * x[0].sqrt() - 0.4 };
    };
    let field = Differences::probed(&[4.0], root).unwrap();
    let inf = f64::INFINITY;
    let problem = Mcp::new(field, vec![-inf], vec![inf], vec![4.0]).unwrap();
    let others = ["auto", "path", "semismooth", "miles"];
    for name in METHODS.iter().map(|m| m.0).chain(others) {
        let answer = Solve::new().solver(name).run(&problem).unwrap();
        assert!(answer.is_solved(), "{name}: {}", answer.status);
        assert!((answer.point.z[0] - 0.01).abs() < 1e-6, "{name}: {:?}", answer.point.z);
        assert!(!loud.load(Ordering::Relaxed), "{name}");
    }
}
