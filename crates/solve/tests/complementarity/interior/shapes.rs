//! Horizontal and mixed problems, solved as they are or refuted.

use nonsmooth_linalg::{Dense, Matrix, norm};
use nonsmooth_problem::check::Certificate;
use nonsmooth_problem::{Hlcp, HlcpPoint, Lcp, Mlcp};
use nonsmooth_solve::Status;

use super::{ALL, BOTH, Numbers, gram, planted, run, skew};
use crate::common::{times, transposed};

#[test]
fn infeasible_problems_come_back_with_a_verified_certificate() {
    let numbers = &mut Numbers(7);
    let mut cases: Vec<(String, Dense, Vec<f64>)> = vec![
        ("1 x 1".into(), Dense::from_rows(&[[-1.0]]).unwrap(), vec![-1.0]),
        ("zero".into(), Dense::zeros(2, 2), vec![1.0, -1.0]),
        ("rank 1".into(), Dense::from_rows(&[[1.0, -1.0], [-1.0, 1.0]]).unwrap(), vec![-1.0, 0.5]),
        (
            "LP without a feasible point".into(),
            // x ≤ 1 and x ≥ 2.
            Dense::from_rows(&[[0.0, 1.0, -1.0], [-1.0, 0.0, 0.0], [1.0, 0.0, 0.0]]).unwrap(),
            vec![1.0, 1.0, -2.0],
        ),
    ];
    for n in [4, 12, 40] {
        // y ≥ 0 with M y = 0 and qᵀy < 0.
        let half = n / 2;
        let y: Vec<f64> =
            (0..n).map(|i| if i < half { numbers.within(0.5, 2.0) } else { 0.0 }).collect();
        let size = norm(&y);
        let mut a = numbers.dense(n, n);
        for j in 0..n {
            let along: f64 = (0..n).map(|i| a[(i, j)] * y[i]).sum::<f64>() / (size * size);
            (0..n).for_each(|i| a[(i, j)] -= along * y[i]);
        }
        let m = times(&a, &transposed(&a));
        let mut q: Vec<f64> = (0..n).map(|_| numbers.within(-1.0, 1.0)).collect();
        let along: f64 = q.iter().zip(&y).map(|(q, y)| q * y).sum::<f64>();
        q.iter_mut().zip(&y).for_each(|(q, y)| *q -= (along + 1.0) * y / (size * size));
        cases.push((format!("PSD, n = {n}"), m, q));
        // An LP that is infeasible: rows of A x ≥ b that add up to 0 ≥ 1.
        let (rows, columns) = (n / 2 + 1, n - n / 2);
        let mut a = numbers.dense(rows, columns);
        for j in 0..columns {
            let sum: f64 = (0..rows - 1).map(|i| a[(i, j)]).sum();
            a[(rows - 1, j)] = -sum - numbers.within(0.0, 0.5);
        }
        let mut b: Vec<f64> = (0..rows).map(|_| numbers.within(-1.0, 1.0)).collect();
        b[rows - 1] = 1.0 - b[..rows - 1].iter().sum::<f64>();
        let mut m = Dense::zeros(rows + columns, rows + columns);
        for i in 0..rows {
            for j in 0..columns {
                m[(columns + i, j)] = a[(i, j)];
                m[(j, columns + i)] = -a[(i, j)];
            }
        }
        let mut q: Vec<f64> = (0..columns).map(|_| numbers.within(0.0, 1.0)).collect();
        q.extend(b.iter().map(|b| -b));
        cases.push((format!("LP, n = {n}"), m, q));
    }
    for (at, m, q) in cases {
        for m in [Matrix::from(m.clone()), m.to_csc().into()] {
            let problem = Lcp::new(m, q.clone()).unwrap();
            for name in ALL {
                if name == "qp" && at == "1 x 1" {
                    continue; // not convex
                }
                let run = run(&problem, name, 1e-9);
                println!("{at}, {name}: {} in {}", run.outcome.status, run.outcome.iterations);
                assert!(run.outcome.status.refutes(), "{at}, {name}: {:?}", run.outcome.status);
            }
        }
    }
}

#[test]
fn horizontal_problems_are_solved_natively() {
    for n in [1, 3, 20, 100] {
        for seed in 0..4 {
            let numbers = &mut Numbers(seed + 77 * n as u64);
            // Monotone: Q = B M, R = −B with M positive semidefinite, and half of the columns exchanged.
            let m = if seed % 2 == 0 {
                gram(n, n.div_ceil(2), 0.0, numbers)
            } else {
                skew(n, 0.5, numbers)
            };
            let b = numbers.dense(n, n);
            let (mut q, mut r) = (times(&b, &m), Dense::from_fn(n, n, |i, j| -b[(i, j)]));
            for j in (0..n).step_by(2) {
                for i in 0..n {
                    (q[(i, j)], r[(i, j)]) = (r[(i, j)], q[(i, j)]);
                }
            }
            for share in [0.0, 0.5] {
                let mut point = HlcpPoint { x: vec![0.0; n], s: vec![0.0; n] };
                for i in 0..n {
                    let side = numbers.within(0.0, 1.0);
                    if side > 0.5 + 0.5 * share {
                        point.x[i] = numbers.within(1.0, 2.0);
                    } else if side < 0.5 - 0.5 * share {
                        point.s[i] = numbers.within(1.0, 2.0);
                    }
                }
                let (mut rhs, mut more) = (vec![0.0; n], vec![0.0; n]);
                Matrix::from(q.clone()).mul(&point.x, &mut rhs);
                Matrix::from(r.clone()).mul(&point.s, &mut more);
                rhs.iter_mut().zip(&more).for_each(|(a, b)| *a += b);
                let dense = [Matrix::from(q.clone()), r.clone().into()];
                let sparse = [Matrix::from(q.to_csc()), r.to_csc().into()];
                for [q, r] in [dense, sparse] {
                    let problem = Hlcp::new(q, r, rhs.clone()).unwrap();
                    for name in BOTH {
                        let run = run(&problem, name, 1e-11);
                        let at = format!("{name}, n = {n}, seed {seed}, share {share}");
                        println!("hLCP {at}: {} in {}", run.outcome.status, run.outcome.iterations);
                        assert_eq!(
                            run.outcome.status,
                            Status::Solved,
                            "{at}: {:?}",
                            run.outcome.measure
                        );
                    }
                }
            }
        }
    }
}

#[test]
fn an_infeasible_horizontal_problem_is_refuted() {
    // M = [1 −1; −1 1] mixed by B = [2 1; 1 1], and with the second columns exchanged.
    let numbers = &mut Numbers(3);
    for n in [2_usize, 10] {
        let y: Vec<f64> = (0..n).map(|i| if i < n.div_ceil(2) + 1 { 1.0 } else { 0.0 }).collect();
        let size = norm(&y);
        let mut a = numbers.dense(n, n);
        for j in 0..n {
            let along: f64 = (0..n).map(|i| a[(i, j)] * y[i]).sum::<f64>() / (size * size);
            (0..n).for_each(|i| a[(i, j)] -= along * y[i]);
        }
        let m = times(&a, &transposed(&a));
        let mut c: Vec<f64> = (0..n).map(|_| numbers.within(-1.0, 1.0)).collect();
        let along: f64 = c.iter().zip(&y).map(|(q, y)| q * y).sum::<f64>();
        c.iter_mut().zip(&y).for_each(|(q, y)| *q -= (along + 1.0) * y / (size * size));
        let b = numbers.dense(n, n);
        let (mut q, mut r) = (times(&b, &m), Dense::from_fn(n, n, |i, j| -b[(i, j)]));
        let mut rhs = vec![0.0; n];
        Matrix::from(b).mul(&c, &mut rhs);
        rhs.iter_mut().for_each(|x| *x = -*x);
        for i in 0..n {
            (q[(i, n - 1)], r[(i, n - 1)]) = (r[(i, n - 1)], q[(i, n - 1)]);
        }
        let problem = Hlcp::new(q, r, rhs).unwrap();
        for name in BOTH {
            let run = run(&problem, name, 1e-9);
            println!(
                "hLCP n = {n}, {name}: {:?} in {}",
                run.outcome.status.name(),
                run.outcome.iterations
            );
            assert!(
                run.outcome.status.refutes()
                    && matches!(run.outcome.status.certificate(), Some(Certificate::Farkas { .. })),
                "{name}: {:?}",
                run.outcome.status
            );
        }
    }
}

#[test]
fn mixed_problems_are_solved_with_their_free_variables() {
    for (n, free) in [(2, 1), (9, 4), (60, 20), (60, 60)] {
        for seed in 0..4 {
            let numbers = &mut Numbers(seed + 13 * n as u64);
            // [A C; D B]: positive semidefinite with A nonsingular, or the saddle [0 −Cᵀ; C B].
            let saddle = seed % 2 == 1 && free < n;
            let m = if saddle {
                let mut m = skew(n, 0.0, numbers);
                for i in 0..n {
                    for j in 0..n {
                        if i < free && j < free {
                            m[(i, j)] = 0.0;
                        }
                    }
                    if i >= free {
                        m[(i, i)] += 1.0;
                    }
                }
                m
            } else {
                gram(n, n, 0.1, numbers)
            };
            let m = Matrix::from(m);
            let (mut z, mut w, _) = planted(&m, 0.2, numbers);
            for i in 0..free {
                (z[i], w[i]) = (numbers.within(-1.0, 1.0), 0.0);
            }
            let mut q = vec![0.0; n];
            m.mul(&z, &mut q);
            q.iter_mut().zip(&w).for_each(|(q, w)| *q = w - *q);
            for m in [m.clone(), m.to_csc().unwrap().into()] {
                let problem = Mlcp::new(m, q.clone(), free).unwrap();
                for name in ALL {
                    let run = run(&problem, name, 1e-11);
                    let at = format!("{name}, n = {n}, {free} free, seed {seed}");
                    println!("MLCP {at}: {} in {}", run.outcome.status, run.outcome.iterations);
                    assert_eq!(
                        run.outcome.status,
                        Status::Solved,
                        "{at}: {:?}",
                        run.outcome.measure
                    );
                }
            }
        }
    }
}
