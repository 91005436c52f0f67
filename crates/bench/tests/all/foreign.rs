//! Other programs' measurements: the open format, its mistakes, and the tables of the corpus.

use std::path::{Path, PathBuf};

use crate::common::{corpus, write};
use nonsmooth_bench::foreign::{Imported, Measure, Source, UNMATCHED, import, problems};
use nonsmooth_bench::record::{Ending, Problem};
use nonsmooth_bench::runs::Runs;

fn source() -> Source {
    Source {
        program: "Peer 1.2".into(),
        machine: "a cluster".into(),
        measure: Some(Measure::Siconos),
    }
}

fn known(name: &str, contacts: usize) -> Problem {
    let (family, _) = name.split_once('/').unwrap();
    let kind = "friction_local_3d".into();
    Problem { name: name.into(), family: family.into(), kind, contacts, ..Problem::default() }
}

/// Imports a text with the known problems `fc3d/a` and `fc3d/b`, two contacts each, and `x/twin`, `y/twin`.
fn read(name: &str, text: &str) -> Imported {
    let folder = tempfile::tempdir().unwrap();
    let all = [("fc3d/a", 2), ("fc3d/b", 2), ("x/twin", 1), ("y/twin", 1)];
    let all = all.map(|(name, contacts)| known(name, contacts));
    let mut read = import(&write(folder.path(), name, text), &source(), &all).unwrap();
    let folder = format!("{}/", folder.path().display());
    read.mistakes.iter_mut().for_each(|m| *m = m.replace(&folder, ""));
    read
}

fn refused(name: &str, text: &str) -> String {
    let folder = tempfile::tempdir().unwrap();
    import(&write(folder.path(), name, text), &source(), &[]).unwrap_err().to_string()
}

const CSV: &str = "\
problem,nc,ndof,tol,solver,status,iters,seconds,error,residu,seconds_first
a.dat,2,6,1e-4,NSGS,0,12,1e-3,9e-5,9e-5,1e-2
a.dat,2,6,1e-4,LIAR,0,0,1e-6,2e-2,1e-9,1e-2
b.hdf5.dat,2,6,1e-4,LATE,1,7,0.5,1e-5,nan,1e-2
a.dat,2,6,1e-8,NSGS,timeout*,-1,3,nan,nan,3
a.dat,2,6,1e-8,LIAR,signal11,-1,0.1,1e0,nan,3
other.dat,2,6,1e-8,NSGS,2,8,0.1,inf,nan,3
a.dat,3,9,1e-10,NSGS,0,8,0.1,1e-11,nan,3
twin.dat,1,3,1e-8,NSGS,0,8,0.1,1e-9,nan,3
";

#[test]
fn a_row_is_solved_by_its_error_and_never_by_its_status() {
    let read = read("peer.csv", CSV);
    assert_eq!(read.mistakes, [""; 0]);
    let runs = &read.runs.runs;
    let endings: Vec<_> = runs.iter().map(|r| r.ending).collect();
    use Ending::{Crashed, Failed, Solved, TimeLimit};
    assert_eq!(endings, [Solved, Failed, Solved, TimeLimit, Crashed, Failed, Solved, Solved]);
    assert_eq!(runs[1].message.as_deref(), Some("status 0, error 2e-2"));
    assert_eq!(runs[3].message.as_deref(), Some("status timeout*, no finite error"));
    assert_eq!((runs[0].solver.as_str(), runs[0].seconds), ("NSGS (Peer 1.2)", Some(1e-3)));
    assert_eq!((runs[0].residuals.siconos, runs[0].residuals.reached), (Some(9e-5), Some(9e-5)));
    assert_eq!(runs[0].residuals.relative, None);
    assert_eq!((runs[0].iterations, runs[3].iterations), (Some(12), None));
    // A solver that never counts above 0 does not count.
    assert_eq!(runs[1].iterations, None);
    let campaign = &read.runs.campaigns[0];
    assert!(
        campaign.foreign && campaign.machine.cpu == "a cluster" && campaign.program == "Peer 1.2"
    );
}

#[test]
fn problems_join_by_name_and_size() {
    let read = read("peer.csv", CSV);
    let names: Vec<_> = read.runs.runs.iter().map(|r| r.problem.as_str()).collect();
    let (a, b) = ("fc3d/a", "fc3d/b");
    let own = ["unmatched/other", "unmatched/a", "unmatched/twin"];
    assert_eq!(names, [a, a, b, a, a, own[0], own[1], own[2]]);
    assert_eq!(
        (read.runs.runs[2].kind.as_str(), read.runs.runs[2].family.as_str()),
        ("friction_local_3d", "fc3d")
    );
    assert_eq!(read.runs.runs[5].family, UNMATCHED);
    assert_eq!(
        read.notes,
        [
            "8 of 8 rows read; 2 problems matched, 3 not",
            "several known problems have the name of 1 problem: not matched",
            "success claimed with an error above the tolerance in 1 row: not solved",
            "iterations never above 0, taken as not known: LIAR (Peer 1.2)",
        ]
    );
}

#[test]
fn what_is_written_reads_back_and_joins_ours() {
    let read = read("peer.csv", CSV);
    let mut back = Runs::parse(Path::new("peer.jsonl"), &read.text()).unwrap();
    assert_eq!(back, read.runs);
    let mut ours = crate::common::campaign("a");
    ours.runs = vec![crate::common::run("fc3d/a", "nsgs", 1.0)];
    assert_eq!(back.join(ours), <_>::default());
    assert_eq!(back.solvers(), ["NSGS (Peer 1.2)", "LIAR (Peer 1.2)", "LATE (Peer 1.2)", "nsgs"]);
    assert!(back.campaign(&back.runs[0]).unwrap().foreign);
}

#[test]
fn json_says_the_same_as_csv() {
    let csv = read("peer.csv", CSV);
    let head: Vec<&str> = CSV.lines().next().unwrap().split(',').collect();
    let object = |line: &str| {
        let value = |(k, cell): (&&str, &str)| {
            // JSON has no nan: null. Numbers as numbers, all else as texts.
            let cell = match cell.parse::<f64>() {
                Ok(x) if x.is_finite() => serde_json::from_str(cell).unwrap(),
                Ok(_) => serde_json::Value::Null,
                Err(_) => cell.into(),
            };
            ((*k).to_owned(), cell)
        };
        serde_json::Value::Object(head.iter().zip(line.split(',')).map(value).collect()).to_string()
    };
    let objects: Vec<String> = CSV.lines().skip(1).map(object).collect();
    for (name, text) in
        [("peer.jsonl", objects.join("\n")), ("peer.json", format!("[{}]", objects.join(",\n")))]
    {
        let json = read(name, &text);
        assert_eq!((&json.runs, &json.notes), (&csv.runs, &csv.notes));
    }
}

#[test]
fn without_an_error_the_status_is_believed_and_that_is_said() {
    let read = read(
        "p.csv",
        "problem,solver,tol,seconds,status\na,S,1e-4,1,0\na,S,1e-5,1,solved\na,S,1e-6,1,iteration_limit\n",
    );
    let endings: Vec<_> = read.runs.runs.iter().map(|r| r.ending).collect();
    assert_eq!(endings, [Ending::Solved, Ending::Solved, Ending::IterationLimit]);
    assert!(read.notes.iter().any(|n| n.contains("own word")), "{:?}", read.notes);
}

#[test]
fn rows_that_are_skipped_count_for_nothing() {
    let row = |problem: &str, iterations: &str| format!("{problem},S,1e-8,1,1e-3,0,{iterations}\n");
    let rows = [("o", "5"), ("o", "5"), ("a", "x"), ("p", "x"), ("twin", "x")];
    let rows: String = rows.map(|(problem, iterations)| row(problem, iterations)).concat();
    let read = read("p.csv", &format!("problem,solver,tol,seconds,error,status,iters\n{rows}"));
    assert_eq!(read.mistakes.len(), 4, "{:?}", read.mistakes);
    assert_eq!(
        read.notes,
        [
            "1 of 5 rows read; 0 problems matched, 1 not",
            "success claimed with an error above the tolerance in 1 row: not solved",
        ]
    );
}

#[test]
fn files_of_every_format_join_by_name() {
    let head = "problem,solver,tol,seconds,error\n";
    for extension in ["dat", "hdf5", "h5", "toml", "mtx", "nl", "nl.dat"] {
        let read = read("p.csv", &format!("{head}x/a.{extension},S,1e-8,1,1e-9\n"));
        assert_eq!(read.runs.runs[0].problem, "fc3d/a", "{extension}");
    }
    let read = read("p.csv", &format!("{head}a.v2,S,1e-8,1,1e-9\n"));
    assert_eq!(read.runs.runs[0].problem, "unmatched/a.v2");
}

#[test]
fn a_mistake_in_a_row_is_named_and_the_others_are_read() {
    let text = "\
problem,solver,tol,seconds,error,nc
a,S,1e-4,1.0,1e-5,2
a,S,abc,1.0,1e-5,2
a,S,-1,1.0,1e-5,2
a,S,1e-5,-2,1e-5,2
a,S,1e-6,1.0
,S,1e-6,1.0,1e-5,2
a,,1e-6,1.0,1e-5,2
a,S,1e-4,2.0,1e-5,2
a,S,,1.0,1e-5,2
a,S,1e-7,1.0,1e-9,2.5
b,S,1e-4,1.0,1e-5,2
";
    let read = read("p.csv", text);
    assert_eq!(read.runs.runs.len(), 2);
    assert_eq!(
        read.mistakes,
        [
            "p.csv, line 3: tolerance: expected a number, found \"abc\"",
            "p.csv, line 4: tolerance: expected a positive number, found -1",
            "p.csv, line 5: seconds: expected a number of at least 0, found -2",
            "p.csv, line 6: expected 6 fields, found 4",
            "p.csv, line 7: problem: expected a name, found nothing",
            "p.csv, line 8: solver: expected a name, found nothing",
            "p.csv, line 9: expected one row for a, S and tolerance 1e-4, found another before",
            "p.csv, line 10: tolerance: expected a number, found nothing",
            "p.csv, line 11: contacts: expected a whole number, found 2.5",
        ]
    );
    let read = self::read(
        "p.jsonl",
        "{\"problem\": \"a\", \"solver\": \"S\", \"tol\": 1e-4, \"seconds\": 1, \"error\": 0}\n[1]\n{\n",
    );
    assert_eq!(read.runs.runs.len(), 1);
    assert!(
        read.mistakes[0].starts_with("p.jsonl, line 2: expected an object"),
        "{:?}",
        read.mistakes
    );
    assert!(
        read.mistakes[1].starts_with("p.jsonl, line 3: expected an object"),
        "{:?}",
        read.mistakes
    );
}

#[test]
fn what_is_no_table_is_refused() {
    for (name, text, part) in [
        ("p.csv", "", "expected a column `problem`, found"),
        (
            "p.csv",
            "problem,solver,tol\n",
            "expected a column `seconds`, found the columns problem, solver, tolerance",
        ),
        ("p.csv", "problem,solver,tol,seconds\n", "expected a column `error` or `status`"),
        ("p.json", "[{]", "expected an array of objects"),
        ("p.json", "", "expected a column `problem`, found no columns"),
    ] {
        let message = refused(name, text);
        assert!(message.contains(part) && !message.contains('\n'), "{message}");
    }
    assert!(
        import(Path::new("nowhere.csv"), &source(), &[])
            .unwrap_err()
            .to_string()
            .contains("nowhere.csv")
    );
}

#[test]
fn the_tables_of_the_corpus_are_read_and_matched() {
    let Some(corpus) = corpus() else { return };
    let all = problems(&corpus).unwrap();
    let tables: Vec<PathBuf> = std::fs::read_dir(&corpus)
        .unwrap()
        .map(|entry| entry.unwrap().path())
        .filter(|path| {
            let name = path.file_name().unwrap().to_string_lossy().into_owned();
            name.starts_with("siconos_") && name.ends_with(".csv")
        })
        .collect();
    assert!(!tables.is_empty());
    for table in tables {
        let read = import(&table, &source(), &all).unwrap();
        let text = std::fs::read_to_string(&table).unwrap();
        assert_eq!(read.mistakes, [""; 0]);
        assert_eq!(read.runs.runs.len(), text.lines().count() - 1);
        // Solved as the table's own numbers say, read by a few lines of other code.
        let head: Vec<&str> = text.lines().next().unwrap().split(',').collect();
        let column = |name| head.iter().position(|h| *h == name).unwrap();
        let (tolerance, error) = (column("tol"), column("error"));
        let solved = text.lines().skip(1).filter(|line| {
            let cells: Vec<&str> = line.split(',').collect();
            cells[error].parse::<f64>().unwrap() <= cells[tolerance].parse::<f64>().unwrap()
        });
        assert_eq!(read.runs.runs.iter().filter(|r| r.solved()).count(), solved.count());
        // The problems are all in the corpus, but for one in the plane.
        let name = table.file_name().unwrap().to_string_lossy().into_owned();
        let unmatched = read.runs.problems.values().filter(|p| p.family == UNMATCHED).count();
        let expected = usize::from(name == "siconos_fc2d.csv");
        assert_eq!(unmatched, expected, "{name}");
    }
}

#[test]
fn lines_are_counted_alike_for_all_ends_of_lines_and_marks_of_encodings() {
    let text = CSV.replace("0.5,1e-5", "fast,1e-5");
    for text in [text.clone(), text.replace('\n', "\r\n"), format!("\u{feff}{text}")] {
        let mistakes = read("peer.csv", &text).mistakes;
        assert_eq!(mistakes, ["peer.csv, line 4: seconds: expected a number, found \"fast\""]);
    }
    let json = r#"[{"problem":"a","solver":"S","tol":1e-4,"seconds":1,"error":1e-5}]"#;
    assert_eq!(read("peer.json", &format!("\u{feff}{json}")).runs.runs.len(), 1);
}

#[test]
fn a_column_that_stands_twice_is_refused() {
    let e = refused("t.csv", "problem,solver,tol,tolerance,seconds,error\na,s,1e-4,1e-8,1,1e-5\n");
    assert!(e.ends_with("expected one column `tolerance`, found several"), "{e}");
    // In JSON each row has its own.
    let row = |iterations: &str| {
        format!(r#"{{"problem":"a","solver":"S","tol":1e-4,"seconds":1,"error":1,{iterations}}}"#)
    };
    let rows = [row(r#""iters":3"#), row(r#""iters":3,"iterations":4"#)];
    let array = format!("[{}]", rows.join(","));
    for (name, text, place) in
        [("t.jsonl", rows.join("\n"), "line 2"), ("t.json", array, "entry 2")]
    {
        let read = read(name, &text);
        let said = format!("{name}, {place}: expected one column `iterations`, found several");
        assert_eq!((read.mistakes, read.runs.runs.len()), (vec![said], 1));
    }
}

#[test]
fn words_for_success_that_are_not_known_are_told() {
    let table = |word: &str| format!("problem,solver,tol,seconds,status\na,s,1e-4,1,{word}\n");
    assert!(read("t.csv", &table("Solved")).runs.runs[0].solved());
    let other = read("t.csv", &table("converged"));
    assert!(!other.runs.runs[0].solved());
    assert!(other.notes.iter().any(|n| n.contains("none counts as solved")), "{:?}", other.notes);
}
