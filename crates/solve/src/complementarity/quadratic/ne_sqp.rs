//! **ne_sqp**: the method NE/SQP of Pang and Gabriel for nonlinear problems.
//!
//! Problem: `l ≤ x ≤ u ⟂ F(x)`. Method: Gauss–Newton directions of the natural residual H that stay inside the box, each by a convex quadratic program that always has a solution
//! ([`Squares`]), with Armijo's rule on `θ = ½‖H‖²`. Fails, and says so, at stationary points of θ that are no solutions; these are many where F is not monotone.
//!
//! References: PangGabriel1993; Acary2018. Cost of a step: a few LU factorisations of the pattern of JFᵀJF.

use nonsmooth_problem::{LcpPoint, Mcp};
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use crate::complementarity::parts::nonlinear::{CHECK_EVERY, Inner, Solve, Squares};
use crate::core::register::{About, Described, Solves};
use crate::core::settings::{Settings, described};
use crate::{SolveError, Solver, Step};

/// The method, without hyperparameters.
#[derive(Debug, Clone, Copy, Default, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields, default)]
pub struct NeSqp {}

impl Settings for NeSqp {}

impl Described for NeSqp {
    const ABOUT: &'static About = &About {
        name: "ne_sqp",
        family: "quadratic",
        solves: Solves::Law,
        summary: "NE/SQP: Gauss-Newton on the natural residual inside the box, by convex quadratic programs",
        needs: &[],
        cites: &["PangGabriel1993", "Acary2018"],
        variants: &[],
        settings: described::<Self>,
    };
}

/// The workspace.
pub struct Work {
    solve: Solve,
    squares: Squares,
}

impl Solver<Mcp> for NeSqp {
    type Work = Work;

    fn work(&self, problem: &Mcp) -> Result<Work, SolveError> {
        Ok(Work { solve: Solve::new(problem), squares: Squares::new(problem.dim()) })
    }

    fn aim(&self, tolerance: f64, work: &mut Work) {
        work.solve.aim(tolerance);
    }

    fn start(&self, _: &Mcp, point: &mut LcpPoint, work: &mut Work) {
        work.solve.begin(point);
    }

    fn step(&self, _: &Mcp, _: &mut LcpPoint, work: &mut Work) -> Step {
        let Work { solve, squares } = work;
        let moved = squares.step(&mut solve.model, &mut solve.at);
        solve.note(moved);
        if moved.moved() { solve.goes_on() } else { solve.ends(moved.why()) }
    }

    fn publish(&self, _: &Mcp, point: &mut LcpPoint, work: &mut Work) {
        work.solve.publish(point);
    }

    fn account(&self, work: &Work) -> Vec<String> {
        work.solve.account(vec![])
    }

    fn check_every(&self, _: &Self::Work) -> usize {
        CHECK_EVERY
    }
}
