//! H₊ by the comparison matrix C: moduli on the diagonal, minus moduli beside it.
//!
//! C is a nonsingular M-matrix exactly if some x > 0 has `C x > 0`: x = e for dominant rows (columns: of the transpose), else the solution of `C x = diag(M)`.
//! Where that solution has negative entries, their moduli v have `C v ≤ 0`, which refutes: CottlePangStone2009, theorem 3.11.10.

use super::finding::{compared, comparison, slacks};
use super::interval::Interval;
use super::{How, Why, Witness};
use nonsmooth_linalg::{Csc, Dense, Matrix, SquareLu};

/// Elimination with bounds on rounding errors costs n³, and bounds grow with n.
const ELIMINATED: usize = 40;

/// Whether M, whose diagonal is positive, is in H₊. Cost: a factorisation, unless rows or columns are dominant.
pub(super) fn decide(m: &Matrix) -> Result<Result<How, Witness>, Why> {
    by_vector(m).or_else(|why| if m.nrows() <= ELIMINATED { eliminate(m) } else { Err(why) })
}

/// By the leading minors of C, with bounds on rounding errors: all are positive exactly if C is an M-matrix.
fn eliminate(m: &Matrix) -> Result<Result<How, Witness>, Why> {
    let n = m.nrows();
    let mut c: Vec<_> = (0..n * n).map(|e| compared(m, e / n, e % n)).collect();
    let mut d = Interval::from(1.0);
    for k in 0..n {
        let p = c[k * n + k];
        if p.is_nonpositive() {
            return Ok(Err(Witness::ComparisonMinor { rows: (0..=k).collect() }));
        }
        if !p.is_positive() {
            return Err(Why::Rounding);
        }
        for i in k + 1..n {
            for j in k + 1..n {
                c[i * n + j] = Interval::cross(p, c[i * n + j], c[i * n + k], c[k * n + j]) / d;
            }
        }
        d = p;
    }
    Ok(Ok(How::Comparison))
}

fn by_vector(m: &Matrix) -> Result<Result<How, Witness>, Why> {
    let n = m.nrows();
    if [false, true].into_iter().any(|t| slacks(m, t).iter().all(|s| s.is_positive())) {
        return Ok(Ok(How::Comparison));
    }
    let ones = vec![1.0; n];
    let all: Vec<_> = (0..n).map(|i| (i, 1.0)).collect();
    if comparison(m, &ones).iter().all(|s| s.is_nonpositive()) {
        return Ok(Err(Witness::Comparison { x: all }));
    }
    let moduli = |i: usize, j: usize, x: f64| if i == j { x.abs() } else { -x.abs() };
    let c: Matrix = match m {
        Matrix::Dense(a) => Dense::from_fn(n, n, |i, j| moduli(i, j, a[(i, j)])).into(),
        Matrix::Sparse(a) => {
            let entries = a.triplets().map(|(i, j, x)| (i, j, moduli(i, j, x)));
            Csc::from_triplets(n, n, entries).map_err(|_| Why::Undecided)?.into()
        }
        Matrix::Operator(_) => return Err(Why::Operator),
    };
    if !super::definite::fits(&c) {
        return Err(Why::Operations);
    }
    let mut lu = SquareLu::default();
    let mut x = m.diagonal().ok_or(Why::Operator)?;
    if lu.factorise(&c).is_err() {
        return Err(Why::Rounding);
    }
    lu.solve(&mut x);
    let largest = x.iter().fold(0.0_f64, |l, x| l.max(x.abs()));
    if !(largest > 0.0 && largest.is_finite()) {
        return Err(Why::Rounding);
    }
    // Inverse iteration makes C x comparable to x, where rounding spoils the first one.
    for _ in 0..3 {
        if !x.iter().all(|x| *x > 0.0 && x.is_finite()) {
            break;
        }
        if comparison(m, &x).iter().all(|s| s.is_positive()) {
            return Ok(Ok(How::Comparison));
        }
        lu.solve(&mut x);
    }
    if !x.iter().any(|x| *x < 0.0) {
        return Err(Why::Rounding);
    }
    let entries = |x: &[f64]| {
        let there = x.iter().enumerate().filter(|(_, x)| **x < 0.0);
        there.map(|(i, x)| (i, -x / largest)).collect::<Vec<_>>()
    };
    let witness = Witness::Comparison { x: entries(&x) };
    if witness.refutes(m, super::Class::HPlus) { Ok(Err(witness)) } else { Err(Why::Rounding) }
}
