//! **qpcomp**: the method QPCOMP of Billups and Ferris: NE/SQP with proximal problems to leave where it stalls.
//!
//! Problem: `l ≤ x ≤ u ⟂ F(x)`. Method: steps of NE/SQP, that is Gauss–Newton directions of the natural residual inside the box by convex quadratic programs
//! ([`Squares`]). Where `θ = ½‖H‖²` stalls above zero, proximal problems `F(x) + λ(x − y)` with moving centres y lead away
//! ([`Escape`](crate::complementarity::parts::nonlinear::Escape)); escapes are finite where F is pseudomonotone at a solution.
//!
//! References: BillupsFerris1997; PangGabriel1993; Acary2018. Cost of a step: a few LU factorisations of the pattern of JFᵀJF. Fails: where no λ helps; escapes may be long.

use nonsmooth_problem::{LcpPoint, Mcp};
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use super::inner::Work;
use crate::complementarity::parts::nonlinear::{CHECK_EVERY, Solve, Squares};
use crate::core::register::{About, Described, Solves};
use crate::core::settings::{Settings, described};
use crate::{SolveError, Solver, Step};

/// The hyperparameters.
#[derive(Debug, Clone, Copy, Default, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields, default)]
pub struct Qpcomp {
    /// Whether projected Newton steps that look for the active set come first; the published method has none.
    pub crash: bool,
}

impl Settings for Qpcomp {}

impl Described for Qpcomp {
    const ABOUT: &'static About = &About {
        name: "qpcomp",
        family: "proximal",
        solves: Solves::Law,
        summary: "NE/SQP, with proximal problems to leave where it stalls",
        needs: &[],
        cites: &["BillupsFerris1997", "PangGabriel1993", "Acary2018"],
        variants: &["crash=true"],
        settings: described::<Self>,
    };
}

impl Solver<Mcp> for Qpcomp {
    type Work = Work<Squares>;

    fn work(&self, problem: &Mcp) -> Result<Self::Work, SolveError> {
        let solve = Solve::new(problem);
        Ok(Work::new(solve, Squares::new(problem.dim())))
    }

    fn aim(&self, tolerance: f64, work: &mut Self::Work) {
        work.solve.aim(tolerance);
    }

    fn start(&self, _: &Mcp, point: &mut LcpPoint, work: &mut Self::Work) {
        work.begin(point, self.crash);
    }

    fn step(&self, _: &Mcp, _: &mut LcpPoint, work: &mut Self::Work) -> Step {
        work.step()
    }

    fn publish(&self, _: &Mcp, point: &mut LcpPoint, work: &mut Self::Work) {
        work.solve.publish(point);
    }

    fn account(&self, work: &Self::Work) -> Vec<String> {
        work.account()
    }

    fn check_every(&self) -> usize {
        CHECK_EVERY
    }
}
