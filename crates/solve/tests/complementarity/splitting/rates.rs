//! What `psor` does by the rate that it measures, how few steps multigrid takes, and what `auto` makes of both.

use nonsmooth_linalg::Csc;
use nonsmooth_problem::planted::{Membrane, PlantedClass, PlantedLcp};
use nonsmooth_problem::{Lcp, Problem};
use nonsmooth_solve::{Solve, Status};

use super::{bump, distance, limits, session, solved, try_solve};

/// Convection and diffusion on `side × side` points above an obstacle, upwind: an M-matrix that is not symmetric.
fn transport(side: usize, diffusion: f64) -> Lcp {
    let h = 1.0 / (side + 1) as f64;
    let (d, [bx, by]) = (diffusion / (h * h), [1.0 / h, 0.5 / h]);
    let mut entries = vec![];
    let mut q = vec![];
    for i in 0..side {
        for j in 0..side {
            let row = i * side + j;
            entries.push((row, row, 4.0 * d + bx + by));
            let mut next = |inside: bool, column: usize, x: f64| {
                if inside {
                    entries.push((row, column, x));
                }
            };
            next(i > 0, row.wrapping_sub(side), -d - bx);
            next(i + 1 < side, row + side, -d);
            next(j > 0, row.wrapping_sub(1), -d - by);
            next(j + 1 < side, row + 1, -d);
            let (x, y) = ((i + 1) as f64 * h, (j + 1) as f64 * h);
            q.push(-5.0 * (6.0 * x).sin() * (5.0 * y).cos() - 0.5);
        }
    }
    let n = side * side;
    Lcp::new(Csc::from_triplets(n, n, entries.into_iter()).unwrap(), q).unwrap()
}

#[test]
fn over_relaxation_that_makes_moves_grow_is_taken_back() {
    let problem = transport(100, 1e-2);
    // With the ω that Young's relation suggests for symmetric matrices the iterates go nowhere.
    let fixed = try_solve(&problem, "psor omega=1.9 adapt=false", &limits(1e-8, 3000)).unwrap().0;
    assert!(matches!(fixed.status, Status::Limit(_)), "{fixed:?}");
    let found = try_solve(&problem, "psor", &limits(1e-8, 3000)).unwrap().0;
    assert_eq!(found.status, Status::Solved, "{found:?}");
}

#[test]
fn a_poor_rate_ends_sweeps_that_have_a_patience() {
    let problem = Membrane { load: -1.0, ..Membrane::square(60) }.above(bump);
    let (_, sweeps) = solved(&problem, "psor omega=1 adapt=false");
    assert!(sweeps > 500, "{sweeps}");
    let label = "psor omega=1 adapt=false patience=100";
    let outcome = try_solve(&problem, label, &limits(1e-10, 10_000)).unwrap().0;
    assert!(outcome.iterations < 100, "{outcome:?}");
    assert!(matches!(&outcome.status, Status::Stalled(why) if why.contains("patience")));
    // Over-relaxation keeps what the patience asks for.
    let (_, sweeps) = solved(&problem, "psor patience=1000");
    assert!(sweeps < 1000, "{sweeps}");
}

#[test]
fn little_patience_ends_sweeps_early() {
    // Sweeps converge on positive semidefinite matrices, but slowly; on those of H+ a dozen is enough.
    let limits = limits(1e-10, 10_000);
    let label = "psor omega=1 adapt=false patience=30";
    let outcome = try_solve(&planted(100, PlantedClass::Psd), label, &limits).unwrap().0;
    assert!(matches!(&outcome.status, Status::Stalled(why) if why.contains("patience")));
    assert_eq!(outcome.iterations, 10);
    // Where M is not symmetric a wave has to cross the grid first: its moves say nothing of the rate.
    let label = "psor omega=1 adapt=false patience=650";
    let outcome = try_solve(&transport(60, 1e-3), label, &limits).unwrap().0;
    assert_eq!(outcome.status, Status::Solved, "{outcome:?}");
    let outcome = try_solve(&planted(100, PlantedClass::HPlus), label, &limits).unwrap().0;
    assert_eq!(outcome.status, Status::Solved);
}

#[test]
fn the_steps_of_multigrid_hardly_depend_on_the_number_of_points() {
    let steps = |side: usize, label: &str| {
        let problem = Membrane { load: -1.0, ..Membrane::square(side) }.above(bump);
        let (z, steps) = solved(&problem, label);
        if side < 50 {
            assert!(distance(&z, &solved(&problem, "mprgp").0) < 1e-7, "{side}");
        }
        steps
    };
    for side in [1, 2, 3, 20, 40, 80, 160] {
        let found = steps(side, "tnnmg");
        assert!(found <= 15, "{side}: {found}");
    }
    // What the cascade saves grows with the number of points that a front has to pass.
    assert!(steps(160, "tnnmg") < steps(160, "tnnmg cascade=false"));
}

#[test]
fn multigrid_that_gets_no_further_says_so() {
    // Indefinite: no minimum between no bounds.
    let entries =
        (0..40).flat_map(|i| [(i, i, 1.0), (i, (i + 1) % 40, 2.0), ((i + 1) % 40, i, 2.0)]);
    let m = Csc::from_triplets(40, 40, entries.collect::<Vec<_>>().into_iter()).unwrap();
    let q = (0..40).map(|i| if i % 3 == 0 { -1.0 } else { 0.5 }).collect();
    let outcome = try_solve(&Lcp::new(m, q).unwrap(), "tnnmg", &limits(1e-10, 1000)).unwrap().0;
    assert!(!matches!(outcome.status, Status::Limit(_)), "{outcome:?}");
}

#[test]
fn auto_takes_multigrid_where_a_matrix_is_large_sparse_and_symmetric_and_sweeps_are_slow() {
    let problem = Membrane { load: -1.0, ..Membrane::square(60) }.above(bump);
    let answer = Solve::new().solver("auto").tolerance(1e-8).run(&problem).unwrap();
    assert!(answer.is_solved(), "{}", answer.status);
    let tried: Vec<_> = answer.account.iter().filter(|line| !line.starts_with(' ')).collect();
    assert!(tried[0].starts_with("psor") && tried[1].starts_with("tnnmg"), "{tried:?}");
    assert_eq!(tried.len(), 2, "{tried:?}");
}

/// Under such a load the sweeps before, with the factor 1 and with one that adapts itself, promise no end.
#[test]
fn auto_relaxes_huge_problems_of_transport_by_factors_that_stay() {
    let mut problem = transport(230, 1e-2);
    let h = 1.0 / 231.0;
    for (k, q) in problem.q.iter_mut().enumerate() {
        let (x, y) = ((k / 230 + 1) as f64 * h, (k % 230 + 1) as f64 * h);
        *q = -20.0 * (5.0 * x).cos() * (7.0 * y).sin();
    }
    let answer = Solve::new().solver("auto").tolerance(1e-8).run(&problem).unwrap();
    assert!(answer.is_solved(), "{} {:?}", answer.status, answer.account);
    let last = answer.account.iter().rfind(|line| !line.starts_with(' ')).unwrap();
    assert!(last.starts_with("psor") && last.contains("solved"), "{:?}", answer.account);
    assert!(answer.factorisations == 0, "{:?}", answer.account);
}

#[test]
fn a_session_of_auto_goes_from_one_shape_to_another_and_back() {
    // The judge's gauge goes from solver to solver, and from solve to solve.
    let problems = [(40, PlantedClass::Kkt), (100, PlantedClass::Psd), (12, PlantedClass::HPlus)];
    let mut session = session::<Lcp>("auto");
    for (n, class) in [problems, problems].concat() {
        let problem = planted(n, class);
        let mut point = problem.origin();
        let outcome = session.solve(&problem, &mut point, &limits(1e-10, 100_000), &mut |_| {});
        let outcome = outcome.unwrap();
        assert_eq!(outcome.status, Status::Solved, "{n}");
        // What a gauge of another problem would have measured is something else.
        let fresh = problem.certify(&point, &mut problem.gauge().unwrap());
        assert_eq!(fresh.relative, outcome.measure.relative, "{n}");
        let kept = session.gauge().map(|gauge| problem.certify(&point, gauge).relative);
        assert_eq!(kept, Some(fresh.relative), "{n}");
    }
}

fn planted(n: usize, class: PlantedClass) -> Lcp {
    PlantedLcp { n, class, seed: 3, ..PlantedLcp::default() }.lcp().0
}

#[test]
fn single_changes_end_block_pivoting_where_they_are_limited() {
    let problem = planted(60, PlantedClass::Kkt);
    solved(&problem, "block_pivoting");
    let outcome =
        try_solve(&problem, "block_pivoting most_singles=1", &limits(1e-10, 1000)).unwrap().0;
    assert!(matches!(&outcome.status, Status::Stalled(why) if why.contains("most_singles")));
}

#[test]
fn auto_begins_with_sweeps_and_goes_on_with_pivots_where_their_rate_is_poor() {
    for (problem, last) in [(transport(60, 1e-3), "psor"), (planted(100, PlantedClass::P), "lemke")]
    {
        let answer = Solve::new().solver("auto").tolerance(1e-8).run(&problem).unwrap();
        assert!(answer.is_solved(), "{}", answer.status);
        let tried: Vec<_> = answer.account.iter().filter(|line| !line.starts_with(' ')).collect();
        assert!(tried[0].starts_with("psor"), "{tried:?}");
        assert!(tried[tried.len() - 1].starts_with(last), "{tried:?}");
    }
}
