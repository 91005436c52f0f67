//! A solver of one problem, made into a solver of another by a reformulation.

use nonsmooth_problem::Problem;
use nonsmooth_problem::check::Measure;

use crate::core::trace::Trace;
use crate::core::visits::{Calibration, closely};
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
///
/// Where the reformulation [approximates](Reformulation::approximates), the other problem's judge is called like the first one's: at the end, when the
/// estimate promises something, and every so many steps.
pub struct ViaWork<P, R, S>
where
    P: Problem,
    R: Reformulation<P>,
    S: Solver<R::To>,
{
    reduced: R::To,
    memo: R::Memo,
    point: <R::To as Problem>::Point,
    /// As the other problem's judge would have it.
    tidied: <R::To as Problem>::Point,
    work: S::Work,
    /// Of the other problem.
    gauge: Option<<R::To as Problem>::Gauge>,
    measure: Measure,
    tolerance: f64,
    calibration: Calibration,
    unjudged: usize,
}

/// What is said when the solver says that it has finished, and the other problem's judge does not agree.
const FAILED: &str =
    "the solver of the reformulated problem has finished, but its answer fails the check";

impl<R, S> Via<R, S> {
    /// Asks the judge of the other problem, if the reformulation approximates: what the step comes to.
    fn approximate<P>(&self, step: Step, work: &mut ViaWork<P, R, S>) -> Step
    where
        P: Problem,
        R: Reformulation<P>,
        S: Solver<R::To>,
    {
        let (Some(said), Some(gauge)) = (self.reformulation.approximates(), &mut work.gauge) else {
            return step;
        };
        work.unjudged += 1;
        let estimate = match step {
            Step::Continue { estimate } => estimate,
            _ => f64::NAN,
        };
        let going = matches!(step, Step::Continue { .. });
        let due = work.unjudged >= self.solver.check_every(&work.work)
            || work.calibration.promises(estimate, work.tolerance);
        if going && !due {
            return step;
        }
        self.solver.publish(&work.reduced, &mut work.point, &mut work.work);
        let _ = work.reduced.measure(&work.point, gauge);
        let ViaWork { reduced, point, tidied, tolerance, .. } = work;
        (work.measure, _) = closely(reduced, point, gauge, tidied, *tolerance);
        work.unjudged = 0;
        work.calibration.learn(work.measure.merit(), estimate);
        match step {
            _ if work.measure.passes(work.tolerance) => Step::Stuck(said.into()),
            Step::Done => Step::Stuck(FAILED.into()),
            step => step,
        }
    }
}

impl<P, R, S> Solver<P> for Via<R, S>
where
    P: Problem,
    R: Reformulation<P>,
    S: Solver<R::To>,
{
    type Work = ViaWork<P, R, S>;

    fn work(&self, problem: &P) -> Result<Self::Work, SolveError> {
        let reduce = || -> Result<_, SolveError> {
            let (reduced, memo) = self.reformulation.reduce(problem)?;
            let work = self.solver.work(&reduced)?;
            let gauge = self.reformulation.approximates().map(|_| reduced.gauge()).transpose()?;
            Ok((reduced, memo, work, gauge))
        };
        let made = reduce().map_err(|e| e.of_reformulated(problem))?;
        let (reduced, memo, work, gauge) = made;
        let (point, tidied) = (reduced.origin(), reduced.origin());
        let (measure, tolerance) = (Measure::unknown(), 0.0);
        Ok(ViaWork {
            reduced,
            memo,
            point,
            tidied,
            work,
            gauge,
            measure,
            tolerance,
            calibration: Calibration::new(),
            unjudged: 0,
        })
    }

    fn refill(&self, problem: &P, work: &mut Self::Work) -> Result<(), SolveError> {
        let mut refill = || {
            self.reformulation.reduce_again(problem, &mut work.reduced, &mut work.memo)?;
            if let Some(gauge) = &mut work.gauge {
                work.reduced.regauge(gauge)?;
            }
            self.solver.refill(&work.reduced, &mut work.work)
        };
        refill().map_err(|e| e.of_reformulated(problem))
    }

    fn aim(&self, tolerance: f64, work: &mut Self::Work) {
        work.tolerance = tolerance;
        self.solver.aim(tolerance, &mut work.work);
    }

    fn start(&self, problem: &P, point: &mut P::Point, work: &mut Self::Work) {
        (work.measure, work.unjudged) = (Measure::unknown(), 0);
        work.calibration = Calibration::new();
        self.reformulation.lower(problem, point, &work.memo, &mut work.point);
        // What is finite here may overflow there.
        if work.reduced.validate_point(&work.point).is_err() {
            work.point = work.reduced.origin();
        }
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
            other => self.approximate(other, work),
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
        let mut account = self.solver.account(&work.work);
        if work.gauge.is_some() && work.measure.relative.is_finite() {
            let (unknowns, relative) = (work.reduced.unknowns(), work.measure.relative);
            account.push(format!(
                "the reformulated problem has {unknowns} unknowns; its own relative residual is {relative:.1e}"
            ));
        }
        account
    }

    fn go_on(&self, _problem: &P, _point: &mut P::Point, work: &mut Self::Work) -> bool {
        self.solver.go_on(&work.reduced, &mut work.point, &mut work.work)
    }

    fn latest(&self) -> bool {
        self.reformulation.approximates().is_some() || self.solver.latest()
    }

    fn check_every(&self, work: &Self::Work) -> usize {
        self.solver.check_every(&work.work)
    }
}
