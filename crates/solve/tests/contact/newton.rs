//! What every Newton method of the family does.

use nonsmooth_linalg::{Bsr, Csc};
use nonsmooth_problem::planted::{Planted, PlantedMix};
use nonsmooth_problem::{FrictionGlobal, FrictionLocal};
use nonsmooth_solve::registry::{self, Registered};
use nonsmooth_solve::settings::from_texts;
use nonsmooth_solve::{Limits, Outcome, Sample, Status};

const ALL: [&str; 9] = [
    "newton_ac",
    "newton_jm",
    "newton_nm",
    "newton_fb",
    "newton_fb_smooth",
    "newton_cm",
    "newton_xsw",
    "newton_pk",
    "newton_hsw",
];

fn planted(seed: u64) -> Planted {
    let mix = PlantedMix { open: 1.0, stick: 1.0, slip: 1.0, degenerate: 0.0 };
    Planted { contacts: 20, dofs: 120, mu: (0.1, 0.8), mix, seed, ..Planted::default() }
}

fn solve<P: Registered>(
    name: &str,
    settings: &[&str],
    problem: &P,
    tolerance: f64,
) -> (Outcome, Vec<Sample>) {
    let map = from_texts(settings).unwrap();
    let mut session = registry::session::<P>(name, &map).unwrap();
    let mut point = problem.origin();
    let limits = Limits { tolerance, max_iterations: 200, ..Limits::default() };
    let outcome = session.solve(problem, &mut point, &limits, &mut |_| {}).unwrap();
    (outcome, session.history().to_vec())
}

/// Solves to 1e-12 in few steps, the last of them superlinear.
fn converges_fast<P: Registered>(kind: &str, make: impl Fn(&Planted) -> P) {
    let mut failures = vec![];
    for name in ALL {
        for seed in 0..4 {
            let (outcome, history) = solve(name, &[], &make(&planted(seed)), 1e-12);
            let residuals: Vec<f64> = history.iter().map(|s| s.relative).collect();
            let shown: Vec<_> = residuals.iter().map(|e| format!("{e:.0e}")).collect();
            let superlinear = residuals.windows(2).any(|e| e[1] < 1e-4 * e[0] && e[0] < 1e-1);
            if outcome.status != Status::Solved || outcome.iterations > 60 || !superlinear {
                failures.push(format!(
                    "{kind} {name} seed {seed}: {} after {}, {shown:?}",
                    outcome.status, outcome.iterations
                ));
            }
        }
    }
    assert!(failures.is_empty(), "{}", failures.join("\n"));
}

#[test]
fn local_problems_of_full_rank_in_space() {
    converges_fast("local 3D", |case| case.local::<3>().0);
}

#[test]
fn local_problems_of_full_rank_in_the_plane() {
    converges_fast("local 2D", |case| case.local::<2>().0);
}

#[test]
fn global_problems_of_full_rank_in_space() {
    converges_fast("global 3D", |case| case.global::<3>().0);
}

#[test]
fn global_problems_of_full_rank_in_the_plane() {
    converges_fast("global 2D", |case| case.global::<2>().0);
}

/// Velocities times `a`, masses times `b`.
fn rescaled(problem: &FrictionLocal<3>, a: f64, b: f64) -> FrictionLocal<3> {
    let w = problem.W.to_csc();
    let triplets = w.triplets().map(|(i, j, x)| (i, j, x / b));
    let w = Csc::from_triplets(w.nrows(), w.ncols(), triplets).unwrap();
    let q = problem.q.iter().map(|q| a * q).collect();
    FrictionLocal::new(Bsr::from_csc(&w), q, problem.mu.clone()).unwrap()
}

#[test]
fn units_change_no_iteration() {
    let problem = planted(5).local::<3>().0;
    for name in ALL {
        for rule in ["rho_rule=fixed", "rho_rule=norm", "rho_rule=spectral"] {
            let count = |a: f64, b: f64| {
                let (outcome, _) = solve(name, &[rule], &rescaled(&problem, a, b), 1e-10);
                assert_eq!(outcome.status, Status::Solved, "{name} {rule} {a:e} {b:e}");
                outcome.iterations
            };
            let reference = count(1.0, 1.0);
            for (a, b) in [(1e6, 1.0), (1e-6, 1.0), (1.0, 1e6), (1.0, 1e-6), (1e-6, 1e6)] {
                assert_eq!(count(a, b), reference, "{name} {rule} {a:e} {b:e}");
            }
        }
    }
}

#[test]
fn a_mass_ratio_of_ten_thousand() {
    for seed in 0..3 {
        let (problem, point) = planted(seed).global::<3>();
        let n = problem.M.nrows();
        let heavier = |(i, j, x): (usize, usize, f64)| {
            // Whole bodies, six unknowns each.
            (i, j, if i / 6 % 2 == 0 { 1e4 * x } else { x })
        };
        let mass = Csc::from_triplets(n, n, problem.M.triplets().map(heavier)).unwrap();
        let mut f = vec![0.0; n];
        mass.mul_add(1.0, &point.v, &mut f);
        problem.H.mul_add(-1.0, &point.r, &mut f);
        let heavy: FrictionGlobal<3> = FrictionGlobal { M: mass, f, ..problem };
        for name in ALL {
            let (outcome, history) = solve(name, &[], &heavy, 1e-10);
            assert_eq!(outcome.status, Status::Solved, "{name} seed {seed}: {history:?}");
        }
    }
}

#[test]
fn without_rescues_a_failure_is_said_at_once() {
    // Ten times as many contact unknowns as degrees of freedom, from zero: Newton's matrix is singular wherever much sticks.
    let case = Planted { contacts: 60, dofs: 18, seed: 2, ..planted(2) };
    for name in ALL {
        let settings = ["rescue=0", "warm_up=0"];
        let (outcome, _) = solve(name, &settings, &case.local::<3>().0, 1e-12);
        match outcome.status {
            Status::Solved | Status::Limit(_) => {}
            Status::Stalled(why) => assert!(why.contains("stuck"), "{name}: {why}"),
            other => panic!("{name}: {other}"),
        }
    }
}
