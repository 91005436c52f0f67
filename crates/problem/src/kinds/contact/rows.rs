//! The bounds of scalar rows.

use crate::ProblemError;
use crate::error;

/// What the impulse λ_j of each scalar row may be, `l_j ≤ λ_j ≤ u_j`; with c the velocity of the row, `−c_j ∈ N_[l_j, u_j](λ_j)`: `c_j ≥ 0` where
/// `λ_j = l_j`, `c_j ≤ 0` where `λ_j = u_j`, and `c_j = 0` between.
///
/// | bounds | the row is |
/// | --- | --- |
/// | `−∞, ∞` | free: a bilateral constraint, `c = 0` |
/// | `0, ∞` | a half line: a limit of a joint, a rope, `0 ≤ λ ⟂ c ≥ 0` |
/// | `l, u` | a box: a motor of limited strength, dry friction in a joint |
///
/// Units: those of the impulses of the row, N·s or N·m·s.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Bounds {
    /// l, p, −∞ allowed; empty: all rows are free.
    pub lower: Vec<f64>,
    /// u, p, ∞ allowed; empty where l is.
    pub upper: Vec<f64>,
}

impl Bounds {
    /// `[l_j, u_j]`.
    pub fn of(&self, row: usize) -> [f64; 2] {
        let bound = |all: &[f64], none: f64| all.get(row).copied().unwrap_or(none);
        [bound(&self.lower, f64::NEG_INFINITY), bound(&self.upper, f64::INFINITY)]
    }

    /// Whether row j has no bound.
    pub fn is_free(&self, row: usize) -> bool {
        self.of(row) == [f64::NEG_INFINITY, f64::INFINITY]
    }

    /// The rows that have a bound.
    pub fn bounded(&self) -> impl Iterator<Item = usize> + '_ {
        (0..self.lower.len()).filter(|&j| !self.is_free(j))
    }

    /// The rows of p that have none.
    pub fn free(&self, rows: usize) -> Vec<usize> {
        (0..rows).filter(|&j| self.is_free(j)).collect()
    }

    /// Whether no row has a bound: all are bilateral constraints.
    pub fn are_free(&self) -> bool {
        self.bounded().next().is_none()
    }

    /// The impulse of row j that is nearest to none.
    pub fn least(&self, row: usize) -> f64 {
        let [l, u] = self.of(row);
        0.0_f64.clamp(l, u)
    }

    /// The part of `w (λ_j − P_[l, u](λ_j − c/w))` that says how far λ_j and the velocity c are from the law of the row, a velocity: the one in the middle of
    /// `w (λ − u)`, c and `w (λ − l)`. The factor w > 0, the velocity that a unit impulse makes, is its own unit only.
    pub fn residual(&self, row: usize, lambda: f64, c: f64, w: f64) -> f64 {
        let [l, u] = self.of(row);
        // Neither `min` nor `max` lets a NaN through.
        if c.is_nan() || lambda.is_nan() {
            return f64::NAN;
        }
        c.min(w * (lambda - l)).max(w * (lambda - u))
    }

    /// How far λ_j and the velocity c, whose terms have this size and which is known but for `rounding`, are from the law of the row, and the size that this is compared with. Only c is rounded: where it is
    /// more than that, λ_j is wrong by its way to the bound, however little the row moves.
    pub(crate) fn violation(
        &self,
        row: usize,
        (lambda, c): (f64, f64),
        w: f64,
        (size, rounding): (f64, f64),
    ) -> (f64, f64) {
        let c = match rounding {
            none if !none.is_finite() => c,
            _ if c.abs() <= rounding => 0.0,
            _ => c - rounding.copysign(c),
        };
        if self.is_free(row) {
            return (c, size);
        }
        (self.residual(row, lambda, c, w), self.size_of(row, (lambda, c), w, size))
    }

    /// What [`residual`](Self::residual) is compared with, of a velocity whose terms have this size. An impulse that is not on the bound that it has to be on is wrong by its part of the
    /// bounds, however fast the row moves: a motor that never reaches its velocity.
    fn size_of(&self, row: usize, (lambda, c): (f64, f64), w: f64, size: f64) -> f64 {
        let bounds = self.of(row).map(|b| if b.is_finite() { b.abs() } else { 0.0 });
        let stated = bounds[0].max(bounds[1]);
        // The impulse is no term of c, but may be all there is.
        let terms = size + (w * lambda).abs();
        match self.residual(row, lambda, c, w) == c || stated == 0.0 {
            true => terms,
            false => terms.min(w * (stated + lambda.abs())),
        }
    }

    /// The lengths fit and the bounds do not cross.
    pub(crate) fn validate(&self, rows: usize, meaning: &str) -> Result<(), ProblemError> {
        match self.lower.is_empty() && self.upper.is_empty() {
            true => Ok(()),
            false => error::bounds([&self.lower, &self.upper], rows, meaning),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// φ against its definition by a projection, and zero exactly where the law holds.
    #[test]
    fn the_residual_is_that_of_the_projection() {
        let inf = f64::INFINITY;
        let kinds: [[f64; 2]; 5] = [[-inf, inf], [0.0, inf], [-inf, 1.0], [-1.0, 2.0], [0.5, 0.5]];
        for [l, u] in kinds {
            let bounds = Bounds { lower: vec![l], upper: vec![u] };
            for lambda in [-3.0_f64, -1.0, 0.0, 0.5, 1.0, 2.0, 3.0] {
                for c in [-2.0, 0.0, 0.25, 4.0] {
                    let w = 2.0;
                    let direct = w * (lambda - (lambda - c / w).clamp(l, u));
                    assert_eq!(bounds.residual(0, lambda, c, w), direct, "{l} {u} {lambda} {c}");
                    let obeys = (l..=u).contains(&lambda)
                        && (c == 0.0 || (c > 0.0 && lambda == l) || (c < 0.0 && lambda == u));
                    assert_eq!(direct == 0.0, obeys, "{l} {u} {lambda} {c}");
                }
            }
        }
    }

    #[test]
    fn bounds_that_cross_are_refused_by_name() {
        let bounds = Bounds { lower: vec![0.0, 2.0], upper: vec![1.0, 1.0] };
        let said = bounds.validate(2, "entries of b").unwrap_err().to_string();
        assert!(said.contains("[l, u][1]") && said.contains("[2, 1]"), "{said}");
        let said = bounds.validate(3, "entries of b").unwrap_err().to_string();
        assert!(said.contains("3 entries"), "{said}");
        assert!(Bounds::default().validate(3, "entries of b").is_ok());
    }
}
