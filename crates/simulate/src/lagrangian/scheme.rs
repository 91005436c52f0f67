//! The settings of the scheme.

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use crate::error::require;
use crate::restitution::Rule;
use crate::{Activation, Impact, SimulateError};

/// Moreau–Jean's θ-scheme for Lagrangian systems; the mathematics stands at the head of `lagrangian/step.rs`.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(default, deny_unknown_fields)]
pub struct LagrangianScheme {
    /// The weight of the end of the step, from ½ to 1. ½ is of second order in smooth motion and keeps the energy of linear systems.
    pub theta: f64,
    /// Where M, H, G are taken.
    pub directions: Directions,
    /// Which velocity relations hold.
    pub relations: RelationsAt,
    /// Which contacts and limits a step knows; the slack is a gap, in its unit. With θ = 1 a contact keeps the gap that it closed with, so where that is one of rounding only a slack above
    /// rounding keeps it in the index set.
    pub activation: Activation,
    /// What u⁻, u⁺ and r have to do with each other at an impact.
    pub impact: Impact,
    /// No restitution where a gap closes more slowly than this.
    pub restitution_threshold: f64,
    /// Newton's method ends when residual and law change by less than this share.
    pub tolerance: f64,
    /// The most iterations of Newton's method in a step.
    pub newton: u32,
    /// After each step q is moved to `|φ| ≤` this and `g ≥ −` this for active contacts, the shortest way in the norm of M; none: relations hold at the level of
    /// velocities alone. In the unit of φ.
    pub projection: Option<f64>,
    /// How often a step that fails may be cut in two.
    pub halvings: u8,
}

impl Default for LagrangianScheme {
    fn default() -> Self {
        Self {
            theta: 0.5,
            directions: Directions::Iterated,
            relations: RelationsAt::Mean,
            activation: Activation::Forecast { gamma: 0.5, slack: 0.0 },
            impact: Impact::Newton,
            restitution_threshold: 0.0,
            tolerance: 1e-12,
            newton: 50,
            projection: None,
            halvings: 0,
        }
    }
}

/// Where M, H and G of a step are taken.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
pub enum Directions {
    /// At the beginning of the step: first order, with a large constant where anything turns.
    Frozen,
    /// At the middle, extrapolated by the velocities at the beginning: evaluated once a step.
    Extrapolated,
    /// At the middle of the step itself, by Newton's method: with relations on the mean velocity, quadratic ones are kept to rounding.
    Iterated,
}

/// Which velocity bilateral relations hold.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
pub enum RelationsAt {
    /// The mean one of the step, with G where impulses act: no energy is lost or made. In steps with an impact that at the end is taken, since a mean one would
    /// reflect what v violates.
    Mean,
    /// That at the end of the step, with G there.
    End,
}

impl LagrangianScheme {
    /// What gaps do at an impact.
    pub(super) fn restitution(&self) -> Rule {
        Rule::new(self.impact, self.theta, self.restitution_threshold)
    }

    /// Checks every value.
    pub(super) fn validate(&self) -> Result<(), SimulateError> {
        let key = |name: &'static str| move || format!("scheme.{name}");
        let t = self.theta;
        require(key("theta"), t, (0.5..=1.0).contains(&t), "a number from 0.5 to 1")?;
        let tol = self.tolerance;
        require(key("tolerance"), tol, tol > 0.0 && tol < 1.0, "a number between 0 and 1")?;
        let u = self.restitution_threshold;
        require(key("restitution_threshold"), u, u >= 0.0, "a velocity of at least 0")?;
        require(key("newton"), self.newton.into(), self.newton > 0, "at least 1")?;
        if let Some(tol) = self.projection {
            require(key("projection"), tol, tol > 0.0, "a positive number")?;
        }
        self.activation.validate("scheme")
    }
}
