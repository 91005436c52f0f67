//! The solvers of linear complementarity problems, described.

use super::{About, Solves};
use crate::settings::described;
use crate::splitting::linear::ProjectedJacobi;

/// Projected Jacobi.
pub const PROJECTED_JACOBI: About = About {
    name: "projected_jacobi",
    family: "splitting",
    solves: Solves::Law,
    summary: "projected Jacobi: one projected step of every variable at once",
    needs: &["a positive diagonal of M"],
    cites: &["Acary2018", "CottlePangStone2009"],
    variants: &["omega=0.7"],
    settings: described::<ProjectedJacobi>,
};
