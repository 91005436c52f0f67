//! The self-adaptive step length of the projection methods.
//!
//! Shorten ρ while `ρ‖F(r) − F(r̄)‖ > accept ‖r − r̄‖`, `r̄ = P_K(r − ρF(r))`; lengthen it after a step whose ratio was small.
//! Source: Khobotov1987; HanLo2002; Acary, lecture, self-adaptive rules.

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use super::at_least_one;
use super::field::Field;
use crate::form::Linear;
use crate::settings::Settings;

/// The hyperparameters of a projection method with a self-adaptive step.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields, default)]
#[schemars(inline)]
pub struct StepRule {
    /// Accept a step whose ratio `rho |F(r) - F(r')| / |r - r'|` is at most this, in (0, 1).
    pub accept: f64,
    /// Lengthen the next step after a ratio below this, in (0, accept).
    pub grow_below: f64,
    /// The factor by which a step is shortened, in (0, 1); its inverse lengthens.
    pub shrink: f64,
    /// Steps between two evaluations of the true residual, unless the estimate asks for one earlier.
    pub check_every: usize,
}

impl Default for StepRule {
    fn default() -> Self {
        Self { accept: 0.9, grow_below: 0.3, shrink: 0.67, check_every: 20 }
    }
}

impl Settings for StepRule {
    fn validate(&self) -> Result<(), String> {
        let inside = |name: &str, x: f64, high: f64| {
            if x > 0.0 && x < high {
                Ok(())
            } else {
                Err(format!("{name}: expected a number in (0, {high}), found {x}"))
            }
        };
        inside("accept", self.accept, 1.0)?;
        inside("grow_below", self.grow_below, self.accept)?;
        inside("shrink", self.shrink, 1.0)?;
        at_least_one("check_every", self.check_every)
    }
}

impl StepRule {
    /// From `field.f = F(r)`: `trial = P_K(r − ρ F(r))` and `trial_f = F(trial)` with an acceptable ρ; the ratio.
    pub(super) fn predict<P: Linear<D>, const D: usize>(
        &self,
        problem: &P,
        r: &[f64],
        field: &mut Field<P, D>,
    ) -> f64 {
        loop {
            field.project(problem, r, false);
            Field::evaluate(&mut field.state, problem, &field.trial, &mut field.trial_f);
            let ratio = field.lipschitz_ratio(r);
            // NaN: nothing moved, or F is not finite, which the driver notices.
            if ratio.is_nan() || ratio <= self.accept || field.rho < 1e-300 {
                return ratio;
            }
            field.rho *= self.shrink;
        }
    }

    /// Lengthens the next step where the last was timid.
    pub(super) fn adapt(&self, ratio: f64, rho: &mut f64) {
        if ratio < self.grow_below {
            *rho /= self.shrink;
        }
    }
}
