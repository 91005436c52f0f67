//! Interior points and the convex QP on linear complementarity problems: planted, classic, degenerate, infeasible and badly scaled ones.

mod path;
mod planted;
mod programs;
mod shapes;
mod sizes;

use nonsmooth_linalg::{Dense, Matrix};
use nonsmooth_problem::Problem;
use nonsmooth_solve::registry::{self, Registered};
use nonsmooth_solve::settings::from_texts;
use nonsmooth_solve::trace::{PathPoint, Trace};
use nonsmooth_solve::{Limits, Outcome};

use crate::common::{times, transposed};

const BOTH: [&str; 2] = ["ip_mty", "ip_mehrotra"];

const ALL: [&str; 3] = ["ip_mty", "ip_mehrotra", "qp"];

/// Numbers that look random and are the same everywhere.
struct Numbers(u64);

impl Numbers {
    fn bits(&mut self) -> u64 {
        self.0 = self.0.wrapping_add(0x9e37_79b9_7f4a_7c15);
        let mut x = self.0;
        x = (x ^ (x >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
        x = (x ^ (x >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
        x ^ (x >> 31)
    }

    fn within(&mut self, low: f64, high: f64) -> f64 {
        low + (high - low) * (self.bits() >> 11) as f64 / (1u64 << 53) as f64
    }

    fn dense(&mut self, rows: usize, columns: usize) -> Dense {
        Dense::from_fn(rows, columns, |_, _| self.within(-1.0, 1.0))
    }
}

struct Run<T> {
    outcome: Outcome,
    point: T,
    path: Vec<PathPoint>,
    account: Vec<String>,
}

fn run_from<P: Problem + Registered>(
    problem: &P,
    name: &str,
    settings: &[&str],
    tolerance: f64,
    mut point: P::Point,
) -> Run<P::Point> {
    let settings = from_texts(settings).unwrap();
    let mut session = registry::session::<P>(name, &settings).unwrap();
    let limits = Limits { tolerance, max_iterations: 2000, trace: true, ..Limits::default() };
    let outcome = session.solve(problem, &mut point, &limits, &mut |_| {}).unwrap();
    let path = match session.trace() {
        Trace::Path(rows) => rows,
        _ => vec![],
    };
    Run { outcome, point, path, account: session.account() }
}

fn run<P: Problem + Registered>(problem: &P, name: &str, tolerance: f64) -> Run<P::Point> {
    run_from(problem, name, &[], tolerance, problem.origin())
}

/// q such that z and w obey the law, `share` of the pairs with both zero; (z, w, q).
fn planted(m: &Matrix, share: f64, numbers: &mut Numbers) -> (Vec<f64>, Vec<f64>, Vec<f64>) {
    let n = m.nrows();
    let (mut z, mut w) = (vec![0.0; n], vec![0.0; n]);
    for i in 0..n {
        let side = numbers.within(0.0, 1.0);
        if side > 0.5 + 0.5 * share {
            z[i] = numbers.within(1.0, 2.0);
        } else if side < 0.5 - 0.5 * share {
            w[i] = numbers.within(1.0, 2.0);
        }
    }
    let mut mz = vec![0.0; n];
    m.mul(&z, &mut mz);
    let q = w.iter().zip(&mz).map(|(w, mz)| w - mz).collect();
    (z, w, q)
}

/// Symmetric positive semidefinite of rank r, with a diagonal added.
fn gram(n: usize, r: usize, diagonal: f64, numbers: &mut Numbers) -> Dense {
    let a = numbers.dense(n, r);
    let mut m = times(&a, &transposed(&a));
    (0..n).for_each(|i| m[(i, i)] += diagonal);
    m
}

/// A diagonal and a skew part.
fn skew(n: usize, diagonal: f64, numbers: &mut Numbers) -> Dense {
    let a = numbers.dense(n, n);
    Dense::from_fn(n, n, |i, j| a[(i, j)] - a[(j, i)] + if i == j { diagonal } else { 0.0 })
}

fn off(a: &[f64], b: &[f64]) -> f64 {
    a.iter().zip(b).fold(0.0, |l, (a, b)| l.max((a - b).abs()))
}
