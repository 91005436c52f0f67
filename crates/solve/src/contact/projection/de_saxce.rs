//! **De Saxcé–Feng fixed point** (Uzawa): `r ← P_K(r − ρ F(r))` with one ρ for the whole solve.
//!
//! Problem: find r ∈ K with `F(r)ᵀ(r' − r) ≥ 0` for all r' ∈ K, `F(r) = W r + q + (mu‖u_T‖e_N)_c`.
//!
//! Method: a projection step along −F with `ρ_c = ρ/w_c`, `w_c = tr(W_cc)/D`. The automatic ρ is the inverse of the largest
//! eigenvalue of W in that metric, by 20 steps of the power method.
//!
//! References: DeSaxceFeng1991; Acary, lecture (105)(106).
//! Cost of a step: one product with W (explicit, or Hᵀ M⁻¹ H without forming it). Storage: 3 vectors.
//! Fails: needs ρ below about 2/λ_max; linear convergence with a rate that tends to 1 with the condition of W.

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use super::{Field, Method};
use crate::contact::form::Linear;
use crate::core::ranges::{at_least, nonnegative};
use crate::core::register::{About, Described, Solves};
use crate::core::settings::{Settings, described};

/// The hyperparameters of the De Saxcé fixed point.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields, default)]
pub struct DeSaxce {
    /// The step in units of 1/w_c; 0 chooses the inverse of the largest eigenvalue.
    pub rho: f64,
    /// Steps between two evaluations of the true residual, unless the estimate asks for one earlier.
    pub check_every: usize,
}

impl Default for DeSaxce {
    fn default() -> Self {
        Self { rho: 0.0, check_every: 20 }
    }
}

impl Settings for DeSaxce {
    fn validate(&self) -> Result<(), String> {
        nonnegative("rho", self.rho)?;
        at_least("check_every", self.check_every, 1)
    }
}

impl Described for DeSaxce {
    const ABOUT: &'static About = &About {
        name: "de_saxce",
        family: "projection",
        solves: Solves::Law,
        summary: "De Saxce-Feng fixed point (Uzawa) with a fixed step",
        needs: &[],
        cites: &["DeSaxceFeng1991", "Acary2018"],
        variants: &[],
        settings: described::<Self>,
    };
}

impl Method for DeSaxce {
    fn begin<P: Linear<D>, const D: usize>(&self, problem: &P, _: &[f64], field: &mut Field<P, D>) {
        field.rho = if self.rho > 0.0 { self.rho } else { 1.0 / field.largest_eigenvalue(problem) };
    }

    fn advance<P: Linear<D>, const D: usize>(
        &self,
        problem: &P,
        r: &mut [f64],
        field: &mut Field<P, D>,
    ) -> f64 {
        Field::evaluate(&mut field.state, problem, r, &mut field.f); // F(r)
        field.project(problem, r, false); //                             P_K(r − ρ F(r))
        let estimate = field.estimate(r);
        r.copy_from_slice(&field.trial);
        estimate
    }

    fn check_every(&self) -> usize {
        self.check_every
    }
}
