//! The settings of the scheme, and of the solver inside.

use nonsmooth_scenes::vec3::{Vec3, add, scale};
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use crate::SimulateError;
use crate::error::require;
use crate::restitution::Rule;

/// Moreau–Jean's θ-scheme for rigid bodies; the mathematics stands at the head of `step/mod.rs`.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(default, deny_unknown_fields)]
pub struct MoreauJean {
    /// The weight of the end of the step, from ½ to 1. ½ keeps energy; impacts dissipate for `½ ≤ θ ≤ 1/(1 + e)`.
    pub theta: f64,
    /// How the gyroscopic torque enters.
    pub gyroscopic: Gyroscopic,
    /// Where normals and arms are taken.
    pub geometry: Geometry,
    /// Which contacts a step knows.
    pub activation: Activation,
    /// What u⁻, u⁺ and r have to do with each other at an impact.
    pub impact: Impact,
    /// What keeps joints closed and bodies out of each other.
    pub stabilisation: Stabilisation,
    /// No restitution where bodies approach more slowly than this, m/s.
    pub restitution_threshold: f64,
    /// Passes over rotation and contact end when they change velocities by less than this share.
    pub tolerance: f64,
    /// The most passes in a step.
    pub passes: u32,
    /// How often a step that fails may be cut in two.
    pub halvings: u8,
}

impl Default for MoreauJean {
    fn default() -> Self {
        Self {
            theta: 0.5,
            gyroscopic: Gyroscopic::Split,
            geometry: Geometry::Extrapolated,
            activation: Activation::default(),
            impact: Impact::Newton,
            stabilisation: Stabilisation::DirectProjection,
            restitution_threshold: 0.0,
            tolerance: 1e-10,
            passes: 20,
            halvings: 0,
        }
    }
}

/// How the gyroscopic torque `Ω × J Ω` enters.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
pub enum Gyroscopic {
    /// By the last pass, so that M stays symmetric; a fixed point that contracts by about `h ‖Ω‖`. At its end the rotation solves the implicit rule.
    Split,
    /// Not at all: `J Ω' = torque`. Neither energy nor momentum of asymmetric bodies is kept; to see what the term does.
    Off,
}

/// Where the directions of a step are taken.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
pub enum Geometry {
    /// At the beginning of the step.
    Frozen,
    /// Impulses at the middle of the step, extrapolated by the velocities at its beginning; velocities of contacts that persist at its end, so that what
    /// rolls or slides on a curved surface stays on it to second order.
    Extrapolated,
    /// As extrapolated, but joints at the middle that the step comes to, by further passes: with θ = ½ their equations and the energy are kept to rounding,
    /// without projection. Some four times the work of joints.
    Midpoint,
}

/// Which contacts take part in a step; g is the gap and `u_N` its rate at the beginning.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case", deny_unknown_fields)]
pub enum Activation {
    /// Those with `g + γ h u_N ≤ slack`: the forecast index set.
    Forecast {
        /// γ.
        #[serde(default = "half")]
        gamma: f64,
        /// What counts as touching, as a share of the smaller body: above rounding, below everything else.
        #[serde(default = "touching")]
        slack: f64,
    },
    /// Those that could close during the step, with the law `0 ≤ u_N + max(g, 0)/h ⟂ r_N ≥ 0`: no penetration to first order and no restitution before
    /// the gap is closed. For piles and coarse steps.
    Gap,
}

impl Default for Activation {
    fn default() -> Self {
        Self::Forecast { gamma: half(), slack: touching() }
    }
}

fn half() -> f64 {
    0.5
}

fn touching() -> f64 {
    1e-9
}

/// The law of impact.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
pub enum Impact {
    /// Newton's: `u_N⁺ ≥ −e u_N⁻`, Coulomb's law with u_T⁺ (or `u_T⁺ + e_T u_T⁻`). With e > 0 and friction energy may grow. What opens while something hits
    /// it has the largest e of the impacts.
    Newton,
    /// Frémond's: the laws of sliding and of rolling friction with the mean velocity of the step; every contact of an impact dissipates for `½ ≤ θ ≤ 1/(1 + e)`. A contact
    /// that stuck in the step before has u_T⁺, one that did not roll u_R⁺, else what is left of them would change its sign for ever.
    Fremond,
}

/// What keeps joints closed and bodies out of each other, whose laws hold for velocities.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
pub enum Stabilisation {
    /// Nothing: they drift apart, by O(h²) at θ = ½.
    None,
    /// After each step the smallest corrections of positions and of velocities, in the norm of the masses, that close joints.
    DirectProjection,
    /// The same, and positions are moved out of penetration too, velocities are not; also limits of joints are kept. A step costs a detection more, and where
    /// something penetrates some frictionless problems. What was pushed takes part in the next step, or what is lifted would fall again and again.
    ContactProjection,
    /// The same, and contacts that the projection pushes but the forecast had open take part in the step, which is tried anew until no more come.
    CombinedProjection,
}

impl Stabilisation {
    /// Whether contacts are projected.
    pub fn has_contacts(self) -> bool {
        matches!(self, Self::ContactProjection | Self::CombinedProjection)
    }
}

impl MoreauJean {
    /// `θ new + (1 − θ) old`.
    pub(crate) fn mean(&self, old: Vec3, new: Vec3) -> Vec3 {
        add(scale(self.theta, new), scale(1.0 - self.theta, old))
    }

    /// What contacts do at an impact, and limits of joints, which know no threshold.
    pub(crate) fn restitution(&self) -> [Rule; 2] {
        [self.restitution_threshold, 0.0].map(|u| Rule::new(self.impact, self.theta, u))
    }

    /// Checks every value.
    pub(crate) fn validate(&self) -> Result<(), SimulateError> {
        let key = |name: &'static str| move || format!("integrator.{name}");
        let t = self.theta;
        require(key("theta"), t, (0.5..=1.0).contains(&t), "a number from 0.5 to 1")?;
        let tol = self.tolerance;
        require(key("tolerance"), tol, tol > 0.0 && tol < 1.0, "a number between 0 and 1")?;
        let u = self.restitution_threshold;
        require(key("restitution_threshold"), u, u >= 0.0, "a velocity of at least 0")?;
        require(key("passes"), self.passes.into(), self.passes > 0, "at least 1")?;
        self.activation.validate("integrator")
    }
}

impl Activation {
    /// γ and the slack of the forecast, where it is one.
    pub(crate) fn forecast(self) -> Option<(f64, f64)> {
        match self {
            Self::Forecast { gamma, slack } => Some((gamma, slack)),
            Self::Gap => None,
        }
    }

    /// What is to be said of it where a law has `e > 0`.
    pub(crate) fn warning(self, of: &str) -> Option<String> {
        (self == Self::Gap).then(|| format!("{of}.activation: `gap` spends the approach in the step that closes a gap: what hits something keeps less than e of its speed"))
    }

    pub(crate) fn validate(&self, of: &str) -> Result<(), SimulateError> {
        let Some((gamma, slack)) = self.forecast() else { return Ok(()) };
        let key = |name: &'static str| move || format!("{of}.activation.forecast.{name}");
        require(key("gamma"), gamma, (0.0..=1.0).contains(&gamma), "a number from 0 to 1")?;
        require(key("slack"), slack, slack >= 0.0, "a number of at least 0")
    }
}
