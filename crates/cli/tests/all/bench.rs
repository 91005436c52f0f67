//! `nonsmooth bench`: what the commands write, and their exit codes.

use std::fs;

use crate::common::Folder;

const TABLE: &str = "\
problem,nc,tol,solver,status,iters,seconds,error
a.dat,5,1e-8,FAST,0,3,0.001,1e-9
a.dat,5,1e-8,SLOW,0,30,0.004,1e-9
b.dat,50,1e-8,FAST,0,5,0.001,1e-3
b.dat,50,1e-8,SLOW,0,50,0.004,1e-10
";

const IMPORT: &str = "bench import t.csv --program Peer --machine here --out t.jsonl";

fn imported() -> Folder {
    let folder = Folder::new();
    fs::write(folder.path("t.csv"), TABLE).unwrap();
    let run = folder.run(IMPORT).exits(0);
    assert!(run.stdout.contains("t.csv: 4 of 4 rows read"), "{}", run.stdout);
    assert!(
        run.stdout.contains("success claimed with an error above the tolerance in 1 row"),
        "{}",
        run.stdout
    );
    folder
}

#[test]
fn import_names_rows_at_fault_and_reads_the_others() {
    let folder = Folder::new();
    fs::write(folder.path("t.csv"), TABLE.replace("0.004", "fast")).unwrap();
    let run = folder.run(IMPORT).exits(2);
    assert_eq!(run.stderr.lines().count(), 2, "{}", run.stderr);
    let first = "error: t.csv, line 3: seconds: expected a number, found \"fast\"";
    assert!(run.stderr.starts_with(first), "{}", run.stderr);
    let written = fs::read_to_string(folder.path("t.jsonl")).unwrap();
    assert_eq!(written.matches("\"line\":\"run\"").count(), 2);
}

#[test]
fn import_replaces_an_import_and_nothing_else() {
    let folder = imported();
    let import = fs::read_to_string(folder.path("t.jsonl")).unwrap();
    folder.run(IMPORT).exits(0);
    for other in
        [import.replace("\"foreign\":true,", ""), format!("{import}{import}"), "text".into()]
    {
        fs::write(folder.path("t.jsonl"), &other).unwrap();
        folder.run(IMPORT).refused(&["t.jsonl: expected a new file, found"]);
        assert_eq!(fs::read_to_string(folder.path("t.jsonl")).unwrap(), other);
    }
}

#[test]
fn import_joins_problems_of_a_folder() {
    let folder = Folder::new();
    fs::create_dir(folder.path("walls")).unwrap();
    folder.run("gen wall --set rows=3 --set columns=2 --out walls/a.hdf5").exits(0);
    fs::write(folder.path("t.csv"), TABLE.replace(",5,", ",,")).unwrap();
    folder.run(&format!("{IMPORT} --problems walls --error siconos")).exits(0);
    let written = fs::read_to_string(folder.path("t.jsonl")).unwrap();
    let named = r#""name":"walls/a","family":"walls","kind":"friction_global_3d""#;
    assert!(written.contains(named), "{written}");
    assert!(written.contains(r#""name":"unmatched/b""#), "{written}");
    assert!(written.contains(r#""reached":1e-9,"siconos":1e-9"#), "{written}");
}

#[test]
fn figures_and_tables_are_written() {
    let folder = imported();
    let run = folder
        .run("bench figures t.jsonl --out out --solver FAST")
        .refused(&["--solver", "found FAST"]);
    assert_eq!(run.stdout, "");
    // Its own input would be among the tables.
    fs::create_dir(folder.path("here")).unwrap();
    fs::copy(folder.path("t.jsonl"), folder.path("here/runs.csv")).unwrap();
    folder
        .run("bench figures here/runs.csv --out here")
        .refused(&["--out here/runs.csv", "one that is read"]);
    let run = folder.run("bench figures t.jsonl --out out").exits(0);
    for file in run.stdout.lines() {
        assert!(fs::metadata(folder.path(file)).unwrap().len() > 0, "{file}");
    }
    let read = |name: &str| fs::read_to_string(folder.path("out").join(name)).unwrap();
    let profile = "solver,tau,share\nvirtual best,1,1\nFAST (Peer),1,0.5\nSLOW (Peer),1,0.5\nSLOW (Peer),4,1\n";
    assert_eq!(read("profile-seconds.csv"), profile);
    assert!(read("profile-seconds.svg").contains("† measured by others: Peer on here"));
    assert!(read("summary-all.md").contains("| SLOW (Peer) | 2 | 2 | 100.0 | 50.0 |"));
    assert_eq!(read("runs.csv").lines().count(), 5);
    // Kinds are never counted together: of several, each has a folder.
    let text = fs::read_to_string(folder.path("t.jsonl")).unwrap();
    let linear = text.replace("unmatched/", "linear/").replace("\"kind\":\"\"", "\"kind\":\"lcp\"");
    fs::write(folder.path("l.jsonl"), linear).unwrap();
    folder.run("bench figures t.jsonl l.jsonl --out both").exits(0);
    for kind in ["unknown", "lcp"] {
        assert_eq!(read(&format!("../both/{kind}/profile-seconds.csv")), profile);
    }
    assert_eq!(read("../both/runs.csv").lines().count(), 9);
    let one = folder.run("bench figures t.jsonl l.jsonl --out one --kind lcp").exits(0);
    assert!(one.stdout.contains("one/profile-seconds.csv"), "{}", one.stdout);
    // Each has a tolerance of its own, and what has no run at it is named.
    let tight = fs::read_to_string(folder.path("l.jsonl")).unwrap().replace("1e-8", "1e-10");
    fs::write(folder.path("l.jsonl"), tight).unwrap();
    let own = folder.run("bench figures t.jsonl l.jsonl --out own").exits(0);
    for line in ["  tolerance  1e-8 for an unknown kind\n", "  tolerance  1e-10 for lcp\n"] {
        assert!(own.stdout.contains(line), "{}", own.stdout);
    }
    assert_eq!(read("../own/lcp/profile-seconds.csv"), profile);
    let one = folder.run("bench figures t.jsonl l.jsonl --out one --kind lcp").exits(0);
    assert!(!one.stdout.contains("  "), "{}", one.stdout);
    let some = folder.run("bench figures t.jsonl l.jsonl --out some --tol 1e-10").exits(0);
    let line = "  but        an unknown kind: no run at 1e-10, left out\n";
    assert!(some.stdout.ends_with(line), "{}", some.stdout);
    let text = fs::read_to_string(folder.path("t.jsonl")).unwrap();
    let slow = text.replace(
        "\"solver\":\"SLOW (Peer)\",\"tolerance\":1e-8",
        "\"solver\":\"SLOW (Peer)\",\"tolerance\":1e-4",
    );
    fs::write(folder.path("s.jsonl"), slow).unwrap();
    let some = folder.run("bench figures s.jsonl --out slow --tol 1e-8").exits(0);
    let line = "  but        an unknown kind: no run at 1e-8 of SLOW (Peer)\n";
    assert!(some.stdout.ends_with(line), "{}", some.stdout);
    // A file that cannot be read is named; the rest goes on.
    let run = folder.run("bench figures none.jsonl t.jsonl --out out").exits(2);
    assert!(run.stderr.starts_with("error: none.jsonl: ") && run.stdout.contains("runs.csv"));
}

#[test]
fn compare_exits_by_what_it_finds() {
    let folder = imported();
    fs::copy(folder.path("t.jsonl"), folder.path("old.jsonl")).unwrap();
    let same = folder.run("bench compare old.jsonl t.jsonl").exits(0);
    assert!(same.stdout.ends_with("nothing worse\n"), "{}", same.stdout);
    fs::write(folder.path("t.csv"), TABLE.replace("1e-10", "1e-5")).unwrap();
    folder.run(IMPORT).exits(0);
    for option in ["", " --outcomes"] {
        let worse = folder.run(&format!("bench compare old.jsonl t.jsonl{option}")).exits(1);
        let line = "unmatched/b  SLOW (Peer)  1e-8: solved -> failed";
        assert!(worse.stdout.contains(line), "{}", worse.stdout);
    }
    let json = folder.run("bench compare old.jsonl t.jsonl --json").exits(1).json();
    assert_eq!(json[0]["newly_unsolved"][0]["solver"], "SLOW (Peer)");
    folder.run("bench compare t.jsonl old.jsonl").exits(0);
    // Slower, but only where times are looked at.
    fs::write(folder.path("t.csv"), TABLE.replace("0.004", "0.008")).unwrap();
    folder.run(IMPORT).exits(0);
    folder.run("bench compare old.jsonl t.jsonl").exits(1);
    folder.run("bench compare old.jsonl t.jsonl --slower 3").exits(0);
    folder.run("bench compare old.jsonl t.jsonl --outcomes").exits(0);
}

#[test]
fn mistakes_are_refused() {
    let folder = imported();
    fs::write(folder.path("text.jsonl"), "no runs\n").unwrap();
    fs::write(folder.path("other.csv"), TABLE.replace("a.dat", "x").replace("b.dat", "y")).unwrap();
    let other = IMPORT.replace("t.csv", "other.csv").replace("t.jsonl", "other.jsonl");
    folder.run(&other).exits(0);
    for (arguments, parts) in [
        ("compare t.jsonl none.jsonl", &["none.jsonl"][..]),
        ("compare t.jsonl text.jsonl", &["text.jsonl", "line 1"]),
        ("compare t.jsonl other.jsonl", &["other.jsonl", "t.jsonl", "none"]),
        ("compare t.jsonl t.jsonl --slower 0.5", &["--slower", "at least 1", "0.5"]),
        ("import none.csv --program P --machine m --out o.jsonl", &["none.csv"]),
        (
            "import t.csv --program P --machine m --out t.csv",
            &["--out", "t.csv", "a file of its own"],
        ),
        ("import t.csv --program P --machine m --out no/o.jsonl", &["--out", "no/o.jsonl"]),
        ("import t.jsonl --program P --machine m --out o.jsonl", &["t.jsonl", "problem"]),
        ("import t.csv --program P --machine m --out o.jsonl --problems no", &["--problems", "no"]),
        ("figures t.jsonl --out f --tol 0", &["--tol", "positive"]),
        ("figures t.jsonl --out f --tol 1e-3", &["selected", "1e-3"]),
        ("figures t.jsonl --out f --size huge", &["--size", "huge", "over 1000"]),
        ("figures t.jsonl --out t.csv", &["--out", "t.csv"]),
    ] {
        folder.run(&format!("bench {arguments}")).refused(parts);
    }
    assert!(!folder.path("o.jsonl").exists());
}

#[test]
fn a_page_never_replaces_its_runs_and_has_a_folder_of_its_own() {
    let folder = imported();
    let before = fs::read(folder.path("t.jsonl")).unwrap();
    let own = folder.run("bench page t.jsonl --out t.jsonl");
    own.refused(&["--out t.jsonl", "a file of its own"]);
    assert_eq!(fs::read(folder.path("t.jsonl")).unwrap(), before);
    folder.run("bench page t.jsonl --out t").refused(&["--out t: expected a name such as"]);
    folder.run("bench page t.jsonl --out page.md").exits(0);
    assert!(folder.path("page/unknown-success.svg").exists());
}

/// With a limit on the size of files, as with a full disk, writing fails midway.
#[cfg(unix)]
#[test]
fn what_cannot_be_written_leaves_the_old_file() {
    let folder = imported();
    folder.run("bench report t.jsonl --out page.html").exits(0);
    let before = fs::read(folder.path("page.html")).unwrap();
    assert!(before.len() > 4096);
    let program = env!("CARGO_BIN_EXE_nonsmooth");
    let script = format!("ulimit -f 2; {program} bench report t.jsonl --out page.html --title New");
    let mut shell = std::process::Command::new("sh");
    let output = shell.args(["-c", &script]).current_dir(&folder).output().unwrap();
    assert!(!output.status.success());
    assert!(fs::read(folder.path("page.html")).unwrap() == before, "the old page is gone");
}
