//! What exists: the solvers of each kind of problem and what may stand before their names, and everything that is generated from that.
//!
//! The list of the complementarity wing's kinds is in that wing; contact problems are listed here, where the bridges are known.

use nonsmooth_problem::{
    FrictionGlobal, FrictionLocal, GlobalPoint, LocalPoint, RollingGlobal, RollingLocal,
};

use crate::bridges::{AsNcp, FacetInner, FacetOuter, First, Glocker};
use crate::contact::condense::Condense;
use crate::contact::form::Regularised;
use crate::contact::proximal::Proximal;
use crate::contact::solvers::{inner_rolling_solvers, inner_solvers, rolling_solvers, solvers};
use crate::contact::weigh::Weighed;

pub use crate::core::register::{
    About, Composed, DEFAULT, Described, Edge, Entry, Prefix, Registered, Solves, about, abouts,
    composed_names, prefixes, session, solver_names, solves,
};

impl Registered for FrictionLocal<2> {
    fn solvers() -> Vec<Entry<Self>> {
        solvers::<Self, 2>()
    }

    fn edges() -> Vec<Edge<Self>> {
        of_local()
    }
}

impl Registered for FrictionLocal<3> {
    fn solvers() -> Vec<Entry<Self>> {
        solvers::<Self, 3>()
    }

    fn edges() -> Vec<Edge<Self>> {
        of_local()
    }
}

impl Registered for FrictionGlobal<2> {
    fn solvers() -> Vec<Entry<Self>> {
        solvers::<Self, 2>()
    }

    fn edges() -> Vec<Edge<Self>> {
        of_global()
    }
}

impl Registered for FrictionGlobal<3> {
    fn solvers() -> Vec<Entry<Self>> {
        solvers::<Self, 3>()
    }

    fn edges() -> Vec<Edge<Self>> {
        of_global()
    }
}

impl Registered for RollingLocal {
    fn solvers() -> Vec<Entry<Self>> {
        rolling_solvers()
    }

    fn edges() -> Vec<Edge<Self>> {
        vec![Edge::new::<Weighed<Proximal<5>>>()]
    }
}

impl Registered for RollingGlobal {
    fn solvers() -> Vec<Entry<Self>> {
        rolling_solvers()
    }

    fn edges() -> Vec<Edge<Self>> {
        vec![Edge::new::<Condense>(), Edge::new::<Weighed<Proximal<5>>>()]
    }
}

/// What may stand before a solver's name on a local problem.
fn of_local<const D: usize>() -> Vec<Edge<FrictionLocal<D>>>
where
    Regularised<FrictionLocal<D>>: Registered<Point = LocalPoint>,
{
    vec![
        Edge::new::<Proximal<D>>(),
        Edge::new::<FacetInner<D>>(),
        Edge::new::<FacetOuter<D>>(),
        Edge::new::<AsNcp<First>>(),
        Edge::new::<AsNcp<Glocker>>(),
    ]
}

/// What may stand before a solver's name on a global problem.
fn of_global<const D: usize>() -> Vec<Edge<FrictionGlobal<D>>>
where
    FrictionLocal<D>: Registered,
    Regularised<FrictionGlobal<D>>: Registered<Point = GlobalPoint>,
{
    vec![Edge::new::<Condense>(), Edge::new::<Proximal<D>>()]
}

impl Registered for Regularised<FrictionLocal<2>> {
    fn solvers() -> Vec<Entry<Self>> {
        inner_solvers::<_, 2>()
    }
}

impl Registered for Regularised<FrictionLocal<3>> {
    fn solvers() -> Vec<Entry<Self>> {
        inner_solvers::<_, 3>()
    }
}

impl Registered for Regularised<FrictionGlobal<2>> {
    fn solvers() -> Vec<Entry<Self>> {
        inner_solvers::<_, 2>()
    }
}

impl Registered for Regularised<FrictionGlobal<3>> {
    fn solvers() -> Vec<Entry<Self>> {
        inner_solvers::<_, 3>()
    }
}

impl Registered for Regularised<RollingLocal> {
    fn solvers() -> Vec<Entry<Self>> {
        inner_rolling_solvers()
    }
}

impl Registered for Regularised<RollingGlobal> {
    fn solvers() -> Vec<Entry<Self>> {
        inner_rolling_solvers()
    }
}
