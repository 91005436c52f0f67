//! The choice among the solvers of a convex subproblem.

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use super::convex::Convex;
use crate::SolveError;
use crate::contact::form::{Access, Explicit, Frictional, Linearised};
use crate::contact::parts::{Clarabel, Ended, Shape};

/// The solvers of a convex problem over cylinders.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
pub enum CylinderSolver {
    /// Spectral projected gradient: products with W only.
    ProjectedGradient,
    /// Semismooth Newton, which on cylinders is the primal-dual active set method.
    #[default]
    ActiveSet,
    /// Clarabel's interior point, polished by active sets.
    Conic,
}

/// How far to go.
#[derive(Debug, Clone, Copy)]
pub(super) struct Effort {
    /// The relative residual of the subproblem to reach.
    pub(super) tolerance: f64,
    /// Gradient steps, factorisations or conic iterations.
    pub(super) most: usize,
    /// Newton steps after a conic solve.
    pub(super) polish: usize,
}

/// A convex subproblem without a solution.
pub(super) const UNBOUNDED: &str =
    "the convex subproblem has no solution: some impulses gain power without cost";

/// Clarabel on the present subproblem.
///
/// It minimises with the symmetric part of W; `(W − W_s) r` of the last impulses stands on the right-hand side.
pub(super) struct Conic<const D: usize> {
    solver: Clarabel<D>,
    symmetric: bool,
    /// `(W − W_s) r` of the last solve, and the right-hand side.
    skew: Vec<f64>,
    b: Vec<f64>,
}

impl<const D: usize> Conic<D> {
    pub(super) fn new<P: Explicit<D> + Frictional<D>>(
        problem: &P,
        convex: &Convex<P, D>,
        shape: Shape,
    ) -> Result<Self, SolveError> {
        let model = problem.model(&convex.state);
        let m = convex.q.len();
        Ok(Self {
            solver: Clarabel::new(&model, problem.mu(), convex.mean_unit(), shape)?,
            symmetric: model.symmetric,
            skew: vec![0.0; m],
            b: vec![0.0; m],
        })
    }

    pub(super) fn refill<P: Explicit<D> + Frictional<D>>(
        &mut self,
        problem: &P,
        convex: &Convex<P, D>,
    ) -> Result<(), SolveError> {
        let model = problem.model(&convex.state);
        self.solver.refill(&model, problem.mu(), convex.mean_unit())?;
        self.symmetric = model.symmetric;
        for x in [&mut self.skew, &mut self.b] {
            x.clear();
            x.resize(convex.q.len(), 0.0);
        }
        Ok(())
    }

    /// Solves, polishes, and leaves `convex.y` at the new `r`; the residual reached.
    pub(super) fn solve<P: Linearised<D> + Frictional<D> + Explicit<D>>(
        &mut self,
        problem: &P,
        convex: &mut Convex<P, D>,
        r: &mut [f64],
        theta: &[f64],
        effort: Effort,
    ) -> Result<f64, &'static str> {
        for (c, shift) in convex.shift.iter().enumerate() {
            for i in D * c..D * c + D {
                self.b[i] = convex.q[i] + self.skew[i];
            }
            self.b[D * c] += shift;
        }
        let speed = convex.scale / (theta.len().max(problem.mu().len()).max(1) as f64).sqrt();
        // The velocities of a conic solve are right to about the root of its tolerance.
        let tolerance = (effort.tolerance * effort.tolerance).clamp(1e-11, 1e-6);
        let most = u32::try_from(effort.most).unwrap_or(u32::MAX);
        match self.solver.solve(&self.b, theta, speed, tolerance, most, r) {
            Ended::Unbounded => return Err(UNBOUNDED),
            Ended::Accurate | Ended::Roughly | Ended::Failed => {}
        }
        convex.restrict(r);
        convex.evaluate(problem, r);
        if !self.symmetric {
            // (W − W_s) r = (y − q − shift) − W_s r.
            self.solver.product(&mut self.skew);
            for (c, shift) in convex.shift.iter().enumerate() {
                for i in D * c..D * c + D {
                    self.skew[i] = convex.y[i] - convex.q[i] - self.skew[i];
                }
                self.skew[D * c] -= shift;
            }
        }
        Ok(convex.newton(problem, r, effort.tolerance, effort.polish))
    }
}

/// A convex subproblem over cylinders (or halves of them) with the solver chosen.
pub(super) struct Cylinders<P: Linearised<D> + Frictional<D> + Explicit<D>, const D: usize> {
    pub(super) convex: Convex<P, D>,
    conic: Option<Conic<D>>,
}

impl<P: Linearised<D> + Frictional<D> + Explicit<D>, const D: usize> Cylinders<P, D> {
    pub(super) fn new(problem: &P, choice: CylinderSolver) -> Result<Self, SolveError> {
        let access = match choice {
            CylinderSolver::ProjectedGradient => Access::Products,
            CylinderSolver::ActiveSet | CylinderSolver::Conic => Access::Newton,
        };
        let convex = Convex::new(problem, access)?;
        let conic = (choice == CylinderSolver::Conic)
            .then(|| Conic::new(problem, &convex, Shape::Cylinder))
            .transpose()?;
        Ok(Self { convex, conic })
    }

    pub(super) fn refill(&mut self, problem: &P) -> Result<(), SolveError> {
        self.convex.refill(problem)?;
        if let Some(conic) = &mut self.conic {
            conic.refill(problem, &self.convex)?;
        }
        Ok(())
    }

    /// Solves the subproblem that `convex.sets` states from `r`, whose `y` is known, to which it belongs afterwards.
    pub(super) fn solve(
        &mut self,
        problem: &P,
        r: &mut [f64],
        theta: &[f64],
        choice: CylinderSolver,
        effort: Effort,
    ) -> Result<f64, &'static str> {
        let Self { convex, conic } = self;
        match (choice, conic) {
            (CylinderSolver::Conic, Some(conic)) => conic.solve(problem, convex, r, theta, effort),
            (CylinderSolver::ProjectedGradient, _) => {
                Ok(convex.gradient(problem, r, effort.tolerance, effort.most))
            }
            _ => Ok(convex.newton(problem, r, effort.tolerance, effort.most)),
        }
    }
}
