//! The global problem by its contacts: velocity space, W never formed.
//!
//! Contact by contact, the state keeps `v` (so that `u_c = H_cᵀ v + w_c` costs the rows that contact c touches) and
//! `Z_c = M⁻¹ H_c` (so that an impulse moves v at the same cost). Products with W are one solve,
//! `Hᵀ M⁻¹ (H r + f) + w`, and need no Z. `complete` recomputes v exactly, so the rounding that the increments
//! gather never reaches a judged point.

use nonsmooth_problem::check::Certificate;
use nonsmooth_problem::linalg::{Block, Csc, Delassus, Refine, small};
use nonsmooth_problem::{Dynamics, FrictionGlobal, GlobalPoint};

use super::{Access, Blockwise, Concurrent, Contacts, Linear, velocity_scale};
use crate::SolveError;

/// What the view keeps.
pub struct GlobalState<const D: usize> {
    dynamics: Dynamics,
    operator: Operator<D>,
    /// The operator belongs to this H.
    h: Csc,
    q: Vec<f64>,
    scale: f64,
    v: Vec<f64>,
    contradiction: Option<Certificate>,
}

/// What a family's access to W needs beside the dynamics.
enum Operator<const D: usize> {
    /// Visits contact by contact: Z.
    Visits(Delassus<D>),
    /// Products with all of W: the diagonal blocks alone.
    Products(Vec<Block<D>>),
}

impl<const D: usize> GlobalState<D> {
    fn update_free_velocity(&mut self, problem: &FrictionGlobal<D>) {
        self.contradiction = self.dynamics.free_velocity(problem, &mut self.q);
        self.scale = velocity_scale(&self.q);
    }
}

impl<const D: usize> Contacts<D> for FrictionGlobal<D> {
    type State = GlobalState<D>;

    fn state(&self, access: Access) -> Result<Self::State, SolveError> {
        let dynamics = Dynamics::new(self)?;
        let inverse = &dynamics.inverse;
        let mut state = GlobalState {
            operator: match access {
                Access::Visits => Operator::Visits(Delassus::new(&self.H, inverse)),
                Access::Products => Operator::Products(Delassus::diagonal(&self.H, inverse)),
            },
            h: self.H.clone(),
            q: vec![0.0; self.w.len()],
            scale: 1.0,
            v: vec![0.0; self.dofs()],
            contradiction: None,
            dynamics,
        };
        state.update_free_velocity(self);
        Ok(state)
    }

    fn refill(&self, state: &mut Self::State) -> Result<(), SolveError> {
        if state.dynamics.serves(self) && state.h == self.H {
            state.update_free_velocity(self);
        } else {
            let access = match state.operator {
                Operator::Visits(_) => Access::Visits,
                Operator::Products(_) => Access::Products,
            };
            *state = self.state(access)?;
        }
        Ok(())
    }

    fn contradiction<'a>(&self, state: &'a Self::State) -> Option<&'a Certificate> {
        state.contradiction.as_ref()
    }

    fn mu(&self) -> &[f64] {
        &self.mu
    }

    fn diagonal_block(&self, state: &Self::State, c: usize) -> [[f64; D]; D] {
        match &state.operator {
            Operator::Visits(delassus) => *delassus.diagonal_block(c),
            Operator::Products(diagonal) => diagonal[c],
        }
    }

    fn velocity_scale(&self, state: &Self::State) -> f64 {
        state.scale
    }

    fn impulses(point: &mut GlobalPoint) -> &mut [f64] {
        &mut point.r
    }

    fn enter(&self, state: &mut Self::State, point: &GlobalPoint) {
        let (v, _) = state.dynamics.solve(self, &point.r, Refine::Once);
        state.v.copy_from_slice(v);
    }

    fn complete(&self, state: &mut Self::State, point: &mut GlobalPoint) {
        state.dynamics.complete(self, point);
        state.v.copy_from_slice(&point.v);
    }
}

impl<const D: usize> Operator<D> {
    #[inline(always)]
    fn visits(&self) -> &Delassus<D> {
        match self {
            Operator::Visits(delassus) => delassus,
            Operator::Products(_) => unreachable!("a state for products is not visited"),
        }
    }
}

impl<const D: usize> Blockwise<D> for FrictionGlobal<D> {
    #[inline(always)]
    fn velocity(&self, state: &Self::State, _: &[f64], c: usize) -> [f64; D] {
        let mut u = state.operator.visits().local_velocity(c, &state.v);
        let w: [f64; D] = small::block(&self.w, c);
        for k in 0..D {
            u[k] += w[k];
        }
        u
    }

    #[inline(always)]
    fn moved(&self, state: &mut Self::State, c: usize, dr: &[f64; D]) {
        state.operator.visits().apply_impulse(c, dr, &mut state.v);
    }
}

impl<const D: usize> Concurrent<D> for FrictionGlobal<D> {
    /// Places are the components of M (with bilateral constraints: of the bordered matrix): `M⁻¹ H_c` reaches all of a component.
    fn places(&self, state: &Self::State, c: usize, reads: &mut Vec<u32>, writes: &mut Vec<u32>) {
        let first = reads.len();
        for k in D * c..D * c + D {
            for &i in self.H.column(k).0 {
                let component = state.dynamics.inverse.component_of(i) as u32;
                if !reads[first..].contains(&component) {
                    reads.push(component);
                }
            }
        }
        writes.extend_from_slice(&reads[first..]);
    }
}

impl<const D: usize> Linear<D> for FrictionGlobal<D> {
    fn velocities(&self, state: &mut Self::State, r: &[f64], u: &mut [f64]) {
        let (v, _) = state.dynamics.solve(self, r, Refine::Once);
        self.velocity_into(v, u);
    }
}
