//! **Fixed-point projection** with a self-adaptive step: `r ← P_K(r − ρ_k F(r))`.
//!
//! Problem: find r ∈ K with `F(r)ᵀ(r' − r) ≥ 0` for all r' ∈ K, `F(r) = W r + q + (mu‖u_T‖e_N)_c`.
//!
//! Method: the step length is shortened until `ρ‖F(r) − F(r̄)‖ ≤ 0.9‖r − r̄‖` with `r̄ = P_K(r − ρF(r))`, then `r ← r̄`;
//! after a timid step it grows again.
//!
//! References: Acary, lecture (105)(106) and the self-adaptive rules; Khobotov1987; HanLo2002.
//! Cost of a step: one product with W for each trial step, usually one. Storage: 4 vectors.
//! Fails: F is not monotone with friction; the rate tends to 1 with the condition of W.

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use super::{Field, Method, StepRule};
use crate::contact::form::Linear;
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
        cites: &["Acary2018", "Khobotov1987", "SolodovTseng1996", "HanLo2002"],
        variants: &["rule=solodov_tseng"],
        settings: described::<Self>,
    };
}

impl Method for FixedPoint {
    fn begin<P: Linear<D>, const D: usize>(&self, problem: &P, r: &[f64], field: &mut Field<P, D>) {
        Field::evaluate(&mut field.state, problem, r, &mut field.f); // F(r)
    }

    fn advance<P: Linear<D>, const D: usize>(
        &self,
        problem: &P,
        r: &mut [f64],
        field: &mut Field<P, D>,
    ) -> f64 {
        let ratio = field.predict(&self.0, problem, r); // r̄ = P_K(r − ρ F(r)), F(r̄)
        let estimate = field.estimate(r);
        r.copy_from_slice(&field.trial); //               r ← r̄, and F(r) is known
        std::mem::swap(&mut field.f, &mut field.trial_f);
        self.0.adapt(ratio, &mut field.rho);
        estimate
    }

    fn check_every(&self) -> usize {
        self.0.check_every
    }
}
