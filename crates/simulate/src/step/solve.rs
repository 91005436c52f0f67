//! The islands are solved: in each pass all that are not done are stated, solved by the crew, and looked at, in their order.

use std::time::Instant;

use nonsmooth_scenes::vec3::{Mat3, Vec3, add, apply, norm, scale, sub};
use nonsmooth_solve::Status;

use super::{Stride, Tools};
use crate::crew::{Asked, Inner};
use crate::moving::Moving;
use crate::report::{StepReport, StepStatus, worst_share};
use crate::{Geometry, SimulateError};

/// What the islands of a step have come to.
pub(super) struct Solved {
    /// That of the first island that is not solved.
    pub status: StepStatus,
    passes: u32,
    residual: f64,
    iterations: usize,
    /// Contacts of the largest island.
    largest: usize,
    /// Wall clock of the solver.
    pub seconds: f64,
}

impl Default for Solved {
    fn default() -> Self {
        let status = StepStatus::Solved;
        Self { status, passes: 0, residual: 0.0, iterations: 0, largest: 0, seconds: 0.0 }
    }
}

impl Solved {
    pub fn tell(self, report: &mut StepReport) {
        report.status = self.status;
        report.newton = self.passes;
        report.residual = self.residual;
        report.counts.iterations = self.iterations;
        report.counts.largest = self.largest;
    }
}

impl Tools {
    pub(super) fn solve(&mut self, stride: Stride, inner: &Inner) -> Result<Solved, SimulateError> {
        let count = self.islands.ends.len();
        self.stated.provide(count)?;
        self.open.clear();
        self.open.extend(0..count as u32);
        let mut solved = Solved::default();
        while !self.open.is_empty() {
            solved.passes += 1;
            let mut open = std::mem::take(&mut self.open);
            for &k in &open {
                self.ask(stride, k as usize, (solved.passes, inner));
                solved.largest = solved.largest.max(self.island.contacts.len());
            }
            let begun = Instant::now();
            self.stated.solve(&self.crew, (count, &open), inner)?;
            solved.seconds += begun.elapsed().as_secs_f64();
            let mut taken = Ok(());
            open.retain(|&k| {
                self.take_up(stride, k as usize, &mut solved).unwrap_or_else(|e| {
                    taken = Err(e);
                    false
                })
            });
            self.open = open;
            taken?;
        }
        Ok(solved)
    }

    /// States the problem of island k and says what is asked of its solver.
    fn ask(&mut self, stride: Stride, k: usize, (pass, inner): (u32, &Inner)) {
        self.gather(k);
        let finite = self.state(stride, k);
        let may_rest = pass == 1 && inner.is_auto() && self.may_rest(stride.rest());
        self.stated.ask(k, Asked { finite, may_rest, ..Asked::default() });
    }

    /// Whether the bodies of the island are slower than `rest` while most of its contacts are new, so that no impulses of the step before lead on.
    fn may_rest(&self, rest: f64) -> bool {
        let slow = |&b: &u32| {
            let b = &self.bodies[b as usize];
            norm(b.v) + norm(b.spin) * b.radius <= rest
        };
        let order = &self.island.contacts;
        let warm = order.iter().filter(|&&c| self.rows[c as usize].warm).count();
        self.island.scalars.is_empty()
            && self.island.solids.is_empty()
            && 2 * warm < order.len()
            && self.island.members.iter().all(slow)
    }

    /// Takes the impulses that the solver found for island k; whether another pass is due.
    fn take_up(
        &mut self,
        stride: Stride,
        k: usize,
        solved: &mut Solved,
    ) -> Result<bool, SimulateError> {
        let Some(outcome) = self.stated.outcome(k) else {
            solved.residual = f64::NAN;
            solved.status = StepStatus::NotFinite;
            return Ok(false);
        };
        let outcome = outcome?;
        self.gather(k);
        self.stated.copy_impulses(k, &self.island, &mut self.rows, &mut self.joints);
        let mut change = self.respond(stride);
        if stride.scheme.geometry == Geometry::Midpoint && !self.island.scalars.is_empty() {
            change = change.max(self.recentre(stride));
        }
        solved.iterations += outcome.iterations;
        let again = change > stride.scheme.tolerance || change.is_nan();
        let ended = if outcome.status != Status::Solved {
            StepStatus::Solver(outcome.status)
        } else if !again {
            StepStatus::Solved
        } else if solved.passes >= stride.scheme.passes || !change.is_finite() {
            StepStatus::NewtonLimit
        } else {
            return Ok(true);
        };
        solved.residual = f64::max(solved.residual, worst_share(&outcome.measure));
        if solved.status == StepStatus::Solved {
            solved.status = ended;
        }
        Ok(false)
    }

    /// Velocities after the step with the impulses of the island; how much solving the rotations exactly has changed them, relative.
    fn respond(&mut self, Stride { scheme, h, .. }: Stride) -> f64 {
        let Self { island, rows, bodies, solids, joints, .. } = self;
        island.solids.iter().for_each(|&k| solids.clear(k));
        for &b in &island.members {
            let b = &mut bodies[b as usize];
            (b.impulse, b.moment) = ([0.0; 3], [0.0; 3]);
        }
        for &c in &island.contacts {
            let row = &rows[c as usize];
            for arm in row.free_arms() {
                if arm.owner >= island.bodies() {
                    (0..3)
                        .for_each(|i| solids.receive(arm.body, arm.sign * row.r[i], row.frame[i]));
                    continue;
                }
                let b = &mut bodies[arm.body as usize];
                for i in 0..3 {
                    b.receive(arm.sign * row.r[i], row.frame[i], arm.moment[i]);
                }
                for k in 0..2 {
                    b.moment = add(b.moment, scale(arm.sign * row.moment[k], row.frame[1 + k]));
                }
            }
        }
        for &k in &island.scalars {
            let lambda = joints.rows[k as usize].lambda;
            for lever in joints.levers(k as usize) {
                bodies[lever.body as usize].receive(lambda, lever.force, lever.moment);
            }
        }
        for &k in &island.solids {
            solids.respond(k, |node, v| bodies[node].v_new = v);
        }
        let mut change = Share::default();
        for &b in &island.members {
            let b = &mut bodies[b as usize];
            let linear = add(b.spin_free, apply(&b.inverse, apply(&b.frame, b.moment)));
            b.rotate(scheme, h);
            change.of(norm(sub(b.spin_new, linear)) * b.radius);
            let spin = norm(b.spin).max(norm(b.spin_new)) * b.radius;
            let size = norm(b.v).max(norm(b.v_new)).max(spin);
            change.against(size.max(norm(b.push) / b.mass));
        }
        change.value()
    }

    /// Takes the joints of the island at the middle that this pass has come to; how far that has moved the bodies since the last one, relative.
    fn recentre(&mut self, Stride { scheme, world, h }: Stride) -> f64 {
        let Self { island, bodies, joints, .. } = self;
        let mut change = Share::default();
        for &k in &island.members {
            let b = &mut bodies[k as usize];
            let pose = b.mean_pose(scheme, h);
            let turned = |r: &Mat3| r.iter().flatten().map(|x| x * x).sum::<f64>().sqrt();
            let turn: Mat3 = std::array::from_fn(|i| sub(pose.r[i], b.middle.r[i]));
            change.of(norm(sub(pose.x, b.middle.x)) + b.radius * turned(&turn));
            let speed =
                norm(b.v).max(norm(b.v_new)) + norm(b.spin).max(norm(b.spin_new)) * b.radius;
            change.against(0.5 * h * (speed + norm(b.push) / b.mass));
            b.middle = pose;
        }
        joints.place_at(world, &island.scalars, |k| bodies[k as usize].middle);
        change.value()
    }
}

impl Moving {
    /// Adds a generalised impulse x along a direction with a moment about the mass centre.
    fn receive(&mut self, x: f64, direction: Vec3, moment: Vec3) {
        self.impulse = add(self.impulse, scale(x, direction));
        self.moment = add(self.moment, scale(x, moment));
    }
}

/// The largest of changes as a share of the largest of sizes; of changes one that is no number, if there is one.
struct Share {
    change: f64,
    size: f64,
}

impl Default for Share {
    fn default() -> Self {
        Self { change: 0.0, size: f64::MIN_POSITIVE }
    }
}

impl Share {
    fn of(&mut self, change: f64) {
        if change > self.change || change.is_nan() {
            self.change = change;
        }
    }

    fn against(&mut self, size: f64) {
        self.size = self.size.max(size);
    }

    fn value(&self) -> f64 {
        self.change / self.size
    }
}
