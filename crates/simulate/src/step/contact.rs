//! From points where bodies are near to contacts of the index set: which take part, along which directions, with which law.

use nonsmooth_scenes::vec3::{Vec3, add, cross, dot, norm, scale, sub};

use super::frame::{apart, frame, tangent_axis, transported};
use super::memory::{Met, recall};
use super::{NONE, Stride, Tools};
use crate::cut::Cut;
use crate::detect::{Key, Near, Place};
use crate::moving::Moving;
use crate::restitution::Restitution;
use crate::rotation::Pose;
use crate::state::{Remembered, State};
use crate::{Activation, Compliance, Dimension, Geometry, Impact};

/// Directions that differ by less are the same, relative.
const SAME: f64 = 1e-13;
/// A point that runs farther over its body from the middle of a step to the end, as a share of the smaller body, is at the middle for velocities too.
const RUNS: f64 = 0.05;

/// One side of a contact.
#[derive(Debug, Clone, Copy, Default)]
pub(super) struct Arm {
    pub body: u32,
    /// The body or elastic solid that it belongs to.
    pub owner: u32,
    pub sign: f64,
    pub free: bool,
    /// `(p − x) × d` in the world frame, for impulses and for velocities.
    pub moment: [Vec3; 3],
    pub moment_end: [Vec3; 3],
}

/// A contact of the index set.
#[derive(Debug, Clone, Copy, Default)]
pub(super) struct Row {
    pub mu: f64,
    /// What a normal impulse gives way by, over it.
    pub compliance: f64,
    pub place: Place,
    /// From the first body to the image of it that touches, where impulses act, m.
    pub offset: Vec3,
    /// Directions of impulses and of velocities.
    pub frame: [Vec3; 3],
    pub frame_end: [Vec3; 3],
    /// Whether velocities are taken elsewhere than impulses.
    pub later: bool,
    pub arms: [Arm; 2],
    /// Velocity of what is moved, along the directions: at the end of the step (in the law), and weighted by θ (in the energy).
    pub given: [f64; 3],
    pub given_mean: [f64; 3],
    /// The same at the end of the step, along the directions of impulses.
    given_middle: [f64; 3],
    /// Relative velocity at the beginning.
    pub before: [f64; 3],
    /// What the law adds to u⁺.
    pub shift: [f64; 3],
    restitution: Restitution,
    pub r: [f64; 3],
    /// Of rolling friction: the coefficient, the moments, the given angular velocity of what is moved, in the law and in the energy, and what the law adds to u_R⁺.
    pub mu_r: f64,
    pub moment: [f64; 2],
    pub turned: [f64; 2],
    pub turned_mean: [f64; 2],
    pub turned_shift: [f64; 2],
    pub warm: bool,
}

impl Row {
    /// The arms on bodies that move freely.
    pub fn free_arms(&self) -> impl Iterator<Item = &Arm> {
        self.arms.iter().filter(|a| a.free)
    }

    /// The bodies and elastic solids that it acts on, with [`NONE`] for one that does not move freely.
    pub fn free_owners(&self) -> [u32; 2] {
        self.arms.each_ref().map(|a| if a.free { a.owner } else { NONE })
    }

    /// What velocities v and ω of an arm's body make along direction i of the impulses.
    pub fn rate(&self, arm: &Arm, i: usize, v: Vec3, omega: Vec3) -> f64 {
        arm.sign * (dot(self.frame[i], v) + dot(arm.moment[i], omega))
    }

    /// Takes velocities where impulses are.
    fn at_the_middle(&mut self) {
        self.later = false;
        self.frame_end = self.frame;
        self.given = self.given_middle;
        self.arms.iter_mut().for_each(|a| a.moment_end = a.moment);
    }
}

/// The velocity of the second body relative to the first one at the beginning of a step, where they are near.
fn sliding([a, b]: [&Moving; 2], Near { place, image, .. }: &Near) -> Vec3 {
    let of_a = add(a.velocity_at(sub(place.point, image.offset)), image.velocity);
    sub(b.velocity_at(place.point), of_a)
}

/// A point where two bodies are near, at the beginning of a step.
struct Meeting<'a> {
    stride: Stride<'a>,
    near: &'a Near,
    known: Option<&'a Remembered>,
    bodies: [&'a Moving; 2],
    /// The velocity of the gap.
    approach: f64,
}

impl<'a> Meeting<'a> {
    fn new(
        stride: Stride<'a>,
        near: &'a Near,
        known: Option<&'a Remembered>,
        bodies: &'a [Moving],
        approach: Option<f64>,
    ) -> Self {
        let sides @ [a, b] = [near.a, near.b].map(|i| &bodies[i as usize]);
        let approach = approach.unwrap_or_else(|| dot(near.place.normal, sliding([a, b], near)));
        Self { stride, near, known, bodies: sides, approach }
    }

    /// From the first body to the image of it that touches after a share of the step.
    fn offset(&self, part: f64) -> Vec3 {
        let part = if self.is_extrapolated() { part } else { 0.0 };
        self.near.image.after(part * self.stride.h)
    }

    /// Where the contact is with its bodies at these poses after a share of the step; of a it is the image that touches.
    fn place(&self, [a, b]: [&Pose; 2], part: f64, normal: Vec3) -> Place {
        let start = self.bodies.map(|b| &b.start);
        if self.near.image.is_itself() {
            return self.near.witness.moved(start, a, b, normal);
        }
        let a = Pose { x: add(a.x, self.offset(part)), r: a.r };
        self.near.witness.moved(start, &a, b, normal)
    }

    /// Whether it took part in the last step.
    fn persists(&self) -> bool {
        self.known.is_some_and(|m| m.active)
    }

    fn is_extrapolated(&self) -> bool {
        self.stride.scheme.geometry != Geometry::Frozen
    }

    /// The index set.
    fn takes_part(&self) -> bool {
        let (gap, h, n) = (self.near.place.gap, self.stride.h, self.near.place.normal);
        // A spring acts where it is compressed at the end of the step.
        if self.near.compliance.is_some() {
            return gap + h * self.approach.min(0.0) <= 0.0;
        }
        let Activation::Forecast { gamma, slack } = self.stride.scheme.activation else {
            return true;
        };
        let beyond = gap + gamma * h * self.approach - slack * self.near.size;
        // What runs along a curved surface leaves it by as much as a step is curved: that is no separation.
        let curved = || {
            let [a, b] = self.bodies;
            let end = self.place([&a.end, &b.end], 1.0, n);
            beyond <= norm(sub(end.normal, n)) * norm(sub(end.point, self.near.place.point))
        };
        beyond <= 0.0 || (self.persists() && self.is_extrapolated() && curved())
    }

    /// A body that nothing moves has no momentum to keep: the arm ends on the surface of the other one. Else both arms end midway.
    fn on_surface(&self, place: Place) -> Place {
        let [a, b] = self.bodies.map(|b| f64::from(u8::from(b.free)));
        let half = 0.5 * (b - a);
        Place { point: add(place.point, scale(half * place.gap, place.normal)), ..place }
    }

    /// How many directions a contact has: in the plane none across it.
    fn directions(&self) -> usize {
        if self.stride.world.dimension == Dimension::Two { 2 } else { 3 }
    }

    /// The contact, with tangents after an axis of the world and impulses of the last step `scaled`, written where it stays: it is large.
    fn write(&self, axis: u8, scaled: f64, row: &mut Row) {
        let Self { near, bodies: [a, b], .. } = self;
        let n = near.place.normal;
        let middle = self.place([&a.middle, &b.middle], 0.5, n);
        let middle = Place { normal: if near.deep { n } else { middle.normal }, ..middle };
        let place = self.on_surface(middle);
        let frame = frame(place.normal, axis);
        // An impact and the rebound from it have one direction; what persists has its velocity where it comes to.
        let lasting =
            self.persists() && (near.law.e == 0.0 || self.approach.abs() <= self.stride.rest());
        let later = lasting && self.is_extrapolated() && !near.deep;
        *row = Row {
            mu: near.law.mu,
            place,
            offset: self.offset(0.5),
            frame,
            frame_end: frame,
            mu_r: near.law.mu_r,
            warm: self.known.is_some_and(|m| m.impulse != [0.0; 3]),
            ..Row::default()
        };
        let count = self.directions();
        // Of the image that touches.
        let offsets = [0.5, 1.0].map(|part| [self.offset(part), [0.0; 3]]);
        for (k, (arm, b)) in row.arms.iter_mut().zip(self.bodies).enumerate() {
            (arm.body, arm.owner, arm.free) = ([near.a, near.b][k], b.owner, b.free);
            arm.sign = [-1.0, 1.0][k];
            let to = sub(place.point, add(b.middle.x, offsets[0][k]));
            (0..count).for_each(|i| arm.moment[i] = cross(to, frame[i]));
            arm.moment_end = arm.moment;
        }
        let (mut point_end, mut runs) = (place.point, false);
        if later {
            let end = self.on_surface(self.place([&a.end, &b.end], 1.0, place.normal));
            let frame_end = transported(&frame, end.normal);
            point_end = end.point;
            let mut turned = 0.0;
            for (k, (arm, b)) in row.arms.iter_mut().zip(self.bodies).enumerate() {
                let to = sub(end.point, add(b.end.x, offsets[1][k]));
                (0..count).for_each(|i| arm.moment_end[i] = cross(to, frame_end[i]));
                turned = f64::max(turned, apart(&arm.moment, &arm.moment_end));
            }
            // Where nothing moves the two ends are the same up to rounding; then W is symmetric to the last bit.
            runs = turned > RUNS * near.size;
            row.later = !runs && (apart(&frame, &frame_end) > SAME || turned > SAME * near.size);
            match row.later {
                true => row.frame_end = frame_end,
                false => {
                    row.arms.iter_mut().for_each(|a| a.moment_end = a.moment);
                    point_end = place.point;
                }
            }
        }
        self.take_velocities(row, point_end);
        self.take_law(row, lasting);
        if runs {
            self.run(row, lasting);
        }
        if let Some(m) = self.known {
            row.r = m.impulse_along(&frame, scaled, row.mu);
            if row.mu_r > 0.0 {
                row.moment = m.moment_along(&frame, scaled, (row.mu_r, row.r[0]));
            }
        }
    }

    /// The relative velocity at the beginning, and those of what is moved, which at the end of the step is taken at a point of its own.
    fn take_velocities(&self, row: &mut Row, point_end: Vec3) {
        let (theta, count) = (self.stride.scheme.theta, self.directions());
        let image = self.near.image;
        for (arm, m) in row.arms.iter().zip(self.bodies) {
            if m.free {
                let omega = m.omega(m.spin);
                for i in 0..count {
                    row.before[i] += row.rate(arm, i, m.v, omega);
                }
                continue;
            }
            let [first, last] = m.linear;
            let beside = if arm.sign < 0.0 { image.offset } else { [0.0; 3] };
            let turn = |p: Vec3| cross(m.angular, sub(p, add(m.start.x, beside)));
            let (mid, end) = (turn(row.place.point), turn(point_end));
            for i in 0..count {
                let of = |v: Vec3| arm.sign * dot(row.frame[i], add(v, mid));
                row.before[i] += of(first);
                row.given[i] += arm.sign * dot(row.frame_end[i], add(last, end));
                row.given_middle[i] += of(last);
                row.given_mean[i] += theta * of(last) + (1.0 - theta) * of(first);
            }
            for k in 0..2 {
                row.turned[k] += arm.sign * dot(row.frame_end[1 + k], m.angular);
                row.turned_mean[k] += arm.sign * dot(row.frame[1 + k], m.angular);
            }
        }
        if !image.is_itself() {
            for i in 0..count {
                let given = dot(row.frame[i], image.velocity);
                row.before[i] -= given;
                row.given_middle[i] -= given;
                row.given_mean[i] -= given;
                row.given[i] -= dot(row.frame_end[i], image.velocity);
            }
        }
    }

    /// The law of a point that runs far over its body within a step, as that of a coin which wobbles fast: an impulse at one place and the law for velocities at the other
    /// would make energy. So both are at the middle, and what u_k has there beyond the beginning, which is no approach and no slip, is in the law with its mean over
    /// the step: the gap is kept to second order, and the work is that of the velocities at the beginning.
    fn run(&self, row: &mut Row, lasting: bool) {
        let (theta, law) = (self.stride.scheme.theta, self.near.law);
        if row.compliance > 0.0 || law.e > 0.0 {
            return;
        }
        let mean = (1.0 - theta) / theta;
        row.shift[0] += mean * (row.before[0] - self.approach.min(0.0));
        if self.takes_mean(lasting, |known| known.stuck) {
            return;
        }
        let slip = sliding(self.bodies, self.near);
        for i in 1..self.directions() {
            row.shift[i] += (mean - law.e_t) * (row.before[i] - dot(row.frame[i], slip));
        }
    }

    /// Whether the law of friction is that of u_θ: by Frémond's, unless what lasts was held in the step before.
    fn takes_mean(&self, lasting: bool, held: impl FnOnce(&Remembered) -> bool) -> bool {
        let held = self.known.is_some_and(held);
        self.stride.scheme.impact == Impact::Fremond && !(lasting && held)
    }

    /// The relative angular velocity about a tangent at the beginning.
    fn turning(&self, row: &Row, tangent: usize) -> f64 {
        let free = row.arms.iter().zip(self.bodies).filter(|a| a.0.free);
        // What is moved turns evenly.
        free.fold(row.turned_mean[tangent], |u, (arm, m)| {
            u + arm.sign * dot(row.frame[1 + tangent], m.omega(m.spin))
        })
    }

    /// What the law adds to u⁺, and what it lets give way.
    fn take_law(&self, row: &mut Row, lasting: bool) {
        let Self { near, stride: Stride { scheme, h, .. }, .. } = self;
        let (law, gap, before) = (near.law, near.place.gap, row.before);
        let mean = (1.0 - scheme.theta) / scheme.theta;
        let share = if self.takes_mean(lasting, |known| known.stuck) { mean } else { law.e_t };
        row.shift = [0.0, share * before[1], share * before[2]];
        if row.mu_r > 0.0 && self.takes_mean(lasting, |known| known.unrolled) {
            row.turned_shift = [0, 1].map(|k| mean * self.turning(row, k));
        }
        if let Some(Compliance { stiffness, damping }) = near.compliance {
            let resistance = damping + h * stiffness;
            row.shift[0] = stiffness * gap / resistance;
            row.compliance = 1.0 / (h * resistance);
            return;
        }
        let waits = scheme.activation == Activation::Gap && gap > 0.0;
        if waits {
            row.shift[0] = gap / h;
        }
        // What lasts opens by as much as a surface is curved.
        row.restitution = Restitution::new(law.e, lasting, waits);
    }
}

/// Points where bodies are near, with what is remembered of pairs of shapes that come in the same order, and what is found of them: the axis of the tangents, the
/// velocity of the gap, and the row, at first 0 of each that takes part.
struct Recalling<'a> {
    near: &'a mut [Near],
    memory: &'a [Remembered],
    taken: &'a mut [bool],
    known: &'a mut [Option<Remembered>],
    found: (&'a mut [u8], (&'a mut [f64], &'a mut [u32])),
}

impl Cut for Recalling<'_> {
    fn count(&self) -> usize {
        self.near.len()
    }

    /// Between pairs of shapes, those of one of which are remembered together.
    fn cut(self, mut at: usize) -> (Self, Self) {
        let pair = |k: usize| self.near[k].key.pair();
        while at > 0 && at < self.near.len() && pair(at) == pair(at - 1) {
            at += 1;
        }
        let whole = self.memory.len();
        let next = self.near.get(at).map(|n| n.key.pair());
        let m = next.map_or(whole, |next| self.memory.partition_point(|m| m.key.pair() < next));
        let (near, memory, taken) = (self.near.cut(at), self.memory.cut(m), self.taken.cut(m));
        let (known, found) = (self.known.cut(at), self.found.cut(at));
        (
            Self { near: near.0, memory: memory.0, taken: taken.0, known: known.0, found: found.0 },
            Self { near: near.1, memory: memory.1, taken: taken.1, known: known.1, found: found.1 },
        )
    }
}

/// The same points with the rows to be written of those that take part.
struct Writing<'a> {
    near: &'a [Near],
    known: &'a [Option<Remembered>],
    found: (&'a [u8], (&'a [f64], &'a [u32])),
    rows: (&'a mut [Row], &'a mut [[u32; 2]]),
}

impl Cut for Writing<'_> {
    fn count(&self) -> usize {
        self.near.len()
    }

    fn cut(self, at: usize) -> (Self, Self) {
        let row_of = self.found.1.1;
        let of = |k: &[u32]| k.iter().copied().find(|&row| row != NONE);
        let first = of(row_of).unwrap_or(0);
        let r = of(&row_of[at..]).map_or(self.rows.0.len(), |row| (row - first) as usize);
        let (near, known) = (self.near.cut(at), self.known.cut(at));
        let (found, rows) = (self.found.cut(at), self.rows.cut(r));
        (
            Self { near: near.0, known: known.0, found: found.0, rows: rows.0 },
            Self { near: near.1, known: known.1, found: found.1, rows: rows.1 },
        )
    }
}

impl Tools {
    /// Index set, frames, warm starts; rows of joints; islands.
    pub(super) fn meet(&mut self, stride: Stride, state: &State) {
        let Self { near, met, row_of, rows, pairs, bodies, crew, insisted, .. } = self;
        let (count, memory) = (near.len(), &state.memory.contacts[..]);
        let Met { known, taken, axes, approach } = met;
        known.resize(count, None);
        taken.clear();
        taken.resize(memory.len(), false);
        axes.resize(count, 0);
        approach.resize(count, 0.0);
        row_of.resize(count, NONE);
        let found = (&mut axes[..], (&mut approach[..], &mut row_of[..]));
        let (bodies, insisted) = (&bodies[..], &insisted[..]);
        let all = Recalling { near, memory, taken, known, found };
        crew.spread(all, count, |Recalling { near, memory, taken, known, found }| {
            recall(memory, near, known, taken);
            let (axes, (approach, row_of)) = found;
            for (k, near) in near.iter().enumerate() {
                let known = known[k].as_ref();
                let last = known.map(|m| m.axis);
                axes[k] = tangent_axis(near.place.normal, last, stride.world.dimension);
                let meeting = Meeting::new(stride, near, known, bodies, None);
                approach[k] = meeting.approach;
                let takes_part = meeting.takes_part() || insisted.binary_search(&near.key).is_ok();
                row_of[k] = if takes_part { 0 } else { NONE };
            }
        });
        let mut number = 0;
        for row in row_of.iter_mut().filter(|row| **row != NONE) {
            *row = number;
            number += 1;
        }
        rows.resize(number as usize, Row::default());
        pairs.resize(number as usize, [NONE; 2]);
        let scaled = state.memory.scaled(stride.h);
        let all = Writing {
            near,
            known,
            found: (axes, (approach, row_of)),
            rows: (&mut rows[..], &mut pairs[..]),
        };
        crew.spread(all, count, |Writing { near, known, found, rows }| {
            let (axes, (approach, row_of)) = found;
            let taking_part = (0..near.len()).filter(|&k| row_of[k] != NONE);
            for ((k, row), pair) in taking_part.zip(rows.0).zip(rows.1) {
                let meeting =
                    Meeting::new(stride, &near[k], known[k].as_ref(), bodies, Some(approach[k]));
                meeting.write(axes[k], scaled, row);
                *pair = row.free_owners();
            }
        });
        self.joints.begin(stride.scheme, stride.world, state, &self.bodies, stride.h);
        self.join();
        self.rebound(stride);
    }

    /// Adds restitution to the laws of contacts and limits, with the largest e among the impacts of each island.
    fn rebound(&mut self, stride: Stride) {
        let Self { rows, joints, islands, impacts, .. } = self;
        let ([rule, of_limits], rest) = (stride.scheme.restitution(), stride.rest());
        impacts.clear();
        impacts.resize(islands.ends.len(), 0.0);
        let (of_rows, of_joints) = islands.of_item.split_at(rows.len());
        for (row, &k) in rows.iter().zip(of_rows) {
            let most = &mut impacts[k as usize];
            *most = most.max(row.restitution.hit(row.before[0], rest, rule));
        }
        for (row, &k) in joints.rows.iter().zip(of_joints) {
            let most = &mut impacts[k as usize];
            *most = most.max(row.hit(rest, of_limits));
        }
        for (row, &k) in rows.iter_mut().zip(of_rows).filter(|r| r.0.compliance == 0.0) {
            let u = row.before[0];
            row.shift[0] += row.restitution.share(u, impacts[k as usize], rule) * u;
        }
        for (row, &k) in joints.rows.iter_mut().zip(of_joints) {
            row.rebound(impacts[k as usize], of_limits);
        }
    }

    /// Islands of contacts and rows.
    fn join(&mut self) {
        let Self { rows, pairs, joints, islands, touching, start, solids, .. } = self;
        let owners = start.bodies() + solids.len();
        let scalars = (0..joints.rows.len()).map(|k| joints.levers(k));
        islands.find(owners, |join| {
            pairs.iter().for_each(|p| join(&mut p.iter().copied().filter(|&b| b != NONE)));
            scalars.for_each(|levers| join(&mut levers.iter().map(|l| l.body)));
        });
        touching.arrange(owners, pairs, islands);
        // Where rows of joints act on a body its contacts have one direction for impulses and velocities: a problem has one V for both.
        if !joints.rows.is_empty() {
            let mut jointed = vec![false; owners];
            for k in 0..joints.rows.len() {
                joints.levers(k).iter().for_each(|l| jointed[l.body as usize] = true);
            }
            let touched = |row: &Row| row.free_arms().any(|a| jointed[a.owner as usize]);
            rows.iter_mut().filter(|row| row.later && touched(row)).for_each(Row::at_the_middle);
        }
    }

    /// Takes the contacts that were pushed behind the last step into the index set, and no others.
    pub fn insist_on_pushed(&mut self, state: &State) {
        self.insisted.clear();
        let pushed = state.memory.contacts.iter().filter(|m| m.pushed);
        self.insisted.extend(pushed.map(|m| m.key));
    }

    /// Takes contacts of the last attempt that were open into the index set of the next ones; whether there was one.
    pub fn insist(&mut self, pushed: &[Key]) -> bool {
        let before = self.insisted.len();
        for (near, &row) in self.near.iter().zip(&self.row_of) {
            if row == NONE && pushed.contains(&near.key) {
                self.insisted.push(near.key);
            }
        }
        self.insisted.sort_unstable();
        self.insisted.len() > before
    }
}
