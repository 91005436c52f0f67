//! Global → local: `W = Hᵀ M⁻¹ H`, `q = Hᵀ M⁻¹ f + w`.
//!
//! The velocities are eliminated, and with them the bilateral constraints: `M⁻¹` stands for the velocity part of
//! `[M, −G; Gᵀ, 0]⁻¹`, so the local problem has none. The way back recovers `(v, λ)` from r by one solve.
//!
//! Source: Acary, lecture (2)–(9). Cost: D solves per contact, then one product per pair of contacts that share
//! a component of M. Storage: W. Fails where M is singular.

use nonsmooth_problem::linalg::{Delassus, Inverse};
use nonsmooth_problem::{FrictionGlobal, FrictionLocal, GlobalPoint, LocalPoint, Problem};

use super::Reformulation;
use crate::SolveError;

/// The condensation of a global problem.
#[derive(Debug, Clone, Copy, Default)]
pub struct Condense;

/// The factorised dynamics.
pub struct CondenseMemo {
    dynamics: Inverse,
}

impl<const D: usize> Reformulation<FrictionGlobal<D>> for Condense {
    type To = FrictionLocal<D>;
    type Memo = CondenseMemo;

    fn reduce(
        &self,
        problem: &FrictionGlobal<D>,
    ) -> Result<(FrictionLocal<D>, CondenseMemo), SolveError> {
        let dynamics = problem.dynamics()?;
        let mut origin = problem.origin();
        let memo = CondenseMemo { dynamics };
        memo.recover(problem, &mut origin);
        let mut q = origin.r;
        problem.velocity_into(&origin.v, &mut q);
        let delassus = Delassus::<D>::new(&problem.H, &memo.dynamics);
        let local = FrictionLocal::new(delassus.condense(), q, problem.mu.clone())?;
        Ok((local, memo))
    }

    fn lower(&self, _: &FrictionGlobal<D>, point: &GlobalPoint, _: &CondenseMemo) -> LocalPoint {
        LocalPoint { r: point.r.clone(), lambda: vec![] }
    }

    fn lift(
        &self,
        problem: &FrictionGlobal<D>,
        reduced: &LocalPoint,
        memo: &CondenseMemo,
        point: &mut GlobalPoint,
    ) {
        point.r.clone_from(&reduced.r);
        memo.recover(problem, point);
    }
}

impl CondenseMemo {
    /// `(v, λ)` from r through the dynamics.
    fn recover<const D: usize>(&self, problem: &FrictionGlobal<D>, point: &mut GlobalPoint) {
        crate::form::recover(problem, &self.dynamics, point);
    }
}
