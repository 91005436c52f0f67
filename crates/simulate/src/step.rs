//! One step of Moreau–Jean's θ-scheme for rigid bodies.
//!
//! With Ω in the body frame, `v_θ = θ v⁺ + (1 − θ) v_k`, impulses r over the whole step and d each of the three directions of a contact,
//!
//! ```text
//! m (v⁺ − v_k) = h (m g + F) + Σ ± d r,                                        x⁺ = x_k + h v_θ
//! J (Ω⁺ − Ω_k) + h Ω_θ × J Ω_θ = (I − ½ h Ω̂_θ) R_kᵀ (h τ + Σ ± (p − x) × d r),   R⁺ = R_k cay(h Ω_θ)
//! K* ∋ u⁺ + w + mu‖u_T⁺ + w_T‖ e_N  ⟂  r ∈ K,   w_N = e min(u_{N,k}, 0),   w_T = e_T u_{T,k}   for the contacts of the index set, r = 0 elsewhere.
//! ```
//!
//! `(I − ½ h Ω̂_θ) R_kᵀ` is the inverse of the mean of R_k and R⁺ at θ = ½: a torque that is fixed in space changes the momentum in space by just that, and
//! `Ω_θ · (…) = (R_k Ω_θ) · L`, so momentum and energy are exact at any h. Bodies whose inertia is isotropic have
//! no gyroscopic torque; their velocities are taken in the world frame, where nothing has to be solved.
//!
//! Method: bodies move freely, contacts of the index set (`g + γ h u_N ≤ 0`) get their directions at the extrapolated midpoint, islands are solved as
//! local problems in r by sessions of the project's solvers ([`crate::crew`]), judged by the problem's own judge. Gyroscopic torque and the frames of torques are those of the last
//! pass; with the impulses found each body's rotation is solved exactly, and where that moves no velocity by more than the tolerance, the step is done.
//! A large island that is slow and whose contacts are new is first asked whether it may stay at rest ([`crate::crew`]): a pile that can stand stands.
//! A persistent contact has the velocity in its law at the extrapolated end of the step. Frémond's law has `w_T = (1 − θ)/θ u_{T,k}`: u_θ in place of u⁺.
//!
//! References: Moreau1988 and Jean1999 for the scheme, Acary2016 for its energy, SimoWong1991 for the rotation, Acary2018 for the index set.
//!
//! Energy: `T⁺ − T_k = Σ u_θ · r − s_θ · r + h v_θ · (m g + F) + h ω_θ · τ − (θ − ½) ‖v⁺ − v_k‖²_M`, s the velocity of surfaces that are moved; what is left is rounding.
//! Cost: W has a block for each pair of contacts that share a body. Fails (a status, never silence) where a contact problem is not solved, or where h ‖Ω‖ is so
//! large that passes do not contract.

use std::time::Instant;

use nonsmooth_linalg::Csc;
use nonsmooth_problem::{Bounds, Friction, RowsLocal};
use nonsmooth_scenes::Rotation;
use nonsmooth_scenes::vec3::{Mat3, Vec3, add, apply, cross, dot, norm, scale, sub};
use nonsmooth_solve::{Limits, Outcome, Status, settings::SettingsMap};

use crate::crew::{Asked, Crew, Slot};
use crate::detect::{Detector, Key, Near, Place};
use crate::islands::Islands;
use crate::joints::Joints;
use crate::moving::Moving;
use crate::report::{ContactReport, EnergyBalance, StepReport, StepStatus, Timings, worst_share};
use crate::rolling::{self, Roller, Turning};
use crate::rotation::{Pose, apply_transposed, cayley, inverse, unit};
use crate::state::{Remembered, State};
use crate::world::oscillation;
use crate::{
    Activation, BodyId, Compliance, Force, Geometry, Gyroscopic, Impact, MoreauJean, Motion,
    SimulateError, Stabilisation, World, Wrenches,
};

/// Six components of a body for each direction of a contact; the fourth place is for the processor.
type Columns = [[f64; 4]; 6];

/// One side of a contact.
#[derive(Debug, Clone, Copy)]
struct Arm {
    body: u32,
    sign: f64,
    free: bool,
    /// `(p − x) × d` in the world frame, for impulses and for velocities.
    moment: [Vec3; 3],
    moment_end: [Vec3; 3],
}

/// What one side of a contact is in the problem, in the frames of a pass. Apart from the contact, for it is written later, and large.
#[derive(Debug, Clone, Copy, Default)]
struct Side {
    /// Velocities of the body to relative velocities, and impulses to velocities of the body.
    rows: Columns,
    solved: Columns,
}

/// A contact of the index set.
#[derive(Debug, Clone, Copy)]
struct Row {
    mu: f64,
    /// What a normal impulse gives way by, over it.
    compliance: f64,
    place: Place,
    /// Directions of impulses and of velocities.
    frame: [Vec3; 3],
    frame_end: [Vec3; 3],
    /// Whether velocities are taken elsewhere than impulses.
    later: bool,
    arms: [Arm; 2],
    /// Velocity of what is moved, along the directions: at the end of the step (in the law), and weighted by θ (in the energy).
    given: [f64; 3],
    given_mean: [f64; 3],
    /// The same at the end of the step, along the directions of impulses.
    given_middle: [f64; 3],
    /// Relative velocity at the beginning.
    before: [f64; 3],
    /// What the law adds to u⁺.
    shift: [f64; 3],
    r: [f64; 3],
    /// Of rolling friction: the coefficient, the moments, and the given angular velocity of what is moved, in the law and in the energy.
    mu_r: f64,
    moment: [f64; 2],
    turned: [f64; 2],
    turned_mean: [f64; 2],
    warm: bool,
}

/// Where an island's contacts begin in the order of islands, where they end and its scalar rows begin, where these end.
type Span = (usize, usize, usize);

/// All memory of a simulation that is not its state.
pub(crate) struct Tools {
    detector: Detector,
    sizes: Vec<f64>,
    margins: Vec<f64>,
    reach: Vec<f64>,
    near: Vec<Near>,
    known: Vec<Option<Remembered>>,
    taken: Vec<bool>,
    axes: Vec<u8>,
    bodies: Vec<Moving>,
    rows: Vec<Row>,
    /// Of each row the sides.
    sides: Vec<[Side; 2]>,
    /// The inverse of each body's inertia, and whether that is isotropic.
    inertias: Vec<(Mat3, bool)>,
    /// For each contact near, its row.
    row_of: Vec<u32>,
    /// Contacts that take part whatever the forecast says, sorted.
    pub insisted: Vec<Key>,
    islands: Islands,
    pub joints: Joints,
    /// The scalar rows of each body in the island, and those of the island.
    levers: Vec<(u32, u32, u32)>,
    scalars: Vec<u32>,
    /// The first contact of each body in the island, and for each contact the next one of its two bodies.
    heads: Vec<u32>,
    next: Vec<[u32; 2]>,
    /// The free bodies of each contact in the island.
    pairs: Vec<[u32; 2]>,
    /// For each contact the place of the last block of its row of W that was mirrored, at first the diagonal one.
    mirrored: Vec<u32>,
    /// The free bodies of the island that is being solved, and for each body the last island that it was gathered for, counted through all steps.
    members: Vec<u32>,
    gathered: Vec<u64>,
    gatherings: u64,
    slots: Vec<Slot>,
    /// The islands that are not solved yet.
    open: Vec<u32>,
    crew: Crew,
    wrenches: Wrenches,
    middle: State,
    pub contacts: Vec<ContactReport>,
}

/// The solver of contact problems and its limits.
pub(crate) struct Inner<'a> {
    pub solver: &'a str,
    pub settings: &'a SettingsMap,
    pub limits: &'a Limits,
}

impl Inner<'_> {
    /// Whether the solver is the one that chooses for itself.
    fn is_auto(&self) -> bool {
        self.solver == "auto" && self.settings.is_empty()
    }
}

/// What the islands of a step have come to.
struct Solved {
    /// That of the first island that is not solved.
    status: StepStatus,
    passes: u32,
    residual: f64,
    iterations: usize,
    /// Contacts of the largest island.
    largest: usize,
    /// Wall clock of the solver.
    seconds: f64,
}

impl Default for Solved {
    fn default() -> Self {
        let status = StepStatus::Solved;
        Self { status, passes: 0, residual: 0.0, iterations: 0, largest: 0, seconds: 0.0 }
    }
}

const NONE: u32 = u32::MAX;
/// The most iterations on a problem that is linear.
const LINEAR: usize = 10;
/// Directions that differ by less are the same, relative.
const SAME: f64 = 1e-13;

impl Tools {
    pub fn new(world: &World, state: &State) -> Result<Self, SimulateError> {
        let detector = Detector::new(world)?;
        let sizes = detector.sizes(world.bodies.len());
        let reach = world
            .bodies
            .iter()
            .map(|b| {
                let finite = b.parts.iter().filter(|p| p.shape.radius().is_finite());
                finite.map(|p| norm(p.position) + p.shape.radius()).fold(0.0, f64::max)
            })
            .collect();
        let mut joints = Joints::new(world);
        joints.redundant = joints.redundant(world, state);
        let inertias = world.bodies.iter().map(|body| {
            let j = &body.inertia;
            let isotropic =
                j[0][0] == j[1][1] && j[1][1] == j[2][2] && [j[0][1], j[0][2], j[1][2]] == [0.0; 3];
            (if body.is_free() { inverse(j) } else { [[0.0; 3]; 3] }, isotropic)
        });
        let inertias = inertias.collect();
        Ok(Self {
            detector,
            sizes,
            reach,
            margins: vec![],
            near: vec![],
            known: vec![],
            taken: vec![],
            axes: vec![],
            bodies: vec![],
            rows: vec![],
            sides: vec![],
            inertias,
            row_of: vec![],
            insisted: vec![],
            islands: Islands::default(),
            joints,
            levers: vec![],
            scalars: vec![],
            heads: vec![],
            next: vec![],
            pairs: vec![],
            mirrored: vec![],
            members: vec![],
            gathered: vec![0; world.bodies.len()],
            gatherings: 0,
            slots: vec![],
            open: vec![],
            crew: Crew::new(1),
            wrenches: Wrenches::default(),
            middle: State { memory: Default::default(), ..state.clone() },
            contacts: vec![],
        })
    }

    /// Lets so many threads solve islands and look for contacts, 0 for one a core.
    pub fn set_threads(&mut self, threads: usize) {
        self.crew = Crew::new(threads);
    }

    /// How many threads were asked for.
    pub fn threads(&self) -> usize {
        self.crew.threads
    }

    /// Pairs of bodies that overlap by more than `share` of the smaller one, with the deepest penetration of each.
    /// What contacts give way by is no overlap.
    pub fn overlaps(
        &mut self,
        world: &World,
        state: &mut State,
        share: f64,
    ) -> Vec<(u32, u32, f64)> {
        let margins = vec![0.0; world.bodies.len()];
        self.detector.detect(world, state, &margins, self.crew.pool(), &mut self.near);
        let mut found: Vec<(u32, u32, f64)> = vec![];
        let hard = self.near.iter().filter(|n| n.compliance.is_none());
        for n in hard.filter(|n| n.place.gap < -share * n.size) {
            match found.last_mut() {
                Some(last) if (last.0, last.1) == (n.a, n.b) => last.2 = last.2.max(-n.place.gap),
                _ => found.push((n.a, n.b, -n.place.gap)),
            }
        }
        found
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

    /// Moves bodies of a world [at rest](World::at_rest) apart that overlap: the smallest displacement in the norm of the masses after which no gap is
    /// negative, to first order, is the velocity of a step of length 1 whose frictionless contacts, and limits of joints, have the gaps to close. Bodies are
    /// looked for within `depth`, m, of each other. What pushes is in the reports of contacts. Whether the problem was solved.
    pub fn part(
        &mut self,
        (world, state): (&World, &mut State),
        depth: f64,
        inner: &Inner,
    ) -> Result<bool, SimulateError> {
        const H: f64 = 1.0;
        let scheme = MoreauJean {
            theta: 1.0,
            gyroscopic: Gyroscopic::Off,
            geometry: Geometry::Frozen,
            activation: Activation::Gap,
            ..MoreauJean::default()
        };
        let zero = vec![[0.0; 3]; world.bodies.len()];
        let mut rest = State { velocity: zero.clone(), spin: zero, ..state.clone() };
        self.start(&scheme, world, &rest, &mut [], H);
        self.margins.iter_mut().for_each(|m| *m += depth);
        self.detector.detect(world, &mut rest, &self.margins, self.crew.pool(), &mut self.near);
        self.near.retain(|near| near.compliance.is_none());
        self.contacts(&scheme, world, &rest, H);
        self.joints.close_limits(world, H);
        for (near, &row) in self.near.iter().zip(&self.row_of) {
            let row = &mut self.rows[row as usize];
            (row.mu, row.shift, row.r) = (0.0, [near.place.gap / H, 0.0, 0.0], [0.0; 3]);
            (row.mu_r, row.moment) = (0.0, [0.0; 2]);
        }
        let solved = self.solve((&scheme, world), inner, H)?.status == StepStatus::Solved;
        self.commit(&scheme, world, &mut rest, H, &mut StepReport::begun(state.t, H));
        let places = rest.position.iter().flatten().chain(rest.rotation.iter().flatten());
        if places.map(|x| 0.0 * x).sum::<f64>() == 0.0 {
            (state.position, state.rotation) = (rest.position, rest.rotation);
        }
        Ok(solved)
    }

    /// Everything up to the velocities after the step; the state is as before but for the axes of its memory.
    pub fn attempt(
        &mut self,
        scheme: &MoreauJean,
        (world, state): (&World, &mut State),
        forces: &mut [Box<dyn Force>],
        inner: &Inner,
        h: f64,
    ) -> Result<StepReport, SimulateError> {
        let begun = Instant::now();
        let mut timings = Timings::default();
        let finite = self.start(scheme, world, state, forces, h);
        let mut report = StepReport::begun(state.t, h);
        if !finite {
            report.status = StepStatus::NotFinite;
            report.timings.total = begun.elapsed().as_secs_f64();
            return Ok(report);
        }
        let detecting = Instant::now();
        self.detector.detect(world, state, &self.margins, self.crew.pool(), &mut self.near);
        timings.detection = detecting.elapsed().as_secs_f64();
        self.contacts(scheme, world, state, h);
        let solved = self.solve((scheme, world), inner, h)?;
        report.newton = solved.passes;
        report.residual = solved.residual;
        report.counts.iterations = solved.iterations;
        report.counts.largest = solved.largest;
        let mut status = solved.status;
        let new = self.bodies.iter().flat_map(|b| [b.v_new, b.spin_new]).flatten();
        if !new.map(|x| 0.0 * x).sum::<f64>().is_finite() {
            status = StepStatus::NotFinite;
        }
        report.status = status;
        report.energy = self.energy(scheme, world, state, h);
        self.count(&mut report);
        timings.solve = solved.seconds;
        timings.total = begun.elapsed().as_secs_f64();
        timings.assembly = timings.total - timings.solve - timings.detection;
        report.timings = timings;
        Ok(report)
    }

    /// The contact problem of a step of length h in the first pass, all islands together; none without contacts.
    pub fn problem(
        &mut self,
        scheme: &MoreauJean,
        (world, state): (&World, &mut State),
        forces: &mut [Box<dyn Force>],
        h: f64,
    ) -> Result<Option<Friction>, SimulateError> {
        if !self.start(scheme, world, state, forces, h) {
            return Ok(None);
        }
        self.detector.detect(world, state, &self.margins, self.crew.pool(), &mut self.near);
        self.contacts(scheme, world, state, h);
        if self.rows.is_empty() && self.joints.rows.is_empty() {
            return Ok(None);
        }
        self.slots_for(1)?;
        for b in &mut self.bodies {
            b.pass(scheme, h);
        }
        let (contacts, scalars) = (self.rows.len(), self.joints.rows.len());
        self.islands.order.clear();
        self.islands.order.extend(0..(contacts + scalars) as u32);
        self.islands.ends.clear();
        self.islands.ends.push(contacts + scalars);
        let all = self.span(0);
        self.gather(all);
        self.columns(scheme, all);
        self.assemble(all, 0);
        let slot = &self.slots[0];
        Ok(Some(match &slot.rolling {
            Some(problem) => Friction::RollingLocal(problem.clone()),
            None => Friction::Local3(slot.problem.clone()),
        }))
    }

    /// Bodies at the beginning of a step, with forces and margins; false where something is no finite number.
    fn start(
        &mut self,
        scheme: &MoreauJean,
        world: &World,
        state: &State,
        forces: &mut [Box<dyn Force>],
        h: f64,
    ) -> bool {
        self.wrenches.clear(world.bodies.len());
        if !forces.is_empty() {
            let middle = &mut self.middle;
            middle.t = state.t + 0.5 * h;
            middle.steps = state.steps;
            for k in 0..world.bodies.len() {
                let to = advanced(state, k, 0.5 * h);
                middle.position[k] = to.0;
                middle.rotation[k] = to.1.0;
            }
            middle.velocity.clone_from(&state.velocity);
            middle.spin.clone_from(&state.spin);
            for force in forces.iter_mut() {
                force.add(middle, &mut self.wrenches);
            }
        }
        self.bodies.clear();
        self.margins.clear();
        let gravity = norm(world.gravity);
        let (gamma, slack) = match scheme.activation {
            Activation::Forecast { gamma, slack } => (gamma, slack),
            Activation::Gap => (1.0, 0.0),
        };
        let mut finite = true;
        for (k, body) in world.bodies.iter().enumerate() {
            let start = state.pose(k);
            let free = body.is_free();
            let (inverse, isotropic) = self.inertias[k];
            let weight = if free { scale(body.mass, world.gravity) } else { [0.0; 3] };
            let push = add(weight, add(body.force, self.wrenches.force[k]));
            let twist = add(body.torque, self.wrenches.torque[k]);
            let omega = apply(&start.r, state.spin[k]);
            let (mut middle, mut end) = (start, start);
            let (mut linear, mut angular) = ([[0.0; 3]; 2], [0.0; 3]);
            match body.motion {
                Motion::Free if scheme.geometry != Geometry::Frozen => {
                    for (pose, part) in [(&mut middle, 0.5), (&mut end, 1.0)] {
                        let (x, q) = advanced(state, k, part * h);
                        *pose = Pose { x, r: q.matrix() };
                    }
                }
                Motion::Free | Motion::Fixed => {}
                Motion::Surface { linear: l, angular: a } => (linear, angular) = ([l; 2], a),
                Motion::Oscillating { amplitude, frequency, phase } => {
                    let at = |t: f64| oscillation(amplitude, frequency, phase, t);
                    linear = [at(state.t).1, at(state.t + h).1];
                    if scheme.geometry != Geometry::Frozen {
                        middle.x = add(body.position, at(state.t + 0.5 * h).0);
                        end.x = add(body.position, at(state.t + h).0);
                    }
                }
            }
            let speed = match body.motion {
                Motion::Free => norm(state.velocity[k]) + norm(omega) * self.reach[k],
                Motion::Fixed | Motion::Surface { .. } => 0.0,
                Motion::Oscillating { amplitude, frequency, .. } => {
                    norm(amplitude) * frequency.abs()
                }
            };
            let fall = if free { h * h * gravity } else { 0.0 };
            let least = (1e-6_f64).max(slack) * self.sizes[k];
            self.margins.push((gamma + 1.0) * h * speed + fall + least);
            let check: f64 = push.iter().chain(&twist).map(|x| 0.0 * x).sum();
            finite &= check == 0.0;
            self.bodies.push(Moving {
                free,
                isotropic,
                mass: body.mass,
                inertia: body.inertia,
                inverse,
                radius: self.reach[k].max(self.sizes[k]),
                start,
                v: state.velocity[k],
                spin: if isotropic { omega } else { state.spin[k] },
                push: scale(h, push),
                twist: scale(h, twist),
                weight,
                middle,
                end,
                linear,
                angular,
                frame: [[0.0; 3]; 3],
                frame_end: [[0.0; 3]; 3],
                v_new: state.velocity[k],
                spin_new: if isotropic { omega } else { state.spin[k] },
                v_free: [0.0; 3],
                spin_free: [0.0; 3],
                impulse: [0.0; 3],
                moment: [0.0; 3],
            });
            let b = self.bodies.last_mut().expect("pushed");
            if free {
                b.rotate(scheme, h);
            }
        }
        if self.joints.redundant.is_some() && scheme.geometry != Geometry::Frozen {
            self.close_middle(world, state, h);
        }
        finite
    }

    /// Puts the extrapolated middle of the step on the joints: elsewhere equations that follow from the others where a loop is closed contradict them, and the
    /// loop would be locked.
    fn close_middle(&mut self, world: &World, state: &State, h: f64) {
        let Self { middle, bodies, joints, .. } = self;
        middle.t = state.t + 0.5 * h;
        middle.memory.angles.clone_from(&state.memory.angles);
        for (k, body) in bodies.iter().enumerate() {
            middle.position[k] = body.middle.x;
            middle.rotation[k] = match body.free {
                true => advanced(state, k, 0.5 * h).1.0,
                false => state.rotation[k],
            };
        }
        joints.project(world, middle);
        for (k, body) in bodies.iter_mut().enumerate().filter(|b| b.1.free) {
            body.middle = middle.pose(k);
        }
    }

    /// Index set, frames, warm starts, islands.
    fn contacts(&mut self, scheme: &MoreauJean, world: &World, state: &State, h: f64) {
        self.recall(state);
        self.rows.clear();
        self.row_of.clear();
        self.axes.clear();
        let rest = 2.0 * h * norm(world.gravity);
        let scaled = state.memory.scaled(h);
        for (k, near) in self.near.iter().enumerate() {
            let known = self.known[k];
            let axis = tangent_axis(near.place.normal, known.map(|m| m.axis));
            self.axes.push(axis);
            let [a, b] = [near.a, near.b].map(|i| &self.bodies[i as usize]);
            let n = near.place.normal;
            let approach =
                dot(n, sub(b.velocity_at(near.place.point), a.velocity_at(near.place.point)));
            let gap = near.place.gap;
            let extrapolated = scheme.geometry != Geometry::Frozen;
            let persistent = known.is_some_and(|m| m.active);
            let active = match scheme.activation {
                Activation::Forecast { gamma, slack } => {
                    let slack = slack * near.size;
                    let beyond = gap + gamma * h * approach - slack;
                    // What runs along a curved surface leaves it by as much as a step is curved: that is no separation.
                    beyond <= 0.0
                        || (persistent && extrapolated && {
                            let end = near.witness.place(&a.end, &b.end, n);
                            let turned = norm(sub(end.normal, n));
                            beyond <= turned * norm(sub(end.point, near.place.point))
                        })
                }
                Activation::Gap => true,
            };
            // A spring acts where it is compressed at the end of the step.
            let active = match near.compliance {
                Some(_) => gap + h * approach.min(0.0) <= 0.0,
                None => active,
            };
            if !active && self.insisted.binary_search(&near.key).is_err() {
                self.row_of.push(NONE);
                continue;
            }
            self.row_of.push(self.rows.len() as u32);
            let at_middle = near.witness.place(&a.middle, &b.middle, n);
            // A body that nothing moves has no momentum to keep: the arm ends on the surface of the other one. Else both arms end midway.
            let on_surface = |place: Place| {
                let half = 0.5 * (f64::from(u8::from(b.free)) - f64::from(u8::from(a.free)));
                Place { point: add(place.point, scale(half * place.gap, place.normal)), ..place }
            };
            let at_middle =
                Place { normal: if near.deep { n } else { at_middle.normal }, ..at_middle };
            let place = on_surface(at_middle);
            let frame = frame(place.normal, axis);
            let pushed = known.is_some_and(|m| m.impulse != [0.0; 3]);
            let persists = persistent && (near.law.e == 0.0 || approach >= -rest);
            let later = persists && extrapolated && !near.deep;
            let (place_end, frame_end) = match later {
                true => {
                    let place = on_surface(near.witness.place(&a.end, &b.end, place.normal));
                    (place, transported(&frame, place.normal))
                }
                false => (place, frame),
            };
            let arm = |body: u32, sign: f64| {
                let b = &self.bodies[body as usize];
                let x_end = if later { b.end.x } else { b.middle.x };
                let free = b.free;
                let moment = frame.map(|d| cross(sub(place.point, b.middle.x), d));
                let moment_end = frame_end.map(|d| cross(sub(place_end.point, x_end), d));
                Arm { body, sign, free, moment, moment_end }
            };
            let mut arms = [arm(near.a, -1.0), arm(near.b, 1.0)];
            // Where nothing moves the two ends are the same up to rounding; then W is symmetric to the last bit.
            let mut frame_end = frame_end;
            let far = |p: &[Vec3; 3], q: &[Vec3; 3]| {
                (0..3).map(|i| norm(sub(p[i], q[i]))).fold(0.0, f64::max)
            };
            let apart = arms.iter().map(|a| far(&a.moment, &a.moment_end)).fold(0.0, f64::max);
            let later = later && (far(&frame, &frame_end) > SAME || apart > SAME * near.size);
            if !later {
                frame_end = frame;
                arms.iter_mut().for_each(|a| a.moment_end = a.moment);
            }
            let [mut given, mut given_mean, mut given_middle, mut before] = [[0.0; 3]; 4];
            let [mut turned, mut turned_mean] = [[0.0; 2]; 2];
            let theta = scheme.theta;
            for Arm { body, sign, moment, .. } in &arms {
                let m = &self.bodies[*body as usize];
                if m.free {
                    let omega = m.omega(m.spin);
                    for i in 0..3 {
                        before[i] += sign * (dot(frame[i], m.v) + dot(moment[i], omega));
                    }
                } else {
                    let [first, last] = m.linear;
                    let turn = |p: Vec3| cross(m.angular, sub(p, m.start.x));
                    let (mid, end) = (turn(place.point), turn(place_end.point));
                    for i in 0..3 {
                        let of = |v: Vec3| sign * dot(frame[i], add(v, mid));
                        before[i] += of(first);
                        given[i] += sign * dot(frame_end[i], add(last, end));
                        given_middle[i] += of(last);
                        given_mean[i] += theta * of(last) + (1.0 - theta) * of(first);
                    }
                    for k in 0..2 {
                        turned[k] += sign * dot(frame_end[1 + k], m.angular);
                        turned_mean[k] += sign * dot(frame[1 + k], m.angular);
                    }
                }
            }
            let law = near.law;
            let mut shift = [0.0, law.e_t * before[1], law.e_t * before[2]];
            if scheme.impact == Impact::Fremond && !(persists && known.is_some_and(|m| m.stuck)) {
                let share = (1.0 - theta) / theta;
                shift = [0.0, share * before[1], share * before[2]];
            }
            // Restitution on approach only, and in the gap's form only where it is closed.
            let closed = scheme.activation != Activation::Gap || gap <= 0.0;
            if closed && before[0] < -scheme.restitution_threshold {
                shift[0] = law.e * before[0];
            }
            let compliance = near.compliance.map_or(0.0, |Compliance { stiffness, damping }| {
                let resistance = damping + h * stiffness;
                shift[0] = stiffness * gap / resistance;
                1.0 / (h * resistance)
            });
            if scheme.activation == Activation::Gap && near.compliance.is_none() {
                shift[0] += gap.max(0.0) / h;
            }
            let r = match known.filter(|_| pushed) {
                Some(m) => clipped(frame.map(|d| scaled * dot(d, m.impulse)), law.mu),
                None => [0.0; 3],
            };
            let moment = match known.filter(|_| law.mu_r > 0.0) {
                Some(m) => {
                    let of = |t: Vec3| scaled * dot(t, m.moment);
                    rolling::clipped([of(frame[1]), of(frame[2])], law.mu_r, r[0])
                }
                None => [0.0; 2],
            };
            self.rows.push(Row {
                mu_r: law.mu_r,
                moment,
                turned,
                turned_mean,
                mu: law.mu,
                compliance,
                place,
                frame,
                frame_end,
                later,
                arms,
                given,
                given_mean,
                given_middle,
                before,
                shift,
                r,
                warm: pushed,
            });
        }
        self.joints.begin(scheme, world, state, &self.bodies, h);
        let Self { rows, joints, islands, bodies, .. } = self;
        let contacts = rows.iter().map(|row| row.arms.each_ref().map(|a| a.free.then_some(a.body)));
        let scalars = (0..joints.rows.len()).map(|k| joints.levers(k));
        islands.find(bodies.len(), |join| {
            contacts.for_each(|pair| join(&mut pair.into_iter().flatten()));
            scalars.for_each(|levers| join(&mut levers.iter().map(|l| l.body)));
        });
        // Where rows of joints act on a body its contacts have one direction for impulses and velocities: a problem has one V for both.
        if !joints.rows.is_empty() {
            let mut jointed = vec![false; bodies.len()];
            for k in 0..joints.rows.len() {
                joints.levers(k).iter().for_each(|l| jointed[l.body as usize] = true);
            }
            let touched = |row: &Row| row.arms.iter().any(|a| a.free && jointed[a.body as usize]);
            rows.iter_mut().filter(|row| row.later && touched(row)).for_each(Row::at_the_middle);
        }
    }

    /// Where the contacts of island k begin in the order, where they end and its scalar rows begin, where these end.
    fn span(&self, k: usize) -> Span {
        let first = if k == 0 { 0 } else { self.islands.ends[k - 1] };
        let end = self.islands.ends[k];
        let contacts = self.rows.len() as u32;
        let order = &self.islands.order[first..end];
        (first, first + order.partition_point(|&c| c < contacts), end)
    }

    /// For each contact near what is remembered of it: by its key, else the nearest of the same two shapes with nearly the same normal.
    fn recall(&mut self, state: &State) {
        let memory = &state.memory.contacts;
        self.known.clear();
        self.taken.clear();
        self.taken.resize(memory.len(), false);
        let mut m = 0;
        for near in &self.near {
            while m < memory.len() && memory[m].key < near.key {
                m += 1;
            }
            let same = m < memory.len() && memory[m].key == near.key;
            if same {
                self.taken[m] = true;
            }
            self.known.push(same.then(|| memory[m]));
        }
        let pair = |key: Key| (key.shape_a, key.shape_b);
        for (near, known) in self.near.iter().zip(&mut self.known) {
            if known.is_some() {
                continue;
            }
            let first = memory.partition_point(|m| pair(m.key) < pair(near.key));
            let mut best = (0.05 * near.size, None);
            for (k, m) in memory.iter().enumerate().skip(first) {
                if pair(m.key) != pair(near.key) {
                    break;
                }
                let far = norm(sub(m.point, near.place.point));
                if !self.taken[k] && far < best.0 && dot(m.normal, near.place.normal) > 0.95 {
                    best = (far, Some(k));
                }
            }
            if let Some(k) = best.1 {
                self.taken[k] = true;
                *known = Some(memory[k]);
            }
        }
        for (near, known) in self.near.iter_mut().zip(&self.known).filter(|n| n.0.deep) {
            if let Some(m) = known.filter(|m| m.key == near.key) {
                near.place.normal = m.normal;
            }
        }
    }

    /// The scalar rows of an island, by their places among those of the step, and its free bodies.
    fn gather(&mut self, span: Span) {
        let Self { islands, rows, joints, scalars, members, gathered, gatherings, .. } = self;
        *gatherings += 1;
        let contacts = rows.len() as u32;
        members.clear();
        let mut meet = |body: u32| {
            let last = &mut gathered[body as usize];
            if *last != *gatherings {
                *last = *gatherings;
                members.push(body);
            }
        };
        for &c in &islands.order[span.0..span.1] {
            let arms = &rows[c as usize].arms;
            arms.iter().filter(|a| a.free).for_each(|a| meet(a.body));
        }
        scalars.clear();
        scalars.extend(islands.order[span.1..span.2].iter().map(|k| k - contacts));
        for &k in scalars.iter() {
            joints.levers(k as usize).iter().for_each(|l| meet(l.body));
        }
    }

    fn slots_for(&mut self, islands: usize) -> Result<(), SimulateError> {
        while self.slots.len() < islands {
            self.slots.push(Slot::new()?);
        }
        Ok(())
    }

    /// Solves the islands: in each pass all that are not done are stated, solved by the crew, and looked at, in their order.
    fn solve(
        &mut self,
        (scheme, world): (&MoreauJean, &World),
        inner: &Inner,
        h: f64,
    ) -> Result<Solved, SimulateError> {
        let count = self.islands.ends.len();
        self.slots_for(count)?;
        self.open.clear();
        self.open.extend(0..count as u32);
        let mut solved = Solved::default();
        for k in 0..count {
            let (first, end, _) = self.span(k);
            solved.largest = solved.largest.max(end - first);
        }
        while !self.open.is_empty() {
            solved.passes += 1;
            let mut open = std::mem::take(&mut self.open);
            for &k in &open {
                self.state(scheme, k as usize, (solved.passes, inner), world, h);
            }
            let begun = Instant::now();
            self.crew.solve(&mut self.slots[..count], &open, inner)?;
            solved.seconds += begun.elapsed().as_secs_f64();
            let mut taken = Ok(());
            open.retain(|&k| {
                let again = self.take_up((scheme, world), k as usize, &mut solved, h);
                again.unwrap_or_else(|e| {
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
    fn state(
        &mut self,
        scheme: &MoreauJean,
        k: usize,
        (pass, inner): (u32, &Inner),
        world: &World,
        h: f64,
    ) {
        let span = self.span(k);
        self.gather(span);
        for &b in &self.members {
            self.bodies[b as usize].pass(scheme, h);
        }
        self.columns(scheme, span);
        let finite = self.assemble(span, k);
        let rest = 2.0 * h * norm(world.gravity);
        let may_rest = pass == 1 && inner.is_auto() && self.may_rest(span, rest);
        let slot = &mut self.slots[k];
        // Equations alone are solved at once, or not at all.
        let linear = slot.problem.rows.as_ref().is_some_and(|r| r.bounds.are_free());
        let linear = linear && slot.problem.mu.is_empty();
        slot.asked = Asked { finite, may_rest, most: if linear { LINEAR } else { usize::MAX } };
    }

    /// Takes the impulses that the solver found for island k; whether another pass is due.
    fn take_up(
        &mut self,
        (scheme, world): (&MoreauJean, &World),
        k: usize,
        solved: &mut Solved,
        h: f64,
    ) -> Result<bool, SimulateError> {
        let Some(outcome) = self.slots[k].outcome.take() else {
            solved.residual = f64::NAN;
            solved.status = StepStatus::NotFinite;
            return Ok(false);
        };
        let outcome: Outcome = outcome?;
        let span = self.span(k);
        self.gather(span);
        let point = &self.slots[k].point;
        for c in span.0..span.1 {
            let row = &mut self.rows[self.islands.order[c] as usize];
            let rolls = self.slots[k].rolling.is_some();
            let r = &point.r[if rolls { 5 } else { 3 } * (c - span.0)..];
            row.r.copy_from_slice(&r[..3]);
            if rolls {
                row.moment.copy_from_slice(&r[3..5]);
            }
        }
        for (&k, lambda) in self.scalars.iter().zip(&point.lambda) {
            self.joints.rows[k as usize].lambda = *lambda;
        }
        let mut change = self.respond(scheme, span, h);
        if scheme.geometry == Geometry::Midpoint && !self.scalars.is_empty() {
            change = change.max(self.recentre(scheme, world, h));
        }
        solved.iterations += outcome.iterations;
        let again = change > scheme.tolerance || change.is_nan();
        let ended = if outcome.status != Status::Solved {
            StepStatus::Solver(outcome.status)
        } else if !again {
            StepStatus::Solved
        } else if solved.passes >= scheme.passes || !change.is_finite() {
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

    /// Whether the bodies of an island are slower than `rest` while most of its contacts are new, so that no impulses of the step before lead on.
    fn may_rest(&self, span: Span, rest: f64) -> bool {
        let slow = |&b: &u32| {
            let b = &self.bodies[b as usize];
            norm(b.v) + norm(b.spin) * b.radius <= rest
        };
        let order = &self.islands.order[span.0..span.1];
        let warm = order.iter().filter(|&&c| self.rows[c as usize].warm).count();
        self.scalars.is_empty() && 2 * warm < order.len() && self.members.iter().all(slow)
    }

    /// Takes the joints of the island at the middle that this pass has come to; how far that has moved the bodies since the last one, relative.
    fn recentre(&mut self, scheme: &MoreauJean, world: &World, h: f64) -> f64 {
        let Self { members, bodies, joints, scalars, .. } = self;
        let (mut moved, mut size): (f64, f64) = (0.0, f64::MIN_POSITIVE);
        for &k in members.iter() {
            let b = &mut bodies[k as usize];
            let pose = b.mean_pose(scheme, h);
            let turned = |r: &Mat3| r.iter().flatten().map(|x| x * x).sum::<f64>().sqrt();
            let turn: Mat3 = std::array::from_fn(|i| sub(pose.r[i], b.middle.r[i]));
            let far = norm(sub(pose.x, b.middle.x)) + b.radius * turned(&turn);
            moved = if far > moved || far.is_nan() { far } else { moved };
            let speed =
                norm(b.v).max(norm(b.v_new)) + norm(b.spin).max(norm(b.spin_new)) * b.radius;
            size = size.max(0.5 * h * (speed + norm(b.push) / b.mass));
            b.middle = pose;
        }
        joints.place_at(world, scalars, |k| bodies[k as usize].middle);
        moved / size
    }

    /// The columns of H and the rows of the velocities, in the frames of this pass.
    fn columns(&mut self, scheme: &MoreauJean, span: Span) {
        self.joints.columns(scheme, &self.scalars, &self.bodies);
        self.sides.resize(self.rows.len(), [Side::default(); 2]);
        for &c in &self.islands.order[span.0..span.1] {
            let row = &self.rows[c as usize];
            let sides = row.arms.iter().zip(&mut self.sides[c as usize]);
            for (arm, side) in sides.filter(|a| a.0.free) {
                let b = &self.bodies[arm.body as usize];
                for i in 0..3 {
                    let column = apply(&b.frame, arm.moment[i]);
                    let turned = match row.later {
                        true => apply(&b.frame_end, arm.moment_end[i]),
                        false => column,
                    };
                    let solved = apply(&b.inverse, column);
                    for k in 0..3 {
                        side.rows[k][i] = arm.sign * row.frame_end[i][k];
                        side.rows[3 + k][i] = arm.sign * turned[k];
                        side.solved[k][i] = arm.sign * row.frame[i][k] / b.mass;
                        side.solved[3 + k][i] = arm.sign * solved[k];
                    }
                }
            }
        }
    }

    /// States the contact problem of an island in slot k; false where it has a number that is not finite.
    fn assemble(&mut self, span: Span, k: usize) -> bool {
        let Self {
            islands,
            rows,
            sides,
            bodies,
            joints,
            scalars,
            heads,
            next,
            pairs,
            mirrored,
            slots,
            ..
        } = self;
        let order = &islands.order[span.0..span.1];
        let n = order.len();
        // The contacts of each body as a list, in order: made from the back.
        heads.resize(bodies.len(), NONE);
        next.clear();
        next.resize(n, [NONE; 2]);
        pairs.clear();
        pairs.extend(order.iter().map(|&c| {
            let free = |a: &Arm| if a.free { a.body } else { NONE };
            rows[c as usize].arms.each_ref().map(free)
        }));
        for &body in pairs.iter().flatten().filter(|&&b| b != NONE) {
            heads[body as usize] = NONE;
        }
        for &k in scalars.iter() {
            joints.levers(k as usize).iter().for_each(|l| heads[l.body as usize] = NONE);
        }
        for c in (0..n).rev() {
            for (side, &body) in pairs[c].iter().enumerate().filter(|b| *b.1 != NONE) {
                next[c][side] = std::mem::replace(&mut heads[body as usize], c as u32);
            }
        }
        let after = |c: u32, body: u32| {
            let side = usize::from(pairs[c as usize][0] != body);
            next[c as usize][side]
        };
        let Slot { problem, point, .. } = &mut slots[k];
        problem.W.clear(n);
        problem.q.clear();
        problem.mu.clear();
        point.r.clear();
        let mut check = 0.0;
        let symmetric = order.iter().all(|&c| !rows[c as usize].later);
        mirrored.clear();
        mirrored.resize(n, 0_u32);
        for c in 0..n {
            let row = &rows[order[c] as usize];
            problem.mu.push(row.mu);
            point.r.extend_from_slice(&row.r);
            for i in 0..3 {
                let mut q = row.given[i] + row.shift[i];
                for (arm, side) in row.arms.iter().zip(&sides[order[c] as usize]) {
                    if arm.free {
                        let b = &bodies[arm.body as usize];
                        q += side.velocity(i, b.v_free, b.spin_free);
                    }
                }
                problem.q.push(q);
                check += 0.0 * q;
            }
            let mut width = 0;
            // The contacts of the two bodies, merged; a body that is not free has none.
            let own = pairs[c];
            let [mut p, mut q] = own.map(|b| if b == NONE { NONE } else { heads[b as usize] });
            while p.min(q) != NONE {
                let j = p.min(q);
                if p == j {
                    p = after(j, own[0]);
                }
                if q == j {
                    q = after(j, own[1]);
                }
                let block = if symmetric && (j as usize) < c {
                    // Row j has met later contacts in the order in which they ask for it.
                    let at = &mut mirrored[j as usize];
                    *at += 1;
                    let there = &problem.W.row(j as usize).1[*at as usize];
                    std::array::from_fn(|p| std::array::from_fn(|q| there[q][p]))
                } else {
                    let other = &sides[order[j as usize] as usize];
                    let mut block =
                        coupling((own, &sides[order[c] as usize]), (pairs[j as usize], other));
                    if j as usize == c {
                        mirrored[c] = width;
                        block[0][0] += row.compliance;
                    }
                    block
                };
                width += 1;
                check += 0.0 * (block[0][0] + block[1][1] + block[2][2]);
                problem.W.push(j as usize, block);
            }
            problem.W.end_row();
        }
        check == 0.0 && self.state_rows(span, k) && self.state_rolling(span, k)
    }

    /// The problem of an island with rolling friction, where a contact has any, in slot k beside that without.
    fn state_rolling(&mut self, span: Span, k: usize) -> bool {
        let Self { islands, rows, sides, bodies, joints, scalars, slots, .. } = self;
        let Slot { problem, rolling, point, .. } = &mut slots[k];
        let order = &islands.order[span.0..span.1];
        *rolling = None;
        if order.iter().all(|&c| rows[c as usize].mu_r == 0.0) {
            return true;
        }
        let roller = |&c: &u32| {
            let (row, side) = (&rows[c as usize], &sides[c as usize]);
            let turning = row.arms.each_ref().map(|arm| {
                if !arm.free {
                    return Turning::default();
                }
                let b = &bodies[arm.body as usize];
                let of = |k: usize| {
                    let later = if row.later { &b.frame_end } else { &b.frame };
                    let moved = scale(arm.sign, apply(later, row.frame_end[1 + k]));
                    let pushed = scale(arm.sign, apply(&b.frame, row.frame[1 + k]));
                    (moved, apply(&b.inverse, pushed))
                };
                let [one, two] = [of(0), of(1)];
                Turning { rows: [one.0, two.0], solved: [one.1, two.1] }
            });
            let angular = |columns: &Columns| {
                std::array::from_fn(|i| std::array::from_fn(|k| columns[3 + k][i]))
            };
            let spin = |k: usize| {
                let free = row.arms.iter().zip(&turning).filter(|a| a.0.free);
                free.map(|(a, t)| dot(t.rows[k], bodies[a.body as usize].spin_free)).sum::<f64>()
            };
            Roller {
                mu_r: row.mu_r,
                bodies: row.arms.each_ref().map(|a| a.free.then_some(a.body)),
                rows: side.each_ref().map(|s| angular(&s.rows)),
                solved: side.each_ref().map(|s| angular(&s.solved)),
                free: [0, 1].map(|k| row.turned[k] + spin(k)),
                start: row.moment,
                sides: turning,
            }
        };
        let rollers: Vec<Roller> = order.iter().map(roller).collect();
        let levers = scalars.iter().enumerate().flat_map(|(j, &k)| {
            let each = joints.levers(k as usize).iter();
            each.map(move |l| (l.body, j, [l.solved[3], l.solved[4], l.solved[5]]))
        });
        let levers: Vec<_> = levers.collect();
        let (stated, start) = rolling::problem(problem, &rollers, &levers, &point.r);
        let finite = stated.q.iter().map(|x| 0.0 * x).sum::<f64>() == 0.0
            && stated.W.blocks().iter().flatten().flatten().map(|x| 0.0 * x).sum::<f64>() == 0.0;
        (*rolling, point.r) = (Some(stated), start);
        finite
    }

    /// The scalar rows of an island, in slot k, after its contacts: `V`, `R`, `s` and the bounds.
    #[allow(non_snake_case)]
    fn state_rows(&mut self, span: Span, k: usize) -> bool {
        let Self {
            islands, rows, sides, bodies, joints, levers, scalars, slots, heads, next, ..
        } = self;
        let Slot { problem, point, .. } = &mut slots[k];
        point.lambda.clear();
        if scalars.is_empty() {
            problem.rows = None;
            return true;
        }
        let order = &islands.order[span.0..span.1];
        levers.clear();
        for (j, &k) in scalars.iter().enumerate() {
            let each = joints.levers(k as usize).iter().enumerate();
            levers.extend(each.map(|(l, lever)| (lever.body, j as u32, l as u32)));
        }
        levers.sort_unstable();
        let (n, p) = (order.len(), scalars.len());
        let (mut v, mut r) = (vec![], vec![]);
        let lever =
            |(_, j, l): (u32, u32, u32)| &joints.levers(scalars[j as usize] as usize)[l as usize];
        for same in levers.chunk_by(|a, b| a.0 == b.0) {
            let body = same[0].0;
            for &e in same {
                let solved = &lever(e).solved;
                // One half and its mirror image: the other differs by rounding, and rounding is no coupling.
                for &other in same.iter().filter(|o| o.1 <= e.1) {
                    let row = &lever(other).row;
                    let entry: f64 = row.iter().zip(solved).map(|(a, b)| a * b).sum();
                    let (i, j) = (other.1 as usize, e.1 as usize);
                    r.push((i, j, entry));
                    if i != j {
                        r.push((j, i, entry));
                    }
                }
                let mut c = heads[body as usize];
                while c != NONE {
                    let row = order[c as usize] as usize;
                    let side = usize::from(rows[row].arms[0].body != body);
                    for i in 0..3 {
                        let arm = &sides[row][side].rows;
                        let entry: f64 = (0..6).map(|k| arm[k][i] * solved[k]).sum();
                        v.push((3 * c as usize + i, e.1 as usize, entry));
                    }
                    c = next[c as usize][side];
                }
            }
        }
        let (mut lower, mut upper, mut s) = (vec![], vec![], vec![]);
        for (j, &k) in scalars.iter().enumerate() {
            let row = &joints.rows[k as usize];
            let mut free = row.shift;
            for lever in joints.levers(k as usize) {
                let b = &bodies[lever.body as usize];
                free += lever.rate(b.v_free, b.spin_free);
            }
            s.push(free);
            lower.push(row.bounds[0]);
            upper.push(row.bounds[1]);
            point.lambda.push(row.lambda);
            r.push((j, j, row.compliance));
        }
        let finite = r.iter().chain(&v).all(|e| e.2.is_finite()) && s.iter().all(|x| x.is_finite());
        let (of_contacts, own) =
            (Csc::from_triplets(3 * n, p, v.into_iter()), Csc::from_triplets(p, p, r.into_iter()));
        let (V, R) = (of_contacts.expect("in range"), own.expect("in range"));
        problem.rows = Some(RowsLocal { V, R, s, bounds: Bounds { lower, upper } });
        finite
    }

    /// Velocities after the step with the impulses of an island; how much solving the rotations exactly has changed them, relative.
    fn respond(&mut self, scheme: &MoreauJean, span: Span, h: f64) -> f64 {
        let Self { islands, rows, bodies, members, joints, scalars, .. } = self;
        let order = &islands.order[span.0..span.1];
        for &b in members.iter() {
            let b = &mut bodies[b as usize];
            (b.impulse, b.moment) = ([0.0; 3], [0.0; 3]);
        }
        for &c in order {
            let row = &rows[c as usize];
            for arm in row.arms.iter().filter(|a| a.free) {
                let b = &mut bodies[arm.body as usize];
                for i in 0..3 {
                    let x = arm.sign * row.r[i];
                    b.impulse = add(b.impulse, scale(x, row.frame[i]));
                    b.moment = add(b.moment, scale(x, arm.moment[i]));
                }
                for k in 0..2 {
                    b.moment = add(b.moment, scale(arm.sign * row.moment[k], row.frame[1 + k]));
                }
            }
        }
        for &k in scalars.iter() {
            let lambda = joints.rows[k as usize].lambda;
            for lever in joints.levers(k as usize) {
                let b = &mut bodies[lever.body as usize];
                b.impulse = add(b.impulse, scale(lambda, lever.force));
                b.moment = add(b.moment, scale(lambda, lever.moment));
            }
        }
        let (mut change, mut size): (f64, f64) = (0.0, f64::MIN_POSITIVE);
        for &b in members.iter() {
            let b = &mut bodies[b as usize];
            let linear = add(b.spin_free, apply(&b.inverse, apply(&b.frame, b.moment)));
            b.rotate(scheme, h);
            let moved = norm(sub(b.spin_new, linear)) * b.radius;
            // Larger of the two, or the one that is no number.
            change = if moved > change || moved.is_nan() { moved } else { change };
            let spin = norm(b.spin).max(norm(b.spin_new)) * b.radius;
            size = size.max(norm(b.v)).max(norm(b.v_new)).max(spin);
            size = size.max(norm(b.push) / b.mass);
        }
        change / size
    }

    fn energy(&self, scheme: &MoreauJean, world: &World, state: &State, h: f64) -> EnergyBalance {
        let theta = scheme.theta;
        let mean = |old: Vec3, new: Vec3| add(scale(theta, new), scale(1.0 - theta, old));
        let mut e = EnergyBalance::default();
        for (k, b) in self.bodies.iter().enumerate().filter(|b| b.1.free) {
            let kinetic = |v: Vec3, spin: Vec3| {
                0.5 * (b.mass * dot(v, v) + dot(spin, apply(&b.inertia, spin)))
            };
            let (v, spin) = (mean(b.v, b.v_new), mean(b.spin, b.spin_new));
            e.kinetic_before += kinetic(b.v, b.spin);
            e.kinetic += kinetic(b.v_new, b.spin_new);
            let (dv, ds) = (sub(b.v_new, b.v), sub(b.spin_new, b.spin));
            e.numerical += 2.0 * (theta - 0.5) * kinetic(dv, ds);
            let gravity = h * dot(b.weight, v);
            let given = sub(b.push, scale(h, b.weight));
            let forces = dot(given, v) + dot(b.twist, b.omega(spin));
            e.gravity += gravity;
            e.forces += forces;
            let x = add(state.position[k], scale(h, v));
            e.potential -= b.mass * dot(world.gravity, x);
            let fall = h * norm(world.gravity);
            e.scale += gravity.abs() + forces.abs() + 0.5 * b.mass * fall * fall;
        }
        for row in &self.rows {
            let motion = row.arms.each_ref().map(|arm| {
                let b = &self.bodies[arm.body as usize];
                (mean(b.v, b.v_new), b.omega(mean(b.spin, b.spin_new)))
            });
            for i in 0..3 {
                let mut u = row.given_mean[i];
                for (arm, (v, omega)) in row.arms.iter().zip(motion).filter(|a| a.0.free) {
                    u += arm.sign * (dot(row.frame[i], v) + dot(arm.moment[i], omega));
                }
                let work = u * row.r[i];
                if i == 0 {
                    e.normal += work
                } else {
                    e.tangential += work
                }
                let drive = row.given_mean[i] * row.r[i];
                e.drives -= drive;
                e.scale += work.abs() + drive.abs();
            }
            for k in 0..2 {
                let sides = row.arms.iter().zip(motion).filter(|a| a.0.free);
                let turn = |(arm, (_, omega)): (&Arm, (Vec3, Vec3))| {
                    arm.sign * dot(row.frame[1 + k], omega)
                };
                let given = row.turned_mean[k] * row.moment[k];
                let work = given + row.moment[k] * sides.map(turn).sum::<f64>();
                e.tangential += work;
                e.drives -= given;
                e.scale += work.abs() + given.abs();
            }
        }
        for (k, row) in self.joints.rows.iter().enumerate() {
            for lever in self.joints.levers(k) {
                let b = &self.bodies[lever.body as usize];
                let (v, omega) = (mean(b.v, b.v_new), b.omega(mean(b.spin, b.spin_new)));
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

    fn count(&self, report: &mut StepReport) {
        let counts = &mut report.counts;
        counts.near = self.near.len();
        counts.deep = self.near.iter().filter(|n| n.deep).count();
        counts.active = self.rows.len();
        counts.islands = self.islands.ends.len();
        counts.rows = self.joints.rows.len();
        counts.warm = self.rows.iter().filter(|row| row.warm).count();
        let gaps = self.near.iter().map(|n| -n.place.gap);
        report.drift.penetration = gaps.fold(0.0, f64::max);
    }

    /// Takes the step: velocities and configuration, what is remembered, the reports of contacts and joints. Says how far quaternions were from length one, and
    /// joints are from closed.
    pub fn commit(
        &mut self,
        scheme: &MoreauJean,
        world: &World,
        state: &mut State,
        h: f64,
        StepReport { drift, energy, counts, .. }: &mut StepReport,
    ) {
        let theta = scheme.theta;
        let mut off: f64 = 0.0;
        for (k, b) in self.bodies.iter().enumerate() {
            if let Motion::Oscillating { amplitude, frequency, phase } = world.bodies[k].motion {
                let (x, v) = oscillation(amplitude, frequency, phase, state.t + h);
                state.position[k] = add(world.bodies[k].position, x);
                state.velocity[k] = v;
            }
            if !b.free {
                continue;
            }
            let mean = |old: Vec3, new: Vec3| add(scale(theta, new), scale(1.0 - theta, old));
            state.position[k] = add(state.position[k], scale(h, mean(b.v, b.v_new)));
            state.velocity[k] = b.v_new;
            let (old, turn) =
                (Rotation(state.rotation[k]), cayley(scale(h, mean(b.spin, b.spin_new))));
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
        state.t += h;
        state.steps += 1;
        self.remember(state, h);
        counts.tell(&self.contacts);
        drift.quaternion = off;
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

    fn remember(&mut self, state: &mut State, h: f64) {
        let memory = &mut state.memory;
        memory.h = h;
        memory.contacts.clear();
        self.contacts.clear();
        for (k, near) in self.near.iter().enumerate() {
            let axis = self.axes[k];
            let row = self.rows.get(self.row_of[k] as usize);
            let frame = row.map_or_else(|| frame(near.place.normal, axis), |row| row.frame);
            let mut report = ContactReport {
                key: near.key,
                a: BodyId(near.a),
                b: BodyId(near.b),
                point: row.map_or(near.place.point, |row| row.place.point),
                frame,
                gap: near.place.gap,
                mu: near.law.mu,
                active: row.is_some(),
                impulse: [0.0; 3],
                before: [0.0; 3],
                after: [0.0; 3],
                mu_r: near.law.mu_r,
                moment: [0.0; 2],
                rolling: [0.0; 2],
            };
            if let Some(row) = row {
                (report.impulse, report.before) = (row.r, row.before);
                for i in 0..3 {
                    report.after[i] = row.given[i];
                    let sides = row.arms.iter().zip(&self.sides[self.row_of[k] as usize]);
                    for (arm, side) in sides.filter(|a| a.0.free) {
                        let b = &self.bodies[arm.body as usize];
                        report.after[i] += side.velocity(i, b.v_new, b.spin_new);
                    }
                }
                report.moment = row.moment;
                report.rolling = row.turned;
                for arm in row.arms.iter().filter(|a| a.free) {
                    let b = &self.bodies[arm.body as usize];
                    let omega = b.omega(b.spin_new);
                    for k in 0..2 {
                        report.rolling[k] += arm.sign * dot(row.frame_end[1 + k], omega);
                    }
                }
            }
            memory.contacts.push(Remembered {
                key: near.key,
                impulse: report.world_impulse(),
                moment: report.world_moment(),
                normal: near.place.normal,
                point: near.place.point,
                axis,
                active: row.is_some(),
                stuck: row.is_some_and(|row| row.r[0] > 0.0 && sticks(&row.r, row.mu)),
            });
            self.contacts.push(report);
        }
    }
}

/// Position and rotation of a body after it has moved for a time with its velocities.
fn advanced(state: &State, k: usize, time: f64) -> (Vec3, Rotation) {
    let x = add(state.position[k], scale(time, state.velocity[k]));
    (x, Rotation(state.rotation[k]).after(cayley(scale(time, state.spin[k]))))
}

impl Row {
    /// Takes velocities where impulses are.
    fn at_the_middle(&mut self) {
        self.later = false;
        self.frame_end = self.frame;
        self.given = self.given_middle;
        self.arms.iter_mut().for_each(|a| a.moment_end = a.moment);
    }
}

impl Side {
    /// Component i of the relative velocity that the body makes with these velocities.
    fn velocity(&self, i: usize, v: Vec3, spin: Vec3) -> f64 {
        (0..3).map(|k| self.rows[k][i] * v[k] + self.rows[3 + k][i] * spin[k]).sum()
    }
}

/// The block of W of two contacts, with their free bodies, a sum over those that they share. With AVX2 (found at run time) four numbers at once and the same bits: nothing is fused.
#[inline]
fn coupling(row: ([u32; 2], &[Side; 2]), other: ([u32; 2], &[Side; 2])) -> [[f64; 3]; 3] {
    let mut sum = [[0.0; 4]; 3];
    for (p, left) in row.0.iter().zip(row.1).filter(|p| *p.0 != NONE) {
        for (_, right) in other.0.iter().zip(other.1).filter(|q| q.0 == p) {
            #[cfg(target_arch = "x86_64")]
            if std::arch::is_x86_feature_detected!("avx2") {
                // SAFETY: the processor has what the function is compiled for.
                unsafe { add_product_avx2(&mut sum, &left.rows, &right.solved) };
                continue;
            }
            add_product(&mut sum, &left.rows, &right.solved);
        }
    }
    sum.map(|[x, y, z, _]| [x, y, z])
}

/// `sum += leftᵀ right`.
#[inline]
fn add_product(sum: &mut [[f64; 4]; 3], left: &Columns, right: &Columns) {
    for (left, right) in left.iter().zip(right) {
        for i in 0..3 {
            for j in 0..4 {
                sum[i][j] += left[i] * right[j];
            }
        }
    }
}

/// The same.
#[cfg(target_arch = "x86_64")]
#[target_feature(enable = "avx2")]
fn add_product_avx2(sum: &mut [[f64; 4]; 3], left: &Columns, right: &Columns) {
    use std::arch::x86_64::{
        _mm256_add_pd, _mm256_loadu_pd, _mm256_mul_pd, _mm256_set1_pd, _mm256_storeu_pd,
    };
    // SAFETY: each pointer is to an array of four numbers.
    let mut rows = [0, 1, 2].map(|i: usize| unsafe { _mm256_loadu_pd(sum[i].as_ptr()) });
    for (left, right) in left.iter().zip(right) {
        // SAFETY: as above.
        let right = unsafe { _mm256_loadu_pd(right.as_ptr()) };
        for i in 0..3 {
            rows[i] = _mm256_add_pd(rows[i], _mm256_mul_pd(_mm256_set1_pd(left[i]), right));
        }
    }
    for (sum, row) in sum.iter_mut().zip(rows) {
        // SAFETY: as above.
        unsafe { _mm256_storeu_pd(sum.as_mut_ptr(), row) };
    }
}

/// The axis of the world whose part across the normal makes the first tangent: that of the last step unless it has come near the normal.
fn tangent_axis(n: Vec3, last: Option<u8>) -> u8 {
    const NEAR: f64 = 0.9;
    if let Some(axis) = last
        && n[axis as usize].abs() <= NEAR
    {
        return axis;
    }
    let least = |a: u8, b: u8| if n[b as usize].abs() < n[a as usize].abs() { b } else { a };
    least(least(0, 1), 2)
}

/// `[N, T1, T2]`, right-handed.
fn frame(n: Vec3, axis: u8) -> [Vec3; 3] {
    let mut e = [0.0; 3];
    e[axis as usize] = 1.0;
    let t = sub(e, scale(n[axis as usize], n));
    let t = scale(1.0 / norm(t), t);
    [n, t, cross(n, t)]
}

/// The frame turned so that its normal becomes n, on the shortest way: what a frame built anew would turn about the normal would turn friction with it.
fn transported(frame: &[Vec3; 3], n: Vec3) -> [Vec3; 3] {
    let sum = add(frame[0], n);
    let tangent = |t: Vec3| sub(t, scale(dot(n, t) / (1.0 + dot(frame[0], n)), sum));
    [n, tangent(frame[1]), tangent(frame[2])]
}

/// An impulse moved into the cone: none where it pulls, friction cut to its bound.
fn clipped(r: [f64; 3], mu: f64) -> [f64; 3] {
    if r[0] <= 0.0 {
        return [0.0; 3];
    }
    let (tangential, bound) = (r[1].hypot(r[2]), mu * r[0]);
    let cut = if tangential > bound { bound / tangential } else { 1.0 };
    [r[0], cut * r[1], cut * r[2]]
}

/// Whether an impulse lies within the cone, not on its boundary.
fn sticks(r: &[f64; 3], mu: f64) -> bool {
    r[1].hypot(r[2]) < (1.0 - 1e-6) * mu * r[0]
}
