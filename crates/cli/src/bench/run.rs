//! `nonsmooth bench run`.

use std::io::{IsTerminal, Write};
use std::path::{Path, PathBuf};
use std::time::{Duration, Instant};

use indicatif::{ProgressBar, ProgressDrawTarget, ProgressStyle};
use nonsmooth_bench::campaign::{
    Event, Journal, Label, Registry, Setup, Summary, WorkerCommand, inputs, machine,
    run as campaign,
};
use nonsmooth_bench::record::{Campaign, FORMAT, Plan, VERSION};
use nonsmooth_bench::runs::Runs;

use crate::report::{count, row};
use crate::{Exit, files, interrupt, output};

/// Run a campaign: problems x solvers x tolerances.
///
/// Each run is a process of its own: one that crashes, does not end or eats the memory is recorded as such, and the
/// others go on. A run solves once to warm up, then --repeats times; the fastest counts. Every answer is judged
/// by the residual recomputed from the problem's data. Each result is one line of JSON, on the disk before the next run
/// begins; Ctrl-C, a kill or a power cut cost the runs in progress, and --resume does what is missing.
#[derive(Debug, clap::Args)]
#[command(after_help = EXAMPLES)]
pub struct Args {
    #[arg(required = true, value_name = "FOLDER", help = files::help("Folders with problems, or files; a problem's family is the folder that holds it. Read are", |_| true))]
    problems: Vec<PathBuf>,
    /// A solver of `nonsmooth list`, perhaps with settings, as auto or nsgs:local=quartic,omega=0.9; may be given
    /// several times [default: the solvers that take the kind of each problem, without prefixes]
    #[arg(long = "solver", value_name = "NAME[:KEY=VALUE,...]")]
    solvers: Vec<String>,
    /// Without --solver: also the solvers behind a prefix, as condense/nsgs
    #[arg(long, conflicts_with = "solvers")]
    composed: bool,
    /// Without --solver: also the settings of each solver that are worth comparing
    #[arg(long, conflicts_with = "solvers")]
    variants: bool,
    /// A relative residual to reach; may be given several times
    #[arg(long = "tol", value_name = "TOL", default_values = ["1e-4", "1e-8"], allow_hyphen_values = true)]
    tolerances: Vec<f64>,
    /// Seconds that a solve may take
    #[arg(long, value_name = "S", default_value = "10", allow_hyphen_values = true)]
    time_limit: f64,
    /// Memory that a run may take, as 500M or 4G [default: 8G, or four fifths of the machine's by job if that is less]
    #[arg(long, value_name = "SIZE", value_parser = size)]
    memory_limit: Option<u64>,
    /// Timed solves of a run, after one to warm up (more where they are very short); with 0 the first solve counts
    #[arg(long, value_name = "K", default_value_t = 3, allow_hyphen_values = true)]
    repeats: u32,
    /// A solve that takes longer is not repeated: the first one counts
    #[arg(long, value_name = "S", default_value = "1", allow_hyphen_values = true)]
    repeat_below: f64,
    /// Keep the residual against time of each run
    #[arg(long)]
    trace: bool,
    /// Runs at a time, each on physical cores of its own; they still share the memory's bandwidth
    #[arg(long, value_name = "N", default_value_t = 1)]
    jobs: usize,
    /// Do part I of N of the problems, for several machines or the tasks of a scheduler; join with `bench merge`
    #[arg(long, value_name = "I/N", value_parser = shard)]
    shard: Option<(usize, usize)>,
    /// The file of runs to write (JSON lines)
    #[arg(long, value_name = "RUNS.jsonl")]
    out: PathBuf,
    /// Go on with the file: do the runs that it lacks. The options must be those that it was begun with, but there may
    /// be more problems, solvers and tolerances, and other --jobs
    #[arg(long)]
    resume: bool,
    /// No progress and no summary
    #[arg(long, short)]
    quiet: bool,
}

const EXAMPLES: &str = "\
Examples:
  nonsmooth bench run problems/ --out runs.jsonl
  nonsmooth bench run problems/ --solver auto --solver nsgs:omega=0.9 --tol 1e-6 --time-limit 60 --out runs.jsonl
  nonsmooth bench run lcp/ --solver lemke --solver psor:omega=1.2 --out lcp.jsonl
  nonsmooth bench run problems/ --shard 3/8 --out part3.jsonl

Exit codes: 0 all runs are done, whatever came of them; 1 ended by Ctrl-C; 2 some problem, solver or option at fault.";

/// The default limit of memory, bytes.
const MEMORY: u64 = 8 << 30;
/// The least limit of memory, bytes: a process needs a few dozen megabytes before it has done anything.
const LEAST_MEMORY: u64 = 64 << 20;
/// The most runs at a time: each has a process, and a thread that watches it.
const JOBS: usize = 1024;

/// Runs the command.
pub fn run(args: &Args) -> Result<Exit, String> {
    let (plan, mut exit) = plan(args)?;
    let (inputs, mistakes) = inputs(&args.problems);
    for mistake in &mistakes {
        output::error(mistake);
        exit = Exit::Mistake;
    }
    if inputs.is_empty() {
        return Err("expected problems, found none".into());
    }
    output::results_are_filed();
    let program = format!("{} {}", "nonsmooth", env!("CARGO_PKG_VERSION"));
    let now =
        std::time::SystemTime::now().duration_since(std::time::UNIX_EPOCH).unwrap_or_default();
    let header = Campaign {
        format: FORMAT.into(),
        version: VERSION,
        id: format!("{:x}-{:x}", now.as_millis(), std::process::id()),
        program,
        foreign: false,
        started: Some(now.as_secs()),
        machine: machine(),
        plan: Some(plan.clone()),
    };
    files::no_stream("--out", &args.out)?;
    let (mut journal, there) = if args.resume {
        Journal::resume(&args.out, &header)?
    } else {
        (Journal::create(&args.out, &header)?, Runs::default())
    };
    let worker = WorkerCommand {
        program: this_program().map_err(|e| format!("this program: {e}"))?,
        arguments: super::WORKER.iter().map(Into::into).collect(),
    };
    let named = !args.solvers.is_empty();
    let setup = Setup { worker, inputs, plan, named, grace: Setup::GRACE };
    let cancel = interrupt::flag();
    let mut progress = Progress::new(!args.quiet);
    let summary = campaign(&setup, &Registry, &there, &mut journal, &cancel, &mut |event| {
        progress.watch(&event);
    });
    drop(progress);
    let summary =
        summary.map_err(|e| format!("{e}; the runs done so far are in {}", args.out.display()))?;
    if !args.quiet {
        output::print(&text(&args.out, &summary, args.jobs));
    }
    if summary.unreadable + summary.lost > 0 {
        exit = Exit::Mistake;
    }
    Ok(exit.max(Exit::solved(!summary.cancelled)))
}

/// This program as it runs now. An upgrade during a campaign replaces its file, but not what Linux runs under this name.
fn this_program() -> std::io::Result<PathBuf> {
    let running = Path::new("/proc/self/exe");
    match cfg!(target_os = "linux") && running.exists() {
        true => Ok(running.into()),
        false => std::env::current_exe(),
    }
}

/// The plan that the options come to. A solver that does not exist is said and left out.
///
/// Errors: an option out of range; no solver is left.
fn plan(args: &Args) -> Result<(Plan, Exit), String> {
    let positive = |option: &str, x: f64| match x > 0.0 && x.is_finite() {
        true => Ok(x),
        false => Err(format!("{option}: expected a positive number, found {x}")),
    };
    let mut exit = Exit::Solved;
    let mut solvers: Vec<String> = vec![];
    for text in &args.solvers {
        let text = text.trim();
        let label = Label::parse(text).and_then(|l| l.kinds(&Registry).map(|_| l.to_string()));
        match label {
            Ok(label) if solvers.contains(&label) => {}
            Ok(label) => solvers.push(label),
            Err(e) => {
                output::error(&format!("--solver {text}: {e}"));
                exit = Exit::Mistake;
            }
        }
    }
    if args.solvers.is_empty() {
        solvers = Registry::labels(args.composed, args.variants);
    } else if solvers.is_empty() {
        return Err("--solver: expected a solver that exists, found none".into());
    }
    let mut tolerances = vec![];
    for &tolerance in &args.tolerances {
        let tolerance = files::tolerance(tolerance)?;
        if !tolerances.contains(&tolerance) {
            tolerances.push(tolerance);
        }
    }
    tolerances.sort_by(|a, b| f64::total_cmp(b, a));
    if !(1..=JOBS).contains(&args.jobs) {
        return Err(format!("--jobs: expected from 1 to {JOBS}, found {}", args.jobs));
    }
    let found = args.repeat_below;
    if found.is_nan() || found < 0.0 {
        return Err(format!("--repeat-below: expected a number of at least 0, found {found}"));
    }
    let plan = Plan {
        solvers,
        tolerances,
        time_limit: positive("--time-limit", args.time_limit)?,
        memory_limit: memory_limit(args)?,
        repeats: args.repeats,
        repeat_below: args.repeat_below,
        trace: args.trace,
        jobs: args.jobs,
        shard: args.shard,
    };
    Ok((plan, exit))
}

/// The limit asked for; else, to resume, that of the file; else one that the machine can bear.
///
/// Errors: so many jobs that the machine has not the least memory for each.
fn memory_limit(args: &Args) -> Result<u64, String> {
    let before = || {
        let there = args.resume && args.out.is_file();
        let runs = there.then(|| Runs::read(&args.out).ok()).flatten()?;
        Some(runs.campaigns.iter().rev().find_map(|c| c.plan.as_ref())?.memory_limit)
    };
    if let Some(limit) = args.memory_limit.or_else(before) {
        return Ok(limit);
    }
    match machine().memory / 5 * 4 {
        0 => Ok(MEMORY),
        bytes => match bytes / args.jobs as u64 {
            LEAST_MEMORY.. => Ok(MEMORY.min(bytes / args.jobs as u64)),
            _ => Err(format!(
                "--jobs: expected at most {}, as this machine has 64M for so many, found {}; --memory-limit sets the memory of each",
                bytes / LEAST_MEMORY,
                args.jobs
            )),
        },
    }
}

/// The memory of a run: a size such as `500M` or `4G`.
fn size(text: &str) -> Result<u64, String> {
    match files::size(text)? {
        LEAST_MEMORY.. => files::size(text),
        _ => Err("expected at least 64M".into()),
    }
}

/// A part such as `3/8`.
fn shard(text: &str) -> Result<(usize, usize), String> {
    let parts = text.split_once('/').and_then(|(i, n)| Some((i.parse().ok()?, n.parse().ok()?)));
    parts
        .filter(|&(i, n)| 1 <= i && i <= n)
        .ok_or_else(|| "expected I/N with I from 1 to N, such as 3/8".into())
}

fn text(out: &Path, summary: &Summary, jobs: usize) -> String {
    let Summary { all, done, new, .. } = *summary;
    let mut text = format!("{}: {done} of {} done ({new} new)\n", out.display(), count(all, "run"));
    for (ending, n) in &summary.endings {
        row(&mut text, ending, n);
    }
    if summary.unreadable > 0 {
        row(&mut text, "unusable", count(summary.unreadable, "problem"));
    }
    if summary.disturbed > 0 {
        let n = count(summary.disturbed, "run");
        let fewer = if jobs > 1 { "; --jobs 1 would not" } else { "" };
        row(&mut text, "disturbed", format!("{n} had to wait for a processor{fewer}"));
    }
    if summary.lost > 0 {
        let n = count(summary.lost, "run");
        row(&mut text, "left out", format!("{n}, whose files changed or went"));
    }
    if summary.cancelled || summary.lost > 0 {
        row(&mut text, "next", "the same command with --resume does the rest");
    } else {
        row(
            &mut text,
            "next",
            format!("nonsmooth bench report {} --out report.html", out.display()),
        );
    }
    text
}

/// How far a campaign is: a bar on a terminal, else a line now and then.
struct Progress {
    bar: Option<ProgressBar>,
    lines: bool,
    next: Instant,
}

/// Between two lines where there is no terminal.
const INTERVAL: Duration = Duration::from_secs(60);

impl Progress {
    fn new(wanted: bool) -> Self {
        let terminal = std::io::stderr().is_terminal();
        let bar = (wanted && terminal).then(|| {
            let bar =
                ProgressBar::with_draw_target(Some(1), ProgressDrawTarget::stderr_with_hz(10));
            let style =
                ProgressStyle::with_template("{prefix} [{bar:24.blue}] {pos}/{len} {wide_msg}");
            bar.set_style(style.unwrap_or_else(|_| ProgressStyle::default_bar()));
            bar
        });
        Self { bar, lines: wanted && !terminal, next: Instant::now() + INTERVAL }
    }

    fn watch(&mut self, event: &Event<'_>) {
        let (what, done, all, message) = match *event {
            Event::Described { done, all, problem } => {
                if let Some(error) = &problem.error {
                    self.aside(&|| output::error(error));
                }
                ("problems", done, all, problem.name.clone())
            }
            Event::Planned { problems, runs, refused, at_most } => {
                self.plan(problems, runs, refused, at_most);
                return;
            }
            Event::Ended { done, all, run, left } => {
                let left = left.map_or_else(String::new, |left| format!("{} left, ", clock(left)));
                let ending = run.ending.name();
                let tolerance = run.tolerance;
                let what = format!("{} on {} at {tolerance:e}: {ending}", run.solver, run.problem);
                ("runs", done, all, left + &what)
            }
            Event::Lost { why } => {
                self.aside(&|| output::error(&format!("{why}; its runs are left out")));
                return;
            }
        };
        // Names of files may hold anything; a message is one line.
        let message = message.replace(char::is_control, " ");
        if let Some(bar) = &self.bar {
            bar.set_prefix(what);
            bar.set_length(all as u64);
            bar.set_position(done as u64);
            bar.set_message(message);
        } else if self.lines && Instant::now() >= self.next {
            self.next = Instant::now() + INTERVAL;
            // A campaign does not end because nobody reads of its progress.
            let _ = writeln!(std::io::stderr(), "{what} {done}/{all}, {message}");
        }
    }

    /// Says what is about to begin; how long it is likely to take, the bar says as soon as there are runs to go by.
    fn plan(&self, problems: usize, runs: usize, refused: usize, at_most: Duration) {
        if self.bar.is_none() && !self.lines {
            return;
        }
        let (problems, runs) = (count(problems, "problem"), count(runs, "run"));
        let (refused, every) = match refused {
            0 => (String::new(), "every one"),
            n => (format!(" ({n} refused by kind)"), "each of the others"),
        };
        let at_most = clock(at_most);
        self.aside(&|| {
            let limit = format!("at most {at_most} if {every} goes to its time limit");
            output::print(&format!("{problems}, {runs}{refused}, {limit}\n"));
        });
    }

    /// Prints something while the bar is out of the way.
    fn aside(&self, print: &dyn Fn()) {
        match &self.bar {
            Some(bar) => bar.suspend(print),
            None => print(),
        }
    }
}

impl Drop for Progress {
    fn drop(&mut self) {
        if let Some(bar) = &self.bar {
            bar.finish_and_clear();
        }
    }
}

fn clock(time: Duration) -> String {
    let s = time.as_secs();
    match s {
        0..60 => format!("{s} s"),
        60..3600 => format!("{}:{:02} min", s / 60, s % 60),
        _ => format!("{}:{:02} h", s / 3600, s / 60 % 60),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn sizes_and_parts() {
        assert_eq!(size("500M"), Ok(500 << 20));
        assert_eq!(size("1.5GiB"), Ok(3 << 29));
        assert_eq!(size("4g"), size("4G"));
        for text in ["", "G", "4X", "-4G", "1M", "nan"] {
            assert!(size(text).is_err(), "{text}");
        }
        assert_eq!(shard("3/8"), Ok((3, 8)));
        for text in ["0/8", "9/8", "3", "a/b", ""] {
            assert!(shard(text).is_err(), "{text}");
        }
        assert_eq!(clock(Duration::from_secs(3725)), "1:02 h");
    }
}
