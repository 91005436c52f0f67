//! How long a solve has got no further.

/// The steps since a value, a residual or a merit, was last halved.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Idle {
    steps: usize,
    /// The value when it was.
    low: f64,
}

impl Default for Idle {
    /// Before the first step: any value is a half.
    fn default() -> Self {
        Self::from(f64::INFINITY)
    }
}

impl From<f64> for Idle {
    /// From this value on.
    fn from(low: f64) -> Self {
        Self { steps: 0, low }
    }
}

impl Idle {
    /// Notes the value after a step: the steps since it was halved, none where that was this one.
    pub fn note(&mut self, value: f64) -> usize {
        self.steps += 1;
        if value < 0.5 * self.low {
            *self = Self::from(value);
        }
        self.steps
    }
}
