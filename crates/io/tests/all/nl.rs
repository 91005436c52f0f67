//! AMPL's files: text and binary, what is read of them and what is refused, round trips, solutions.

use std::path::{Path, PathBuf};

use std::sync::Arc;

use nonsmooth_io::nl::{Form, Model, Nl, Options, Refusal, Solution};
use nonsmooth_io::{Format, Info, ProblemFile, StoredPoint, holds_problem, parts};
use nonsmooth_problem::field::{Binary, Expressions, Graph, Nary, Node, Piecewise, Unary};
use nonsmooth_problem::{LcpPoint, Mcp, Problem};

// ------------------------------------------------------------------------------------------------ forms

/// The text of a file in binary form: what AMPL writes with `option nl_comments 0` and the letter b.
pub fn binary(text: &str, form: Form) -> Vec<u8> {
    let mut lines = text.lines().map(|l| l.split('#').next().unwrap().trim());
    let raw: Vec<_> = text.lines().collect();
    let mut out = vec![];
    for k in 0..10 {
        let line = lines.next().unwrap();
        let line = match k {
            0 => raw[0].replacen('g', "b", 1),
            5 => {
                let mut words: Vec<_> = line.split_whitespace().collect();
                words[2] = if form == Form::LittleEndian { "1" } else { "2" };
                words.join(" ")
            }
            _ => raw[k].to_owned(),
        };
        out.extend_from_slice(line.as_bytes());
        out.push(b'\n');
    }
    let mut lines = lines.filter(|l| !l.is_empty());
    let rows: Vec<usize> = raw[1].split_whitespace().take(2).map(|w| w.parse().unwrap()).collect();
    let mut put = Put { out, form };
    while let Some(line) = lines.next() {
        let (letter, rest) = line.split_at(1);
        let words: Vec<_> = rest.split_whitespace().collect();
        put.out.push(line.as_bytes()[0]);
        match letter {
            "C" => {
                put.whole(words[0]);
                put.expression(&mut lines);
            }
            "V" => {
                words.iter().for_each(|w| put.whole(w));
                put.pairs(&mut lines, words[1], false);
                put.expression(&mut lines);
            }
            "O" => {
                words.iter().for_each(|w| put.whole(w));
                put.expression(&mut lines);
            }
            "x" | "d" => {
                put.whole(words[0]);
                put.pairs(&mut lines, words[0], false);
            }
            "J" | "G" => {
                words.iter().for_each(|w| put.whole(w));
                put.pairs(&mut lines, words[1], false);
            }
            "S" => {
                words[..2].iter().for_each(|w| put.whole(w));
                put.name(words[2]);
                put.pairs(&mut lines, words[1], words[0].parse::<i32>().unwrap() & 4 == 0);
            }
            "F" => {
                words[..3].iter().for_each(|w| put.whole(w));
                put.name(words[3]);
            }
            "k" | "K" => {
                put.whole(words[0]);
                for _ in 0..words[0].parse().unwrap() {
                    put.whole(lines.next().unwrap());
                }
            }
            "r" | "b" => {
                for _ in 0..rows[usize::from(letter == "r")] {
                    let words: Vec<_> = lines.next().unwrap().split_whitespace().collect();
                    put.out.push(words[0].as_bytes()[0]);
                    let whole = words[0] == "5";
                    words[1..].iter().for_each(|w| if whole { put.whole(w) } else { put.real(w) });
                }
            }
            other => panic!("segment {other}"),
        }
    }
    put.out
}

struct Put {
    out: Vec<u8>,
    form: Form,
}

impl Put {
    fn bytes(&mut self, mut bytes: Vec<u8>) {
        if self.form == Form::BigEndian {
            bytes.reverse();
        }
        self.out.extend(bytes);
    }

    fn whole(&mut self, word: &str) {
        self.bytes(word.parse::<i32>().unwrap().to_le_bytes().into());
    }

    fn real(&mut self, word: &str) {
        self.bytes(word.parse::<f64>().unwrap().to_le_bytes().into());
    }

    fn name(&mut self, word: &str) {
        self.whole(&word.len().to_string());
        self.out.extend(word.as_bytes());
    }

    fn pairs<'a>(&mut self, lines: &mut impl Iterator<Item = &'a str>, count: &str, whole: bool) {
        for _ in 0..count.parse().unwrap() {
            let (j, x) = lines.next().unwrap().split_once(char::is_whitespace).unwrap();
            self.whole(j);
            if whole { self.whole(x.trim()) } else { self.real(x.trim()) }
        }
    }

    fn expression<'a>(&mut self, lines: &mut impl Iterator<Item = &'a str>) {
        let mut left = 1;
        while left > 0 {
            left -= 1;
            let (letter, rest) = lines.next().unwrap().split_at(1);
            self.out.push(letter.as_bytes()[0]);
            match letter {
                "n" => self.real(rest),
                "s" => self.bytes(rest.parse::<i16>().unwrap().to_le_bytes().into()),
                "l" | "v" => self.whole(rest),
                "o" => {
                    self.whole(rest);
                    let mut count = || {
                        let count = lines.next().unwrap();
                        self.whole(count);
                        count.parse::<usize>().unwrap()
                    };
                    left += match rest.parse().unwrap() {
                        13..=16 | 34 | 37..=47 | 49..=53 | 77 | 79 => 1,
                        35 | 65 | 72 => 3,
                        11 | 12 | 54 | 59..=61 | 70 | 71 | 74 | 75 => count(),
                        64 => 2 * count(),
                        _ => 2,
                    };
                }
                other => panic!("{other}"),
            }
        }
    }
}

fn model(name: &str, bytes: &[u8]) -> Model {
    Model::parse(Path::new(name), bytes, &Options::default()).unwrap_or_else(|e| panic!("{e}"))
}

fn values(problem: &Mcp, x: &[f64]) -> Vec<f64> {
    let mut f = vec![0.0; x.len()];
    assert!(problem.F.evaluator().value(x, &mut f), "{f:?}");
    f
}

// ------------------------------------------------------------------------------------------------ the corpus

/// The largest entry of `x − mid(l, u, x − F(x))`.
fn natural(problem: &Mcp, x: &[f64]) -> f64 {
    let f = values(problem, x);
    (0..x.len()).map(|i| (x[i] - problem.project(i, x[i] - f[i])).abs()).fold(0.0, f64::max)
}

/// The numbers of `"key": …` in a text of JSON.
fn numbers(json: &str, key: &str) -> Vec<f64> {
    let Some((_, rest)) = json.split_once(&format!("\"{key}\": ")) else { return vec![] };
    let rest = rest.trim_start_matches('[');
    let end = rest.find([']', '}', '"']).unwrap();
    rest[..end].split(',').filter_map(|w| w.trim().parse().ok()).collect()
}

#[test]
fn files_of_the_corpus_have_their_reference_solutions() {
    let Some(corpus) = std::env::var_os("NONSMOOTH_CORPUS") else {
        crate::common::skipped("NONSMOOTH_CORPUS is not set");
        return;
    };
    let folder = Path::new(&corpus).join("mcp");
    let mut files: Vec<PathBuf> =
        std::fs::read_dir(&folder).unwrap().map(|entry| entry.unwrap().path()).collect();
    files.retain(|path| path.extension().is_some_and(|e| e == "nl"));
    files.sort();
    assert!(files.len() > 160, "{}", files.len());
    let (mut solved, mut forms) = (0, 0);
    for path in &files {
        assert!(holds_problem(path), "{}", path.display());
        let bytes = std::fs::read(path).unwrap();
        let name = path.file_name().unwrap().to_str().unwrap();
        let read = Model::read(path, &Options::default()).unwrap_or_else(|e| panic!("{e}"));
        assert!(read.remarks.is_empty(), "{:?}", read.remarks);
        let json = std::fs::read_to_string(path.with_extension("ref.json")).unwrap();
        let x = numbers(&json, "x");
        if let [stated] = numbers(&json, "res_inf")[..] {
            let found = natural(&read.problem, &x);
            assert!(found <= stated.max(1e-9) * 1.01, "{name}: {found:e}, stated {stated:e}");
            solved += 1;
        }
        // The same in binary forms, and written and read again.
        if let Ok(text) = std::str::from_utf8(&bytes).map(ToOwned::to_owned)
            && text.starts_with('g')
        {
            for form in [Form::LittleEndian, Form::BigEndian] {
                assert!(model(name, &binary(&text, form)).problem == read.problem, "{name}");
                forms += 1;
            }
        } else {
            let text = folder.join(name.trim_start_matches("bin_"));
            let of_text = model(name, &std::fs::read(text).unwrap()).problem;
            assert!(of_text == read.problem, "{name}");
        }
        let file = ProblemFile::read(path).unwrap();
        let again = Nl.parse(Path::new("again"), &Nl.to_bytes(path, &file).unwrap()).unwrap();
        assert!(again == file, "{name}");
    }
    eprintln!("{} files read, {solved} residuals, {forms} other forms", files.len());
    assert!(solved > 150 && forms > 300, "{solved} {forms}");
}

// ------------------------------------------------------------------------------------------------ own files

const PAIRS: &str = include_str!("../nl/pairs.nl");
const AMPL: &str = include_str!("../nl/ampl.nl");

fn path(name: &str) -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/nl").join(name)
}

#[test]
fn text_and_binary_of_either_order_are_one_model() {
    let file = ProblemFile::read(path("pairs.nl")).unwrap();
    assert_eq!(file.info.title.as_deref(), Some("three pairs"));
    assert_eq!(file.info.names, ["labour", "capital", "price"]);
    assert_eq!(parts(&path("pairs.nl")).len(), 3);
    let read = Model::read(&path("pairs.nl"), &Options::default()).unwrap();
    let Mcp { lower, upper, start, .. } = &read.problem;
    let inf = f64::INFINITY;
    assert_eq!((&lower[..], &upper[..]), (&[0.0, -1.0, -inf][..], &[inf, 2.0, inf][..]));
    // As the file has it; the problem begins at the projection.
    assert_eq!(start[..], [0.5, -3.0, 0.0]);
    assert_eq!(read.problem.origin().z, [0.5, -1.0, 0.0]);
    let x = [1.0, 2.0, -0.5];
    assert_eq!(values(&read.problem, &x), [1.0 + 2.0 - 3.0, (-1f64).exp() - 0.5, 1.0 - 1.0 - 4.0]);
    assert_eq!(read.problem.F.pattern().places().count(), 7);
    for (name, form) in [("pairs-little.nl", Form::LittleEndian), ("pairs-big.nl", Form::BigEndian)]
    {
        let bytes = std::fs::read(path(name)).unwrap();
        let of_file = Model::read(&path(name), &Options::default()).unwrap();
        assert_eq!(of_file.echo.form, form);
        assert!(of_file.problem == read.problem, "{name}");
        // The writer of this test agrees with the one that made the file.
        assert!(model(name, &binary(PAIRS, form)).problem == read.problem);
        assert!(Nl.begins(&bytes) && Nl.holds_problem(Path::new("x"), &bytes));
    }
    let crlf = PAIRS.replace('\n', "\r\n").replace("o44", "o44\t# exp\r\n\r\n# a line of its own");
    assert!(model("crlf", crlf.as_bytes()).problem == read.problem);
    assert!(Nl.begins(PAIRS.as_bytes()) && !Nl.begins(b"given = 3\n") && !Nl.begins(b"g\n"));
}

#[test]
fn what_ampl_writes_is_paired_by_its_rules() {
    let read = model("ampl.nl", AMPL.as_bytes());
    let inf = f64::INFINITY;
    assert_eq!(read.problem.lower, [0.0, -inf, -inf]);
    assert_eq!(read.problem.upper, [inf, inf, -3.0]);
    // The equation is the free variable's; the rows of code 5 are those of the variables that they name.
    assert_eq!(values(&read.problem, &[1.0, 2.0, -4.0]), [5.5, -1.0, -16.0]);
    assert_eq!(natural(&read.problem, &[0.0, 3.0, -3.0]), 0.0);
    assert!(read.remarks.is_empty());
    let odd = model("ampl.nl", AMPL.replace("5 2 3", "5 3 3").as_bytes());
    assert!(odd.problem == read.problem && odd.remarks.len() == 1, "{:?}", odd.remarks);
    assert!(odd.remarks[0].contains("line 19, row 1"), "{:?}", odd.remarks);
    // The k-th equation goes to the k-th variable that no row names.
    let two = AMPL.replace("5 2 3", "4 7").replace("1 -3", "3");
    assert_eq!(values(&model("two", two.as_bytes()).problem, &[1.0, 2.0, 5.0]), [5.5, 8.0, -23.0]);
}

#[test]
fn infinite_bounds_begin_at_1e20() {
    let text = PAIRS.replace("0 -1.0 2.0", "0 -1e30 1e20");
    let read = model("x", text.as_bytes());
    assert_eq!((read.problem.lower[1], read.problem.upper[1]), (f64::NEG_INFINITY, f64::INFINITY));
    let options = Options { infinity: 1e25, ..Options::default() };
    let read = Model::parse(Path::new("x"), text.as_bytes(), &options).unwrap();
    assert_eq!((read.problem.lower[1], read.problem.upper[1]), (f64::NEG_INFINITY, 1e20));
}

/// A file of one variable and the row `0 ≤ x ⟂ expression`.
fn one(expression: &str) -> String {
    let lines: Vec<_> = expression.split_whitespace().collect();
    format!(
        "g3 1 1 0\n 1 1 0 0 0\n 1 0 0 1\n 0 0\n 1 0 0\n 0 0 0 1\n 0 0 0 0 0\n 1 0\n 0 0\n 0 0 0 0 0\nC0\n{}\nr\n5 1 1\nb\n2 0\nk0\nJ0 1\n0 0\n",
        lines.join("\n")
    )
}

#[test]
fn operators_of_the_table() {
    const X: f64 = 0.7;
    let table: &[(&str, f64)] = &[
        ("o0 v0 n2", X + 2.0),
        ("o1 v0 n2", X - 2.0),
        ("o2 v0 s-2", X * -2.0),
        ("o3 v0 l4", X / 4.0),
        ("o4 n-7.5 o2 v0 n10", -0.5),
        ("o5 v0 n3", X * X * X),
        ("o5 n-2 s3", -8.0),
        ("o6 v0 n2", 0.0),
        ("o6 n2 v0", 2.0 - X),
        ("o11 3 n1 v0 n2", X),
        ("o12 2 v0 n0.5", X),
        ("o13 v0", 0.0),
        ("o14 v0", 1.0),
        ("o15 o16 v0", X),
        ("o16 v0", -X),
        ("o20 n0 v0", 1.0),
        ("o21 n0 v0", 0.0),
        ("o22 v0 n1", 1.0),
        ("o23 v0 v0", 1.0),
        ("o24 v0 n1", 0.0),
        ("o28 v0 n1", 0.0),
        ("o29 v0 n0", 1.0),
        ("o30 v0 n1", 1.0),
        ("o34 v0", 0.0),
        ("o35 o29 v0 n1 n10 n20", 20.0),
        ("o37 v0", X.tanh()),
        ("o38 v0", X.tan()),
        ("o39 v0", X.sqrt()),
        ("o40 v0", X.sinh()),
        ("o41 v0", X.sin()),
        ("o42 v0", X.log10()),
        ("o43 v0", X.ln()),
        ("o44 v0", X.exp()),
        ("o45 v0", X.cosh()),
        ("o46 v0", X.cos()),
        ("o47 v0", X.atanh()),
        ("o48 v0 n2", X.atan2(2.0)),
        ("o49 v0", X.atan()),
        ("o50 v0", X.asinh()),
        ("o51 v0", X.asin()),
        ("o52 n1.5", 1.5f64.acosh()),
        ("o53 v0", X.acos()),
        ("o54 3 v0 v0 n1", X + X + 1.0),
        ("o54 1 v0", X),
        ("o55 n-7 n2", -3.0),
        ("o56 n123.456 n2", 120.0),
        ("o57 n2.345 n1", 2.3),
        ("o58 n-2.39 n1", -2.3),
        ("o59 3 v0 n0 n1", 2.0),
        ("o60 4 n1 v0 n1 n1", 2.0),
        ("o61 2 v0 v0", 1.0),
        ("o62 n1 o59 2 v0 n0", 1.0),
        ("o63 n1 o59 2 v0 v0", 0.0),
        ("o64 3 n-1 n0.5 n2 n1 n3 v0", -0.5 + 2.0 * (X - 0.5)),
        ("o65 n0 n5 v0", X),
        ("o66 n2 o59 2 v0 v0", 1.0),
        ("o67 n1 o59 2 v0 n0", 0.0),
        ("o68 n1 o59 2 v0 v0", 1.0),
        ("o69 n2 o59 2 v0 v0", 0.0),
        ("o70 2 v0 n0", 0.0),
        ("o71 2 v0 n0", 1.0),
        ("o72 v0 n4 n5", 4.0),
        ("o73 v0 n2", 1.0),
        ("o74 3 v0 n1 n2", 1.0),
        ("o75 3 v0 n1 v0", 1.0),
        ("o76 v0 n2", X * X),
        ("o77 v0", X * X),
        ("o78 n2 v0", 2f64.powf(X)),
        ("o79 v0", 1.0 / (1.0 + (-X).exp())),
        ("o80 o16 v0 n2", -X.powf(2.0)),
    ];
    for &(expression, expected) in table {
        let text = one(expression);
        let read = model(expression, text.as_bytes());
        let found = values(&read.problem, &[X])[0];
        assert!((found - expected).abs() < 1e-14 * (1.0 + expected.abs()), "{expression}: {found}");
        assert!(model(expression, &binary(&text, Form::BigEndian)).problem == read.problem);
        let file = ProblemFile::new(read.problem.clone());
        let again = Nl.to_bytes(Path::new("x"), &file).unwrap();
        assert!(model(expression, &again).problem == read.problem, "{expression}");
    }
    let refused = (0..200).filter(|k| {
        let text = one(&format!("o{k} 3 v0 v0 v0"));
        let read = Model::parse(Path::new("x"), text.as_bytes(), &Options::default());
        read.is_err_and(|e| e.to_string().contains("operator of AMPL"))
    });
    let unknown = [7, 8, 9, 10, 17, 18, 19, 25, 26, 27, 31, 32, 33, 36];
    assert_eq!(refused.collect::<Vec<_>>(), unknown.into_iter().chain(81..200).collect::<Vec<_>>());
}

// ------------------------------------------------------------------------------------------------ mistakes

fn refusal(text: &[u8]) -> Refusal {
    let read = Model::parse(Path::new("m.nl"), text, &Options::default());
    read.expect_err(&String::from_utf8_lossy(text))
}

#[test]
fn every_pitfall_has_a_line_with_its_place() {
    // What is changed in the file, and what the message says.
    let table = [
        (
            "g3",
            "z3",
            "m.nl: line 1, header (format and options): expected a file in format `g` (text) or `b` (binary), found `z`, an old binary format",
        ),
        ("g3", "h3", "an old binary format"),
        (
            "g3",
            "q3",
            "m.nl: line 1, header (format and options): expected `g` (text) or `b` (binary), found `q3 1 1 0 # problem three pairs`",
        ),
        (
            "g3 1",
            "g12 1",
            "line 1, header (format and options): expected a whole number from 0 to 9, found 12",
        ),
        (
            " 3 3 1 0 1\t",
            " 3 3 1 0 1 2\t",
            "line 2, header (variables, rows, objectives): expected no logical constraints, found 2 of them",
        ),
        (
            " 3 3 1",
            " 3 3000000000 1",
            "line 2, header (variables, rows, objectives): expected at most",
        ),
        (" 3 3 1", " 3 -3 1", "expected a whole number from 0 on, found -3"),
        (" 3 3 1", " 3 x 1", "expected a whole number, found `x`"),
        (
            "\n 0 0 0 0 0\t",
            "\n 0 1 0 0 0\t",
            "line 7, header (discrete variables): expected no binary or integer variables, found 1 of them",
        ),
        (
            " 0 1 0 0 0\t",
            " 0 99999999999 0 0 0\t",
            "line 10, header (defined variables): expected at most",
        ),
        (
            "o44",
            "o84",
            "line 24, segment C1: expected an operator of AMPL's table, from 0 to 80, found `o84`",
        ),
        (
            "o44\nv3",
            "f2 1\nv3",
            "line 24, segment C1: expected functions that AMPL has itself, found a call of the external function",
        ),
        (
            "S0 1 scale\n1 2",
            "F2 0 1 gamma\nC1\nf2 1\nv0",
            "found a call of the external function `gamma`",
        ),
        ("o44\nv3", "v7", "expected a variable below 4, of which 3 are no definitions, found `v7`"),
        (
            "V3 2 0",
            "V2 2 0",
            "line 13, segment V2: expected a number from 3 on, behind the variables, found 2",
        ),
        (
            "V3 2 0\n0 1.0\n1 -1.0\nn0\n",
            "",
            "segment C0: expected a segment V3 before its use, found `v3` without it",
        ),
        ("o44\nv3", "h3:abc", "found a string"),
        (
            "o44\nv3",
            "w3",
            "expected a number (n, s, l), a variable (v) or an operator (o), found `w3`",
        ),
        ("o44\nv3", "ninf", "expected a finite number, found inf"),
        ("o44\nv3", "o54\n0", "expected at least one argument, found 0"),
        ("o44\nv3", "o64\n2\nn1\nv0", "expected a slope or a breakpoint (n, s, l), found `v0`"),
        (
            "o44\nv3",
            "o64\n3\nn1\nn2\nn1\nn0\nn1\nv0",
            "expected slopes with ascending breakpoints between them",
        ),
        ("C1", "C0", "line 23, segment C0: expected one of this name, found a second one"),
        ("C1", "C8", "the row of a segment C: expected a whole number from 0 to 2, found 8"),
        ("C1", "L0", "segment L: expected no logical constraints, found one"),
        (
            "C1",
            "Q1",
            "a segment: expected the letter of a segment (F S V C L O x d r b k K J G), found `Q1`",
        ),
        (
            "5 3 2",
            "5 3 1",
            "line 35, row 1: expected a variable of its own, found variable 0, which line 34, row 0 names",
        ),
        (
            "5 3 2",
            "5 3 0",
            "line 35, segment r, row 1: expected a variable from 1 to 3, counted from 1, found 0",
        ),
        ("5 3 2", "5 3 4", "counted from 1, found 4"),
        (
            "5 3 2",
            "5 9 2",
            "the bounds of its variable: expected a whole number from 0 to 3, found 9",
        ),
        ("5 3 2", "6 3 2", "segment r, row 1: expected a code from 0 to 5, found 6"),
        ("5 3 2", "5 3", "segment r, row 1: expected a whole number, found the end of the line"),
        ("2 0.0", "5 1 1", "segment b, variable 0: expected a code from 0 to 4, found 5"),
        ("2 0.0", "2 nan", "segment b, variable 0: expected a number, found NaN"),
        ("2 0.0", "2 1e20", "segment b, variable 0: expected a lower bound below 1e20"),
        (
            "0 -1.0 2.0",
            "0 3 2.0",
            "line 39, variable 1: expected bounds that do not cross, found 3.0 and 2.0",
        ),
        (
            "4 4.0",
            "2 4.0",
            "line 36, row 2: expected an equation, or a row that is complementary to a variable, found the inequality 4.0 <= c(x) <= inf",
        ),
        (
            "4 4.0",
            "3",
            "the rows: expected as many equations as variables that no row is complementary to, found 0 of 3 for 1 of 3",
        ),
        (
            "-1.0 2.0\n3",
            "-1.0 2.0\n2 0",
            "line 40, variable 2: expected a free variable, as no row is complementary to it",
        ),
        ("x2", "x9", "segment x: expected a number from 0 to 3, found 9"),
        ("1 -3.0", "5 -3.0", "line 32, segment x: expected a whole number from 0 to 2, found 5"),
        ("J1 3", "J1 77", "segment J1: expected a number from 0 to 3, found 77"),
        ("k2", "k2000", "the number of columns of a segment k: expected"),
        ("\nb\n", "\n", "a segment: expected the letter"),
    ];
    let mut wrong = vec![];
    for (from, to, expected) in table {
        assert!(PAIRS.contains(from), "{from}");
        let message = refusal(PAIRS.replacen(from, to, 1).as_bytes()).to_string();
        if !message.contains(expected) {
            wrong.push(format!("{from} -> {to}:\n{message}\n{expected}"));
        }
        assert!(message.starts_with("m.nl: ") && !message.contains('\n'), "{message}");
    }
    assert!(wrong.is_empty(), "{}", wrong.join("\n"));
    // What AMPL can be told has a number.
    let number =
        |from: &str, to: &str| refusal(PAIRS.replacen(from, to, 1).as_bytes()).answer.map(|a| a.1);
    assert_eq!(number("0 -1.0 2.0", "0 3 2.0"), Some(200));
    assert_eq!(number("5 3 2", "5 3 1"), Some(501));
    assert_eq!(number("4 4.0", "3"), Some(504));
    assert_eq!(number("4 4.0", "2 4.0"), Some(505));
    assert_eq!(number("o44", "o84"), None);
    // Names of rows and variables, where there are files of them.
    let folder = tempfile::tempdir().unwrap();
    for (name, text) in [
        ("m.nl", &PAIRS.replacen("5 3 2", "5 3 1", 1)[..]),
        ("m.col", include_str!("../nl/pairs.col")),
        ("m.row", include_str!("../nl/pairs.row")),
    ] {
        std::fs::write(folder.path().join(name), text).unwrap();
    }
    let message = ProblemFile::read(folder.path().join("m.nl")).unwrap_err().to_string();
    let expected = "row 1 (`second`): expected a variable of its own, found variable 0 (`labour`), which line 34, row 0 (`first`) names";
    assert!(message.contains(expected), "{message}");
}

#[test]
fn a_file_that_ends_early_is_refused_wherever_it_ends() {
    let endings = [PAIRS.as_bytes().to_vec(), std::fs::read(path("pairs-little.nl")).unwrap()];
    for bytes in endings {
        let mut messages = 0;
        for end in 0..bytes.len() {
            let read = Model::parse(Path::new("m.nl"), &bytes[..end], &Options::default());
            // Only a number at the end may be cut short and be one.
            if let Err(e) = read {
                assert!(!e.to_string().contains('\n'));
                messages += 1;
            }
        }
        assert!(messages > bytes.len() - 8, "{messages} of {}", bytes.len());
    }
    let whole = String::from_utf8(PAIRS.into()).unwrap();
    let last = whole.rfind("\nJ").unwrap() + 1;
    let message = refusal(&whole.as_bytes()[..last]).to_string();
    assert!(
        message.contains("the segments J: expected") && message.contains("as the header says"),
        "{message}"
    );
    let message = refusal(&PAIRS.as_bytes()[..30]).to_string();
    assert!(message.contains("line 2, header (variables, rows, objectives): expected ten lines of header, found the end of the file"), "{message}");
    let bytes = std::fs::read(path("pairs-big.nl")).unwrap();
    let message = refusal(&bytes[..700]).to_string();
    assert!(
        message.contains("byte ") && message.ends_with("found the end of the file"),
        "{message}"
    );
}

#[test]
fn the_other_order_of_bytes_is_no_model() {
    let bytes = std::fs::read(path("pairs-big.nl")).unwrap();
    let text = String::from_utf8_lossy(&bytes).into_owned();
    let at = text.find(" 0 0 2 1").unwrap();
    let with = |digit: u8| {
        let mut bytes = bytes.clone();
        bytes[at + 5] = digit;
        refusal(&bytes).to_string()
    };
    assert!(with(b'1').starts_with("m.nl: byte "), "{}", with(b'1'));
    let other = with(b'5');
    assert!(
        other.contains("expected IEEE arithmetic, 1 (little-endian) or 2 (big-endian), found 5"),
        "{other}"
    );
}

// ------------------------------------------------------------------------------------------------ side inequalities

#[test]
fn side_inequalities_become_rows_where_they_are_allowed() {
    let options = Options { side_inequalities: true, ..Options::default() };
    let read = |text: &str| Model::parse(Path::new("x"), text.as_bytes(), &options).unwrap();
    // x0 + 2 x2 >= 4 in place of the equation, and no row for x2, which is between 0 and 9.
    let text = PAIRS.replacen("4 4.0", "5 3 3", 1).replacen("\n3\nk2", "\n0 0 9\nk2", 1);
    assert_eq!(read(&text).problem.dim(), 3);
    let text = PAIRS.replacen("-1.0 2.0\n3", "-1.0 2.0\n0 0 9", 1);
    let p = read(&text).problem;
    let inf = f64::INFINITY;
    assert_eq!((&p.lower[2..], &p.upper[2..]), (&[-inf, 0.0, -inf][..], &[inf, inf, 0.0][..]));
    let f = values(&p, &[1.0, 1.0, 5.0, 0.0, 0.0]);
    assert_eq!(f[2..], [1.0 + 10.0 - 4.0, 5.0, 5.0 - 9.0]);
    // An inequality beside three pairs.
    let three = PAIRS.replacen("4 4.0", "5 3 3", 1);
    let three = three.replacen(" 3 3 1", " 3 4 1", 1).replacen("5 3 3\n", "5 3 3\n0 1 2\n", 1);
    let p = read(&(three.clone() + "J3 1\n0 3\n")).problem;
    assert_eq!((p.lower[3], p.upper[3], p.lower[4], p.upper[4]), (-inf, inf, 1.0, 2.0));
    // c − y and v for c = 3 x0.
    assert_eq!(values(&p, &[1.0, 1.0, 1.0, 7.0, 1.5])[3..], [1.5, 7.0]);
    let p = read(&(three.replacen("0 1 2\n", "2 1\n", 1) + "J3 1\n0 3\n")).problem;
    assert_eq!((p.dim(), values(&p, &[1.0, 1.0, 1.0, 0.0])[3]), (4, 2.0));
    // A row without bounds asks for nothing.
    let free = three.replacen("0 1 2\n", "3\n", 1);
    assert_eq!(model("free", free.as_bytes()).problem.dim(), 3);
}

// ------------------------------------------------------------------------------------------------ writing

/// Everything that a graph may hold, shared parts included.
fn zoo() -> Mcp {
    let mut g = Graph::new(3);
    let x: Vec<_> = (0..3).map(|j| g.variable(j)).collect();
    let two = g.constant(2.0);
    let shared = g.binary(Binary::Mul, x[0], x[1]);
    let linear = g.add(Node::Linear(vec![(0, 2.0), (2, -1.5)]));
    let unordered = g.add(Node::Linear(vec![(2, 1.0), (0, 0.0), (2, 3.0)]));
    let square = g.unary(Unary::Square, shared);
    let piece = Piecewise::new(vec![-1.0, 2.0, 5.0], vec![-0.5, 0.25]).unwrap();
    let pieces = g.add(Node::Piecewise(piece, shared));
    let least = g.add(Node::Nary(Nary::Min, vec![shared, two, unordered]));
    let either = g.add(Node::If([x[0], square, least]));
    let sum = g.add(Node::Nary(Nary::Sum, vec![either, pieces]));
    let r0 = g.binary(Binary::Add, sum, linear);
    let r1 = g.add(Node::Linear(vec![(0, 1.0), (1, 4.0)]));
    let r2 = g.binary(Binary::SignPow, r0, two);
    let f = Expressions::new(g, vec![r0, r1, r2]).unwrap();
    let inf = f64::INFINITY;
    Mcp::new(f, vec![-inf, 0.0, -2.0], vec![inf, inf, -2.0], vec![0.0, -0.5, 1e-300]).unwrap()
}

#[test]
fn what_is_written_is_read_as_the_same_function() {
    let problem = zoo();
    let names = ["a b", "c", "d"].map(String::from).to_vec();
    let info = Info { title: Some("all sorts".into()), names, ..Info::default() };
    let file = ProblemFile { info, ..ProblemFile::new(problem.clone()) };
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("zoo.nl");
    file.write(&path).unwrap();
    let again = ProblemFile::read(&path).unwrap();
    assert_eq!(again.info, file.info);
    let read = Model::read(&path, &Options::default()).unwrap().problem;
    assert_eq!(
        (&read.lower, &read.upper, &read.start),
        (&problem.lower, &problem.upper, &problem.start)
    );
    for x in [[0.5, -1.5, 2.0], [0.0, 1.0, -1.0], [-2.0, -3.0, 0.25]] {
        assert_eq!(values(&read, &x), values(&problem, &x));
    }
    // A solution stands beside the model, in the form of the model.
    let mut pairs = vec![];
    for form in [None, Some(Form::LittleEndian), Some(Form::BigEndian)] {
        if let Some(form) = form {
            let text = String::from_utf8(Nl.to_bytes(&path, &file).unwrap()).unwrap();
            std::fs::write(&path, binary(&text, form)).unwrap();
        }
        let point: StoredPoint = LcpPoint { z: vec![0.1, 1e-300, -2.0] }.into();
        let solved = ProblemFile { solution: Some(point), ..file.clone() };
        solved.write_solution(&path).unwrap();
        assert_eq!(ProblemFile::read(&path).unwrap().solution, solved.solution, "{form:?}");
        let other = folder.path().join("zoo.sol");
        let bytes = std::fs::read(&other).unwrap();
        for end in 0..bytes.len() {
            std::fs::write(&other, &bytes[..end]).unwrap();
            let read = ProblemFile::read(&path).unwrap().solution;
            assert!(read.is_none() || read == solved.solution || form.is_none(), "{end}");
        }
        pairs.push((std::fs::read(&path).unwrap(), bytes, solved.solution));
    }
    // It is read in any other form too.
    for (model, ..) in &pairs {
        std::fs::write(&path, model).unwrap();
        for (_, solution, point) in &pairs {
            std::fs::write(path.with_extension("sol"), solution).unwrap();
            assert_eq!(ProblemFile::read(&path).unwrap().solution, *point);
        }
    }
    file.write(&path).unwrap();
    assert!(ProblemFile::read(&path).unwrap().solution.is_none());
    // What is read is written and read as it is.
    let bytes = Nl.to_bytes(&path, &again).unwrap();
    assert!(Nl.parse(&path, &bytes).unwrap().problem == again.problem);
    // Not expressions.
    let closed = Mcp { F: Arc::new(Closed(problem.F.clone())), ..problem };
    let message = Nl.to_bytes(&path, &ProblemFile::new(closed)).unwrap_err().to_string();
    assert!(
        message.contains("F: expected a function by expressions, found a closure"),
        "{message}"
    );
}

#[derive(Debug)]
struct Closed(Arc<dyn nonsmooth_problem::field::Field>);

impl nonsmooth_problem::field::Field for Closed {
    fn dim(&self) -> usize {
        self.0.dim()
    }
    fn pattern(&self) -> &nonsmooth_problem::field::Pattern {
        self.0.pattern()
    }
    fn evaluator(&self) -> Box<dyn nonsmooth_problem::field::Evaluator> {
        self.0.evaluator()
    }
    fn source(&self) -> String {
        "a closure".into()
    }
}

#[test]
fn a_chain_of_a_million_operations_is_read_and_written() {
    const LENGTH: usize = 1_000_000;
    let text = one(&("o0 v0 ".repeat(LENGTH) + "v0"));
    let read = model("chain", text.as_bytes());
    assert_eq!(values(&read.problem, &[1.0]), [(LENGTH + 1) as f64]);
    let left = one(&("o0 ".repeat(LENGTH) + &"v0 ".repeat(LENGTH + 1)));
    let other = model("chain", left.as_bytes());
    assert_eq!(values(&other.problem, &[1.0]), [(LENGTH + 1) as f64]);
    let again = Nl.to_bytes(Path::new("x"), &ProblemFile::new(read.problem.clone())).unwrap();
    assert!(model("again", &again).problem == read.problem);
}

#[test]
fn what_doubles_with_every_definition_is_written_once() {
    // V_{k+1} = V_k + V_k: 2^60 x.
    let mut parts = String::new();
    for k in 0..60 {
        parts += &format!("V{} 0 0\no0\nv{}\nv{}\n", k + 1, k, k);
    }
    let text = one("v60").replacen(" 0 0 0 0 0\nC0", &format!(" 0 60 0 0 0\n{parts}C0"), 1);
    let read = model("doubled", text.as_bytes());
    assert_eq!(values(&read.problem, &[1.0]), [2f64.powi(60)]);
    let bytes = Nl.to_bytes(Path::new("x"), &ProblemFile::new(read.problem.clone())).unwrap();
    assert!(bytes.len() < 2500, "{}", bytes.len());
    assert!(model("again", &bytes).problem == read.problem);
}

// ------------------------------------------------------------------------------------------------ solutions

#[test]
fn solutions_repeat_what_the_model_says_of_itself() {
    let echo = model("x", PAIRS.as_bytes()).echo;
    let x = [1.0, -0.1, 1e-300];
    let solution = Solution { echo: &echo, message: "NAME: done.\n\ntwo", x: &x, result: 0 };
    let expected =
        "NAME: done.\n \ntwo\n\nOptions\n3\n1\n1\n0\n3\n0\n3\n3\n1.0\n-0.1\n1e-300\nobjno 0 0\n";
    assert_eq!(String::from_utf8(solution.to_bytes()).unwrap(), expected);
    let echo = model("x", AMPL.as_bytes()).echo;
    let failed = Solution { echo: &echo, message: "no", x: &[], result: 504 };
    let expected =
        "no\n\nOptions\n11\n4\n3\n0\n4\n20081213\n0\n4\n0\n240\n3\n0\n3\n0\n1e-5\nobjno 0 504\n";
    assert_eq!(String::from_utf8(failed.to_bytes()).unwrap(), expected);
    // Records between their lengths.
    for (name, form) in [("pairs-little.nl", Form::LittleEndian), ("pairs-big.nl", Form::BigEndian)]
    {
        let echo = Model::read(&path(name), &Options::default()).unwrap().echo;
        let bytes = Solution { echo: &echo, message: "done", x: &x, result: 402 }.to_bytes();
        let whole = |b: &[u8]| {
            let b = b.try_into().unwrap();
            if form == Form::BigEndian { i32::from_be_bytes(b) } else { i32::from_le_bytes(b) }
        };
        let mut rest = &bytes[..];
        let mut records = vec![];
        while !rest.is_empty() {
            let length = whole(&rest[..4]) as usize;
            records.push(&rest[4..4 + length]);
            assert_eq!(rest[4 + length..8 + length], rest[..4]);
            rest = &rest[8 + length..];
        }
        assert_eq!(records[..3], [&b"binary"[..], b"done", b""]);
        assert_eq!(&records[3][..7], b"Options");
        let numbers: Vec<_> = records[3][7..].chunks(4).map(whole).collect();
        assert_eq!(numbers, [3, 1, 1, 0, 3, 0, 3, 3]);
        assert_eq!((records[4].len(), records[5].len(), records.len()), (0, 24, 7));
        let first = records[5][..8].try_into().unwrap();
        let first = if form == Form::BigEndian {
            f64::from_be_bytes(first)
        } else {
            f64::from_le_bytes(first)
        };
        assert_eq!(first, 1.0);
        assert_eq!([whole(&records[6][..4]), whole(&records[6][4..])], [0, 402]);
    }
}
