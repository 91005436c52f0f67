//! Lemke's method: known solutions and pivot counts, degeneracy, certificates, mixed problems, bad scaling, and that the bases agree.

mod known;
mod lemke_howson;
mod mixed;
mod random;

use nonsmooth_linalg::Dense;
use nonsmooth_problem::{Lcp, LcpPoint, Problem};
use nonsmooth_solve::complementarity::pivoting::{BasisKind, Lemke, Ties};
use nonsmooth_solve::trace::{Pivot, Trace};
use nonsmooth_solve::{Driver, Limits, Outcome, Session};
use rand::SeedableRng;
use rand_pcg::Pcg64Mcg;

const BASES: [BasisKind; 3] = [BasisKind::Tableau, BasisKind::Dense, BasisKind::Sparse];

/// The textbook's method.
fn plain() -> Lemke {
    Lemke { ties: Ties::Rows, restarts: 0, ..Lemke::default() }
}

struct Run {
    z: Vec<f64>,
    outcome: Outcome,
    pivots: Vec<Pivot>,
}

fn run_with<P>(problem: &P, solver: Lemke, start: &[f64], tolerance: f64) -> Run
where
    P: Problem<Point = LcpPoint> + nonsmooth_solve::complementarity::form::Complementary + Sync,
{
    let mut driver = Driver::new(solver);
    let mut point = problem.origin();
    if !start.is_empty() {
        point.z.copy_from_slice(start);
    }
    let limits = Limits { trace: true, tolerance, max_iterations: 1_000_000, ..Limits::default() };
    let outcome = driver.solve(problem, &mut point, &limits, &mut |_| {}).expect("it applies");
    let Trace::Pivots(pivots) = driver.trace() else { panic!("a history of pivots") };
    Run { z: point.z, outcome, pivots }
}

fn run<P>(problem: &P, settings: Lemke) -> Run
where
    P: Problem<Point = LcpPoint> + nonsmooth_solve::complementarity::form::Complementary + Sync,
{
    run_with(problem, settings, &[], 1e-11)
}

fn from_fn(n: usize, m: impl FnMut(usize, usize) -> f64, q: impl FnMut(usize) -> f64) -> Lcp {
    Lcp::new(Dense::from_fn(n, n, m), (0..n).map(q).collect()).unwrap()
}

fn assert_close(z: &[f64], expected: &[f64], what: &str) {
    let size = expected.iter().fold(1e-300_f64, |l, x| l.max(x.abs()));
    let off = z.iter().zip(expected).fold(0.0_f64, |l, (a, b)| l.max((a - b).abs()));
    assert!(z.len() == expected.len() && off <= 1e-12 * size, "{what}: {z:?}, not {expected:?}");
}

/// What the three bases agree on.
fn same_pivots(problem: &Lcp, settings: Lemke, what: &str) -> Run {
    let mut runs: Vec<Run> =
        BASES.iter().map(|&basis| run(problem, Lemke { basis, ..settings.clone() })).collect();
    let first = runs.remove(0);
    let exchanges = |r: &Run| r.pivots.iter().map(|p| (p.entering, p.leaving)).collect::<Vec<_>>();
    for other in &runs {
        let (a, b) = (exchanges(&first), exchanges(other));
        let differ = a.iter().zip(&b).position(|(a, b)| a != b);
        assert!(differ.is_none() && a.len() == b.len(), "{what}: at pivot {differ:?}");
        assert_eq!(first.outcome.status.name(), other.outcome.status.name(), "{what}");
    }
    first
}

fn rng(seed: u64) -> Pcg64Mcg {
    Pcg64Mcg::seed_from_u64(seed)
}
