//! The solvers of linear complementarity problems, described.

use super::{About, Solves};
use crate::auto::linear::LinearAuto;
use crate::interior::linear::{MehrotraType, MizunoToddYe};
use crate::optimisation::linear::QuadraticProgram;
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

/// Mizuno, Todd and Ye's interior points.
pub const IP_MTY: About = About {
    name: "ip_mty",
    family: "interior",
    solves: Solves::Law,
    summary: "interior points in the narrow neighbourhood: predictor and corrector of Mizuno, Todd and Ye",
    needs: &["a monotone problem (of an LCP: M positive semidefinite) to be sure of its end"],
    cites: &["MizunoToddYe1993", "Potra1996", "Acary2018"],
    variants: &["theta=0.1"],
    settings: described::<MizunoToddYe>,
};

/// Mehrotra's interior points.
pub const IP_MEHROTRA: About = About {
    name: "ip_mehrotra",
    family: "interior",
    solves: Solves::Law,
    summary: "interior points in the wide neighbourhood: Mehrotra's predictor and corrector, infeasible start",
    needs: &["a monotone problem (of an LCP: M positive semidefinite) to be sure of its end"],
    cites: &["Mehrotra1992", "Wright1997", "Acary2018", "KojimaMegiddoNomaYoshise1991"],
    variants: &["epsilon=0.01"],
    settings: described::<MehrotraType>,
};

/// The convex quadratic program.
pub const QP: About = About {
    name: "qp",
    family: "optimisation",
    solves: Solves::Law,
    summary: "the convex quadratic program behind the problem, through Clarabel, polished",
    needs: &["M positive semidefinite; symmetric where variables have two bounds"],
    cites: &["GoulartChen2024", "CottlePangStone2009", "Acary2018"],
    variants: &["form=gap"],
    settings: described::<QuadraticProgram>,
};
