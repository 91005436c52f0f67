//! Limits that hold whatever is under way.
//!
//! Kernels of this workspace look at their [`budget`](nonsmooth_problem::linalg::budget) every few milliseconds, and the loop after every step. What remains
//! are single calls into libraries (a sparse factorisation, an ordering, an iteration of a cone program) that end when they end: on a large problem after a minute.
//! So the solve of a problem that is large enough for such calls to matter runs on a thread of its own, on a copy of the problem. The caller's thread
//! waits for it, relays its progress, and watches the clock and the flag to cancel. What does not come back soon after the limit is given up: it ends by itself where it next
//! looks at its flag, and the caller gets the best point that was judged.
//!
//! A small problem, and a solve without a limit on time or a flag, runs where it is called: no thread, no copy, no allocation.

use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::mpsc::{RecvTimeoutError, sync_channel};
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};
use std::time::{Duration, Instant};

use cpu_time::ProcessTime;
use nonsmooth_problem::Problem;
use nonsmooth_problem::check::Measure;

use crate::registry::{self, Registered};
use crate::settings::SettingsMap;
use crate::trace::Trace;
use crate::{Limit, Limits, Observer, Outcome, Progress, Sample, Session, SolveError, Status};

/// Up to this many unknowns, no single operation takes more than some milliseconds.
pub const SMALL: usize = 300;
/// How often the flag to cancel is looked at, and progress relayed.
const TICK: Duration = Duration::from_millis(10);
/// Seconds that a task has after a limit to come back by itself, and the share of the time limit that it has in addition.
const GRACE: f64 = 0.05;
const SHARE: f64 = 0.05;
/// Of the thread: as much as a main thread has.
const STACK: usize = 8 << 20;

/// Runs `task`, which observes the limits that it is given as well as it can, and gives it up where it is late.
///
/// `limits.time_limit` counts from now. The task gets limits of its own: the same time, and a flag that is set when it is given up or when the caller's flag
/// is. `tick` is called about a hundred times a second meanwhile. Without a limit on time and a flag to cancel the task runs on the caller's thread.
///
/// Errors: the limit at which the task was given up.
///
/// # Panics
///
/// Where the task does.
pub fn run<T: Send + 'static>(
    limits: &Limits,
    mut tick: impl FnMut(),
    task: impl FnOnce(&Limits) -> T + Send + 'static,
) -> Result<T, Limit> {
    if limits.time_limit.is_none() && limits.cancel.is_none() {
        return Ok(task(limits));
    }
    let begun = Instant::now();
    let leash = Leash(Arc::new(AtomicBool::new(false)));
    let own = Limits { cancel: Some(leash.0.clone()), ..limits.clone() };
    let (give, take) = sync_channel(1);
    // Where no thread is to be had, the task runs here.
    let task = Arc::new(Mutex::new(Some(task)));
    let theirs = (task.clone(), own.clone());
    let thread = std::thread::Builder::new().stack_size(STACK).spawn(move || {
        let (task, own) = theirs;
        let task = locked(&task).take();
        if let Some(task) = task {
            // A caller who has given up listens no more.
            let _ = give.send(task(&own));
        }
    });
    let thread = match thread {
        Ok(thread) => thread,
        Err(_) => {
            let task = locked(&task).take().expect("not taken by a thread that was not made");
            return Ok(task(limits));
        }
    };
    let grace = GRACE + SHARE * limits.time_limit.unwrap_or(0.0).min(20.0);
    let grace = Duration::from_secs_f64(grace);
    // The limit that is reached, and when it was noticed.
    let mut late: Option<(Limit, Instant)> = None;
    loop {
        match take.recv_timeout(TICK) {
            Ok(result) => return Ok(result),
            Err(RecvTimeoutError::Disconnected) => match thread.join() {
                Err(panic) => std::panic::resume_unwind(panic),
                Ok(()) => unreachable!("a task sends before it ends"),
            },
            Err(RecvTimeoutError::Timeout) => {}
        }
        tick();
        match late {
            None => {
                late = limits.reached(begun).map(|limit| (limit, Instant::now()));
                if let Some((Limit::Cancelled, _)) = late {
                    leash.0.store(true, Ordering::Relaxed);
                }
            }
            Some((limit, since)) if since.elapsed() >= grace => return Err(limit),
            Some(_) => {}
        }
    }
}

/// A flag that is set when its owner is gone, whatever the reason.
struct Leash(Arc<AtomicBool>);

impl Drop for Leash {
    fn drop(&mut self) {
        self.0.store(true, Ordering::Relaxed);
    }
}

/// What a thread that panicked left is whole all the same: it is written in one go.
fn locked<T>(mutex: &Mutex<T>) -> MutexGuard<'_, T> {
    mutex.lock().unwrap_or_else(PoisonError::into_inner)
}

/// A session that keeps its limits.
pub(crate) struct Guarded<P: Registered> {
    /// None where it was given up: the next solve makes another one.
    session: Option<Box<dyn Session<P>>>,
    name: String,
    settings: SettingsMap,
    /// Of a solve that was given up.
    history: Vec<Sample>,
    account: Vec<String>,
}

/// What the two threads share.
struct Seen<P: Problem> {
    /// Whether the caller's thread asks for progress.
    asked: AtomicBool,
    told: Mutex<Told<P>>,
}

struct Told<P: Problem> {
    progress: Option<Progress>,
    best: Option<(P::Point, Measure)>,
}

/// The observer on the thread of the solve.
struct Relay<P: Problem>(Arc<Seen<P>>);

impl<P: Problem> Observer<P> for Relay<P> {
    fn step(&mut self, progress: &Progress) {
        if self.0.asked.load(Ordering::Relaxed) {
            locked(&self.0.told).progress = Some(*progress);
            self.0.asked.store(false, Ordering::Relaxed);
        }
    }

    fn keeps_best(&self) -> bool {
        true
    }

    fn best(&mut self, point: &P::Point, measure: &Measure) {
        let mut told = locked(&self.0.told);
        match &mut told.best {
            Some((kept, of)) => {
                P::copy_point(point, kept);
                *of = *measure;
            }
            none => *none = Some((point.clone(), *measure)),
        }
    }
}

impl<P: Registered> Guarded<P> {
    pub(crate) fn new(session: Box<dyn Session<P>>, name: &str, settings: &SettingsMap) -> Self {
        Self {
            session: Some(session),
            name: name.into(),
            settings: settings.clone(),
            history: vec![],
            account: vec![],
        }
    }
}

impl<P: Registered> Session<P> for Guarded<P> {
    fn observe(
        &mut self,
        problem: &P,
        point: &mut P::Point,
        limits: &Limits,
        observer: &mut dyn Observer<P>,
    ) -> Result<Outcome, SolveError> {
        limits.validate()?;
        let mut session = match self.session.take() {
            Some(session) => session,
            None => registry::bare(&self.name, &self.settings)?,
        };
        let unlimited = limits.time_limit.is_none() && limits.cancel.is_none();
        if unlimited || problem.unknowns() <= SMALL {
            let outcome = session.observe(problem, point, limits, observer);
            self.session = Some(session);
            return outcome;
        }
        let (wall, cpu) = (Instant::now(), ProcessTime::now());
        self.history.clear();
        self.account.clear();
        let told = Mutex::new(Told { progress: None, best: None });
        let seen = Arc::new(Seen { asked: AtomicBool::new(true), told });
        let copy = (problem.clone(), point.clone(), seen.clone());
        let left = limits.time_limit.map(|t| t - wall.elapsed().as_secs_f64());
        let left = Limits { time_limit: left.map(|t| t.max(0.0)), ..limits.clone() };
        let history = &mut self.history;
        let mut last = None;
        let tick = || {
            let progress = locked(&seen.told).progress.take();
            if let Some(progress) = progress {
                seen.asked.store(true, Ordering::Relaxed);
                if history.last().is_none_or(|s: &Sample| *s != progress.judged) {
                    history.push(progress.judged);
                }
                last = Some(progress);
                observer.step(&progress);
            }
        };
        let done = run(&left, tick, move |limits| {
            let (problem, mut point, seen) = copy;
            let outcome = session.observe(&problem, &mut point, limits, &mut Relay(seen));
            (session, point, outcome)
        });
        match done {
            Ok((session, found, outcome)) => {
                self.session = Some(session);
                P::copy_point(&found, point);
                outcome
            }
            Err(limit) => {
                let best = locked(&seen.told).best.take();
                let measure = match best {
                    Some((best, measure)) => {
                        P::copy_point(&best, point);
                        measure
                    }
                    None => Measure::unknown(),
                };
                self.account.push(format!(
                    "{} was given up in the middle of an operation that cannot be interrupted",
                    self.name
                ));
                let solved = measure.passes(limits.tolerance);
                Ok(Outcome {
                    status: if solved { Status::Solved } else { Status::Limit(limit) },
                    measure,
                    iterations: last.map_or(0, |p| p.iteration),
                    // Those of the other thread are not known here.
                    factorisations: 0,
                    seconds: wall.elapsed().as_secs_f64(),
                    cpu_seconds: cpu.elapsed().as_secs_f64(),
                })
            }
        }
    }

    fn history(&self) -> &[Sample] {
        self.session.as_ref().map_or(&self.history, |session| session.history())
    }

    fn trace(&self) -> Trace {
        self.session.as_ref().map_or(Trace::None, |session| session.trace())
    }

    fn account(&self) -> Vec<String> {
        self.session.as_ref().map_or_else(|| self.account.clone(), |session| session.account())
    }
}
