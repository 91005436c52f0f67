//! **Newton's method on the Alart–Curnier function.**
//!
//! Problem: `r_N = max(0, x_N)`, `r_T = P_{D(mu max(0, x_N))}(x_T)`, `x = r − ρu`, `u = W r + q`.
//!
//! Method: the skeleton of this family ([`Semismooth`](super::Semismooth)) with [`AlartCurnier`](crate::contact::law::cfun::AlartCurnier).
//!
//! References: AlartCurnier1991; Acary, lecture (88)–(96).
//! Cost and storage of a step: the skeleton's.
//! Fails: as the skeleton: rank deficient W with much sticking.

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use super::{Method, Newton};
use crate::contact::law::cfun::AlartCurnier;
use crate::core::register::{About, Described, Solves};
use crate::core::settings::{Settings, described};

/// The hyperparameters: those of the skeleton.
#[derive(Debug, Clone, Copy, Default, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(transparent)]
pub struct NewtonAc(pub Newton);

impl Settings for NewtonAc {
    fn validate(&self) -> Result<(), String> {
        self.0.validate()
    }
}

impl Described for NewtonAc {
    const ABOUT: &'static About = &About {
        name: "newton_ac",
        family: "newton",
        solves: Solves::Law,
        summary: "semismooth Newton on the Alart-Curnier function",
        needs: &[],
        cites: &[
            "AlartCurnier1991",
            "Acary2018",
            "GoldsteinPrice1967",
            "GrippoLamparielloLucidi1986",
        ],
        variants: &[
            "line_search=none",
            "line_search=goldstein_price",
            "line_search=nonmonotone",
            "rho_rule=fixed",
            "rho_rule=norm",
            "rho_rule=adaptive",
            "warm_up=0",
        ],
        settings: described::<Self>,
    };
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
