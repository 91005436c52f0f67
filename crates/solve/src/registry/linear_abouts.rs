//! The solvers of linear complementarity problems, described.

use super::{About, Solves};
use crate::auto::linear::LinearAuto;
use crate::interior::linear::{MehrotraType, MizunoToddYe};
use crate::newton::linear::{NewtonFb, NewtonMin, NewtonPfb};
use crate::optimisation::linear::{Mprgp, QuadraticProgram};
use crate::pivoting::{
    Bard, BlockPivoting, CrissCross, Enumeration, EnumerationExact, Keller, Lemke, Murty,
};
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

/// Enumeration of complementary cones in exact arithmetic.
pub const ENUMERATION_EXACT: About = About {
    name: "enumeration_exact",
    family: "pivoting",
    solves: Solves::Law,
    summary: "enumeration of complementary cones in rational arithmetic: decides any problem of few variables, whatever its scaling and condition",
    needs: &["the entries of M", "few complementary pairs (max_pairs)"],
    cites: &["CottlePangStone2009", "Bareiss1968", "Bland1977"],
    variants: &[],
    settings: described::<EnumerationExact>,
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
