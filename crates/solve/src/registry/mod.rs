//! What exists: one slice of entries per kind of problem, and everything that is generated from it.
//!
//! A composed name `reformulation/solver` (such as `condense/nsgs`) needs no entry of its own.

mod abouts;
mod contact;
mod facets;
mod guarded;
mod linear;
pub mod linear_abouts;

use std::marker::PhantomData;

use nonsmooth_problem::{Kind, Lcp, Mlcp, Problem};
use serde::Serialize;

pub use abouts::*;
pub use facets::{FACET_INNER, FACET_OUTER};
use guarded::Guarded;

use crate::proximal::ProximalPoint;
use crate::reform::Facets;
use crate::settings::{Setting, SettingsMap, described};
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

/// A solver, described.
#[derive(Debug, Serialize)]
pub struct About {
    /// The name by which it is asked for.
    pub name: &'static str,
    /// The family: the folder of its file.
    pub family: &'static str,
    /// What its answers are solutions of.
    pub solves: Solves,
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
///
/// Implemented for each kind by itself, not for all dimensions at once: so the solvers are compiled here, and not again by
/// every crate that asks for one.
pub trait Registered: Problem<Point: 'static> + Clone + Send + Sync + Sized + 'static {
    /// The descriptions of the solvers that work on it directly.
    fn abouts() -> Vec<&'static About>;

    /// The composed names `reformulation/solver` that exist.
    fn composed_names() -> Vec<String>;

    /// A session of the solver of this name, composed or not; `None` where there is none.
    fn make(name: &str, settings: &SettingsMap) -> Made<Self>;

    /// Whether a composed name contains a reformulation whose answers obey the problem's law only nearly.
    fn nearly(_name: &str) -> bool {
        false
    }
}

/// A session, if there is such a solver and its settings are right.
type Made<P> = Option<Result<Box<dyn Session<P>>, String>>;

/// The solver that is used when none is named.
pub const DEFAULT: &str = "auto";

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
    Prefix {
        name: "reduce",
        summary: "MLCP to LCP: the free variables eliminated, M = B - D A^-1 C, where A is invertible",
        from: &[Kind::Mlcp],
        cites: &["Acary2018"],
        settings: Vec::new,
    },
    Prefix {
        name: "split",
        summary: "box LCP to MLCP: bounds by shifts, second bounds by multipliers",
        from: &[Kind::BoxLcp],
        cites: &["Acary2018"],
        settings: Vec::new,
    },
    Prefix {
        name: "mixed",
        summary: "horizontal LCP to MLCP: s is a free variable",
        from: &[Kind::Hlcp],
        cites: &["Acary2018"],
        settings: Vec::new,
    },
    Prefix {
        name: FACET_INNER,
        summary: "contact to LCP: the disk of friction becomes an inscribed polygon; exact in the plane, an approximation in space",
        from: &[Kind::FrictionLocal2d, Kind::FrictionLocal3d],
        cites: &["StewartTrinkle1996", "AnitescuPotra1997", "Acary2018"],
        settings: described::<Facets>,
    },
    Prefix {
        name: FACET_OUTER,
        summary: "contact to MLCP: the disk of friction becomes a circumscribed polygon; exact in the plane, an approximation in space",
        from: &[Kind::FrictionLocal2d, Kind::FrictionLocal3d],
        cites: &["Klarbring1986", "Acary2018"],
        settings: described::<Facets>,
    },
];

fn find<V: Visitor>(entries: Vec<Entry<V>>, name: &str) -> Option<Entry<V>> {
    entries.into_iter().find(|e| e.about.name == name)
}

fn names<V: Visitor>(entries: &[Entry<V>], prefix: &str) -> Vec<String> {
    entries.iter().map(|e| format!("{prefix}{}", e.about.name)).collect()
}

/// The descriptions of the solvers that work on problems of type `P` directly.
pub fn abouts<P: Registered>() -> Vec<&'static About> {
    P::abouts()
}

/// Every name that [`session`] takes for problems of type `P`.
pub fn solver_names<P: Registered>() -> Vec<String> {
    let mut all: Vec<String> = P::abouts().iter().map(|about| about.name.into()).collect();
    all.extend(P::composed_names());
    all
}

/// The description behind a name, composed or not.
pub fn about<P: Registered>(name: &str) -> Option<&'static About> {
    let (path, last) = name.rsplit_once('/').unwrap_or(("", name));
    let before = path.rsplit('/').next().unwrap_or(path);
    behind(before).unwrap_or_else(P::abouts).into_iter().find(|a| a.name == last)
}

/// The solvers behind a prefix that leads to problems of another kind, with solvers of their own.
fn behind(prefix: &str) -> Option<Vec<&'static About>> {
    match prefix {
        FACET_INNER | "reduce" => Some(Lcp::abouts()),
        FACET_OUTER | "split" | "mixed" => Some(Mlcp::abouts()),
        _ => None,
    }
}

/// What the answers of the solver behind a name, composed or not, are solutions of.
pub fn solves<P: Registered>(name: &str) -> Option<Solves> {
    let solves = about::<P>(name)?.solves;
    Some(if P::nearly(name) { Solves::Relaxation } else { solves })
}

/// A session of the solver called `name`, with the settings given and defaults for the rest.
///
/// It keeps its limits whatever the solver does, see [`guard`](crate::guard).
/// Errors: an unknown name, an unknown key, a value of the wrong type or out of range.
pub fn session<P: Registered>(
    name: &str,
    settings: &SettingsMap,
) -> Result<Box<dyn Session<P>>, SolveError> {
    let bare = bare::<P>(name, settings)?;
    Ok(Box::new(Guarded::new(bare, name, settings)))
}

/// As [`session`], for callers who are guarded themselves.
pub(crate) fn bare<P: Registered>(
    name: &str,
    settings: &SettingsMap,
) -> Result<Box<dyn Session<P>>, SolveError> {
    P::make(name, settings)
        .ok_or_else(|| SolveError::UnknownSolver {
            name: name.into(),
            known: solver_names::<P>().join(", "),
        })?
        .map_err(|problem| SolveError::Settings { solver: name.into(), problem })
}

#[cfg(test)]
mod tests {
    use nonsmooth_problem::{FrictionGlobal, FrictionLocal};

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
