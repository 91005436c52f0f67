//! The only loop: iterations, wall clock, cancellation, non-finite iterates, best point, history, verdict.

use std::borrow::Cow;
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::time::{Duration, Instant};

use cpu_time::ProcessTime;
use nonsmooth_linalg::budget::{self, Budget, Scope};
use nonsmooth_linalg::{factorisations, pieces, uncounted};
use nonsmooth_problem::Problem;
use nonsmooth_problem::check::{Certificate, Evidence, Measure, Proof};

use crate::core::guard;
use crate::core::trace::Trace;
use crate::{SolveError, Solver, Step};

/// When to stop.
#[derive(Debug, Clone)]
pub struct Limits {
    /// The relative residual (unit-free, see [`Measure`]) to reach. Nominal 1e-3 … 1e-12; below about 1e-14
    /// rounding in the data's products cannot be told from an error.
    pub tolerance: f64,
    /// At most this many steps.
    pub max_iterations: usize,
    /// At most this many seconds of wall clock, the preparation of judge and workspace included. Looked at after every step and inside long ones; what
    /// cannot be interrupted is given up (see [`guard`](crate::core::guard)).
    pub time_limit: Option<f64>,
    /// Set to true from anywhere to stop, as promptly as at the time limit.
    pub cancel: Option<Arc<AtomicBool>>,
    /// The bytes of memory that one factorisation may take: a larger one is refused before it begins. Without a number, what the machine has free.
    pub memory_limit: Option<u64>,
    /// Threads that large factorisations and sweeps over many contacts may use, 0 for one a core. They change the time, not one bit of the result.
    pub threads: usize,
    /// Whether to keep the method's own record of its iterations ([`Session::trace`]); it grows with their number.
    pub trace: bool,
    /// Whether to read the processor's clock too ([`Outcome::cpu_seconds`]), which costs two system calls: as much as a small contact problem.
    pub cpu_time: bool,
}

/// More threads than any machine has use for.
pub const THREADS_MOST: usize = 1024;

impl Default for Limits {
    fn default() -> Self {
        Self {
            tolerance: 1e-8,
            max_iterations: 1_000_000,
            time_limit: None,
            cancel: None,
            memory_limit: None,
            threads: 1,
            trace: false,
            cpu_time: false,
        }
    }
}

impl Limits {
    /// What kernels look at, if the clock runs from `begun`.
    pub fn budget(&self, begun: Instant) -> Budget {
        // A limit beyond the reach of the clock is none.
        let deadline = |t: f64| begun.checked_add(Duration::try_from_secs_f64(t).ok()?);
        Budget {
            deadline: self.time_limit.and_then(deadline),
            cancel: self.cancel.clone(),
            memory: self.memory_limit,
            threads: match self.threads {
                0 => std::thread::available_parallelism().map_or(1, usize::from),
                n => n,
            },
        }
    }

    /// What is left of a budget, for a solve within what it bounds.
    pub(crate) fn of(budget: &Budget) -> Self {
        let left = |end: Instant| end.saturating_duration_since(Instant::now()).as_secs_f64();
        Self {
            time_limit: budget.deadline.map(left),
            cancel: budget.cancel.clone(),
            memory_limit: budget.memory,
            threads: budget.threads.max(1),
            ..Self::default()
        }
    }

    /// Which of the limits that come from outside is reached, if the clock runs from `begun`.
    pub(crate) fn reached(&self, begun: Instant) -> Option<Limit> {
        let late = |t: f64| begun.elapsed().as_secs_f64() >= t;
        if self.cancel.as_ref().is_some_and(|flag| flag.load(Ordering::Relaxed)) {
            Some(Limit::Cancelled)
        } else if self.time_limit.is_some_and(late) {
            Some(Limit::Time)
        } else {
            None
        }
    }

    /// What is left of them for a part of what was begun at `begun`.
    pub fn left(&self, begun: Instant) -> Self {
        let spent = begun.elapsed().as_secs_f64();
        Self { time_limit: self.time_limit.map(|t| (t - spent).max(0.0)), ..self.clone() }
    }

    /// Errors: a tolerance that is not in (0, 1], a limit of time that is negative or no number, more threads than [`THREADS_MOST`].
    pub fn validate(&self) -> Result<(), SolveError> {
        // The residual of doing nothing is about 1: beyond, everything would pass.
        if !(self.tolerance > 0.0 && self.tolerance <= 1.0) {
            return Err(SolveError::Limits {
                name: "tolerance",
                expected: "a positive number of at most 1",
                found: self.tolerance.to_string(),
            });
        }
        if self.threads > THREADS_MOST {
            return Err(SolveError::Limits {
                name: "threads",
                expected: "at most 1024, 0 for one a core",
                found: self.threads.to_string(),
            });
        }
        match self.time_limit {
            Some(t) if t.is_nan() || t < 0.0 => Err(SolveError::Limits {
                name: "time limit",
                expected: "a number of seconds of at least 0",
                found: t.to_string(),
            }),
            _ => Ok(()),
        }
    }
}

/// The answer to "is it solved, and if not, why did it stop". `Solved` is the judge's word, never the solver's.
#[derive(Debug, Clone, PartialEq)]
pub enum Status {
    /// The judge accepts the point at the tolerance asked for.
    Solved,
    /// There is no solution: proved, in exact arithmetic on the stored data.
    Infeasible(Proof),
    /// There is no solution for data that differ from those stored by rounding; nothing is known of the problem as stored.
    NearlyInfeasible {
        /// What holds nearly.
        certificate: Certificate,
        /// The relative change of the data that makes it true.
        change: f64,
    },
    /// The solver ended on a ray that the judge does not accept as a proof.
    NoConclusion(Certificate),
    /// A limit came first.
    Limit(Limit),
    /// The solver could not go on.
    Stalled(Cow<'static, str>),
}

/// Which limit came first.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Limit {
    /// `max_iterations` steps were done.
    Iterations,
    /// `time_limit` seconds have passed.
    Time,
    /// `cancel` was set.
    Cancelled,
}

impl Status {
    /// What the status rests on, where it is about there being no solution.
    pub fn certificate(&self) -> Option<&Certificate> {
        match self {
            Status::Infeasible(proof) => Some(proof.certificate()),
            Status::NearlyInfeasible { certificate, .. } | Status::NoConclusion(certificate) => {
                Some(certificate)
            }
            _ => None,
        }
    }

    /// Whether it says that there is no solution, proved or up to rounding.
    pub fn refutes(&self) -> bool {
        matches!(self, Status::Infeasible(_) | Status::NearlyInfeasible { .. })
    }

    /// A short name: `solved`, `infeasible`, `nearly_infeasible`, `no_conclusion`, `iteration_limit`,
    /// `time_limit`, `cancelled`, `stalled`.
    pub fn name(&self) -> &'static str {
        match self {
            Status::Solved => "solved",
            Status::Infeasible(_) => "infeasible",
            Status::NearlyInfeasible { .. } => "nearly_infeasible",
            Status::NoConclusion(_) => "no_conclusion",
            Status::Limit(Limit::Iterations) => "iteration_limit",
            Status::Limit(Limit::Time) => "time_limit",
            Status::Limit(Limit::Cancelled) => "cancelled",
            Status::Stalled(_) => "stalled",
        }
    }
}

impl std::fmt::Display for Status {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        match self {
            Status::Solved => f.write_str("solved"),
            Status::Infeasible(proof) => {
                write!(f, "infeasible: {proof}; proved in exact arithmetic")?;
                // The default tolerance: what is meant contradicts itself by more.
                match proof.margin() {
                    margin if margin < 1e-8 => {
                        write!(f, ", if only by {margin:.0e} of the largest right-hand side")
                    }
                    _ => Ok(()),
                }
            }
            Status::NearlyInfeasible { certificate, change } => write!(
                f,
                "not solved, nearly infeasible: {certificate}, up to rounding: a relative change of the data by {change:.0e} would make it so"
            ),
            Status::NoConclusion(_) => {
                f.write_str("no conclusion: the solver ended on a ray that proves nothing")
            }
            Status::Limit(Limit::Iterations) => f.write_str("not solved: iteration limit reached"),
            Status::Limit(Limit::Time) => f.write_str("not solved: time limit reached"),
            Status::Limit(Limit::Cancelled) => f.write_str("not solved: cancelled"),
            Status::Stalled(why) => write!(f, "not solved: {why}"),
        }
    }
}

/// What a solve came to. The point itself is the caller's, overwritten with the best one judged.
#[derive(Debug, Clone, PartialEq)]
pub struct Outcome {
    /// Whether it is solved and, if not, why it stopped.
    pub status: Status,
    /// The judge's residuals of the point returned. Where a bound of them was enough to see that it passes ([`Problem::accept`]), that bound, larger by about the rounding of plain
    /// arithmetic; [`Judged::judge`](nonsmooth_problem::check::Judged::judge) tells the last digits.
    pub measure: Measure,
    /// Steps done.
    pub iterations: usize,
    /// Matrices factorised for the solve, as far as they grow with the problem: M, a Newton matrix, but not the
    /// blocks of single contacts, nor what the judge factorises for itself.
    pub factorisations: u64,
    /// Wall clock of the solve: set-up of the workspace, steps and judgements, but no file and no final report. The judge's own preparation is left out, but where on several threads
    /// it runs beside that set-up and is waited for.
    pub seconds: f64,
    /// Processor time of the whole process meanwhile, all threads, if [`Limits::cpu_time`] asked for it: below `seconds` where the process had to wait.
    pub cpu_seconds: Option<f64>,
}

/// One visit of the judge.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Sample {
    /// Steps done so far.
    pub iteration: usize,
    /// Seconds since the start of the solve.
    pub seconds: f64,
    /// The relative residual; where another criterion is worse (bilateral constraints, dynamics), that.
    pub relative: f64,
}

/// What a solve uses up, from the preparation of the workspace on.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Meter {
    /// When the solve was asked for: limits count from here, with the judge's preparation.
    pub(crate) begun: Instant,
    wall: Instant,
    cpu: Option<ProcessTime>,
    factorisations: u64,
}

impl Meter {
    pub(crate) fn start(begun: Instant, limits: &Limits) -> Self {
        let cpu = limits.cpu_time.then(ProcessTime::now);
        Self { begun, wall: Instant::now(), cpu, factorisations: factorisations() }
    }

    pub(crate) fn seconds(&self) -> f64 {
        self.wall.elapsed().as_secs_f64()
    }

    /// What a failure of the preparation comes to: where a limit was reached, a preparation that was cut short proves nothing of the problem.
    pub(crate) fn ended(
        &self,
        measure: Measure,
        limits: &Limits,
        scope: &Scope,
        error: SolveError,
    ) -> Result<Outcome, SolveError> {
        let inapplicable = error.is_inapplicable();
        match (raised(scope), scope.refused()) {
            (Some(limit), _) if inapplicable => {
                let limit = limits.reached(self.begun).unwrap_or(limit);
                Ok(self.outcome(Status::Limit(limit), measure, 0))
            }
            (_, Some(refused)) if inapplicable => Err(refused.into()),
            _ => Err(error),
        }
    }

    pub(crate) fn outcome(&self, status: Status, measure: Measure, iterations: usize) -> Outcome {
        Outcome {
            status,
            measure,
            iterations,
            factorisations: factorisations() - self.factorisations,
            seconds: self.seconds(),
            cpu_seconds: self.cpu.map(|cpu| cpu.elapsed().as_secs_f64()),
        }
    }
}

/// What a watcher sees after every step.
#[derive(Debug, Clone, Copy)]
pub struct Progress {
    /// The last visit of the judge.
    pub judged: Sample,
    /// The smallest residual judged so far.
    pub best: f64,
    /// Steps done so far.
    pub iteration: usize,
    /// Seconds since the start of the solve.
    pub seconds: f64,
}

/// Who follows a solve from outside.
pub trait Observer<P: Problem> {
    /// Called after every step, judged or not.
    fn step(&mut self, progress: &Progress);

    /// Whether [`best`](Self::best) is to be called, which costs a judgement of the start.
    fn keeps_best(&self) -> bool {
        false
    }

    /// Called with each point that would be returned if the solve stopped now.
    fn best(&mut self, _point: &P::Point, _measure: &Measure) {}
}

/// An observer of steps alone.
struct Steps<'a>(&'a mut dyn FnMut(&Progress));

impl<P: Problem> Observer<P> for Steps<'_> {
    fn step(&mut self, progress: &Progress) {
        (self.0)(progress);
    }
}

/// A solver whose type is forgotten: what the registry hands out. One virtual call per solve, none per step.
pub trait Session<P: Problem>: Send {
    /// Solves `problem` from `point`, which is overwritten with the best point found whatever stops the solve.
    ///
    /// `watch` is called after every step, but for a large problem with a limit on time or a flag to cancel: then now and then. Errors are the
    /// caller's mistakes only.
    fn solve(
        &mut self,
        problem: &P,
        point: &mut P::Point,
        limits: &Limits,
        watch: &mut dyn FnMut(&Progress),
    ) -> Result<Outcome, SolveError> {
        self.observe(problem, point, limits, &mut Steps(watch))
    }

    /// As [`solve`](Self::solve), with an observer who may also see the best point so far.
    fn observe(
        &mut self,
        problem: &P,
        point: &mut P::Point,
        limits: &Limits,
        observer: &mut dyn Observer<P>,
    ) -> Result<Outcome, SolveError>;

    /// The judge's visits during the last solve, thinned evenly where there were very many.
    fn history(&self) -> &[Sample];

    /// The method's own record of the last solve, if [`Limits::trace`] asked for it and the method keeps one.
    fn trace(&self) -> Trace;

    /// What the solver says that it did during the last solve; empty where it has nothing to tell.
    fn account(&self) -> Vec<String>;

    /// The judge's gauge of the problem last solved, where there is a whole one: for a verdict without another preparation.
    fn gauge(&mut self) -> Option<&mut P::Gauge> {
        None
    }

    /// Hands over a gauge of the problem that is solved next, which then prepares none of its own; by default it is not used.
    fn lend(&mut self, gauge: Box<P::Gauge>) {
        drop(gauge);
    }

    /// Takes the gauge out, where [`gauge`](Self::gauge) shows one.
    fn reclaim(&mut self) -> Option<Box<P::Gauge>> {
        None
    }
}

/// The factor from a solver's own estimate to the judge's residual, learned at each judgement: the two are proportional, near enough.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Calibration(f64);

impl Calibration {
    /// Nothing learned yet.
    pub(crate) fn new() -> Self {
        Self(1.0)
    }

    /// Learns from a judgement at an estimate; NaN teaches nothing.
    pub(crate) fn learn(&mut self, residual: f64, estimate: f64) {
        let ratio = residual / estimate;
        self.0 = if ratio.is_finite() && ratio > 0.0 { ratio } else { 1.0 };
    }

    /// Whether an estimate promises that the judge will be content.
    pub(crate) fn promises(self, estimate: f64, tolerance: f64) -> bool {
        self.0 * estimate <= tolerance
    }
}

/// The judge's visits during a solve, thinned evenly where there are very many.
#[derive(Debug)]
pub(crate) struct History {
    samples: Vec<Sample>,
    /// Every `stride`-th visit is kept.
    stride: usize,
    visits: usize,
}

impl History {
    /// The most samples that are kept.
    const MOST: usize = 4096;

    /// An empty one, with room for all that it may keep.
    pub(crate) fn new() -> Self {
        Self { samples: Vec::with_capacity(Self::MOST), stride: 1, visits: 0 }
    }

    pub(crate) fn clear(&mut self) {
        self.samples.clear();
        (self.stride, self.visits) = (1, 0);
    }

    /// Notes a visit; one that is `worth_it` is kept whatever the stride.
    pub(crate) fn note(&mut self, sample: Sample, worth_it: bool) {
        if self.samples.len() == Self::MOST {
            let mut k = 0;
            self.samples.retain(|_| {
                k += 1;
                k % 2 == 1
            });
            self.stride = self.stride.saturating_mul(2);
        }
        if worth_it || self.visits.is_multiple_of(self.stride) {
            self.samples.push(sample);
        }
        self.visits += 1;
    }

    pub(crate) fn samples(&self) -> &[Sample] {
        &self.samples
    }
}

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
        let meter = before.unwrap_or_else(|| Meter::start(begun, limits));
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
                    let measure = visit.last;
                    if measure.passes(limits.tolerance) {
                        P::copy_point(best, point);
                        (k.untouched, k.torn) = (true, scope.raised());
                        *kept = Some(k);
                        return Ok(meter.outcome(Status::Solved, measure, 0));
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

/// The limit at which a kernel was cut short, if one was.
fn raised(scope: &Scope) -> Option<Limit> {
    let limit = || if scope.cancelled() { Limit::Cancelled } else { Limit::Time };
    scope.raised().then(limit)
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

/// A residual of a large problem above this many tolerances is not doubted at a limit of time: another judgement, in doubled precision, takes long and
/// could not make it pass.
const DOUBTFUL: f64 = 1e3;

/// Whether that is so, or a judgement takes whatever time a caller's functions take.
pub(crate) fn is_hopeless<P: Problem>(problem: &P, best: &Measure, limits: &Limits) -> bool {
    problem.asks_functions()
        || problem.burden() > guard::SMALL && best.merit() > DOUBTFUL * limits.tolerance
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
                        let small = self.problem.burden() <= guard::SMALL;
                        patience = iterations + iterations.max(if small { MODEST } else { 0 });
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
        self.judge.meter.outcome(status, measure, iterations)
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
        self.limits.reached(self.judge.meter.begun).or_else(|| raised(self.scope))
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

/// Whether a proof that there is no solution ends the search for one. A point that passes the check at the tolerance is what a user asked for, whatever the last digits of the data say; so a
/// proof that leaves room for such a point is kept, and is the last word only when as much work as it took, or [`MODEST`] work on a small problem, has found none.
pub(crate) fn is_final(proof: &Proof, tolerance: f64) -> bool {
    proof.margin() > ROOM * tolerance
}

/// Points that pass may miss a row by so many tolerances: one error is taken over all rows.
const ROOM: f64 = 100.0;
/// Iterations in the face of a proof, on a small problem.
pub(crate) const MODEST: usize = 3000;
/// What such a search ends with, before the proof takes its place.
const NOTHING_PASSES: Status = Status::Stalled(Cow::Borrowed("no point was found that passes"));

/// The judge's word on a certificate that a solver has found.
pub(crate) fn concluded<P: Problem>(problem: &P, certificate: Certificate) -> Status {
    match problem.evidence(&certificate) {
        Evidence::Proved(proof) => Status::Infeasible(proof),
        Evidence::Nearly { change } => Status::NearlyInfeasible { certificate, change },
        Evidence::Nothing => Status::NoConclusion(certificate),
    }
}

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

/// A solve that has not halved its merit in so many steps is asked whether it is at the floor; a factorisation counts as three steps more.
const IDLE: u64 = 1200;
/// A floor above this is one of impulses that run away.
const RUNAWAY: f64 = 1e-6;
/// How much later it may be asked the second question, and each later time than the one before.
const LATE: u64 = 4;
/// What counts as at the floor, and as near it.
const AT_FLOOR: f64 = 10.0;
const NEAR_FLOOR: f64 = 1000.0;

/// The most steps between two looks at a point of which a single contact is not done: a look costs several steps.
const MOST_WAIT: usize = 16;

/// The certified residuals of the point last measured, or those of the same with its variables exactly on their bounds, then in `tidied`, where they are better; which.
pub(crate) fn closely<P: Problem>(
    problem: &P,
    point: &P::Point,
    gauge: &mut P::Gauge,
    tidied: &mut P::Point,
    tolerance: f64,
) -> (Measure, bool) {
    let mut plain = None;
    for boldly in [true, false] {
        P::copy_point(point, tidied);
        if !problem.tidy(tidied, gauge, boldly) {
            continue;
        }
        let measure = problem.certify(tidied, gauge);
        let plain = plain.insert(problem.certify(point, gauge));
        if measure.passes(tolerance) || measure.is_better_than(plain) {
            return (measure, true);
        }
    }
    (plain.unwrap_or_else(|| problem.certify(point, gauge)), false)
}

/// The certified residuals of a start of which nothing has come; where they are not finite, those of the origin, which then takes its place.
pub(crate) fn fallen_back<P: Problem>(
    problem: &P,
    point: &mut P::Point,
    gauge: &mut P::Gauge,
) -> Measure {
    let start = problem.certify(point, gauge);
    if start.merit().is_finite() {
        return start;
    }
    let mut origin = problem.origin();
    let _ = problem.measure(&origin, gauge);
    problem.follow_impulses(&mut origin, gauge);
    let measure = problem.certify(&origin, gauge);
    if !measure.is_better_than(&start) {
        return start;
    }
    *point = origin;
    measure
}

/// The start is one of the points that an unsolved problem's solve may return: where its residuals, certified if `closely` or where it looks solved at the tolerance, are smaller than those of `point`, it takes its place. Cost: one
/// judgement, of a global problem one more. Allocates nothing.
pub(crate) fn or_start<P: Problem>(
    problem: &P,
    start: &mut P::Point,
    point: &mut P::Point,
    gauge: &mut P::Gauge,
    measure: Measure,
    how: (f64, bool),
) -> Measure {
    if *start == *point {
        return measure;
    }
    let first = of_start(problem, start, gauge, how);
    if !first.is_better_than(&measure) {
        return measure;
    }
    P::copy_point(start, point);
    first
}

/// The residuals of a start, which is given by its impulses alone; certified if `closely`, or where it looks solved at the tolerance: nobody may look at it again.
fn of_start<P: Problem>(
    problem: &P,
    start: &mut P::Point,
    gauge: &mut P::Gauge,
    (tolerance, closely): (f64, bool),
) -> Measure {
    let plain = problem.measure(start, gauge);
    let plain = match problem.follow_impulses(start, gauge) && !closely {
        true => problem.measure(start, gauge),
        false => plain,
    };
    if closely || plain.passes(tolerance) { problem.certify(start, gauge) } else { plain }
}

/// Since when a solve gets no further.
#[derive(Debug, Clone, Copy)]
struct Halved {
    merit: f64,
    iteration: usize,
    factorisations: u64,
    /// The work without a halving after which the floor is looked at.
    patience: u64,
}

impl Halved {
    fn now(merit: f64, iteration: usize) -> Self {
        Self { merit, iteration, factorisations: factorisations(), patience: IDLE }
    }
}

/// How a point is looked at.
#[derive(Clone, Copy, PartialEq)]
enum Look {
    /// To steer by, and if it looks solved again to decide by.
    Plainly,
    /// To decide by at once: the solver's estimate promises a solution.
    Promised,
    /// In doubled precision even if it seems no solution: a solver's last word.
    Closely,
}

/// What a look found beside the residuals.
#[derive(Default)]
struct Seen {
    /// The residuals to decide by, where they were needed.
    certified: Option<Measure>,
    /// They are those of the point in `tidied`.
    tidied: bool,
    /// The residual to steer by: what a bound adds to it is no part of how it falls.
    steered: Option<f64>,
}

/// The judge's visits, the best point among them, and the history.
struct Judge<'a, P: Problem> {
    gauge: &'a mut P::Gauge,
    /// The start, as long as no point has finite residuals.
    best: &'a mut P::Point,
    /// The point last certified with its variables exactly on their bounds.
    tidied: &'a mut P::Point,
    history: &'a mut History,
    meter: Meter,
    /// Whether the latest point counts as the best.
    latest: bool,
    last: Measure,
    best_measure: Measure,
    /// The best point's residuals in doubled precision, where they were needed.
    certified: Option<Measure>,
    /// When the best merit was last halved.
    halved: Halved,
    /// The own residual of the contact for which a point was last refused, the step from which it is asked again, and the last wait.
    own: Option<f64>,
    own_again: usize,
    own_wait: usize,
    calibration: Calibration,
    /// No promise has been broken yet: a broken one costs a look in vain.
    trusting: bool,
}

impl<'a, P: Problem> Judge<'a, P> {
    fn new(
        gauge: &'a mut P::Gauge,
        best: &'a mut P::Point,
        tidied: &'a mut P::Point,
        history: &'a mut History,
        meter: Meter,
        latest: bool,
    ) -> Self {
        let nothing = Measure::unknown();
        Self {
            gauge,
            best,
            tidied,
            history,
            meter,
            latest,
            last: nothing,
            best_measure: nothing,
            certified: None,
            halved: Halved::now(f64::INFINITY, 0),
            own: None,
            own_again: 0,
            own_wait: 0,
            calibration: Calibration::new(),
            trusting: true,
        }
    }

    /// Whether the point is now the best.
    fn judge(
        &mut self,
        problem: &P,
        point: &P::Point,
        iteration: usize,
        tolerance: f64,
        look: Look,
    ) -> bool {
        let promised = look == Look::Promised && self.trusting;
        let accepted = promised.then(|| problem.accept(point, self.gauge, tolerance)).flatten();
        self.trusting &= !promised || accepted.is_some();
        let seen = match accepted {
            Some((bounds, steered)) => {
                self.last = bounds;
                Seen { certified: Some(bounds), tidied: false, steered: Some(steered) }
            }
            None => self.look(problem, point, iteration, tolerance, look),
        };
        // What passes counts as the best, though its merit may be that of a point with a contact that is not done.
        let mut better = self.last.merit().is_finite()
            && (self.latest && !(budget::over() && self.last.merit() >= f64::MAX)
                || self.last.is_better_than(&self.best_measure)
                || self.last.passes(tolerance));
        // Residuals may be finite where an impulse that nothing feels is not.
        if better && problem.validate_point(point).is_err() {
            (self.last, better) = (Measure::unknown(), false);
        }
        if better {
            self.best_measure = self.last;
            self.certified = seen.certified;
            P::copy_point(if seen.tidied { self.tidied } else { point }, self.best);
        }
        let merit = self.last.merit();
        let relative = seen.steered.unwrap_or(merit);
        let sample = Sample { iteration, seconds: self.meter.seconds(), relative };
        self.history.note(sample, merit <= self.best_measure.merit());
        better
    }

    /// The residuals of the point, in `last`: to steer by, and to decide by where it looks solved or is a last word.
    fn look(
        &mut self,
        problem: &P,
        point: &P::Point,
        iteration: usize,
        tolerance: f64,
        look: Look,
    ) -> Seen {
        self.last = problem.measure(point, self.gauge);
        let mut seen = Seen::default();
        if !self.last.passes(tolerance) {
            // What is zero but for rounding may hide how good the rest is.
            P::copy_point(point, self.tidied);
            if problem.tidy(self.tidied, self.gauge, true) {
                let measure = problem.measure(self.tidied, self.gauge);
                if measure.is_better_than(&self.last) {
                    (self.last, seen.tidied) = (measure, true);
                }
                if measure.passes(tolerance) {
                    // Back to the point that is to be tidied for good.
                    let _ = problem.measure(point, self.gauge);
                }
            }
        }
        if let (Some(own), true) = (self.own, iteration < self.own_again) {
            // Refused a moment ago for a single contact: as yet as good as then.
            self.last.own = Some(own);
        } else if look == Look::Closely || self.last.passes(tolerance) {
            // What looks solved is looked at again, in doubled precision.
            match problem.accept(point, self.gauge, tolerance) {
                Some((bounds, steered)) => (self.last, seen.steered) = (bounds, Some(steered)),
                None => (self.last, seen.tidied) = self.certify(problem, point, tolerance),
            }
            seen.certified = Some(self.last);
            if self.last.fails_own_only(tolerance) {
                self.own = self.last.own;
                self.own_wait = (2 * self.own_wait).clamp(1, MOST_WAIT);
                self.own_again = iteration + self.own_wait;
            }
        }
        seen
    }

    /// [`closely`] of the point last measured.
    fn certify(&mut self, problem: &P, point: &P::Point, tolerance: f64) -> (Measure, bool) {
        closely(problem, point, self.gauge, self.tidied, tolerance)
    }

    /// The work since the best merit was last halved, where it is time to look at the floor.
    fn idle(&mut self, iteration: usize) -> Option<u64> {
        let merit = self.best_measure.merit();
        if merit <= 0.5 * self.halved.merit {
            self.halved = Halved::now(merit, iteration);
            return None;
        }
        let Halved { iteration: since, factorisations: before, patience, .. } = self.halved;
        let work = (iteration - since) as u64 + 3 * (factorisations() - before);
        if work < patience {
            return None;
        }
        self.halved.patience *= 2;
        Some(work)
    }

    /// The best point's residuals in doubled precision.
    fn certify_best(&mut self, problem: &P) -> Measure {
        let measure = *self.certified.get_or_insert_with(|| problem.certify(self.best, self.gauge));
        self.best_measure = measure;
        measure
    }

    fn progress(&self, iteration: usize) -> Progress {
        let last = self.history.samples().last().copied();
        // The clock is looked at once for a step.
        let seconds = match last {
            Some(sample) if sample.iteration == iteration => sample.seconds,
            _ => self.meter.seconds(),
        };
        let judged = last.unwrap_or(Sample { iteration, seconds, relative: f64::NAN });
        Progress { judged, best: self.best_measure.merit(), iteration, seconds }
    }
}
