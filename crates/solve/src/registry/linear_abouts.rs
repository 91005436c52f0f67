//! The solvers of linear complementarity problems, described.

use super::{About, Solves};
use crate::auto::linear::LinearAuto;
use crate::pivoting::Lemke;
use crate::settings::described;
use crate::splitting::linear::ProjectedJacobi;

/// The automatic method.
pub const AUTO: About = About {
    name: "auto",
    family: "auto",
    solves: Solves::Law,
    summary: "needs no setting: a plan of solvers by size, class and structure of M, until one solves the problem or proves that there is no solution",
    needs: &[],
    cites: &["CottlePangStone2009", "FacchineiPang2003", "Acary2018"],
    variants: &[],
    settings: described::<LinearAuto>,
};

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

/// Lemke's method.
pub const LEMKE: About = About {
    name: "lemke",
    family: "pivoting",
    solves: Solves::Law,
    summary: "Lemke: complementary pivoting on a factorised basis; decides solvability for copositive-plus M",
    needs: &["the entries of M"],
    cites: &["Acary2018", "CottlePangStone2009", "Lemke1965", "Kostreva1979"],
    variants: &[
        "basis=tableau",
        "basis=dense",
        "basis=sparse",
        "ties=perturbed",
        "covering=row_norms",
        "covering=random",
    ],
    settings: described::<Lemke>,
};
