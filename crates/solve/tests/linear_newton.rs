//! Semismooth Newton methods on linear complementarity problems: known solutions, planted ones, cycling matrices, every shape of mixed problem.

use nonsmooth_linalg::{Csc, Dense, Matrix, Operator, SquareLu};
use nonsmooth_problem::check::Judged;
use nonsmooth_problem::{BoxLcp, Lcp, LcpPoint, Mlcp, Problem};
use nonsmooth_solve::registry::{self, Registered};
use nonsmooth_solve::settings::from_texts;
use nonsmooth_solve::{Limits, Outcome, Status};
use rand::{RngExt, SeedableRng};
use rand_pcg::Pcg64;

const METHODS: [&str; 3] = ["newton_min", "newton_fb", "newton_pfb"];

fn solve_with<P: Registered + Problem<Point = LcpPoint>>(
    name: &str,
    settings: &[&str],
    problem: &P,
    start: &[f64],
    tolerance: f64,
) -> (Outcome, Vec<f64>, Vec<String>) {
    let mut session = registry::session::<P>(name, &from_texts(settings).unwrap()).unwrap();
    let mut point = LcpPoint { z: start.to_vec() };
    let limits = Limits { tolerance, max_iterations: 500, ..Limits::default() };
    let outcome = session.solve(problem, &mut point, &limits, &mut |_| {}).unwrap();
    (outcome, point.z, session.account())
}

/// The solution found at 1e-12, the judge agreeing.
fn solve<P: Registered + Problem<Point = LcpPoint> + Judged>(
    name: &str,
    problem: &P,
    what: &str,
) -> (Vec<f64>, usize) {
    let (outcome, z, account) = solve_with(name, &[], problem, &problem.origin().z, 1e-12);
    if std::env::var_os("NEWTON_TALK").is_some() {
        println!(
            "{name:10} {what:40} {:4} steps {:4} factorisations {:?} {:.1e} {account:?}",
            outcome.iterations,
            outcome.factorisations,
            outcome.status.name(),
            outcome.measure.merit()
        );
    }
    assert_eq!(outcome.status, Status::Solved, "{name} {what}: {:?} {account:?}", outcome.measure);
    assert!(problem.judge(&LcpPoint { z: z.clone() }, 1e-12).unwrap().solved, "{name} {what}");
    (z, outcome.iterations)
}

fn close(found: &[f64], known: &[f64], tolerance: f64, what: &str) {
    let size = known.iter().fold(0.0_f64, |m, x| m.max(x.abs()));
    for (i, (a, b)) in found.iter().zip(known).enumerate() {
        assert!((a - b).abs() <= tolerance * size, "{what}: z[{i}] = {a}, known {b}");
    }
}

// ------------------------------------------------------------------------------------------ known solutions

/// Unit upper triangular with 2 above the diagonal.
fn murty(n: usize) -> Dense {
    Dense::from_fn(n, n, |i, j| match i.cmp(&j) {
        std::cmp::Ordering::Equal => 1.0,
        std::cmp::Ordering::Less => 2.0,
        std::cmp::Ordering::Greater => 0.0,
    })
}

fn transposed(a: &Dense) -> Dense {
    Dense::from_fn(a.ncols(), a.nrows(), |i, j| a[(j, i)])
}

fn times(a: &Dense, b: &Dense) -> Dense {
    Dense::from_fn(a.nrows(), b.ncols(), |i, j| (0..a.ncols()).map(|k| a[(i, k)] * b[(k, j)]).sum())
}

fn rows(rows: &[&[f64]]) -> Dense {
    Dense::from_rows(rows).unwrap()
}

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

// ------------------------------------------------------------------------------------------------ planted

#[derive(Debug, Clone, Copy, PartialEq)]
enum Class {
    /// Symmetric positive definite.
    Spd,
    /// `AᵀA + skew + diagonal`.
    Definite,
    /// `Bᵀ B` of half the rank: w is unique, z is not.
    Semidefinite,
    /// Tridiagonal M-matrix.
    Z,
    /// Triangular with positive diagonal, far from symmetric.
    Triangular,
    /// `[H −Aᵀ; A 0]`, H semidefinite.
    Kkt,
}

fn random(rng: &mut Pcg64) -> f64 {
    rng.random_range(-1.0..1.0)
}

fn matrix(class: Class, n: usize, rng: &mut Pcg64) -> Dense {
    let scale = (n as f64).sqrt();
    let g = Dense::from_fn(n, n, |_, _| random(rng) / scale);
    let thin = Dense::from_fn(n.div_ceil(2), n, |_, _| random(rng) / scale);
    match class {
        Class::Spd => {
            let mut m = times(&transposed(&g), &g);
            (0..n).for_each(|i| m[(i, i)] += 0.1);
            m
        }
        Class::Definite => {
            let mut m = times(&transposed(&g), &g);
            for i in 0..n {
                for j in 0..i {
                    let s = 2.0 * random(rng) / scale;
                    m[(i, j)] += s;
                    m[(j, i)] -= s;
                }
                m[(i, i)] += 0.3 * rng.random::<f64>();
            }
            m
        }
        Class::Semidefinite => times(&transposed(&thin), &thin),
        Class::Z => Dense::from_fn(n, n, |i, j| match i.abs_diff(j) {
            0 => 2.0,
            1 => -1.0,
            _ => 0.0,
        }),
        Class::Triangular => Dense::from_fn(n, n, |i, j| match i.cmp(&j) {
            std::cmp::Ordering::Equal => 1.0,
            std::cmp::Ordering::Less => 3.0 * g[(i, j)],
            std::cmp::Ordering::Greater => 0.0,
        }),
        Class::Kkt => {
            let k = n / 3;
            let h = times(&transposed(&thin), &thin);
            Dense::from_fn(n, n, |i, j| match (i < n - k, j < n - k) {
                (true, true) => h[(i, j)],
                (true, false) => -g[(j, i)] * scale,
                (false, true) => g[(i, j)] * scale,
                (false, false) => 0.0,
            })
        }
    }
}

/// Planted z and w, of which a part is zero on both sides.
fn plant(n: usize, degenerate: f64, rng: &mut Pcg64) -> (Vec<f64>, Vec<f64>) {
    (0..n)
        .map(|_| {
            let size = rng.random_range(1.0..2.0);
            if rng.random::<f64>() < degenerate {
                (0.0, 0.0)
            } else if rng.random::<f64>() < 0.5 {
                (size, 0.0)
            } else {
                (0.0, size)
            }
        })
        .unzip()
}

fn product(m: &Dense, z: &[f64]) -> Vec<f64> {
    let mut w = vec![0.0; m.nrows()];
    Matrix::from(m.clone()).mul(z, &mut w);
    w
}

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

// ------------------------------------------------------------------------------- two bounds, mixed, rectangular

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

// ------------------------------------------------------------------------------------------------- large

/// The five-point Laplacian on k × k inner points of the unit square.
fn laplacian(k: usize) -> Csc {
    let at = |i: usize, j: usize| i * k + j;
    let entries = (0..k * k).flat_map(|p| {
        let (i, j) = (p / k, p % k);
        let mut near = vec![(p, p, 4.0)];
        if i > 0 {
            near.push((p, at(i - 1, j), -1.0));
        }
        if i + 1 < k {
            near.push((p, at(i + 1, j), -1.0));
        }
        if j > 0 {
            near.push((p, at(i, j - 1), -1.0));
        }
        if j + 1 < k {
            near.push((p, at(i, j + 1), -1.0));
        }
        near
    });
    Csc::from_triplets(k * k, k * k, entries).unwrap()
}

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

// ------------------------------------------------------------------------------------------ what they say

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

// ------------------------------------------------------------------------------------------------ corpus

/// All numbers of a file, from the first line of the format on.
fn numbers(path: &std::path::Path) -> Vec<f64> {
    let text = std::fs::read_to_string(path).unwrap();
    text.split_whitespace().map_while(|t| t.parse().ok()).collect()
}

/// Siconos' dense text format: numbers column by column.
fn siconos_lcp(path: &std::path::Path) -> Option<Lcp> {
    let x = numbers(path);
    let n = x[0] as usize;
    if x[1] != 0.0 || x.len() < 6 + n * n + n {
        return None;
    }
    let m = Dense::from_fn(n, n, |i, j| x[6 + j * n + i]);
    Lcp::new(m, x[6 + n * n..6 + n * n + n].to_vec()).ok()
}

/// The same for mixed problems: `1 1 n m`, the blocks of rows, then the matrix as above.
fn siconos_mlcp(path: &std::path::Path) -> Option<Mlcp> {
    let x = numbers(path);
    let (free, pairs) = (x[2] as usize, x[3] as usize);
    let n = free + pairs;
    if [x[0], x[9], x[10], x[11]] != [1.0, 0.0, n as f64, n as f64] {
        return None;
    }
    let m = Dense::from_fn(n, n, |i, j| x[14 + j * n + i]);
    Mlcp::new(m, x[14 + n * n..14 + n * n + n].to_vec(), free).ok()
}

/// Every method on every file of a folder of the corpus; what it did not solve.
fn corpus<P: Registered + Problem<Point = LcpPoint>>(
    folder: &str,
    read: impl Fn(&std::path::Path) -> Option<P>,
) -> Option<(usize, Vec<String>)> {
    let Some(root) = std::env::var_os("NONSMOOTH_CORPUS") else {
        println!("skipped: NONSMOOTH_CORPUS is not set");
        return None;
    };
    let folder = std::path::Path::new(&root).join(folder);
    let (mut count, mut unsolved) = (0, vec![]);
    for entry in std::fs::read_dir(folder).unwrap() {
        let path = entry.unwrap().path();
        let file = path.file_name().unwrap().to_string_lossy().into_owned();
        let Some(problem) = read(&path) else { continue };
        count += 1;
        for name in METHODS {
            let (outcome, _, account) = solve_with(name, &[], &problem, &problem.origin().z, 1e-10);
            println!("{name:10} {file:36} {:4} {} {account:?}", outcome.iterations, outcome.status);
            if outcome.status != Status::Solved {
                unsolved.push(format!("{name} {file}: {}", outcome.status));
            }
        }
    }
    Some((count, unsolved))
}

#[test]
fn corpus_lcp() {
    let Some((count, unsolved)) = corpus("lcp", siconos_lcp) else { return };
    assert!(count >= 14, "{count} problems");
    let impossible = |u: &String| u.contains("Pang_isolated_sol_perturbed.dat: infeasible");
    assert!(unsolved.iter().all(impossible), "{unsolved:#?}");
}

#[test]
fn corpus_mlcp() {
    let Some((count, unsolved)) = corpus("mlcp", siconos_mlcp) else { return };
    assert!(count >= 17, "{count} problems");
    // Rows of 1e-12 beside rows of 1: what the merit of the whole does not see, the componentwise judge does. `newton_min` solves them.
    let spread = |u: &String| u.contains("Buck") && !u.starts_with("newton_min");
    assert!(unsolved.iter().all(spread), "{unsolved:#?}");
}
