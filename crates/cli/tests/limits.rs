//! Limits of time and memory on the command line: the whole process ends soon after them.
//!
//! On a machine that does other work besides, `NONSMOOTH_SLACK` allows the processes so many times as long.

mod common;

use std::process::Stdio;
use std::sync::{Mutex, PoisonError};
use std::time::{Duration, Instant};

use common::Folder;

/// Times are those of the wall: one test at a time.
static ALONE: Mutex<()> = Mutex::new(());

fn slack() -> f64 {
    std::env::var("NONSMOOTH_SLACK").ok().and_then(|s| s.parse().ok()).unwrap_or(1.0)
}

fn pile() -> Folder {
    let folder = Folder::new();
    folder.run("gen sphere_pile --set count=1500 --out pile.hdf5").exits(0);
    folder
}

#[test]
fn commands_end_soon_after_their_time_limit() {
    let _alone = ALONE.lock().unwrap_or_else(PoisonError::into_inner);
    let folder = pile();
    for command in [
        "solve pile.hdf5 --tol 1e-15 --solver tresca",
        "solve pile.hdf5 --tol 1e-15 --solver condense/ip --out solved.hdf5",
        "solve pile.hdf5 --tol 1e-15 --json",
        "exists pile.hdf5",
        "diagnose pile.hdf5 --spectrum-limit 100000",
        "info pile.hdf5 --spectrum --existence --spectrum-limit 100000",
    ] {
        let limit = 0.5;
        let begun = Instant::now();
        folder.run(&format!("{command} --time-limit {limit}"));
        let wall = begun.elapsed().as_secs_f64();
        assert!(wall <= slack() * (1.1 * limit + 0.2), "{command}: {wall:.2} s");
    }
}

#[cfg(unix)]
#[test]
fn one_ctrl_c_ends_a_solve_with_its_best_point() {
    let _alone = ALONE.lock().unwrap_or_else(PoisonError::into_inner);
    let folder = pile();
    folder
        .run("gen wall --set rows=25 --set columns=20 --set disturbance=0.3 --form local --out wall.hdf5")
        .exits(0);
    for command in [
        "solve pile.hdf5 --tol 1e-15 --solver tresca",
        "exists pile.hdf5",
        "exists wall.hdf5",
        "diagnose wall.hdf5",
    ] {
        let mut process = folder.command();
        process.args(command.split_whitespace()).stdout(Stdio::piped()).stderr(Stdio::piped());
        let process = process.spawn().unwrap();
        std::thread::sleep(Duration::from_millis(400));
        let interrupt = ["-INT".to_owned(), process.id().to_string()];
        assert!(std::process::Command::new("kill").args(interrupt).status().unwrap().success());
        let begun = Instant::now();
        let output = process.wait_with_output().unwrap();
        let wall = begun.elapsed().as_secs_f64();
        assert!(wall <= slack() * 0.2, "{command}: {wall:.2} s");
        let said = String::from_utf8(output.stdout).unwrap();
        // What was done before is done.
        let decided = said.contains("proved") || said.contains("solved:");
        assert!(decided || said.contains("cancelled"), "{command}: {said}");
        assert!(!said.contains("time limit"), "{command}: {said}");
    }
}

#[test]
fn threads_change_no_bit_of_an_answer() {
    let folder = Folder::new();
    // A factorisation of it is large enough to be shared.
    folder.run("gen sphere_pile --set count=600 --out p.hdf5").exits(0);
    let solved = |threads: usize| {
        let command = format!("solve p.hdf5 --solver ip --threads {threads} --solution --json");
        let report = folder.run(&command).json().remove(0);
        assert_eq!(report["status"], "solved");
        (report["iterations"].clone(), report["solution"].clone())
    };
    let alone = solved(1);
    assert!(alone.1.is_object());
    assert_eq!(solved(2), alone);
    assert_eq!(solved(0), alone);
    folder.run("solve p.hdf5 --threads 5000").refused(&["threads", "1024", "5000"]);
}

#[test]
fn memory_limits_are_sizes_and_name_what_they_refuse() {
    let folder = Folder::new();
    folder.run("gen lcp --set n=60 --out p.toml").exits(0);
    for size in ["5X", "many", "0", "-1G"] {
        let command = format!("solve p.toml --memory-limit={size}");
        folder.run(&command).refused(&["--memory-limit", "500M"]);
    }
    folder.run("solve p.toml --solver criss_cross --memory-limit 10k").refused(&[
        "p.toml",
        "the dense tableau would take about 56 KB of memory",
        "10 KB",
    ]);
    folder.run("solve p.toml --solver criss_cross --memory-limit 1M").exits(0);
}
