//! A solver of one problem, made into a solver of another by a reformulation.

use nonsmooth_problem::Problem;

use crate::trace::Trace;
use crate::{Reformulation, SolveError, Solver, Step};

/// `Via { reformulation, solver }` reduces a problem of type `P`, lets `solver` work on the other problem, and
/// lifts its point back whenever the judge of the *first* problem asks. Itself a solver.
#[derive(Debug, Clone, Copy)]
pub struct Via<R, S> {
    /// The way there and back.
    pub reformulation: R,
    /// The solver of the other problem.
    pub solver: S,
}

/// The other problem, the way back, and the solver's workspace there.
pub struct ViaWork<P, R, S>
where
    P: Problem,
    R: Reformulation<P>,
    S: Solver<R::To>,
{
    reduced: R::To,
    memo: R::Memo,
    point: <R::To as Problem>::Point,
    work: S::Work,
}

impl<P, R, S> Solver<P> for Via<R, S>
where
    P: Problem,
    R: Reformulation<P>,
    S: Solver<R::To>,
{
    type Work = ViaWork<P, R, S>;

    fn work(&self, problem: &P) -> Result<Self::Work, SolveError> {
        let (reduced, memo) = self.reformulation.reduce(problem)?;
        let work = self.solver.work(&reduced)?;
        let point = reduced.origin();
        Ok(ViaWork { reduced, memo, point, work })
    }

    fn refill(&self, problem: &P, work: &mut Self::Work) -> Result<(), SolveError> {
        self.reformulation.reduce_again(problem, &mut work.reduced, &mut work.memo)?;
        self.solver.refill(&work.reduced, &mut work.work)
    }

    fn aim(&self, tolerance: f64, work: &mut Self::Work) {
        self.solver.aim(tolerance, &mut work.work);
    }

    fn start(&self, problem: &P, point: &mut P::Point, work: &mut Self::Work) {
        self.reformulation.lower(problem, point, &mut work.point);
        self.solver.start(&work.reduced, &mut work.point, &mut work.work);
    }

    fn step(&self, _problem: &P, _point: &mut P::Point, work: &mut Self::Work) -> Step {
        if let Some(ray) = self.reformulation.contradiction(&work.memo) {
            return Step::NoSolution(ray);
        }
        match self.solver.step(&work.reduced, &mut work.point, &mut work.work) {
            Step::NoSolution(certificate) => {
                Step::NoSolution(self.reformulation.lift_certificate(certificate, &work.memo))
            }
            other => other,
        }
    }

    fn publish(&self, problem: &P, point: &mut P::Point, work: &mut Self::Work) {
        self.solver.publish(&work.reduced, &mut work.point, &mut work.work);
        self.reformulation.lift(problem, &work.point, &mut work.memo, point);
    }

    fn record(&self, on: bool, work: &mut Self::Work) {
        self.solver.record(on, &mut work.work);
    }

    fn trace(&self, work: &Self::Work) -> Trace {
        self.solver.trace(&work.work)
    }

    fn account(&self, work: &Self::Work) -> Vec<String> {
        self.solver.account(&work.work)
    }

    fn check_every(&self) -> usize {
        self.solver.check_every()
    }
}
