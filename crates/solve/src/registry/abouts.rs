//! The solvers of frictional contact, described.

use super::{About, Solves};
use crate::auto::Auto;
use crate::interior::{ConvexRelaxation, Interior};
use crate::newton::{
    NewtonAc, NewtonCm, NewtonFb, NewtonFbSmooth, NewtonHsw, NewtonJm, NewtonNm, NewtonPk,
    NewtonXsw,
};
use crate::optimisation::{Cadoux, Panagiotopoulos, Tresca};
use crate::projection::{DeSaxce, Extragradient, FixedPoint, Hyperplane};
use crate::proximal::Admm;
use crate::settings::described;
use crate::splitting::{Colored, Nsgs, Psor};

/// The automatic method.
pub const AUTO: About = About {
    name: "auto",
    family: "auto",
    solves: Solves::Law,
    summary: "needs no setting: sweeps, interior point, proximal semismooth Newton, each where it is the fastest",
    needs: &[],
    cites: &["AcaryBremondHuber2018", "AlartCurnier1991", "Acary2018"],
    variants: &["interior=false"],
    settings: described::<Auto>,
};

/// NSGS.
pub const NSGS: About = About {
    name: "nsgs",
    family: "splitting",
    solves: Solves::Law,
    summary: "nonsmooth block Gauss-Seidel over contacts, with a choice of local solvers",
    needs: &[],
    cites: &["JourdanAlartJean1998", "Jean1999", "AcaryBremondHuber2018", "DBB11", "WalkerNi2011"],
    variants: &[
        "local=quartic",
        "local=newton_ac",
        "local=newton_jm",
        "local=projection",
        "local=projection_iterated",
        "ordering=shuffled",
        "ordering=fully_shuffled",
        "omega=0.9",
        "freeze_after=5",
        "local_tolerance=adaptive",
        "anderson=5",
    ],
    settings: described::<Nsgs>,
};

/// Coloured NSGS.
pub const NSGS_COLORED: About = About {
    name: "nsgs_colored",
    family: "splitting",
    solves: Solves::Law,
    summary: "nonsmooth block Gauss-Seidel on several threads, contacts by colour; the same bits for any number of threads",
    needs: &[],
    cites: &["JourdanAlartJean1998", "JonesPlassmann1993"],
    variants: &["threads=2", "serial_below=1", "local=newton_ac"],
    settings: described::<Colored>,
};

/// PSOR.
pub const PSOR: About = About {
    name: "psor",
    family: "splitting",
    solves: Solves::Law,
    summary: "projected successive over-relaxation: Gauss-Seidel sweeps with one projection a contact",
    needs: &[],
    cites: &["Cryer1971", "AcaryBremondHuber2018"],
    variants: &["omega=1"],
    settings: described::<Psor>,
};

/// The De Saxcé fixed point.
pub const DE_SAXCE: About = About {
    name: "de_saxce",
    family: "projection",
    solves: Solves::Law,
    summary: "De Saxce-Feng fixed point (Uzawa) with a fixed step",
    needs: &[],
    cites: &["DeSaxceFeng1991", "Acary2018"],
    variants: &[],
    settings: described::<DeSaxce>,
};

/// The fixed-point projection.
pub const FIXED_POINT: About = About {
    name: "fixed_point",
    family: "projection",
    solves: Solves::Law,
    summary: "fixed-point projection with a self-adaptive step",
    needs: &[],
    cites: &["Acary2018", "Khobotov1987", "SolodovTseng1996", "HanLo2002"],
    variants: &["rule=solodov_tseng"],
    settings: described::<FixedPoint>,
};

/// The extragradient method.
pub const EXTRAGRADIENT: About = About {
    name: "extragradient",
    family: "projection",
    solves: Solves::Law,
    summary: "extragradient projection with a self-adaptive step",
    needs: &[],
    cites: &["Korpelevich1976", "Khobotov1987", "SolodovTseng1996", "Acary2018"],
    variants: &["rule=solodov_tseng"],
    settings: described::<Extragradient>,
};

/// The hyperplane projection.
pub const HYPERPLANE: About = About {
    name: "hyperplane",
    family: "projection",
    solves: Solves::Law,
    summary: "hyperplane projection with a self-adaptive prediction",
    needs: &[],
    cites: &["SolodovTseng1996", "SolodovSvaiter1999", "AcaryBremondHuber2018"],
    // normal=field is too slow for any problem that tests would run.
    variants: &["rule=khobotov"],
    settings: described::<Hyperplane>,
};

/// ADMM.
pub const ADMM: About = About {
    name: "admm",
    family: "proximal",
    solves: Solves::Law,
    summary: "alternating direction method of multipliers with exact projection on the cones",
    needs: &[
        "W (or M) with a positive semidefinite symmetric part; the full W is factorised, so it need not be symmetric",
    ],
    cites: &["Carpentier2024", "EcksteinBertsekas1992", "BoydParikhChuPeleatoEckstein2011"],
    variants: &["rule=fixed", "alpha=1", "anderson=5"],
    settings: described::<Admm>,
};

/// Newton on the Alart–Curnier function.
pub const NEWTON_AC: About = About {
    name: "newton_ac",
    family: "newton",
    solves: Solves::Law,
    summary: "semismooth Newton on the Alart-Curnier function",
    needs: &[],
    cites: &["AlartCurnier1991", "Acary2018", "GoldsteinPrice1967", "GrippoLamparielloLucidi1986"],
    variants: &[
        "line_search=none",
        "line_search=goldstein_price",
        "line_search=nonmonotone",
        "rho_rule=fixed",
        "rho_rule=norm",
        "rho_rule=adaptive",
        "warm_up=0",
    ],
    settings: described::<NewtonAc>,
};

/// Newton on the Jean–Moreau function.
pub const NEWTON_JM: About = About {
    name: "newton_jm",
    family: "newton",
    solves: Solves::Law,
    summary: "semismooth Newton on the Jean-Moreau function",
    needs: &[],
    cites: &["AlartCurnier1991", "Jean1999", "Acary2018"],
    variants: &[],
    settings: described::<NewtonJm>,
};

/// Newton on the natural map.
pub const NEWTON_NM: About = About {
    name: "newton_nm",
    family: "newton",
    solves: Solves::Law,
    summary: "semismooth Newton on the natural map of the cone",
    needs: &[],
    cites: &["AcaryBremondHuber2018", "Acary2018"],
    variants: &[],
    settings: described::<NewtonNm>,
};

/// Newton on the Fischer–Burmeister function.
pub const NEWTON_FB: About = About {
    name: "newton_fb",
    family: "newton",
    solves: Solves::Law,
    summary: "semismooth Newton on the Fischer-Burmeister function over the second-order cone",
    needs: &[],
    cites: &["FukushimaLuoTseng2001", "Acary2018"],
    variants: &[],
    settings: described::<NewtonFb>,
};

/// Newton on the smoothed Fischer–Burmeister function.
pub const NEWTON_FB_SMOOTH: About = About {
    name: "newton_fb_smooth",
    family: "newton",
    solves: Solves::Law,
    summary: "smoothing Newton on the Fischer-Burmeister function over the second-order cone",
    needs: &[],
    cites: &["FukushimaLuoTseng2001", "Acary2018"],
    variants: &[],
    settings: described::<NewtonFbSmooth>,
};

/// Newton on Chen–Mangasarian smoothings.
pub const NEWTON_CM: About = About {
    name: "newton_cm",
    family: "newton",
    solves: Solves::Law,
    summary: "smoothing Newton on the Chen-Mangasarian class over the second-order cone",
    needs: &[],
    cites: &["ChenMangasarian1996", "FukushimaLuoTseng2001"],
    variants: &["kernel=neural_network"],
    settings: described::<NewtonCm>,
};

/// Newton on the equations of Xuewen, Soh and Wanji.
pub const NEWTON_XSW: About = About {
    name: "newton_xsw",
    family: "newton",
    solves: Solves::Law,
    summary: "semismooth Newton on the direct equations of Xuewen, Soh and Wanji",
    needs: &[],
    cites: &["Acary2018"],
    variants: &[],
    settings: described::<NewtonXsw>,
};

/// Newton on the equations of Park and Kwak.
pub const NEWTON_PK: About = About {
    name: "newton_pk",
    family: "newton",
    solves: Solves::Law,
    summary: "semismooth Newton on the equations of Park and Kwak, with the sliding angle in space",
    needs: &[],
    cites: &["ParkKwak1994", "LeungChenChen1998", "Acary2018"],
    variants: &[],
    settings: described::<NewtonPk>,
};

/// Newton on the function of Hüeber, Stadler and Wohlmuth.
pub const NEWTON_HSW: About = About {
    name: "newton_hsw",
    family: "newton",
    solves: Solves::Law,
    summary: "semismooth Newton on the function of Hueber, Stadler and Wohlmuth",
    needs: &[],
    cites: &["HueberStadlerWohlmuth2008"],
    variants: &["slip=exact"],
    settings: described::<NewtonHsw>,
};

/// The Tresca fixed point.
pub const TRESCA: About = About {
    name: "tresca",
    family: "optimisation",
    solves: Solves::Law,
    summary: "Tresca fixed point (Haslinger): convex problems over cylinders of given thresholds",
    needs: &[],
    cites: &["HaslingerDostalKucera2002", "Acary2018", "AcaryBremondHuber2018"],
    variants: &["inner=projected_gradient", "inner=conic", "anderson=5"],
    settings: described::<Tresca>,
};

/// Panagiotopoulos' alternation.
pub const PANAGIOTOPOULOS: About = About {
    name: "panagiotopoulos",
    family: "optimisation",
    solves: Solves::Law,
    summary: "Panagiotopoulos' alternation of a normal and a tangential convex problem",
    needs: &[],
    cites: &["Panagiotopoulos1975", "Acary2018", "AcaryBremondHuber2018"],
    variants: &["inner=projected_gradient", "inner=active_set"],
    settings: described::<Panagiotopoulos>,
};

/// Cadoux' approach.
pub const CADOUX: About = About {
    name: "cadoux",
    family: "optimisation",
    solves: Solves::Law,
    summary: "Cadoux' approach: second-order cone programs of given sliding speeds, Newton on the speeds",
    needs: &[],
    cites: &["Cadoux2009", "AcaryCadouxLemarechalMalick2011", "Acary2018"],
    variants: &[
        "update=fixed_point",
        "update=anderson",
        "inner=clarabel",
        "inner=newton",
        "inner=projected_gradient",
    ],
    settings: described::<Cadoux>,
};

/// The nonsmooth interior-point method.
pub const IP: About = About {
    name: "ip",
    family: "interior",
    solves: Solves::Law,
    summary: "nonsmooth interior point: Mehrotra's predictor-corrector with Nesterov-Todd scaling on Coulomb's law itself",
    needs: &[],
    cites: &["NesterovTodd1998", "Mehrotra1992", "TutuncuTohTodd2003", "Keller1977"],
    variants: &["smoothing=0.1", "warm_margin=0.1", "path=continuation"],
    settings: described::<Interior>,
};

/// The convex relaxation.
pub const CONVEX_RELAXATION: About = About {
    name: "convex_relaxation",
    family: "interior",
    solves: Solves::Relaxation,
    summary: "interior point on the convex relaxation (s = 0), which is Coulomb's law only where nothing slides",
    needs: &[],
    cites: &["NesterovTodd1998", "Mehrotra1992", "Acary2018"],
    variants: &[],
    settings: described::<ConvexRelaxation>,
};
