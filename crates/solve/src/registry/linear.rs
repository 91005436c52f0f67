//! Which solvers there are for linear complementarity problems, and how each is made.

use std::marker::PhantomData;

use nonsmooth_problem::{BoxLcp, Hlcp, Lcp, Mlcp};

use super::linear_abouts::*;
use super::{About, Direct, Entry, Made, Registered, Through, Visitor, find, names};
use crate::Session;
use crate::auto::linear::{LinearAuto, Planned};
use crate::form::{Bounded, Complementary};
use crate::newton::linear::{Method, NewtonFb, NewtonMin, NewtonPfb, Semismooth};
use crate::reform::{Mixed, Reduce, Split};
use crate::settings::{SettingsMap, parse};
use crate::splitting::linear::Jacobi;

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
        Entry { about: &NEWTON_MIN, build: |s, v| newton::<V, NewtonMin>(s, v) },
        Entry { about: &NEWTON_FB, build: |s, v| newton::<V, NewtonFb>(s, v) },
        Entry { about: &NEWTON_PFB, build: |s, v| newton::<V, NewtonPfb>(s, v) },
    ]
}

/// The solvers of problems whose variables are free or nonnegative.
fn complementary_solvers<V: Visitor<Problem: Complementary>>() -> Vec<Entry<V>> {
    bounded_solvers()
}

/// The solvers of horizontal problems.
fn horizontal_solvers<V: Visitor<Problem = Hlcp>>() -> Vec<Entry<V>> {
    vec![]
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
