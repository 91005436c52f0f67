//! The energy of a step by terms.
//!
//! ```text
//! T⁺ − T_k = v_θ · (h F_θ + H r + G λ) − (θ − ½) ‖v⁺ − v_k‖²_M + ½ ‖v⁺‖²_{M(q⁺) − M} + ½ ‖v_k‖²_{M − M(q_k)},     M = M(q_*).
//! ```
//!
//! The last two are what the change of M takes; with the work of the terms of F that are squares of velocities they vanish up to O(h³), and both are counted as
//! work of forces.

use super::gradients::dot;
use super::state::LagrangianState;
use super::step::{Motion, Tools};
use super::{Lagrangian, LagrangianScheme};
use crate::EnergyBalance;

impl<const D: usize> Tools<D> {
    /// The balance of the step from `state` to the motion found.
    pub fn energy<L: Lagrangian<D> + ?Sized>(
        &mut self,
        system: &L,
        scheme: &LagrangianScheme,
        state: &LagrangianState,
        h: f64,
    ) -> EnergyBalance {
        let theta = scheme.theta;
        let Self { motion: m, matrices, lines, .. } = self;
        let mut e = EnergyBalance {
            kinetic_before: matrices.kinetic(system, &state.q, &state.v),
            kinetic: matrices.kinetic(system, &m.end, &m.v),
            potential: system.potential(state.t + h, &m.end),
            ..EnergyBalance::default()
        };
        let inertia = (e.kinetic - matrices.half_square(&m.v))
            - (e.kinetic_before - matrices.half_square(&state.v));
        let Motion { v, drive, push: mean, residual: change, .. } = m;
        let both = || v.iter().zip(&state.v);
        mean.clear();
        mean.extend(both().map(|(new, old)| theta * new + (1.0 - theta) * old));
        change.clear();
        change.extend(both().map(|(new, old)| new - old));
        let work = dot(mean, drive);
        e.forces = work + inertia;
        e.numerical = 2.0 * (theta - 0.5) * matrices.half_square(change);
        e.scale = e.kinetic_before + e.kinetic + e.numerical + work.abs() + inertia.abs();
        for (k, line) in lines.lines.iter().enumerate() {
            let rate = dot(lines.now.line(line.index), mean);
            let drive = line.given_mean * line.impulse;
            let work = rate * line.impulse + drive;
            e.scale += work.abs() + drive.abs();
            if k >= D * lines.touching.len() {
                e.joints += rate * line.impulse;
                continue;
            }
            e.drives -= drive;
            if k % D == 0 {
                e.normal += work;
            } else {
                e.tangential += work;
            }
        }
        let all = e.forces + e.normal + e.tangential + e.drives + e.joints;
        e.imbalance = e.kinetic - e.kinetic_before - (all - e.numerical);
        e
    }
}
