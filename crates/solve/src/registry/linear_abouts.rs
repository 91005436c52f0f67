//! The solvers of linear complementarity problems, described.

use super::{About, Solves};
use crate::auto::linear::LinearAuto;
use crate::pivoting::{Bard, BlockPivoting, CrissCross, Enumeration, Keller, Murty};
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

/// Murty's method.
pub const MURTY: About = About {
    name: "murty",
    family: "pivoting",
    solves: Solves::Law,
    summary: "Murty's principal pivoting: the least index with a negative value changes sides",
    needs: &["the entries of M", "no zero on the tableau's diagonal (M a P-matrix: guaranteed)"],
    cites: &["Acary2018", "Murty1974", "Murty1988", "CottlePangStone2009"],
    variants: &["descending=true"],
    settings: described::<Murty>,
};

/// Bard's method.
pub const BARD: About = About {
    name: "bard",
    family: "pivoting",
    solves: Solves::Law,
    summary: "Bard's principal pivoting: the most negative variable changes sides; least index where that cycles",
    needs: &["the entries of M", "no zero on the tableau's diagonal (M a P-matrix: guaranteed)"],
    cites: &["Acary2018", "Murty1988", "CottlePangStone2009"],
    variants: &["protect=false"],
    settings: described::<Bard>,
};

/// The least-index criss-cross method.
pub const CRISS_CROSS: About = About {
    name: "criss_cross",
    family: "pivoting",
    solves: Solves::Law,
    summary: "least-index criss-cross: single and double principal pivots, for sufficient M; proves infeasibility",
    needs: &["the entries of M", "a sufficient M (PSD or P, for instance): guaranteed"],
    cites: &["DenHertogRoosTerlaky1993", "CsizmadiaIlles2006", "CottlePangStone2009"],
    variants: &["descending=true"],
    settings: described::<CrissCross>,
};

/// The principal pivoting method.
pub const KELLER: About = About {
    name: "keller",
    family: "pivoting",
    solves: Solves::Law,
    summary: "principal pivoting of Keller, Cottle and Dantzig: one negative variable at a time is driven to zero; proves infeasibility",
    needs: &["the entries of M", "a sufficient M (PSD or P, for instance): guaranteed"],
    cites: &["Keller1973", "CottleDantzig1968", "CottlePangStone2009"],
    variants: &["least_index=true"],
    settings: described::<Keller>,
};

/// Block principal pivoting.
pub const BLOCK_PIVOTING: About = About {
    name: "block_pivoting",
    family: "pivoting",
    solves: Solves::Law,
    summary: "block principal pivoting: every variable of the wrong sign changes sides, Murty's rule where that does not help; dense or sparse LU",
    needs: &["the entries of M", "regular principal submatrices (M a P-matrix: guaranteed)"],
    cites: &["JudicePires1994", "Kostreva1978", "Murty1974", "BenGharbiaGilbert2012"],
    variants: &["patience=1"],
    settings: described::<BlockPivoting>,
};

/// Enumeration.
pub const ENUMERATION: About = About {
    name: "enumeration",
    family: "pivoting",
    solves: Solves::Law,
    summary: "enumeration of complementary cones by branch and bound: any M of few variables, a solution or a proof that there is none",
    needs: &["the entries of M", "few complementary pairs (max_pairs)"],
    cites: &["CottlePangStone2009", "Bland1977", "Acary2018"],
    variants: &["batch=1"],
    settings: described::<Enumeration>,
};
