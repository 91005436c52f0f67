//! Where every joule of a step went, and what else its report counts.

use nonsmooth_scenes::vec3::{Vec3, add, dot, norm, scale, sub};

use super::contact::Row;
use super::{Stride, Tools};
use crate::moving::Moving;
use crate::report::{EnergyBalance, StepReport};
use crate::state::State;

/// Bodies and contacts are summed by so many, and then the sums: any number of threads rounds as one does.
const SUMMED: usize = 256;

impl Tools {
    pub(super) fn energy(&mut self, stride: Stride, state: &State) -> EnergyBalance {
        let scheme = stride.scheme;
        let Self { bodies, rows, crew, sums, .. } = self;
        let free = state.position.len();
        let (bodies, rows) = (&bodies[..], &rows[..]);
        // v_θ and ω_θ.
        let mean = |body: u32| {
            let b = &bodies[body as usize];
            (scheme.mean(b.v, b.v_new), b.omega(scheme.mean(b.spin, b.spin_new)))
        };
        let count = free.max(rows.len());
        let parts = count.div_ceil(SUMMED);
        sums.clear();
        sums.resize(parts, EnergyBalance::default());
        crew.spread((0..parts, &mut sums[..]), count, |(numbers, sums)| {
            for (k, e) in numbers.zip(sums) {
                let of = |all: usize| all.min(SUMMED * k)..all.min(SUMMED * (k + 1));
                let own = bodies[of(free)].iter().zip(&state.position[of(free)]);
                own.filter(|b| b.0.free).for_each(|(b, &x)| e.add_body(b, x, stride));
                for row in &rows[of(rows.len())] {
                    e.add_contact(row, row.arms.each_ref().map(|arm| mean(arm.body)));
                }
            }
        });
        let mut e = sums.iter().fold(EnergyBalance::default(), |e, part| e.and(part));
        self.solids.energy(stride, state, &mut e);
        for (k, row) in self.joints.rows.iter().enumerate() {
            for lever in self.joints.levers(k) {
                let (v, omega) = mean(lever.body);
                let work = row.lambda * (dot(lever.force, v) + dot(lever.moment, omega));
                e.joints += work;
                e.scale += work.abs();
            }
        }
        e.scale += e.kinetic_before + e.kinetic + e.numerical;
        let work = e.gravity + e.forces + e.normal + e.tangential + e.drives + e.joints;
        e.imbalance = e.kinetic - e.kinetic_before - (work - e.numerical);
        e
    }

    pub(super) fn count(&self, report: &mut StepReport) {
        let counts = &mut report.counts;
        let (mut deep, mut deepest) = (0, 0.0_f64);
        for near in &self.near {
            deep += usize::from(near.deep);
            deepest = deepest.max(-near.place.gap);
        }
        counts.near = self.near.len();
        counts.deep = deep;
        counts.active = self.rows.len();
        counts.islands = self.islands.ends.len();
        counts.rows = self.joints.rows.len();
        counts.warm = self.rows.iter().filter(|row| row.warm).count();
        report.drift.penetration = deepest;
    }
}

impl EnergyBalance {
    /// The sum with that of other bodies and contacts.
    fn and(self, other: &Self) -> Self {
        Self {
            kinetic_before: self.kinetic_before + other.kinetic_before,
            kinetic: self.kinetic + other.kinetic,
            potential: self.potential + other.potential,
            gravity: self.gravity + other.gravity,
            forces: self.forces + other.forces,
            normal: self.normal + other.normal,
            tangential: self.tangential + other.tangential,
            drives: self.drives + other.drives,
            joints: self.joints + other.joints,
            numerical: self.numerical + other.numerical,
            imbalance: self.imbalance + other.imbalance,
            scale: self.scale + other.scale,
        }
    }

    /// A free body at x: its kinetic and potential energy, and the work of what is given.
    fn add_body(&mut self, b: &Moving, x: Vec3, Stride { world, scheme, h }: Stride) {
        let (v, spin) = (scheme.mean(b.v, b.v_new), scheme.mean(b.spin, b.spin_new));
        self.kinetic_before += b.kinetic(b.v, b.spin);
        self.kinetic += b.kinetic(b.v_new, b.spin_new);
        let (dv, ds) = (sub(b.v_new, b.v), sub(b.spin_new, b.spin));
        self.numerical += 2.0 * (scheme.theta - 0.5) * b.kinetic(dv, ds);
        let gravity = h * dot(b.weight, v);
        let given = sub(b.push, scale(h, b.weight));
        let forces = dot(given, v) + dot(b.twist, b.omega(spin));
        self.gravity += gravity;
        self.forces += forces;
        self.potential -= b.mass * dot(world.gravity, add(x, scale(h, v)));
        let fall = h * norm(world.gravity);
        self.scale += gravity.abs() + forces.abs() + 0.5 * b.mass * fall * fall;
    }

    /// The work of a contact on its bodies, with their v_θ and ω_θ, and of what moves the others.
    fn add_contact(&mut self, row: &Row, motion: [(Vec3, Vec3); 2]) {
        let free = || row.arms.iter().zip(motion).filter(|a| a.0.free);
        for i in 0..3 {
            let given = row.given_mean[i];
            let u = free().fold(given, |u, (arm, (v, omega))| u + row.rate(arm, i, v, omega));
            let work = u * row.r[i];
            match i {
                0 => self.normal += work,
                _ => self.tangential += work,
            }
            self.take_from_drives(given * row.r[i], work);
        }
        if row.mu_r == 0.0 {
            return;
        }
        for k in 0..2 {
            let turn = free().map(|(arm, (_, omega))| arm.sign * dot(row.frame[1 + k], omega));
            let given = row.turned_mean[k] * row.moment[k];
            let work = given + row.moment[k] * turn.sum::<f64>();
            self.tangential += work;
            self.take_from_drives(given, work);
        }
    }

    /// What is given belongs to drives.
    fn take_from_drives(&mut self, given: f64, work: f64) {
        self.drives -= given;
        self.scale += work.abs() + given.abs();
    }
}
