//! **Newton's method on the Alart–Curnier function.**
//!
//! Problem: `r_N = max(0, x_N)`, `r_T = P_{D(mu max(0, x_N))}(x_T)`, `x = r − ρu`, `u = W r + q`.
//!
//! Method: the skeleton of this family ([`Semismooth`](super::Semismooth)) with [`AlartCurnier`](crate::cfun::AlartCurnier).
//!
//! References: AlartCurnier1991; Acary, lecture (88)–(96).
//! Cost and storage of a step: the skeleton's.
//! Fails: as the skeleton: rank deficient W with much sticking.

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use super::{Method, Newton};
use crate::cfun::AlartCurnier;
use crate::settings::Settings;

/// The hyperparameters: those of the skeleton.
#[derive(Debug, Clone, Copy, Default, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(transparent)]
pub struct NewtonAc(pub Newton);

impl Settings for NewtonAc {
    fn validate(&self) -> Result<(), String> {
        self.0.validate()
    }
}

impl Method for NewtonAc {
    type Function = AlartCurnier;

    fn newton(&self) -> Newton {
        self.0
    }

    fn function(&self) -> AlartCurnier {
        AlartCurnier
    }
}
