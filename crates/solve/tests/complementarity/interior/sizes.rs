//! Obstacle problems of many unknowns.

use nonsmooth_problem::Lcp;
use nonsmooth_solve::Status;

use super::run;
use crate::common::laplacian;

/// A membrane over an obstacle: z is the height above it, with the load f and the obstacle ψ, `q = A ψ − h² f`.
fn obstacle(k: usize) -> Lcp {
    let a = laplacian(k);
    let h = 1.0 / (k as f64 + 1.0);
    let mut psi = vec![0.0; k * k];
    for i in 0..k {
        for j in 0..k {
            let (x, y) = ((i + 1) as f64 * h - 0.5, (j + 1) as f64 * h - 0.5);
            psi[i * k + j] = 0.3 - 2.0 * (x * x + y * y);
        }
    }
    let mut q = vec![0.0; k * k];
    a.mul_add(1.0, &psi, &mut q);
    q.iter_mut().for_each(|q| *q += 2.0 * h * h);
    Lcp::new(a, q).unwrap()
}

#[test]
fn an_obstacle_problem_of_ninety_thousand_is_solved() {
    let problem = obstacle(300);
    let clock = std::time::Instant::now();
    let run = run(&problem, "ip_mehrotra", 1e-10);
    println!(
        "300 x 300: {} in {} iterations, {} factorisations, {:.1} s ({:?}); {:?}",
        run.outcome.status,
        run.outcome.iterations,
        run.outcome.factorisations,
        clock.elapsed().as_secs_f64(),
        run.account,
        run.outcome.measure
    );
    assert_eq!(run.outcome.status, Status::Solved);
    assert!(run.outcome.iterations <= 40);
    let touching = run.point.z.iter().filter(|z| **z <= 1e-12).count();
    assert!(touching > 100 && touching < 80_000, "{touching}");
}

#[test]
#[ignore = "a million unknowns: minutes and gigabytes"]
fn an_obstacle_problem_of_a_million_is_solved() {
    let problem = obstacle(1000);
    let run = run(&problem, "ip_mehrotra", 1e-8);
    println!(
        "1000 x 1000: {} in {} iterations, {} factorisations, {:.1} s; {:?}",
        run.outcome.status,
        run.outcome.iterations,
        run.outcome.factorisations,
        run.outcome.seconds,
        run.outcome.measure
    );
    assert_eq!(run.outcome.status, Status::Solved);
}
