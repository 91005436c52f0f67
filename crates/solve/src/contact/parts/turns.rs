//! Visits of contacts by several threads, those of each place in the same order as by one.
//!
//! A visit reads and writes a few places (the bodies that the contact touches) and nothing else that others write. So the visits of one place
//! have to come in turn, and what comes of them is the same, bit by bit, whoever makes them and whatever happens elsewhere meanwhile: Gauss–Seidel in the order given.
//!
//! The contacts are cut into one set a thread, by breadth from a contact on the rim. In each set they are put in an order that keeps the order at every place, as a list
//! schedule (Graham1969) of visits of equal length finds it: of those whose turn has come, the first in the order given, where what another thread makes is taken to arrive late. So threads
//! hardly ever wait, and places that are near in memory are visited one after the other. Only where a place belongs to several sets has it a counter of visits, and a visit waits until the counter
//! has come to its turn. The first visit that is not made yet, in the order of one thread, never has to wait: so there is no deadlock. Sweeps need not end together.
//!
//! Cost: a few passes over contacts and places and a heap for the schedule, some 0.3 µs a contact; a visit at a cut loads and stores a counter a place.

use std::cmp::Reverse;
use std::collections::{BinaryHeap, HashMap};
use std::sync::atomic::{AtomicBool, AtomicU64, Ordering};
use std::sync::{Mutex, PoisonError};
use std::thread;
use std::time::{Duration, Instant};

use nonsmooth_linalg::budget;
use rayon::ThreadPool;

use crate::contact::form::AHEAD;

/// What another thread makes is taken to arrive so many visits later: visits differ in length.
const LATE: u32 = 30;
/// Threads that the schedule leaves idle for more than this share of the time gain too little.
const MOST_IDLE: f64 = 0.25;
/// Visits between two looks at the time: some tens of microseconds.
const LOOK_EVERY: usize = 256;
/// How often a thread looks for its turn before it lets others have its core: some microseconds.
const LOOKS: usize = 300;
/// Who waits for longer than this share of its time, and a little, waits for a thread that has no core: threads whose visits take longer than others' make these wait less.
const TOO_LONG: (f64, Duration) = (0.3, Duration::from_micros(500));
/// So many times the visits are made by one thread after that; twice as many each time that it happens again.
const FIRST_REST: usize = 8;

/// Who visits what, and when.
#[derive(Debug)]
pub struct Turns {
    /// The contacts of each thread in the order of their visits; and of each contact its thread, and its place in that order.
    order: Vec<Vec<u32>>,
    visited: Vec<(u32, u32)>,
    /// The turns of contact c, from `ptr[c]` to `ptr[c + 1]`.
    ptr: Vec<u32>,
    turns: Vec<Turn>,
    /// Of each place that is shared: how often it is visited in a sweep, and has been since all began.
    visits: Vec<u64>,
    done: Vec<AtomicU64>,
    /// For how long one thread is to make the visits, and the next time.
    rest: usize,
    rests: usize,
}

/// At a place that is shared: how many visits of it in a sweep come before.
#[derive(Debug, Clone, Copy)]
struct Turn {
    place: u32,
    rank: u32,
}

impl Turns {
    /// Turns for `threads` threads and contacts that touch the places, below `places`, that `of` puts in place of what is in a vector. None where threads would
    /// wait for each other too long.
    pub fn new(
        contacts: usize,
        places: usize,
        threads: usize,
        of: impl FnMut(usize, &mut Vec<u32>),
    ) -> Option<Self> {
        let touching = Touching::new(contacts, places, of);
        let mut owner = vec![0; contacts];
        for (k, &c) in touching.by_breadth().iter().enumerate() {
            owner[c as usize] = (k * threads / contacts) as u32;
        }
        let order = touching.schedule(&owner, threads)?;
        let mut visited = vec![(0, 0); contacts];
        for (thread, order) in order.iter().enumerate() {
            for (k, &c) in order.iter().enumerate() {
                visited[c as usize] = (thread as u32, k as u32);
            }
        }
        // The number of each place that several threads visit.
        let mut number = vec![u32::MAX; touching.places()];
        let mut visits = vec![];
        for (p, number) in number.iter_mut().enumerate() {
            let contacts = touching.contacts(p);
            let owners = |c: &u32| owner[*c as usize] != owner[contacts[0] as usize];
            if contacts.iter().any(owners) {
                *number = visits.len() as u32;
                visits.push(contacts.len() as u64);
            }
        }
        let mut ranks = vec![0; visits.len()];
        let (mut ptr, mut turns) = (vec![0], vec![]);
        for c in 0..contacts {
            for place in touching.of(c).iter().map(|p| number[*p as usize]) {
                if let Some(rank) = ranks.get_mut(place as usize) {
                    turns.push(Turn { place, rank: *rank });
                    *rank += 1;
                }
            }
            ptr.push(u32::try_from(turns.len()).ok()?);
        }
        let done = visits.iter().map(|_| AtomicU64::new(0)).collect();
        Some(Self { order, visited, ptr, turns, visits, done, rest: 0, rests: FIRST_REST })
    }

    /// Whether threads are worth a trial now: not for a while after they had to wait for a core.
    pub fn are_free(&mut self) -> bool {
        let free = self.rest == 0;
        self.rest = self.rest.saturating_sub(1);
        free
    }

    /// `sweeps` times all visits: `visit(c, contact, last)` for each of `contacts`, which are those of all c in order, on the threads of `pool`; `last` in the last sweep.
    /// Ends early where the time is over. Where threads wait for each other again and again, since others have their cores, the calling thread makes the visits that are left.
    pub fn run<T: Send>(
        &mut self,
        pool: &ThreadPool,
        sweeps: usize,
        contacts: impl Iterator<Item = T>,
        visit: impl Fn(usize, &mut T, bool) + Sync,
        foresee: impl Fn(usize) + Sync,
    ) {
        self.done.iter_mut().for_each(|done| *done.get_mut() = 0);
        let mut contacts: Vec<Option<T>> = contacts.map(Some).collect();
        let mut set = |order: &Vec<u32>| {
            let visit = |&c: &u32| contacts[c as usize].take().map(|contact| (c, contact));
            Mutex::new(Set { visits: order.iter().filter_map(visit).collect(), at: (0, 0) })
        };
        let mut sets: Vec<_> = self.order.iter().map(&mut set).collect();
        let (end, budget, turns) = (Ends::default(), budget::current(), &*self);
        pool.broadcast(|thread| {
            let _scope = budget.enter();
            let _leaving = Leaving(&end);
            let mut set = sets[thread.index()].lock().unwrap_or_else(PoisonError::into_inner);
            let Set { visits, at } = &mut *set;
            let mut waiting = Waiting { began: Instant::now(), waited: Duration::ZERO };
            for sweep in 0..sweeps {
                for k in 0..visits.len() {
                    *at = (sweep, k);
                    if k % LOOK_EVERY == 0 && end.is_due() {
                        return;
                    }
                    if let Some((later, _)) = visits.get(k + AHEAD) {
                        foresee(*later as usize);
                    }
                    let (c, contact) = &mut visits[k];
                    let c = *c as usize;
                    let mine = &turns.turns[turns.ptr[c] as usize..turns.ptr[c + 1] as usize];
                    if !mine.iter().all(|turn| turns.come(*turn, sweep, &end, &mut waiting)) {
                        return;
                    }
                    visit(c, contact, sweep + 1 == sweeps);
                    for turn in mine {
                        let done = &turns.done[turn.place as usize];
                        // Nobody else writes until it is written.
                        done.store(done.load(Ordering::Relaxed) + 1, Ordering::Release);
                    }
                }
            }
            *at = (sweeps, 0);
        });
        if !end.crowded.load(Ordering::Relaxed) {
            self.rests = FIRST_REST;
            return;
        }
        (self.rest, self.rests) = (self.rests, 2 * self.rests);
        let mut sets: Vec<_> = sets
            .iter_mut()
            .map(|set| set.get_mut().unwrap_or_else(PoisonError::into_inner))
            .collect();
        self.finish(&mut sets, sweeps, visit);
    }

    /// The visits that threads have left, in the order of one.
    fn finish<T>(
        &self,
        sets: &mut [&mut Set<T>],
        sweeps: usize,
        visit: impl Fn(usize, &mut T, bool),
    ) {
        for sweep in 0..sweeps {
            for (c, &(thread, k)) in self.visited.iter().enumerate() {
                let Set { visits, at } = &mut *sets[thread as usize];
                if (sweep, k as usize) >= *at {
                    visit(c, &mut visits[k as usize].1, sweep + 1 == sweeps);
                }
                if c % LOOK_EVERY == 0 && budget::over() {
                    return;
                }
            }
        }
    }

    /// Waits for a turn; false where all is to end.
    #[inline]
    fn come(&self, turn: Turn, sweep: usize, end: &Ends, waiting: &mut Waiting) -> bool {
        let done = &self.done[turn.place as usize];
        let due = sweep as u64 * self.visits[turn.place as usize] + u64::from(turn.rank);
        let here = || done.load(Ordering::Acquire) == due;
        for _ in 0..LOOKS {
            if here() {
                return true;
            }
            std::hint::spin_loop();
        }
        waiting.wait(here, end)
    }
}

/// Since when a thread has been at work, and for how long it has waited.
struct Waiting {
    began: Instant,
    waited: Duration,
}

impl Waiting {
    /// Lets others have the core until something is here; false where all is to end.
    #[cold]
    fn wait(&mut self, here: impl Fn() -> bool, end: &Ends) -> bool {
        let (from, before) = (Instant::now(), self.waited);
        while !here() {
            if end.is_due() {
                return false;
            }
            thread::yield_now();
            self.waited = before + from.elapsed();
            if self.waited > TOO_LONG.1 + self.began.elapsed().mul_f64(TOO_LONG.0) {
                end.crowded.store(true, Ordering::Relaxed);
            }
        }
        true
    }
}

/// The visits of one thread, in their order, and the sweep and the visit that it has come to.
struct Set<T> {
    visits: Vec<(u32, T)>,
    at: (usize, usize),
}

/// Why threads leave their visits.
#[derive(Debug, Default)]
struct Ends {
    over: AtomicBool,
    crowded: AtomicBool,
}

impl Ends {
    fn is_due(&self) -> bool {
        if budget::over() {
            self.over.store(true, Ordering::Relaxed);
        }
        self.over.load(Ordering::Relaxed) || self.crowded.load(Ordering::Relaxed)
    }
}

/// Ends all if its thread panics, so that nobody waits for it.
struct Leaving<'a>(&'a Ends);

impl Drop for Leaving<'_> {
    fn drop(&mut self) {
        if thread::panicking() {
            self.0.over.store(true, Ordering::Relaxed);
        }
    }
}

/// Which contact touches which place, both ways. Places that the same contacts touch are one.
struct Touching {
    places: Lists,
    contacts: Lists,
}

/// Lists one after the other, and where they begin.
struct Lists {
    ptr: Vec<usize>,
    all: Vec<u32>,
}

impl Lists {
    fn new(lists: impl Iterator<Item = impl IntoIterator<Item = u32>>) -> Self {
        let mut out = Self { ptr: vec![0], all: vec![] };
        for list in lists {
            out.all.extend(list);
            out.ptr.push(out.all.len());
        }
        out
    }

    fn len(&self) -> usize {
        self.ptr.len() - 1
    }

    fn of(&self, i: usize) -> &[u32] {
        &self.all[self.ptr[i]..self.ptr[i + 1]]
    }

    /// The lists of those that have i in theirs, for i below `count`.
    fn turned(&self, count: usize) -> Self {
        let mut ptr = vec![0; count + 1];
        self.all.iter().for_each(|&i| ptr[i as usize + 1] += 1);
        (0..count).for_each(|i| ptr[i + 1] += ptr[i]);
        let mut at = ptr.clone();
        let mut all = vec![0; self.all.len()];
        for k in 0..self.len() {
            for &i in self.of(k) {
                all[at[i as usize]] = k as u32;
                at[i as usize] += 1;
            }
        }
        Self { ptr, all }
    }
}

impl Touching {
    fn new(contacts: usize, places: usize, mut of: impl FnMut(usize, &mut Vec<u32>)) -> Self {
        let mut found = vec![];
        let touched = Lists::new((0..contacts).map(|c| {
            of(c, &mut found);
            found.clone()
        }));
        let touching = touched.turned(places);
        // The unknowns of a body are touched by the same contacts, but for zeros.
        let mut groups: HashMap<&[u32], u32> = HashMap::new();
        let mut distinct: Vec<&[u32]> = vec![];
        for p in 0..places {
            let contacts = touching.of(p);
            if !contacts.is_empty() {
                groups.entry(contacts).or_insert_with(|| {
                    distinct.push(contacts);
                    distinct.len() as u32
                });
            }
        }
        let contacts_of = Lists::new(distinct.iter().map(|list| list.iter().copied()));
        Self { places: contacts_of.turned(contacts), contacts: contacts_of }
    }

    /// The places of contact c.
    fn of(&self, c: usize) -> &[u32] {
        self.places.of(c)
    }

    /// The contacts of place p.
    fn contacts(&self, p: usize) -> &[u32] {
        self.contacts.of(p)
    }

    fn places(&self) -> usize {
        self.contacts.len()
    }

    /// The contacts by breadth from a contact on the rim, island after island.
    fn by_breadth(&self) -> Vec<u32> {
        // What a first search ends with lies on the rim.
        let first = self.search(0..self.places.len() as u32);
        self.search(first.into_iter().rev())
    }

    fn search(&self, starts: impl Iterator<Item = u32>) -> Vec<u32> {
        let contacts = self.places.len();
        let (mut seen, mut open) = (vec![false; contacts], vec![true; self.places()]);
        let mut order: Vec<u32> = Vec::with_capacity(contacts);
        let mut next = 0;
        for start in starts {
            if std::mem::replace(&mut seen[start as usize], true) {
                continue;
            }
            order.push(start);
            while let Some(&c) = order.get(next) {
                next += 1;
                for &p in self.of(c as usize) {
                    if !std::mem::take(&mut open[p as usize]) {
                        continue;
                    }
                    for &other in self.contacts(p as usize) {
                        if !std::mem::replace(&mut seen[other as usize], true) {
                            order.push(other);
                        }
                    }
                }
            }
        }
        order
    }

    /// The visits of each thread in their order; none where threads would be idle for too long.
    fn schedule(&self, owner: &[u32], threads: usize) -> Option<Vec<Vec<u32>>> {
        let contacts = owner.len();
        // Visits that have to come before, of those not made yet; when all have arrived; which visit of each place comes next.
        let mut before: Vec<u32> = vec![0; contacts];
        let mut arrived = vec![0_u32; contacts];
        let mut next = vec![0_usize; self.places()];
        for p in 0..self.places() {
            self.contacts(p)[1..].iter().for_each(|&c| before[c as usize] += 1);
        }
        let mut time = vec![0_u32; threads];
        let mut due: Vec<BinaryHeap<Reverse<u32>>> = vec![BinaryHeap::new(); threads];
        let mut coming: Vec<BinaryHeap<Reverse<(u32, u32)>>> = vec![BinaryHeap::new(); threads];
        for c in (0..contacts).filter(|&c| before[c] == 0) {
            due[owner[c] as usize].push(Reverse(c as u32));
        }
        let mut order: Vec<Vec<u32>> = vec![vec![]; threads];
        for _ in 0..contacts {
            let (thread, c) = loop {
                let thread = (0..threads)
                    .filter(|&t| !due[t].is_empty() || !coming[t].is_empty())
                    .min_by_key(|&t| time[t])?;
                while let Some(&Reverse((at, c))) = coming[thread].peek()
                    && at <= time[thread]
                {
                    coming[thread].pop();
                    due[thread].push(Reverse(c));
                }
                if let Some(Reverse(c)) = due[thread].pop() {
                    break (thread, c);
                }
                let &Reverse((at, _)) = coming[thread].peek()?;
                time[thread] = at;
            };
            order[thread].push(c);
            time[thread] += 1;
            for &p in self.of(c as usize) {
                next[p as usize] += 1;
                let Some(&later) = self.contacts(p as usize).get(next[p as usize]) else {
                    continue;
                };
                let l = later as usize;
                let elsewhere = owner[l] as usize != thread;
                arrived[l] = arrived[l].max(time[thread] + if elsewhere { LATE } else { 0 });
                before[l] -= 1;
                if before[l] == 0 {
                    coming[owner[l] as usize].push(Reverse((arrived[l], later)));
                }
            }
        }
        let end = time.into_iter().max().unwrap_or(0) as f64;
        let busy = contacts as f64 / threads as f64;
        (busy >= (1.0 - MOST_IDLE) * end).then_some(order)
    }
}

#[cfg(test)]
mod tests {
    use std::sync::Arc;

    use rayon::ThreadPoolBuilder;

    use super::*;

    /// The place in a chain of contact c: each touches this place and the next, and they are in no order.
    fn at(c: usize, contacts: usize) -> usize {
        c * 389 % contacts
    }

    fn chain(contacts: usize, threads: usize) -> Turns {
        let of = |c: usize, places: &mut Vec<u32>| {
            places.clear();
            places.extend([0, 1].map(|k| (at(c, contacts) + k) as u32));
        };
        Turns::new(contacts, contacts + 1, threads, of).unwrap()
    }

    /// The order in which each place of a chain was visited.
    fn visited(
        turns: &mut Turns,
        threads: usize,
        contacts: usize,
        sweeps: usize,
    ) -> Vec<Vec<usize>> {
        let pool = ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
        let log: Vec<_> = (0..=contacts).map(|_| Mutex::new(vec![])).collect();
        let visit = |c: usize, own: &mut usize, last: bool| {
            *own += 1;
            assert_eq!(last, *own == sweeps);
            for place in [at(c, contacts), at(c, contacts) + 1] {
                log[place].lock().unwrap().push(c);
            }
        };
        turns.run(&pool, sweeps, vec![0; contacts].into_iter(), visit, |_| ());
        log.into_iter().map(|place| place.into_inner().unwrap()).collect()
    }

    #[test]
    fn each_place_is_visited_in_order_sweep_after_sweep() {
        for threads in [1, 2, 3] {
            let mut turns = chain(1000, threads);
            assert_eq!(
                turns.visits.len(),
                threads - 1,
                "a chain is cut at one place for each thread more"
            );
            let log = visited(&mut turns, threads, 1000, 5);
            for (place, visits) in log.iter().enumerate() {
                let touches = |c: &usize| (at(*c, 1000)..=at(*c, 1000) + 1).contains(&place);
                let once = (0..1000).filter(touches).collect::<Vec<_>>();
                assert_eq!(*visits, once.repeat(5));
            }
        }
    }

    #[test]
    fn what_has_to_come_one_after_the_other_is_not_cut() {
        let star = |c: usize, places: &mut Vec<u32>| {
            places.clear();
            places.extend([0, c as u32 + 1]);
        };
        assert!(Turns::new(100, 101, 2, star).is_none());
        assert!(Turns::new(100, 101, 1, star).is_some());
    }

    #[test]
    fn what_threads_leave_is_made_in_the_order_of_one() {
        let turns = chain(600, 2);
        let left_at = [(1, 100), (0, 250)];
        let mut sets = [0, 1].map(|t: usize| Set {
            visits: turns.order[t].iter().map(|&c| (c, ())).collect(),
            at: left_at[t],
        });
        let log = Mutex::new(vec![]);
        let [a, b] = &mut sets;
        turns.finish(&mut [a, b], 2, |c, (), last| log.lock().unwrap().push((last, c)));
        let left = |sweep: usize, c: usize| {
            let (thread, k) = turns.visited[c];
            (sweep, k as usize) >= left_at[thread as usize]
        };
        let all = (0..2).flat_map(|sweep| (0..600).map(move |c| (sweep, c)));
        let expected = all.filter(|(sweep, c)| left(*sweep, *c)).map(|(sweep, c)| (sweep == 1, c));
        assert_eq!(log.into_inner().unwrap(), expected.collect::<Vec<_>>());
    }

    #[test]
    fn a_flag_ends_the_visits() {
        let mut turns = chain(600, 2);
        // A visit that the second thread waits for never comes.
        turns.visits[0] += 1;
        let pool = ThreadPoolBuilder::new().num_threads(2).build().unwrap();
        let cancel = Arc::new(AtomicBool::new(false));
        let budget = budget::Budget { cancel: Some(cancel.clone()), ..Default::default() };
        let _scope = budget.enter();
        thread::scope(|scope| {
            scope.spawn(|| {
                thread::sleep(Duration::from_millis(20));
                cancel.store(true, Ordering::Relaxed);
            });
            turns.run(&pool, 3, vec![(); 600].into_iter(), |_, (), _| (), |_| ());
        });
    }

    #[test]
    fn a_panic_reaches_the_caller_and_leaves_nobody_waiting() {
        let mut turns = chain(600, 2);
        let caught = std::panic::catch_unwind(std::panic::AssertUnwindSafe(|| {
            let pool = ThreadPoolBuilder::new().num_threads(2).build().unwrap();
            let visit = |c: usize, (): &mut (), _| assert!(c != 7, "meant to be");
            turns.run(&pool, 3, vec![(); 600].into_iter(), visit, |_| ());
        }));
        assert!(caught.is_err());
    }
}
