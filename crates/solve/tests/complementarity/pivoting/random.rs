//! Random problems with planted solutions: P-matrices, semidefinite ones, degenerate programs, any scale, any class.

use nonsmooth_linalg::Dense;
use nonsmooth_problem::Lcp;
use nonsmooth_problem::planted::classics::{self, Classic, Known};
use rand::{RngExt, SeedableRng};
use rand_pcg::Pcg64;

use super::{ALL, close, from, largest, p_matrix, planted, redundant, solve};
use crate::common::w_of;

/// The optimality conditions of a quadratic program: `[H −Aᵀ; A 0]` with repeated rows of A and integers, so that ties are exact.
fn program(n: usize, rng: &mut Pcg64) -> Dense {
    let p = n / 2;
    let a = Dense::from_fn(n - p, p, |_, _| f64::from(rng.random_range(-2..3)));
    let of = |i: usize| if i % 3 == 2 { i - 1 } else { i };
    Dense::from_fn(n, n, |i, j| match (i < p, j < p) {
        (true, true) if i == j => 1.0,
        (true, false) => -a[(of(j - p), i)],
        (false, true) => a[(of(i - p), j)],
        _ => 0.0,
    })
}

#[test]
fn random_p_matrices() {
    let mut rng = Pcg64::seed_from_u64(1);
    for n in [1, 2, 5, 12, 40, 100, 200] {
        for degenerate in [0.0, 0.1, 0.5] {
            let (problem, z) = planted(p_matrix(n, &mut rng), degenerate, &mut rng);
            for name in ALL.iter().filter(|name| n <= 12 || **name != "enumeration") {
                // The least index is exponential in the worst case, and slow in all.
                if n > 40 && ["murty", "criss_cross"].contains(name) {
                    continue;
                }
                let solved = solve(name, &[], &problem);
                assert_eq!(solved.status(), "solved", "{name} n = {n} {}", solved.outcome.status);
                assert!(close(&solved.z, &z, 1e-9), "{name} n = {n}");
            }
        }
    }
}

#[test]
fn random_semidefinite_matrices_with_redundant_rows() {
    let mut rng = Pcg64::seed_from_u64(2);
    for n in [2, 5, 10, 20, 40, 100, 200] {
        for degenerate in [0.0, 0.3] {
            let (problem, z) = planted(redundant(n, &mut rng), degenerate, &mut rng);
            let w = w_of(&problem, &z);
            for (name, settings) in [
                ("criss_cross", vec![]),
                ("keller", vec![]),
                ("keller", vec!["least_index=true"]),
                ("enumeration", vec![]),
            ] {
                if (name == "enumeration" && n > 10) || (name == "criss_cross" && n > 40) {
                    continue;
                }
                let solved = solve(name, &settings, &problem);
                assert_eq!(solved.status(), "solved", "{name} n = {n} {}", solved.outcome.status);
                // M symmetric and semidefinite: w is unique, z need not be.
                let found = w_of(&problem, &solved.z);
                assert!(close(&found, &w, 1e-9 * largest(&z) * n as f64), "{name} n = {n}");
            }
        }
    }
}

#[test]
fn degenerate_programs_with_many_ties() {
    let mut rng = Pcg64::seed_from_u64(3);
    for n in [6, 10, 20, 40, 100, 200] {
        for degenerate in [0.0, 0.5, 0.9] {
            let m = program(n, &mut rng);
            let (mut z, mut w) = (vec![0.0; n], vec![0.0; n]);
            for i in 0..n {
                if rng.random_range(0.0..1.0) >= degenerate {
                    let value = f64::from(rng.random_range(1..4));
                    if rng.random_range(0.0..1.0) < 0.5 { z[i] = value } else { w[i] = value }
                }
            }
            let q = (0..n)
                .map(|i| w[i] - m.row(i).iter().zip(&z).map(|(m, z)| m * z).sum::<f64>())
                .collect();
            let problem = Lcp::new(m, q).unwrap();
            for (name, settings) in [
                ("criss_cross", vec![]),
                ("keller", vec![]),
                ("keller", vec!["least_index=true"]),
                ("enumeration", vec![]),
            ] {
                if (name == "enumeration" && n > 10) || (name == "criss_cross" && n > 40) {
                    continue;
                }
                let solved = solve(name, &settings, &problem);
                assert_eq!(solved.status(), "solved", "{name} n = {n} {}", solved.outcome.status);
                // H is definite: x is unique.
                let off = solved.z[..n / 2].iter().zip(&z).map(|(a, b)| (a - b).abs());
                assert!(off.fold(0.0, f64::max) < 1e-9, "{name} n = {n}");
            }
        }
    }
}

#[test]
fn rows_and_columns_of_any_scale() {
    let mut rng = Pcg64::seed_from_u64(4);
    for n in [5, 20, 60] {
        let (problem, z) = planted(p_matrix(n, &mut rng), 0.1, &mut rng);
        let known = Known::Solutions(vec![z]);
        let plain = Classic { name: "random", problem, known };
        let mut factors =
            || (0..n).map(|_| 10f64.powf(rng.random_range(-6.0..6.0))).collect::<Vec<_>>();
        let scaled = classics::scaled(&plain, &factors(), &factors());
        for name in ["bard", "keller", "block_pivoting", "murty"] {
            if name == "murty" && n > 20 {
                continue;
            }
            let solved = solve(name, &[], &scaled.problem);
            assert_eq!(solved.status(), "solved", "{name} n = {n} {}", solved.outcome.status);
            let known = scaled.solution().unwrap();
            let off = solved.z.iter().zip(known).map(|(a, b)| (a - b).abs() / b.max(1e-300));
            let off = off.zip(known).filter(|(_, b)| **b > 0.0).map(|(o, _)| o).fold(0.0, f64::max);
            assert!(off < 1e-8, "{name} n = {n}: {off:.1e}");
        }
    }
}

#[test]
fn a_solution_as_the_start_costs_no_pivot() {
    let mut rng = Pcg64::seed_from_u64(6);
    let (problem, z) = planted(p_matrix(50, &mut rng), 0.0, &mut rng);
    // Near the solution, but not at it: the basis is right.
    let near: Vec<f64> = z.iter().map(|z| 1.001 * z).collect();
    for name in ["murty", "bard", "criss_cross", "keller", "block_pivoting"] {
        let solved = from(name, &[], &problem, near.clone()).unwrap();
        assert_eq!((solved.status(), solved.pivots), ("solved", 0), "{name}");
        assert!(close(&solved.z, &z, 1e-10));
    }
}

/// Problems of no class: an end with a name, an answer that the judge accepts, or a proof. Nothing runs on for ever.
#[test]
fn matrices_of_no_class_end_with_a_name() {
    let mut rng = Pcg64::seed_from_u64(8);
    for _ in 0..300 {
        let n = rng.random_range(1..9);
        let integer = rng.random_range(0..2) == 0;
        let mut entry = || match integer {
            true => f64::from(rng.random_range(-2..3)),
            false => rng.random_range(-1.0..1.0),
        };
        let m = Dense::from_fn(n, n, |_, _| entry());
        let q: Vec<f64> = (0..n).map(|_| entry()).collect();
        let problem = Lcp::new(m, q).unwrap();
        let exact = solve("enumeration", &[], &problem);
        assert!(
            ["solved", "infeasible"].contains(&exact.status()),
            "{problem:?} {}",
            exact.status()
        );
        for name in ALL {
            let solved = solve(name, &[], &problem);
            match solved.status() {
                "solved" => assert_eq!(exact.status(), "solved"),
                "infeasible" => assert_eq!(exact.status(), "infeasible"),
                "stalled" | "no_conclusion" => {}
                other => panic!("{name}: {other} {problem:?}"),
            }
        }
    }
}
