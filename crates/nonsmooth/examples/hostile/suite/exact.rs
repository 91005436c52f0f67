//! Numbers `m 2^e` with a whole m of any length: sums and products of doubles without error, quotients and square roots to a
//! relative error of 2^-200. Written for the suite alone, so that no mistake of the library can hide in it.

use std::cmp::Ordering;
use std::ops::{Add, Mul, Neg, Sub};

use num_bigint::{BigInt, Sign};

/// The bits that a quotient or a root keeps.
const BITS: i64 = 200;

/// `m 2^e`.
#[derive(Debug, Clone)]
pub struct Dyadic {
    m: BigInt,
    e: i64,
}

/// `x = m 2^e` with an odd m, or `(0, 0)`; of a finite x.
pub fn parts(x: f64) -> (i64, i32) {
    if x == 0.0 {
        return (0, 0);
    }
    let bits = x.to_bits();
    let stored = (bits >> 52 & 0x7ff) as i32;
    let fraction = (bits & ((1 << 52) - 1)) as i64;
    let (m, e) = if stored == 0 { (fraction, -1074) } else { (fraction | 1 << 52, stored - 1075) };
    let zeros = m.trailing_zeros();
    let m = m >> zeros;
    (if x < 0.0 { -m } else { m }, e + zeros as i32)
}

impl Dyadic {
    pub fn zero() -> Self {
        Self { m: BigInt::ZERO, e: 0 }
    }

    pub fn new(m: BigInt, e: i64) -> Self {
        Self { m, e }
    }

    pub fn sign(&self) -> i32 {
        match self.m.sign() {
            Sign::Minus => -1,
            Sign::NoSign => 0,
            Sign::Plus => 1,
        }
    }

    pub fn is_zero(&self) -> bool {
        self.sign() == 0
    }

    pub fn abs(&self) -> Self {
        Self { m: self.m.magnitude().clone().into(), e: self.e }
    }

    pub fn max(self, other: Self) -> Self {
        if self < other { other } else { self }
    }

    pub fn min(self, other: Self) -> Self {
        if other < self { other } else { self }
    }

    /// `self / other`, `other ≠ 0`.
    pub fn over(&self, other: &Self) -> Self {
        let have = self.m.bits() as i64 - other.m.bits() as i64;
        let shift = (BITS - have).max(0);
        Self { m: (&self.m << shift) / &other.m, e: self.e - other.e - shift }
    }

    /// `self / divisor` where that leaves no rest but powers of two.
    pub fn over_divisor(&self, divisor: &Self) -> Self {
        let zeros = divisor.m.trailing_zeros().unwrap_or(0);
        let m = &self.m / (&divisor.m >> zeros);
        Self { m, e: self.e - divisor.e - zeros as i64 }
    }

    /// Of a number that is not negative.
    pub fn sqrt(&self) -> Self {
        if self.is_zero() {
            return Self::zero();
        }
        let mut shift = (2 * BITS - self.m.bits() as i64).max(0);
        shift += (self.e - shift).rem_euclid(2);
        Self { m: (&self.m << shift).sqrt(), e: (self.e - shift) / 2 }
    }

    /// The nearest double but for the last bits; zero below their range and infinite above it.
    pub fn to_f64(&self) -> f64 {
        let drop = (self.m.bits() as i64 - 60).max(0);
        let m: BigInt = &self.m >> drop;
        let m = i64::try_from(m).expect("61 bits") as f64;
        let e = (self.e + drop).clamp(-2000, 2000) as i32;
        // In two steps, since 2^e alone may leave the range.
        m * 2.0_f64.powi(e / 2) * 2.0_f64.powi(e - e / 2)
    }

    fn aligned(&self, other: &Self) -> (BigInt, BigInt, i64) {
        match self.e.cmp(&other.e) {
            Ordering::Equal => (self.m.clone(), other.m.clone(), self.e),
            Ordering::Less => (self.m.clone(), &other.m << (other.e - self.e), self.e),
            Ordering::Greater => (&self.m << (self.e - other.e), other.m.clone(), other.e),
        }
    }
}

impl From<f64> for Dyadic {
    fn from(x: f64) -> Self {
        assert!(x.is_finite(), "{x} has no exact value");
        let (m, e) = parts(x);
        Self { m: m.into(), e: e.into() }
    }
}

impl Add for &Dyadic {
    type Output = Dyadic;
    fn add(self, other: &Dyadic) -> Dyadic {
        if self.is_zero() {
            return other.clone();
        }
        if other.is_zero() {
            return self.clone();
        }
        let (a, b, e) = self.aligned(other);
        Dyadic { m: a + b, e }
    }
}

impl Neg for &Dyadic {
    type Output = Dyadic;
    fn neg(self) -> Dyadic {
        Dyadic { m: -&self.m, e: self.e }
    }
}

impl Sub for &Dyadic {
    type Output = Dyadic;
    fn sub(self, other: &Dyadic) -> Dyadic {
        self + &-other
    }
}

impl Mul for &Dyadic {
    type Output = Dyadic;
    fn mul(self, other: &Dyadic) -> Dyadic {
        Dyadic { m: &self.m * &other.m, e: self.e + other.e }
    }
}

impl PartialEq for Dyadic {
    fn eq(&self, other: &Self) -> bool {
        self.cmp(other) == Ordering::Equal
    }
}

impl Eq for Dyadic {}

impl PartialOrd for Dyadic {
    fn partial_cmp(&self, other: &Self) -> Option<Ordering> {
        Some(self.cmp(other))
    }
}

impl Ord for Dyadic {
    fn cmp(&self, other: &Self) -> Ordering {
        let (a, b) = (self.sign(), other.sign());
        if a != b || a == 0 {
            return a.cmp(&b);
        }
        // Where the leading bits differ in place, nothing needs to be shifted.
        let top = |x: &Dyadic| x.m.bits() as i64 + x.e;
        match top(self).cmp(&top(other)) {
            Ordering::Equal => {
                let (a, b, _) = self.aligned(other);
                a.cmp(&b)
            }
            by_size if a > 0 => by_size,
            by_size => by_size.reverse(),
        }
    }
}

/// A sum of products of doubles, and the sum of their sizes.
#[derive(Debug, Clone)]
pub struct Sum {
    pub value: Dyadic,
    pub size: Dyadic,
}

impl Sum {
    pub fn of(x: f64) -> Self {
        let value = Dyadic::from(x);
        Self { size: value.abs(), value }
    }

    pub fn add(&mut self, a: f64, b: f64) {
        if a != 0.0 && b != 0.0 {
            let ((m, e), (n, f)) = (parts(a), parts(b));
            let product = i128::from(m) * i128::from(n);
            let e = i64::from(e) + i64::from(f);
            self.value = &self.value + &Dyadic::new(product.into(), e);
            self.size = &self.size + &Dyadic::new(product.abs().into(), e);
        }
    }
}
