//! Runs made by hand.
#![allow(dead_code)]

use std::io::Write;
use std::path::{Path, PathBuf};

use nonsmooth_bench::record::{Campaign, Ending, FORMAT, Machine, Plan, Residuals, Run, VERSION};
use nonsmooth_bench::runs::Runs;

/// Says that a test was passed by, also where the output of tests is captured.
pub fn skipped(why: &str) {
    let line = format!("SKIPPED: {why}\n");
    std::io::stderr().write_all(line.as_bytes()).unwrap();
}

/// The corpus, if there is one.
pub fn corpus() -> Option<PathBuf> {
    let corpus = std::env::var_os("NONSMOOTH_CORPUS").map(PathBuf::from);
    if corpus.is_none() {
        skipped("NONSMOOTH_CORPUS is not set");
    }
    corpus
}

/// A campaign without runs.
pub fn campaign(id: &str) -> Runs {
    let plan = Plan {
        solvers: vec![],
        tolerances: vec![1e-8],
        time_limit: 10.0,
        memory_limit: 1 << 30,
        repeats: 5,
        repeat_below: 1.0,
        trace: false,
        jobs: 1,
        shard: None,
    };
    let campaign = Campaign {
        format: FORMAT.into(),
        version: VERSION,
        id: id.into(),
        program: "nonsmooth 0.1.0".into(),
        foreign: false,
        started: None,
        machine: Machine { cpu: "a processor".into(), cores: 2, ..Machine::default() },
        plan: Some(plan),
    };
    Runs { campaigns: vec![campaign], ..Runs::default() }
}

/// A solved run of a campaign `a`, on a problem `family/name`.
pub fn run(problem: &str, solver: &str, seconds: f64) -> Run {
    Run {
        campaign: "a".into(),
        problem: problem.into(),
        digest: String::new(),
        family: problem.split('/').next().unwrap().into(),
        kind: "friction_local_3d".into(),
        contacts: 10,
        solver: solver.into(),
        tolerance: 1e-8,
        ending: Ending::Solved,
        message: None,
        iterations: Some(10),
        factorisations: Some(0),
        seconds: Some(seconds),
        seconds_median: Some(seconds),
        seconds_max: Some(seconds),
        repeats: 5,
        cpu_seconds: None,
        peak_memory: None,
        loaded_memory: None,
        residuals: Residuals { reached: Some(1e-9), ..Residuals::default() },
        trace: vec![],
    }
}

/// The same, but it failed.
pub fn failed(problem: &str, solver: &str, ending: Ending, reached: f64) -> Run {
    let residuals = Residuals { reached: Some(reached), ..Residuals::default() };
    Run { ending, residuals, ..run(problem, solver, 10.0) }
}

/// Writes a file into a folder.
pub fn write(folder: &Path, name: &str, text: &str) -> PathBuf {
    let path = folder.join(name);
    std::fs::write(&path, text).unwrap();
    path
}
