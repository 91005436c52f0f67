//! The interior point method on the exact law.

use nonsmooth_linalg::{Bsr, Csc};
use nonsmooth_problem::FrictionLocal;
use nonsmooth_problem::planted::{Planted, PlantedMix};
use nonsmooth_solve::registry::{self, Registered};
use nonsmooth_solve::settings::from_texts;
use nonsmooth_solve::{Limits, Outcome};

fn solved<P: Registered>(problem: &P, settings: &[&str], tolerance: f64) -> Outcome {
    let settings = from_texts(settings).unwrap();
    let mut session = registry::session::<P>("ip", &settings).unwrap();
    let limits = Limits { tolerance, max_iterations: 500, ..Limits::default() };
    session.solve(problem, &mut problem.origin(), &limits, &mut |_| {}).unwrap()
}

#[test]
fn planted_problems_of_all_kinds_are_solved_to_1e_12() {
    let all = PlantedMix { open: 1.0, stick: 1.0, slip: 1.0, degenerate: 0.0 };
    let base = Planted { mix: all, dofs: 120, ..Planted::default() };
    for case in [
        base.clone(),
        Planted { seed: 1, mu: (0.0, 0.6), ..base.clone() },
        Planted { seed: 2, mu: (0.0, 0.0), ..base.clone() },
        Planted { seed: 3, skew: 0.02, ..base.clone() },
        Planted { seed: 4, bilateral: 6, ..base.clone() },
        // Hyperstatic.
        Planted { seed: 5, contacts: 30, dofs: 48, ..base },
    ] {
        let outcomes = [
            solved(&case.local::<3>().0, &[], 1e-12),
            solved(&case.local::<2>().0, &[], 1e-12),
            solved(&case.global::<3>().0, &[], 1e-12),
            solved(&case.global::<2>().0, &[], 1e-12),
        ];
        for outcome in outcomes {
            assert!(outcome.measure.relative <= 1e-12, "{case:?}: {outcome:?}");
            assert!(outcome.iterations <= 60, "{case:?}: {outcome:?}");
        }
    }
}

#[test]
fn units_do_not_matter() {
    let (problem, _) = Planted { dofs: 120, ..Planted::default() }.local::<3>();
    let first = solved(&problem, &[], 1e-9);
    let w = problem.W.to_csc();
    for (mass, speed) in [(1e6, 1.0), (1e-6, 1.0), (1.0, 1e6), (1e-6, 1e-6)] {
        let entries = w.triplets().map(|(i, j, x)| (i, j, x / mass));
        let w = Csc::from_triplets(w.nrows(), w.ncols(), entries).unwrap();
        let q = problem.q.iter().map(|q| speed * q).collect();
        let other = FrictionLocal::<3>::new(Bsr::from_csc(&w), q, problem.mu.clone()).unwrap();
        let outcome = solved(&other, &[], 1e-9);
        assert_eq!(outcome.iterations, first.iterations, "mass × {mass:e}, q × {speed:e}");
        assert!(outcome.measure.relative <= 1e-9);
    }
}

#[test]
fn a_problem_without_a_solution_ends_as_stuck() {
    // A wedge that cannot give way: two walls press on a body without mass, W = 0.
    let w = Bsr::from_csc(&Csc::from_triplets(6, 6, std::iter::empty()).unwrap());
    let q = vec![-1.0, 0.0, 0.0, -1.0, 0.0, 0.0];
    let problem = FrictionLocal::<3>::new(w, q, vec![0.3, 0.3]).unwrap();
    for settings in [&[][..], &["path=continuation"]] {
        let outcome = solved(&problem, settings, 1e-8);
        assert!(matches!(outcome.status, nonsmooth_solve::Status::Stalled(_)), "{outcome:?}");
    }
}
