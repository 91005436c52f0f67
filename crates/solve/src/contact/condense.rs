//! Global → local: `W = Hᵀ M⁻¹ H`, `q = Hᵀ M⁻¹ f + w`.
//!
//! The velocities are eliminated, and with them the bilateral constraints: `M⁻¹` stands for the velocity part of
//! `[M, −G; Gᵀ, 0]⁻¹`, so the local problem has none. Of the scalar rows those with bounds stay: `V = Hᵀ M⁻¹ G`, `R = Gᵀ M⁻¹ G`,
//! `s = Gᵀ M⁻¹ f + b`. The way back recovers `(v, λ)` from r, and the λ of those rows, by one solve.
//!
//! Source: Acary, lecture (5). Cost: D solves per contact, then one product per pair of contacts that share
//! a component of M. Storage: W. Fails where M is singular.

use nonsmooth_linalg::{Csc, Delassus, Refine, budget};
use nonsmooth_problem::check::{Certificate, Impulses};
use nonsmooth_problem::{
    Bounds, Dynamics, FrictionGlobal, FrictionLocal, GlobalPoint, LocalPoint, RowsLocal,
};

use crate::SolveError;
use crate::contact::law::DiskLaw;
use crate::core::reformulation::Reformulation;
use crate::core::register::{Composed, Over, Registered};
use crate::core::settings::NoSettings;
use crate::{Boxed, Via, ViaSession};
use nonsmooth_problem::Kind;

/// The condensation of a global problem.
#[derive(Debug, Clone, Copy, Default)]
pub struct Condense;

impl<const D: usize, L: DiskLaw<D>> Composed<FrictionGlobal<D, L>> for Condense
where
    FrictionLocal<D, L>: Registered,
{
    type To = FrictionLocal<D, L>;
    type Settings = NoSettings;
    const NAME: &'static str = "condense";
    const SUMMARY: &'static str =
        "global to local: forms W = H' M^-1 H and q, bilateral constraints eliminated";
    const FROM: &'static [Kind] =
        &[Kind::FrictionGlobal2d, Kind::FrictionGlobal3d, Kind::RollingGlobal3d];
    const CITES: &'static [&'static str] = &["Acary2018"];

    const SESSION: Option<Over<NoSettings, FrictionLocal<D, L>, FrictionGlobal<D, L>>> =
        Some(|_, session| Box::new(ViaSession::new(Self, session)));

    fn compose(_: NoSettings, solver: Boxed<Self::To>) -> Boxed<FrictionGlobal<D, L>> {
        Boxed::new(Via { reformulation: Condense, solver })
    }

    /// The proximal point method takes global problems as they are.
    fn lists(solver: &str) -> bool {
        !solver.starts_with("proximal/")
    }
}

/// The factorised dynamics, and the H that W was formed with.
pub struct CondenseMemo {
    dynamics: Dynamics,
    h: Csc,
    contradiction: Option<Impulses>,
}

impl<const D: usize, L: DiskLaw<D>> Reformulation<FrictionGlobal<D, L>> for Condense {
    type To = FrictionLocal<D, L>;
    type Memo = CondenseMemo;

    fn reduce(
        &self,
        problem: &FrictionGlobal<D, L>,
    ) -> Result<(FrictionLocal<D, L>, CondenseMemo), SolveError> {
        let mut dynamics = Dynamics::new(problem)?;
        let mut q = vec![0.0; problem.w.len()];
        let contradiction = dynamics.free_velocity(problem, &mut q); //                                  q = Hᵀ M⁻¹ f + w
        let bytes = Delassus::<D>::condensed_bytes(&problem.H, &dynamics.inverse);
        budget::admit("the condensed W", bytes)?;
        let w = Delassus::condense(&problem.H, &dynamics.inverse); //                W = Hᵀ M⁻¹ H
        let rows = rows(problem, &mut dynamics);
        let (mu, mu_r) = (problem.mu.clone(), problem.mu_r.clone());
        let local = FrictionLocal { W: w, q, mu, mu_r, rows };
        checked(&local)?;
        Ok((local, CondenseMemo { dynamics, h: problem.H.clone(), contradiction }))
    }

    fn reduce_again(
        &self,
        problem: &FrictionGlobal<D, L>,
        reduced: &mut FrictionLocal<D, L>,
        memo: &mut CondenseMemo,
    ) -> Result<(), SolveError> {
        if memo.dynamics.serves(problem) && memo.h == problem.H {
            memo.contradiction = memo.dynamics.free_velocity(problem, &mut reduced.q);
            reduced.mu.clone_from(&problem.mu);
            reduced.mu_r.clone_from(&problem.mu_r);
            reduced.rows = rows(problem, &mut memo.dynamics);
            checked(reduced)?;
        } else {
            (*reduced, *memo) = self.reduce(problem)?;
        }
        Ok(())
    }

    fn contradiction(&self, memo: &CondenseMemo) -> Option<Certificate> {
        memo.contradiction.clone().map(Certificate::from)
    }

    fn lower(
        &self,
        problem: &FrictionGlobal<D, L>,
        point: &GlobalPoint,
        _: &CondenseMemo,
        reduced: &mut LocalPoint,
    ) {
        reduced.r.clone_from(&point.r);
        reduced.lambda.clear();
        reduced.lambda.extend(bounded(problem).map(|j| point.lambda[j]));
    }

    fn lift(
        &self,
        problem: &FrictionGlobal<D, L>,
        reduced: &LocalPoint,
        memo: &mut CondenseMemo,
        point: &mut GlobalPoint,
    ) {
        point.r.clone_from(&reduced.r);
        bounded(problem).zip(&reduced.lambda).for_each(|(j, x)| point.lambda[j] = *x);
        memo.dynamics.complete(problem, point);
    }
}

/// Bilateral constraints that nothing touches leave an empty problem, which is solved.
fn checked<const D: usize, L: DiskLaw<D>>(reduced: &FrictionLocal<D, L>) -> Result<(), SolveError> {
    if reduced.contacts() + reduced.multipliers() > 0 {
        reduced.validate()?;
    }
    Ok(())
}

/// The rows with bounds.
fn bounded<const D: usize, L: DiskLaw<D>>(
    problem: &FrictionGlobal<D, L>,
) -> impl Iterator<Item = usize> + '_ {
    problem.rows.iter().flat_map(|b| b.bounds.bounded())
}

/// The rows with bounds as the local problem states them, if there are any.
#[allow(non_snake_case)]
fn rows<const D: usize, L: DiskLaw<D>>(
    problem: &FrictionGlobal<D, L>,
    dynamics: &mut Dynamics,
) -> Option<RowsLocal> {
    let b = problem.rows.as_ref().filter(|b| !b.bounds.are_free())?;
    let which: Vec<usize> = bounded(problem).collect();
    let (mut v, mut r) = (vec![], vec![]);
    for (k, &j) in which.iter().enumerate() {
        let response = dynamics.respond_to_row(problem, j);
        let of = |a: &Csc, i: usize| a.column_dot(i, response);
        v.extend((0..problem.w.len()).map(|i| (i, k, of(&problem.H, i))));
        r.extend(which.iter().enumerate().map(|(l, &i)| (l, k, of(&b.G, i))));
    }
    let there = |e: &(usize, usize, f64)| e.2 != 0.0;
    let matrix = |rows: usize, entries: Vec<_>| {
        let entries = entries.into_iter().filter(there);
        Csc::from_triplets(rows, which.len(), entries).expect("in range")
    };
    // Without impulses, those of the rows included.
    dynamics.hold(&vec![0.0; b.b.len()]);
    let (free, _) = dynamics.solve(problem, &vec![0.0; problem.w.len()], Refine::Fully);
    let s = which.iter().map(|&j| b.G.column_dot(j, free) + b.b[j]).collect();
    let [lower, upper] =
        [0, 1].map(|side| which.iter().map(|&j| b.bounds.of(j)[side]).collect::<Vec<f64>>());
    let (V, R) = (matrix(problem.w.len(), v), matrix(which.len(), r));
    Some(RowsLocal { V, R, s, bounds: Bounds { lower, upper } })
}
