//! The cost of an NSGS sweep against streaming the blocks of W once, in the same run.
//!
//! `cargo run --release -p nonsmooth-bench --example sweeps -- [peer=CSV] [key=value]… FILE_OR_FOLDER…`
//!
//! Local files only. Two baselines: `memory`, the bytes of W at the rate at which this machine reads a buffer far larger than its
//! caches; and `cache`, the blocks of this very W added up again and again, which for all but the largest problems come
//! from a cache. Each figure is the fastest of several interleaved repetitions. With a peer's table of runs (columns problem, solver,
//! iters, seconds), its NSGS seconds per iteration stand beside ours.

use std::hint::black_box;
use std::path::PathBuf;
use std::time::Instant;

use nonsmooth_io::fclib;
use nonsmooth_problem::{Friction, FrictionLocal};
use nonsmooth_solve::Limits;
use nonsmooth_solve::registry::{self, Registered};
use nonsmooth_solve::settings::{self, SettingsMap};

const REPETITIONS: usize = 7;

/// Seconds to add up all entries once, with enough accumulators to be limited by loads alone.
fn stream(entries: &[f64], passes: usize) -> f64 {
    let start = Instant::now();
    for _ in 0..passes {
        let entries = black_box(entries);
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

/// Bytes per second from a buffer of 512 MiB.
fn memory_rate() -> f64 {
    let buffer = vec![1.0; 1 << 26];
    let fastest = (0..5).map(|_| stream(&buffer, 1)).fold(f64::INFINITY, f64::min);
    8.0 * buffer.len() as f64 / fastest
}

/// A peer's smallest seconds per iteration of NSGS on the problem of that name.
fn peer_seconds(csv: &str, name: &str) -> Option<f64> {
    let mut lines = csv.lines().map(|l| l.split(',').collect::<Vec<_>>());
    let header = lines.next()?;
    let column = |name: &str| header.iter().position(|h| *h == name);
    let (problem, solver) = (column("problem")?, column("solver")?);
    let (iterations, seconds) = (column("iters")?, column("seconds")?);
    let stem = |n: &str| n.trim_end_matches(".dat").trim_end_matches(".hdf5").to_owned();
    lines
        .filter(|l| stem(l[problem]) == stem(name) && l[solver] == "NSGS")
        .filter_map(|l| Some((l[seconds].parse::<f64>().ok()?, l[iterations].parse::<f64>().ok()?)))
        .filter(|(_, iterations)| *iterations >= 10.0)
        .map(|(seconds, iterations)| seconds / iterations)
        .reduce(f64::min)
}

/// What the figures are compared with.
struct Baselines {
    memory_rate: f64,
    peer: Option<String>,
}

fn report<const D: usize>(
    problem: &FrictionLocal<D>,
    settings: &SettingsMap,
    name: &str,
    baselines: &Baselines,
) where
    FrictionLocal<D>: Registered,
{
    let entries = problem.W.blocks().as_flattened().as_flattened();
    let bytes = 8 * entries.len();
    let sweeps = (50_000_000 / bytes).clamp(20, 20_000);
    let mut best = (f64::INFINITY, f64::INFINITY);
    for _ in 0..REPETITIONS {
        best.0 = best.0.min(stream(entries, sweeps));
        best.1 = best.1.min(sweep(problem, settings, sweeps));
    }
    let (cache, sweep) = best;
    let memory = bytes as f64 / baselines.memory_rate;
    let nc = problem.contacts() as f64;
    print!(
        "{:8} {:8.1} {:8.2} {:9.1} {:9.1} {:9.1} {:8.1} {:8.2} {:8.2}",
        problem.contacts(),
        problem.W.nblocks() as f64 / nc,
        bytes as f64 / 1e6,
        sweep * 1e6,
        memory * 1e6,
        cache * 1e6,
        sweep * 1e9 / nc,
        sweep / memory,
        sweep / cache,
    );
    match baselines.peer.as_deref().and_then(|csv| peer_seconds(csv, name)) {
        Some(peer) => print!(" {:9.1} {:8.1}", peer * 1e6, peer / sweep),
        None => print!(" {:9} {:8}", "", ""),
    }
    println!("  {name}");
}

fn main() -> Result<(), Box<dyn std::error::Error>> {
    let args: Vec<String> = std::env::args().skip(1).collect();
    let (settings, roots): (Vec<_>, Vec<_>) = args.iter().partition(|a| a.contains('='));
    let mut settings = settings::from_texts(&settings)?;
    let peer = settings.remove("peer").and_then(|path| path.as_str().map(str::to_owned));
    let peer = peer.map(std::fs::read_to_string).transpose()?;
    let roots: Vec<PathBuf> = roots.iter().map(PathBuf::from).collect();
    if roots.is_empty() {
        return Err("usage: sweeps [key=value]… FILE_OR_FOLDER…".into());
    }
    let baselines = Baselines { memory_rate: memory_rate(), peer };
    println!("memory rate {:.1} GB/s; times in us", baselines.memory_rate / 1e9);
    println!(
        "{:>8} {:>8} {:>8} {:>9} {:>9} {:>9} {:>8} {:>8} {:>8} {:>9} {:>8}",
        "contacts",
        "blk/row",
        "MB",
        "sweep",
        "memory",
        "cache",
        "ns/cont",
        "/memory",
        "/cache",
        "peer",
        "peer/us",
    );
    let (inputs, mistakes) = nonsmooth_bench::campaign::inputs(&roots);
    mistakes.iter().for_each(|mistake| eprintln!("{mistake}"));
    for input in inputs {
        let name = input.name.rsplit('/').next().unwrap_or_default();
        match fclib::read_problem(&input.path) {
            Ok(Friction::Local2(problem)) => report(&problem, &settings, name, &baselines),
            Ok(Friction::Local3(problem)) => report(&problem, &settings, name, &baselines),
            Ok(_) => {}
            Err(e) => eprintln!("{e}"),
        }
    }
    Ok(())
}
