//! When a solve is to stop.

use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::time::{Duration, Instant};

use nonsmooth_linalg::budget::Budget;

use crate::SolveError;

/// When to stop.
#[derive(Debug, Clone)]
pub struct Limits {
    /// The relative residual (unit-free, see [`Measure`](nonsmooth_problem::check::Measure)) to reach. Nominal 1e-3 … 1e-12; below about 1e-14
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
    /// Whether to keep the method's own record of its iterations ([`Session::trace`](crate::Session::trace)); it grows with their number.
    pub trace: bool,
    /// Whether to read the processor's clock too ([`Outcome::cpu_seconds`](crate::Outcome::cpu_seconds)), which costs two system calls: as much as a small contact problem.
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
        self.reached_at(begun, Instant::now)
    }

    /// The same at `now`, which is asked for where there is a limit on time: a look at the clock costs 25 ns, and a contact problem may take 1000.
    pub(super) fn reached_at(
        &self,
        begun: Instant,
        now: impl FnOnce() -> Instant,
    ) -> Option<Limit> {
        let late = |t: f64| now().duration_since(begun).as_secs_f64() >= t;
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
