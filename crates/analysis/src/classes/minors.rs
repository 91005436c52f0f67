//! P and P0 by principal minors, one irreducible diagonal block after the other: a principal minor is the product of those of the blocks.
//!
//! Minors of `α ∪ {k}` come from the Schur complement of α, so all 2ⁿ of them cost about 6·2ⁿ operations (TsatsomerosLi2000). Below a minor that vanishes the
//! rest of that branch is computed one by one.

use std::cmp::Ordering;

use super::finding::entry;
use super::interval::Interval;
use super::tableau::determinant_sign;
use nonsmooth_linalg::Matrix;

/// What the minors of a block say.
#[derive(Debug, Clone, Default)]
pub(super) struct Minors {
    /// The rows of a minor that is not positive.
    pub(super) not_positive: Option<Vec<usize>>,
    /// The rows of a minor that is negative.
    pub(super) negative: Option<Vec<usize>>,
    /// Rounding hides the sign of some minor.
    pub(super) doubtful: bool,
    /// The operations ran out.
    pub(super) cut: bool,
    left: u64,
}

impl Minors {
    /// All principal minors of a small matrix.
    pub(super) fn of(m: &Matrix, operations: u64) -> Self {
        let n = m.nrows();
        let mut out = Self { left: operations, ..Self::default() };
        if n >= 60 || operations < 6 << n {
            out.cut = true;
            return out;
        }
        let scale = symmetric_scale(m);
        let t: Vec<_> = (0..n * n)
            .map(|e| {
                let (i, j) = (e / n, e % n);
                Interval::from(entry(m, i, j)) * Interval::from(scale[i]) * Interval::from(scale[j])
            })
            .collect();
        let rows: Vec<_> = (0..n).collect();
        out.go(&t, &rows, Interval::from(1.0), &mut vec![]);
        out
    }

    /// `t` is d times the Schur complement of the rows in `set`, `rows` its rows. False to stop.
    fn go(&mut self, t: &[Interval], rows: &[usize], d: Interval, set: &mut Vec<usize>) -> bool {
        let m = rows.len();
        for k in 0..m {
            let p = t[k * m + k];
            let rest = m - k - 1;
            match p.sign() {
                Some(Ordering::Greater) => {
                    let cost = (rest * rest) as u64 + 1;
                    if self.left < cost {
                        self.cut = true;
                        return false;
                    }
                    self.left -= cost;
                    let child: Vec<_> = (0..rest * rest)
                        .map(|e| {
                            let (i, j) = (k + 1 + e / rest, k + 1 + e % rest);
                            Interval::cross(p, t[i * m + j], t[i * m + k], t[k * m + j]) / d
                        })
                        .collect();
                    set.push(rows[k]);
                    let on = self.go(&child, &rows[k + 1..], p, set);
                    set.pop();
                    if !on {
                        return false;
                    }
                }
                Some(Ordering::Less) => {
                    self.negative = Some([&set[..], &[rows[k]]].concat());
                    self.not_positive = self.negative.clone();
                    return false;
                }
                Some(Ordering::Equal) => {
                    if self.not_positive.is_none() {
                        self.not_positive = Some([&set[..], &[rows[k]]].concat());
                    }
                    if !self.below_zero(t, rows, k, set) {
                        return false;
                    }
                }
                None => self.doubtful = true,
            }
        }
        true
    }

    /// The minors of the sets that hold row k, whose own minor vanishes, and later rows.
    fn below_zero(&mut self, t: &[Interval], rows: &[usize], k: usize, set: &[usize]) -> bool {
        let m = rows.len();
        let rest = m - k - 1;
        let cost = (1_u64 << rest) * ((rest * rest * rest) as u64 / 16 + 1);
        if self.left < cost {
            self.cut = true;
            return false;
        }
        self.left -= cost;
        for bits in 1_u64..1 << rest {
            let chosen = (0..rest).filter(|b| bits >> b & 1 == 1).map(|b| k + 1 + b);
            let at: Vec<_> = std::iter::once(k).chain(chosen).collect();
            match determinant_sign(at.len(), |i, j| t[at[i] * m + at[j]]) {
                Some(Ordering::Less) => {
                    let more: Vec<_> = at.iter().map(|&i| rows[i]).collect();
                    self.negative = Some([set, &more[..]].concat());
                    return false;
                }
                Some(_) => {}
                None => self.doubtful = true,
            }
        }
        true
    }
}

/// Powers of two that bring the diagonal near 1: the signs of minors stay.
pub(super) fn symmetric_scale(m: &Matrix) -> Vec<f64> {
    let diagonal = m.diagonal().unwrap_or_default();
    diagonal
        .iter()
        .map(|d| if *d == 0.0 { 1.0 } else { (-0.5 * d.abs().log2()).round().exp2() })
        .collect()
}
