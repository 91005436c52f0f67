//! A world in motion.

use nonsmooth_problem::{Friction, FrictionLocal};
use nonsmooth_scenes::vec3::{Vec3, add, cross, norm, sub};
use nonsmooth_solve::settings::SettingsMap;
use nonsmooth_solve::{Limits, registry};

use crate::crew::Inner;
use crate::drive::{self, Driven, Observer};
use crate::error::{Overlap, require, within_limits};
use crate::projection::Projection;
use crate::report::{ContactReport, RunReport, Settled, StepReport, StepStatus};
use crate::state::{ElasticState, State};
use crate::step::{Stride, Tools};
use crate::world::oscillation;
use crate::{
    BodyId, Dimension, JointReport, MoreauJean, Motion, SimulateError, Stabilisation, World,
};

/// Bodies that overlap by more than this share of the smaller one are refused at the start.
const OVERLAP: f64 = 1e-6;

/// Forces (N) and torques about the mass centre (N·m) on all bodies, in the world frame; in a plane what acts across it is without effect.
#[derive(Debug, Clone, Default)]
pub struct Wrenches {
    pub(crate) force: Vec<Vec3>,
    pub(crate) torque: Vec<Vec3>,
    /// When the step begins and ends, s.
    span: [f64; 2],
}

impl Wrenches {
    pub(crate) fn clear(&mut self, bodies: usize, span: [f64; 2]) {
        self.span = span;
        for list in [&mut self.force, &mut self.torque] {
            list.clear();
            list.resize(bodies, [0.0; 3]);
        }
    }

    /// The share of the step that lies between two times, s: what acts from one to the other, times its share, has the right impulse in any steps.
    pub fn share(&self, from: f64, until: f64) -> f64 {
        let [begin, end] = self.span;
        match from <= begin && end <= until {
            true => 1.0,
            false => ((until.min(end) - from.max(begin)) / (end - begin)).max(0.0),
        }
    }

    /// Adds a force at the mass centre.
    pub fn force(&mut self, body: BodyId, force: Vec3) {
        let f = &mut self.force[body.index()];
        *f = add(*f, force);
    }

    /// Adds a torque.
    pub fn torque(&mut self, body: BodyId, torque: Vec3) {
        let t = &mut self.torque[body.index()];
        *t = add(*t, torque);
    }

    /// Adds a force that acts at `point`.
    pub fn force_at(&mut self, state: &State, body: BodyId, force: Vec3, point: Vec3) {
        self.force(body, force);
        self.torque(body, cross(sub(point, state.position[body.index()]), force));
    }
}

/// A force that depends on time and state: springs, fields, controllers.
pub trait Force: Send {
    /// Adds to what acts during a step. `state` is that in the middle of the step, extrapolated, with the velocities of its beginning: forces that are
    /// smooth are taken to second order; one that begins or ends within a step is told its share of it by [`Wrenches::share`]. A number that is not finite ends the step with [`StepStatus::NotFinite`](crate::StepStatus::NotFinite).
    fn add(&mut self, state: &State, wrenches: &mut Wrenches);
}

impl<F: FnMut(&State, &mut Wrenches) + Send> Force for F {
    fn add(&mut self, state: &State, wrenches: &mut Wrenches) {
        self(state, wrenches);
    }
}

/// Errors: elastic solids, where this is done.
fn rigid(world: &World, where_: &str) -> Result<(), SimulateError> {
    match world.elastic.len() {
        0 => Ok(()),
        n => Err(SimulateError::value("elastic", format!("rigid bodies alone where {where_}"), n)),
    }
}

/// In words, bodies and elastic solids that may slip between the nodes of an elastic solid.
fn small(world: &World) -> Vec<String> {
    let mut said = vec![];
    for (k, elastic) in world.elastic.iter().enumerate() {
        let cell = norm(elastic.solid.cell());
        for (i, body) in world.bodies.iter().enumerate() {
            let radii = body.parts.iter().map(|p| p.shape.radius());
            if radii.fold(f64::INFINITY, f64::min) < cell {
                said.push(format!(
                    "{} is not much larger than the elements of {}: only nodes touch, and it may pass between them",
                    world.label(i),
                    world.label(world.bodies.len() + k)
                ));
            }
        }
    }
    for (j, second) in world.elastic.iter().enumerate() {
        for (i, first) in world.elastic[..j].iter().enumerate() {
            let label = |k: usize| world.label(world.bodies.len() + k);
            let (nodes, faces) = match first.is_finer_than(second) {
                true => ((first, i), (second, j)),
                false => ((second, j), (first, i)),
            };
            let cell = nodes.0.solid.cell().into_iter().fold(0.0, f64::max);
            let narrow = faces.0.solid.sides.into_iter().fold(f64::INFINITY, f64::min);
            if narrow < cell {
                said.push(format!(
                    "{} is narrower than the elements of {}, whose nodes touch it: it may pass between them",
                    label(faces.1),
                    label(nodes.1)
                ));
            }
        }
    }
    said
}

/// A world, the scheme, the solver, and the state that they move.
pub struct Simulation {
    world: World,
    scheme: MoreauJean,
    state: State,
    forces: Vec<Box<dyn Force>>,
    tools: Tools,
    projection: Option<Projection>,
    solver: String,
    settings: SettingsMap,
    limits: Limits,
    warnings: Vec<String>,
}

impl Simulation {
    /// Sets a world in motion, its contact problems solved by `auto` to 1e-10.
    ///
    /// Errors: those of [`World::validate`]; settings of the scheme that are not possible; pairs of shapes that may meet and are not
    /// supported; bodies that overlap by more than 1e-6 of their size, all of them listed; [`SceneError::Stopped`](nonsmooth_scenes::SceneError::Stopped) where the
    /// limits in force ([`nonsmooth_linalg::budget`]) ended it.
    pub fn new(world: World, scheme: MoreauJean) -> Result<Self, SimulateError> {
        let mut simulation = Self::placed(world, scheme)?;
        match simulation.overlaps()? {
            pairs if pairs.is_empty() => Ok(simulation),
            pairs => Err(SimulateError::Overlap(pairs)),
        }
    }

    /// The same, of a world whose bodies may overlap: they are moved apart before it starts, by displacements that are small in the norm of the masses and
    /// have nothing to do with velocities. `min ½‖Δ‖²_M` with `g + HᵀΔ ≥ 0` at all contacts is a frictionless contact problem with `W = Hᵀ M⁻¹ H`, `q = g`; it is stated and
    /// solved anew until no overlap is left, at most [`SETTLING`](Self::SETTLING) times.
    ///
    /// Errors: those of [`new`](Self::new), with the overlaps that are left.
    pub fn settled(world: World, scheme: MoreauJean) -> Result<(Self, Settled), SimulateError> {
        rigid(&world, "bodies that overlap are moved apart")?;
        let mut simulation = Self::placed(world, scheme)?;
        let mut settled = Settled::default();
        let before = simulation.state.position.clone();
        let rest = simulation.world.at_rest();
        let mut tools = Tools::new(&rest, &simulation.state)?;
        loop {
            let pairs = simulation.overlaps()?;
            let depth = pairs.iter().map(|p| p.depth).fold(0.0, f64::max);
            if settled.rounds == 0 {
                (settled.pairs, settled.depth) = (pairs.len(), depth);
            }
            if pairs.is_empty() {
                break;
            }
            if settled.rounds == Self::SETTLING {
                return Err(SimulateError::Overlap(pairs));
            }
            settled.rounds += 1;
            let Self { state, solver, settings, limits, .. } = &mut simulation;
            tools.part(&rest, state, depth, &Inner { solver, settings, limits })?;
        }
        let far = |(p, q): (&Vec3, &Vec3)| norm(sub(*q, *p));
        settled.moved = before.iter().zip(&simulation.state.position).map(far).fold(0.0, f64::max);
        simulation.state.memory.axes.clear();
        simulation.remember_joints();
        Ok((simulation, settled))
    }

    /// How often [`settled`](Self::settled) moves bodies at most.
    pub const SETTLING: u32 = 100;

    /// A world at its start, wherever its bodies are.
    fn placed(mut world: World, scheme: MoreauJean) -> Result<Self, SimulateError> {
        let mut warnings = world.validate()?;
        scheme.validate()?;
        if scheme.stabilisation.has_contacts() {
            rigid(&world, "the stabilisation projects contacts")?;
        }
        warnings.extend(small(&world));
        if world.laws().any(|(_, law)| law.e > 0.0) {
            warnings.extend(scheme.activation.warning("integrator"));
        }
        let mut state = State::of(&world);
        for (k, body) in world.bodies.iter().enumerate() {
            if let Motion::Oscillating { amplitude, frequency, phase } = body.motion {
                let (x, v) = oscillation(amplitude, frequency, phase, 0.0);
                (state.position[k], state.velocity[k]) = (add(body.position, x), v);
            }
            if let Motion::Uniform { velocity } = body.motion {
                state.velocity[k] = velocity;
            }
        }
        let tools = Tools::new(&world, &state)?;
        let mut simulation = Self {
            world,
            scheme,
            state,
            forces: vec![],
            tools,
            projection: None,
            solver: "auto".into(),
            settings: SettingsMap::new(),
            limits: Limits { tolerance: 1e-10, max_iterations: 100_000, ..Limits::default() },
            warnings,
        };
        simulation.remember_joints();
        let Self { world, state, tools, warnings, .. } = &mut simulation;
        warnings.extend(tools.joints.violated(world, state));
        if let Some((found, all)) = simulation.tools.joints.redundant {
            simulation.warnings.push(format!(
                "{found} of {all} equations of joints are redundant: the motion is unique, the impulses of these joints are not"
            ));
        }
        Ok(simulation)
    }

    /// Notes where the joints are before the first step.
    fn remember_joints(&mut self) {
        let Self { world, state, tools, .. } = self;
        tools.joints.tell(world, state);
    }

    /// Makes the projection ready where the scheme has one of contacts.
    fn projecting(&mut self) -> Result<(), SimulateError> {
        if self.scheme.stabilisation.has_contacts() && self.projection.is_none() {
            let threads = self.tools.threads();
            self.projection = Some(Projection::new(&self.world, &self.state, threads)?);
        }
        Ok(())
    }

    /// Pairs of bodies that overlap by more than they may at the start.
    ///
    /// Errors: limits that are over, which cut detection short.
    fn overlaps(&mut self) -> Result<Vec<Overlap>, SimulateError> {
        let Self { world, state, tools, .. } = self;
        let found = tools.overlaps(world, state, OVERLAP);
        let name = |k: u32| world.label(k as usize);
        within_limits()?;
        Ok(found.iter().map(|&(a, b, depth)| Overlap { a: name(a), b: name(b), depth }).collect())
    }

    /// With contact problems solved by the solver of this name, with these settings.
    ///
    /// Errors: an unknown solver or setting.
    pub fn with_solver(
        mut self,
        solver: &str,
        settings: SettingsMap,
    ) -> Result<Self, SimulateError> {
        match self.world.dimension {
            Dimension::Two => drop(registry::session::<FrictionLocal<2>>(solver, &settings)?),
            Dimension::Three => drop(registry::session::<FrictionLocal<3>>(solver, &settings)?),
        }
        (self.solver, self.settings) = (solver.into(), settings);
        self.tools.forget_solver(self.world.dimension);
        self.projection = None;
        Ok(self)
    }

    /// With contact problems solved to this relative residual.
    #[must_use]
    pub fn with_tolerance(mut self, tolerance: f64) -> Self {
        self.limits.tolerance = tolerance;
        self
    }

    /// With these limits on the solution of each contact problem; their `cancel` also ends [`run`](Self::run).
    #[must_use]
    pub fn with_limits(self, limits: Limits) -> Self {
        Self { limits, ..self }
    }

    /// With all of a step done by so many threads, 0 for one a core. By default there is one; the bits are the same for every number.
    #[must_use]
    pub fn with_threads(mut self, threads: usize) -> Self {
        self.tools.set_threads(threads);
        self
    }

    /// With one more force.
    #[must_use]
    pub fn with_force(mut self, force: impl Force + 'static) -> Self {
        self.forces.push(Box::new(force));
        self
    }

    /// The world.
    pub fn world(&self) -> &World {
        &self.world
    }

    /// The scheme.
    pub fn scheme(&self) -> &MoreauJean {
        &self.scheme
    }

    /// The state.
    pub fn state(&self) -> &State {
        &self.state
    }

    /// The state, to be changed between steps: velocities that are given, bodies that are put elsewhere.
    pub fn state_mut(&mut self) -> &mut State {
        &mut self.state
    }

    /// What is to be said of the world: what was changed to make it valid, and what may surprise.
    pub fn warnings(&self) -> &[String] {
        &self.warnings
    }

    /// The contacts of the last step, by key: all points where bodies were near each other.
    pub fn contacts(&self) -> &[ContactReport] {
        &self.tools.contacts
    }

    /// What the joints did in the last step, in their order.
    pub fn joints(&self) -> &[JointReport] {
        &self.tools.joints.reports
    }

    /// Does one step of length h > 0, s.
    ///
    /// Errors: h that is no positive number; a solver that does not apply. What numerics come to is in the report.
    pub fn step(&mut self, h: f64) -> Result<StepReport, SimulateError> {
        drive::step(self, h)
    }

    /// Steps of length h until `until`, s; the last one is shorter where h does not divide what is left. A step that is not solved is counted and the run
    /// goes on from the best that was found; one that is not finite ends it.
    ///
    /// Errors: those of [`step`](Self::step).
    pub fn run(
        &mut self,
        until: f64,
        h: f64,
        observer: &mut dyn Observer,
    ) -> Result<RunReport, SimulateError> {
        drive::run(self, until, h, observer)
    }

    /// The contact problem of the next step, were it of length h, as it is solved in the first pass, all islands together; with rolling friction where a contact has any; none without contacts. The state
    /// stays as it is.
    ///
    /// Errors: those of [`step`](Self::step).
    pub fn problem(&mut self, h: f64) -> Result<Option<Friction>, SimulateError> {
        require(|| "h".into(), h, h > 0.0, "a positive number")?;
        let Self { world, scheme, state, forces, tools, .. } = self;
        let axes = state.memory.axes.clone();
        tools.insist_on_pushed(state);
        let problem = tools.problem(Stride { world, scheme, h }, state, forces);
        state.memory.axes = axes;
        problem
    }

    /// The state as bytes (JSON): all that a simulation of the same world needs to go on as if it had never stopped, bit for bit.
    pub fn checkpoint(&self) -> Vec<u8> {
        serde_json::to_vec(&self.state).expect("numbers and lists of numbers")
    }

    /// Goes on from a checkpoint of the same world.
    ///
    /// Errors: bytes that are none.
    pub fn restore(&mut self, checkpoint: &[u8]) -> Result<(), SimulateError> {
        let bodies = self.world.bodies.len();
        let wrong = |found: String| SimulateError::Checkpoint { bodies, found };
        let state: State = serde_json::from_slice(checkpoint).map_err(|e| wrong(e.to_string()))?;
        let lengths =
            [state.position.len(), state.rotation.len(), state.velocity.len(), state.spin.len()];
        if lengths != [bodies; 4] {
            return Err(wrong(format!("one of {lengths:?} positions, rotations and velocities")));
        }
        let nodes = |solids: &[ElasticState]| {
            solids.iter().map(|s| [s.displacement.len(), s.velocity.len()]).collect::<Vec<_>>()
        };
        let [own, theirs] = [&self.state.elastic, &state.elastic].map(|s| nodes(s));
        if own != theirs {
            return Err(wrong(format!("one of elastic solids with {theirs:?} nodes")));
        }
        self.state = state;
        Ok(())
    }
}

impl Driven for Simulation {
    type State = State;

    fn time(&self) -> f64 {
        self.state.t
    }

    fn state(&mut self) -> &mut State {
        &mut self.state
    }

    fn limits(&self) -> &Limits {
        &self.limits
    }

    fn halvings(&self) -> u8 {
        self.scheme.halvings
    }

    fn check(&mut self) -> Result<(), SimulateError> {
        Ok(())
    }

    fn attempt(&mut self, h: f64) -> Result<StepReport, SimulateError> {
        self.projecting()?;
        let Self { world, scheme, state, forces, tools, projection, .. } = self;
        let inner = Inner { solver: &self.solver, settings: &self.settings, limits: &self.limits };
        let stride = Stride { world, scheme, h };
        tools.insist_on_pushed(state);
        let mut report = tools.attempt(stride, state, forces, &inner)?;
        let Some(projection) = projection
            .as_mut()
            .filter(|_| scheme.stabilisation == Stabilisation::CombinedProjection)
        else {
            return Ok(report);
        };
        while report.status == StepStatus::Solved {
            let mut trial = state.clone();
            tools.commit(stride, &mut trial, &mut report.clone());
            let pushed = projection.project(world, &mut trial, &inner)?.pushed;
            if !tools.insist(&pushed) {
                break;
            }
            report = tools.attempt(stride, state, forces, &inner)?;
        }
        Ok(report)
    }

    fn take(&mut self, report: &mut StepReport, h: f64) -> Result<(), SimulateError> {
        let Self { world, scheme, state, tools, projection, .. } = self;
        tools.commit(Stride { world, scheme, h }, state, report);
        if let Some(projection) = projection {
            let inner =
                Inner { solver: &self.solver, settings: &self.settings, limits: &self.limits };
            let found = projection.project(world, state, &inner)?;
            if !found.closed && report.status == StepStatus::Solved {
                report.status = StepStatus::ProjectionLimit;
            }
            if scheme.stabilisation == Stabilisation::ContactProjection {
                state.memory.note_pushed(&found.pushed);
            }
            if found.moved {
                report.energy.potential = world.potential(state);
                report.drift.joints = tools.joints.tell(world, state);
            }
        }
        Ok(())
    }

    fn discard(&mut self) {
        self.tools.contacts.clear();
    }
}
