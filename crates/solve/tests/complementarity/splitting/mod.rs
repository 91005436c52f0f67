//! Splitting and projection methods for linear complementarity problems: known, planted and published solutions, what they refuse, and what they promise.

mod allocations;
mod bounds;
mod optima;
mod planted;
mod rates;
mod refusals;
mod sizes;
mod sweeps;

use nonsmooth_linalg::{Dense, Matrix};
use nonsmooth_problem::planted::Membrane;
use nonsmooth_problem::{Lcp, LcpPoint, Problem};
use nonsmooth_solve::registry::{self, Registered};
use nonsmooth_solve::{Limits, Outcome, Session, SolveError, Status, settings};
use rand::{RngExt, SeedableRng};
use rand_pcg::Pcg64;

/// A solver with settings, as a command line has them: `psor omega=1.5 adapt=false`.
fn session<P: Registered>(label: &str) -> Box<dyn Session<P>> {
    let mut words = label.split(' ');
    let name = words.next().unwrap();
    let settings = settings::from_texts(&words.collect::<Vec<_>>()).unwrap();
    registry::session::<P>(name, &settings).unwrap()
}

fn limits(tolerance: f64, max_iterations: usize) -> Limits {
    Limits { tolerance, max_iterations, ..Limits::default() }
}

fn try_solve<P>(
    problem: &P,
    label: &str,
    limits: &Limits,
) -> Result<(Outcome, Vec<f64>), SolveError>
where
    P: Registered + Problem<Point = LcpPoint>,
{
    let mut point = problem.origin();
    let outcome = session::<P>(label).solve(problem, &mut point, limits, &mut |_| {})?;
    Ok((outcome, point.z))
}

/// The solution to 1e-10, and the number of steps.
fn solved<P>(problem: &P, label: &str) -> (Vec<f64>, usize)
where
    P: Registered + Problem<Point = LcpPoint>,
{
    let (outcome, z) = try_solve(problem, label, &limits(1e-10, 200_000)).unwrap();
    assert_eq!(outcome.status, Status::Solved, "{label}: {outcome:?}");
    (z, outcome.iterations)
}

/// The largest difference relative to the largest entry of b.
fn distance(a: &[f64], b: &[f64]) -> f64 {
    let size = b.iter().fold(f64::MIN_POSITIVE, |l, x| l.max(x.abs()));
    a.iter().zip(b).map(|(a, b)| (a - b).abs()).fold(0.0, f64::max) / size
}

/// Pseudo-random in (−1, 1), the same for the same indices.
struct Draw(Pcg64);

impl Draw {
    fn seeded(seed: u64) -> Self {
        Self(Pcg64::seed_from_u64(seed))
    }

    fn square(&mut self, n: usize) -> Dense {
        Dense::from_fn(n, n, |_, _| self.0.random_range(-1.0..1.0))
    }

    /// q such that z with about half of its entries zero solves LCP(M, q), strictly; and z.
    fn plant(&mut self, m: &Dense) -> (Vec<f64>, Vec<f64>) {
        let n = m.nrows();
        let (mut z, mut w) = (vec![0.0; n], vec![0.0; n]);
        for i in 0..n {
            let side = if self.0.random_range(0.0..1.0) < 0.5 { &mut z } else { &mut w };
            side[i] = self.0.random_range(1.0..2.0);
        }
        let mut q = vec![0.0; n];
        Matrix::from(m.clone()).mul(&z, &mut q);
        q.iter_mut().zip(&w).for_each(|(q, w)| *q = w - *q);
        (q, z)
    }
}

/// `AᵀA/n + shift I`.
fn gram(a: &Dense, shift: f64) -> Dense {
    let n = a.nrows();
    Dense::from_fn(n, n, |i, j| {
        let sum: f64 = (0..n).map(|k| a[(k, i)] * a[(k, j)]).sum();
        sum / n as f64 + if i == j { shift } else { 0.0 }
    })
}

const SYMMETRIC: [&str; 10] = [
    "pgs",
    "pgs direction=symmetric",
    "psor",
    "psor omega=1.5 adapt=false",
    "psor direction=symmetric",
    "rpgs",
    "rpsor",
    "splitting_ls",
    "splitting_ls sweep=jacobi",
    "mprgp",
];

/// An obstacle that a membrane under a downward load touches in a region with a wavy rim.
fn bump(x: f64, y: f64) -> f64 {
    let (x, y) = (x - 0.5, y - 0.5);
    0.3 - 4.0 * (x * x + y * y) + 0.02 * (20.0 * x).sin() * (17.0 * y).sin()
}

fn large(side: usize, steps: usize) {
    let membrane = Membrane { load: -1.0, ..Membrane::square(side) };
    let problem = membrane.above(bump);
    let (outcome, z) = try_solve(&problem, "psor", &limits(1e-8, steps)).unwrap();
    let Outcome { iterations, seconds, .. } = outcome;
    println!("psor, {side} x {side}: {iterations} sweeps, {seconds:.1} s");
    assert_eq!(outcome.status, Status::Solved, "{outcome:?}");
    let touching = z.iter().filter(|z| **z == 0.0).count();
    assert!(touching > side * side / 100 && touching < side * side / 2);
    // Products only, and from the solution of the sweeps: mprgp must agree that it is one.
    let by_products = membrane.above_by_products(bump);
    let mut point = LcpPoint { z };
    let outcome = session::<Lcp>("mprgp")
        .solve(&by_products, &mut point, &limits(1e-8, 2000), &mut |_| {})
        .unwrap();
    assert_eq!(outcome.status, Status::Solved, "{outcome:?}");
}
