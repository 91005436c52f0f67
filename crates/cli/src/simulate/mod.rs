//! `nonsmooth simulate` and `nonsmooth play`.

mod record;
mod said;

use std::path::{Path, PathBuf};
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::time::{Duration, Instant};

use nonsmooth_io::trajectory::Trajectory;
use nonsmooth_record::Origin;
use nonsmooth_scenes::{SceneEntry, SceneError};
use nonsmooth_simulate::{Control, RunReport, SceneFile, SimulateError, Simulation, StepReport};
use nonsmooth_solve::settings;
use nonsmooth_solve::{Limits, THREADS_MOST};
use serde_json::json;

use self::record::Recorder;
use crate::progress::RunBar;
use crate::report::row;
use crate::{Exit, files, interrupt, output};

/// Move the bodies of a scene through impacts, sticking and sliding: Moreau-Jean time stepping, every step judged.
///
/// A scene is a TOML (or JSON) file of bodies, materials, pairs and forces, or one of the families of `nonsmooth gen --list` with its
/// rigid bodies. Each step states and solves a frictional contact problem with Coulomb's law itself; the residual that is reported is the judge's, and the
/// energy of each step is accounted for by terms.
#[derive(Debug, clap::Args)]
#[command(after_help = EXAMPLES)]
pub struct Args {
    /// The scene: a .toml or .json file, or the name of a family of `nonsmooth gen --list`
    #[arg(required_unless_present = "schema")]
    scene: Option<PathBuf>,
    /// A value of the scene by its path (time.h=5e-4, bodies[0].mass=2), or a setting of the family; may be given several times
    #[arg(long = "set", value_name = "KEY=VALUE")]
    settings: Vec<String>,
    /// The time at the end, s [default: the scene's time.end; 1 for a family]
    #[arg(long, value_name = "T", allow_hyphen_values = true)]
    end: Option<f64>,
    /// Steps between two frames of the files written; pages and pictures show the last state too [default: the scene's output.every]
    #[arg(long, value_name = "STEPS", allow_hyphen_values = true)]
    every: Option<u64>,
    /// Write the trajectory (HDF5), while the run goes on into parts beside it: what is written stays readable whatever happens
    #[arg(long, value_name = "FILE.h5")]
    out: Option<PathBuf>,
    /// Seconds after which what is new of the trajectory is written
    #[arg(long, value_name = "S", default_value_t = 5.0, allow_hyphen_values = true)]
    flush: f64,
    /// Write a page that plays the motion in a browser, without a network
    #[arg(long, value_name = "FILE.html")]
    html: Option<PathBuf>,
    /// Write time, energy by terms, residual and counts, a row a step
    #[arg(long, value_name = "FILE.csv")]
    csv: Option<PathBuf>,
    /// Write for ParaView: FILE.pvd, with the frames in a folder beside it
    #[arg(long, value_name = "FILE.pvd")]
    vtk: Option<PathBuf>,
    /// Draw a picture on paper of the last frame; or, as the name of a folder, pictures of all frames
    #[arg(long, value_name = "FILE.svg|DIR")]
    svg: Option<PathBuf>,
    /// Write the contact problem of each step that is not solved, and with --dump-every of others, as FCLIB files in this folder
    #[arg(long, value_name = "DIR")]
    dump_fclib: Option<PathBuf>,
    /// Write the contact problem of every so many steps, too
    #[arg(long, value_name = "STEPS", requires = "dump_fclib", allow_hyphen_values = true)]
    dump_every: Option<u64>,
    /// Move bodies apart that overlap at the start, by displacements that are small in the norm of the masses, in place of refusing them
    #[arg(long)]
    settle: bool,
    /// Go on from the end of a trajectory of the same scene, and append to it unless --out names another file
    #[arg(long, value_name = "FILE.h5")]
    resume: Option<PathBuf>,
    /// Stop after this many seconds of the wall clock, also while the scene is made; the step that is being done then is not taken
    #[arg(long, value_name = "S", allow_hyphen_values = true)]
    time_limit: Option<f64>,
    /// Work on so many threads, 0 for one a core; the results are the same, bit for bit
    #[arg(long, value_name = "N", default_value_t = 1, allow_hyphen_values = true)]
    threads: usize,
    /// Say where the time went
    #[arg(long)]
    timings: bool,
    /// Report as JSON, one object
    #[arg(long)]
    json: bool,
    /// Print the completed scene, with every default, and do nothing
    #[arg(long)]
    explain: bool,
    /// Print the JSON Schema of scenes, and do nothing
    #[arg(long)]
    schema: bool,
}

const EXAMPLES: &str = "\
Examples:
  nonsmooth simulate wall --end 0.5 --html wall.html        a family of `nonsmooth gen`, as a page that plays
  nonsmooth simulate scene.toml --out run.h5 --csv run.csv  a scene of your own
  nonsmooth simulate scene.toml --set time.h=5e-4           with another step
  nonsmooth simulate scene.toml --resume run.h5 --end 10    further
  nonsmooth simulate scene.toml --explain                   the scene with every default
  nonsmooth play run.h5 --html run.html                     a page from a trajectory
  nonsmooth play run.h5 --svg frames                        a picture of each frame, in a folder

Exit codes: 0 every step is solved; 1 a step is not solved, or the run was stopped; 2 a mistake in a file or an option; 130 Ctrl-C pressed twice.";

/// Make a page that plays a trajectory in a browser, or files for ParaView and other viewers.
#[derive(Debug, clap::Args)]
pub struct PlayArgs {
    /// A trajectory that `nonsmooth simulate --out` has written
    file: PathBuf,
    /// The page, without a network [default: the file's name with .html]
    #[arg(long, value_name = "FILE.html")]
    html: Option<PathBuf>,
    /// For ParaView: FILE.pvd, with the frames in a folder beside it
    #[arg(long, value_name = "FILE.pvd")]
    vtk: Option<PathBuf>,
    /// As glTF, for Blender and other viewers
    #[arg(long, value_name = "FILE.glb")]
    glb: Option<PathBuf>,
    /// A picture on paper of the last frame; or, as the name of a folder, pictures of all frames
    #[arg(long, value_name = "FILE.svg|DIR")]
    svg: Option<PathBuf>,
}

/// How the names of trajectories end.
const TRAJECTORY: &[&str] = &["h5", "hdf5"];

/// What is wrong with a table `time` without an end.
const NO_END: &str = "missing field `end`";

/// The end of a family's run, s, where nobody says another.
const FAMILY_END: f64 = 1.0;

/// A scene from a file or a family; none where the limits in force ended its making.
fn scene(args: &Args) -> Result<Option<SceneFile>, String> {
    let Some(path) = &args.scene else { return Err("expected a scene, found none".into()) };
    let mut changes: Vec<&str> = args.settings.iter().map(String::as_str).collect();
    let name = path.to_string_lossy();
    let is_file = path.extension().is_some() || path.components().count() > 1;
    let mut scene = match SceneEntry::find(&name) {
        Ok(family) if !path.exists() => {
            let set = settings::from_texts(&changes).map_err(|e| format!("--set: {e}"))?;
            match family.make(&set) {
                Err(SceneError::Stopped) => return Ok(None),
                Err(e) => return Err(format!("{name}: {e}")),
                Ok(made) => SceneFile::of_made(&name, set, made, FAMILY_END),
            }
        }
        Err(e) if !path.exists() && !is_file => {
            return Err(format!("{name}: expected a file or a family of scenes, and {e}"));
        }
        _ => {
            if let Some(origin) = path.exists().then(|| Origin::of(path)).flatten() {
                return Err(format!(
                    "{name}: expected a scene as TOML or JSON, found {}, of which `nonsmooth convert {name} {}` makes one",
                    origin.name(),
                    path.with_extension("toml").display()
                ));
            }
            let text = SceneFile::text(path)?;
            // --end stands in for an end that the scene does not state; its value comes below.
            changes.extend(args.end.map(|_| "time.end=0"));
            let wrong = |e: SimulateError| match &e {
                SimulateError::Schema { path, problem } if path == "time" && problem == NO_END => {
                    format!("{name}: {e}; --end T gives it")
                }
                _ => format!("{name}: {e}"),
            };
            let mut scene = SceneFile::parse(&text, &changes).map_err(wrong)?;
            scene.load_meshes(path.parent().unwrap_or(Path::new(""))).map_err(wrong)?;
            scene
        }
    };
    if let Some(end) = args.end {
        scene.time.end = end;
    }
    if let Some(every) = args.every {
        scene.output.every = every;
    }
    Ok(Some(scene))
}

/// Says that the run ended before it began.
fn stopped(path: &Path, as_json: bool) -> Exit {
    let why = SceneError::Stopped.to_string();
    output::print(&match as_json {
        true => {
            let run = json!({
                "scene": path.to_string_lossy(), "status": "not_solved", "message": why, "steps": 0, "stopped": true,
            });
            format!("{run}\n")
        }
        false => format!("{}: {why}\n", path.display()),
    });
    Exit::NotSolved
}

/// Where an output goes: to what the option says, or to a file beside the scene that the scene names.
fn target(option: &Option<PathBuf>, named: &Option<String>, scene: &Path) -> Option<PathBuf> {
    let beside = |name: &String| scene.parent().unwrap_or(Path::new("")).join(name);
    option.clone().or_else(|| named.as_ref().map(beside))
}

/// Checks that all outputs can be written, each to a file of its own whose name says what it is.
fn writable<'a, const N: usize>(
    read: impl IntoIterator<Item = &'a Path>,
    written: [(&str, &Option<PathBuf>); N],
) -> Result<(), String> {
    let there = || written.iter().filter_map(|(option, path)| Some((*option, path.as_deref()?)));
    for (option, path) in there() {
        match option {
            "--svg" => record::drawable(path)?,
            option => files::writable(option, path)?,
        }
    }
    files::apart(read, there())?;
    there().try_for_each(|(option, path)| match option {
        "--html" => files::ends_in(option, path, &["html", "htm"]),
        "--csv" => files::ends_in(option, path, &["csv"]),
        "--vtk" => files::ends_in(option, path, &["pvd"]),
        "--glb" => files::ends_in(option, path, &["glb"]),
        // Of pictures the name may be a folder's, of trajectories it is checked before all else.
        _ => Ok(()),
    })
}

/// Runs `simulate`.
pub fn run(args: &Args) -> Result<Exit, String> {
    if args.schema {
        output::print(&format!("{:#}\n", SceneFile::schema()));
        return Ok(Exit::Solved);
    }
    let limit = files::time_limit(args.time_limit)?;
    let cancel = interrupt::flag();
    if let Some(seconds) = limit {
        end_after(seconds, cancel.clone());
    }
    let mut limits = Limits { max_iterations: 100_000, cancel: Some(cancel), ..Limits::default() };
    // A large scene takes as long to make as many steps of it; in the steps the limits are the simulation's.
    let making = limits.budget(Instant::now()).enter();
    let path = args.scene.clone().unwrap_or_default();
    let Some(scene) = scene(args)? else { return Ok(stopped(&path, args.json)) };
    limits.tolerance = scene.solver.tol;
    if args.explain {
        output::print(&scene.to_toml());
        return Ok(Exit::Solved);
    }
    if args.threads > THREADS_MOST {
        let found = args.threads;
        return Err(format!(
            "--threads: expected at most {THREADS_MOST}, 0 for one a core, found {found}"
        ));
    }
    let out = target(&args.out, &scene.output.trajectory, &path).or_else(|| args.resume.clone());
    let html = target(&args.html, &scene.output.html, &path);
    let csv = target(&args.csv, &scene.output.csv, &path);
    let vtk = target(&args.vtk, &scene.output.vtk, &path);
    if let Some(out) = &out {
        let resumed = args.out.is_none() && args.resume.as_ref() == Some(out);
        files::ends_in(if resumed { "--resume" } else { "--out" }, out, TRAJECTORY)?;
    }
    // A trajectory that is resumed goes on in its own file.
    let resumed =
        args.resume.as_deref().filter(|file| !out.iter().any(|out| files::same(out, file)));
    let read = [args.scene.as_deref(), resumed];
    writable(
        read.into_iter().flatten(),
        [
            ("--out", &out),
            ("--html", &html),
            ("--csv", &csv),
            ("--vtk", &vtk),
            ("--svg", &args.svg),
        ],
    )?;
    if args.dump_every == Some(0) {
        return Err("--dump-every: expected at least one step, found 0".into());
    }
    if let Some(folder) = &args.dump_fclib {
        files::folder("--dump-fclib", folder)?;
    }
    let wrong = |e| format!("{}: {e}", path.display());
    let built = match args.settle {
        true => scene.build_settled().map(|(made, settled)| (made, Some(settled))),
        false => scene.build().map(|made| (made, None)),
    };
    drop(making);
    if let Err(SimulateError::Scene(SceneError::Stopped)) = built {
        return Ok(stopped(&path, args.json));
    }
    let (simulation, settled) = built.map_err(wrong)?;
    let mut simulation = simulation.with_limits(limits).with_threads(args.threads);
    let frames = out.is_some() || html.is_some() || vtk.is_some() || args.svg.is_some();
    let mut recorder = Recorder::new(&scene, &simulation, frames);
    if let Some(file) = &args.resume {
        recorder.resume(file, &mut simulation)?;
        let (end, t) = (scene.time.end, simulation.state().t);
        // Up to the rounding of the sum that time is.
        if end < t - 1e-3 * scene.time.h {
            let place = if args.end.is_some() { "--end" } else { "time.end" };
            let file = file.display();
            return Err(format!(
                "{place}: expected a time of at least {t} s, which --resume {file} has reached, found {end}"
            ));
        }
    }
    if let Some(out) = &out {
        let resumed = args.resume.as_ref().is_some_and(|file| files::same(file, out));
        recorder.write_to(out, resumed, pause(args.flush)?);
    }
    let begun = Instant::now();
    let mut bar = RunBar::new(&path.to_string_lossy(), scene.time.end, !args.json);
    let mut mistake = None;
    let mut watch = |simulation: &Simulation, report: &StepReport| {
        recorder.step(simulation, report);
        bar.watch(report.t, report.counts.active, report.residual);
        match recorder.flush(simulation) {
            Ok(()) => Control::Continue,
            Err(e) => {
                mistake = Some(e);
                Control::Stop
            }
        }
    };
    let mut observer = record::Dump {
        folder: args.dump_fclib.as_deref(),
        every: args.dump_every,
        title: &scene.name,
        problem: None,
        mistake: None,
        watch: &mut watch,
    };
    let report = simulation.run(scene.time.end, scene.time.h, &mut observer).map_err(wrong)?;
    let unwritten = observer.mistake;
    drop(bar);
    let seconds = begun.elapsed().as_secs_f64();
    // What cannot be written is no reason to lose the others, nor the report.
    let (mut written, mut mistakes) = (vec![], vec![]);
    mistakes.extend(unwritten);
    let mut note = |path: &PathBuf, done: Result<(), String>| match done {
        Ok(()) => written.push(path.clone()),
        Err(e) => mistakes.push(e),
    };
    if let Some(out) = &out {
        note(out, mistake.map_or_else(|| recorder.finish(&simulation), Err));
    }
    recorder.show_the_end(&simulation);
    if let Some(csv) = &csv {
        note(csv, files::write_text("--csv", csv, &recorder.csv()));
    }
    if let Some(html) = &html {
        let page = record::page(&recorder.trajectory, &scene, simulation.world());
        note(html, page.and_then(|page| files::write_text("--html", html, &page)));
    }
    if let Some(vtk) = &vtk {
        note(vtk, record::paraview(vtk, &recorder.trajectory, simulation.world()));
    }
    if let Some(svg) = &args.svg {
        let drawn = record::drawings(svg, &recorder.trajectory, &scene, simulation.world());
        note(svg, drawn);
    }
    let run = said::Run {
        path: &path,
        scene: &scene,
        simulation: &simulation,
        recorder: &recorder,
        report: &report,
        settled,
        seconds,
        written: &written,
    };
    match args.json {
        true => output::print(&format!("{}\n", run.json())),
        false => output::print(&run.text(args.timings)),
    }
    match mistakes.is_empty() {
        true => Ok(Exit::solved(complete(&report))),
        false => Err(mistakes.join("; ")),
    }
}

/// The time between two flushes.
fn pause(seconds: f64) -> Result<Duration, String> {
    match Duration::try_from_secs_f64(seconds) {
        Ok(pause) => Ok(pause),
        // Beyond the reach of the clock.
        Err(_) if seconds > 0.0 => Ok(Duration::MAX),
        Err(_) => {
            Err(format!("--flush: expected a number of seconds of at least 0, found {seconds}"))
        }
    }
}

/// Sets the flag after so many seconds, however long a step takes.
fn end_after(seconds: f64, flag: Arc<AtomicBool>) {
    // A limit beyond the reach of the clock is none.
    if let Ok(limit) = Duration::try_from_secs_f64(seconds) {
        // A thread would come too late where there is no time at all.
        flag.fetch_or(limit.is_zero(), Ordering::Relaxed);
        std::thread::spawn(move || {
            std::thread::sleep(limit);
            flag.store(true, Ordering::Relaxed);
        });
    }
}

fn complete(report: &RunReport) -> bool {
    report.is_solved() && !report.stopped
}

/// Runs `play`.
pub fn play(args: &PlayArgs) -> Result<Exit, String> {
    let file = &args.file;
    let others = [&args.vtk, &args.glb, &args.svg];
    let page = args.html.is_some() || others.iter().all(|path| path.is_none());
    let html = page.then(|| args.html.clone().unwrap_or_else(|| file.with_extension("html")));
    writable(
        [file.as_path()],
        [("--html", &html), ("--vtk", &args.vtk), ("--glb", &args.glb), ("--svg", &args.svg)],
    )?;
    let trajectory = Trajectory::read(file).map_err(|e| e.to_string())?;
    let wrong = |e| format!("{}: /scene: {e}", file.display());
    let scene = SceneFile::parse(&trajectory.scene, &[]).map_err(wrong)?;
    let world = scene.world().map_err(wrong)?;
    let (frames, steps) = (trajectory.frames.len(), trajectory.steps.len());
    let mut said = format!("{}: {frames} frames of {steps} steps\n", file.display());
    if let Some(html) = &html {
        files::write_text("--html", html, &record::page(&trajectory, &scene, &world)?)?;
        row(&mut said, "page", html.display());
    }
    if let Some(vtk) = &args.vtk {
        record::paraview(vtk, &trajectory, &world)?;
        row(&mut said, "ParaView", vtk.display());
    }
    if let Some(glb) = &args.glb {
        record::gltf(glb, &trajectory, &world)?;
        row(&mut said, "glTF", glb.display());
    }
    if let Some(svg) = &args.svg {
        record::drawings(svg, &trajectory, &scene, &world)?;
        row(&mut said, "pictures", svg.display());
    }
    output::print(&said);
    Ok(Exit::Solved)
}
