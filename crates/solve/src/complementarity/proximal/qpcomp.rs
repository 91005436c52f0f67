//! **qpcomp**: the method QPCOMP of Billups and Ferris: NE/SQP with proximal problems to leave where it stalls.
//!
//! Problem: `l ≤ x ≤ u ⟂ F(x)`. Method: steps of NE/SQP, that is Gauss–Newton directions of the natural residual inside the box by convex quadratic programs
//! ([`Squares`]). Where `θ = ½‖H‖²` stalls above zero, proximal problems `F(x) + λ(x − y)` with moving centres y lead away
//! ([`Escape`](crate::complementarity::parts::nonlinear::Escape)); escapes are finite where F is pseudomonotone at a solution.
//!
//! References: BillupsFerris1997; PangGabriel1993; Acary2018. Cost of a step: a few LU factorisations of the pattern of JFᵀJF. Fails: where no λ helps; escapes may be long.

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use super::escaping::Escaping;
use crate::complementarity::form::Model;
use crate::complementarity::parts::nonlinear::Squares;
use crate::core::register::{About, Described, Solves};
use crate::core::settings::{Settings, described};

/// The hyperparameters.
#[derive(Debug, Clone, Copy, Default, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields, default)]
pub struct Qpcomp {
    /// Whether projected Newton steps that look for the active set come first; the published method has none.
    pub crash: bool,
}

impl Settings for Qpcomp {}

impl Described for Qpcomp {
    const ABOUT: &'static About = &About {
        name: "qpcomp",
        family: "proximal",
        solves: Solves::Law,
        summary: "NE/SQP, with proximal problems to leave where it stalls",
        needs: &[],
        cites: &["BillupsFerris1997", "PangGabriel1993", "Acary2018"],
        variants: &["crash=true"],
        settings: described::<Self>,
    };
}

impl Escaping for Qpcomp {
    type Inner = Squares;

    fn inner(&self, model: &Model) -> Self::Inner {
        Squares::new(model.dim())
    }

    fn crash(&self) -> bool {
        self.crash
    }
}
