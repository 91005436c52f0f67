//! The step is taken: velocities and configuration, what is remembered, the reports of contacts and joints.

use nonsmooth_scenes::Rotation;
use nonsmooth_scenes::vec3::{add, dot, scale};

use super::frame::frame;
use super::{Stride, Tools};
use crate::detect::Near;
use crate::report::{ContactReport, StepReport};
use crate::rotation::{apply_transposed, cayley, unit};
use crate::state::{Remembered, State};
use crate::world::oscillation;
use crate::{BodyId, Motion, Stabilisation};

impl Tools {
    /// Says also how far quaternions were from length one, and joints are from closed.
    pub fn commit(
        &mut self,
        stride: Stride,
        state: &mut State,
        StepReport { drift, energy, counts, .. }: &mut StepReport,
    ) {
        let Stride { world, scheme, h } = stride;
        drift.quaternion = self.move_bodies(stride, state);
        self.solids.take(scheme, h, state);
        state.t += h;
        state.steps += 1;
        self.remember(state, h);
        counts.tell(&self.contacts);
        let violations = match scheme.stabilisation {
            Stabilisation::None => self.joints.violations(world, state).0,
            _ => {
                let violations = self.joints.project(world, state);
                if !self.joints.is_empty() {
                    let change = self.joints.project_velocities(world, state);
                    energy.kinetic += change;
                    energy.numerical -= change;
                }
                violations
            }
        };
        drift.joints = violations.iter().copied().fold(0.0, f64::max);
        self.joints.finish(state, &violations);
    }

    /// How far quaternions were from length one.
    fn move_bodies(&self, Stride { world, scheme, h }: Stride, state: &mut State) -> f64 {
        let mut off: f64 = 0.0;
        for (k, b) in self.bodies[..world.bodies.len()].iter().enumerate() {
            if let Motion::Oscillating { amplitude, frequency, phase } = world.bodies[k].motion {
                let (x, v) = oscillation(amplitude, frequency, phase, state.t + h);
                state.position[k] = add(world.bodies[k].position, x);
                state.velocity[k] = v;
            }
            if let Motion::Uniform { velocity } = world.bodies[k].motion {
                state.position[k] = add(world.bodies[k].position, scale(state.t + h, velocity));
                state.velocity[k] = velocity;
            }
            if !b.free {
                continue;
            }
            state.position[k] = add(state.position[k], scale(h, scheme.mean(b.v, b.v_new)));
            state.velocity[k] = b.v_new;
            let old = Rotation(state.rotation[k]);
            let turn = cayley(scale(h, scheme.mean(b.spin, b.spin_new)));
            let new = if b.isotropic { turn.after(old) } else { old.after(turn) };
            let length = new.0.iter().map(|x| x * x).sum::<f64>().sqrt();
            off = off.max((length - 1.0).abs());
            let new = unit(new);
            state.rotation[k] = new.0;
            state.spin[k] = match b.isotropic {
                true => apply_transposed(&new.matrix(), b.spin_new),
                false => b.spin_new,
            };
        }
        off
    }

    fn remember(&mut self, state: &mut State, h: f64) {
        let mut contacts = std::mem::take(&mut self.contacts);
        let memory = &mut state.memory;
        memory.h = h;
        memory.contacts.clear();
        contacts.clear();
        for (k, near) in self.near.iter().enumerate() {
            let row = self.rows.get(self.row_of[k] as usize);
            let report = self.report(near, k);
            memory.contacts.push(Remembered::of(near, self.axes[k], row, &report));
            contacts.push(report);
        }
        self.contacts = contacts;
    }

    /// Of point k.
    fn report(&self, near: &Near, k: usize) -> ContactReport {
        let place = self.row_of[k] as usize;
        let mut report = ContactReport {
            key: near.key,
            a: BodyId(self.bodies[near.a as usize].owner),
            b: BodyId(self.bodies[near.b as usize].owner),
            point: near.place.point,
            offset: near.image.offset,
            frame: [[0.0; 3]; 3],
            gap: near.place.gap,
            mu: near.law.mu,
            active: false,
            impulse: [0.0; 3],
            before: [0.0; 3],
            after: [0.0; 3],
            mu_r: near.law.mu_r,
            moment: [0.0; 2],
            rolling: [0.0; 2],
        };
        let Some(row) = self.rows.get(place) else {
            report.frame = frame(near.place.normal, self.axes[k]);
            return report;
        };
        report.active = true;
        (report.point, report.frame) = (row.place.point, row.frame);
        report.offset = row.offset;
        (report.impulse, report.before, report.moment) = (row.r, row.before, row.moment);
        report.after = self.stated.after(place, row, &self.bodies);
        report.rolling = row.turned;
        for arm in row.free_arms() {
            let b = &self.bodies[arm.body as usize];
            let omega = b.omega(b.spin_new);
            for k in 0..2 {
                report.rolling[k] += arm.sign * dot(row.frame_end[1 + k], omega);
            }
        }
        report
    }
}
