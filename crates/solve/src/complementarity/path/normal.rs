//! The path search on the normal map, as in the first versions of PATH.
//!
//! ```text
//! F₊(y) = F(π(y)) + y − π(y),   p(t): A_k(p(t)) = (1 − t) F₊(y),   A_k(y) = F(x) + JF(x)(π(y) − x) + y − π(y),  x = π(y_k)
//! ```
//!
//! The arc p of the linearised map A_k itself is searched: `y ← p(t)` with t = 1, ½, ¼, …, as soon as `‖F₊(p(t))‖ ≤ (1 − σt) R`, R the largest of the last norms. A full step that is no
//! longer than a radius, which shrinks each time, is taken without this test, up to ten times; after these, or where no t is accepted, the search goes on from the best y.
//!
//! References: Ralph1994, DirkseFerris1995. Cost of a trial: a sparse LU and the pivots up to t.

use nonsmooth_linalg::norm;

use super::watchdog::Watchdog;
use crate::complementarity::form::Model;
use crate::complementarity::parts::arc::{Cell, End, Linearised, Start};
use crate::complementarity::parts::nonlinear::{Iterate, Moved};

/// σ and the shortest t.
const SIGMA: f64 = 0.01;
const LEAST: f64 = 1e-6;

/// The search's memory.
pub struct Normal {
    y: Vec<f64>,
    /// The best y, and the norm of the normal map there.
    best: Vec<f64>,
    least: f64,
    trial: Vec<f64>,
    trial_x: Vec<f64>,
    trial_f: Vec<f64>,
    scratch: Vec<f64>,
    last: Vec<f64>,
    memory: usize,
    watchdog: Watchdog,
}

/// `‖f + y − x‖`
fn size(x: &[f64], y: &[f64], f: &[f64], scratch: &mut [f64]) -> f64 {
    for i in 0..x.len() {
        scratch[i] = f[i] + y[i] - x[i];
    }
    norm(scratch)
}

impl Normal {
    /// For n variables.
    pub fn new(n: usize) -> Self {
        let zeros = || vec![0.0; n];
        Self {
            y: zeros(),
            best: zeros(),
            least: f64::INFINITY,
            trial: zeros(),
            trial_x: zeros(),
            trial_f: zeros(),
            scratch: zeros(),
            last: vec![],
            memory: 1,
            watchdog: Watchdog::new(true),
        }
    }

    /// Begins at the y with the smallest residual over the iterate.
    pub fn begin(&mut self, model: &Model, at: &Iterate, memory: usize, watchdog: bool) {
        for i in 0..self.y.len() {
            let (l, u) = model.bounds(i);
            let (x, f) = (at.x[i], at.f[i]);
            self.y[i] = if x <= l {
                l - f.max(0.0)
            } else if x >= u {
                u - f.min(0.0)
            } else {
                x
            };
        }
        self.last.clear();
        self.memory = memory;
        self.least = f64::INFINITY;
        self.watchdog = Watchdog::new(watchdog);
    }

    /// How many steps were not tested.
    pub fn untested(&self) -> usize {
        self.watchdog.total()
    }

    /// The size of the normal map at the best y.
    pub fn least(&self) -> f64 {
        self.least
    }

    /// One step.
    pub fn step(
        &mut self,
        model: &mut Model,
        at: &mut Iterate,
        linear: &mut Linearised,
        (lambda, pivots): (f64, usize),
    ) -> Moved {
        if !model.linearise(&at.x, &mut at.f) {
            if self.watchdog.gives_up() && self.least.is_finite() {
                self.back(model, at);
                return Moved::Newton;
            }
            return Moved::Undefined;
        }
        let here = size(&at.x, &self.y, &at.f, &mut self.scratch);
        if here < self.least {
            self.least = here;
            self.best.copy_from_slice(&self.y);
        }
        if self.watchdog.is_due() && self.least < here {
            self.watchdog.turns_back();
            self.back(model, at);
            return Moved::Newton;
        }
        if self.last.len() == self.memory {
            self.last.remove(0);
        }
        self.last.push(here);
        let reference = self.last.iter().fold(here, |m, x| m.max(*x));
        let mut until = 1.0;
        while until >= LEAST {
            let begin = (Start::At, Cell::Of(&self.y));
            let found = linear.solve_until(model, (&at.x, &at.f), lambda, begin, pivots, until);
            if found == End::Over {
                return Moved::Stuck;
            }
            let t = linear.reached();
            if t > 0.0 {
                self.trial.copy_from_slice(linear.normal_end());
                self.trial_x.copy_from_slice(linear.end());
                if model.value(&self.trial_x, &mut self.trial_f) {
                    let length = self.y.iter().zip(&self.trial).map(|(a, b)| (a - b).abs());
                    let untested = found == End::Solved
                        && until == 1.0
                        && self.watchdog.allows(length.fold(0.0, f64::max));
                    let there = size(&self.trial_x, &self.trial, &self.trial_f, &mut self.scratch);
                    if untested || there <= (1.0 - SIGMA * t) * reference {
                        if !untested {
                            self.watchdog.tested();
                        }
                        std::mem::swap(&mut self.y, &mut self.trial);
                        std::mem::swap(&mut at.x, &mut self.trial_x);
                        std::mem::swap(&mut at.f, &mut self.trial_f);
                        at.measure(model);
                        return if lambda > 0.0 { Moved::Regularised } else { Moved::Newton };
                    }
                }
            }
            if t <= 0.0 {
                break;
            }
            until = 0.5 * t.min(until);
        }
        Moved::Stuck
    }

    /// To the best y.
    fn back(&mut self, model: &mut Model, at: &mut Iterate) {
        self.y.copy_from_slice(&self.best);
        for (i, x) in at.x.iter_mut().enumerate() {
            *x = model.project(i, self.y[i]);
        }
        at.arrive(model);
    }
}
