//! Rolling friction in units of velocity: a length for each contact turns its angular velocities and moments into velocities and impulses.
//!
//! With the arm ℓ_c and `D_c = diag(1, 1, 1, ℓ_c, ℓ_c)` the problem in `u' = D u`, `r = D r'` has `W' = D W D`, `q' = D q`, `mu_r' = mu_r/ℓ_c`, and
//! is of the same form. The arm is `√(tr W_TT/tr W_RR)`, that of a ball on a plane √1.4 of its radius, rounded to a power of two: then nothing else is rounded, and the
//! two problems are the same problem in other units. Residuals are those of the problem in u'.

use super::contact::{Law, length};
use super::gauge::{LawGauge, verdict};
use crate::check::{Measure, Verdict};
use nonsmooth_linalg::{norm, power_of_two, small};

/// A contact problem that can be stated in units of velocity: `u' = D u`, `r = D r'` with `D_c = diag(1, 1, 1, ℓ_c, ℓ_c)`, a change of units without any rounding.
pub trait Weighed: Sized {
    /// ℓ_c, a power of two, of each contact; nothing without rolling friction.
    fn arms(&self) -> Option<Vec<f64>>;

    /// The problem in u'. Cost: a copy.
    fn weighed(&self, arms: &[f64]) -> Self;

    /// `r' = D⁻¹ r` in place of r; of velocities `u = D⁻¹ u'`.
    fn weigh(arms: &[f64], r: &mut [f64]);

    /// `r = D r'` in place of r'; of velocities `u' = D u`.
    fn unweigh(arms: &[f64], r: &mut [f64]);
}

/// The arm from the traces of the blocks of the tangents and of rolling.
pub(crate) fn arm(tangential: f64, rolling: f64) -> f64 {
    let ratio = tangential / rolling;
    if ratio > 0.0 && ratio.is_finite() { power_of_two(ratio.sqrt()) } else { 1.0 }
}

/// The weight of row i of contacts of D rows.
pub(crate) fn weight<const D: usize>(arms: &[f64], i: usize) -> f64 {
    if i % D > (D - 1) / 2 { arms[i / D] } else { 1.0 }
}

/// `x_i ← x_i weight_i`.
pub(crate) fn multiply<const D: usize>(arms: &[f64], x: &mut [f64]) {
    x.iter_mut().enumerate().for_each(|(i, x)| *x *= weight::<D>(arms, i));
}

/// `x_i ← x_i/weight_i`.
pub(crate) fn divide<const D: usize>(arms: &[f64], x: &mut [f64]) {
    x.iter_mut().enumerate().for_each(|(i, x)| *x /= weight::<D>(arms, i));
}

/// The residuals that other codes report of the problem as it is given, in place of those in u'.
pub(crate) fn as_given<L: Law<D>, const D: usize>(
    measure: &mut Measure,
    (r, u, q): (&[f64], &[f64], f64),
    law: impl Fn(usize) -> L,
) {
    let map = (0..r.len() / D).map(|c| {
        let (r, u) = (small::block::<D>(r, c), small::block::<D>(u, c));
        length(&law(c).natural_map(&r, &law(c).modified_velocity(&u))).powi(2)
    });
    let map = map.sum::<f64>().sqrt();
    let over = |size: f64| if size > 0.0 { map / size } else { map };
    measure.literature = over(q);
    measure.siconos = over(q.max(norm(r)).max(norm(u)));
}

/// The verdict on impulses r and velocities u' that have been measured, in units of velocity; with the velocities as the problem is given.
pub(crate) fn verdict_weighed<P: Weighed, L: Law<D>, const D: usize>(
    problem: &P,
    law: impl Fn(&P, usize) -> L,
    measure: Measure,
    gauge: &LawGauge,
    (r, u): (&[f64], &[f64]),
    tolerance: f64,
) -> Verdict {
    let Some(arms) = problem.arms() else {
        return verdict::<L, D>(measure, gauge, r, u, |c| law(problem, c), tolerance);
    };
    let weighed = problem.weighed(&arms);
    let mut r = r.to_vec();
    divide::<D>(&arms, &mut r);
    let mut found = verdict::<L, D>(measure, gauge, &r, u, |c| law(&weighed, c), tolerance);
    divide::<D>(&arms, &mut found.velocity);
    found
}
