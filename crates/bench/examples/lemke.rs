//! Lemke's method on a plain dense tableau against a factorised basis, and on sparse problems, in one run on one thread.
//!
//! `cargo run --release -p nonsmooth-bench --example lemke -- [n=100,200,500,1000] [sparse=5000] [repeat=1]`
//!
//! Dense: random positive definite matrices that are not symmetric, and positive semidefinite ones of half the rank with a skew part; seeded. Sparse: the
//! obstacle problem on a square grid, random matrices with 5 entries a row, and frictionless contacts of a redundant stack (`W = Hᵀ H`, rank below n).
//! Times are processor seconds of the driver: set-up, pivots and judgement. Each figure is the fastest of the repetitions, which are interleaved.

use nonsmooth_linalg::{Csc, Dense, Matrix};
use nonsmooth_problem::{Lcp, Problem};
use nonsmooth_solve::complementarity::pivoting::{BasisKind, Lemke, Ties};
use nonsmooth_solve::{Driver, Limits, Outcome, Session};
use rand::{RngExt, SeedableRng};
use rand_pcg::Pcg64Mcg;

/// The solution is planted: half of the pairs with `z > 0`.
fn planted(m: impl Into<Matrix>, rng: &mut Pcg64Mcg) -> Lcp {
    let m = m.into();
    let n = m.nrows();
    let (mut z, mut w) = (vec![0.0; n], vec![0.0; n]);
    for i in 0..n {
        let x = rng.random_range(1.0..2.0);
        if rng.random_range(0.0..1.0) < 0.5 { z[i] = x } else { w[i] = x }
    }
    let mut q = vec![0.0; n];
    m.mul(&z, &mut q);
    q.iter_mut().zip(&w).for_each(|(q, w)| *q = w - *q);
    Lcp::new(m, q).expect("a square matrix")
}

/// `B Bᵀ / n` of this rank with half of a random skew matrix.
fn dense(n: usize, rank: usize, rng: &mut Pcg64Mcg) -> Lcp {
    let b = Dense::from_fn(n, rank, |_, _| rng.random_range(-1.0..1.0));
    let s = Dense::from_fn(n, n, |_, _| rng.random_range(-0.5..0.5));
    let dot = |i: usize, j: usize| b.row(i).iter().zip(b.row(j)).map(|(x, y)| x * y).sum::<f64>();
    let shift = if rank == n { 0.1 } else { 0.0 };
    let entry = |i: usize, j: usize| {
        dot(i, j) / n as f64 + s[(i, j)] - s[(j, i)] + if i == j { shift } else { 0.0 }
    };
    planted(Dense::from_fn(n, n, entry), rng)
}

/// A membrane over an obstacle, on a grid of about n points.
fn obstacle(n: usize) -> Lcp {
    let k = (n as f64).sqrt().round() as usize;
    let mut entries = vec![];
    for i in 0..k * k {
        entries.push((i, i, 4.0));
        if i % k + 1 < k {
            entries.extend([(i, i + 1, -1.0), (i + 1, i, -1.0)]);
        }
        if i + k < k * k {
            entries.extend([(i, i + k, -1.0), (i + k, i, -1.0)]);
        }
    }
    let q = (0..k * k).map(|i| {
        let (x, y) = ((i % k) as f64 / k as f64, (i / k) as f64 / k as f64);
        0.1 - 0.8 * (9.0 * x).sin() * (7.0 * y).cos()
    });
    let m = Csc::from_triplets(k * k, k * k, entries.iter().copied()).expect("in range");
    Lcp::new(m, q.collect()).expect("a square matrix")
}

/// Entries anywhere, and a diagonal that dominates.
fn scattered(n: usize, rng: &mut Pcg64Mcg) -> Lcp {
    let mut entries = vec![];
    for i in 0..n {
        let mut sum = 0.1;
        for _ in 0..4 {
            let x: f64 = rng.random_range(-1.0..1.0);
            entries.push((i, rng.random_range(0..n), x));
            sum += x.abs();
        }
        entries.push((i, i, sum));
    }
    planted(Csc::from_triplets(n, n, entries.iter().copied()).expect("in range"), rng)
}

/// Contacts between neighbours in a grid of bodies with two unknowns each, four contacts a neighbourhood: more contacts than unknowns.
fn contacts(n: usize, rng: &mut Pcg64Mcg) -> Lcp {
    let k = (n as f64 / 8.0).sqrt().round() as usize;
    let mut h = vec![];
    let mut c = 0;
    for body in 0..k * k {
        for (there, neighbour) in [(body % k + 1 < k, body + 1), (body + k < k * k, body + k)] {
            for _ in 0..4 {
                let (a, b) = (rng.random_range(-1.0..1.0), rng.random_range(-1.0..1.0));
                h.extend([(2 * body, c, a), (2 * body + 1, c, b)]);
                if there {
                    h.extend([(2 * neighbour, c, -a), (2 * neighbour + 1, c, -b)]);
                }
                c += 1;
            }
        }
    }
    let h = Csc::from_triplets(2 * k * k, c, h.iter().copied()).expect("in range");
    let t = h.transpose();
    let mut entries = vec![];
    for j in 0..c {
        let (rows, values) = h.column(j);
        for (&r, &x) in rows.iter().zip(values) {
            let (contacts, others) = t.column(r);
            entries.extend(contacts.iter().zip(others).map(|(&i, &y)| (i, j, x * y)));
        }
    }
    planted(Csc::from_triplets(c, c, entries.iter().copied()).expect("in range"), rng)
}

fn solve(problem: &Lcp, basis: BasisKind) -> Outcome {
    let settings = Lemke { basis, ties: Ties::Perturbed, ..Lemke::default() };
    let mut driver = Driver::new(settings);
    let limits = Limits { tolerance: 1e-10, cpu_time: true, ..Limits::default() };
    driver.solve(problem, &mut problem.origin(), &limits, &mut |_| {}).expect("it applies")
}

fn rounds(text: Option<&str>, usual: &[usize]) -> Result<Vec<usize>, std::num::ParseIntError> {
    match text {
        Some(text) => text.split(',').map(str::parse).collect(),
        None => Ok(usual.to_vec()),
    }
}

fn main() -> Result<(), Box<dyn std::error::Error>> {
    let args: Vec<String> = std::env::args().skip(1).collect();
    let of = |key: &str| args.iter().find_map(|a| a.strip_prefix(key)?.strip_prefix('='));
    let sizes = rounds(of("n"), &[100, 200, 500, 1000])?;
    let sparse = rounds(of("sparse"), &[5000])?;
    let repeat = of("repeat").map_or(Ok(1), str::parse)?;

    println!(
        "{:22} {:>6} {:>8} {:>12} {:>12} {:>7}",
        "dense", "n", "pivots", "tableau s", "factorised s", "ratio"
    );
    for n in sizes {
        let mut rng = Pcg64Mcg::seed_from_u64(n as u64);
        for (name, rank) in [("positive definite", n), ("semidefinite", n / 2)] {
            let problem = dense(n, rank, &mut rng);
            let mut best = [f64::INFINITY; 2];
            let mut pivots = [0; 2];
            for _ in 0..repeat {
                for (k, basis) in [BasisKind::Tableau, BasisKind::Dense].into_iter().enumerate() {
                    let outcome = solve(&problem, basis);
                    assert_eq!(outcome.status.name(), "solved");
                    best[k] = best[k].min(outcome.cpu_seconds.expect("asked for"));
                    pivots[k] = outcome.iterations;
                }
            }
            let same = if pivots[0] == pivots[1] { "" } else { " (other pivots)" };
            println!(
                "{name:22} {n:6} {:8} {:12.4} {:12.4} {:7.2}{same}",
                pivots[1],
                best[0],
                best[1],
                best[0] / best[1]
            );
        }
    }
    println!("\n{:22} {:>6} {:>8} {:>12} {:>12} {:>7}", "sparse", "n", "pivots", "LU", "s", "rows");
    for n in sparse {
        let mut rng = Pcg64Mcg::seed_from_u64(n as u64);
        let problems = [
            ("obstacle", obstacle(n)),
            ("random, 5 a row", scattered(n, &mut rng)),
            ("contacts, redundant", contacts(n, &mut rng)),
        ];
        for (name, problem) in problems {
            let outcome = solve(&problem, BasisKind::Auto);
            println!(
                "{name:22} {:6} {:8} {:12} {:12.3} {:7.0e} {}",
                problem.dim(),
                outcome.iterations,
                outcome.factorisations,
                outcome.cpu_seconds.expect("asked for"),
                outcome.measure.relative,
                outcome.status
            );
        }
    }
    Ok(())
}
