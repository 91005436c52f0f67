//! **proxi**: Billups' proximal-perturbation method with a nonsmooth Newton method inside.
//!
//! Problem: `l ≤ x ≤ u ⟂ F(x)`. Method: Newton's direction of the natural residual H, `B d = −H` with B of the B-subdifferential, with a projected search on `θ = ½‖H‖²`; a
//! singular B is regularised by a multiple of I. Where θ stalls above zero, proximal problems `F(x) + λ(x − y)` with moving centres y lead away
//! ([`Escape`](crate::complementarity::parts::nonlinear::Escape)).
//!
//! References: Billups1995; BillupsFerris1997 (QPCOMP's escape); Acary2018. Cost of a step: one LU of the pattern of JF. Fails: where no λ helps; escapes may be long.

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use super::escaping::Escaping;
use crate::complementarity::form::Model;
use crate::complementarity::functions::Min;
use crate::complementarity::parts::nonlinear::{Descent, Options};
use crate::core::register::{About, Described, Solves};
use crate::core::settings::{Settings, described};

/// The hyperparameters.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields, default)]
pub struct Proxi {
    /// Whether projected Newton steps that look for the active set come first.
    pub crash: bool,
}

impl Default for Proxi {
    fn default() -> Self {
        Self { crash: true }
    }
}

impl Settings for Proxi {}

impl Described for Proxi {
    const ABOUT: &'static About = &About {
        name: "proxi",
        family: "proximal",
        solves: Solves::Law,
        summary: "nonsmooth Newton on the natural residual, with proximal problems to leave where it stalls",
        needs: &[],
        cites: &["Billups1995", "BillupsFerris1997", "Acary2018"],
        variants: &["crash=false"],
        settings: described::<Self>,
    };
}

const OPTIONS: Options = Options { memory: 1, slack: 1.0, least: 1e-8, gradient: false };

impl Escaping for Proxi {
    type Inner = Descent<Min, Min>;

    fn inner(&self, model: &Model) -> Self::Inner {
        Descent::new(Min {}, Min {}, OPTIONS, model)
    }

    fn crash(&self) -> bool {
        self.crash
    }
}
