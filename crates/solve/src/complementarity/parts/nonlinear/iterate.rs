//! Where a solve of a nonlinear problem is.

use rand::{RngExt, SeedableRng};
use rand_pcg::Pcg64Mcg;

use crate::complementarity::form::Model;

/// A point of the box with what is known there, and the best one met.
#[derive(Debug, Clone, Default)]
pub struct Iterate {
    /// x, between the bounds.
    pub x: Vec<f64>,
    /// F(x) with the proximal term that the model has.
    pub f: Vec<f64>,
    /// The natural residual of that.
    pub residual: f64,
    /// The point with the smallest natural residual of F itself, and that.
    pub best: Vec<f64>,
    /// Its residual.
    pub least: f64,
    /// Where the solve began.
    pub start: Vec<f64>,
}

/// How far from its bounds a start is moved until F is defined there.
const INSIDE: [f64; 9] = [1e-12, 1e-8, 1e-6, 1e-4, 1e-2, 0.1, 0.5, 1.0, 10.0];

impl Iterate {
    /// Of so many variables, nowhere yet.
    pub fn new(n: usize) -> Self {
        let zeros = || vec![0.0; n];
        Self {
            x: zeros(),
            f: zeros(),
            residual: f64::INFINITY,
            best: zeros(),
            least: f64::INFINITY,
            start: zeros(),
        }
    }

    /// Begins at the point of the box nearest to x, or as near as F and its Jacobian are defined: further inside. The model is left without proximal term.
    pub fn begin(&mut self, model: &mut Model, x: &[f64]) {
        model.release();
        model.unweigh();
        for (i, x) in x.iter().enumerate() {
            self.x[i] = model.project(i, *x);
        }
        self.start.copy_from_slice(&self.x);
        let mut defined = model.linearise(&self.x, &mut self.f);
        for (distance, sign) in INSIDE.into_iter().flat_map(|d| [(d, 1.0), (d, -1.0)]) {
            if defined {
                break;
            }
            for i in 0..self.x.len() {
                let (l, u) = model.bounds(i);
                let d = distance.min(0.5 * (u - l));
                if d > 0.0 {
                    // Free variables that are zero are moved, too, up or down: of a root or a quotient.
                    let free = l.is_infinite() && u.is_infinite();
                    let x = self.start[i];
                    self.x[i] = if free && x == 0.0 { sign * d } else { x.max(l + d).min(u - d) };
                }
            }
            defined = model.linearise(&self.x, &mut self.f);
        }
        if defined {
            model.weigh(&self.x, &self.f);
        } else {
            self.x.copy_from_slice(&self.start);
        }
        self.start.copy_from_slice(&self.x);
        (self.least, self.residual) = (f64::INFINITY, f64::INFINITY);
        self.best.copy_from_slice(&self.x);
        self.arrive(model);
    }

    /// Begins again where the solve began.
    pub fn again(&mut self, model: &mut Model) {
        model.release();
        self.x.copy_from_slice(&self.start);
        self.arrive(model);
    }

    /// F at x, and the residual, after x was changed. False where F is not defined.
    pub fn arrive(&mut self, model: &mut Model) -> bool {
        let defined = model.value(&self.x, &mut self.f);
        self.measure(model);
        defined
    }

    /// The residual, where x and f are known.
    pub fn measure(&mut self, model: &Model) {
        self.residual = model.natural(&self.x, &self.f);
        if model.lambda() == 0.0 && self.residual < self.least {
            self.least = self.residual;
            self.best.copy_from_slice(&self.x);
        }
    }
}

/// How far a perturbed start is from the start, in units of its size, by turns.
const SPREAD: [f64; 4] = [0.1, 0.5, 2.0, 10.0];

impl Iterate {
    /// Begins again at a point near the start, ever farther with the turn; the same for the same turn.
    pub fn perturbed(&mut self, model: &mut Model, turn: u64) {
        model.release();
        let mut random = Pcg64Mcg::seed_from_u64(turn);
        for _ in 0..TRIES {
            let spread = SPREAD[(turn as usize).saturating_sub(1) % SPREAD.len()];
            for i in 0..self.x.len() {
                let (l, u) = model.bounds(i);
                let size = self.start[i].abs().max(1.0);
                let width = if (u - l).is_finite() { size.min(u - l) } else { size };
                let x = self.start[i] + spread * width * random.random_range(-1.0..1.0);
                self.x[i] = model.project(i, x);
            }
            if self.arrive(model) {
                return;
            }
        }
        self.again(model);
    }
}

/// Points that are tried until F is defined at one.
const TRIES: usize = 20;
