//! Simulations: a scene in, a run out.
//!
//! A world of Python is the document that a scene file is, so it is read, completed and refused by what reads files. A run is computed on another thread; the thread
//! that asks waits, sees Ctrl-C, and runs the callback of each step.

use std::path::{Path, PathBuf};
use std::sync::{Arc, Mutex, OnceLock};
use std::time::Instant;

use nonsmooth_io::ProblemFile;
use nonsmooth_io::trajectory::{Checkpoint, Contact, Frame, Joint, Step as Stepped, Trajectory};
use nonsmooth_problem::check::Motion;
use nonsmooth_record::Origin;
use nonsmooth_scenes::draw::{Drawing, svg};
use nonsmooth_scenes::vec3::Vec3;
use nonsmooth_simulate::{BodyId, Control, RunReport, SceneFile, SimulateError, State, Wrenches};
use numpy::{PyArray1, PyArray2, PyArray3, PyArrayMethods, PyReadonlyArray2};
use pyo3::prelude::*;
use pyo3::types::{PyBytes, PyDict};

use crate::function::{Watcher, locked};
use crate::wait::{ask, elsewhere};
use crate::{expected, mistake};

/// Iterations that a step's solve may take, as the command line has it.
const ITERATIONS: usize = 100_000;

/// A scene as a JSON document, from a file of TOML or JSON, with its meshes, or from a robot's URDF, a model of MuJoCo or a scene of Siconos; and what is to be said of it.
#[pyfunction]
pub fn read_scene(py: Python<'_>, path: PathBuf) -> PyResult<(String, Vec<String>)> {
    py.detach(|| {
        let name = path.display();
        let wrong = |e: SimulateError| mistake(format!("{name}: {e}"));
        let folder = path.parent().unwrap_or(Path::new(""));
        let (text, warnings) = match Origin::of(&path) {
            Some(origin) => origin.read(&path).map(|made| (made.scene, made.warnings)),
            None => Ok((SceneFile::text(&path).map_err(mistake)?, vec![])),
        }
        .map_err(mistake)?;
        let mut scene = SceneFile::parse(&text, &[]).map_err(wrong)?;
        scene.load_meshes(folder).map_err(wrong)?;
        let document = serde_json::to_string(&scene).map_err(mistake)?;
        Ok((document, warnings))
    })
}

/// A picture of a scene as it begins, SVG.
#[pyfunction]
pub fn draw(py: Python<'_>, scene: &str) -> PyResult<String> {
    let scene = Arc::new(SceneFile::parse(scene, &[]).map_err(mistake)?);
    let simulation = built(py, &scene, false)?;
    py.detach(move || {
        let mut trajectory = nonsmooth_record::begun(&scene, &simulation);
        trajectory.frames.push(nonsmooth_record::frame(&simulation));
        drawn(&trajectory, &scene, simulation.world(), 0)
    })
}

/// The simulation of a scene, made on another thread: Ctrl-C ends that.
fn built(
    py: Python<'_>,
    scene: &Arc<SceneFile>,
    settle: bool,
) -> PyResult<nonsmooth_simulate::Simulation> {
    let watcher = Arc::new(Watcher::default());
    let limits =
        nonsmooth_solve::Limits { cancel: Some(watcher.stop.clone()), ..Default::default() };
    let scene = scene.clone();
    let hear = |_: Option<()>| ask(&watcher, |_| Ok(false));
    let made = py.detach(|| {
        elsewhere(hear, move |_| {
            let _scope = limits.budget(Instant::now()).enter();
            match settle {
                true => scene.build_settled().map(|(made, _)| made),
                false => scene.build(),
            }
        })
    });
    match watcher.fault() {
        Some(fault) => Err(fault),
        None => made.map_err(|e| match &e {
            SimulateError::Lawless { a, b, .. } => mistake(format!(
                "{e}: world.pair(\"{a}\", \"{b}\", mu=…) states it, world.pair(\"default\", mu=…) that of all pairs that are not listed"
            )),
            _ => mistake(e),
        }),
    }
}

fn drawn(
    trajectory: &Trajectory,
    scene: &SceneFile,
    world: &nonsmooth_simulate::World,
    frame: usize,
) -> PyResult<String> {
    let playback = nonsmooth_record::playback(trajectory, scene, world);
    let picture = playback.picture(frame).map_err(mistake)?;
    svg(&picture, &Drawing { view: playback.view, ..Drawing::default() }).map_err(mistake)
}

/// A world in motion; `nonsmooth.Simulation` has the words.
#[pyclass(frozen, module = "nonsmooth._nonsmooth")]
pub struct Simulation {
    /// None while a run has it.
    inner: Mutex<Option<nonsmooth_simulate::Simulation>>,
    scene: Arc<SceneFile>,
    /// What all runs begin with: to write the scene down takes as long as many steps.
    begun: OnceLock<Trajectory>,
    /// What the caller has act in the step that is done, once there was something.
    asked: OnceLock<Arc<Mutex<Asked>>>,
}

/// Forces at the mass centres (N) and torques about them (N·m) in the frame of the world, of all bodies or of none.
#[derive(Default)]
struct Asked {
    forces: Vec<Vec3>,
    torques: Vec<Vec3>,
}

impl Asked {
    fn add(&self, wrenches: &mut Wrenches) {
        let bodies = || (0..).map(BodyId);
        bodies().zip(&self.forces).for_each(|(body, f)| wrenches.force(body, *f));
        bodies().zip(&self.torques).for_each(|(body, t)| wrenches.torque(body, *t));
    }
}

/// The rows of a matrix, of none none.
fn rows(matrix: Option<PyReadonlyArray2<'_, f64>>) -> Vec<Vec3> {
    let matrix = matrix.as_ref().map(|m| m.as_array());
    let rows = matrix.iter().flat_map(|m| m.rows());
    rows.map(|row| std::array::from_fn(|i| row[i])).collect()
}

fn busy() -> PyErr {
    expected("simulation", "one that is not running", "one in a run")
}

impl Simulation {
    /// What is asked of the simulation while no run has it.
    fn with<T>(
        &self,
        what: impl FnOnce(&mut nonsmooth_simulate::Simulation) -> PyResult<T>,
    ) -> PyResult<T> {
        what(locked(&self.inner).as_mut().ok_or_else(busy)?)
    }

    /// The limits of the scene on each solve, which `watcher` may end.
    fn limits(&self, watcher: &Watcher) -> nonsmooth_solve::Limits {
        nonsmooth_solve::Limits {
            tolerance: self.scene.solver.tol,
            max_iterations: ITERATIONS,
            cancel: Some(watcher.stop.clone()),
            ..Default::default()
        }
    }
}

#[pymethods]
impl Simulation {
    /// The simulation of a scene, a JSON document; `settle` moves bodies apart that overlap.
    #[new]
    fn new(py: Python<'_>, scene: &str, settle: bool) -> PyResult<Self> {
        let scene = Arc::new(SceneFile::parse(scene, &[]).map_err(mistake)?);
        let inner = Mutex::new(Some(built(py, &scene, settle)?));
        Ok(Self { inner, scene, begun: OnceLock::new(), asked: OnceLock::new() })
    }

    /// The time, s.
    #[getter]
    fn t(&self) -> PyResult<f64> {
        self.with(|s| Ok(s.state().t))
    }

    /// What is to be said of the world.
    #[getter]
    fn warnings(&self) -> PyResult<Vec<String>> {
        self.with(|s| Ok(s.warnings().to_vec()))
    }

    /// The names of the bodies.
    #[getter]
    fn bodies(&self) -> PyResult<Vec<String>> {
        self.with(|s| Ok(s.world().bodies.iter().map(|body| body.name.clone()).collect()))
    }

    /// The scene with all defaults, TOML.
    fn toml(&self) -> String {
        self.scene.to_toml()
    }

    /// Positions (b × 3), rotations (b × 4), velocities and angular velocities (b × 3) as they are now.
    fn state<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyDict>> {
        let frame = self.with(|s| Ok(nonsmooth_record::frame(s)))?;
        let state = PyDict::new(py);
        for (name, width, all) in motions(std::slice::from_ref(&frame)) {
            state.set_item(
                name,
                PyArray1::from_vec(py, all).reshape([frame.bodies.len(), width])?,
            )?;
        }
        Ok(state)
    }

    /// The contact problem of the next step of length h; `None` where nothing touches.
    fn problem(&self, h: f64) -> PyResult<Option<crate::problem::Problem>> {
        let problem = self.with(|s| s.problem(h).map_err(mistake))?;
        Ok(problem.map(|p| crate::problem::Problem::new(ProblemFile::new(p))))
    }

    /// Moves on until a time, in steps of h, a frame every so many; `callback` is called with each step.
    #[pyo3(signature = (until, h, every, callback))]
    fn run(
        &self,
        py: Python<'_>,
        until: f64,
        h: f64,
        every: u64,
        callback: Option<Py<PyAny>>,
    ) -> PyResult<Run> {
        if every == 0 {
            return Err(expected("every", "at least 1 step between two frames", 0));
        }
        let simulation = locked(&self.inner).take().ok_or_else(busy)?;
        let watcher = Arc::new(Watcher::default());
        let limits = self.limits(&watcher);
        let told = callback.is_some();
        let begun = || nonsmooth_record::begun(&self.scene, &simulation);
        let mut trajectory = self.begun.get_or_init(begun).clone();
        let hear = |news: Option<(Stepped, Frame)>| {
            ask(&watcher, |py| match (&callback, news) {
                (Some(callback), Some((step, frame))) => {
                    callback.bind(py).call1((Step { step, frame },))?.is_truthy()
                }
                _ => Ok(false),
            });
        };
        let stop = watcher.stop.clone();
        let (simulation, trajectory, report) = py.detach(|| {
            elsewhere(hear, move |say| {
                let mut simulation = simulation.with_limits(limits);
                trajectory.frames.push(nonsmooth_record::frame(&simulation));
                let mut watch =
                    |simulation: &nonsmooth_simulate::Simulation,
                     report: &nonsmooth_simulate::StepReport| {
                        let number = simulation.state().steps;
                        let step = nonsmooth_record::step(number, report);
                        if told {
                            say((step.clone(), nonsmooth_record::frame(simulation)));
                        }
                        trajectory.steps.push(step);
                        if number.is_multiple_of(every) {
                            trajectory.frames.push(nonsmooth_record::frame(simulation));
                        }
                        match stop.load(std::sync::atomic::Ordering::Relaxed) {
                            true => Control::Stop,
                            false => Control::Continue,
                        }
                    };
                let report = simulation.run(until, h, &mut watch);
                let state = simulation.state();
                trajectory.checkpoint = Some(Checkpoint {
                    step: state.steps,
                    time: state.t,
                    state: simulation.checkpoint(),
                });
                (simulation, trajectory, report)
            })
        });
        *locked(&self.inner) = Some(simulation);
        if let Some(fault) = watcher.fault() {
            return Err(fault);
        }
        let report = report.map_err(mistake)?;
        py.check_signals()?;
        Ok(Run { trajectory, report, scene: self.scene.clone() })
    }

    /// Does one step of length h with forces and torques, b × 3, that act in it alone.
    #[pyo3(signature = (h, forces, torques))]
    fn step(
        &self,
        py: Python<'_>,
        h: f64,
        forces: Option<PyReadonlyArray2<'_, f64>>,
        torques: Option<PyReadonlyArray2<'_, f64>>,
    ) -> PyResult<Step> {
        let mut simulation = locked(&self.inner).take().ok_or_else(busy)?;
        if forces.is_some() || torques.is_some() {
            let known = self.asked.get().is_some();
            let asked = self.asked.get_or_init(Arc::default);
            *locked(asked) = Asked { forces: rows(forces), torques: rows(torques) };
            if !known {
                let acts = asked.clone();
                let force = move |_: &State, wrenches: &mut Wrenches| locked(&acts).add(wrenches);
                simulation = simulation.with_force(force);
            }
        }
        let watcher = Arc::new(Watcher::default());
        let limits = self.limits(&watcher);
        let hear = |_: Option<()>| ask(&watcher, |_| Ok(false));
        let (simulation, done) = py.detach(|| {
            elsewhere(hear, move |_| {
                let mut simulation = simulation.with_limits(limits);
                let report = simulation.step(h);
                let done = report.map(|report| Step {
                    step: nonsmooth_record::step(simulation.state().steps, &report),
                    frame: nonsmooth_record::frame(&simulation),
                });
                (simulation, done)
            })
        });
        if let Some(asked) = self.asked.get() {
            *locked(asked) = Asked::default();
        }
        *locked(&self.inner) = Some(simulation);
        match watcher.fault() {
            Some(fault) => Err(fault),
            None => done.map_err(mistake),
        }
    }

    /// All that the next step depends on.
    fn checkpoint<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyBytes>> {
        self.with(|s| Ok(PyBytes::new(py, &s.checkpoint())))
    }

    /// Goes back, or on, to a checkpoint of the same world.
    fn restore(&self, checkpoint: &[u8]) -> PyResult<()> {
        self.with(|s| s.restore(checkpoint).map_err(mistake))
    }
}

/// What a simulation came to in a step.
#[pyclass(frozen, module = "nonsmooth._nonsmooth")]
pub struct Step {
    step: Stepped,
    frame: Frame,
}

/// A part of a step.
type Of<T> = fn(&Stepped) -> T;

/// Kinetic and potential energy, the works, and what the balance lacks, by name.
fn energies(step: &Stepped) -> [(&'static str, f64); 10] {
    let e = &step.energy;
    [
        ("kinetic", e.kinetic),
        ("potential", e.potential),
        ("gravity", e.gravity),
        ("forces", e.forces),
        ("normal", e.normal),
        ("tangential", e.tangential),
        ("drives", e.drives),
        ("joints", e.joints),
        ("numerical", e.numerical),
        ("imbalance", e.imbalance),
    ]
}

/// What is counted in a step, by name.
fn counts(step: &Stepped) -> [(&'static str, u64); 6] {
    [
        ("near", step.near.into()),
        ("active", step.active.into()),
        ("open", step.open.into()),
        ("stick", step.stick.into()),
        ("slip", step.slip.into()),
        ("iterations", step.iterations),
    ]
}

#[pymethods]
impl Step {
    /// Its number, from 1.
    #[getter]
    fn number(&self) -> u64 {
        self.step.number
    }

    /// The time after it, s.
    #[getter]
    fn t(&self) -> f64 {
        self.step.time
    }

    /// Its length, s.
    #[getter]
    fn h(&self) -> f64 {
        self.step.h
    }

    /// How it ended, in a word.
    #[getter]
    fn status(&self) -> &str {
        &self.step.status
    }

    /// The judge's relative residual.
    #[getter]
    fn residual(&self) -> f64 {
        self.step.residual
    }

    /// Energies and works by name, J.
    #[getter]
    fn energy<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyDict>> {
        let all = PyDict::new(py);
        energies(&self.step).into_iter().try_for_each(|(name, x)| all.set_item(name, x))?;
        Ok(all)
    }

    /// How many contacts do what.
    #[getter]
    fn counts<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyDict>> {
        let all = PyDict::new(py);
        counts(&self.step).into_iter().try_for_each(|(name, n)| all.set_item(name, n))?;
        Ok(all)
    }

    /// Mass centres after it, b × 3, m.
    #[getter]
    fn position<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyArray2<f64>>> {
        self.of(py, "position", 3)
    }

    /// Velocities after it, b × 3, m/s.
    #[getter]
    fn velocity<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyArray2<f64>>> {
        self.of(py, "velocity", 3)
    }

    fn __repr__(&self) -> String {
        let Stepped { number, time, status, residual, active, .. } = &self.step;
        format!(
            "<Step {number}: t = {time:.6} s, {status}, residual {residual:.2e}, {active} contacts>"
        )
    }
}

impl Step {
    fn of<'py>(
        &self,
        py: Python<'py>,
        name: &str,
        width: usize,
    ) -> PyResult<Bound<'py, PyArray2<f64>>> {
        let found = motions(std::slice::from_ref(&self.frame)).into_iter().find(|m| m.0 == name);
        let all = found.map_or_else(Vec::new, |(_, _, all)| all);
        PyArray1::from_vec(py, all).reshape([self.frame.bodies.len(), width])
    }
}

/// How bodies stand and move in frames: name, components, all numbers.
fn motions(frames: &[Frame]) -> [(&'static str, usize, Vec<f64>); 4] {
    let states = || frames.iter().flat_map(|frame| &frame.bodies);
    [
        ("position", 3, states().flat_map(|s| s.position).collect()),
        ("rotation", 4, states().flat_map(|s| s.rotation).collect()),
        ("velocity", 3, states().flat_map(|s| s.velocity).collect()),
        ("angular_velocity", 3, states().flat_map(|s| s.angular_velocity).collect()),
    ]
}

/// Vectors as the rows of a matrix.
fn table<const N: usize>(
    py: Python<'_>,
    rows: impl Iterator<Item = [f64; N]>,
) -> PyResult<Bound<'_, PyArray2<f64>>> {
    let all: Vec<f64> = rows.flatten().collect();
    let count = all.len() / N;
    PyArray1::from_vec(py, all).reshape([count, N])
}

/// What a simulation left behind; `nonsmooth.Run` has the words.
#[pyclass(frozen, module = "nonsmooth._nonsmooth")]
pub struct Run {
    trajectory: Trajectory,
    report: RunReport,
    scene: Arc<SceneFile>,
}

#[pymethods]
impl Run {
    /// Whether every step is solved and the run came to its end.
    #[getter]
    fn solved(&self) -> bool {
        self.report.is_solved() && !self.report.stopped
    }

    /// Whether the callback ended it.
    #[getter]
    fn stopped(&self) -> bool {
        self.report.stopped
    }

    /// Steps in which bodies overlapped so deeply that shapes may have passed through each other.
    #[getter]
    fn deep(&self) -> u64 {
        self.report.deep
    }

    /// When the first of them ended.
    #[getter]
    fn first_deep(&self) -> Option<f64> {
        self.report.first_deep
    }

    /// The names of the bodies.
    #[getter]
    fn bodies(&self) -> Vec<String> {
        self.trajectory.bodies.iter().map(|body| body.name.clone()).collect()
    }

    /// How each step ended, in a word.
    #[getter]
    fn status(&self) -> Vec<String> {
        self.trajectory.steps.iter().map(|step| step.status.clone()).collect()
    }

    /// Numbers of each step by name; in `energy` and `counts` by a second one.
    fn steps<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyDict>> {
        let steps = &self.trajectory.steps;
        let all = PyDict::new(py);
        let reals: [(&str, Of<f64>); 5] = [
            ("time", |s| s.time),
            ("h", |s| s.h),
            ("residual", |s| s.residual),
            ("penetration", |s| s.penetration),
            ("wall", |s| s.wall),
        ];
        for (name, of) in reals {
            all.set_item(name, PyArray1::from_iter(py, steps.iter().map(of)))?;
        }
        let (energy, counted) = (PyDict::new(py), PyDict::new(py));
        for (k, (name, _)) in energies(&Stepped::default()).into_iter().enumerate() {
            let column = steps.iter().map(|step| energies(step)[k].1);
            energy.set_item(name, PyArray1::from_iter(py, column))?;
        }
        for (k, (name, _)) in counts(&Stepped::default()).into_iter().enumerate() {
            let column = steps.iter().map(|step| counts(step)[k].1 as i64);
            counted.set_item(name, PyArray1::from_iter(py, column))?;
        }
        all.set_item("energy", energy)?;
        all.set_item("counts", counted)?;
        Ok(all)
    }

    /// The times of the frames, and of all bodies position, rotation, velocity and angular velocity, frames × bodies × components.
    fn frames<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyDict>> {
        let frames = &self.trajectory.frames;
        let all = PyDict::new(py);
        all.set_item("t", PyArray1::from_iter(py, frames.iter().map(|frame| frame.time)))?;
        for (name, width, numbers) in motions(frames) {
            let shape = [frames.len(), self.trajectory.bodies.len(), width];
            let array: Bound<'py, PyArray3<f64>> =
                PyArray1::from_vec(py, numbers).reshape(shape)?;
            all.set_item(name, array)?;
        }
        Ok(all)
    }

    /// The names of the joints.
    #[getter]
    fn joints(&self) -> Vec<String> {
        self.trajectory.joints.clone()
    }

    /// What a joint, given by its number, did in the step before each frame: numbers by name, and vectors frames × 3.
    fn joint<'py>(&self, py: Python<'py>, number: usize) -> PyResult<Bound<'py, PyDict>> {
        let frames = &self.trajectory.frames;
        // Before the first step a joint has done nothing.
        let blank = Joint::default();
        let states =
            || frames.iter().map(|frame| frame.joints.get(number).copied().unwrap_or(blank));
        let all = PyDict::new(py);
        let column = |of: fn(Joint) -> f64| PyArray1::from_iter(py, states().map(of));
        let triple = |of: fn(Joint) -> [f64; 3]| table(py, states().map(of));
        all.set_item("angle", column(|j| j.angle))?;
        all.set_item("slide", column(|j| j.slide))?;
        all.set_item("impulse", triple(|j| j.impulse)?)?;
        all.set_item("moment", triple(|j| j.moment)?)?;
        all.set_item("violation", column(|j| j.violation))?;
        Ok(all)
    }

    /// The contacts of a frame by columns.
    fn contacts<'py>(&self, py: Python<'py>, frame: usize) -> PyResult<Bound<'py, PyDict>> {
        let frames = &self.trajectory.frames;
        let Some(frame) = frames.get(frame) else {
            return Err(expected("frame", &format!("one of {}", frames.len()), frame));
        };
        let all = PyDict::new(py);
        let contacts = &frame.contacts;
        let word = |c: &Contact| match c.status {
            None => "",
            Some(Motion::Open) => "open",
            Some(Motion::Stick) => "stick",
            Some(Motion::Slip) => "slip",
        };
        let column = |of: fn(&Contact) -> f64| PyArray1::from_iter(py, contacts.iter().map(of));
        let whole = |of: fn(&Contact) -> i64| PyArray1::from_iter(py, contacts.iter().map(of));
        let triple = |of: fn(&Contact) -> [f64; 3]| table(py, contacts.iter().map(of));
        all.set_item("a", whole(|c| c.a.into()))?;
        all.set_item("b", whole(|c| c.b.into()))?;
        all.set_item("status", contacts.iter().map(word).collect::<Vec<_>>())?;
        all.set_item("gap", column(|c| c.gap))?;
        all.set_item("mu", column(|c| c.mu))?;
        all.set_item("point", triple(|c| c.point)?)?;
        all.set_item("normal", triple(|c| c.frame[0])?)?;
        all.set_item("r", triple(|c| c.r)?)?;
        all.set_item("u", triple(|c| c.u)?)?;
        all.set_item("impulse", triple(Contact::world_impulse)?)?;
        all.set_item("mu_r", column(|c| c.mu_r))?;
        all.set_item("rolling", table(py, contacts.iter().map(|c| c.rolling))?)?;
        all.set_item("moment", triple(Contact::world_moment)?)?;
        Ok(all)
    }

    /// The page that plays the run.
    fn html(&self, py: Python<'_>) -> PyResult<String> {
        py.detach(|| {
            let world = self.scene.world().map_err(mistake)?;
            nonsmooth_record::page(&self.trajectory, &self.scene, &world).map_err(mistake)
        })
    }

    /// A picture of a frame, SVG.
    fn svg(&self, py: Python<'_>, frame: usize) -> PyResult<String> {
        py.detach(|| {
            let world = self.scene.world().map_err(mistake)?;
            drawn(&self.trajectory, &self.scene, &world, frame)
        })
    }

    /// A table of time, energies, residual and counts, a row a step, comma-separated.
    fn csv(&self) -> String {
        nonsmooth_record::csv(&self.trajectory)
    }

    /// Writes the trajectory: HDF5 (.h5), for ParaView (.pvd), glTF (.glb).
    fn save(&self, py: Python<'_>, path: PathBuf) -> PyResult<()> {
        let end = path.extension().map(|e| e.to_string_lossy().to_lowercase()).unwrap_or_default();
        py.detach(|| {
            let meshes = || {
                let world = self.scene.world().map_err(mistake)?;
                Ok::<_, PyErr>(nonsmooth_record::meshes(&self.trajectory, &world))
            };
            match end.as_str() {
                "h5" | "hdf5" => self.trajectory.write(&path).map_err(mistake),
                "pvd" => {
                    nonsmooth_io::vtk::write(&path, &self.trajectory, &meshes()?).map_err(mistake)
                }
                "glb" => {
                    let world = self.scene.world().map_err(mistake)?;
                    let upright = nonsmooth_record::upright(&self.trajectory, &world);
                    nonsmooth_io::gltf::write(&path, &upright, &meshes()?).map_err(mistake)
                }
                _ => Err(expected(
                    &path.display().to_string(),
                    "a name that ends in .h5, .csv, .html, .pvd or .glb",
                    "another ending",
                )),
            }
        })
    }
}
