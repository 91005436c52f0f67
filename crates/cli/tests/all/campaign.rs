//! `nonsmooth bench` as a user meets it: campaigns that are killed and go on, parts, mistakes.

use std::collections::BTreeMap;
use std::path::Path;
use std::process::{Child, Stdio};
use std::time::{Duration, Instant};

use crate::common::Folder;
use nonsmooth_io::ProblemFile;
use nonsmooth_problem::planted::Planted;
use serde_json::Value;

/// `count` small problems in four families below `problems/`.
fn problems(folder: &Folder, count: u64) {
    for seed in 0..count {
        let family =
            folder.path("problems").join(["arch", "pile", "stack", "wall"][seed as usize % 4]);
        std::fs::create_dir_all(&family).unwrap();
        let planted = Planted { contacts: 2, dofs: 12, seed, ..Planted::default() };
        let (problem, _) = planted.local::<3>();
        ProblemFile::new(problem).write(family.join(format!("p{seed}.hdf5"))).unwrap();
    }
}

/// The lines of a file of runs that are whole.
fn lines(file: &Path) -> Vec<Value> {
    let text = std::fs::read_to_string(file).unwrap_or_default();
    let whole = text.rfind('\n').map_or("", |end| &text[..end]);
    whole.lines().map(|line| serde_json::from_str(line).unwrap()).collect()
}

/// How often each run stands in a file.
fn runs(file: &Path) -> BTreeMap<String, usize> {
    let mut all = BTreeMap::new();
    for line in lines(file).iter().filter(|l| l["line"] == "run") {
        let key = format!("{} {} {}", line["problem"], line["solver"], line["tolerance"]);
        *all.entry(key).or_default() += 1;
    }
    all
}

#[cfg(target_os = "linux")]
fn workers_of(folder: &Folder) -> usize {
    let here = folder.as_ref().canonicalize().unwrap();
    let works_here = |pid: &Path| {
        let command = std::fs::read_to_string(pid.join("cmdline")).unwrap_or_default();
        command.contains("bench\0worker")
            && std::fs::read_link(pid.join("cwd")).is_ok_and(|d| d == here)
    };
    let all = std::fs::read_dir("/proc").unwrap();
    all.filter(|e| e.as_ref().is_ok_and(|e| works_here(&e.path()))).count()
}

fn wait_for(what: &str, seconds: u64, mut happened: impl FnMut() -> bool) {
    let start = Instant::now();
    while !happened() {
        assert!(start.elapsed() < Duration::from_secs(seconds), "waited in vain for {what}");
        std::thread::sleep(Duration::from_millis(20));
    }
}

#[test]
fn a_campaign_of_10_solvers_200_problems_and_2_tolerances_survives_kill_9() {
    let folder = Folder::new();
    problems(&folder, 200);
    let solvers = [
        "nsgs",
        "nsgs:omega=0.9",
        "nsgs:omega=0.8",
        "nsgs:local=quartic",
        "nsgs:local=newton_ac",
        "nsgs:local=newton_jm",
        "nsgs:local=projection_iterated",
        "de_saxce",
        "fixed_point",
        "extragradient",
    ];
    let solvers: String = solvers.iter().map(|s| format!(" --solver {s}")).collect();
    let options = format!("{solvers} --tol 1e-3 --tol 1e-5 --repeats 0 --time-limit 2 --jobs 2");
    let start = |more: &str| -> Child {
        let all = format!("bench run problems --out runs.jsonl{options}{more}");
        let mut command = folder.command();
        command.args(all.split_whitespace()).stdout(Stdio::null()).stderr(Stdio::null());
        command.spawn().unwrap()
    };
    let file = folder.path("runs.jsonl");
    let mut first = start("");
    wait_for("half of the runs", 300, || runs(&file).len() >= 2000);
    // SIGKILL on Unix.
    first.kill().unwrap();
    first.wait().unwrap();
    #[cfg(target_os = "linux")]
    wait_for("the workers to go", 30, || workers_of(&folder) == 0);
    let before = runs(&file);
    assert!((2000..4000).contains(&before.len()), "{}", before.len());
    assert!(start(" --resume").wait().unwrap().success());
    let after = runs(&file);
    assert_eq!(after.len(), 4000);
    assert!(after.values().all(|&times| times == 1), "a run was made twice");
    assert!(before.keys().all(|key| after.contains_key(key)));
    let again = folder.run(&format!("bench run problems --out runs.jsonl{options} --resume"));
    assert!(again.stdout.contains("4000 of 4000 runs done (0 new)"), "{}", again.stdout);
}

#[test]
fn parts_are_joined_and_reported() {
    let folder = Folder::new();
    problems(&folder, 5);
    for part in 1..=3 {
        folder
            .run(&format!("bench run problems --solver nsgs --out {part}.jsonl --shard {part}/3"))
            .exits(0);
    }
    let two = folder.run("bench merge 1.jsonl 3.jsonl --out two.jsonl");
    assert_eq!(two.code, Some(1));
    assert!(two.stdout.contains("missing parts 2/3"), "{}", two.stdout);
    let all = folder.run("bench merge 1.jsonl 2.jsonl 3.jsonl --out all.jsonl").exits(0);
    assert!(all.stdout.contains("3 campaigns, 10 runs of 5 problems"), "{}", all.stdout);
    assert_eq!(runs(&folder.path("all.jsonl")).len(), 10);
    // What is torn or was not run is said wherever the runs are used.
    let text = std::fs::read_to_string(folder.path("2.jsonl")).unwrap();
    let last = text.trim_end().rfind('\n').unwrap();
    std::fs::write(folder.path("cut.jsonl"), &text[..last + 40]).unwrap();
    let merged = folder.run("bench merge 1.jsonl cut.jsonl 3.jsonl --out cut-all.jsonl").exits(1);
    let outputs =
        ["report cut.jsonl --out r.html", "figures cut.jsonl --out f", "page cut.jsonl --out p.md"];
    let outputs = outputs.map(|made| folder.run(&format!("bench {made}")).exits(0));
    for run in outputs.iter().chain([&merged]) {
        let said = [
            "  but        cut.jsonl: the last line is torn",
            "cut.jsonl: missing 1 of 4 runs of the plan",
        ];
        assert!(said.iter().all(|said| run.stdout.contains(said)), "{}", run.stdout);
    }
    assert!(outputs[0].stdout.contains("missing parts 1/3, 3/3"), "{}", outputs[0].stdout);
    let compared = folder.run("bench compare 2.jsonl cut.jsonl --outcomes").exits(0);
    let said = "warning: the new campaign: the last line is torn";
    assert!(compared.stdout.contains(said), "{}", compared.stdout);
    // Neither is a campaign that is there lost.
    let before = std::fs::read(folder.path("2.jsonl")).unwrap();
    folder
        .run("bench merge 1.jsonl 3.jsonl --out 2.jsonl")
        .refused(&["2.jsonl: expected a new file, found"]);
    assert!(std::fs::read(folder.path("2.jsonl")).unwrap() == before);
    std::fs::write(folder.path("empty.jsonl"), "").unwrap();
    folder.run("bench merge 1.jsonl 2.jsonl 3.jsonl --out empty.jsonl").exits(0);
    let own = folder.run("bench merge 1.jsonl --out 1.jsonl");
    assert_eq!(own.code, Some(2));
    assert!(own.stderr.contains("expected a file of its own"), "{}", own.stderr);
}

/// Times of an even number of solves, of a proof, and of one solver under several spellings.
#[test]
fn answers_are_repeated_and_counted_under_one_label() {
    let folder = Folder::new();
    std::fs::write(folder.path("no.toml"), "kind = \"lcp\"\nq = [-1]\nM = [[-1]]\n").unwrap();
    folder.run("gen wall --set rows=6 --set columns=5 --out wall.hdf5").exits(0);
    let options = "--repeats 2 --repeat-below 100 --time-limit 100 --out r.jsonl";
    folder.run(&format!("bench run no.toml --solver lemke --tol 1e-8 {options}")).exits(0);
    let proof = lines(&folder.path("r.jsonl")).pop().unwrap();
    assert_eq!(proof["ending"], "infeasible");
    assert!(proof["repeats"].as_u64() >= Some(2), "{proof}");
    std::fs::remove_file(folder.path("r.jsonl")).unwrap();
    let labels = "--solver condense/nsgs:omega=0.9 --solver condense/nsgs:omega=0.90";
    folder.run(&format!("bench run wall.hdf5 {labels} --tol 1e-4 {options}")).exits(0);
    let all = runs(&folder.path("r.jsonl"));
    assert_eq!(all.len(), 1, "{all:?}");
    let run = lines(&folder.path("r.jsonl")).pop().unwrap();
    let [seconds, median, most] =
        ["seconds", "seconds_median", "seconds_max"].map(|key| run[key].as_f64().unwrap());
    if run["repeats"] == 2 {
        assert_eq!(median, 0.5 * (seconds + most), "{run}");
    }
}

#[test]
fn mistakes_are_named_and_the_rest_goes_on() {
    let folder = Folder::new();
    problems(&folder, 2);
    std::fs::create_dir(folder.path("empty")).unwrap();
    std::fs::write(folder.path("problems/arch/broken.hdf5"), "rubbish").unwrap();
    let run = folder.run(
        "bench run problems empty nowhere --solver nsgs --solver magic --solver nsgs:omega=7 --tol 1e-3 --out r.jsonl",
    );
    assert_eq!(run.code, Some(2));
    let errors: Vec<_> = run.stderr.lines().collect();
    assert_eq!(errors.len(), 5, "{}", run.stderr);
    assert!(errors[0].starts_with("error: --solver magic: unknown solver `magic`"));
    assert!(errors[1].contains("nsgs:omega=7: solver `nsgs`: omega: expected a number in (0, 2)"));
    assert_eq!(
        errors[2],
        "error: empty: expected problems (*.hdf5, *.toml, *.mtx, *.nl, *.dat), found none"
    );
    assert!(errors[3].starts_with("error: nowhere: "));
    assert!(errors[4].contains("broken.hdf5"));
    assert!(run.stdout.contains("r.jsonl: 2 of 2 runs done (2 new)"), "{}", run.stdout);
    assert!(run.stdout.contains("unusable   1 problem"), "{}", run.stdout);

    let refused = |arguments: &str, message: &str| {
        let run = folder.run(arguments);
        assert_eq!(run.code, Some(2), "{arguments}");
        assert!(run.stderr.contains(message), "{arguments}: {}", run.stderr);
    };
    refused("bench run empty --out e.jsonl", "expected problems, found none");
    refused("bench run problems --solver magic --out e.jsonl", "expected a solver that exists");
    refused("bench run problems --solver nsgs --out r.jsonl", "--resume goes on with it");
    refused("bench run problems --tol 0 --out e.jsonl", "--tol: expected a positive number");
    refused(
        "bench run problems --time-limit -1 --out e.jsonl",
        "--time-limit: expected a positive",
    );
    refused("bench run problems --jobs 0 --out e.jsonl", "--jobs: expected from 1 to 1024");
    refused("bench run problems --jobs 2000 --out e.jsonl", "found 2000");
    #[cfg(unix)]
    refused("bench run problems --out /dev/full", "/dev/full: expected a file, found a directory,");
    refused("bench run problems --shard 4/3 --out e.jsonl", "expected I/N with I from 1 to N");
    refused("bench run problems --memory-limit 3X --out e.jsonl", "expected a size such as");
    refused("bench run problems --out nowhere/r.jsonl", "nowhere/r.jsonl: No such file");
    let newer = std::fs::read_to_string(folder.path("r.jsonl")).unwrap();
    let newer = newer.replacen("\"version\":1", "\"version\":7", 1);
    std::fs::write(folder.path("newer.jsonl"), newer).unwrap();
    let merged = folder.run("bench merge newer.jsonl r.jsonl --out all.jsonl");
    assert_eq!(merged.code, Some(2));
    let message = "newer.jsonl: expected version 1 of nonsmooth-runs, found version 7";
    assert!(merged.stderr.contains(message), "{}", merged.stderr);
    assert!(merged.stdout.starts_with("all.jsonl: 1 campaign, 2 runs"), "{}", merged.stdout);
    refused("bench merge newer.jsonl --out x.jsonl", "expected a file of runs that can be used");
}

#[cfg(unix)]
#[test]
fn ctrl_c_keeps_what_is_done() {
    let folder = Folder::new();
    problems(&folder, 60);
    // As a terminal does it: the whole group of processes is told.
    let mut command = folder.command();
    std::os::unix::process::CommandExt::process_group(&mut command, 0);
    let mut child = command
        .args("bench run problems --out runs.jsonl --tol 1e-4".split_whitespace())
        .stdout(Stdio::piped())
        .spawn()
        .unwrap();
    let file = folder.path("runs.jsonl");
    wait_for("some runs", 60, || runs(&file).len() >= 20);
    let group = format!("-{}", child.id());
    let interrupt = std::process::Command::new("kill").args(["-INT", "--", &group]).status();
    assert!(interrupt.unwrap().success());
    assert_eq!(child.wait().unwrap().code(), Some(1));
    let text = std::io::read_to_string(child.stdout.unwrap()).unwrap();
    assert!(text.contains("the same command with --resume does the rest"), "{text}");
    assert!(runs(&file).len() >= 20);
    let ended = lines(&file).iter().all(|l| l["line"] != "run" || l["ending"] != "crashed");
    assert!(ended, "a run that was dropped is recorded as a crash");
}

/// A campaign of many runs, from a program that may be another copy.
#[cfg(target_os = "linux")]
fn long_campaign(mut program: std::process::Command) -> Child {
    let all = "bench run problems --solver nsgs --tol 1e-4 --out runs.jsonl --quiet";
    program.args(all.split_whitespace()).stderr(Stdio::piped()).spawn().unwrap()
}

#[cfg(target_os = "linux")]
#[test]
fn an_upgrade_of_the_program_does_not_touch_a_campaign() {
    let folder = Folder::new();
    problems(&folder, 100);
    let copy = folder.path("copy");
    std::fs::copy(env!("CARGO_BIN_EXE_nonsmooth"), &copy).unwrap();
    let mut command = std::process::Command::new(&copy);
    command.current_dir(&folder);
    let mut campaign = long_campaign(command);
    let file = folder.path("runs.jsonl");
    wait_for("a run", 60, || !runs(&file).is_empty());
    // As package managers do it: a new file under the old name.
    std::fs::copy("/bin/true", folder.path("new")).unwrap();
    std::fs::rename(folder.path("new"), &copy).unwrap();
    assert!(campaign.wait().unwrap().success());
    assert_eq!(runs(&file).len(), 100);
    let crashed = lines(&file).iter().filter(|l| l["ending"] == "crashed").count();
    assert_eq!(crashed, 0);
}

#[cfg(target_os = "linux")]
#[test]
fn nothing_else_writes_into_a_campaign() {
    let folder = Folder::new();
    problems(&folder, 100);
    folder.run("bench run problems --solver nsgs --tol 1e-3 --out old.jsonl").exits(0);
    let mut campaign = long_campaign(folder.command());
    let file = folder.path("runs.jsonl");
    wait_for("a run", 60, || !runs(&file).is_empty());
    let merged = folder.run("bench merge old.jsonl --out runs.jsonl");
    assert_eq!(merged.code, Some(2));
    assert!(merged.stderr.contains("found one that a campaign writes"), "{}", merged.stderr);
    assert!(campaign.wait().unwrap().success());
    assert_eq!(runs(&file).len(), 100);
}
