//! Friction through facets: solvers of linear complementarity problems that become solvers of friction problems, `facet_inner/lemke`.

use nonsmooth_problem::{FrictionLocal, Lcp, Mlcp};

use super::linear::complementary_solvers;
use super::{About, Entry, Registered, Visitor, find};
use crate::reform::{FacetInner, FacetOuter, Facets};
use crate::settings::{SettingsMap, parse};
use crate::{Reformulation, Solver, Via};

/// The prefix of inner faceting, to an LCP.
pub const FACET_INNER: &str = "facet_inner";
/// The prefix of outer faceting, to an MLCP.
pub const FACET_OUTER: &str = "facet_outer";

/// The solvers that are listed behind the prefixes: those that work on matrices which are no more than copositive. Others can be named all the same, and
/// say for themselves whether they apply.
const LISTED: &[&str] = &["lemke"];

/// Hands a solver on as a solver of the problem before a reformulation.
struct Before<V, R> {
    reformulation: R,
    visitor: V,
}

impl<V, R> Visitor for Before<V, R>
where
    V: Visitor,
    R: Reformulation<V::Problem> + 'static,
{
    type Problem = R::To;
    type Output = V::Output;
    fn visit<S: Solver<R::To> + 'static>(self, solver: S) -> V::Output {
        self.visitor.visit(Via { reformulation: self.reformulation, solver })
    }
}

/// Builds the solver of a name that begins with one of the two prefixes; `None` where it does not, or where there is no such solver.
pub(super) fn faceted<const D: usize, V>(
    name: &str,
    settings: &SettingsMap,
    visitor: V,
) -> Option<Result<V::Output, String>>
where
    V: Visitor<Problem = FrictionLocal<D>>,
{
    match name.split_once('/')? {
        (FACET_INNER, solver) => {
            build(complementary_solvers(), solver, settings, visitor, FacetInner::<D>)
        }
        (FACET_OUTER, solver) => {
            build(complementary_solvers(), solver, settings, visitor, FacetOuter::<D>)
        }
        _ => None,
    }
}

/// The settings of the facets (their keys say so), and those of the solver.
fn build<V, R>(
    entries: Vec<Entry<Before<V, R>>>,
    solver: &str,
    settings: &SettingsMap,
    visitor: V,
    edge: fn(Facets) -> R,
) -> Option<Result<V::Output, String>>
where
    V: Visitor,
    R: Reformulation<V::Problem> + 'static,
{
    let entry = find(entries, solver)?;
    let (own, inner): (SettingsMap, SettingsMap) =
        settings.clone().into_iter().partition(|(key, _)| key.starts_with("facet"));
    let built = parse(&own)
        .and_then(|facets| (entry.build)(&inner, Before { reformulation: edge(facets), visitor }));
    Some(built)
}

/// The names behind `path` (empty, or a prefix with its slash) that are listed.
pub(super) fn facet_names(path: &str) -> Vec<String> {
    let listed = |prefix: &str, abouts: Vec<&'static About>| {
        let there = move |name: &&&str| abouts.iter().any(|about| about.name == **name);
        let prefix = format!("{path}{prefix}/");
        LISTED.iter().filter(there).map(|name| format!("{prefix}{name}")).collect::<Vec<_>>()
    };
    [listed(FACET_INNER, Lcp::abouts()), listed(FACET_OUTER, Mlcp::abouts())].concat()
}

/// Whether the answers of a solver of this name obey the law only nearly: facets in space.
pub(super) fn nearly<const D: usize>(name: &str) -> bool {
    D > 2 && name.split('/').any(|part| [FACET_INNER, FACET_OUTER].contains(&part))
}
