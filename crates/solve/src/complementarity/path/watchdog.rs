//! Full steps that no merit has tested.

/// The first radius, by what it shrinks, steps without a test, returns to the best point.
const RADIUS: f64 = 20.0;
const SHRINK: f64 = 0.8;
const UNTESTED: usize = 10;
const RETURNS: usize = 5;

/// Says which full steps are taken without a test, and when to go back.
#[derive(Debug, Clone, Copy)]
pub struct Watchdog {
    radius: f64,
    /// Since the last test.
    untested: usize,
    returns: usize,
    /// Of all.
    total: usize,
}

impl Watchdog {
    /// One that allows such steps, or none.
    pub fn new(allows: bool) -> Self {
        let returns = if allows { 0 } else { RETURNS };
        Self { radius: RADIUS, untested: 0, returns, total: 0 }
    }

    /// Whether a step of this length is taken; then it counts as one.
    pub fn allows(&mut self, length: f64) -> bool {
        if self.returns >= RETURNS || self.untested >= UNTESTED || length > self.radius {
            return false;
        }
        self.radius *= SHRINK;
        self.untested += 1;
        self.total += 1;
        true
    }

    /// Whether the steps without a test have been so many that one is due.
    pub fn is_due(&mut self) -> bool {
        let due = self.untested >= UNTESTED;
        if due {
            self.untested = 0;
        }
        due
    }

    /// A step was tested.
    pub fn tested(&mut self) {
        self.untested = 0;
    }

    /// Back to the best point.
    pub fn turns_back(&mut self) {
        self.returns += 1;
    }

    /// No such steps any more. False where none were made since the last test.
    pub fn gives_up(&mut self) -> bool {
        self.returns = RETURNS;
        std::mem::take(&mut self.untested) > 0
    }

    /// How many steps were not tested.
    pub fn total(&self) -> usize {
        self.total
    }
}
