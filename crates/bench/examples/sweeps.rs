//! The cost of an NSGS sweep against streaming the blocks of W once through memory, in the same run.
//!
//! `cargo run --release -p nonsmooth-bench --example sweeps -- [key=value]… FILE_OR_FOLDER…`
//!
//! Local files only. Each figure is the fastest of several interleaved repetitions; `cpu` seconds per sweep can be set beside a
//! peer's seconds per iteration.

use std::hint::black_box;
use std::path::PathBuf;
use std::time::Instant;

use nonsmooth_io::fclib;
use nonsmooth_problem::linalg::Bsr;
use nonsmooth_problem::{Friction, FrictionLocal};
use nonsmooth_solve::Limits;
use nonsmooth_solve::registry::{self, Registered, SettingsMap};

const REPETITIONS: usize = 7;

/// Seconds to add up every entry of every block, with enough accumulators to be limited by memory alone.
fn stream<const D: usize>(w: &Bsr<D>, passes: usize) -> f64 {
    let start = Instant::now();
    for _ in 0..passes {
        let entries = black_box(w.blocks()).as_flattened().as_flattened();
        let mut sums = [0.0; 16];
        for chunk in entries.chunks_exact(16) {
            for (s, x) in sums.iter_mut().zip(chunk) {
                *s += x;
            }
        }
        black_box(sums);
    }
    start.elapsed().as_secs_f64() / passes as f64
}

/// Seconds of a sweep: a warm-started run that never reaches its tolerance, judged once.
fn sweep<P: Registered>(problem: &P, settings: &SettingsMap, sweeps: usize) -> f64 {
    let mut settings = settings.clone();
    settings.insert("check_every".into(), usize::MAX.into());
    let mut session = registry::session::<P>("nsgs", &settings).expect("NSGS with valid settings");
    let mut point = problem.origin();
    let limits = |n| Limits { tolerance: 1e-300, max_iterations: n, ..Limits::default() };
    let mut run = |n| session.solve(problem, &mut point, &limits(n), &mut |_| {}).expect("a run");
    run(50);
    let (long, short) = (run(sweeps + 1), run(1));
    // The difference leaves the set-up and the two judgements out.
    (long.seconds - short.seconds).max(0.0) / (long.iterations.max(2) - 1) as f64
}

fn report<const D: usize>(problem: &FrictionLocal<D>, settings: &SettingsMap, name: &str) {
    let bytes = 8 * D * D * problem.W.nblocks();
    let sweeps = (50_000_000 / bytes).clamp(20, 20_000);
    let mut best = (f64::INFINITY, f64::INFINITY);
    for _ in 0..REPETITIONS {
        best.0 = best.0.min(stream(&problem.W, sweeps));
        best.1 = best.1.min(sweep(problem, settings, sweeps));
    }
    let blocks = problem.W.nblocks() as f64;
    println!(
        "{:5} contacts {:6.1} blocks/row {:8.2} MB  stream {:9.2} us ({:5.1} GB/s)  sweep {:9.2} us \
         ({:5.1} ns/contact)  ratio {:5.2}  {name}",
        problem.contacts(),
        blocks / problem.contacts() as f64,
        bytes as f64 / 1e6,
        best.0 * 1e6,
        bytes as f64 / best.0 / 1e9,
        best.1 * 1e6,
        best.1 * 1e9 / problem.contacts() as f64,
        best.1 / best.0,
    );
}

fn main() -> Result<(), Box<dyn std::error::Error>> {
    let args: Vec<String> = std::env::args().skip(1).collect();
    let (settings, roots): (Vec<_>, Vec<_>) = args.iter().partition(|a| a.contains('='));
    let settings = registry::parse_settings(&settings)?;
    let roots: Vec<PathBuf> = roots.iter().map(PathBuf::from).collect();
    if roots.is_empty() {
        return Err("usage: sweeps [key=value]… FILE_OR_FOLDER…".into());
    }
    for path in nonsmooth_bench::problem_files(&roots)? {
        let name = path.file_name().unwrap_or_default().to_string_lossy();
        match fclib::read(&path).map(|file| file.problem) {
            Ok(Friction::Local2(problem)) => report(&problem, &settings, &name),
            Ok(Friction::Local3(problem)) => report(&problem, &settings, &name),
            Ok(_) => {}
            Err(e) => eprintln!("{e}"),
        }
    }
    Ok(())
}
