//! Gauss–Seidel on scalar rows with bounds: `−c_j ∈ N_[l_j, u_j](λ_j)`, one row at a time, all other impulses frozen.
//!
//! Method: `λ_j ← P_[l_j, u_j](λ_j − ω c_j/w_j)`, `w_j = ∂c_j/∂λ_j`: projected SOR (Cryer1971; Acary, lecture (107) for contacts). It is exact for the row with ω = 1
//! and `w_j > 0`. A row that its own impulse does not move, because bilateral rows determine its velocity, goes to the bound that this velocity asks for: friction in a joint whose motion
//! is prescribed.
//!
//! Cost: one pass over the rows' velocities and what they do; nothing is allocated.

use crate::contact::form::{Rows, has_bounds};

/// Puts the impulses of rows with bounds between these, so that a sweep may begin.
pub fn put_within_bounds<P: Rows<D>, const D: usize>(problem: &P, point: &mut P::Point) {
    let (_, lambda) = P::all_impulses(point);
    if let Some(bounds) = problem.bounds() {
        for j in bounds.bounded() {
            let [l, u] = bounds.of(j);
            lambda[j] = lambda[j].clamp(l, u);
        }
    }
}

/// The impulse within the bounds that a row asks for, which has `lambda`, moves at c and by w for a unit impulse; relaxed by ω.
pub fn asked([l, u]: [f64; 2], lambda: f64, c: f64, w: f64, omega: f64) -> f64 {
    if w > 0.0 {
        return (lambda - omega * c / w).clamp(l, u);
    }
    let bound = match c {
        c if c > 0.0 => l,
        c if c < 0.0 => u,
        _ => lambda,
    };
    if bound.is_finite() { bound } else { lambda }
}

/// One sweep over the rows with bounds, relaxed by ω; returns `Σ (w_j Δλ_j)²`, with `c_j²` of a row that moves and whose impulse does not move it.
pub fn sweep_rows<P: Rows<D>, const D: usize>(
    problem: &P,
    state: &mut P::State,
    (r, lambda): (&[f64], &mut [f64]),
    omega: f64,
) -> f64 {
    let Some(bounds) = problem.bounds().filter(|_| has_bounds(problem)) else { return 0.0 };
    let mut moves = 0.0;
    for j in bounds.bounded() {
        let w = problem.row_response(state, j);
        let (old, c) = (lambda[j], problem.row_velocity(state, r, lambda, j));
        let new = asked(bounds.of(j), old, c, w, omega);
        if new != old {
            lambda[j] = new;
            problem.row_moved(state, j, new - old);
            moves += if w > 0.0 { w * (new - old) } else { c }.powi(2);
        }
    }
    moves
}
