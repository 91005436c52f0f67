//! AMPL's files: text and binary, what is read of them and what is refused, round trips, solutions.

mod common;

use std::path::{Path, PathBuf};

use nonsmooth_io::nl::{Echo, Form, Model, Nl, Options, Solution};
use nonsmooth_io::{Format, ProblemFile, holds_problem};
use nonsmooth_problem::{AnyProblem, Complementarity, Mcp};

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
        common::skipped("NONSMOOTH_CORPUS is not set");
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
