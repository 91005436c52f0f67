//! A solver whose type is forgotten.

use std::sync::Arc;

use nonsmooth_problem::Problem;

use crate::core::error::SolveError;
use crate::core::solver::{Solver, Step};
use crate::core::trace::Trace;

/// A solver of problems of type `P` whose type, and that of its workspace, are forgotten: what the registry makes, and what reformulations and outer loops
/// have inside. Itself a solver. One virtual call a step; what a step does inside, contact by contact, is compiled for the solver's type.
pub struct Boxed<P: Problem>(Arc<dyn Erased<P>>);

impl<P: Problem> Boxed<P> {
    /// Forgets the type of `solver`.
    pub fn new<S>(solver: S) -> Self
    where
        S: Solver<P, Work: 'static> + 'static,
    {
        Self(Arc::new(solver))
    }
}

/// What a solver is asked before there is a workspace.
trait Erased<P: Problem>: Send + Sync {
    fn work(self: Arc<Self>, problem: &P) -> Result<Box<dyn AtWork<P>>, SolveError>;
    fn latest(&self) -> bool;
}

/// A solver with its workspace. One object, so that a step need not ask whose workspace it was given.
trait AtWork<P: Problem>: Send {
    fn refill(&mut self, problem: &P) -> Result<(), SolveError>;
    fn aim(&mut self, tolerance: f64);
    fn start(&mut self, problem: &P, point: &mut P::Point);
    fn step(&mut self, problem: &P, point: &mut P::Point) -> Step;
    fn publish(&mut self, problem: &P, point: &mut P::Point);
    fn record(&mut self, on: bool);
    fn trace(&self) -> Trace;
    fn account(&self) -> Vec<String>;
    fn check_every(&self) -> usize;
    fn go_on(&mut self, problem: &P, point: &mut P::Point) -> bool;
}

/// What [`AtWork`] is of a solver S.
struct Working<S, W> {
    solver: Arc<S>,
    work: W,
}

impl<P: Problem, S: Solver<P, Work: 'static> + 'static> Erased<P> for S {
    fn work(self: Arc<Self>, problem: &P) -> Result<Box<dyn AtWork<P>>, SolveError> {
        let work = Solver::work(&*self, problem)?;
        Ok(Box::new(Working { solver: self, work }))
    }

    fn latest(&self) -> bool {
        Solver::latest(self)
    }
}

impl<P: Problem, S: Solver<P>> AtWork<P> for Working<S, S::Work> {
    fn refill(&mut self, problem: &P) -> Result<(), SolveError> {
        self.solver.refill(problem, &mut self.work)
    }

    fn aim(&mut self, tolerance: f64) {
        self.solver.aim(tolerance, &mut self.work);
    }

    fn start(&mut self, problem: &P, point: &mut P::Point) {
        self.solver.start(problem, point, &mut self.work);
    }

    fn step(&mut self, problem: &P, point: &mut P::Point) -> Step {
        self.solver.step(problem, point, &mut self.work)
    }

    fn publish(&mut self, problem: &P, point: &mut P::Point) {
        self.solver.publish(problem, point, &mut self.work);
    }

    fn record(&mut self, on: bool) {
        self.solver.record(on, &mut self.work);
    }

    fn trace(&self) -> Trace {
        self.solver.trace(&self.work)
    }

    fn account(&self) -> Vec<String> {
        self.solver.account(&self.work)
    }

    fn check_every(&self) -> usize {
        self.solver.check_every(&self.work)
    }

    fn go_on(&mut self, problem: &P, point: &mut P::Point) -> bool {
        self.solver.go_on(problem, point, &mut self.work)
    }
}

/// The workspace of a [`Boxed`] solver.
pub struct BoxedWork<P: Problem>(Box<dyn AtWork<P>>);

impl<P: Problem> Solver<P> for Boxed<P> {
    type Work = BoxedWork<P>;

    fn work(&self, problem: &P) -> Result<Self::Work, SolveError> {
        self.0.clone().work(problem).map(BoxedWork)
    }

    fn refill(&self, problem: &P, work: &mut Self::Work) -> Result<(), SolveError> {
        work.0.refill(problem)
    }

    fn aim(&self, tolerance: f64, work: &mut Self::Work) {
        work.0.aim(tolerance);
    }

    fn start(&self, problem: &P, point: &mut P::Point, work: &mut Self::Work) {
        work.0.start(problem, point);
    }

    fn step(&self, problem: &P, point: &mut P::Point, work: &mut Self::Work) -> Step {
        work.0.step(problem, point)
    }

    fn publish(&self, problem: &P, point: &mut P::Point, work: &mut Self::Work) {
        work.0.publish(problem, point);
    }

    fn record(&self, on: bool, work: &mut Self::Work) {
        work.0.record(on);
    }

    fn trace(&self, work: &Self::Work) -> Trace {
        work.0.trace()
    }

    fn account(&self, work: &Self::Work) -> Vec<String> {
        work.0.account()
    }

    fn go_on(&self, problem: &P, point: &mut P::Point, work: &mut Self::Work) -> bool {
        work.0.go_on(problem, point)
    }

    fn latest(&self) -> bool {
        self.0.latest()
    }

    fn check_every(&self, work: &Self::Work) -> usize {
        work.0.check_every()
    }
}
