//! Mixed problems, square and of any shape; what a method refuses.

use nonsmooth_linalg::{Csc, Dense, Matrix};
use nonsmooth_problem::check::Certificate;
use nonsmooth_problem::planted::classics;
use nonsmooth_problem::{Lcp, Mlcp};
use nonsmooth_solve::Status;
use nonsmooth_solve::complementarity::pivoting::all_solutions;
use rand::{RngExt, SeedableRng};
use rand_pcg::Pcg64;

use super::{ALL, close, from, p_matrix, solve};

/// A mixed problem with a planted solution, A nonsingular or zero.
#[test]
fn mixed_problems() {
    let mut rng = Pcg64::seed_from_u64(7);
    for n in [1, 3, 6, 20] {
        for m in [1, 4, 8, 30] {
            for saddle in [false, true] {
                if saddle && n > m {
                    continue;
                }
                let size = n + m;
                let base = p_matrix(size, &mut rng);
                let mut matrix = base.clone();
                if saddle {
                    // [0 C; −Cᵀ B], B definite: A is singular.
                    for i in 0..n {
                        for j in 0..n {
                            matrix[(i, j)] = 0.0;
                        }
                        for j in n..size {
                            matrix[(j, i)] = -base[(i, j)];
                        }
                    }
                } else if n > 1 {
                    // Rows of A in another order: no usable diagonal.
                    for j in 0..size {
                        matrix[(0, j)] = base[(n - 1, j)];
                        matrix[(n - 1, j)] = base[(0, j)];
                    }
                }
                let mut z: Vec<f64> = (0..size).map(|_| rng.random_range(-1.0..1.0)).collect();
                let mut w = vec![0.0; size];
                for i in n..size {
                    w[i] = (-z[i]).max(0.0);
                    z[i] = z[i].max(0.0);
                }
                if saddle {
                    // As many z as equations are needed for a solution to be regular.
                    for i in n..(2 * n).min(size) {
                        (z[i], w[i]) = (1.0, 0.0);
                    }
                }
                let product =
                    |i: usize| matrix.row(i).iter().zip(&z).map(|(m, z)| m * z).sum::<f64>();
                let q = (0..size).map(|i| w[i] - product(i)).collect();
                let problem = Mlcp::new(matrix.clone(), q, n).unwrap();
                for name in ALL {
                    if (m > 8 && ["enumeration", "murty", "criss_cross"].contains(&name))
                        || (saddle && ["murty", "bard", "block_pivoting"].contains(&name))
                    {
                        continue;
                    }
                    let solved = solve(name, &[], &problem);
                    let said = &solved.outcome.status;
                    assert_eq!(solved.status(), "solved", "{name} {n} {m} {saddle}: {said}");
                    assert!(close(&solved.z, &z, 1e-7), "{name} {n} {m} {saddle}");
                }
            }
        }
    }
}

#[test]
fn mixed_problems_of_any_shape() {
    // Two equal equations for one free variable: u + v = 1, 0 ≤ v ⟂ u ≥ 0.
    let m = Dense::from_rows(&[[1.0, 1.0], [1.0, 1.0], [1.0, 0.0]]).unwrap();
    let more = Mlcp::rectangular(m, vec![-1.0, -1.0, 0.0], 2, 1).unwrap();
    assert_eq!(solve("enumeration", &[], &more).status(), "solved");
    assert!(from("murty", &[], &more, vec![0.0; 2]).is_err_and(|e| e.is_inapplicable()));
    let mut both: Vec<_> =
        all_solutions(&more, 10).unwrap().isolated().map(|f| f.z.clone()).collect();
    both.sort_by(|a, b| a[0].total_cmp(&b[0]));
    assert!(close(&both[0], &[0.0, 1.0], 1e-14) && close(&both[1], &[1.0, 0.0], 1e-14));

    // Equations that contradict each other.
    let m = Dense::from_rows(&[[1.0, 1.0], [1.0, 1.0], [1.0, 0.0]]).unwrap();
    let none = Mlcp::rectangular(m, vec![-1.0, -2.0, 0.0], 2, 1).unwrap();
    let solved = solve("enumeration", &[], &none);
    assert!(matches!(solved.outcome.status, Status::Infeasible(_)));
    let certificate = solved.outcome.status.certificate();
    assert!(matches!(certificate, Some(Certificate::Farkas { .. })));

    // One equation for two free variables: a line of solutions.
    let m = Dense::from_rows(&[[1.0, 2.0, 0.0], [0.0, 0.0, 1.0]]).unwrap();
    let fewer = Mlcp::rectangular(m, vec![-1.0, -1.0], 1, 2).unwrap();
    assert_eq!(solve("enumeration", &[], &fewer).status(), "solved");
    let found = all_solutions(&fewer, 10).unwrap();
    assert_eq!((found.isolated().count(), found.families().next().unwrap().dimension), (0, 1));

    // An equation without entries: 0 = 0 is dropped, 0 = 1 is a contradiction.
    let m = Dense::from_rows(&[[0.0, 0.0], [0.0, 1.0]]).unwrap();
    let empty = Mlcp::new(m.clone(), vec![0.0, -1.0], 1).unwrap();
    let impossible = Mlcp::new(m, vec![1.0, -1.0], 1).unwrap();
    for name in ["murty", "bard", "criss_cross", "keller", "enumeration"] {
        assert_eq!(solve(name, &[], &empty).status(), "solved", "{name}");
        assert_eq!(solve(name, &[], &impossible).status(), "infeasible", "{name}");
    }
    // A free variable that only a pair's row mentions: the tableau methods say so.
    let m = Dense::from_rows(&[[0.0, 0.0], [1.0, 1.0]]).unwrap();
    let loose = Mlcp::new(m, vec![0.0, -1.0], 1).unwrap();
    assert!(from("keller", &[], &loose, vec![0.0; 2]).is_err_and(|e| e.is_inapplicable()));
    assert_eq!(solve("enumeration", &[], &loose).status(), "solved");
}

#[derive(Debug)]
struct Products;

impl nonsmooth_linalg::Operator for Products {
    fn nrows(&self) -> usize {
        2
    }
    fn ncols(&self) -> usize {
        2
    }
    fn mul(&self, x: &[f64], y: &mut [f64]) {
        y.copy_from_slice(x);
    }
    fn mul_transpose(&self, x: &[f64], y: &mut [f64]) {
        y.copy_from_slice(x);
    }
}

#[test]
fn what_does_not_apply_says_so() {
    let operator =
        Lcp::new(Matrix::Operator(std::sync::Arc::new(Products)), vec![-1.0; 2]).unwrap();
    for name in ALL {
        let refused = from(name, &[], &operator, vec![0.0; 2]);
        assert!(refused.is_err_and(|e| e.is_inapplicable()), "{name}");
    }
    let refused = from("enumeration", &["max_pairs=5"], &classics::fathi(6).problem, vec![0.0; 6]);
    assert!(refused.is_err_and(|e| e.to_string().contains("few complementary pairs")));
    let big = Csc::diagonal(&vec![1.0; 100_000]);
    let big = Lcp::new(big, vec![-1.0; 100_000]).unwrap();
    for name in ["murty", "bard", "criss_cross", "keller"] {
        let refused = from(name, &[], &big, vec![0.0; 100_000]);
        assert!(refused.is_err_and(|e| e.is_inapplicable()), "{name}");
    }
    assert_eq!(solve("block_pivoting", &[], &big).status(), "solved");
}
