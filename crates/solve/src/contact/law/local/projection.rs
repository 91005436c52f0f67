//! One frictional contact by projection: `r ← P_K(r − ρ (u + mu‖u_T‖ e_N))`, `u = W r + q`.
//!
//! [`Projection`] takes one such step a visit with `ρ = 1/‖W‖`; [`ProjectionIterated`] repeats it until the contact is solved,
//! with ρ adapted by Khobotov's rule (`ρ‖F(r) − F(r̄)‖ ≤ 0.9‖r − r̄‖`).
//!
//! Source: DeSaxceFeng1991; Acary, lecture (105)–(109); Khobotov1987. Cost: about 40 flops a step. A single step
//! per visit converges slowly when the block is badly conditioned, and may not at all for large mu.

use super::{LocalSolver, modified_velocity, norm_bound};
use crate::contact::law::ContactLaw;

/// One projection step a visit.
#[derive(Debug, Clone, Copy)]
pub struct Projection {
    /// The step in units of `1/‖W‖`.
    pub step: f64,
}

impl Default for Projection {
    fn default() -> Self {
        Self { step: 1.0 }
    }
}

/// Projection steps until the contact is solved.
#[derive(Debug, Clone, Copy)]
pub struct ProjectionIterated {
    /// At most this many steps a visit.
    pub steps: usize,
    /// The residual in units of velocity below which it stops; 0: to rounding.
    pub tolerance: f64,
}

impl Default for ProjectionIterated {
    fn default() -> Self {
        Self { steps: 100, tolerance: 0.0 }
    }
}

impl<L: ContactLaw<D>, const D: usize> LocalSolver<D, L> for Projection {
    type Memo = f64;

    fn prepare(&self, w: &[[f64; D]; D], _: L) -> f64 {
        self.step * step_length(w)
    }

    #[inline(always)]
    fn solve(
        &self,
        rho: &mut f64,
        w: &[[f64; D]; D],
        q: &[f64; D],
        law: L,
        r: &[f64; D],
    ) -> [f64; D] {
        projected(r, &modified_velocity(w, q, law, r), *rho, law)
    }
}

impl<L: ContactLaw<D>, const D: usize> LocalSolver<D, L> for ProjectionIterated {
    type Memo = f64;

    fn tolerate(&mut self, velocity: f64) {
        self.tolerance = velocity;
    }

    fn prepare(&self, w: &[[f64; D]; D], _: L) -> f64 {
        step_length(w)
    }

    fn solve(
        &self,
        rho: &mut f64,
        w: &[[f64; D]; D],
        q: &[f64; D],
        law: L,
        r: &[f64; D],
    ) -> [f64; D] {
        let distance =
            |x: &[f64; D], y: &[f64; D]| (0..D).map(|k| (x[k] - y[k]).powi(2)).sum::<f64>().sqrt();
        let mut r = *r;
        let mut f = modified_velocity(w, q, law, &r);
        for _ in 0..self.steps {
            let (next, f_next, ratio) = loop {
                let next = projected(&r, &f, *rho, law);
                let f_next = modified_velocity(w, q, law, &next);
                let ratio = *rho * distance(&f, &f_next) / distance(&r, &next);
                // A NaN (no movement) is accepted, and ends the outer loop below; so is what no shorter step would mend, where numbers are too large for their squares.
                if !(ratio > 0.9 && ratio.is_finite() && *rho > f64::MIN_POSITIVE) {
                    break (next, f_next, ratio);
                }
                *rho *= 2.0 / 3.0;
            };
            let moved = distance(&r, &next);
            (r, f) = (next, f_next);
            if moved <= (4.0 * f64::EPSILON * distance(&r, &[0.0; D])).max(*rho * self.tolerance) {
                break;
            }
            if ratio < 0.3 {
                *rho *= 1.5;
            }
        }
        r
    }
}

fn step_length<const D: usize>(w: &[[f64; D]; D]) -> f64 {
    let bound = norm_bound(w);
    if bound > 0.0 { 1.0 / bound } else { 1.0 }
}

#[inline(always)]
fn projected<L: ContactLaw<D>, const D: usize>(
    r: &[f64; D],
    f: &[f64; D],
    rho: f64,
    law: L,
) -> [f64; D] {
    let mut x = *r;
    for k in 0..D {
        x[k] -= rho * f[k];
    }
    law.project(&x)
}
