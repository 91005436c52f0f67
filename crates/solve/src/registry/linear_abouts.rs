//! The solvers of linear complementarity problems, described.

use super::{About, Solves};
use crate::auto::linear::LinearAuto;
use crate::optimisation::linear::Mprgp;
use crate::settings::described;
use crate::splitting::linear::{Pgs, ProjectedJacobi, Psor, Rpgs, Rpsor, SplittingLs};

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

/// Projected Gauss–Seidel.
pub const PGS: About = About {
    name: "pgs",
    family: "splitting",
    solves: Solves::Law,
    summary: "projected Gauss-Seidel: each variable in turn solves its own row",
    needs: &["the entries of M", "a positive diagonal of M"],
    cites: &["Acary2018", "Cryer1971", "CottlePangStone2009"],
    variants: &["direction=symmetric"],
    settings: described::<Pgs>,
};

/// Projected successive over-relaxation.
pub const PSOR: About = About {
    name: "psor",
    family: "splitting",
    solves: Solves::Law,
    summary: "projected Gauss-Seidel with over-relaxation, whose factor may follow the observed rate",
    needs: &["the entries of M", "a positive diagonal of M"],
    cites: &["Acary2018", "Cryer1971", "CottlePangStone2009", "HagemanYoung1981"],
    variants: &["adapt=true", "direction=symmetric"],
    settings: described::<Psor>,
};

/// Regularised projected Gauss–Seidel.
pub const RPGS: About = About {
    name: "rpgs",
    family: "splitting",
    solves: Solves::Law,
    summary: "projected Gauss-Seidel inside a proximal loop, for zeros on the diagonal",
    needs: &["the entries of M", "a nonnegative diagonal of M"],
    cites: &["Acary2018", "Rockafellar1976"],
    variants: &["adapt=false"],
    settings: described::<Rpgs>,
};

/// Regularised PSOR.
pub const RPSOR: About = About {
    name: "rpsor",
    family: "splitting",
    solves: Solves::Law,
    summary: "PSOR inside a proximal loop, for zeros on the diagonal",
    needs: &["the entries of M", "a nonnegative diagonal of M"],
    cites: &["Acary2018", "Rockafellar1976"],
    variants: &["adapt=false", "direction=symmetric"],
    settings: described::<Rpsor>,
};

/// Splitting with line search.
pub const SPLITTING_LS: About = About {
    name: "splitting_ls",
    family: "splitting",
    solves: Solves::Law,
    summary: "a PSOR or Jacobi sweep gives the direction, an exact line search on the energy the step",
    needs: &["the entries of M", "a symmetric M", "a positive diagonal of M"],
    cites: &["Acary2018", "CottlePangStone2009"],
    variants: &["sweep=jacobi"],
    settings: described::<SplittingLs>,
};

/// Modified proportioning with reduced gradient projections.
pub const MPRGP: About = About {
    name: "mprgp",
    family: "optimisation",
    solves: Solves::Law,
    summary: "conjugate gradients on the face, gradient projections between faces; by products only",
    needs: &["a symmetric positive semidefinite M"],
    cites: &["DostalSchoberl2005", "Dostal2009"],
    variants: &["gamma=0.1"],
    settings: described::<Mprgp>,
};
