//! **Newton's method on the equations of Xuewen, Soh and Wanji.**
//!
//! Problem: `min(u_N, r_N) = 0`, `min(‖u_T‖, mu r_N − ‖r_T‖) = 0`, `u_T` against `r_T`, `u = W r + q`.
//!
//! Method: the skeleton of this family ([`Semismooth`](super::Semismooth)) with [`XuewenSohWanji`](crate::contact::law::cfun::XuewenSohWanji).
//!
//! References: Acary, lecture (99).
//! Cost and storage of a step: the skeleton's.
//! Fails: |·| and ‖·‖ have their kinks at every solution, and contacts that stick with `r_T = 0` make the matrix singular:
//! it leans on its rescues more than the others.

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use super::{Method, Newton};
use crate::contact::law::cfun::XuewenSohWanji;
use crate::core::register::{About, Described, Solves};
use crate::core::settings::{Settings, described};

/// The hyperparameters: those of the skeleton.
#[derive(Debug, Clone, Copy, Default, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(transparent)]
pub struct NewtonXsw(pub Newton);

impl Settings for NewtonXsw {
    fn validate(&self) -> Result<(), String> {
        self.0.validate()
    }
}

impl Described for NewtonXsw {
    const ABOUT: &'static About = &About {
        name: "newton_xsw",
        family: "newton",
        solves: Solves::Law,
        summary: "semismooth Newton on the direct equations of Xuewen, Soh and Wanji",
        needs: &[],
        cites: &["Acary2018"],
        variants: &[],
        settings: described::<Self>,
    };
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
