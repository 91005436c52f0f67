//! Newton's restitution of rows that push only and may act together: contacts, limits of joints, gaps of Lagrangian systems.
//!
//! The law is `0 ≤ r ⟂ u⁺ + s ≥ 0`, with `s = e u_k` for what approaches. What has rebounded opens, `u_k > 0`, and is still in the index set, for positions lag behind
//! velocities by half a step; something else may press it there. Did the law ask for u⁺ ≥ 0, the impulse would act on what opens, with a work of ½ (u⁺ + u_k) r that nothing
//! takes back. Without friction
//!
//! ```text
//! 2 (T⁺ − T) = Σ (u_k − s) r,      Σ (u_k + s) r = −rᵀ W r,
//! ```
//!
//! so energy cannot grow where `s = c u_k` of all that open and `|s| ≤ c |u_k|` of all that approach: c is the largest e among the impacts of the island, and at least
//! the row's own unless it lasts. So what rests or rolls keeps `u⁺ ≥ 0` until something hits it, and as c ≤ 1 no gap closes at θ = ½. Frémond's law, by which each contact
//! dissipates by itself, asks for u_θ ≥ 0 of all that open, also where nothing rebounds.

use crate::Impact;

/// What a scheme says of restitution.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Rule {
    /// What approaches no faster does not rebound.
    threshold: f64,
    /// The least c of what opens.
    least: f64,
}

impl Rule {
    pub fn new(impact: Impact, theta: f64, threshold: f64) -> Self {
        let least = match impact {
            Impact::Newton => 0.0,
            Impact::Fremond => (1.0 - theta) / theta,
        };
        Self { threshold, least }
    }
}

/// The coefficients of a row: in an impact, and as it opens.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub(crate) struct Restitution {
    impact: f64,
    opening: f64,
}

impl Restitution {
    /// With the coefficient e; what lasts rests or rolls, and what waits closes its gap without a rebound.
    pub fn new(e: f64, lasts: bool, waits: bool) -> Self {
        let unless = |not: bool| if not { 0.0 } else { e };
        Self { impact: unless(waits), opening: unless(lasts) }
    }

    /// The coefficient with which it hits its island where it approaches with u and what is slower than `slow` is no impact.
    pub fn hit(self, u: f64, slow: f64, rule: Rule) -> f64 {
        if u < -slow.max(rule.threshold) { self.impact } else { 0.0 }
    }

    /// s/u_k for the velocity u at the beginning of a step; `hit` is the largest coefficient with which something hits its island.
    pub fn share(self, u: f64, hit: f64, rule: Rule) -> f64 {
        if u < -rule.threshold {
            return self.impact;
        }
        let own = if u > rule.threshold { self.opening } else { 0.0 };
        if u > 0.0 { hit.max(own).max(rule.least) } else { 0.0 }
    }
}
