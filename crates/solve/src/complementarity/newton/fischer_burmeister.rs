//! **Newton's method on the Fischer–Burmeister function.**
//!
//! Problem: `z_i + w_i = √(z_i² + w_i²)`, `w = M z + q`; with two bounds the function nested in itself; equalities `w_i = 0`, in any number.
//!
//! Method: the skeleton of this family ([`Semismooth`](super::Semismooth)). Its merit is differentiable and, for M of class P0, has no stationary point but solutions.
//!
//! References: Fischer1992; DeLucaFacchineiKanzow1996; Acary2018 (74d).
//! Cost and storage of a step: the skeleton's.
//! Fails: stationary points of the merit, where M is not P0; merits that decrease forever, where there is no solution.

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use super::{Method, Newton};
use crate::complementarity::functions::FischerBurmeister;
use crate::core::register::{About, Described, Solves};
use crate::core::settings::{Settings, described};

/// The hyperparameters: those of the skeleton.
#[derive(Debug, Clone, Copy, Default, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(transparent)]
pub struct NewtonFb(pub Newton);

impl Settings for NewtonFb {
    fn validate(&self) -> Result<(), String> {
        self.0.validate()
    }
}

impl Described for NewtonFb {
    const ABOUT: &'static About = &About {
        name: "newton_fb",
        family: "newton",
        solves: Solves::Law,
        summary: "semismooth Newton on the Fischer-Burmeister function; equalities in any number",
        needs: &["the entries of M"],
        cites: &["Acary2018", "Fischer1992", "DeLucaFacchineiKanzow1996"],
        variants: &["line_search=armijo"],
        settings: described::<Self>,
    };
}

impl Method for NewtonFb {
    type Function = FischerBurmeister;
    const MINIMUM_FIRST: bool = false;

    fn newton(&self) -> Newton {
        self.0
    }

    fn function(&self) -> FischerBurmeister {
        FischerBurmeister
    }
}
