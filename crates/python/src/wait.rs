//! Waiting for a computation on another thread, so that Ctrl-C is seen and the user's functions run on the thread that asked.

use std::panic::{AssertUnwindSafe, catch_unwind, resume_unwind};
use std::sync::atomic::Ordering;
use std::sync::mpsc::{RecvTimeoutError, SendError, Sender, channel, sync_channel};
use std::sync::{Mutex, MutexGuard};
use std::time::Duration;

use pyo3::prelude::*;

use crate::function::{Watcher, locked};

/// How often Ctrl-C is looked for.
pub const TICK: Duration = Duration::from_millis(20);

/// Asks Python: whether Ctrl-C was pressed and what the user's function says; what is true, or raised, ends the computation.
pub fn ask(watcher: &Watcher, user: impl FnOnce(Python<'_>) -> PyResult<bool>) {
    let asked = Python::try_attach(|py| {
        py.check_signals()?;
        user(py)
    });
    match asked {
        Some(Ok(false)) => {}
        Some(Ok(true)) | None => watcher.stop.store(true, Ordering::Relaxed),
        Some(Err(fault)) => watcher.fail(fault),
    }
}

/// What a thread does; it calls what it is handed when it has no more to do than to say what it found.
type Job = Box<dyn FnOnce(&dyn Fn()) + Send>;

/// The threads of a process that have nothing to do: to wake one takes less than a step of a small simulation, to make one takes more.
struct Idle {
    /// A process that was forked has none of the threads that its list tells of.
    process: u32,
    threads: Vec<Sender<Job>>,
}

static IDLE: Mutex<Idle> = Mutex::new(Idle { process: 0, threads: vec![] });

impl Idle {
    fn now() -> MutexGuard<'static, Self> {
        let mut idle = locked(&IDLE);
        let process = std::process::id();
        if idle.process != process {
            *idle = Self { process, threads: vec![] };
        }
        idle
    }

    /// Has a job done by one of them, or by a new one, which then is one of them.
    fn give(job: Job) {
        let idle = Self::now().threads.pop();
        match idle {
            None => Self::hire(job),
            Some(thread) => {
                if let Err(SendError(job)) = thread.send(job) {
                    Self::hire(job);
                }
            }
        }
    }

    fn hire(first: Job) {
        let (give, jobs) = channel();
        std::thread::spawn(move || {
            let rest = || Self::now().threads.push(give.clone());
            first(&rest);
            jobs.iter().for_each(|job: Job| job(&rest));
        });
    }
}

/// Runs a task on another thread. `hear` is called on this one with each piece of news, until which the task waits, and with nothing every [`TICK`].
/// Python must have been let go of.
pub fn elsewhere<N: Send + 'static, T: Send + 'static>(
    mut hear: impl FnMut(Option<N>),
    task: impl FnOnce(&mut dyn FnMut(N)) -> T + Send + 'static,
) -> T {
    enum Said<N, T> {
        News(N),
        Done(std::thread::Result<Box<T>>),
    }
    let (say, listen) = channel();
    let (heard, go_on) = sync_channel::<()>(0);
    Idle::give(Box::new(move |rest| {
        let mut tell = |one| {
            if say.send(Said::News(one)).is_ok() {
                // Until it was heard; an error is that nobody waits any more.
                let _ = go_on.recv();
            }
        };
        let done = catch_unwind(AssertUnwindSafe(|| Box::new(task(&mut tell))));
        rest();
        let _ = say.send(Said::Done(done));
    }));
    loop {
        match listen.recv_timeout(TICK) {
            Ok(Said::Done(Ok(done))) => return *done,
            Ok(Said::Done(Err(panic))) => resume_unwind(panic),
            Ok(Said::News(news)) => {
                hear(Some(news));
                let _ = heard.send(());
            }
            Err(RecvTimeoutError::Timeout) => hear(None),
            Err(RecvTimeoutError::Disconnected) => unreachable!("a task says what it found"),
        }
    }
}
