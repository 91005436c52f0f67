//! **Newton's method on the natural map of the cone.**
//!
//! Problem: `r = P_K(r − ρ(u + mu‖u_T‖e_N))`, `u = W r + q`.
//!
//! Method: the skeleton of this family ([`Semismooth`](super::Semismooth)) with [`NaturalMap`](crate::contact::law::cfun::NaturalMap).
//!
//! References: AcaryBremondHuber2018; Acary, lecture (108)–(110).
//! Cost and storage of a step: the skeleton's.
//! Fails: ‖u_T‖ has its kink at every sticking contact, so fewer starts converge than with Alart–Curnier.

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use super::{Method, Newton};
use crate::contact::law::cfun::NaturalMap;
use crate::core::register::{About, Described, Solves};
use crate::core::settings::{Settings, described};

/// The hyperparameters: those of the skeleton.
#[derive(Debug, Clone, Copy, Default, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(transparent)]
pub struct NewtonNm(pub Newton);

impl Settings for NewtonNm {
    fn validate(&self) -> Result<(), String> {
        self.0.validate()
    }
}

impl Described for NewtonNm {
    const ABOUT: &'static About = &About {
        name: "newton_nm",
        family: "newton",
        solves: Solves::Law,
        summary: "semismooth Newton on the natural map of the cone",
        needs: &[],
        cites: &["AcaryBremondHuber2018", "Acary2018"],
        variants: &[],
        settings: described::<Self>,
    };
}

impl Method for NewtonNm {
    type Function = NaturalMap;

    fn newton(&self) -> Newton {
        self.0
    }

    fn function(&self) -> NaturalMap {
        NaturalMap
    }
}
