//! **Fixed-point projection** with a self-adaptive step: `x ← P_X(x − ρ_k F(x))`.
//!
//! Problem: find x ∈ X with `F(x)ᵀ(y − x) ≥ 0` for all y ∈ X.
//!
//! Method: the step length is shortened until `ρ‖F(x) − F(x̄)‖ ≤ 0.9‖x − x̄‖` with `x̄ = P_X(x − ρF(x))`, then `x ← x̄`;
//! after a timid step it grows again.
//!
//! References: FacchineiPang2003, section 12.1; Khobotov1987 and HanLo2002 for the step.
//! Cost of a step: one value of F and one projection for each trial step, usually one. Storage: 5 vectors.
//! Fails: F must be strongly monotone (or a gradient's); where it turns about the solution, as `(x_2, −x_1)`, the steps go round.

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use super::{Method, State, StepRule};
use crate::core::register::{About, Described, Solves};
use crate::core::settings::{Settings, described};

/// The hyperparameters: those of the step rule.
#[derive(Debug, Clone, Copy, Default, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(transparent)]
pub struct FixedPoint(pub StepRule);

impl Settings for FixedPoint {
    fn validate(&self) -> Result<(), String> {
        self.0.validate()
    }
}

impl Described for FixedPoint {
    const ABOUT: &'static About = &About {
        name: "fixed_point",
        family: "projection",
        solves: Solves::Law,
        summary: "fixed-point projection with a self-adaptive step",
        needs: &[],
        cites: &["FacchineiPang2003", "Khobotov1987", "HanLo2002"],
        variants: &["rule=solodov_tseng"],
        settings: described::<Self>,
    };
}

impl Method for FixedPoint {
    fn advance(&self, x: &mut [f64], state: &mut State) -> Option<f64> {
        let ratio = state.predict(&self.0, x)?; // x̄ = P_X(x − ρ F(x)), F(x̄)
        let estimate = state.estimate(x);
        x.copy_from_slice(&state.trial); //        x ← x̄, and F(x) is known
        std::mem::swap(&mut state.f, &mut state.trial_f);
        self.0.adapt(ratio, &mut state.rho);
        Some(estimate)
    }

    fn check_every(&self) -> usize {
        self.0.check_every
    }
}
