//! **Hyperplane projection**: `x ← P_X(x − γ τ_k d_k)`, a step to (or beyond) a hyperplane that parts x from the solutions.
//!
//! Problem: find x ∈ X with `F(x)ᵀ(y − x) ≥ 0` for all y ∈ X.
//!
//! Method: a prediction `x̄ = P_X(x − ρ_k F(x))` with a self-adaptive step; a hyperplane through x̄ with the normal d that has x on one side
//! and, for monotone F, all solutions on the other; γ times the way from x to it, `τ = dᵀ(x − x̄)/‖d‖²`, then back to X. Each step
//! brings x closer to every solution, without a Lipschitz constant. The normal is
//!
//! ```text
//! d = x − x̄ − ρ(F(x) − F(x̄))    residual: vanishes at the solution, so τ stays of order one
//! d = F(x̄)                      field: the classical one
//! ```
//!
//! References: SolodovTseng1996 (residual); SolodovSvaiter1999 (field); FacchineiPang2003, section 12.1.3.
//! Cost of a step: two values of F and two projections, more where the step is shortened. Storage: 5 vectors.
//! Fails: as the extragradient method. With the normal F(x̄), where that is not zero at the solution, τ tends to zero.

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use super::{Method, Ratio, State, StepRule};
use crate::core::ranges::below;
use crate::core::register::{About, Described, Solves};
use crate::core::settings::{Settings, described};

/// The hyperparameters of the hyperplane projection.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields, default)]
pub struct Hyperplane {
    /// The normal of the hyperplane.
    pub normal: Normal,
    /// How far beyond (above 1) or short of (below 1) the hyperplane a step goes, in (0, 2).
    pub gamma: f64,
    /// What the prediction's step length is measured by.
    pub rule: Ratio,
    /// Accept a prediction whose ratio is at most this, in (0, 1).
    pub accept: f64,
    /// Lengthen the next prediction after a ratio below this, in (0, accept).
    pub grow_below: f64,
    /// The factor by which a prediction's step is shortened, in (0, 0.99); its inverse lengthens.
    pub shrink: f64,
    /// Steps between two evaluations of the true residual, unless the estimate asks for one earlier.
    pub check_every: usize,
}

/// The normals of the hyperplane.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
pub enum Normal {
    /// `x - x' - rho (F(x) - F(x'))`.
    #[default]
    Residual,
    /// `F(x')`, the classical one.
    Field,
}

impl Default for Hyperplane {
    fn default() -> Self {
        let StepRule { accept, grow_below, shrink, check_every, .. } = StepRule::default();
        Self {
            normal: Normal::Residual,
            gamma: 1.5,
            rule: Ratio::SolodovTseng,
            accept,
            grow_below,
            shrink,
            check_every,
        }
    }
}

impl Hyperplane {
    fn step_rule(&self) -> StepRule {
        let Self { rule, accept, grow_below, shrink, check_every, .. } = *self;
        StepRule { rule, accept, grow_below, shrink, check_every }
    }
}

impl Settings for Hyperplane {
    fn validate(&self) -> Result<(), String> {
        below("gamma", self.gamma, 2.0)?;
        self.step_rule().validate()
    }
}

impl Described for Hyperplane {
    const ABOUT: &'static About = &About {
        name: "hyperplane",
        family: "projection",
        solves: Solves::Law,
        summary: "hyperplane projection with a self-adaptive prediction",
        needs: &[],
        cites: &["SolodovTseng1996", "SolodovSvaiter1999", "FacchineiPang2003"],
        variants: &["rule=khobotov", "normal=field"],
        settings: described::<Self>,
    };
}

impl Method for Hyperplane {
    fn advance(&self, x: &mut [f64], state: &mut State) -> Option<f64> {
        let rule = self.step_rule();
        let ratio = state.predict(&rule, x)?; // x̄ = P_X(x − ρ F(x)), F(x̄)
        let estimate = state.estimate(x);
        if self.normal == Normal::Residual {
            let State { f, trial, trial_f, rho, .. } = state;
            for i in 0..x.len() {
                trial_f[i] = x[i] - trial[i] - *rho * (f[i] - trial_f[i]);
            }
        }
        let d = &state.trial_f;
        let ahead: f64 = (0..x.len()).map(|i| d[i] * (x[i] - state.trial[i])).sum();
        let tau = ahead / d.iter().map(|d| d * d).sum::<f64>();
        // Else x̄ is behind no hyperplane (F is not monotone there, or x̄ = x solves the problem): go there.
        if tau > 0.0
            && tau.is_finite()
            && !state.project(x, self.gamma * tau, |state| &state.trial_f)
        {
            return None;
        }
        x.copy_from_slice(&state.trial); //           P_X(x − γ τ d)
        state.known = false;
        rule.adapt(ratio, &mut state.rho);
        Some(estimate)
    }

    fn check_every(&self) -> usize {
        self.check_every
    }
}
