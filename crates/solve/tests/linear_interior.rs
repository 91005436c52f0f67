//! Interior points and the convex QP on linear complementarity problems: planted, classic, degenerate, infeasible and badly scaled ones.

use nonsmooth_linalg::{Csc, Dense, Matrix, norm};
use nonsmooth_problem::check::Certificate;
use nonsmooth_problem::{BoxLcp, Hlcp, HlcpPoint, Lcp, LcpPoint, Mlcp, Problem};
use nonsmooth_solve::registry::{self, Registered};
use nonsmooth_solve::settings::from_texts;
use nonsmooth_solve::trace::{PathPoint, Trace};
use nonsmooth_solve::{Limits, Outcome, Status};

const BOTH: [&str; 2] = ["ip_mty", "ip_mehrotra"];
const ALL: [&str; 3] = ["ip_mty", "ip_mehrotra", "qp"];

/// Numbers that look random and are the same everywhere.
struct Numbers(u64);

impl Numbers {
    fn bits(&mut self) -> u64 {
        self.0 = self.0.wrapping_add(0x9e37_79b9_7f4a_7c15);
        let mut x = self.0;
        x = (x ^ (x >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
        x = (x ^ (x >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
        x ^ (x >> 31)
    }

    fn within(&mut self, low: f64, high: f64) -> f64 {
        low + (high - low) * (self.bits() >> 11) as f64 / (1u64 << 53) as f64
    }

    fn dense(&mut self, rows: usize, columns: usize) -> Dense {
        Dense::from_fn(rows, columns, |_, _| self.within(-1.0, 1.0))
    }
}

fn times(a: &Dense, b: &Dense) -> Dense {
    Dense::from_fn(a.nrows(), b.ncols(), |i, j| (0..a.ncols()).map(|k| a[(i, k)] * b[(k, j)]).sum())
}

fn transposed(a: &Dense) -> Dense {
    Dense::from_fn(a.ncols(), a.nrows(), |i, j| a[(j, i)])
}

struct Run<T> {
    outcome: Outcome,
    point: T,
    path: Vec<PathPoint>,
    account: Vec<String>,
}

fn run_from<P: Problem + Registered>(
    problem: &P,
    name: &str,
    settings: &[&str],
    tolerance: f64,
    mut point: P::Point,
) -> Run<P::Point> {
    let settings = from_texts(settings).unwrap();
    let mut session = registry::session::<P>(name, &settings).unwrap();
    let limits = Limits { tolerance, max_iterations: 2000, trace: true, ..Limits::default() };
    let outcome = session.solve(problem, &mut point, &limits, &mut |_| {}).unwrap();
    let path = match session.trace() {
        Trace::Path(rows) => rows,
        _ => vec![],
    };
    Run { outcome, point, path, account: session.account() }
}

fn run<P: Problem + Registered>(problem: &P, name: &str, tolerance: f64) -> Run<P::Point> {
    run_from(problem, name, &[], tolerance, problem.origin())
}

/// q such that z and w obey the law, `share` of the pairs with both zero; (z, w, q).
fn planted(m: &Matrix, share: f64, numbers: &mut Numbers) -> (Vec<f64>, Vec<f64>, Vec<f64>) {
    let n = m.nrows();
    let (mut z, mut w) = (vec![0.0; n], vec![0.0; n]);
    for i in 0..n {
        let side = numbers.within(0.0, 1.0);
        if side > 0.5 + 0.5 * share {
            z[i] = numbers.within(1.0, 2.0);
        } else if side < 0.5 - 0.5 * share {
            w[i] = numbers.within(1.0, 2.0);
        }
    }
    let mut mz = vec![0.0; n];
    m.mul(&z, &mut mz);
    let q = w.iter().zip(&mz).map(|(w, mz)| w - mz).collect();
    (z, w, q)
}

/// Symmetric positive semidefinite of rank r, with a diagonal added.
fn gram(n: usize, r: usize, diagonal: f64, numbers: &mut Numbers) -> Dense {
    let a = numbers.dense(n, r);
    let mut m = times(&a, &transposed(&a));
    (0..n).for_each(|i| m[(i, i)] += diagonal);
    m
}

/// A diagonal and a skew part.
fn skew(n: usize, diagonal: f64, numbers: &mut Numbers) -> Dense {
    let a = numbers.dense(n, n);
    Dense::from_fn(n, n, |i, j| a[(i, j)] - a[(j, i)] + if i == j { diagonal } else { 0.0 })
}

fn off(a: &[f64], b: &[f64]) -> f64 {
    a.iter().zip(b).fold(0.0, |l, (a, b)| l.max((a - b).abs()))
}

fn w_of(problem: &Lcp, z: &[f64]) -> Vec<f64> {
    let mut w = vec![0.0; z.len()];
    problem.M.mul(z, &mut w);
    w.iter_mut().zip(&problem.q).for_each(|(w, q)| *w += q);
    w
}

#[test]
fn planted_monotone_problems_are_solved_to_rounding() {
    for n in [1, 2, 5, 30, 120] {
        for seed in 0..4 {
            let numbers = &mut Numbers(seed + 1000 * n as u64);
            let cases: [(&str, Dense); 4] = [
                ("SPD", gram(n, n, 0.1, numbers)),
                ("PSD", gram(n, n.div_ceil(2), 0.0, numbers)),
                ("skew", skew(n, 0.0, numbers)),
                ("skew + 1", skew(n, 1.0, numbers)),
            ];
            for (class, m) in cases {
                for share in [0.0, 0.3, 1.0] {
                    let matrices = [Matrix::from(m.clone()), m.to_csc().into()];
                    let (z, w, q) = planted(&matrices[0], share, numbers);
                    for m in matrices {
                        let storage =
                            if matches!(m, Matrix::Dense(_)) { "dense" } else { "sparse" };
                        let problem = Lcp::new(m, q.clone()).unwrap();
                        for name in ALL {
                            let at = format!(
                                "{name}, {class}, {storage}, n = {n}, seed {seed}, share {share}"
                            );
                            let run = run(&problem, name, 1e-12);
                            assert_eq!(
                                run.outcome.status,
                                Status::Solved,
                                "{at}: {:?}",
                                run.outcome.measure
                            );
                            let most = if name == "ip_mty" { 120 } else { 60 };
                            assert!(
                                run.outcome.iterations <= most,
                                "{at}: {}",
                                run.outcome.iterations
                            );
                            let wrong = off(&w_of(&problem, &run.point.z), &w);
                            if class == "SPD" || class == "PSD" {
                                assert!(wrong < 1e-6, "{at}: w off by {wrong:.1e}");
                            }
                            if class == "SPD" || class == "skew + 1" {
                                let wrong = off(&run.point.z, &z);
                                assert!(wrong < 1e-6, "{at}: z off by {wrong:.1e}");
                            }
                        }
                    }
                }
            }
        }
    }
}

fn csizmadia(n: usize) -> Lcp {
    let m = Dense::from_fn(n, n, |i, j| match i.cmp(&j) {
        std::cmp::Ordering::Equal => 1.0,
        std::cmp::Ordering::Greater => -1.0,
        std::cmp::Ordering::Less => 0.0,
    });
    Lcp::new(m, vec![-1.0; n]).unwrap()
}

#[test]
fn csizmadias_problem_costs_what_its_handicap_says_and_is_solved_or_named() {
    for n in [3, 6, 10, 16, 24] {
        let problem = csizmadia(n);
        for name in BOTH {
            let run = run(&problem, name, 1e-10);
            println!(
                "Csizmadia n = {n}, {name}: {} in {}",
                run.outcome.status, run.outcome.iterations
            );
            assert!(
                matches!(run.outcome.status, Status::Solved | Status::Stalled(_)),
                "{:?}",
                run.outcome.status
            );
            if n <= 10 {
                assert_eq!(run.outcome.status, Status::Solved, "{name}, n = {n}");
                // z = 2^i: the whole is an M-matrix, all rows are equalities.
                for (i, z) in run.point.z.iter().enumerate() {
                    let exact = (i as f64).exp2();
                    assert!((z / exact - 1.0).abs() < 1e-9, "{name}: z[{i}] = {z}");
                }
            }
        }
    }
}

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

#[test]
fn the_path_stays_in_its_neighbourhood() {
    let numbers = &mut Numbers(5);
    for n in [10, 50, 200] {
        let m = Matrix::from(gram(n, n / 2, 0.0, numbers));
        let (_, _, q) = planted(&m, 0.2, numbers);
        let problem = Lcp::new(m, q).unwrap();
        let narrow = run(&problem, "ip_mty", 1e-12);
        let wide = run(&problem, "ip_mehrotra", 1e-12);
        assert_eq!(
            (&narrow.outcome.status, &wide.outcome.status),
            (&Status::Solved, &Status::Solved)
        );
        println!(
            "n = {n}: {} and {} iterations",
            narrow.outcome.iterations, wide.outcome.iterations
        );
        let mut last = 0;
        for row in &narrow.path {
            // The first row of an iteration is the predictor's, the last one the corrector's.
            let theta = if row.iteration > last { 0.5 } else { 0.25 };
            assert!(row.delta <= theta + 1e-6, "{row:?}");
            last = row.iteration;
        }
        assert!(narrow.path.len() >= 2 * narrow.outcome.iterations);
        assert!(wide.path.iter().all(|row| row.least >= 1e-3 - 1e-9), "{:?}", wide.path);
        for path in [&narrow.path, &wide.path] {
            let end = path.last().unwrap();
            assert!(end.mu < 1e-3 * path[0].mu && end.residual < 1e-3, "{end:?}");
        }
    }
}

/// The 5-point Laplacian on a k × k grid.
fn laplacian(k: usize) -> Csc {
    let at = |i: usize, j: usize| i * k + j;
    let mut entries = vec![];
    for i in 0..k {
        for j in 0..k {
            entries.push((at(i, j), at(i, j), 4.0));
            if i + 1 < k {
                entries.push((at(i, j), at(i + 1, j), -1.0));
                entries.push((at(i + 1, j), at(i, j), -1.0));
            }
            if j + 1 < k {
                entries.push((at(i, j), at(i, j + 1), -1.0));
                entries.push((at(i, j + 1), at(i, j), -1.0));
            }
        }
    }
    Csc::from_triplets(k * k, k * k, entries.into_iter()).unwrap()
}

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

#[test]
fn scaling_by_different_hands_is_undone() {
    for n in [5, 40] {
        for seed in 0..4 {
            let numbers = &mut Numbers(seed + 31 * n as u64);
            let m = if seed % 2 == 0 { gram(n, n, 0.5, numbers) } else { skew(n, 1.0, numbers) };
            let (_, _, q) = planted(&Matrix::from(m.clone()), 0.1, numbers);
            let d: Vec<[f64; 2]> =
                (0..n).map(|_| [0; 2].map(|_| 10f64.powf(numbers.within(-6.0, 6.0)))).collect();
            let scaled = Dense::from_fn(n, n, |i, j| d[i][0] * m[(i, j)] * d[j][1]);
            let q: Vec<f64> = q.iter().zip(&d).map(|(q, d)| q * d[0]).collect();
            let problem = Lcp::new(scaled, q).unwrap();
            for name in BOTH {
                let run = run(&problem, name, 1e-10);
                println!(
                    "n = {n}, seed {seed}, {name}: {} in {}",
                    run.outcome.status, run.outcome.iterations
                );
                assert_eq!(run.outcome.status, Status::Solved, "{name}: {:?}", run.outcome.measure);
            }
        }
    }
}

#[test]
fn a_good_start_is_used_and_a_bad_one_does_no_harm() {
    let numbers = &mut Numbers(9);
    let m = Matrix::from(gram(80, 80, 0.1, numbers));
    let (z, _, q) = planted(&m, 0.0, numbers);
    let problem = Lcp::new(m, q).unwrap();
    for name in BOTH {
        let cold = run(&problem, name, 1e-10).outcome.iterations;
        let near: Vec<f64> = z.iter().map(|z| z + numbers.within(-1e-4, 1e-4)).collect();
        let warm = run_from(&problem, name, &[], 1e-10, LcpPoint { z: near });
        let wild: Vec<f64> = z.iter().map(|_| numbers.within(-1e6, 1e6)).collect();
        let bad = run_from(&problem, name, &[], 1e-10, LcpPoint { z: wild });
        println!(
            "{name}: {cold} cold, {} warm, {} from afar",
            warm.outcome.iterations, bad.outcome.iterations
        );
        assert_eq!((warm.outcome.status, bad.outcome.status), (Status::Solved, Status::Solved));
        assert!(warm.outcome.iterations <= cold && bad.outcome.iterations <= cold + 1);
    }
}

#[test]
fn programs_take_boxes_and_both_forms() {
    for n in [1, 4, 30, 100] {
        for seed in 0..4 {
            let numbers = &mut Numbers(seed + 5 * n as u64);
            let m = gram(n, if seed % 2 == 0 { n } else { n.div_ceil(2) }, 0.0, numbers);
            let (mut z, mut w) = (vec![0.0; n], vec![0.0; n]);
            let (mut lower, mut upper) = (vec![0.0; n], vec![0.0; n]);
            for i in 0..n {
                (lower[i], upper[i]) = match numbers.bits() % 5 {
                    0 => (-1.0, 2.0),
                    1 => (f64::NEG_INFINITY, 1.0),
                    2 => (0.5, f64::INFINITY),
                    3 => (f64::NEG_INFINITY, f64::INFINITY),
                    _ => (0.25, 0.25),
                };
                let side = numbers.within(-1.0, 1.0);
                let size = numbers.within(0.5, 1.0);
                if side < -0.3 && lower[i].is_finite() {
                    (z[i], w[i]) = (lower[i], size);
                } else if (side > 0.3 && upper[i].is_finite()) || lower[i] == upper[i] {
                    (z[i], w[i]) = (upper[i], -size);
                } else {
                    z[i] = lower[i].max(-2.0) + 0.5 * (upper[i].min(2.0) - lower[i].max(-2.0));
                }
            }
            let mut q = vec![0.0; n];
            Matrix::from(m.clone()).mul(&z, &mut q);
            q.iter_mut().zip(&w).for_each(|(q, w)| *q = w - *q);
            for m in [Matrix::from(m.clone()), m.to_csc().into()] {
                let problem = BoxLcp::new(m, q.clone(), lower.clone(), upper.clone()).unwrap();
                let run = run(&problem, "qp", 1e-11);
                assert_eq!(
                    run.outcome.status,
                    Status::Solved,
                    "n = {n}, seed {seed}: {:?}, {:?}",
                    run.outcome.measure,
                    run.account
                );
            }
            let (_, w, q) = planted(&Matrix::from(m.clone()), 0.3, numbers);
            let problem = Lcp::new(m, q).unwrap();
            for form in ["form=energy", "form=gap"] {
                let run = run_from(&problem, "qp", &[form], 1e-11, problem.origin());
                assert_eq!(
                    run.outcome.status,
                    Status::Solved,
                    "{form}, n = {n}, seed {seed}: {:?}, {:?}",
                    run.outcome.measure,
                    run.account
                );
                assert!(off(&w_of(&problem, &run.point.z), &w) < 1e-8);
            }
        }
    }
}

#[test]
fn programs_say_what_they_need() {
    let refusal = |problem: &dyn Fn() -> String| problem();
    let lcp = |rows: &[[f64; 2]], settings: &[&str]| {
        let problem = Lcp::new(Dense::from_rows(rows).unwrap(), vec![-1.0, 1.0]).unwrap();
        let mut session = registry::session::<Lcp>("qp", &from_texts(settings).unwrap()).unwrap();
        session
            .solve(&problem, &mut problem.origin(), &Limits::default(), &mut |_| {})
            .unwrap_err()
            .to_string()
    };
    let indefinite = refusal(&|| lcp(&[[1.0, 2.0], [2.0, 1.0]], &[]));
    assert!(indefinite.contains("a positive semidefinite M"), "{indefinite}");
    let skew = refusal(&|| lcp(&[[1.0, 2.0], [-2.0, 1.0]], &["form=energy"]));
    assert!(skew.contains("a symmetric M"), "{skew}");
    let boxed =
        BoxLcp::new(Dense::from_rows(&[[1.0]]).unwrap(), vec![1.0], vec![0.0], vec![1.0]).unwrap();
    let mut session =
        registry::session::<BoxLcp>("qp", &from_texts(&["form=gap"]).unwrap()).unwrap();
    let error =
        session.solve(&boxed, &mut boxed.origin(), &Limits::default(), &mut |_| {}).unwrap_err();
    assert!(error.to_string().contains("free or nonnegative"), "{error}");
    let rectangular = Mlcp::rectangular(Dense::zeros(3, 2), vec![0.0; 3], 2, 1).unwrap();
    for name in ALL {
        let mut session =
            registry::session::<Mlcp>(name, &from_texts::<&str>(&[]).unwrap()).unwrap();
        let error = session
            .solve(&rectangular, &mut rectangular.origin(), &Limits::default(), &mut |_| {})
            .unwrap_err();
        assert!(error.is_inapplicable(), "{name}: {error}");
    }
}

#[test]
fn an_unbounded_box_is_refuted() {
    // min −z_1 + …, z_1 unbounded above with a zero row; the third variable only below.
    let m = Dense::from_rows(&[[1.0, 1.0, 0.0], [1.0, 1.0, 0.0], [0.0, 0.0, 1.0]]).unwrap();
    let (lower, upper) =
        (vec![f64::NEG_INFINITY, f64::NEG_INFINITY, 0.0], vec![0.0, f64::INFINITY, 1.0]);
    // y = (−1, 1, 0): M y = 0, qᵀy = −2.
    let problem = BoxLcp::new(m, vec![1.0, -1.0, 0.5], lower, upper).unwrap();
    let run = run(&problem, "qp", 1e-9);
    assert!(
        run.outcome.status.refutes()
            && matches!(run.outcome.status.certificate(), Some(Certificate::Farkas { .. })),
        "{:?} {:?}",
        run.outcome.status,
        run.account
    );
}

#[test]
fn what_is_not_monotone_is_solved_or_named() {
    let murty = Dense::from_rows(&[[-2.0, 1.0], [1.0, -2.0]]).unwrap();
    let pang = Dense::from_rows(&[[0.0, -1.0, -1.0], [1.0, 0.0, 0.0], [-1.0, 0.0, 0.0]]).unwrap();
    let ray =
        Dense::from_rows(&[[-1.0, 0.0, -3.0], [1.0, -2.0, -5.0], [-2.0, -1.0, -2.0]]).unwrap();
    let kostreva = Dense::from_rows(&[[1.0, 2.0, 0.0], [0.0, 1.0, 2.0], [2.0, 0.0, 1.0]]).unwrap();
    for (m, q, solvable) in [
        (murty, vec![-1.0, -1.0], false),
        (pang, vec![0.0, -1.0, 1.0], true),
        (ray, vec![-3.0, -2.0, -1.0], false),
        (kostreva, vec![-1.0; 3], true),
    ] {
        let problem = Lcp::new(m, q).unwrap();
        for name in BOTH {
            let status = run(&problem, name, 1e-9).outcome.status;
            println!("{name}: {status}");
            match status {
                Status::Solved => assert!(solvable),
                Status::Infeasible(_) => assert!(!solvable),
                Status::Stalled(_) => {}
                other => panic!("{name}: {other}"),
            }
        }
    }
}

#[test]
fn a_session_is_used_again() {
    let numbers = &mut Numbers(21);
    let m = gram(40, 25, 0.0, numbers);
    for m in [Matrix::from(m.clone()), m.to_csc().into()] {
        for name in ALL {
            let mut session =
                registry::session::<Lcp>(name, &from_texts::<&str>(&[]).unwrap()).unwrap();
            for share in [0.0, 0.4, 0.0] {
                let (_, w, q) = planted(&m, share, numbers);
                let problem = Lcp::new(m.clone(), q).unwrap();
                let mut point = problem.origin();
                let limits = Limits { tolerance: 1e-11, ..Limits::default() };
                let outcome = session.solve(&problem, &mut point, &limits, &mut |_| {}).unwrap();
                assert_eq!(outcome.status, Status::Solved, "{name}: {:?}", outcome.measure);
                assert!(off(&w_of(&problem, &point.z), &w) < 1e-8);
            }
        }
    }
}
