//! **Extragradient** with a self-adaptive step: `x̄ = P_X(x − ρ_k F(x))`, `x ← P_X(x − ρ_k F(x̄))`.
//!
//! Problem: find x ∈ X with `F(x)ᵀ(y − x) ≥ 0` for all y ∈ X.
//!
//! Method: the prediction's step is shortened until `ρ‖F(x) − F(x̄)‖ ≤ 0.9‖x − x̄‖`; the correction projects from x along
//! F at x̄. Converges for monotone F that is Lipschitz near the solutions, without knowing the constant.
//!
//! References: Korpelevich1976; Khobotov1987; FacchineiPang2003, section 12.1.2.
//! Cost of a step: two values of F and two projections, more where the step is shortened. Storage: 5 vectors.
//! Fails: where F is not monotone; linear convergence, with a rate that tends to 1 with the condition of JF.

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use super::{Method, State, StepRule};
use crate::core::register::{About, Described, Solves};
use crate::core::settings::{Settings, described};

/// The hyperparameters: those of the step rule.
#[derive(Debug, Clone, Copy, Default, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(transparent)]
pub struct Extragradient(pub StepRule);

impl Settings for Extragradient {
    fn validate(&self) -> Result<(), String> {
        self.0.validate()
    }
}

impl Described for Extragradient {
    const ABOUT: &'static About = &About {
        name: "extragradient",
        family: "projection",
        solves: Solves::Law,
        summary: "extragradient projection with a self-adaptive step",
        needs: &[],
        cites: &["Korpelevich1976", "Khobotov1987", "FacchineiPang2003"],
        variants: &["rule=solodov_tseng"],
        settings: described::<Self>,
    };
}

impl Method for Extragradient {
    fn advance(&self, x: &mut [f64], state: &mut State) -> Option<f64> {
        let ratio = state.predict(&self.0, x)?; // x̄ = P_X(x − ρ F(x)), F(x̄)
        let estimate = state.estimate(x);
        let rho = state.rho;
        if !state.project(x, rho, |state| &state.trial_f) {
            return None;
        }
        x.copy_from_slice(&state.trial); //        x ← P_X(x − ρ F(x̄))
        state.known = false;
        self.0.adapt(ratio, &mut state.rho);
        Some(estimate)
    }

    fn check_every(&self) -> usize {
        self.0.check_every
    }
}
