//! Every command of the documentation runs, in the order of its document, in a folder that looks like the checkout; one trial a document.
//!
//! A command is a line of an `sh` block, or a table cell that begins with `nonsmooth`. It ends with exit code 0, or with N where its remark (or what
//! follows it in the cell, in brackets) begins with "exits N:"; the files that it writes are there afterwards; and where a `text` block follows a single
//! command, its words are those that the command prints, numbers and times apart.
//! The remark `<!-- not run: REASON -->` before a block leaves it out.

mod common;

use std::collections::BTreeSet;
use std::path::{Path, PathBuf};
use std::process::Command;

use libtest_mimic::{Arguments, Failed, Trial};
use pulldown_cmark::{CodeBlockKind, Event, Options, Parser, Tag, TagEnd};

use crate::common::{Folder, Run};

fn main() {
    let documents = documents();
    let commands = documents.iter().flat_map(|d| &d.commands).map(|c| c.line.clone()).collect();
    let mut trials: Vec<_> = documents
        .into_iter()
        .filter(|d| !d.commands.is_empty())
        .map(|d| Trial::test(d.name.clone(), move || d.run()))
        .collect();
    trials.push(Trial::test("every command of the program is shown", || every_command(commands)));
    trials.push(Trial::test("the tour of the lecture is complete", || {
        the_tour_of_the_lecture_is_complete();
        Ok(())
    }));
    trials.push(Trial::test("documents are read as their readers read them", || {
        documents_are_read_as_their_readers_read_them();
        Ok(())
    }));
    libtest_mimic::run(&Arguments::from_args(), trials).exit();
}

/// A document and its commands in their order.
struct Document {
    name: String,
    commands: Vec<Shown>,
}

/// A command as a document shows it.
#[derive(Debug, PartialEq)]
struct Shown {
    /// Counted from 1.
    place: usize,
    line: String,
    exit: i32,
    /// What it prints, according to the document.
    output: Option<String>,
}

fn root() -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("../..")
}

/// README.md, that of the examples, and all below docs/.
fn documents() -> Vec<Document> {
    let mut names = vec!["README.md".to_owned(), "examples/README.md".to_owned()];
    let mut folders = vec!["docs".to_owned()];
    while let Some(folder) = folders.pop() {
        for entry in std::fs::read_dir(root().join(&folder)).unwrap() {
            let entry = entry.unwrap();
            let name = format!("{folder}/{}", entry.file_name().to_str().unwrap());
            match entry.file_type().unwrap().is_dir() {
                true => folders.push(name),
                false if name.ends_with(".md") => names.push(name),
                false => {}
            }
        }
    }
    names.sort();
    let read = |name: String| {
        let text = std::fs::read_to_string(root().join(&name)).unwrap();
        let commands = commands(&text).unwrap_or_else(|e| panic!("{name}:{e}"));
        Document { name, commands }
    };
    names.into_iter().map(read).collect()
}

/// The commands of a text in Markdown.
fn commands(text: &str) -> Result<Vec<Shown>, String> {
    let place = |at: usize| text[..at].matches('\n').count() + 1;
    let mut found: Vec<Shown> = Vec::new();
    let mut events = Parser::new_ext(text, Options::ENABLE_TABLES).into_offset_iter().peekable();
    // The reason for which the next block is not run; how many commands the block just before has.
    let (mut left_out, mut before) = (None, 0);
    while let Some((event, range)) = events.next() {
        match event {
            Event::Html(html) => {
                if let Some(rest) = html.trim().strip_prefix("<!-- not run:") {
                    let reason = rest.strip_suffix("-->").unwrap_or("").trim();
                    if reason.is_empty() {
                        return Err(format!("{}: not run, without a reason", place(range.start)));
                    }
                    left_out = Some(reason.to_owned());
                }
            }
            Event::Start(Tag::CodeBlock(kind)) => {
                let mut block = String::new();
                while let Some((Event::Text(part), _)) =
                    events.next_if(|(e, _)| matches!(e, Event::Text(_)))
                {
                    block.push_str(&part);
                }
                let language = match &kind {
                    CodeBlockKind::Fenced(language) => &**language,
                    CodeBlockKind::Indented => "",
                };
                let first = place(range.start) + 1;
                let count = found.len();
                match language {
                    "sh" if left_out.is_none() => found.extend(lines(&block, first)),
                    "sh" => {}
                    "text" if before == 1 => found.last_mut().unwrap().output = Some(block),
                    // Else a command could hide from this test behind another word.
                    _ if block.lines().any(is_command) => {
                        return Err(format!("{first}: commands stand in blocks marked sh"));
                    }
                    _ => {}
                }
                (left_out, before) = (None, found.len() - count);
            }
            Event::Start(Tag::TableCell) => {
                if let Some((Event::Code(line), _)) = events
                    .next_if(|(e, _)| matches!(e, Event::Code(c) if c.starts_with("nonsmooth ")))
                {
                    let mut remark = String::new();
                    while let Some((event, _)) =
                        events.next_if(|(e, _)| *e != Event::End(TagEnd::TableCell))
                    {
                        if let Event::Text(part) = event {
                            remark.push_str(&part);
                        }
                    }
                    let exit = exit(remark.trim_start().trim_start_matches('('));
                    found.push(Shown {
                        place: place(range.start),
                        line: line.to_string(),
                        exit,
                        output: None,
                    });
                }
            }
            Event::Start(Tag::Paragraph | Tag::Heading { .. } | Tag::List(_)) => {
                (left_out, before) = (None, 0)
            }
            _ => {}
        }
    }
    Ok(found)
}

/// Not a dependency (`nonsmooth = …`), for instance.
fn is_command(line: &str) -> bool {
    let rest = line.strip_prefix("nonsmooth ");
    rest.is_some_and(|r| r.starts_with(|c: char| c.is_ascii_lowercase()))
}

/// The commands of a block that begins in line `first`; those that end with `\` go on in the next line.
fn lines(block: &str, first: usize) -> Vec<Shown> {
    let mut shown = Vec::new();
    let mut begun: Option<(usize, String)> = None;
    for (k, line) in block.lines().enumerate() {
        let (place, mut whole) = begun.take().unwrap_or((first + k, String::new()));
        whole.push_str(line);
        if let Some(part) = whole.strip_suffix('\\') {
            begun = Some((place, part.to_owned()));
            continue;
        }
        let (command, remark) = whole.split_once(" # ").unwrap_or((&whole, ""));
        if !command.trim().is_empty() && !command.starts_with('#') {
            shown.push(Shown {
                place,
                line: command.trim().to_owned(),
                exit: exit(remark),
                output: None,
            });
        }
    }
    shown
}

/// The exit code that a remark announces.
fn exit(remark: &str) -> i32 {
    let announced = remark.trim_start().strip_prefix("exits ").and_then(|r| r.split_once(':'));
    announced.map_or(0, |(code, _)| code.trim().parse().unwrap())
}

impl Document {
    fn run(&self) -> Result<(), Failed> {
        let folder = Folder::new();
        for part in ["examples", "docs"] {
            copy(&root().join(part), &folder.path(part));
        }
        let mistakes: Vec<_> = self
            .commands
            .iter()
            .filter_map(|c| Some(format!("{}:{}", self.name, c.run(&folder)?)))
            .collect();
        if mistakes.is_empty() { Ok(()) } else { Err(mistakes.join("\n").into()) }
    }
}

impl Shown {
    /// Runs it in the folder, and says what is wrong.
    fn run(&self, folder: &Folder) -> Option<String> {
        let program = Path::new(env!("CARGO_BIN_EXE_nonsmooth"));
        let path = std::env::var_os("PATH").unwrap_or_default();
        let paths = std::iter::once(program.parent().unwrap().to_owned())
            .chain(std::env::split_paths(&path));
        let output = Command::new("sh")
            .args(["-c", &self.line])
            .current_dir(folder)
            .env("PATH", std::env::join_paths(paths).unwrap())
            .output();
        let run = Run::from(output.unwrap());
        let mistake = if run.code != Some(self.exit) {
            format!(
                "exit code {:?}, expected {}\n{}{}",
                run.code, self.exit, run.stdout, run.stderr
            )
        } else if let Some(file) = self.files().into_iter().find(|f| !folder.path(f).exists()) {
            format!("{file} is not there")
        } else {
            let (shown, printed) = (words(self.output.as_deref()?), words(&run.stdout));
            if shown == printed {
                return None;
            }
            let only =
                |a: &BTreeSet<&str>, b| a.difference(b).copied().collect::<Vec<_>>().join(" ");
            let (shown, printed) = (only(&shown, &printed), only(&printed, &shown));
            format!("shown, not printed: {shown}; printed, not shown: {printed}\n{}", run.stdout)
        };
        Some(format!("{}: {}: {mistake}", self.place, self.line))
    }

    /// The files that the command names as its results.
    fn files(&self) -> Vec<String> {
        let words: Vec<_> = self.line.split_whitespace().collect();
        let after = |pair: &[&str]| {
            ["--out", "--plot", "--trace", "--draw", "--certificate", ">"]
                .contains(&pair[0])
                .then(|| pair[1].to_owned())
        };
        let mut files: Vec<_> = words.windows(2).filter_map(after).filter(|f| f != "-").collect();
        if let ["nonsmooth", "convert", _, to] = words[..] {
            files.push(to.to_owned());
        }
        files
    }
}

/// The words of an output that depend neither on the machine nor on rounding: no numbers (but those of the problem), no units of time, and in no order,
/// since solvers are listed by their times.
fn words(output: &str) -> BTreeSet<&str> {
    let mut words = BTreeSet::new();
    for line in output.lines() {
        let of_problem = line.trim_start().starts_with("problem ");
        let bare = line.split_whitespace().map(|w| w.trim_matches(|c: char| ",;:()".contains(c)));
        let steady =
            |w: &&str| of_problem || w.parse::<f64>().is_err() && !["s", "ms", "us"].contains(w);
        words.extend(bare.filter(steady));
    }
    words
}

fn copy(from: &Path, to: &Path) {
    std::fs::create_dir(to).unwrap();
    for entry in std::fs::read_dir(from).unwrap() {
        let entry = entry.unwrap();
        let to = to.join(entry.file_name());
        match entry.file_type().unwrap().is_dir() {
            true => copy(&entry.path(), &to),
            false => drop(std::fs::copy(entry.path(), to).unwrap()),
        }
    }
}

/// Each command that `--help` lists, `bench` with its own, is among those that the documents show and this test runs.
fn every_command(shown: Vec<String>) -> Result<(), Failed> {
    let folder = Folder::new();
    let listed = |before: &str| -> Vec<String> {
        let help = folder.run(&format!("{before} --help")).exits(0).stdout;
        let list = help.split_once("Commands:\n").unwrap().1.split("\n\n").next().unwrap();
        // The texts of the commands go on in lines that are indented further.
        let lines = list.lines().filter(|l| l.starts_with("  ") && !l.starts_with("   "));
        let names = lines.map(|l| l.split_whitespace().next().unwrap()).filter(|n| *n != "help");
        names.map(|name| format!("nonsmooth {before} {name}").replace("  ", " ")).collect()
    };
    let commands: Vec<_> = [listed(""), listed("bench")].concat();
    assert!(commands.len() > 15, "{commands:?}");
    let is_shown = |c: &String| {
        shown
            .iter()
            .any(|line| line.split(" | ").any(|l| format!("{l} ").starts_with(&format!("{c} "))))
    };
    let missing: Vec<_> = commands.into_iter().filter(|c| !is_shown(c)).collect();
    if missing.is_empty() {
        Ok(())
    } else {
        Err(format!("no document shows {}", missing.join(", ")).into())
    }
}

/// Each of the lecture's equations has a row, each row a command or the reason why there is none, and what a command runs cites the lecture.
fn the_tour_of_the_lecture_is_complete() {
    let text = std::fs::read_to_string(root().join("docs/lecture.md")).unwrap();
    let mut equations = BTreeSet::new();
    for row in text
        .lines()
        .filter(|l| l.starts_with("| ") && !l.starts_with("| lecture ") && !l.starts_with("| ---"))
    {
        let cells: Vec<_> = row.trim_matches('|').split(" | ").map(str::trim).collect();
        let [lecture, here, command, seen] = cells[..] else { panic!("four cells: {row}") };
        let to_come = here.contains("comes with the nonlinear problems")
            || here.contains("comes with the simulation");
        assert_eq!(to_come, command == "–" && seen == "–", "{row}");
        assert!(
            to_come || command.starts_with("`nonsmooth ") && !here.is_empty() && !seen.is_empty(),
            "{row}"
        );
        // (12), (74a) and ranges (33)–(45).
        let number = |part: &str| {
            part.trim_start_matches('(')
                .split(|c: char| !c.is_ascii_digit())
                .next()?
                .parse::<usize>()
                .ok()
        };
        let mut numbers = Vec::new();
        for part in lecture.split_inclusive(')') {
            let Some(at) = part.rfind('(') else { continue };
            let Some(n) = number(&part[at..]) else { continue };
            let first =
                if part[..at].ends_with('–') { numbers.last().map_or(n, |l| l + 1) } else { n };
            numbers.extend(first..=n);
        }
        equations.extend(numbers);
    }
    let missing: Vec<_> = (1..=124).filter(|n| !equations.contains(n)).collect();
    assert!(missing.is_empty() && equations.len() == 124, "no row has {missing:?}");

    let list: serde_json::Value =
        serde_json::from_str(&Folder::new().run("list --json").exits(0).stdout).unwrap();
    let citing: BTreeSet<&str> = ["solvers", "reformulations"]
        .iter()
        .flat_map(|k| list[k].as_array().unwrap())
        .filter(|s| s["cites"].as_array().unwrap().iter().any(|c| c == "Acary2018"))
        .map(|s| s["name"].as_str().unwrap().trim_end_matches('/'))
        .collect();
    let commands = commands(&text).unwrap();
    let names = commands
        .iter()
        .flat_map(|c| c.line.split("--solver ").skip(1))
        .map(|c| c.split([' ', ':']).next().unwrap());
    for part in names.flat_map(|name| name.split('/')) {
        assert!(
            citing.contains(part),
            "{part} is shown on the tour and does not cite Acary2018; {citing:?}"
        );
    }
}

fn documents_are_read_as_their_readers_read_them() {
    let text = "\
```sh
nonsmooth a --out b.svg   # exits 1: no solution
nonsmooth c \\
    --draw d.svg --out -
```

```text
what c prints
```

<!-- not run: takes a day -->
```sh
nonsmooth d
```

| what | command |
| --- | --- |
| e | `nonsmooth e > f` (exits 2: refused) |
| g | the option `nonsmooth g` |
";
    let shown = commands(text).unwrap();
    let summary: Vec<_> =
        shown.iter().map(|c| (c.place, c.line.as_str(), c.exit, c.files())).collect();
    let files = |names: &[&str]| names.iter().map(|n| (*n).to_owned()).collect::<Vec<_>>();
    assert_eq!(
        summary,
        [
            (2, "nonsmooth a --out b.svg", 1, files(&["b.svg"])),
            (3, "nonsmooth c     --draw d.svg --out -", 0, files(&["d.svg"])),
            (18, "nonsmooth e > f", 2, files(&["f"])),
        ]
    );
    assert!(shown.iter().all(|c| c.output.is_none()), "an output of two commands is nobody's");
    assert_eq!(
        commands("```sh\nnonsmooth a\n```\n\n```text\nb 1e-8 s\n```\n").unwrap()[0]
            .output
            .as_deref(),
        Some("b 1e-8 s\n")
    );
    assert!(commands("```console\nnonsmooth a\n```\n").is_err());
    assert!(commands("```toml\nnonsmooth = \"0.1\"\n```\n").unwrap().is_empty());
    assert!(commands("<!-- not run: -->\n```sh\nnonsmooth a\n```\n").is_err());
    // What a command does wrong is seen.
    let folder = Folder::new();
    let wrong = |text: &str| commands(text).unwrap()[0].run(&folder);
    assert!(wrong("```sh\ntrue\n```\n").is_none());
    assert!(wrong("```sh\nfalse\n```\n").unwrap().contains("exit code Some(1)"));
    assert!(wrong("```sh\ntrue --out x.svg\n```\n").unwrap().contains("x.svg is not there"));
    assert!(wrong("```sh\necho 2 rocks\n```\n```text\n3 rocks\n```\n").is_none());
    assert!(wrong("```sh\necho 2 rocks\n```\n```text\n2 socks\n```\n").unwrap().contains("socks"));
}
