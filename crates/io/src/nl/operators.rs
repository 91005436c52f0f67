//! The operators of expressions, by their numbers.

use std::sync::LazyLock;

use nonsmooth_problem::field::{Binary, Nary, Unary};

/// What an operator makes of its arguments.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) enum Operator {
    /// Of one.
    Unary(Unary),
    /// Of two.
    Binary(Binary),
    /// Of as many as the file says.
    Nary(Nary),
    /// The second where the first is true, else the third.
    If,
    /// A piecewise linear function, whose slopes and breakpoints stand before the argument.
    Piecewise,
    /// `a²`, which AMPL makes of `a^2` and writes as a power.
    Square,
}

use Operator::{If, Piecewise, Square};

/// All operators with their numbers. Of several numbers for one operator, the first is written.
const TABLE: [(u8, Operator); 67] = [
    (0, Operator::Binary(Binary::Add)),
    (1, Operator::Binary(Binary::Sub)),
    (2, Operator::Binary(Binary::Mul)),
    (3, Operator::Binary(Binary::Div)),
    (4, Operator::Binary(Binary::Rem)),
    (5, Operator::Binary(Binary::Pow)),
    (6, Operator::Binary(Binary::Less)),
    (11, Operator::Nary(Nary::Min)),
    (12, Operator::Nary(Nary::Max)),
    (13, Operator::Unary(Unary::Floor)),
    (14, Operator::Unary(Unary::Ceil)),
    (15, Operator::Unary(Unary::Abs)),
    (16, Operator::Unary(Unary::Neg)),
    (20, Operator::Binary(Binary::Or)),
    (21, Operator::Binary(Binary::And)),
    (22, Operator::Binary(Binary::Lt)),
    (23, Operator::Binary(Binary::Le)),
    (24, Operator::Binary(Binary::Eq)),
    (28, Operator::Binary(Binary::Ge)),
    (29, Operator::Binary(Binary::Gt)),
    (30, Operator::Binary(Binary::Ne)),
    (34, Operator::Unary(Unary::Not)),
    (35, If),
    (37, Operator::Unary(Unary::Tanh)),
    (38, Operator::Unary(Unary::Tan)),
    (39, Operator::Unary(Unary::Sqrt)),
    (40, Operator::Unary(Unary::Sinh)),
    (41, Operator::Unary(Unary::Sin)),
    (42, Operator::Unary(Unary::Log10)),
    (43, Operator::Unary(Unary::Log)),
    (44, Operator::Unary(Unary::Exp)),
    (45, Operator::Unary(Unary::Cosh)),
    (46, Operator::Unary(Unary::Cos)),
    (47, Operator::Unary(Unary::Atanh)),
    (48, Operator::Binary(Binary::Atan2)),
    (49, Operator::Unary(Unary::Atan)),
    (50, Operator::Unary(Unary::Asinh)),
    (51, Operator::Unary(Unary::Asin)),
    (52, Operator::Unary(Unary::Acosh)),
    (53, Operator::Unary(Unary::Acos)),
    (54, Operator::Nary(Nary::Sum)),
    (55, Operator::Binary(Binary::IntDiv)),
    (56, Operator::Binary(Binary::Precision)),
    (57, Operator::Binary(Binary::Round)),
    (58, Operator::Binary(Binary::Trunc)),
    (59, Operator::Nary(Nary::Count)),
    (60, Operator::Nary(Nary::NumberOf)),
    (61, Operator::Nary(Nary::NumberOf)),
    // `atleast a c` is a ≤ c for a count c, and so on.
    (62, Operator::Binary(Binary::Le)),
    (63, Operator::Binary(Binary::Ge)),
    (64, Piecewise),
    (65, If),
    (66, Operator::Binary(Binary::Eq)),
    (67, Operator::Binary(Binary::Gt)),
    (68, Operator::Binary(Binary::Lt)),
    (69, Operator::Binary(Binary::Ne)),
    (70, Operator::Nary(Nary::All)),
    (71, Operator::Nary(Nary::Any)),
    (72, If),
    (73, Operator::Binary(Binary::Iff)),
    (74, Operator::Nary(Nary::AllDiff)),
    (75, Operator::Nary(Nary::SomeSame)),
    // A power whose exponent, or base, is a number.
    (76, Operator::Binary(Binary::Pow)),
    (77, Square),
    (78, Operator::Binary(Binary::Pow)),
    (79, Operator::Unary(Unary::Logistic)),
    (80, Operator::Binary(Binary::SignPow)),
];

/// The operator of a number.
pub(super) fn operator(number: i64) -> Option<Operator> {
    static BY_NUMBER: LazyLock<[Option<Operator>; 81]> = LazyLock::new(|| {
        std::array::from_fn(|k| {
            TABLE.iter().find(|entry| usize::from(entry.0) == k).map(|entry| entry.1)
        })
    });
    BY_NUMBER.get(usize::try_from(number).ok()?).copied().flatten()
}

/// The number that is written for an operator.
pub(super) fn number(of: Operator) -> Option<u8> {
    TABLE.iter().find(|entry| entry.1 == of).map(|entry| entry.0)
}
