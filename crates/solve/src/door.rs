//! The one door: a problem of a known kind, or of any, in; point, status, verdict and account out.
//!
//! ```
//! use nonsmooth_problem::planted::Planted;
//! use nonsmooth_solve::{Solve, solve};
//!
//! let (problem, _known) = Planted::default().local::<3>();
//! let answer = solve(&problem)?;
//! assert!(answer.is_solved());
//!
//! let closer = Solve::new().solver("nsgs").set("omega", 0.9).tolerance(1e-10).warm(&answer.point);
//! assert!(closer.run(&problem)?.verdict.measure.relative <= 1e-10);
//! # Ok::<(), nonsmooth_solve::SolveError>(())
//! ```

use std::any::Any;
use std::sync::Arc;
use std::sync::atomic::AtomicBool;
use std::time::Instant;

use nonsmooth_problem::check::{Certificate, Judged, Verdict, VerdictOf};
use nonsmooth_problem::{
    AnyPoint, AnyProblem, OfAny, OfAnyPoint, ProblemError, any_verdict, with_problem,
};
use serde_json::Value;

use crate::core::register::{AnySession, DEFAULT, Described, Registered, session};
use crate::core::settings::SettingsMap;
use crate::core::trace::Trace;
use crate::{Limit, Limits, Outcome, Progress, Sample, Session, SolveError, Status, guard};

/// Solves a problem with `auto`, from zero, to the default tolerance and without other limits: [`Solve::new`]`.run(problem)`.
///
/// Errors: data at fault; a method that does not apply. That there is no solution, or that none was found, is a [`Status`].
pub fn solve<P: Solvable>(problem: &P) -> Result<Answer<P>, SolveError> {
    Solve::new().run(problem)
}

/// How to solve: a solver with its settings, limits, a point to start from. All have defaults.
#[derive(Debug, Clone)]
pub struct Solve {
    solver: String,
    settings: SettingsMap,
    pub(crate) limits: Limits,
    start: Option<AnyPoint>,
}

impl Default for Solve {
    fn default() -> Self {
        Self::new()
    }
}

impl Solve {
    /// `auto` with its defaults, [`Limits::default`], from zero.
    pub fn new() -> Self {
        Self {
            solver: DEFAULT.into(),
            settings: SettingsMap::new(),
            limits: Limits::default(),
            start: None,
        }
    }

    /// By the solver of this name (`nonsmooth list` shows them), perhaps behind prefixes: `condense/nsgs`.
    #[must_use]
    pub fn solver(mut self, name: impl Into<String>) -> Self {
        self.solver = name.into();
        self
    }

    /// With this value of one of the solver's settings.
    #[must_use]
    pub fn set(mut self, key: impl Into<String>, value: impl Into<Value>) -> Self {
        self.settings.insert(key.into(), value.into());
        self
    }

    /// With these settings, as [`settings::from_texts`](crate::settings::from_texts) reads them, in place of all set before.
    #[must_use]
    pub fn settings(mut self, settings: SettingsMap) -> Self {
        self.settings = settings;
        self
    }

    /// By the solver that is this struct of hyperparameters, `with(&Nsgs { omega: 0.9, ..Nsgs::default() })`.
    #[must_use]
    pub fn with<S: Described>(mut self, method: &S) -> Self {
        self.solver = S::ABOUT.name.into();
        // A struct of settings becomes an object.
        if let Ok(Value::Object(settings)) = serde_json::to_value(method) {
            self.settings = settings;
        }
        self
    }

    /// To this relative residual, a pure number in (0, 1].
    #[must_use]
    pub fn tolerance(mut self, tolerance: f64) -> Self {
        self.limits.tolerance = tolerance;
        self
    }

    /// In at most this many iterations.
    #[must_use]
    pub fn max_iterations(mut self, iterations: usize) -> Self {
        self.limits.max_iterations = iterations;
        self
    }

    /// In at most this many seconds of wall clock, the verdict included.
    #[must_use]
    pub fn time_limit(mut self, seconds: f64) -> Self {
        self.limits.time_limit = Some(seconds);
        self
    }

    /// Until this flag is set.
    #[must_use]
    pub fn cancel(mut self, flag: Arc<AtomicBool>) -> Self {
        self.limits.cancel = Some(flag);
        self
    }

    /// With all these limits in place of those set before.
    #[must_use]
    pub fn limits(mut self, limits: Limits) -> Self {
        self.limits = limits;
        self
    }

    /// From this point, of the kind of the problem.
    #[must_use]
    pub fn warm<X: Clone + Into<AnyPoint>>(mut self, point: &X) -> Self {
        self.start = Some(point.clone().into());
        self
    }

    /// Solves a problem. Many problems of one shape, step by step, are solved without allocation by one
    /// [`session`](crate::registry::session).
    ///
    /// Errors: an unknown solver or setting, data or a starting point at fault, an impossible limit; a method that does not apply.
    pub fn run<P: Solvable>(&self, problem: &P) -> Result<Answer<P>, SolveError> {
        self.watched(problem, &mut |_| {})
    }

    /// As [`run`](Self::run); `watch` sees how far it is after every iteration (of large problems, now and then).
    pub fn watched<P: Solvable>(
        &self,
        problem: &P,
        watch: &mut dyn FnMut(&Progress),
    ) -> Result<Answer<P>, SolveError> {
        problem.answer(self, &mut Kept::default(), watch)
    }

    /// As [`watched`](Self::watched), by the session in `kept` where that is of this solver with these settings and of the problem's kind; the session of this solve is
    /// kept there. What a session knows of a pattern (orderings, symbolic factors, memory) is so found once for many problems that differ by their numbers.
    ///
    /// ```
    /// use nonsmooth_problem::planted::PlantedLcp;
    /// use nonsmooth_solve::{Kept, Solve};
    ///
    /// let (mut problem, _known) = PlantedLcp::default().lcp();
    /// let (solve, mut kept) = (Solve::new(), Kept::default());
    /// for _ in 0..3 {
    ///     problem.q.iter_mut().for_each(|q| *q *= 0.5);
    ///     assert!(solve.again(&problem, &mut kept, &mut |_| {})?.is_solved());
    /// }
    /// # Ok::<(), nonsmooth_solve::SolveError>(())
    /// ```
    pub fn again<P: Solvable>(
        &self,
        problem: &P,
        kept: &mut Kept,
        watch: &mut dyn FnMut(&Progress),
    ) -> Result<Answer<P>, SolveError> {
        problem.answer(self, kept, watch)
    }
}

/// The session of a solve, kept for the next one; see [`Solve::again`].
#[derive(Default)]
pub struct Kept(Option<KeptSession>);

/// A session whose kind of problem is forgotten, with what it was made of.
struct KeptSession {
    solver: String,
    settings: SettingsMap,
    session: Box<dyn Any + Send>,
}

impl Kept {
    /// The session that is kept if it is the one that is asked for, else a new one.
    fn take<P: Registered>(&mut self, how: &Solve) -> Result<AnySession<P>, SolveError> {
        let same = self.0.take_if(|kept| {
            kept.solver == how.solver
                && kept.settings == how.settings
                && kept.session.is::<AnySession<P>>()
        });
        match same.and_then(|kept| kept.session.downcast::<AnySession<P>>().ok()) {
            Some(session) => Ok(*session),
            None => session::<P>(&how.solver, &how.settings),
        }
    }

    fn put<P: Registered>(&mut self, how: &Solve, session: AnySession<P>) {
        let (solver, settings) = (how.solver.clone(), how.settings.clone());
        self.0 = Some(KeptSession { solver, settings, session: Box::new(session) });
    }
}

impl std::fmt::Debug for Kept {
    fn fmt(&self, f: &mut std::fmt::Formatter) -> std::fmt::Result {
        f.debug_tuple("Kept").field(&self.0.as_ref().map(|kept| &kept.solver)).finish()
    }
}

/// What came of a solve.
#[derive(Debug, Clone)]
pub struct Answer<P: Judged> {
    /// The best point found.
    pub point: P::Point,
    /// Whether it is solved, and if not, why it stopped.
    pub status: Status,
    /// The judge's word on the point: residuals, what each contact or row does, velocities.
    pub verdict: VerdictOf<P>,
    /// Steps done.
    pub iterations: usize,
    /// Matrices factorised that grow with the problem, see [`Outcome::factorisations`].
    pub factorisations: u64,
    /// Wall clock of the solve, see [`Outcome::seconds`].
    pub seconds: f64,
    /// Processor time, where [`Limits::cpu_time`] asked for it.
    pub cpu_seconds: Option<f64>,
    /// What the solver says that it did.
    pub account: Vec<String>,
    /// The residuals on the way.
    pub history: Vec<Sample>,
    /// The method's own record, where [`Limits::trace`] asked for it.
    pub trace: Trace,
}

impl<P: Judged> Answer<P> {
    /// Whether the judge accepts the point.
    pub fn is_solved(&self) -> bool {
        self.status == Status::Solved
    }

    /// What it rests on, where the status says that there is no solution.
    pub fn certificate(&self) -> Option<&Certificate> {
        self.status.certificate()
    }
}

/// What the door takes: a problem of any kind that has solvers, or an [`AnyProblem`].
pub trait Solvable: Judged {
    /// Solves the problem as `how` says, by the session in `kept` where it fits.
    fn answer(
        &self,
        how: &Solve,
        kept: &mut Kept,
        watch: &mut dyn FnMut(&Progress),
    ) -> Result<Answer<Self>, SolveError>
    where
        Self: Sized;
}

impl<P: Registered + Judged<Point: OfAnyPoint>> Solvable for P {
    fn answer(
        &self,
        how: &Solve,
        kept: &mut Kept,
        watch: &mut dyn FnMut(&Progress),
    ) -> Result<Answer<P>, SolveError> {
        let begun = Instant::now();
        self.validate()?;
        // Nobody knows how long a caller's functions take: whoever asks them here does so within the limits, the judge as well.
        let scope = self.asks_functions().then(|| how.limits.budget(begun).enter());
        let mut session = kept.take::<P>(how)?;
        let mut point = match &how.start {
            None => self.origin(),
            Some(start) => P::Point::of(start).cloned().ok_or_else(|| ProblemError::Shape {
                place: "the point to start from".into(),
                expected: format!("one of a problem {}", self.kind().name()),
                found: "one of another kind".into(),
            })?,
        };
        let outcome = session.solve(self, &mut point, &how.limits, watch)?;
        let verdict = verdict(self, &point, &outcome, &mut *session, &how.limits, begun)?;
        drop(scope);
        let (account, history) = (session.account(), session.history().to_vec());
        let trace = session.trace();
        kept.put(how, session);
        Ok(Answer {
            point,
            status: joined(outcome.status, verdict.solved, || {
                let all = outcome.iterations >= how.limits.max_iterations;
                how.limits.reached(begun).or(all.then_some(Limit::Iterations))
            }),
            verdict,
            iterations: outcome.iterations,
            factorisations: outcome.factorisations,
            seconds: outcome.seconds,
            cpu_seconds: outcome.cpu_seconds,
            account,
            history,
            trace,
        })
    }
}

impl Solvable for AnyProblem {
    fn answer(
        &self,
        how: &Solve,
        kept: &mut Kept,
        watch: &mut dyn FnMut(&Progress),
    ) -> Result<Answer<AnyProblem>, SolveError> {
        with_problem!(self, p => p.answer(how, kept, watch).map(of_any))
    }
}

fn of_any<P: OfAny>(answer: Answer<P>) -> Answer<AnyProblem> {
    Answer {
        point: answer.point.into(),
        status: answer.status,
        verdict: any_verdict::<P>(answer.verdict),
        iterations: answer.iterations,
        factorisations: answer.factorisations,
        seconds: answer.seconds,
        cpu_seconds: answer.cpu_seconds,
        account: answer.account,
        history: answer.history,
        trace: answer.trace,
    }
}

/// The status of a solve by the last verdict on its point: what that does not call solved is not, but ended at the limit that is reached, or without more to say.
fn joined(status: Status, solved: bool, reached: impl FnOnce() -> Option<Limit>) -> Status {
    match status {
        Status::Solved if !solved => match reached() {
            Some(limit) => Status::Limit(limit),
            None => Status::Stalled("the point that was found fails the last check".into()),
        },
        status => status,
    }
}

/// The judge's word on the point, with the gauge of the solve where there is one: nothing is factorised twice. Where the limits leave no time for more it is
/// the measure of the solve alone.
fn verdict<P>(
    problem: &P,
    point: &P::Point,
    outcome: &Outcome,
    session: &mut dyn Session<P>,
    limits: &Limits,
    begun: Instant,
) -> Result<VerdictOf<P>, SolveError>
where
    P: Registered + Judged,
{
    let tolerance = limits.tolerance;
    let alone = || Verdict {
        measure: outcome.measure,
        solved: outcome.status == Status::Solved && outcome.measure.passes(tolerance),
        counts: P::Counts::default(),
        statuses: vec![],
        velocity: problem.partner(point),
        worst: vec![],
    };
    let small = problem.unknowns() <= guard::SMALL;
    let unlimited = limits.time_limit.is_none() && limits.cancel.is_none();
    // Where a limit has passed, nobody waits for a verdict on a large problem, nor for a caller's functions.
    let late = limits.reached(begun).is_some();
    let asks = problem.asks_functions();
    if late && asks {
        return Ok(alone());
    }
    // Exact arithmetic is part of a verdict and ends with the limits; what it could not say again the solve has said.
    let within = |gauge: &mut P::Gauge| {
        let scope = limits.budget(begun).enter();
        let whole = problem.verdict(point, gauge, tolerance);
        if asks && limits.reached(begun).is_some() {
            alone()
        } else if scope.raised() {
            let Verdict { measure, solved, .. } = alone();
            Verdict { measure, solved, ..whole }
        } else {
            whole
        }
    };
    if (small || !late)
        && let Some(gauge) = session.gauge()
    {
        return Ok(within(gauge));
    }
    if small || unlimited {
        return Ok(within(&mut problem.gauge()?));
    }
    let spent = begun.elapsed().as_secs_f64();
    let left = limits.time_limit.map(|t| (t - spent).max(0.0));
    let left = Limits { time_limit: left, ..limits.clone() };
    let copy = (problem.clone(), point.clone());
    match guard::run(&left, || {}, move |_| copy.0.judge(&copy.1, tolerance)) {
        Ok(verdict) => Ok(verdict?),
        Err(Limit::Time | Limit::Cancelled | Limit::Iterations) => Ok(alone()),
    }
}
