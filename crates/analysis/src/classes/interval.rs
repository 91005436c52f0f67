//! Numbers known between two bounds, sharp where arithmetic is exact: what is computed from integers stays one number as long as it fits into 53 bits.
//!
//! The rounding error of each operation says whether a bound must move outwards (by one unit in the last place). Source: OgitaRumpOishi2005 for the errors of sums
//! and products.

use std::cmp::Ordering;

/// All numbers from `lo` to `hi`.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Interval {
    lo: f64,
    hi: f64,
}

impl From<f64> for Interval {
    fn from(x: f64) -> Self {
        Self { lo: x, hi: x }
    }
}

/// The largest number that is surely not above `value + error`, |error| at most half a unit in the last place.
#[inline]
fn down(value: f64, error: f64) -> f64 {
    if value.is_nan() {
        f64::NEG_INFINITY
    } else if value == f64::INFINITY {
        f64::MAX
    } else if error >= 0.0 {
        value
    } else {
        value.next_down()
    }
}

#[inline]
fn up(value: f64, error: f64) -> f64 {
    -down(-value, -error)
}

/// The sum and its error.
#[inline]
fn sum(a: f64, b: f64) -> (f64, f64) {
    let s = a + b;
    let shadow = s - a;
    (s, (a - (s - shadow)) + (b - shadow))
}

/// Products below this may have an error that no double holds.
const SMALL: f64 = 1e-280;
/// Factors above this cannot be split.
const LARGE: f64 = 1e290;

/// The product and its error; NaN where it is not known.
#[inline]
fn product(a: f64, b: f64) -> (f64, f64) {
    let p = a * b;
    if a == 0.0 || b == 0.0 {
        return (p, 0.0);
    }
    if !(p.abs() > SMALL && p.abs() < LARGE && a.abs() < LARGE && b.abs() < LARGE) {
        return (p, f64::NAN);
    }
    let split = |x: f64| {
        let scaled = 134_217_729.0 * x; // 2²⁷ + 1
        let high = scaled - (scaled - x);
        (high, x - high)
    };
    let ((ah, al), (bh, bl)) = (split(a), split(b));
    (p, ((ah * bh - p) + ah * bl + al * bh) + al * bl)
}

/// The quotient and a number with the sign of its error; NaN where it is not known.
#[inline]
fn quotient(a: f64, b: f64) -> (f64, f64) {
    let q = a / b;
    if a == 0.0 {
        return (0.0, 0.0);
    }
    let (p, e) = product(q, b);
    if q.abs() < SMALL || a.abs() < SMALL {
        return (q, f64::NAN);
    }
    (q, ((a - p) - e) * b.signum())
}

impl Interval {
    pub(super) const ZERO: Self = Self { lo: 0.0, hi: 0.0 };

    fn is_point(self) -> bool {
        self.lo == self.hi
    }

    /// `a b − c d`, sharper than by its parts: of numbers that are known, about four times the usual digits.
    #[inline]
    pub(super) fn cross(a: Self, b: Self, c: Self, d: Self) -> Self {
        if a.is_point() && b.is_point() && c.is_point() && d.is_point() {
            let ((p, e), (q, f)) = (product(a.lo, b.lo), product(c.lo, d.lo));
            let (s, t) = sum(p, -q);
            if e.is_finite() && f.is_finite() && t.is_finite() {
                return Self::from(s) + (Self::from(t) + (Self::from(e) - Self::from(f)));
            }
        }
        a * b - c * d
    }

    /// The sign, where all numbers have the same.
    #[inline]
    pub(super) fn sign(self) -> Option<Ordering> {
        if self.lo > 0.0 {
            Some(Ordering::Greater)
        } else if self.hi < 0.0 {
            Some(Ordering::Less)
        } else if self.lo == 0.0 && self.hi == 0.0 {
            Some(Ordering::Equal)
        } else {
            None
        }
    }

    pub(super) fn is_positive(self) -> bool {
        self.lo > 0.0
    }

    pub(super) fn is_negative(self) -> bool {
        self.hi < 0.0
    }

    pub(super) fn is_zero(self) -> bool {
        self.lo == 0.0 && self.hi == 0.0
    }

    /// Surely not below zero.
    pub(super) fn is_nonnegative(self) -> bool {
        self.lo >= 0.0
    }

    /// Surely not above zero.
    pub(super) fn is_nonpositive(self) -> bool {
        self.hi <= 0.0
    }

    /// Some number inside.
    pub(super) fn middle(self) -> f64 {
        0.5 * self.lo + 0.5 * self.hi
    }

    /// From the least and the largest of what `f` gives at the ends.
    #[inline]
    fn ends(self, other: Self, f: impl Fn(f64, f64) -> (f64, f64)) -> Self {
        if self.is_point() && other.is_point() {
            let (value, error) = f(self.lo, other.lo);
            return Self { lo: down(value, error), hi: up(value, error) };
        }
        let mut out = Self { lo: f64::INFINITY, hi: f64::NEG_INFINITY };
        for a in [self.lo, self.hi] {
            for b in [other.lo, other.hi] {
                let (value, error) = f(a, b);
                out.lo = out.lo.min(down(value, error));
                out.hi = out.hi.max(up(value, error));
            }
        }
        out
    }
}

impl std::ops::Neg for Interval {
    type Output = Self;
    #[inline]
    fn neg(self) -> Self {
        Self { lo: -self.hi, hi: -self.lo }
    }
}

impl std::ops::Add for Interval {
    type Output = Self;
    #[inline]
    fn add(self, other: Self) -> Self {
        let ((lo, le), (hi, he)) = (sum(self.lo, other.lo), sum(self.hi, other.hi));
        Self { lo: down(lo, le), hi: up(hi, he) }
    }
}

impl std::ops::AddAssign for Interval {
    fn add_assign(&mut self, other: Self) {
        *self = *self + other;
    }
}

impl std::ops::Sub for Interval {
    type Output = Self;
    #[inline]
    fn sub(self, other: Self) -> Self {
        self + (-other)
    }
}

impl std::ops::Mul for Interval {
    type Output = Self;
    #[inline]
    fn mul(self, other: Self) -> Self {
        self.ends(other, product)
    }
}

impl std::ops::Div for Interval {
    type Output = Self;
    /// Everything, where the divisor may be zero.
    #[inline]
    fn div(self, other: Self) -> Self {
        if other.lo <= 0.0 && other.hi >= 0.0 {
            return Self { lo: f64::NEG_INFINITY, hi: f64::INFINITY };
        }
        self.ends(other, quotient)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn bounds_move_only_where_rounding_does() {
        let [a, b, c] = [3.0, 7.0, 0.1].map(Interval::from);
        assert!((a * b - b * a).is_zero() && (a * b / b - a).is_zero());
        assert!((a / b).sign().is_some() && !(a / b).is_point());
        assert!((a / b * b - a).sign().is_none());
        // 0.1 + 0.2 is not a double.
        let sum = c + Interval::from(0.2);
        assert!(!sum.is_point() && sum.hi == sum.lo.next_up());
        assert!((c - c).is_zero() && (c * Interval::ZERO).is_zero());
        // 0.1 · 0.3 − 0.3 · 0.1 by parts is only nearly zero.
        let d = Interval::from(0.3);
        assert!((c * d - d * c).sign().is_none() && Interval::cross(c, d, d, c).is_zero());
        let tiny = Interval::from(1e-200) * Interval::from(1e-200);
        assert!(tiny.lo <= 0.0 && tiny.hi > 0.0);
        let huge = Interval::from(1e200) * Interval::from(1e200);
        assert!(huge.is_positive() && huge.hi == f64::INFINITY);
        assert!((huge - huge).sign().is_none() && (a / (c - sum)).is_negative());
        assert!((a / (c - c)).sign().is_none());
    }
}
