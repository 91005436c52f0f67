//! Copositive, strictly, and plus, by all principal submatrices of `S = M + Mᵀ`.
//!
//! S is not copositive exactly if some principal submatrix has a negative determinant and an inverse without positive entries (Hadeler1983, theorem 2). Where
//! `xᵀ S x = 0` with x ≥ 0, the zeros are combinations of those x whose support β has a submatrix of corank one with a positive null vector: S is strictly copositive if
//! there is no such β, and copositive-plus if `S x = 0` for each of them.

use super::finding::{doubled, entry, quadratic};
use super::interval::Interval;
use super::minors::symmetric_scale;
use super::tableau::Tableau;
use super::{Class, Witness};
use nonsmooth_linalg::Matrix;

/// What the principal submatrices say of a small matrix.
#[derive(Debug, Clone, Default)]
pub(super) struct Submatrices {
    /// A verified vector with `xᵀ M x < 0`.
    pub(super) negative: Option<Witness>,
    /// A verified vector against strict copositivity.
    pub(super) zero: Option<Witness>,
    /// A verified vector against copositive-plus.
    pub(super) moved: Option<Witness>,
    /// Rounding hides whether there is a negative direction; whether there is a zero.
    pub(super) doubtful: [bool; 2],
    /// The operations ran out.
    pub(super) cut: bool,
}

impl Submatrices {
    pub(super) fn of(m: &Matrix, mut operations: u64) -> Self {
        let n = m.nrows();
        let mut out = Self::default();
        if n > 24 || operations < ((n * n) as u64) << n {
            out.cut = true;
            return out;
        }
        let scale = symmetric_scale(m);
        let at = |i: usize, j: usize| {
            doubled(m, i, j) * Interval::from(scale[i]) * Interval::from(scale[j])
        };
        let visited =
            Tableau::new(n, at).visit(&mut operations, &mut |set, t| out.look(m, &scale, set, t));
        // A submatrix that may be singular: perhaps it is not, and has a negative determinant.
        out.doubtful = out.doubtful.map(|d| d || visited.doubtful);
        out.cut |= visited.cut;
        out
    }

    fn look(&mut self, m: &Matrix, scale: &[f64], set: u32, t: &Tableau) -> bool {
        let n = scale.len();
        let rows: Vec<_> = (0..n).filter(|i| set >> i & 1 == 1).collect();
        let vector = |x: Vec<(usize, f64)>| -> Vec<(usize, f64)> {
            x.into_iter().map(|(i, x)| (i, scale[i] * x)).filter(|e| e.1 != 0.0).collect()
        };
        // N_αα = S_αα⁻¹ = T_αα / d without a positive entry, where d < 0: T_αα has no negative one.
        if !t.d.is_positive() {
            let may =
                |f: fn(Interval) -> bool| rows.iter().all(|&i| rows.iter().all(|&j| f(t.at(i, j))));
            if t.d.is_negative() && may(Interval::is_nonnegative) {
                let x = rows.iter().map(|&i| (i, rows.iter().map(|&j| t.at(i, j).middle()).sum()));
                let x = vector(x.collect());
                if !x.is_empty() && quadratic(m, &x).is_negative() && beyond_rounding(m, &x) {
                    self.negative = Some(Witness::Direction { x });
                    return false;
                }
                self.doubtful[0] = true;
            } else if may(|x| !x.is_negative()) {
                self.doubtful[0] = true;
            }
            return true;
        }
        for k in (0..n).filter(|k| set >> k & 1 == 0) {
            // S_ββ, β = α ∪ {k}, has the null vector x_α = T_αk / d, x_k = 1.
            let corank = t.at(k, k);
            if corank.is_positive() || corank.is_negative() {
                continue;
            }
            if rows.iter().any(|&i| t.at(i, k).is_nonpositive()) {
                continue;
            }
            if !corank.is_zero() || !rows.iter().all(|&i| t.at(i, k).is_positive()) {
                self.doubtful[1] = true;
                continue;
            }
            let x = rows.iter().map(|&i| (i, t.at(i, k).middle())).chain([(k, t.d.middle())]);
            let mut x = vector(x.collect());
            x.sort_by_key(|e| e.0);
            let others = (0..n).filter(|i| *i != k && set >> i & 1 == 0);
            let moves: Vec<_> = others.map(|i| t.at(i, k)).collect();
            let witness = Witness::Direction { x };
            if moves.iter().any(|s| s.is_positive() || s.is_negative()) {
                if witness.refutes(m, Class::CopositivePlus) {
                    self.moved = Some(witness.clone());
                } else {
                    self.doubtful[1] = true;
                }
            } else if !moves.iter().all(|s| s.is_zero()) {
                self.doubtful[1] = true;
            }
            if witness.refutes(m, Class::StrictlyCopositive) {
                self.zero = Some(witness);
            } else {
                self.doubtful[1] = true;
            }
        }
        true
    }
}

/// `xᵀ M x` is larger than what rounding of the entries would make of zero.
fn beyond_rounding(m: &Matrix, x: &[(usize, f64)]) -> bool {
    let terms = x.iter().flat_map(|&(i, a)| x.iter().map(move |&(j, b)| (i, j, a * b)));
    let (value, size) = terms.fold((0.0, 0.0), |(value, size), (i, j, ab)| {
        let term = ab * entry(m, i, j);
        (value + term, size + f64::abs(term))
    });
    f64::abs(value) > 32.0 * f64::EPSILON * size
}
