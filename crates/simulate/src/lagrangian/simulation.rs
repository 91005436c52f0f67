//! A Lagrangian system in motion.

use nonsmooth_problem::FrictionLocal;
use nonsmooth_solve::Limits;
use nonsmooth_solve::registry::Registered;
use nonsmooth_solve::settings::SettingsMap;

use super::differences;
use super::gradients::{Gradients, dot};
use super::state::{LagrangianContact, LagrangianState, Memory};
use super::step::Tools;
use super::{Lagrangian, LagrangianScheme, RowLaw, Size};
use crate::SimulateError;
use crate::drive::{self, Driven, Observer};
use crate::error::{finite, require};
use crate::report::{RunReport, StepReport};

/// A [`Lagrangian`] system, the scheme, the solver, and the state that they move.
///
/// A ball on a string that swings into a wall:
///
/// ```
/// use nonsmooth_linalg::Dense;
/// use nonsmooth_simulate::{Lagrangian, LagrangianScheme, LagrangianSimulation, Law, Size};
///
/// struct Ball;
///
/// impl Lagrangian<2> for Ball {
///     fn size(&self) -> Size {
///         Size::new(2).contacts(1).relations(1)
///     }
///     fn mass(&self, _: &[f64], mass: &mut Dense) {
///         (mass[(0, 0)], mass[(1, 1)]) = (1.0, 1.0);
///     }
///     fn force(&self, _: f64, _: &[f64], _: &[f64], force: &mut [f64]) {
///         force[1] = -9.81;
///     }
///     fn potential(&self, _: f64, q: &[f64]) -> f64 {
///         9.81 * q[1]
///     }
///     // The string is one metre long.
///     fn relations(&self, _: f64, q: &[f64], phi: &mut [f64]) {
///         phi[0] = 0.5 * (q[0] * q[0] + q[1] * q[1] - 1.0);
///     }
///     // The wall stands below the nail.
///     fn gaps(&self, _: f64, q: &[f64], gaps: &mut [f64]) {
///         gaps[0] = -q[0];
///     }
///     fn law(&self, _: usize, _: f64, _: &[f64], _: &[f64]) -> Law {
///         Law { e: 0.8, ..Law::default() }
///     }
/// }
///
/// let scheme = LagrangianScheme { projection: Some(1e-12), ..LagrangianScheme::default() };
/// let mut swing = LagrangianSimulation::new(Ball, scheme, &[-1.0, 0.0], &[0.0, 0.0])?;
/// let run = swing.run(2.0, 1e-3, &mut ())?;
/// assert!(run.is_solved() && run.imbalance <= 1e-10, "{run}");
/// let [x, y] = swing.state().q[..] else { unreachable!() };
/// assert!(x < 1e-2 && (x * x + y * y - 1.0).abs() < 1e-11);
/// # Ok::<(), nonsmooth_simulate::SimulateError>(())
/// ```
pub struct LagrangianSimulation<L: Lagrangian<D>, const D: usize> {
    system: L,
    scheme: LagrangianScheme,
    state: LagrangianState,
    tools: Tools<D>,
    limits: Limits,
    /// That at the start.
    size: Size,
    /// Whether somebody may have written to the system since it was checked.
    changed: bool,
    warnings: Vec<String>,
}

/// How much a velocity may miss a relation by, relative to the terms of its rate, to be called consistent.
const CONSISTENT: f64 = 1e-9;

/// q and v are n finite numbers each, and constant matrices n × n.
fn fits<L: Lagrangian<D> + ?Sized, const D: usize>(
    system: &L,
    q: &[f64],
    v: &[f64],
) -> Result<(), SimulateError> {
    let n = system.size().dofs;
    for (name, x) in [("q", q), ("v", v)] {
        if x.len() != n {
            let expected = format!("{n} entries, one for each degree of freedom");
            return Err(SimulateError::value(name, expected, x.len()));
        }
        finite(|| name.into(), x)?;
    }
    let Some(c) = system.constant() else { return Ok(()) };
    for (name, a) in [("mass", c.mass), ("damping", c.damping), ("stiffness", c.stiffness)] {
        if (a.nrows(), a.ncols()) != (n, n) {
            let found = format!("{} × {}", a.nrows(), a.ncols());
            let key = format!("constant().{name}");
            return Err(SimulateError::value(key, format!("{n} × {n}"), found));
        }
    }
    Ok(())
}

impl<L: Lagrangian<D>, const D: usize> LagrangianSimulation<L, D> {
    /// Sets a system in motion from q and v at t = 0, its contact problems solved by `auto` to 1e-12.
    ///
    /// Errors: q or v of the wrong length or not finite; a scheme that is not possible; a mass matrix that is not positive definite; contacts with friction
    /// whose directions are not given; matrices of a constant system of the wrong shape.
    pub fn new(
        system: L,
        scheme: LagrangianScheme,
        q: &[f64],
        v: &[f64],
    ) -> Result<Self, SimulateError>
    where
        FrictionLocal<D>: Registered,
    {
        const { assert!(D == 2 || D == 3, "contacts have 2 or 3 components") };
        scheme.validate()?;
        system.validate()?;
        let size = system.size();
        fits(&system, q, v)?;
        require(
            || "size().dofs".into(),
            size.dofs as f64,
            size.dofs > 0,
            "at least one degree of freedom",
        )?;
        let mut tools = Tools::new(&system, "auto", &SettingsMap::new())?;
        tools.matrices.mass(&system, q).map_err(|unfit| unfit.at(0.0))?;
        let (mut gradients, mut at) = (Gradients::default(), q.to_vec());
        gradients.evaluate(&system, 0.0, &mut at, &mut vec![]);
        let mut bounces = false;
        for c in 0..size.contacts {
            let law = system.law(c, 0.0, q, v);
            gradients.admit(c, &law)?;
            bounces |= law.e > 0.0;
        }
        let limit = |k| matches!(system.row_law(k, 0.0, q, v), RowLaw::Limit { e } if e > 0.0);
        bounces |= (0..size.rows).any(limit);
        let warnings = scheme.activation.warning("scheme").filter(|_| bounces);
        let warnings = warnings.into_iter().collect();
        let state = LagrangianState { q: q.to_vec(), v: v.to_vec(), ..LagrangianState::default() };
        let limits = Limits { tolerance: 1e-12, max_iterations: 100_000, ..Limits::default() };
        Ok(Self { system, scheme, state, tools, limits, size, changed: false, warnings })
    }

    /// With contact problems solved by the solver of this name, with these settings.
    ///
    /// Errors: an unknown solver or setting.
    pub fn with_solver(
        mut self,
        solver: &str,
        settings: &SettingsMap,
    ) -> Result<Self, SimulateError>
    where
        FrictionLocal<D>: Registered,
    {
        self.tools = Tools::new(&self.system, solver, settings)?;
        Ok(self)
    }

    /// With contact problems solved to this relative residual.
    #[must_use]
    pub fn with_tolerance(mut self, tolerance: f64) -> Self {
        self.limits.tolerance = tolerance;
        self
    }

    /// With these limits on each step; their `cancel` also ends [`run`](Self::run).
    #[must_use]
    pub fn with_limits(self, limits: Limits) -> Self {
        Self { limits, ..self }
    }

    /// The system.
    pub fn system(&self) -> &L {
        &self.system
    }

    /// The system, to be changed between steps: what a controller does. Its size must stay; matrices that are not as they were are factorised anew in the next step.
    pub fn system_mut(&mut self) -> &mut L {
        self.changed = true;
        &mut self.system
    }

    /// What is allowed but perhaps not meant, by the laws at the start.
    pub fn warnings(&self) -> &[String] {
        &self.warnings
    }

    /// The scheme.
    pub fn scheme(&self) -> &LagrangianScheme {
        &self.scheme
    }

    /// The state.
    pub fn state(&self) -> &LagrangianState {
        &self.state
    }

    /// The state, to be changed between steps.
    pub fn state_mut(&mut self) -> &mut LagrangianState {
        &mut self.state
    }

    /// What the contacts did in the last step, nc.
    pub fn contacts(&self) -> &[LagrangianContact<D>] {
        &self.tools.contacts
    }

    /// The impulses of the relations in the last step, p, N·s: h times the forces that hold the system together. Those of redundant relations are one of many.
    pub fn relation_impulses(&self) -> &[f64] {
        let all = &self.state.memory.scalars;
        all.get(..self.system.size().relations).unwrap_or(&[])
    }

    /// The impulses of the scalar rows in the last step, N·s.
    pub fn row_impulses(&self) -> &[f64] {
        let all = &self.state.memory.scalars;
        all.get(self.system.size().relations..).unwrap_or(&[])
    }

    /// The velocity nearest to v, in the norm of M, that obeys the relations at q: what the relations on mean velocities leave of `Gᵀ v` is of second order in h. For output, and
    /// to begin with.
    ///
    /// What moves relations by itself, ∂φ/∂t, is taken by a difference of fourth order over a hundredth of the last step (of 1e-3 s before the first): 1e-10 of it is lost where φ turns
    /// with ω = 1/h, less where it is slower, and `1e-14 |φ| / h` by rounding. Redundant relations are allowed.
    ///
    /// Errors: those of [`step`](Self::step); relations that no velocity obeys to 1e-9 of the terms of their rates, since they contradict each other or do not depend
    /// on q; a rate that is no finite number; limits that end the solution before.
    pub fn consistent_velocity(&mut self) -> Result<Vec<f64>, SimulateError> {
        self.check()?;
        let Self { system, state, tools, limits, size, .. } = self;
        let (mut q, mut v) = (state.q.clone(), state.v.clone());
        if size.relations == 0 {
            return Ok(v);
        }
        tools.matrices.mass(system, &q).map_err(|unfit| unfit.at(state.t))?;
        let mut gradients = Gradients::default();
        gradients.evaluate(system, state.t, &mut q, &mut vec![]);
        // The unit of time of a mechanism is not known, that of its steps is.
        let span = if state.memory.h > 0.0 { state.memory.h } else { 1e-3 };
        let mut rate = vec![0.0; size.relations];
        differences::rate(state.t, span, &mut rate, |t, phi| system.relations(t, &q, phi));
        let first = D * size.contacts;
        let key = |k: usize| format!("relations[{k}]");
        for (k, by_time) in rate.iter().enumerate() {
            let of = [&[*by_time], gradients.line(first + k)];
            for (name, x) in ["∂φ/∂t", "∂φ/∂q"].into_iter().zip(of) {
                finite(|| format!("{name} of {}", key(k)), x)?;
            }
        }
        let Tools { projection, matrices, .. } = tools;
        // Whether that is solved is judged by what is left of the rates.
        projection.project_velocity((&gradients, first), &rate, matrices, limits, &mut v)?;
        for (k, by_time) in rate.iter().enumerate() {
            let g = gradients.line(first + k);
            let left = dot(g, &v) + by_time;
            let terms = |v: &[f64]| g.iter().zip(v).map(|(g, v)| (g * v).abs()).sum::<f64>();
            let size = by_time.abs() + terms(&v) + terms(&state.v);
            let expected = "a rate of 0, which no velocity was found to make";
            require(|| key(k), left, left.abs() <= CONSISTENT * size, expected)?;
        }
        Ok(v)
    }

    /// Does one step of length h > 0, s.
    ///
    /// Errors: h that is no positive number; a state of the wrong length or not finite; a system whose size has changed; a law that is none, or friction without tangents; a mass
    /// matrix that is not symmetric and positive definite; a solver that does not apply. The state is then that before the step. What numerics come to is in the report.
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
        observer: &mut dyn Observer<Self>,
    ) -> Result<RunReport, SimulateError> {
        drive::run(self, until, h, observer)
    }

    /// The contact problem of the next step, were it of length h, as it is solved in the first iteration; none without contacts and rows. The state stays as it is.
    ///
    /// Errors: those of [`step`](Self::step).
    pub fn problem(&mut self, h: f64) -> Result<Option<FrictionLocal<D>>, SimulateError> {
        require(|| "h".into(), h, h > 0.0, "a positive number")?;
        self.check()?;
        self.tools.problem(&self.system, &self.scheme, &self.state, h)
    }

    /// The state as bytes (JSON): all that a simulation of the same system needs to go on as if it had never stopped, bit for bit.
    pub fn checkpoint(&self) -> Vec<u8> {
        serde_json::to_vec(&self.state).expect("numbers and lists of numbers")
    }

    /// Goes on from a checkpoint of the same system.
    ///
    /// Errors: bytes that are none; the checkpoint of a system with other numbers of coordinates, contacts, relations or rows.
    pub fn restore(&mut self, checkpoint: &[u8]) -> Result<(), SimulateError> {
        let wrong = |found: String| SimulateError::value("checkpoint", "one of this system", found);
        let state: LagrangianState =
            serde_json::from_slice(checkpoint).map_err(|e| wrong(e.to_string()))?;
        let size = self.system.size();
        let n = size.dofs;
        if [state.q.len(), state.v.len()] != [n; 2] {
            let found = [state.q.len(), state.v.len()];
            return Err(wrong(format!("one of {found:?} coordinates and velocities")));
        }
        // Before the first step nothing is remembered.
        let found = state.memory.lengths();
        let expected = Memory::lengths_of(size, D);
        if found != expected && (state.steps > 0 || found != [0; 4]) {
            return Err(wrong(format!(
                "one of {found:?} contact impulses, other impulses, active and stuck, not {expected:?}"
            )));
        }
        self.state = state;
        Ok(())
    }
}

impl<L: Lagrangian<D>, const D: usize> Driven for LagrangianSimulation<L, D> {
    type State = LagrangianState;

    fn time(&self) -> f64 {
        self.state.t
    }

    fn state(&mut self) -> &mut LagrangianState {
        &mut self.state
    }

    fn limits(&self) -> &Limits {
        &self.limits
    }

    fn halvings(&self) -> u8 {
        self.scheme.halvings
    }

    fn check(&mut self) -> Result<(), SimulateError> {
        let Self { system, state, size, changed, .. } = self;
        if system.size() != *size {
            let found = format!("{:?}", system.size());
            return Err(SimulateError::value(
                "size()",
                format!("{size:?}, as at the start"),
                found,
            ));
        }
        if *changed {
            system.validate()?;
            *changed = false;
        }
        require(|| "t".into(), state.t, true, "a finite time")?;
        fits(system, &state.q, &state.v)
    }

    fn attempt(&mut self, h: f64) -> Result<StepReport, SimulateError> {
        self.tools.attempt(&self.system, &self.scheme, &self.state, &self.limits, h)
    }

    fn take(&mut self, _report: &mut StepReport, h: f64) -> Result<(), SimulateError> {
        self.tools.commit(&self.system, &mut self.state, h);
        Ok(())
    }

    fn discard(&mut self) {
        self.tools.contacts.clear();
    }
}
