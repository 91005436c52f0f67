//! Mixed problems: free variables in the basis, equalities that cannot be met.

use nonsmooth_linalg::{Dense, Matrix, norm};
use nonsmooth_problem::Mlcp;
use nonsmooth_problem::check::Certificate;
use nonsmooth_solve::complementarity::pivoting::Lemke;
use nonsmooth_solve::{Solve, Status};
use rand::RngExt;

use super::{BASES, plain, rng, run};

/// `A u + C v + a = 0`, `0 ≤ v ⟂ D u + B v + b ≥ 0` with a planted solution.
fn planted_mixed(
    free: usize,
    m: usize,
    mut entry: impl FnMut(usize, usize) -> f64,
    seed: u64,
) -> (Mlcp, Vec<f64>) {
    let n = free + m;
    let mut rng = rng(seed);
    let matrix = Matrix::from(Dense::from_fn(n, n, &mut entry));
    let mut z: Vec<f64> = (0..n).map(|_| rng.random_range(-1.0..1.0)).collect();
    let mut w = vec![0.0; n];
    for i in free..n {
        (z[i], w[i]) = (z[i].max(0.0), (-z[i]).max(0.0));
    }
    let mut q = vec![0.0; n];
    matrix.mul(&z, &mut q);
    q.iter_mut().zip(&w).for_each(|(q, w)| *q = w - *q);
    (Mlcp::new(matrix, q, free).unwrap(), z)
}

#[test]
fn free_variables_are_basic_whether_a_is_singular_or_not() {
    for (free, m) in [(1, 1), (3, 5), (20, 30), (30, 40)] {
        let n = free + m;
        let mut rng = rng(n as u64);
        let r = Dense::from_fn(n, n, |_, _| rng.random_range(-1.0..1.0_f64));
        let gram = |i: usize, j: usize| -> f64 {
            r.row(i).iter().zip(r.row(j)).map(|(x, y)| x * y).sum::<f64>() / n as f64
        };
        let skew = |i: usize, j: usize| r[(i, j)] - r[(j, i)];
        // A definite; A = 0, a saddle point; A of half the rank.
        let kinds: [Box<dyn Fn(usize, usize) -> f64>; 3] = [
            Box::new(|i, j| gram(i, j) + skew(i, j) + f64::from(u8::from(i == j))),
            Box::new(|i, j| match (i < free, j < free) {
                (true, true) => 0.0,
                (false, false) => gram(i, j) + f64::from(u8::from(i == j)),
                _ => skew(i, j),
            }),
            Box::new(|i, j| match (i < free, j < free) {
                (true, true) => f64::from(u8::from(i == j && i >= free.div_ceil(2))),
                (false, false) => gram(i, j) + f64::from(u8::from(i == j)),
                _ => skew(i, j),
            }),
        ];
        for (kind, entry) in kinds.iter().enumerate() {
            if kind > 0 && m < free {
                continue;
            }
            let (problem, z) = planted_mixed(free, m, entry, n as u64);
            for basis in BASES {
                let found = run(&problem, Lemke { basis, ..plain() });
                let what = format!("{free} + {m}, kind {kind}, {basis:?}");
                assert_eq!(found.outcome.status, Status::Solved, "{what}");
                // Elsewhere u need not be unique.
                let off: Vec<f64> = z.iter().zip(&found.z).map(|(a, b)| a - b).collect();
                assert!(kind > 0 || norm(&off) <= 1e-9 * norm(&z), "{what}");
            }
        }
    }
}

#[test]
fn equalities_that_cannot_be_met_are_refuted_or_named() {
    // u + v = 1 twice; then the second one says 2.
    let rows = [[1.0, 1.0, 1.0], [1.0, 1.0, 1.0], [0.0, 0.0, 1.0]];
    let matrix = || Dense::from_rows(&rows).unwrap();
    for basis in BASES {
        let settings = Lemke { basis, ..plain() };
        let redundant = Mlcp::new(matrix(), vec![-1.0, -1.0, 0.5], 2).unwrap();
        assert_eq!(run(&redundant, settings.clone()).outcome.status, Status::Solved, "{basis:?}");
        let contradictory = Mlcp::new(matrix(), vec![-1.0, -2.0, 0.5], 2).unwrap();
        let found = run(&contradictory, settings).outcome.status;
        assert!(
            found.refutes() && matches!(found.certificate(), Some(Certificate::Farkas { .. })),
            "{basis:?}: {found:?}"
        );
    }
}

#[test]
fn equalities_that_repeat_each_other_but_for_rounding_contradict_nothing() {
    // M = B Bᵀ of a rank below the number of free variables: most of these are not determined, and their equations follow from the others.
    let (free, pairs, rank) = (40, 40, 13);
    let mut rng = rng(3);
    let b = Dense::from_fn(free + pairs, rank, |_, _| rng.random_range(-1.0..1.0_f64));
    let gram = |i: usize, j: usize| b.row(i).iter().zip(b.row(j)).map(|(x, y)| x * y).sum::<f64>();
    let (problem, _) = planted_mixed(free, pairs, gram, 4);
    let found = run(&problem, plain());
    assert!(!found.outcome.status.refutes(), "{:?}", found.outcome.status);
    let answer = Solve::new().time_limit(10.0).run(&problem).unwrap();
    assert_eq!(answer.status, Status::Solved, "{:#?}", answer.account);
    let names = ["lemke", "ip_mehrotra", " "];
    let cheap = |line: &String| names.iter().any(|name| line.starts_with(name));
    assert!(answer.account.iter().all(cheap), "{:#?}", answer.account);
}
