//! F by a closure, its Jacobian by differences: where nothing else is there.
//!
//! ```text
//! J_ij = (F_i(x + h e_j) − F_i(x − h e_j)) / 2h              h = ε^⅓ max(|x_j|, 10⁻³)
//! J_ij = ±(4 F_i(x ± h e_j) − F_i(x ± 2h e_j) − 3 F_i(x)) / 2h   where F_i is defined on one side only
//! ```
//!
//! for all columns at once of which no row has two (CurtisPowellReid1974). The relative error is about 10⁻¹⁰ where F has the size of its terms and x_j that of what
//! F changes with; Newton's methods then still converge as fast as anybody sees, down to a residual of the rounding of F. Cost: two values of F a colour.

use std::fmt;
use std::sync::Arc;

use nonsmooth_linalg::budget;

use super::closures::Closure;
use super::groups::Groups;
use super::memory::{JACOBIANS, Memory, VALUES};
use super::probe::{Seen, points, probed};
use super::{Evaluator, Field, Pattern, tentatively};
use crate::ProblemError;
use crate::error::vector;

/// Sizes of variables below this count as this.
const SMALL: f64 = 1e-3;

/// `F: ℝⁿ → ℝⁿ` by a closure, whose Jacobian is taken by finite differences. Numbers that are not finite say that F is not defined there.
///
/// ```
/// use nonsmooth_problem::field::{Differences, Evaluator, Field};
///
/// let field = Differences::probed(&[1.0, 1.0, 1.0], |x, f| {
///     f.copy_from_slice(&[x[0].exp() - 1.0, x[0] * x[1], x[2].powi(3)]);
/// })?;
/// assert_eq!(field.pattern().row(1), [0, 1]);
/// assert!(field.source().starts_with("central differences in 2 colours"));
/// let (mut f, mut j) = ([0.0; 3], [0.0; 4]);
/// assert!(field.evaluator().jacobian(&[0.0, 3.0, 2.0], &mut f, &mut j));
/// assert!([1.0, 3.0, 0.0, 12.0].iter().zip(j).all(|(exact, j)| (exact - j).abs() < 1e-7));
/// # Ok::<(), nonsmooth_problem::ProblemError>(())
/// ```
#[derive(Clone)]
pub struct Differences {
    value: Closure,
    shape: Arc<Shape>,
    /// What was said of F, and what came of it.
    values: Arc<Memory>,
    jacobians: Arc<Memory>,
}

/// Where the Jacobian may not be zero.
struct Shape {
    pattern: Pattern,
    groups: Groups,
    probed: bool,
}

impl Differences {
    /// `value(x, f)` writes F(x), all entries of it. What the pattern does not have is taken to be zero.
    ///
    /// Errors: a pattern that is not square, or whose columns do not ascend.
    pub fn new(
        pattern: Pattern,
        value: impl Fn(&[f64], &mut [f64]) + Send + Sync + 'static,
    ) -> Result<Self, ProblemError> {
        pattern.validate()?;
        Ok(Self::of(Arc::new(value), pattern, false))
    }

    /// As [`new`](Self::new), with the pattern probed at x, where F should be defined, and at three points about it: a row has a place in a column if its value there is not the
    /// same after a change of that variable, or NaN where that is NaN. A dependence that shows at none of these points is not seen. Cost: for k places a row
    /// some `8 k log₂ n` values of F.
    ///
    /// Errors: no variables, or numbers in x that are not finite.
    pub fn probed(
        x: &[f64],
        value: impl Fn(&[f64], &mut [f64]) + Send + Sync + 'static,
    ) -> Result<Self, ProblemError> {
        let n = x.len();
        if n == 0 {
            return Err(ProblemError::shape("x", "at least one variable", "none"));
        }
        vector("x", x, n, "variables")?;
        let mut f = vec![0.0; n];
        // A change that nothing of F rounds away, and not by a number that a period is made of.
        let change = |x: f64| x + 0.0123 * x.abs().max(1.0);
        let at = points(x).into_iter().map(|x| {
            let mut f = vec![0.0; n];
            tentatively(|| value(&x, &mut f));
            (x, f)
        });
        let at: Vec<_> = at.collect();
        let pattern = probed(n, 1, |sets, seen| {
            for (set, seen) in sets.iter().zip(seen) {
                for (x, before) in &at {
                    for changed in [change, |_| f64::NAN] {
                        let mut y = x.clone();
                        set.iter().for_each(|&j| y[j] = changed(x[j]));
                        // A failure is an answer as NaN is: it depends.
                        tentatively(|| value(&y, &mut f));
                        for (i, seen) in seen.iter_mut().enumerate() {
                            let said = match before[i].is_finite() {
                                false => Seen::Unknown,
                                true if before[i] == f[i] => Seen::No,
                                true => Seen::Yes,
                            };
                            *seen = said.max(*seen);
                        }
                    }
                }
            }
        });
        Ok(Self::of(Arc::new(value), pattern, true))
    }

    fn of(value: Closure, pattern: Pattern, probed: bool) -> Self {
        let groups = Groups::of(&pattern, pattern.rows());
        let shape = Arc::new(Shape { pattern, groups, probed });
        Self { value, shape, values: Arc::default(), jacobians: Arc::default() }
    }
}

impl fmt::Debug for Differences {
    fn fmt(&self, f: &mut fmt::Formatter) -> fmt::Result {
        f.debug_struct("Differences").field("pattern", &self.shape.pattern).finish_non_exhaustive()
    }
}

impl Field for Differences {
    fn dim(&self) -> usize {
        self.shape.pattern.rows()
    }

    fn pattern(&self) -> &Pattern {
        &self.shape.pattern
    }

    fn evaluator(&self) -> Box<dyn Evaluator> {
        let sides = std::array::from_fn(|_| vec![0.0; self.dim()]);
        Box::new(Running { field: self.clone(), y: vec![], sides })
    }

    fn source(&self) -> String {
        let pattern = if self.shape.probed { "probed" } else { "declared" };
        format!("central differences in {} of a {pattern} pattern", self.shape.groups.said())
    }
}

struct Running {
    field: Differences,
    y: Vec<f64>,
    /// F at h, −h, 2h and −2h.
    sides: [Vec<f64>; 4],
}

impl Evaluator for Running {
    fn value(&mut self, x: &[f64], f: &mut [f64]) -> bool {
        self.field.values.recall(VALUES, x, f, &*self.field.value)
    }

    fn jacobian(&mut self, x: &[f64], f: &mut [f64], jacobian: &mut [f64]) -> bool {
        if budget::over() || !self.value(x, f) {
            return false;
        }
        let memory = self.field.jacobians.clone();
        memory.recall(JACOBIANS, x, jacobian, |x, jacobian| self.differences(x, f, jacobian))
    }
}

impl Running {
    /// The entries of the Jacobian at x, where F is f. NaN where F is not defined about x, or the time is over.
    fn differences(&mut self, x: &[f64], f: &[f64], jacobian: &mut [f64]) {
        let Self { field, y, sides } = self;
        let Shape { pattern, groups, .. } = &*field.shape;
        y.clear();
        y.extend_from_slice(x);
        for (colour, columns) in groups.columns.iter().enumerate() {
            if budget::over() {
                return jacobian.fill(f64::NAN);
            }
            let mut look = |side: &mut Vec<f64>, times: f64| {
                columns.iter().for_each(|&j| y[j] = x[j] + times * step(x[j]));
                // Beside x F may not be defined.
                tentatively(|| (field.value)(y, side));
            };
            let [up, down, far_up, far_down] = sides;
            look(up, 1.0);
            look(down, -1.0);
            if up.iter().chain(&*down).any(|f| !f.is_finite()) {
                look(far_up, 2.0);
                look(far_down, -2.0);
            }
            columns.iter().for_each(|&j| y[j] = x[j]);
            for (at, (i, j)) in pattern.places().enumerate() {
                if groups.of_column[j] != colour {
                    continue;
                }
                // As x and h are rounded.
                let h = ((x[j] + step(x[j])) - (x[j] - step(x[j]))) / 2.0;
                let one_sided = |near: f64, far: f64| (4.0 * near - far - 3.0 * f[i]) / (2.0 * h);
                jacobian[at] = match (up[i].is_finite(), down[i].is_finite()) {
                    (true, true) => (up[i] - down[i]) / (2.0 * h),
                    (true, false) => one_sided(up[i], far_up[i]),
                    (false, true) => -one_sided(down[i], far_down[i]),
                    (false, false) => f64::NAN,
                };
            }
        }
    }
}

/// h for a variable at x.
fn step(x: f64) -> f64 {
    f64::EPSILON.cbrt() * x.abs().max(SMALL)
}
