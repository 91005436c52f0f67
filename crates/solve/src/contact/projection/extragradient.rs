//! **Extragradient** with a self-adaptive step: `r̄ = P_K(r − ρ_k F(r))`, `r ← P_K(r − ρ_k F(r̄))`.
//!
//! Problem: find r ∈ K with `F(r)ᵀ(r' − r) ≥ 0` for all r' ∈ K, `F(r) = W r + q + (mu‖u_T‖e_N)_c`.
//!
//! Method: the prediction's step is shortened until `ρ‖F(r) − F(r̄)‖ ≤ 0.9‖r − r̄‖`; the correction projects from r along
//! the field at r̄. Converges for monotone Lipschitz F, without knowing the constant.
//!
//! References: Korpelevich1976; Khobotov1987; Acary, lecture, projection methods for VI.
//! Cost of a step: two products with W, more where the step is shortened. Storage: 4 vectors.
//! Fails: as the fixed point, at twice the price a step, but it needs only monotonicity where the fixed point needs
//! more.

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use super::{Field, Method, StepRule};
use crate::contact::form::Linear;
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
        cites: &["Korpelevich1976", "Khobotov1987", "SolodovTseng1996", "Acary2018"],
        variants: &["rule=solodov_tseng"],
        settings: described::<Self>,
    };
}

impl Method for Extragradient {
    fn begin<P: Linear<D>, const D: usize>(&self, _: &P, _: &[f64], _: &mut Field<P, D>) {}

    fn advance<P: Linear<D>, const D: usize>(
        &self,
        problem: &P,
        r: &mut [f64],
        field: &mut Field<P, D>,
    ) -> f64 {
        Field::evaluate(&mut field.state, problem, r, &mut field.f); // F(r)
        let ratio = field.predict(&self.0, problem, r); //                r̄ = P_K(r − ρ F(r)), F(r̄)
        let estimate = field.estimate(r);
        field.project(problem, r, true); //                              P_K(r − ρ F(r̄))
        r.copy_from_slice(&field.trial);
        self.0.adapt(ratio, &mut field.rho);
        estimate
    }

    fn check_every(&self) -> usize {
        self.0.check_every
    }
}
