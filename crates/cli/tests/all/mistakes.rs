//! The caller's mistakes: exit code 2 and one line that names the place, what was expected and what was found.

use std::fs;

use crate::common::Folder;

#[test]
fn bad_files() {
    let folder = Folder::with_problems();
    let good = fs::read(folder.path("wall.hdf5")).unwrap();
    fs::write(folder.path("text.hdf5"), "not a problem").unwrap();
    fs::write(folder.path("empty.hdf5"), "").unwrap();
    fs::write(folder.path("short.hdf5"), &good[..good.len() / 2]).unwrap();
    fs::create_dir(folder.path("folder")).unwrap();
    for command in ["solve", "check", "info"] {
        for file in ["missing.hdf5", "text.hdf5", "empty.hdf5", "short.hdf5", "folder"] {
            folder.run(&format!("{command} {file}")).refused(&[file, "expected", "found"]);
        }
    }
}

#[test]
fn nan_in_the_data() {
    let folder = Folder::new();
    let mu: f64 = 0.123456789;
    folder.run(&format!("gen sliding_box --set mu={mu} --out nan.hdf5")).exits(0);
    let mut bytes = fs::read(folder.path("nan.hdf5")).unwrap();
    let at = bytes.windows(8).position(|b| b == mu.to_le_bytes()).unwrap();
    bytes[at..at + 8].copy_from_slice(&f64::NAN.to_le_bytes());
    fs::write(folder.path("nan.hdf5"), bytes).unwrap();
    folder.run("solve nan.hdf5").refused(&["nan.hdf5", "mu[0]", "expected", "NaN"]);
}

#[test]
fn bad_options_of_solve() {
    let folder = Folder::with_problems();
    let cases: &[(&str, &[&str])] = &[
        ("wall.hdf5 --solver magic", &["wall.hdf5", "magic", "nsgs"]),
        (
            "box.hdf5 --solver condense/nsgs",
            &["box.hdf5", "solver `condense/nsgs` takes global problems only", "friction_local_3d"],
        ),
        ("wall.hdf5 --max-iter 1.5", &["--max-iter", "1.5", "whole number"]),
        ("wall.hdf5 --max-iter -1", &["--max-iter", "-1", "whole number"]),
        ("wall.hdf5 --plot a.png", &["--plot", "a.png", ".svg"]),
        ("wall.hdf5 --solver nsgs --set omga=1", &["omga", "omega"]),
        ("wall.hdf5 --solver nsgs --set omega=3", &["omega", "(0, 2)", "3"]),
        ("wall.hdf5 --solver nsgs --set local=7", &["local", "exact"]),
        ("wall.hdf5 --set omega=1", &["solver `auto`", "omega", "interior"]),
        ("wall.hdf5 --set omega", &["--set", "key=value"]),
        ("wall.hdf5 --solver nsgs:omega", &["nsgs:omega", "key=value"]),
        ("wall.hdf5 --solver nsgs:omega=3", &["solver `nsgs`", "omega", "(0, 2)", "3"]),
        (
            "wall.hdf5 --solver nsgs:omega=1 --set omega=1",
            &["`omega` is set by --solver nsgs:omega=1 too"],
        ),
        ("wall.hdf5 --set seed=1 --set seed=2", &["seed", "twice"]),
        ("wall.hdf5 --tol -1e-8", &["--tol", "positive", "-1e-8"]),
        ("wall.hdf5 --tol 0", &["--tol", "positive"]),
        ("wall.hdf5 --tol NaN", &["--tol", "NaN"]),
        ("wall.hdf5 --tol inf", &["--tol", "inf"]),
        ("wall.hdf5 --tol 1.5", &["--tol", "at most 1", "1.5"]),
        ("wall.hdf5 --time-limit -1", &["--time-limit", "at least 0", "-1"]),
        ("wall.hdf5 --time-limit nan", &["--time-limit", "NaN"]),
        ("wall.hdf5 --solver tresca --set anderson=99999999999", &["anderson", "at most 50"]),
        ("wall.hdf5 --solver cadoux --set memory=99999999999", &["memory", "at most 50"]),
        ("wall.hdf5 --solver proximal/magic", &["wall.hdf5", "proximal/magic", "proximal/nsgs"]),
        ("wall.hdf5 --solver proximal/nsgs --set prox_magic=1", &["prox_magic"]),
        ("wall.hdf5 --warm-start", &["wall.hdf5", "/guesses/1", "none", "--warm-start=FILE"]),
        (
            "--warm-start box.hdf5 wall.hdf5",
            &["--warm-start box.hdf5", "did you mean --warm-start=box.hdf5?"],
        ),
        ("wall.hdf5 --warm-start=nowhere.hdf5", &["--warm-start", "nowhere.hdf5"]),
        (
            "wall.hdf5 --warm-start=wall.hdf5",
            &["--warm-start", "/solution or /guesses/1", "neither"],
        ),
        (
            "wall.hdf5 --warm-start=box.hdf5",
            &["--warm-start box.hdf5", "contacts in 3D", "found 4"],
        ),
        ("wall.hdf5 box.hdf5 --out both.hdf5", &["--out", "both.hdf5", "directory"]),
        ("wall.hdf5 box.hdf5 --plot both.svg", &["--plot", "both.svg", "directory"]),
        ("wall.hdf5 ./wall.hdf5 --out out/", &["--out", "wall.hdf5", "two"]),
        ("wall.hdf5 --out nowhere/a.hdf5", &["--out", "nowhere/a.hdf5"]),
        ("wall.hdf5 --plot nowhere/a.svg", &["--plot", "nowhere/a.svg"]),
        ("wall.hdf5 --plot wall.hdf5", &["--plot", "wall.hdf5"]),
        ("wall.hdf5 --out box.hdf5/", &["--out", "box.hdf5"]),
        #[cfg(unix)]
        ("wall.hdf5 --out /dev/null", &["--out", "/dev/null", "device"]),
    ];
    let before = fs::read(folder.path("wall.hdf5")).unwrap();
    for (arguments, parts) in cases {
        let run = folder.run(&format!("solve {arguments}")).refused(parts);
        assert_eq!(run.stdout, "", "{arguments}");
    }
    assert!(before == fs::read(folder.path("wall.hdf5")).unwrap());
}

#[test]
fn bad_options_of_the_other_commands() {
    let folder = Folder::with_problems();
    let cases: &[(&str, &[&str])] = &[
        ("check wall.hdf5", &["wall.hdf5", "/solution", "none"]),
        ("check box.hdf5 --tol -1", &["--tol", "-1"]),
        ("list magic", &["magic", "nsgs"]),
        ("gen magic --out a.hdf5", &["magic", "wall"]),
        ("gen wall", &["--out", "--draw"]),
        ("gen wall --set bricks=3 --out a.hdf5", &["bricks", "rows"]),
        ("gen wall --set rows=0 --out a.hdf5", &["rows", "0"]),
        ("gen wall --set rows=many --out a.hdf5", &["rows", "many"]),
        ("gen wall --set mu=-1 --out a.hdf5", &["mu", "-1"]),
        ("gen wall --set rows --out a.hdf5", &["--set", "key=value"]),
        ("gen wall --out nowhere/a.hdf5", &["--out", "nowhere/a.hdf5"]),
        ("gen wall --draw nowhere/a.svg", &["--draw", "nowhere/a.svg"]),
        ("gen wall --out a.svg --draw a.svg", &["--draw", "a.svg", "its own"]),
        ("gen wall --draw a.png", &["--draw", "a.png", ".svg"]),
        ("gen wall --solve --out a.hdf5 --tol 0", &["--tol", "positive"]),
        ("gen wall --solve --out a.hdf5 --time-limit -1", &["--time-limit", "at least 0"]),
        ("gen wall --out a.hdf5 --time-limit 1", &["--solve"]),
        ("gen --suite none.toml --out all", &["--suite none.toml", "expected a TOML file"]),
        ("gen --suite none.toml", &["--out"]),
        ("gen wall --suite none.toml --out all", &["--suite"]),
    ];
    for (arguments, parts) in cases {
        folder.run(arguments).refused(parts);
    }
    assert!(!folder.path("a.hdf5").exists());
    for unknown in ["", "sulve", "solve", "solve wall.hdf5 --tol x", "list --json --markdown"] {
        assert_eq!(folder.run(unknown).code, Some(2), "{unknown}");
    }
}

#[test]
fn suites_name_the_entry_at_fault() {
    let folder = Folder::new();
    let wall = "[[problem]]\nfamily = \"wall\"\n";
    let cases: &[(&str, &[&str])] = &[
        ("", &["line 1", "problem"]),
        ("[[problem]]\nfamily = \"wall\n", &["line 2"]),
        ("[[problem]]\nfamily = \"tower\"\n", &["problem 1", "tower", "wall"]),
        ("[[problem]]\nname = \"a\"\n", &["line 1", "family"]),
        (&format!("{wall}{wall}colour = 3\n"), &["line 5", "colour", "settings"]),
        (&format!("{wall}{wall}form = \"both\"\n"), &["problem 2", "form", "both"]),
        (&format!("{wall}name = \"a/b\"\n"), &["problem 1", "name", "a/b"]),
        (&format!("{wall}form = []\n"), &["problem 1", "form", "[]"]),
        (&format!("{wall}settings = {{ rows = [] }}\n"), &["problem 1", "rows", "[]"]),
        (
            &format!("{wall}settings = {{ rows = [2, 0] }}\n"),
            &["wall/wall-rows0", "rows", "found 0"],
        ),
        (&format!("{wall}settings = {{ row = 2 }}\n"), &["wall/wall-row2", "`row`", "rows"]),
        (&format!("{wall}{wall}"), &["wall/wall", "twice"]),
    ];
    for (text, parts) in cases {
        fs::write(folder.path("suite.toml"), text).unwrap();
        let parts = [&["--suite suite.toml"], *parts].concat();
        folder.run("gen --suite suite.toml --out all").refused(&parts);
    }
    fs::write(folder.path("suite.toml"), wall).unwrap();
    folder.run("gen --suite suite.toml --out suite.toml").refused(&["--out", "suite.toml"]);
}

#[test]
fn one_bad_file_does_not_not_keep_the_others_from_running() {
    let folder = Folder::with_problems();
    let run =
        folder.run("solve missing.hdf5 wall.hdf5 --max-iter 1 --json").refused(&["missing.hdf5"]);
    let lines = run.json();
    assert_eq!(
        (&lines[0]["file"], &lines[1]["status"]),
        (&"missing.hdf5".into(), &"iteration_limit".into())
    );
    let error = lines[0]["error"].as_str().unwrap();
    assert!(run.stderr.contains(error) && error.contains("missing.hdf5"));
    let run = folder.run("solve box.hdf5 wall.hdf5 --solver condense/nsgs").refused(&["box.hdf5"]);
    assert!(run.stdout.starts_with("wall.hdf5: solved"));
    let run = folder.run("info missing.hdf5 wall.hdf5").refused(&["missing.hdf5"]);
    assert!(run.stdout.starts_with("wall.hdf5: "));
}

/// A slip of a solver's, a setting's or a file's name is recognised.
#[test]
fn slips_are_answered_by_what_was_meant() {
    let folder = Folder::with_problems();
    for (command, meant) in [
        ("solve box.hdf5 --solver nsg", "did you mean `nsgs`?"),
        ("solve box.hdf5 --solver NSGS", "did you mean `nsgs`?"),
        ("solve box.hdf5 --solver newton-ac", "did you mean `newton_ac`?"),
        ("solve box.hdf5 --solver proximal/nsg", "did you mean `proximal/nsgs`?"),
        ("solve box.hdf5 --solver nsgs --set omgea=0.9", "did you mean `omega`?"),
        ("solve bocks.hdf5", "did you mean `box.hdf5`?"),
        ("solve box.hdf --solver nsgs", "did you mean `box.hdf5`?"),
    ] {
        let said = folder.run(command).exits(2).stderr;
        assert!(said.contains(meant), "{command}: {said}");
    }
}

/// Where a method does not apply, what is suggested has solved the problem.
#[test]
fn suggestions_in_place_of_a_refused_solver_solve_the_problem() {
    let folder = Folder::with_problems();
    folder.run("gen box_lcp --set n=12 --out box.toml").exits(0);
    folder.run("gen lcp --set class=kkt --set n=12 --out kkt.toml").exits(0);
    for command in ["solve box.toml --solver lemke", "solve kkt.toml --solver psor"] {
        let said = folder.run(command).exits(2).stderr;
        let (_, tried) = said.split_once("on trial it was solved by ").expect(&said);
        let file = command.split(' ').nth(1).unwrap();
        let names: Vec<_> = tried.split("--solver ").skip(1).collect();
        assert!(!names.is_empty(), "{said}");
        for name in names {
            let name = name.trim().trim_end_matches(',');
            folder.run(&format!("solve {file} --solver {name} --quiet")).exits(0);
        }
    }
}
