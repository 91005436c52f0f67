//! **Newton's method on the equations of Park and Kwak.**
//!
//! Problem: `min(u_N, r_N) = 0`, the tangential law along the sliding angle and nothing across it, `u = W r + q`.
//!
//! Method: the skeleton of this family ([`Semismooth`](super::Semismooth)) with [`ParkKwak`](crate::contact::law::cfun::ParkKwak).
//!
//! References: ParkKwak1994; LeungChenChen1998; Acary, lecture (97)(98); docs/derivations/sliding-angle.md.
//! Cost and storage of a step: the skeleton's.
//! Fails: where `x_T` is nearly zero the frame turns fast and steps are short. In the plane it is `newton_ac`.

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use super::{Method, Newton};
use crate::contact::law::cfun::ParkKwak;
use crate::core::register::{About, Described, Solves};
use crate::core::settings::{Settings, described};

/// The hyperparameters: those of the skeleton.
#[derive(Debug, Clone, Copy, Default, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(transparent)]
pub struct NewtonPk(pub Newton);

impl Settings for NewtonPk {
    fn validate(&self) -> Result<(), String> {
        self.0.validate()
    }
}

impl Described for NewtonPk {
    const ABOUT: &'static About = &About {
        name: "newton_pk",
        family: "newton",
        solves: Solves::Law,
        summary: "semismooth Newton on the equations of Park and Kwak, with the sliding angle in space",
        needs: &[],
        cites: &["ParkKwak1994", "LeungChenChen1998", "Acary2018"],
        variants: &[],
        settings: described::<Self>,
    };
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
