//! Motions into the dual cone by Gauss–Seidel: the relaxation `K* ∋ u − τ e_N ⟂ r ∈ K` is convex, and its velocities come
//! within τ of K* + τ e_N, that is into K*, after a few sweeps.

use nonsmooth_linalg::small::block;
use nonsmooth_problem::check::{Kinematic, Kinematics};

use super::{Clock, Found};
use crate::contact::form::{Access, Blockwise, Disked};
use crate::contact::law::ContactLaw;
use crate::contact::law::cone::ConvexSet;

/// The margins τ that are tried, in units of the largest free velocity.
const MARGINS: [f64; 3] = [1.0, 1e-2, 1e-4];
/// Sweeps between two looks at all velocities.
const LOOK: usize = 5;

/// A verified motion, or a verified contradiction of bilateral constraints, if found within `sweeps` for each margin.
pub(super) fn approach<P: Blockwise<D> + Disked<D> + Kinematic<D>, const D: usize>(
    problem: &P,
    kinematics: &Kinematics<D>,
    sweeps: usize,
    clock: &Clock,
) -> Option<Found> {
    let verified = |motion: Vec<f64>| {
        let margin = kinematics.margin(&motion)?;
        Some(Found::Motion(motion, margin))
    };
    if let Some(still) = verified(vec![0.0; kinematics.rows.nrows()]) {
        return Some(still);
    }
    let mut state = problem.state(Access::Visits).ok()?;
    if let Some(certificate) = problem.contradiction(&state) {
        let certificate = certificate.clone();
        let refutes = kinematics.refutes(&certificate);
        return refutes.then_some(Found::Contradiction(certificate));
    }
    let mut point = problem.origin();
    problem.enter(&mut state, &point);
    let nc = problem.contacts();
    let mut largest = 0.0_f64;
    for c in 0..nc {
        let u = problem.velocity(&state, P::impulses(&mut point), c);
        largest = u.iter().fold(largest, |m, u| m.max(u.abs()));
    }
    let unit = if largest > 0.0 { largest } else { 1.0 };
    let bounds: Vec<f64> = (0..nc).map(|c| row_sum(&problem.diagonal_block(&state, c))).collect();
    for margin in MARGINS {
        for sweep in 0..=sweeps {
            if sweep.is_multiple_of(LOOK) {
                let r = P::impulses(&mut point);
                let inside = |c: usize| {
                    let u: [f64; D] = problem.velocity(&state, r, c);
                    u[0] - problem.law(c).shift(&u) > 0.0
                };
                if (0..nc).all(inside) {
                    problem.complete(&mut state, &mut point);
                    if let Some(found) = verified(P::motion(&point)) {
                        return Some(found);
                    }
                    problem.enter(&mut state, &point);
                }
                if clock.over() {
                    return None;
                }
            }
            for c in 0..nc {
                let (law, bound) = (problem.law(c), bounds[c]);
                if bound <= 0.0 {
                    continue;
                }
                let r = P::impulses(&mut point);
                let mut u: [f64; D] = problem.velocity(&state, r, c);
                u[0] -= margin * unit;
                let old: [f64; D] = block(r, c);
                let step: [f64; D] = std::array::from_fn(|k| old[k] - u[k] / bound);
                let new = law.project(&step);
                let moved: [f64; D] = std::array::from_fn(|k| new[k] - old[k]);
                if moved.iter().any(|&d| d != 0.0) {
                    r[D * c..D * c + D].copy_from_slice(&new);
                    problem.moved(&mut state, c, &moved);
                }
            }
        }
    }
    None
}

/// The largest row sum of absolute values: at least the spectral radius.
fn row_sum<const D: usize>(w: &[[f64; D]; D]) -> f64 {
    w.iter().map(|row| row.iter().map(|x| x.abs()).sum()).fold(0.0, f64::max)
}
