//! Problems whose parts differ by many orders of magnitude: what is small is solved too or not called solved, and what double precision
//! cannot hold ends soon, with a status that says so.

use nonsmooth_linalg::{Bsr, Csc};
use nonsmooth_problem::check::Judged;
use nonsmooth_problem::{FrictionGlobal, FrictionLocal, Problem, RowsLocal};
use nonsmooth_solve::registry::{self, Registered, Solves};
use nonsmooth_solve::{Limits, Outcome, Status};

fn solve<P: Registered + Judged>(problem: &P, solver: &str, limits: &Limits) -> Outcome {
    let mut session = registry::session::<P>(solver, &Default::default()).unwrap();
    let mut point = problem.origin();
    let outcome = session.solve(problem, &mut point, limits, &mut |_| {}).unwrap();
    let verdict = problem.judge(&point, limits.tolerance).unwrap();
    assert_eq!(outcome.status == Status::Solved, verdict.solved, "{solver}: {}", outcome.status);
    outcome
}

fn every<P: Registered + Judged>(problem: &P) -> Vec<(String, Status)> {
    let limits = Limits { max_iterations: 5_000, ..Limits::default() };
    let of_the_law = |name: &String| registry::solves::<P>(name) == Some(Solves::Law);
    let names = registry::solver_names::<P>().into_iter().filter(of_the_law);
    names.map(|name| (name.clone(), solve(problem, &name, &limits).status)).collect()
}

/// Two contacts that nothing couples: the first has a solution, the second has W = 0 and approaches.
#[test]
fn a_small_contact_without_solution_is_never_solved() {
    let block = [[1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]];
    for size in [1e-9, 1e-20, 1e-100] {
        let w = Bsr::from_rows(2, &[vec![(0, block)], vec![(1, [[0.0; 3]; 3])]]);
        let q = vec![-1.0, 0.2, 0.0, -size, 0.0, 0.0];
        let problem = FrictionLocal::new(w, q, vec![0.5; 2]).unwrap();
        for (name, status) in every(&problem) {
            assert_ne!(status, Status::Solved, "{name}, {size:e}");
        }
    }
}

#[test]
fn a_small_contact_with_a_solution_is_solved() {
    let diagonal = |x: f64| [[x, 0.0, 0.0], [0.0, x, 0.0], [0.0, 0.0, x]];
    for size in [1e-9, 1e-20] {
        let w = Bsr::from_rows(2, &[vec![(0, diagonal(1.0))], vec![(1, diagonal(size * size))]]);
        let q = vec![-1.0, 0.2, 0.0, -size, 0.4 * size, 0.3 * size];
        let problem = FrictionLocal::new(w, q, vec![0.5; 2]).unwrap();
        for solver in ["auto", "nsgs"] {
            let outcome = solve(&problem, solver, &Limits::default());
            assert_eq!(outcome.status, Status::Solved, "{solver}, {size:e}");
            assert!(outcome.measure.own.unwrap() <= 1e-4);
        }
    }
}

/// Multipliers of 1e10 that cancel the velocities of impulses: rounded before they are added, they hide an approach of 1e-5.
#[test]
fn multipliers_that_cancel_impulses_deceive_nobody() {
    for big in [1e6, 1e10, 1e14] {
        let w = Csc::from_triplets(2, 2, [(0, 0, 1.0), (1, 1, 1.0)].into_iter()).unwrap();
        let column = [(0, 0, 1.0), (1, 0, 0.37)];
        // What is left of W is 1/big in the direction of V.
        let own = [(0, 0, (1.0 + 0.37 * 0.37) * (1.0 + 1.0 / big))];
        let bilateral = RowsLocal::bilateral(
            Csc::from_triplets(2, 1, column.into_iter()).unwrap(),
            Csc::from_triplets(1, 1, own.into_iter()).unwrap(),
            vec![0.3],
        );
        let problem = FrictionLocal::<2>::with_rows(
            Bsr::from_csc(&w),
            vec![-1.3, 0.77],
            vec![1.0],
            bilateral,
        )
        .unwrap();
        // `solve` compares each status with the judge.
        let statuses = every(&problem);
        let auto = statuses.iter().find(|(name, _)| name == "auto").unwrap();
        // Beyond, the multipliers' rounding alone makes more than the tolerance.
        assert!(big > 1e8 || auto.1 == Status::Solved, "{big:e}: {}", auto.1);
    }
}

/// A tower of bodies with two degrees of freedom, each `ratio` times heavier than the one below it, pushed aside a little.
fn tower(levels: usize, ratio: f64) -> FrictionGlobal<2> {
    let mass: Vec<f64> = (0..levels).flat_map(|k| [ratio.powi(k as i32); 2]).collect();
    let (mut h, mut f) = (vec![], vec![]);
    for k in 0..levels {
        // Along y and along x, against the body below.
        for (row, column) in [(2 * k + 1, 2 * k), (2 * k, 2 * k + 1)] {
            h.push((row, column, 1.0));
            if k > 0 {
                h.push((row - 2, column, -1.0));
            }
        }
        f.extend([0.0123 * mass[2 * k] / (k + 1) as f64, -0.0981 * mass[2 * k]]);
    }
    let h = Csc::from_triplets(2 * levels, 2 * levels, h.into_iter()).unwrap();
    let w = vec![0.0; 2 * levels];
    FrictionGlobal::new(Csc::diagonal(&mass), h, f, w, vec![0.6; levels]).unwrap()
}

#[test]
fn heavy_on_light_is_solved_or_ends_at_the_floor_soon() {
    for (levels, ratio) in [(4, 10.0), (8, 6.0), (10, 4.0), (6, 16.0), (7, 30.0)] {
        let problem = tower(levels, ratio);
        let limits = Limits { tolerance: 1e-12, ..Limits::default() };
        let outcome = solve(&problem, "auto", &limits);
        let floor = outcome.measure.floor.unwrap();
        assert!(outcome.iterations < 10_000, "{levels} {ratio}: {outcome:?}");
        match outcome.status {
            Status::Solved => {}
            Status::Stalled(why) => {
                assert!(why.contains("the rounding of the unknowns"), "{levels} {ratio}: {why}");
                assert!(floor > 1e-12, "{levels} {ratio}: {floor:e}");
            }
            other => panic!("{levels} {ratio}: {other}"),
        }
        // What is within reach is reached.
        if ratio > 20.0 {
            continue;
        }
        let limits = Limits { tolerance: (30.0 * floor).max(1e-12), ..limits };
        assert_eq!(solve(&problem, "auto", &limits).status, Status::Solved, "{levels} {ratio}");
    }
}

#[test]
fn a_solver_without_newton_ends_at_the_floor_too() {
    let problem = tower(7, 30.0);
    let limits = Limits { tolerance: 1e-15, max_iterations: 200_000, ..Limits::default() };
    let mut point = problem.origin();
    let mut session = registry::session::<FrictionGlobal<2>>("auto", &Default::default()).unwrap();
    session
        .solve(&problem, &mut point, &Limits { tolerance: 1e-9, ..Limits::default() }, &mut |_| {})
        .unwrap();
    // From near the solution.
    let mut session = registry::session::<FrictionGlobal<2>>("nsgs", &Default::default()).unwrap();
    let outcome = session.solve(&problem, &mut point, &limits, &mut |_| {}).unwrap();
    assert!(outcome.iterations < 100_000, "{outcome:?}");
    assert_ne!(outcome.status, Status::Solved);
}
