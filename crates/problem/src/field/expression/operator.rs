//! The operations of expressions: values in several arithmetics, and slopes.

use nonsmooth_linalg::Doubled;

/// Operations on one number.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
#[allow(missing_docs)]
pub enum Unary {
    Neg,
    Abs,
    Sqrt,
    Square,
    Exp,
    Log,
    Log10,
    Sin,
    Cos,
    Tan,
    Asin,
    Acos,
    Atan,
    Sinh,
    Cosh,
    Tanh,
    Asinh,
    Acosh,
    Atanh,
    /// `1/(1 + e^−x)`
    Logistic,
    Floor,
    Ceil,
    /// 1 where x = 0, else 0.
    Not,
}

/// Operations on two numbers. Those with a yes or no for an answer give 1 or 0; a number is true unless it is 0.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
#[allow(missing_docs)]
pub enum Binary {
    Add,
    Sub,
    Mul,
    Div,
    /// `a^b`; a negative base needs a whole exponent. `0^0 = 1`.
    Pow,
    /// `a − b ⌊a/b⌋` with the quotient cut towards zero: the sign is that of a.
    Rem,
    /// `max(a − b, 0)`
    Less,
    /// The angle of the point `(b, a)`.
    Atan2,
    /// The quotient, cut towards zero.
    IntDiv,
    /// a with b significant decimal digits.
    Precision,
    /// a with b decimals, rounded.
    Round,
    /// a with b decimals, cut.
    Trunc,
    /// `sign(a) |a|^b`
    SignPow,
    Lt,
    Le,
    Eq,
    Ge,
    Gt,
    Ne,
    And,
    Or,
    Iff,
}

/// Operations on any number of numbers.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub enum Nary {
    /// The sum.
    Sum,
    /// The smallest; the slope is that of the first that is the smallest.
    Min,
    /// The largest, likewise.
    Max,
    /// How many are not zero.
    Count,
    /// How many of the others are equal to the first.
    NumberOf,
    /// 1 where none is zero.
    All,
    /// 1 where one is not zero.
    Any,
    /// 1 where no two are equal.
    AllDiff,
    /// 1 where two are equal.
    SomeSame,
}

/// An arithmetic in which expressions have values.
pub(super) trait Number: Copy {
    fn known(x: f64) -> Self;
    /// The nearest double.
    fn value(self) -> f64;
    fn neg(self) -> Self;
    fn add(self, other: Self) -> Self;
    fn sub(self, other: Self) -> Self;
    fn mul(self, other: Self) -> Self;
    fn div(self, other: Self) -> Self;
    fn sqrt(self) -> Self;
    fn abs(self) -> Self;
    /// A smooth function with this value and slope at [`value`](Self::value).
    fn smooth(self, value: f64, slope: f64) -> Self;
    /// A function of two numbers, likewise.
    fn smooth2(self, other: Self, value: f64, slopes: [f64; 2]) -> Self;
}

impl Number for f64 {
    #[inline(always)]
    fn known(x: f64) -> Self {
        x
    }
    #[inline(always)]
    fn value(self) -> f64 {
        self
    }
    #[inline(always)]
    fn neg(self) -> Self {
        -self
    }
    #[inline(always)]
    fn add(self, other: Self) -> Self {
        self + other
    }
    #[inline(always)]
    fn sub(self, other: Self) -> Self {
        self - other
    }
    #[inline(always)]
    fn mul(self, other: Self) -> Self {
        self * other
    }
    #[inline(always)]
    fn div(self, other: Self) -> Self {
        self / other
    }
    #[inline(always)]
    fn sqrt(self) -> Self {
        f64::sqrt(self)
    }
    #[inline(always)]
    fn abs(self) -> Self {
        f64::abs(self)
    }
    #[inline(always)]
    fn smooth(self, value: f64, _: f64) -> Self {
        value
    }
    #[inline(always)]
    fn smooth2(self, _: Self, value: f64, _: [f64; 2]) -> Self {
        value
    }
}

/// Sums, products, quotients and roots in doubled precision; of other functions, what the rest of the argument adds.
impl Number for Doubled {
    fn known(x: f64) -> Self {
        x.into()
    }
    fn value(self) -> f64 {
        self.parts().0
    }
    fn neg(self) -> Self {
        -self
    }
    fn add(self, other: Self) -> Self {
        self + other
    }
    fn sub(self, other: Self) -> Self {
        self - other
    }
    fn mul(self, other: Self) -> Self {
        self * other
    }
    fn div(self, other: Self) -> Self {
        self / other
    }
    fn sqrt(self) -> Self {
        let root = self.value().sqrt();
        if root > 0.0 && root.is_finite() {
            let rest = self - Doubled::product(root, root);
            Doubled::new(root, rest.value() / (2.0 * root))
        } else {
            root.into()
        }
    }
    fn abs(self) -> Self {
        if self.value() < 0.0 { -self } else { self }
    }
    fn smooth(self, value: f64, slope: f64) -> Self {
        rest(value, slope * self.parts().1)
    }
    fn smooth2(self, other: Self, value: f64, slopes: [f64; 2]) -> Self {
        rest(value, slopes[0] * self.parts().1 + slopes[1] * other.parts().1)
    }
}

/// `value + rest`, where the rest is a number.
fn rest(value: f64, rest: f64) -> Doubled {
    if rest.is_finite() { Doubled::new(value, rest) } else { value.into() }
}

/// A value with the size of its terms: of a polynomial the sum of the moduli of its monomials, to first order otherwise. Multiplying a variable or a row
/// by a number multiplies it likewise.
#[derive(Debug, Clone, Copy, Default)]
pub(super) struct Sized {
    pub(super) value: f64,
    pub(super) size: f64,
}

impl Number for Sized {
    fn known(x: f64) -> Self {
        Self { value: x, size: x.abs() }
    }
    fn value(self) -> f64 {
        self.value
    }
    fn neg(self) -> Self {
        Self { value: -self.value, ..self }
    }
    fn add(self, other: Self) -> Self {
        Self { value: self.value + other.value, size: self.size + other.size }
    }
    fn sub(self, other: Self) -> Self {
        self.add(other.neg())
    }
    fn mul(self, other: Self) -> Self {
        Self { value: self.value * other.value, size: self.size * other.size }
    }
    fn div(self, other: Self) -> Self {
        let inverse = 1.0 / other.value.abs();
        let size = self.size * inverse * (other.size * inverse);
        Self { value: self.value / other.value, size }
    }
    fn sqrt(self) -> Self {
        Self { value: self.value.sqrt(), size: self.size.sqrt() }
    }
    fn abs(self) -> Self {
        Self { value: self.value.abs(), ..self }
    }
    fn smooth(self, value: f64, slope: f64) -> Self {
        let more = slope.abs() * self.size;
        Self { value, size: value.abs() + if more.is_finite() { more } else { 0.0 } }
    }
    fn smooth2(self, other: Self, value: f64, slopes: [f64; 2]) -> Self {
        let more = slopes[0].abs() * self.size + slopes[1].abs() * other.size;
        Self { value, size: value.abs() + if more.is_finite() { more } else { 0.0 } }
    }
}

/// Whole exponents up to this modulus are products.
const PRODUCTS: f64 = 64.0;

/// `a^k` by products.
fn whole_power<T: Number>(a: T, k: u32) -> T {
    let (mut power, mut square, mut k) = (T::known(1.0), a, k);
    while k > 0 {
        if k & 1 == 1 {
            power = power.mul(square);
        }
        k >>= 1;
        if k > 0 {
            square = square.mul(square);
        }
    }
    power
}

fn power<T: Number>(a: T, b: T) -> T {
    let (x, y) = (a.value(), b.value());
    // To the power of zero, or as that of one, it would have a value.
    if x.is_nan() || y.is_nan() {
        return T::known(f64::NAN);
    }
    if y.fract() == 0.0 && y.abs() <= PRODUCTS {
        let power = whole_power(a, y.abs() as u32);
        return if y < 0.0 { T::known(1.0).div(power) } else { power };
    }
    if y == 0.5 && x >= 0.0 {
        return a.sqrt();
    }
    if is_pole(x, y) {
        return T::known(f64::NAN);
    }
    a.smooth2(b, x.powf(y), slopes2(Binary::Pow, x, y, x.powf(y)))
}

/// Whether x^y is a pole: it has no value there, for what is made of ∞ may be finite.
fn is_pole(x: f64, y: f64) -> bool {
    x == 0.0 && y < 0.0
}

/// 1 or 0.
fn truth(yes: bool) -> f64 {
    f64::from(u8::from(yes))
}

/// Of a comparison: none where an argument has no value.
fn compared((x, y): (f64, f64), yes: bool) -> f64 {
    if x.is_nan() || y.is_nan() { f64::NAN } else { truth(yes) }
}

impl Unary {
    /// The value at a.
    #[inline]
    pub(super) fn of<T: Number>(self, a: T) -> T {
        let x = a.value();
        let value = match self {
            Self::Neg => return a.neg(),
            Self::Abs => return a.abs(),
            Self::Sqrt => return a.sqrt(),
            Self::Square => return a.mul(a),
            Self::Exp => x.exp(),
            // At a pole it has no value: what is made of ∞ may be finite.
            Self::Log | Self::Log10 if x == 0.0 => f64::NAN,
            Self::Atanh if x.abs() == 1.0 => f64::NAN,
            Self::Log => x.ln(),
            Self::Log10 => x.log10(),
            Self::Sin => x.sin(),
            Self::Cos => x.cos(),
            Self::Tan => x.tan(),
            Self::Asin => x.asin(),
            Self::Acos => x.acos(),
            Self::Atan => x.atan(),
            Self::Sinh => x.sinh(),
            Self::Cosh => x.cosh(),
            Self::Tanh => x.tanh(),
            Self::Asinh => x.asinh(),
            Self::Acosh => x.acosh(),
            Self::Atanh => x.atanh(),
            Self::Logistic => 1.0 / (1.0 + (-x).exp()),
            Self::Floor => x.floor(),
            Self::Ceil => x.ceil(),
            Self::Not => compared((x, x), x == 0.0),
        };
        a.smooth(value, self.slope(x, value))
    }

    /// The slope at x, where the value is known. At a kink, that of one side.
    #[inline]
    pub(super) fn slope(self, x: f64, value: f64) -> f64 {
        match self {
            Self::Neg => -1.0,
            Self::Abs => {
                if x < 0.0 {
                    -1.0
                } else {
                    1.0
                }
            }
            Self::Sqrt => 0.5 / value,
            Self::Square => 2.0 * x,
            Self::Exp => value,
            Self::Log => 1.0 / x,
            Self::Log10 => std::f64::consts::LOG10_E / x,
            Self::Sin => x.cos(),
            Self::Cos => -x.sin(),
            Self::Tan => 1.0 + value * value,
            Self::Asin => 1.0 / (1.0 - x * x).sqrt(),
            Self::Acos => -1.0 / (1.0 - x * x).sqrt(),
            Self::Atan => 1.0 / (1.0 + x * x),
            Self::Sinh => x.cosh(),
            Self::Cosh => x.sinh(),
            Self::Tanh => 1.0 - value * value,
            Self::Asinh => 1.0 / (x * x + 1.0).sqrt(),
            Self::Acosh => 1.0 / ((x - 1.0).sqrt() * (x + 1.0).sqrt()),
            Self::Atanh => 1.0 / (1.0 - x * x),
            Self::Logistic => value * (1.0 - value),
            Self::Floor | Self::Ceil | Self::Not => 0.0,
        }
    }
}

/// `x` in units of `10^−decimals`, changed by `to`, and back.
fn by_decimals(x: f64, decimals: f64, to: impl Fn(f64) -> f64) -> f64 {
    let unit = 10f64.powf(decimals.round());
    to(x * unit) / unit
}

impl Binary {
    /// The value at (a, b).
    #[inline]
    pub(super) fn of<T: Number>(self, a: T, b: T) -> T {
        match self {
            Self::Add => return a.add(b),
            Self::Sub => return a.sub(b),
            Self::Mul => return a.mul(b),
            Self::Div => return a.div(b),
            Self::Pow => return power(a, b),
            _ => {}
        }
        let (x, y) = (a.value(), b.value());
        let value = match self {
            Self::Less => {
                let difference = a.sub(b);
                return if difference.value() <= 0.0 { T::known(0.0) } else { difference };
            }
            Self::Rem => x % y,
            Self::Atan2 => x.atan2(y),
            Self::SignPow if is_pole(x, y) => f64::NAN,
            Self::SignPow => x.signum() * x.abs().powf(y),
            Self::IntDiv if y == 0.0 => f64::NAN,
            Self::IntDiv => (x / y).trunc(),
            Self::Precision if x == 0.0 => 0.0,
            Self::Precision => {
                by_decimals(x, y - 1.0 - x.abs().log10().floor(), f64::round_ties_even)
            }
            Self::Round => by_decimals(x, y, f64::round),
            Self::Trunc => by_decimals(x, y, f64::trunc),
            Self::Lt => compared((x, y), x < y),
            Self::Le => compared((x, y), x <= y),
            Self::Eq => compared((x, y), x == y),
            Self::Ge => compared((x, y), x >= y),
            Self::Gt => compared((x, y), x > y),
            Self::Ne => compared((x, y), x != y),
            // The second counts where the first leaves it open.
            Self::And if x == 0.0 => 0.0,
            Self::And => compared((x, y), y != 0.0),
            Self::Or if x != 0.0 && !x.is_nan() => 1.0,
            Self::Or => compared((x, y), y != 0.0),
            Self::Iff => compared((x, y), (x != 0.0) == (y != 0.0)),
            Self::Add | Self::Sub | Self::Mul | Self::Div | Self::Pow => unreachable!("above"),
        };
        a.smooth2(b, value, slopes2(self, x, y, value))
    }
}

/// The slopes of a binary operation at (x, y), where the value is known.
#[inline]
pub(super) fn slopes2(op: Binary, x: f64, y: f64, value: f64) -> [f64; 2] {
    match op {
        Binary::Add => [1.0, 1.0],
        Binary::Sub => [1.0, -1.0],
        Binary::Mul => [y, x],
        Binary::Div => [1.0 / y, -value / y],
        Binary::Pow => {
            let in_base = if y == 0.0 {
                0.0
            } else if y.fract() == 0.0 && y.abs() <= PRODUCTS {
                y * x.powi(y as i32 - 1)
            } else {
                y * x.powf(y - 1.0)
            };
            // Where the base is not positive the exponent is a constant, or F is not differentiable.
            [in_base, if x > 0.0 { value * x.ln() } else { 0.0 }]
        }
        Binary::SignPow => {
            [y * x.abs().powf(y - 1.0), if x != 0.0 { value * x.abs().ln() } else { 0.0 }]
        }
        Binary::Less if x > y => [1.0, -1.0],
        Binary::Rem => [1.0, -(x / y).trunc()],
        Binary::Atan2 => {
            let square = x * x + y * y;
            [y / square, -x / square]
        }
        _ => [0.0; 2],
    }
}

impl Nary {
    /// The value of the arguments; for the smallest and the largest, that of the first that is.
    #[inline]
    pub(super) fn of<T: Number>(self, arguments: impl Iterator<Item = T> + Clone) -> T {
        let truths = || arguments.clone().filter(|a| a.value() != 0.0).count();
        // The first that is as `sought` ends a conjunction or an alternative; before it each needs a value.
        let ends = |sought: fn(f64) -> bool| {
            let mut values = arguments.clone().map(T::value);
            values.find(|x| x.is_nan() || sought(*x))
        };
        let has_values = || arguments.clone().all(|a| !a.value().is_nan());
        match self {
            Self::Count | Self::NumberOf | Self::AllDiff | Self::SomeSame if !has_values() => {
                T::known(f64::NAN)
            }
            Self::Sum => arguments.reduce(T::add).unwrap_or(T::known(0.0)),
            Self::Min | Self::Max => match self.chosen(arguments.clone().map(T::value)) {
                Some(k) => arguments.clone().nth(k).unwrap_or(T::known(f64::NAN)),
                None => T::known(f64::NAN),
            },
            Self::Count => T::known(truths() as f64),
            Self::All => T::known(ends(|x| x == 0.0).map_or(1.0, |x| 0.0 * x)),
            Self::Any => T::known(ends(|x| x != 0.0).map_or(0.0, |x| compared((x, x), true))),
            Self::NumberOf => {
                let mut all = arguments.map(T::value);
                let sought = all.next();
                T::known(all.filter(|a| Some(*a) == sought).count() as f64)
            }
            Self::AllDiff | Self::SomeSame => {
                let mut all: Vec<_> = arguments.map(T::value).collect();
                all.sort_by(f64::total_cmp);
                let same = all.windows(2).any(|w| w[0] == w[1]);
                T::known(truth(same == (self == Self::SomeSame)))
            }
        }
    }

    /// Which argument the smallest or the largest is: the first. A NaN is chosen before all others.
    pub(super) fn chosen(self, values: impl Iterator<Item = f64>) -> Option<usize> {
        let mut best: Option<(usize, f64)> = None;
        for (k, x) in values.enumerate() {
            let better = match best {
                None => true,
                Some((_, b)) if self == Self::Min => x < b,
                Some((_, b)) => x > b,
            };
            if x.is_nan() {
                return Some(k);
            }
            if better {
                best = Some((k, x));
            }
        }
        best.map(|b| b.0)
    }
}
