//! What is kept of a run: the trajectory, and what is made of it.

use std::path::Path;
use std::time::{Duration, Instant};

use nonsmooth_io::trajectory::{Checkpoint, Trajectory, Writer};
use nonsmooth_io::{Info, IoError, ProblemFile, vtk};
use nonsmooth_problem::{AnyProblem, Friction, Problem};
use nonsmooth_scenes::SceneError;
use nonsmooth_scenes::draw::{self, Drawing};
use nonsmooth_simulate::{Control, Observer, SceneFile, Simulation, StepReport, World};

use crate::files;

/// The trajectory of a run, as it grows.
pub struct Recorder {
    pub trajectory: Trajectory,
    every: u64,
    /// Whether frames are asked for; steps are always kept.
    frames: bool,
    writer: Option<Writer>,
    flushed: Instant,
    /// Between two flushes, at least; a flush that takes longer is followed by as long a time without.
    pause: Duration,
    wait: Duration,
    /// Steps of the trajectory that was gone on from.
    pub earlier: usize,
}

impl Recorder {
    pub fn new(scene: &SceneFile, simulation: &Simulation, frames: bool) -> Self {
        let mut recorder = Self {
            trajectory: nonsmooth_record::begun(scene, simulation),
            every: scene.output.every,
            frames,
            writer: None,
            flushed: Instant::now(),
            pause: Duration::MAX,
            wait: Duration::MAX,
            earlier: 0,
        };
        recorder.frame(simulation);
        recorder
    }

    /// Goes on from the end of a trajectory of the same scene.
    pub fn resume(&mut self, file: &Path, simulation: &mut Simulation) -> Result<(), String> {
        let name = file.display();
        let earlier = Trajectory::read(file).map_err(|e| e.to_string())?;
        let like = |text: &str| {
            let scene = SceneFile::parse(text, &[]).map_err(|e| format!("{name}: /scene: {e}"))?;
            let mut scene = SceneFile { output: Default::default(), ..scene };
            scene.time.end = 0.0;
            Ok::<_, String>(scene)
        };
        if like(&earlier.scene)? != like(&self.trajectory.scene)? {
            return Err(format!(
                "--resume {name}: expected a trajectory of the same scene but for time.end and output, found one of another"
            ));
        }
        let Some(checkpoint) = &earlier.checkpoint else {
            return Err(format!(
                "--resume {name}: expected a trajectory with a checkpoint, found none"
            ));
        };
        simulation.restore(&checkpoint.state).map_err(|e| format!("--resume {name}: {e}"))?;
        self.earlier = earlier.steps.len();
        let scene = std::mem::take(&mut self.trajectory.scene);
        self.trajectory = Trajectory { scene, ..earlier };
        Ok(())
    }

    /// Takes note of a step.
    pub fn step(&mut self, simulation: &Simulation, report: &StepReport) {
        let number = simulation.state().steps;
        self.trajectory.steps.push(nonsmooth_record::step(number, report));
        if self.frames && number.is_multiple_of(self.every) {
            self.frame(simulation);
        }
    }

    /// Ends what is shown with the state at the end, if that is no frame already.
    pub fn show_the_end(&mut self, simulation: &Simulation) {
        let last = self.trajectory.frames.last().map(|frame| frame.step);
        if last != Some(simulation.state().steps) {
            self.frame(simulation);
        }
    }

    fn frame(&mut self, simulation: &Simulation) {
        if self.frames {
            self.trajectory.frames.push(nonsmooth_record::frame(simulation));
        }
    }

    /// Writes the trajectory to a file with at least so long a time between; `resumed` if what stands there is its beginning.
    pub fn write_to(&mut self, out: &Path, resumed: bool, pause: Duration) {
        self.writer = Some(Writer::new(out, resumed));
        (self.pause, self.wait) = (pause, pause);
    }

    /// Writes what is new of the trajectory, if it is time to.
    pub fn flush(&mut self, simulation: &Simulation) -> Result<(), String> {
        match self.flushed.elapsed() < self.wait {
            true => Ok(()),
            false => self.write(simulation, Writer::flush),
        }
    }

    /// Writes the whole trajectory.
    pub fn finish(&mut self, simulation: &Simulation) -> Result<(), String> {
        self.write(simulation, Writer::finish)
    }

    fn write(
        &mut self,
        simulation: &Simulation,
        how: fn(&mut Writer, &Trajectory) -> Result<(), IoError>,
    ) -> Result<(), String> {
        let Some(writer) = &mut self.writer else { return Ok(()) };
        let begun = Instant::now();
        let state = simulation.state();
        self.trajectory.checkpoint =
            Some(Checkpoint { step: state.steps, time: state.t, state: simulation.checkpoint() });
        how(writer, &self.trajectory).map_err(|e| format!("--out {e}"))?;
        self.wait = self.pause.max(begun.elapsed());
        self.flushed = Instant::now();
        Ok(())
    }

    /// Time, energies, residual and counts, a row a step.
    pub fn csv(&self) -> String {
        nonsmooth_record::csv(&self.trajectory)
    }
}

/// The page that plays a trajectory.
pub fn page(trajectory: &Trajectory, scene: &SceneFile, world: &World) -> Result<String, String> {
    nonsmooth_record::page(trajectory, scene, world).map_err(|e| e.to_string())
}

/// Files for ParaView.
pub fn paraview(path: &Path, trajectory: &Trajectory, world: &World) -> Result<(), String> {
    let meshes = nonsmooth_record::meshes(trajectory, world);
    let shown = nonsmooth_record::in_cell(trajectory, world);
    vtk::write(path, &shown, &meshes).map_err(|e| format!("--vtk {e}"))
}

/// A glTF file.
pub fn gltf(path: &Path, trajectory: &Trajectory, world: &World) -> Result<(), String> {
    let meshes = nonsmooth_record::meshes(trajectory, world);
    let upright = nonsmooth_record::upright(trajectory, world);
    nonsmooth_io::gltf::write(path, &upright, &meshes).map_err(|e| format!("--glb {e}"))
}

/// Whether pictures go to a folder; else to one file.
fn is_folder(path: &Path) -> bool {
    path.extension().is_none()
}

/// Checks that pictures can be written there.
pub fn drawable(path: &Path) -> Result<(), String> {
    match path.extension() {
        None => files::folder("--svg", path),
        Some(e) if e == "svg" => files::writable("--svg", path),
        Some(_) => Err(format!(
            "--svg {}: expected a name that ends in .svg, or the name of a folder, found another ending",
            path.display()
        )),
    }
}

/// Pictures of frames: of the last one in a file, or of all in a folder.
pub fn drawings(
    path: &Path,
    trajectory: &Trajectory,
    scene: &SceneFile,
    world: &World,
) -> Result<(), String> {
    let playback = nonsmooth_record::playback(trajectory, scene, world);
    let wrong = |e: SceneError| format!("--svg: {e}");
    let draw = |frame: usize, to: &Path| {
        let picture = playback.picture(frame).map_err(wrong)?;
        let drawing = Drawing { view: playback.view, ..Drawing::default() };
        let text = draw::svg(&picture, &drawing).map_err(wrong)?;
        files::write_text("--svg", to, &text)
    };
    let frames = trajectory.frames.len();
    match is_folder(path) {
        true => {
            let name = |k: usize| path.join(format!("frame-{k:06}.svg"));
            (0..frames).try_for_each(|k| draw(k, &name(k)))?;
            // Frames of a longer run that was there before belong to another film.
            (frames..).map(name).take_while(|old| old.exists()).try_for_each(|old| {
                std::fs::remove_file(&old).map_err(|e| format!("--svg {}: {e}", old.display()))
            })
        }
        false => draw(frames.saturating_sub(1), path),
    }
}

/// Writes contact problems of steps, and lets another observer see them.
pub struct Dump<'a> {
    pub folder: Option<&'a Path>,
    pub every: Option<u64>,
    pub title: &'a str,
    /// The problem of the step that is being done.
    pub problem: Option<Friction>,
    /// What went wrong.
    pub mistake: Option<String>,
    pub watch: &'a mut dyn FnMut(&Simulation, &StepReport) -> Control,
}

impl Observer for Dump<'_> {
    fn before(&mut self, simulation: &mut Simulation, h: f64) {
        if self.folder.is_some() {
            self.problem = simulation.problem(h).ok().flatten();
        }
    }

    fn step(&mut self, simulation: &Simulation, report: &StepReport) -> Control {
        let number = simulation.state().steps;
        let due =
            self.every.is_some_and(|n| number.is_multiple_of(n)) || !report.status.is_solved();
        if let (Some(folder), Some(problem), true) = (self.folder, self.problem.take(), due) {
            let path = folder.join(format!("step-{number:07}.hdf5"));
            if let Err(e) = fclib(&path, problem, self.title) {
                self.mistake.get_or_insert(e);
                return Control::Stop;
            }
        }
        (self.watch)(simulation, report)
    }
}

fn fclib(path: &Path, problem: Friction, title: &str) -> Result<(), String> {
    let problem = AnyProblem::Friction(problem);
    let format = files::target_format("--dump-fclib", path, None, problem.kind(), None)?;
    let info = Info { title: Some(title.into()), ..Info::default() };
    files::write(path, format, &ProblemFile { info, ..ProblemFile::new(problem) })
}
