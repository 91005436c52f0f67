//! Functions `F: ℝⁿ → ℝⁿ` of nonlinear problems: where their values and Jacobians come from.
//!
//! | source | values | Jacobian |
//! | --- | --- | --- |
//! | [`Expressions`] | a graph of operations, in plain and in doubled precision | exact, sparse, backwards through each row |
//! | `Duals` (feature `duals`) | a function generic over its numbers | exact, sparse, forwards, several columns at once |
//! | [`Closures`] | a closure | another closure |
//! | [`Differences`] | a closure | central differences, several columns at once |
//!
//! The last three do not know the terms of a row: the judge takes them from the Jacobian, and has F in plain arithmetic only. Within a solve closures are not asked twice at the last points.

mod closures;
mod differences;
#[cfg(feature = "duals")]
mod duals;
mod expression;
mod groups;
mod memory;
mod probe;
#[cfg(test)]
mod tests;

use std::cell::Cell;
use std::fmt::Debug;
use std::sync::Arc;

use nonsmooth_linalg::Csc;

use crate::ProblemError;

pub use closures::Closures;
pub use differences::Differences;
#[cfg(feature = "duals")]
pub use duals::{Duals, Function, Number};
pub use expression::{
    Affine, Binary, Expressions, Graph, Id, Nary, Node, Piecewise, Range, Twins, Unary,
};
pub(crate) use expression::{Combination, Term};

thread_local! {
    static TENTATIVE: Cell<bool> = const { Cell::new(false) };
}

/// Asks functions on this thread in vain where they fail: whoever calls those of a caller's takes a failure there for a point where F is not defined, and tells nobody
/// ([`is_tentative`]).
pub fn tentatively<T>(ask: impl FnOnce() -> T) -> T {
    struct Before(bool);
    impl Drop for Before {
        fn drop(&mut self) {
            TENTATIVE.set(self.0);
        }
    }
    let _before = Before(TENTATIVE.replace(true));
    ask()
}

/// Whether a function that fails now is to fail in silence.
pub fn is_tentative() -> bool {
    TENTATIVE.get()
}

/// Checks that the pattern of the Jacobian is one of as many rows as F has.
pub(crate) fn fits(field: &dyn Field) -> Result<(), ProblemError> {
    let (pattern, n) = (field.pattern(), field.dim());
    if pattern.rows() != n {
        return Err(ProblemError::shape(
            "pattern",
            format!("{n} rows, as F"),
            pattern.rows().to_string(),
        ));
    }
    pattern.validate()
}

/// The places where a Jacobian may not be zero: columns of each row, ascending.
#[derive(Debug, Clone, PartialEq, Eq, Default)]
pub struct Pattern {
    starts: Vec<usize>,
    columns: Vec<usize>,
}

impl Pattern {
    /// Of the columns of each row, ascending and without repetition.
    pub fn new(rows: impl Iterator<Item: Iterator<Item = usize>>) -> Self {
        let mut out = Self { starts: vec![0], columns: vec![] };
        for row in rows {
            out.columns.extend(row);
            out.starts.push(out.columns.len());
        }
        out
    }

    /// All places of n rows and columns.
    pub fn dense(n: usize) -> Self {
        Self::new((0..n).map(|_| 0..n))
    }

    /// Checks that there are as many columns as rows, at least one, and that the columns of each row ascend without repetition.
    pub fn validate(&self) -> Result<(), ProblemError> {
        let n = self.rows();
        if n == 0 {
            return Err(ProblemError::shape("pattern", "at least one row", "none"));
        }
        for i in 0..n {
            let row = self.row(i);
            let wrong = |k: &usize| row[*k] >= n || (*k > 0 && row[*k] <= row[*k - 1]);
            if let Some(k) = (0..row.len()).find(wrong) {
                return Err(ProblemError::value(
                    format!("pattern[{i}][{k}]"),
                    format!("columns below {n} in ascending order"),
                    row[k],
                ));
            }
        }
        Ok(())
    }

    /// The number of rows.
    pub fn rows(&self) -> usize {
        self.starts.len().saturating_sub(1)
    }

    /// The number of places.
    pub fn len(&self) -> usize {
        self.columns.len()
    }

    /// Whether there is no place.
    pub fn is_empty(&self) -> bool {
        self.columns.is_empty()
    }

    /// Where row i stands among all places.
    pub fn range(&self, i: usize) -> std::ops::Range<usize> {
        self.starts[i]..self.starts[i + 1]
    }

    /// The columns of row i.
    pub fn row(&self, i: usize) -> &[usize] {
        &self.columns[self.range(i)]
    }

    /// Rows and columns of all places, row after row.
    pub fn places(&self) -> impl Iterator<Item = (usize, usize)> + Clone + '_ {
        (0..self.rows()).flat_map(|i| self.row(i).iter().map(move |&j| (i, j)))
    }
}

/// `F: ℝⁿ → ℝⁿ`, which may be undefined somewhere, with its Jacobian.
pub trait Field: Debug + Send + Sync {
    /// n.
    fn dim(&self) -> usize;

    /// Where the Jacobian may not be zero.
    fn pattern(&self) -> &Pattern;

    /// What evaluates it, with memory of its own.
    fn evaluator(&self) -> Box<dyn Evaluator>;

    /// Where values and Jacobian come from, in words for an account.
    fn source(&self) -> String;

    /// The expressions that it is made of, if it is.
    fn expressions(&self) -> Option<&Expressions> {
        None
    }
}

/// Functions are the same where they are the same expressions, or the same object.
pub(crate) fn same(a: &Arc<dyn Field>, b: &Arc<dyn Field>) -> bool {
    match (a.expressions(), b.expressions()) {
        (Some(a), Some(b)) => a.same(b),
        _ => Arc::ptr_eq(a, b),
    }
}

/// M and q of `F(x) = M x + q`, where F is known to be affine, and whether they are exact: the coefficients of F without any rounding.
pub fn linear(field: &dyn Field) -> Option<(Csc, Vec<f64>, bool)> {
    let n = field.dim();
    let affine = field.expressions()?.affine()?;
    let finite = affine.entries.iter().all(|e| e.2.is_finite());
    if !finite || affine.constants.iter().any(|q| !q.is_finite()) {
        return None;
    }
    let matrix = Csc::from_triplets(n, n, affine.entries.iter().copied()).ok()?;
    Some((matrix, affine.constants, affine.exact))
}

/// Evaluates a [`Field`].
pub trait Evaluator: Send {
    /// `f = F(x)`. False where F is not defined; then f is of no use.
    fn value(&mut self, x: &[f64], f: &mut [f64]) -> bool;

    /// F(x), and JF(x) along the [`Pattern`], row after row. False where one of them is not defined, or the time is over.
    fn jacobian(&mut self, x: &[f64], f: &mut [f64], jacobian: &mut [f64]) -> bool;

    /// F(x) in doubled precision, rounded once, as far as the source allows; of other sources as [`value`](Self::value).
    fn precisely(&mut self, x: &[f64], f: &mut [f64]) -> bool {
        self.value(x, f)
    }

    /// The size of the terms of each row at x: of a polynomial the sum of the moduli of its monomials. False where the source does not know terms.
    fn sizes(&mut self, _x: &[f64], _sizes: &mut [f64]) -> bool {
        false
    }
}
