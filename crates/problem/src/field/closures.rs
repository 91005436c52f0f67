//! F and its Jacobian by closures.

use std::fmt;
use std::sync::Arc;

use super::memory::{JACOBIANS, Memory, VALUES};
use super::{Evaluator, Field, Pattern};
use crate::ProblemError;

/// `f = F(x)`, or JF along a pattern.
pub(super) type Closure = Arc<dyn Fn(&[f64], &mut [f64]) + Send + Sync>;

/// `F: ℝⁿ → ℝⁿ` by a closure, with its Jacobian by another. Numbers that are not finite say that F is not defined there. Both are functions of x
/// for as long as a solve lasts: what they said is remembered for so long.
///
/// ```
/// use nonsmooth_problem::field::{Closures, Evaluator, Field, Pattern};
///
/// // F = (log x1, x1 x2)
/// let pattern = Pattern::new([vec![0], vec![0, 1]].into_iter().map(Vec::into_iter));
/// let field = Closures::new(
///     pattern,
///     |x, f| (f[0], f[1]) = (x[0].ln(), x[0] * x[1]),
///     |x, j| j.copy_from_slice(&[1.0 / x[0], x[1], x[0]]), // row after row
/// )?;
/// let (mut f, mut j) = ([0.0; 2], [0.0; 3]);
/// assert!(field.evaluator().jacobian(&[1.0, 3.0], &mut f, &mut j));
/// assert_eq!((f, j), ([0.0, 3.0], [1.0, 3.0, 1.0]));
/// assert!(!field.evaluator().value(&[-1.0, 3.0], &mut f));
/// # Ok::<(), nonsmooth_problem::ProblemError>(())
/// ```
#[derive(Clone)]
pub struct Closures {
    pattern: Arc<Pattern>,
    value: Closure,
    jacobian: Closure,
    /// What they said.
    values: Arc<Memory>,
    jacobians: Arc<Memory>,
}

impl Closures {
    /// `value(x, f)` writes F(x), `jacobian(x, j)` the entries of JF(x) at the places of the pattern, row after row. Both have to write all entries.
    ///
    /// Errors: a pattern that is not square, or whose columns do not ascend.
    pub fn new(
        pattern: Pattern,
        value: impl Fn(&[f64], &mut [f64]) + Send + Sync + 'static,
        jacobian: impl Fn(&[f64], &mut [f64]) + Send + Sync + 'static,
    ) -> Result<Self, ProblemError> {
        pattern.validate()?;
        Ok(Self {
            pattern: Arc::new(pattern),
            value: Arc::new(value),
            jacobian: Arc::new(jacobian),
            values: Arc::default(),
            jacobians: Arc::default(),
        })
    }
}

impl fmt::Debug for Closures {
    fn fmt(&self, f: &mut fmt::Formatter) -> fmt::Result {
        f.debug_struct("Closures").field("pattern", &self.pattern).finish_non_exhaustive()
    }
}

impl Field for Closures {
    fn dim(&self) -> usize {
        self.pattern.rows()
    }

    fn pattern(&self) -> &Pattern {
        &self.pattern
    }

    fn evaluator(&self) -> Box<dyn Evaluator> {
        Box::new(self.clone())
    }

    fn source(&self) -> String {
        "closures for F and for its Jacobian".into()
    }
}

impl Evaluator for Closures {
    fn value(&mut self, x: &[f64], f: &mut [f64]) -> bool {
        self.values.recall(VALUES, x, f, &*self.value)
    }

    fn jacobian(&mut self, x: &[f64], f: &mut [f64], jacobian: &mut [f64]) -> bool {
        self.value(x, f) && self.jacobians.recall(JACOBIANS, x, jacobian, &*self.jacobian)
    }
}
