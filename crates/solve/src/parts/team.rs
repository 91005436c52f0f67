//! A team of threads for work that is done again and again in phases.
//!
//! [`Team::run`] forks once and joins once; in between the members meet at a barrier that spins for a moment and then yields, which
//! costs well under a microsecond where each has a core. The calling thread is member 0, so a team of one is a plain call.
//! What the members share is the caller's matter (locks): a meeting orders, it does not protect.

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

    /// The number of members.
    pub fn size(&self) -> usize {
        self.size
    }

    /// Calls `work(member, meeting)` on every member at the same time, and returns when all have returned.
    pub fn run(&self, work: impl Fn(usize, &Meeting) + Sync) {
        let meeting = Meeting::new(self.size);
        match &self.others {
            None => work(0, &meeting),
            Some(pool) => pool.in_place_scope(|scope| {
                let (work, meeting) = (&work, &meeting);
                scope.spawn_broadcast(move |_, context| {
                    let _leaving = Leaving(meeting);
                    work(context.index() + 1, meeting);
                });
                let _leaving = Leaving(meeting);
                work(0, meeting);
            }),
        }
    }
}

/// A barrier that serves any number of times.
pub struct Meeting {
    size: usize,
    arrived: AtomicUsize,
    held: AtomicUsize,
    /// A member has panicked: nobody waits any longer.
    broken: AtomicBool,
}

/// How often a member looks before it lets others have its core.
const SPINS: usize = 5000;

impl Meeting {
    fn new(size: usize) -> Self {
        Self {
            size,
            arrived: AtomicUsize::new(0),
            held: AtomicUsize::new(0),
            broken: AtomicBool::new(false),
        }
    }

    /// Waits until all members are here.
    pub fn wait(&self) {
        if self.size == 1 {
            return;
        }
        let held = self.held.load(Ordering::Acquire);
        if self.arrived.fetch_add(1, Ordering::AcqRel) + 1 == self.size {
            self.arrived.store(0, Ordering::Relaxed);
            self.held.store(held.wrapping_add(1), Ordering::Release);
            return;
        }
        let mut looks = 0;
        while self.held.load(Ordering::Acquire) == held && !self.broken.load(Ordering::Relaxed) {
            looks += 1;
            if looks < SPINS {
                std::hint::spin_loop();
            } else {
                thread::yield_now();
            }
        }
    }
}

/// Breaks the meeting up if its member panics, so that the others do not wait for ever.
struct Leaving<'a>(&'a Meeting);

impl Drop for Leaving<'_> {
    fn drop(&mut self) {
        if thread::panicking() {
            self.0.broken.store(true, Ordering::Relaxed);
        }
    }
}

#[cfg(test)]
mod tests {
    use std::sync::Mutex;

    use super::*;

    #[test]
    fn all_members_do_each_phase_before_any_does_the_next() {
        for threads in [1, 2, 3] {
            let team = Team::new(threads);
            assert_eq!(team.size(), threads);
            let log = Mutex::new(vec![]);
            team.run(|member, meeting| {
                for phase in 0..50 {
                    log.lock().unwrap().push((phase, member));
                    meeting.wait();
                }
            });
            let mut log = log.into_inner().unwrap();
            assert!(log.is_sorted_by_key(|(phase, _)| *phase));
            log.sort_unstable();
            let all = (0..50).flat_map(|p| (0..threads).map(move |m| (p, m)));
            assert!(log.into_iter().eq(all));
        }
    }

    #[test]
    fn a_panic_reaches_the_caller_and_leaves_nobody_waiting() {
        let team = Team::new(2);
        for culprit in [0, 1] {
            let caught = std::panic::catch_unwind(std::panic::AssertUnwindSafe(|| {
                team.run(|member, meeting| {
                    assert!(member != culprit, "meant to be");
                    meeting.wait();
                });
            }));
            assert!(caught.is_err());
        }
    }
}
