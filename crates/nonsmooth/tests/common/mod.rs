//! What the tests of the whole house share.
#![allow(dead_code)]

use std::io::Write;
use std::path::{Path, PathBuf};

use nonsmooth_problem::check::{Judged, VerdictOf};
use nonsmooth_solve::registry::{self, Registered};
use nonsmooth_solve::{Limits, Outcome, Status};

/// Says that a test, or a part of it, did not run; past the capture of the output of tests.
pub fn skipped(why: &str) {
    let line = format!("SKIPPED: {why}\n");
    std::io::stderr().write_all(line.as_bytes()).unwrap();
}

/// The HDF5 files under folders of the corpus that `NONSMOOTH_CORPUS` names, sorted; none, said visibly, where it is
/// not set.
pub fn corpus_files(folders: &[&str]) -> Vec<PathBuf> {
    let Some(corpus) = std::env::var_os("NONSMOOTH_CORPUS") else {
        skipped("NONSMOOTH_CORPUS is not set");
        return vec![];
    };
    let corpus = Path::new(&corpus);
    let roots: Vec<_> = folders.iter().map(|folder| corpus.join(folder)).collect();
    let (found, mistakes) = nonsmooth_bench::campaign::inputs(&roots);
    assert!(mistakes.is_empty(), "the corpus at {}: {mistakes:?}", corpus.display());
    let mut files: Vec<_> = found.into_iter().map(|input| input.path).collect();
    files.sort();
    files
}

/// A run of one solver, confronted with the judge: `solved` is the judge's word.
pub struct Run<P: Judged> {
    pub point: P::Point,
    pub outcome: Outcome,
    pub verdict: VerdictOf<P>,
    pub account: Vec<String>,
}

/// Runs a solver; it must end near its time limit, and say `solved` exactly where the judge does.
pub fn run<P: Registered + Judged>(
    problem: &P,
    solver: &str,
    settings: &[&str],
    limits: &Limits,
) -> Run<P> {
    let settings = nonsmooth_solve::settings::from_texts(settings).unwrap();
    let mut session = registry::session::<P>(solver, &settings).unwrap();
    let mut point = problem.origin();
    let outcome = session.solve(problem, &mut point, limits, &mut |_| {}).unwrap();
    let verdict = problem.judge(&point, limits.tolerance).unwrap();
    assert_eq!(outcome.status == Status::Solved, verdict.solved, "{solver}: {outcome:?}");
    if let Some(limit) = limits.time_limit {
        // A step may take a while, and the machine may be busy with other tests.
        let late = 2.0 * limit + 10.0;
        assert!(outcome.seconds < late, "{solver}: {} s, allowed {limit}", outcome.seconds);
    }
    Run { point, outcome, verdict, account: session.account() }
}

/// To this relative residual, within so many seconds.
pub fn within(tolerance: f64, seconds: f64) -> Limits {
    Limits { tolerance, time_limit: Some(seconds), ..Limits::default() }
}
