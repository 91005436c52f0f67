//! **Newton's method on the Jean–Moreau function.**
//!
//! Problem: `r_N = max(0, x_N)`, `r_T = P_{D(mu max(0, r_N))}(x_T)`, `x = r − ρu`, `u = W r + q`.
//!
//! Method: the skeleton of this family ([`Semismooth`](super::Semismooth)) with [`JeanMoreau`](crate::contact::law::cfun::JeanMoreau).
//!
//! References: Jean1999; Acary, lecture (88)–(96), with the radius mu r_N.
//! Cost and storage of a step: the skeleton's.
//! Fails: as the skeleton. The radius sees r_N, which may be negative on the way: such contacts count as open.

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use super::{Method, Newton};
use crate::contact::law::cfun::JeanMoreau;
use crate::core::register::{About, Described, Solves};
use crate::core::settings::{Settings, described};

/// The hyperparameters: those of the skeleton.
#[derive(Debug, Clone, Copy, Default, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(transparent)]
pub struct NewtonJm(pub Newton);

impl Settings for NewtonJm {
    fn validate(&self) -> Result<(), String> {
        self.0.validate()
    }
}

impl Described for NewtonJm {
    const ABOUT: &'static About = &About {
        name: "newton_jm",
        family: "newton",
        solves: Solves::Law,
        summary: "semismooth Newton on the Jean-Moreau function",
        needs: &[],
        cites: &["AlartCurnier1991", "Jean1999", "Acary2018"],
        variants: &[],
        settings: described::<Self>,
    };
}

impl Method for NewtonJm {
    type Function = JeanMoreau;

    fn newton(&self) -> Newton {
        self.0
    }

    fn function(&self) -> JeanMoreau {
        JeanMoreau
    }
}
