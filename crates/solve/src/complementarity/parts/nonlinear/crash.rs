//! The projected Newton steps with which codes begin that look for the active set first.
//!
//! A step solves for the variables that are not at a bound that their F pushes them to, `B d = −H` with B of the B-subdifferential of the natural residual, along the
//! projected direction, on the merit of the penalised Fischer–Burmeister function. The crash ends when at most one variable changes its side, or a step is not Newton's.
//!
//! References: DirkseFerris1997; Munson2002.

use super::{Descent, Inner, Iterate, Moved, Options};
use crate::complementarity::form::Model;
use crate::complementarity::functions::{Min, Penalised};

/// The most steps.
const STEPS: usize = 50;

/// The crash of a solve.
pub struct Crash {
    descent: Descent<Min, Penalised>,
    /// Where each variable was: at the lower bound, between, at the upper one.
    sides: Vec<i8>,
    steps: usize,
    over: bool,
    /// Steps of a regularised matrix do not end it.
    persistent: bool,
}

const OPTIONS: Options = Options { memory: 1, slack: 1.0, least: 1e-4, gradient: false };

impl Crash {
    /// For problems of this model.
    pub fn new(model: &Model) -> Self {
        let descent = Descent::new(Min {}, Penalised::default(), OPTIONS, model);
        Self { descent, sides: vec![0; model.dim()], steps: 0, over: false, persistent: false }
    }

    /// Begins anew; with no step at all where it is not `wanted`.
    pub fn begin(&mut self, wanted: bool) {
        self.descent.restart(Min {}, Penalised::default(), OPTIONS);
        (self.steps, self.over) = (0, !wanted);
        self.sides.fill(i8::MAX);
    }

    /// From now on a step with a regularised matrix does not end it.
    pub fn persist(&mut self) {
        self.persistent = true;
    }

    /// Whether it has ended.
    pub fn is_over(&self) -> bool {
        self.over
    }

    /// The steps made.
    pub fn steps(&self) -> usize {
        self.steps
    }

    /// One step.
    pub fn step(&mut self, model: &mut Model, at: &mut Iterate) {
        let moved = self.descent.step(model, at);
        self.steps += usize::from(moved.moved());
        let mut changes = 0;
        for (i, side) in self.sides.iter_mut().enumerate() {
            let (l, u) = model.bounds(i);
            let x = at.x[i] - at.f[i];
            let now = i8::from(x >= u) - i8::from(x <= l);
            changes += usize::from(std::mem::replace(side, now) != now);
        }
        let goes_on = moved == Moved::Newton || (self.persistent && moved == Moved::Regularised);
        self.over = !goes_on || changes <= 1 || self.steps >= STEPS;
    }
}
