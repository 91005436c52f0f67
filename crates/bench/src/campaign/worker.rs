//! The worker: one process, one problem, one solver, one tolerance.

use std::io::{BufRead, Read, Write};
use std::time::Instant;

use nonsmooth_problem::check::Measure;
use nonsmooth_problem::with_problem;
use nonsmooth_solve::registry::Registered;
use nonsmooth_solve::{Limit, Limits, Outcome, Sample, Status};

use super::files::describe;
use super::job::{Job, Said, Task};
use super::solvers::{Label, Solvers};
use super::system;
use crate::finite;
use crate::record::{Ending, Residuals, Run};
use crate::tables::median;

/// Seconds between two signs of life.
const PULSE: f64 = 1.0;
/// Solves that take less in all, s, are repeated further: a single interruption outweighs them.
const SHORT: f64 = 0.02;
/// By how many times at most.
const MORE: usize = 10;
/// The most points that a trace keeps.
const TRACE: usize = 256;

/// As in [`Run::trace`].
type Trace = Vec<(u64, f64, f64)>;

/// Does the one [`Job`] that stands on the first line of the standard input, and says on the standard output what comes
/// of it. The process ends when the standard input does: nobody is left to listen.
///
/// Errors: no job on the standard input.
pub fn serve(solvers: &impl Solvers) -> Result<(), String> {
    let mut line = String::new();
    std::io::stdin().lock().read_line(&mut line).map_err(|e| format!("standard input: {e}"))?;
    let job: Job = serde_json::from_str(&line)
        .map_err(|e| format!("standard input: expected a job of a campaign, found {e}"))?;
    std::thread::spawn(|| {
        let _ = std::io::stdin().lock().read(&mut [0]);
        std::process::exit(1);
    });
    system::stay_on(&job.processors);
    system::limit_memory(job.memory_limit);
    say(&match &job.task {
        Task::Describe => describe(&job.file).map_or_else(Said::Unreadable, Said::Described),
        Task::Solve { .. } => match nonsmooth_io::read(&job.file) {
            Err(e) => Said::Unreadable(e.to_string()),
            Ok(problem) => with_problem!(&problem, p => solve(p, &job.task, solvers))
                .unwrap_or_else(Said::Refused),
        },
    });
    Ok(())
}

/// Says one line. If the campaign is gone, so is the worker.
fn say(said: &Said) {
    let text = serde_json::to_string(said).unwrap_or_default();
    let mut out = std::io::stdout().lock();
    if writeln!(out, "{text}").and_then(|()| out.flush()).is_err() {
        std::process::exit(1);
    }
}

/// Solves a problem: once to warm up, then `repeats` times (more where it is short), unless the first time is long enough or ends without an answer: a solution, or
/// a proof that there is none.
fn solve<P: Registered>(problem: &P, task: &Task, solvers: &impl Solvers) -> Result<Said, String> {
    let &Task::Solve { ref solver, tolerance, time_limit, repeats, repeat_below, trace } = task
    else {
        return Err("expected a task to solve".into());
    };
    let label = Label::parse(solver)?;
    let start = Instant::now();
    drop(problem.gauge().map_err(|e| e.to_string())?);
    say(&Said::Loaded { judge: start.elapsed().as_secs_f64() });
    let loaded_memory = system::peak_memory();
    let limits = Limits {
        tolerance,
        max_iterations: usize::MAX,
        time_limit: Some(time_limit),
        cpu_time: true,
        ..Limits::default()
    };
    // Each solve has a workspace of its own: what is timed is a solver that meets the problem for the first time.
    let attempt = || -> Result<(Outcome, Trace), String> {
        let mut session =
            solvers.session::<P>(&label.name, &label.settings).map_err(|e| e.to_string())?;
        let mut point = problem.origin();
        let mut next = PULSE;
        say(&Said::Solving);
        let outcome = session.solve(problem, &mut point, &limits, &mut |p| {
            if p.seconds >= next {
                next = p.seconds + PULSE;
                let (iteration, seconds) = (p.iteration as u64, p.seconds);
                say(&Said::Progress { iteration, seconds, best: finite(p.best) });
            }
        });
        // Kept for a trace alone: it would count as memory of the solves to come.
        let history = if trace { thinned(session.history()) } else { vec![] };
        Ok((outcome.map_err(|e| e.to_string())?, history))
    };
    let answers = |(outcome, _): &(Outcome, Trace)| ending(&outcome.status).answers();
    let first = attempt()?;
    let mut timed = vec![first];
    if answers(&timed[0]) && timed[0].0.seconds < repeat_below && repeats > 0 {
        timed.clear();
        let mut spent = 0.0;
        while timed.len() < repeats as usize
            || (spent < SHORT && timed.len() < MORE * repeats as usize)
        {
            timed.push(attempt()?);
            spent += timed[timed.len() - 1].0.seconds;
        }
    }
    timed.sort_by(|a, b| a.0.seconds.total_cmp(&b.0.seconds));
    let seconds: Vec<f64> = timed.iter().map(|t| t.0.seconds).collect();
    // A success that does not repeat is none.
    let counts = timed.iter().position(|t| !answers(t)).unwrap_or(0);
    let (outcome, trace) = timed.swap_remove(counts);
    Ok(Said::Done(Box::new(Run {
        ending: ending(&outcome.status),
        message: (outcome.status != Status::Solved).then(|| outcome.status.to_string()),
        iterations: Some(outcome.iterations as u64),
        factorisations: Some(outcome.factorisations),
        seconds: Some(outcome.seconds),
        seconds_median: median(&seconds),
        seconds_max: Some(seconds[seconds.len() - 1]),
        repeats: seconds.len() as u32,
        cpu_seconds: outcome.cpu_seconds,
        peak_memory: system::peak_memory(),
        loaded_memory,
        residuals: residuals(&outcome.measure),
        trace,
        ..Run::default()
    })))
}

fn ending(status: &Status) -> Ending {
    match status {
        Status::Solved => Ending::Solved,
        Status::Infeasible(_) => Ending::Infeasible,
        Status::NearlyInfeasible { .. } => Ending::NearlyInfeasible,
        Status::NoConclusion(_) => Ending::NoConclusion,
        Status::Limit(Limit::Time | Limit::Cancelled) => Ending::TimeLimit,
        Status::Limit(Limit::Iterations) => Ending::IterationLimit,
        Status::Stalled(_) => Ending::Stalled,
    }
}

fn residuals(m: &Measure) -> Residuals {
    Residuals {
        reached: finite(m.merit()),
        relative: finite(m.relative),
        absolute: finite(m.absolute),
        literature: finite(m.literature),
        siconos: finite(m.siconos),
        primal: finite(m.primal),
        dual: finite(m.dual),
        complementarity: finite(m.complementarity),
        dynamics: m.dynamics.and_then(finite),
        bilateral: m.bilateral.and_then(finite),
    }
}

/// At most [`TRACE`] points, evenly by their number, the last one included.
fn thinned(history: &[Sample]) -> Trace {
    let stride = history.len().div_ceil(TRACE).max(1);
    let last = history.len().saturating_sub(1);
    history
        .iter()
        .enumerate()
        .filter(|(k, s)| (last - k).is_multiple_of(stride) && s.relative.is_finite())
        .map(|(_, s)| (s.iteration as u64, s.seconds, s.relative))
        .collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn traces_are_thinned_and_end_where_the_solve_did() {
        let sample = |k: usize| Sample { iteration: k, seconds: k as f64, relative: 1.0 };
        let history: Vec<_> = (0..1000).map(sample).collect();
        let thin = thinned(&history);
        assert!(thin.len() <= TRACE && thin.len() > TRACE / 2);
        assert_eq!(thin.last().unwrap().0, 999);
        assert_eq!(thinned(&history[..3]).len(), 3);
        assert!(thinned(&[]).is_empty());
    }
}
