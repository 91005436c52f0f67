//! No command loses a file: what is read is not written over, no output over another, and what has no stream is not taken for a file of the name `-`.

use std::fs;

use crate::common::Folder;

const IMPOSSIBLE: &str = "kind = \"lcp\"\nM = [[0]]\nq = [-1]\n";
const SCENE: &str = r#"
format = "nonsmooth-scene"
version = 1
time = { h = 1e-2, end = 0.1 }

[[bodies]]
shape = { kind = "sphere", radius = 0.2 }
density = 2000
position = [0, 0, 1]
"#;

fn folder() -> Folder {
    let folder = Folder::with_problems();
    fs::write(folder.path("none.toml"), IMPOSSIBLE).unwrap();
    fs::write(folder.path("ball.toml"), SCENE).unwrap();
    folder.run("simulate ball.toml --end 0.05 --out ball.h5").exits(0);
    folder.run("bench run box.hdf5 --solver auto --repeats 0 --out runs.jsonl");
    folder
}

/// The names of the files of a folder, and what is in them.
fn content(folder: &Folder) -> Vec<(String, Option<Vec<u8>>)> {
    let entries = fs::read_dir(folder).unwrap().map(|entry| entry.unwrap().path());
    let mut all: Vec<_> = entries
        .map(|path| (path.file_name().unwrap().to_string_lossy().into(), fs::read(path).ok()))
        .collect();
    all.sort();
    all
}

#[test]
fn what_is_read_or_written_already_is_not_written_over() {
    let folder = folder();
    let before = content(&folder);
    for command in [
        "solve box.hdf5 --out box.hdf5 --format csv",
        "solve box.hdf5 wall.hdf5 --out ./ --format csv",
        "solve none.toml --out none.toml --format mtx",
        "solve none.toml --solver lemke --certificate none.toml",
        "solve none.toml --solver lemke --trace a.json --certificate a.json",
        "solve box.hdf5 --out a.hdf5 --trace ./a.hdf5",
        "exists wall.hdf5 --certificate wall.hdf5",
        "simulate ball.toml --csv ball.toml",
        "simulate ball.toml --html ball.toml",
        "simulate ball.toml --out a.h5 --csv a.h5",
        "simulate ball.toml --resume ball.h5 --csv ball.h5",
        "simulate ball.toml --resume ball.h5 --out a.h5 --html ball.h5",
        "play ball.h5 --html ball.h5",
        "play ball.h5 --html a.html --glb a.html",
        "convert box.hdf5 box.hdf5",
        "gen stack --out a.svg --draw a.svg",
        "bench report runs.jsonl --out runs.jsonl",
        "bench page runs.jsonl --out runs.jsonl",
        "bench merge runs.jsonl --out runs.jsonl",
    ] {
        let run = folder.run(command);
        let said = &run.stderr;
        assert_eq!(run.code, Some(2), "{command}: {}{said}", run.stdout);
        let own = said.contains("a file of its own") || said.contains("of the file that is read");
        assert!(own, "{command}: {said}");
        assert!(content(&folder) == before, "{command}");
    }
    // A scene is no trajectory, whatever is asked.
    folder.run("simulate ball.toml --out ball.toml").refused(&["ends in .h5 or .hdf5"]);
    assert!(content(&folder) == before);
    // Nor is a table a page, and a trajectory of another run stays what it is.
    for (command, expected) in [
        (
            "simulate ball.toml --csv ball.h5",
            "--csv ball.h5: expected a file name that ends in .csv",
        ),
        (
            "simulate ball.toml --html run.csv",
            "--html run.csv: expected a file name that ends in .html or .htm",
        ),
        (
            "simulate ball.toml --vtk run.vtu",
            "--vtk run.vtu: expected a file name that ends in .pvd",
        ),
        ("play ball.h5 --html run.csv", "ends in .html"),
        (
            "bench report runs.jsonl --out others.jsonl",
            "--out others.jsonl: expected a file name that ends in .html",
        ),
        (
            "bench page runs.jsonl --out others.jsonl",
            "--out others.jsonl: expected a file name that ends in .md",
        ),
        ("play ball.h5 --glb run.gltf", "--glb run.gltf: expected a file name that ends in .glb"),
        (
            "solve none.toml --solver lemke --trace ball.h5",
            "--trace ball.h5: expected a file name that ends in .json",
        ),
        (
            "solve none.toml --solver lemke --certificate ball.h5",
            "--certificate ball.h5: expected a file name that ends in .json",
        ),
        (
            "exists wall.hdf5 --certificate ball.h5",
            "--certificate ball.h5: expected a file name that ends in .json",
        ),
        (
            "bench merge runs.jsonl --out ball.h5",
            "--out ball.h5: expected a file name that ends in .jsonl",
        ),
    ] {
        folder.run(command).refused(&[expected]);
        assert!(content(&folder) == before, "{command}");
    }
}

#[cfg(unix)]
#[test]
fn a_link_to_the_input_is_the_input() {
    let folder = folder();
    let before = content(&folder);
    std::os::unix::fs::symlink("box.hdf5", folder.path("table.csv")).unwrap();
    folder.run("solve box.hdf5 --out table.csv").refused(&["table.csv", "FCLIB", "another file"]);
    fs::remove_file(folder.path("table.csv")).unwrap();
    assert!(content(&folder) == before);
}

#[test]
fn a_problem_is_written_back_with_its_solution_and_a_trajectory_goes_on() {
    let folder = folder();
    folder.run("solve wall.hdf5 --out wall.hdf5").exits(0);
    folder.run("check wall.hdf5").exits(0);
    folder.run("simulate ball.toml --resume ball.h5").exits(0);
    folder.run("simulate ball.toml --resume ball.h5 --out ball.h5 --end 0.2").exits(0);
}

#[test]
fn what_has_no_stream_refuses_its_name() {
    let folder = folder();
    let before = content(&folder);
    for command in [
        "solve none.toml --solver lemke --certificate -",
        "solve none.toml --solver lemke --trace -",
        "solve box.hdf5 --plot -",
        "exists wall.hdf5 --certificate -",
        "simulate ball.toml --out -",
        "simulate ball.toml --csv -",
        "simulate ball.toml --html -",
        "simulate ball.toml --svg -",
        "simulate ball.toml --vtk -",
        "simulate ball.toml --dump-fclib -",
        "play ball.h5 --html -",
        "bench run box.hdf5 --out -",
        "bench report runs.jsonl --out -",
        "bench merge runs.jsonl --out -",
        "bench figures runs.jsonl --out -",
    ] {
        let run = folder.run(command);
        assert_eq!(run.code, Some(2), "{command}: {}{}", run.stdout, run.stderr);
        assert!(run.stderr.contains(" -: expected "), "{command}: {}", run.stderr);
        assert!(content(&folder) == before, "{command}");
    }
}

#[test]
fn figures_of_what_no_run_has_are_refused() {
    let folder = folder();
    for (option, there) in [
        ("--solver nosuch", "auto"),
        ("--solver auto --solver nosuch", "auto"),
        ("--kind nosuch", "friction_local_3d"),
        ("--family nosuch", "nosuch"),
    ] {
        let command = format!("bench figures runs.jsonl --out figures {option}");
        folder.run(&command).refused(&["expected one that the runs have", there, "found nosuch"]);
    }
    assert!(!folder.path("figures").exists());
}
