//! **Newton's method on the function of Hüeber, Stadler and Wohlmuth.**
//!
//! Problem: `r_N = max(0, x_N)`, `max(R, ‖x_T‖) r_T = R x_T`, `R = mu max(0, x_N)`, `x = r − ρu`, `u = W r + q`.
//!
//! Method: the skeleton of this family ([`Semismooth`](super::Semismooth)) with [`HueberStadlerWohlmuth`](crate::contact::law::cfun::HueberStadlerWohlmuth).
//!
//! References: HueberStadlerWohlmuth2008; docs/derivations/hueber-stadler-wohlmuth.md.
//! Cost and storage of a step: the skeleton's.
//! Fails: as `newton_ac`; the modified block is not a derivative, so a short step need not decrease the merit.

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use super::{Method, Newton};
use crate::contact::law::cfun::{HueberStadlerWohlmuth, SlipBlock};
use crate::core::register::{About, Described, Solves};
use crate::core::settings::{Settings, described};

/// The hyperparameters. (Unknown keys are refused where settings are parsed; serde cannot refuse them beside `flatten`.)
#[derive(Debug, Clone, Copy, Default, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(default)]
pub struct NewtonHsw {
    /// The derivative while sliding.
    pub slip: SlipBlock,
    /// The hyperparameters of the skeleton.
    #[serde(flatten)]
    pub newton: Newton,
}

impl Settings for NewtonHsw {
    fn validate(&self) -> Result<(), String> {
        self.newton.validate()
    }
}

impl Described for NewtonHsw {
    const ABOUT: &'static About = &About {
        name: "newton_hsw",
        family: "newton",
        solves: Solves::Law,
        summary: "semismooth Newton on the function of Hueber, Stadler and Wohlmuth",
        needs: &[],
        cites: &["HueberStadlerWohlmuth2008"],
        variants: &["slip=exact"],
        settings: described::<Self>,
    };
}

impl Method for NewtonHsw {
    type Function = HueberStadlerWohlmuth;

    fn newton(&self) -> Newton {
        self.newton
    }

    fn function(&self) -> HueberStadlerWohlmuth {
        HueberStadlerWohlmuth { slip: self.slip }
    }
}
