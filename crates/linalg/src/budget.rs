//! What the computation of this thread may still use: time, memory for one factorisation, and threads for large ones.
//!
//! A loop that looks at its limits between two steps is late by the length of a step, which may be a factorisation of a minute. So whoever
//! has limits installs them for a scope ([`Budget::enter`]), and kernels ask ([`over`]) wherever some milliseconds of work have passed. They then
//! return early with the error that they have for a matrix that cannot be factorised; who installed the budget knows better what that means.

use std::cell::{Cell, RefCell};
use std::sync::atomic::{AtomicBool, AtomicU64, Ordering};
use std::sync::{Arc, Mutex, PoisonError};
use std::time::Instant;

use rayon::{ThreadPool, ThreadPoolBuilder};

/// Limits of a computation; each may be absent.
#[derive(Debug, Clone, Default)]
pub struct Budget {
    /// When it is over.
    pub deadline: Option<Instant>,
    /// Set to true from anywhere to end it.
    pub cancel: Option<Arc<AtomicBool>>,
    /// The bytes that one factorisation may take; without a number, what the machine has free when it begins.
    pub memory: Option<u64>,
    /// Threads that one large kernel may use; its results are the same bits for any number. 0 and 1: the present thread alone.
    pub threads: usize,
}

thread_local! {
    static CURRENT: RefCell<Budget> = const {
        RefCell::new(Budget { deadline: None, cancel: None, memory: None, threads: 0 })
    };
    /// Whether there is a deadline or a flag to look at.
    static ARMED: Cell<bool> = const { Cell::new(false) };
    /// Whether a kernel of the present scope has been told that it is over.
    static RAISED: Cell<bool> = const { Cell::new(false) };
    /// The last factorisation that was refused in the present scope.
    static REFUSED: Cell<Option<TooLarge>> = const { Cell::new(None) };
    /// The number of the outermost scope, 0 outside of all.
    static COMPUTATION: Cell<u64> = const { Cell::new(0) };
}

/// Outermost scopes so far, of all threads.
static COMPUTATIONS: AtomicU64 = AtomicU64::new(0);

/// The number of the computation that the present thread is in, that is of its outermost scope: what a function has said is remembered for as long as it stays the same, since between two
/// computations the caller may have changed what the function goes by. `None` outside of all scopes.
pub fn computation() -> Option<std::num::NonZeroU64> {
    std::num::NonZeroU64::new(COMPUTATION.get())
}

/// A budget in force; what was in force before returns when it is dropped.
#[derive(Debug)]
pub struct Scope {
    before: Budget,
    /// The number of the computation outside.
    outside: u64,
    raised: bool,
    refused: Option<TooLarge>,
    /// The scope belongs to the thread that entered it.
    here: std::marker::PhantomData<*const ()>,
}

impl Budget {
    /// Puts this budget in force on the present thread, for as long as the scope lives. What an outer scope asks holds as well. Allocates nothing.
    #[must_use = "the budget ends with its scope"]
    pub fn enter(&self) -> Scope {
        let before = CURRENT.take();
        let earlier = |a: Instant, b: Instant| a.min(b);
        let now = Self {
            deadline: match (self.deadline, before.deadline) {
                (Some(a), Some(b)) => Some(earlier(a, b)),
                (a, b) => a.or(b),
            },
            cancel: self.cancel.clone().or_else(|| before.cancel.clone()),
            memory: match (self.memory, before.memory) {
                (Some(a), Some(b)) => Some(a.min(b)),
                (a, b) => a.or(b),
            },
            threads: self.threads.max(before.threads),
        };
        ARMED.set(now.deadline.is_some() || now.cancel.is_some());
        CURRENT.set(now);
        let outside = COMPUTATION.get();
        if outside == 0 {
            COMPUTATION.set(1 + COMPUTATIONS.fetch_add(1, Ordering::Relaxed));
        }
        Scope {
            before,
            outside,
            raised: RAISED.replace(false),
            refused: REFUSED.replace(None),
            here: std::marker::PhantomData,
        }
    }

    /// Whether the deadline has passed or the flag is set.
    pub fn is_over(&self) -> bool {
        self.cancel.as_ref().is_some_and(|flag| flag.load(Ordering::Relaxed))
            || self.deadline.is_some_and(|deadline| Instant::now() >= deadline)
    }
}

impl Scope {
    /// Whether the flag to cancel is set, rather than the deadline passed.
    pub fn cancelled(&self) -> bool {
        let set = |flag: &Arc<AtomicBool>| flag.load(Ordering::Relaxed);
        CURRENT.with_borrow(|budget| budget.cancel.as_ref().is_some_and(set))
    }

    /// Whether a kernel was told to return early, so that what it left is of no use.
    pub fn raised(&self) -> bool {
        RAISED.get()
    }

    /// The last factorisation that was refused for its size.
    pub fn refused(&self) -> Option<TooLarge> {
        REFUSED.get()
    }
}

impl Drop for Scope {
    fn drop(&mut self) {
        let before = std::mem::take(&mut self.before);
        ARMED.set(before.deadline.is_some() || before.cancel.is_some());
        // What an outer limit cut short inside was cut short outside too; what the inner scope gave itself is its own matter.
        RAISED.set(self.raised || (RAISED.get() && before.is_over()));
        CURRENT.set(before);
        COMPUTATION.set(self.outside);
        REFUSED.set(REFUSED.get().or(self.refused));
    }
}

/// The budget in force, to be entered by a thread that works for this one.
pub fn current() -> Budget {
    CURRENT.with_borrow(Budget::clone)
}

/// The threads that a kernel of the present thread may use: one on a thread of a pool, whose neighbours have work of their own.
pub fn threads() -> usize {
    match rayon::current_thread_index() {
        Some(_) => 1,
        None => CURRENT.with_borrow(|budget| budget.threads).max(1),
    }
}

/// Pools of threads by the process that made them: a fork has none of its parent's threads.
static TEAMS: Mutex<Vec<(u32, Arc<ThreadPool>)>> = Mutex::new(vec![]);

/// These [`threads`], where they are several, as a pool: made at first use, and kept.
pub(crate) fn team() -> Option<Arc<ThreadPool>> {
    let threads = threads();
    if threads < 2 {
        return None;
    }
    let process = std::process::id();
    let mut teams = TEAMS.lock().unwrap_or_else(PoisonError::into_inner);
    let found = teams.iter().find(|(p, t)| *p == process && t.current_num_threads() == threads);
    if let Some((_, team)) = found {
        return Some(team.clone());
    }
    let team = Arc::new(ThreadPoolBuilder::new().num_threads(threads).build().ok()?);
    teams.push((process, team.clone()));
    Some(team)
}

/// Lets all [`threads`] do `lane`, this one among them, each under the same limits; this one alone where more are not `worth` it. What
/// another thread was told of a limit this one has yet to ask for.
pub(crate) fn on_all(worth: bool, lane: impl Fn() + Sync) {
    let Some(team) = worth.then(team).flatten() else { return lane() };
    let budget = current();
    team.in_place_scope(|scope| {
        for _ in 1..team.current_num_threads() {
            scope.spawn(|_| {
                let _scope = budget.enter();
                lane();
            });
        }
        lane();
    });
}

/// Whether the computation is to end now. Costs some 30 ns where there is a limit, 1 ns where there is none.
#[inline]
pub fn over() -> bool {
    ARMED.get() && look()
}

#[cold]
fn look() -> bool {
    let over = CURRENT.with_borrow(Budget::is_over);
    if over {
        RAISED.set(true);
    }
    over
}

/// Asks [`over`] each time that some milliseconds of work have been done, by a count of operations.
#[derive(Debug, Clone, Copy, Default)]
pub struct Pace {
    done: f64,
}

/// Operations between two looks: a millisecond or so.
const PACE: f64 = 2e6;

impl Pace {
    /// Takes note of `operations`; true where it is time to end.
    #[inline]
    pub fn over(&mut self, operations: f64) -> bool {
        self.done += operations;
        if self.done < PACE {
            return false;
        }
        self.done = 0.0;
        over()
    }
}

/// A factorisation that is refused before it begins.
#[derive(Debug, Clone, Copy, PartialEq, thiserror::Error)]
#[error("{what} would take about {} of memory, {}", bytes_in_words(*.needed), allowed_in_words(*.allowed, *.free))]
pub struct TooLarge {
    /// What was asked for.
    pub what: &'static str,
    /// Its estimate in bytes.
    pub needed: f64,
    /// What it may take.
    pub allowed: f64,
    /// Whether that is what the machine has free, rather than a limit that somebody set.
    pub free: bool,
}

fn allowed_in_words(allowed: f64, free: bool) -> String {
    let allowed = bytes_in_words(allowed);
    if free {
        format!("and the machine has {allowed} free")
    } else {
        format!("and the memory limit is {allowed}")
    }
}

/// A number of bytes in the unit that suits it.
pub fn bytes_in_words(bytes: f64) -> String {
    match bytes {
        b if b < 1024.0 => format!("{b:.0} B"),
        b if b < 1024.0 * 1024.0 => format!("{:.0} KB", b / 1024.0),
        b if b < 1024.0 * 1024.0 * 1024.0 => format!("{:.0} MB", b / (1024.0 * 1024.0)),
        b => format!("{:.1} GB", b / (1024.0 * 1024.0 * 1024.0)),
    }
}

/// Below this, nobody asks what the machine has free.
const HARMLESS: f64 = 64e6;

/// What may be taken, and whether that is what the machine has free; `None` where `needed` bytes need no question.
fn allowed(needed: f64) -> Option<(f64, bool)> {
    match CURRENT.with_borrow(|budget| budget.memory) {
        Some(limit) => Some((limit as f64, false)),
        None if needed < HARMLESS => None,
        None => Some((free_memory().unwrap_or(f64::INFINITY), true)),
    }
}

/// Whether `needed` bytes may be taken, with no word about it: a first look with an upper bound.
pub fn fits(needed: f64) -> bool {
    allowed(needed).is_none_or(|(allowed, _)| needed <= allowed)
}

/// Whether about `needed` bytes may be taken for `what`: within the memory of the budget in force or, where that has none, within what the machine has free.
pub fn admit(what: &'static str, needed: f64) -> Result<(), TooLarge> {
    match allowed(needed) {
        Some((allowed, free)) if needed > allowed => {
            let refused = TooLarge { what, needed, allowed, free };
            REFUSED.set(Some(refused));
            Err(refused)
        }
        _ => Ok(()),
    }
}

/// What this machine has free, in bytes; `None` where it does not say. A control group's limit counts.
pub fn free_memory() -> Option<f64> {
    let text = std::fs::read_to_string("/proc/meminfo").ok()?;
    let line = text.lines().find_map(|line| line.strip_prefix("MemAvailable:"))?;
    let kilobytes: f64 = line.trim().trim_end_matches("kB").trim().parse().ok()?;
    let number = |path: &str| std::fs::read_to_string(path).ok()?.trim().parse::<f64>().ok();
    let group = number("/sys/fs/cgroup/memory.max")
        .zip(number("/sys/fs/cgroup/memory.current"))
        .map_or(f64::INFINITY, |(most, now)| (most - now).max(0.0));
    Some((1024.0 * kilobytes).min(group))
}

#[cfg(test)]
mod tests {
    use std::time::Duration;

    use super::*;

    #[test]
    fn a_scope_arms_and_disarms() {
        assert!(!over());
        let flag = Arc::new(AtomicBool::new(false));
        let budget = Budget { cancel: Some(flag.clone()), ..Budget::default() };
        {
            let scope = budget.enter();
            assert!(!over() && !scope.raised());
            flag.store(true, Ordering::Relaxed);
            assert!(over() && scope.raised());
        }
        assert!(!over());
    }

    #[test]
    fn inner_scopes_keep_what_outer_ones_ask() {
        let past = Some(Instant::now() - Duration::from_secs(1));
        let outer = Budget { deadline: past, memory: Some(1000), ..Budget::default() };
        let _outer = outer.enter();
        let later = Some(Instant::now() + Duration::from_secs(100));
        let inner = Budget { deadline: later, memory: Some(2000), ..Budget::default() };
        let _inner = inner.enter();
        assert!(over());
        assert_eq!(current().memory, Some(1000));
    }

    #[test]
    fn what_an_inner_scope_gave_itself_does_not_end_the_outer_one() {
        let past = Some(Instant::now() - Duration::from_secs(1));
        let outer = Budget::default().enter();
        {
            let inner = Budget { deadline: past, ..Budget::default() }.enter();
            assert!(over() && inner.raised());
        }
        assert!(!over() && !outer.raised());
        let flag = Arc::new(AtomicBool::new(false));
        let cancelled = Budget { cancel: Some(flag.clone()), ..Budget::default() }.enter();
        {
            let _inner = Budget { deadline: past, ..Budget::default() }.enter();
            flag.store(true, Ordering::Relaxed);
            assert!(over());
        }
        assert!(cancelled.raised());
    }

    #[test]
    fn what_is_too_large_is_refused_with_its_estimate() {
        assert_eq!(admit("the factor", 1e6), Ok(()));
        let budget = Budget { memory: Some(100 * 1024 * 1024), ..Budget::default() };
        let _scope = budget.enter();
        assert_eq!(admit("the factor", 1e8), Ok(()));
        let refused = admit("the factor", 3e9).unwrap_err().to_string();
        assert_eq!(
            refused,
            "the factor would take about 2.8 GB of memory, and the memory limit is 100 MB"
        );
        drop(_scope);
        let refused = admit("the factor", 1e18).unwrap_err().to_string();
        assert!(refused.contains("free"), "{refused}");
    }

    #[test]
    fn paces_look_now_and_then() {
        let budget = Budget { deadline: Some(Instant::now()), ..Budget::default() };
        let _scope = budget.enter();
        let mut pace = Pace::default();
        assert!(!pace.over(1e3));
        assert!(pace.over(1e7));
    }
}
