//! The only loop: iterations, wall clock, cancellation, non-finite iterates, best point, history, verdict.

use std::borrow::Cow;
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::time::Instant;

use cpu_time::ProcessTime;
use nonsmooth_problem::Problem;
use nonsmooth_problem::check::{Certificate, Measure};
use nonsmooth_problem::linalg::factorisations;

use crate::trace::Trace;
use crate::{SolveError, Solver, Step};

/// When to stop.
#[derive(Debug, Clone)]
pub struct Limits {
    /// The relative residual (unit-free, see [`Measure`]) to reach. Nominal 1e-3 … 1e-12; below about 1e-14
    /// rounding in the data's products cannot be told from an error.
    pub tolerance: f64,
    /// At most this many steps.
    pub max_iterations: usize,
    /// At most this many seconds of wall clock, set-up of the workspace included. Tested after every step.
    pub time_limit: Option<f64>,
    /// Set to true from anywhere to stop after the current step.
    pub cancel: Option<Arc<AtomicBool>>,
    /// Whether to keep the method's own record of its iterations ([`Session::trace`]); it grows with their number.
    pub trace: bool,
}

impl Default for Limits {
    fn default() -> Self {
        Self {
            tolerance: 1e-8,
            max_iterations: 1_000_000,
            time_limit: None,
            cancel: None,
            trace: false,
        }
    }
}

impl Limits {
    fn validate(&self) -> Result<(), SolveError> {
        if !(self.tolerance > 0.0 && self.tolerance.is_finite()) {
            return Err(SolveError::Limits {
                name: "tolerance",
                expected: "a positive finite number",
                found: self.tolerance.to_string(),
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
    /// There is no solution; the judge has verified the certificate.
    Infeasible(Certificate),
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
    /// A short name: `solved`, `infeasible`, `no_conclusion`, `iteration_limit`, `time_limit`, `cancelled`, `stalled`.
    pub fn name(&self) -> &'static str {
        match self {
            Status::Solved => "solved",
            Status::Infeasible(_) => "infeasible",
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
            Status::Infeasible(certificate) => {
                write!(f, "infeasible: {certificate}, with a verified certificate")
            }
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
    /// The judge's residuals of the point returned.
    pub measure: Measure,
    /// Steps done.
    pub iterations: usize,
    /// Matrices factorised for the solve, as far as they grow with the problem: M, a Newton matrix, but not the
    /// blocks of single contacts, nor what the judge factorises for itself.
    pub factorisations: u64,
    /// Wall clock of the solve: set-up of the workspace, steps and judgements, but no file and no final report.
    pub seconds: f64,
    /// Processor time of the whole process meanwhile, all threads: below `seconds` where the process had to wait.
    pub cpu_seconds: f64,
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
struct Meter {
    wall: Instant,
    cpu: ProcessTime,
    factorisations: u64,
}

impl Meter {
    fn start() -> Self {
        Self { wall: Instant::now(), cpu: ProcessTime::now(), factorisations: factorisations() }
    }

    fn seconds(&self) -> f64 {
        self.wall.elapsed().as_secs_f64()
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

/// A solver whose type is forgotten: what the registry hands out. One virtual call per solve, none per step.
pub trait Session<P: Problem>: Send {
    /// Solves `problem` from `point`, which is overwritten with the best point found whatever stops the solve.
    ///
    /// `watch` is called after every step. Errors are the caller's mistakes only.
    fn solve(
        &mut self,
        problem: &P,
        point: &mut P::Point,
        limits: &Limits,
        watch: &mut dyn FnMut(&Progress),
    ) -> Result<Outcome, SolveError>;

    /// The judge's visits during the last solve, thinned evenly where there were very many.
    fn history(&self) -> &[Sample];

    /// The method's own record of the last solve, if [`Limits::trace`] asked for it and the method keeps one.
    fn trace(&self) -> Trace;

    /// What the solver says that it did during the last solve; empty where it has nothing to tell.
    fn account(&self) -> Vec<String>;
}

/// So many visits of the judge at points whose residual is rounding, and still above the tolerance, are enough.
const PATIENCE: usize = 20;
/// What is rounding, in units of what half a bit of each unknown makes.
const NOISE: f64 = 16.0;

/// The most samples that a history keeps.
const HISTORY: usize = 4096;

/// Drives a solver. Keeps its workspace, so that a second solve of the same shape allocates nothing.
pub struct Driver<P: Problem, S: Solver<P>> {
    solver: S,
    kept: Option<Kept<P, S>>,
    history: Vec<Sample>,
}

struct Kept<P: Problem, S: Solver<P>> {
    work: S::Work,
    gauge: P::Gauge,
    best: P::Point,
    tidied: P::Point,
}

impl<P: Problem, S: Solver<P>> Driver<P, S> {
    /// A driver for `solver`, without a workspace yet.
    pub fn new(solver: S) -> Self {
        Self { solver, kept: None, history: Vec::with_capacity(HISTORY) }
    }

    /// The solver.
    pub fn solver(&self) -> &S {
        &self.solver
    }
}

impl<P: Problem, S: Solver<P>> Session<P> for Driver<P, S> {
    fn solve(
        &mut self,
        problem: &P,
        point: &mut P::Point,
        limits: &Limits,
        watch: &mut dyn FnMut(&Progress),
    ) -> Result<Outcome, SolveError> {
        limits.validate()?;
        problem.validate_point(point)?;
        let Self { solver, kept, history } = self;
        // The judge's own preparation is not part of the solve's time.
        let mut kept_now = match kept.take() {
            Some(mut k) => {
                problem.regauge(&mut k.gauge)?;
                let meter = Meter::start();
                solver.refill(problem, &mut k.work)?;
                (k, meter)
            }
            None => {
                let gauge = problem.gauge()?;
                let meter = Meter::start();
                let work = solver.work(problem)?;
                (Kept { work, gauge, best: point.clone(), tidied: point.clone() }, meter)
            }
        };
        let outcome = {
            let (Kept { work, gauge, best, tidied }, meter) = &mut kept_now;
            P::copy_point(point, best);
            let mut run = Run {
                problem,
                solver,
                work,
                judge: Judge::new(gauge, best, tidied, history, *meter, solver.latest()),
                limits,
            };
            run.solve(point, watch)
        };
        *kept = Some(kept_now.0);
        Ok(outcome)
    }

    fn history(&self) -> &[Sample] {
        &self.history
    }

    fn trace(&self) -> Trace {
        self.kept.as_ref().map_or(Trace::None, |kept| self.solver.trace(&kept.work))
    }

    fn account(&self) -> Vec<String> {
        self.kept.as_ref().map_or(vec![], |kept| self.solver.account(&kept.work))
    }
}

struct Run<'a, P: Problem, S: Solver<P>> {
    problem: &'a P,
    solver: &'a S,
    work: &'a mut S::Work,
    judge: Judge<'a, P>,
    limits: &'a Limits,
}

impl<P: Problem, S: Solver<P>> Run<'_, P, S> {
    fn solve(&mut self, point: &mut P::Point, watch: &mut dyn FnMut(&Progress)) -> Outcome {
        let mut iterations = 0;
        self.solver.aim(self.limits.tolerance, self.work);
        self.solver.record(self.limits.trace, self.work);
        self.solver.start(self.problem, point, self.work);
        self.judge(point, 0);
        let mut estimate = f64::NAN;
        let mut since_judged = 0;
        let mut claim = None;
        let status = loop {
            if self.judge.last.passes(self.limits.tolerance) {
                break Status::Solved;
            }
            if let Some(claim) = claim.take() {
                break claim;
            }
            if let Some(limit) = self.limit(iterations) {
                if since_judged > 0 {
                    // A last look: the steps since the last one may have been enough.
                    self.judge(point, iterations);
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
                ended => claim = Some(self.conclusion(ended)),
            }
            let due = since_judged >= self.solver.check_every()
                || self.judge.ratio * estimate <= self.limits.tolerance;
            if due || claim.is_some() {
                self.judge(point, iterations);
                self.judge.calibrate(estimate);
                since_judged = 0;
                if !self.judge.last.merit().is_finite() {
                    claim = Some(Status::Stalled("the iterates are no longer finite".into()));
                }
                if claim.is_none() && self.judge.at_floor >= PATIENCE {
                    claim = Some(Status::Stalled(
                        format!(
                            "rounding the unknowns to doubles makes a residual of {:.0e} here, more than the tolerance",
                            self.judge.floor
                        )
                        .into(),
                    ));
                }
            }
            watch(&self.judge.progress(iterations));
        };
        P::copy_point(self.judge.best, point);
        let measure = match self.judge.certified {
            Some(measure) => measure,
            None => {
                // The gauge may have been at another point since.
                let _ = self.problem.measure(point, self.judge.gauge);
                let (measure, tidied) =
                    self.judge.certify(self.problem, point, self.limits.tolerance);
                if tidied {
                    P::copy_point(self.judge.tidied, point);
                }
                measure
            }
        };
        // Plain arithmetic may have refused, at rounding level, what doubled precision accepts.
        let status = match status {
            Status::Limit(_) | Status::Stalled(_) if measure.passes(self.limits.tolerance) => {
                Status::Solved
            }
            other => other,
        };
        let meter = &self.judge.meter;
        Outcome {
            status,
            measure,
            iterations,
            factorisations: factorisations() - meter.factorisations,
            seconds: meter.seconds(),
            cpu_seconds: meter.cpu.elapsed().as_secs_f64(),
        }
    }

    fn judge(&mut self, point: &mut P::Point, iteration: usize) {
        self.solver.publish(self.problem, point, self.work);
        self.judge.judge(self.problem, point, iteration, self.limits.tolerance);
    }

    fn limit(&self, iterations: usize) -> Option<Limit> {
        let cancelled =
            || self.limits.cancel.as_ref().is_some_and(|flag| flag.load(Ordering::Relaxed));
        let late = |t: f64| self.judge.meter.seconds() >= t;
        if iterations >= self.limits.max_iterations {
            Some(Limit::Iterations)
        } else if cancelled() {
            Some(Limit::Cancelled)
        } else if self.limits.time_limit.is_some_and(late) {
            Some(Limit::Time)
        } else {
            None
        }
    }

    /// What a solver's last word comes to if the judge does not accept its point.
    fn conclusion(&self, step: Step) -> Status {
        match step {
            Step::Stuck(why) => Status::Stalled(why),
            Step::NoSolution(certificate) if self.problem.verify(&certificate) => {
                Status::Infeasible(certificate)
            }
            Step::NoSolution(certificate) => Status::NoConclusion(certificate),
            Step::Done | Step::Continue { .. } => {
                Status::Stalled("the solver has finished, but its answer fails the check".into())
            }
        }
    }
}

/// The judge's visits, the best point among them, and the history.
struct Judge<'a, P: Problem> {
    gauge: &'a mut P::Gauge,
    best: &'a mut P::Point,
    /// The point last certified with its variables exactly on their bounds.
    tidied: &'a mut P::Point,
    history: &'a mut Vec<Sample>,
    meter: Meter,
    /// Whether the latest point counts as the best.
    latest: bool,
    last: Measure,
    best_measure: Measure,
    /// The best point's residuals in doubled precision, where they were needed.
    certified: Option<Measure>,
    /// Judged residual over the solver's estimate, when last compared.
    ratio: f64,
    /// Visits at points whose residual is rounding, and what that makes.
    at_floor: usize,
    floor: f64,
    /// Keep every `stride`-th visit in the history.
    stride: usize,
    visits: usize,
}

impl<'a, P: Problem> Judge<'a, P> {
    fn new(
        gauge: &'a mut P::Gauge,
        best: &'a mut P::Point,
        tidied: &'a mut P::Point,
        history: &'a mut Vec<Sample>,
        meter: Meter,
        latest: bool,
    ) -> Self {
        history.clear();
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
            ratio: 1.0,
            at_floor: 0,
            floor: 0.0,
            stride: 1,
            visits: 0,
        }
    }

    fn judge(&mut self, problem: &P, point: &P::Point, iteration: usize, tolerance: f64) {
        self.last = problem.measure(point, self.gauge);
        let floor = problem.floor(self.gauge);
        if floor > tolerance && self.last.merit() <= NOISE * floor {
            (self.at_floor, self.floor) = (self.at_floor + 1, floor);
        }
        let (mut certified, mut tidied) = (None, false);
        if !self.last.passes(tolerance) {
            // What is zero but for rounding may hide how good the rest is.
            P::copy_point(point, self.tidied);
            if problem.tidy(self.tidied, self.gauge, true) {
                let measure = problem.measure(self.tidied, self.gauge);
                if measure.is_better_than(&self.last) {
                    (self.last, tidied) = (measure, true);
                }
                if measure.passes(tolerance) {
                    // Back to the point that is to be tidied for good.
                    let _ = problem.measure(point, self.gauge);
                }
            }
        }
        if self.last.passes(tolerance) {
            // What looks solved is looked at again, in doubled precision.
            (self.last, tidied) = self.certify(problem, point, tolerance);
            certified = Some(self.last);
        }
        if self.visits == 0 || self.latest || self.last.is_better_than(&self.best_measure) {
            self.best_measure = self.last;
            self.certified = certified;
            P::copy_point(if tidied { self.tidied } else { point }, self.best);
        }
        if self.history.len() == HISTORY {
            let mut k = 0;
            self.history.retain(|_| {
                k += 1;
                k % 2 == 1
            });
            self.stride *= 2;
        }
        let merit = self.last.merit();
        if self.visits.is_multiple_of(self.stride) || merit <= self.best_measure.merit() {
            self.history.push(Sample { iteration, seconds: self.meter.seconds(), relative: merit });
        }
        self.visits += 1;
    }

    /// The certified residuals of the point last measured, or of the same with its variables exactly on their bounds if those are better; which.
    fn certify(&mut self, problem: &P, point: &P::Point, tolerance: f64) -> (Measure, bool) {
        let mut plain = None;
        for boldly in [true, false] {
            P::copy_point(point, self.tidied);
            if !problem.tidy(self.tidied, self.gauge, boldly) {
                continue;
            }
            let tidied = problem.certify(self.tidied, self.gauge);
            let plain = plain.insert(problem.certify(point, self.gauge));
            if tidied.passes(tolerance) || tidied.is_better_than(plain) {
                return (tidied, true);
            }
        }
        (plain.unwrap_or_else(|| problem.certify(point, self.gauge)), false)
    }

    /// The solver's estimate is proportional to the residual, near enough: learn the factor.
    fn calibrate(&mut self, estimate: f64) {
        let ratio = self.last.merit() / estimate;
        self.ratio = if ratio.is_finite() && ratio > 0.0 { ratio } else { 1.0 };
    }

    fn progress(&self, iteration: usize) -> Progress {
        let seconds = self.meter.seconds();
        let judged = self.history.last().copied().unwrap_or(Sample {
            iteration,
            seconds,
            relative: f64::NAN,
        });
        Progress { judged, best: self.best_measure.merit(), iteration, seconds }
    }
}
