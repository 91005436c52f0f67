//! Which solvers there are for frictional contact: one line each.

use nonsmooth_problem::check::Kinematic;

use crate::contact::auto::Auto;
use crate::contact::form::{
    Concurrent, Explicit, Frictional, Linear, Linearised, OnContacts, Regularised,
};
use crate::contact::interior::{ConvexRelaxation, Interior};
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
use crate::core::register::{Described, Entry};
use crate::{Boxed, Solver};

/// A method that is its hyperparameters.
fn on<P, S, const D: usize>() -> Entry<P>
where
    P: Linear<D> + Frictional<D> + 'static,
    S: Described + 'static,
    OnContacts<S, D>: Solver<P, Work: 'static>,
{
    Entry::new(|method: S| Boxed::new(OnContacts(method)))
}

fn projected<P, M, const D: usize>() -> Entry<P>
where
    P: Linear<D> + Frictional<D> + 'static,
    M: Method + Described + 'static,
{
    Entry::new(|method: M| Boxed::new(Projected::<M, D>(method)))
}

/// The solvers of problems that can be seen by their contacts.
pub fn solvers<P, const D: usize>() -> Vec<Entry<P>>
where
    P: Concurrent<D> + Frictional<D> + Linearised<D> + Explicit<D> + Kinematic<D> + 'static,
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

/// The solvers that the proximal point method may have inside: those that gain from a regular W.
pub fn inner_solvers<P, const D: usize>() -> Vec<Entry<Regularised<P>>>
where
    P: Concurrent<D> + Frictional<D> + Linearised<D> + 'static,
    Regularised<P>: Concurrent<D> + Linearised<D>,
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
