//! What a solve found is printed, kept in any format, passed on by streams and drawn.

use std::io::Write;
use std::path::Path;
use std::process::Stdio;

use crate::common::{Folder, Run};
use nonsmooth_io::ProblemFile;

/// One contact, pushed beyond its cone, as Siconos writes it; the answer is known.
const SICONOS: &str = "3\n1\n0\n3\n3\n3 3\n1 0 0\n0 1 0\n0 0 1\n0\n3\n3\n3 3\n1 0 0\n0 1 0\n0 0 1\n-1 -0.5 0\n0 0 0\n0.1\n";

/// The solutions (0, 1), (1, 0) and (1/3, 1/3).
const THREE: &str =
    "kind = \"lcp\"\nnames = [\"cat\", \"a, b\"]\nM = [[1, 2], [2, 1]]\nq = [-1, -1]\n";

fn folder() -> Folder {
    let folder = Folder::new();
    for (name, text) in [("GFC3D_one.dat", SICONOS), ("three.toml", THREE)] {
        std::fs::write(folder.path(name), text).unwrap();
    }
    let rectifier = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../examples/lcp/rectifier.toml");
    std::fs::copy(rectifier, folder.path("rectifier.toml")).unwrap();
    folder.run("gen wall --set rows=3 --set columns=3 --out wall.hdf5").exits(0);
    folder
}

/// Runs the program with these bytes on its standard input.
fn piped(folder: &Folder, arguments: &str, input: &[u8]) -> std::process::Output {
    let mut command = folder.command();
    command.args(arguments.split_whitespace());
    let streams = command.stdin(Stdio::piped()).stdout(Stdio::piped()).stderr(Stdio::piped());
    let mut child = streams.spawn().unwrap();
    child.stdin.take().unwrap().write_all(input).unwrap();
    child.wait_with_output().unwrap()
}

#[test]
fn small_answers_are_printed_and_large_ones_on_demand() {
    let folder = folder();
    let text = folder.run("solve rectifier.toml").exits(0).stdout;
    for line in ["variable  name      status  value  w", "v[1]      I_23      lower       0  5"] {
        assert!(text.contains(line), "{line} in {text}");
    }
    let text = folder.run("solve GFC3D_one.dat").exits(0).stdout;
    let row = text.lines().find(|l| l.trim_start().starts_with("0 ")).unwrap();
    let cells: Vec<_> = row.split_whitespace().collect();
    assert_eq!(cells[..5], ["0", "slip", "1", "0.1", "0"], "{text}");
    assert_eq!(cells[6], "-0.4", "{text}");
    // More than twenty contacts.
    let text = folder.run("solve wall.hdf5").exits(0).stdout;
    assert!(text.contains("--solution prints it, --out FILE keeps it"), "{text}");
    assert!(!text.contains("r_t1"), "{text}");
    let text = folder.run("solve wall.hdf5 --out kept.hdf5").exits(0).stdout;
    assert!(text.contains("--solution prints it") && !text.contains("--out"), "{text}");
    let text = folder.run("solve wall.hdf5 --solution").exits(0).stdout;
    assert!(text.lines().count() > 40 && text.contains("velocities v: "), "{text}");
    // As JSON, with all digits.
    assert!(folder.run("solve three.toml --json").exits(0).json()[0].get("solution").is_none());
    let line = &folder.run("solve rectifier.toml --json --solution").exits(0).json()[0]["solution"];
    assert_eq!(line["v"].as_array().unwrap().len(), 4);
    assert_eq!(line["status"][0], "free", "{line}");
    let line = &folder.run("solve wall.hdf5 --json --solution").exits(0).json()[0]["solution"];
    assert_eq!(line["r"].as_array().unwrap().len(), 3 * line["status"].as_array().unwrap().len());
    // What was not solved is no solution.
    let text = folder.run("solve wall.hdf5 --max-iter 0").exits(1).stdout;
    assert!(!text.contains("--solution"), "{text}");
    let text = folder.run("solve wall.hdf5 --max-iter 0 --solution").exits(1).stdout;
    assert!(text.contains("  best point contact"), "{text}");
}

#[test]
fn tables_are_written_and_unknown_extensions_refused() {
    let folder = folder();
    folder.run("solve three.toml --out three.csv --quiet").exits(0);
    let table = std::fs::read_to_string(folder.path("three.csv")).unwrap();
    assert!(table.starts_with("variable,name,status,z,w\n0,cat,"), "{table}");
    assert!(table.contains("\n1,\"a, b\","), "{table}");
    folder.run("solve wall.hdf5 --out wall.csv --quiet").exits(0);
    let table = std::fs::read_to_string(folder.path("wall.csv")).unwrap();
    assert!(table.starts_with("contact,status,r_n,r_t1,r_t2,u_n,u_t1,u_t2\n0,"), "{table}");
    assert!(table.lines().all(|line| line.split(',').count() == 8), "{table}");
    for (file, known) in
        [("wall.hdf5", ".hdf5, .h5 or .csv"), ("three.toml", ".toml, .mtx or .csv")]
    {
        for out in ["a.vtk", "a", "a.dat", "a.json"] {
            folder.run(&format!("solve {file} --out {out}")).refused(&["--out", out, known]);
            assert!(!folder.path(out).exists());
        }
    }
    folder.run("check three.csv").refused(&["three.csv", "a solution alone"]);
    folder.run("gen wall --out wall2.csv").refused(&["wall2.csv", "holds nothing else"]);
    folder.run("solve three.toml --out three --format csv --quiet").exits(0);
    assert!(folder.path("three").exists());
    folder.run("solve three.toml --out a.toml --format hdf5").refused(&["lcp", "FCLIB"]);
    folder.run("solve three.toml --out a.toml --format vtk").refused(&["--format", "toml, mtx"]);
}

#[test]
fn streams_stand_for_files() {
    let folder = folder();
    let wall = std::fs::read(folder.path("wall.hdf5")).unwrap();
    for (arguments, input) in [
        ("solve - --tol 1e-9", &wall[..]),
        ("info -", &wall),
        ("solve -", THREE.as_bytes()),
        ("solve -", SICONOS.as_bytes()),
    ] {
        let run = Run::from(piped(&folder, arguments, input)).exits(0);
        assert!(run.stdout.starts_with("-: "), "{}", run.stdout);
    }
    // The file alone on stdout, the report on stderr; HDF5 from HDF5.
    let out = piped(&folder, "solve - --out -", &wall);
    assert_eq!(out.status.code(), Some(0));
    let file = ProblemFile::parse("a", &out.stdout).unwrap();
    assert!(file.solution.is_some() && String::from_utf8_lossy(&out.stderr).contains("solved"));
    let out = piped(&folder, "solve - --out - --quiet", THREE.as_bytes());
    assert!(out.stderr.is_empty() && out.stdout.starts_with(b"# 0 <= z"));
    let made =
        folder.command().args(["gen", "lcp", "--set", "n=4", "--out", "-"]).output().unwrap();
    assert!(ProblemFile::parse("a", &made.stdout).unwrap().solution.is_some());
    // What Siconos writes is not written here.
    let out = piped(&folder, "solve - --out - --quiet", SICONOS.as_bytes());
    assert!(ProblemFile::parse("a", &out.stdout).is_ok());
    let run = Run::from(piped(&folder, "solve -", b"so what"));
    run.refused(&["standard input", "another text"]);
}

#[test]
fn conversion_keeps_what_it_can_and_says_what_is_lost() {
    let folder = folder();
    folder.run("solve wall.hdf5 --out solved.hdf5 --quiet").exits(0);
    let text = folder.run("convert solved.hdf5 again.h5").exits(0).stdout;
    assert!(text.contains("problem, solution") && !text.contains("lost"), "{text}");
    let [a, b] = ["solved.hdf5", "again.h5"].map(|f| ProblemFile::read(folder.path(f)).unwrap());
    assert_eq!(a, b);
    let text = folder.run("convert rectifier.toml again.toml").exits(0).stdout;
    assert!(text.contains("names of the variables") && !text.contains("lost"), "{text}");
    let text = folder.run("convert three.toml three.mtx").exits(0).stdout;
    assert!(text.contains("lost       names of the variables"), "{text}");
    let text = folder.run("convert solved.hdf5 table.csv").exits(0).stdout;
    let lost = text.lines().find(|l| l.trim_start().starts_with("lost")).unwrap();
    assert!(
        lost.contains("problem, velocities of the bodies, drawing of the bodies, title"),
        "{text}"
    );
    // A matrix has a vector beside it.
    folder.run("gen lcp --set n=3 --out a.mtx").exits(0);
    folder.run("gen lcp --set n=4 --out a_q.mtx").exits(0);
    let beside = ["TO a.mtx", "a file of its own for a_q.mtx beside it", "one that is read"];
    folder.run("convert a_q.mtx a.mtx").refused(&beside);
    folder.run("convert GFC3D_one.dat one.hdf5").exits(0);
    folder.run("solve one.hdf5").exits(0);
    for (arguments, parts) in [
        ("convert wall.hdf5 wall.toml", ["TO wall.toml", ".hdf5, .h5 or .csv"]),
        ("convert rectifier.toml rectifier.mtx", ["rectifier.mtx", "mlcp"]),
        ("convert wall.hdf5 wall.hdf5", ["a file of its own", "one that is read"]),
        ("convert wall.hdf5 none.csv", ["the solution", "none"]),
        ("convert three.toml nowhere/three.mtx", ["TO", "nowhere"]),
    ] {
        folder.run(arguments).refused(&parts);
    }
}

#[test]
fn problems_are_drawn() {
    let folder = folder();
    folder.run("draw wall.hdf5 --view matrices").exits(0);
    let svg = std::fs::read_to_string(folder.path("wall.svg")).unwrap();
    for part in ["M: ", "H: ", "Normal impulses", "r_T / (mu r_N)", "solved by auto"] {
        assert!(svg.contains(part), "{part}");
    }
    folder.run("draw wall.hdf5").refused(&["wall.svg", "--out"]);
    folder.run("gen sliding_box --form local --solve --out box.hdf5").exits(0);
    let text = folder.run("draw box.hdf5 --out forces.svg").exits(0).stdout;
    assert!(text.contains("stored solution, passes"), "{text}");
    folder.run("draw three.toml --out m.svg").exits(0);
    folder.run("draw wall.hdf5 --out a.png").refused(&["--out a.png", ".svg or .html"]);
}

#[test]
fn files_of_scenes_hold_their_bodies() {
    let folder = Folder::new();
    let read = |name: &str| std::fs::read_to_string(folder.path(name)).unwrap();
    folder.run("gen sphere_pile --set count=30 --out pile.hdf5 --solve --draw pile.svg").exits(0);
    folder.run("draw pile.hdf5 --out again.svg").exits(0);
    // The same picture, but for numbers that the file has in single precision.
    let count = |text: &str| text.matches("stroke-linecap").count();
    assert!(count(&read("pile.svg")) > 40);
    assert_eq!(count(&read("pile.svg")), count(&read("again.svg")));
    folder.run("draw pile.hdf5 --out bodies.svg --view bodies").exits(0);
    assert_eq!(count(&read("bodies.svg")), 0);
    // Bodies pass through a solve and a conversion, and a table has no room for them.
    folder.run("solve pile.hdf5 --out solved.hdf5").exits(0);
    let text = folder.run("convert solved.hdf5 copy.h5").exits(0).stdout;
    assert!(text.contains("drawing of the bodies") && !text.contains("lost"), "{text}");
    folder.run("draw copy.h5 --out view.html").exits(0);
    assert!(read("view.html").starts_with("<!DOCTYPE html>"));
    let text = folder.run("convert solved.hdf5 copy.csv").exits(0).stdout;
    assert!(text.lines().any(|l| l.contains("lost") && l.contains("drawing of the bodies")));
    folder.run("draw pile.hdf5 --view matrices --out a.html").refused(&["--view", "a.html"]);
    std::fs::write(folder.path("three.toml"), THREE).unwrap();
    folder.run("draw three.toml --view bodies --out a.svg").refused(&["three.toml", "with bodies"]);
    folder.run("gen wall --draw a.svg --view forces").refused(&["view", "impulses", "none"]);
    folder.run("gen wall --solve --draw w.svg --view forces").exits(0);
    assert!(count(&read("w.svg")) > 10);
    folder.run("gen wall --solve --draw wall.html").exits(0);
    assert!(read("wall.html").contains("\"status\":\"stick\""));
}

#[test]
fn all_solutions_of_a_small_problem_are_listed() {
    let folder = folder();
    let text = folder.run("solve three.toml --all-solutions").exits(0).stdout;
    assert!(text.contains("3 isolated solutions; there are no others"), "{text}");
    assert!(text.matches("0.33333").count() == 2 && text.contains("cat"), "{text}");
    let line = &folder.run("solve three.toml --all-solutions --json").exits(0).json()[0];
    assert_eq!(
        (line["complete"].as_bool(), line["solutions"].as_array().unwrap().len()),
        (Some(true), 3)
    );
    // A segment.
    let family = "kind = \"lcp\"\nM = [[1, 1], [1, 1]]\nq = [-1, -1]\n";
    std::fs::write(folder.path("family.toml"), family).unwrap();
    let text = folder.run("solve family.toml --all-solutions").exits(0).stdout;
    assert!(
        text.contains("1 family of solutions") && text.matches("end: (").count() == 2,
        "{text}"
    );
    std::fs::write(folder.path("none.toml"), "kind = \"lcp\"\nM = [[0]]\nq = [-1]\n").unwrap();
    let text = folder.run("solve none.toml --all-solutions").exits(1).stdout;
    assert!(text.contains("no solution; there are no others"), "{text}");
    // A line of a free variable; what needs more digits than doubles have.
    let line = "kind = \"mlcp\"\nA = [[0]]\na = [0]\nB = [[1]]\nb = [-1]\n";
    std::fs::write(folder.path("line.toml"), line).unwrap();
    let text = folder.run("solve line.toml --all-solutions").exits(0).stdout;
    assert!(text.contains("line: (1, 0)") && text.contains("end: (0, 1)"), "{text}");
    let line = &folder.run("solve line.toml --all-solutions --json").exits(0).json()[0];
    assert_eq!(line["solutions"][0]["lines"].to_string(), "[[1.0,0.0]]");
    let far = "kind = \"lcp\"\nM = [[1e-300]]\nq = [-1e300]\n";
    std::fs::write(folder.path("far.toml"), far).unwrap();
    let text = folder.run("solve far.toml --all-solutions").exits(1).stdout;
    assert!(text.contains("perhaps there are some") && !text.contains("no others"), "{text}");
    folder.run("solve rectifier.toml --all-solutions").exits(0);
    folder
        .run("solve wall.hdf5 --all-solutions")
        .refused(&["--all-solutions", "friction_global_3d"]);
}

#[test]
fn shells_complete_commands() {
    let folder = Folder::new();
    for shell in ["bash", "zsh", "fish", "powershell"] {
        let script = folder.run(&format!("completions {shell}")).exits(0).stdout;
        assert!(script.contains("nonsmooth") && script.contains("warm-start"), "{shell}");
    }
}

#[test]
fn a_method_without_a_record_says_so() {
    let folder = folder();
    let text = folder.run("solve wall.hdf5 --trace trace.json").exits(0).stdout;
    assert!(text.contains("trace      auto keeps no record"), "{text}");
    let text = folder.run("solve three.toml --solver lemke --trace trace.json").exits(0).stdout;
    assert!(!text.contains("keeps no record"), "{text}");
}

/// Whatever the solver, a hyperstatic problem has the same motion; how the load is shared differs, and a report says so.
#[test]
fn impulses_that_are_not_unique_are_said_to_be_so() {
    let folder = Folder::new();
    folder.run("gen arch --set blocks=5 --out arch.hdf5").exits(0);
    let mut degrees = vec![];
    for solver in ["auto", "nsgs", "ip", "newton_ac", "cadoux"] {
        let run = folder.run(&format!("solve arch.hdf5 --tol 1e-9 --solver {solver} --json"));
        let line = run.exits(0).json().remove(0);
        // Nothing moves: sticking at the limit is no slip.
        assert_eq!(line["contacts_by_status"]["slip"], 0, "{solver}: {line}");
        assert_eq!(line["impulses_unique"], false, "{solver}: {line}");
        let found = &line["indeterminacy"];
        assert!(found["rank"].as_u64() < found["of"].as_u64(), "{found}");
        degrees.push(found["rank"].clone());
    }
    let text = folder.run("solve arch.hdf5 --out solved.hdf5").exits(0).stdout;
    let says = |text: &str| {
        let line = text.lines().find(|l| l.starts_with("  impulses   not unique: rank "));
        line.unwrap_or_else(|| panic!("{text}")).to_owned()
    };
    assert!(says(&text).ends_with("all of them give the same motion"), "{text}");
    assert_eq!(says(&folder.run("check solved.hdf5").exits(0).stdout), says(&text));
    // A box on three points of a slope slides: what moves determines the impulses.
    folder.run("gen sliding_box --set contact_density=1.5 --form local --out box.hdf5").exits(0);
    let line = folder.run("solve box.hdf5 --json").exits(0).json().remove(0);
    assert_eq!(line["impulses_unique"], true, "{line}");
}

#[test]
fn families_of_solutions_pass_where_zero_is_all_that_ends_them() {
    let folder = Folder::new();
    for text in [
        "M = [[5, -6, 5], [-6, 8, -8], [5, -8, 10]]\nq = [0, 0, 0]\n",
        "M = [[-2, 2, -3, 0], [2, -2, -2, 1], [-3, -2, -2, 3], [0, 1, 3, 0]]\nq = [3, 0, 0, 0]\n",
        "M = [[-3, 0, -2, -1], [0, 0, 3, 0], [-2, 3, 3, -1], [-1, 0, -1, 1]]\nq = [3, 0, -1, 0]\n",
    ] {
        std::fs::write(folder.path("lcp.toml"), format!("kind = \"lcp\"\n{text}")).unwrap();
        let said = folder.run("solve lcp.toml --all-solutions").exits(0).stdout;
        assert!(!said.contains("does not pass"), "{said}");
    }
}

#[test]
fn a_fraction_over_nothing_is_no_proof() {
    let folder = Folder::new();
    std::fs::write(folder.path("lcp.toml"), "kind = \"lcp\"\nM = [[1, 0], [0, 1]]\nq = [-1, -1]\n")
        .unwrap();
    for fraction in ["1/0", "1/00", "-1/-0", "0/0"] {
        let proof = format!(
            "{{\"proof\": {{\"proof\": \"farkas\", \"y\": [0, 1], \"exact\": [[[0, \"{fraction}\"]]]}}}}"
        );
        std::fs::write(folder.path("proof.json"), proof).unwrap();
        folder.run("check lcp.toml --certificate proof.json").refused(&["expected a fraction"]);
    }
}

#[test]
fn what_a_limit_cut_short_is_drawn_all_the_same() {
    let folder = Folder::new();
    folder
        .run("gen wall --set rows=40 --set columns=40 --set disturbance=0.3 --out wall.hdf5")
        .exits(0);
    let run = folder.run("draw wall.hdf5 --out wall.svg --time-limit 0.02");
    assert_eq!(run.code, Some(1), "{}{}", run.stdout, run.stderr);
    assert!(folder.path("wall.svg").exists());
}
