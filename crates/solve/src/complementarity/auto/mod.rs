//! **auto** for complementarity problems: chooses by size, class and structure, falls back, and says what it tried and why.
//!
//! Problem: LCP, MLCP, horizontal and box LCP; of nonlinear problems see `nonlinear.rs`.
//!
//! Method: on problems so small that a look at the matrix costs as much as a solve, pivots at once; then a plan of solvers in the order of their promise on the problem at hand
//! (`plan.rs`); then, while time and iterations last, cases of few pairs, other covering vectors and other starts of Newton's method in turn, with ever larger budgets. Each starts from the best point before it and has a budget of
//! iterations, never of seconds, so that a run repeats itself. The first that solves the problem, or proves that there is no solution, ends the solve.
//!
//! References: CottlePangStone2009; FacchineiPang2003; Acary2018 (how to choose); the solvers' own files.
//!
//! Cost: that of the solvers tried. Fails: where all of them do.

mod nonlinear;
mod plan;
mod predictor;

use nonsmooth_problem::{BoxLcp, Hlcp, Lcp, Mlcp};
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use crate::core::register::Registered;
use crate::core::register::{About, Described, Solves};
use crate::core::settings::{Settings, described};

pub use crate::core::portfolio::{Candidate, Portfolio};

/// The hyperparameters of `auto` for complementarity problems; none needs to be set.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields, default)]
pub struct Auto {
    /// Enumerate all complementary bases, as the last resort, up to this many complementary pairs.
    pub enumerate_below: usize,
    /// Perturbed starts of a nonlinear problem that are tried in a turn where nothing has solved it: two turns without a limit on time, else until it is over.
    pub restarts: usize,
}

impl Default for Auto {
    fn default() -> Self {
        Self { enumerate_below: 20, restarts: 20 }
    }
}

impl Settings for Auto {}

impl Described for Auto {
    const ABOUT: &'static About = &About {
        name: "auto",
        family: "auto",
        solves: Solves::Law,
        summary: "needs no setting: a plan of solvers by size, class and structure, until one solves the problem or proves that there is no solution",
        needs: &[],
        cites: &["CottlePangStone2009", "FacchineiPang2003", "Munson2002", "Acary2018"],
        variants: &[],
        settings: described::<Self>,
    };
}

/// A kind of problem that `auto` has a plan for.
pub trait Planned: Registered {
    /// The solvers to try at this stage, in this order: first those that need no look at the problem, then a plan by its class and structure, then what time
    /// that is left is good for. None: the end.
    fn plan(&self, settings: &Auto, stage: usize) -> Vec<Candidate>;
}

impl Auto {
    /// A session without history: the plan is made of the first problem that it meets.
    pub fn session<P: Planned>(self) -> Portfolio<P> {
        Portfolio::new(move |problem: &P, stage| problem.plan(&self, stage))
    }
}

impl Planned for Lcp {
    fn plan(&self, settings: &Auto, stage: usize) -> Vec<Candidate> {
        plan::of_lcp(self, settings, stage)
    }
}

impl Planned for Mlcp {
    fn plan(&self, settings: &Auto, stage: usize) -> Vec<Candidate> {
        plan::of_mlcp(self, settings, stage)
    }
}

impl Planned for BoxLcp {
    fn plan(&self, settings: &Auto, stage: usize) -> Vec<Candidate> {
        plan::of_box(self, settings, stage)
    }
}

impl Planned for Hlcp {
    fn plan(&self, settings: &Auto, stage: usize) -> Vec<Candidate> {
        plan::of_hlcp(self, settings, stage)
    }
}
