//! The way of QPCOMP, PROXI and SEMICOMP out of a point where descent stalls: proximal problems with moving centres.
//!
//! ```text
//! stalled at x, θ* = ½‖H(x)‖²
//! y⁰ = x;  y^{j+1} ≈ a solution of MCP(F + λ(· − y^j)) from y^j, to ε_j;  until ½‖H(y^j)‖² ≤ γ θ*: go on from there
//! ```
//!
//! H is the natural residual. Where a proximal problem stalls in its turn, or the centres stop, λ grows tenfold: with λ large enough `F + λ(· − y)` is strongly
//! monotone near y. θ may grow while the centres move.
//!
//! References: BillupsFerris1997; Billups1995. Cost: that of the inner steps.

use super::{Idle, Iterate, Moved};
use crate::complementarity::form::Model;

/// A method that makes steps on whatever problem the model states.
pub trait Inner: Send {
    /// One step.
    fn step(&mut self, model: &mut Model, at: &mut Iterate) -> Moved;

    /// The model states another problem from now on, or the solve begins elsewhere.
    fn forget(&mut self);
}

/// γ
const ENOUGH: f64 = 0.81;
/// λ of the first proximal problem, and the largest.
const FIRST: f64 = 0.1;
const LARGEST: f64 = 1e8;
/// Steps on one proximal problem.
const STEPS: usize = 30;
/// Centres before λ grows, if θ has not.
const CENTRES: usize = 100;
/// Steps of descent in which the residual must halve.
const PATIENCE: usize = 60;

/// Where the escape is.
#[derive(Debug, Clone, Copy, PartialEq)]
enum Phase {
    /// On the problem itself.
    Descent { idle: Idle },
    /// On a proximal problem; steps there, centres so far, the residual to fall to.
    Proximal { steps: usize, centres: usize, goal: f64 },
}

/// An inner method with the escape.
pub struct Escape<I> {
    /// The inner method.
    pub inner: I,
    phase: Phase,
    lambda: f64,
    centre: Vec<f64>,
    f: Vec<f64>,
    /// Escapes begun, proximal problems made.
    pub counts: [usize; 2],
}

impl<I: Inner> Escape<I> {
    /// Of problems with n variables.
    pub fn new(inner: I, n: usize) -> Self {
        Self {
            inner,
            phase: Phase::Descent { idle: Idle::default() },
            lambda: FIRST,
            centre: vec![0.0; n],
            f: vec![0.0; n],
            counts: [0; 2],
        }
    }

    /// Begins anew.
    pub fn begin(&mut self) {
        self.phase = Phase::Descent { idle: Idle::default() };
        (self.lambda, self.counts) = (FIRST, [0; 2]);
        self.inner.forget();
    }

    /// One step; stuck where even the strongest proximal term does not help.
    pub fn step(&mut self, model: &mut Model, at: &mut Iterate) -> Moved {
        match self.phase {
            Phase::Descent { mut idle } => {
                let moved = self.inner.step(model, at);
                let idle_for = idle.note(at.residual);
                self.phase = Phase::Descent { idle };
                if moved.moved() && idle_for <= PATIENCE {
                    return moved;
                }
                // Away from here, from the best point of this descent.
                self.counts[0] += 1;
                self.lambda = FIRST;
                at.x.copy_from_slice(&at.best);
                self.phase =
                    Phase::Proximal { steps: 0, centres: 0, goal: ENOUGH.sqrt() * at.least };
                self.recentre(model, at);
                Moved::Regularised
            }
            Phase::Proximal { steps, centres, goal } => {
                let moved = self.inner.step(model, at);
                let enough = 1e-2 * goal.min(1.0);
                if moved.moved() && at.residual > enough && steps < STEPS {
                    self.phase = Phase::Proximal { steps: steps + 1, centres, goal };
                    return moved;
                }
                // What the residual of F itself is here.
                let lambda = model.lambda();
                model.release();
                let defined = model.value(&at.x, &mut self.f);
                let own = if defined { model.natural(&at.x, &self.f) } else { f64::INFINITY };
                if own <= goal {
                    at.arrive(model);
                    self.phase = Phase::Descent { idle: Idle::from(own) };
                    self.inner.forget();
                    return Moved::Regularised;
                }
                let away = at.x.iter().zip(&self.centre).map(|(x, c)| (x - c).abs());
                let size = at.x.iter().fold(1.0_f64, |m, x| m.max(x.abs()));
                let stands = away.fold(0.0, f64::max) <= 1e-10 * size;
                let stalled = !moved.moved() && at.residual > enough;
                let slow = centres > 0 && centres.is_multiple_of(CENTRES);
                if stalled || stands || slow {
                    if lambda >= LARGEST {
                        return Moved::Stuck;
                    }
                    self.lambda = 10.0 * lambda;
                    if stalled || !defined {
                        // Not from a point at which nothing was solved.
                        at.x.copy_from_slice(&self.centre);
                    }
                }
                self.phase = Phase::Proximal { steps: 0, centres: centres + 1, goal };
                self.recentre(model, at);
                Moved::Regularised
            }
        }
    }

    /// A proximal problem with its centre here.
    fn recentre(&mut self, model: &mut Model, at: &mut Iterate) {
        self.counts[1] += 1;
        self.centre.copy_from_slice(&at.x);
        model.pull(self.lambda, &self.centre);
        at.arrive(model);
        self.inner.forget();
    }
}
