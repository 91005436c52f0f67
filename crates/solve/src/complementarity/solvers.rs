//! Which solvers there are for linear complementarity problems: one line each.

use nonsmooth_problem::{BoxLcp, Hlcp, Lcp, Mlcp};

use crate::Boxed;
use crate::complementarity::auto::LinearAuto;
use crate::complementarity::form::{Bounded, Complementary, Paired};
use crate::complementarity::interior::{Mehrotra, Mty};
use crate::complementarity::newton::{Method, NewtonFb, NewtonMin, NewtonPfb, Semismooth};
use crate::complementarity::pivoting::{
    BardPivoting, BlockPrincipal, CrissCrossPivoting, Enumerate, EnumerateExactly, KellerPivoting,
    LemkePath, MurtyPivoting,
};
use crate::complementarity::quadratic::{Programmed, Proportioning};
use crate::complementarity::reform::{Mixed, Reduce, Split};
use crate::complementarity::splitting::{
    Jacobi, Pgs, Proximal, Psor, Relaxation, Rpgs, Rpsor, Searched,
};
use crate::core::register::{Described, Edge, Entry, Registered};

/// A Newton method, by its function.
fn newton<P: Bounded + 'static, M: Method<Function: 'static> + Described>() -> Entry<P> {
    Entry::new(|method: M| Boxed::new(Semismooth::new(&method)))
}

/// The solvers that take bounds of any kind.
fn bounded<P: Bounded + 'static>() -> Vec<Entry<P>> {
    vec![
        Entry::new(|s| Boxed::new(Jacobi(s))),
        Entry::new(|s: Pgs| Boxed::new(Relaxation(Psor::from(s)))),
        Entry::new(|s| Boxed::new(Relaxation(s))),
        Entry::new(|s: Rpgs| Boxed::new(Proximal(Rpsor::from(s)))),
        Entry::new(|s| Boxed::new(Proximal(s))),
        Entry::new(|s| Boxed::new(Searched(s))),
        Entry::new(|s| Boxed::new(Proportioning(s))),
        Entry::new(|s| Boxed::new(Programmed(s))),
        newton::<P, NewtonMin>(),
        newton::<P, NewtonFb>(),
        newton::<P, NewtonPfb>(),
        Entry::new(|s| Boxed::new(EnumerateExactly(s))),
    ]
}

/// The pivoting methods.
fn pivoting<P: Complementary + 'static>() -> Vec<Entry<P>> {
    vec![
        Entry::new(|s| Boxed::new(LemkePath::new(s))),
        Entry::new(|s| Boxed::new(KellerPivoting(s))),
        Entry::new(|s| Boxed::new(CrissCrossPivoting(s))),
        Entry::new(|s| Boxed::new(MurtyPivoting(s))),
        Entry::new(|s| Boxed::new(BardPivoting(s))),
        Entry::new(|s| Boxed::new(BlockPrincipal(s))),
        Entry::new(|s| Boxed::new(Enumerate(s))),
    ]
}

/// The solvers that follow pairs of variables.
fn paired<P: Paired + 'static>() -> Vec<Entry<P>> {
    vec![Entry::new(|s| Boxed::new(Mty(s))), Entry::new(|s| Boxed::new(Mehrotra(s)))]
}

/// The solvers of problems whose variables are free or nonnegative: all but `auto`.
fn complementary<P: Complementary + Paired + 'static>() -> Vec<Entry<P>> {
    [bounded(), pivoting(), paired()].into_iter().flatten().collect()
}

/// `auto` runs whole sessions of the others.
fn with_auto<P: crate::complementarity::auto::Planned>(others: Vec<Entry<P>>) -> Vec<Entry<P>> {
    let auto = Entry::session(|auto: LinearAuto| auto.session::<P>());
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
        solvers.push(Entry::new(|s| Boxed::new(EnumerateExactly(s))));
        with_auto(solvers)
    }

    fn edges() -> Vec<Edge<Self>> {
        vec![Edge::new::<Mixed>()]
    }
}
