//! Pipes and signals.
#![cfg(unix)]

use std::fs::File;
use std::process::{Command, Stdio};
use std::time::Duration;

use crate::common::{Folder, Run};

#[test]
fn a_reader_that_goes_away_is_no_catastrophe() {
    let folder = Folder::with_problems();
    let program = env!("CARGO_BIN_EXE_nonsmooth");
    for command in ["list", "list --markdown", "gen", "--help", "info wall.hdf5 wall.hdf5 --json"] {
        let script = format!("(sleep 0.1; {program} {command}) | true");
        let run: Run =
            Command::new("sh").args(["-c", &script]).current_dir(&folder).output().unwrap().into();
        assert_eq!(run.stderr, "", "{command}");
    }
}

#[test]
fn what_goes_to_files_needs_no_reader() {
    let folder = Folder::with_problems();
    let program = env!("CARGO_BIN_EXE_nonsmooth");
    for (command, written) in [
        ("solve wall.hdf5 box.hdf5 --out solved/", vec!["solved/wall.hdf5", "solved/box.hdf5"]),
        ("bench run wall.hdf5 --solver nsgs --repeats 0 --out runs.jsonl", vec!["runs.jsonl"]),
    ] {
        let script = format!("{program} {command} | true");
        let run = Command::new("sh").args(["-c", &script]).current_dir(&folder).output();
        assert_eq!(Run::from(run.unwrap()).stderr, "", "{command}");
        assert!(written.iter().all(|name| folder.path(name).exists()), "{command}");
    }
    let runs = std::fs::read_to_string(folder.path("runs.jsonl")).unwrap();
    assert!(runs.contains("\"ending\":\"solved\""), "{runs}");
}

#[test]
#[cfg(target_os = "linux")]
fn a_full_disk_is_reported() {
    let folder = Folder::new();
    let full = File::options().write(true).open("/dev/full").unwrap();
    for word in ["list", "--help", "--version"] {
        let full = full.try_clone().unwrap();
        let output = folder.command().arg(word).stdout(full).output().unwrap();
        Run::from(output).refused(&["standard output"]);
    }
}

#[test]
fn ctrl_c_returns_the_best_iterate() {
    let folder = Folder::with_problems();
    folder.run("gen wall --set rows=25 --set columns=12 --out hard.hdf5").exits(0);
    // Sweeps approach the solution of a wall slowly and never see that they cannot come as near as this.
    let solve = "solve hard.hdf5 wall.hdf5 --solver nsgs --tol 1e-15 --max-iter 1000000000 --json --out best/";
    let child = folder
        .command()
        .args(solve.split(' '))
        .stdout(Stdio::piped())
        .stderr(Stdio::piped())
        .spawn()
        .unwrap();
    // Long enough to have read the file and begun.
    std::thread::sleep(Duration::from_millis(1500));
    let pid = child.id().to_string();
    assert!(Command::new("kill").args(["-INT", &pid]).status().unwrap().success());
    let run = Run::from(child.wait_with_output().unwrap()).exits(1);

    // The second file is skipped.
    let lines = run.json();
    assert_eq!((lines.len(), &lines[0]["status"]), (1, &"cancelled".into()));
    assert!(lines[0]["iterations"].as_u64() > Some(0));
    let relative = lines[0]["residual"]["relative"].as_f64().unwrap();
    assert!(relative < 0.5, "{relative}");
    let checked = folder.run("check best/hard.hdf5 --tol 0.5 --json").exits(0).json();
    assert_eq!(checked[0]["residual"], lines[0]["residual"]);
    assert!(!folder.path("best/wall.hdf5").exists());
}

/// The limit holds while a file is read, also one that nobody ends.
#[test]
fn a_pipe_that_nobody_writes_to_does_not_outlast_the_limit() {
    let folder = Folder::with_problems();
    let made = Command::new("mkfifo").arg(folder.path("pipe.toml")).status().unwrap();
    assert!(made.success());
    for file in ["-", "pipe.toml", "wall.hdf5 --warm-start=pipe.toml"] {
        let mut command = folder.command();
        command.args(["solve", "--time-limit", "0.2", "--json"]).args(file.split(' '));
        command.stdin(Stdio::piped());
        let mut child = command.stdout(Stdio::piped()).stderr(Stdio::piped()).spawn().unwrap();
        // It stays open until the end.
        let input = child.stdin.take();
        let run = Run::from(child.wait_with_output().unwrap()).exits(1);
        drop(input);
        let line = run.json().remove(0);
        assert_eq!(line["status"], "time_limit", "{file}: {line}");
    }
}
