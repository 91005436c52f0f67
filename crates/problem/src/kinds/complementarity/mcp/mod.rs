//! The nonlinear mixed complementarity problem.

mod judge;
#[cfg(test)]
mod tests;

use std::sync::Arc;

use nonsmooth_linalg::Matrix;

pub use judge::McpGauge;

use super::stated::{Part, Parts, Shape, Stated, of_jacobian, plural, x_and_f};
use super::{BoxLcp, LcpPoint};
use crate::check::proof::Exactly;
use crate::check::{
    Certificate, ConeSystem, Evidence, Judged, Measure, Relaxed, RowCounts, RowStatus, VerdictOf,
    weigh,
};
use crate::error::{bounds, vector};
use crate::field::{Expressions, Field, fits, linear, same};
use crate::{Kind, OfAny, Problem, ProblemError};

/// `l ≤ x ≤ u ⟂ F(x)`: `F_i(x) ≥ 0` where `x_i = l_i`, `F_i(x) ≤ 0` where `x_i = u_i`, and `F_i(x) = 0` between; that is
/// `−F(x) ∈ N_[l, u](x)`.
///
/// Bounds may be infinite: `l = 0, u = ∞` is the NCP `0 ≤ x ⟂ F(x) ≥ 0`, `l = −∞, u = ∞` an equation; where `l_i = u_i`, x_i is fixed and `F_i` free.
/// F may be undefined somewhere.
#[derive(Debug, Clone)]
#[allow(non_snake_case)]
pub struct Mcp {
    /// F: ℝⁿ → ℝⁿ.
    pub F: Arc<dyn Field>,
    /// l, n; −∞ allowed.
    pub lower: Vec<f64>,
    /// u, n; ∞ allowed.
    pub upper: Vec<f64>,
    /// Where solvers begin, n; its projection on the box is the problem's [`origin`](Problem::origin).
    pub start: Vec<f64>,
}

impl PartialEq for Mcp {
    /// Functions are equal where they are the same expressions, or the same object.
    fn eq(&self, other: &Self) -> bool {
        same(&self.F, &other.F)
            && self.lower == other.lower
            && self.upper == other.upper
            && self.start == other.start
    }
}

#[allow(non_snake_case)]
impl Mcp {
    /// States a problem, validated.
    ///
    /// Errors: a wrong length, a start that is not finite, bounds that are NaN or cross.
    pub fn new(
        F: impl Field + 'static,
        lower: Vec<f64>,
        upper: Vec<f64>,
        start: Vec<f64>,
    ) -> Result<Self, ProblemError> {
        Self::of(Arc::new(F), lower, upper, start)
    }

    /// As [`new`](Self::new), of a function that others have too.
    ///
    /// Errors: likewise.
    pub fn of(
        F: Arc<dyn Field>,
        lower: Vec<f64>,
        upper: Vec<f64>,
        start: Vec<f64>,
    ) -> Result<Self, ProblemError> {
        let problem = Self { F, lower, upper, start };
        problem.validate()?;
        Ok(problem)
    }

    /// The nonlinear complementarity problem `0 ≤ x ⟂ F(x) ≥ 0`.
    ///
    /// Errors: as [`new`](Self::new).
    pub fn ncp(F: impl Field + 'static, start: Vec<f64>) -> Result<Self, ProblemError> {
        let n = F.dim();
        Self::new(F, vec![0.0; n], vec![f64::INFINITY; n], start)
    }

    /// Checks shapes and values; the fields are public, so call it after changing them.
    pub fn validate(&self) -> Result<(), ProblemError> {
        let n = self.F.dim();
        if n == 0 {
            return Err(ProblemError::shape("F", "at least one row", "none"));
        }
        fits(&*self.F)?;
        vector("start", &self.start, n, "rows of F")?;
        bounds([&self.lower, &self.upper], n, "rows of F")
    }

    /// The number of variables n.
    pub fn dim(&self) -> usize {
        self.start.len()
    }

    /// The point of `[l_i, u_i]` nearest to x.
    #[inline]
    pub fn project(&self, i: usize, x: f64) -> f64 {
        x.max(self.lower[i]).min(self.upper[i])
    }

    /// The same problem with `F(x) = M x + q` by its matrix, where F is known to be affine, and whether M and q are exact: the coefficients of F without any
    /// rounding.
    pub fn affine(&self) -> Option<(BoxLcp, bool)> {
        let (matrix, q, exact) = linear(&*self.F)?;
        let n = self.dim();
        let full = n > FEW && 4 * matrix.nnz() >= n * n;
        let matrix = Matrix::from(matrix);
        // What is nearly full is cheaper to factorise as such.
        let dense = if full { matrix.to_dense().map(Matrix::from) } else { None };
        let M = dense.unwrap_or(matrix);
        let problem = BoxLcp { M, q, lower: self.lower.clone(), upper: self.upper.clone() };
        Some((problem, exact))
    }
}

/// Up to this many variables it makes no difference whether a matrix is stored dense.
const FEW: usize = 200;

impl Problem for Mcp {
    type Point = LcpPoint;
    type Gauge = McpGauge;

    fn kind(&self) -> Kind {
        <Self as OfAny>::KIND
    }

    fn unknowns(&self) -> usize {
        self.dim()
    }

    fn asks_functions(&self) -> bool {
        self.F.expressions().is_none()
    }

    fn origin(&self) -> LcpPoint {
        let projected = self.start.iter().enumerate().map(|(i, &x)| self.project(i, x));
        LcpPoint { z: projected.collect() }
    }

    fn validate(&self) -> Result<(), ProblemError> {
        Self::validate(self)
    }

    fn validate_point(&self, point: &LcpPoint) -> Result<(), ProblemError> {
        vector("x", &point.z, self.dim(), "variables")
    }

    fn copy_point(from: &LcpPoint, to: &mut LcpPoint) {
        to.z.clone_from(&from.z);
    }

    fn gauge(&self) -> Result<McpGauge, ProblemError> {
        Ok(McpGauge::new(self))
    }

    fn measure(&self, point: &LcpPoint, gauge: &mut McpGauge) -> Measure {
        gauge.measure(self, point, false)
    }

    fn certify(&self, point: &LcpPoint, gauge: &mut McpGauge) -> Measure {
        gauge.measure(self, point, true)
    }

    fn tidy(&self, point: &mut LcpPoint, gauge: &mut McpGauge, boldly: bool) -> bool {
        gauge.tidy(self, point, boldly)
    }

    /// F(x); NaN where it is not defined.
    fn partner(&self, point: &LcpPoint) -> Vec<f64> {
        let mut f = vec![0.0; self.dim()];
        if !self.F.evaluator().value(&point.z, &mut f) {
            f.iter_mut().filter(|f| !f.is_finite()).for_each(|f| *f = f64::NAN);
        }
        f
    }

    fn evidence(&self, certificate: &Certificate) -> Evidence {
        weigh(self, certificate)
    }

    fn cones(&self) -> Option<ConeSystem> {
        self.system(None)
    }

    fn assembled(&self, unknowns: &[f64]) -> LcpPoint {
        LcpPoint { z: unknowns.to_vec() }
    }
}

impl Judged for Mcp {
    type Status = RowStatus;
    type Counts = RowCounts;

    fn verdict(&self, point: &LcpPoint, gauge: &mut McpGauge, tolerance: f64) -> VerdictOf<Self> {
        gauge.verdict(self, point, tolerance)
    }
}

/// That of the affine problem, where its coefficients are exact; else, of F by expressions, a relaxation in which each term that is not linear lies between its bounds.
impl Exactly for Mcp {
    fn system(&self, wanted: Option<&[bool]>) -> Option<ConeSystem> {
        if let Some((linear, true)) = self.affine() {
            return linear.system(wanted);
        }
        let relaxed = Relaxed {
            field: self.F.expressions()?,
            lower: &self.lower,
            upper: &self.upper,
            silent: vec![false; self.dim()],
            constraints: &[],
            cones: vec![],
        };
        relaxed.system(wanted)
    }

    fn rows(&self) -> usize {
        self.dim()
    }
}

impl Stated for Mcp {
    const STATEMENT: &'static str = "-F(x) in the normal cone of [lower, upper] at x";
    const PARTS: &'static [(&'static str, Shape)] = &[
        ("F", Shape::Expressions),
        ("lower", Shape::Vector),
        ("upper", Shape::Vector),
        ("start", Shape::Vector),
    ];
    const SOLUTION: &'static [&'static str] = &["x", "F"];
    const PARTNER: &'static str = "F";

    fn parts(&self) -> Vec<(&'static str, Part<'_>)> {
        let vectors = [("lower", &self.lower), ("upper", &self.upper), ("start", &self.start)];
        let vectors = vectors.map(|(name, x)| (name, Part::Vector(x)));
        let f = self.F.expressions().map(|f| ("F", Part::Expressions(f)));
        f.into_iter().chain(vectors).collect()
    }

    fn from_parts(parts: &mut dyn Parts) -> Result<Self, ProblemError> {
        let f: Expressions = parts.expressions("F")?;
        let n = f.dim();
        let mut or = |name, default: f64| match parts.has(name) {
            true => parts.vector(name),
            false => Ok(vec![default; n]),
        };
        let (lower, upper) = (or("lower", 0.0)?, or("upper", f64::INFINITY)?);
        let start = or("start", 0.0)?;
        Self::new(f, lower, upper, start)
    }

    fn point_parts<'a>(
        &self,
        point: &'a LcpPoint,
        f: Option<&'a [f64]>,
    ) -> Vec<(&'static str, &'a [f64])> {
        x_and_f(point, f)
    }

    fn point_from_parts<E>(
        mut part: impl FnMut(&'static str) -> Result<Vec<f64>, E>,
    ) -> Result<LcpPoint, E> {
        Ok(LcpPoint { z: part("x")? })
    }

    fn pairs(&self) -> usize {
        self.dim()
    }

    fn equations(&self) -> usize {
        self.dim()
    }

    fn size(&self) -> String {
        let all = || self.lower.iter().zip(&self.upper);
        let count = |of: fn(f64, f64) -> bool| all().filter(|&(&l, &u)| of(l, u)).count();
        let free = count(|l, u| l.is_infinite() && u.is_infinite());
        let two = count(|l, u| l.is_finite() && u.is_finite());
        format!(
            "{}, {free} free, {two} between two bounds, {}",
            plural(self.dim(), "variable"),
            of_jacobian(&*self.F)
        )
    }

    fn nonlinear(&self) -> Option<&Mcp> {
        Some(self)
    }

    fn function(&self) -> Option<&dyn Field> {
        Some(&*self.F)
    }

    fn sizes(&self) -> Vec<(&'static str, usize)> {
        vec![("jacobian_entries", self.F.pattern().len())]
    }
}
