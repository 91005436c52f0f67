//! Which solvers there are for linear complementarity problems, and how each is made.

use std::marker::PhantomData;

use nonsmooth_problem::{BoxLcp, Hlcp, Lcp, Mlcp};

use super::linear_abouts::*;
use super::{About, Direct, Entry, Made, Registered, Through, Visitor, find, names};
use crate::Session;
use crate::auto::linear::{LinearAuto, Planned};
use crate::form::{Bounded, Complementary, Paired};
use crate::interior::linear::{Mehrotra, Mty};
use crate::newton::linear::{Method, NewtonFb, NewtonMin, NewtonPfb, Semismooth};
use crate::optimisation::linear::{Programmed, Proportioning};
use crate::pivoting::{
    BardPivoting, BlockPrincipal, CrissCrossPivoting, Enumerate, EnumerateExactly, KellerPivoting,
    LemkePath, MurtyPivoting,
};
use crate::reform::{Mixed, Reduce, Split};
use crate::settings::{SettingsMap, parse};
use crate::splitting::linear::{Jacobi, Pgs, Proximal, Psor, Relaxation, Rpgs, Rpsor, Searched};

/// A Newton method, by its function.
fn newton<V, M>(settings: &SettingsMap, visitor: V) -> Result<V::Output, String>
where
    V: Visitor<Problem: Bounded>,
    M: Method<Function: 'static>,
{
    Ok(visitor.visit(Semismooth::new(&parse::<M>(settings)?)))
}

/// The solvers that take bounds of any kind.
fn bounded_solvers<V: Visitor<Problem: Bounded>>() -> Vec<Entry<V>> {
    vec![
        Entry { about: &PROJECTED_JACOBI, build: |s, v| Ok(v.visit(Jacobi(parse(s)?))) },
        Entry { about: &PGS, build: |s, v| Ok(v.visit(Relaxation(Psor::from(parse::<Pgs>(s)?)))) },
        Entry { about: &PSOR, build: |s, v| Ok(v.visit(Relaxation(parse(s)?))) },
        Entry { about: &RPGS, build: |s, v| Ok(v.visit(Proximal(Rpsor::from(parse::<Rpgs>(s)?)))) },
        Entry { about: &RPSOR, build: |s, v| Ok(v.visit(Proximal(parse(s)?))) },
        Entry { about: &SPLITTING_LS, build: |s, v| Ok(v.visit(Searched(parse(s)?))) },
        Entry { about: &MPRGP, build: |s, v| Ok(v.visit(Proportioning(parse(s)?))) },
        Entry { about: &QP, build: |s, v| Ok(v.visit(Programmed(parse(s)?))) },
        Entry { about: &NEWTON_MIN, build: |s, v| newton::<V, NewtonMin>(s, v) },
        Entry { about: &NEWTON_FB, build: |s, v| newton::<V, NewtonFb>(s, v) },
        Entry { about: &NEWTON_PFB, build: |s, v| newton::<V, NewtonPfb>(s, v) },
        Entry { about: &ENUMERATION_EXACT, build: |s, v| Ok(v.visit(EnumerateExactly(parse(s)?))) },
    ]
}

/// The pivoting methods.
fn pivoting_solvers<V: Visitor<Problem: Complementary>>() -> Vec<Entry<V>> {
    vec![
        Entry { about: &LEMKE, build: |s, v| Ok(v.visit(LemkePath::new(parse(s)?))) },
        Entry { about: &KELLER, build: |s, v| Ok(v.visit(KellerPivoting(parse(s)?))) },
        Entry { about: &CRISS_CROSS, build: |s, v| Ok(v.visit(CrissCrossPivoting(parse(s)?))) },
        Entry { about: &MURTY, build: |s, v| Ok(v.visit(MurtyPivoting(parse(s)?))) },
        Entry { about: &BARD, build: |s, v| Ok(v.visit(BardPivoting(parse(s)?))) },
        Entry { about: &BLOCK_PIVOTING, build: |s, v| Ok(v.visit(BlockPrincipal(parse(s)?))) },
        Entry { about: &ENUMERATION, build: |s, v| Ok(v.visit(Enumerate(parse(s)?))) },
    ]
}

/// The solvers that follow pairs of variables.
fn paired_solvers<V: Visitor<Problem: Paired>>() -> Vec<Entry<V>> {
    vec![
        Entry { about: &IP_MTY, build: |s, v| Ok(v.visit(Mty(parse(s)?))) },
        Entry { about: &IP_MEHROTRA, build: |s, v| Ok(v.visit(Mehrotra(parse(s)?))) },
    ]
}

/// Those of horizontal problems.
fn horizontal_solvers<V: Visitor<Problem: Paired>>() -> Vec<Entry<V>> {
    let mut all = paired_solvers::<V>();
    all.push(Entry {
        about: &ENUMERATION_EXACT,
        build: |s, v: V| Ok(v.visit(EnumerateExactly(parse(s)?))),
    });
    all
}

/// The solvers of problems whose variables are free or nonnegative: all.
pub(super) fn complementary_solvers<V: Visitor<Problem: Complementary + Paired>>() -> Vec<Entry<V>>
{
    let mut all = bounded_solvers();
    all.extend(pivoting_solvers());
    all.extend(paired_solvers());
    all
}

/// `auto` runs whole sessions of the others, so it is one itself.
fn automatic<P: Planned>(settings: &SettingsMap) -> Result<Box<dyn Session<P>>, String> {
    Ok(Box::new(parse::<LinearAuto>(settings)?.session::<P>()))
}

/// `$prefix/solver` leads to another kind of problem by a reformulation.
macro_rules! register {
    ($kind:ty, $solvers:ident $(, $prefix:literal, $reformulation:ident, $others:ident)?) => {
        impl Registered for $kind {
            fn abouts() -> Vec<&'static About> {
                let entries = $solvers::<Direct<Self>>();
                std::iter::once(&AUTO).chain(entries.iter().map(|entry| entry.about)).collect()
            }

            fn composed_names() -> Vec<String> {
                let all: Vec<Vec<String>> = vec![$(names(
                    &$others::<Through<Self, $reformulation>>(),
                    concat!($prefix, "/"),
                ))?];
                all.concat()
            }

            fn make(name: &str, settings: &SettingsMap) -> Made<Self> {
                if name == AUTO.name {
                    return Some(automatic(settings));
                }
                $(if let Some(($prefix, solver)) = name.split_once('/') {
                    let entry = find($others::<Through<Self, _>>(), solver)?;
                    return Some((entry.build)(settings, Through($reformulation, PhantomData)));
                })?
                let entry = find($solvers::<Direct<Self>>(), name)?;
                Some((entry.build)(settings, Direct(PhantomData)))
            }
        }
    };
}

register!(Lcp, complementary_solvers);
register!(Mlcp, complementary_solvers, "reduce", Reduce, complementary_solvers);
register!(BoxLcp, bounded_solvers, "split", Split, complementary_solvers);
register!(Hlcp, horizontal_solvers, "mixed", Mixed, complementary_solvers);
