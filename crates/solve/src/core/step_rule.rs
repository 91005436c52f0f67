//! The self-adaptive step length of the projection methods.
//!
//! Shorten ρ while the ratio of a rule is above `accept`, with `r̄ = P_K(r − ρF(r))`; lengthen it after a step whose ratio was
//! small. In the metric of the methods (of contacts `diag(w_c)` for impulses, its inverse for velocities) the ratios are
//!
//! ```text
//! ρ ‖F(r) − F(r̄)‖ / ‖r − r̄‖                  Khobotov
//! ρ (F(r) − F(r̄))ᵀ(r − r̄) / ‖r − r̄‖²         Solodov–Tseng
//! ```
//!
//! The second is never larger than the first, so it allows longer steps. It is what makes `F(r̄)ᵀ(x − r̄) = 0` separate r
//! from the solutions (monotone F): `F(r̄)ᵀ(r − r̄) ≥ (1 − accept)‖r − r̄‖²/ρ`.
//!
//! Source: Khobotov1987; SolodovTseng1996; HanLo2002 for steps that grow again; AcaryBremondHuber2018, who call the two
//! rules UPK and UPTS.

use nonsmooth_linalg::budget;
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use crate::core::ranges::{at_least, below};
use crate::core::settings::Settings;

/// The hyperparameters of a projection method with a self-adaptive step.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields, default)]
#[schemars(inline)]
pub struct StepRule {
    /// What a step length is measured by.
    pub rule: Ratio,
    /// Accept a step whose ratio is at most this, in (0, 1).
    pub accept: f64,
    /// Lengthen the next step after a ratio below this, in (0, accept).
    pub grow_below: f64,
    /// The factor by which a step is shortened, in (0, 0.99); its inverse lengthens.
    pub shrink: f64,
    /// Steps between two evaluations of the true residual, unless the estimate asks for one earlier.
    pub check_every: usize,
}

/// The ratios that bound a step length.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
pub enum Ratio {
    /// `rho |F(r) - F(r')| / |r - r'|`, a bound on the Lipschitz constant (Khobotov).
    #[default]
    Khobotov,
    /// `rho (F(r) - F(r'))'(r - r') / |r - r'|^2`, longer steps (Solodov and Tseng).
    SolodovTseng,
}

impl Default for StepRule {
    fn default() -> Self {
        Self { rule: Ratio::Khobotov, accept: 0.9, grow_below: 0.3, shrink: 0.67, check_every: 20 }
    }
}

impl Settings for StepRule {
    fn validate(&self) -> Result<(), String> {
        below("accept", self.accept, 1.0)?;
        below("grow_below", self.grow_below, self.accept)?;
        below("shrink", self.shrink, MILDEST)?;
        at_least("check_every", self.check_every, 1)
    }
}

/// A milder factor would shorten for ever, or not at all.
const MILDEST: f64 = 0.99;
/// Steps are no longer than this, whatever the ratios say.
const LONGEST: f64 = 1e300;

impl StepRule {
    /// Shortens ρ until the ratio that the prediction has with it is acceptable, or the time is over; the ratio. NaN, where nothing moves, is; infinite, where F is not defined, is not, whatever ρ.
    pub(crate) fn shorten(&self, rho: &mut f64, mut predict: impl FnMut(f64) -> f64) -> f64 {
        loop {
            let ratio = predict(*rho);
            if ratio.is_nan() || ratio <= self.accept || *rho < 1e-300 || budget::over() {
                return ratio;
            }
            *rho *= self.shrink;
        }
    }

    /// Lengthens the next step where the last was timid, or so short that rounding undid it: then the ratio is NaN. What is too long is shortened again as soon as something moves.
    pub(crate) fn adapt(&self, ratio: f64, rho: &mut f64) {
        if ratio < self.grow_below || ratio.is_nan() {
            // An infinite step could not be shortened again.
            *rho = (*rho / self.shrink).min(LONGEST);
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_step_that_has_grown_for_ever_is_shortened_in_the_end() {
        let (rule, mut rho) = (StepRule::default(), 1.0);
        (0..10_000).for_each(|_| rule.adapt(0.0, &mut rho));
        assert!(rho.is_finite());
        let ratio = rule.shorten(&mut rho, |rho| rho);
        assert!(ratio <= rule.accept && rho == ratio);
    }

    #[test]
    fn a_step_that_moves_nothing_grows() {
        let (rule, mut rho) = (StepRule::default(), 1.0);
        (0..100).for_each(|_| rule.adapt(f64::NAN, &mut rho));
        assert!(rho > 1e16, "{rho}");
        (0..10_000).for_each(|_| rule.adapt(f64::NAN, &mut rho));
        assert!(rho.is_finite());
    }
}
