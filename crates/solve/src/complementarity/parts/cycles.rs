//! Whether a sequence of bases repeats itself.

/// Says whether a basis has come back: by hashes, with Brent's method.
#[derive(Debug, Clone, Default)]
pub struct Cycles {
    hash: u64,
    kept: u64,
    steps: u64,
    next: u64,
}

/// A random word for a number.
pub fn word(number: u64) -> u64 {
    let mut x = number.wrapping_add(0x9e37_79b9_7f4a_7c15).wrapping_mul(0xbf58_476d_1ce4_e5b9);
    x = (x ^ (x >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
    x ^ (x >> 31)
}

impl Cycles {
    /// Begins at this basis.
    pub fn begin(&mut self) {
        *self = Self { hash: 0, kept: 0, steps: 0, next: 1 };
    }

    /// After an exchange, given the words of what entered and what left, joined by exclusive or: whether the basis is one that was there before.
    pub fn exchange(&mut self, words: u64) -> bool {
        self.exchange_and_drive(words, 0)
    }

    /// As [`exchange`](Self::exchange), of a basis together with what enters next, by its word.
    pub fn exchange_and_drive(&mut self, words: u64, next: u64) -> bool {
        self.hash ^= words;
        self.steps += 1;
        let state = self.hash ^ next;
        if state == self.kept && self.steps > 1 {
            return true;
        }
        if self.steps == self.next {
            self.next *= 2;
            self.kept = state;
        }
        false
    }
}
