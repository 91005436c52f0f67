//! The shape of the registry: what is said of a solver, how one is made from its name, and what may stand before the name.
//!
//! A name is a path, `condense/facet_inner/lemke`: each prefix is a reformulation to another kind of problem (or to the same kind with a proximal
//! term), which has solvers and prefixes of its own; the last part is a solver there.

use std::any::TypeId;

use nonsmooth_problem::{Kind, Problem};
use serde::Serialize;

use crate::core::boxed::Boxed;
use crate::core::drive::Driver;
use crate::core::error::SolveError;
use crate::core::guarded::Guarded;
use crate::core::reformulation::Reformulation;
use crate::core::session::Session;
use crate::core::settings::{Setting, Settings, SettingsMap, described, parse};
use crate::core::solver::Solver;
use crate::core::spelling::meant;
use crate::core::via::Via;

/// The solver that is used when none is named.
pub const DEFAULT: &str = "auto";

/// What is known of a solver without a problem: lists, help and documentation are made of it.
#[derive(Debug, Serialize)]
pub struct About {
    /// The name by which it is asked for.
    pub name: &'static str,
    /// The family: the folder of its file.
    pub family: &'static str,
    /// What its answers are solutions of.
    pub solves: Solves,
    /// One line, without the name.
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
    /// One line, without the name.
    pub summary: &'static str,
    /// The kinds of problem that it takes.
    pub from: &'static [Kind],
    /// Keys of `docs/refs.bib`.
    pub cites: &'static [&'static str],
    /// The documented settings that it adds to those of the solver.
    #[serde(serialize_with = "settings_now")]
    pub settings: fn() -> Vec<Setting>,
}

/// Hyperparameters that describe their solver: the description stands in the solver's own file.
pub trait Described: Settings {
    /// What the solver is and needs.
    const ABOUT: &'static About;
}

/// What a method is called and rests on, where the description stands with a part of it: a complementarity function, say.
#[derive(Debug)]
pub struct Named {
    /// The method's name.
    pub name: &'static str,
    /// One line, without the name.
    pub summary: &'static str,
    /// Keys of `docs/refs.bib`.
    pub cites: &'static [&'static str],
    /// Settings that tests and benchmarks run besides the defaults.
    pub variants: &'static [&'static str],
}

impl Named {
    /// The description of the method, which answers the problem that it is given.
    pub(crate) const fn about(
        self,
        family: &'static str,
        needs: &'static [&'static str],
        settings: fn() -> Vec<Setting>,
    ) -> About {
        let Self { name, summary, cites, variants } = self;
        About { name, family, solves: Solves::Law, summary, needs, cites, variants, settings }
    }
}

/// How a solver is made from its settings.
type Make<T> = Box<dyn Fn(&SettingsMap) -> Result<T, String>>;

/// A session whose type is forgotten.
pub type AnySession<P> = Box<dyn Session<P>>;

/// What makes a session of `P` of one of `To`, and of a prefix's settings `S`.
pub type Over<S, To, P> = fn(S, AnySession<To>) -> AnySession<P>;

/// What was made, if there is such a name and the settings are right.
pub(crate) type Made<T> = Option<Result<T, String>>;

/// One solver of problems of type `P`.
pub struct Entry<P: Problem> {
    /// What it is and needs.
    pub about: &'static About,
    make: Maker<P>,
}

enum Maker<P: Problem> {
    Solver(Make<Boxed<P>>),
    /// Runs whole sessions of others, so it is one itself and has no steps that a prefix could lead to.
    Session(Make<AnySession<P>>),
}

impl<P: Problem + 'static> Entry<P> {
    /// A solver, by what makes it of its hyperparameters.
    pub(crate) fn new<S: Described>(make: impl Fn(S) -> Boxed<P> + 'static) -> Self {
        let make = move |settings: &SettingsMap| parse(settings).map(&make);
        Self { about: S::ABOUT, make: Maker::Solver(Box::new(make)) }
    }

    /// A solver that is its hyperparameters.
    pub(crate) fn of<S: Described + Solver<P, Work: 'static> + 'static>() -> Self {
        Self::new(Boxed::new::<S>)
    }

    /// A whole session, by what makes it of its hyperparameters.
    pub(crate) fn session<S: Described, T: Session<P> + 'static>(
        make: impl Fn(S) -> T + 'static,
    ) -> Self {
        let make =
            move |settings: &SettingsMap| Ok(Box::new(make(parse(settings)?)) as AnySession<P>);
        Self { about: S::ABOUT, make: Maker::Session(Box::new(make)) }
    }

    /// The same solver behind a reformulation of the kind to itself that its name does not show.
    pub(crate) fn behind<R>(self, reformulation: R) -> Self
    where
        R: Reformulation<P, To = P, Memo: 'static> + Copy + 'static,
        P::Point: 'static,
    {
        let Self { about, make } = self;
        let make = match make {
            Maker::Solver(make) => Maker::Solver(Box::new(move |settings: &SettingsMap| {
                Ok(Boxed::new(Via { reformulation, solver: make(settings)? }))
            }) as Make<Boxed<P>>),
            session => session,
        };
        Self { about, make }
    }

    fn has_steps(&self) -> bool {
        matches!(self.make, Maker::Solver(_))
    }
}

/// What may stand before the name of a solver of another kind of problem, and makes of it a solver of `P`.
pub trait Composed<P: Problem> {
    /// The other kind of problem.
    type To: Registered;
    /// Its own hyperparameters; [`NoSettings`](crate::settings::NoSettings) where it has none.
    type Settings: Settings;
    /// The name before the slash.
    const NAME: &'static str;
    /// One line, without the name.
    const SUMMARY: &'static str;
    /// The kinds of problem that it takes.
    const FROM: &'static [Kind];
    /// Keys of `docs/refs.bib`.
    const CITES: &'static [&'static str];
    /// All of that and the settings, for lists and help.
    const PREFIX: &'static Prefix = &Prefix {
        name: Self::NAME,
        summary: Self::SUMMARY,
        from: Self::FROM,
        cites: Self::CITES,
        settings: described::<Self::Settings>,
    };
    /// How the keys of its settings begin, so that they can be told from the solver's.
    const KEYS: &'static str = "";
    /// Whether the solutions of the other problem are those of the first only nearly.
    const NEARLY: bool = false;

    /// The session of `P` that has another inside, of prefixes that stand before whole sessions, too.
    const SESSION: Option<Over<Self::Settings, Self::To, P>> = None;

    /// The solver of `P` that has `solver` inside.
    fn compose(settings: Self::Settings, solver: Boxed<Self::To>) -> Boxed<P>;

    /// Whether the solver of this name is listed behind the prefix; those without a prefix are. Others can be named all the same, and say for themselves
    /// whether they apply.
    fn lists(solver: &str) -> bool {
        !solver.contains('/')
    }
}

/// One prefix of the solvers of problems of type `P`.
pub struct Edge<P: Problem> {
    prefix: &'static Prefix,
    solver: fn(&str, &SettingsMap) -> Made<Boxed<P>>,
    session: fn(&str, &SettingsMap) -> Made<AnySession<P>>,
    describe: fn(&str) -> Option<(&'static About, Solves)>,
    names: fn() -> Vec<String>,
}

impl<P: Problem + 'static> Edge<P> {
    /// The edge that is `C`.
    pub(crate) fn new<C: Composed<P>>() -> Self {
        Self {
            prefix: C::PREFIX,
            solver: |name, settings| {
                let (own, inner) = parted::<P, C>(settings);
                let solver = solver::<C::To>(name, &inner)?;
                Some(parse(&own).and_then(|own| Ok(C::compose(own, solver?))))
            },
            session: |name, settings| {
                let (own, inner) = parted::<P, C>(settings);
                let over = C::SESSION?;
                let session = made::<C::To>(name, &inner)?;
                Some(parse(&own).and_then(|own| Ok(over(own, session?))))
            },
            describe: |name| {
                let (about, solves) = describe::<C::To>(name)?;
                Some((about, if C::NEARLY { Solves::Relaxation } else { solves }))
            },
            names: || {
                // What leads back to the same kind is not gone through again.
                let again = TypeId::of::<C::To>() == TypeId::of::<P>();
                let mut names = if again { direct::<C::To>() } else { with_steps::<C::To>() };
                if C::SESSION.is_some() {
                    let sessions = C::To::solvers().into_iter().filter(|entry| !entry.has_steps());
                    names.extend(sessions.map(|entry| entry.about.name.into()));
                }
                let names = names.into_iter().filter(|name| C::lists(name));
                names.map(|name| format!("{}/{name}", C::NAME)).collect()
            },
        }
    }
}

/// A kind of problem that has solvers.
///
/// Implemented for each kind by itself, not for all dimensions at once: so the solvers are compiled here, and not again by
/// every crate that asks for one.
pub trait Registered: Problem<Point: 'static> + Clone + Send + Sync + Sized + 'static {
    /// The solvers that work on it directly.
    fn solvers() -> Vec<Entry<Self>>;

    /// What may stand before the names of solvers of other problems.
    fn edges() -> Vec<Edge<Self>> {
        vec![]
    }
}

/// Where a name leads from problems of type `P`: to a solver, or behind a prefix with the rest of the name.
enum Way<'a, P: Problem> {
    Here(Entry<P>),
    Behind(Edge<P>, &'a str),
}

fn way<P: Registered>(name: &str) -> Option<Way<'_, P>> {
    match name.split_once('/') {
        Some((prefix, rest)) => {
            let edge = P::edges().into_iter().find(|edge| edge.prefix.name == prefix)?;
            Some(Way::Behind(edge, rest))
        }
        None => P::solvers().into_iter().find(|entry| entry.about.name == name).map(Way::Here),
    }
}

/// The solver behind a name.
pub(crate) fn solver<P: Registered>(name: &str, settings: &SettingsMap) -> Made<Boxed<P>> {
    match way::<P>(name)? {
        Way::Behind(edge, rest) => (edge.solver)(rest, settings),
        Way::Here(Entry { make: Maker::Solver(make), .. }) => Some(make(settings)),
        Way::Here(Entry { make: Maker::Session(_), .. }) => None,
    }
}

/// A prefix's own settings, and those of the solver behind it.
fn parted<P: Problem, C: Composed<P>>(settings: &SettingsMap) -> (SettingsMap, SettingsMap) {
    let own = |key: &str| !C::KEYS.is_empty() && key.starts_with(C::KEYS);
    settings.clone().into_iter().partition(|(key, _)| own(key))
}

/// The session behind a name: one of its own, or a solver that is driven.
fn made<P: Registered>(name: &str, settings: &SettingsMap) -> Made<AnySession<P>> {
    if let Some(solver) = solver::<P>(name, settings) {
        return Some(solver.map(driven));
    }
    match way::<P>(name)? {
        Way::Here(Entry { make: Maker::Session(make), .. }) => Some(make(settings)),
        Way::Here(_) => None,
        Way::Behind(edge, rest) => (edge.session)(rest, settings),
    }
}

/// What is behind a name, and what its answers are solutions of.
fn describe<P: Registered>(name: &str) -> Option<(&'static About, Solves)> {
    match way::<P>(name)? {
        Way::Behind(edge, rest) => (edge.describe)(rest),
        Way::Here(Entry { about, .. }) => Some((about, about.solves)),
    }
}

/// The names of solvers that a prefix can lead to.
fn with_steps<P: Registered>() -> Vec<String> {
    let mut names = direct::<P>();
    names.extend(composed_names::<P>());
    names
}

/// Those of them without a prefix of their own.
fn direct<P: Registered>() -> Vec<String> {
    let solvers = P::solvers().into_iter().filter(Entry::has_steps);
    solvers.map(|entry| entry.about.name.into()).collect()
}

/// The descriptions of the solvers that work on problems of type `P` directly.
pub fn abouts<P: Registered>() -> Vec<&'static About> {
    P::solvers().into_iter().map(|entry| entry.about).collect()
}

/// The prefixes of the solvers of problems of type `P`.
pub fn prefixes<P: Registered>() -> Vec<&'static Prefix> {
    P::edges().into_iter().map(|edge| edge.prefix).collect()
}

/// The composed names `reformulation/solver` that are listed for problems of type `P`.
pub fn composed_names<P: Registered>() -> Vec<String> {
    P::edges().into_iter().flat_map(|edge| (edge.names)()).collect()
}

/// Every name that is listed for problems of type `P`; [`session`] takes these, and composed ones besides.
pub fn solver_names<P: Registered>() -> Vec<String> {
    let mut all: Vec<String> = abouts::<P>().iter().map(|about| about.name.into()).collect();
    all.extend(composed_names::<P>());
    all
}

/// The description behind a name, composed or not.
pub fn about<P: Registered>(name: &str) -> Option<&'static About> {
    Some(describe::<P>(name)?.0)
}

/// What the answers of the solver behind a name, composed or not, are solutions of.
pub fn solves<P: Registered>(name: &str) -> Option<Solves> {
    Some(describe::<P>(name)?.1)
}

/// A session of the solver called `name`, with the settings given and defaults for the rest.
///
/// It keeps its limits whatever the solver does, see [`guard`](crate::guard).
/// Errors: an unknown name, an unknown key, a value of the wrong type or out of range.
pub fn session<P: Registered>(
    name: &str,
    settings: &SettingsMap,
) -> Result<AnySession<P>, SolveError> {
    let bare = bare::<P>(name, settings)?;
    Ok(Box::new(Guarded::new(bare, name, settings)))
}

/// As [`session`], for callers who are guarded themselves.
pub(crate) fn bare<P: Registered>(
    name: &str,
    settings: &SettingsMap,
) -> Result<AnySession<P>, SolveError> {
    made::<P>(name, settings)
        .ok_or_else(|| SolveError::UnknownSolver {
            name: name.into(),
            meant: meant(name, solver_names::<P>()),
            known: solver_names::<P>().join(", "),
        })?
        .map_err(|problem| SolveError::Settings { solver: name.into(), problem })
}

fn driven<P: Problem + Sync + 'static>(solver: Boxed<P>) -> AnySession<P> {
    Box::new(Driver::new(solver))
}
