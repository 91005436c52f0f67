//! Passes over the same items again and again, as sweeps of Gauss–Seidel are, by several threads **one behind the other**.
//!
//! Items touch places (contacts touch bodies), and an item feels those that touch a place of its own. Pass k + 1 may come to an item as soon as
//! pass k has left all that it feels behind; so a thread with pass k + 1 follows the one with pass k at a distance, and every item finds what it would find if the
//! passes came one after the other: the same bits for any number of threads. Both read the same data shortly one after the other, so
//! the second finds them in the cache.
//!
//! How close they may follow is a matter of the order. Where the given one has items that feel each other far apart, it is replaced by that
//! of a breadth-first search over the places, begun at one far from the middle (CuthillMcKee1969), with every item moved at random by a little: passes over a
//! pile of 99 695 contacts may then follow each other at .04 of their length, before at .96. Without the last Gauss-Seidel takes one and a half times the sweeps of the order of the
//! file and more, with it up to a quarter more (15 590 → 19 030 there).

use std::marker::PhantomData;
use std::ops::Range;
use std::sync::atomic::{AtomicBool, AtomicU64, AtomicUsize, Ordering};

use crate::budget;
use crate::row::prefetch;

/// Items between two looks at how far the pass before has come.
const BLOCK: usize = 256;
/// The given order stays where passes may follow each other at this part of a pass.
const CLOSE: f64 = 0.1;
/// How far an item may be moved at random, as a part of a pass. At .005 Gauss-Seidel sweeps over piles still are now and then half as many again, from .01 to .05 a quarter more at most.
const JITTER: f64 = 0.03;

/// The order of the items, and how passes may follow each other.
#[derive(Debug, Clone)]
pub struct Passes {
    /// The item at each position, and the position of each item; empty: the given order.
    order: Vec<u32>,
    position: Vec<u32>,
    items: usize,
    /// How many blocks the pass before must have done for each block to begin.
    ahead: Vec<u32>,
}

impl Passes {
    /// Of items whose places are `places[ptr[i]..ptr[i + 1]]`, each below `count`. Cost: O(places).
    pub fn new(ptr: &[u32], places: &[u32], count: usize) -> Self {
        let items = ptr.len() - 1;
        let given = Self { order: vec![], position: vec![], items, ahead: vec![] };
        let given = given.with_distances(ptr, places, count);
        if given.distance() <= CLOSE {
            return given;
        }
        let order = jittered(&breadth_first(ptr, places, count));
        let mut position = vec![0; items];
        order.iter().enumerate().for_each(|(at, &item)| position[item as usize] = at as u32);
        let found = Self { order, position, items, ahead: vec![] };
        let found = found.with_distances(ptr, places, count);
        if found.distance() < given.distance() { found } else { given }
    }

    fn with_distances(mut self, ptr: &[u32], places: &[u32], count: usize) -> Self {
        let of = |item: usize| &places[ptr[item] as usize..ptr[item + 1] as usize];
        // The last position that touches each place.
        let mut last = vec![0; count];
        for at in 0..self.items {
            of(self.item(at)).iter().for_each(|&p| last[p as usize] = at);
        }
        let mut farthest = 0;
        self.ahead = (0..self.items)
            .step_by(BLOCK)
            .map(|begin| {
                let end = (begin + BLOCK).min(self.items);
                let felt = (begin..end).flat_map(|at| of(self.item(at))).map(|&p| last[p as usize]);
                farthest = felt.chain([farthest, end - 1]).max().unwrap_or(0);
                (farthest / BLOCK + 1) as u32
            })
            .collect();
        self
    }

    /// At which part of a pass another may follow, in the mean.
    pub fn distance(&self) -> f64 {
        let blocks = self.ahead.len().max(1) as f64;
        let sum: f64 = (0..).zip(&self.ahead).map(|(at, &ahead)| f64::from(ahead - at)).sum();
        sum / blocks.powi(2)
    }

    /// The item at a position.
    #[inline(always)]
    pub fn item(&self, at: usize) -> usize {
        self.order.get(at).map_or(at, |&item| item as usize)
    }

    /// The position of an item.
    #[inline(always)]
    pub fn position(&self, item: usize) -> usize {
        self.position.get(item).map_or(item, |&at| at as usize)
    }

    /// Makes `count` passes on the threads that the budget in force allows: `work` does the items at a range of positions, and returns something of
    /// them that is summed over the pass; returns the sum of the last pass. It ends early where the budget is over.
    ///
    /// While `work` is at an item, no other thread is at one that touches a place of it.
    pub fn run(&self, count: usize, work: impl Fn(Range<usize>) -> f64 + Sync) -> f64 {
        let board = Board {
            done: (0..count).map(|_| AtomicUsize::new(0)).collect(),
            sum: AtomicU64::new(0.0_f64.to_bits()),
            taken: AtomicUsize::new(0),
            ended: AtomicBool::new(false),
        };
        budget::on_all(count > 1, || self.lane(&board, &work));
        if board.ended.load(Ordering::Acquire) {
            // Whoever saw it first: the thread that asked knows that its budget is over.
            budget::over();
        }
        f64::from_bits(board.sum.load(Ordering::Acquire))
    }

    /// Passes that nobody has taken, one after the other. Who takes one is at work, so nobody waits for a thread that the system has not given a core
    /// for longer than that lasts.
    fn lane(&self, board: &Board, work: &(impl Fn(Range<usize>) -> f64 + Sync)) {
        let _leaving = Leaving(board);
        loop {
            let pass = board.taken.fetch_add(1, Ordering::AcqRel);
            if pass >= board.done.len() {
                return;
            }
            let mut sum = 0.0;
            for (block, &ahead) in self.ahead.iter().enumerate() {
                if budget::over() {
                    board.ended.store(true, Ordering::Release);
                }
                if !board.wait(pass, ahead as usize) {
                    return;
                }
                sum += work(block * BLOCK..((block + 1) * BLOCK).min(self.items));
                board.done[pass].store(block + 1, Ordering::Release);
            }
            if pass + 1 == board.done.len() {
                board.sum.store(sum.to_bits(), Ordering::Release);
            }
        }
    }
}

/// How far the passes are.
struct Board {
    /// Blocks done of each, and the bits of the sum of the last once it is through.
    done: Vec<AtomicUsize>,
    sum: AtomicU64,
    taken: AtomicUsize,
    /// The budget is over, or somebody has panicked.
    ended: AtomicBool,
}

/// How often a thread looks before it lets others have its core.
const LOOKS: usize = 5000;

impl Board {
    /// Waits until the pass before this one has done so many blocks; false where it is to end.
    fn wait(&self, pass: usize, blocks: usize) -> bool {
        let mut looks = 0;
        while !self.ended.load(Ordering::Acquire) {
            if pass == 0 || self.done[pass - 1].load(Ordering::Acquire) >= blocks {
                return true;
            }
            looks += 1;
            if looks < LOOKS {
                std::hint::spin_loop();
            } else {
                std::thread::yield_now();
            }
        }
        false
    }
}

/// Ends the passes if its thread panics, so that nobody waits for ever.
struct Leaving<'a>(&'a Board);

impl Drop for Leaving<'_> {
    fn drop(&mut self) {
        if std::thread::panicking() {
            self.0.ended.store(true, Ordering::Release);
        }
    }
}

/// The items in the order in which a breadth-first search over the places comes to them, from a place that another search came to last.
fn breadth_first(ptr: &[u32], places: &[u32], count: usize) -> Vec<u32> {
    let items = ptr.len() - 1;
    let of = |item: usize| &places[ptr[item] as usize..ptr[item + 1] as usize];
    // The items of each place.
    let mut begin = vec![0_u32; count + 1];
    places.iter().for_each(|&p| begin[p as usize + 1] += 1);
    (0..count).for_each(|p| begin[p + 1] += begin[p]);
    let mut fill = begin.clone();
    let mut touching = vec![0_u32; places.len()];
    for item in 0..items {
        for &p in of(item) {
            touching[fill[p as usize] as usize] = item as u32;
            fill[p as usize] += 1;
        }
    }
    let mut order: Vec<u32> = Vec::with_capacity(items);
    // By which search an item and a place were last met.
    let (mut met, mut reached) = (vec![0_u8; items], vec![0_u8; count]);
    let mut queue: Vec<u32> = vec![];
    for start in 0..items {
        if met[start] != 0 {
            continue;
        }
        let Some(&first) = of(start).first() else {
            met[start] = 2;
            order.push(start as u32);
            continue;
        };
        let mut from = first;
        for search in [1, 2] {
            queue.clear();
            queue.push(from);
            reached[from as usize] = search;
            let mut at = 0;
            while let Some(&place) = queue.get(at) {
                at += 1;
                from = place;
                for &item in
                    &touching[begin[place as usize] as usize..begin[place as usize + 1] as usize]
                {
                    if std::mem::replace(&mut met[item as usize], search) == search {
                        continue;
                    }
                    if search == 2 {
                        order.push(item);
                    }
                    for &p in of(item as usize) {
                        if std::mem::replace(&mut reached[p as usize], search) != search {
                            queue.push(p);
                        }
                    }
                }
            }
        }
    }
    order
}

/// Each moved on by up to [`JITTER`] of the whole.
fn jittered(order: &[u32]) -> Vec<u32> {
    let reach = JITTER * order.len() as f64;
    let mut moved: Vec<(f64, u32)> =
        (0..).zip(order).map(|(at, &item)| (at as f64 + reach * random(at), item)).collect();
    moved.sort_by(|a, b| a.0.total_cmp(&b.0));
    moved.into_iter().map(|(_, item)| item).collect()
}

/// The same number in [0, 1) for the same k, and another one for every other: the finaliser of SplitMix64.
fn random(k: u64) -> f64 {
    let mut x = k.wrapping_add(1).wrapping_mul(0x9e37_79b9_7f4a_7c15);
    x = (x ^ (x >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
    x = (x ^ (x >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
    ((x ^ (x >> 31)) >> 11) as f64 / (1_u64 << 53) as f64
}

/// A slice that several threads write to at the same time, in different places.
#[derive(Debug)]
pub struct Parts<'a, T> {
    first: *mut T,
    len: usize,
    slice: PhantomData<&'a mut [T]>,
}

// SAFETY: it is a mutable slice whose parts are handed out; who takes one (unsafe) sees to it that nobody else has it.
unsafe impl<T: Send> Send for Parts<'_, T> {}
// SAFETY: as above.
unsafe impl<T: Send> Sync for Parts<'_, T> {}

impl<'a, T> Parts<'a, T> {
    /// The parts of a slice.
    pub fn of(slice: &'a mut [T]) -> Self {
        Self { first: slice.as_mut_ptr(), len: slice.len(), slice: PhantomData }
    }

    /// Asks for the lines of the cache where a part begins and ends.
    #[inline(always)]
    pub fn prefetch(&self, begin: usize, len: usize) {
        let end = (begin + len).min(self.len);
        if begin < end {
            prefetch(self.first.wrapping_add(begin));
            prefetch(self.first.wrapping_add(end - 1));
        }
    }

    /// The part that begins at a place.
    ///
    /// # Safety
    ///
    /// As long as it is held nobody else holds a part that overlaps it.
    #[inline(always)]
    #[allow(clippy::mut_from_ref)]
    pub unsafe fn part(&self, begin: usize, len: usize) -> &mut [T] {
        assert!(begin <= self.len && len <= self.len - begin);
        // SAFETY: the part lies within the slice, which lives as long as `'a`, and is the caller's alone.
        unsafe { std::slice::from_raw_parts_mut(self.first.add(begin), len) }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::budget::Budget;

    /// A band of places, each item at two of them, in an order that jumps about.
    fn shuffled_band(items: usize, width: usize) -> (Vec<u32>, Vec<u32>, usize) {
        let count = items / 3;
        let places = (0..items).flat_map(|k| {
            let item = k * 7919 % items;
            let first = item * count / items;
            [first as u32, ((first + 1 + item % width) % count) as u32]
        });
        ((0..=items as u32).map(|i| 2 * i).collect(), places.collect(), count)
    }

    #[test]
    fn an_order_holds_every_item_once_and_lets_nobody_meet() {
        for (items, width) in [(5000, 5), (5000, 700), (10, 2), (0, 1)] {
            let (ptr, places, count) = shuffled_band(items, width);
            let passes = Passes::new(&ptr, &places, count);
            let mut seen: Vec<usize> = (0..items).map(|at| passes.item(at)).collect();
            assert!((0..items).all(|at| passes.position(passes.item(at)) == at));
            seen.sort_unstable();
            assert!(seen.into_iter().eq(0..items));
            // Whatever feels an item of a block lies in blocks that the pass before has left.
            let of = |item: usize| &places[2 * item..2 * item + 2];
            for at in 0..items {
                for other in at..items {
                    let feels =
                        of(passes.item(at)).iter().any(|p| of(passes.item(other)).contains(p));
                    assert!(!feels || other / BLOCK < passes.ahead[at / BLOCK] as usize);
                }
            }
            if items == 5000 && width == 5 {
                assert!(
                    !passes.order.is_empty() && passes.distance() < 0.1,
                    "{}",
                    passes.distance()
                );
            }
        }
    }

    #[test]
    fn an_order_that_is_close_stays() {
        let ptr: Vec<u32> = (0..=5000).map(|i| 2 * i).collect();
        let places: Vec<u32> = (0..5000).flat_map(|i| [i, i + 1]).collect();
        let passes = Passes::new(&ptr, &places, 5001);
        assert!(passes.order.is_empty() && passes.item(17) == 17 && passes.position(17) == 17);
    }

    #[test]
    fn passes_on_several_threads_have_the_bits_of_one() {
        let (ptr, places, count) = shuffled_band(6000, 40);
        let passes = Passes::new(&ptr, &places, count);
        // Each visit reads and writes what it touches; the order of visits to a place decides the bits.
        let run = |threads: usize| {
            let mut state: Vec<f64> = (0..count).map(|p| (p as f64).sin()).collect();
            let parts = Parts::of(&mut state);
            let _scope = Budget { threads, ..Budget::default() }.enter();
            let sum = passes.run(11, |block| {
                let mut moved = 0.0;
                for at in block {
                    let [a, b] = [0, 1].map(|k| places[2 * passes.item(at) + k] as usize);
                    // SAFETY: nobody else is at an item with one of these places.
                    let [a, b] = [a, b].map(|p| unsafe { parts.part(p, 1).as_mut_ptr() });
                    // SAFETY: as above.
                    unsafe {
                        let by = 0.3 * (*a - *b) + 0.01 * (at as f64).cos();
                        *a -= by;
                        *b += 0.7 * by;
                        moved += by * by;
                    }
                }
                moved
            });
            (state, sum)
        };
        let alone = run(0);
        for threads in [1, 2, 3, 5] {
            assert!(run(threads) == alone, "{threads}");
        }
    }

    #[test]
    fn passes_end_when_the_budget_is_over() {
        let (ptr, places, count) = shuffled_band(6000, 40);
        let passes = Passes::new(&ptr, &places, count);
        for threads in [1, 2, 5] {
            let flag = std::sync::Arc::new(AtomicBool::new(false));
            let budget = Budget { threads, cancel: Some(flag.clone()), ..Budget::default() };
            let scope = budget.enter();
            let visited = AtomicUsize::new(0);
            // Whichever thread comes so far first, each makes the block that it has begun and no other.
            passes.run(1000, |block| {
                let before = visited.fetch_add(block.len(), Ordering::AcqRel);
                flag.fetch_or(before >= 6000 * 7, Ordering::AcqRel);
                0.0
            });
            let visited = visited.into_inner();
            assert!(scope.raised());
            assert!(visited < 6000 * 7 + (threads + 1) * BLOCK, "{visited}");
        }
    }
}
