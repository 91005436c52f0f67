//! Limits that hold whatever is under way.
//!
//! Kernels of this workspace look at their [`budget`](nonsmooth_linalg::budget) every few milliseconds, and the loop after every step. What remains
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

use nonsmooth_linalg::budget::Budget;

use crate::{Limit, Limits};

/// Up to this many unknowns, no single operation takes more than some milliseconds.
pub const SMALL: usize = 300;
/// How often the flag to cancel is looked at, and progress relayed.
const TICK: Duration = Duration::from_millis(5);
/// Seconds that a task has after a limit to come back by itself, and the share of the time limit that it has in addition.
const GRACE: f64 = 0.04;
const SHARE: f64 = 0.01;
/// The same after Ctrl-C, when somebody waits.
const CANCELLED: f64 = 0.1;
/// The same where there is no time from the start: what can be had at once.
const AT_ONCE: f64 = 0.02;
/// Of the thread: as much as a main thread has.
const STACK: usize = 8 << 20;

/// Runs `task`, which observes the limits that it is given as well as it can, and gives it up where it is late.
///
/// `limits.time_limit` counts from now. The task gets limits of its own: the same time, and a flag that is set when it is given up or when the caller's flag
/// is. `tick` is called some hundred times a second meanwhile. Without a limit on time and a flag to cancel the task runs on the caller's thread.
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
    let result = Arc::new(Mutex::new(None));
    let theirs = result.clone();
    let task = move |limits: &Limits| {
        let result = task(limits);
        *locked(&theirs) = Some(result);
    };
    watched(limits, &mut tick, Box::new(task))?;
    let result = locked(&result).take();
    Ok(result.expect("a task that came back has left its result"))
}

type Task = Box<dyn FnOnce(&Limits) + Send>;

/// [`run`], of tasks that say nothing, so that it is compiled once.
fn watched(limits: &Limits, tick: &mut dyn FnMut(), task: Task) -> Result<(), Limit> {
    let begun = Instant::now();
    let leash = Leash(Arc::new(AtomicBool::new(false)));
    let own = Limits { cancel: Some(leash.0.clone()), ..limits.clone() };
    // Nobody hears of what kernels cut short for this one.
    let given_up = Leash(Arc::new(AtomicBool::new(false)));
    let alone = Budget { cancel: Some(given_up.0.clone()), ..Budget::default() };
    let (give, take) = sync_channel(1);
    // Where no thread is to be had, the task runs here.
    let task = Arc::new(Mutex::new(Some(task)));
    let theirs = (task.clone(), own.clone());
    let thread = std::thread::Builder::new().stack_size(STACK).spawn(move || {
        let (task, own) = theirs;
        let task = locked(&task).take();
        let _scope = alone.enter();
        if let Some(task) = task {
            task(&own);
            // A caller who has given up listens no more.
            let _ = give.send(());
        }
    });
    let thread = match thread {
        Ok(thread) => thread,
        Err(_) => {
            let task = locked(&task).take().expect("not taken by a thread that was not made");
            task(limits);
            return Ok(());
        }
    };
    let at_once = limits.reached(begun).is_some();
    let time = limits.time_limit.unwrap_or(0.0);
    let grace = |limit| {
        Duration::from_secs_f64(match limit {
            _ if at_once => AT_ONCE,
            Limit::Cancelled => CANCELLED,
            Limit::Time | Limit::Iterations => GRACE + SHARE * time.min(20.0),
        })
    };
    // The limit that is reached, and when it was noticed.
    let mut late: Option<(Limit, Instant)> = None;
    loop {
        match take.recv_timeout(TICK) {
            Ok(()) => return Ok(()),
            Err(RecvTimeoutError::Disconnected) => match thread.join() {
                Err(panic) => std::panic::resume_unwind(panic),
                Ok(()) => unreachable!("a thread sends before it ends"),
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
            Some((limit, since)) if since.elapsed() >= grace(limit) => return Err(limit),
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
pub(crate) fn locked<T>(mutex: &Mutex<T>) -> MutexGuard<'_, T> {
    mutex.lock().unwrap_or_else(PoisonError::into_inner)
}
