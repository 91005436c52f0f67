//! **Newton's method on the equations of Park and Kwak.**
//!
//! Problem: `min(u_N, r_N) = 0`, the tangential law along the sliding angle and nothing across it, `u = W r + q`.
//!
//! Method: the skeleton of this family ([`Semismooth`](super::Semismooth)) with [`ParkKwak`](crate::cfun::ParkKwak).
//!
//! References: ParkKwak1994; LeungChenChen1998; Acary, lecture (97)(98); docs/derivations/sliding-angle.md.
//! Cost and storage of a step: the skeleton's.
//! Fails: where `x_T` is nearly zero the frame turns fast and steps are short. In the plane it is `newton_ac`.

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use super::{Method, Newton};
use crate::cfun::ParkKwak;
use crate::settings::Settings;

/// The hyperparameters: those of the skeleton.
#[derive(Debug, Clone, Copy, Default, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(transparent)]
pub struct NewtonPk(pub Newton);

impl Settings for NewtonPk {
    fn validate(&self) -> Result<(), String> {
        self.0.validate()
    }
}

impl Method for NewtonPk {
    type Function = ParkKwak;

    fn newton(&self) -> Newton {
        self.0
    }

    fn function(&self) -> ParkKwak {
        ParkKwak
    }
}
