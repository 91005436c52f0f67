//! What every solver of nonlinear problems has in its workspace, and says of itself.

use nonsmooth_problem::{LcpPoint, Mcp};

use super::{Iterate, Moved};
use crate::Step;
use crate::complementarity::form::Model;

/// The model, the iterate, and what is asked of it.
pub struct Solve {
    /// The problem.
    pub model: Model,
    /// Where the solve is.
    pub at: Iterate,
    tolerance: f64,
    /// Steps that moved: by Newton's direction, of a regularised matrix, along the gradient.
    moves: [usize; 3],
    /// Starts that came after the first.
    pub restarts: usize,
}

impl Solve {
    /// Of a problem.
    pub fn new(problem: &Mcp) -> Self {
        let at = Iterate::new(problem.dim());
        Self { model: Model::new(problem), at, tolerance: 0.0, moves: [0; 3], restarts: 0 }
    }

    /// Learns what residual is asked for.
    pub fn aim(&mut self, tolerance: f64) {
        self.tolerance = tolerance;
    }

    /// Begins at a point, or as near as F is defined.
    pub fn begin(&mut self, point: &LcpPoint) {
        (self.moves, self.restarts, self.model.evaluations) = ([0; 3], 0, [0; 2]);
        self.at.begin(&mut self.model, &point.z);
    }

    /// The best point so far.
    pub fn publish(&self, point: &mut LcpPoint) {
        point.z.copy_from_slice(&self.at.best);
    }

    /// Whether the residual is what is asked for.
    pub fn is_done(&self) -> bool {
        self.at.least <= self.tolerance
    }

    /// Notes what a step came to.
    pub fn note(&mut self, moved: Moved) {
        let k = match moved {
            Moved::Newton => 0,
            Moved::Regularised => 1,
            Moved::Gradient => 2,
            Moved::Stuck | Moved::Undefined => return,
        };
        self.moves[k] += 1;
    }

    /// Where a solve goes on.
    pub fn goes_on(&self) -> Step {
        let own = self.model.lambda() == 0.0;
        let estimate = if own { self.at.residual.max(self.at.least) } else { f64::NAN };
        Step::Continue { estimate }
    }

    /// Where it has no way to go on: done if the residual is what is asked for.
    pub fn ends(&self, why: &'static str) -> Step {
        if self.is_done() { Step::Done } else { Step::Stuck(why.into()) }
    }

    /// The account.
    pub fn account(&self, more: Vec<String>) -> Vec<String> {
        let [newton, regularised, gradient] = self.moves;
        let [values, jacobians] = self.model.evaluations;
        let mut said = vec![format!(
            "steps: Newton {newton}, regularised {regularised}, gradient {gradient}; F evaluated {values} times, its Jacobian {jacobians} times"
        )];
        if self.restarts > 0 {
            said.push(format!("began again {} times", self.restarts));
        }
        said.extend(more);
        said
    }
}

/// What is said where F has no value.
pub const UNDEFINED: &str =
    "F or its Jacobian is not defined at the start, nor near it inside the bounds";
/// What is said where the merit has a stationary point.
pub const STATIONARY: &str =
    "no direction decreases the merit: a stationary point that is no solution";
/// Steps between two visits of the judge that the residual does not ask for.
pub const CHECK_EVERY: usize = 500;
