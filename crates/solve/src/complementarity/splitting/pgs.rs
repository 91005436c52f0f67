//! **Projected Gauss–Seidel** (PGS): every variable in turn takes the value that solves its own row.
//!
//! Problem: `−w_i ∈ N_[l_i, u_i](z_i)`, `w = M z + q`; an LCP is `l = 0, u = ∞`.
//!
//! Method: `z_i ← P(z_i − (q_i + Σ_{j<i} M_ij z_j^new + Σ_{j≥i} M_ij z_j^old) / M_ii)`: PSOR ([`Psor`]) with ω = 1, and run by it.
//!
//! References: Acary2018 (12) with ω = 1; Cryer1971; CottlePangStone2009, chapter 5.
//!
//! Cost of a step: one pass over M. Storage: M by rows.
//! Fails: as [`Psor`].

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use super::psor::Psor;
use super::rows::Direction;
use crate::core::ranges::at_least;
use crate::core::register::{About, Described, Solves};
use crate::core::settings::{Settings, described};

/// ω is 1, so that only the order of the visits is left to choose.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields, default)]
pub struct Pgs {
    /// The order of the visits.
    pub direction: Direction,
    /// Steps between two evaluations of the true residual, unless the estimate asks for one earlier.
    pub check_every: usize,
}

impl Default for Pgs {
    fn default() -> Self {
        Self { direction: Direction::Forward, check_every: 50 }
    }
}

impl Settings for Pgs {
    fn validate(&self) -> Result<(), String> {
        at_least("check_every", self.check_every, 1)
    }
}

impl Described for Pgs {
    const ABOUT: &'static About = &About {
        name: "pgs",
        family: "splitting",
        solves: Solves::Law,
        summary: "projected Gauss-Seidel: each variable in turn solves its own row",
        needs: &["the entries of M", "a positive diagonal of M"],
        cites: &["Acary2018", "Cryer1971", "CottlePangStone2009"],
        variants: &["direction=symmetric"],
        settings: described::<Self>,
    };
}

impl From<Pgs> for Psor {
    fn from(Pgs { direction, check_every }: Pgs) -> Self {
        Self { omega: 1.0, adapt: false, direction, check_every, patience: 0 }
    }
}
