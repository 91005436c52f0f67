//! Obstacle problems and large sparse ones.

use nonsmooth_linalg::Csc;
use nonsmooth_problem::Lcp;
use rand::{RngExt, SeedableRng};
use rand_pcg::Pcg64;

use super::{METHODS, close, plant, random, solve};
use crate::common::laplacian;

/// A membrane over a bump, `u ≥ ψ`, `−Δu ≥ 0`: z = u − ψ.
fn obstacle(k: usize) -> Lcp {
    let m = laplacian(k);
    let psi: Vec<f64> = (0..k * k)
        .map(|p| {
            let x = |i: usize| (i + 1) as f64 / (k + 1) as f64 - 0.5;
            0.5 - 5.0 * (x(p / k).powi(2) + 2.0 * x(p % k).powi(2)) + 0.1 * (20.0 * x(p / k)).sin()
        })
        .collect();
    let mut q = vec![0.0; k * k];
    m.mul_add(1.0, &psi, &mut q);
    Lcp::new(m, q).unwrap()
}

#[test]
fn obstacle_problems() {
    let problem = obstacle(40);
    let found = METHODS.map(|name| solve(name, &problem, "obstacle 40").0);
    close(&found[1], &found[0], 1e-10, "fb");
    close(&found[2], &found[0], 1e-10, "pfb");
}

#[test]
#[ignore = "seconds to minutes"]
fn large_problems() {
    let k = std::env::var("GRID").map_or(300, |k| k.parse().unwrap());
    let problem = obstacle(k);
    for name in METHODS {
        let clock = std::time::Instant::now();
        let (_, steps) = solve(name, &problem, "obstacle");
        println!("{name} {k} × {k}: {steps} steps, {:.2} s", clock.elapsed().as_secs_f64());
    }
    let mut rng = Pcg64::seed_from_u64(1);
    let n = 5000;
    let entries: Vec<_> = (0..n)
        .flat_map(|i| {
            let others: Vec<_> =
                (0..3).map(|_| (i, rng.random_range(0..n), random(&mut rng))).collect();
            others.into_iter().chain([(i, i, 3.5)])
        })
        .collect();
    let m = Csc::from_triplets(n, n, entries.iter().copied()).unwrap();
    let (z, w) = plant(n, 0.1, &mut rng);
    let mut q = w.clone();
    m.mul_add(-1.0, &z, &mut q);
    let problem = Lcp::new(m, q).unwrap();
    for name in METHODS {
        let clock = std::time::Instant::now();
        let (found, steps) = solve(name, &problem, "sparse 5000");
        println!("{name} sparse 5000: {steps} steps, {:.2} s", clock.elapsed().as_secs_f64());
        close(&found, &z, 1e-9, name);
    }
}
