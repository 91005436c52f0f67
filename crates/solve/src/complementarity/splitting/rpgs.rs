//! **Regularised projected Gauss–Seidel** (RPGS): Gauss–Seidel sweeps on `M + R` inside a proximal loop.
//!
//! Problem: `−w_i ∈ N_[l_i, u_i](z_i)`, `w = M z + q`, where M may have zeros on its diagonal.
//!
//! Method: `z_i ← P(z_i − (w_i + ρ_i (z_i − z̃_i)) / (M_ii + ρ_i))`, the centre z̃ moving to z whenever the sweeps have nearly ended: [`Rpsor`] with ω = 1, and run
//! by it.
//!
//! References: Acary2018 (14); Rockafellar1976.
//!
//! Cost of a step: one pass over M. Storage: M by rows, z̃ and ρ.
//! Fails: as [`Rpsor`].

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use super::rows::Direction;
use super::rpsor::Rpsor;
use crate::core::register::{About, Described, Solves};
use crate::core::settings::{Settings, described};

/// [`Rpsor`] without relaxation.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields, default)]
pub struct Rpgs {
    /// The regularisation in units of the balanced row sums of |M|, positive. With adapt, the first one.
    pub rho: f64,
    /// Whether rho follows the number of sweeps that the inner problems take.
    pub adapt: bool,
    /// The inner residual, in units of the proximal move, at which the centre moves; in (0, 1).
    pub fraction: f64,
    /// The order of the visits.
    pub direction: Direction,
    /// Steps between two evaluations of the true residual, unless the estimate asks for one earlier.
    pub check_every: usize,
}

impl Default for Rpgs {
    fn default() -> Self {
        let Rpsor { rho, adapt, fraction, direction, check_every, .. } = Rpsor::default();
        Self { rho, adapt, fraction, direction, check_every }
    }
}

impl Settings for Rpgs {
    fn validate(&self) -> Result<(), String> {
        Rpsor::from(*self).validate()
    }
}

impl Described for Rpgs {
    const ABOUT: &'static About = &About {
        name: "rpgs",
        family: "splitting",
        solves: Solves::Law,
        summary: "projected Gauss-Seidel inside a proximal loop, for zeros on the diagonal",
        needs: &["the entries of M", "a nonnegative diagonal of M"],
        cites: &["Acary2018", "Rockafellar1976"],
        variants: &["adapt=false"],
        settings: described::<Self>,
    };
}

impl From<Rpgs> for Rpsor {
    fn from(Rpgs { rho, adapt, fraction, direction, check_every }: Rpgs) -> Self {
        Self { omega: 1.0, rho, adapt, fraction, direction, check_every }
    }
}
