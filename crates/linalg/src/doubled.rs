//! Numbers of about 106 bits: the unevaluated sum of two doubles.
//!
//! The judge compares numbers that nearly cancel (an impulse of 1e17 in units of velocity against a velocity of 1e-8), so what it
//! adds up in doubled precision it must also subtract, square and compare so. [`Real`] lets the law be written once for both
//! precisions.
//!
//! The sum and the product of parts are those of OgitaRumpOishi2005; quotients by three digits of long division, roots by one Newton step.

use std::cmp::Ordering;
use std::ops::{Add, Div, Mul, Neg, Sub};

use super::compensated::split;

/// `high + low` with `|low| ≤ ulp(high)/2`. Each operation is right to a few units of 2⁻¹⁰⁴, as long as the parts stay within the
/// range of double precision; what leaves it is infinite or NaN.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub struct Doubled {
    high: f64,
    low: f64,
}

/// `a + b` and its rounding error.
#[inline(always)]
fn two_sum(a: f64, b: f64) -> (f64, f64) {
    let sum = a + b;
    let shadow = sum - a;
    (sum, (a - (sum - shadow)) + (b - shadow))
}

/// `high + low`, normalised; `|high| ≥ |low|`.
#[inline(always)]
fn normal(high: f64, low: f64) -> Doubled {
    let sum = high + low;
    Doubled { high: sum, low: low - (sum - high) }
}

impl Doubled {
    /// `high + low` of any two numbers.
    #[inline]
    pub fn new(high: f64, low: f64) -> Self {
        let (high, low) = two_sum(high, low);
        Self { high, low }
    }

    /// `a b`, exactly where nothing underflows.
    #[inline]
    pub fn product(a: f64, b: f64) -> Self {
        let high = a * b;
        let ((a_high, a_low), (b_high, b_low)) = (split(a), split(b));
        let low = ((a_high * b_high - high) + a_high * b_low + a_low * b_high) + a_low * b_low;
        // A fused product is a function call where the machine is not known; it is needed beyond 2⁹⁹⁶ only.
        Self { high, low: if low.is_finite() { low } else { a.mul_add(b, -high) } }
    }

    /// The nearest double and the rest.
    #[inline]
    pub fn parts(self) -> (f64, f64) {
        (self.high, self.low)
    }
}

impl From<f64> for Doubled {
    #[inline]
    fn from(x: f64) -> Self {
        Self { high: x, low: 0.0 }
    }
}

impl PartialOrd for Doubled {
    #[inline]
    fn partial_cmp(&self, other: &Self) -> Option<Ordering> {
        match self.high.partial_cmp(&other.high) {
            Some(Ordering::Equal) => self.low.partial_cmp(&other.low),
            decided => decided,
        }
    }
}

impl Neg for Doubled {
    type Output = Self;
    #[inline]
    fn neg(self) -> Self {
        Self { high: -self.high, low: -self.low }
    }
}

impl Add for Doubled {
    type Output = Self;
    #[inline]
    fn add(self, other: Self) -> Self {
        let (high, error) = two_sum(self.high, other.high);
        let (low, rest) = two_sum(self.low, other.low);
        let sum = normal(high, error + low);
        normal(sum.high, sum.low + rest)
    }
}

impl Sub for Doubled {
    type Output = Self;
    #[inline]
    fn sub(self, other: Self) -> Self {
        self + -other
    }
}

impl Mul for Doubled {
    type Output = Self;
    #[inline]
    fn mul(self, other: Self) -> Self {
        let Self { high, low } = Self::product(self.high, other.high);
        normal(high, low + (self.high * other.low + self.low * other.high))
    }
}

impl Div for Doubled {
    type Output = Self;
    #[inline]
    fn div(self, other: Self) -> Self {
        let first = self.high / other.high;
        let rest = self - other * Self::from(first);
        let second = rest.high / other.high;
        let rest = rest - other * Self::from(second);
        normal(first, second) + Self::from(rest.high / other.high)
    }
}

impl Div<f64> for Doubled {
    type Output = Self;
    #[inline]
    fn div(self, other: f64) -> Self {
        let first = self.high / other;
        let product = Self::product(first, other);
        let rest = (self.high - product.high) - product.low + self.low;
        Self::new(first, rest / other)
    }
}

/// The arithmetic in which the law at a contact is judged: plain or doubled.
pub trait Real:
    Copy
    + PartialOrd
    + From<f64>
    + Neg<Output = Self>
    + Add<Output = Self>
    + Sub<Output = Self>
    + Mul<Output = Self>
    + Div<Output = Self>
{
    /// A bound on the relative error of a dozen operations, which a verdict has to allow for.
    const DOUBT: f64;
    /// The square root of a number that is not negative.
    fn sqrt(self) -> Self;
    /// `√(x² + y²)` without overflow or underflow between.
    fn hypot(self, other: Self) -> Self;
    /// The nearest double.
    fn value(self) -> f64;
    /// `a b` with all its digits.
    fn of_product(a: f64, b: f64) -> Self;
    /// Times a power of two: exact where nothing underflows.
    fn times_power(self, power: f64) -> Self;
    /// `|x|`.
    #[inline]
    fn modulus(self) -> Self {
        if self < Self::from(0.0) { -self } else { self }
    }
}

impl Real for f64 {
    // 32 units of 2⁻⁵².
    const DOUBT: f64 = 32.0 * f64::EPSILON;
    #[inline]
    fn sqrt(self) -> Self {
        f64::sqrt(self)
    }
    #[inline]
    fn hypot(self, other: Self) -> Self {
        let square = self * self + other * other;
        // Where no square leaves the range, several times faster.
        if (1e-280..1e280).contains(&square) {
            square.sqrt()
        } else if other == 0.0 {
            self.abs()
        } else {
            f64::hypot(self, other)
        }
    }
    #[inline]
    fn value(self) -> f64 {
        self
    }
    #[inline]
    fn of_product(a: f64, b: f64) -> Self {
        a * b
    }
    #[inline]
    fn times_power(self, power: f64) -> Self {
        self * power
    }
}

impl Real for Doubled {
    // 32 units of 2⁻¹⁰⁴.
    const DOUBT: f64 = 32.0 * f64::EPSILON * f64::EPSILON;
    #[inline]
    fn sqrt(self) -> Self {
        if self.high <= 0.0 || !self.high.is_finite() {
            return Self::from(self.high.sqrt());
        }
        let guess = self.high.sqrt();
        let rest = self - Self::product(guess, guess);
        Self::new(guess, rest.high / (2.0 * guess))
    }
    fn hypot(self, other: Self) -> Self {
        let sum = self * self + other * other;
        // Where no part of a square leaves the range.
        if (1e-200..1e280).contains(&sum.high) {
            return sum.sqrt();
        }
        let largest = self.high.abs().max(other.high.abs());
        if largest == 0.0 || !largest.is_finite() {
            return Self::from(largest);
        }
        let unit = power_of_two(largest);
        let square = |x: Self| {
            let x = x.times_power(1.0 / unit);
            x * x
        };
        (square(self) + square(other)).sqrt().times_power(unit)
    }
    #[inline]
    fn value(self) -> f64 {
        self.high
    }
    #[inline]
    fn of_product(a: f64, b: f64) -> Self {
        Self::product(a, b)
    }
    #[inline]
    fn times_power(self, power: f64) -> Self {
        Self { high: power * self.high, low: power * self.low }
    }
}

/// The power of two next below a positive `x`, within 2^±1000: a unit that changes no digit.
#[inline]
pub fn power_of_two(x: f64) -> f64 {
    let exponent = ((x.to_bits() >> 52) as i64).clamp(23, 2023) as u64;
    f64::from_bits(exponent << 52)
}

#[cfg(test)]
mod tests {
    use dashu_ratio::RBig;
    use rand::{RngExt, SeedableRng};

    use super::*;

    fn exact(x: Doubled) -> RBig {
        let of = |x: f64| RBig::try_from(x).unwrap();
        of(x.high) + of(x.low)
    }

    /// `|x − y| / |y|`.
    fn error(x: Doubled, y: &RBig) -> f64 {
        if y.is_zero() {
            return exact(x).to_f64().value().abs();
        }
        ((exact(x) - y) / y).to_f64().value().abs()
    }

    #[test]
    fn operations_agree_with_rational_arithmetic() {
        let mut random = rand_pcg::Pcg64::seed_from_u64(5);
        let mut draw = || {
            let x = random.random_range(-1.0..1.0) * 2f64.powi(random.random_range(-40..40));
            Doubled::new(x, random.random_range(-1.0..1.0) * f64::EPSILON * x.abs())
        };
        for _ in 0..2000 {
            let (a, b) = (draw(), draw());
            let (x, y) = (exact(a), exact(b));
            for (found, exact) in [
                (a + b, &x + &y),
                (a - b, &x - &y),
                (a * b, &x * &y),
                (a / b, &x / &y),
                (a / b.high, &x / &RBig::try_from(b.high).unwrap()),
                // What is left of a difference is exact to the digits of its terms.
                ((a + b) - a, y.clone()),
            ] {
                let cancelled = ((&x / &y).to_f64().value().abs() + 1.0) * 1e-31;
                assert!(error(found, &exact) < cancelled.max(1e-30), "{a:?} {b:?} {found:?}");
            }
            let root = a.modulus().sqrt();
            assert!(error(root * root, &exact(a.modulus())) < 1e-30);
            assert_eq!(a < b, x < y);
        }
    }

    #[test]
    fn roots_and_hypotenuses_of_any_size() {
        for unit in [1e-290, 1e-150, 1.0, 1e150, 1e300] {
            let of = |x: f64| Doubled::from(x * unit);
            let length = of(3.0).hypot(of(-4.0));
            assert!((length.value() / (5.0 * unit) - 1.0).abs() < 1e-15, "{unit:e}");
            assert_eq!(power_of_two(unit).log2().fract(), 0.0);
        }
        assert_eq!(Doubled::from(0.0).hypot(0.0.into()).value(), 0.0);
        let one = Doubled::from(3.0).hypot(4.0.into()) - 5.0.into();
        assert_eq!(one.value(), 0.0);
        assert!(power_of_two(0.0) > 0.0 && power_of_two(f64::MAX).is_finite());
    }

    #[test]
    fn what_leaves_the_range_is_seen() {
        let huge = Doubled::from(1e300);
        assert!(!(huge * huge + huge).value().is_finite());
    }
}
