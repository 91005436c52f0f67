//! The islands are solved: in each pass all that are not done are stated, solved by the crew, and taken up; bodies respond to the impulses of all their contacts, each by itself.

use std::time::Instant;

use nonsmooth_linalg::budget;
use nonsmooth_scenes::vec3::{Mat3, Vec3, add, apply, norm, scale, sub};
use nonsmooth_solve::{Outcome, Status};

use super::problem::{Island, scalars};
use super::{NONE, Stride, Tools};
use crate::crew::{Inner, SMALL};
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

/// The islands that are not done, and what each of them has come to in this pass.
#[derive(Default)]
pub(super) struct Open {
    /// Their numbers, ascending, and whether an island is one of them.
    pub list: Vec<u32>,
    pub due: Vec<bool>,
    outcomes: Vec<Option<Outcome>>,
    /// Of each body, and of each island, how much solving the rotations exactly has changed their velocities.
    moved: Vec<Share>,
    changes: Vec<Share>,
}

impl Open {
    /// All of so many islands are.
    pub fn begin(&mut self, count: usize) {
        self.list.clear();
        self.list.extend(0..count as u32);
        self.due.clear();
        self.due.resize(count, true);
        self.outcomes.resize_with(count, || None);
    }
}

impl Tools {
    /// Solves all islands; nothing where the time was over before what is to be solved was stated.
    pub(super) fn solve(
        &mut self,
        stride: Stride,
        inner: &Inner,
    ) -> Result<Option<Solved>, SimulateError> {
        let count = self.islands.ends.len();
        self.stated.provide(count)?;
        self.open.begin(count);
        let sizes = (0..count).map(|k| self.touching.island(k).len());
        let mut solved = Solved { largest: sizes.max().unwrap_or(0), ..Solved::default() };
        while !self.open.list.is_empty() {
            solved.passes += 1;
            solved.seconds += self.state(stride, Some(inner));
            if budget::over() {
                return Ok(None);
            }
            for at in 0..self.open.list.len() {
                let k = self.open.list[at] as usize;
                let may_rest = solved.passes == 1
                    && inner.is_auto()
                    && self.touching.island(k).len() > SMALL
                    && self.may_rest(k, stride.rest());
                self.stated.ask(k, may_rest);
            }
            let begun = Instant::now();
            self.stated.solve(&self.crew, (count, &self.open.list), inner)?;
            solved.seconds += begun.elapsed().as_secs_f64();
            self.take_up(stride, &mut solved)?;
        }
        Ok(Some(solved))
    }

    /// Whether the bodies of island k are slower than `rest` while most of its contacts are new, so that no impulses of the step before lead on.
    fn may_rest(&mut self, k: usize, rest: f64) -> bool {
        let order = &self.touching.order[self.touching.island(k)];
        let warm = order.iter().filter(|&&c| self.rows[c as usize].warm).count();
        if 2 * warm >= order.len() {
            return false;
        }
        self.gather(k);
        let slow = |&b: &u32| {
            let b = &self.bodies[b as usize];
            norm(b.v) + norm(b.spin) * b.radius <= rest
        };
        let Island { scalars, solids, members, .. } = &self.island;
        scalars.is_empty() && solids.is_empty() && members.iter().all(slow)
    }

    /// Takes the impulses that the solver found for the open islands, and leaves open those for which another pass is due.
    fn take_up(&mut self, stride: Stride, solved: &mut Solved) -> Result<(), SimulateError> {
        let Self { stated, open, islands, touching, rows, joints, crew, .. } = self;
        for &k in &open.list {
            let outcome = stated.outcome(k as usize).transpose()?;
            if outcome.is_none() {
                (solved.residual, solved.status) = (f64::NAN, StepStatus::NotFinite);
                open.due[k as usize] = false;
            }
            open.outcomes[k as usize] = outcome;
        }
        open.list.retain(|&k| open.due[k as usize]);
        let count = rows.len();
        let all = (&islands.of_item[..count], &touching.place_of[..], &mut rows[..]);
        let (stated, due) = (&*stated, &open.due[..]);
        crew.spread(all, count, |(islands, places, rows)| {
            for ((&k, &place), row) in islands.iter().zip(places).zip(rows) {
                if due[k as usize] {
                    let c = place as usize - touching.firsts[k as usize];
                    stated.impulse(k as usize, c, row);
                }
            }
        });
        for &k in &open.list {
            let scalars = scalars(islands, count, k as usize).iter();
            for (&item, &lambda) in scalars.zip(stated.scalar_impulses(k as usize)) {
                joints.rows[item as usize - count].lambda = lambda;
            }
        }
        self.respond(stride);
        for at in 0..self.open.list.len() {
            let k = self.open.list[at] as usize;
            let mut change = self.open.changes[k].value();
            if stride.scheme.geometry == Geometry::Midpoint
                && !scalars(&self.islands, count, k).is_empty()
            {
                self.gather(k);
                change = change.max(self.recentre(stride));
            }
            let Some(outcome) = self.open.outcomes[k].take() else { continue };
            solved.iterations += outcome.iterations;
            let again = change > stride.scheme.tolerance || change.is_nan();
            let ended = if outcome.status != Status::Solved {
                StepStatus::Solver(outcome.status)
            } else if !again {
                StepStatus::Solved
            } else if solved.passes >= stride.scheme.passes || !change.is_finite() {
                StepStatus::NewtonLimit
            } else {
                continue;
            };
            self.open.due[k] = false;
            solved.residual = f64::max(solved.residual, worst_share(&outcome.measure));
            if solved.status == StepStatus::Solved {
                solved.status = ended;
            }
        }
        let Open { list, due, .. } = &mut self.open;
        list.retain(|&k| due[k as usize]);
        Ok(())
    }

    /// Velocities after the step with the impulses of the open islands; how much solving the rotations exactly has changed them, relative.
    fn respond(&mut self, Stride { scheme, h, world }: Stride) {
        let Self { islands, touching, rows, bodies, solids, joints, open, crew, .. } = self;
        let Open { list, due, moved, changes, .. } = open;
        let (rows, contacts, free) = (&rows[..], rows.len(), world.bodies.len());
        let is_due = |k: u32| k != NONE && due[k as usize];
        let (of_body, of_solid) = islands.of_body.split_at(free);
        let all = (0..free, of_body, &mut bodies[..free]);
        crew.spread(all, contacts, |(numbers, islands, bodies)| {
            let due = numbers.zip(islands).zip(bodies).filter(|((_, k), _)| is_due(**k));
            for ((number, _), b) in due {
                (b.impulse, b.moment) = ([0.0; 3], [0.0; 3]);
                for (place, side) in touching.of(number as u32) {
                    let row = &rows[touching.order[place] as usize];
                    let arm = &row.arms[side];
                    for i in 0..3 {
                        b.receive(arm.sign * row.r[i], row.frame[i], arm.moment[i]);
                    }
                    for k in (0..2).filter(|_| row.mu_r > 0.0) {
                        b.moment = add(b.moment, scale(arm.sign * row.moment[k], row.frame[1 + k]));
                    }
                }
            }
        });
        for (solid, _) in of_solid.iter().enumerate().filter(|k| is_due(*k.1)) {
            let solid = solid as u32;
            solids.clear(solid);
            for (place, side) in touching.of(free as u32 + solid) {
                let row = &rows[touching.order[place] as usize];
                let arm = &row.arms[side];
                (0..3).for_each(|i| solids.receive(arm.body, arm.sign * row.r[i], row.frame[i]));
            }
            solids.respond(solid, |node, v| bodies[node].v_new = v);
        }
        for &k in &*list {
            for &item in scalars(islands, contacts, k as usize) {
                let k = item as usize - contacts;
                for lever in joints.levers(k) {
                    let lambda = joints.rows[k].lambda;
                    bodies[lever.body as usize].receive(lambda, lever.force, lever.moment);
                }
            }
        }
        moved.resize(free, Share::default());
        let all = (of_body, &mut bodies[..free], &mut moved[..]);
        crew.spread(all, contacts, |(islands, bodies, moved)| {
            let due = islands.iter().zip(bodies).zip(moved).filter(|((k, _), _)| is_due(**k));
            for ((_, b), moved) in due {
                let linear = add(b.spin_free, apply(&b.inverse, apply(&b.frame, b.moment)));
                b.rotate(scheme, h);
                let spin = norm(b.spin).max(norm(b.spin_new)) * b.radius;
                let size = norm(b.v).max(norm(b.v_new)).max(spin);
                *moved = Share {
                    change: norm(sub(b.spin_new, linear)) * b.radius,
                    size: size.max(norm(b.push) / b.mass),
                };
            }
        });
        changes.clear();
        changes.resize(due.len(), Share::default());
        for (&k, moved) in of_body.iter().zip(moved).filter(|m| is_due(*m.0)) {
            changes[k as usize].of(moved.change);
            changes[k as usize].against(moved.size);
        }
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
#[derive(Clone, Copy)]
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
