//! Worker processes side by side, and the campaign from its plan to its last line.

use std::collections::{BTreeMap, HashMap, HashSet, VecDeque};
use std::path::Path;
use std::sync::Mutex;
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::mpsc::channel;
use std::time::{Duration, Instant, SystemTime};

use nonsmooth_problem::Kind;

use super::child::{End, WorkerCommand, work};
use super::files::Input;
use super::job::{Job, Said, Task};
use super::journal::Journal;
use super::solvers::{Label, Solvers};
use super::system;
use crate::record::{Ending, Key, Line, Plan, Problem, Residuals, Run};
use crate::runs::Runs;

/// What to run, and how.
#[derive(Debug, Clone)]
pub struct Setup {
    /// How a worker is started.
    pub worker: WorkerCommand,
    /// The problems, in the order in which they are run.
    pub inputs: Vec<Input>,
    /// The rest.
    pub plan: Plan,
    /// Whether a solver that takes no problems of a kind is recorded there as having refused, as where it was asked for by its name; else its runs are no part
    /// of the campaign.
    pub named: bool,
    /// Seconds beyond its time limit after which a solve that does not stop is ended; the time limit itself, where that
    /// is longer. A solver looks at the clock after a step only.
    pub grace: f64,
}

impl Setup {
    /// The grace that is enough for a step on a busy machine, s.
    pub const GRACE: f64 = 10.0;
}

/// Something that happened in a campaign.
#[derive(Debug)]
pub enum Event<'a> {
    /// A problem was described.
    Described {
        /// Problems described.
        done: usize,
        /// Problems in all.
        all: usize,
        /// The problem; its [`error`](Problem::error) says if it cannot be used.
        problem: &'a Problem,
    },
    /// What is about to begin.
    Planned {
        /// Problems that can be used.
        problems: usize,
        /// Runs that the file lacks.
        runs: usize,
        /// Of them, those that are not made: their solvers refuse the kind of problem.
        refused: usize,
        /// How long the others take at most: all to their time limits.
        at_most: Duration,
    },
    /// A run has ended.
    Ended {
        /// Runs in the file that belong to the plan.
        done: usize,
        /// Runs of the plan.
        all: usize,
        /// The run.
        run: &'a Run,
        /// An estimate of the time left.
        left: Option<Duration>,
    },
    /// A problem whose file can no more be used; its runs from now on are left out. Said once for each problem.
    Lost {
        /// What happened to the file, by its name.
        why: &'a str,
    },
}

/// What a campaign came to.
#[derive(Debug, Clone, PartialEq, Eq, Default)]
pub struct Summary {
    /// Runs of the plan.
    pub all: usize,
    /// Of them, those in the file now.
    pub done: usize,
    /// Of them, those done by this call.
    pub new: usize,
    /// Of those, how many ended how.
    pub endings: BTreeMap<&'static str, usize>,
    /// Solves whose process had to wait for a processor for more than a tenth of the time.
    pub disturbed: usize,
    /// Problems that cannot be used: unreadable, or changed since their runs were made.
    pub unreadable: usize,
    /// Runs that are left out, as the file of their problem changed or went during the campaign.
    pub lost: usize,
    /// Whether it was cancelled.
    pub cancelled: bool,
}

/// Runs what of the plan is not in `there` yet, and appends it to `journal`.
///
/// Problems are dealt to shards one by one, so that all solvers of a problem run on the same machine. In each problem
/// all solvers run one after another. Runs in progress when `cancel` is set are dropped; they will be done on resumption.
/// So are those of a problem whose file changes or goes during the campaign. A problem that cannot be read, or whose file
/// has changed since `there` was written, is told and left out.
///
/// Errors: solver labels that nobody takes; a worker that cannot be started; a journal that cannot be written.
pub fn run(
    setup: &Setup,
    solvers: &impl Solvers,
    there: &Runs,
    journal: &mut Journal,
    cancel: &AtomicBool,
    watch: &mut dyn FnMut(Event<'_>),
) -> Result<Summary, String> {
    let labels = setup.plan.solvers.iter().map(|label| {
        let label = Label::parse(label)?;
        Ok((label.to_string(), label.kinds(solvers)?))
    });
    let labels = labels.collect::<Result<Vec<_>, String>>()?;
    let (shard, shards) = setup.plan.shard.unwrap_or((1, 1));
    let inputs: Vec<&Input> = setup.inputs.iter().skip(shard - 1).step_by(shards).collect();
    let lanes = lanes(setup.plan.jobs);
    let stamps: Vec<Stamp> = inputs.iter().map(|input| stamp(&input.path)).collect();
    // First what the problems are: it decides which solvers take them.
    let (described, cancelled) = describe(setup, &inputs, &lanes, there, journal, cancel, watch)?;
    let unreadable = described.values().filter(|p| p.error.is_some()).count();
    let mut summary = Summary { unreadable, cancelled, ..Summary::default() };
    if cancelled {
        return Ok(summary);
    }

    let before: HashMap<Key, Ending> = there.runs.iter().map(|r| (r.key(), r.ending)).collect();
    let mut jobs = VecDeque::new();
    let mut refused = vec![];
    for (&input, &stamp) in inputs.iter().zip(&stamps) {
        let problem = &described[&input.name];
        if problem.error.is_some() {
            continue;
        }
        for (label, kinds, tolerance) in runs_of(&setup.plan, &labels) {
            let takes = kinds.iter().any(|kind| kind.name() == problem.kind);
            if !takes && !setup.named {
                continue;
            }
            let run = blank(journal.campaign(), problem, label, tolerance);
            summary.all += 1;
            if let Some(ending) = before.get(&run.key()) {
                summary.count(*ending);
            } else if !takes {
                let message = Some(format!("takes no {} problems", problem.kind));
                refused.push(Run { ending: Ending::Refused, message, ..run });
            } else {
                let job = setup.job(input, setup.solve(label, tolerance));
                jobs.push_back(((run, input, stamp), job));
            }
        }
    }
    let limit = setup.plan.time_limit * jobs.len() as f64 / lanes.len().max(1) as f64;
    watch(Event::Planned {
        problems: described.len() - unreadable,
        runs: jobs.len() + refused.len(),
        refused: refused.len(),
        at_most: Duration::try_from_secs_f64(limit).unwrap_or(Duration::MAX),
    });
    let mut clock = Clock::new(jobs.iter().map(|((run, ..), _)| run), lanes.len());
    let mut ended = |run: Run, took: Option<Duration>, summary: &mut Summary| {
        journal.append(&Line::Run(Box::new(run.clone())))?;
        summary.count(run.ending);
        summary.new += 1;
        summary.disturbed += usize::from(disturbed(&run));
        took.into_iter().for_each(|took| clock.note(&run, took));
        let left = clock.left();
        watch(Event::Ended { done: summary.done, all: summary.all, run: &run, left });
        Ok::<_, String>(())
    };
    for run in refused {
        ended(run, None, &mut summary)?;
    }
    let mut told = BTreeMap::new();
    summary.cancelled =
        each(setup, &lanes, jobs, cancel, &mut |(blank, input, stamp), end, took| {
            if let Some(why) = lost(input, stamp, &end) {
                summary.lost += 1;
                told.entry(&input.name).or_insert(why);
                return Ok(());
            }
            ended(finished(blank, end, &setup.plan), Some(took), &mut summary)
        })?;
    told.values().for_each(|why| watch(Event::Lost { why }));
    Ok(summary)
}

/// Every solver with the kinds of problem that it takes, at every tolerance.
fn runs_of<'a>(
    plan: &'a Plan,
    labels: &'a [(String, Vec<Kind>)],
) -> impl Iterator<Item = (&'a str, &'a [Kind], f64)> {
    plan.tolerances.iter().flat_map(move |&tolerance| {
        labels.iter().map(move |(label, kinds)| (label.as_str(), kinds.as_slice(), tolerance))
    })
}

/// Has every problem described, and writes down those that `there` does not know. Second: whether that was cancelled.
fn describe(
    setup: &Setup,
    inputs: &[&Input],
    lanes: &[Vec<usize>],
    there: &Runs,
    journal: &mut Journal,
    cancel: &AtomicBool,
    watch: &mut dyn FnMut(Event<'_>),
) -> Result<(BTreeMap<String, Problem>, bool), String> {
    let jobs = inputs.iter().map(|&input| (input, setup.job(input, Task::Describe))).collect();
    let mut described = BTreeMap::new();
    let mut taken = HashSet::new();
    let cancelled = each(setup, lanes, jobs, cancel, &mut |input: &Input, end, _| {
        let mut problem = problem(input, end);
        if let Some(before) = before(&problem, inputs, there, &taken) {
            taken.insert(before);
            problem.name = before.into();
        }
        match there.problems.get(&problem.name) {
            Some(old) if old.error.is_none() && old.digest != problem.digest => {
                let file = input.path.display();
                let why = problem.error.unwrap_or_else(|| {
                    format!("{file}: expected the file that its runs were made on, found another")
                });
                problem = Problem { error: Some(why), ..old.clone() };
            }
            Some(old) if *old == problem => {}
            _ => journal.append(&Line::Problem(problem.clone()))?,
        }
        let (done, all) = (described.len() + 1, inputs.len());
        watch(Event::Described { done, all, problem: &problem });
        described.insert(input.name.clone(), problem);
        Ok(())
    })?;
    Ok((described, cancelled))
}

/// The name under which a problem is there, where that takes in fewer or more folders than its own now: another file of its name has come since, or is not
/// among the inputs this time.
fn before<'a>(
    problem: &Problem,
    inputs: &[&Input],
    there: &'a Runs,
    taken: &HashSet<&str>,
) -> Option<&'a str> {
    let is_it = |old: &Problem| old.error.is_none() && old.digest == problem.digest;
    let named = there.problems.get(&problem.name);
    if problem.digest.is_empty() || named.is_some_and(|old| old.error.is_some() || is_it(old)) {
        return None;
    }
    let ends = |long: &str, short: &str| long.strip_suffix(short).is_some_and(|s| s.ends_with('/'));
    let known = there.problems.iter().filter(|(_, old)| is_it(old)).map(|(name, _)| name.as_str());
    let namesakes = known.filter(|name| ends(name, &problem.name) || ends(&problem.name, name));
    let free = namesakes
        .filter(|name| !taken.contains(name) && !inputs.iter().any(|input| input.name == **name));
    free.min_by_key(|name| name.len().abs_diff(problem.name.len()))
}

impl Setup {
    fn job(&self, input: &Input, task: Task) -> Job {
        let memory_limit = self.plan.memory_limit;
        Job { file: input.path.clone(), task, memory_limit, processors: vec![] }
    }

    fn solve(&self, label: &str, tolerance: f64) -> Task {
        let &Plan { time_limit, repeats, repeat_below, trace, .. } = &self.plan;
        Task::Solve { solver: label.into(), tolerance, time_limit, repeats, repeat_below, trace }
    }
}

impl Summary {
    fn count(&mut self, ending: Ending) {
        self.done += 1;
        *self.endings.entry(ending.name()).or_insert(0) += 1;
    }
}

/// Whether a solve had to wait for a processor for more than a tenth of its time.
fn disturbed(run: &Run) -> bool {
    run.seconds.zip(run.cpu_seconds).is_some_and(|(wall, cpu)| wall > 0.01 && wall > 1.1 * cpu)
}

/// The processors of each worker: the physical cores dealt evenly, or no restriction for one worker alone or where
/// there are more workers than cores.
fn lanes(jobs: usize) -> Vec<Vec<usize>> {
    let cores = system::cores();
    let jobs = jobs.max(1);
    if jobs == 1 || jobs > cores.len() {
        return vec![vec![]; jobs];
    }
    let share = cores.len() / jobs;
    (0..jobs).map(|k| cores[k * share..(k + 1) * share].concat()).collect()
}

/// Has the workers do all jobs, one lane each; returns whether that was cancelled. `done` is called in this thread.
fn each<T: Send>(
    setup: &Setup,
    lanes: &[Vec<usize>],
    jobs: VecDeque<(T, Job)>,
    cancel: &AtomicBool,
    done: &mut dyn FnMut(T, End, Duration) -> Result<(), String>,
) -> Result<bool, String> {
    let queue = Mutex::new(jobs);
    // A campaign that fails stops its workers as one that is cancelled does.
    let stop = AtomicBool::new(false);
    let (send, receive) = channel();
    let outcome = std::thread::scope(|scope| {
        for lane in lanes {
            let (queue, stop, send) = (&queue, &stop, send.clone());
            scope.spawn(move || {
                let next = || queue.lock().ok()?.pop_front();
                while let Some((what, job)) = next() {
                    let job = Job { processors: lane.clone(), ..job };
                    let start = Instant::now();
                    let end = work(&setup.worker, &job, setup.grace, stop);
                    let over = matches!(end, Ok(End::Cancelled) | Err(_));
                    if send.send((what, end, start.elapsed())).is_err() || over {
                        break;
                    }
                }
            });
        }
        drop(send);
        let mut outcome = Ok(());
        loop {
            stop.fetch_or(cancel.load(Ordering::Relaxed) || outcome.is_err(), Ordering::Relaxed);
            match receive.recv_timeout(Duration::from_millis(100)) {
                Ok((_, Ok(End::Cancelled), _)) => {}
                Ok((what, Ok(end), took)) if outcome.is_ok() => outcome = done(what, end, took),
                Ok((_, Err(e), _)) if outcome.is_ok() => {
                    outcome = Err(format!("{}: {e}", setup.worker.program.display()));
                }
                Ok(_) => {}
                Err(std::sync::mpsc::RecvTimeoutError::Timeout) => {}
                Err(std::sync::mpsc::RecvTimeoutError::Disconnected) => break outcome,
            }
        }
    });
    outcome.map(|()| cancel.load(Ordering::Relaxed))
}

/// What tells that a file is as it was: its length and the time of its last change. None where there is no file.
type Stamp = Option<(u64, Option<SystemTime>)>;

fn stamp(file: &Path) -> Stamp {
    std::fs::metadata(file).ok().map(|m| (m.len(), m.modified().ok()))
}

/// Why a run is none of the problem that was described, if so.
fn lost(input: &Input, before: Stamp, end: &End) -> Option<String> {
    let file = input.path.display();
    match (stamp(&input.path), end) {
        (None, _) => Some(format!("{file}: expected the problem, found that its file is gone")),
        (now, _) if now != before => {
            Some(format!("{file}: expected the problem as it was, found that its file has changed"))
        }
        (_, End::Said(Said::Unreadable(why))) => Some(why.clone()),
        _ => None,
    }
}

/// What a worker's word on a file comes to.
fn problem(input: &Input, end: End) -> Problem {
    let named =
        Problem { name: input.name.clone(), family: input.family.clone(), ..<_>::default() };
    let unusable = |error: String| Problem { error: Some(error), ..named.clone() };
    let file = input.path.display();
    match end {
        End::Said(Said::Described(problem)) => {
            Problem { name: input.name.clone(), family: input.family.clone(), ..problem }
        }
        End::Said(Said::Unreadable(message)) => unusable(message),
        End::Said(other) => unusable(format!("{file}: expected a description, found {other:?}")),
        End::Hung { .. } => unusable(format!("{file}: reading it does not end")),
        End::OutOfMemory(why) => {
            unusable(format!("{file}: reading it takes too much memory: {why}"))
        }
        End::Crashed(why) => unusable(format!("{file}: reading it ends the program: {why}")),
        End::Cancelled => unusable(format!("{file}: cancelled")),
    }
}

/// A run of which nothing is known but what it is to be.
fn blank(campaign: &str, problem: &Problem, solver: &str, tolerance: f64) -> Run {
    Run {
        campaign: campaign.into(),
        problem: problem.name.clone(),
        digest: problem.digest.clone(),
        family: problem.family.clone(),
        kind: problem.kind.clone(),
        contacts: problem.contacts,
        solver: solver.into(),
        tolerance,
        ..Run::default()
    }
}

/// The run with what came of it.
fn finished(run: Run, end: End, plan: &Plan) -> Run {
    let ended = |ending, message: String| Run { ending, message: Some(message), ..run.clone() };
    match end {
        End::Said(Said::Done(result)) => Run {
            campaign: run.campaign,
            problem: run.problem,
            digest: run.digest,
            family: run.family,
            kind: run.kind,
            contacts: run.contacts,
            solver: run.solver,
            tolerance: run.tolerance,
            ..*result
        },
        End::Said(Said::Refused(message)) => ended(Ending::Refused, message),
        End::Said(other) => ended(Ending::Crashed, format!("expected a result, found {other:?}")),
        End::Hung { iteration, best, seconds, loading } => {
            let what = if loading { "reading the problem" } else { "the solve" };
            let message = format!("{what} did not stop at the limit of {} s", plan.time_limit);
            Run {
                iterations: iteration,
                seconds: (!loading).then_some(seconds),
                residuals: Residuals { reached: best, ..Residuals::default() },
                ..ended(Ending::Hung, message)
            }
        }
        End::OutOfMemory(message) => ended(Ending::OutOfMemory, message),
        End::Crashed(message) => ended(Ending::Crashed, message),
        End::Cancelled => ended(Ending::Crashed, "cancelled".into()),
    }
}

/// Estimates the time left: what remains of each solver and tolerance takes as long as what was done of it.
struct Clock {
    lanes: usize,
    groups: BTreeMap<(String, u64), Group>,
}

#[derive(Default)]
struct Group {
    left: usize,
    done: usize,
    took: Duration,
}

impl Clock {
    fn new<'a>(runs: impl Iterator<Item = &'a Run>, lanes: usize) -> Self {
        let mut groups: BTreeMap<_, Group> = BTreeMap::new();
        runs.for_each(|run| groups.entry(Self::group(run)).or_default().left += 1);
        Self { lanes, groups }
    }

    fn group(run: &Run) -> (String, u64) {
        (run.solver.clone(), run.tolerance.to_bits())
    }

    fn note(&mut self, run: &Run, took: Duration) {
        let group = self.groups.entry(Self::group(run)).or_default();
        group.left = group.left.saturating_sub(1);
        group.done += 1;
        group.took += took;
    }

    fn left(&self) -> Option<Duration> {
        let mean = |group: &Group| group.took.as_secs_f64() / group.done as f64;
        let known: Vec<f64> = self.groups.values().filter(|g| g.done > 0).map(mean).collect();
        let other = known.iter().sum::<f64>() / known.len() as f64;
        let seconds =
            self.groups.values().map(|g| g.left as f64 * if g.done > 0 { mean(g) } else { other });
        let total = seconds.sum::<f64>() / self.lanes as f64;
        (!known.is_empty()).then(|| Duration::try_from_secs_f64(total).ok()).flatten()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_time_left_is_that_of_the_runs_that_are_left() {
        let problem = Problem::default();
        let fast = blank("c", &problem, "fast", 1e-4);
        let slow = blank("c", &problem, "slow", 1e-4);
        let runs = [&fast, &fast, &fast, &slow, &slow];
        let mut clock = Clock::new(runs.into_iter(), 2);
        assert_eq!(clock.left(), None);
        clock.note(&fast, Duration::from_secs(1));
        // The other solver is taken to be as fast.
        assert_eq!(clock.left(), Some(Duration::from_secs(2)));
        clock.note(&slow, Duration::from_secs(10));
        assert_eq!(clock.left(), Some(Duration::from_secs(6)));
    }

    #[test]
    fn lanes_share_the_cores_and_do_not_overlap() {
        let cores = system::cores().len();
        assert_eq!(lanes(1), [[0; 0]]);
        assert_eq!(lanes(cores + 1), vec![Vec::<usize>::new(); cores + 1]);
        let mut all = lanes(cores).concat();
        let count = all.len();
        all.sort_unstable();
        all.dedup();
        assert_eq!(all.len(), count);
    }
}
