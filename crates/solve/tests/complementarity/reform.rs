//! Reformulations of linear complementarity problems: there and back, certificates, refusals.

use nonsmooth_linalg::{Dense, Matrix};
use nonsmooth_problem::check::{Certificate, Evidence, Judged};
use nonsmooth_problem::{BoxLcp, Hlcp, HlcpPoint, Lcp, LcpPoint, Mlcp, Problem};
use nonsmooth_solve::Reformulation;
use nonsmooth_solve::complementarity::reform::{Mixed, Reduce, Split};
use nonsmooth_solve::registry::{self, Registered};
use nonsmooth_solve::{Limits, SolveError, Status};
use rand::{RngExt, SeedableRng};
use rand_pcg::Pcg64;

fn random(rng: &mut Pcg64) -> f64 {
    rng.random_range(-1.0..1.0)
}

/// Positive definite, not symmetric.
fn definite(n: usize, rng: &mut Pcg64) -> Dense {
    let mut m = Dense::zeros(n, n);
    for i in 0..n {
        for j in 0..i {
            let x = random(rng) / (n as f64).sqrt();
            (m[(i, j)], m[(j, i)]) = (x, -x + 0.1 * random(rng) / n as f64);
        }
        m[(i, i)] = rng.random_range(0.5..1.0);
    }
    m
}

fn product(m: &Matrix, z: &[f64]) -> Vec<f64> {
    let mut w = vec![0.0; m.nrows()];
    m.mul(z, &mut w);
    w
}

/// Both storages.
fn storages(m: &Dense) -> [Matrix; 2] {
    [m.clone().into(), m.to_csc().into()]
}

fn close(found: &[f64], known: &[f64], what: &str) {
    assert_eq!(found.len(), known.len(), "{what}");
    for (i, (a, b)) in found.iter().zip(known).enumerate() {
        assert!((a - b).abs() < 1e-9, "{what}: [{i}] = {a}, known {b}");
    }
}

fn solved<P: Registered>(name: &str, problem: &P) -> P::Point {
    let mut session = registry::session::<P>(name, &Default::default()).unwrap();
    let mut point = problem.origin();
    let limits = Limits { tolerance: 1e-12, max_iterations: 300, ..Limits::default() };
    let outcome = session.solve(problem, &mut point, &limits, &mut |_| {}).unwrap();
    assert_eq!(outcome.status, Status::Solved, "{name}: {:?}", outcome.measure);
    point
}

fn refused<P: Registered>(name: &str, problem: &P) -> SolveError {
    let mut session = registry::session::<P>(name, &Default::default()).unwrap();
    let refused = session.solve(problem, &mut problem.origin(), &Limits::default(), &mut |_| {});
    refused.expect_err("refused")
}

/// A mixed problem with its solution: `M`, q, z, w.
fn mixed(free: usize, pairs: usize, seed: u64) -> (Dense, Vec<f64>, Vec<f64>, Vec<f64>) {
    let mut rng = Pcg64::seed_from_u64(seed);
    let n = free + pairs;
    let m = definite(n, &mut rng);
    let (mut z, mut w) = (vec![0.0; n], vec![0.0; n]);
    for i in 0..n {
        let size = rng.random_range(0.5..1.5);
        match (i < free, rng.random::<bool>()) {
            (true, _) => z[i] = random(&mut rng),
            (false, true) => z[i] = size,
            (false, false) => w[i] = size,
        }
    }
    let q = w.iter().zip(product(&m.clone().into(), &z)).map(|(w, x)| w - x).collect();
    (m, q, z, w)
}

// -------------------------------------------------------------------------------------------------- reduce

#[test]
fn the_reduced_problem_is_the_lectures() {
    // A = 2, C = (1, −1), D = (3, 1)ᵀ, B = I, a = 4, b = (0, 1).
    let m = Dense::from_rows(&[[2.0, 1.0, -1.0], [3.0, 1.0, 0.0], [1.0, 0.0, 1.0]]).unwrap();
    let problem = Mlcp::new(m, vec![4.0, 0.0, 1.0], 1).unwrap();
    let (reduced, mut memo) = Reduce.reduce(&problem).unwrap();
    let expected = Dense::from_rows(&[[-0.5, 1.5], [-0.5, 1.5]]).unwrap();
    assert_eq!((reduced.M, reduced.q), (expected.into(), vec![-6.0, -1.0]));
    let mut point = problem.origin();
    Reduce.lift(&problem, &LcpPoint { z: vec![1.0, 5.0] }, &mut memo, &mut point);
    assert_eq!(point.z, [0.0, 1.0, 5.0]);
    let mut back = LcpPoint::default();
    Reduce.lower(&problem, &point, &memo, &mut back);
    assert_eq!(back.z, [1.0, 5.0]);
}

#[test]
fn reduced_problems_lead_back_to_the_planted_solution() {
    for (free, pairs, seed) in [(0, 4, 0), (1, 1, 1), (5, 9, 2), (40, 30, 3)] {
        let (m, q, z, w) = mixed(free, pairs, seed);
        for m in storages(&m) {
            let problem = Mlcp::new(m, q.clone(), free).unwrap();
            // The planted v solves the reduced problem with the planted w.
            let (reduced, mut memo) = Reduce.reduce(&problem).unwrap();
            let forces: Vec<f64> = product(&reduced.M, &z[free..])
                .iter()
                .zip(&reduced.q)
                .map(|(x, q)| x + q)
                .collect();
            close(&forces, &w[free..], "w");
            let mut point = problem.origin();
            Reduce.lift(&problem, &LcpPoint { z: z[free..].to_vec() }, &mut memo, &mut point);
            close(&point.z, &z, "lift");
            let point = solved("reduce/newton_min", &problem);
            close(&point.z, &z, "reduce/newton_min");
            assert!(problem.judge(&point, 1e-12).unwrap().solved);
        }
    }
}

#[test]
fn another_right_hand_side_reuses_the_factors() {
    let (m, q, z, _) = mixed(6, 8, 4);
    let mut problem = Mlcp::new(m, q, 6).unwrap();
    let mut session = registry::session::<Mlcp>("reduce/newton_min", &Default::default()).unwrap();
    let limits = Limits { tolerance: 1e-12, ..Limits::default() };
    let mut point = problem.origin();
    session.solve(&problem, &mut point, &limits, &mut |_| {}).unwrap();
    problem.q.iter_mut().for_each(|q| *q *= 2.0);
    let outcome = session.solve(&problem, &mut point, &limits, &mut |_| {}).unwrap();
    assert_eq!(outcome.status, Status::Solved);
    let twice: Vec<f64> = z.iter().map(|z| 2.0 * z).collect();
    close(&point.z, &twice, "twice");
    // A point that is right from the start asks for no factorisation but of A, and that one is kept.
    let outcome = session.solve(&problem, &mut point, &limits, &mut |_| {}).unwrap();
    assert_eq!((outcome.iterations, outcome.factorisations), (0, 0));
}

#[test]
fn a_singular_a_is_named() {
    let zero = Dense::from_rows(&[[0.0, 1.0], [-1.0, 1.0]]).unwrap();
    let dependent =
        Dense::from_rows(&[[1.0, 3.0, 1.0], [1.0 / 3.0, 1.0, 0.0], [0.0, 1.0, 1.0]]).unwrap();
    for (m, free) in [(zero, 1), (dependent, 2)] {
        for m in storages(&m) {
            let problem = Mlcp::new(m, vec![1.0; 1 + free], free).unwrap();
            let error = refused("reduce/newton_min", &problem);
            assert!(error.is_inapplicable(), "{error}");
            let said = error.to_string();
            assert!(said.starts_with("A: expected an invertible matrix"), "{said}");
        }
    }
    // Bad units alone are no singularity.
    let m = Dense::from_rows(&[[1e-9, 1e-17, 0.0], [0.0, 1e-8, 1.0], [0.0, 0.0, 1.0]]).unwrap();
    assert!(Reduce.reduce(&Mlcp::new(m, vec![1.0; 3], 2).unwrap()).is_ok());
}

#[test]
fn rectangular_problems_are_refused() {
    let m = Dense::from_fn(4, 3, |i, j| (i + j) as f64);
    let problem = Mlcp::rectangular(m, vec![1.0; 4], 2, 1).unwrap();
    let said = refused("reduce/newton_fb", &problem).to_string();
    assert!(said.contains("2 equalities and 1 free variables"), "{said}");
    let m = Dense::from_fn(2, 2, |i, j| f64::from(u8::from(i == j)));
    let said = refused("reduce/newton_fb", &Mlcp::new(m, vec![1.0; 2], 2).unwrap()).to_string();
    assert!(said.contains("a complementary pair"), "{said}");
}

#[test]
fn certificates_of_the_reduced_problem_are_lifted() {
    // Reduced matrices without a solution, hidden behind a change of variables: B = M + D A⁻¹ C, b = q + D A⁻¹ a.
    let reduced = [
        (Dense::from_rows(&[[-2.0, 1.0], [1.0, -2.0]]).unwrap(), vec![-1.0, -1.0], vec![1.0, 1.0]),
        (Dense::from_rows(&[[0.0, -1.0], [1.0, 1.0]]).unwrap(), vec![-1.0, 3.0], vec![1.0, 0.0]),
        (Dense::from_rows(&[[1.0, -1.0], [-1.0, 1.0]]).unwrap(), vec![-1.0, -1.0], vec![1.0, 1.0]),
    ];
    for seed in 0..5 {
        for (m, q, y) in &reduced {
            let mut rng = Pcg64::seed_from_u64(seed);
            let free = 7;
            let n = free + 2;
            let mut whole = definite(n, &mut rng);
            let mut constants: Vec<f64> = (0..n).map(|_| random(&mut rng)).collect();
            // With B = 0 and b = 0 the reduced problem is (−D A⁻¹ C, −D A⁻¹ a).
            for i in 0..2 {
                for j in 0..2 {
                    whole[(free + i, free + j)] = 0.0;
                }
                constants[free + i] = 0.0;
            }
            let bare = Mlcp::new(whole.clone(), constants.clone(), free).unwrap();
            let (bare, _) = Reduce.reduce(&bare).unwrap();
            let there = bare.M.to_dense().unwrap();
            for i in 0..2 {
                for j in 0..2 {
                    whole[(free + i, free + j)] = m[(i, j)] - there[(i, j)];
                }
                constants[free + i] = q[i] - bare.q[i];
            }
            for whole in storages(&whole) {
                let problem = Mlcp::new(whole, constants.clone(), free).unwrap();
                let (lcp, memo) = Reduce.reduce(&problem).unwrap();
                let exact = Lcp::new(m.clone(), q.clone()).unwrap();
                let farkas = Certificate::Farkas { y: y.clone() };
                assert!(exact.verify(&farkas));
                let kept = lcp.M.to_dense().unwrap();
                let gap = (0..4).map(|k| (kept[(k / 2, k % 2)] - m[(k / 2, k % 2)]).abs());
                assert!(gap.fold(0.0, f64::max) < 1e-12);
                let lifted = Reduce.lift_certificate(farkas, &memo);
                let Certificate::Farkas { y: all } = &lifted else { panic!("{lifted:?}") };
                assert_eq!(all.len(), n);
                // The reduced matrix is rounded, so what is proved of it is nearly so of the whole.
                let says = |c: &Certificate| !matches!(problem.evidence(c), Evidence::Nothing);
                assert!(says(&lifted), "seed {seed} {m:?}");
                let ray = Certificate::Ray { z: y.clone(), z0: 0.0 };
                assert!(says(&Reduce.lift_certificate(ray, &memo)));
                // What proves nothing there proves nothing here.
                let wrong = Certificate::Farkas { y: vec![0.0, 0.0] };
                assert!(!problem.verify(&Reduce.lift_certificate(wrong, &memo)));
                let ray = Certificate::Ray { z: y.clone(), z0: 1.0 };
                assert!(!problem.verify(&Reduce.lift_certificate(ray, &memo)));
            }
        }
    }
}

#[test]
fn a_row_is_lifted_with_its_multipliers() {
    // u = v − 1 by the equality; the pair's row is −u − v − 3 = −2v − 2.
    let m = Dense::from_rows(&[[1.0, -1.0], [-1.0, -1.0]]).unwrap();
    let problem = Mlcp::new(m, vec![1.0, -3.0], 1).unwrap();
    let (lcp, memo) = Reduce.reduce(&problem).unwrap();
    let row = Certificate::Row { row: 0 };
    assert!(lcp.verify(&row) && !problem.verify(&Certificate::Row { row: 1 }));
    assert!(problem.verify(&Reduce.lift_certificate(row, &memo)));
    let mut session = registry::session::<Mlcp>("reduce/newton_fb", &Default::default()).unwrap();
    let limits = Limits::default();
    let outcome = session.solve(&problem, &mut problem.origin(), &limits, &mut |_| {}).unwrap();
    assert!(matches!(outcome.status, Status::Infeasible(_)), "{}", outcome.status);
}

// --------------------------------------------------------------------------------------------------- split

const INF: f64 = f64::INFINITY;

/// A box problem with its solution, every kind of bounds in it.
fn boxed(n: usize, seed: u64) -> (Dense, Vec<f64>, [Vec<f64>; 2], Vec<f64>) {
    let mut rng = Pcg64::seed_from_u64(seed);
    let m = definite(n, &mut rng);
    let (mut z, mut w, mut lower, mut upper) = (vec![], vec![], vec![], vec![]);
    for i in 0..n {
        let (at, gap, force) =
            (random(&mut rng), rng.random_range(0.5..1.0), rng.random_range(0.1..1.0));
        let (l, u) = [(at, INF), (-INF, at), (-INF, INF), (at, at + gap), (at, at)][i % 5];
        let (zi, wi) = match (rng.random_range(0..3), l.is_finite(), u.is_finite()) {
            (0, true, _) => (l, force),
            (1, _, true) => (u, -force),
            (_, true, true) => (0.5 * (l + u), if l == u { -force } else { 0.0 }),
            (_, true, false) => (l + gap, 0.0),
            (_, false, true) => (u - gap, 0.0),
            (_, false, false) => (at, 0.0),
        };
        z.push(zi);
        w.push(wi);
        lower.push(l);
        upper.push(u);
    }
    let q = w.iter().zip(product(&m.clone().into(), &z)).map(|(w, x)| w - x).collect();
    (m, q, [lower, upper], z)
}

#[test]
fn split_problems_lead_back_to_the_planted_solution() {
    for (n, seed) in [(1, 0), (2, 1), (5, 2), (13, 3), (60, 4)] {
        let (m, q, [lower, upper], z) = boxed(n, seed);
        for m in storages(&m) {
            let problem = BoxLcp::new(m, q.clone(), lower.clone(), upper.clone()).unwrap();
            let (mixed, mut memo) = Split.reduce(&problem).unwrap();
            // A solution goes there and back unchanged, and solves the mixed problem.
            let mut there = mixed.origin();
            Split.lower(&problem, &LcpPoint { z: z.clone() }, &memo, &mut there);
            assert!(mixed.judge(&there, 1e-12).unwrap().solved, "n = {n}");
            let mut back = problem.origin();
            Split.lift(&problem, &there, &mut memo, &mut back);
            close(&back.z, &z, "there and back");
            for name in ["split/newton_min", "split/newton_fb", "newton_min"] {
                let point = solved(name, &problem);
                close(&point.z, &z, name);
                // Bounds are met exactly.
                for (i, x) in point.z.iter().enumerate() {
                    assert!(lower[i] <= *x && *x <= upper[i], "{name} z[{i}]");
                }
            }
        }
    }
}

#[test]
fn bounds_come_back_exactly() {
    let (l, u) = (0.1, 0.1 + 0.7);
    let m = Dense::from_rows(&[[1.0]]).unwrap();
    let problem = BoxLcp::new(m, vec![-9.0], vec![l], vec![u]).unwrap();
    assert_eq!(solved("split/newton_min", &problem).z, [u]);
    let problem = BoxLcp { q: vec![9.0], ..problem };
    assert_eq!(solved("split/newton_min", &problem).z, [l]);
}

#[test]
fn certificates_of_the_split_problem_are_lifted() {
    // w_1 = −z_2 − 1 ≥ 0 for z_1 ≥ 0, z_2 in [0, 1]: no solution. Lower and upper bounds, with and without a second one.
    let m = Dense::from_rows(&[[0.0, -1.0], [0.0, 1.0]]).unwrap();
    let problem = BoxLcp::new(m, vec![-1.0, 0.0], vec![0.0, 0.0], vec![INF, 1.0]).unwrap();
    let (mixed, memo) = Split.reduce(&problem).unwrap();
    let row = Certificate::Row { row: 0 };
    assert!(mixed.verify(&row));
    assert!(problem.verify(&Split.lift_certificate(row, &memo)));
    // Mirrored: z_1 ≤ 0 wants w_1 = z_2 + 1 ≤ 0 with z_2 in [0, 1].
    let m = Dense::from_rows(&[[0.0, 1.0], [0.0, 1.0]]).unwrap();
    let problem = BoxLcp::new(m, vec![1.0, 0.0], vec![-INF, 0.0], vec![0.0, 1.0]).unwrap();
    let (mixed, memo) = Split.reduce(&problem).unwrap();
    let farkas = Certificate::Farkas { y: vec![1.0, 0.0, 0.0] };
    assert!(mixed.verify(&farkas));
    let lifted = Split.lift_certificate(farkas, &memo);
    assert_eq!(lifted, Certificate::Farkas { y: vec![-1.0, 0.0] });
    assert!(problem.verify(&lifted));
    // The bound is needed: w_1 = z_2 − 2 with z_2 ≤ 1; the multiplier of the bound is part of the proof there, and not here.
    let m = Dense::from_rows(&[[0.0, 1.0], [0.0, 1.0]]).unwrap();
    let problem = BoxLcp::new(m, vec![-2.0, 0.0], vec![0.0, 0.0], vec![INF, 1.0]).unwrap();
    let (mixed, memo) = Split.reduce(&problem).unwrap();
    let farkas = Certificate::Farkas { y: vec![1.0, 0.0, 1.0] };
    assert!(mixed.verify(&farkas));
    assert!(problem.verify(&Split.lift_certificate(farkas, &memo)));
}

#[test]
fn a_box_of_one_point_is_refused() {
    let m = Dense::from_rows(&[[1.0]]).unwrap();
    let problem = BoxLcp::new(m, vec![5.0], vec![2.0], vec![2.0]).unwrap();
    let said = Split.reduce(&problem).err().unwrap().to_string();
    assert!(said.contains("a variable that can move"), "{said}");
}

// --------------------------------------------------------------------------------------------------- mixed

#[test]
fn horizontal_problems_through_mixed_ones() {
    for (n, seed) in [(1, 0), (6, 1), (50, 2)] {
        let mut rng = Pcg64::seed_from_u64(seed);
        let (m, t) = (definite(n, &mut rng), definite(n, &mut rng));
        // T (s − M x) = T k: monotone whatever T.
        let q_matrix =
            Dense::from_fn(n, n, |i, j| -(0..n).map(|k| t[(i, k)] * m[(k, j)]).sum::<f64>());
        let (mut x, mut s) = (vec![0.0; n], vec![0.0; n]);
        for i in 0..n {
            if rng.random::<bool>() { x[i] = 1.0 + random(&mut rng) / 2.0 } else { s[i] = 1.0 }
        }
        for (qm, r) in storages(&q_matrix).into_iter().zip(storages(&t)) {
            let q = product(&qm, &x).iter().zip(product(&r, &s)).map(|(a, b)| a + b).collect();
            let problem = Hlcp::new(qm, r, q).unwrap();
            let (mixed, mut memo) = Mixed.reduce(&problem).unwrap();
            let known = HlcpPoint { x: x.clone(), s: s.clone() };
            let mut there = LcpPoint::default();
            Mixed.lower(&problem, &known, &memo, &mut there);
            assert!(mixed.judge(&there, 1e-12).unwrap().solved);
            let mut back = problem.origin();
            Mixed.lift(&problem, &there, &mut memo, &mut back);
            assert_eq!(back, known);
            for name in ["mixed/newton_min", "mixed/newton_fb", "mixed/newton_pfb"] {
                let point = solved(name, &problem);
                close(&point.x, &x, name);
                close(&point.s, &s, name);
            }
        }
    }
}

#[test]
fn certificates_of_the_mixed_problem_are_lifted() {
    // x + s = −1 has no solution.
    let one = Dense::from_rows(&[[1.0]]).unwrap();
    let problem = Hlcp::new(one.clone(), one, vec![-1.0]).unwrap();
    let (mixed, memo) = Mixed.reduce(&problem).unwrap();
    let farkas = Certificate::Farkas { y: vec![-1.0, 1.0] };
    assert!(mixed.verify(&farkas));
    assert!(problem.verify(&Mixed.lift_certificate(farkas, &memo)));
    let ray = Certificate::Ray { z: vec![-1.0, 1.0], z0: 0.0 };
    assert!(problem.verify(&Mixed.lift_certificate(ray, &memo)));
}

// ------------------------------------------------------------------------------------------------ registry

#[test]
fn composed_names_exist_and_are_described() {
    fn each<P: Registered>(prefix: &str) {
        let composed = registry::composed_names::<P>();
        assert!(composed.iter().any(|n| *n == format!("{prefix}/newton_fb")), "{composed:?}");
        for name in &composed {
            assert!(registry::session::<P>(name, &Default::default()).is_ok(), "{name}");
            assert!(registry::about::<P>(name).is_some(), "{name}");
        }
        assert!(registry::prefixes::<P>().iter().any(|p| p.name == prefix));
        assert!(registry::session::<P>(&format!("{prefix}/nothing"), &Default::default()).is_err());
    }
    each::<Mlcp>("reduce");
    each::<BoxLcp>("split");
    each::<Hlcp>("mixed");
    assert!(registry::composed_names::<Lcp>().is_empty());
}

/// What overflows in a reformulation is none of the caller's data: the method does not apply, and `auto` tries others.
#[test]
fn data_that_overflow_in_a_reformulation_are_no_mistake() {
    let one = |x: f64| Dense::from_rows(&[[x]]).unwrap();
    let boxed = BoxLcp::new(one(-2.0), vec![1.0], vec![-1e308], vec![f64::INFINITY]).unwrap();
    let error = refused("split/lemke", &boxed);
    assert!(error.is_inapplicable() && error.to_string().contains("reformulation"), "{error}");
    let point = solved("auto", &boxed);
    assert!(boxed.judge(&point, 1e-12).unwrap().solved);
}
