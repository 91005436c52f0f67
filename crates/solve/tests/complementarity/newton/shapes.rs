//! Two bounds, free variables, more rows than columns; operators are refused.

use nonsmooth_linalg::{Dense, Matrix, Operator};
use nonsmooth_problem::{BoxLcp, Lcp, Mlcp, Problem};
use nonsmooth_solve::Limits;
use nonsmooth_solve::registry::{self};
use nonsmooth_solve::settings::from_texts;
use rand::{RngExt, SeedableRng};
use rand_pcg::Pcg64;

use super::{Class, METHODS, close, matrix, plant, product, random, solve};

#[test]
fn two_bounds() {
    for class in [Class::Spd, Class::Definite, Class::Semidefinite, Class::Triangular] {
        for (n, seed) in [(1, 0), (6, 1), (40, 2), (40, 3), (120, 4)] {
            let mut rng = Pcg64::seed_from_u64(seed);
            let m = matrix(class, n, &mut rng);
            let (mut lower, mut upper, mut z, mut w) = (vec![], vec![], vec![], vec![]);
            for i in 0..n {
                let (l, gap) = (3.0 * random(&mut rng), rng.random_range(0.5..2.0));
                let size = rng.random_range(0.5..1.0);
                // Every kind of bounds, and every place between them, degenerate ones included.
                let (l, u) = match i % 5 {
                    0 => (l, l + gap),
                    1 => (l, f64::INFINITY),
                    2 => (f64::NEG_INFINITY, l),
                    3 => (f64::NEG_INFINITY, f64::INFINITY),
                    _ => (l, if i % 2 == 0 { l } else { l + gap }),
                };
                let (at, force) = match rng.random_range(0..4) {
                    0 if l.is_finite() => (l, size),
                    1 if u.is_finite() => (u, -size),
                    2 if l.is_finite() => (l, 0.0),
                    _ if l == u => (l, -size),
                    _ if l.is_finite() && u.is_finite() => (0.5 * (l + u), 0.0),
                    _ if l.is_finite() => (l + size, 0.0),
                    _ if u.is_finite() => (u - size, 0.0),
                    _ => (size, 0.0),
                };
                lower.push(l);
                upper.push(u);
                z.push(at);
                w.push(force);
            }
            let q: Vec<f64> = w.iter().zip(product(&m, &z)).map(|(w, x)| w - x).collect();
            let problem = BoxLcp::new(m, q, lower, upper).unwrap();
            for name in METHODS {
                let what = format!("box {class:?} n = {n} seed {seed}");
                let found = solve(name, &problem, &what).0;
                if class != Class::Semidefinite {
                    close(&found, &z, 1e-8, &format!("{name} {what}"));
                }
            }
        }
    }
}

/// The three functions on `[A C; D B]`; sparse and dense; A regular, and A = 0 (a saddle point).
#[test]
fn mixed_problems() {
    for saddle in [false, true] {
        for (free, pairs, seed) in [(1, 1, 0), (3, 8, 1), (10, 30, 2), (30, 90, 3)] {
            let mut rng = Pcg64::seed_from_u64(seed);
            let n = free + pairs;
            let mut m = matrix(Class::Definite, n, &mut rng);
            if saddle {
                // [0 C; −Cᵀ B], B definite.
                for i in 0..free {
                    for j in 0..n {
                        let x = if j < free { 0.0 } else { random(&mut rng) };
                        (m[(i, j)], m[(j, i)]) = (x, -x);
                    }
                }
            }
            let (mut z, mut w) = plant(n, 0.1, &mut rng);
            for i in 0..free {
                (z[i], w[i]) = (random(&mut rng), 0.0);
            }
            let q: Vec<f64> = w.iter().zip(product(&m, &z)).map(|(w, x)| w - x).collect();
            for m in [Matrix::from(m.clone()), m.to_csc().into()] {
                let problem = Mlcp::new(m, q.clone(), free).unwrap();
                for name in METHODS {
                    let what = format!("mixed {free} + {pairs} saddle {saddle}");
                    let found = solve(name, &problem, &what).0;
                    close(&found[free..], &z[free..], 1e-7, &format!("{name} {what}"));
                }
            }
        }
    }
}

/// More equalities than free variables (consistent ones), and fewer.
#[test]
fn rectangular_problems() {
    for (equalities, free, pairs) in [(6, 3, 10), (3, 6, 10), (0, 2, 5), (4, 0, 8)] {
        for seed in 0..3 {
            let mut rng = Pcg64::seed_from_u64(seed);
            let b = matrix(Class::Definite, pairs, &mut rng);
            let m = Dense::from_fn(equalities + pairs, free + pairs, |i, j| {
                if i >= equalities && j >= free {
                    b[(i - equalities, j - free)]
                } else {
                    random(&mut rng)
                }
            });
            let (v, f) = plant(pairs, 0.0, &mut rng);
            let z: Vec<f64> = (0..free).map(|_| random(&mut rng)).chain(v).collect();
            let w: Vec<f64> = vec![0.0; equalities].into_iter().chain(f).collect();
            let q: Vec<f64> = w.iter().zip(product(&m, &z)).map(|(w, x)| w - x).collect();
            for m in [Matrix::from(m.clone()), m.to_csc().into()] {
                let problem = Mlcp::rectangular(m, q.clone(), equalities, free).unwrap();
                for name in METHODS {
                    solve(name, &problem, &format!("{equalities} × {free} + {pairs} seed {seed}"));
                }
            }
        }
    }
}

#[derive(Debug)]
struct Twice;

impl Operator for Twice {
    fn nrows(&self) -> usize {
        2
    }
    fn ncols(&self) -> usize {
        2
    }
    fn mul(&self, x: &[f64], y: &mut [f64]) {
        (y[0], y[1]) = (2.0 * x[0], 2.0 * x[1]);
    }
    fn mul_transpose(&self, x: &[f64], y: &mut [f64]) {
        self.mul(x, y);
    }
}

#[test]
fn refusals() {
    let m = Matrix::Operator(std::sync::Arc::new(Twice));
    let problem = Lcp::new(m, vec![-1.0, 1.0]).unwrap();
    for name in METHODS {
        let mut session = registry::session::<Lcp>(name, &Default::default()).unwrap();
        let refused =
            session.solve(&problem, &mut problem.origin(), &Limits::default(), &mut |_| {});
        let said = refused.unwrap_err().to_string();
        assert!(said.contains("the entries of M") && said.contains("operator"), "{said}");
    }
    let error = registry::session::<Lcp>("newton_pfb", &from_texts(&["lambda=0"]).unwrap());
    let said = error.err().unwrap().to_string();
    assert!(said.contains("lambda") && said.contains("(0, 1]"), "{said}");
}
