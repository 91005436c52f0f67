//! What one solver solves: a line per file and the shares solved.
//!
//! `cargo run --release -p nonsmooth-bench --example outcomes -- TOL SECONDS SOLVER [key=value]… FOLDER…`

use std::path::PathBuf;

use nonsmooth_io::fclib;
use nonsmooth_problem::with_friction;
use nonsmooth_solve::registry::{self, Registered};
use nonsmooth_solve::settings::{self, SettingsMap};
use nonsmooth_solve::{Limits, Outcome, SolveError, Status};

fn solve<P: Registered>(
    problem: &P,
    solver: &str,
    settings: &SettingsMap,
    limits: &Limits,
) -> Result<Outcome, SolveError> {
    let mut point = problem.origin();
    registry::session::<P>(solver, settings)?.solve(problem, &mut point, limits, &mut |_| {})
}

fn main() -> Result<(), Box<dyn std::error::Error>> {
    let args: Vec<String> = std::env::args().skip(1).collect();
    let [tolerance, seconds, solver, rest @ ..] = args.as_slice() else {
        return Err("usage: outcomes TOL SECONDS SOLVER [key=value]… FOLDER…".into());
    };
    let limits = Limits {
        tolerance: tolerance.parse()?,
        time_limit: Some(seconds.parse()?),
        max_iterations: usize::MAX,
        cancel: None,
    };
    let (settings, folders): (Vec<_>, Vec<_>) = rest.iter().partition(|a| a.contains('='));
    let settings = settings::from_texts(&settings)?;
    let folders: Vec<PathBuf> = folders.iter().map(PathBuf::from).collect();
    let (mut solved, mut all) = (0, 0);
    for path in nonsmooth_bench::problem_files(&folders)? {
        let file = match fclib::read(&path) {
            Ok(file) => file,
            Err(e) => {
                println!("{e}");
                continue;
            }
        };
        let outcome = with_friction!(&file.problem, p => solve(p, solver, &settings, &limits))?;
        all += 1;
        solved += usize::from(outcome.status == Status::Solved);
        println!(
            "{:16} {:.2e} {:.2e} {:8} its {:9.3e} s  nc {:5}  {}",
            outcome.status.name(),
            outcome.measure.relative,
            outcome.measure.peer,
            outcome.iterations,
            outcome.seconds,
            file.problem.contacts(),
            path.display()
        );
    }
    println!("{solved} of {all} solved at {tolerance}");
    Ok(())
}
