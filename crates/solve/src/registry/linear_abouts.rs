//! The solvers of linear complementarity problems, described.

use super::{About, Solves};
use crate::auto::linear::LinearAuto;
use crate::newton::linear::{NewtonFb, NewtonMin, NewtonPfb};
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

/// Newton's method on the minimum.
pub const NEWTON_MIN: About = About {
    name: "newton_min",
    family: "newton",
    solves: Solves::Law,
    summary: "semismooth Newton on min(z, w), globalised by the Fischer-Burmeister merit",
    needs: &["the entries of M"],
    cites: &["Acary2018", "BenGharbiaGilbert2012", "DeLucaFacchineiKanzow1996"],
    variants: &["line_search=armijo"],
    settings: described::<NewtonMin>,
};

/// Newton's method on the Fischer–Burmeister function.
pub const NEWTON_FB: About = About {
    name: "newton_fb",
    family: "newton",
    solves: Solves::Law,
    summary: "semismooth Newton on the Fischer-Burmeister function; equalities in any number",
    needs: &["the entries of M"],
    cites: &["Acary2018", "Fischer1992", "DeLucaFacchineiKanzow1996"],
    variants: &["line_search=armijo"],
    settings: described::<NewtonFb>,
};

/// Newton's method on the penalised Fischer–Burmeister function.
pub const NEWTON_PFB: About = About {
    name: "newton_pfb",
    family: "newton",
    solves: Solves::Law,
    summary: "semismooth Newton on the penalised Fischer-Burmeister function",
    needs: &["the entries of M"],
    cites: &["Acary2018", "ChenChenKanzow2000"],
    variants: &["lambda=0.95"],
    settings: described::<NewtonPfb>,
};
