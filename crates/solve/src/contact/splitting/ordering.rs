//! The order in which a sweep visits the contacts.

use rand::SeedableRng;
use rand::seq::SliceRandom;
use rand_pcg::Pcg64;
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

/// How sweeps are ordered. All of them are reproducible: the same seed gives the same order.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
pub enum Ordering {
    /// As the problem numbers its contacts.
    #[default]
    Given,
    /// One random permutation, kept for the whole solve.
    Shuffled,
    /// A new random permutation for every sweep.
    FullyShuffled,
}

/// The permutation of the present sweep.
#[derive(Debug, Clone)]
pub struct Order {
    ordering: Ordering,
    permutation: Vec<u32>,
    rng: Pcg64,
}

impl Order {
    /// An order of `n` contacts.
    pub fn new(ordering: Ordering, n: usize, seed: u64) -> Self {
        let mut order = Self { ordering, permutation: vec![], rng: Pcg64::seed_from_u64(seed) };
        order.restart(n, seed);
        order
    }

    /// Begins a solve: the same order as after [`new`](Order::new).
    pub fn restart(&mut self, n: usize, seed: u64) {
        self.rng = Pcg64::seed_from_u64(seed);
        self.permutation.clear();
        self.permutation.extend(0..u32::try_from(n).expect("fewer than 2³² contacts"));
        if self.ordering == Ordering::Shuffled {
            self.permutation.shuffle(&mut self.rng);
        }
    }

    /// The permutation of the next sweep.
    pub fn next_sweep(&mut self) -> &[u32] {
        if self.ordering == Ordering::FullyShuffled {
            self.permutation.shuffle(&mut self.rng);
        }
        &self.permutation
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_sweep_is_a_permutation_and_reproducible() {
        for ordering in [Ordering::Given, Ordering::Shuffled, Ordering::FullyShuffled] {
            let (mut a, mut b) = (Order::new(ordering, 50, 7), Order::new(ordering, 50, 7));
            let first = a.next_sweep().to_vec();
            assert_eq!(first, b.next_sweep());
            let second = a.next_sweep().to_vec();
            let mut sorted = second.clone();
            sorted.sort_unstable();
            assert!(sorted.iter().copied().eq(0..50));
            assert_eq!(first == second, ordering != Ordering::FullyShuffled);
            assert_eq!(first.iter().copied().eq(0..50), ordering == Ordering::Given);
            a.restart(50, 7);
            assert_eq!(a.next_sweep(), first);
        }
    }
}
