//! Which solvers there are for linear complementarity problems, and how each is made.

use std::marker::PhantomData;

use nonsmooth_problem::{BoxLcp, Hlcp, Lcp, Mlcp};

use super::linear_abouts::*;
use super::{About, Direct, Entry, Made, Registered, Visitor, find};
use crate::Session;
use crate::auto::linear::{LinearAuto, Planned};
use crate::form::{Bounded, Complementary, Paired};
use crate::interior::linear::{Mehrotra, Mty};
use crate::optimisation::linear::Programmed;
use crate::settings::{SettingsMap, parse};
use crate::splitting::linear::Jacobi;

/// The solvers that take bounds of any kind.
fn bounded_solvers<V: Visitor<Problem: Bounded>>() -> Vec<Entry<V>> {
    vec![
        Entry { about: &PROJECTED_JACOBI, build: |s, v| Ok(v.visit(Jacobi(parse(s)?))) },
        Entry { about: &QP, build: |s, v| Ok(v.visit(Programmed(parse(s)?))) },
    ]
}

/// The solvers of problems whose variables are free or nonnegative.
fn complementary_solvers<V: Visitor<Problem: Complementary + Paired>>() -> Vec<Entry<V>> {
    let mut all = bounded_solvers();
    all.extend(paired_solvers());
    all
}

/// The solvers that follow pairs of variables.
fn paired_solvers<V: Visitor<Problem: Paired>>() -> Vec<Entry<V>> {
    vec![
        Entry { about: &IP_MTY, build: |s, v| Ok(v.visit(Mty(parse(s)?))) },
        Entry { about: &IP_MEHROTRA, build: |s, v| Ok(v.visit(Mehrotra(parse(s)?))) },
    ]
}

/// The solvers of horizontal problems.
fn horizontal_solvers<V: Visitor<Problem = Hlcp>>() -> Vec<Entry<V>> {
    paired_solvers()
}

/// `auto` runs whole sessions of the others, so it is one itself.
fn automatic<P: Planned>(settings: &SettingsMap) -> Result<Box<dyn Session<P>>, String> {
    Ok(Box::new(parse::<LinearAuto>(settings)?.session::<P>()))
}

macro_rules! register {
    ($kind:ty, $solvers:ident) => {
        impl Registered for $kind {
            fn abouts() -> Vec<&'static About> {
                let entries = $solvers::<Direct<Self>>();
                std::iter::once(&AUTO).chain(entries.iter().map(|entry| entry.about)).collect()
            }

            fn composed_names() -> Vec<String> {
                vec![]
            }

            fn make(name: &str, settings: &SettingsMap) -> Made<Self> {
                if name == AUTO.name {
                    return Some(automatic(settings));
                }
                let entry = find($solvers::<Direct<Self>>(), name)?;
                Some((entry.build)(settings, Direct(PhantomData)))
            }
        }
    };
}

register!(Lcp, complementary_solvers);
register!(Mlcp, complementary_solvers);
register!(BoxLcp, bounded_solvers);
register!(Hlcp, horizontal_solvers);
