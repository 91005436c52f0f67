//! A session of one problem, made into a session of another by a reformulation.

use std::borrow::Cow;
use std::time::Instant;

use nonsmooth_problem::Problem;
use nonsmooth_problem::check::Measure;

use crate::core::meter::Meter;
use crate::core::status::concluded;
use crate::core::trace::Trace;
use crate::core::visits::fallen_back;
use crate::{
    Limit, Limits, Observer, Outcome, Progress, Reformulation, Sample, Session, SolveError, Status,
};

/// What [`Via`](crate::Via) is of solvers, of whole sessions: those have no steps at which the judge of the first problem could be asked, so it is asked when they
/// end. Where it is not content they go on from there, to a closer tolerance of their own.
pub struct ViaSession<P: Problem, R: Reformulation<P>> {
    reformulation: R,
    session: Box<dyn Session<R::To>>,
    /// The other problem that was last solved, and the way back.
    kept: Option<(R::To, R::Memo)>,
    gauge: Option<P::Gauge>,
    /// What the session was asked for beyond its first answer.
    account: Vec<String>,
}

/// The factor between the tolerances of two tries.
const CLOSER: f64 = 1e-2;

impl<P: Problem, R: Reformulation<P>> ViaSession<P, R> {
    /// `session`, behind `reformulation`.
    pub fn new(reformulation: R, session: Box<dyn Session<R::To>>) -> Self {
        Self { reformulation, session, kept: None, gauge: None, account: vec![] }
    }
}

/// Sees the other problem's solve as one of the first: points are lifted, and measured by the first problem's judge.
struct Lifted<'a, P: Problem, R: Reformulation<P>> {
    problem: &'a P,
    reformulation: &'a R,
    memo: &'a mut R::Memo,
    gauge: &'a mut P::Gauge,
    trial: P::Point,
    /// The best point so far, and its measure.
    best: (&'a mut P::Point, Measure),
    observer: &'a mut dyn Observer<P>,
    /// The tolerance of the problem itself.
    tolerance: f64,
    /// Steps before this try.
    iterations: usize,
}

impl<P: Problem, R: Reformulation<P>> Lifted<'_, P, R> {
    /// The measure of a point of the other problem; kept where it is the best.
    fn see(&mut self, point: &<R::To as Problem>::Point, closely: bool) -> Measure {
        self.reformulation.lift(self.problem, point, self.memo, &mut self.trial);
        let plain = (!closely).then(|| self.problem.measure(&self.trial, self.gauge));
        // What looks solved is decided in doubled precision: nobody may look again.
        let measure = match plain {
            Some(measure) if !measure.passes(self.tolerance) => measure,
            _ => self.problem.certify(&self.trial, self.gauge),
        };
        // What passes counts as the best: `own` is no part of the merit.
        let better = measure.passes(self.tolerance) || measure.is_better_than(&self.best.1);
        if better && self.problem.validate_point(&self.trial).is_ok() {
            P::copy_point(&self.trial, self.best.0);
            self.best.1 = measure;
            if self.observer.keeps_best() {
                self.observer.best(self.best.0, &measure);
            }
        }
        measure
    }
}

impl<P: Problem, R: Reformulation<P>> Observer<R::To> for Lifted<'_, P, R> {
    fn step(&mut self, progress: &Progress) {
        let mut progress = *progress;
        progress.judged.iteration += self.iterations;
        self.observer.step(&progress);
    }

    fn keeps_best(&self) -> bool {
        self.observer.keeps_best()
    }

    fn best(&mut self, point: &<R::To as Problem>::Point, _: &Measure) {
        self.see(point, false);
    }
}

impl<P, R> Session<P> for ViaSession<P, R>
where
    P: Problem<Point: Clone, Gauge: Send>,
    R: Reformulation<P>,
{
    fn observe(
        &mut self,
        problem: &P,
        point: &mut P::Point,
        limits: &Limits,
        observer: &mut dyn Observer<P>,
    ) -> Result<Outcome, SolveError> {
        let begun = Instant::now();
        limits.validate()?;
        problem.validate_point(point)?;
        self.account.clear();
        let scope = limits.budget(begun).enter();
        let meter = Meter::start(begun, limits);
        let Self { reformulation, session, kept, gauge, account } = self;
        let gauge = match problem.gauge() {
            Ok(judge) => gauge.insert(judge),
            Err(e) => return meter.ended(Measure::unknown(), limits, &scope, e.into()),
        };
        let start = fallen_back(problem, point, gauge);
        // To make the other problem may take all the time there is.
        if observer.keeps_best() {
            observer.best(point, &start);
        }
        let reduced = match kept.take() {
            Some((mut to, mut memo)) => {
                reformulation.reduce_again(problem, &mut to, &mut memo).map(|()| (to, memo))
            }
            None => reformulation.reduce(problem),
        };
        // What was cut short is not kept.
        let (reduced, memo) = match reduced {
            Ok(reduced) if !scope.raised() => kept.insert(reduced),
            Ok(_) => {
                return Ok(meter.outcome(
                    Status::Limit(limits.reached(begun).unwrap_or(Limit::Time)),
                    start,
                    0,
                ));
            }
            Err(e) => return meter.ended(start, limits, &scope, e.of_reformulated(problem)),
        };
        if let Some(ray) = reformulation.contradiction(memo) {
            return Ok(meter.outcome(concluded(problem, ray), start, 0));
        }
        let mut there = reduced.origin();
        reformulation.lower(problem, point, memo, &mut there);
        // What is finite here may overflow there.
        if reduced.validate_point(&there).is_err() {
            there = reduced.origin();
        }
        drop(scope);

        let mut tolerance = limits.tolerance;
        let mut iterations = 0;
        let trial = point.clone();
        let mut seen = Lifted {
            problem,
            reformulation,
            memo,
            gauge,
            trial,
            best: (point, start),
            observer,
            tolerance: limits.tolerance,
            iterations,
        };
        let status = loop {
            let limits_there = Limits {
                tolerance,
                max_iterations: limits.max_iterations.saturating_sub(iterations),
                ..limits.left(begun)
            };
            let outcome = session.observe(reduced, &mut there, &limits_there, &mut seen);
            let outcome = outcome.map_err(|e| e.of_reformulated(problem))?;
            iterations += outcome.iterations;
            seen.iterations = iterations;
            let measure = seen.see(&there, true);
            if measure.passes(limits.tolerance) {
                break Status::Solved;
            }
            tolerance *= CLOSER;
            match outcome.status {
                Status::Solved if tolerance > f64::EPSILON => account.push(format!(
                    "solved as it was reformulated, with a relative residual of {:.1e} in the problem itself: once more, to {tolerance:.0e}",
                    measure.relative
                )),
                Status::Solved => break Status::Stalled(Cow::Borrowed(FAILED)),
                Status::Infeasible(proof) => {
                    let lifted = reformulation.lift_certificate(proof.certificate().clone(), seen.memo);
                    break concluded(problem, lifted);
                }
                // What holds of the data of the other problem may not hold of these.
                Status::NearlyInfeasible { .. } => break Status::Stalled(Cow::Borrowed(NEARLY)),
                status => break status,
            }
        };
        let measure = seen.best.1;
        Ok(meter.outcome(status, measure, iterations))
    }

    fn history(&self) -> &[Sample] {
        self.session.history()
    }

    fn trace(&self) -> Trace {
        self.session.trace()
    }

    fn account(&self) -> Vec<String> {
        let mut account = self.session.account();
        account.extend(self.account.iter().cloned());
        account
    }

    fn gauge(&mut self) -> Option<&mut P::Gauge> {
        self.gauge.as_mut()
    }
}

/// What is said when the session says that it has solved the other problem as closely as doubles can, and the judge does not agree.
const FAILED: &str =
    "the reformulated problem is solved as closely as doubles can, but the answer fails the check";

/// What is said when there is no solution of the other problem up to rounding.
const NEARLY: &str = "the reformulated problem has no solution up to rounding of its data, which proves nothing of this one";
