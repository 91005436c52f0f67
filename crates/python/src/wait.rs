//! Waiting for a computation on another thread, so that Ctrl-C is seen and the user's functions run on the thread that asked.

use std::sync::atomic::Ordering;
use std::sync::mpsc::{RecvTimeoutError, channel, sync_channel};
use std::time::Duration;

use pyo3::prelude::*;

use crate::function::Watcher;

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

/// Runs a task on another thread. `hear` is called on this one with each piece of news, until which the task waits, and with nothing every [`TICK`].
/// Python must have been let go of.
pub fn elsewhere<N: Send + 'static, T: Send + 'static>(
    mut hear: impl FnMut(Option<N>),
    task: impl FnOnce(&mut dyn FnMut(N)) -> T + Send + 'static,
) -> T {
    enum Said<N, T> {
        News(N),
        Done(Box<T>),
    }
    let (say, listen) = channel();
    let (heard, go_on) = sync_channel::<()>(0);
    let thread = std::thread::spawn(move || {
        let news = say.clone();
        let done = task(&mut |one| {
            if news.send(Said::News(one)).is_ok() {
                // Until it was heard; an error is that nobody waits any more.
                let _ = go_on.recv();
            }
        });
        let _ = say.send(Said::Done(Box::new(done)));
    });
    loop {
        match listen.recv_timeout(TICK) {
            Ok(Said::Done(done)) => {
                // A thread that has sent what it found does nothing more.
                let _ = thread.join();
                return *done;
            }
            Ok(Said::News(news)) => {
                hear(Some(news));
                let _ = heard.send(());
            }
            Err(RecvTimeoutError::Timeout) => hear(None),
            Err(RecvTimeoutError::Disconnected) => match thread.join() {
                Err(panic) => std::panic::resume_unwind(panic),
                Ok(()) => unreachable!("a task ends with what it found"),
            },
        }
    }
}
