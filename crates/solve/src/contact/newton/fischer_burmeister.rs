//! **Newton's method on the Fischer–Burmeister function over the cone.**
//!
//! Problem: `x + y = (x² + y²)^½` in the Jordan algebra, `x = (mu r_N, r_T)`, `y = ρ(ũ_N/mu, ũ_T)`, `u = W r + q`.
//!
//! Method: the skeleton of this family ([`Semismooth`](super::Semismooth)) with [`FischerBurmeister`](crate::contact::law::cfun::FischerBurmeister).
//!
//! References: FukushimaLuoTseng2001; Acary, lecture (111)–(116).
//! Cost and storage of a step: the skeleton's.
//! Fails: coordinates stretched by mu: small coefficients of friction make it ill conditioned; and as the natural map.

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use super::{Method, Newton};
use crate::contact::law::cfun::FischerBurmeister;
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
        summary: "semismooth Newton on the Fischer-Burmeister function over the second-order cone",
        needs: &[],
        cites: &["FukushimaLuoTseng2001", "Acary2018"],
        variants: &[],
        settings: described::<Self>,
    };
}

impl Method for NewtonFb {
    type Function = FischerBurmeister;

    fn newton(&self) -> Newton {
        self.0
    }

    fn function(&self) -> FischerBurmeister {
        FischerBurmeister
    }
}
