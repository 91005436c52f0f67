//! **Newton's method on the equations of Xuewen, Soh and Wanji.**
//!
//! Problem: `min(u_N, r_N) = 0`, `min(‖u_T‖, mu r_N − ‖r_T‖) = 0`, `u_T` against `r_T`, `u = W r + q`.
//!
//! Method: the skeleton of this family ([`Semismooth`](super::Semismooth)) with [`XuewenSohWanji`](crate::cfun::XuewenSohWanji).
//!
//! References: Acary, lecture (99).
//! Cost and storage of a step: the skeleton's.
//! Fails: |·| and ‖·‖ have their kinks at every solution, and contacts that stick with `r_T = 0` make the matrix singular:
//! it leans on its rescues more than the others.

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use super::{Method, Newton};
use crate::cfun::XuewenSohWanji;
use crate::settings::Settings;

/// The hyperparameters: those of the skeleton.
#[derive(Debug, Clone, Copy, Default, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(transparent)]
pub struct NewtonXsw(pub Newton);

impl Settings for NewtonXsw {
    fn validate(&self) -> Result<(), String> {
        self.0.validate()
    }
}

impl Method for NewtonXsw {
    type Function = XuewenSohWanji;

    fn newton(&self) -> Newton {
        self.0
    }

    fn function(&self) -> XuewenSohWanji {
        XuewenSohWanji
    }
}
