//! **miles**: the Newton–Josephy method, as in Rutherford's code MILES.
//!
//! Problem: `l ≤ x ≤ u ⟂ F(x)`. Method: z solves the linear problem `l ≤ z ≤ u ⟂ F(x) + JF(x)(z − x)`, by pivots with implicit bounds
//! ([`arc`](crate::complementarity::parts::arc)) from the basis that the signs of `x − F(x)` suggest, whose infeasibility is the covering column; then
//! `x ← x + t (z − x)` with t = 1, ½, ¼, …, as soon as the deviation `‖x − π(x − F(x))‖₁` decreases, and no smaller than `least_step`, which is taken in any case. Where the pivots
//! end on a ray, other bases and covering columns are tried, and at last the arc from x as far as it leads; where the deviation does not decrease for long, the method begins again, once, from Lemke's ray.
//!
//! References: Rutherford1993; Josephy1979; Acary2018 (70). Cost of a step: a sparse LU and a solve for each pivot.
//! Fails: where linearisations have no solution, as with singular Jacobians; where the deviation has a local minimum.

use nonsmooth_problem::{LcpPoint, Mcp};
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use crate::complementarity::form::Model;
use crate::complementarity::parts::arc::{Cell, End, Linearised, Start};
use crate::complementarity::parts::nonlinear::{CHECK_EVERY, Idle, Moved, Solve, UNDEFINED};
use crate::core::ranges::{at_least, below};
use crate::core::register::{About, Described, Solves};
use crate::core::settings::{Settings, described};
use crate::{SolveError, Solver, Step};

/// The hyperparameters.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields, default)]
pub struct Miles {
    /// By what a step is shortened that does not decrease the deviation, in (0, 1).
    pub damping: f64,
    /// The shortest step, taken whatever the deviation says, in (0, 1).
    pub least_step: f64,
    /// Steps in which the deviation must have halved, else the method begins again.
    pub patience: usize,
    /// How often it begins again.
    pub restarts: usize,
    /// The most pivots of one linear problem.
    pub pivots: usize,
}

impl Default for Miles {
    fn default() -> Self {
        Self { damping: 0.5, least_step: 0.01, patience: 100, restarts: 1, pivots: 10_000 }
    }
}

impl Settings for Miles {
    fn validate(&self) -> Result<(), String> {
        below("damping", self.damping, 1.0)?;
        below("least_step", self.least_step, 1.0)?;
        at_least("patience", self.patience, 1)?;
        at_least("pivots", self.pivots, 1)
    }
}

impl Described for Miles {
    const ABOUT: &'static About = &About {
        name: "miles",
        family: "newton",
        solves: Solves::Law,
        summary: "Newton-Josephy: linear problems by pivots with implicit bounds, damped by the deviation (the code MILES)",
        needs: &[],
        cites: &["Rutherford1993", "Josephy1979", "Acary2018"],
        variants: &["damping=0.25"],
        settings: described::<Self>,
    };
}

/// The workspace.
pub struct Work {
    solve: Solve,
    linear: Linearised,
    trial: Vec<f64>,
    trial_f: Vec<f64>,
    /// Of the deviation.
    idle: Idle,
    /// Linear problems that were not solved.
    unsolved: usize,
}

/// The bases with which a linear problem is tried, in this order; a new start has the last one first.
const BASES: [(Start, Cell); 3] =
    [(Start::Basis, Cell::Minimum), (Start::At, Cell::Preimage), (Start::Ray, Cell::Preimage)];
/// The shortest step where F is not defined farther on.
const LEAST: f64 = 1e-12;
const NO_SOLUTION: &str =
    "the linearised problem was not solved from any basis: the pivots ended on rays";
const STALLED: &str = "the deviation does not decrease";

/// `‖x − π(x − f)‖₁`
fn deviation(model: &Model, x: &[f64], f: &[f64]) -> f64 {
    (0..x.len()).map(|i| model.residual(i, x[i], f[i]).abs()).sum()
}

impl Miles {
    /// A solution of the linear problem, or the point of the arc from x at which its residual is the smallest; whether one was found that is not x.
    fn linear_problem(&self, work: &mut Work) -> bool {
        let Work { solve, linear, unsolved, .. } = work;
        let at = (&solve.at.x[..], &solve.at.f[..]);
        let turn = solve.restarts % BASES.len();
        for k in 0..BASES.len() {
            let basis = BASES[(k + BASES.len() - turn) % BASES.len()];
            match linear.solve(&solve.model, at, 0.0, basis, self.pivots) {
                End::Solved => return true,
                End::Over => return false,
                _ => {}
            }
        }
        *unsolved += 1;
        // As far as the arc from x leads.
        let found = linear.solve(&solve.model, at, 0.0, BASES[1], self.pivots);
        found != End::Over && linear.reached() > 0.0
    }

    /// A step towards the solution of the linear problem; whether F was defined there.
    fn advance(&self, work: &mut Work) -> bool {
        let Work { solve: Solve { model, at, .. }, linear, trial, trial_f, .. } = work;
        let here = deviation(model, &at.x, &at.f);
        let mut t = 1.0;
        while t >= LEAST {
            for (i, trial) in trial.iter_mut().enumerate() {
                let z = linear.end()[i];
                *trial = if t == 1.0 { z } else { model.project(i, at.x[i] + t * (z - at.x[i])) };
            }
            let defined = model.value(trial, trial_f);
            let last = t * self.damping < self.least_step;
            if defined && (last || deviation(model, trial, trial_f) < here) {
                std::mem::swap(&mut at.x, trial);
                std::mem::swap(&mut at.f, trial_f);
                at.measure(model);
                return true;
            }
            t *= self.damping;
        }
        false
    }
}

impl Solver<Mcp> for Miles {
    type Work = Work;

    fn work(&self, problem: &Mcp) -> Result<Work, SolveError> {
        let solve = Solve::new(problem);
        let n = solve.model.dim();
        Ok(Work {
            linear: Linearised::new(&solve.model),
            solve,
            trial: vec![0.0; n],
            trial_f: vec![0.0; n],
            idle: Idle::default(),
            unsolved: 0,
        })
    }

    fn aim(&self, tolerance: f64, work: &mut Work) {
        work.solve.aim(tolerance);
    }

    fn start(&self, _: &Mcp, point: &mut LcpPoint, work: &mut Work) {
        work.solve.begin(point);
        work.idle = Idle::default();
        (work.linear.pivots, work.unsolved) = (0, 0);
    }

    fn step(&self, _: &Mcp, _: &mut LcpPoint, work: &mut Work) -> Step {
        let Solve { model, at, .. } = &mut work.solve;
        let why = if !model.linearise(&at.x, &mut at.f) {
            UNDEFINED
        } else if !self.linear_problem(work) {
            NO_SOLUTION
        } else if !self.advance(work) {
            UNDEFINED
        } else {
            work.solve.note(Moved::Newton);
            let now = deviation(&work.solve.model, &work.solve.at.x, &work.solve.at.f);
            if work.idle.note(now) <= self.patience {
                return work.solve.goes_on();
            }
            STALLED
        };
        if work.solve.is_done() || work.solve.restarts == self.restarts {
            return work.solve.ends(why);
        }
        work.solve.restarts += 1;
        work.idle = Idle::default();
        work.solve.at.again(&mut work.solve.model);
        work.solve.goes_on()
    }

    fn publish(&self, _: &Mcp, point: &mut LcpPoint, work: &mut Work) {
        work.solve.publish(point);
    }

    fn account(&self, work: &Work) -> Vec<String> {
        let Work { linear, unsolved, .. } = work;
        let mut said = format!("pivots {}", linear.pivots);
        if *unsolved > 0 {
            said += &format!("; {unsolved} linear problems not solved");
        }
        work.solve.account(vec![said])
    }

    fn check_every(&self, _: &Self::Work) -> usize {
        CHECK_EVERY
    }
}
