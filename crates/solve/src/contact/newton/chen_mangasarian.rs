//! **Newton's method on the Chen–Mangasarian smoothings of the natural map.**
//!
//! Problem: `x = P_ε(x − y)` with ε → 0 and P_ε a smoothing of the projection on the cone, `x = (mu r_N, r_T)`, `y = ρ(ũ_N/mu, ũ_T)`,
//! `u = W r + q`. ε is a fraction of the residual, and of its square near the solution.
//!
//! Method: the skeleton of this family ([`Semismooth`](super::Semismooth)) with [`ChenMangasarian`](crate::contact::law::cfun::ChenMangasarian).
//!
//! References: ChenMangasarian1996; FukushimaLuoTseng2001, section 4.
//! Cost and storage of a step: the skeleton's.
//! Fails: as `newton_fb`.

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use super::{Method, Newton};
use crate::contact::law::cfun::{ChenMangasarian, Kernel};
use crate::core::register::{About, Described, Solves};
use crate::core::settings::{Settings, described};

/// The hyperparameters. (Unknown keys are refused where settings are parsed; serde cannot refuse them beside `flatten`.)
#[derive(Debug, Clone, Copy, Default, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(default)]
pub struct NewtonCm {
    /// The smoothing of the positive part.
    pub kernel: Kernel,
    /// The hyperparameters of the skeleton.
    #[serde(flatten)]
    pub newton: Newton,
}

impl Settings for NewtonCm {
    fn validate(&self) -> Result<(), String> {
        self.newton.validate()
    }
}

impl Described for NewtonCm {
    const ABOUT: &'static About = &About {
        name: "newton_cm",
        family: "newton",
        solves: Solves::Law,
        summary: "smoothing Newton on the Chen-Mangasarian class over the second-order cone",
        needs: &[],
        cites: &["ChenMangasarian1996", "FukushimaLuoTseng2001"],
        variants: &["kernel=neural_network"],
        settings: described::<Self>,
    };
}

impl Method for NewtonCm {
    type Function = ChenMangasarian;

    fn newton(&self) -> Newton {
        self.newton
    }

    fn function(&self) -> ChenMangasarian {
        ChenMangasarian { kernel: self.kernel }
    }
}
