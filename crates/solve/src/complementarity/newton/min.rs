//! **Newton's method on the minimum.**
//!
//! Problem: `min(z_i, w_i) = 0`, `w = M z + q`; with two bounds the middle of `z − l`, `z − u` and w; equalities `w_i = 0`.
//!
//! Method: the skeleton of this family ([`Semismooth`](super::Semismooth)): `z_i = 0` where `z_i ≤ w_i`, `w_i = 0` elsewhere, solved for z. The plain method (a primal–dual
//! active set) is finite where M is an M-matrix, and cycles on some P-matrices: where its full steps stop helping, they must decrease the merit of Fischer's and
//! Burmeister's function, and give way to that function's direction where they do not.
//!
//! References: BenGharbiaGilbert2012 (cycles); DeLucaFacchineiKanzow1996 (globalisation); Acary2018 (74a).
//! Cost and storage of a step: the skeleton's. Ends with the exact solution of the active set.
//! Fails: stationary points of the merit, where M is not P0.

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use super::{Method, Newton};
use crate::complementarity::functions::FischerBurmeister;
use crate::core::register::{About, Described, Solves};
use crate::core::settings::{Settings, described};

/// The hyperparameters: those of the skeleton.
#[derive(Debug, Clone, Copy, Default, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(transparent)]
pub struct NewtonMin(pub Newton);

impl Settings for NewtonMin {
    fn validate(&self) -> Result<(), String> {
        self.0.validate()
    }
}

impl Described for NewtonMin {
    const ABOUT: &'static About = &About {
        name: "newton_min",
        family: "newton",
        solves: Solves::Law,
        summary: "semismooth Newton on min(z, w), globalised by the Fischer-Burmeister merit",
        needs: &["the entries of M"],
        cites: &["Acary2018", "BenGharbiaGilbert2012", "DeLucaFacchineiKanzow1996"],
        variants: &["line_search=armijo"],
        settings: described::<Self>,
    };
}

impl Method for NewtonMin {
    type Function = FischerBurmeister;
    const MINIMUM_FIRST: bool = true;

    fn newton(&self) -> Newton {
        self.0
    }

    fn function(&self) -> FischerBurmeister {
        FischerBurmeister
    }
}
