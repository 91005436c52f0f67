//! Pivoting methods on linear complementarity problems: worked examples, pivot counts, certificates, random problems of known class.

mod all_solutions;
mod corpus;
mod examples;
mod mixed;
mod random;
mod refuted;
mod sizes;

use nonsmooth_linalg::Dense;
use nonsmooth_problem::{Lcp, LcpPoint, Problem};
use nonsmooth_solve::registry::{self, Registered};
use nonsmooth_solve::settings::from_texts;
use nonsmooth_solve::trace::Trace;
use nonsmooth_solve::{Limits, Outcome, SolveError};
use rand::RngExt;
use rand_pcg::Pcg64;

/// What a solve came to.
struct Solved {
    outcome: Outcome,
    z: Vec<f64>,
    pivots: usize,
    account: Vec<String>,
}

impl Solved {
    fn status(&self) -> &'static str {
        self.outcome.status.name()
    }
}

/// Solves from a point to the accuracy that direct methods reach.
fn from<P: Registered + Problem<Point = LcpPoint>>(
    name: &str,
    settings: &[&str],
    problem: &P,
    z: Vec<f64>,
) -> Result<Solved, SolveError> {
    let map = from_texts(settings).expect("key=value");
    let mut session = registry::session::<P>(name, &map)?;
    let mut point = LcpPoint { z };
    let limits =
        Limits { tolerance: 1e-12, max_iterations: 200_000, trace: true, ..Limits::default() };
    let outcome = session.solve(problem, &mut point, &limits, &mut |_| {})?;
    let Trace::Pivots(rows) = session.trace() else {
        return Ok(Solved { outcome, z: point.z, pivots: 0, account: session.account() });
    };
    Ok(Solved { outcome, z: point.z, pivots: rows.len(), account: session.account() })
}

fn solve<P: Registered + Problem<Point = LcpPoint>>(
    name: &str,
    settings: &[&str],
    problem: &P,
) -> Solved {
    from(name, settings, problem, problem.origin().z).expect("the method applies")
}

/// The methods with the classes of matrices they are made for.
const ALL: [&str; 6] = ["murty", "bard", "criss_cross", "keller", "block_pivoting", "enumeration"];

fn close(a: &[f64], b: &[f64], relative: f64) -> bool {
    let scale = b.iter().fold(f64::MIN_POSITIVE, |l, x| l.max(x.abs()));
    a.len() == b.len() && a.iter().zip(b).all(|(a, b)| (a - b).abs() <= relative * scale)
}

fn largest(x: &[f64]) -> f64 {
    x.iter().fold(0.0, |l, x| l.max(x.abs()))
}

/// `M_αα x = −q_α`.
fn eliminate(m: &Dense, q: &[f64], alpha: &[usize]) -> Option<Vec<f64>> {
    let k = alpha.len();
    let mut a: Vec<Vec<f64>> =
        alpha.iter().map(|&i| alpha.iter().map(|&j| m[(i, j)]).chain([-q[i]]).collect()).collect();
    for c in 0..k {
        let p = (c..k).max_by(|x, y| a[*x][c].abs().total_cmp(&a[*y][c].abs()))?;
        a.swap(c, p);
        let pivot = a[c].clone();
        if pivot[c].abs() < 1e-12 {
            return None;
        }
        for (r, row) in a.iter_mut().enumerate().filter(|(r, _)| *r != c) {
            let _ = r;
            let factor = row[c] / pivot[c];
            row.iter_mut().zip(&pivot).for_each(|(x, p)| *x -= factor * p);
        }
    }
    Some((0..k).map(|c| a[c][k] / a[c][c]).collect())
}

/// A problem with a planted solution: (z > 0, w = 0), (0, w > 0), and a share of degenerate pairs (0, 0).
fn planted(m: Dense, degenerate: f64, rng: &mut Pcg64) -> (Lcp, Vec<f64>) {
    let n = m.nrows();
    let (mut z, mut w) = (vec![0.0; n], vec![0.0; n]);
    for i in 0..n {
        let value = rng.random_range(1.0..2.0);
        if rng.random_range(0.0..1.0) >= degenerate {
            if rng.random_range(0.0..1.0) < 0.5 { z[i] = value } else { w[i] = value }
        }
    }
    let q =
        (0..n).map(|i| w[i] - m.row(i).iter().zip(&z).map(|(m, z)| m * z).sum::<f64>()).collect();
    (Lcp::new(m, q).unwrap(), z)
}

/// `AᵀA + B + diag(d)`, B skew: positive definite, not symmetric.
fn p_matrix(n: usize, rng: &mut Pcg64) -> Dense {
    let a = Dense::from_fn(n, n, |_, _| rng.random_range(-5.0..5.0));
    let mut m = Dense::zeros(n, n);
    for k in 0..n {
        let row = a.row(k).to_vec();
        for i in 0..n {
            let x = row[i];
            m.row_mut(i).iter_mut().zip(&row).for_each(|(m, y)| *m += x * y);
        }
    }
    for i in 0..n {
        m[(i, i)] += rng.random_range(0.0..0.3);
        for j in 0..i {
            let b = rng.random_range(-5.0..5.0);
            m[(i, j)] += b;
            m[(j, i)] -= b;
        }
    }
    m
}

/// `G Gᵀ` of rank n/2 with repeated rows: contacts of a rigid body, hyperstatic.
fn redundant(n: usize, rng: &mut Pcg64) -> Dense {
    let rank = (n / 2).max(1);
    let g: Vec<Vec<f64>> =
        (0..n).map(|_| (0..rank).map(|_| rng.random_range(-1.0..1.0)).collect()).collect();
    let of = |i: usize| &g[if i % 5 == 4 { i - 1 } else { i }];
    Dense::from_fn(n, n, |i, j| of(i).iter().zip(of(j)).map(|(a, b)| a * b).sum())
}
