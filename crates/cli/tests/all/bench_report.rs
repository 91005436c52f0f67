//! `nonsmooth bench report`: files of runs become a page, and a file at fault does not keep the others from it.

use std::fs;

use crate::common::Folder;

/// A file of runs by one solver on two problems, in the given version of the format.
fn runs(version: u32, solver: &str) -> String {
    let machine = r#"{"cpu":"a processor","cores":2,"memory":8589934592,"os":"an OS"}"#;
    let run = |problem: &str, ending: &str| {
        format!(
            r#"{{"line":"run","campaign":"{solver}","problem":"{problem}","solver":"{solver}","tolerance":1e-8,"ending":"{ending}","seconds":0.5}}"#
        )
    };
    format!(
        "{{\"line\":\"campaign\",\"format\":\"nonsmooth-runs\",\"version\":{version},\"id\":\"{solver}\",\
         \"program\":\"a program 1.0\",\"machine\":{machine}}}\n{}\n{}\n",
        run("a/1", "solved"),
        run("a/2", "stalled")
    )
}

#[test]
fn files_are_joined_into_a_page() {
    let folder = Folder::new();
    fs::write(folder.path("one.jsonl"), runs(1, "one")).unwrap();
    fs::write(folder.path("two.jsonl"), runs(1, "two")).unwrap();
    let done = folder
        .run("bench report one.jsonl two.jsonl one.jsonl --out page.html --title A<B")
        .exits(0);
    assert!(done.stdout.starts_with("page.html: 4 runs of 2 solvers"), "{}", done.stdout);
    assert!(done.stdout.contains("2 runs in several files"), "{}", done.stdout);
    let page = fs::read_to_string(folder.path("page.html")).unwrap();
    assert!(page.contains("<h1>A&lt;B</h1>") && page.contains("2 problems, 2 solvers, 4 runs"));
}

#[test]
fn a_file_of_another_version_is_named_and_the_rest_goes_on() {
    let folder = Folder::new();
    fs::write(folder.path("one.jsonl"), runs(1, "one")).unwrap();
    fs::write(folder.path("new.jsonl"), runs(7, "two")).unwrap();
    let done = folder.run("bench report new.jsonl one.jsonl --out page.html");
    let said = ["new.jsonl", "expected version 1", "found version 7", "a program 1.0"];
    assert!(said.iter().all(|s| done.stderr.contains(s)), "{}", done.stderr);
    assert_eq!((done.code, done.stderr.lines().count()), (Some(2), 1));
    assert!(done.stdout.starts_with("page.html: 2 runs of 1 solver,"), "{}", done.stdout);
    assert!(folder.path("page.html").exists());
}

#[test]
fn mistakes_are_refused_before_anything_is_written() {
    let folder = Folder::new();
    fs::write(folder.path("one.jsonl"), runs(1, "one")).unwrap();
    fs::create_dir(folder.path("folder")).unwrap();
    folder.run("bench report one.jsonl --out one.jsonl").refused(&[
        "--out",
        "one.jsonl",
        "expected a file of its own",
        "found",
    ]);
    folder.run("bench report one.jsonl --out folder").refused(&[
        "--out",
        "folder",
        "expected a file",
        "found a directory",
    ]);
    assert_eq!(fs::read_to_string(folder.path("one.jsonl")).unwrap(), runs(1, "one"));
    fs::write(folder.path("text.jsonl"), "not runs").unwrap();
    let done = folder.run("bench report text.jsonl missing.jsonl --out page.html");
    assert_eq!((done.code, done.stderr.lines().count()), (Some(2), 3), "{}", done.stderr);
    assert!(!folder.path("page.html").exists());
}
