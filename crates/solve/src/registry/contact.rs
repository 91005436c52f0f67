//! Which solvers there are for frictional contact, and how each is made.

use std::marker::PhantomData;

use nonsmooth_problem::check::Kinematic;
use nonsmooth_problem::{FrictionGlobal, FrictionLocal};

use super::abouts::*;
use super::facets::{facet_names, faceted, nearly};
use super::{About, Direct, Entry, Made, Registered, Through, Visitor, find, names};
use crate::auto::Hybrid;
use crate::cfun::ContactFunction;
use crate::form::{Concurrent, Explicit, Linear, Linearised, Overwrite, Regularised};
use crate::interior::{ConvexRelaxation, Interior, Pursued, Relaxed};
use crate::newton::{
    Method as NewtonMethod, NewtonAc, NewtonCm, NewtonFb, NewtonFbSmooth, NewtonHsw, NewtonJm,
    NewtonNm, NewtonPk, NewtonXsw, Semismooth,
};
use crate::optimisation::{Alternation, CadouxSteps, TrescaSteps};
use crate::projection::{DeSaxce, Extragradient, FixedPoint, Hyperplane, Method, Projected};
use crate::proximal::{AdmmSteps, Outer, ProximalPoint};
use crate::reform::Condense;
use crate::settings::{Settings, SettingsMap, parse};
use crate::splitting::{Colored, Nsgs, Psor};
use crate::{Driver, Session, Solver};

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

/// A Newton method, by its function.
fn newton<const D: usize, V, M>(settings: &SettingsMap, visitor: V) -> Result<V::Output, String>
where
    V: Visitor,
    V::Problem: Linearised<D>,
    M: NewtonMethod + Settings,
    M::Function: ContactFunction<D> + 'static,
{
    Ok(visitor.visit(Semismooth::<M::Function, D>::new(&parse::<M>(settings)?)))
}

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
    vec![
        Entry { about: &AUTO, build: |s, v| Ok(v.visit(Hybrid::<D>(parse(s)?))) },
        Entry { about: &NSGS, build: |s, v| Ok(parse::<Nsgs>(s)?.visit::<D, V>(v)) },
        Entry { about: &NSGS_COLORED, build: |s, v| Ok(parse::<Colored>(s)?.visit::<D, V>(v)) },
        Entry { about: &PSOR, build: |s, v| Ok(v.visit(parse::<Psor>(s)?.sweeps::<D>())) },
        Entry { about: &DE_SAXCE, build: projected::<D, V, DeSaxce> },
        Entry { about: &FIXED_POINT, build: projected::<D, V, FixedPoint> },
        Entry { about: &EXTRAGRADIENT, build: projected::<D, V, Extragradient> },
        Entry { about: &HYPERPLANE, build: projected::<D, V, Hyperplane> },
        Entry { about: &ADMM, build: |s, v| Ok(v.visit(AdmmSteps::<D>(parse(s)?))) },
        Entry { about: &NEWTON_AC, build: newton::<D, V, NewtonAc> },
        Entry { about: &NEWTON_JM, build: newton::<D, V, NewtonJm> },
        Entry { about: &NEWTON_NM, build: newton::<D, V, NewtonNm> },
        Entry { about: &NEWTON_FB, build: newton::<D, V, NewtonFb> },
        Entry { about: &NEWTON_FB_SMOOTH, build: newton::<D, V, NewtonFbSmooth> },
        Entry { about: &NEWTON_CM, build: newton::<D, V, NewtonCm> },
        Entry { about: &NEWTON_XSW, build: newton::<D, V, NewtonXsw> },
        Entry { about: &NEWTON_PK, build: newton::<D, V, NewtonPk> },
        Entry { about: &NEWTON_HSW, build: newton::<D, V, NewtonHsw> },
        Entry { about: &TRESCA, build: |s, v| Ok(v.visit(TrescaSteps::<D>(parse(s)?))) },
        Entry { about: &PANAGIOTOPOULOS, build: |s, v| Ok(v.visit(Alternation::<D>(parse(s)?))) },
        Entry { about: &CADOUX, build: |s, v| Ok(v.visit(CadouxSteps::<D>(parse(s)?))) },
        Entry { about: &IP, build: |s, v| Ok(v.visit(Pursued::<D>(parse::<Interior>(s)?))) },
        Entry {
            about: &CONVEX_RELAXATION,
            build: |s, v| Ok(v.visit(Relaxed::<D>(parse::<ConvexRelaxation>(s)?))),
        },
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
        Entry { about: &NEWTON_AC, build: newton::<D, V, NewtonAc> },
        Entry { about: &NEWTON_NM, build: newton::<D, V, NewtonNm> },
        Entry { about: &NEWTON_FB, build: newton::<D, V, NewtonFb> },
    ]
}

/// The settings of the proximal point method (their keys say so), and those of its inner solver.
fn around<P, const D: usize>(solver: &str, settings: &SettingsMap) -> Made<P>
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

/// A session on a problem of contacts, but for the composed names that only some forms have.
fn contact_session<P, const D: usize>(name: &str, settings: &SettingsMap) -> Made<P>
where
    P: Concurrent<D> + Linearised<D> + Explicit<D> + Kinematic<D> + Overwrite + Send + Registered,
{
    match name.split_once('/') {
        None => {
            let entry = find(contact_solvers::<D, Direct<P>>(), name)?;
            Some((entry.build)(settings, Direct(PhantomData)))
        }
        Some(("proximal", solver)) => around::<P, D>(solver, settings),
        Some(_) => None,
    }
}

macro_rules! register {
    ($d:literal) => {
        impl Registered for FrictionLocal<$d> {
            fn abouts() -> Vec<&'static About> {
                abouts(&contact_solvers::<$d, Direct<Self>>())
            }

            fn composed_names() -> Vec<String> {
                let mut all = around_names::<Self, $d>();
                all.extend(facet_names(""));
                all
            }

            fn make(name: &str, settings: &SettingsMap) -> Made<Self> {
                faceted::<$d, _>(name, settings, Direct(PhantomData))
                    .or_else(|| contact_session::<Self, $d>(name, settings))
            }

            fn nearly(name: &str) -> bool {
                nearly::<$d>(name)
            }
        }

        impl Registered for FrictionGlobal<$d> {
            fn abouts() -> Vec<&'static About> {
                abouts(&contact_solvers::<$d, Direct<Self>>())
            }

            fn composed_names() -> Vec<String> {
                let local = contact_solvers::<$d, Direct<FrictionLocal<$d>>>();
                let mut all = names(&local, "condense/");
                all.extend(around_names::<Self, $d>());
                all.extend(facet_names("condense/"));
                all
            }

            fn make(name: &str, settings: &SettingsMap) -> Made<Self> {
                match name.split_once('/') {
                    Some(("condense", solver)) if solver.contains('/') => {
                        faceted::<$d, _>(solver, settings, Through(Condense, PhantomData))
                    }
                    Some(("condense", solver)) => {
                        let entry = find(contact_solvers::<$d, _>(), solver)?;
                        Some((entry.build)(settings, Through(Condense, PhantomData)))
                    }
                    _ => contact_session::<Self, $d>(name, settings),
                }
            }

            fn nearly(name: &str) -> bool {
                nearly::<$d>(name)
            }
        }
    };
}

register!(2);
register!(3);

fn abouts<V: Visitor>(entries: &[Entry<V>]) -> Vec<&'static About> {
    entries.iter().map(|entry| entry.about).collect()
}
