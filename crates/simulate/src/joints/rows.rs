//! The scalar rows of a step: equations of joints, and what acts along their coordinates.
//!
//! ```text
//! equations, springs, drivers:   c = Gᵀ v_θ + b,   0 = c + κ λ        on the mean velocity, with G at the extrapolated midpoint: second order, exact in energy
//! limits:                        c = Gᵀ (v⁺ + e v_k),   0 ≤ λ ⟂ c ≥ 0     where the forecast closes them, e as in `restitution.rs`
//! motors, dry friction:          c = Gᵀ v⁺ − target,   −c ∈ N_[−h F, h F](λ)
//! spring k, damper d:            κ = 1/(h (d + h θ k)),   b = k (s_k − rest)/(d + h θ k):    λ = −h (k (s_k + h θ s'_θ − rest) + d s'_θ)
//! ```
//!
//! A row on the mean velocity would throw back a velocity that does not fit the joints: where that at the beginning does not, the nearest one that does, in the
//! norm of the masses, stands for it in `v_θ`, and where nothing is projected after the step in the extrapolation.

use nonsmooth_scenes::vec3::{Vec3, apply, cross, dot, norm, scale, sub};

use super::equations::{Equation, Linkage, Placed, Reach, coupled};
use super::{Coordinate, Drive, JointId, JointLimits, JointReport, Motor, Spring};
use crate::moving::Moving;
use crate::restitution::{Restitution, Rule};
use crate::rotation::Pose;
use crate::state::State;
use crate::world::{entry, oscillation};
use crate::{Activation, BodyId, MoreauJean, Motion, World};

/// What a row does to a free body, and the rates that its velocities make.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Lever {
    pub body: u32,
    /// In the world frame.
    pub force: Vec3,
    pub moment: Vec3,
    /// In the frame of the body's velocities.
    pub row: [f64; 6],
    pub solved: [f64; 6],
}

/// A scalar row of a step.
#[derive(Debug, Clone, Copy)]
pub(crate) struct ScalarRow {
    /// Joint or, beyond the joints, coupling; and which of its rows.
    pub key: (u32, u32),
    /// Its levers.
    levers: (u32, u32),
    pub bounds: [f64; 2],
    pub compliance: f64,
    /// The share of the velocity before the step that c has besides that after it.
    share: f64,
    /// What bodies that are moved, targets and springs add to c.
    given: f64,
    limit: Option<Limit>,
    /// What c has besides the velocities of free bodies after the step.
    pub shift: f64,
    pub lambda: f64,
}

/// What a limit has besides.
#[derive(Debug, Clone, Copy)]
struct Limit {
    restitution: Restitution,
    /// Its velocity before the step, and the part that bodies have which are moved.
    before: f64,
    moved: f64,
    /// What a velocity of one of its bodies, m/s, makes of its own at most.
    ease: f64,
}

/// The joints of a world, and the rows of a step.
pub(crate) struct Joints {
    pub linkages: Vec<Linkage>,
    pub rows: Vec<ScalarRow>,
    levers: Vec<Lever>,
    /// Angle and slide at the beginning of the step.
    coordinates: Vec<[f64; 2]>,
    pub reports: Vec<JointReport>,
    /// The state with velocities that fit, where those at the beginning of the step do not.
    pub fitted: Option<State>,
    /// How many of how many equations follow from the others at the beginning.
    pub redundant: Option<(usize, usize)>,
}

/// Whether the row of this number is the end of a coordinate.
pub(super) fn is_limit(number: u32) -> bool {
    number.checked_sub(EQUATIONS).is_some_and(|along| [LOWER, UPPER].contains(&(along % 8)))
}

/// The number of a row that acts along a coordinate, after those of the equations.
fn number(drive: usize, what: u32) -> u32 {
    EQUATIONS + 8 * drive as u32 + what
}

/// The other way: the drive that a row belongs to, and what it is there; none of equations and couplings.
fn drive_of(number: u32) -> Option<(usize, u32)> {
    let beyond = number.checked_sub(EQUATIONS)?;
    Some(((beyond / 8) as usize, beyond % 8))
}

/// A joint has fewer equations.
const EQUATIONS: u32 = 8;
/// What acts along a coordinate, by number.
const LOWER: u32 = 0;
const UPPER: u32 = 1;
const SPRING: u32 = 2;
const FRICTION: u32 = 3;
const MOTOR: u32 = 4;
const DRIVER: u32 = 5;

impl Joints {
    /// Those of a world whose bodies stand as they were built.
    pub fn new(world: &World) -> Self {
        Self {
            linkages: world.joints.iter().map(|j| Linkage::new(j, world)).collect(),
            rows: vec![],
            levers: vec![],
            coordinates: vec![],
            reports: vec![],
            fitted: None,
            redundant: None,
        }
    }

    pub fn is_empty(&self) -> bool {
        self.linkages.is_empty()
    }

    /// The levers of a row.
    pub fn levers(&self, row: usize) -> &[Lever] {
        let (first, last) = self.rows[row].levers;
        &self.levers[first as usize..last as usize]
    }

    /// The coordinates of all joints at poses that follow those of `state`.
    fn coordinates(&self, state: &State, pose: impl Fn(u32) -> Pose) -> Vec<[f64; 2]> {
        let last = |j: usize| state.memory.angles.get(j).copied().unwrap_or(0.0);
        let each = self.linkages.iter().enumerate();
        each.map(|(j, l)| l.coordinates(&l.place(&pose), last(j))).collect()
    }

    /// States the rows of a step of length h.
    pub fn begin(
        &mut self,
        scheme: &MoreauJean,
        world: &World,
        state: &State,
        bodies: &[Moving],
        h: f64,
    ) {
        self.rows.clear();
        self.levers.clear();
        if self.is_empty() {
            return;
        }
        self.coordinates = self.coordinates(state, |k| bodies[k as usize].start);
        let Self { linkages, rows, levers, coordinates, fitted, .. } = self;
        let step = Step { scheme, world, state, fitted: fitted.as_ref(), bodies, h };
        let middle = |k: u32| bodies[k as usize].middle;
        let mut gradients = Gradients::at(world, linkages, coordinates, middle);
        let mut push = |key: (u32, u32), reach: &[Reach], wanted: Wanted| {
            let first = levers.len() as u32;
            levers.extend(reach.iter().filter(|r| step.is_free(r)).map(Lever::of));
            if levers.len() as u32 > first {
                rows.push(step.row(key, reach, (first, levers.len() as u32), wanted));
            }
        };
        for (j, joint) in world.joints.iter().enumerate() {
            for k in 0..gradients.equations(j as u32).len() as u32 {
                let key = (j as u32, k);
                push(key, &gradients.of(key), Wanted::bilateral());
            }
            for (d, drive) in joint.drives.iter().enumerate() {
                let [angle, slide] = coordinates[j];
                let s = if drive.coordinate == Coordinate::Angle { angle } else { slide };
                let rate = step.rate(&gradients.of((j as u32, number(d, SPRING))));
                for (what, wanted) in step.along(drive, s, rate) {
                    let key = (j as u32, number(d, what));
                    push(key, &gradients.of(key), wanted);
                }
            }
        }
        for c in 0..world.couplings.len() {
            let key = ((world.joints.len() + c) as u32, 0);
            push(key, &gradients.of(key), Wanted::bilateral());
        }
    }

    /// Each drive with limits: its joint, where it stands, and the unit in which that is measured, one radian or the size of the joint.
    fn limited<'a>(
        &'a self,
        world: &'a World,
        state: &State,
    ) -> impl Iterator<Item = (usize, &'a Drive, JointLimits, f64, f64)> + 'a {
        let any = world.joints.iter().flat_map(|j| &j.drives).any(|d| d.limits.is_some());
        let coordinates = match any {
            true => self.coordinates(state, |k| state.pose(k as usize)),
            false => vec![],
        };
        coordinates.into_iter().enumerate().flat_map(move |(j, [angle, slide])| {
            let limited = world.joints[j].drives.iter().filter_map(|d| Some((d, d.limits?)));
            limited.map(move |(drive, limits)| match drive.coordinate {
                Coordinate::Angle => (j, drive, limits, angle, 1.0),
                Coordinate::Slide => (j, drive, limits, slide, self.linkages[j].size()),
            })
        })
    }

    /// The most by which a limit is violated, as a share of one radian or of the size of its joint.
    pub fn overshoot(&self, world: &World, state: &State) -> f64 {
        self.limited(world, state).fold(0.0, |worst, (_, _, limits, s, unit)| {
            f64::max(worst, (limits.lower - s).max(s - limits.upper) / unit)
        })
    }

    /// What is to be said of limits that are violated before the first step, by more than rounding.
    pub fn violated(&self, world: &World, state: &State) -> Vec<String> {
        let beyond = self.limited(world, state).filter(|(_, _, limits, s, unit)| {
            (limits.lower - s).max(s - limits.upper) > 1e-9 * unit
        });
        let said = beyond.map(|(j, drive, limits, s, _)| {
            let place = entry("joints", j, &world.joints[j].name);
            let JointLimits { lower, upper, .. } = limits;
            let (what, unit) = match drive.coordinate {
                Coordinate::Angle => ("angle", "rad"),
                Coordinate::Slide => ("slide", "m"),
            };
            format!("{place}: begins beyond its limits: {what} {s:.4} {unit}, limits [{lower}, {upper}]: it will not go farther")
        });
        said.collect()
    }

    /// Makes rows of limits close what a limit is violated by in a step of length h.
    pub fn close_limits(&mut self, world: &World, h: f64) {
        for row in &mut self.rows {
            let Some((drive, what)) = drive_of(row.key.1) else { continue };
            let (LOWER | UPPER) = what else { continue };
            let j = row.key.0 as usize;
            let drive = &world.joints[j].drives[drive];
            let Some(limits) = drive.limits else { continue };
            let [angle, slide] = self.coordinates[j];
            let s = if drive.coordinate == Coordinate::Angle { angle } else { slide };
            let gap = if what == LOWER { s - limits.lower } else { limits.upper - s };
            (row.given, row.share) = (gap / h, 0.0);
        }
    }

    /// The rows in the frames of this pass, which count on after so many contacts.
    pub fn columns(&mut self, rows: &[u32], contacts: u32, bodies: &[Moving]) {
        for &k in rows {
            let row = &mut self.rows[(k - contacts) as usize];
            let mut before = 0.0;
            let (first, last) = row.levers;
            for lever in &mut self.levers[first as usize..last as usize] {
                let b = &bodies[lever.body as usize];
                let turned = apply(&b.frame, lever.moment);
                let solved = apply(&b.inverse, turned);
                for i in 0..3 {
                    lever.row[i] = lever.force[i];
                    lever.row[3 + i] = turned[i];
                    lever.solved[i] = lever.force[i] / b.mass;
                    lever.solved[3 + i] = solved[i];
                }
                before += lever.rate(b.v, b.spin);
            }
            row.shift = row.given + row.share * before;
        }
    }

    /// The velocity of a row without impulses, and the sizes of its terms together.
    pub fn free(&self, row: usize, bodies: &[Moving]) -> (f64, f64) {
        let ScalarRow { shift, given, share, .. } = self.rows[row];
        self.levers(row).iter().fold((shift, given.abs()), |(free, terms), lever| {
            let b = &bodies[lever.body as usize];
            let before = share.abs() * lever.terms(b.v, b.spin);
            let rate = lever.rate(b.v_free, b.spin_free);
            (free + rate, terms + before + lever.terms(b.v_free, b.spin_free))
        })
    }

    /// Takes the gradients of these rows at other poses: those of the middle of the step as the last pass has it, `½ (R_k + R⁺)` for rotations. With the velocities
    /// that belong to them the equations of joints keep their values to rounding.
    pub fn place_at(&mut self, world: &World, rows: &[u32], pose: impl Fn(u32) -> Pose) {
        let Self { linkages, coordinates, rows: all, levers, .. } = self;
        let mut gradients = Gradients::at(world, linkages, coordinates, pose);
        for &k in rows {
            let row = &all[k as usize];
            let reach = gradients.of(row.key);
            let free = reach.iter().filter(|r| world.bodies[r.body as usize].is_free());
            let (first, last) = row.levers;
            for (lever, r) in levers[first as usize..last as usize].iter_mut().zip(free) {
                (lever.force, lever.moment) = (r.force, r.moment);
            }
        }
    }

    /// Says where the joints are, and by how much they are violated at most.
    pub fn tell(&mut self, world: &World, state: &mut State) -> f64 {
        let violations = self.violations(world, state).0;
        self.finish(world, state, &violations);
        violations.into_iter().fold(0.0, f64::max)
    }

    /// Keeps what the step did, and says it: coordinates, impulses. `violations` are those of the joints after the step.
    pub fn finish(&mut self, world: &World, state: &mut State, violations: &[f64]) {
        if self.is_empty() {
            return;
        }
        self.coordinates = self.coordinates(state, |k| state.pose(k as usize));
        let memory = &mut state.memory;
        memory.angles.clear();
        memory.angles.extend(self.coordinates.iter().map(|c| c[0]));
        memory.impulses.clear();
        memory.impulses.extend(self.rows.iter().map(|row| (row.key, row.lambda)));
        self.reports.clear();
        for (j, linkage) in self.linkages.iter().enumerate() {
            let (mut impulse, mut moment) = ([0.0; 3], [0.0; 3]);
            // A body that impulses do not move has no levers: what acts on it is minus what acts on the other.
            let on_b = world.bodies[linkage.b as usize].is_free();
            let body = linkage.a.filter(|_| !on_b).unwrap_or(linkage.b);
            let sign = if on_b == linkage.on_a { -1.0 } else { 1.0 };
            // Rows are in the order of their joints.
            let first = self.rows.partition_point(|r| (r.key.0 as usize) < j);
            let own = self.rows.iter().enumerate().skip(first);
            for (k, row) in own.take_while(|r| r.1.key.0 as usize == j) {
                let lambda = sign * row.lambda;
                for lever in self.levers(k).iter().filter(|l| l.body == body) {
                    for i in 0..3 {
                        impulse[i] += lambda * lever.force[i];
                        moment[i] += lambda * lever.moment[i];
                    }
                }
            }
            let at = linkage.place(|k| state.pose(k as usize));
            let arm = sub(at.anchor(linkage.on_a), state.position[body as usize]);
            let about = cross(arm, impulse);
            let [angle, slide] = self.coordinates[j];
            let has = |c: Coordinate, x: f64| if linkage.kind.has(c) { x } else { 0.0 };
            self.reports.push(JointReport {
                joint: JointId(j as u32),
                angle: has(Coordinate::Angle, angle),
                slide: has(Coordinate::Slide, slide),
                impulse,
                moment: sub(moment, about),
                violation: violations.get(j).copied().unwrap_or(0.0),
            });
        }
    }

    /// The equations of all joints, drivers and couplings at poses, each with the joint that it belongs to.
    pub fn equations(
        &self,
        world: &World,
        state: &State,
        pose: impl Fn(u32) -> Pose,
    ) -> Vec<(usize, Equation)> {
        let coordinates = self.coordinates(state, &pose);
        let places: Vec<_> = self.linkages.iter().map(|l| l.place(&pose)).collect();
        let coordinate = |j: usize, c: Coordinate| {
            let [angle, slide] = coordinates[j];
            let value = if c == Coordinate::Angle { angle } else { slide };
            (value, self.linkages[j].gradient(&places[j], c))
        };
        let mut out = vec![];
        for (j, linkage) in self.linkages.iter().enumerate() {
            let own = linkage.equations(&places[j], coordinates[j][0]);
            out.extend(own.into_iter().map(|e| (j, e)));
            for drive in &world.joints[j].drives {
                if let Some(driver) = &drive.driver {
                    let (value, gradient) = coordinate(j, drive.coordinate);
                    let equation = Equation::new(value - driver.at(state.t), gradient);
                    out.push((j, Equation { target: driver.rate(state.t), ..equation }));
                }
            }
        }
        for coupling in &world.couplings {
            let j = coupling.terms[0].0.index();
            out.push((j, coupled(coupling, |joint, c| coordinate(joint.index(), c))));
        }
        out
    }
}

impl ScalarRow {
    /// The coefficient with which a limit hits its island; what is slower than `rest`, m/s, does not.
    pub fn hit(&self, rest: f64, rule: Rule) -> f64 {
        self.limit.map_or(0.0, |l| l.restitution.hit(l.before, rest * l.ease, rule))
    }

    /// Takes the restitution of a limit into its law; `hit` is the largest coefficient of an impact in its island.
    pub fn rebound(&mut self, hit: f64, rule: Rule) {
        let Some(limit) = self.limit else { return };
        self.share = limit.restitution.share(limit.before, hit, rule);
        self.given += self.share * limit.moved;
    }
}

impl Lever {
    fn of(r: &Reach) -> Self {
        let (row, solved) = ([0.0; 6], [0.0; 6]);
        Self { body: r.body, force: r.force, moment: r.moment, row, solved }
    }

    /// The rate that the body's velocities make.
    pub fn rate(&self, v: Vec3, spin: Vec3) -> f64 {
        (0..3).map(|k| self.row[k] * v[k] + self.row[3 + k] * spin[k]).sum()
    }

    /// The sizes of its terms together.
    fn terms(&self, v: Vec3, spin: Vec3) -> f64 {
        (0..3).map(|k| (self.row[k] * v[k]).abs() + (self.row[3 + k] * spin[k]).abs()).sum()
    }
}

impl Reach {
    fn times(&self, factor: f64) -> Self {
        Self {
            body: self.body,
            force: scale(factor, self.force),
            moment: scale(factor, self.moment),
        }
    }
}

/// The gradients of rows at a configuration, by their keys.
struct Gradients<'a> {
    world: &'a World,
    linkages: &'a [Linkage],
    coordinates: &'a [[f64; 2]],
    places: Vec<Placed>,
    /// The equations of the joint that was asked for last.
    own: (u32, Vec<Equation>),
}

impl<'a> Gradients<'a> {
    fn at(
        world: &'a World,
        linkages: &'a [Linkage],
        coordinates: &'a [[f64; 2]],
        pose: impl Fn(u32) -> Pose,
    ) -> Self {
        let places = linkages.iter().map(|l| l.place(&pose)).collect();
        Self { world, linkages, coordinates, places, own: (u32::MAX, vec![]) }
    }

    fn equations(&mut self, joint: u32) -> &[Equation] {
        if self.own.0 != joint {
            let j = joint as usize;
            let equations = self.linkages[j].equations(&self.places[j], self.coordinates[j][0]);
            self.own = (joint, equations);
        }
        &self.own.1
    }

    fn of(&mut self, (owner, which): (u32, u32)) -> Vec<Reach> {
        let Self { world, linkages, places, .. } = self;
        let j = owner as usize;
        if let Some(coupling) = j.checked_sub(linkages.len()) {
            let gradient = |joint: JointId, c: Coordinate| {
                (0.0, linkages[joint.index()].gradient(&places[joint.index()], c))
            };
            coupled(&world.couplings[coupling], gradient).gradient
        } else if let Some((drive, what)) = drive_of(which) {
            let along = world.joints[j].drives[drive].coordinate;
            let sign = if what == UPPER { -1.0 } else { 1.0 };
            linkages[j].gradient(&places[j], along).iter().map(|r| r.times(sign)).collect()
        } else {
            self.equations(owner)[which as usize].gradient.clone()
        }
    }
}

/// What a row is to have.
struct Wanted {
    bounds: [f64; 2],
    compliance: f64,
    mean: bool,
    given: f64,
    /// Of a limit e.
    limit: Option<f64>,
}

impl Wanted {
    fn bilateral() -> Self {
        let bounds = [f64::NEG_INFINITY, f64::INFINITY];
        Self { bounds, compliance: 0.0, mean: true, given: 0.0, limit: None }
    }

    /// On the velocity after the step.
    fn end(bounds: [f64; 2], given: f64) -> Self {
        Self { bounds, compliance: 0.0, mean: false, given, limit: None }
    }
}

/// All that rows are made of.
struct Step<'a> {
    scheme: &'a MoreauJean,
    world: &'a World,
    state: &'a State,
    fitted: Option<&'a State>,
    bodies: &'a [Moving],
    h: f64,
}

impl Step<'_> {
    fn is_free(&self, r: &Reach) -> bool {
        self.bodies[r.body as usize].free
    }

    /// What acts along a coordinate, which is s and changes at `rate`.
    fn along(&self, drive: &Drive, s: f64, rate: f64) -> Vec<(u32, Wanted)> {
        let (h, theta) = (self.h, self.scheme.theta);
        let mut all = vec![];
        if let Some(limits) = drive.limits {
            let gamma = match self.scheme.activation {
                Activation::Forecast { gamma, .. } => gamma,
                Activation::Gap => 1.0,
            };
            let sides = [(LOWER, s - limits.lower, 1.0), (UPPER, limits.upper - s, -1.0)];
            for (what, gap, sign) in sides {
                if gap + gamma * h * sign * rate <= 0.0 {
                    let wanted = Wanted::end([0.0, f64::INFINITY], 0.0);
                    all.push((what, Wanted { limit: Some(limits.e), ..wanted }));
                }
            }
        }
        let pull = |spring: &Spring, max: f64| {
            let Spring { stiffness, damping, rest } = *spring;
            let resistance = damping + h * theta * stiffness;
            (resistance > 0.0).then(|| Wanted {
                bounds: [-h * max, h * max],
                compliance: 1.0 / (h * resistance),
                mean: true,
                given: stiffness * (s - rest) / resistance,
                limit: None,
            })
        };
        let spring = drive.spring.as_ref().and_then(|s| pull(s, f64::INFINITY));
        all.extend(spring.map(|wanted| (SPRING, wanted)));
        if drive.friction > 0.0 {
            let most = h * drive.friction;
            all.push((FRICTION, Wanted::end([-most, most], 0.0)));
        }
        let motor = match &drive.motor {
            Some(Motor::Velocity { velocity, max }) => {
                Some(Wanted::end([-h * max, h * max], -velocity))
            }
            Some(Motor::Position { spring, max }) => pull(spring, *max),
            None => None,
        };
        all.extend(motor.map(|wanted| (MOTOR, wanted)));
        if let Some(driver) = &drive.driver {
            let t = self.state.t;
            let given = -(driver.at(t + h) - driver.at(t)) / h;
            all.push((DRIVER, Wanted { given, ..Wanted::bilateral() }));
        }
        all
    }

    /// The row of these levers that has what is wanted.
    fn row(
        &self,
        key: (u32, u32),
        reach: &[Reach],
        levers: (u32, u32),
        wanted: Wanted,
    ) -> ScalarRow {
        let Wanted { bounds, compliance, mean, given, limit } = wanted;
        let (mut before, mut moved, mut moved_end, mut unfit) = (0.0, 0.0, 0.0, 0.0);
        let mut ease = 0.0;
        for r in reach {
            let b = &self.bodies[r.body as usize];
            if b.free {
                let (v, omega) = (b.v, b.omega(b.spin));
                before += dot(r.force, v) + dot(r.moment, omega);
                if let Some(fitted) = self.fitted {
                    let slide = sub(v, fitted.velocity[r.body as usize]);
                    let turn = sub(omega, fitted.angular_velocity(BodyId(r.body)));
                    unfit += dot(r.force, slide) + dot(r.moment, turn);
                }
                ease = f64::max(ease, norm(r.force) + norm(r.moment) / b.radius);
            } else {
                let (mean, end) = self.moved(r.body as usize);
                moved += dot(r.force, mean);
                moved_end += dot(r.force, end);
            }
        }
        // What has a compliance is a force, no constraint: nothing is thrown back.
        let unfit = if compliance > 0.0 { 0.0 } else { unfit };
        let theta = self.scheme.theta;
        let share = (1.0 - theta) / theta;
        let (given, share, compliance) = match mean {
            true => ((moved + given) / theta - share * unfit, share, compliance / theta),
            false => (moved_end + given, 0.0, compliance),
        };
        let limit = limit.map(|e| Limit {
            // Impulses and velocities have one direction, so nothing opens but what something moves.
            restitution: Restitution::new(e, false, false),
            before: before + moved,
            moved,
            ease,
        });
        let [l, u] = bounds;
        let memory = &self.state.memory;
        let lambda = (memory.scaled(self.h) * memory.impulse(key)).clamp(l, u);
        ScalarRow { key, levers, bounds, compliance, share, given, limit, shift: given, lambda }
    }

    /// The rate of a row at the beginning.
    fn rate(&self, reach: &[Reach]) -> f64 {
        let each = reach.iter().map(|r| {
            let b = &self.bodies[r.body as usize];
            match b.free {
                true => dot(r.force, b.v) + dot(r.moment, b.omega(b.spin)),
                false => dot(r.force, self.moved(r.body as usize).0),
            }
        });
        each.sum()
    }

    /// The mean velocity in the step and that at its end of a body that is moved.
    fn moved(&self, k: usize) -> (Vec3, Vec3) {
        let motion = &self.world.bodies[k].motion;
        let end = motion.velocity(self.state.t + self.h);
        match *motion {
            Motion::Oscillating { amplitude, frequency, phase } => {
                let at = |t: f64| oscillation(amplitude, frequency, phase, t).0;
                let way = sub(at(self.state.t + self.h), at(self.state.t));
                (scale(1.0 / self.h, way), end)
            }
            _ => (end, end),
        }
    }
}
