//! Work that can be cut in two, so that several threads may take their parts: slices, ranges, and what goes with them item by item.

use std::ops::Range;

/// Consecutive items that can be cut at any of them.
pub(crate) trait Cut: Sized + Send {
    /// How many items there are.
    fn count(&self) -> usize;
    /// The items before this one, and the rest.
    fn cut(self, at: usize) -> (Self, Self);
}

impl Cut for Range<usize> {
    fn count(&self) -> usize {
        self.len()
    }

    fn cut(self, at: usize) -> (Self, Self) {
        let middle = self.start + at;
        (self.start..middle, middle..self.end)
    }
}

impl<T: Sync> Cut for &[T] {
    fn count(&self) -> usize {
        self.len()
    }

    fn cut(self, at: usize) -> (Self, Self) {
        self.split_at(at)
    }
}

impl<T: Send> Cut for &mut [T] {
    fn count(&self) -> usize {
        self.len()
    }

    fn cut(self, at: usize) -> (Self, Self) {
        self.split_at_mut(at)
    }
}

/// As many of the one as of the other.
impl<A: Cut, B: Cut> Cut for (A, B) {
    fn count(&self) -> usize {
        debug_assert_eq!(self.0.count(), self.1.count());
        self.0.count()
    }

    fn cut(self, at: usize) -> (Self, Self) {
        let ((a, c), (b, d)) = (self.0.cut(at), self.1.cut(at));
        ((a, b), (c, d))
    }
}

impl<A: Cut, B: Cut, C: Cut> Cut for (A, B, C) {
    fn count(&self) -> usize {
        debug_assert!([self.1.count(), self.2.count()] == [self.0.count(); 2]);
        self.0.count()
    }

    fn cut(self, at: usize) -> (Self, Self) {
        let ((a, d), (b, e), (c, f)) = (self.0.cut(at), self.1.cut(at), self.2.cut(at));
        ((a, b, c), (d, e, f))
    }
}
