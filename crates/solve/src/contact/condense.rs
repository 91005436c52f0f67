//! Global → local: `W = Hᵀ M⁻¹ H`, `q = Hᵀ M⁻¹ f + w`.
//!
//! The velocities are eliminated, and with them the bilateral constraints: `M⁻¹` stands for the velocity part of
//! `[M, −G; Gᵀ, 0]⁻¹`, so the local problem has none. The way back recovers `(v, λ)` from r by one solve.
//!
//! Source: Acary, lecture (2)–(9). Cost: D solves per contact, then one product per pair of contacts that share
//! a component of M. Storage: W. Fails where M is singular.

use nonsmooth_linalg::{Csc, Delassus, budget};
use nonsmooth_problem::check::{Certificate, Impulses};
use nonsmooth_problem::{Dynamics, FrictionGlobal, FrictionLocal, GlobalPoint, LocalPoint};

use crate::SolveError;
use crate::core::reformulation::Reformulation;
use crate::core::register::{Composed, Prefix};
use crate::core::settings::NoSettings;
use crate::{Boxed, Via};
use nonsmooth_problem::Kind;

/// The condensation of a global problem.
#[derive(Debug, Clone, Copy, Default)]
pub struct Condense;

impl<const D: usize> Composed<FrictionGlobal<D>> for Condense
where
    FrictionLocal<D>: crate::core::register::Registered,
{
    type To = FrictionLocal<D>;
    type Settings = NoSettings;
    const PREFIX: &'static Prefix = &Prefix {
        name: "condense",
        summary: "global to local: forms W = H' M^-1 H and q, bilateral constraints eliminated",
        from: &[Kind::FrictionGlobal2d, Kind::FrictionGlobal3d],
        cites: &["Acary2018"],
        settings: Vec::new,
    };

    fn compose(_: NoSettings, solver: Boxed<Self::To>) -> Boxed<FrictionGlobal<D>> {
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

impl<const D: usize> Reformulation<FrictionGlobal<D>> for Condense {
    type To = FrictionLocal<D>;
    type Memo = CondenseMemo;

    fn reduce(
        &self,
        problem: &FrictionGlobal<D>,
    ) -> Result<(FrictionLocal<D>, CondenseMemo), SolveError> {
        let mut dynamics = Dynamics::new(problem)?;
        let mut q = vec![0.0; problem.w.len()];
        let contradiction = dynamics.free_velocity(problem, &mut q); //                                  q = Hᵀ M⁻¹ f + w
        let bytes = Delassus::<D>::condensed_bytes(&problem.H, &dynamics.inverse);
        budget::admit("the condensed W", bytes)?;
        let w = Delassus::condense(&problem.H, &dynamics.inverse); //                W = Hᵀ M⁻¹ H
        let local = FrictionLocal::new(w, q, problem.mu.clone())?;
        Ok((local, CondenseMemo { dynamics, h: problem.H.clone(), contradiction }))
    }

    fn reduce_again(
        &self,
        problem: &FrictionGlobal<D>,
        reduced: &mut FrictionLocal<D>,
        memo: &mut CondenseMemo,
    ) -> Result<(), SolveError> {
        if memo.dynamics.serves(problem) && memo.h == problem.H {
            memo.contradiction = memo.dynamics.free_velocity(problem, &mut reduced.q);
            reduced.mu.clone_from(&problem.mu);
            reduced.validate()?;
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
        _: &FrictionGlobal<D>,
        point: &GlobalPoint,
        _: &CondenseMemo,
        reduced: &mut LocalPoint,
    ) {
        reduced.r.clone_from(&point.r);
    }

    fn lift(
        &self,
        problem: &FrictionGlobal<D>,
        reduced: &LocalPoint,
        memo: &mut CondenseMemo,
        point: &mut GlobalPoint,
    ) {
        point.r.clone_from(&reduced.r);
        memo.dynamics.complete(problem, point);
    }
}
