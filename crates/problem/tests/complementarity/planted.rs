//! Planted linear problems: the judge accepts what was planted, and only that; the matrices are of the class they are said to be.

use nonsmooth_linalg::Matrix;
use nonsmooth_problem::check::{Certificate, Evidence, Judged};
use nonsmooth_problem::planted::{PlantedBlocks, PlantedClass, PlantedLcp, PlantedMlcp};
use nonsmooth_problem::{LcpPoint, Problem};

const TOLERANCE: f64 = 1e-13;

fn cases() -> impl Iterator<Item = PlantedLcp> {
    PlantedClass::ALL.into_iter().flat_map(|class| {
        (0..18).map(move |seed| PlantedLcp {
            n: [2, 3, 7, 24, 60, 200][seed as usize % 6],
            class,
            density: if seed % 2 == 0 { 1.0 } else { 0.05 },
            degenerate: [0.0, 0.1, 0.5][seed as usize % 3],
            decades: if seed >= 12 { 6.0 } else { 0.0 },
            seed,
            ..PlantedLcp::default()
        })
    })
}

#[test]
fn the_judge_accepts_what_was_planted_and_refuses_what_is_near() {
    for case in cases() {
        let (problem, point) = case.lcp();
        let verdict = problem.judge(&point, TOLERANCE).unwrap();
        assert!(verdict.solved, "{case:?}: {:?}", verdict.measure);
        assert_eq!(matches!(problem.M, Matrix::Dense(_)), case.density >= 1.0);
        for i in (0..problem.dim()).step_by(7) {
            let mut wrong = point.clone();
            wrong.z[i] = if wrong.z[i] == 0.0 { -1e-4 } else { -wrong.z[i] };
            let size = problem.M.diagonal().unwrap()[i].abs();
            if case.decades == 0.0 && size > 0.0 {
                assert!(!problem.judge(&wrong, 1e-8).unwrap().solved, "{case:?} {i}");
            }
        }
    }
}

#[test]
fn boxes_and_horizontal_problems_are_solved_too() {
    for case in cases() {
        let (problem, point) = case.boxed();
        let verdict = problem.judge(&point, TOLERANCE).unwrap();
        assert!(verdict.solved, "{case:?}: {:?}", verdict.measure);
        let (problem, point) = case.hlcp();
        let verdict = problem.judge(&point, TOLERANCE).unwrap();
        assert!(verdict.solved, "{case:?}: {:?}", verdict.measure);
    }
}

#[test]
fn mixed_problems_are_solved_too() {
    for blocks in PlantedBlocks::ALL {
        for seed in 0..24 {
            let case = PlantedMlcp {
                free: [1, 2, 9, 40][seed as usize % 4],
                pairs: [1, 3, 12, 50][seed as usize / 4 % 4],
                blocks,
                redundant: seed as usize % 3,
                density: if seed % 2 == 0 { 1.0 } else { 0.1 },
                degenerate: if seed % 5 == 0 { 0.3 } else { 0.0 },
                seed,
            };
            let (problem, point) = case.mlcp();
            assert_eq!((problem.free, problem.pairs()), (case.free, case.pairs));
            assert_eq!(problem.equalities, case.free + case.redundant);
            let verdict = problem.judge(&point, TOLERANCE).unwrap();
            assert!(verdict.solved, "{case:?}: {:?}", verdict.measure);
            let mut wrong = point.clone();
            wrong.z[case.free] = -1.0;
            assert!(!problem.judge(&wrong, 1e-6).unwrap().solved, "{case:?}");
        }
    }
}

#[test]
fn infeasible_problems_come_with_a_proof() {
    for case in cases() {
        let Some((problem, proof)) = case.infeasible() else {
            use PlantedClass::*;
            assert!(!matches!(case.class, Psd | Kkt | CopositivePlus));
            continue;
        };
        assert!(matches!(problem.evidence(&proof), Evidence::Proved(_)), "{case:?}");
        let Certificate::Farkas { y } = &proof else { panic!("another proof") };
        // The opposite vector proves nothing, and neither does the proof of a problem that has a solution.
        assert!(!problem.verify(&Certificate::Farkas { y: y.iter().map(|y| -y).collect() }));
        let (solvable, _) = case.lcp();
        if solvable.dim() == y.len() {
            assert!(!solvable.verify(&proof), "{case:?}");
        }
    }
}

#[test]
fn degeneracy_is_as_asked_for() {
    let case = PlantedLcp { n: 400, degenerate: 0.25, density: 0.02, ..PlantedLcp::default() };
    let (problem, point) = case.lcp();
    let counts = problem.judge(&point, 1e-10).unwrap().counts;
    assert!((60..140).contains(&counts.degenerate), "{counts:?}");
    assert!((100..200).contains(&counts.inside), "{counts:?}");
    let none = PlantedLcp { degenerate: 0.0, ..case };
    let (problem, point) = none.lcp();
    assert_eq!(problem.judge(&point, 1e-10).unwrap().counts.degenerate, 0);
}

#[test]
fn a_seed_is_a_problem() {
    for class in PlantedClass::ALL {
        let case = PlantedLcp { class, n: 12, seed: 5, ..PlantedLcp::default() };
        assert_eq!(case.lcp(), case.lcp());
        assert_ne!(case.lcp().0, PlantedLcp { seed: 6, ..case }.lcp().0);
    }
}

#[test]
fn large_sparse_problems_take_no_time() {
    for class in PlantedClass::ALL.into_iter().filter(|c| *c != PlantedClass::Bimatrix) {
        let case = PlantedLcp { class, n: 30_000, density: 2e-4, ..PlantedLcp::default() };
        let (problem, point) = case.lcp();
        let nnz = problem.M.nnz().unwrap();
        assert!((60_000..3_000_000).contains(&nnz), "{class:?}: {nnz}");
        assert!(problem.judge(&point, TOLERANCE).unwrap().solved, "{class:?}");
    }
    let origin = LcpPoint { z: vec![0.0; 2] };
    let (problem, _) = PlantedLcp { n: 2, seed: 3, active: 1.0, ..PlantedLcp::default() }.lcp();
    assert!(!problem.judge(&origin, 1e-6).unwrap().solved);
}
