//! Which solvers there are for linear complementarity problems: one line each.

use nonsmooth_problem::{BoxLcp, Hlcp, Lcp, Mcp, Mlcp};

use crate::Boxed;
use crate::complementarity::auto::{Auto, Planned};
use crate::complementarity::form::{Bounded, Complementary, Paired};
use crate::complementarity::functions::{
    EvtushenkoPurtov, FischerBurmeister, Min, MinRho, Penalised,
};
use crate::complementarity::interior::{MehrotraType, MizunoToddYe};
use crate::complementarity::newton::{Miles, Newton, Semismooth, Smooth};
use crate::complementarity::path::PathSearch;
use crate::complementarity::pivoting::{
    Bard, BlockPivoting, CrissCross, Enumeration, EnumerationExact, Keller, Lemke, LemkeHowson,
    Murty,
};
use crate::complementarity::proximal::{Proxi, Qpcomp, Semicomp};
use crate::complementarity::quadratic::{Mprgp, NeSqp, QuadraticProgram};
use crate::complementarity::reform::{Mixed, Presolve, Reduce, Split};
use crate::complementarity::splitting::{
    Pgs, ProjectedJacobi, Psor, Rpgs, Rpsor, SplittingLs, Tnnmg,
};
use crate::core::register::{Edge, Entry, Registered};

/// The solvers that take bounds of any kind.
fn bounded<P: Bounded + 'static>() -> Vec<Entry<P>> {
    vec![
        Entry::of::<ProjectedJacobi>(),
        Entry::new(|s: Pgs| Boxed::new(Psor::from(s))),
        Entry::of::<Psor>(),
        Entry::new(|s: Rpgs| Boxed::new(Rpsor::from(s))),
        Entry::of::<Rpsor>(),
        Entry::of::<SplittingLs>(),
        Entry::of::<Tnnmg>(),
        Entry::of::<Mprgp>(),
        Entry::of::<QuadraticProgram>(),
        Entry::of::<Newton<Min>>(),
        Entry::of::<Newton<FischerBurmeister>>(),
        Entry::of::<Newton<Penalised>>(),
        Entry::of::<EnumerationExact>(),
    ]
}

fn pivoting<P: Complementary + 'static>() -> Vec<Entry<P>> {
    vec![
        Entry::of::<Lemke>(),
        Entry::of::<LemkeHowson>(),
        Entry::of::<Keller>(),
        Entry::of::<CrissCross>(),
        Entry::of::<Murty>(),
        Entry::of::<Bard>(),
        Entry::of::<BlockPivoting>(),
        Entry::of::<Enumeration>(),
    ]
}

/// The solvers that follow pairs of variables.
fn paired<P: Paired + 'static>() -> Vec<Entry<P>> {
    vec![Entry::of::<MizunoToddYe>(), Entry::of::<MehrotraType>()]
}

/// The solvers of problems whose variables are free or nonnegative: all but `auto`.
fn complementary<P: Complementary + Paired + 'static>() -> Vec<Entry<P>> {
    [bounded(), pivoting(), paired()].into_iter().flatten().collect()
}

/// `auto` runs whole sessions of the others.
fn with_auto<P: Planned>(others: Vec<Entry<P>>) -> Vec<Entry<P>> {
    let auto = Entry::session(|auto: Auto| auto.session::<P>());
    std::iter::once(auto).chain(others).collect()
}

impl Registered for Lcp {
    fn solvers() -> Vec<Entry<Self>> {
        with_auto(complementary())
    }
}

impl Registered for Mlcp {
    fn solvers() -> Vec<Entry<Self>> {
        with_auto(complementary())
    }

    fn edges() -> Vec<Edge<Self>> {
        vec![Edge::new::<Reduce>()]
    }
}

impl Registered for BoxLcp {
    fn solvers() -> Vec<Entry<Self>> {
        with_auto(bounded())
    }

    fn edges() -> Vec<Edge<Self>> {
        vec![Edge::new::<Split>()]
    }
}

impl Registered for Hlcp {
    fn solvers() -> Vec<Entry<Self>> {
        let mut solvers = paired();
        solvers.push(Entry::of::<EnumerationExact>());
        with_auto(solvers)
    }

    fn edges() -> Vec<Edge<Self>> {
        vec![Edge::new::<Mixed>()]
    }
}

impl Registered for Mcp {
    fn solvers() -> Vec<Entry<Self>> {
        vec![
            Entry::session(Auto::nonlinear),
            Entry::of::<PathSearch>(),
            Entry::of::<Miles>(),
            Entry::of::<Semismooth>(),
            Entry::of::<Smooth>(),
            Entry::of::<NeSqp>(),
            Entry::of::<Qpcomp>(),
            Entry::of::<Proxi>(),
            Entry::of::<Semicomp>(),
            Entry::of::<Newton<Min>>(),
            Entry::of::<Newton<MinRho>>(),
            Entry::of::<Newton<FischerBurmeister>>(),
            Entry::of::<Newton<Penalised>>(),
            Entry::of::<Newton<EvtushenkoPurtov>>(),
        ]
    }

    fn edges() -> Vec<Edge<Self>> {
        vec![Edge::new::<Presolve>()]
    }
}
