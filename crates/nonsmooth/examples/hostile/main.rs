//! Attacks the solvers with problems made to deceive, and tests every claim exactly; for as long as you like.
//!
//! `cargo run --release -p nonsmooth --example hostile -- --hours 1 --seed 1 [--solves N] [--kind K] [--threads 2] [--out report.json] [--out-dir lies]`
//!
//! `--replay SEED KIND INDEX` repeats one problem and says what everybody claims; with `--out-dir` it is written as a file.
//!
//! What is told: how often each solver ended how, problems of at most ten pairs that `auto` left undecided, and every claim that is false:
//!
//! | claim | meaning |
//! | --- | --- |
//! | `solved none` | called solved, though no solution exists |
//! | `solved residual` | called solved, though the criterion, computed exactly, is above the tolerance |
//! | `infeasible`, `no solution` | said to have none, though there is one |
//! | `proved` | said to have a solution, though there is none |
//! | `late`, `panic`, `not finite` | no way to end |
//!
//! Exit code 1 where a claim was false, 3 where a solver did not come back.

mod suite;

use std::collections::BTreeMap;
use std::path::PathBuf;
use std::sync::Mutex;
use std::sync::atomic::{AtomicBool, AtomicU64, Ordering};
use std::time::{Duration, Instant};

use suite::claims::{Effort, Lie, Tally};
use suite::{All, KINDS};

/// Undecided problems that are listed, of each kind and truth.
const OPEN_SHOWN: usize = 20;
/// Seconds after which a solver is given up, and the run with it.
const HANGS: f64 = 60.0;

#[derive(Debug, Clone)]
struct Options {
    seconds: f64,
    solves: u64,
    seed: u64,
    kinds: Vec<String>,
    threads: usize,
    out: Option<PathBuf>,
    folder: Option<PathBuf>,
    replay: Option<(u64, String, u64)>,
    time_limit: f64,
    steps: usize,
}

fn options() -> Result<Options, String> {
    let mut options = Options {
        seconds: 60.0,
        solves: u64::MAX,
        seed: 1,
        kinds: KINDS.iter().map(|&k| k.to_owned()).collect(),
        threads: 2,
        out: None,
        folder: None,
        replay: None,
        time_limit: 2.0,
        steps: 300,
    };
    let mut args = std::env::args().skip(1);
    while let Some(name) = args.next() {
        let mut value = || args.next().ok_or(format!("{name} needs a value"));
        let number = |text: String| text.parse::<f64>().map_err(|e| format!("{name} {text}: {e}"));
        let whole = |text: String| text.parse::<u64>().map_err(|e| format!("{name} {text}: {e}"));
        match name.as_str() {
            "--hours" => options.seconds = 3600.0 * number(value()?)?,
            "--seconds" => options.seconds = number(value()?)?,
            "--solves" => options.solves = whole(value()?)?,
            "--seed" => options.seed = whole(value()?)?,
            "--kind" => options.kinds = value()?.split(',').map(str::to_owned).collect(),
            "--threads" => options.threads = whole(value()?)? as usize,
            "--out" => options.out = Some(value()?.into()),
            "--out-dir" => options.folder = Some(value()?.into()),
            "--time-limit" => options.time_limit = number(value()?)?,
            "--steps" => options.steps = whole(value()?)? as usize,
            "--replay" => options.replay = Some((whole(value()?)?, value()?, whole(value()?)?)),
            _ => {
                return Err(format!(
                    "unknown option {name}; the first lines of this file name all"
                ));
            }
        }
    }
    let mut named = options.kinds.iter().chain(options.replay.as_ref().map(|r| &r.1));
    match named.find(|k| !KINDS.contains(&k.as_str()) && *k != "files") {
        Some(kind) => Err(format!("no kind {kind}; there are: {}, files", KINDS.join(", "))),
        None => Ok(options),
    }
}

fn main() {
    let options = options().unwrap_or_else(|mistake| {
        eprintln!("{mistake}");
        std::process::exit(2);
    });
    let effort =
        Effort { steps: options.steps, default_steps: 20_000, seconds: options.time_limit };
    if let Some((seed, kind, index)) = &options.replay {
        replay(&options, &effort, *seed, kind, *index);
        return;
    }
    // Panics are counted, not printed.
    std::panic::set_hook(Box::new(|_| {}));
    if let Some(folder) = &options.folder {
        std::fs::create_dir_all(folder).expect("a folder for the lies");
    }
    let begun = Instant::now();
    let (next, over) = (AtomicU64::new(0), AtomicBool::new(false));
    let total = Mutex::new(Tally::default());
    let doing: Vec<_> = (0..options.threads).map(|_| Mutex::new((begun, String::new()))).collect();
    std::thread::scope(|scope| {
        let workers: Vec<_> = (0..options.threads)
            .map(|k| {
                let (options, effort, next, over, total) =
                    (&options, &effort, &next, &over, &total);
                let doing = &doing[k];
                scope.spawn(move || work(options, effort, next, over, total, doing))
            })
            .collect();
        let mut said = Instant::now();
        while !workers.iter().all(|w| w.is_finished()) {
            std::thread::sleep(Duration::from_millis(200));
            let solves = total.lock().expect("no panic").solves;
            if begun.elapsed().as_secs_f64() > options.seconds || solves >= options.solves {
                over.store(true, Ordering::Relaxed);
            }
            for doing in &doing {
                let (since, what) = doing.lock().expect("no panic").clone();
                if since.elapsed().as_secs_f64() > HANGS && !what.is_empty() {
                    eprintln!("HANGS: {what}");
                    report(&options, &total.lock().expect("no panic"), begun.elapsed());
                    std::process::exit(3);
                }
            }
            if said.elapsed().as_secs_f64() > 60.0 {
                said = Instant::now();
                let total = total.lock().expect("no panic");
                eprintln!(
                    "{:.0} s: {} problems, {} solves, {} false",
                    begun.elapsed().as_secs_f64(),
                    total.problems,
                    total.solves,
                    total.lies.len()
                );
            }
        }
    });
    let total = total.into_inner().expect("no panic");
    report(&options, &total, begun.elapsed());
    if !total.lies.is_empty() {
        std::process::exit(1);
    }
}

fn work(
    options: &Options,
    effort: &Effort,
    next: &AtomicU64,
    over: &AtomicBool,
    total: &Mutex<Tally>,
    doing: &Mutex<(Instant, String)>,
) {
    let mut all = All::new();
    let files = tempfile::tempdir().expect("a folder for damaged files");
    while !over.load(Ordering::Relaxed) {
        let k = next.fetch_add(1, Ordering::Relaxed);
        let kind = &options.kinds[k as usize % options.kinds.len()];
        let index = k / options.kinds.len() as u64;
        let say = |what: &str| {
            let text = format!("--replay {} {kind} {index}: {what}", options.seed);
            *doing.lock().expect("no panic") = (Instant::now(), text);
        };
        let tally = if kind == "files" {
            say("reading");
            suite::files::run(files.path(), options.seed, index, 50)
        } else {
            all.run(kind, options.seed, index, effort, &say)
        };
        for lie in &tally.lies {
            if let (Some(folder), "late" | "panic") = (&options.folder, lie.claim) {
                let _ = std::fs::write(folder.join("latest.txt"), line(lie));
            }
            if let (Some(folder), true) = (&options.folder, KINDS.contains(&lie.kind)) {
                let name = format!(
                    "{}-{}-{}-{}",
                    lie.claim.replace(' ', "-"),
                    lie.kind,
                    lie.seed,
                    lie.index
                );
                if let Err(e) = suite::save(lie.kind, lie.seed, lie.index, &folder.join(name)) {
                    eprintln!("{e}");
                }
            }
        }
        total.lock().expect("no panic").add(tally);
    }
    *doing.lock().expect("no panic") = (Instant::now(), String::new());
}

fn replay(options: &Options, effort: &Effort, seed: u64, kind: &str, index: u64) {
    if let Some(folder) = &options.folder {
        std::fs::create_dir_all(folder).expect("a folder");
        let path = folder.join(format!("{kind}-{seed}-{index}"));
        suite::save(kind, seed, index, &path).expect("a valid problem");
    }
    println!("{}", suite::described(kind, seed, index));
    let tally = All::new().run(kind, seed, index, effort, &|_| {});
    for ((_, solver), statuses) in &tally.counts {
        let seconds =
            tally.seconds.get(&(tally_kind(kind), solver.clone())).copied().unwrap_or(0.0);
        let words: Vec<_> = statuses.keys().copied().collect();
        println!("{solver:40} {:20} {:.3} s", words.join(" "), seconds);
    }
    tally.lies.iter().for_each(|lie| println!("FALSE {}", line(lie)));
}

fn tally_kind(kind: &str) -> &'static str {
    KINDS.into_iter().find(|k| *k == kind).unwrap_or("files")
}

fn line(lie: &Lie) -> String {
    let Lie { kind, seed, index, solver, claim, why, recipe, size } = lie;
    format!("{claim:16} {solver:28} --replay {seed} {kind} {index}  n {size}  {recipe} | {why}")
}

fn report(options: &Options, tally: &Tally, taken: Duration) {
    let mut columns: Vec<_> = tally.counts.values().flat_map(|c| c.keys().copied()).collect();
    columns.sort_unstable();
    columns.dedup();
    let mut kind = "";
    for ((k, solver), statuses) in &tally.counts {
        if *k != kind {
            kind = k;
            println!(
                "\n{kind}\n{:40} {}",
                "",
                columns.iter().map(|c| format!("{c:>17}")).collect::<String>()
            );
        }
        let counts =
            columns.iter().map(|c| format!("{:>17}", statuses.get(c).copied().unwrap_or(0)));
        let seconds = tally.seconds.get(&(*k, solver.clone())).copied().unwrap_or(0.0);
        println!("{solver:40} {} {seconds:8.1} s", counts.collect::<String>());
    }
    println!("\nleft undecided by auto, of those that enumeration decides");
    for ((kind, truth), (asked, left)) in &tally.undecided {
        let share = 100.0 * *left as f64 / (*asked).max(1) as f64;
        println!("{kind:24} {truth:12} {left:8} of {asked:8}  {share:6.2} %");
        let open = tally.open.iter().filter(|o| o.0 == *kind && o.2.starts_with(truth));
        open.take(OPEN_SHOWN).for_each(|(_, index, recipe)| println!("  {index:6}  {recipe}"));
    }
    let mut classes: BTreeMap<_, Vec<&Lie>> = BTreeMap::new();
    for lie in &tally.lies {
        classes.entry((lie.claim, lie.kind)).or_default().push(lie);
    }
    println!("\nfalse claims: {}", tally.lies.len());
    for ((claim, kind), mut lies) in classes {
        lies.sort_by_key(|lie| (lie.size, lie.recipe.len()));
        let mut by_solver: BTreeMap<&str, u64> = BTreeMap::new();
        lies.iter().for_each(|lie| *by_solver.entry(&lie.solver).or_default() += 1);
        let mut by_solver: Vec<_> = by_solver.into_iter().collect();
        by_solver.sort_by_key(|s| std::cmp::Reverse(s.1));
        let names: Vec<_> = by_solver.iter().map(|(name, n)| format!("{name} {n}")).collect();
        println!("\n{claim}, {kind}: {} ({})", lies.len(), names.join(", "));
        // The smallest, each problem once.
        lies.dedup_by_key(|lie| lie.index);
        lies.iter().take(5).for_each(|lie| println!("  {}", line(lie)));
    }
    let seconds = taken.as_secs_f64();
    println!(
        "\n{} problems, {} judged solves in {seconds:.0} s, {:.0} a second",
        tally.problems,
        tally.solves,
        tally.solves as f64 / seconds
    );
    if let Some(path) = &options.out {
        let counts: Vec<_> = tally
            .counts
            .iter()
            .map(|((kind, solver), c)| serde_json::json!({"kind": kind, "solver": solver, "statuses": c}))
            .collect();
        let undecided: Vec<_> = tally
            .undecided
            .iter()
            .map(|((kind, truth), (asked, left))| {
                serde_json::json!({"kind": kind, "truth": truth, "asked": asked, "undecided": left})
            })
            .collect();
        let lies: Vec<_> = tally
            .lies
            .iter()
            .map(|l| {
                serde_json::json!({
                    "claim": l.claim, "kind": l.kind, "solver": l.solver, "seed": l.seed,
                    "index": l.index, "size": l.size, "recipe": l.recipe, "why": l.why,
                })
            })
            .collect();
        let report = serde_json::json!({
            "seed": options.seed, "seconds": seconds, "problems": tally.problems,
            "solves": tally.solves, "counts": counts, "undecided": undecided, "false": lies,
        });
        if let Err(e) = std::fs::write(path, format!("{report:#}\n")) {
            eprintln!("{}: {e}", path.display());
        }
    }
}
