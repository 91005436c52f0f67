//! F by a function that is generic over its numbers, its Jacobian by dual numbers.
//!
//! ```text
//! x_j + ε_c(j)      in lane c(j), the colour of column j
//! F(x + ε)  = F(x) + Σ_c ε_c Σ_{j of colour c} J_ij      of which no row has two terms (CurtisPowellReid1974)
//! ```
//!
//! Exact to rounding. Cost: one evaluation in numbers of 1 + 8 parts for each 8 colours; that of an evaluation in doubles is counted in what a number's derivatives cost
//! beside its value: 2 to 10 times.

use std::fmt;
use std::sync::Arc;

use nonsmooth_linalg::budget;
use num_dual::{Derivative, DualNum, DualSVec64};

use super::groups::Groups;
use super::probe::{Seen, points, probed};
use super::{Evaluator, Field, Pattern};
use crate::ProblemError;
use crate::error::vector;

/// Derivatives of a number.
const LANES: usize = 8;

type Dual = DualSVec64<LANES>;

/// What a [`Function`] calculates with: sums, products, quotients among themselves and with doubles, powers, roots, exponentials, trigonometric functions and
/// their inverses, comparisons by value.
pub trait Number: DualNum<Primitive = f64> + Copy {}

impl<T: DualNum<Primitive = f64> + Copy> Number for T {}

/// `F: ℝⁿ → ℝⁿ`, written once for all numbers.
///
/// ```
/// use nonsmooth_problem::field::{Duals, Evaluator, Field, Function, Number};
///
/// /// `F_i = x_i³ − x_{i−1} − x_{i+1}`
/// struct Chain(usize);
///
/// impl Function for Chain {
///     fn dim(&self) -> usize {
///         self.0
///     }
///
///     fn at<T: Number>(&self, x: &[T], f: &mut [T]) {
///         for i in 0..self.0 {
///             f[i] = x[i].powi(3);
///             if i > 0 {
///                 f[i] -= x[i - 1];
///             }
///             if i + 1 < self.0 {
///                 f[i] -= x[i + 1];
///             }
///         }
///     }
/// }
///
/// let field = Duals::new(Chain(1000), &[1.0; 1000])?;
/// assert_eq!(field.source(), "a generic function, by dual numbers in 3 colours of a probed pattern");
/// assert_eq!(field.pattern().len(), 2998);
/// # Ok::<(), nonsmooth_problem::ProblemError>(())
/// ```
pub trait Function: Send + Sync + 'static {
    /// n
    fn dim(&self) -> usize;

    /// `f = F(x)`, all entries of it. Numbers that are not finite say that F is not defined there.
    fn at<T: Number>(&self, x: &[T], f: &mut [T]);

    /// Where the Jacobian may not be zero; where that is not said, it is probed.
    fn pattern(&self) -> Option<Pattern> {
        None
    }
}

/// A [`Function`] with its Jacobian by dual numbers.
pub struct Duals<F>(Arc<Shaped<F>>);

struct Shaped<F> {
    function: F,
    pattern: Pattern,
    groups: Groups,
    probed: bool,
}

impl<F> Clone for Duals<F> {
    fn clone(&self) -> Self {
        Self(self.0.clone())
    }
}

impl<F: Function> Duals<F> {
    /// A function with the pattern that it declares. Where it declares none, it is probed at x, where F should be defined, and at three points about it: a derivative that is not
    /// a number is given to each column, and what it reaches has a place. So a dependence is seen whatever its size, even where it is zero at that point;
    /// only where it is in a branch that none of these points takes, it is not. Rows that are defined at none of them are taken to be full. Cost: for k places a row some
    /// `k log₂ n` evaluations.
    ///
    /// Errors: no variables, x of another length or not finite, a pattern that is not that of n rows and columns.
    pub fn new(function: F, x: &[f64]) -> Result<Self, ProblemError> {
        let n = function.dim();
        if n == 0 {
            return Err(ProblemError::shape("F", "at least one row", "none"));
        }
        vector("x", x, n, "rows of F")?;
        let declared = function.pattern();
        let probed = declared.is_none();
        let pattern = declared.unwrap_or_else(|| pattern_of(&function, x));
        pattern.validate()?;
        if pattern.rows() != n {
            let found = format!("{} rows", pattern.rows());
            return Err(ProblemError::shape("pattern", format!("{n} rows (those of F)"), found));
        }
        let groups = Groups::of(&pattern, n);
        Ok(Self(Arc::new(Shaped { function, pattern, groups, probed })))
    }
}

fn pattern_of<F: Function>(function: &F, x: &[f64]) -> Pattern {
    let n = x.len();
    let points = points(x);
    let mut f = vec![Dual::from(0.0); n];
    // The last lane is nobody's: it is a number unless the function has no slope.
    probed(n, LANES - 1, |sets, seen| {
        for x in &points {
            let mut y: Vec<_> = x.iter().map(|&x| Dual::from(x)).collect();
            for (lane, set) in sets.iter().enumerate() {
                for &j in set {
                    y[j] = y[j].derivative(lane);
                    y[j].eps.0.iter_mut().for_each(|eps| eps[lane] = f64::NAN);
                }
            }
            function.at(&y, &mut f);
            for (i, f) in f.iter().enumerate() {
                let lanes = f.eps.0.unwrap_or_default();
                for (lane, seen) in seen.iter_mut().enumerate() {
                    let said = match lanes[lane].is_nan() {
                        _ if !f.re.is_finite() || lanes[LANES - 1].is_nan() => Seen::Unknown,
                        true => Seen::Yes,
                        false => Seen::No,
                    };
                    seen[i] = said.max(seen[i]);
                }
            }
        }
    })
}

impl<F: Function> fmt::Debug for Duals<F> {
    fn fmt(&self, f: &mut fmt::Formatter) -> fmt::Result {
        f.debug_struct("Duals").field("pattern", &self.0.pattern).finish_non_exhaustive()
    }
}

impl<F: Function> Field for Duals<F> {
    fn dim(&self) -> usize {
        self.0.pattern.rows()
    }

    fn pattern(&self) -> &Pattern {
        &self.0.pattern
    }

    fn evaluator(&self) -> Box<dyn Evaluator> {
        let zero = vec![Dual::from(0.0); self.dim()];
        Box::new(Running { field: self.clone(), y: zero.clone(), f: zero })
    }

    fn source(&self) -> String {
        let pattern = if self.0.probed { "probed" } else { "declared" };
        let colours = self.0.groups.said();
        format!("a generic function, by dual numbers in {colours} of a {pattern} pattern")
    }
}

struct Running<F> {
    field: Duals<F>,
    y: Vec<Dual>,
    f: Vec<Dual>,
}

impl<F: Function> Evaluator for Running<F> {
    fn value(&mut self, x: &[f64], f: &mut [f64]) -> bool {
        self.field.0.function.at(x, f);
        f.iter().all(|f| f.is_finite())
    }

    fn jacobian(&mut self, x: &[f64], f: &mut [f64], jacobian: &mut [f64]) -> bool {
        let Shaped { function, pattern, groups, .. } = &*self.field.0;
        for first in (0..groups.columns.len()).step_by(LANES) {
            if budget::over() {
                return false;
            }
            for ((y, &x), &colour) in self.y.iter_mut().zip(x).zip(&groups.of_column) {
                *y = Dual::from(x);
                if (first..first + LANES).contains(&colour) {
                    *y = y.derivative(colour - first);
                }
            }
            function.at(&self.y, &mut self.f);
            if self.f.iter().any(|f| !f.re.is_finite()) {
                return false;
            }
            for (entry, (i, j)) in jacobian.iter_mut().zip(pattern.places()) {
                if let Some(lane) = groups.of_column[j].checked_sub(first).filter(|k| *k < LANES) {
                    let Derivative(eps) = self.f[i].eps;
                    *entry = eps.map_or(0.0, |eps| eps[lane]);
                }
            }
        }
        f.iter_mut().zip(&self.f).for_each(|(f, dual)| *f = dual.re);
        jacobian.iter().all(|j| j.is_finite())
    }
}
