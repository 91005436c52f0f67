//! `nonsmooth draw`.

use std::path::{Path, PathBuf};
use std::time::Instant;

use nonsmooth_io::ProblemFile;
use nonsmooth_problem::check::Judged;
use nonsmooth_problem::{AnyPoint, AnyProblem};
use nonsmooth_scenes::SceneError;
use nonsmooth_scenes::draw::Picture;
use nonsmooth_solve::registry;
use nonsmooth_solve::settings::SettingsMap;

use crate::kinds::AnyVerdict;
use crate::plot::problem::{Solution, svg};
use crate::plot::scene as scene_plot;
use crate::solve::{Plan, limits, solve};
use crate::{Exit, files, output, report};

/// Draw a problem: its bodies with the impulses, where the file has bodies; else the entries of its matrices, and of contacts the sizes of the impulses and where they
/// lie in their friction cones.
///
/// The impulses are those of the file's solution; where there is none, the problem is solved first. Files that `nonsmooth gen SCENE` has written hold
/// bodies, and keep them through `solve --out` and `convert`.
#[derive(Debug, clap::Args)]
#[command(after_help = EXAMPLES)]
pub struct Args {
    #[arg(value_name = "FILE", help = files::help("A file with a problem", |_| true))]
    file: PathBuf,
    /// The picture, as .svg or, of bodies, as .html, a page that turns them in a browser, without a network; `-` for the standard output [default: the file's name
    /// with .svg, unless that is there already]
    #[arg(long, value_name = "FILE")]
    out: Option<PathBuf>,
    /// What the picture is to show well [default: bodies or forces, whichever shows more, if the file has bodies, else matrices]
    #[arg(long, value_enum)]
    view: Option<View>,
    /// Solve the problem even if the file has a solution
    #[arg(long)]
    solve: bool,
    /// The relative residual of the solve, and at which the statuses of the contacts are judged
    #[arg(long, value_name = "TOL", default_value = "1e-8", allow_hyphen_values = true)]
    tol: f64,
    /// At most this many seconds for the solve
    #[arg(long, value_name = "S", default_value = "60", allow_hyphen_values = true)]
    time_limit: f64,
}

const EXAMPLES: &str = "\
Examples:
  nonsmooth draw wall.hdf5
  nonsmooth draw solved.hdf5 --out forces.svg --view forces
  nonsmooth draw solved.hdf5 --out view.html

Exit codes: 0 drawn; 1 drawn with the best point of a problem that is not solved; 2 a mistake in a file or an option.";

/// Runs the command.
pub fn run(args: &Args) -> Result<Exit, String> {
    let file = &args.file;
    let out = place(args)?;
    let limits = limits(args.tol, None, Some(args.time_limit))?;
    let content = files::read(file)?;
    let scene = scene(args, &content, &out)?;
    let contacts = matches!(content.problem, AnyProblem::Friction(_));
    let stored = content.solution.as_ref().filter(|_| contacts && !args.solve);
    let found = match stored {
        Some(stored) => {
            let verdict = content.problem.judge(&stored.point, args.tol);
            let verdict = verdict.map_err(|e| format!("{}: {e}", file.display()))?;
            let passes = if verdict.solved { "passes" } else { "does not pass" };
            Some((
                stored.point.clone(),
                verdict,
                format!("stored solution, {passes} at {:e}", args.tol),
            ))
        }
        None if contacts => {
            let settings = &SettingsMap::new();
            let begun = Instant::now();
            let plan = Plan { solver: registry::DEFAULT, settings, limits, begun, progress: true };
            let solved = solve(file, &content.problem, None, &plan)?;
            let says = format!("{} by {}", solved.status, registry::DEFAULT);
            Some((solved.point, solved.verdict, says))
        }
        None => None,
    };
    let text = match scene {
        Some(picture) => bodies(picture, found.as_ref(), &out, args.view)
            .map_err(|e| format!("{}: /nonsmooth/drawing: {e}", file.display()))?,
        None => picture(&content, found.as_ref())?,
    };
    let mut said = format!("{}: {}\n", out.display(), report::problem_text(&content.problem));
    if let Some((_, verdict, says)) = &found {
        report::row(&mut said, "solution", says);
        report::verdict_text(&mut said, &content, verdict, args.tol, 0);
    }
    if files::is_stream(&out) {
        output::print(&text);
        output::remark(&said);
    } else {
        files::write_text("--out", &out, &text)?;
        output::print(&said);
    }
    Ok(Exit::solved(found.is_none_or(|(_, verdict, _)| verdict.solved)))
}

/// What the picture is to show well.
#[derive(Debug, Clone, Copy, PartialEq, Eq, clap::ValueEnum)]
enum View {
    /// Bodies, with an arrow for each impulse
    Bodies,
    /// Impulses as force chains, as wide as they are large, in front of pale bodies
    Forces,
    /// The entries of the matrices, the sizes of the impulses, the friction cones
    Matrices,
}

/// The bodies of the file, if they are to be drawn.
fn scene(args: &Args, content: &ProblemFile, out: &Path) -> Result<Option<Picture>, String> {
    let page = out.extension().is_some_and(|e| e.eq_ignore_ascii_case("html"));
    let place = args.file.display();
    match (&content.drawing, args.view) {
        (_, Some(View::Matrices)) if page => {
            Err(format!("--view matrices: expected --out FILE.svg, found {}", out.display()))
        }
        (_, Some(View::Matrices)) => Ok(None),
        (None, view) if page || view.is_some() => Err(format!(
            "{place}: expected a file with bodies, as nonsmooth gen SCENE writes it, found a problem alone"
        )),
        (None, _) => Ok(None),
        (Some(drawing), _) => Picture::from_json(drawing)
            .map(Some)
            .map_err(|e| format!("{place}: /nonsmooth/drawing: {e}")),
    }
}

fn bodies(
    picture: Picture,
    found: Option<&(AnyPoint, AnyVerdict, String)>,
    out: &Path,
    view: Option<View>,
) -> Result<String, SceneError> {
    let picture = match found {
        Some((point, verdict, _)) => scene_plot::solved(picture, point, verdict)?,
        None => picture,
    };
    let view = match view {
        Some(View::Bodies) => Some(scene_plot::View::Bodies),
        Some(View::Forces) => Some(scene_plot::View::Forces),
        Some(View::Matrices) | None => None,
    };
    scene_plot::drawn(&picture, out, view)
}

fn picture(
    content: &ProblemFile,
    found: Option<&(AnyPoint, AnyVerdict, String)>,
) -> Result<String, String> {
    let size = report::problem_text(&content.problem);
    let title = match content.info.title.as_deref().map(str::trim).filter(|t| !t.is_empty()) {
        Some(title) => format!("{}: {size}", title.replace(char::is_control, " ")),
        None => size,
    };
    let solution =
        found.map(|(point, verdict, says)| Solution { point, statuses: &verdict.statuses, says });
    svg(&title, &content.problem, solution.as_ref())
}

/// Where the picture goes.
fn place(args: &Args) -> Result<PathBuf, String> {
    if let Some(out) = &args.out {
        if !files::is_stream(out) {
            files::ends_in("--out", out, scene_plot::EXTENSIONS)?;
        }
        files::writable_or_stream("--out", out)?;
        files::apart([args.file.as_path()], [("--out", out.as_path())])?;
        return Ok(out.clone());
    }
    if files::is_stream(&args.file) {
        return Ok(args.file.clone());
    }
    let name = args.file.with_extension("svg");
    let name = Path::new(name.file_name().unwrap_or_default()).to_path_buf();
    if name.exists() {
        let name = name.display();
        return Err(format!(
            "{name}: expected no such file, or --out to name the picture, found one"
        ));
    }
    files::writable("--out", &name)?;
    Ok(name)
}
