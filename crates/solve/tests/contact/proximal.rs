//! The proximal point method.

use nonsmooth_linalg::{Bsr, Csc};
use nonsmooth_problem::planted::Planted;
use nonsmooth_problem::{FrictionLocal, Problem};
use nonsmooth_solve::registry;
use nonsmooth_solve::settings::from_texts;
use nonsmooth_solve::{Limits, Session, Status};

fn session(name: &str, texts: &[&str]) -> Box<dyn Session<FrictionLocal<3>>> {
    registry::session(name, &from_texts(texts).unwrap()).unwrap()
}

/// One pressed contact, `W = 2 I`, `q = (−2, 0, 0)`, α = 1, r_0 = 0: `(2 + 2) r − 2 = 0`, r_1 = 1/2;
/// `2 r − 2 + 2 (r − 1/2) = 0`, r_2 = 3/4.
#[test]
fn outer_steps_by_hand() {
    let w = Bsr::from_csc(&Csc::diagonal(&[2.0; 3]));
    let problem = FrictionLocal::<3>::new(w, vec![-2.0, 0.0, 0.0], vec![0.5]).unwrap();
    let mut solver = session("proximal/nsgs", &["prox_rule=fixed", "check_every=1"]);
    for (steps, expected) in [(1, 0.5), (2, 0.75), (3, 0.875)] {
        let mut point = problem.origin();
        let limits = Limits { tolerance: 1e-14, max_iterations: steps, ..Limits::default() };
        solver.solve(&problem, &mut point, &limits, &mut |_| {}).unwrap();
        assert!((point.r[0] - expected).abs() < 1e-14, "{:?}", point.r);
    }
}

#[test]
fn every_rule_on_a_hyperstatic_problem() {
    let planted = Planted { contacts: 20, dofs: 36, seed: 4, ..Planted::default() };
    let (problem, _) = planted.local::<3>();
    for rule in ["fixed", "residual", "success"] {
        let rule = format!("prox_rule={rule}");
        let mut solver = session("proximal/nsgs", &[&rule, "prox_alpha=0.01"]);
        let mut point = problem.origin();
        let limits = Limits { tolerance: 1e-8, max_iterations: 100_000, ..Limits::default() };
        let outcome = solver.solve(&problem, &mut point, &limits, &mut |_| {}).unwrap();
        assert_eq!(outcome.status, Status::Solved, "{rule} {:e}", outcome.measure.relative);
    }
}

#[test]
fn settings_are_told_apart() {
    let make = |texts: &[&str]| {
        registry::session::<FrictionLocal<3>>("proximal/nsgs", &from_texts(texts).unwrap())
            .err()
            .map(|e| e.to_string())
    };
    assert_eq!(make(&["prox_alpha=0.5", "omega=0.9"]), None);
    assert!(make(&["prox_alpha=-1"]).unwrap().contains("prox_alpha: expected a positive"));
    assert!(make(&["prox_alfa=1"]).unwrap().contains("unknown key `prox_alfa`"));
    assert!(make(&["omega=3"]).unwrap().contains("omega: expected"));
}
