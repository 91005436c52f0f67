//! The contract of a solver.

use std::borrow::Cow;

use nonsmooth_problem::Problem;
use nonsmooth_problem::check::Certificate;

use crate::SolveError;
use crate::core::trace::Trace;

/// An iterative method for problems of type `P`. The implementing struct *is* the method's hyperparameters.
///
/// A solver advances a point; it does not count, time, print, judge or decide to stop. Those belong to
/// [`Driver`](crate::Driver), the only loop:
///
/// ```text
/// work ── start ──┬─ step ─┬─ publish ─ (the judge) ─┐
///                 └────────┴────────────────────────┘
/// ```
pub trait Solver<P: Problem>: Send + Sync {
    /// Everything that the method keeps between steps; survives between solves.
    type Work: Send;

    /// Allocates and prepares the workspace for `problem`.
    ///
    /// Errors: the problem lacks something that the method needs (an invertible M, for instance).
    fn work(&self, problem: &P) -> Result<Self::Work, SolveError>;

    /// Prepares an existing workspace for another problem; allocates nothing where the shape is the same.
    fn refill(&self, problem: &P, work: &mut Self::Work) -> Result<(), SolveError> {
        *work = self.work(problem)?;
        Ok(())
    }

    /// Learns the tolerance that the judge will ask for, before the start: a method may choose its means by it.
    fn aim(&self, _tolerance: f64, _work: &mut Self::Work) {}

    /// Takes `point` as the starting point. Called once per solve, after `work` or `refill`.
    fn start(&self, problem: &P, point: &mut P::Point, work: &mut Self::Work);

    /// One iteration: improves `point` (or the iterate in `work`) and says how far off it is.
    fn step(&self, problem: &P, point: &mut P::Point, work: &mut Self::Work) -> Step;

    /// Brings `point` up to date with `work`. Called before the point is judged or returned; methods whose
    /// iterate lives in the workspace (velocities, a reduced problem) write it out here.
    fn publish(&self, _problem: &P, _point: &mut P::Point, _work: &mut Self::Work) {}

    /// Begins a record of iterations, if `on`: see [`trace`](Self::trace). Called once per solve, before the start.
    fn record(&self, _on: bool, _work: &mut Self::Work) {}

    /// The record of the last solve, of methods that keep one.
    fn trace(&self, _work: &Self::Work) -> Trace {
        Trace::None
    }

    /// What the last solve did, in a few sentences for its user; nothing where there is nothing to tell.
    fn account(&self, _work: &Self::Work) -> Vec<String> {
        vec![]
    }

    /// What the last step claimed is proved, but by so little that a point may pass the check all the same. Whether the method goes on to look for one, and
    /// claims no such thing again.
    fn go_on(&self, _problem: &P, _point: &mut P::Point, _work: &mut Self::Work) -> bool {
        false
    }

    /// Whether the latest point is the answer even where an earlier one has the smaller residual: of methods that solve another problem than the judge's,
    /// whose answer must not be mixed with the start.
    fn latest(&self) -> bool {
        false
    }

    /// The number of steps between two visits of the judge, unless the estimate calls it earlier.
    /// A judgement costs about one product with W. It is asked after each step.
    fn check_every(&self, _: &Self::Work) -> usize {
        1
    }
}

/// What a step says of itself. All of it is a claim; the judge decides.
#[derive(Debug, Clone, PartialEq)]
pub enum Step {
    /// Go on. `estimate` is the method's own cheap estimate of the relative residual, up to a factor that the
    /// driver calibrates at each judgement; NaN where it has none.
    Continue {
        /// Of the relative residual, by the method's own means; the loop calibrates it by the judge.
        estimate: f64,
    },
    /// The method has finished and cannot improve the point.
    Done,
    /// The method cannot go on, for the reason given.
    Stuck(Cow<'static, str>),
    /// The method claims that there is no solution.
    NoSolution(Certificate),
}
