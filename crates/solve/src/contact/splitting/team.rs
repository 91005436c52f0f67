//! A team of threads for work that is done again and again in phases.
//!
//! [`Team::share`] forks once and joins once; in between whoever is free takes the next part of the present phase from a counter, so a
//! member that the system has not given a core holds nobody up. The calling thread is a member, so a team of one is a plain loop.
//! What the members share is the caller's matter (locks): phases order, they do not protect.

use std::sync::atomic::{AtomicBool, AtomicUsize, Ordering};
use std::thread;

use rayon::{ThreadPool, ThreadPoolBuilder};

/// Threads that live as long as the workspace.
pub struct Team {
    /// All members but the calling thread.
    others: Option<ThreadPool>,
    size: usize,
}

impl Team {
    /// A team of `threads`, 0 for one a core. Smaller where the system gives no more threads.
    pub fn new(threads: usize) -> Self {
        let size = match threads {
            0 => thread::available_parallelism().map_or(1, usize::from),
            n => n,
        };
        let pool = || ThreadPoolBuilder::new().num_threads(size - 1).build().ok();
        let others = if size > 1 { pool() } else { None };
        Self { size: others.as_ref().map_or(1, |p| p.current_num_threads() + 1), others }
    }

    pub fn size(&self) -> usize {
        self.size
    }

    /// Does `work(phase, part)` for all parts of each phase in turn, on whichever thread is free, and `after(phase)` on the calling
    /// thread between a phase and the next.
    pub fn share(
        &self,
        phases: usize,
        parts: usize,
        work: impl Fn(usize, usize) + Sync,
        mut after: impl FnMut(usize),
    ) {
        let board = Board::default();
        let mut lead = || {
            let _closing = Closing(&board);
            for phase in 0..phases {
                let end = (phase + 1) * parts;
                board.released.store(end, Ordering::Release);
                while let Some(k) = board.take() {
                    work(k / parts, k % parts);
                    board.done.fetch_add(1, Ordering::AcqRel);
                }
                board.wait(|| board.done.load(Ordering::Acquire) >= end);
                after(phase);
            }
        };
        match &self.others {
            None => lead(),
            Some(pool) => pool.in_place_scope(|scope| {
                let (work, board) = (&work, &board);
                scope.spawn_broadcast(move |_, _| {
                    let _leaving = Leaving(board);
                    while !board.closed.load(Ordering::Acquire) {
                        if let Some(k) = board.take() {
                            work(k / parts, k % parts);
                            board.done.fetch_add(1, Ordering::AcqRel);
                        } else {
                            board.wait(|| board.any());
                        }
                    }
                });
                lead();
            }),
        }
    }
}

/// What is to be done: parts are numbered through all phases.
#[derive(Default)]
struct Board {
    released: AtomicUsize,
    taken: AtomicUsize,
    done: AtomicUsize,
    /// Nothing more will come, or somebody has panicked: nobody waits any longer.
    closed: AtomicBool,
}

/// How often a thread looks before it lets others have its core.
const LOOKS: usize = 5000;

impl Board {
    fn any(&self) -> bool {
        self.taken.load(Ordering::Acquire) < self.released.load(Ordering::Acquire)
    }

    /// A part that nobody has taken.
    fn take(&self) -> Option<usize> {
        let free = |k: usize| (k < self.released.load(Ordering::Acquire)).then_some(k + 1);
        self.taken.fetch_update(Ordering::AcqRel, Ordering::Acquire, free).ok()
    }

    fn wait(&self, come: impl Fn() -> bool) {
        let mut looks = 0;
        while !come() && !self.closed.load(Ordering::Acquire) {
            looks += 1;
            if looks < LOOKS {
                std::hint::spin_loop();
            } else {
                thread::yield_now();
            }
        }
    }
}

/// Closes the board when the leader is through, or panics.
struct Closing<'a>(&'a Board);

impl Drop for Closing<'_> {
    fn drop(&mut self) {
        self.0.closed.store(true, Ordering::Release);
    }
}

/// Closes the board if its thread panics, so that the leader does not wait for ever.
struct Leaving<'a>(&'a Board);

impl Drop for Leaving<'_> {
    fn drop(&mut self) {
        if thread::panicking() {
            self.0.closed.store(true, Ordering::Release);
        }
    }
}

#[cfg(test)]
mod tests {
    use std::sync::Mutex;

    use super::*;

    #[test]
    fn all_parts_of_a_phase_are_done_once_and_before_the_next() {
        for threads in [1, 2, 3] {
            let team = Team::new(threads);
            assert_eq!(team.size(), threads);
            let log = Mutex::new(vec![]);
            let note = |phase, part| log.lock().unwrap().push((phase, part));
            team.share(50, 4, note, |phase| note(phase, 4));
            let mut log = log.into_inner().unwrap();
            for of_phase in log.chunks_mut(5) {
                assert_eq!(of_phase[4].1, 4, "what comes after came before");
                of_phase.sort_unstable();
            }
            assert!(log.into_iter().eq((0..50).flat_map(|p| (0..5).map(move |k| (p, k)))));
        }
    }

    #[test]
    fn a_panic_reaches_the_caller_and_leaves_nobody_waiting() {
        let team = Team::new(2);
        let caught = std::panic::catch_unwind(std::panic::AssertUnwindSafe(|| {
            team.share(3, 2, |phase, part| assert!((phase, part) != (1, 1), "meant to be"), |_| ());
        }));
        assert!(caught.is_err());
    }
}
