//! How long `auto` takes in a session that knows the problem's shape, as in a simulator's step, beside a peer's table.
//!
//! `cargo run --release -p nonsmooth-bench --example warm -- [tol=1e-8] [solver=auto] [peers=TABLE.csv] [seconds=0.1] [iterations=N] [limit=S] FILE.hdf5...`
//!
//! Contact files, each solved from zero impulses again and again by one session; the figure is the fastest wall clock of a solve, judge included, since what
//! takes microseconds is disturbed upwards only. The table has the columns `problem, tol, solver, seconds, error`; of a problem it counts the fastest solver whose
//! error is at most the tolerance. The last lines are geometric means of the ratios to it, and those above 1.5.

use std::collections::HashMap;
use std::path::Path;
use std::time::Instant;

use nonsmooth_problem::{AnyProblem, with_problem};
use nonsmooth_solve::registry::{Registered, session};
use nonsmooth_solve::settings::SettingsMap;
use nonsmooth_solve::{Limits, Outcome};

/// Solves of this many seconds are not repeated.
const LONG: f64 = 3.0;

/// The fastest of the solves that fit into so many seconds, at least three if they take no longer than [`LONG`], and what it came to.
fn fastest<P: Registered>(
    problem: &P,
    solver: &str,
    limits: &Limits,
    seconds: f64,
) -> Result<(f64, Outcome), Box<dyn std::error::Error>> {
    let mut session = session::<P>(solver, &SettingsMap::new())?;
    let origin = problem.origin();
    let mut point = origin.clone();
    let begun = Instant::now();
    let (mut best, mut count) = (f64::INFINITY, 0);
    loop {
        P::copy_point(&origin, &mut point);
        let start = Instant::now();
        let outcome = session.solve(problem, &mut point, limits, &mut |_| {})?;
        best = best.min(start.elapsed().as_secs_f64());
        count += 1;
        let spent = begun.elapsed().as_secs_f64();
        if (count >= 3 || spent > LONG) && spent >= seconds {
            return Ok((best, outcome));
        }
    }
}

/// The seconds of the fastest solver of each problem by its stem.
fn peers(table: &str, tolerance: f64) -> Result<HashMap<String, f64>, Box<dyn std::error::Error>> {
    let mut best = HashMap::new();
    for row in csv::Reader::from_path(table)?.deserialize() {
        let row: HashMap<String, String> = row?;
        let number = |key: &str| row.get(key).and_then(|t| t.parse::<f64>().ok());
        let (Some(tol), Some(seconds), Some(error)) =
            (number("tol"), number("seconds"), number("error"))
        else {
            continue;
        };
        if tol <= tolerance && error <= tolerance {
            let stem = Path::new(&row["problem"]).file_stem().unwrap_or_default();
            let entry = best.entry(stem.to_string_lossy().into_owned()).or_insert(f64::INFINITY);
            *entry = seconds.min(*entry);
        }
    }
    Ok(best)
}

fn main() -> Result<(), Box<dyn std::error::Error>> {
    let arguments: Vec<String> = std::env::args().skip(1).collect();
    let of = |key: &str| arguments.iter().find_map(|a| a.strip_prefix(key)?.strip_prefix('='));
    let tolerance = of("tol").map_or(Ok(1e-8), str::parse)?;
    let seconds = of("seconds").map_or(Ok(0.1), str::parse)?;
    let solver = of("solver").unwrap_or("auto");
    let peers = of("peers").map_or(Ok(HashMap::new()), |table| peers(table, tolerance))?;
    let most = of("iterations").map_or(Ok(Limits::default().max_iterations), str::parse)?;
    let time_limit = of("limit").map(str::parse).transpose()?;
    let limits = Limits { tolerance, max_iterations: most, time_limit, ..Limits::default() };
    println!(
        "{:40} {:>8} {:>10} {:>12} {:>10} {:>7}  status",
        "problem", "contacts", "iterations", "us", "peer us", "ratio"
    );
    let mut ratios = vec![];
    for file in arguments.iter().filter(|a| !a.contains('=')) {
        let AnyProblem::Friction(problem) = nonsmooth_io::read(file)? else {
            return Err(format!("{file}: no contact problem").into());
        };
        let contacts = problem.contacts();
        let problem = AnyProblem::from(problem);
        let (time, outcome) = with_problem!(&problem, p => fastest(p, solver, &limits, seconds)?);
        let stem = Path::new(file).file_stem().unwrap_or_default().to_string_lossy();
        let peer = peers.get(&*stem).copied();
        let ratio = peer.map(|peer| time / peer);
        let shown =
            |x: Option<f64>, digits: usize| x.map_or("-".into(), |x| format!("{x:.digits$}"));
        println!(
            "{stem:40} {contacts:8} {:10} {:12.2} {:>10} {:>7}  {}",
            outcome.iterations,
            time * 1e6,
            shown(peer.map(|p| p * 1e6), 2),
            shown(ratio, 2),
            outcome.status.name()
        );
        ratios.extend(ratio);
    }
    if !ratios.is_empty() {
        let mean = ratios.iter().map(|r: &f64| r.ln()).sum::<f64>() / ratios.len() as f64;
        let slow = ratios.iter().filter(|r| **r > 1.5).count();
        println!(
            "\n{} with a peer: geometric mean {:.3}, {slow} above 1.5",
            ratios.len(),
            mean.exp()
        );
    }
    Ok(())
}
