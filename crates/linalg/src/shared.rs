//! Numbers that several threads read and write in turn.

use std::sync::atomic::{AtomicU64, Ordering};

use super::row::prefetch;

/// A slice of numbers lent to several threads. Who reads a place after another thread has written it orders the two by other means, which see to it that
/// the number is there; without such an order the number is an older one, never a torn one.
#[derive(Debug, Clone, Copy)]
pub struct Shared<'a>(&'a [AtomicU64]);

impl<'a> Shared<'a> {
    /// Those of `numbers`; none on a machine whose atomic integers want to lie otherwise in memory.
    pub fn new(numbers: &'a mut [f64]) -> Option<Self> {
        // SAFETY: an `AtomicU64` has the size of an `f64` and any bits are a value of both; the middle is aligned, and nobody else has the slice as long as it is lent.
        let (before, all, after) = unsafe { numbers.align_to_mut::<AtomicU64>() };
        (before.is_empty() && after.is_empty()).then_some(Self(all))
    }

    /// Number i.
    #[inline(always)]
    pub fn get(&self, i: usize) -> f64 {
        f64::from_bits(self.0[i].load(Ordering::Relaxed))
    }

    /// Fetches number i into the cache.
    #[inline(always)]
    pub fn foresee(&self, i: usize) {
        prefetch(&self.0[i]);
    }

    /// Puts x in its place.
    #[inline(always)]
    pub fn set(&self, i: usize, x: f64) {
        self.0[i].store(x.to_bits(), Ordering::Relaxed);
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_one_thread_sets_another_finds() {
        let mut numbers = vec![1.0, -0.0, f64::NAN];
        let shared = Shared::new(&mut numbers).unwrap();
        std::thread::scope(|scope| {
            scope.spawn(|| shared.set(1, 2.5));
        });
        assert_eq!(shared.get(1), 2.5);
        assert_eq!(numbers[..2], [1.0, 2.5]);
        assert!(numbers[2].is_nan());
    }
}
