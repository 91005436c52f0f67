//! Semismooth Newton methods on linear complementarity problems: known solutions, planted ones, cycling matrices, every shape of mixed problem.

mod corpus;
mod known;
mod nonlinear;
mod planted;
mod shapes;
mod sizes;

use nonsmooth_linalg::{Dense, Matrix};
use nonsmooth_problem::check::Judged;
use nonsmooth_problem::{LcpPoint, Problem};
use nonsmooth_solve::registry::{self, Registered};
use nonsmooth_solve::settings::from_texts;
use nonsmooth_solve::{Limits, Outcome, Status};
use rand::RngExt;
use rand_pcg::Pcg64;

use crate::common::{times, transposed};

const METHODS: [&str; 3] = ["newton_min", "newton_fb", "newton_pfb"];

fn solve_with<P: Registered + Problem<Point = LcpPoint>>(
    name: &str,
    settings: &[&str],
    problem: &P,
    start: &[f64],
    tolerance: f64,
) -> (Outcome, Vec<f64>, Vec<String>) {
    let mut session = registry::session::<P>(name, &from_texts(settings).unwrap()).unwrap();
    let mut point = LcpPoint { z: start.to_vec() };
    let limits = Limits { tolerance, max_iterations: 500, ..Limits::default() };
    let outcome = session.solve(problem, &mut point, &limits, &mut |_| {}).unwrap();
    (outcome, point.z, session.account())
}

/// The solution found at 1e-12, the judge agreeing.
fn solve<P: Registered + Problem<Point = LcpPoint> + Judged>(
    name: &str,
    problem: &P,
    what: &str,
) -> (Vec<f64>, usize) {
    let (outcome, z, account) = solve_with(name, &[], problem, &problem.origin().z, 1e-12);
    if std::env::var_os("NEWTON_TALK").is_some() {
        println!(
            "{name:10} {what:40} {:4} steps {:4} factorisations {:?} {:.1e} {account:?}",
            outcome.iterations,
            outcome.factorisations,
            outcome.status.name(),
            outcome.measure.merit()
        );
    }
    assert_eq!(outcome.status, Status::Solved, "{name} {what}: {:?} {account:?}", outcome.measure);
    assert!(problem.judge(&LcpPoint { z: z.clone() }, 1e-12).unwrap().solved, "{name} {what}");
    (z, outcome.iterations)
}

fn close(found: &[f64], known: &[f64], tolerance: f64, what: &str) {
    let size = known.iter().fold(0.0_f64, |m, x| m.max(x.abs()));
    for (i, (a, b)) in found.iter().zip(known).enumerate() {
        assert!((a - b).abs() <= tolerance * size, "{what}: z[{i}] = {a}, known {b}");
    }
}

/// Unit upper triangular with 2 above the diagonal.
fn murty(n: usize) -> Dense {
    Dense::from_fn(n, n, |i, j| match i.cmp(&j) {
        std::cmp::Ordering::Equal => 1.0,
        std::cmp::Ordering::Less => 2.0,
        std::cmp::Ordering::Greater => 0.0,
    })
}

fn rows(rows: &[&[f64]]) -> Dense {
    Dense::from_rows(rows).unwrap()
}

#[derive(Debug, Clone, Copy, PartialEq)]
enum Class {
    /// Symmetric positive definite.
    Spd,
    /// `AᵀA + skew + diagonal`.
    Definite,
    /// `Bᵀ B` of half the rank: w is unique, z is not.
    Semidefinite,
    /// Tridiagonal M-matrix.
    Z,
    /// Triangular with positive diagonal, far from symmetric.
    Triangular,
    /// `[H −Aᵀ; A 0]`, H semidefinite.
    Kkt,
}

fn random(rng: &mut Pcg64) -> f64 {
    rng.random_range(-1.0..1.0)
}

fn matrix(class: Class, n: usize, rng: &mut Pcg64) -> Dense {
    let scale = (n as f64).sqrt();
    let g = Dense::from_fn(n, n, |_, _| random(rng) / scale);
    let thin = Dense::from_fn(n.div_ceil(2), n, |_, _| random(rng) / scale);
    match class {
        Class::Spd => {
            let mut m = times(&transposed(&g), &g);
            (0..n).for_each(|i| m[(i, i)] += 0.1);
            m
        }
        Class::Definite => {
            let mut m = times(&transposed(&g), &g);
            for i in 0..n {
                for j in 0..i {
                    let s = 2.0 * random(rng) / scale;
                    m[(i, j)] += s;
                    m[(j, i)] -= s;
                }
                m[(i, i)] += 0.3 * rng.random::<f64>();
            }
            m
        }
        Class::Semidefinite => times(&transposed(&thin), &thin),
        Class::Z => Dense::from_fn(n, n, |i, j| match i.abs_diff(j) {
            0 => 2.0,
            1 => -1.0,
            _ => 0.0,
        }),
        Class::Triangular => Dense::from_fn(n, n, |i, j| match i.cmp(&j) {
            std::cmp::Ordering::Equal => 1.0,
            std::cmp::Ordering::Less => 3.0 * g[(i, j)],
            std::cmp::Ordering::Greater => 0.0,
        }),
        Class::Kkt => {
            let k = n / 3;
            let h = times(&transposed(&thin), &thin);
            Dense::from_fn(n, n, |i, j| match (i < n - k, j < n - k) {
                (true, true) => h[(i, j)],
                (true, false) => -g[(j, i)] * scale,
                (false, true) => g[(i, j)] * scale,
                (false, false) => 0.0,
            })
        }
    }
}

/// Planted z and w, of which a part is zero on both sides.
fn plant(n: usize, degenerate: f64, rng: &mut Pcg64) -> (Vec<f64>, Vec<f64>) {
    (0..n)
        .map(|_| {
            let size = rng.random_range(1.0..2.0);
            if rng.random::<f64>() < degenerate {
                (0.0, 0.0)
            } else if rng.random::<f64>() < 0.5 {
                (size, 0.0)
            } else {
                (0.0, size)
            }
        })
        .unzip()
}

fn product(m: &Dense, z: &[f64]) -> Vec<f64> {
    let mut w = vec![0.0; m.nrows()];
    Matrix::from(m.clone()).mul(z, &mut w);
    w
}
