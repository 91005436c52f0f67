//! `nonsmooth gen`.

mod complementarity;
mod scene;
mod suite;

use std::path::{Path, PathBuf};
use std::time::Instant;

use nonsmooth_io::{Info, ProblemFile};
use nonsmooth_problem::{AnyProblem, Problem};
use nonsmooth_scenes::draw::Picture;
use nonsmooth_scenes::{Scene, SceneEntry, SceneError, scenes::SCENES};
use nonsmooth_solve::Limits;
use nonsmooth_solve::registry;
use nonsmooth_solve::settings::{self, Setting, SettingsMap};

use self::complementarity::Maker;
use self::scene::{Form, plain, summary, told};
use crate::plot::scene::{self as scene_plot, View};
use crate::solve::{Plan, Solved, limits, seconds, solve, with_solution};
use crate::{Exit, files, output, report};

/// Generate the problem of a scene, or a complementarity problem.
///
/// A scene is a set of rigid bodies or elastic solids in contact; its problem is one Moreau-Jean time step from
/// the initial velocities. Without a scene, or with --list, the scenes and their settings are listed. A suite is a
/// TOML file that lists problems: each [[problem]] has a family (a scene), and may have a name, a form and
/// settings; where a setting or the form is a list, there is a problem for each combination. A complementarity problem
/// (lcp, mlcp, obstacle, bratu, ...) is written with the solution that was planted in it, if one was.
#[derive(Debug, clap::Args)]
#[command(after_help = EXAMPLES, group(clap::ArgGroup::new("what").args(["scene", "suite"])))]
pub struct Args {
    /// The scene or complementarity problem, one of `nonsmooth gen --list`
    scene: Option<String>,
    /// A setting of it; may be given several times
    #[arg(long = "set", value_name = "KEY=VALUE", requires = "scene")]
    settings: Vec<String>,
    /// Generate every problem that a file lists, as DIR/FAMILY/NAME.hdf5 below the directory of --out
    #[arg(
        long,
        value_name = "FILE.toml",
        requires = "out",
        conflicts_with_all = ["settings", "form", "draw", "solve", "list"]
    )]
    suite: Option<PathBuf>,
    /// Write the problem: FCLIB (HDF5); a complementarity problem as .toml or .nl, a linear one also as .mtx
    #[arg(long, value_name = "FILE", requires = "what")]
    out: Option<PathBuf>,
    /// State it with the velocities of the bodies (M, H, f, w), or at the contacts alone (W, q)
    #[arg(long, value_enum, default_value_t = Form::Global)]
    form: Form,
    /// Draw the scene, as .svg or as .html, a page that turns it in a browser, without a network; with --solve also the impulses, coloured by the status
    /// of the contact
    #[arg(long, value_name = "FILE", requires = "scene")]
    draw: Option<PathBuf>,
    /// What the picture is to show well [default: forces, where bodies hide most of the impulses, else bodies]
    #[arg(long, value_enum, requires = "draw")]
    view: Option<View>,
    /// Solve the problem (default solver) and store its /solution
    #[arg(long, requires = "scene")]
    solve: bool,
    /// The relative residual that --solve is to reach
    #[arg(
        long,
        value_name = "TOL",
        default_value = "1e-10",
        requires = "solve",
        allow_hyphen_values = true
    )]
    tol: f64,
    /// At most this many seconds for --solve
    #[arg(long, value_name = "S", requires = "solve", allow_hyphen_values = true)]
    time_limit: Option<f64>,
    /// List the scenes and their settings (of one scene, if it is named)
    #[arg(long, conflicts_with_all = ["settings", "out", "draw", "solve"])]
    list: bool,
}

const EXAMPLES: &str = "\
Examples:
  nonsmooth gen --list
  nonsmooth gen wall --set rows=8 --set mu=0.4 --out wall.hdf5
  nonsmooth gen arch --out arch.hdf5 --form local --solve --draw arch.svg
  nonsmooth gen sphere_pile --solve --draw pile.html
  nonsmooth gen lcp --set n=100 --set class=p --set degenerate=0.1 --out hard.toml
  nonsmooth gen --suite docs/benchmarks/suite.toml --out problems/

Exit codes: 0 done; 1 --solve did not reach --tol (the best point is stored); 2 a mistake in the options.";

/// Runs the command.
pub fn run(args: &Args) -> Result<Exit, String> {
    if let (Some(file), Some(out)) = (&args.suite, &args.out) {
        return suite::run(file, out);
    }
    let Some(name) = args.scene.as_deref() else {
        output::print(&format!("{}\n{}", list(SCENES), makers(complementarity::MAKERS)));
        return Ok(Exit::Solved);
    };
    let made = Made::find(name)?;
    if args.list {
        output::print(&made.list());
        return Ok(Exit::Solved);
    }
    made.fits(args)?;
    let settings = settings::from_texts(&args.settings).map_err(|e| format!("--set: {e}"))?;
    let Some(label) = args.out.as_deref().or(args.draw.as_deref()) else {
        let (expected, found) = match made {
            Made::Scene(_) => ("--out FILE.hdf5, --draw FILE.svg or --draw FILE.html", "neither"),
            Made::Complementarity(_) => ("--out FILE.toml", "none"),
        };
        return Err(format!("gen {name}: expected {expected}, found {found}"));
    };
    args.out.as_deref().map_or(Ok(()), |path| files::writable_or_stream("--out", path))?;
    args.draw.as_deref().map_or(Ok(()), |path| files::writable("--draw", path))?;
    args.draw
        .as_deref()
        .map_or(Ok(()), |path| files::ends_in("--draw", path, scene_plot::EXTENSIONS))?;
    let written = [("--out", args.out.as_deref()), ("--draw", args.draw.as_deref())];
    files::apart([], written.into_iter().filter_map(|(option, path)| Some((option, path?))))?;

    if args.solve {
        files::tolerance(args.tol)?;
        files::time_limit(args.time_limit)?;
    }
    let (scene, mut content) = made.make(&settings, args.form)?;
    let drawn = |e: SceneError| format!("scene {name}: {e}");
    let picture = scene.as_ref().map(Picture::new).transpose().map_err(drawn)?;
    content.drawing = picture.as_ref().map(Picture::json);
    let kind = content.problem.kind();
    let format = |path| files::target_format("--out", path, None, kind, None);
    let out = args.out.as_deref().map(|path| Ok::<_, String>((path, format(path)?))).transpose()?;
    let solved = match args.solve {
        // Ctrl-C ends the program at once until here: nothing is made yet.
        true => {
            let limits = limits(args.tol, None, args.time_limit)?;
            Some(solve_by_default(label, &content.problem, limits)?)
        }
        false => None,
    };
    if let Some(solved) = &solved {
        content = with_solution(content, solved);
    }
    if let Some((path, format)) = out {
        files::write(path, format, &content)?;
    }
    if let (Some(path), Some(picture)) = (&args.draw, picture) {
        let text = drawing(picture, solved.as_ref(), path, args.view).map_err(drawn)?;
        files::write_text("--draw", path, &text)?;
    }
    let mut text = said(label, scene.as_ref(), &content);
    if let Some(solved) = &solved {
        solution(&mut text, &content, solved, args.tol);
    }
    match out {
        // The standard output is the file's.
        Some((path, _)) if files::is_stream(path) => output::remark(&text),
        _ => output::print(&text),
    }
    Ok(Exit::solved(solved.as_ref().is_none_or(Solved::is_solved)))
}

/// One line on what was made.
fn said(label: &Path, scene: Option<&Scene>, content: &ProblemFile) -> String {
    match scene {
        Some(scene) => summary(label, scene, &content.problem),
        None => format!("{}: {}\n", label.display(), report::problem_text(&content.problem)),
    }
}

/// What makes a problem.
#[derive(Clone, Copy)]
enum Made {
    Scene(&'static SceneEntry),
    Complementarity(&'static Maker),
}

impl Made {
    fn find(name: &str) -> Result<Self, String> {
        if let Some(maker) = Maker::find(name) {
            return Ok(Self::Complementarity(maker));
        }
        SceneEntry::find(name).map(Self::Scene).map_err(|e| {
            let others: Vec<_> = complementarity::MAKERS.iter().map(|m| m.name).collect();
            format!("{e}; complementarity: {}", others.join(", "))
        })
    }

    /// Of the format in which a suite writes its problems.
    fn extension(self) -> &'static str {
        match self {
            Self::Scene(_) => "hdf5",
            Self::Complementarity(_) => "toml",
        }
    }

    fn list(self) -> String {
        match self {
            Self::Scene(entry) => list(std::slice::from_ref(entry)),
            Self::Complementarity(maker) => makers(std::slice::from_ref(maker)),
        }
    }

    /// Options that only scenes have.
    fn fits(self, args: &Args) -> Result<(), String> {
        match self {
            Self::Complementarity(maker) if args.draw.is_some() || args.form != Form::Global => {
                let option = if args.draw.is_some() { "--draw" } else { "--form" };
                let name = maker.name;
                Err(format!("{option}: expected a scene, found {name}, a complementarity problem"))
            }
            _ => Ok(()),
        }
    }

    /// The file of the problem, and its scene if it has one.
    fn make(
        self,
        settings: &SettingsMap,
        form: Form,
    ) -> Result<(Option<Scene>, ProblemFile), String> {
        match self {
            Self::Scene(entry) => {
                let made = scene::make(entry, settings, form);
                let (scene, content) = made.map_err(|e| format!("scene {}: {e}", entry.name))?;
                Ok((Some(scene), content))
            }
            Self::Complementarity(maker) => {
                let mut content = maker.make(settings)?;
                let by = |all: &str| {
                    format!("{}, by nonsmooth {}: {all}.", maker.summary, env!("CARGO_PKG_VERSION"))
                };
                let names = std::mem::take(&mut content.info.names);
                let info = told(maker.name, settings, (maker.settings)(), by);
                content.info = Info { names, ..info };
                Ok((None, content))
            }
        }
    }
}

fn solve_by_default(label: &Path, problem: &AnyProblem, limits: Limits) -> Result<Solved, String> {
    let settings = &SettingsMap::new();
    let begun = Instant::now();
    let plan = Plan { solver: registry::DEFAULT, settings, limits, begun, progress: true };
    solve(label, problem, None, &plan)
}

fn drawing(
    picture: Picture,
    solved: Option<&Solved>,
    path: &Path,
    view: Option<View>,
) -> Result<String, SceneError> {
    let picture = match solved {
        Some(solved) => scene_plot::solved(picture, &solved.point, &solved.verdict)?,
        None => picture,
    };
    scene_plot::drawn(&picture, path, view)
}

/// What came of --solve.
fn solution(text: &mut String, content: &ProblemFile, solved: &Solved, tolerance: f64) {
    let iterations = report::count(solved.iterations, "iteration");
    let (status, time) = (&solved.status, seconds(solved.seconds));
    report::row(text, "solution", format!("{status}, {iterations}, {time}"));
    report::verdict_text(text, content, &solved.verdict, tolerance, 0);
}

/// The makers of complementarity problems and variational inequalities, and their settings.
fn makers(all: &[Maker]) -> String {
    let mut text = String::from(
        "Complementarity problems, variational inequalities and their settings, for `nonsmooth gen NAME --set key=value --out FILE.toml`\n",
    );
    // Those with the same settings, one after the other, have them once.
    let mut before: Option<Vec<Setting>> = None;
    for maker in all {
        let settings = (maker.settings)();
        text += &format!("\n{}: {}\n", maker.name, maker.summary);
        if before.as_ref() == Some(&settings) {
            text += "  the same settings\n";
        } else {
            settings.iter().for_each(|s| text += &line(s));
        }
        before = Some(settings);
    }
    text
}

/// The scenes and their settings. Of several scenes the settings that all scenes have come once, at the end, and with a
/// scene only where its default is another.
fn list(entries: &[SceneEntry]) -> String {
    let all: Vec<Vec<Setting>> = entries.iter().map(SceneEntry::settings).collect();
    let everywhere = |s: &Setting| {
        let same = |other: &Setting| other.key == s.key && other.help == s.help;
        all.len() > 1 && all.iter().all(|settings| settings.iter().any(same))
    };
    let common: Vec<&Setting> = match all.first() {
        Some(first) => first.iter().filter(|s| everywhere(s)).collect(),
        None => vec![],
    };
    let mut text = String::from(
        "Scenes and their settings, for `nonsmooth gen SCENE --set key=value --out FILE.hdf5`\n",
    );
    for (entry, settings) in entries.iter().zip(&all) {
        text += &format!("\n{}: {}\n", entry.name, entry.summary);
        settings.iter().filter(|s| !common.contains(s)).for_each(|s| text += &line(s));
    }
    if !common.is_empty() {
        text += "\nevery scene:\n";
        common.iter().for_each(|s| text += &line(s));
    }
    text
}

/// A setting, as the list shows it.
fn line(Setting { key, default, choices, help }: &Setting) -> String {
    let setting = format!("{key}={}", plain(default));
    let choices = match choices.as_slice() {
        [] => String::new(),
        names => format!(" One of {}.", names.join(", ")),
    };
    format!("  {setting:<20} {help}{choices}\n")
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_scene_and_setting_is_listed_with_its_help() {
        let text = list(SCENES);
        for entry in SCENES {
            assert!(text.contains(&format!("\n{}: ", entry.name)));
        }
        assert!(text.contains("layout=square") && text.contains("One of square, triangular."));
        // What all scenes have is said once, and with a scene only where its default is another.
        let (scenes, common) = text.split_once("\nevery scene:\n").unwrap();
        assert!(common.contains("contact_density=0.0") && !scenes.contains("contact_density="));
        assert!(common.contains("mu=0.6") && scenes.contains("mu=0.3"));
        assert!(list(&SCENES[..1]).contains("contact_density=0.0"));
        // A setting without help would end its line with blanks.
        assert!(text.lines().all(|line| line == line.trim_end()), "{text}");
    }
}
