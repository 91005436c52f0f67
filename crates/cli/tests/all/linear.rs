//! The commands on linear complementarity problems.

use std::path::{Path, PathBuf};

use crate::common::{Folder, Run, has_keys};
use nonsmooth_io::ProblemFile;
use nonsmooth_problem::AnyPoint;
use serde_json::Value;

const JUDGED: &str = "file kind rows unknowns status message tolerance residual/absolute residual/relative \
    residual/primal residual/siconos failing rows_by_status/inside rows_by_status/lower rows_by_status/upper \
    rows_by_status/equalities degenerate worst_rows";

fn examples() -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("../../examples/lcp")
}

/// A folder with the examples, and some problems in other formats.
fn folder() -> Folder {
    let folder = Folder::new();
    for entry in std::fs::read_dir(examples()).unwrap() {
        let entry = entry.unwrap();
        std::fs::copy(entry.path(), folder.path(entry.file_name().to_str().unwrap())).unwrap();
    }
    // A line of the file is a column of M.
    let put = |name: &str, text: &str| std::fs::write(folder.path(name), text).unwrap();
    put("lcp_two.dat", "2\n0\n2\n2\n2 2\n 4 1\n -2 3\n -4 -7\n\na remark\n");
    put(
        "two.mtx",
        "%%MatrixMarket matrix coordinate real general\n2 2 4\n1 1 4\n2 1 1\n1 2 -2\n2 2 3\n",
    );
    put("two_q.mtx", "-4\n-7\n");
    folder
}

fn first(run: Run) -> Value {
    run.json().remove(0)
}

#[test]
fn the_examples_hold_solutions_that_pass() {
    let folder = folder();
    for (name, kind) in
        [("string", "lcp"), ("rectifier", "mlcp"), ("blocks", "box_lcp"), ("horizontal", "hlcp")]
    {
        let text = folder.run(&format!("check {name}.toml --tol 1e-14")).exits(0).stdout;
        assert!(text.starts_with(&format!("{name}.toml: solved (relative residual ")), "{text}");
        assert!(
            text.contains(&format!("problem    {kind}, ")) && text.contains("rows       "),
            "{text}"
        );
        let line = first(folder.run(&format!("check {name}.toml --json")).exits(0));
        has_keys(&line, JUDGED);
        let counts = line["rows_by_status"].as_object().unwrap();
        let sum: u64 = counts.values().map(|n| n.as_u64().unwrap()).sum();
        // A horizontal problem's rows are equations, and its pairs come besides.
        let rows = line["rows"].as_u64().unwrap();
        assert_eq!(sum, if kind == "hlcp" { 2 * rows } else { rows }, "{line}");
    }
    let text = folder.run("check blocks.toml").exits(0).stdout;
    assert!(text.contains("1 inside, 1 at the lower bound, 1 at the upper bound"), "{text}");
    let text = folder.run("check rectifier.toml").exits(0).stdout;
    assert!(text.contains("4 equalities"), "{text}");
    folder.run("check impossible.toml").refused(&["impossible.toml", "[solution]", "none"]);
    // A wrong solution does not pass.
    let wrong = std::fs::read_to_string(folder.path("blocks.toml")).unwrap();
    std::fs::write(folder.path("wrong.toml"), wrong.replace("-0.125", "-0.1")).unwrap();
    let text = folder.run("check wrong.toml").exits(1).stdout;
    assert!(text.contains("does not pass") && text.contains("worst      rows 1 ("), "{text}");
}

#[test]
fn problems_are_solved_from_every_format() {
    let folder = folder();
    let solve = "solve string.toml lcp_two.dat two.mtx blocks.toml --solver projected_jacobi --tol 1e-10 --json";
    for line in folder.run(solve).exits(0).json() {
        has_keys(&line, JUDGED);
        has_keys(&line, "solver settings iterations seconds account");
        assert_eq!(line["status"], "solved", "{line}");
    }
    let text = folder.run("solve lcp_two.dat --solver projected_jacobi").exits(0).stdout;
    assert!(
        text.contains("lcp, 2 variables")
            && text.contains("rows       2 inside, 0 at the lower bound"),
        "{text}"
    );
    assert!(!text.contains("m/s"), "{text}");
    // A folder takes solutions in our format, under the names of the problems.
    let out = "solve lcp_two.dat two.mtx string.toml --solver projected_jacobi --tol 1e-12 --out solved/ --quiet";
    folder.run(out).exits(0);
    folder.run("check solved/lcp_two.toml solved/two.toml solved/string.toml --tol 1e-12").exits(0);
    let [a, b] = ["lcp_two", "two"].map(|name| {
        let file = ProblemFile::read(folder.path(&format!("solved/{name}.toml"))).unwrap();
        match file.solution.unwrap().point {
            AnyPoint::Lcp(point) => point.z,
            other => panic!("{other:?}"),
        }
    });
    assert!(a.iter().zip(&b).all(|(a, b)| (a - b).abs() < 1e-10), "{a:?} {b:?}");
    assert!((a[0] - 26.0 / 14.0).abs() < 1e-10, "M is read by columns: {a:?}");
    // Titles stay.
    let kept = ProblemFile::read(folder.path("solved/string.toml")).unwrap();
    assert_eq!(kept.info.title.as_deref(), Some("string over an obstacle"));
    // Matrix Market has the solution beside; in place, the file itself gets it.
    folder
        .run("solve two.mtx --solver projected_jacobi --tol 1e-12 --out again.mtx --quiet")
        .exits(0);
    folder.run("check again.mtx --tol 1e-12").exits(0);
    folder
        .run("solve solved/two.toml --solver projected_jacobi --out solved/two.toml --quiet")
        .exits(0);
    folder.run("check solved/two.toml").exits(0);
}

#[test]
fn problems_are_generated_with_the_solution_planted() {
    let folder = Folder::new();
    let list = folder.run("gen --list").exits(0).stdout;
    assert!(
        list.contains("\nlcp: ") && list.contains("class=spd") && list.contains("copositive_plus")
    );
    assert!(folder.run("gen bearing --list").exits(0).stdout.contains("eccentricity=0.1"));
    for (name, settings) in [
        ("lcp", "--set n=12 --set class=p --set degenerate=0.25"),
        ("lcp", "--set n=30 --set class=m_matrix --set density=0.2 --set decades=4"),
        ("box_lcp", "--set n=9 --set seed=3"),
        ("hlcp", ""),
        ("mlcp", "--set blocks=singular_a --set redundant=2"),
    ] {
        folder.run(&format!("gen {name} {settings} --out a.toml")).exits(0);
        folder.run("check a.toml --tol 1e-12").exits(0);
        assert!(folder.run("info a.toml").exits(0).stdout.contains("title      "), "{name}");
    }
    folder.run("gen lcp --out a.mtx").exits(0);
    folder.run("check a.mtx").exits(0);
    for (name, kind) in
        [("obstacle", "lcp"), ("torsion", "box_lcp"), ("bearing", "lcp"), ("infeasible", "lcp")]
    {
        let text = folder.run(&format!("gen {name} --out {name}.toml")).exits(0).stdout;
        assert!(text.contains(kind), "{text}");
        folder.run(&format!("check {name}.toml")).refused(&["[solution]"]);
    }
    for (arguments, parts) in [
        ("gen lcp", ["--out FILE.toml", "found none"]),
        ("gen lcp --out a.hdf5", ["--out a.hdf5", ".toml, .mtx or .csv"]),
        ("gen lcp --draw a.svg --out a.toml", ["--draw", "lcp"]),
        ("gen lcp --form local --out a.toml", ["--form", "lcp"]),
        ("gen lcp --set n=1 --out a.toml", ["n: expected from 2", "found 1"]),
        ("gen lcp --set class=q --out a.toml", ["class", "spd"]),
        ("gen lcp --set n=1000000 --out a.toml", ["fits in memory", "1000000 × 1000000"]),
        ("gen mlcp --set pairs=1000000 --out a.toml", ["fits in memory", "GB"]),
        ("gen mlcp --set redundant=20000000 --out a.toml", ["fits in memory", "GB"]),
        ("gen infeasible --set n=3 --out a.toml", ["at least 6", "found 3"]),
        ("gen infeasible --set class=spd --out a.toml", ["class", "psd, kkt or copositive_plus"]),
        ("gen magic --out a.toml", ["magic", "complementarity: lcp"]),
    ] {
        folder.run(arguments).refused(&parts);
    }
}

#[test]
fn auto_solves_the_examples_or_proves_that_there_is_no_solution() {
    let folder = folder();
    folder
        .run("solve string.toml rectifier.toml blocks.toml horizontal.toml --tol 1e-10 --quiet")
        .exits(0);
    let text = folder.run("solve impossible.toml").exits(1).stdout;
    assert!(
        text.starts_with("impossible.toml: infeasible: ")
            && text.contains("proved in exact arithmetic"),
        "{text}"
    );
    let line = first(folder.run("solve impossible.toml --json").exits(1));
    assert_eq!(line["status"], "infeasible");
    has_keys(&line, "certificate/proof");

    let text = folder.run("solve rectifier.toml --certificate none.json").exits(0).stdout;
    assert!(text.contains("certificate there is a solution: no file is written"), "{text}");
    assert!(!folder.path("none.json").exists());
    folder.run("solve impossible.toml --certificate one.json").exits(1);
    assert!(folder.path("one.json").exists());
}

#[test]
fn a_solution_is_a_start() {
    let folder = folder();
    let iterations = |arguments: &str| {
        let run =
            folder.run(&format!("solve string.toml --solver projected_jacobi --json {arguments}"));
        first(run.exits(0))["iterations"].as_u64().unwrap()
    };
    let cold = iterations("");
    assert!(iterations("--warm-start") < cold / 2);
    std::fs::create_dir(folder.path("before")).unwrap();
    std::fs::copy(folder.path("string.toml"), folder.path("before/string.toml")).unwrap();
    assert!(iterations("--warm-start=before/string.toml") < cold / 2);
    assert!(iterations("--warm-start=before") < cold / 2);
}

#[test]
fn the_trace_and_the_plot_are_written() {
    let folder = folder();
    let run = "solve lcp_two.dat --solver projected_jacobi --trace a.json --plot a.svg --quiet";
    folder.run(run).exits(0);
    let trace: Value =
        serde_json::from_str(&std::fs::read_to_string(folder.path("a.json")).unwrap()).unwrap();
    has_keys(&trace, "file kind solver settings status iterations method");
    assert_eq!(trace["method"], "none");
    assert!(trace.get("rows").is_none());
    let svg = std::fs::read_to_string(folder.path("a.svg")).unwrap();
    assert!(svg.contains("projected_jacobi on lcp_two.dat"));
    let run = "solve string.toml --solver lemke --trace b.json --plot b.svg --quiet";
    folder.run(run).exits(0);
    let trace: Value =
        serde_json::from_str(&std::fs::read_to_string(folder.path("b.json")).unwrap()).unwrap();
    assert_eq!(trace["method"], "pivots");
    has_keys(&trace, "rows/0/iteration rows/0/entering rows/0/leaving rows/0/ratio rows/0/z0");
    assert!(std::fs::read_to_string(folder.path("b.svg")).unwrap().contains("z0"));
    let run = "solve string.toml --solver ip_mehrotra --trace c.json --plot c.svg --quiet";
    folder.run(run).exits(0);
    let trace: Value =
        serde_json::from_str(&std::fs::read_to_string(folder.path("c.json")).unwrap()).unwrap();
    assert_eq!(trace["method"], "path");
    has_keys(&trace, "rows/0/mu rows/0/delta rows/0/step rows/0/residual");
    assert!(std::fs::read_to_string(folder.path("c.svg")).unwrap().contains("centrality delta"));
    let several = "solve lcp_two.dat string.toml --solver projected_jacobi --trace all/ --quiet";
    folder.run(several).exits(0);
    assert!(
        folder.path("all/lcp_two.trace.json").is_file()
            && folder.path("all/string.trace.json").is_file()
    );
}

#[test]
fn info_describes_the_matrix() {
    let folder = folder();
    let text =
        folder.run("info string.toml rectifier.toml blocks.toml horizontal.toml").exits(0).stdout;
    for part in [
        "string.toml: lcp, 9 variables",
        "title      string over an obstacle",
        "M          9 x 9, sparse, 25 nonzeros (31 %), symmetric, positive diagonal, no positive entry off it (Z)",
        "rectifier.toml: mlcp, 4 equalities, 4 free variables, 4 pairs",
        "B          4 x 4, zero",
        "blocks.toml: box_lcp, 3 variables, 3 lower bounds and 3 upper",
        "horizontal.toml: hlcp, 2 pairs",
        "solution   stored, passes at 1e-8",
        "M is       symmetric, Z, ",
        "murty: M is ",
    ] {
        assert!(text.contains(part), "{part} in {text}");
    }
    let line = first(folder.run("info rectifier.toml --json").exits(0));
    has_keys(
        &line,
        "title matrices/M/density matrices/A/asymmetry q/negative solution/residual equalities free pairs",
    );
    let none = first(folder.run("info two.mtx --json").exits(0));
    assert!(none["solution"].is_null() && none["matrices"]["M"]["storage"] == "sparse");
}

#[test]
fn mistakes_are_named() {
    let folder = folder();
    folder.run("gen sliding_box --out box.hdf5").exits(0);
    std::fs::write(folder.path("bad.toml"), "kind = \"lcp\"\nq = [1]\nM = [[1, 2]]\n").unwrap();
    std::fs::write(folder.path("other.txt"), "some text").unwrap();
    let cases: &[(&str, &[&str])] = &[
        ("solve bad.toml", &["bad.toml: M: expected 1 × 1 (square), found 1 × 2"]),
        (
            "info other.txt",
            &[
                "other.txt: expected a file of FCLIB's HDF5 (.hdf5, .h5), TOML (.toml), ",
                "found another text",
            ],
        ),
        (
            "solve string.toml --solver nsgs",
            &["solver `nsgs` takes friction problems only (this file: lcp)"],
        ),
        ("solve box.hdf5 --solver projected_jacobi", &["takes lcp, mlcp, box_lcp problems only"]),
        ("solve string.toml --out a.hdf5", &["--out a.hdf5", ".toml, .mtx or .csv"]),
        ("solve rectifier.toml --solver projected_jacobi", &["rectifier.toml", "diagonal"]),
        ("solve two.mtx --warm-start", &["two.mtx: [solution]", "none"]),
        (
            "solve two.mtx --warm-start=string.toml",
            &["--warm-start string.toml", "2 variables", "9 variables"],
        ),
        (
            "solve string.toml --warm-start=two.mtx",
            &["--warm-start two.mtx", "9 variables", "2 variables"],
        ),
        ("solve string.toml --warm-start=box.hdf5", &["--warm-start", "contact"]),
        ("solve box.hdf5 --warm-start=string.toml", &["--warm-start", "string.toml"]),
        ("solve string.toml --trace string.toml", &["--trace", "a file of its own"]),
        ("solve string.toml --trace a.svg --plot a.svg", &["--trace", "that of --plot"]),
    ];
    for (arguments, parts) in cases {
        folder.run(arguments).refused(parts);
    }
    assert!(!folder.path("a.hdf5").exists() && !folder.path("a.svg").exists());
}

#[test]
fn solvers_of_both_classes_are_listed_apart() {
    let folder = Folder::new();
    let text = folder.run("list").exits(0).stdout;
    let (contact, linear) = text.split_once("# Complementarity\n").unwrap();
    assert!(contact.contains("\nnsgs: ") && !contact.contains("\nprojected_jacobi: "));
    assert!(linear.contains("\nprojected_jacobi: ") && !linear.contains("\nnsgs: "));
    let both = folder.run("list auto").exits(0).stdout;
    assert_eq!(both.matches("auto (the default): ").count(), 3, "contact, mcp and vi: {both}");
    let page = folder.run("list --markdown").exits(0).stdout;
    assert!(page.contains("](#auto)") && page.contains("](#auto-complementarity)"));
    assert_eq!(page.matches("\n### auto\n").count(), 1);
}

/// A campaign over files of all formats, and another program's table joined to it.
#[test]
fn campaigns_run_on_linear_problems() {
    let folder = folder();
    let run = "bench run . --solver projected_jacobi --tol 1e-8 --repeats 0 --time-limit 2 --out runs.jsonl --quiet";
    folder.run(run).exits(0);
    let runs = std::fs::read_to_string(folder.path("runs.jsonl")).unwrap();
    let lines: Vec<Value> = runs.lines().map(|l| serde_json::from_str(l).unwrap()).collect();
    let of = |name: &str| {
        let is_run =
            |l: &&Value| l["line"] == "run" && l["problem"].as_str().unwrap().ends_with(name);
        lines.iter().find(is_run).unwrap_or_else(|| panic!("{name} in {runs}"))
    };
    for name in ["/string", "/lcp_two", "/two", "/blocks"] {
        assert_eq!(of(name)["ending"], "solved", "{name}");
        assert!(of(name)["residuals"]["primal"].is_number());
    }
    assert_eq!(of("/rectifier")["ending"], "refused");
    assert_eq!((&of("/string")["kind"], &of("/string")["contacts"]), (&"lcp".into(), &9.into()));
    assert!(!runs.contains("two_q"), "a vector is no problem: {runs}");
    // Of a horizontal problem there is nothing to run with this solver.
    assert!(lines.iter().any(|l| l["kind"] == "hlcp" && l["line"] == "problem"));

    let table = "problem,nc,tol,solver,status,iters,seconds,error\n\
        lcp_two.dat,2,1e-8,LEMKE,0,2,1e-6,1e-12\nlcp_two.dat,2,1e-8,PGS,1,9,1e-6,0.1\n";
    std::fs::write(folder.path("table.csv"), table).unwrap();
    let import = "bench import table.csv --program Other --machine here --error siconos --problems runs.jsonl --out other.jsonl";
    let text = folder.run(import).exits(0).stdout;
    assert!(text.contains("2 of 2 rows read; 1 problem matched, 0 not"), "{text}");
}

#[test]
fn exists_and_diagnose_take_complementarity_problems() {
    let folder = folder();
    for (name, says, code) in [
        ("string", "proved: M is P, and then every q has a solution", 0),
        ("rectifier", "proved: an exact solution is known", 0),
        ("blocks", "proved: all bounds are finite, and then every q has a solution", 0),
        ("horizontal", "proved: an exact solution is known", 0),
        ("impossible", "none, proved: row 1 is negative for every z >= 0", 1),
    ] {
        let text = folder.run(&format!("exists {name}.toml")).exits(code).stdout;
        assert!(text.contains(&format!("existence of a solution {says}")), "{text}");
        assert!(text.contains("verified in exact arithmetic"), "{text}");
        let line = first(folder.run(&format!("exists {name}.toml --json")).exits(code));
        has_keys(&line, "file kind rows unknowns verdict message seconds");
        let text = folder.run(&format!("diagnose {name}.toml")).exits(0).stdout;
        assert!(text.contains(says), "{text}");
        // Advised is what solved the problem on trial.
        let line = first(folder.run(&format!("diagnose {name}.toml --json")).exits(0));
        let suits = line["suits"].as_array().unwrap();
        assert_eq!(suits.is_empty(), code == 1, "{line}");
        for solver in suits {
            let solver = solver.as_str().unwrap();
            folder.run(&format!("solve {name}.toml --solver {solver}")).exits(0);
        }
    }
    // The proof is kept, and verified by another command.
    folder.run("exists impossible.toml --certificate proof.json").exits(1);
    assert!(std::fs::read_to_string(folder.path("proof.json")).unwrap().contains("no_solution"));
}

#[test]
fn suites_list_complementarity_problems() {
    let folder = Folder::new();
    let suite = "[[problem]]\nfamily = \"lcp\"\nfolder = \"psd\"\nsettings = { class = \"psd\", n = [6, 8] }\n\
        [[problem]]\nfamily = \"sliding_box\"\n[[problem]]\nfamily = \"torsion\"\nsettings = { n = 4 }\n";
    std::fs::write(folder.path("s.toml"), suite).unwrap();
    folder.run("gen --suite s.toml --out all").exits(0);
    for made in [
        "psd/lcp-psd-n6.toml",
        "psd/lcp-psd-n8.toml",
        "torsion/torsion-n4.toml",
        "sliding_box/sliding_box.hdf5",
    ] {
        folder.run(&format!("solve all/{made}")).exits(0);
    }
    std::fs::write(folder.path("s.toml"), "[[problem]]\nfamily = \"lpc\"\n").unwrap();
    folder.run("gen --suite s.toml --out all").refused(&["problem 1", "lpc", "obstacle"]);
}
