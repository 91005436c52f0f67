//! What the judge says of a linear complementarity problem does not depend on the units of its rows and columns, to the last bit, and what it accepts is a solution.

use nonsmooth_linalg::{Dense, Matrix};
use nonsmooth_problem::check::{Judged, Measure};
use nonsmooth_problem::{BoxLcp, Hlcp, HlcpPoint, Lcp, LcpPoint, Mlcp, Problem};
use rand::{RngExt, SeedableRng};
use rand_pcg::Pcg64Mcg;

const INF: f64 = f64::INFINITY;

fn power(rng: &mut Pcg64Mcg) -> f64 {
    f64::from(rng.random_range(-40..=40)).exp2()
}

fn powers(rng: &mut Pcg64Mcg, n: usize) -> Vec<f64> {
    (0..n).map(|_| power(rng)).collect()
}

/// An entry: small integers with many zeros, or a real number of any size.
fn entry(rng: &mut Pcg64Mcg, integers: bool) -> f64 {
    if integers {
        f64::from(rng.random_range(-4..=4_i32))
    } else if rng.random_bool(0.3) {
        0.0
    } else {
        rng.random_range(-1.0..1.0) * 10.0_f64.powi(rng.random_range(-3..=3))
    }
}

/// A matrix, with an empty row or column now and then, or two rows alike.
fn matrix(rng: &mut Pcg64Mcg, m: usize, n: usize, integers: bool) -> Dense {
    let mut a = Dense::from_fn(m, n, |_, _| entry(rng, integers));
    let (row, column) = (rng.random_range(0..m), rng.random_range(0..n));
    match rng.random_range(0..6) {
        0 => (0..n).for_each(|j| a[(row, j)] = 0.0),
        1 => (0..m).for_each(|i| a[(i, column)] = 0.0),
        2 => (0..n).for_each(|j| a[(0, j)] = a[(row, j)]),
        _ => {}
    }
    a
}

fn vector(rng: &mut Pcg64Mcg, n: usize, integers: bool) -> Vec<f64> {
    (0..n).map(|_| entry(rng, integers)).collect()
}

/// A point with zeros, small and large entries.
fn point(rng: &mut Pcg64Mcg, n: usize) -> Vec<f64> {
    (0..n)
        .map(|_| match rng.random_range(0..4) {
            0 => 0.0,
            1 => rng.random_range(-1e-9..1e-6),
            2 => f64::from(rng.random_range(0..=4_i32)),
            _ => rng.random_range(0.0..3.0),
        })
        .collect()
}

fn scaled(a: &Dense, rows: &[f64], columns: &[f64], sparse: bool) -> Matrix {
    let b = Dense::from_fn(a.nrows(), a.ncols(), |i, j| rows[i] * a[(i, j)] * columns[j]);
    if sparse { b.to_csc().into() } else { b.into() }
}

fn times(a: &[f64], b: &[f64]) -> Vec<f64> {
    a.iter().zip(b).map(|(a, b)| a * b).collect()
}

fn over(a: &[f64], b: &[f64]) -> Vec<f64> {
    a.iter().zip(b).map(|(a, b)| a / b).collect()
}

/// The deciding numbers, and those of the tidied point with the point itself.
fn judged<P: Problem + Judged>(
    problem: &P,
    point: &P::Point,
    boldly: bool,
) -> ([f64; 4], [f64; 4], P::Point) {
    let mut gauge = problem.gauge().unwrap();
    let numbers = |m: Measure| [m.relative, m.primal, m.dual, m.complementarity];
    let first = problem.certify(point, &mut gauge);
    assert_eq!(problem.judge(point, 1e-8).unwrap().solved, first.relative <= 1e-8);
    assert!(first.primal.max(first.dual).max(first.complementarity) <= first.relative);
    let mut tidied = point.clone();
    problem.tidy(&mut tidied, &mut gauge, boldly);
    (numbers(first), numbers(problem.certify(&tidied, &mut gauge)), tidied)
}

#[test]
fn the_verdict_is_the_same_in_all_units() {
    for seed in 0..4000 {
        let mut rng = Pcg64Mcg::seed_from_u64(seed);
        let (n, integers, sparse) =
            (rng.random_range(1..=7), rng.random_bool(0.5), rng.random_bool(0.5));
        let boldly = rng.random_bool(0.5);
        let (m, q) = (matrix(&mut rng, n, n, integers), vector(&mut rng, n, integers));
        let ones = vec![1.0; n];
        let (rows, columns) = (powers(&mut rng, n), powers(&mut rng, n));
        let z = point(&mut rng, n);
        let (at, there) = (LcpPoint { z: z.clone() }, LcpPoint { z: over(&z, &columns) });
        let back = |p: LcpPoint| times(&p.z, &columns);

        let here = Lcp::new(scaled(&m, &ones, &ones, sparse), q.clone()).unwrap();
        let other = Lcp::new(scaled(&m, &rows, &columns, sparse), times(&q, &rows)).unwrap();
        let (a, b) = (judged(&here, &at, boldly), judged(&other, &there, boldly));
        assert_eq!((a.0, a.1, a.2.z), (b.0, b.1, back(b.2)), "seed {seed}, LCP");

        let (free, equalities) = (rng.random_range(0..=n), rng.random_range(0..=n));
        let mixed = |problem: &Lcp, columns: &[f64]| {
            // As many pairs on both sides: rows and columns are dropped or not.
            let pairs = (n - free).min(n - equalities);
            let a = problem.M.to_dense().unwrap();
            let (k, l) = (equalities + pairs, free + pairs);
            let m = Dense::from_fn(k, l, |i, j| a[(i, j)]);
            let q = problem.q[..k].to_vec();
            let z = over(&z[..l], &columns[..l]);
            (Mlcp::rectangular(m, q, equalities, free), LcpPoint { z })
        };
        let ((a, at_a), (b, at_b)) = (mixed(&here, &ones), mixed(&other, &columns));
        if let (Ok(a), Ok(b)) = (a, b) {
            let (a, b) = (judged(&a, &at_a, boldly), judged(&b, &at_b, boldly));
            assert_eq!((a.0, a.1), (b.0, b.1), "seed {seed}, MLCP");
            assert_eq!(a.2.z, times(&b.2.z, &columns), "seed {seed}, MLCP");
        }

        let bound = |rng: &mut Pcg64Mcg| match rng.random_range(0..4) {
            0 => (0.0, INF),
            1 => (-INF, f64::from(rng.random_range(-2..=2_i32))),
            2 => (-INF, INF),
            _ => {
                let l = f64::from(rng.random_range(-2..=2_i32));
                (l, l + f64::from(rng.random_range(0..=3_i32)))
            }
        };
        let (l, u): (Vec<_>, Vec<_>) = (0..n).map(|_| bound(&mut rng)).unzip();
        let a = BoxLcp::new(here.M.clone(), here.q.clone(), l.clone(), u.clone()).unwrap();
        let bounds = (over(&l, &columns), over(&u, &columns));
        let b = BoxLcp::new(other.M.clone(), other.q.clone(), bounds.0, bounds.1).unwrap();
        let (a, b) = (judged(&a, &at, boldly), judged(&b, &there, boldly));
        assert_eq!((a.0, a.1, a.2.z), (b.0, b.1, back(b.2)), "seed {seed}, box");

        let r = matrix(&mut rng, n, n, integers);
        let (of_s, s) = (powers(&mut rng, n), point(&mut rng, n));
        let a = Hlcp::new(here.M.clone(), scaled(&r, &ones, &ones, sparse), q).unwrap();
        let b = Hlcp::new(other.M.clone(), scaled(&r, &rows, &of_s, sparse), other.q.clone());
        let a = judged(&a, &HlcpPoint { x: z.clone(), s: s.clone() }, boldly);
        let b = judged(&b.unwrap(), &HlcpPoint { x: there.z, s: over(&s, &of_s) }, boldly);
        assert_eq!((a.0, a.1), (b.0, b.1), "seed {seed}, horizontal");
        let back = (times(&b.2.x, &columns), times(&b.2.s, &of_s));
        assert_eq!((a.2.x, a.2.s), back, "seed {seed}, horizontal");
    }
}

#[test]
fn a_point_that_runs_away_in_the_kernel_is_no_solution() {
    // w = (−1, −1) wherever z = t (1, 1): small beside the terms of its rows, not beside q.
    let m = Dense::from_rows(&[[1.0, -1.0], [-1.0, 1.0]]).unwrap();
    let problem = Lcp::new(m, vec![-1.0, -1.0]).unwrap();
    for t in [1e3, 1e9, 1e12, 1e15] {
        let found = problem.judge(&LcpPoint { z: vec![t, t] }, 1e-3).unwrap();
        // At least one, and more by what doubled precision leaves in doubt only.
        let relative = found.measure.relative;
        assert!(!found.solved && (1.0..1.0 + 1e-12).contains(&relative), "{found:?}");
    }
    // Nor is one whose variables are far apart: the third is neither zero nor its w.
    let m = [[1.0, -1.0, 1.0], [-1.0, 1.0, 0.0], [0.0, 0.0, 0.0]];
    let problem = Lcp::new(Dense::from_rows(&m).unwrap(), vec![-1.0, 0.0, 1.0]).unwrap();
    let found = problem.judge(&LcpPoint { z: vec![1e12, 1e12, 1.0] }, 1e-3).unwrap();
    assert!(!found.solved, "{found:?}");
}

#[test]
fn an_empty_column_excuses_nothing() {
    let m = Dense::from_rows(&[[0.0, 1.0], [0.0, 1.0]]).unwrap();
    let problem = Lcp::new(m.clone(), vec![1.0, -1.0]).unwrap();
    for z in [-1e-300, 1e-300, 3.0] {
        assert!(!problem.judge(&LcpPoint { z: vec![z, 1.0] }, 0.9).unwrap().solved, "{z}");
    }
    // Tidied, it is where it should be.
    let (mut point, mut gauge) = (LcpPoint { z: vec![3.0, 1.0] }, problem.gauge().unwrap());
    let _ = problem.certify(&point, &mut gauge);
    assert!(problem.tidy(&mut point, &mut gauge, false) && point.z == [0.0, 1.0]);
    assert!(problem.judge(&point, 0.0).unwrap().solved);
    // Where w is zero, a variable may be anywhere between its bounds.
    let problem = Lcp::new(m, vec![-1.0, -1.0]).unwrap();
    assert!(problem.judge(&LcpPoint { z: vec![3.0, 1.0] }, 0.0).unwrap().solved);
    assert!(!problem.judge(&LcpPoint { z: vec![-1e-9, 1.0] }, 0.9).unwrap().solved);
}

/// What is zero of its own and may have both signs: a row of which nothing is left but its rounding refuses no point.
#[test]
fn free_variables_that_are_zero_but_for_rounding_are_put_there() {
    // x₀ = x₁, x₀ + 2 x₁ = 0, 0 ≤ x₂ ⟂ x₀ + x₂ − 1 ≥ 0.
    let m = [[1.0, -1.0, 0.0], [1.0, 2.0, 0.0], [1.0, 0.0, 1.0]];
    let q = vec![0.0, 0.0, -1.0];
    let problem = Mlcp::new(Dense::from_rows(&m).unwrap(), q, 2).unwrap();
    let mut gauge = problem.gauge().unwrap();
    for noise in [7e-33, 1e-15, 3e-280] {
        let mut point = LcpPoint { z: vec![noise, -0.5 * noise, 1.0] };
        assert!(!problem.certify(&point, &mut gauge).passes(0.5), "{noise}");
        assert!(problem.tidy(&mut point, &mut gauge, true) && point.z == [0.0, 0.0, 1.0]);
        assert!(problem.certify(&point, &mut gauge).passes(1e-15));
    }
    // Not so what is an error.
    let mut point = LcpPoint { z: vec![1e-9, 1e-9, 1.0] };
    let _ = problem.certify(&point, &mut gauge);
    problem.tidy(&mut point, &mut gauge, true);
    assert!(point.z[0] == 1e-9 && !problem.certify(&point, &mut gauge).passes(1e-8));
}

#[test]
fn products_beyond_the_range_of_doubles_are_not_trusted() {
    let m = Dense::from_rows(&[[1e-200]]).unwrap();
    let problem = Lcp::new(m, vec![0.0]).unwrap();
    assert!(!problem.judge(&LcpPoint { z: vec![1e-200] }, 0.9).unwrap().solved);
    assert!(problem.judge(&LcpPoint { z: vec![0.0] }, 0.0).unwrap().solved);
}
