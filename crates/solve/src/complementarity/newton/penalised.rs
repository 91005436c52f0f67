//! **Newton's method on the penalised Fischer–Burmeister function.**
//!
//! Problem: `λ(z_i + w_i − √(z_i² + w_i²)) + (1 − λ) z_i₊ w_i₊ = 0`, `w = M z + q`; with two bounds nested; equalities `w_i = 0`.
//!
//! Method: the skeleton of this family ([`Semismooth`](super::Semismooth)). Where z and w are both large and positive the function sees it, which Fischer's and
//! Burmeister's hardly does; its level sets are bounded for more matrices.
//!
//! References: ChenChenKanzow2000; Acary2018 (74e).
//! Cost and storage of a step: the skeleton's.
//! Fails: as Newton's method on Fischer's and Burmeister's function.

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use super::{Method, Newton};
use crate::complementarity::functions::Penalised;
use crate::core::line_search::LineSearch;
use crate::core::register::{About, Described, Solves};
use crate::core::settings::{Settings, described};

/// The hyperparameters.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields, default)]
pub struct NewtonPfb {
    /// How the line search accepts a step, on half the square of the function; `none` takes every full step and knows no other directions.
    pub line_search: LineSearch,
    /// How often the method starts again elsewhere after it got stuck.
    pub restarts: usize,
    /// The weight of the Fischer-Burmeister function, in (0, 1]; the rest is the penalty's.
    pub lambda: f64,
}

impl Default for NewtonPfb {
    fn default() -> Self {
        let Newton { line_search, restarts } = Newton::default();
        Self { line_search, restarts, lambda: 0.8 }
    }
}

impl Settings for NewtonPfb {
    fn validate(&self) -> Result<(), String> {
        if !(self.lambda > 0.0 && self.lambda <= 1.0) {
            return Err(format!("lambda: expected a number in (0, 1], found {}", self.lambda));
        }
        self.newton().validate()
    }
}

impl Described for NewtonPfb {
    const ABOUT: &'static About = &About {
        name: "newton_pfb",
        family: "newton",
        solves: Solves::Law,
        summary: "semismooth Newton on the penalised Fischer-Burmeister function",
        needs: &["the entries of M"],
        cites: &["Acary2018", "ChenChenKanzow2000"],
        variants: &["lambda=0.95"],
        settings: described::<Self>,
    };
}

impl Method for NewtonPfb {
    type Function = Penalised;
    const MINIMUM_FIRST: bool = false;

    fn newton(&self) -> Newton {
        Newton { line_search: self.line_search, restarts: self.restarts }
    }

    fn function(&self) -> Penalised {
        Penalised { lambda: self.lambda }
    }
}
