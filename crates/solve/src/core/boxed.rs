//! A solver whose type is forgotten.

use std::any::Any;

use nonsmooth_problem::Problem;

use crate::core::error::SolveError;
use crate::core::solver::{Solver, Step};
use crate::core::trace::Trace;

/// A solver of problems of type `P` whose type, and that of its workspace, are forgotten: what the registry makes, and what reformulations and outer loops
/// have inside. Itself a solver. One virtual call a step; what a step does inside, contact by contact, is compiled for the solver's type.
pub struct Boxed<P: Problem>(Box<dyn Erased<P>>);

impl<P: Problem> Boxed<P> {
    /// Forgets the type of `solver`.
    pub fn new<S>(solver: S) -> Self
    where
        S: Solver<P, Work: 'static> + 'static,
    {
        Self(Box::new(solver))
    }
}

/// [`Solver`] with a workspace of any type.
trait Erased<P: Problem>: Send {
    fn work(&self, problem: &P) -> Result<Box<dyn Any + Send>, SolveError>;
    fn refill(&self, problem: &P, work: &mut dyn Any) -> Result<(), SolveError>;
    fn aim(&self, tolerance: f64, work: &mut dyn Any);
    fn start(&self, problem: &P, point: &mut P::Point, work: &mut dyn Any);
    fn step(&self, problem: &P, point: &mut P::Point, work: &mut dyn Any) -> Step;
    fn publish(&self, problem: &P, point: &mut P::Point, work: &mut dyn Any);
    fn record(&self, on: bool, work: &mut dyn Any);
    fn trace(&self, work: &dyn Any) -> Trace;
    fn account(&self, work: &dyn Any) -> Vec<String>;
    fn latest(&self) -> bool;
    fn check_every(&self) -> usize;
}

/// Why a workspace is of the solver's own type.
const OWN: &str = "a boxed solver is given the workspace that it made";

impl<P: Problem, S: Solver<P, Work: 'static>> Erased<P> for S {
    fn work(&self, problem: &P) -> Result<Box<dyn Any + Send>, SolveError> {
        Ok(Box::new(Solver::work(self, problem)?))
    }

    fn refill(&self, problem: &P, work: &mut dyn Any) -> Result<(), SolveError> {
        Solver::refill(self, problem, work.downcast_mut().expect(OWN))
    }

    fn aim(&self, tolerance: f64, work: &mut dyn Any) {
        Solver::aim(self, tolerance, work.downcast_mut().expect(OWN));
    }

    fn start(&self, problem: &P, point: &mut P::Point, work: &mut dyn Any) {
        Solver::start(self, problem, point, work.downcast_mut().expect(OWN));
    }

    fn step(&self, problem: &P, point: &mut P::Point, work: &mut dyn Any) -> Step {
        Solver::step(self, problem, point, work.downcast_mut().expect(OWN))
    }

    fn publish(&self, problem: &P, point: &mut P::Point, work: &mut dyn Any) {
        Solver::publish(self, problem, point, work.downcast_mut().expect(OWN));
    }

    fn record(&self, on: bool, work: &mut dyn Any) {
        Solver::record(self, on, work.downcast_mut().expect(OWN));
    }

    fn trace(&self, work: &dyn Any) -> Trace {
        Solver::trace(self, work.downcast_ref().expect(OWN))
    }

    fn account(&self, work: &dyn Any) -> Vec<String> {
        Solver::account(self, work.downcast_ref().expect(OWN))
    }

    fn latest(&self) -> bool {
        Solver::latest(self)
    }

    fn check_every(&self) -> usize {
        Solver::check_every(self)
    }
}

impl<P: Problem> Solver<P> for Boxed<P> {
    type Work = Box<dyn Any + Send>;

    fn work(&self, problem: &P) -> Result<Self::Work, SolveError> {
        self.0.work(problem)
    }

    fn refill(&self, problem: &P, work: &mut Self::Work) -> Result<(), SolveError> {
        self.0.refill(problem, &mut **work)
    }

    fn aim(&self, tolerance: f64, work: &mut Self::Work) {
        self.0.aim(tolerance, &mut **work);
    }

    fn start(&self, problem: &P, point: &mut P::Point, work: &mut Self::Work) {
        self.0.start(problem, point, &mut **work);
    }

    fn step(&self, problem: &P, point: &mut P::Point, work: &mut Self::Work) -> Step {
        self.0.step(problem, point, &mut **work)
    }

    fn publish(&self, problem: &P, point: &mut P::Point, work: &mut Self::Work) {
        self.0.publish(problem, point, &mut **work);
    }

    fn record(&self, on: bool, work: &mut Self::Work) {
        self.0.record(on, &mut **work);
    }

    fn trace(&self, work: &Self::Work) -> Trace {
        self.0.trace(&**work)
    }

    fn account(&self, work: &Self::Work) -> Vec<String> {
        self.0.account(&**work)
    }

    fn latest(&self) -> bool {
        self.0.latest()
    }

    fn check_every(&self) -> usize {
        self.0.check_every()
    }
}
