//! `nonsmooth solve`.

use std::path::{Path, PathBuf};
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::time::Instant;

use nonsmooth_bench::campaign::Label;
use nonsmooth_io::{About, Format, ProblemFile, StoredPoint, keeper};
use nonsmooth_problem::check::RELATIVE;
use nonsmooth_problem::{AnyProblem, Problem, with_problem};
use nonsmooth_solve::diagnose;
use nonsmooth_solve::registry;
use nonsmooth_solve::settings::{self, SettingsMap};
use nonsmooth_solve::trace::Trace;
use nonsmooth_solve::{Answer, Limit, Limits, Sample, Solve, SolveError, Status};
use serde_json::{Value, json};

use crate::kinds::{self, alike, start, takes};
use crate::multistart::{self, Starts};
use crate::progress::Bar;
use crate::report::{self, row};
use crate::{Exit, answer, enumerate, files, interrupt, output, plot};

/// Solve problems.
///
/// The status printed is the judge's: the residual is recomputed from the problem's data, whatever the solver
/// believes. Whenever a solve stops, the best point found so far is reported and written.
/// Ctrl-C stops the solve that way; pressed twice it ends the program.
#[derive(Debug, clap::Args)]
#[command(after_help = EXAMPLES)]
pub struct Args {
    #[arg(required = true, value_name = "FILE", help = files::help("Files with one problem each", |_| true))]
    files: Vec<PathBuf>,
    /// The solver, one of `nonsmooth list`; settings may follow as in a campaign, NAME:KEY=VALUE,...
    #[arg(long, value_name = "NAME", default_value = registry::DEFAULT)]
    solver: String,
    /// A setting of the solver; may be given several times
    #[arg(long = "set", value_name = "KEY=VALUE")]
    settings: Vec<String>,
    /// The relative residual to reach
    #[arg(long, value_name = "TOL", default_value = "1e-8", allow_hyphen_values = true)]
    tol: f64,
    /// At most this many iterations [default: 1000000, or no limit with --time-limit]
    #[arg(long, value_name = "N", allow_hyphen_values = true, value_parser = files::whole)]
    max_iter: Option<usize>,
    /// At most this many seconds for each file, reading it included
    #[arg(long, value_name = "S", allow_hyphen_values = true)]
    time_limit: Option<f64>,
    /// Memory that one factorisation may take, as 500M or 4G: a larger one is refused before it begins [default: what the
    /// machine has free]
    #[arg(long, value_name = "SIZE", value_parser = files::size)]
    memory_limit: Option<u64>,
    /// Factorise large matrices and sweep over large piles on so many threads, 0 for one a core; the results are the same, bit for bit
    #[arg(long, value_name = "N", default_value_t = 1, allow_hyphen_values = true)]
    threads: usize,
    /// Start from the file's /guesses/1 (complementarity: its [solution]) in place of zero; with =FILE from the
    /// solution of another file (or its /guesses/1) of the same size, with =DIRECTORY from the file of the same name there
    #[arg(long, value_name = "FILE", num_args = 0..=1, require_equals = true)]
    warm_start: Option<Option<PathBuf>>,
    /// Print the whole solution (impulses r and velocities u of each contact; z and w), however large; without this, reports of
    /// at most 20 contacts or variables have it. With --json: as `solution`
    #[arg(long)]
    solution: bool,
    /// List every solution of an LCP or MLCP of at most 40 pairs, isolated ones and families, by enumeration of the complementary
    /// cones; with more than some 20 pairs this may take long (--time-limit). `there are no others` is said where exact arithmetic has shown it, else
    /// what is not known. A family is all mixtures of its ends, plus nonnegative multiples of its directions, plus any multiples of its lines. With --json:
    /// `complete` (no others), else `lacks` (what is not known), and `solutions`, each with `z` (of a family one in its interior), `w`, `dimension`, `ends`, `rays` (the
    /// directions), `lines` and `relative` (the residual of z)
    #[arg(long, conflicts_with_all = ["solver", "settings", "warm_start", "out", "plot", "trace", "certificate", "max_iter"])]
    all_solutions: bool,
    /// Begin at the start of a nonlinear problem and at random points, so many in all, and list the solutions that differ
    #[arg(long, value_name = "K", conflicts_with_all = ["all_solutions", "warm_start", "out", "plot", "trace", "certificate"], value_parser = files::whole)]
    multistart: Option<usize>,
    /// The seed of the random points of --multistart
    #[arg(long, value_name = "S", requires = "multistart", default_value = "0")]
    seed: u64,
    /// Write the problem with its solution, in the format of the extension: FCLIB (.hdf5), TOML (.toml), Matrix Market (.mtx,
    /// vectors beside) or AMPL's (.nl); .csv is a table of the solution alone. A directory (existing or ending in `/`) for several files, `-` for the
    /// standard output. A new file holds the problem, its info, guesses and solution, and nothing else of the input; of the input
    /// itself, which may be named, only the solution changes
    #[arg(long, value_name = "FILE")]
    out: Option<PathBuf>,
    /// The format of --out, whatever its name: hdf5, toml, mtx, nl or csv [default: that of the extension; of `-`, that of the input]
    #[arg(long, value_name = "EXTENSION", requires = "out", value_parser = files::format_named)]
    format: Option<&'static dyn Format>,
    /// Draw the residual against iterations and time (SVG), and the pivots or the central path of methods that record
    /// them; a directory for several files
    #[arg(long, value_name = "FILE.svg")]
    plot: Option<PathBuf>,
    /// Write what the method did, pivot by pivot or iteration by iteration (JSON), of methods that record it; a directory
    /// for several files
    #[arg(long, value_name = "FILE.json")]
    trace: Option<PathBuf>,
    /// Where there is no solution: write the certificate (JSON), which `nonsmooth check FILE --certificate` verifies; a directory for
    /// several files. A proof is written with the exact fractions that were verified
    #[arg(long, value_name = "FILE.json")]
    certificate: Option<PathBuf>,
    /// Print one line of JSON for each file in place of the report
    #[arg(long)]
    json: bool,
    /// No report and no progress bar: only errors and the exit code (and the JSON, with --json)
    #[arg(long, short)]
    quiet: bool,
}

const EXAMPLES: &str = "\
Examples:
  nonsmooth solve wall.hdf5
  nonsmooth solve wall.hdf5 --tol 1e-12 --time-limit 60 --plot history.svg
  nonsmooth solve wall.hdf5 --solver nsgs --set omega=0.9 --set ordering=shuffled
  nonsmooth solve *.hdf5 --out solved/ --json > results.jsonl
  nonsmooth solve step2.hdf5 --warm-start=solved/step1.hdf5
  nonsmooth solve contact.toml --out solved.toml --trace pivots.json --plot pivots.svg
  nonsmooth solve rectifier.toml --out table.csv
  nonsmooth solve game.toml --all-solutions
  nonsmooth solve kojima.toml --multistart 50 --seed 1
  nonsmooth gen lcp --out - | nonsmooth solve - --solution
  nonsmooth solve impossible.toml --certificate proof.json   # then: check impossible.toml --certificate proof.json

Exit codes: 0 all solved; 1 some not solved; 2 some file or option at fault.";

/// How to solve, whatever the problem.
#[derive(Clone)]
pub struct Plan<'a> {
    /// The solver's name.
    pub solver: &'a str,
    /// The solver's settings.
    pub settings: &'a SettingsMap,
    /// When to stop.
    pub limits: Limits,
    /// When the file was begun: the time limit counts from here.
    pub begun: Instant,
    /// Whether a progress bar is wanted.
    pub progress: bool,
}

/// What came of a solve.
pub type Solved = Answer<AnyProblem>;

/// Runs the command.
pub fn run(args: &Args) -> Result<Exit, String> {
    warm_start_is_meant(args)?;
    let Label { name: solver, mut settings } = Label::parse(&args.solver)?;
    for (key, value) in settings::from_texts(&args.settings).map_err(|e| format!("--set: {e}"))? {
        if settings.contains_key(&key) {
            return Err(format!("--set: `{key}` is set by --solver {} too", args.solver));
        }
        settings.insert(key, value);
    }
    let mut limits = limits(args.tol, args.max_iter, args.time_limit)?;
    limits.memory_limit = args.memory_limit;
    limits.threads = args.threads;
    limits.trace = args.trace.is_some() || args.plot.is_some();
    let targets = Targets::new(args)?;
    if targets.any() {
        output::results_are_filed();
    }
    let cancel = limits.cancel.clone().unwrap_or_default();
    let plan = Plan {
        solver: &solver,
        settings: &settings,
        limits,
        begun: Instant::now(),
        progress: !args.quiet,
    };
    let one_file = |k: usize, file: &Path| {
        if cancelled(&cancel) && k > 0 {
            if !args.json && !args.quiet {
                output::print(&format!("{}: skipped after Ctrl-C\n", file.display()));
            }
            return Ok(Exit::NotSolved);
        }
        let targets = targets.of(k);
        let begun = Instant::now();
        let content = match files::read_within(file, &plan.limits)? {
            Ok(content) => content,
            Err(limit) => return Ok(files::late(file, args.json, limit, files::WHILE_READ)),
        };
        if args.all_solutions {
            return enumerate::run(file, &content, &plan.limits.left(begun), args.json);
        }
        if let Some(number) = args.multistart {
            let starts = Starts { number, seed: args.seed, solver: &solver, settings: &settings };
            let limits = plan.limits.left(begun);
            return multistart::run(file, &content, &starts, &limits, args.json);
        }
        let kind = content.problem.kind();
        let out = targets.out.map(|path| {
            let format = files::target_format("--out", path, args.format, kind, Some(file))?;
            if files::same(file, path) {
                same_format(path, format.about(), files::about(file)?)?;
            }
            Ok::<_, String>((path, format))
        });
        let out = out.transpose()?;
        let guess = match &args.warm_start {
            None => None,
            Some(from) => match guess(from.as_deref(), file, &content, &plan.limits.left(begun))? {
                Ok(point) => Some(point),
                Err(limit) => {
                    return Ok(files::late(file, args.json, limit, files::WHILE_READ));
                }
            },
        };
        let plan = Plan { begun, ..plan.clone() };
        let solved = solve(file, &content.problem, guess.as_ref(), &plan)?;
        let content = with_solution(content, &solved);
        Done::new(file, &content, &plan, &solved, args).keep(file, content, solved, out, targets)
    };
    Ok(files::each(&args.files, args.json, one_file))
}

/// Of the input itself only the solution changes, not the format.
fn same_format(path: &Path, asked: &About, own: &About) -> Result<(), String> {
    match asked.name == own.name {
        true => Ok(()),
        false => Err(format!(
            "--out {}: expected the format of the file that is read, {}, or another file, found {}",
            path.display(),
            own.name,
            asked.name
        )),
    }
}

/// Refuses a bare `--warm-start` before the name of a file among several: with `=` that would be the point to start from, without it is one more problem.
fn warm_start_is_meant(args: &Args) -> Result<(), String> {
    if args.warm_start != Some(None) || args.files.len() < 2 {
        return Ok(());
    }
    let mut words = std::env::args_os().skip_while(|word| word != WARM_START).skip(1);
    match words.next().map(PathBuf::from).filter(|word| word.is_file()) {
        Some(file) => {
            let file = file.display();
            Err(format!(
                "{WARM_START} {file}: expected {WARM_START}=FILE, or {WARM_START} after the files, each of which then starts from its own guess, found a file after a blank (did you mean {WARM_START}={file}?)"
            ))
        }
        None => Ok(()),
    }
}

/// The option that says where to start.
const WARM_START: &str = "--warm-start";

/// The point to start from that a file proposes itself, or that another one, or that of the same name in a directory, holds for its problem; the
/// limit if it came before that one was read.
fn guess(
    from: Option<&Path>,
    file: &Path,
    content: &ProblemFile,
    limits: &Limits,
) -> Result<Result<StoredPoint, Limit>, String> {
    let Some(from) = from else {
        let about = files::about(file)?;
        // Formats without guesses propose the solution.
        let (place, point) = match about.guess {
            Some(place) => (place, content.guesses.first()),
            None => (about.solution, content.solution.as_ref()),
        };
        let file = file.display();
        return point.cloned().map(Ok).ok_or_else(|| {
            format!(
                "{file}: {place}: expected a point for --warm-start, found none; --warm-start=FILE takes that of another file"
            )
        });
    };
    let path = other_file(from, file);
    let other = match files::read_within(&path, limits).map_err(|e| format!("--warm-start {e}"))? {
        Ok(other) => other,
        Err(limit) => return Ok(Err(limit)),
    };
    let refused = |expected: String, found: &str| {
        format!("--warm-start {}: expected {expected}, found {found}", path.display())
    };
    let (ours, theirs) = (alike(&content.problem), alike(&other.problem));
    if ours != theirs {
        return Err(refused(format!("{ours} as in {}", file.display()), &theirs));
    }
    let point = other.solution.or(other.guesses.into_iter().next());
    let about = files::about(&path)?;
    point.map(Ok).ok_or_else(|| match about.guess {
        Some(guess) => refused(format!("a {} or {guess}", about.solution), "neither"),
        None => refused(format!("a {}", about.solution), "none"),
    })
}

/// A file, or that of the same name in a directory.
fn other_file(from: &Path, file: &Path) -> PathBuf {
    match file.file_name() {
        Some(name) if from.is_dir() => from.join(name),
        _ => from.into(),
    }
}

/// Limits from options; Ctrl-C is one of them. To be called once.
pub fn limits(tol: f64, iterations: Option<usize>, seconds: Option<f64>) -> Result<Limits, String> {
    let time_limit = files::time_limit(seconds)?;
    Ok(Limits {
        tolerance: files::tolerance(tol)?,
        max_iterations: match (iterations, time_limit) {
            (Some(n), _) => n,
            (None, Some(_)) => usize::MAX,
            (None, None) => Limits::default().max_iterations,
        },
        time_limit,
        cancel: Some(interrupt::flag()),
        ..Limits::default()
    })
}

fn cancelled(flag: &Arc<AtomicBool>) -> bool {
    flag.load(Ordering::Relaxed)
}

/// What is left to print and to write of a solve.
struct Done {
    report: String,
    /// The trace as JSON, if asked for.
    record: Option<String>,
    /// The certificate as JSON, where there is one.
    proof: Option<String>,
    /// What the plot shows.
    title: String,
    tolerance: f64,
}

impl Done {
    fn new(file: &Path, content: &ProblemFile, plan: &Plan, solved: &Solved, args: &Args) -> Self {
        let problem = &content.problem;
        let report = match (args.json, args.quiet) {
            (true, _) => json_line(file, content, plan, solved, args.solution),
            (false, true) => String::new(),
            (false, false) => text(file, content, plan, solved, args),
        };
        let status = &solved.status;
        let record = args.trace.as_ref().map(|_| {
            let mut all = report::problem_json(file, problem);
            // The rows of a trace are pivots or iterations.
            all.remove("rows");
            all.extend(report::fields(json!({
                "solver": plan.solver,
                "settings": plan.settings,
                "status": status.name(),
                "iterations": solved.iterations,
            })));
            all.extend(report::fields(json!(solved.trace)));
            format!("{}\n", json!(all))
        });
        let proof = certificate(status).map(|certificate| {
            let mut all = report::problem_json(file, problem);
            all.insert("status".into(), json!(status.name()));
            all.insert("certificate".into(), certificate);
            format!("{}\n", json!(all))
        });
        let (title, tolerance) =
            (format!("{} on {}", plan.solver, name(file)), plan.limits.tolerance);
        Self { report, record, proof, title, tolerance }
    }

    /// Writes the files asked for and prints the report.
    fn keep(
        self,
        file: &Path,
        content: ProblemFile,
        solved: Solved,
        out: Option<(&Path, &'static dyn Format)>,
        targets: Target,
    ) -> Result<Exit, String> {
        let Self { report, record, proof, title, tolerance } = self;
        let pictures = || {
            if let Some(path) = targets.plot {
                let svg = plot::svg(&title, &solved.history, &solved.trace, tolerance)?;
                files::write_text("--plot", path, &svg)?;
            }
            for (option, path, text) in
                [("--trace", targets.trace, record), ("--certificate", targets.certificate, proof)]
            {
                if let (Some(path), Some(text)) = (path, text) {
                    files::write_text(option, path, &text)?;
                }
            }
            Ok(())
        };
        // Files first: whoever reads the report may be gone. But a file that fails must not cost the report.
        let kept = out.map_or(Ok(()), |(path, format)| keep(file, path, format, &content));
        let kept = kept.and_then(|()| pictures());
        match out {
            // The standard output is the file's.
            Some((path, _)) if files::is_stream(path) => output::remark(&report),
            _ => output::print(&report),
        }
        kept.map(|()| Exit::solved(solved.is_solved()))
    }
}

/// Writes a problem that was read from `file` with its solution.
fn keep(
    file: &Path,
    path: &Path,
    format: &'static dyn Format,
    content: &ProblemFile,
) -> Result<(), String> {
    match files::same(file, path) {
        true => format.write_solution(path, content).map_err(|e| e.to_string()),
        false => files::write(path, format, content),
    }
}

/// What a file holds after a solve.
pub fn with_solution(content: ProblemFile, solved: &Solved) -> ProblemFile {
    let (point, velocity) = (solved.point.clone(), solved.verdict.velocity.clone());
    let mut stored = StoredPoint::new(&content.problem, point, velocity);
    // What overflows has no place in a file.
    stored.partner = stored.partner.filter(|u| u.iter().all(|u| u.is_finite()));
    let statuses = solved.verdict.statuses.clone();
    ProblemFile { solution: Some(StoredPoint { statuses, ..stored }), ..content }
}

/// Solves a problem from a stored point, or from zero. `file` is its name in messages.
pub fn solve(
    file: &Path,
    problem: &AnyProblem,
    from: Option<&StoredPoint>,
    plan: &Plan,
) -> Result<Solved, String> {
    let mut how = Solve::new().solver(plan.solver).settings(plan.settings.clone());
    how = how.limits(plan.limits.left(plan.begun));
    if let Some(stored) = from {
        how = how.warm(&start(problem, stored));
    }
    let mut bar = Bar::new(&name(file), plan.limits.tolerance, plan.progress);
    how.watched(problem, &mut |p| bar.watch(p)).map_err(|e| {
        let file = file.display();
        match (&e, takes(plan.solver)) {
            (SolveError::UnknownSolver { name, .. }, Some(problems)) => {
                let kind = problem.kind().name();
                let tried = instead(problem, plan);
                format!(
                    "{file}: solver `{name}` takes {problems} problems only (this file: {kind}){tried}"
                )
            }
            _ if e.is_inapplicable() => format!("{file}: {e}{}", instead(problem, plan)),
            _ => format!("{file}: {e}"),
        }
    })
}

/// What solved the problem on trial where the solver asked for does not apply.
fn instead(problem: &AnyProblem, plan: &Plan) -> String {
    let limits = plan.limits.left(plan.begun);
    let solving = with_problem!(problem, p => diagnose::instead(p, plan.solver, &limits));
    let names: Vec<_> = solving.iter().map(|name| format!("--solver {name}")).collect();
    match &names[..] {
        [] => String::new(),
        names => format!("; on trial it was solved by {}", names.join(", ")),
    }
}

fn name(file: &Path) -> String {
    file.file_name().unwrap_or_default().to_string_lossy().into()
}

/// What the status rests on, if it says that there is no solution.
fn certificate(status: &Status) -> Option<Value> {
    match status {
        Status::Infeasible(proof) => Some(json!(proof)),
        Status::NoConclusion(certificate) => Some(json!(certificate)),
        Status::NearlyInfeasible { certificate, change } => {
            let mut all = report::fields(json!(certificate));
            all.insert("change".into(), json!(change));
            Some(Value::Object(all))
        }
        _ => None,
    }
}

/// The worst contacts that a report of an unsolved problem lists.
const WORST: usize = 3;

fn json_line(
    file: &Path,
    content: &ProblemFile,
    plan: &Plan,
    solved: &Solved,
    solution: bool,
) -> String {
    let problem = &content.problem;
    let Solved { status, verdict, account, .. } = solved;
    let mut all = report::problem_json(file, problem);
    all.extend(report::fields(json!({
        "solver": plan.solver,
        "settings": plan.settings,
        "tolerance": plan.limits.tolerance,
        "status": status.name(),
        "message": status.to_string(),
        "iterations": solved.iterations,
        "seconds": solved.seconds,
        "account": account,
    })));
    if let Some(certificate) = certificate(status) {
        all.insert("certificate".into(), certificate);
    }
    all.extend(report::verdict_json(verdict, plan.limits.tolerance, verdict.worst.len()));
    all.extend(report::uniqueness_json(content, &solved.point, verdict));
    if let Some(stored) = content.solution.as_ref().filter(|_| solution) {
        all.insert("solution".into(), answer::json(problem, stored, &content.info.names));
    }
    format!("{}\n", json!(all))
}

fn text(file: &Path, content: &ProblemFile, plan: &Plan, solved: &Solved, asked: &Args) -> String {
    let problem = &content.problem;
    let Solved { status, verdict, .. } = solved;
    let tolerance = plan.limits.tolerance;
    let is_solved = *status == Status::Solved;
    let says = status.to_string();
    let mut text = report::headline(file, &says, &verdict.measure, tolerance);
    row(&mut text, "problem", report::problem_text(problem));
    let settings = plan.settings.iter().map(|(k, v)| match v.as_str() {
        Some(word) => format!(" {k}={word}"),
        None => format!(" {k}={v}"),
    });
    let iterations = report::count(solved.iterations, "iteration");
    row(
        &mut text,
        "solver",
        format!(
            "{}{}, {iterations}, {}",
            plan.solver,
            settings.collect::<String>(),
            seconds(solved.seconds)
        ),
    );
    for (k, line) in solved.account.iter().enumerate() {
        row(&mut text, if k == 0 { "account" } else { "" }, line);
    }
    // Where there is no solution, no row is to blame.
    let settled = is_solved || matches!(status, Status::Infeasible(_));
    let worst = if settled { 0 } else { WORST };
    report::verdict_text(&mut text, content, verdict, tolerance, worst);
    report::uniqueness_text(&mut text, content, &solved.point, verdict);
    // A point that is none is shown to those who ask for it.
    if is_solved {
        answer::text(&mut text, "solution", content, asked.solution, asked.out.is_some());
    } else if asked.solution {
        answer::text(&mut text, "best point", content, true, asked.out.is_some());
    }
    if asked.certificate.is_some() && certificate(status).is_none() {
        let why = if is_solved { "there is a solution" } else { "none was found" };
        row(&mut text, "certificate", format!("{why}: no file is written"));
    }
    if asked.trace.is_some() && solved.trace == Trace::None {
        row(
            &mut text,
            "trace",
            format!("{} keeps no record of its steps: none is in the file", plan.solver),
        );
    }
    let stuck = stuck(&solved.history);
    if let (Status::Limit(_), Some(since)) = (status, stuck) {
        row(&mut text, "stuck", format!("no progress since iteration {since}"));
    }
    if let Some(hint) = hint(problem, solved, plan, stuck.is_some()) {
        row(&mut text, "try", hint);
    }
    text
}

/// A duration in the unit that suits it.
pub fn seconds(t: f64) -> String {
    match t {
        t if t < 1e-3 => format!("{:.0} us", 1e6 * t),
        t if t < 1.0 => format!("{:.3} s", t),
        t if t < 100.0 => format!("{t:.2} s"),
        t => format!("{t:.0} s"),
    }
}

/// The iteration after which the residual fell no more, but for a tenth, if that is half of all iterations ago.
fn stuck(history: &[Sample]) -> Option<usize> {
    /// Fewer iterations tell nothing.
    const ENOUGH: usize = 100;
    let last = history.last()?.iteration;
    let best = history.iter().map(|s| s.relative).fold(f64::INFINITY, f64::min);
    let since = history.iter().find(|s| s.relative <= 1.1 * best)?.iteration;
    (last >= ENOUGH && since <= last / 2).then_some(since)
}

/// Settings that make another method of the same solver.
const OTHER_WAYS: [&str; 2] = ["local=projection", "ordering=shuffled"];

/// Criteria that iterations bring down.
const ITERATED: [&str; 4] = [RELATIVE, "primal", "dual", "bilateral constraints"];

/// What may help where the problem is not solved.
fn hint(problem: &AnyProblem, solved: &Solved, plan: &Plan, stuck: bool) -> Option<String> {
    // Iterations are of no help where the contacts are as they should be.
    let failing = solved.verdict.measure.failing(plan.limits.tolerance);
    if !failing.iter().any(|f| ITERATED.contains(&f.what)) {
        return None;
    }
    let about = kinds::about(problem, plan.solver)?;
    let more = match &solved.status {
        Status::Solved | Status::Infeasible(_) | Status::Limit(Limit::Cancelled) => return None,
        Status::Limit(_) if stuck => OTHER_WAYS
            .iter()
            .filter(|way| about.variants.contains(way))
            .filter(|way| way.split_once('=').is_some_and(|w| !plan.settings.contains_key(w.0)))
            .map(|way| format!("--set {way}"))
            .collect(),
        Status::Limit(Limit::Iterations) => {
            vec![format!("--max-iter {}", plan.limits.max_iterations.max(1).saturating_mul(10))]
        }
        Status::Limit(Limit::Time) => {
            let t = plan.limits.time_limit.unwrap_or_default();
            vec![format!("--time-limit {}", (10.0 * t).max(1.0))]
        }
        Status::NearlyInfeasible { .. } | Status::NoConclusion(_) | Status::Stalled(_) => vec![],
    };
    let limits = plan.limits.left(plan.begun);
    let others = with_problem!(problem, p => diagnose::others(p, plan.solver, &limits));
    let others = others.iter().map(|name| format!("--solver {name}, which solved it on trial"));
    let mut tries: Vec<_> = more.into_iter().chain(others).take(3).collect();
    tries.push("`nonsmooth diagnose` says what makes the problem hard".into());
    Some(tries.join(", or "))
}

/// The output files, one of each for each input.
struct Targets {
    out: Option<Vec<PathBuf>>,
    plot: Option<Vec<PathBuf>>,
    trace: Option<Vec<PathBuf>>,
    certificate: Option<Vec<PathBuf>>,
}

/// The output files for one input.
#[derive(Clone, Copy)]
struct Target<'a> {
    out: Option<&'a Path>,
    plot: Option<&'a Path>,
    trace: Option<&'a Path>,
    certificate: Option<&'a Path>,
}

impl Targets {
    /// Whether something goes to a file.
    fn any(&self) -> bool {
        let Self { out, plot, trace, certificate } = self;
        let all = [out, plot, trace, certificate].into_iter().flatten().flatten();
        all.into_iter().any(|path| !files::is_stream(path))
    }

    fn new(args: &Args) -> Result<Self, String> {
        // In a directory, formats that hold no solution give way to others.
        let names: Vec<_> = args.files.iter().map(|file| keeper(file)).collect();
        let place = |option: &str, to: &Option<PathBuf>, extension| {
            let to = to.as_deref();
            to.map(|to| files::targets(option, to, &names, extension)).transpose()
        };
        let out = place("--out", &args.out, None)?;
        let plot = place("--plot", &args.plot, Some("svg"))?;
        let trace = place("--trace", &args.trace, Some("trace.json"))?;
        let certificate = place("--certificate", &args.certificate, Some("certificate.json"))?;
        fn written<'a>(
            option: &'a str,
            all: &'a Option<Vec<PathBuf>>,
        ) -> impl Iterator<Item = (&'a str, &'a Path)> {
            all.iter().flatten().map(move |path| (option, path.as_path()))
        }
        // A file may be written with its own solution.
        let back =
            |k: usize, file: &Path| out.as_ref().is_some_and(|out| files::same(&out[k], file));
        let read = args.files.iter().enumerate().filter(|(k, file)| !back(*k, file));
        files::apart(
            read.map(|(_, file)| file.as_path()),
            written("--out", &out)
                .chain(written("--plot", &plot))
                .chain(written("--trace", &trace))
                .chain(written("--certificate", &certificate)),
        )?;
        for (option, all, end) in [
            ("--plot", &plot, "svg"),
            ("--trace", &trace, "json"),
            ("--certificate", &certificate, "json"),
        ] {
            all.iter().flatten().try_for_each(|path| files::ends_in(option, path, &[end]))?;
        }
        Ok(Self { out, plot, trace, certificate })
    }

    fn of(&self, k: usize) -> Target<'_> {
        fn path(all: &Option<Vec<PathBuf>>, k: usize) -> Option<&Path> {
            Some(all.as_ref()?.get(k)?.as_path())
        }
        Target {
            out: path(&self.out, k),
            plot: path(&self.plot, k),
            trace: path(&self.trace, k),
            certificate: path(&self.certificate, k),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_solve_is_stuck_when_half_of_it_brought_nothing() {
        let since = |residual: fn(usize) -> f64, last: usize| {
            let sample = |k| Sample { iteration: k, seconds: 0.0, relative: residual(k) };
            stuck(&(0..=last).map(sample).collect::<Vec<_>>())
        };
        let floor = |k: usize| 0.5_f64.powi(k as i32).max(1e-3);
        assert_eq!(since(floor, 200), Some(10));
        assert_eq!(since(floor, 20), None);
        assert_eq!(since(|k| 0.99_f64.powi(k as i32), 200), None);
        // Up and down all the time, and never a number.
        assert_eq!(since(|k| 1.0 + (k % 7) as f64, 200), Some(0));
        assert_eq!(since(|_| f64::NAN, 200), None);
        assert_eq!(stuck(&[]), None);
    }
}
