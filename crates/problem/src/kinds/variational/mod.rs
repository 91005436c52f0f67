//! Variational inequalities over simple convex sets, and their judge.
//!
//! | kind | statement |
//! | --- | --- |
//! | [`Vi`] | `−F(x) ∈ N_X(x)`, X a box, a polyhedron, a ball, a second-order cone or a product of these |

mod constraints;
mod judge;
pub mod planted;
mod set;
#[cfg(test)]
mod tests;

use std::sync::Arc;

pub use constraints::Constraints;
pub use judge::{Held, SetCounts, SetStatus, ViGauge};
pub use set::Set;

use super::complementarity::stated::{Part, Parts, Shape, Stated, of_jacobian, plural, x_and_f};
use crate::check::proof::Exactly;
use crate::check::{Certificate, ConeSystem, Evidence, Judged, Measure, Relaxed, VerdictOf, weigh};
use crate::error::vector;
use crate::field::{Expressions, Field, fits, same};
use crate::{Kind, LcpPoint, Mcp, OfAny, Problem, ProblemError};

/// The variational inequality: find x ∈ X with `F(x)ᵀ(y − x) ≥ 0` for all y ∈ X; that is `x = P_X(x − γ F(x))` for any γ > 0.
///
/// F may be undefined somewhere. Over a box this is an [`Mcp`](crate::Mcp).
#[derive(Debug, Clone)]
#[allow(non_snake_case)]
pub struct Vi {
    /// F: ℝⁿ → ℝⁿ.
    pub F: Arc<dyn Field>,
    /// X ⊂ ℝⁿ.
    pub set: Set,
    /// Where solvers begin, n; they begin at its projection on X.
    pub start: Vec<f64>,
}

impl PartialEq for Vi {
    /// Functions are equal where they are the same expressions, or the same object.
    fn eq(&self, other: &Self) -> bool {
        same(&self.F, &other.F) && self.set == other.set && self.start == other.start
    }
}

#[allow(non_snake_case)]
impl Vi {
    /// States a problem, validated.
    ///
    /// ```
    /// use nonsmooth_problem::check::Judged;
    /// use nonsmooth_problem::field::Expressions;
    /// use nonsmooth_problem::{LcpPoint, Set, Vi};
    ///
    /// // The point of the unit disk nearest to (3, 4): F(x) = x − (3, 4).
    /// let field = Expressions::parse(&["x1 - 3".into(), "x2 - 4".into()], &[])?;
    /// let disk = Set::Ball { centre: vec![0.0; 2], radius: 1.0 };
    /// let problem = Vi::new(field, disk, vec![0.0; 2])?;
    /// assert!(problem.judge(&LcpPoint { z: vec![0.6, 0.8] }, 1e-12)?.solved);
    /// # Ok::<(), Box<dyn std::error::Error>>(())
    /// ```
    ///
    /// Errors: a set at fault, F or a start of another dimension than the set, a start that is not finite.
    pub fn new(F: impl Field + 'static, set: Set, start: Vec<f64>) -> Result<Self, ProblemError> {
        Self::of(Arc::new(F), set, start)
    }

    /// As [`new`](Self::new), of a function that others have too.
    ///
    /// Errors: likewise.
    pub fn of(F: Arc<dyn Field>, set: Set, start: Vec<f64>) -> Result<Self, ProblemError> {
        let problem = Self { F, set, start };
        problem.validate()?;
        Ok(problem)
    }

    /// Checks shapes and values; the fields are public, so call it after changing them.
    pub fn validate(&self) -> Result<(), ProblemError> {
        self.set.validate()?;
        let (n, rows) = (self.set.dim(), self.F.dim());
        if rows != n {
            let expected = format!("{n} rows (variables of the set)");
            return Err(ProblemError::shape("F", expected, rows.to_string()));
        }
        fits(&*self.F)?;
        vector("start", &self.start, n, "variables of the set")
    }

    /// The number of variables n.
    pub fn dim(&self) -> usize {
        self.start.len()
    }

    /// The same problem as a mixed complementarity problem, where the set is a box or a product of boxes.
    pub fn mcp(&self) -> Option<Mcp> {
        let (lower, upper) = self.set.bounds()?;
        Some(Mcp { F: self.F.clone(), lower, upper, start: self.start.clone() })
    }
}

/// The most entries of a polyhedron's rows, zeros included: 400 MB.
const DENSE: usize = 50_000_000;

impl Problem for Vi {
    type Point = LcpPoint;
    type Gauge = ViGauge;

    fn kind(&self) -> Kind {
        <Self as OfAny>::KIND
    }

    fn unknowns(&self) -> usize {
        self.dim()
    }

    /// With the rows of polyhedra, on which the judge projects.
    fn burden(&self) -> usize {
        let rows = |set: &Set| match set {
            Set::Polyhedron { A, C, .. } => A.nrows() + C.nrows(),
            _ => 0,
        };
        self.dim() + self.set.parts().into_iter().map(|(_, set)| rows(set)).sum::<usize>()
    }

    fn asks_functions(&self) -> bool {
        self.F.expressions().is_none()
    }

    fn origin(&self) -> LcpPoint {
        LcpPoint { z: self.start.clone() }
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

    /// Errors: polyhedra that are too large to be projected on.
    fn gauge(&self) -> Result<ViGauge, ProblemError> {
        let entries = |set: &Set| match set {
            Set::Polyhedron { A, C, .. } => (A.nrows() + C.nrows()).saturating_mul(A.ncols()),
            _ => 0,
        };
        let found = self.set.parts().into_iter().map(|(_, set)| entries(set)).max().unwrap_or(0);
        if found > DENSE {
            let expected = format!(
                "at most {DENSE} as the rows times the variables of a polyhedron, on which the judge projects"
            );
            return Err(ProblemError::value("set", expected, found));
        }
        Ok(ViGauge::new(self))
    }

    fn measure(&self, point: &LcpPoint, gauge: &mut ViGauge) -> Measure {
        gauge.measure(self, point, false)
    }

    fn certify(&self, point: &LcpPoint, gauge: &mut ViGauge) -> Measure {
        gauge.measure(self, point, true)
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

impl Judged for Vi {
    type Status = SetStatus;
    type Counts = SetCounts;

    fn verdict(&self, point: &LcpPoint, gauge: &mut ViGauge, tolerance: f64) -> VerdictOf<Self> {
        gauge.verdict(self, point, tolerance)
    }
}

/// Over a box that of the complementarity problem. Else, of F by expressions, that of the problem with multipliers of the constraints that are no bounds, whose rows come after F's; balls and cones are
/// relaxed: of a ball its box, of a cone `x_1 ≥ |x_j|`, `F_1 ≥ |F_j|`.
impl Exactly for Vi {
    fn system(&self, wanted: Option<&[bool]>) -> Option<ConeSystem> {
        if let Some(mcp) = self.mcp() {
            return mcp.system(wanted);
        }
        let Constraints { lower, upper, others } = self.set.constraints();
        let mut silent = vec![false; self.dim()];
        let mut cones = vec![];
        for (first, set) in self.set.parts() {
            let all = first..first + set.dim();
            match set {
                Set::Ball { .. } => silent[all].fill(true),
                Set::SecondOrderCone { dimension } if *dimension > 1 => {
                    silent[all.clone()].fill(true);
                    cones.push(all);
                }
                _ => {}
            }
        }
        let (field, constraints) = (self.F.expressions()?, &others[..]);
        Relaxed { field, lower: &lower, upper: &upper, silent, constraints, cones }.system(wanted)
    }

    fn rows(&self) -> usize {
        // A polyhedron of n variables may have one bound a row: only counting tells.
        match self.set.bounds() {
            Some(_) => self.dim(),
            None => self.dim() + self.set.constraints().others.len(),
        }
    }
}

impl Stated for Vi {
    const STATEMENT: &'static str = "F(x)'(y - x) >= 0 for all y in the set, x in the set";
    const PARTS: &'static [(&'static str, Shape)] =
        &[("F", Shape::Expressions), ("set", Shape::Set), ("start", Shape::Vector)];
    const SOLUTION: &'static [&'static str] = &["x", "F"];
    const PARTNER: &'static str = "F";

    fn parts(&self) -> Vec<(&'static str, Part<'_>)> {
        let f = self.F.expressions().map(|f| ("F", Part::Expressions(f)));
        let others = [("start", Part::Vector(&self.start)), ("set", Part::Set(&self.set))];
        f.into_iter().chain(others).collect()
    }

    fn from_parts(parts: &mut dyn Parts) -> Result<Self, ProblemError> {
        let f: Expressions = parts.expressions("F")?;
        let n = f.dim();
        let set = parts.set("set", n)?;
        let start = if parts.has("start") { parts.vector("start")? } else { vec![0.0; n] };
        Self::new(f, set, start)
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
        let (variables, jacobian) = (plural(self.dim(), "variable"), of_jacobian(&*self.F));
        format!("{variables} in {}, {jacobian}", self.set)
    }

    fn function(&self) -> Option<&dyn Field> {
        Some(&*self.F)
    }

    fn sizes(&self) -> Vec<(&'static str, usize)> {
        vec![
            ("jacobian_entries", self.F.pattern().len()),
            ("parts_of_the_set", self.set.parts().len()),
        ]
    }
}
