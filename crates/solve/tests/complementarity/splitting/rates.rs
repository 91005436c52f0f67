//! What `psor` does by the rate that it measures, and what `auto` makes of it.

use nonsmooth_linalg::Csc;
use nonsmooth_problem::Lcp;
use nonsmooth_problem::planted::{Membrane, PlantedClass, PlantedLcp};
use nonsmooth_solve::{Solve, Status};

use super::{bump, limits, solved, try_solve};

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
