//! The solvers of linear complementarity problems, described.

use super::{About, Solves};
use crate::auto::linear::LinearAuto;
use crate::interior::linear::{MehrotraType, MizunoToddYe};
use crate::newton::linear::{NewtonFb, NewtonMin, NewtonPfb};
use crate::optimisation::linear::Mprgp;
use crate::pivoting::Lemke;
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
    variants: &["adapt=false", "direction=symmetric"],
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

/// Lemke's method.
pub const LEMKE: About = About {
    name: "lemke",
    family: "pivoting",
    solves: Solves::Law,
    summary: "Lemke: complementary pivoting on a factorised basis; decides solvability for copositive-plus M",
    needs: &["the entries of M"],
    cites: &["Acary2018", "CottlePangStone2009", "Lemke1965"],
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
