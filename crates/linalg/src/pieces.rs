//! Work over long vectors in pieces, on all threads that the budget allows: the same bits for any number of threads.
//!
//! Where the pieces begin depends on the length alone, and what they return is added in their order; which thread has which piece changes nothing.

use std::ops::Range;
use std::sync::atomic::{AtomicUsize, Ordering};

use crate::budget;
use crate::passes::Parts;

/// The most pieces.
const MOST: usize = 64;
/// Fewer pieces are not worth a second thread, which takes some 20 µs to come.
pub(crate) const SHARED: usize = 8;

/// Lets `work` do the pieces of `0..n`, each at least `least` long but the last, and returns `Σ work(piece)`, K sums.
///
/// Shorter than a piece is one call. What one piece writes no other may read. Allocates nothing on one thread.
pub fn sums<const K: usize>(
    n: usize,
    least: usize,
    work: impl Fn(Range<usize>) -> [f64; K] + Sync,
) -> [f64; K] {
    let length = least.max(n.div_ceil(MOST)).max(1);
    let count = n.div_ceil(length);
    if count == 1 {
        return work(0..n);
    }
    let piece = |k: usize| work(k * length..((k + 1) * length).min(n));
    let mut of_pieces = [[0.0; K]; MOST];
    let (taken, results) = (AtomicUsize::new(0), Parts::of(&mut of_pieces[..count]));
    budget::on_all(count >= SHARED, || {
        loop {
            let k = taken.fetch_add(1, Ordering::Relaxed);
            if k >= count {
                return;
            }
            // SAFETY: nobody else has taken piece k.
            unsafe { results.part(k, 1)[0] = piece(k) };
        }
    });
    let mut total = [0.0; K];
    for sums in &of_pieces[..count] {
        total.iter_mut().zip(sums).for_each(|(total, sum)| *total += sum);
    }
    total
}

/// [`sums`] of work that returns nothing.
pub fn each(n: usize, least: usize, work: impl Fn(Range<usize>) + Sync) {
    sums(n, least, |piece| {
        work(piece);
        []
    });
}

/// [`sums`] of work that also writes to slices, all with the same number of entries for each of the n items: it is given those of its piece.
///
/// Panics where the slices have not the same length, or not a whole number of entries an item.
pub fn writing<T: Send, const N: usize, const K: usize>(
    n: usize,
    least: usize,
    slices: [&mut [T]; N],
    work: impl Fn(Range<usize>, [&mut [T]; N]) -> [f64; K] + Sync,
) -> [f64; K] {
    let len = slices.first().map_or(0, |slice| slice.len());
    let width = len / n.max(1);
    assert!(slices.iter().all(|slice| slice.len() == len) && width * n == len);
    let parts = slices.map(Parts::of);
    sums(n, least, |piece| {
        // SAFETY: pieces do not overlap.
        let of_piece = parts
            .each_ref()
            .map(|parts| unsafe { parts.part(width * piece.start, width * piece.len()) });
        work(piece, of_piece)
    })
}

/// [`each`] of work that writes to two slices of one entry an item: it is given where its piece begins and the entries of both.
///
/// Panics where the slices have not the same length.
pub fn writing_both<T: Send, U: Send>(
    least: usize,
    (a, b): (&mut [T], &mut [U]),
    work: impl Fn(usize, &mut [T], &mut [U]) + Sync,
) {
    assert_eq!(a.len(), b.len());
    let (n, a, b) = (a.len(), Parts::of(a), Parts::of(b));
    each(n, least, |piece| {
        // SAFETY: pieces do not overlap.
        let (a, b) =
            unsafe { (a.part(piece.start, piece.len()), b.part(piece.start, piece.len())) };
        work(piece.start, a, b);
    });
}

/// Does two things, at the same time where the budget allows several threads.
pub fn both<A: Send, B>(there: impl FnOnce() -> A + Send, here: impl FnOnce() -> B) -> (A, B) {
    let Some(team) = budget::team() else { return (there(), here()) };
    let (budget, mut a) = (budget::current(), None);
    let b = team.in_place_scope(|scope| {
        let a = &mut a;
        scope.spawn(move |_| {
            let _scope = budget.enter();
            *a = Some(there());
        });
        here()
    });
    // Whichever thread saw it: the one that asked knows that its budget is over.
    budget::over();
    (a.expect("a scope ends with its work done"), b)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::budget::Budget;
    use crate::dot;

    #[test]
    fn two_things_are_done_under_the_same_limits() {
        let ended =
            Budget { deadline: Some(std::time::Instant::now()), threads: 2, ..Budget::default() };
        for (budget, late) in [(Budget { threads: 2, ..Budget::default() }, false), (ended, true)] {
            let scope = budget.enter();
            let (there, here) = both(budget::over, budget::threads);
            assert_eq!((there, here, scope.raised()), (late, 2, late));
        }
        assert_eq!(both(budget::threads, || 3), (1, 3));
    }

    #[test]
    fn every_place_is_visited_once_and_sums_are_the_same_bits_on_any_number_of_threads() {
        for n in [0, 1, 99, 100, 101, 799, 800, 12_345, 1_000_003] {
            let x: Vec<f64> = (0..n).map(|i| (i as f64 * 0.7).sin()).collect();
            let run = |threads| {
                let _scope = Budget { threads, ..Budget::default() }.enter();
                let (mut seen, mut twice) = (vec![0; 3 * n], vec![0; 3 * n]);
                let both = writing(n, 100, [&mut seen, &mut twice], |piece, [seen, twice]| {
                    assert!(seen.len() == 3 * piece.len() && twice.len() == seen.len());
                    seen.iter_mut().for_each(|s| *s += 1);
                    twice.iter_mut().zip(3 * piece.start..).for_each(|(t, i)| *t += 2 * i);
                    let x = &x[piece];
                    [x.iter().sum(), dot(x, x)]
                });
                writing_both(100, (&mut seen, &mut twice), |from, seen, twice| {
                    seen.iter_mut().zip(twice).zip(from..).for_each(|((seen, t), i)| {
                        *seen -= if *t == 2 * i { 0 } else { 1000 };
                    });
                });
                assert!(seen.iter().all(|seen| *seen == 1));
                assert!(twice.iter().enumerate().all(|(i, t)| *t == 2 * i));
                both
            };
            let [one, three] = [1, 3].map(run);
            assert_eq!(one, three);
            let plain: f64 = x.iter().sum();
            assert!((one[0] - plain).abs() <= 1e-12 * n as f64, "{} {plain}", one[0]);
            let squares: f64 = x.iter().map(|x| x * x).sum();
            assert!((one[1] - squares).abs() <= 1e-12 * n as f64);
        }
    }

    #[test]
    #[should_panic = "width * n == len"]
    fn slices_that_do_not_fit_the_items_are_refused() {
        writing(3, 1, [&mut [0; 7]], |_, _| []);
    }
}
