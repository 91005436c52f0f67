//! Bounds of expressions over a box, rounded outwards: interval arithmetic.
//!
//! Sums, products, quotients, roots and whole powers are bounded by the error that they make, so that what is exact stays exact. Functions of the mathematical library
//! are taken to be right to `2⁻⁴⁰` of their value (the libraries at hand claim a few `2⁻⁵²`). A bound is that of the values where the expression is defined.
//!
//! References: MooreKearfottCloud2009. Cost: a dozen operations a node.

use nonsmooth_linalg::budget::{self, Pace};

use super::graph::{Graph, Node, Piecewise};
use super::operator::{Binary, Nary, Unary};

/// The values of an expression over a box lie in `[low, high]`; both may be infinite.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Range {
    /// No value is less.
    pub low: f64,
    /// No value is larger.
    pub high: f64,
    /// Whether the expression is defined on the whole box.
    pub total: bool,
}

/// What the mathematical library may be wrong by, in units of the value.
const LIBRARY: f64 = 1.0 / (1u64 << 40) as f64;
/// Angles beyond which nothing is said of sine and cosine.
const ANGLES: f64 = 1e6;
/// Nodes between two looks at the clock.
const NODES: usize = 4096;

impl Range {
    const ALL: Self = Self { low: f64::NEG_INFINITY, high: f64::INFINITY, total: true };

    /// All numbers between two.
    pub fn new(low: f64, high: f64) -> Self {
        Self { low, high, total: true }
    }

    /// One number.
    pub fn point(x: f64) -> Self {
        Self::new(x, x)
    }

    /// Nothing is known.
    fn unknown() -> Self {
        Self { total: false, ..Self::ALL }
    }

    fn and(self, total: bool) -> Self {
        Self { total: self.total && total, ..self }
    }

    /// Whether a number may be a value.
    pub fn contains(&self, x: f64) -> bool {
        self.low <= x && x <= self.high
    }

    fn hull(self, other: Self) -> Self {
        Self {
            low: self.low.min(other.low),
            high: self.high.max(other.high),
            total: self.total && other.total,
        }
    }

    /// The largest modulus.
    fn size(&self) -> f64 {
        self.low.abs().max(self.high.abs())
    }

    /// `−x`
    pub(crate) fn neg(self) -> Self {
        Self { low: -self.high, high: -self.low, ..self }
    }

    /// `x + y`
    pub(crate) fn add(self, y: Self) -> Self {
        let low = sum(self.low, y.low, Side::Low);
        Self { low, high: sum(self.high, y.high, Side::High), total: self.total && y.total }
    }

    /// `x y`
    pub(crate) fn mul(self, y: Self) -> Self {
        let corners =
            [(self.low, y.low), (self.low, y.high), (self.high, y.low), (self.high, y.high)];
        let low = corners.map(|(a, b)| product(a, b, Side::Low));
        let high = corners.map(|(a, b)| product(a, b, Side::High));
        Self {
            low: low.into_iter().fold(f64::INFINITY, f64::min),
            high: high.into_iter().fold(f64::NEG_INFINITY, f64::max),
            total: self.total && y.total,
        }
    }

    /// The natural logarithm.
    pub(crate) fn ln(self) -> Self {
        self.unary(Unary::Log)
    }

    /// `1/x`
    fn inverse(self) -> Self {
        let at = |x: f64, side: Side| {
            let r = 1.0 / x;
            let exact = (-r).mul_add(x, 1.0) == 0.0 && r.abs() > SMALL;
            if exact || x.is_infinite() { r } else { side.beyond(r) }
        };
        match (self.low, self.high) {
            (l, h) if l > 0.0 || h < 0.0 => {
                Self { low: at(h, Side::Low), high: at(l, Side::High), ..self }
            }
            (0.0, h) if h > 0.0 => {
                Self { low: at(h, Side::Low), high: f64::INFINITY, total: false }
            }
            (l, 0.0) if l < 0.0 => {
                Self { low: f64::NEG_INFINITY, high: at(l, Side::High), total: false }
            }
            _ => Self::unknown(),
        }
    }

    /// `x / y`
    pub(crate) fn div(self, y: Self) -> Self {
        if y.low == y.high && y.low != 0.0 && y.low.is_finite() {
            let at = |x: f64, side: Side| {
                let q = x / y.low;
                let exact = (-q).mul_add(y.low, x) == 0.0 && q.abs() > SMALL;
                if exact || x == 0.0 || x.is_infinite() { q } else { side.beyond(q) }
            };
            let (a, b) = if y.low > 0.0 { (self.low, self.high) } else { (self.high, self.low) };
            return Self {
                low: at(a, Side::Low),
                high: at(b, Side::High),
                total: self.total && y.total,
            };
        }
        self.mul(y.inverse())
    }

    fn abs(self) -> Self {
        match (self.low, self.high) {
            (l, _) if l >= 0.0 => self,
            (_, h) if h <= 0.0 => self.neg(),
            _ => Self { low: 0.0, high: self.size(), ..self },
        }
    }

    fn sqrt(self) -> Self {
        if self.high < 0.0 {
            return Self::unknown();
        }
        let at = |x: f64, side: Side| {
            let r = x.sqrt();
            let exact = (-r).mul_add(r, x) == 0.0 && r > SMALL.sqrt();
            if exact || x == 0.0 || x.is_infinite() { r } else { side.beyond(r) }
        };
        Self {
            low: at(self.low.max(0.0), Side::Low).max(0.0),
            high: at(self.high, Side::High),
            total: self.total && self.low >= 0.0,
        }
    }

    /// `x^k`
    fn whole_power(self, k: i64) -> Self {
        let at = |x: f64| {
            let (mut power, mut square, mut k) =
                (Self::point(1.0), Self::point(x), k.unsigned_abs());
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
        };
        let base = if k % 2 == 0 { self.abs() } else { self };
        let power = Self { low: at(base.low).low, high: at(base.high).high, ..base };
        if k < 0 { power.inverse() } else { power }
    }

    fn power(self, y: Self) -> Self {
        let constant = (y.low == y.high).then_some(y.low);
        if let Some(k) = constant.filter(|k| k.fract() == 0.0 && k.abs() <= 64.0) {
            // 0⁰ = 1, and x⁰ is 1 even where x has no value.
            return if k == 0.0 { Self::point(1.0) } else { self.whole_power(k as i64) };
        }
        let total = self.total && y.total;
        if self.low > 0.0 || (self.low == 0.0 && y.low > 0.0) {
            // The logarithm is bilinear in y and log x.
            let corners =
                [(self.low, y.low), (self.low, y.high), (self.high, y.low), (self.high, y.high)];
            let values = corners.map(|(a, b)| a.powf(b));
            if values.iter().any(|v| v.is_nan()) {
                return Self::unknown();
            }
            let low = values.into_iter().fold(f64::INFINITY, f64::min);
            let high = values.into_iter().fold(f64::NEG_INFINITY, f64::max);
            return Self {
                low: widened(low, Side::Low).max(0.0),
                high: widened(high, Side::High),
                total,
            };
        }
        match constant {
            // A base below zero has a value for whole exponents only.
            Some(k) if k.fract() != 0.0 && self.high >= 0.0 && k > 0.0 => {
                Self { low: 0.0, high: widened(self.high.powf(k), Side::High), total: false }
            }
            _ => Self::unknown(),
        }
    }

    /// An increasing function of the library, on its domain `[from, to]`, with values in `[least, most]`.
    fn increasing(self, f: impl Fn(f64) -> f64, domain: [f64; 2], values: [f64; 2]) -> Self {
        let [from, to] = domain;
        if self.high < from || self.low > to {
            return Self::unknown();
        }
        let low = widened(f(self.low.max(from)), Side::Low);
        let high = widened(f(self.high.min(to)), Side::High);
        if low.is_nan() || high.is_nan() {
            return Self::unknown();
        }
        Self {
            low: low.max(values[0]),
            high: high.min(values[1]),
            total: self.total && self.low >= from && self.high <= to,
        }
    }

    /// The sine, by its largest values at `π/2 + 2πk` and its smallest at `−π/2 + 2πk`.
    fn sin(self, shift: f64, f: impl Fn(f64) -> f64) -> Self {
        use std::f64::consts::{PI, TAU};
        let all = Self { low: -1.0, high: 1.0, ..self };
        if self.size() > ANGLES || self.high - self.low >= TAU {
            return all;
        }
        // An angle that is nearer than this to a place where the function turns counts as there.
        const NEAR: f64 = 1e-8;
        let meets = |at: f64| {
            let turns = |x: f64| (x + shift - at) / TAU;
            (turns(self.low - NEAR)).ceil() <= (turns(self.high + NEAR)).floor()
        };
        let (a, b) = (f(self.low), f(self.high));
        let low = if meets(-PI / 2.0) { -1.0 } else { (a.min(b) - 1e-12).max(-1.0) };
        let high = if meets(PI / 2.0) { 1.0 } else { (a.max(b) + 1e-12).min(1.0) };
        Self { low, high, ..self }
    }

    fn tan(self) -> Self {
        use std::f64::consts::PI;
        let branch = |x: f64| (x / PI + 0.5).floor();
        let apart = self.size() < ANGLES && branch(self.low - 1e-8) == branch(self.high + 1e-8);
        if !apart {
            return Self::unknown();
        }
        Self {
            low: widened(self.low.tan(), Side::Low),
            high: widened(self.high.tan(), Side::High),
            ..self
        }
    }

    /// `{0, 1}`, or one of them.
    fn truth(yes: Option<bool>) -> Self {
        match yes {
            Some(yes) => Self::point(f64::from(u8::from(yes))),
            None => Self::new(0.0, 1.0),
        }
    }

    fn unary(self, op: Unary) -> Self {
        const LINE: [f64; 2] = [f64::NEG_INFINITY, f64::INFINITY];
        const HALF: [f64; 2] = [0.0, f64::INFINITY];
        const UNIT: [f64; 2] = [-1.0, 1.0];
        match op {
            Unary::Neg => self.neg(),
            Unary::Abs => self.abs(),
            Unary::Sqrt => self.sqrt(),
            Unary::Square => self.whole_power(2),
            Unary::Exp => self.increasing(f64::exp, LINE, HALF),
            // No value at 0.
            Unary::Log => self.increasing(f64::ln, HALF, LINE).and(self.low > 0.0),
            Unary::Log10 => self.increasing(f64::log10, HALF, LINE).and(self.low > 0.0),
            Unary::Sin => self.sin(0.0, f64::sin),
            Unary::Cos => self.sin(std::f64::consts::FRAC_PI_2, f64::cos),
            Unary::Tan => self.tan(),
            Unary::Asin => self.increasing(f64::asin, UNIT, LINE),
            Unary::Acos => self.neg().increasing(|x| (-x).acos(), UNIT, LINE),
            Unary::Atan => self.increasing(f64::atan, LINE, LINE),
            Unary::Sinh => self.increasing(f64::sinh, LINE, LINE),
            Unary::Cosh => self.abs().increasing(f64::cosh, HALF, [1.0, f64::INFINITY]),
            Unary::Tanh => self.increasing(f64::tanh, LINE, UNIT),
            Unary::Asinh => self.increasing(f64::asinh, LINE, LINE),
            // Near 1 its argument is rounded, not its value.
            Unary::Acosh => {
                let range = self.increasing(f64::acosh, [1.0, f64::INFINITY], HALF);
                Self { low: (range.low - 1e-12).max(0.0), high: range.high + 1e-12, ..range }
            }
            Unary::Atanh => {
                self.increasing(f64::atanh, UNIT, LINE).and(self.low > -1.0 && self.high < 1.0)
            }
            Unary::Logistic => self.increasing(|x| 1.0 / (1.0 + (-x).exp()), LINE, [0.0, 1.0]),
            Unary::Floor => Self { low: self.low.floor(), high: self.high.floor(), ..self },
            Unary::Ceil => Self { low: self.low.ceil(), high: self.high.ceil(), ..self },
            Unary::Not if !self.total => Self::truth(None),
            Unary::Not if !self.contains(0.0) => Self::truth(Some(false)),
            Unary::Not => Self::truth((self.size() == 0.0).then_some(true)),
        }
    }

    fn binary(self, op: Binary, y: Self) -> Self {
        let total = self.total && y.total;
        match op {
            Binary::Add => self.add(y),
            Binary::Sub => self.add(y.neg()),
            Binary::Mul => self.mul(y),
            Binary::Div => self.div(y),
            Binary::Pow => self.power(y),
            Binary::Less => {
                let d = self.add(y.neg());
                // 0 also where a difference has no value.
                let low = if total { d.low.max(0.0) } else { 0.0 };
                Self { low, high: d.high.max(0.0), total: true }
            }
            Binary::Rem => {
                let most = self.size().min(y.size());
                let low = if self.low < 0.0 { -most } else { 0.0 };
                Self { low, high: if self.high > 0.0 { most } else { 0.0 }, total: false }
            }
            Binary::Atan2 => Self { low: -4.0, high: 4.0, total },
            Binary::SignPow
            | Binary::IntDiv
            | Binary::Precision
            | Binary::Round
            | Binary::Trunc => Self::unknown(),
            Binary::Lt | Binary::Le | Binary::Eq | Binary::Ge | Binary::Gt | Binary::Ne => {
                Self::truth(None)
            }
            Binary::And | Binary::Or | Binary::Iff => Self::truth(None),
        }
    }
}

/// Below this a product may lose digits that its error does not show.
const SMALL: f64 = 1e-280;

#[derive(Clone, Copy, PartialEq)]
enum Side {
    Low,
    High,
}

impl Side {
    /// The next number on this side; what has run over the largest number is that number on the other side.
    fn beyond(self, x: f64) -> f64 {
        match self {
            Self::Low => x.next_down(),
            Self::High => x.next_up(),
        }
    }

    fn is_over(self, x: f64) -> bool {
        x == if self == Self::Low { f64::INFINITY } else { f64::NEG_INFINITY }
    }
}

/// A bound of `a + b`.
fn sum(a: f64, b: f64, side: Side) -> f64 {
    let s = a + b;
    if a.is_infinite() || b.is_infinite() {
        return s;
    }
    if s.is_infinite() {
        return if side.is_over(s) { side.beyond(s) } else { s };
    }
    let shadow = s - a;
    let error = (a - (s - shadow)) + (b - shadow);
    // An error that ran over is none of a number.
    let fine = match side {
        Side::Low => error >= 0.0,
        Side::High => error <= 0.0,
    };
    if fine { s } else { side.beyond(s) }
}

/// A bound of `a b`, where 0 times anything is 0.
fn product(a: f64, b: f64, side: Side) -> f64 {
    if a == 0.0 || b == 0.0 {
        return 0.0;
    }
    let p = a * b;
    if a.is_infinite() || b.is_infinite() {
        return p;
    }
    if p.is_infinite() {
        return if side.is_over(p) { side.beyond(p) } else { p };
    }
    let error = a.mul_add(b, -p);
    let fine = p.abs() > SMALL
        && match side {
            Side::Low => error >= 0.0,
            Side::High => error <= 0.0,
        };
    if fine { p } else { side.beyond(p) }
}

/// A value of the library with what it may be wrong by.
fn widened(x: f64, side: Side) -> f64 {
    if x.is_infinite() {
        return if side.is_over(x) { side.beyond(x) } else { x };
    }
    let error = LIBRARY * x.abs() + f64::MIN_POSITIVE;
    if side == Side::Low { x - error } else { x + error }
}

/// The values of a piecewise linear function: at the ends, and at the points between.
fn piecewise(piece: &Piecewise, x: Range) -> Range {
    // From 0 to each point, as the value is computed.
    let at = |x: f64| {
        let (mut at, mut value) = (0.0, Range::point(0.0));
        let step = |value: Range, k: usize, from: f64, to: f64| {
            let length = Range::point(to).add(Range::point(-from));
            value.add(Range::point(piece.slopes[k]).mul(length))
        };
        if x >= 0.0 {
            let mut k = piece.breaks.partition_point(|b| *b <= 0.0);
            while k < piece.breaks.len() && piece.breaks[k] < x {
                value = step(value, k, at, piece.breaks[k]);
                at = piece.breaks[k];
                k += 1;
            }
            step(value, k, at, x)
        } else {
            let mut k = piece.breaks.partition_point(|b| *b < 0.0);
            while k > 0 && piece.breaks[k - 1] > x {
                value = step(value, k, at, piece.breaks[k - 1]);
                at = piece.breaks[k - 1];
                k -= 1;
            }
            step(value, k, at, x)
        }
    };
    let inside = piece.breaks.iter().copied().filter(|b| x.contains(*b));
    let all = inside.chain([x.low, x.high]).map(at).reduce(Range::hull);
    all.unwrap_or(Range::ALL).and(x.total)
}

impl Graph {
    /// Bounds of all nodes over the box `[lower, upper]`. `None` where the time is over before.
    pub(crate) fn ranges(&self, lower: &[f64], upper: &[f64]) -> Option<Vec<Range>> {
        let mut out: Vec<Range> = Vec::with_capacity(self.nodes.len());
        let variable = |j: usize| Range::new(lower[j], upper[j]);
        let mut pace = Pace::default();
        for (k, node) in self.nodes.iter().enumerate() {
            if k % NODES == 0 && pace.over(NODES as f64 * 30.0) {
                return None;
            }
            let at = |a: &super::Id| out[a.index()];
            let range = match node {
                Node::Constant(x) if x.is_finite() => Range::point(*x),
                Node::Constant(_) => Range::unknown(),
                Node::Variable(j) => variable(*j),
                Node::Unary(op, a) => at(a).unary(*op),
                Node::Binary(op, a, b) => at(a).binary(*op, at(b)),
                Node::Linear(terms) => terms.iter().fold(Range::point(0.0), |sum, &(j, c)| {
                    sum.add(Range::point(c).mul(variable(j)))
                }),
                Node::Nary(op, all) => nary(*op, all.iter().map(at)),
                Node::If([c, a, b]) => match at(c) {
                    // A condition without a value counts as true.
                    c if !c.contains(0.0) => at(a),
                    c if c.total && c.size() == 0.0 => at(b),
                    _ => at(a).hull(at(b)),
                },
                Node::Piecewise(piece, a) => piecewise(piece, at(a)),
            };
            // A bound that is none.
            let sound = range.low <= range.high;
            out.push(if sound { range } else { Range::unknown() });
        }
        (!budget::over()).then_some(out)
    }
}

fn nary(op: Nary, arguments: impl ExactSizeIterator<Item = Range>) -> Range {
    let count = arguments.len() as f64;
    match op {
        Nary::Sum => arguments.fold(Range::point(0.0), Range::add),
        Nary::Min => {
            let less = |a: Range, b: Range| Range {
                low: a.low.min(b.low),
                high: a.high.min(b.high),
                total: a.total && b.total,
            };
            arguments.reduce(less).unwrap_or(Range::unknown())
        }
        Nary::Max => {
            let more = |a: Range, b: Range| Range {
                low: a.low.max(b.low),
                high: a.high.max(b.high),
                total: a.total && b.total,
            };
            arguments.reduce(more).unwrap_or(Range::unknown())
        }
        Nary::Count | Nary::NumberOf => Range::new(0.0, count),
        Nary::All | Nary::Any | Nary::AllDiff | Nary::SomeSame => Range::truth(None),
    }
}

#[cfg(test)]
mod tests {
    use super::super::Expressions;
    use crate::field::Field;

    /// A few numbers without any pattern, in [0, 1).
    fn numbers(seed: u64) -> impl FnMut() -> f64 {
        let mut state = seed.wrapping_mul(0x9e37_79b9_7f4a_7c15) | 1;
        move || {
            state ^= state << 13;
            state ^= state >> 7;
            state ^= state << 17;
            (state >> 11) as f64 / (1u64 << 53) as f64
        }
    }

    #[test]
    fn no_value_is_outside_its_bounds() {
        let texts = [
            "x1*x2 - x2*x1 + x1^3",
            "x1/x2 + 1/(x1 - 3)",
            "sqrt(x1) + sqrt(x2 + 4)",
            "exp(x1) - log(x2) + log10(x1 + 5)",
            "sin(3*x1) * cos(x2)",
            "sin(x1) + cos(x1) + tan(0.3*x2)",
            "abs(x1) - x2^2 + x1^4",
            "tanh(x1) + atan(x2) + sinh(x1) + cosh(x2)",
            "asin(x1/10) - acos(x2/10) + asinh(x1) + acosh(x2) + atanh(x1/20)",
            "x1^1.5 + x2^(-0.5) + x1^(-3)",
            "min(x1, x2, 0.3) + max(x1, 2*x2)",
            "(x1 + 0.1)*(x2 - 0.7)/3 + x1^0.5",
            "2^x1 + 0.5^x2",
            "x1^x2",
        ];
        let mut defined = 0;
        for (k, text) in texts.iter().enumerate() {
            let f = Expressions::parse(&[text.to_string(), "x2".into()], &[]).unwrap();
            let mut field = f.evaluator();
            let mut next = numbers(k as u64 + 1);
            for _ in 0..200 {
                let box_of = |a: f64, b: f64| [8.0 * a - 4.0, 8.0 * a - 4.0 + 8.0 * b * b * b];
                let sides = [box_of(next(), next()), box_of(next(), next())];
                let (lower, upper) = (sides.map(|s| s[0]), sides.map(|s| s[1]));
                let range = f.ranges(&lower, &upper).unwrap()[0];
                for _ in 0..30 {
                    let x = [0, 1].map(|j| lower[j] + (upper[j] - lower[j]) * next());
                    let mut values = [0.0; 2];
                    if field.value(&x, &mut values) {
                        defined += 1;
                        // The value itself is rounded.
                        let slack = 1e-12 * values[0].abs().max(1.0);
                        let inside =
                            range.low - slack <= values[0] && values[0] <= range.high + slack;
                        assert!(inside, "{text} at {x:?}: {} {range:?}", values[0]);
                    } else {
                        assert!(!range.total, "{text} at {x:?} {range:?}");
                    }
                }
            }
        }
        assert!(defined > 20_000);
    }

    #[test]
    fn what_is_exact_stays_so_and_what_is_not_is_rounded_outwards() {
        let inf = f64::INFINITY;
        let range = |text: &str, low: f64, high: f64| {
            let f = Expressions::parse(&[text.to_string()], &[]).unwrap();
            let range = f.ranges(&[low], &[high]).unwrap()[0];
            (range.low, range.high, range.total)
        };
        assert_eq!(range("x1^2 + 1", -inf, inf), (1.0, inf, true));
        assert_eq!(range("3*x1 - 6", 0.0, 2.0), (-6.0, 0.0, true));
        assert_eq!(range("-1 - abs(x1)", -3.0, inf), (-inf, -1.0, true));
        assert_eq!(range("x1/4", 1.0, 3.0), (0.25, 0.75, true));
        assert_eq!(range("sqrt(x1)", -1.0, 9.0), (0.0, 3.0, false));
        assert_eq!(range("1/x1", 0.0, 2.0), (0.5, inf, false));
        assert_eq!(range("1/x1", 2.0, inf), (0.0, 0.5, true));
        assert_eq!(range("log(x1)", 0.0, 1.0).0, -inf);
        let (low, high, _) = range("0.1*x1", 3.0, 3.0);
        assert!(low < high && high.next_down() <= low.next_up() && low <= 0.3 && 0.3 <= high);
        let (low, high, _) = range("exp(x1)", 0.0, 0.0);
        assert!(low < 1.0 && 1.0 < high && high - low < 1e-11);
        assert_eq!(range("sin(x1)", 0.0, 3.0).1, 1.0);
        assert_eq!(range("cos(x1)", -0.5, 0.5).1, 1.0);
        assert!(range("sin(x1)", 0.1, 0.2).1 < 0.2);
        // Numbers that run over stay on the safe side.
        assert_eq!(range("x1*x1*1e200", 1e200, 1e300), (f64::MAX, inf, true));
    }
}
