//! The global problem by its contacts: velocity space, W never formed.
//!
//! The state keeps `v` (so that `u_c = H_cᵀ v + w_c` costs the rows that contact c touches) and `Z_c = M⁻¹ H_c`
//! (so that an impulse moves v at the same cost). `complete` recomputes v exactly, so the rounding that the
//! increments gather never reaches a judged point.

use nonsmooth_problem::linalg::{Csc, Delassus, Inverse, norm, small};
use nonsmooth_problem::{FrictionGlobal, GlobalPoint};

use super::{Blockwise, Contacts, Linear};
use crate::SolveError;

/// What the view keeps.
pub struct GlobalState<const D: usize> {
    dynamics: Inverse,
    delassus: Delassus<D>,
    /// The operators above belong to these matrices.
    m: Csc,
    h: Csc,
    g: Option<Csc>,
    q: Vec<f64>,
    scale: f64,
    v: Vec<f64>,
    /// `(v, λ)` while the dynamics are solved.
    full: Vec<f64>,
    scratch: Vec<f64>,
}

impl<const D: usize> GlobalState<D> {
    fn load(&mut self, problem: &FrictionGlobal<D>, r: &[f64]) {
        problem.load(r, &mut self.full);
        self.dynamics.solve_with(&mut self.full, &mut self.scratch);
    }

    fn update_free_velocity(&mut self, problem: &FrictionGlobal<D>) {
        self.v.fill(0.0);
        self.q.fill(0.0);
        // q serves as the zero impulse here.
        let q = std::mem::take(&mut self.q);
        self.load(problem, &q);
        self.q = q;
        problem.velocity_into(&self.full[..problem.dofs()], &mut self.q);
        let norm_q = norm(&self.q);
        self.scale = if norm_q > 0.0 { norm_q } else { 1.0 };
    }
}

impl<const D: usize> Contacts<D> for FrictionGlobal<D> {
    type State = GlobalState<D>;

    fn state(&self) -> Result<Self::State, SolveError> {
        let dynamics = self.dynamics()?;
        let delassus = Delassus::new(&self.H, &dynamics);
        let mut state = GlobalState {
            delassus,
            m: self.M.clone(),
            h: self.H.clone(),
            g: self.bilateral.as_ref().map(|b| b.G.clone()),
            q: vec![0.0; self.w.len()],
            scale: 1.0,
            v: vec![0.0; self.dofs()],
            full: vec![0.0; self.dofs() + self.multipliers()],
            scratch: vec![0.0; dynamics.scratch_len()],
            dynamics,
        };
        state.update_free_velocity(self);
        Ok(state)
    }

    fn refill(&self, state: &mut Self::State) -> Result<(), SolveError> {
        let same = state.m == self.M
            && state.h == self.H
            && state.g.as_ref() == self.bilateral.as_ref().map(|b| &b.G);
        if same {
            state.update_free_velocity(self);
        } else {
            *state = self.state()?;
        }
        Ok(())
    }

    fn mu(&self) -> &[f64] {
        &self.mu
    }

    fn diagonal_block(&self, state: &Self::State, c: usize) -> [[f64; D]; D] {
        state.delassus.diagonal_block(c)
    }

    fn velocity_scale(&self, state: &Self::State) -> f64 {
        state.scale
    }

    fn impulses(point: &mut GlobalPoint) -> &mut [f64] {
        &mut point.r
    }

    fn enter(&self, state: &mut Self::State, point: &GlobalPoint) {
        state.load(self, &point.r);
        state.v.copy_from_slice(&state.full[..self.dofs()]);
    }

    fn complete(&self, state: &mut Self::State, point: &mut GlobalPoint) {
        self.enter(state, point);
        let (v, lambda) = state.full.split_at(self.dofs());
        point.v.copy_from_slice(v);
        point.lambda.copy_from_slice(lambda);
    }
}

impl<const D: usize> Blockwise<D> for FrictionGlobal<D> {
    #[inline(always)]
    fn velocity(&self, state: &Self::State, _: &[f64], c: usize) -> [f64; D] {
        let mut u = state.delassus.local_velocity(c, &state.v);
        let w: [f64; D] = small::block(&self.w, c);
        for k in 0..D {
            u[k] += w[k];
        }
        u
    }

    #[inline(always)]
    fn moved(&self, state: &mut Self::State, c: usize, dr: &[f64; D]) {
        state.delassus.apply_impulse(c, dr, &mut state.v);
    }
}

impl<const D: usize> Linear<D> for FrictionGlobal<D> {
    fn velocities(&self, state: &mut Self::State, r: &[f64], u: &mut [f64]) {
        state.delassus.mul_plus(r, &state.q, u, &mut state.v);
    }
}

/// `(v, λ)` of a point from its impulses, by one solve with the dynamics.
pub(crate) fn recover<const D: usize>(
    problem: &FrictionGlobal<D>,
    dynamics: &Inverse,
    point: &mut GlobalPoint,
) {
    let mut full = vec![0.0; problem.dofs() + problem.multipliers()];
    problem.load(&point.r, &mut full);
    dynamics.solve(&mut full);
    let (v, lambda) = full.split_at(problem.dofs());
    point.v.copy_from_slice(v);
    point.lambda.copy_from_slice(lambda);
}
