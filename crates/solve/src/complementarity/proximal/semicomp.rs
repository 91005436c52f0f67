//! **semicomp**: Billups' proximal-perturbation method with the semismooth Newton method inside.
//!
//! Problem: `l ≤ x ≤ u ⟂ F(x)`. Method: semismooth Newton steps on the Fischer–Burmeister function with a projected search on `Ψ = ½‖Φ‖²` and the gradient where Newton's direction
//! does not descend. Where that stalls above zero, proximal problems `F(x) + λ(x − y)` with moving centres y lead away
//! ([`Escape`](crate::complementarity::parts::nonlinear::Escape)).
//!
//! References: Billups1995; BillupsFerris1997 (QPCOMP's escape); Acary2018. Cost of a step: one LU of the pattern of JF. Fails: where no λ helps; escapes may be long.

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use super::escaping::Escaping;
use crate::complementarity::form::Model;
use crate::complementarity::functions::FischerBurmeister;
use crate::complementarity::parts::nonlinear::{Descent, Options};
use crate::core::register::{About, Described, Solves};
use crate::core::settings::{Settings, described};

/// The hyperparameters.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields, default)]
pub struct Semicomp {
    /// Whether projected Newton steps that look for the active set come first.
    pub crash: bool,
}

impl Default for Semicomp {
    fn default() -> Self {
        Self { crash: true }
    }
}

impl Settings for Semicomp {}

impl Described for Semicomp {
    const ABOUT: &'static About = &About {
        name: "semicomp",
        family: "proximal",
        solves: Solves::Law,
        summary: "semismooth Newton on the Fischer-Burmeister function, with proximal problems to leave where it stalls",
        needs: &[],
        cites: &["Billups1995", "BillupsFerris1997", "DeLucaFacchineiKanzow1996", "Acary2018"],
        variants: &["crash=false"],
        settings: described::<Self>,
    };
}

const OPTIONS: Options = Options { memory: 4, slack: 1.0, least: 1e-8, gradient: true };

impl Escaping for Semicomp {
    type Inner = Descent<FischerBurmeister, FischerBurmeister>;

    fn inner(&self, model: &Model) -> Self::Inner {
        Descent::new(FischerBurmeister {}, FischerBurmeister {}, OPTIONS, model)
    }

    fn crash(&self) -> bool {
        self.crash
    }
}
