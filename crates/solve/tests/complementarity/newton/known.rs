//! Known solutions, and the matrices on which the plain method cycles.

use nonsmooth_linalg::{Dense, Matrix, SquareLu};
use nonsmooth_problem::Lcp;
use nonsmooth_solve::Status;

use super::{METHODS, close, murty, product, rows, solve, solve_with};
use crate::common::{times, transposed};

fn unit(n: usize, i: usize, x: f64) -> Vec<f64> {
    (0..n).map(|k| if k == i { x } else { 0.0 }).collect()
}

#[test]
fn known_solutions() {
    let ones = |n: usize| vec![-1.0; n];
    let u = murty(16);
    let tridiagonal = |n, sub: f64, over: f64| {
        Dense::from_fn(n, n, |i, j| match (i + 1).wrapping_sub(j) {
            1 => 4.0,
            2 => sub,
            0 => over,
            _ => 0.0,
        })
    };
    let ahn = [0.407637, 0.315273, 0.334365, 0.326367, 0.319917, 0.303019, 0.265996, 0.183501];
    let gk = [0.366013, 0.464052, 0.490196, 0.496732, 0.496732, 0.490196, 0.464052, 0.366013];
    let floudas = rows(&[
        &[11.0, 0.0, 10.0, -1.0],
        &[0.0, 11.0, 10.0, -1.0],
        &[10.0, 10.0, 21.0, -1.0],
        &[1.0, 1.0, 1.0, 0.0],
    ]);
    // Name, M, q, z, and the digits that M's condition leaves.
    type Case = (&'static str, Dense, Vec<f64>, Vec<f64>, f64);
    let cases: Vec<Case> = vec![
        ("murty", u.clone(), ones(16), unit(16, 15, 1.0), 1e-12),
        ("murty transposed", transposed(&u), ones(16), unit(16, 0, 1.0), 1e-12),
        ("fathi", times(&transposed(&u), &u), ones(16), unit(16, 0, 1.0), 1e-9),
        ("fathi reversed", times(&u, &transposed(&u)), ones(16), unit(16, 15, 1.0), 1e-9),
        (
            "kostreva",
            rows(&[&[1.0, 2.0, 0.0], &[0.0, 1.0, 2.0], &[2.0, 0.0, 1.0]]),
            ones(3),
            vec![1.0 / 3.0; 3],
            1e-12,
        ),
        (
            "deudeu",
            rows(&[&[2.0, 1.0], &[1.0, 2.0]]),
            vec![-5.0, -6.0],
            vec![4.0 / 3.0, 7.0 / 3.0],
            1e-12,
        ),
        ("ahn", tridiagonal(8, 1.0, -2.0), ones(8), ahn.to_vec(), 2e-6),
        ("geiger-kanzow", tridiagonal(8, -1.0, -1.0), ones(8), gk.to_vec(), 2e-6),
        (
            "floudas 10.2.9",
            floudas.clone(),
            vec![50.0, 50.0, 10.0, -6.0],
            vec![2.0, 2.0, 2.0, 92.0],
            1e-12,
        ),
        (
            "floudas 10.2.9 at 100",
            floudas,
            vec![50.0, 50.0, 100.0, -6.0],
            vec![3.0, 3.0, 0.0, 83.0],
            1e-12,
        ),
        (
            "ortiz",
            rows(&[
                &[3.0, 1.0, 0.0, -1.0],
                &[-1.0, 2.0, 1.0, 1.0],
                &[0.0, 1.0, 3.0, -1.0],
                &[0.0, 0.0, 1.0, 2.0],
            ]),
            vec![-2.0, 1.0, -1.0, 1.0],
            vec![2.0 / 3.0, 0.0, 1.0 / 3.0, 0.0],
            1e-12,
        ),
        (
            "path manual",
            rows(&[
                &[0.0, 0.0, -1.0, -1.0],
                &[0.0, 0.0, 1.0, -2.0],
                &[1.0, -1.0, 2.0, -2.0],
                &[1.0, 2.0, -2.0, 4.0],
            ]),
            vec![2.0, 2.0, -2.0, -6.0],
            vec![2.8, 0.0, 0.8, 1.2],
            1e-12,
        ),
        (
            "murty 2.8",
            rows(&[
                &[1.0, -1.0, -1.0, -1.0],
                &[-1.0, 1.0, -1.0, -1.0],
                &[1.0, 1.0, 2.0, 0.0],
                &[1.0, 1.0, 0.0, 2.0],
            ]),
            vec![3.0, 5.0, -9.0, -5.0],
            vec![2.0, 1.0, 3.0, 1.0],
            1e-12,
        ),
    ];
    for (what, m, q, z, tolerance) in cases {
        for name in METHODS {
            for m in [Matrix::from(m.clone()), m.to_csc().into()] {
                let problem = Lcp::new(m, q.clone()).unwrap();
                close(&solve(name, &problem, what).0, &z, tolerance, &format!("{name} {what}"));
            }
        }
    }
}

/// Ben Gharbia and Gilbert: P-matrices on which the plain Newton method on the minimum cycles.
fn cycling(n: usize) -> Dense {
    let mut m = Dense::from_fn(n, n, |i, j| f64::from(u8::from(i == j)));
    if n % 2 == 1 {
        (1..n).for_each(|i| m[(i, i - 1)] = 2.0);
        m[(0, n - 1)] = 2.0;
    } else {
        let (alpha, beta) = (4.0 / 3.0, 0.5);
        for i in 0..n {
            m[(i, (i + n - 1) % n)] = alpha;
            m[(i, (i + n - 2) % n)] = beta;
        }
    }
    m
}

fn inverse(a: &Dense) -> Dense {
    let n = a.nrows();
    let mut lu = SquareLu::default();
    lu.factorise(&a.clone().into()).unwrap();
    let mut columns: Vec<Vec<f64>> = (0..n).map(|j| unit(n, j, 1.0)).collect();
    columns.iter_mut().for_each(|c| lu.solve(c));
    Dense::from_fn(n, n, |i, j| columns[j][i])
}

/// With z and w exchanged, so that the solution is `z = e` and no projection on the quadrant finds it by chance.
#[test]
fn the_plain_minimum_cycles_and_the_globalised_one_does_not() {
    for n in 3..=11 {
        let m = inverse(&cycling(n));
        let q: Vec<f64> = product(&m, &vec![-1.0; n]);
        let problem = Lcp::new(m, q).unwrap();
        // From the complementary basis {1} of the problem in w and z, where the cycle is: w = (−1, 0, …), z = e + M' w.
        let w: Vec<f64> = unit(n, 0, -1.0);
        let start: Vec<f64> = product(&cycling(n), &w).iter().map(|x| 1.0 + x).collect();
        let plain = ["line_search=none", "restarts=0"];
        let (outcome, ..) = solve_with("newton_min", &plain, &problem, &start, 1e-10);
        assert_ne!(outcome.status, Status::Solved, "n = {n}");
        for name in METHODS {
            for rule in ["nonmonotone", "armijo"] {
                let rule = format!("line_search={rule}");
                let (outcome, z, _) = solve_with(name, &[&rule], &problem, &start, 1e-12);
                assert_eq!(outcome.status, Status::Solved, "{name} n = {n}");
                assert!(z.iter().all(|z| (z - 1.0).abs() < 1e-11));
                assert!(outcome.iterations < 60, "{name} n = {n}: {}", outcome.iterations);
            }
        }
    }
}
