//! A solver of one problem, made into a solver of another by a reformulation.

use std::time::Instant;

use nonsmooth_problem::Problem;
use nonsmooth_problem::check::{Evidence, Measure};

use crate::core::drive::{Calibration, Meter};
use crate::core::trace::Trace;
use crate::{
    Limits, Observer, Outcome, Progress, Reformulation, Sample, Session, SolveError, Solver,
    Status, Step,
};

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
        let due = work.unjudged >= self.solver.check_every()
            || work.calibration.promises(estimate, work.tolerance);
        if going && !due {
            return step;
        }
        self.solver.publish(&work.reduced, &mut work.point, &mut work.work);
        work.measure = work.reduced.certify(&work.point, gauge);
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
        let (reduced, memo) = self.reformulation.reduce(problem)?;
        let work = self.solver.work(&reduced)?;
        let point = reduced.origin();
        let gauge = self.reformulation.approximates().map(|_| reduced.gauge()).transpose()?;
        let (measure, tolerance) = (Measure::unknown(), 0.0);
        Ok(ViaWork {
            reduced,
            memo,
            point,
            work,
            gauge,
            measure,
            tolerance,
            calibration: Calibration::new(),
            unjudged: 0,
        })
    }

    fn refill(&self, problem: &P, work: &mut Self::Work) -> Result<(), SolveError> {
        self.reformulation.reduce_again(problem, &mut work.reduced, &mut work.memo)?;
        if let Some(gauge) = &mut work.gauge {
            work.reduced.regauge(gauge)?;
        }
        self.solver.refill(&work.reduced, &mut work.work)
    }

    fn aim(&self, tolerance: f64, work: &mut Self::Work) {
        work.tolerance = tolerance;
        self.solver.aim(tolerance, &mut work.work);
    }

    fn start(&self, problem: &P, point: &mut P::Point, work: &mut Self::Work) {
        (work.measure, work.unjudged) = (Measure::unknown(), 0);
        work.calibration = Calibration::new();
        self.reformulation.lower(problem, point, &work.memo, &mut work.point);
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

    fn latest(&self) -> bool {
        self.reformulation.approximates().is_some() || self.solver.latest()
    }

    fn check_every(&self) -> usize {
        self.solver.check_every()
    }
}

/// A whole session of one problem, made into a session of another by a reformulation.
///
/// The session has its own judge, who may be content before the judge of the first problem is: then it goes on from its point, to a closer tolerance.
pub struct ViaSession<P, R>
where
    P: Problem,
    R: Reformulation<P>,
{
    reformulation: R,
    session: Box<dyn Session<R::To>>,
    gauge: Option<P::Gauge>,
}

impl<P, R> ViaSession<P, R>
where
    P: Problem,
    R: Reformulation<P>,
{
    /// Of the way there and back, and the session of the other problem.
    pub fn new(reformulation: R, session: Box<dyn Session<R::To>>) -> Self {
        Self { reformulation, session, gauge: None }
    }
}

/// The tolerances that are tried, in units of the one before, and how often.
const CLOSER: f64 = 1e-2;
const TRIES: usize = 4;

/// What is said of a proof that is none of the problem as it is stated.
const WITHOUT: &str = "the reformulated problem has no solution, which is proved of it alone";

/// Sees the session of the other problem as one of the first.
struct Lifted<'a, P, R>
where
    P: Problem,
    R: Reformulation<P>,
{
    problem: &'a P,
    reformulation: &'a R,
    memo: &'a mut R::Memo,
    gauge: &'a mut P::Gauge,
    point: P::Point,
    observer: &'a mut dyn Observer<P>,
    iterations: usize,
    begun: Instant,
    merit: f64,
}

impl<P, R> Observer<R::To> for Lifted<'_, P, R>
where
    P: Problem,
    R: Reformulation<P>,
{
    fn step(&mut self, progress: &Progress) {
        let iteration = self.iterations + progress.iteration;
        let seconds = self.begun.elapsed().as_secs_f64();
        self.observer.step(&Progress { iteration, seconds, ..*progress });
    }

    fn keeps_best(&self) -> bool {
        self.observer.keeps_best()
    }

    fn best(&mut self, reduced: &<R::To as Problem>::Point, _: &Measure) {
        self.reformulation.lift(self.problem, reduced, self.memo, &mut self.point);
        let measure = self.problem.measure(&self.point, self.gauge);
        if measure.merit() < self.merit {
            self.merit = measure.merit();
            self.observer.best(&self.point, &measure);
        }
    }
}

impl<P, R> Session<P> for ViaSession<P, R>
where
    P: Problem<Gauge: Send>,
    R: Reformulation<P>,
{
    fn observe(
        &mut self,
        problem: &P,
        point: &mut P::Point,
        limits: &Limits,
        observer: &mut dyn Observer<P>,
    ) -> Result<Outcome, SolveError> {
        limits.validate()?;
        problem.validate_point(point)?;
        let meter = Meter::start(Instant::now(), limits);
        let scope = limits.budget(meter.begun).enter();
        let (other, mut memo) = self.reformulation.reduce(problem)?;
        let mut reduced = other.origin();
        self.reformulation.lower(problem, point, &memo, &mut reduced);
        let gauge = self.gauge.insert(problem.gauge()?);
        let mut trial = problem.origin();
        let mut best: Option<(P::Point, Measure)> = None;
        let (asked, mut tolerance) = (limits.tolerance, limits.tolerance);
        let (mut iterations, mut factorisations) = (0, 0);
        let mut status = Status::Stalled(FAILED.into());
        for _ in 0..TRIES {
            let left = |t: f64| (t - meter.seconds()).max(0.0);
            let limits = Limits {
                tolerance,
                max_iterations: limits.max_iterations.saturating_sub(iterations),
                time_limit: limits.time_limit.map(left),
                ..limits.clone()
            };
            let mut lifted = Lifted {
                problem,
                reformulation: &self.reformulation,
                memo: &mut memo,
                gauge,
                point: problem.origin(),
                observer,
                iterations,
                begun: meter.begun,
                merit: best.as_ref().map_or(f64::INFINITY, |b| b.1.merit()),
            };
            let outcome = self.session.observe(&other, &mut reduced, &limits, &mut lifted)?;
            iterations += outcome.iterations;
            factorisations += outcome.factorisations;
            self.reformulation.lift(problem, &reduced, &mut memo, &mut trial);
            let measure = problem.certify(&trial, gauge);
            let passes = measure.passes(asked);
            if best.as_ref().is_none_or(|b| measure.is_better_than(&b.1)) {
                best = Some((trial.clone(), measure));
            }
            status = match outcome.status {
                _ if passes => Status::Solved,
                Status::Solved => Status::Stalled(FAILED.into()),
                Status::Infeasible(proof) => {
                    let lifted =
                        self.reformulation.lift_certificate(proof.certificate().clone(), &memo);
                    match problem.evidence(&lifted) {
                        Evidence::Proved(proof) => Status::Infeasible(proof),
                        _ => Status::Stalled(WITHOUT.into()),
                    }
                }
                Status::NearlyInfeasible { .. } | Status::NoConclusion(_) => Status::Stalled(
                    "the reformulated problem has no solution, up to rounding".into(),
                ),
                other => other,
            };
            if status != Status::Stalled(FAILED.into()) {
                break;
            }
            tolerance = (CLOSER * tolerance).max(f64::EPSILON);
        }
        drop(scope);
        let measure = match best {
            Some((best, measure)) => {
                P::copy_point(&best, point);
                measure
            }
            None => problem.certify(point, gauge),
        };
        let outcome = meter.outcome(status, measure, iterations);
        Ok(Outcome { factorisations, ..outcome })
    }

    fn history(&self) -> &[Sample] {
        self.session.history()
    }

    fn trace(&self) -> Trace {
        self.session.trace()
    }

    fn account(&self) -> Vec<String> {
        self.session.account()
    }

    fn gauge(&mut self) -> Option<&mut P::Gauge> {
        self.gauge.as_mut()
    }
}
