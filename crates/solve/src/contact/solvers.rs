//! Which solvers there are for frictional contact: one line each.

use nonsmooth_problem::check::Kinematic;

use crate::contact::auto::Auto;
use crate::contact::form::{
    Concurrent, Disked, Explicit, Frictional, Linear, Linearised, OnContacts, Parted, Regularised,
};
use crate::contact::interior::{ConvexRelaxation, Interior};
use crate::contact::law::Rolling;
use crate::contact::law::cfun::{
    AlartCurnier, ChenMangasarian, FischerBurmeister, HueberStadlerWohlmuth, JeanMoreau,
    NaturalMap, ParkKwak, SmoothedFischerBurmeister, XuewenSohWanji,
};
use crate::contact::newton::Newton;
use crate::contact::optimisation::{Cadoux, Panagiotopoulos, Tresca};
use crate::contact::projection::{
    DeSaxce, Extragradient, FixedPoint, Hyperplane, Method, Projected,
};
use crate::contact::proximal::Admm;
use crate::contact::splitting::{Colored, Nsgs, Psor};
use crate::contact::weigh::Weigh;
use crate::core::reformulation::Reformulation;
use crate::core::register::{Described, Entry};
use crate::{Boxed, Solver};

/// A method that is its hyperparameters.
fn on<P, S, const D: usize>() -> Entry<P>
where
    P: Linear<D> + Disked<D> + 'static,
    S: Described + 'static,
    OnContacts<S, D>: Solver<P, Work: 'static>,
{
    Entry::new(|method: S| Boxed::new(OnContacts(method)))
}

fn projected<P, M, const D: usize>() -> Entry<P>
where
    P: Linear<D> + Disked<D> + 'static,
    M: Method + Described + 'static,
{
    Entry::new(|method: M| Boxed::new(Projected::<M, D>(method)))
}

/// The solvers of problems that can be seen by their contacts.
pub fn solvers<P, const D: usize>() -> Vec<Entry<P>>
where
    P: Concurrent<D>
        + Frictional<D>
        + Linearised<D>
        + Explicit<D>
        + Kinematic<D>
        + Parted<D>
        + Send
        + 'static,
{
    vec![
        on::<P, Auto, D>(),
        Entry::new(Nsgs::boxed::<P, D>),
        Entry::new(Colored::boxed::<P, D>),
        Entry::new(|s: Psor| Boxed::new(s.sweeps::<D>())),
        projected::<P, DeSaxce, D>(),
        projected::<P, FixedPoint, D>(),
        projected::<P, Extragradient, D>(),
        projected::<P, Hyperplane, D>(),
        on::<_, Admm, D>(),
        on::<P, Newton<AlartCurnier>, D>(),
        on::<P, Newton<JeanMoreau>, D>(),
        on::<P, Newton<NaturalMap>, D>(),
        on::<P, Newton<FischerBurmeister>, D>(),
        on::<P, Newton<SmoothedFischerBurmeister>, D>(),
        on::<P, Newton<ChenMangasarian>, D>(),
        on::<P, Newton<XuewenSohWanji>, D>(),
        on::<P, Newton<ParkKwak>, D>(),
        on::<P, Newton<HueberStadlerWohlmuth>, D>(),
        on::<P, Tresca, D>(),
        on::<P, Panagiotopoulos, D>(),
        on::<P, Cadoux, D>(),
        on::<P, Interior, D>(),
        on::<P, ConvexRelaxation, D>(),
    ]
}

/// The solvers of problems with rolling friction: those whose method is any cone's, or any of disks. They see the problem in units of velocity ([`Weigh`]).
pub fn rolling_solvers<P>() -> Vec<Entry<P>>
where
    P: Concurrent<5>
        + Disked<5, Law = Rolling>
        + Linearised<5>
        + Kinematic<5>
        + Parted<5>
        + Send
        + 'static,
    Weigh: Reformulation<P, To = P>,
{
    let solvers = vec![
        on::<P, Auto, 5>(),
        Entry::new(Nsgs::rolling::<P, 5>),
        Entry::new(Colored::rolling::<P, 5>),
        Entry::new(|s: Psor| Boxed::new(s.sweeps::<5>())),
        projected::<P, DeSaxce, 5>(),
        projected::<P, FixedPoint, 5>(),
        projected::<P, Extragradient, 5>(),
        projected::<P, Hyperplane, 5>(),
        on::<P, Newton<AlartCurnier>, 5>(),
        on::<P, Newton<JeanMoreau>, 5>(),
        on::<P, Newton<NaturalMap>, 5>(),
        on::<P, Interior, 5>(),
    ];
    solvers.into_iter().map(|entry| entry.behind(Weigh)).collect()
}

/// Those of them that the proximal point method may have inside.
pub fn inner_rolling_solvers<P>() -> Vec<Entry<Regularised<P>>>
where
    P: Concurrent<5> + Disked<5, Law = Rolling> + Linearised<5> + 'static,
{
    vec![
        Entry::new(Nsgs::rolling::<Regularised<P>, 5>),
        projected::<_, Extragradient, 5>(),
        on::<_, Newton<AlartCurnier>, 5>(),
        on::<_, Newton<NaturalMap>, 5>(),
    ]
}

/// The solvers that the proximal point method may have inside: those that gain from a regular W.
pub fn inner_solvers<P, const D: usize>() -> Vec<Entry<Regularised<P>>>
where
    P: Concurrent<D> + Frictional<D> + Linearised<D> + 'static,
    Regularised<P>: Concurrent<D> + Frictional<D> + Linearised<D>,
{
    vec![
        Entry::new(Nsgs::boxed::<Regularised<P>, D>),
        projected::<_, Extragradient, D>(),
        on::<_, Admm, D>(),
        on::<_, Newton<AlartCurnier>, D>(),
        on::<_, Newton<NaturalMap>, D>(),
        on::<_, Newton<FischerBurmeister>, D>(),
    ]
}
