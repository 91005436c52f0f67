//! The only loop: iterations, wall clock, cancellation, non-finite iterates, best point, history, verdict.

use std::borrow::Cow;
use std::time::Instant;

use nonsmooth_linalg::budget::{self, Scope};
use nonsmooth_linalg::{pieces, uncounted};
use nonsmooth_problem::Problem;
use nonsmooth_problem::check::Measure;

use crate::core::guard;
use crate::core::limits::{Limit, Limits};
use crate::core::meter::{Meter, raised};
use crate::core::session::{Observer, Sample, Session};
use crate::core::status::{MODEST, Outcome, Status, concluded, is_final};
use crate::core::trace::Trace;
use crate::core::visits::{History, IDLE, Judge, Look, fallen_back, of_start, or_start};
use crate::{SolveError, Solver, Step};

/// On several threads judge and workspace of a problem with so much to judge are prepared side by side.
const BESIDE: usize = 2000;

/// Drives a solver. Keeps its workspace, so that a second solve of the same shape allocates nothing.
pub struct Driver<P: Problem, S: Solver<P>> {
    solver: S,
    // Boxed: workspaces are large to move.
    gauge: Option<Box<P::Gauge>>,
    /// The gauge is one of the next problem already.
    lent: bool,
    kept: Option<Box<Kept<P, S>>>,
    history: History,
}

struct Kept<P: Problem, S: Solver<P>> {
    work: S::Work,
    /// Where a solve without a better idea starts.
    origin: P::Point,
    /// The last solve ended where it began, and the workspace is one of another problem.
    untouched: bool,
    best: P::Point,
    tidied: P::Point,
    /// The caller's start: what solvers make of it may be worse.
    given: P::Point,
    /// A limit was reached inside a kernel, which left something unfinished.
    torn: bool,
}

impl<P: Problem, S: Solver<P>> Driver<P, S> {
    /// A driver for `solver`, without a workspace yet.
    pub fn new(solver: S) -> Self {
        Self { solver, gauge: None, lent: false, kept: None, history: History::new() }
    }

    /// The solver that is driven, with its settings.
    pub fn solver(&self) -> &S {
        &self.solver
    }
}

impl<P: Problem + Sync, S: Solver<P>> Session<P> for Driver<P, S> {
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
        let scope = limits.budget(begun).enter();
        let Self { solver, gauge, lent, kept, history } = self;
        history.clear();
        let lent = std::mem::take(lent);
        // What was cut short in a kernel is begun anew.
        let earlier = kept.take().filter(|k| !k.torn);
        let gauge_before = gauge.take().filter(|_| lent || earlier.is_some());
        let beside = gauge_before.is_none()
            && budget::threads() > 1
            && problem.burden() >= BESIDE
            && !problem.asks_functions()
            && earlier.is_none();
        let before = beside.then(|| Meter::start(begun, limits));
        let gauge_anew = || uncounted(|| problem.gauge()).map(Box::new);
        let (judge, made) = match gauge_before {
            Some(gauge) if lent => (Ok(gauge), None),
            Some(mut gauge) => (uncounted(|| problem.regauge(&mut gauge)).map(|()| gauge), None),
            None if beside => {
                let (judge, made) = pieces::both(gauge_anew, || solver.work(problem));
                // Only this thread hears of what was refused.
                (judge.or_else(|_| gauge_anew()), Some(made))
            }
            None => (gauge_anew(), None),
        };
        // The judge's own preparation is not part of the solve's time.
        let meter = before.unwrap_or_else(|| {
            match earlier.is_some() && is_small(problem) && !problem.asks_functions() {
                true => Meter::since(begun, begun, limits),
                false => Meter::start(begun, limits),
            }
        });
        let judge: &mut P::Gauge = match judge {
            Ok(judge) => gauge.insert(judge),
            Err(e) => return meter.ended(Measure::unknown(), limits, &scope, e.into()),
        };
        // Whatever happens in the preparation, there is a judged point.
        let start = observer.keeps_best().then(|| {
            let mut first = point.clone();
            let measure = of_start(problem, &mut first, judge, (limits.tolerance, false));
            observer.best(&first, &measure);
            (first, measure)
        });
        let ready = match earlier {
            Some(mut k) => {
                // A solution, as the impulses of the step before often are, needs no solver nor its preparation.
                k.untouched = false;
                if *point != k.origin {
                    let Kept { best, tidied, .. } = &mut *k;
                    P::copy_point(point, best);
                    let mut visit = Judge::new(judge, best, tidied, history, meter, false);
                    visit.judge(problem, point, 0, limits.tolerance, Look::Plainly);
                    let (measure, seen) = (visit.last, visit.seen);
                    if measure.passes(limits.tolerance) {
                        P::copy_point(best, point);
                        (k.untouched, k.torn) = (true, scope.raised());
                        *kept = Some(k);
                        return Ok(meter.outcome_at(seen, Status::Solved, measure, 0));
                    }
                    history.clear();
                }
                solver.refill(problem, &mut k.work).map(|()| k)
            }
            None => made.unwrap_or_else(|| solver.work(problem)).map(|work| {
                let (best, tidied, given) = (point.clone(), point.clone(), point.clone());
                let (origin, untouched, torn) = (problem.origin(), false, false);
                Box::new(Kept { work, origin, untouched, best, tidied, given, torn })
            }),
        };
        let mut now = match ready {
            Ok(now) => now,
            Err(e) => {
                let measure = match start {
                    Some((first, measure)) => {
                        P::copy_point(&first, point);
                        measure
                    }
                    None if scope.raised() => problem.measure(point, judge),
                    None => Measure::unknown(),
                };
                return meter.ended(measure, limits, &scope, e);
            }
        };
        let outcome = {
            let Kept { work, best, tidied, given, .. } = &mut *now;
            P::copy_point(point, best);
            P::copy_point(point, given);
            let mut run = Run {
                problem,
                solver,
                work,
                judge: Judge::new(judge, best, tidied, history, meter, solver.latest()),
                limits,
                scope: &scope,
                observer,
            };
            run.solve(point, given)
        };
        now.torn = scope.raised();
        *kept = Some(now);
        Ok(outcome)
    }

    fn history(&self) -> &[Sample] {
        self.history.samples()
    }

    fn trace(&self) -> Trace {
        let touched = self.kept.as_ref().filter(|kept| !kept.untouched);
        touched.map_or(Trace::None, |kept| self.solver.trace(&kept.work))
    }

    fn account(&self) -> Vec<String> {
        match &self.kept {
            Some(kept) if kept.untouched => {
                vec!["started from the point given, which is a solution".into()]
            }
            Some(kept) => self.solver.account(&kept.work),
            None => vec![],
        }
    }

    fn gauge(&mut self) -> Option<&mut P::Gauge> {
        // Without a limit reached inside a kernel the solve left nothing unfinished.
        self.kept.as_ref().filter(|kept| !kept.torn).and(self.gauge.as_deref_mut())
    }

    fn lend(&mut self, gauge: Box<P::Gauge>) {
        (self.gauge, self.lent) = (Some(gauge), true);
    }

    fn reclaim(&mut self) -> Option<Box<P::Gauge>> {
        let whole = self.kept.as_ref().is_none_or(|kept| !kept.torn);
        self.gauge.take().filter(|_| whole)
    }
}

struct Run<'a, P: Problem, S: Solver<P>> {
    problem: &'a P,
    solver: &'a S,
    work: &'a mut S::Work,
    judge: Judge<'a, P>,
    limits: &'a Limits,
    scope: &'a Scope,
    observer: &'a mut dyn Observer<P>,
}

/// Whether no single operation on a problem takes more than some milliseconds, but for a caller's functions.
fn is_small<P: Problem>(problem: &P) -> bool {
    problem.burden() <= guard::SMALL
}

/// A residual of a large problem above this many tolerances is not doubted at a limit of time: another judgement, in doubled precision, takes long and
/// could not make it pass.
const DOUBTFUL: f64 = 1e3;

/// Whether that is so, or a judgement takes whatever time a caller's functions take.
pub(crate) fn is_hopeless<P: Problem>(problem: &P, best: &Measure, limits: &Limits) -> bool {
    problem.asks_functions() || !is_small(problem) && best.merit() > DOUBTFUL * limits.tolerance
}

impl<P: Problem, S: Solver<P>> Run<'_, P, S> {
    fn solve(&mut self, point: &mut P::Point, given: &mut P::Point) -> Outcome {
        let mut iterations = 0;
        self.solver.aim(self.limits.tolerance, self.work);
        self.solver.record(self.limits.trace, self.work);
        self.solver.start(self.problem, point, self.work);
        self.judge(point, 0, Look::Plainly);
        // Else a method's form of the start, or its first step, was judged in its place.
        let counted = !self.solver.latest() && *given == *point;
        let mut estimate = f64::NAN;
        let mut since_judged = 0;
        let mut claim = None;
        let mut proof = None;
        let mut patience = usize::MAX;
        let status = loop {
            if self.judge.last.passes(self.limits.tolerance) {
                break Status::Solved;
            }
            if let Some(claim) = claim.take() {
                break claim;
            }
            if iterations >= patience {
                break NOTHING_PASSES;
            }
            if let Some(limit) = self.limit(iterations) {
                if since_judged > 0 {
                    // A last look: the steps since the last one may have been enough.
                    self.judge(point, iterations, Look::Plainly);
                    if self.judge.last.passes(self.limits.tolerance) {
                        break Status::Solved;
                    }
                }
                break Status::Limit(limit);
            }
            let step = self.solver.step(self.problem, point, self.work);
            iterations += 1;
            since_judged += 1;
            match step {
                Step::Continue { estimate: e } => estimate = e,
                // What ends because a kernel was cut short has not failed.
                Step::Stuck(_) | Step::Done if self.scope.raised() => {}
                ended => match self.conclusion(ended) {
                    Status::Infeasible(found)
                        if proof.is_none()
                            && !is_final(&found, self.limits.tolerance)
                            && self.solver.go_on(self.problem, point, self.work) =>
                    {
                        proof = Some(found);
                        let modest = if is_small(self.problem) { MODEST } else { 0 };
                        patience = iterations + iterations.max(modest);
                    }
                    // A certificate whose verification was cut short is not refuted.
                    Status::Infeasible(proof) => claim = Some(Status::Infeasible(proof)),
                    other => claim = (!self.scope.raised()).then_some(other),
                },
            }
            let promised = self.judge.calibration.promises(estimate, self.limits.tolerance);
            let due = promised || since_judged >= self.solver.check_every(self.work);
            if due || claim.is_some() {
                let look = match claim {
                    Some(_) => Look::Closely,
                    None if promised => Look::Promised,
                    None => Look::Plainly,
                };
                self.judge(point, iterations, look);
                self.judge.calibration.learn(self.judge.last.merit(), estimate);
                since_judged = 0;
                if !self.judge.last.merit().is_finite() {
                    claim = Some(Status::Stalled("the iterates are no longer finite".into()));
                } else if claim.is_none() && proof.is_none() {
                    claim = self.floor(iterations);
                }
            }
            self.observer.step(&self.judge.progress(iterations));
        };
        P::copy_point(self.judge.best, point);
        let end =
            (status == Status::Solved && self.judge.certified.is_some()).then_some(self.judge.seen);
        let late = matches!(status, Status::Limit(Limit::Time | Limit::Cancelled));
        let hopeless = is_hopeless(self.problem, &self.judge.best_measure, self.limits);
        let measure = match self.judge.certified {
            Some(measure) => measure,
            // The best point is the start still.
            None if !self.judge.best_measure.merit().is_finite() => {
                fallen_back(self.problem, point, self.judge.gauge)
            }
            None if late && hopeless => self.judge.best_measure,
            None => {
                // The gauge may have been at another point since.
                let _ = self.problem.measure(point, self.judge.gauge);
                let (measure, tidied) =
                    self.judge.certify(self.problem, point, self.limits.tolerance);
                if tidied {
                    P::copy_point(self.judge.tidied, point);
                }
                // A projection that the limit cut short says nothing of a point that was judged before.
                let cut_short = budget::over() && measure.merit() >= f64::MAX;
                if cut_short { self.judge.best_measure } else { measure }
            }
        };
        // What a solver of another problem ends with is its answer; where a limit stops it, or a ray that proves nothing, it has none.
        let answered = match status {
            Status::Solved => true,
            Status::Limit(_) | Status::NoConclusion(_) => false,
            _ => self.solver.latest(),
        };
        let measure = match counted || answered {
            true => measure,
            false => {
                let closely = !(late && hopeless);
                let how = (self.limits.tolerance, closely);
                or_start(self.problem, given, point, self.judge.gauge, measure, how)
            }
        };
        // Plain arithmetic may have refused, at rounding level, what doubled precision accepts.
        let status = match status {
            Status::Limit(_) | Status::Stalled(_) if measure.passes(self.limits.tolerance) => {
                Status::Solved
            }
            // A solver that goes on without what memory refused it says what it lacked.
            Status::Limit(Limit::Iterations) => match self.scope.refused() {
                Some(refused) => {
                    Status::Stalled(format!("iteration limit reached; {refused}").into())
                }
                None => status,
            },
            other => other,
        };
        let status = match proof {
            Some(proof) if status != Status::Solved => Status::Infeasible(proof),
            _ => status,
        };
        let end = end.unwrap_or_else(Instant::now);
        self.judge.meter.outcome_at(end, status, measure, iterations)
    }

    fn judge(&mut self, point: &mut P::Point, iteration: usize, look: Look) {
        self.solver.publish(self.problem, point, self.work);
        let tolerance = self.limits.tolerance;
        let better = self.judge.judge(self.problem, point, iteration, tolerance, look);
        if better && self.observer.keeps_best() {
            self.observer.best(self.judge.best, &self.judge.best_measure);
        }
    }

    fn limit(&self, iterations: usize) -> Option<Limit> {
        if iterations >= self.limits.max_iterations {
            return Some(Limit::Iterations);
        }
        // Nothing has been done since the start was judged.
        let now = || if iterations == 0 { self.judge.seen } else { Instant::now() };
        self.limits.reached_at(self.judge.meter.begun, now).or_else(|| raised(self.scope))
    }

    /// The end of a solve that the rounding of its impulses keeps from the tolerance: nothing has come of it for long, and the best point is at
    /// the floor that the judge finds for it.
    fn floor(&mut self, iterations: usize) -> Option<Status> {
        let work = self.judge.idle(iterations)?;
        let measure = self.judge.certify_best(self.problem);
        let floor = measure.floor.filter(|floor| floor.is_finite())?;
        let tolerance = self.limits.tolerance;
        // Impulses that are that large may be those of a problem without a solution: a solver that asks has its time.
        if floor > RUNAWAY && work < LATE * IDLE {
            return None;
        }
        // A point near the floor may still meet a tolerance little below it by chance.
        let (near, below) = if work < LATE * IDLE { (AT_FLOOR, 4.0) } else { (NEAR_FLOOR, 1.0) };
        (floor > below * tolerance && measure.merit() <= near * floor)
            .then(|| Status::Stalled(floor_of(floor).into()))
    }

    /// What a solver's last word comes to if the judge does not accept its point.
    fn conclusion(&self, step: Step) -> Status {
        match step {
            Step::Stuck(why) => match self.scope.refused() {
                Some(refused) => Status::Stalled(format!("{why}: {refused}").into()),
                None => Status::Stalled(why),
            },
            Step::NoSolution(certificate) => concluded(self.problem, certificate),
            Step::Done | Step::Continue { .. } => {
                Status::Stalled("the solver has finished, but its answer fails the check".into())
            }
        }
    }
}

/// What such a search ends with, before the proof takes its place.
const NOTHING_PASSES: Status = Status::Stalled(Cow::Borrowed("no point was found that passes"));

/// What is said of a floor, by its decade: without allocation, so that a solve that ends there costs none.
fn floor_of(floor: f64) -> &'static str {
    macro_rules! texts {
        ($($decade:literal)*) => {
            [$(concat!(
                "the rounding of the unknowns to double precision alone makes a residual of about 1e-",
                $decade
            )),*]
        };
    }
    const TEXTS: [&str; 18] = texts!(0 1 2 3 4 5 6 7 8 9 10 11 12 13 14 15 16 17);
    TEXTS[(-floor.log10()).round().clamp(0.0, 17.0) as usize]
}

/// A floor above this is one of impulses that run away.
const RUNAWAY: f64 = 1e-6;

/// How much later it may be asked the second question, and each later time than the one before.
const LATE: u64 = 4;

/// What counts as at the floor, and as near it.
const AT_FLOOR: f64 = 10.0;

const NEAR_FLOOR: f64 = 1000.0;
