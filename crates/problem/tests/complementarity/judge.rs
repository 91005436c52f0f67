//! The judge of linear complementarity problems from first principles: numbers made by hand, planted solutions, what must never pass, and certificates.

use std::sync::Arc;

use dashu_int::IBig;
use nonsmooth_linalg::{Csc, Dense, Matrix, Operator};
use nonsmooth_problem::check::{Certificate, Evidence, Judged, Measure, RowStatus};
use nonsmooth_problem::planted::{PlantedBlocks, PlantedClass, PlantedLcp, PlantedMlcp};
use nonsmooth_problem::{BoxLcp, Hlcp, HlcpPoint, Lcp, LcpPoint, Mlcp, Problem};
use proptest::prelude::*;

const INF: f64 = f64::INFINITY;

fn rows<const N: usize>(entries: [[f64; N]; N]) -> Matrix {
    Dense::from_rows(&entries).unwrap().into()
}

fn point(z: &[f64]) -> LcpPoint {
    LcpPoint { z: z.to_vec() }
}

fn lcp<const N: usize>(m: [[f64; N]; N], q: [f64; N]) -> Lcp {
    Lcp::new(rows(m), q.to_vec()).unwrap()
}

fn measure<P: Problem>(problem: &P, point: &P::Point) -> Measure {
    problem.certify(point, &mut problem.gauge().unwrap())
}

fn close(a: f64, b: f64) -> bool {
    (a - b).abs() <= 1e-14 * b.abs().max(1e-300)
}

fn farkas(y: &[f64]) -> Certificate {
    Certificate::Farkas { y: y.to_vec() }
}

fn ray(z: &[f64], z0: f64) -> Certificate {
    Certificate::Ray { z: z.to_vec(), z0 }
}

// ------------------------------------------------------------------------------------------ numbers by hand

#[test]
fn the_residuals_of_an_lcp_by_hand() {
    let problem = lcp([[2.0, 1.0], [1.0, 4.0]], [-5.0, -6.0]);
    // w = (2·1 + 2 − 5, 1 + 8 − 6) = (−1, 3), s = (2, 4): min(s z, w) = (−1, 3).
    let at = point(&[1.0, 2.0]);
    let found = measure(&problem, &at);
    let norm_q = 61.0_f64.sqrt();
    assert!(close(found.absolute, 10.0_f64.sqrt()), "{found:?}");
    // Rows have the terms 9 and 15, less than the units 12 and 20 that q makes. Pair 1: 1/9. Pair 2: the smaller of 3/15, and 2 of max(1/9, 4/15).
    assert!(close(found.relative, 0.2) && found.complementarity == found.relative);
    // min(z, w) = (−1, 2).
    assert!(close(found.literature, 5.0_f64.sqrt() / norm_q));
    assert_eq!((found.primal, found.worst_contact), (0.0, 1));
    assert!(close(found.dual, 1.0 / 9.0) && found.worst == found.relative);
    let verdict = problem.judge(&at, 1e-8).unwrap();
    assert!(!verdict.solved);
    assert_eq!(verdict.velocity, [-1.0, 3.0]);
    assert_eq!(verdict.worst[0].0, 1);
    // Exactly solved: (2, 1) has w = (0, 0).
    let solution = point(&[2.0, 1.0]);
    let verdict = problem.judge(&solution, 0.0).unwrap();
    assert!(verdict.solved, "{verdict:?}");
    assert_eq!(verdict.statuses, [RowStatus::Inside; 2]);
    assert_eq!((verdict.counts.inside, verdict.counts.degenerate), (2, 0));
}

#[test]
fn negative_variables_are_infeasible_however_the_products_vanish() {
    let problem = lcp([[1.0, 0.0], [0.0, 1.0]], [1.0, -1.0]);
    // z = (−1, 1) has w = (0, 0): all products vanish.
    let found = measure(&problem, &point(&[-1.0, 1.0]));
    assert!(close(found.relative, 1.0) && close(found.primal, found.relative));
    assert!(problem.judge(&point(&[0.0, 1.0]), 0.0).unwrap().solved);
    // Degenerate pairs count once, at the bound.
    let flat = lcp([[1.0, 0.0], [0.0, 1.0]], [0.0, -1.0]);
    let counts = flat.judge(&point(&[0.0, 1.0]), 1e-9).unwrap().counts;
    assert_eq!((counts.inside, counts.lower, counts.degenerate), (1, 1, 1));
}

#[test]
fn without_q_rows_are_compared_with_their_terms() {
    let problem = lcp([[1.0, 0.0], [0.0, 1.0]], [0.0, 0.0]);
    let found = measure(&problem, &point(&[3.0, 4.0]));
    assert!(close(found.relative, 1.0) && close(found.absolute, 5.0), "{found:?}");
    assert!(problem.judge(&point(&[0.0, 0.0]), 0.0).unwrap().solved);
    assert!(!problem.judge(&point(&[1e-3, 0.0]), 1e-6).unwrap().solved);
}

#[test]
fn mixed_problems_by_hand() {
    // u + 2 v − 3 = 0, 0 ≤ v ⟂ −u + v + 1 ≥ 0.
    let m = rows([[1.0, 2.0], [-1.0, 1.0]]);
    let problem = Mlcp::new(m, vec![-3.0, 1.0], 1).unwrap();
    // u = 5/3, v = 2/3.
    let solved = problem.judge(&point(&[5.0 / 3.0, 2.0 / 3.0]), 1e-15).unwrap();
    assert!(solved.solved, "{solved:?}");
    assert_eq!(solved.statuses, [RowStatus::Equality, RowStatus::Inside]);
    // u = 3, v = 0 satisfies the equality and violates the other row: w = −2.
    let found = measure(&problem, &point(&[3.0, 0.0]));
    // Its terms add up to 4; q makes 3 of it, because v = 3 is what the first row asks of it.
    assert!(close(found.relative, 2.0 / 3.0), "{found:?}");
    // u = −3, v = 3: the equality holds, w = 7, min(2·3?) is 3·s = 3, s = 1.
    let found = measure(&problem, &point(&[-3.0, 3.0]));
    assert!(close(found.absolute, 3.0), "{found:?}");
    // The sign of u is free, the equality is not.
    let found = measure(&problem, &point(&[0.0, 0.0]));
    assert!(close(found.absolute, 3.0) && found.worst_contact == 0);
    // More equalities than free variables: the second contradicts or repeats.
    for (b, ok) in [(-6.0, true), (-6.1, false)] {
        let m = Dense::from_rows(&[[1.0, 2.0], [2.0, 4.0], [-1.0, 1.0]]).unwrap();
        let problem = Mlcp::rectangular(m, vec![-3.0, b, 1.0], 2, 1).unwrap();
        let verdict = problem.judge(&point(&[5.0 / 3.0, 2.0 / 3.0]), 1e-12).unwrap();
        assert_eq!(verdict.solved, ok, "{verdict:?}");
    }
}

#[test]
fn bounds_on_both_sides_by_hand() {
    // z − 3 with z in [0, 2]: z = 2, w = −1.
    let one =
        |q: f64, l: f64, u: f64| BoxLcp::new(rows([[1.0]]), vec![q], vec![l], vec![u]).unwrap();
    let problem = one(-3.0, 0.0, 2.0);
    let verdict = problem.judge(&point(&[2.0]), 0.0).unwrap();
    assert!(verdict.solved);
    assert_eq!(verdict.statuses, [RowStatus::Upper]);
    for (z, residual) in [(0.0, 2.0), (1.0, 1.0), (2.5, 0.5), (-1.0, 3.0)] {
        let found = measure(&problem, &point(&[z]));
        assert!(close(found.absolute, residual), "{z}: {found:?}");
    }
    // Inside, at the lower bound, fixed, free.
    for (q, l, u, z, status) in [
        (-1.0, 0.0, 2.0, 1.0, RowStatus::Inside),
        (1.0, 0.0, 2.0, 0.0, RowStatus::Lower),
        (1.0, -0.5, INF, -0.5, RowStatus::Lower),
        (-7.0, 5.0, 5.0, 5.0, RowStatus::Upper),
        (7.0, 5.0, 5.0, 5.0, RowStatus::Lower),
        (4.0, -INF, INF, -4.0, RowStatus::Inside),
        (-4.0, -INF, 1.0, 1.0, RowStatus::Upper),
    ] {
        let verdict = one(q, l, u).judge(&point(&[z]), 0.0).unwrap();
        assert!(verdict.solved, "{q} {l} {u}: {verdict:?}");
        assert_eq!(verdict.statuses, [status], "{q} {l} {u}");
        for step in [1e-3, -1e-3] {
            assert!(!one(q, l, u).judge(&point(&[z + step]), 1e-8).unwrap().solved, "{q} {l} {u}");
        }
    }
}

#[test]
fn horizontal_problems_by_hand() {
    // 2 x − s = 4: x = 2, s = 0.
    let problem = Hlcp::new(rows([[2.0]]), rows([[-1.0]]), vec![4.0]).unwrap();
    let at = |x: f64, s: f64| HlcpPoint { x: vec![x], s: vec![s] };
    assert!(problem.judge(&at(2.0, 0.0), 0.0).unwrap().solved);
    // The equality holds, the pair does not: min(2·3, 1·2) = 2.
    assert!(close(measure(&problem, &at(3.0, 2.0)).absolute, 2.0));
    // The pair holds, the equality does not: 2 − 4.
    assert!(close(measure(&problem, &at(1.0, 0.0)).absolute, 2.0));
    assert!(!problem.judge(&at(1.0, -2.0), 1e-8).unwrap().solved, "s < 0");
    assert!(!problem.judge(&at(-1.0, -6.0), 1e-8).unwrap().solved);
}

// -------------------------------------------------------------------------------------- what must not pass

#[test]
fn nan_and_infinity_never_pass() {
    for bad in [f64::NAN, INF, -INF] {
        for i in 0..3 {
            let mut z = vec![0.0; 3];
            z[i] = bad;
            let problem = lcp([[1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]], [1.0, 2.0, 3.0]);
            assert!(!measure(&problem, &point(&z)).passes(1e300), "{bad} at {i}");
            assert!(problem.judge(&point(&z), 1e300).is_err());
            let boxed =
                BoxLcp::new(problem.M.clone(), vec![1.0; 3], vec![-INF; 3], vec![INF; 3]).unwrap();
            assert!(!measure(&boxed, &point(&z)).passes(1e300), "{bad} at {i}");
            let mixed = Mlcp::new(problem.M.clone(), vec![1.0; 3], 2).unwrap();
            assert!(!measure(&mixed, &point(&z)).passes(1e300), "{bad} at {i}");
            let horizontal = Hlcp::new(problem.M.clone(), problem.M.clone(), vec![1.0; 3]).unwrap();
            for (x, s) in [(z.clone(), vec![0.0; 3]), (vec![0.0; 3], z.clone())] {
                let at = HlcpPoint { x, s };
                assert!(!measure(&horizontal, &at).passes(1e300), "{bad} at {i}");
            }
        }
    }
    // A matrix row without entries: whatever z is, w = q.
    let empty = Lcp::new(Csc::zeros(2, 2), vec![1.0, 1.0]).unwrap();
    assert!(!measure(&empty, &point(&[f64::NAN, 0.0])).passes(1e300));
    let flat = Lcp::new(Csc::zeros(2, 2), vec![0.0, 0.0]).unwrap();
    assert!(!measure(&flat, &point(&[f64::NAN, 0.0])).passes(1e300));
    let free = Mlcp::new(rows([[0.0, 1.0], [0.0, 1.0]]), vec![-1.0, -1.0], 1).unwrap();
    assert!(measure(&free, &point(&[7.0, 1.0])).passes(0.0));
    assert!(!measure(&free, &point(&[f64::NAN, 1.0])).passes(1e300));
    assert!(measure(&free, &point(&[f64::NAN, 1.0])).merit().is_infinite());
    assert!(empty.judge(&point(&[0.0]), 1.0).is_err(), "a wrong length");
}

#[test]
fn a_scale_of_rows_hides_nothing() {
    // Two copies of a problem, one in units that are 1e±8 of the other's: an error in either must show.
    for power in [-8, 8] {
        let scale = 10.0_f64.powi(power);
        let block = [[2.0, 1.0], [1.0, 2.0]];
        let mut m = Dense::zeros(4, 4);
        for i in 0..2 {
            for j in 0..2 {
                m[(i, j)] = block[i][j];
                m[(2 + i, 2 + j)] = scale * block[i][j];
            }
        }
        let q = vec![-5.0, -6.0, -5.0 * scale, -6.0 * scale];
        let z = [4.0 / 3.0, 7.0 / 3.0, 4.0 / 3.0, 7.0 / 3.0];
        let problem = Lcp::new(m, q).unwrap();
        assert!(problem.judge(&point(&z), 1e-14).unwrap().solved);
        for i in 0..4 {
            for error in [1e-4, -1e-4, -z[i]] {
                let mut wrong = z;
                wrong[i] += error;
                assert!(
                    !problem.judge(&point(&wrong), 1e-8).unwrap().solved,
                    "{power} {i} {error}"
                );
            }
        }
    }
}

#[test]
fn the_unit_of_a_column_does_not_matter_to_rows_that_see_nothing_else() {
    // D₁ M D₂ with large powers of two: the same answer, row by row.
    let case = PlantedLcp {
        n: 12,
        class: PlantedClass::HPlus,
        decades: 8.0,
        seed: 3,
        ..PlantedLcp::default()
    };
    let (problem, known) = case.lcp();
    assert!(problem.judge(&known, 1e-13).unwrap().solved);
    // What a row does not see, no residual can: errors are as large as the largest variable.
    let reach = known.z.iter().fold(0.0_f64, |l, z| l.max(z.abs()));
    for i in 0..12 {
        let mut wrong = known.clone();
        wrong.z[i] = -reach;
        assert!(!problem.judge(&wrong, 1e-8).unwrap().solved, "{i}");
    }
}

#[derive(Debug)]
struct Products(Matrix);

impl Operator for Products {
    fn nrows(&self) -> usize {
        self.0.nrows()
    }
    fn ncols(&self) -> usize {
        self.0.ncols()
    }
    fn mul(&self, x: &[f64], y: &mut [f64]) {
        self.0.mul(x, y);
    }
    fn mul_transpose(&self, x: &[f64], y: &mut [f64]) {
        self.0.mul_transpose(x, y);
    }
    fn diagonal(&self) -> Option<Vec<f64>> {
        self.0.diagonal()
    }
}

fn same(a: &Measure, b: &Measure) -> bool {
    let near = |x: f64, y: f64| (x - y).abs() <= 1e-12 * x.abs().max(y.abs()).max(1e-3);
    near(a.relative, b.relative)
        && near(a.literature, b.literature)
        && near(a.siconos, b.siconos)
        && near(a.primal, b.primal)
        && near(a.dual, b.dual)
        && near(a.complementarity, b.complementarity)
}

#[test]
fn operators_are_judged_by_their_products() {
    let (problem, known) = PlantedLcp { class: PlantedClass::HPlus, ..PlantedLcp::default() }.lcp();
    let operator =
        Lcp::new(Matrix::Operator(Arc::new(Products(problem.M.clone()))), problem.q.clone())
            .unwrap();
    assert!(operator.judge(&known, 1e-13).unwrap().solved);
    let mut wrong = known.clone();
    wrong.z[3] += 1e-5;
    assert!(!operator.judge(&wrong, 1e-8).unwrap().solved);
    // Dominant rows have their largest modulus on the diagonal, so that this number agrees, and the others are of the same size.
    let (a, b) = (measure(&operator, &wrong), measure(&problem, &wrong));
    assert!((a.absolute / b.absolute - 1.0).abs() < 1e-9, "{a:?} {b:?}");
    assert!((0.1..10.0).contains(&(a.relative / b.relative)), "{a:?} {b:?}");
    // No certificate of an operator can be verified.
    assert!(!operator.verify(&Certificate::Farkas { y: vec![1.0; 20] }));
    assert!(!operator.verify(&Certificate::Row { row: 0 }));
}

/// `M = I + L`, `q = −1` with whole numbers below the diagonal, none of them positive (a K-matrix), and its solution, rounded: all variables are
/// positive, and grow exponentially, so that their rounding alone is many units of q.
fn growing(n: usize, below: impl Fn(usize, usize) -> i64) -> (Lcp, LcpPoint) {
    let mut exact: Vec<IBig> = vec![];
    for i in 0..n {
        let terms = exact.iter().enumerate().map(|(j, z)| IBig::from(-below(i, j)) * z);
        exact.push(terms.fold(IBig::ONE, |sum, term| sum + term));
    }
    let entry = |i: usize, j: usize| match j.cmp(&i) {
        std::cmp::Ordering::Less => below(i, j) as f64,
        std::cmp::Ordering::Equal => 1.0,
        std::cmp::Ordering::Greater => 0.0,
    };
    let problem = Lcp::new(Dense::from_fn(n, n, entry), vec![-1.0; n]).unwrap();
    (problem, LcpPoint { z: exact.iter().map(|z| z.to_f64().value()).collect() })
}

#[test]
fn the_rounding_of_an_exact_solution_is_no_error_however_large_it_is() {
    for n in [48, 49, 60, 150, 300] {
        let (problem, known) = growing(n, |_, _| -2);
        assert_eq!(known.z[n - 1], (IBig::from(3).pow(n - 1)).to_f64().value());
        let found = measure(&problem, &known);
        assert!(found.passes(1e-13) && found.floor.unwrap() > 1e5, "{n}: {found:?}");
        // A few last bits, a variable too few, and one that is negative in the end.
        for (at, factor) in [(n - 1, 1.0 + 4e-15), (n - 5, 1.0 - 4e-15), (n - 1, 0.0), (0, -1.0)] {
            let mut wrong = known.clone();
            wrong.z[at] *= factor;
            assert!(!problem.judge(&wrong, 1e-3).unwrap().solved, "{n}: z_{at} times {factor}");
        }
    }
    // Beyond, exact arithmetic is too dear.
    let (problem, known) = growing(301, |_, _| -2);
    assert!(!measure(&problem, &known).passes(1e-3));
}

#[test]
fn exact_arithmetic_ends_with_the_budget_in_force() {
    // Dense, so that the numbers of its elimination grow, and with terms far above q.
    let n = 200;
    let entry = |i: usize, j: usize| ((i * 37 + j * 91) as f64 * 0.618).sin() + 1.5;
    let z: Vec<f64> = (0..n).map(|j| 1e20 * (1.1 + (j as f64).cos())).collect();
    let problem = Lcp::new(Dense::from_fn(n, n, entry), vec![-1.0; n]).unwrap();
    let ended = nonsmooth_linalg::budget::Budget {
        deadline: Some(std::time::Instant::now()),
        ..Default::default()
    };
    let scope = ended.enter();
    let begun = std::time::Instant::now();
    assert!(!measure(&problem, &LcpPoint { z }).passes(1e-8));
    assert!(begun.elapsed().as_secs_f64() < 0.5, "{:?}", begun.elapsed());
    drop(scope);
}

// ---------------------------------------------------------------------------------------------- properties

fn cases() -> impl Strategy<Value = PlantedLcp> {
    (0..PlantedClass::ALL.len(), 2_usize..30, any::<u64>(), 0.0..0.6_f64, prop::bool::ANY).prop_map(
        |(class, n, seed, degenerate, full)| PlantedLcp {
            n,
            class: PlantedClass::ALL[class],
            density: if full { 1.0 } else { 0.2 },
            degenerate,
            seed,
            ..PlantedLcp::default()
        },
    )
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(200))]

    #[test]
    fn planted_solutions_pass_and_points_beside_them_do_not(case in cases(), at in any::<prop::sample::Index>()) {
        let (problem, known) = case.lcp();
        prop_assert!(problem.judge(&known, 1e-13).unwrap().solved);
        let i = at.index(problem.dim());
        let mut wrong = known.clone();
        // Below zero is never right, and is seen where the row has a size or w does not.
        wrong.z[i] = -0.1;
        prop_assert!(!problem.judge(&wrong, 1e-6).unwrap().solved, "{:?}", case);
        // Both positive is not right either, though .01 may be little beside the other terms of its rows.
        let mut w = vec![0.0; problem.dim()];
        problem.M.mul(&known.z, &mut w);
        let free = (0..w.len()).find(|&i| known.z[i] == 0.0 && w[i] + problem.q[i] > 0.5);
        if let Some(i) = free {
            let mut wrong = known.clone();
            wrong.z[i] = 0.01;
            let found = measure(&problem, &wrong);
            prop_assert!(!found.passes(1e-8), "{:?} {:?}", case, found);
        }
    }

    #[test]
    fn points_beside_a_rounded_solution_are_none(n in 49_usize..120, seed in any::<u64>(), at in any::<prop::sample::Index>(), bits in 3..200_i64, up in prop::bool::ANY) {
        let digits = |i: usize, j: usize| -(((seed ^ (i * 131 + j) as u64).wrapping_mul(0x9e37_79b9_7f4a_7c15) >> 40) as i64 % 3);
        let (problem, known) = growing(n, digits);
        prop_assert!(problem.judge(&known, 1e-9).unwrap().solved);
        let at = at.index(n);
        let mut wrong = known.clone();
        let step = f64::EPSILON * bits as f64;
        wrong.z[at] *= if up { 1.0 + step } else { 1.0 - step };
        // Where its own row feels it by more than the tolerance.
        if (wrong.z[at] - known.z[at]).abs() > 1e-3 {
            prop_assert!(!problem.judge(&wrong, 1e-8).unwrap().solved, "{n} {seed} {at}");
        }
    }

    #[test]
    fn storage_and_order_do_not_matter(case in cases(), error in -0.5..0.5_f64, shift in 1_usize..29) {
        let (problem, known) = case.lcp();
        let n = problem.dim();
        let mut z = known.z.clone();
        z.iter_mut().enumerate().for_each(|(i, z)| *z += error * (i as f64).sin());
        let at = point(&z);
        let here = measure(&problem, &at);
        let m = problem.M.to_dense().unwrap();
        let sparse = Lcp::new(m.to_csc(), problem.q.clone()).unwrap();
        let dense = Lcp::new(m.clone(), problem.q.clone()).unwrap();
        prop_assert!(same(&measure(&sparse, &at), &here) && same(&measure(&dense, &at), &here));
        // The plain measure and the one in doubled precision agree but for rounding.
        let plain = problem.measure(&at, &mut problem.gauge().unwrap());
        prop_assert!(same(&plain, &here));
        let moved = |i: usize| (i + shift) % n;
        let turned = Dense::from_fn(n, n, |i, j| m[(moved(i), moved(j))]);
        let q = (0..n).map(|i| problem.q[moved(i)]).collect();
        let there = measure(&Lcp::new(turned, q).unwrap(), &point(&(0..n).map(|i| z[moved(i)]).collect::<Vec<_>>()));
        prop_assert!(same(&there, &here), "{:?} {:?}", there, here);
        // The same problem as a mixed one without free variables, in a box, and horizontally.
        let mixed = Mlcp::new(problem.M.clone(), problem.q.clone(), 0).unwrap();
        prop_assert!(same(&measure(&mixed, &at), &here));
        let boxed = BoxLcp::new(problem.M.clone(), problem.q.clone(), vec![0.0; n], vec![INF; n]).unwrap();
        prop_assert!(same(&measure(&boxed, &at), &here));
        // All rows in another unit.
        let scaled = Dense::from_fn(n, n, |i, j| 1024.0 * m[(i, j)]);
        let q = problem.q.iter().map(|q| 1024.0 * q).collect();
        let other = measure(&Lcp::new(scaled, q).unwrap(), &at);
        prop_assert!(other.relative == here.relative, "{:?} {:?}", other, here);
        // All variables in another unit.
        let scaled = Dense::from_fn(n, n, |i, j| m[(i, j)] / 1024.0);
        let far = point(&z.iter().map(|z| 1024.0 * z).collect::<Vec<_>>());
        let other = measure(&Lcp::new(scaled, problem.q.clone()).unwrap(), &far);
        prop_assert!(other.relative == here.relative, "{:?} {:?}", other, here);
    }

    #[test]
    fn mixed_and_boxed_solutions_pass(seed in any::<u64>(), blocks in 0..3_usize, free in 1..8_usize, pairs in 1..12_usize) {
        let case = PlantedMlcp { free, pairs, blocks: PlantedBlocks::ALL[blocks], seed, ..PlantedMlcp::default() };
        let (problem, known) = case.mlcp();
        prop_assert!(problem.judge(&known, 1e-13).unwrap().solved);
        // An equality that is off by a little.
        let mut off = problem.clone();
        off.q[0] += 1e-4;
        prop_assert!(!off.judge(&known, 1e-7).unwrap().solved);
        let case = PlantedLcp { n: pairs + 1, seed, ..PlantedLcp::default() };
        let (problem, known) = case.boxed();
        prop_assert!(problem.judge(&known, 1e-13).unwrap().solved);
        for i in 0..problem.dim() {
            let mut outside = known.clone();
            outside.z[i] = problem.upper[i] + 0.1;
            if outside.z[i].is_finite() {
                prop_assert!(!problem.judge(&outside, 1e-6).unwrap().solved);
            }
        }
        let (problem, known) = case.hlcp();
        prop_assert!(problem.judge(&known, 1e-13).unwrap().solved);
        for i in 0..problem.dim() {
            let mut wrong = known.clone();
            wrong.x[i] += 1e-3;
            prop_assert!(!problem.judge(&wrong, 1e-7).unwrap().solved);
        }
    }

    #[test]
    fn proofs_of_planted_problems_stand_and_others_fall(seed in any::<u64>(), class in 0..3_usize, n in 6..40_usize, pick in any::<prop::sample::Index>()) {
        let class = [PlantedClass::Psd, PlantedClass::Kkt, PlantedClass::CopositivePlus][class];
        let case = PlantedLcp { n, class, seed, ..PlantedLcp::default() };
        let (problem, proof) = case.infeasible().unwrap();
        prop_assert!(problem.evidence(&proof).holds());
        let Certificate::Farkas { y } = proof else { unreachable!() };
        let there: Vec<_> = (0..n).filter(|&i| y[i] > 0.0).collect();
        let i = there[pick.index(there.len())];
        let changed = |factor: f64| {
            let mut other = y.clone();
            other[i] *= factor;
            problem.evidence(&farkas(&other)).holds()
        };
        // Not by chance: where more of a row is no longer balanced downwards, less of it is.
        prop_assert!(!changed(-1.0), "{}", i);
        prop_assert!(!(changed(1.0 + 1e-6) && changed(1.0 - 1e-6)), "{}", i);
        // The same as a ray, a mixed problem and a box.
        prop_assert!(problem.evidence(&ray(&y, 0.0)).holds());
        prop_assert!(!problem.verify(&ray(&y, 0.1)));
        let mixed = Mlcp::new(problem.M.clone(), problem.q.clone(), 0).unwrap();
        prop_assert!(mixed.evidence(&farkas(&y)).holds());
        let boxed = BoxLcp::new(problem.M.clone(), problem.q.clone(), vec![0.0; n], vec![INF; n]).unwrap();
        prop_assert!(boxed.evidence(&farkas(&y)).holds());
        // Scaled rows: the vector goes with them.
        let m = problem.M.to_dense().unwrap();
        let d = |i: usize| f64::from((i as i32 * 7) % 53 - 26).exp2();
        let scaled = Dense::from_fn(n, n, |i, j| d(i) * m[(i, j)]);
        let q = (0..n).map(|i| d(i) * problem.q[i]).collect();
        let scaled = Lcp::new(scaled, q).unwrap();
        let fitting: Vec<_> = (0..n).map(|i| y[i] / d(i)).collect();
        prop_assert!(scaled.evidence(&farkas(&fitting)).holds());
        // A feasible problem has no proof: raise q until the planted point is a solution again.
        let (feasible, _) = case.lcp();
        prop_assert!(!feasible.evidence(&farkas(&y)).holds());
    }
}

// -------------------------------------------------------------------------------------------- certificates

#[test]
fn certificates_by_hand() {
    // Murty 2.2: both rows add up to −z₁ − z₂ − 2.
    let problem = lcp([[-2.0, 1.0], [1.0, -2.0]], [-1.0, -1.0]);
    assert!(problem.verify(&farkas(&[1.0, 1.0])) && problem.verify(&ray(&[1.0, 1.0], 0.0)));
    assert!(problem.verify(&farkas(&[1e-9, 1e-9])) && problem.verify(&farkas(&[1e9, 1e9])));
    for wrong in
        [&[1.0, 0.0][..], &[0.0, 0.0], &[-1.0, -1.0], &[1.0], &[1.0, f64::NAN], &[INF, INF]]
    {
        assert!(!problem.verify(&farkas(wrong)), "{wrong:?}");
        assert!(!problem.verify(&ray(wrong, 0.0)), "{wrong:?}");
    }
    assert!(!problem.verify(&Certificate::Row { row: 0 }), "a positive entry");
    // 1 × 1.
    let single = lcp([[-1.0]], [-1.0]);
    assert!(single.verify(&Certificate::Row { row: 0 }));
    assert!(!single.verify(&Certificate::Row { row: 1 }));
    assert!(!lcp([[-1.0]], [0.0]).verify(&Certificate::Row { row: 0 }), "z = 0 solves it");
    assert!(!lcp([[1.0]], [-1.0]).verify(&Certificate::Row { row: 0 }));
    // A row whose only positive entry is tiny is no proof: z may be huge.
    assert!(!lcp([[1e-12]], [-1.0]).verify(&Certificate::Row { row: 0 }));
    assert!(!lcp([[1e-12]], [-1.0]).verify(&farkas(&[1.0])));
    assert!(!lcp([[1e-300]], [-1.0]).verify(&farkas(&[1.0])));
}

#[test]
fn residuals_at_the_end_of_the_doubles_are_numbers() {
    // Neither the norm of q nor a row's size times z is a double.
    let problem = lcp([[1e300, -1e300], [1e300, 1e300]], [-1e308, -1.7e308]);
    let at = measure(&problem, &point(&[1.35e8, 0.36e8]));
    assert!(at.absolute > 1e305 && at.absolute.is_finite(), "{at:?}");
    assert!(at.literature > 1e-3 && at.literature < 1.0, "{at:?}");
}

#[test]
fn feasible_problems_without_a_solution_are_refuted_by_cones() {
    // Pang's perturbed problem: feasible, no solution.
    let m = [[0.0, -1.0, -1.0], [1.0, 0.0, 0.0], [-1.0, 0.0, 0.0]];
    let problem = lcp(m, [-1e-4, -1.0, 1.0]);
    // w₀ = −z₁ − z₂ − 1e-4 is negative whatever z: one vector is enough.
    assert!(problem.verify(&Certificate::Row { row: 0 }));
    assert!(problem.verify(&Certificate::Cones { separating: vec![vec![1.0, 0.0, 0.0]] }));
    // [0 1; 0 0] with q = (−1, −1)... the second row never moves.
    let q0 = lcp([[0.0, 1.0], [1.0, 0.0]], [-1.0, -1.0]);
    assert!(!q0.verify(&Certificate::Cones { separating: vec![] }), "(1, 1) solves it");
    // [0 1; −1 0] has complementary cones that leave a quadrant out: q = (1, −1) needs z₀ ≤ −1.
    let skew = lcp([[0.0, 1.0], [-1.0, 0.0]], [1.0, -1.0]);
    assert!(skew.verify(&Certificate::Row { row: 1 }));
    // Feasible, and no cone holds q: M = [−1 2; 2 −1] would be; here [1 2; −1... by all four cones.
    let m = [[0.0, 1.0], [0.0, 1.0]];
    let q = [-1.0, -2.0];
    let problem = lcp(m, q);
    // z₁ = 2: w = (1, 0), z₀ = 0: a solution, so no set of vectors may be accepted.
    assert!(problem.judge(&point(&[0.0, 2.0]), 0.0).unwrap().solved);
    for y in [[1.0, 0.0], [0.0, 1.0], [1.0, 1.0], [1.0, -1.0], [-1.0, 1.0]] {
        assert!(!problem.verify(&Certificate::Cones { separating: vec![y.to_vec()] }), "{y:?}");
    }
    // Feasible without a solution: z₁ ≥ 1 makes w₀ ≥ 0, and then z₁ > 0 asks for w₁ = −z₀ − 1 + ... = 0.
    let m = [[0.0, 1.0], [1.0, 1.0]];
    // w₀ = z₁ − 1, w₁ = z₀ + z₁ + 1 > 0, so z₁ = 0, so w₀ = −1.
    let problem = lcp(m, [-1.0, 1.0]);
    assert!(!problem.verify(&Certificate::Farkas { y: vec![1.0, 0.0] }));
    // Cones {w₀, w₁}, {z₀, w₁}: y = (1, 0); {w₀, z₁}, {z₀, z₁}: with −yᵀM₁ = −(y₀ + y₁) ≥ 0.
    let separating = vec![vec![1.0, 0.0], vec![0.0, -1.0]];
    let both = Certificate::Cones { separating: separating.clone() };
    let first = Certificate::Cones { separating: separating[..1].to_vec() };
    let second = Certificate::Cones { separating: separating[1..].to_vec() };
    assert!(problem.verify(&both), "−z₀ − z₁ ≤ 0 for every z of these cones");
    assert!(!problem.verify(&first) && !problem.verify(&second));
    // A vector that the proof does without is no part of it.
    let three = [&separating[..1], &[vec![0.0, 1.0]], &separating[1..]].concat();
    match problem.evidence(&Certificate::Cones { separating: three }) {
        Evidence::Proved(proof) => assert_eq!(proof.certificate(), &both),
        other => panic!("{other:?}"),
    }
    // No solution in fact: brute force over the four cones.
    for z in [[0.0, 0.0], [1.0, 0.0], [0.0, 1.0], [0.0, 3.0], [2.0, 1.0]] {
        assert!(!problem.judge(&point(&z), 1e-3).unwrap().solved);
    }
}

#[test]
fn certificates_of_mixed_boxed_and_horizontal_problems() {
    // 0 u + v + 1 = 0, v ≥ 0: no solution; the combination of the equality may have any sign.
    let m = rows([[0.0, 1.0], [0.0, 1.0]]);
    let problem = Mlcp::new(m, vec![1.0, 1.0], 1).unwrap();
    assert!(problem.verify(&farkas(&[-1.0, 0.0])));
    assert!(!problem.verify(&farkas(&[1.0, 0.0])) && !problem.verify(&farkas(&[0.0, -1.0])));
    // With a free variable in it nothing follows.
    let m = rows([[1e-6, 1.0], [0.0, 1.0]]);
    assert!(!Mlcp::new(m, vec![1.0, 1.0], 1).unwrap().verify(&farkas(&[-1.0, 0.0])));
    assert!(!problem.verify(&Certificate::Row { row: 0 }), "an equality");
    // Rectangular: two equalities that contradict each other.
    let m = Dense::from_rows(&[[1.0, 0.0], [1.0, 0.0], [0.0, 1.0]]).unwrap();
    let problem = Mlcp::rectangular(m, vec![-1.0, -2.0, 1.0], 2, 1).unwrap();
    assert!(
        problem.verify(&farkas(&[-1.0, 1.0, 0.0])) && !problem.verify(&farkas(&[1.0, -1.0, 0.0]))
    );
    // A box always has a solution where it is bounded; with one bound it may have none.
    let half =
        |q: f64, l: f64, u: f64| BoxLcp::new(rows([[-1.0]]), vec![q], vec![l], vec![u]).unwrap();
    assert!(half(-1.0, 0.0, INF).verify(&farkas(&[1.0])));
    assert!(!half(-1.0, 0.0, 5.0).verify(&farkas(&[1.0])));
    assert!(half(1.0, -INF, 0.0).verify(&farkas(&[-1.0])));
    assert!(!half(-1.0, -2.0, INF).verify(&farkas(&[1.0])), "z = −1 is inside, w = 0");
    assert!(half(-3.0, -2.0, INF).verify(&farkas(&[1.0])));
    // x + s = −1 has no nonnegative solution; x − s = −1 does.
    let horizontal = |r: f64| Hlcp::new(rows([[1.0]]), rows([[r]]), vec![-1.0]).unwrap();
    assert!(horizontal(1.0).verify(&farkas(&[1.0])) && !horizontal(1.0).verify(&farkas(&[-1.0])));
    assert!(!horizontal(-1.0).verify(&farkas(&[1.0])));
    let row = Certificate::Row { row: 0 };
    assert!(horizontal(1.0).verify(&row) && !horizontal(-1.0).verify(&row));
}

/// The terms of a row and its unit may be beyond the doubles where the row is not.
#[test]
fn numbers_near_the_largest_double_are_judged_as_others_are() {
    let third = 1e308 / 3.0;
    for exponent in [0, -900, -1000] {
        let scale = 2_f64.powi(exponent);
        let problem = lcp([[2.0, 1.0], [1.0, 2.0]], [-1e308 * scale; 2]);
        let found = measure(&problem, &point(&[third * scale; 2]));
        assert!(found.passes(1e-15), "{exponent}: {found:?}");
        let off = measure(&problem, &point(&[third * scale * (1.0 + 1e-6); 2]));
        assert!(!off.passes(1e-7) && off.passes(1e-5), "{exponent}: {off:?}");
        assert!(!measure(&problem, &point(&[0.0; 2])).passes(0.1));
    }
}

// ------------------------------------------------------------------------------------------ rounding in q

/// A bar on an elastic bed above a sloping plane, pulled up by a load at its middle: q is the load and, beyond it, the rounding of the plane's second differences. Rows and columns
/// multiplied by powers of two, where `scaled`.
fn bar(n: usize, scaled: bool) -> (Lcp, Vec<f64>) {
    let plane = |i: usize| 0.1 + 0.3 * i as f64 / (n - 1) as f64;
    let power = |i: usize, period: usize| (if scaled { 9 * (i % period) } else { 0 }) as i32;
    let row = |i: usize| 2.0_f64.powi(power(i, 7));
    let column = |j: usize| 2.0_f64.powi(-power(j, 5));
    let entries = (0..n).flat_map(|i| {
        let beside = [i.checked_sub(1), Some(i + 1).filter(|j| *j < n)].into_iter().flatten();
        beside.map(move |j| (i, j, -1.0)).chain([(i, i, 2.0 + 0.01)])
    });
    let entries = entries.map(|(i, j, x)| (i, j, row(i) * x * column(j)));
    let matrix = Csc::from_triplets(n, n, entries).unwrap();
    let q: Vec<f64> = (0..n)
        .map(|i| {
            let noise = if i == 0 || i + 1 == n {
                0.0
            } else {
                2.0 * plane(i) - plane(i - 1) - plane(i + 1)
            };
            let load = if (n / 2..n / 2 + 5).contains(&i) { 1.0 } else { 0.0 };
            row(i) * (noise - load)
        })
        .collect();
    let columns = (0..n).map(column).collect();
    (Lcp::new(matrix, q).unwrap(), columns)
}

#[test]
fn entries_of_q_that_are_rounding_are_no_units() {
    let n = 101;
    let z = eliminated(&bar(n, false).0);
    assert!(z.iter().all(|z| *z > 0.0));
    let plain = measure(&bar(n, false).0, &point(&z));
    assert!(plain.relative < 1e-12, "{plain:?}");
    // The same in other units of rows and columns.
    let (scaled, columns) = bar(n, true);
    assert!(scaled.q.iter().any(|q| *q != 0.0 && q.abs() < 1e-12));
    let there: Vec<f64> = z.iter().zip(&columns).map(|(z, c)| z / c).collect();
    let same = measure(&scaled, &point(&there));
    assert!(same.relative < 1e-12, "{same:?}");
    // What is wrong is wrong: an error of each variable, also of those that only rounding loads.
    for i in [3, 20, n / 2, n - 8] {
        let mut wrong = z.clone();
        wrong[i] *= 1.0 + 1e-4;
        let found = measure(&bar(n, false).0, &point(&wrong));
        assert!(found.relative > 1e-6, "{i}: {found:?}");
    }
}

#[test]
fn small_loads_of_their_own_are_units() {
    // Two parts without a connection, one with a load of 1e-20: that is no rounding of the other's.
    let m = [
        [2.0, -1.0, 0.0, 0.0],
        [-1.0, 2.0, 0.0, 0.0],
        [0.0, 0.0, 1.0, -1.0],
        [0.0, 0.0, -1.0, 1.0],
    ];
    let apart = lcp(m, [-1.0, -1.0, -1e-20, -1e-20]);
    // The second part has none: the sum of its rows is −2e-20. Far along the kernel the terms hide it, the loads do not.
    let found = measure(&apart, &point(&[1.0, 1.0, 1e-8, 1e-8]));
    assert!(found.relative > 0.5, "{found:?}");
    // Coupled to the first part by an entry like all others, it is rounding.
    let mut coupled = m;
    (coupled[1][2], coupled[2][1]) = (-0.5, -0.5);
    coupled[2][2] = 2.0;
    coupled[3][3] = 2.0;
    let coupled = lcp(coupled, [-1.0, -1.0, -1e-20, -1e-20]);
    let z = eliminated(&coupled);
    let found = measure(&coupled, &point(&z));
    assert!(found.relative < 1e-14, "{found:?}");
}

/// `M z = −q` by elimination without pivoting.
fn eliminated(problem: &Lcp) -> Vec<f64> {
    let n = problem.q.len();
    let mut a = vec![vec![0.0; n + 1]; n];
    problem.M.for_each(|i, j, x| a[i][j] = x);
    (0..n).for_each(|i| a[i][n] = -problem.q[i]);
    for k in 0..n {
        for i in k + 1..n {
            let factor = a[i][k] / a[k][k];
            for j in k..=n {
                a[i][j] -= factor * a[k][j];
            }
        }
    }
    let mut z = vec![0.0; n];
    for i in (0..n).rev() {
        let sum: f64 = (i + 1..n).map(|j| a[i][j] * z[j]).sum();
        z[i] = (a[i][n] - sum) / a[i][i];
    }
    z
}
