//! The methods through convex optimisation: their fixed points are those of Gauss–Seidel, whatever solves the convex problems.

use nonsmooth_problem::planted::{Planted, PlantedMix};
use nonsmooth_problem::{FrictionLocal, Problem};
use nonsmooth_solve::contact::form::{Access, Linear};
use nonsmooth_solve::registry::{self, Registered};
use nonsmooth_solve::{Limits, Outcome, Status, settings};

/// Every solver of this family, with its default settings and every variant.
fn runs<P: Registered>() -> Vec<(&'static str, Vec<&'static str>)> {
    let mut all = vec![];
    for about in registry::abouts::<P>() {
        if about.family == "optimisation" {
            all.push((about.name, vec![]));
            all.extend(about.variants.iter().map(|v| (about.name, vec![*v])));
        }
    }
    all
}

fn solve<P: Registered + Linear<D>, const D: usize>(
    problem: &P,
    name: &str,
    texts: &[&str],
    limits: &Limits,
) -> (Outcome, Vec<f64>) {
    let settings = settings::from_texts(texts).unwrap();
    let mut session = registry::session::<P>(name, &settings).unwrap();
    let mut point = problem.origin();
    let outcome = session.solve(problem, &mut point, limits, &mut |_| {}).unwrap();
    let mut state = problem.state(Access::Products).unwrap();
    let r = P::impulses(&mut point).to_vec();
    let mut u = vec![0.0; r.len()];
    problem.velocities(&mut state, &r, &mut u);
    (outcome, u)
}

/// W of full rank: u and r are unique there, near enough, and all methods must agree on u.
fn cases() -> Vec<Planted> {
    let base = Planted {
        contacts: 10,
        dofs: 60,
        mu: (0.0, 0.5),
        mix: PlantedMix { open: 1.0, stick: 1.0, slip: 1.0, degenerate: 0.0 },
        ..Planted::default()
    };
    vec![
        Planted { seed: 1, ..base.clone() },
        Planted { seed: 2, mu: (0.0, 0.0), ..base.clone() },
        Planted { seed: 3, skew: 0.01, ..base.clone() },
        Planted { seed: 4, dofs: 70, bilateral: 4, ..base.clone() },
        Planted { seed: 5, contacts: 1, dofs: 6, ..base },
    ]
}

fn agree<P: Registered + Linear<D>, const D: usize>(make: impl Fn(&Planted) -> P) {
    let limits = Limits { tolerance: 1e-10, max_iterations: 20_000, ..Limits::default() };
    let mut wrong = vec![];
    for case in cases() {
        let problem = make(&case);
        let (outcome, expected) = solve::<P, D>(&problem, "nsgs", &[], &limits);
        assert_eq!(outcome.status, Status::Solved, "nsgs {case:?}");
        let size = expected.iter().fold(0.0_f64, |a, u| a.max(u.abs()));
        for (name, texts) in runs::<P>() {
            let (outcome, u) = solve::<P, D>(&problem, name, &texts, &limits);
            let off = u.iter().zip(&expected).fold(0.0_f64, |a, (x, y)| a.max((x - y).abs()));
            if outcome.status != Status::Solved || off > 1e-8 * size.max(1.0) {
                wrong.push(format!(
                    "{name} {texts:?} seed {}: {} after {}, residual {:.1e}, u off by {off:.1e}",
                    case.seed, outcome.status, outcome.iterations, outcome.measure.relative
                ));
            }
        }
    }
    assert!(wrong.is_empty(), "\n{}", wrong.join("\n"));
}

/// What is refilled is scaled and rounded as what is new.
#[test]
fn a_session_solves_the_same_problem_to_the_same_bits() {
    for (name, texts) in [("cadoux", ["inner=clarabel"]), ("tresca", ["inner=conic"])] {
        for seed in 0..4 {
            let case = Planted { contacts: 2, dofs: 6, seed, ..Planted::default() };
            let (problem, _) = case.local::<3>();
            let settings = settings::from_texts(&texts).unwrap();
            let mut session = registry::session::<FrictionLocal<3>>(name, &settings).unwrap();
            let limits = Limits { max_iterations: 200, ..Limits::default() };
            let mut again = || {
                let mut point = problem.origin();
                let done = session.solve(&problem, &mut point, &limits, &mut |_| {}).unwrap();
                (done.iterations, point.r.iter().map(|r| r.to_bits()).collect::<Vec<_>>())
            };
            assert_eq!(again(), again(), "{name} {seed}");
        }
    }
}

#[test]
fn all_agree_with_gauss_seidel_on_local_problems() {
    agree::<_, 3>(|case| case.local::<3>().0);
    agree::<_, 2>(|case| case.local::<2>().0);
}

#[test]
fn all_agree_with_gauss_seidel_on_global_problems() {
    agree::<_, 3>(|case| case.global::<3>().0);
    agree::<_, 2>(|case| case.global::<2>().0);
}
