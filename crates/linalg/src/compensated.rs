//! Sums and products of double precision carried to about twice its precision.
//!
//! A residual is the difference of numbers much larger than itself: computed plainly, it is rounding that looks like an
//! answer. Source: OgitaRumpOishi2005, algorithms TwoSum, TwoProduct and Dot2.

use super::Doubled;

/// A running sum with the rounding errors of all its additions.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub struct Compensated {
    sum: f64,
    error: f64,
}

impl From<f64> for Compensated {
    fn from(x: f64) -> Self {
        Self { sum: x, error: 0.0 }
    }
}

impl Compensated {
    /// The sum and the errors that [`into_parts`](Self::into_parts) gave.
    #[inline]
    pub fn parts(sum: f64, error: f64) -> Self {
        Self { sum, error }
    }

    /// The sum and the errors, to be stored apart.
    #[inline]
    pub fn into_parts(self) -> (f64, f64) {
        (self.sum, self.error)
    }

    /// Adds `x`.
    #[inline]
    pub fn add(&mut self, x: f64) {
        let sum = self.sum + x;
        let shadow = sum - self.sum;
        self.error += (self.sum - (sum - shadow)) + (x - shadow);
        self.sum = sum;
    }

    /// Adds `x` and forgets the rounding error.
    #[inline]
    pub fn add_plainly(&mut self, x: f64) {
        self.sum += x;
    }

    /// Adds `a b`, its rounding error included.
    #[inline]
    pub fn add_product(&mut self, a: f64, b: f64) {
        self.add_product_by::<false>(a, b);
    }

    /// The same, `FUSED` with one fused multiplication and addition for the error: for functions that are compiled for machines that have it.
    #[inline(always)]
    pub fn add_product_by<const FUSED: bool>(&mut self, a: f64, b: f64) {
        let product = a * b;
        if FUSED {
            self.add(product);
            self.error += a.mul_add(b, -product);
            return;
        }
        let (a_high, a_low) = split(a);
        let (b_high, b_low) = split(b);
        let error = ((a_high * b_high - product) + a_high * b_low + a_low * b_high) + a_low * b_low;
        self.add(product);
        // The parts of a factor beyond 2⁹⁹⁶ leave the range, though the product need not.
        self.error += if error.is_finite() { error } else { a.mul_add(b, -product) };
    }

    /// The sum with all that is known of it; NaN where a part left the range of double precision.
    #[inline]
    pub fn doubled(self) -> Doubled {
        Doubled::new(self.sum, self.error)
    }

    /// The sum, rounded once. Where a part left the range of double precision, the plain sum.
    #[inline]
    pub fn value(self) -> f64 {
        let value = self.sum + self.error;
        if value.is_finite() { value } else { self.sum }
    }
}

/// `x` as two numbers of 26 bits each.
#[inline]
pub(super) fn split(x: f64) -> (f64, f64) {
    const FACTOR: f64 = 134_217_729.0; // 2²⁷ + 1
    let scaled = FACTOR * x;
    let high = scaled - (scaled - x);
    (high, x - high)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_plain_arithmetic_loses_is_kept() {
        let mut sum = Compensated::from(-1.0);
        sum.add(1e17);
        sum.add(-1e17);
        assert_eq!(sum.value(), -1.0);
        // (1 + ε)(1 − ε) − 1 = −ε².
        let epsilon = f64::EPSILON;
        let mut product = Compensated::from(-1.0);
        product.add_product(1.0 + epsilon, 1.0 - epsilon);
        assert_eq!(product.value(), -epsilon * epsilon);
    }
}
