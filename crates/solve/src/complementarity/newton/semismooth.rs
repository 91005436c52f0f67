//! **semismooth**: the semismooth Newton method of De Luca, Facchinei and Kanzow for nonlinear problems, as in the code SEMI.
//!
//! Problem: `l ≤ x ≤ u ⟂ F(x)`. Method: Newton's direction `B d = −Φ`, B of the B-subdifferential of the penalised Fischer–Burmeister function Φ of all pairs, along the
//! projected direction with a non-monotone search on `Ψ = ½‖Φ‖²`; where it does not descend, that of a regularised Jacobian, then the gradient. After a short crash (projected Newton
//! steps that look for the active set) it begins at the start; where it stalls it begins again with other options:
//!
//! | start | crash | λ | memory | κ |
//! | --- | --- | --- | --- | --- |
//! | first | yes | `lambda` | `memory` | 1 |
//! | second | no | .95 | 4 | 1 |
//! | third | yes | .95 | 4 | 5 |
//! | fourth | no | 1: plain Fischer–Burmeister | 1: monotone | 1 |
//!
//! References: DeLucaFacchineiKanzow1996; ChenChenKanzow2000 (penalty); Munson2002 (crash, restarts); Acary2018 (74). Cost of a step: one LU of the pattern of JF.
//! Fails: at stationary points of Ψ that are no solutions, where JF is not P0 there.

use nonsmooth_problem::{LcpPoint, Mcp};
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use crate::complementarity::functions::Penalised;
use crate::complementarity::parts::nonlinear::{
    CHECK_EVERY, Crash, Descent, Idle, Inner, MEMORY_MOST, Options, Solve,
};
use crate::core::ranges::{at_least, at_most, up_to};
use crate::core::register::{About, Described, Solves};
use crate::core::settings::{Settings, described};
use crate::{SolveError, Solver, Step};

/// The hyperparameters.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields, default)]
pub struct Semismooth {
    /// The weight of the Fischer-Burmeister function, in (0, 1]; the rest is the penalty's.
    pub lambda: f64,
    /// Of how many merits the largest is the reference of the search; 1: monotone.
    pub memory: usize,
    /// Whether projected Newton steps that look for the active set come first.
    pub crash: bool,
    /// Whether it begins again with other options where it stalls.
    pub restarts: bool,
    /// Where it begins: 0 at the start, other numbers at points around it, ever farther with the number modulo 4.
    pub seed: u64,
}

impl Default for Semismooth {
    fn default() -> Self {
        Self { lambda: 0.8, memory: 4, crash: true, restarts: true, seed: 0 }
    }
}

impl Settings for Semismooth {
    fn validate(&self) -> Result<(), String> {
        up_to("lambda", self.lambda, 1.0)?;
        at_least("memory", self.memory, 1)?;
        at_most("memory", self.memory, MEMORY_MOST)
    }
}

impl Described for Semismooth {
    const ABOUT: &'static About = &About {
        name: "semismooth",
        family: "newton",
        solves: Solves::Law,
        summary: "semismooth Newton on the penalised Fischer-Burmeister function, with crash and restarts (the code SEMI)",
        needs: &[],
        cites: &["DeLucaFacchineiKanzow1996", "ChenChenKanzow2000", "Munson2002", "Acary2018"],
        variants: &["crash=false", "seed=1"],
        settings: described::<Self>,
    };
}

/// The workspace.
pub struct Work {
    solve: Solve,
    crash: Crash,
    descent: Descent<Penalised, Penalised>,
    idle: Idle,
}

/// Steps in which the residual must halve.
const PATIENCE: usize = 100;

impl Semismooth {
    /// The options of a start: whether there is a crash, the function, the search.
    fn start_of(&self, turn: usize) -> Option<(bool, Penalised, Options)> {
        let plain = Options { memory: self.memory, ..Options::default() };
        let restart = |crash, lambda, memory, slack| {
            let options = Options { memory, slack, ..Options::default() };
            self.restarts.then_some((crash, Penalised { lambda }, options))
        };
        match turn {
            0 => Some((self.crash, Penalised { lambda: self.lambda }, plain)),
            1 => restart(false, 0.95, 4, 1.0),
            2 => restart(true, 0.95, 4, 5.0),
            3 => restart(false, 1.0, 1, 1.0),
            _ => None,
        }
    }

    /// Begins the start of this number; false where there is none.
    fn begin(&self, turn: usize, work: &mut Work) -> bool {
        let Some((crash, function, options)) = self.start_of(turn) else { return false };
        work.crash.begin(crash);
        work.descent.restart(function, function, options);
        work.idle = Idle::default();
        true
    }
}

impl Solver<Mcp> for Semismooth {
    type Work = Work;

    fn work(&self, problem: &Mcp) -> Result<Work, SolveError> {
        let solve = Solve::new(problem);
        let function = Penalised { lambda: self.lambda };
        let descent = Descent::new(function, function, Options::default(), &solve.model);
        Ok(Work { crash: Crash::new(&solve.model), descent, solve, idle: Idle::default() })
    }

    fn aim(&self, tolerance: f64, work: &mut Work) {
        work.solve.aim(tolerance);
    }

    fn start(&self, _: &Mcp, point: &mut LcpPoint, work: &mut Work) {
        work.solve.begin(point);
        if self.seed > 0 {
            work.solve.at.perturbed(&mut work.solve.model, self.seed);
        }
        self.begin(0, work);
    }

    fn step(&self, _: &Mcp, _: &mut LcpPoint, work: &mut Work) -> Step {
        let Work { solve, crash, descent, idle } = work;
        if !crash.is_over() {
            crash.step(&mut solve.model, &mut solve.at);
            return solve.goes_on();
        }
        let moved = descent.step(&mut solve.model, &mut solve.at);
        solve.note(moved);
        let idle_for = idle.note(solve.at.residual);
        if moved.moved() && idle_for <= PATIENCE {
            return solve.goes_on();
        }
        if work.solve.is_done() {
            return Step::Done;
        }
        let turn = work.solve.restarts + 1;
        if !self.begin(turn, work) {
            return work.solve.ends(moved.why());
        }
        work.solve.restarts = turn;
        work.solve.at.again(&mut work.solve.model);
        work.solve.goes_on()
    }

    fn publish(&self, _: &Mcp, point: &mut LcpPoint, work: &mut Work) {
        work.solve.publish(point);
    }

    fn account(&self, work: &Work) -> Vec<String> {
        work.solve.account(vec![format!("crash steps {}", work.crash.steps())])
    }

    fn check_every(&self, _: &Self::Work) -> usize {
        CHECK_EVERY
    }
}
