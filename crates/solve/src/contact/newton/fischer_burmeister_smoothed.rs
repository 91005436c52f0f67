//! **Newton's method on the smoothed Fischer–Burmeister function.**
//!
//! Problem: `x + y = (x² + y² + 2ε²e)^½` with ε → 0, `x = (mu r_N, r_T)`, `y = ρ(ũ_N/mu, ũ_T)`, `u = W r + q`. ε is a fraction of the
//! residual, and of its square near the solution, so that convergence stays fast.
//!
//! Method: the skeleton of this family ([`Semismooth`](super::Semismooth)) with [`SmoothedFischerBurmeister`](crate::contact::law::cfun::SmoothedFischerBurmeister).
//!
//! References: FukushimaLuoTseng2001; Acary, lecture (117).
//! Cost and storage of a step: the skeleton's.
//! Fails: as `newton_fb`.

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use super::{Method, Newton};
use crate::contact::law::cfun::SmoothedFischerBurmeister;
use crate::core::register::{About, Described, Solves};
use crate::core::settings::{Settings, described};

/// The hyperparameters: those of the skeleton.
#[derive(Debug, Clone, Copy, Default, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(transparent)]
pub struct NewtonFbSmooth(pub Newton);

impl Settings for NewtonFbSmooth {
    fn validate(&self) -> Result<(), String> {
        self.0.validate()
    }
}

impl Described for NewtonFbSmooth {
    const ABOUT: &'static About = &About {
        name: "newton_fb_smooth",
        family: "newton",
        solves: Solves::Law,
        summary: "smoothing Newton on the Fischer-Burmeister function over the second-order cone",
        needs: &[],
        cites: &["FukushimaLuoTseng2001", "Acary2018"],
        variants: &[],
        settings: described::<Self>,
    };
}

impl Method for NewtonFbSmooth {
    type Function = SmoothedFischerBurmeister;

    fn newton(&self) -> Newton {
        self.0
    }

    fn function(&self) -> SmoothedFischerBurmeister {
        SmoothedFischerBurmeister
    }
}
