//! What exists: one slice of entries per kind of problem, and everything that is generated from it.
//!
//! A composed name `reformulation/solver` (such as `condense/nsgs`) needs no entry of its own.

use std::marker::PhantomData;

use nonsmooth_problem::check::Kinematic;
use nonsmooth_problem::{FrictionGlobal, FrictionLocal, Kind, Problem};
use serde::Serialize;

use crate::auto::{Auto, Hybrid};
use crate::cfun::ContactFunction;
use crate::form::{Concurrent, Explicit, Linear, Linearised, Overwrite, Regularised};
use crate::interior::{ConvexRelaxation, Interior, Pursued, Relaxed};
use crate::newton::{
    Method as NewtonMethod, NewtonAc, NewtonCm, NewtonFb, NewtonFbSmooth, NewtonHsw, NewtonJm,
    NewtonNm, NewtonPk, NewtonXsw, Semismooth,
};
use crate::optimisation::{Alternation, Cadoux, CadouxSteps, Panagiotopoulos, Tresca, TrescaSteps};
use crate::projection::{DeSaxce, Extragradient, FixedPoint, Hyperplane, Method, Projected};
use crate::proximal::{Admm, AdmmSteps, Outer, ProximalPoint};
use crate::reform::Condense;
use crate::settings::{Setting, Settings, SettingsMap, described, parse};
use crate::splitting::{Colored, Nsgs, Psor};
use crate::{Driver, Reformulation, Session, SolveError, Solver, Via};

/// One solver: what it is, and how it is made and handed to a visitor that knows the kind of problem.
pub struct Entry<V: Visitor> {
    /// What it is and needs.
    pub about: &'static About,
    build: fn(&SettingsMap, V) -> Result<V::Output, String>,
}

/// Someone who takes a solver for `Problem` with its type, once a session, and makes something of it.
pub trait Visitor {
    /// The problems that the solver must solve.
    type Problem: Problem;
    /// What comes of it.
    type Output;
    /// Takes the solver.
    fn visit<S: Solver<Self::Problem> + 'static>(self, solver: S) -> Self::Output;
}

/// Makes a session on the solver's own kind of problem.
struct Direct<P>(PhantomData<P>);

impl<P: Problem + 'static> Visitor for Direct<P> {
    type Problem = P;
    type Output = Box<dyn Session<P>>;
    fn visit<S: Solver<P> + 'static>(self, solver: S) -> Self::Output {
        Box::new(Driver::new(solver))
    }
}

/// Makes a session on problems of type `P` that a reformulation leads to the solver's.
struct Through<P, R>(R, PhantomData<P>);

impl<P: Problem + 'static, R: Reformulation<P> + 'static> Visitor for Through<P, R> {
    type Problem = R::To;
    type Output = Box<dyn Session<P>>;
    fn visit<S: Solver<R::To> + 'static>(self, solver: S) -> Self::Output {
        Box::new(Driver::new(Via { reformulation: self.0, solver }))
    }
}

/// Makes a session on problems of type `P` in which the solver works on the inner problems of a proximal point method.
struct Around<P, const D: usize>(ProximalPoint, PhantomData<P>);

impl<P, const D: usize> Visitor for Around<P, D>
where
    P: Linear<D> + Overwrite + Send + 'static,
{
    type Problem = Regularised<P>;
    type Output = Box<dyn Session<P>>;
    fn visit<S: Solver<Regularised<P>> + 'static>(self, inner: S) -> Self::Output {
        Box::new(Driver::new(Outer::<S, D> { settings: self.0, inner }))
    }
}

/// A solver, described.
#[derive(Debug, Serialize)]
pub struct About {
    /// The name by which it is asked for.
    pub name: &'static str,
    /// The family: the folder of its file.
    pub family: &'static str,
    /// One line.
    pub summary: &'static str,
    /// What it needs of a problem, in words; empty where it takes any.
    pub needs: &'static [&'static str],
    /// Keys of `docs/refs.bib`.
    pub cites: &'static [&'static str],
    /// Settings (`key=value`) that the conformance tests and benchmarks run besides the defaults.
    pub variants: &'static [&'static str],
    /// The documented settings.
    #[serde(serialize_with = "settings_now")]
    pub settings: fn() -> Vec<Setting>,
}

/// What a solver's answers are solutions of.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize)]
#[serde(rename_all = "snake_case")]
pub enum Solves {
    /// The problem that it is given, in this case Coulomb's law.
    Law,
    /// A relaxation, whose answers obey the law in special cases only: the judge, who knows the law alone, says in which.
    Relaxation,
}

/// The solvers of relaxations.
const RELAXATIONS: &[&str] = &["convex_relaxation"];

impl About {
    /// What the solver's answers are solutions of.
    pub fn solves(&self) -> Solves {
        if RELAXATIONS.contains(&self.name) { Solves::Relaxation } else { Solves::Law }
    }
}

fn settings_now<S: serde::Serializer>(
    settings: &fn() -> Vec<Setting>,
    serializer: S,
) -> Result<S::Ok, S::Error> {
    settings().serialize(serializer)
}

/// A reformulation that can stand before a solver's name.
#[derive(Debug, Serialize)]
pub struct Prefix {
    /// The name before the slash.
    pub name: &'static str,
    /// One line.
    pub summary: &'static str,
    /// The kinds of problem that it takes.
    pub from: &'static [Kind],
    /// Keys of `docs/refs.bib`.
    pub cites: &'static [&'static str],
    /// The documented settings that it adds to those of the solver.
    #[serde(serialize_with = "settings_now")]
    pub settings: fn() -> Vec<Setting>,
}

/// A kind of problem that has solvers.
pub trait Registered: Problem + Sized + 'static {
    /// The solvers that work on it directly, to be handed to `V`.
    fn entries<V: Visitor<Problem = Self>>() -> Vec<Entry<V>>;

    /// Hands a solver reached through a reformulation to a session; `None` where there is no such pair.
    fn composed(_reformulation: &str, _solver: &str, _settings: &SettingsMap) -> Composed<Self> {
        None
    }

    /// The composed names `reformulation/solver` that exist.
    fn composed_names() -> Vec<String> {
        vec![]
    }
}

/// A session through a reformulation, if there is such a pair and its settings are right.
type Composed<P> = Option<Result<Box<dyn Session<P>>, String>>;

/// The solver that is used when none is named.
pub const DEFAULT: &str = "nsgs";

/// The reformulations.
pub const PREFIXES: &[Prefix] = &[
    Prefix {
        name: "condense",
        summary: "global to local: forms W = H' M^-1 H and q, bilateral constraints eliminated",
        from: &[Kind::FrictionGlobal2d, Kind::FrictionGlobal3d],
        cites: &["Acary2018"],
        settings: Vec::new,
    },
    Prefix {
        name: "proximal",
        summary: "proximal point: the solver works on problems with W + alpha w in place of W",
        from: &[
            Kind::FrictionLocal2d,
            Kind::FrictionLocal3d,
            Kind::FrictionGlobal2d,
            Kind::FrictionGlobal3d,
        ],
        cites: &["Rockafellar1976", "AcaryBremondHuber2018"],
        settings: described::<ProximalPoint>,
    },
];

/// NSGS.
pub const NSGS: About = About {
    name: "nsgs",
    family: "splitting",
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

/// The De Saxcé fixed point.
pub const DE_SAXCE: About = About {
    name: "de_saxce",
    family: "projection",
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
    summary: "extragradient projection with a self-adaptive step",
    needs: &[],
    cites: &["Korpelevich1976", "Khobotov1987", "SolodovTseng1996", "Acary2018"],
    variants: &["rule=solodov_tseng"],
    settings: described::<Extragradient>,
};

/// The Tresca fixed point.
pub const TRESCA: About = About {
    name: "tresca",
    family: "optimisation",
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

/// Newton on the Alart–Curnier function.
pub const NEWTON_AC: About = About {
    name: "newton_ac",
    family: "newton",
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
    summary: "semismooth Newton on the function of Hueber, Stadler and Wohlmuth",
    needs: &[],
    cites: &["HueberStadlerWohlmuth2008"],
    variants: &["slip=exact"],
    settings: described::<NewtonHsw>,
};

/// The convex relaxation.
pub const CONVEX_RELAXATION: About = About {
    name: "convex_relaxation",
    family: "interior",
    summary: "interior point on the convex relaxation (s = 0), which is Coulomb's law only where nothing slides",
    needs: &[],
    cites: &["NesterovTodd1998", "Mehrotra1992", "Acary2018"],
    variants: &[],
    settings: described::<ConvexRelaxation>,
};

/// The nonsmooth interior-point method.
pub const IP: About = About {
    name: "ip",
    family: "interior",
    summary: "nonsmooth interior point: Mehrotra's predictor-corrector with Nesterov-Todd scaling on Coulomb's law itself",
    needs: &[],
    cites: &["NesterovTodd1998", "Mehrotra1992", "TutuncuTohTodd2003", "Keller1977"],
    variants: &["smoothing=0.1", "warm_margin=0.1", "path=continuation"],
    settings: described::<Interior>,
};

/// The hyperplane projection.
pub const HYPERPLANE: About = About {
    name: "hyperplane",
    family: "projection",
    summary: "hyperplane projection with a self-adaptive prediction",
    needs: &[],
    cites: &["SolodovTseng1996", "SolodovSvaiter1999", "AcaryBremondHuber2018"],
    // normal=field is too slow for any problem that tests would run.
    variants: &["rule=khobotov"],
    settings: described::<Hyperplane>,
};

/// PSOR.
pub const PSOR: About = About {
    name: "psor",
    family: "splitting",
    summary: "projected successive over-relaxation: Gauss-Seidel sweeps with one projection a contact",
    needs: &[],
    cites: &["Cryer1971", "AcaryBremondHuber2018"],
    variants: &["omega=1"],
    settings: described::<Psor>,
};

/// Coloured NSGS.
pub const NSGS_COLORED: About = About {
    name: "nsgs_colored",
    family: "splitting",
    summary: "nonsmooth block Gauss-Seidel on several threads, contacts by colour; the same bits for any number of threads",
    needs: &[],
    cites: &["JourdanAlartJean1998", "JonesPlassmann1993"],
    variants: &["threads=2", "serial_below=1", "local=newton_ac"],
    settings: described::<Colored>,
};

/// ADMM.
pub const ADMM: About = About {
    name: "admm",
    family: "proximal",
    summary: "alternating direction method of multipliers with exact projection on the cones",
    needs: &[
        "W (or M) with a positive semidefinite symmetric part; the full W is factorised, so it need not be symmetric",
    ],
    cites: &["Carpentier2024", "EcksteinBertsekas1992", "BoydParikhChuPeleatoEckstein2011"],
    variants: &["rule=fixed", "alpha=1", "anderson=5"],
    settings: described::<Admm>,
};

/// The automatic method.
pub const AUTO: About = About {
    name: "auto",
    family: "auto",
    summary: "hybrid",
    needs: &[],
    cites: &["Acary2018"],
    variants: &[],
    settings: described::<Auto>,
};

/// The solvers of frictional contact, for any problem that can be seen by its contacts.
fn contact_solvers<const D: usize, V>() -> Vec<Entry<V>>
where
    V: Visitor,
    V::Problem: Concurrent<D> + Linearised<D> + Explicit<D> + Kinematic<D>,
{
    fn projected<const D: usize, V, M>(
        settings: &SettingsMap,
        visitor: V,
    ) -> Result<V::Output, String>
    where
        V: Visitor,
        V::Problem: Linear<D>,
        M: Method + Settings + 'static,
    {
        Ok(visitor.visit(Projected::<M, D>(parse(settings)?)))
    }
    fn newton<const D: usize, V, M>(settings: &SettingsMap, visitor: V) -> Result<V::Output, String>
    where
        V: Visitor,
        V::Problem: Linearised<D>,
        M: NewtonMethod + Settings,
        M::Function: ContactFunction<D> + 'static,
    {
        Ok(visitor.visit(Semismooth::<M::Function, D>::new(&parse::<M>(settings)?)))
    }
    vec![
        Entry { about: &NSGS, build: |s, v| Ok(parse::<Nsgs>(s)?.visit::<D, V>(v)) },
        Entry { about: &AUTO, build: |s, v| Ok(v.visit(Hybrid::<D>(parse(s)?))) },
        Entry { about: &DE_SAXCE, build: projected::<D, V, DeSaxce> },
        Entry { about: &FIXED_POINT, build: projected::<D, V, FixedPoint> },
        Entry { about: &EXTRAGRADIENT, build: projected::<D, V, Extragradient> },
        Entry { about: &TRESCA, build: |s, v| Ok(v.visit(TrescaSteps::<D>(parse(s)?))) },
        Entry { about: &PANAGIOTOPOULOS, build: |s, v| Ok(v.visit(Alternation::<D>(parse(s)?))) },
        Entry { about: &CADOUX, build: |s, v| Ok(v.visit(CadouxSteps::<D>(parse(s)?))) },
        Entry { about: &NEWTON_AC, build: newton::<D, V, NewtonAc> },
        Entry { about: &NEWTON_JM, build: newton::<D, V, NewtonJm> },
        Entry { about: &NEWTON_NM, build: newton::<D, V, NewtonNm> },
        Entry { about: &NEWTON_FB, build: newton::<D, V, NewtonFb> },
        Entry { about: &NEWTON_FB_SMOOTH, build: newton::<D, V, NewtonFbSmooth> },
        Entry { about: &NEWTON_CM, build: newton::<D, V, NewtonCm> },
        Entry { about: &NEWTON_XSW, build: newton::<D, V, NewtonXsw> },
        Entry { about: &NEWTON_PK, build: newton::<D, V, NewtonPk> },
        Entry { about: &NEWTON_HSW, build: newton::<D, V, NewtonHsw> },
        Entry {
            about: &CONVEX_RELAXATION,
            build: |s, v| Ok(v.visit(Relaxed::<D>(parse::<ConvexRelaxation>(s)?))),
        },
        Entry { about: &IP, build: |s, v| Ok(v.visit(Pursued::<D>(parse::<Interior>(s)?))) },
        Entry { about: &HYPERPLANE, build: projected::<D, V, Hyperplane> },
        Entry { about: &PSOR, build: |s, v| Ok(v.visit(parse::<Psor>(s)?.sweeps::<D>())) },
        Entry { about: &NSGS_COLORED, build: |s, v| Ok(parse::<Colored>(s)?.visit::<D, V>(v)) },
        Entry { about: &ADMM, build: |s, v| Ok(v.visit(AdmmSteps::<D>(parse(s)?))) },
    ]
}

/// The solvers that the proximal point method may have inside: those that gain from a regular W. One line each.
fn inner_solvers<const D: usize, V>() -> Vec<Entry<V>>
where
    V: Visitor,
    V::Problem: Concurrent<D> + Linearised<D>,
{
    vec![
        Entry { about: &NSGS, build: |s, v| Ok(parse::<Nsgs>(s)?.visit::<D, V>(v)) },
        Entry {
            about: &EXTRAGRADIENT,
            build: |s, v| Ok(v.visit(Projected::<Extragradient, D>(parse(s)?))),
        },
        Entry { about: &ADMM, build: |s, v| Ok(v.visit(AdmmSteps::<D>(parse(s)?))) },
    ]
}

/// The settings of the proximal point method (their keys say so), and those of its inner solver.
fn around<P, const D: usize>(solver: &str, settings: &SettingsMap) -> Composed<P>
where
    P: Concurrent<D> + Linearised<D> + Overwrite + Send + 'static,
{
    let entry = find(inner_solvers::<D, Around<P, D>>(), solver)?;
    let (outer, inner): (SettingsMap, SettingsMap) =
        settings.clone().into_iter().partition(|(key, _)| key.starts_with("prox_"));
    let built = parse(&outer).and_then(|outer| (entry.build)(&inner, Around(outer, PhantomData)));
    Some(built)
}

fn around_names<P, const D: usize>() -> Vec<String>
where
    P: Concurrent<D> + Linearised<D> + Overwrite + Send + 'static,
{
    names(&inner_solvers::<D, Around<P, D>>(), "proximal/")
}

impl<const D: usize> Registered for FrictionLocal<D> {
    fn entries<V: Visitor<Problem = Self>>() -> Vec<Entry<V>> {
        contact_solvers::<D, V>()
    }

    fn composed(reformulation: &str, solver: &str, settings: &SettingsMap) -> Composed<Self> {
        (reformulation == "proximal").then(|| around::<Self, D>(solver, settings)).flatten()
    }

    fn composed_names() -> Vec<String> {
        around_names::<Self, D>()
    }
}

impl<const D: usize> Registered for FrictionGlobal<D> {
    fn entries<V: Visitor<Problem = Self>>() -> Vec<Entry<V>> {
        contact_solvers::<D, V>()
    }

    fn composed(reformulation: &str, solver: &str, settings: &SettingsMap) -> Composed<Self> {
        match reformulation {
            "condense" => {
                let entry = find(contact_solvers::<D, _>(), solver)?;
                Some((entry.build)(settings, Through(Condense, PhantomData)))
            }
            "proximal" => around::<Self, D>(solver, settings),
            _ => None,
        }
    }

    fn composed_names() -> Vec<String> {
        let mut all = names(&FrictionLocal::<D>::entries::<Direct<_>>(), "condense/");
        all.extend(around_names::<Self, D>());
        all
    }
}

fn find<V: Visitor>(entries: Vec<Entry<V>>, name: &str) -> Option<Entry<V>> {
    entries.into_iter().find(|e| e.about.name == name)
}

fn names<V: Visitor>(entries: &[Entry<V>], prefix: &str) -> Vec<String> {
    entries.iter().map(|e| format!("{prefix}{}", e.about.name)).collect()
}

/// The descriptions of the solvers that work on problems of type `P` directly.
pub fn abouts<P: Registered>() -> Vec<&'static About> {
    P::entries::<Direct<P>>().iter().map(|e| e.about).collect()
}

/// Every name that [`session`] takes for problems of type `P`.
pub fn solver_names<P: Registered>() -> Vec<String> {
    let mut all = names(&P::entries::<Direct<P>>(), "");
    all.extend(P::composed_names());
    all
}

/// The description behind a name, composed or not.
pub fn about<P: Registered>(name: &str) -> Option<&'static About> {
    let last = name.rsplit('/').next().unwrap_or(name);
    abouts::<P>().into_iter().find(|a| a.name == last)
}

/// A session of the solver called `name`, with the settings given and defaults for the rest.
///
/// Errors: an unknown name, an unknown key, a value of the wrong type or out of range.
pub fn session<P: Registered>(
    name: &str,
    settings: &SettingsMap,
) -> Result<Box<dyn Session<P>>, SolveError> {
    let built = match name.split_once('/') {
        Some((reformulation, solver)) => P::composed(reformulation, solver, settings),
        None => find(P::entries::<Direct<P>>(), name)
            .map(|entry| (entry.build)(settings, Direct(PhantomData))),
    };
    built
        .ok_or_else(|| SolveError::UnknownSolver {
            name: name.into(),
            known: solver_names::<P>().join(", "),
        })?
        .map_err(|problem| SolveError::Settings { solver: name.into(), problem })
}

#[cfg(test)]
mod tests {
    use super::*;

    fn refusal(texts: &[&str]) -> String {
        let map = crate::settings::from_texts(texts).unwrap();
        session::<FrictionLocal<3>>("nsgs", &map).err().expect("refused").to_string()
    }

    #[test]
    fn mistakes_in_settings_name_key_expected_and_found() {
        assert_eq!(
            refusal(&["omga=1"]),
            "solver `nsgs`: unknown key `omga`; there are: local, local_tolerance, omega, omega_min, \
             ordering, seed, freeze_after, freeze_for, anderson, anderson_every, check_every"
        );
        assert_eq!(
            refusal(&["omega=2.5"]),
            "solver `nsgs`: omega: expected a number in (0, 2), found 2.5"
        );
        assert_eq!(
            refusal(&["omega=fast"]),
            "solver `nsgs`: omega: expected a number, found \"fast\""
        );
        assert!(refusal(&["local=magic"]).contains("local: expected one of exact, quartic,"));
        assert!(refusal(&["seed=-1"]).contains("seed: expected a whole number"));
        assert!(refusal(&["check_every=0"]).contains("check_every: expected at least 1, found 0"));
    }

    #[test]
    fn unknown_solvers_are_refused_with_those_that_exist() {
        let e = session::<FrictionLocal<3>>("lemke", &SettingsMap::new()).err().expect("refused");
        assert!(e.to_string().contains("unknown solver `lemke`") && e.to_string().contains("nsgs"));
        for name in ["condense/nsgs", "facet/nsgs", "nsgs/condense"] {
            assert!(session::<FrictionLocal<3>>(name, &SettingsMap::new()).is_err(), "{name}");
        }
        assert!(session::<FrictionGlobal<3>>("condense/nsgs", &SettingsMap::new()).is_ok());
    }

    #[test]
    fn every_setting_is_documented() {
        for about in abouts::<FrictionLocal<3>>() {
            let settings = (about.settings)();
            assert!(!settings.is_empty(), "{}", about.name);
            assert!(settings.iter().all(|s| !s.help.is_empty()), "{}: {settings:?}", about.name);
        }
    }

    /// Methods that share no iteration find the same motion where W is regular.
    #[test]
    fn independent_methods_agree() {
        use nonsmooth_problem::planted::Planted;
        let planted = Planted { contacts: 20, dofs: 120, seed: 11, ..Planted::default() };
        let (problem, _) = planted.local::<3>();
        let motion = |name: &str, texts: &[&str]| {
            let settings = crate::settings::from_texts(texts).unwrap();
            let mut session = session::<FrictionLocal<3>>(name, &settings).unwrap();
            let mut point = problem.origin();
            let limits = crate::Limits {
                tolerance: 1e-11,
                max_iterations: 100_000,
                ..crate::Limits::default()
            };
            let outcome = session.solve(&problem, &mut point, &limits, &mut |_| {}).unwrap();
            assert_eq!(outcome.status, crate::Status::Solved, "{name} {texts:?}");
            let mut u = vec![0.0; problem.q.len()];
            problem.W.mul_plus(&point.r, &problem.q, &mut u);
            u
        };
        let reference = motion("nsgs", &[]);
        let size = nonsmooth_problem::linalg::norm(&problem.q);
        for (name, texts) in [
            ("psor", vec![]),
            ("nsgs_colored", vec!["threads=2", "serial_below=1"]),
            ("nsgs", vec!["anderson=5"]),
            ("nsgs", vec!["local=newton_ac", "local_tolerance=adaptive"]),
            ("nsgs", vec!["local=projection_iterated", "local_tolerance=adaptive"]),
            ("extragradient", vec!["rule=solodov_tseng"]),
            ("hyperplane", vec![]),
            ("proximal/extragradient", vec![]),
            ("admm", vec![]),
            ("admm", vec!["rule=fixed", "anderson=5"]),
            ("proximal/nsgs", vec![]),
            ("proximal/admm", vec!["prox_rule=residual"]),
        ] {
            let u = motion(name, &texts);
            let far = u.iter().zip(&reference).fold(0.0_f64, |m, (a, b)| m.max((a - b).abs()));
            assert!(far < 1e-8 * size, "{name} {texts:?}: {far:e}");
        }
    }
}
