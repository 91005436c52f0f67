//! The step is taken: velocities and configuration, what is remembered, the reports of contacts and joints.

use nonsmooth_scenes::Rotation;
use nonsmooth_scenes::vec3::{Vec3, add, dot, scale};

use super::frame::frame;
use super::{Stride, Tools};
use crate::detect::Near;
use crate::moving::Moving;
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
                let joined = !self.joints.is_empty();
                let before = if joined { world.potential(state) } else { 0.0 };
                let violations = self.joints.project(world, state);
                if joined {
                    energy.potential += world.potential(state) - before;
                    let change = self.joints.project_velocities(world, state);
                    energy.kinetic += change;
                    energy.numerical -= change;
                }
                violations
            }
        };
        drift.joints = violations.iter().copied().fold(0.0, f64::max);
        self.joints.finish(world, state, &violations);
    }

    /// How far quaternions were from length one.
    fn move_bodies(&mut self, stride: Stride, state: &mut State) -> f64 {
        let Self { bodies, off, crew, .. } = self;
        let (count, t) = (stride.world.bodies.len(), state.t);
        off.resize(count, 0.0);
        let turns = (&mut state.rotation[..], (&mut state.spin[..], &mut off[..]));
        let all = (
            (&bodies[..count], &stride.world.bodies[..]),
            (&mut state.position[..], &mut state.velocity[..]),
            turns,
        );
        crew.spread(all, count, |((moving, bodies), (x, v), (rotation, (spin, off)))| {
            for (k, b) in moving.iter().enumerate() {
                off[k] = 0.0;
                if let Motion::Oscillating { amplitude, frequency, phase } = bodies[k].motion {
                    let moves = oscillation(amplitude, frequency, phase, t + stride.h);
                    (x[k], v[k]) = (add(bodies[k].position, moves.0), moves.1);
                }
                if let Motion::Uniform { velocity } = bodies[k].motion {
                    x[k] = add(bodies[k].position, scale(t + stride.h, velocity));
                    v[k] = velocity;
                }
                if b.free {
                    x[k] = add(x[k], scale(stride.h, stride.scheme.mean(b.v, b.v_new)));
                    v[k] = b.v_new;
                    off[k] = b.turn(stride, &mut rotation[k], &mut spin[k]);
                }
            }
        });
        off.iter().copied().fold(0.0, f64::max)
    }

    fn remember(&mut self, state: &mut State, h: f64) {
        let mut contacts = std::mem::take(&mut self.contacts);
        let memory = &mut state.memory;
        memory.h = h;
        let count = self.near.len();
        if let Some(near) = self.near.first() {
            let blank = self.blank(near);
            memory.contacts.resize(count, Remembered::of(near, (0, 0.0), None, &blank));
            contacts.resize(count, blank);
        } else {
            memory.contacts.clear();
            contacts.clear();
        }
        let this = &*self;
        let written = (&mut contacts[..], &mut memory.contacts[..]);
        self.crew.spread((0..count, written), count, |(numbers, (contacts, memory))| {
            for ((k, contact), remembered) in numbers.zip(contacts).zip(memory) {
                let near = &this.near[k];
                let row = this.rows.get(this.row_of[k] as usize);
                this.report(near, k, contact);
                let of = |body: u32| this.margins.get(body as usize).copied().unwrap_or(0.0);
                let known = (this.met.axes[k], of(near.a) + of(near.b));
                *remembered = Remembered::of(near, known, row, contact);
            }
        });
        self.contacts = contacts;
    }

    /// Of a point that takes no part.
    fn blank(&self, near: &Near) -> ContactReport {
        ContactReport {
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
        }
    }

    /// Writes that of point k.
    fn report(&self, near: &Near, k: usize, report: &mut ContactReport) {
        *report = self.blank(near);
        let place = self.row_of[k] as usize;
        let Some(row) = self.rows.get(place) else {
            report.frame = frame(near.place.normal, self.met.axes[k]);
            return;
        };
        report.active = true;
        (report.point, report.frame) = (row.place.point, row.frame);
        report.offset = row.offset;
        (report.impulse, report.before, report.moment) = (row.r, row.before, row.moment);
        let at = self.touching.place_of[place] as usize;
        report.after = self.stated.after(at, row, &self.bodies);
        report.rolling = row.turned;
        for arm in row.free_arms() {
            let b = &self.bodies[arm.body as usize];
            let omega = b.omega(b.spin_new);
            for k in 0..2 {
                report.rolling[k] += arm.sign * dot(row.frame_end[1 + k], omega);
            }
        }
    }
}

impl Moving {
    /// Turns a body, and writes its angular velocity; how far the quaternion was from length one.
    fn turn(
        &self,
        Stride { scheme, h, .. }: Stride,
        rotation: &mut [f64; 4],
        spin: &mut Vec3,
    ) -> f64 {
        let old = Rotation(*rotation);
        let turn = cayley(scale(h, scheme.mean(self.spin, self.spin_new)));
        let new = if self.isotropic { turn.after(old) } else { old.after(turn) };
        let length = new.0.iter().map(|x| x * x).sum::<f64>().sqrt();
        let new = unit(new);
        *rotation = new.0;
        *spin = match self.isotropic {
            true => apply_transposed(&new.matrix(), self.spin_new),
            false => self.spin_new,
        };
        (length - 1.0).abs()
    }
}
