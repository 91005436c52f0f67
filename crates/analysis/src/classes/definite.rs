//! Positive definite, semidefinite, or neither.
//!
//! A Cholesky factorisation in floating point of `S − c I`, S the symmetric part scaled to a diagonal between 1/2 and 2, proves that S is positive definite, if c
//! exceeds the rounding errors of the factorisation, `γ_{n+1} tr S`: Rump2006. That of `S + c I` says that S is semidefinite up to rounding; where it breaks down, a
//! vector of negative curvature is looked for and verified. Small matrices that are exactly singular are eliminated with bounds on the rounding errors.

use std::cmp::Ordering;

use faer::sparse::linalg::cholesky::{SymmetricOrdering, factorize_symbolic_cholesky};
use faer::sparse::{SparseColMat, SymbolicSparseColMatRef, Triplet};
use faer::{Mat, Side};

use super::finding::{doubled, quadratic, slacks};
use super::graph::components;
use super::interval::Interval;
use super::{How, Why, Witness};
use nonsmooth_linalg::{Csc, Matrix, budget, norm};

/// What is known of the sign of `xᵀ M x`.
#[derive(Debug, Clone)]
pub(super) enum Definite {
    Positive(How),
    /// Semidefinite, and not definite by the witness.
    Semi(How, Witness),
    /// Semidefinite, and nothing more is known.
    AtLeastSemi(How, Why),
    /// By the witness.
    Not(Witness),
    Unknown(Why),
}

/// Elimination with bounds on rounding errors costs `n³`, and bounds grow with n.
const ELIMINATED: usize = 40;
/// All eigenvalues up to this order, Lanczos beyond.
const EIGENVALUES: usize = 200;
/// Steps of Lanczos' method.
const STEPS: usize = 60;

/// The most entries of a factor: a few hundred megabytes.
const MOST_ENTRIES: usize = 50_000_000;

/// Whether a sparse factorisation of a matrix with the pattern of `m + mᵀ` stays within bounds; a random graph fills up completely.
pub(super) fn fits(m: &Matrix) -> bool {
    let (n, Matrix::Sparse(a)) = (m.nrows(), m) else { return true };
    if n * n <= MOST_ENTRIES {
        return true;
    }
    let entries = a.triplets().flat_map(|(i, j, _)| [(i, j, 0.0), (j, i, 0.0)]);
    let Ok(both) = Csc::from_triplets(n, n, entries.filter(|(i, j, _)| i >= j)) else {
        return false;
    };
    let pattern = SymbolicSparseColMatRef::new_checked(n, n, both.col_ptr(), None, both.row_idx());
    factorize_symbolic_cholesky(pattern, Side::Lower, SymmetricOrdering::Amd, Default::default())
        .is_ok_and(|symbolic| symbolic.len_val() <= MOST_ENTRIES)
}

/// Decides at the cost of two Cholesky factorisations.
pub(super) fn decide(m: &Matrix) -> Definite {
    let n = m.nrows();
    let Some(diagonal) = m.diagonal() else { return Definite::Unknown(Why::Operator) };
    if let Some(i) = diagonal.iter().position(|d| *d < 0.0) {
        return Definite::Not(Witness::axis(i));
    }
    if let Some(witness) = pair(m, &diagonal, true) {
        return Definite::Not(witness);
    }
    let dominated = dominant(m, &diagonal);
    if let Some(Definite::Positive(_) | Definite::Semi(..)) = dominated {
        return dominated.unwrap_or(Definite::Unknown(Why::Undecided));
    }
    // A zero on the diagonal has, by now, a row of zeros in M + Mᵀ.
    let rows: Vec<_> = (0..n).filter(|&i| diagonal[i] > 0.0).collect();
    let flat = (0..n).find(|&i| diagonal[i] == 0.0);
    let part = Part::new(m, &diagonal, rows);
    let found = part.decide();
    match (found, flat) {
        (Definite::Positive(how), Some(i)) => Definite::Semi(how, Witness::axis(i)),
        (Definite::AtLeastSemi(how, _), Some(i)) => Definite::Semi(how, Witness::axis(i)),
        (Definite::Unknown(why), _) if dominated.is_some() => {
            Definite::AtLeastSemi(How::Dominance, why)
        }
        (found, _) => found,
    }
}

/// Two rows whose minor of M + Mᵀ is negative, in spite of rounding (`beyond`), or else exactly zero.
pub(super) fn pair(m: &Matrix, diagonal: &[f64], beyond: bool) -> Option<Witness> {
    let mut found = None;
    m.for_each(|i, j, _| {
        if i == j || found.is_some() {
            return;
        }
        let s = doubled(m, i, j);
        let (size, most) = (s.middle() * s.middle(), 4.0 * diagonal[i] * diagonal[j]);
        // Of a matrix of rank one the sign is a matter of rounding.
        let rounding = 16.0 * f64::EPSILON * most;
        if size < most - rounding || (beyond && size <= most + rounding) {
            return;
        }
        let four = Interval::from(4.0) * Interval::from(diagonal[i]) * Interval::from(diagonal[j]);
        let minor = four - s * s;
        if minor.is_negative() || (!beyond && minor.is_zero()) {
            found = Some(Witness::SymmetricMinor { rows: vec![i.min(j), i.max(j)] });
        }
    });
    found
}

/// By the diagonal of M + Mᵀ alone.
fn dominant(m: &Matrix, diagonal: &[f64]) -> Option<Definite> {
    let (row, column) = (slacks(m, false), slacks(m, true));
    let sum: Vec<_> = row.iter().zip(&column).map(|(a, b)| *a + *b).collect();
    if !sum.iter().all(|s| s.is_nonnegative()) {
        return None;
    }
    let positive = diagonal.iter().all(|d| *d > 0.0);
    let strict = |rows: &Vec<usize>| rows.iter().any(|&i| sum[i].is_positive());
    Some(if positive && components(m, |_, _, _| true).iter().all(strict) {
        Definite::Positive(How::Dominance)
    } else if let Some(i) = diagonal.iter().position(|d| *d == 0.0) {
        Definite::Semi(How::Dominance, Witness::axis(i))
    } else {
        let ones: Vec<_> = (0..m.nrows()).map(|i| (i, 1.0)).collect();
        if quadratic(m, &ones).is_nonpositive() {
            Definite::Semi(How::Dominance, Witness::Direction { x: ones })
        } else {
            // Definite perhaps, where an entry of M + Mᵀ is smaller than those of M and Mᵀ, or by signs.
            Definite::AtLeastSemi(How::Dominance, Why::Undecided)
        }
    })
}

/// The rows and columns with a positive diagonal, to be scaled.
struct Part<'a> {
    m: &'a Matrix,
    rows: Vec<usize>,
    /// Powers of two.
    scale: Vec<f64>,
    trace: f64,
}

impl<'a> Part<'a> {
    fn new(m: &'a Matrix, diagonal: &[f64], rows: Vec<usize>) -> Self {
        let mut scale = vec![0.0; diagonal.len()];
        rows.iter().for_each(|&i| scale[i] = (-0.5 * diagonal[i].log2()).round().exp2());
        let trace = rows.iter().map(|&i| diagonal[i] * scale[i] * scale[i]).sum();
        Self { m, rows, scale, trace }
    }

    fn decide(&self) -> Definite {
        let k = self.rows.len();
        if k == 0 {
            return Definite::AtLeastSemi(How::Entries, Why::Undecided);
        }
        if !fits(self.m) {
            return Definite::Unknown(Why::Operations);
        }
        let shift = 2.0 * (k + 4) as f64 * f64::EPSILON * self.trace;
        if self.has_cholesky(-shift) {
            return Definite::Positive(How::Cholesky);
        }
        let nearly = self.has_cholesky(shift);
        if !nearly && let Some(witness) = self.negative_curvature() {
            return Definite::Not(witness);
        }
        let eliminated = if k <= ELIMINATED { self.eliminate() } else { None };
        // A minor that is negative by rounding refutes nothing.
        let eliminated = eliminated.filter(|found| !nearly || !matches!(found, Definite::Not(_)));
        eliminated.unwrap_or(Definite::Unknown(match nearly {
            true => Why::UpToRounding,
            false => Why::Undecided,
        }))
    }

    /// Whether the scaled symmetric part plus `shift I` has a Cholesky factorisation.
    fn has_cholesky(&self, shift: f64) -> bool {
        let k = self.rows.len();
        let scale = &self.scale;
        if budget::over() {
            return false;
        }
        match self.m {
            Matrix::Dense(_) => self.dense(shift).llt(Side::Lower).is_ok(),
            _ => {
                let mut place = vec![usize::MAX; scale.len()];
                self.rows.iter().enumerate().for_each(|(at, &i)| place[i] = at);
                let mut entries: Vec<_> = (0..k).map(|i| (i, i, shift)).collect();
                self.m.for_each(|i, j, x| {
                    let (a, b) = (place[i], place[j]);
                    if a != usize::MAX && b != usize::MAX {
                        let half = if i == j { 1.0 } else { 0.5 };
                        entries.push((a.max(b), a.min(b), half * (scale[i] * x * scale[j])));
                    }
                });
                let Ok(lower) = Csc::from_triplets(k, k, entries.into_iter()) else { return false };
                let lower: Vec<_> =
                    lower.triplets().map(|(i, j, x)| Triplet::new(i, j, x)).collect();
                SparseColMat::<usize, f64>::try_new_from_triplets(k, k, &lower)
                    .is_ok_and(|a| a.sp_cholesky(Side::Lower).is_ok())
            }
        }
    }

    fn dense(&self, shift: f64) -> Mat<f64> {
        let entry = |i: usize, j: usize| super::finding::entry(self.m, i, j);
        Mat::from_fn(self.rows.len(), self.rows.len(), |a, b| {
            let (i, j) = (self.rows[a], self.rows[b]);
            let s = 0.5 * entry(i, j) + 0.5 * entry(j, i);
            self.scale[i] * s * self.scale[j] + if a == b { shift } else { 0.0 }
        })
    }

    /// A vector with `xᵀ M x < 0`, verified.
    fn negative_curvature(&self) -> Option<Witness> {
        let x = if self.rows.len() <= EIGENVALUES { self.eigenvector()? } else { self.lanczos()? };
        let largest = x.iter().fold(0.0_f64, |l, x| l.max(x.abs()));
        let x: Vec<_> = (self.rows.iter().zip(&x))
            .filter(|(_, x)| x.abs() > 1e-12 * largest)
            .map(|(&i, x)| (i, self.scale[i] * x / largest))
            .collect();
        quadratic(self.m, &x).is_negative().then_some(Witness::Direction { x })
    }

    fn eigenvector(&self) -> Option<Vec<f64>> {
        let eigen = self.dense(0.0).self_adjoint_eigen(Side::Lower).ok()?;
        let column = eigen.U().col(0);
        Some((0..self.rows.len()).map(|i| column[i]).collect())
    }

    /// The vector of the least Ritz value after a few steps of Lanczos' method, with full orthogonalisation.
    fn lanczos(&self) -> Option<Vec<f64>> {
        let k = self.rows.len();
        let n = self.scale.len();
        let (mut x, mut y, mut z) = (vec![0.0; n], vec![0.0; n], vec![0.0; n]);
        let mut basis: Vec<Vec<f64>> = vec![];
        let (mut alpha, mut beta) = (vec![], vec![]);
        let mut v: Vec<f64> =
            (0..k).map(|i| (i as f64 * 0.618_033_988_749_895).fract() - 0.5).collect();
        for _ in 0..STEPS.min(k) {
            let size = norm(&v);
            if size.is_nan() || size <= 1e-12 || budget::over() {
                break;
            }
            if !basis.is_empty() {
                beta.push(size);
            }
            v.iter_mut().for_each(|v| *v /= size);
            self.rows.iter().zip(&v).for_each(|(&i, v)| x[i] = self.scale[i] * v);
            self.m.mul(&x, &mut y);
            self.m.mul_transpose(&x, &mut z);
            let mut w: Vec<_> =
                self.rows.iter().map(|&i| 0.5 * self.scale[i] * (y[i] + z[i])).collect();
            let dot = |a: &[f64], b: &[f64]| a.iter().zip(b).map(|(a, b)| a * b).sum::<f64>();
            alpha.push(dot(&v, &w));
            basis.push(v);
            for _ in 0..2 {
                for u in &basis {
                    let part = dot(u, &w);
                    w.iter_mut().zip(u).for_each(|(w, u)| *w -= part * u);
                }
            }
            v = w;
        }
        let steps = alpha.len();
        if steps == 0 {
            return None;
        }
        let t = Mat::from_fn(steps, steps, |i, j| match i.abs_diff(j) {
            0 => alpha[i],
            1 => beta[i.min(j)],
            _ => 0.0,
        });
        let eigen = t.self_adjoint_eigen(Side::Lower).ok()?;
        let column = eigen.U().col(0);
        let mut out = vec![0.0; k];
        for (s, u) in basis.iter().enumerate() {
            out.iter_mut().zip(u).for_each(|(o, u)| *o += column[s] * u);
        }
        Some(out)
    }

    /// Elimination without fractions along the diagonal; `None` where rounding hides a sign.
    fn eliminate(&self) -> Option<Definite> {
        let k = self.rows.len();
        let mut t: Vec<Interval> = (0..k * k)
            .map(|e| {
                let (i, j) = (self.rows[e / k], self.rows[e % k]);
                doubled(self.m, i, j)
                    * Interval::from(self.scale[i])
                    * Interval::from(self.scale[j])
            })
            .collect();
        let mut d = Interval::from(1.0);
        let (mut left, mut done): (Vec<usize>, Vec<usize>) = ((0..k).collect(), vec![]);
        let minor = |done: &[usize], more: &[usize]| {
            let mut rows: Vec<_> = done.iter().chain(more).map(|&a| self.rows[a]).collect();
            rows.sort_unstable();
            rows
        };
        while !left.is_empty() {
            if let Some(&a) = left.iter().find(|&&a| t[a * k + a].is_negative()) {
                return Some(Definite::Not(Witness::SymmetricMinor { rows: minor(&done, &[a]) }));
            }
            let sure = |a: &usize| t[a * k + a].sign() == Some(Ordering::Greater);
            let Some(at) = left.iter().position(sure) else {
                // Nothing but zeros may be left.
                for &a in &left {
                    for &b in &left {
                        match t[a * k + b].sign()? {
                            Ordering::Equal => {}
                            _ if a == b => return None,
                            _ if !t[a * k + a].is_zero() || !t[b * k + b].is_zero() => return None,
                            _ => {
                                let rows = minor(&done, &[a, b]);
                                return Some(Definite::Not(Witness::SymmetricMinor { rows }));
                            }
                        }
                    }
                }
                let rows = minor(&done, &left[..1]);
                return Some(Definite::Semi(How::Elimination, Witness::SymmetricMinor { rows }));
            };
            if budget::over() {
                return None;
            }
            let p = left.swap_remove(at);
            let pivot = t[p * k + p];
            for &i in &left {
                for &j in &left {
                    t[i * k + j] =
                        Interval::cross(pivot, t[i * k + j], t[i * k + p], t[p * k + j]) / d;
                }
            }
            d = pivot;
            done.push(p);
        }
        Some(Definite::Positive(How::Elimination))
    }
}
