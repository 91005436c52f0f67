//! Planted solutions: every class, every unit, one session for many problems.

use nonsmooth_linalg::{Dense, Matrix};
use nonsmooth_problem::{Lcp, Problem};
use nonsmooth_solve::registry::{self};
use nonsmooth_solve::{Limits, Status};
use rand::SeedableRng;
use rand_pcg::Pcg64;

use super::{Class, METHODS, close, matrix, plant, product, random, rows, solve, solve_with};

const CLASSES: [Class; 6] =
    [Class::Spd, Class::Definite, Class::Semidefinite, Class::Z, Class::Triangular, Class::Kkt];

fn planted(sizes: &[usize], seeds: u64) {
    for class in CLASSES {
        for &n in sizes {
            for seed in 0..seeds {
                for degenerate in [0.0, 0.1, 0.5] {
                    let mut rng = Pcg64::seed_from_u64(seed);
                    let m = matrix(class, n, &mut rng);
                    let (z, w) = plant(n, degenerate, &mut rng);
                    let q: Vec<f64> = w.iter().zip(product(&m, &z)).map(|(w, x)| w - x).collect();
                    let problem = Lcp::new(m.clone(), q).unwrap();
                    for name in METHODS {
                        let what = format!("{class:?} n = {n} seed {seed} degenerate {degenerate}");
                        let found = solve(name, &problem, &what).0;
                        match class {
                            Class::Semidefinite | Class::Kkt => {
                                // (z' − z)ᵀ M (z' − z) = 0: then (M + Mᵀ)(z' − z) = 0.
                                let gap: Vec<f64> =
                                    found.iter().zip(&z).map(|(a, b)| a - b).collect();
                                let energy: f64 =
                                    gap.iter().zip(product(&m, &gap)).map(|(a, b)| a * b).sum();
                                assert!(energy.abs() < 1e-8 * n as f64, "{name} {what}: {energy}");
                            }
                            // Triangular matrices are P, but can be badly conditioned.
                            _ => close(&found, &z, 1e-6, &format!("{name} {what}")),
                        }
                    }
                }
            }
        }
    }
}

#[test]
fn planted_problems() {
    planted(&[1, 2, 5, 20, 60], 3);
    planted(&[200], 1);
}

#[test]
#[ignore = "minutes"]
fn planted_problems_of_order_1000() {
    planted(&[1000], 1);
}

/// Rows and columns scaled by powers of ten from −6 to 6, also not in the same way.
#[test]
fn badly_scaled_problems() {
    for class in [Class::Spd, Class::Definite, Class::Z] {
        for seed in 0..4 {
            let n = 40;
            let mut rng = Pcg64::seed_from_u64(seed);
            let m = matrix(class, n, &mut rng);
            let (z, w) = plant(n, 0.1, &mut rng);
            let mut scales =
                || -> Vec<f64> { (0..n).map(|_| 10.0_f64.powf(6.0 * random(&mut rng))).collect() };
            let (r, c) = (scales(), scales());
            let scaled = Dense::from_fn(n, n, |i, j| r[i] * m[(i, j)] * c[j]);
            let z: Vec<f64> = z.iter().zip(&c).map(|(z, c)| z / c).collect();
            let w: Vec<f64> = w.iter().zip(&r).map(|(w, r)| w * r).collect();
            let q: Vec<f64> = w.iter().zip(product(&scaled, &z)).map(|(w, x)| w - x).collect();
            let problem = Lcp::new(scaled, q).unwrap();
            for name in METHODS {
                let what = format!("badly scaled {class:?} seed {seed}");
                let found = solve(name, &problem, &what).0;
                for (i, (a, b)) in found.iter().zip(&z).enumerate() {
                    assert!((a - b).abs() * c[i] < 1e-4, "{name} {what}: z[{i}] = {a}, known {b}");
                }
            }
        }
    }
}

/// Units change nothing: the same steps for M, q in other units.
#[test]
fn units_change_no_step() {
    let mut rng = Pcg64::seed_from_u64(3);
    let m = matrix(Class::Definite, 30, &mut rng);
    let (z, w) = plant(30, 0.1, &mut rng);
    let q: Vec<f64> = w.iter().zip(product(&m, &z)).map(|(w, x)| w - x).collect();
    for name in METHODS {
        let counts = [(1.0, 1.0), (1e6, 1.0), (1e-7, 1e5), (3.0, 1e-8)].map(|(a, b)| {
            let m = Dense::from_fn(30, 30, |i, j| a * m[(i, j)]);
            let q = q.iter().map(|q| b * q).collect();
            solve(name, &Lcp::new(m, q).unwrap(), "units").1
        });
        // Scales are powers of two, so other units may round otherwise.
        let (least, most) = (counts.iter().min().unwrap(), counts.iter().max().unwrap());
        assert!(most - least <= 3, "{name}: {counts:?}");
    }
}

#[test]
fn problems_without_a_solution_end_and_are_never_called_solved() {
    let cases = [
        ("murty 2.2", rows(&[&[-2.0, 1.0], &[1.0, -2.0]]), vec![-1.0, -1.0]),
        (
            "murty 2.9",
            rows(&[&[-1.0, 0.0, -3.0], &[1.0, -2.0, -5.0], &[-2.0, -1.0, -2.0]]),
            vec![-3.0, -2.0, -1.0],
        ),
        ("1 × 1", rows(&[&[-1.0]]), vec![-1.0]),
        (
            "pang perturbed",
            rows(&[&[0.0, -1.0, -1.0], &[1.0, 0.0, 0.0], &[-1.0, 0.0, 0.0]]),
            vec![-1e-4, -1.0, 1.0],
        ),
        ("semidefinite", rows(&[&[1.0, -1.0], &[-1.0, 1.0]]), vec![-1.0, -1.0]),
    ];
    for (what, m, q) in cases {
        let problem = Lcp::new(m, q).unwrap();
        for name in METHODS {
            let (outcome, ..) = solve_with(name, &[], &problem, &problem.origin().z, 1e-10);
            assert!(
                matches!(outcome.status, Status::Infeasible(_)),
                "{name} {what}: {}",
                outcome.status
            );
        }
    }
}

#[test]
fn a_session_solves_again_from_where_it_is() {
    let mut rng = Pcg64::seed_from_u64(8);
    let m = matrix(Class::Definite, 50, &mut rng);
    let (z, w) = plant(50, 0.0, &mut rng);
    let q: Vec<f64> = w.iter().zip(product(&m, &z)).map(|(w, x)| w - x).collect();
    for name in METHODS {
        for m in [Matrix::from(m.clone()), m.to_csc().into()] {
            let mut session = registry::session::<Lcp>(name, &Default::default()).unwrap();
            let mut problem = Lcp::new(m, q.clone()).unwrap();
            let mut point = problem.origin();
            let limits = Limits { tolerance: 1e-12, ..Limits::default() };
            let cold = session.solve(&problem, &mut point, &limits, &mut |_| {}).unwrap();
            close(&point.z, &z, 1e-10, name);
            problem.q.iter_mut().for_each(|q| *q *= 1.001);
            let warm = session.solve(&problem, &mut point, &limits, &mut |_| {}).unwrap();
            assert_eq!(warm.status, Status::Solved);
            assert!(warm.iterations <= cold.iterations, "{name}");
            let scaled: Vec<f64> = z.iter().map(|z| 1.001 * z).collect();
            close(&point.z, &scaled, 1e-10, name);
            // Another shape into the same session.
            let small = Lcp::new(rows(&[&[2.0]]), vec![-4.0]).unwrap();
            let mut point = small.origin();
            session.solve(&small, &mut point, &limits, &mut |_| {}).unwrap();
            close(&point.z, &[2.0], 1e-12, name);
        }
    }
}
