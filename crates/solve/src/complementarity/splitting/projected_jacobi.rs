//! **Projected Jacobi**: every variable takes one step, all from the same w.
//!
//! Problem: `−w_i ∈ N_[l_i, u_i](z_i)`, `w = M z + q`; an LCP is `l = 0, u = ∞`.
//!
//! Method: `z ← P(z − ω D⁻¹ (q + M z))`, D the diagonal of M, P the projection on `[l, u]`.
//!
//! References: Acary2018 (11); CottlePangStone2009, chapter 5.
//!
//! Cost of a step: one product with M. Storage: w and D.
//! Fails: needs a positive diagonal; converges for ω = 1 where M is an H-matrix with positive diagonal, else only for ω small enough where M is symmetric
//! positive definite.

use nonsmooth_linalg::Matrix;
use nonsmooth_problem::LcpPoint;
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use crate::complementarity::form::{Bounded, system};
use crate::core::ranges::{at_least, below};
use crate::core::register::{About, Described, Solves};
use crate::core::settings::{Settings, described};
use crate::{SolveError, Solver, Step};

/// All variables move at once, so the step is shorter than in a sweep.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields, default)]
pub struct ProjectedJacobi {
    /// Relaxation: the step in units of 1/M_ii, in (0, 2).
    pub omega: f64,
    /// Steps between two evaluations of the true residual, unless the estimate asks for one earlier.
    pub check_every: usize,
}

impl Default for ProjectedJacobi {
    fn default() -> Self {
        Self { omega: 1.0, check_every: 50 }
    }
}

impl Settings for ProjectedJacobi {
    fn validate(&self) -> Result<(), String> {
        below("omega", self.omega, 2.0)?;
        at_least("check_every", self.check_every, 1)
    }
}

impl Described for ProjectedJacobi {
    const ABOUT: &'static About = &About {
        name: "projected_jacobi",
        family: "splitting",
        solves: Solves::Law,
        summary: "projected Jacobi: one projected step of every variable at once",
        needs: &["a positive diagonal of M"],
        cites: &["Acary2018", "CottlePangStone2009"],
        variants: &["omega=0.7"],
        settings: described::<Self>,
    };
}

/// The workspace: w and the diagonal.
#[derive(Debug, Clone, Default)]
pub struct JacobiWork {
    w: Vec<f64>,
    diagonal: Vec<f64>,
    scale: f64,
}

impl<P: Bounded> Solver<P> for ProjectedJacobi {
    type Work = JacobiWork;

    fn work(&self, problem: &P) -> Result<JacobiWork, SolveError> {
        let mut work = JacobiWork::default();
        self.refill(problem, &mut work)?;
        Ok(work)
    }

    fn refill(&self, problem: &P, work: &mut JacobiWork) -> Result<(), SolveError> {
        let system = problem.system()?;
        let JacobiWork { w, diagonal, scale } = work;
        diagonal.clear();
        match system.matrix {
            Matrix::Dense(a) => diagonal.extend((0..system.dim()).map(|i| a[(i, i)])),
            Matrix::Sparse(a) => diagonal.extend((0..system.dim()).map(|i| a.get(i, i))),
            Matrix::Operator(a) => diagonal.extend(a.diagonal().ok_or_else(|| {
                SolveError::needs("the diagonal of M", "an operator without one")
            })?),
        }
        if let Some(i) = diagonal.iter().position(|d| d.is_nan() || *d <= 0.0) {
            let found = format!("M[{i}, {i}] = {}", diagonal[i]);
            return Err(SolveError::needs("a positive diagonal of M", found));
        }
        w.resize(system.dim(), 0.0);
        *scale = system.scale();
        Ok(())
    }

    fn start(&self, problem: &P, point: &mut LcpPoint, _: &mut JacobiWork) {
        let bounds = system(problem).bounds;
        point.z.iter_mut().enumerate().for_each(|(i, z)| *z = bounds.project(i, *z));
    }

    fn step(&self, problem: &P, point: &mut LcpPoint, work: &mut JacobiWork) -> Step {
        let system = system(problem);
        system.matrix.mul(&point.z, &mut work.w);
        let mut moved = 0.0;
        for (i, z) in point.z.iter_mut().enumerate() {
            let w = work.w[i] + system.q[i];
            let new = system.bounds.project(i, *z - self.omega / work.diagonal[i] * w);
            moved += (work.diagonal[i] * (new - *z)).powi(2);
            *z = new;
        }
        Step::Continue { estimate: moved.sqrt() / (work.scale * self.omega) }
    }

    fn check_every(&self, _: &Self::Work) -> usize {
        self.check_every
    }
}
