//! Whether an iteration promises to reach the tolerance for less than what comes after it would cost.

/// Iterations may cost this many times as much as they were compared with, before their promise is no longer believed.
const BELIEF: f64 = 3.0;

/// So many estimates are kept; of a longer iteration every second, fourth, ... of them.
const KEPT: usize = 64;

/// The estimates of an iteration that converges linearly, more or less, one a step.
#[derive(Debug, Clone)]
pub struct Rate {
    /// Those of the steps 0, `stride`, 2 `stride`, ...
    estimates: [f64; KEPT],
    stride: usize,
    /// The steps so far, and the estimate of the last.
    steps: usize,
    now: f64,
}

impl Default for Rate {
    fn default() -> Self {
        Self { estimates: [0.0; KEPT], stride: 1, steps: 0, now: f64::NAN }
    }
}

impl Rate {
    /// Forgets everything.
    pub fn begin(&mut self) {
        *self = Self::default();
    }

    /// Notes the estimate of a step.
    pub fn note(&mut self, estimate: f64) {
        if self.steps == KEPT * self.stride {
            (0..KEPT / 2).for_each(|k| self.estimates[k] = self.estimates[2 * k]);
            self.stride *= 2;
        }
        if self.steps.is_multiple_of(self.stride) {
            self.estimates[self.steps / self.stride] = estimate;
        }
        self.steps += 1;
        self.now = estimate;
    }

    /// How many more steps it takes to `tolerance` at the mean rate of the second half of the steps so far, which a single step that raises the
    /// estimate does not upset; infinite where the estimates do not fall.
    pub fn left(&self, tolerance: f64) -> f64 {
        if self.steps < 2 {
            return f64::INFINITY;
        }
        let last = self.steps - 1;
        let middle = last / 2 / self.stride;
        let fall = (self.estimates[middle] / self.now).ln() / (last - middle * self.stride) as f64;
        if fall > 0.0 { (self.now / tolerance).ln() / fall } else { f64::INFINITY }
    }

    /// Whether the steps left, each of which costs `cost`, cost less than `limit`, and those done were not several times as dear.
    pub fn promises(&self, tolerance: f64, cost: f64, limit: f64) -> bool {
        self.left(tolerance) * cost < limit && self.steps as f64 * cost < BELIEF * limit
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_geometric_sequence_is_foreseen_and_a_flat_one_is_not_believed() {
        let mut rate = Rate::default();
        assert_eq!(rate.left(1e-8), f64::INFINITY);
        (0..5).for_each(|k| rate.note(0.1_f64.powi(k)));
        assert!((rate.left(1e-8) - 4.0).abs() < 1e-9);
        assert!(rate.promises(1e-8, 1.0, 4.5) && !rate.promises(1e-8, 1.0, 3.5));
        // Too dear already.
        assert!(!rate.promises(1e-4, 1.0, 1.5));
        rate.begin();
        (0..5).for_each(|_| rate.note(1.0));
        assert!(!rate.promises(1e-8, 1.0, 1e300));
        // A long one.
        rate.begin();
        (0..1000).for_each(|k| rate.note(0.99_f64.powi(k)));
        assert!((rate.left(0.99_f64.powi(1099)) - 100.0).abs() < 1e-6);
        // One step up on the way down.
        rate.begin();
        [1.0, 0.1, 1e-2, 1e-3, 2e-3].iter().for_each(|&e| rate.note(e));
        assert!(rate.left(1e-8).is_finite());
    }
}
