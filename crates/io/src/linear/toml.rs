//! Our own format: a complementarity problem or a variational inequality as TOML, for people to read and write. docs/formats.md describes it.
//!
//! Numbers are written with as many digits as tell them from all others, so what is written reads back bit for bit, and so does the storage of the
//! matrices (dense or sparse). Functions are expressions, one text a row.

use std::fmt::Write;
use std::path::Path;

use nonsmooth_linalg::{Csc, Dense, Matrix};
use nonsmooth_problem::field::Expressions;
use nonsmooth_problem::{
    AnyPoint, AnyProblem, Complementarity, Kind, Part, Parts, ProblemError, Set, Shape, Stated,
    each_kind, with_complementarity,
};
use serde::Deserialize;
use serde::de::{self, DeserializeSeed, Deserializer, MapAccess, SeqAccess, Visitor};

use super::{Digits, check, set};
use crate::format::{About, bytes, put};
use crate::tokens::text;
use crate::{Format, Info, IoError, ProblemFile, StoredPoint};

/// The type of a key.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
enum Type {
    Text,
    Texts,
    Part(Shape),
    Solution,
}

/// What stands at a key.
#[derive(Debug)]
enum Value {
    Text(String),
    Texts(Vec<String>),
    Matrix(Given),
    Vector(Vec<f64>),
    Count(usize),
    Set(set::Stated),
    Solution(Keys),
}

/// The keys that a file, or its `[solution]`, has.
type Keys = Vec<(&'static str, Value)>;

/// The keys that may be there.
#[derive(Clone, Copy)]
struct Known<'a>(&'a [(&'static str, Type)]);

impl<'de> DeserializeSeed<'de> for Known<'_> {
    type Value = Keys;

    fn deserialize<D: Deserializer<'de>>(self, deserializer: D) -> Result<Keys, D::Error> {
        deserializer.deserialize_map(self)
    }
}

impl<'de> Visitor<'de> for Known<'_> {
    type Value = Keys;

    fn expecting(&self, f: &mut std::fmt::Formatter) -> std::fmt::Result {
        f.write_str("a table")
    }

    fn visit_map<A: MapAccess<'de>>(self, mut map: A) -> Result<Keys, A::Error> {
        let mut keys = vec![];
        while let Some((key, of)) = map.next_key_seed(Key(self))? {
            let value = match of {
                Type::Text => Value::Text(map.next_value()?),
                Type::Texts => Value::Texts(map.next_value()?),
                Type::Part(Shape::Matrix) => Value::Matrix(map.next_value()?),
                Type::Part(Shape::Vector) => Value::Vector(map.next_value()?),
                Type::Part(Shape::Count) => Value::Count(map.next_value()?),
                Type::Part(Shape::Expressions) => Value::Texts(map.next_value()?),
                Type::Part(Shape::Set) => Value::Set(map.next_value()?),
                Type::Solution => Value::Solution(map.next_value_seed(Known(&of_solutions()))?),
            };
            keys.push((key, value));
        }
        Ok(keys)
    }
}

/// One of the known keys.
struct Key<'a>(Known<'a>);

impl<'de> DeserializeSeed<'de> for Key<'_> {
    type Value = (&'static str, Type);

    fn deserialize<D: Deserializer<'de>>(self, deserializer: D) -> Result<Self::Value, D::Error> {
        let found = String::deserialize(deserializer)?;
        let Known(all) = self.0;
        all.iter().find(|key| key.0 == found).copied().ok_or_else(|| {
            let all: Vec<_> = all.iter().map(|key| format!("`{}`", key.0)).collect();
            let all = all.join(", ");
            de::Error::custom(format!("unknown field `{found}`, expected one of {all}"))
        })
    }
}

/// All keys of all kinds; which belong to a kind it says itself.
fn of_problems() -> Vec<(&'static str, Type)> {
    let mut parts: Vec<(&str, Shape)> = vec![];
    for part in each_kind!(P in Complementarity => P::PARTS).into_iter().flatten() {
        if !parts.contains(part) {
            parts.push(*part);
        }
    }
    // Matrices, vectors, numbers.
    parts.sort_by_key(|part| part.1);
    let parts = parts.into_iter().map(|(name, shape)| (name, Type::Part(shape)));
    let texts = [("kind", Type::Text), ("title", Type::Text), ("description", Type::Text)];
    let before = texts.into_iter().chain([("names", Type::Texts)]);
    before.chain(parts).chain([("solution", Type::Solution)]).collect()
}

/// All keys of solutions.
fn of_solutions() -> Vec<(&'static str, Type)> {
    let mut all: Vec<(&str, Type)> = vec![];
    for name in each_kind!(P in Complementarity => P::SOLUTION).into_iter().flatten() {
        let key = (*name, Type::Part(Shape::Vector));
        if !all.contains(&key) {
            all.push(key);
        }
    }
    all
}

/// Takes a key out.
fn take(keys: &mut Keys, name: &str) -> Option<Value> {
    let at = keys.iter().position(|key| key.0 == name)?;
    Some(keys.swap_remove(at).1)
}

/// A text that may be there.
fn take_text(keys: &mut Keys, name: &str) -> Option<String> {
    match take(keys, name) {
        Some(Value::Text(said)) => Some(said),
        _ => None,
    }
}

/// A matrix as it is stated: rows, or a shape and entries.
#[derive(Debug)]
pub(super) enum Given {
    Rows(Vec<Vec<f64>>),
    Entries(Entries),
}

#[derive(Debug, Deserialize)]
#[serde(deny_unknown_fields)]
pub(super) struct Entries {
    shape: (usize, usize),
    entries: Vec<(usize, usize, f64)>,
}

impl<'de> Deserialize<'de> for Given {
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        struct Either;
        impl<'de> Visitor<'de> for Either {
            type Value = Given;

            fn expecting(&self, f: &mut std::fmt::Formatter) -> std::fmt::Result {
                f.write_str("a matrix: an array of rows, or a table of shape and entries")
            }

            fn visit_seq<A: SeqAccess<'de>>(self, all: A) -> Result<Given, A::Error> {
                Vec::deserialize(de::value::SeqAccessDeserializer::new(all)).map(Given::Rows)
            }

            fn visit_map<A: MapAccess<'de>>(self, all: A) -> Result<Given, A::Error> {
                let map = de::value::MapAccessDeserializer::new(all);
                Entries::deserialize(map).map(Given::Entries)
            }
        }
        deserializer.deserialize_any(Either)
    }
}

/// What is read and written of a kind.
struct Read {
    kind: Kind,
    parts: Vec<&'static str>,
    of_point: &'static [&'static str],
    partner: &'static str,
    problem: fn(&mut dyn Parts) -> Result<AnyProblem, ProblemError>,
    point: fn(&mut Keyed<'_>) -> Result<AnyPoint, ProblemError>,
}

/// All kinds that the format has.
fn kinds() -> impl Iterator<Item = Read> {
    fn of<P: Stated>() -> Read {
        Read {
            kind: P::KIND,
            parts: P::PARTS.iter().map(|part| part.0).collect(),
            of_point: P::SOLUTION,
            partner: P::PARTNER,
            problem: |parts| P::from_parts(parts).map(Into::into),
            point: |keyed| P::point_from_parts(|name| keyed.vector(name)).map(Into::into),
        }
    }
    each_kind!(P in Complementarity => of::<P>()).into_iter()
}

/// The format.
///
/// Errors of reading: what is no TOML or has a wrong type, by its line; what is missing, superfluous, of a wrong shape or not finite, by its key. Of writing:
/// a problem that is known by its products or its values only.
#[derive(Debug, Clone, Copy)]
pub struct Toml;

impl Format for Toml {
    fn about(&self) -> &'static About {
        const ABOUT: About = About {
            name: "TOML",
            extensions: &["toml"],
            reads: Complementarity::KINDS,
            writes: Complementarity::KINDS,
            ..About::TEXT
        };
        &ABOUT
    }

    /// Whether a line sets `kind`, and none `format`, as scenes do.
    fn begins(&self, bytes: &[u8]) -> bool {
        let text = text(bytes);
        sets(&text, "kind") && !sets(&text, "format")
    }

    fn parse(&self, name: &Path, bytes: &[u8]) -> Result<ProblemFile, IoError> {
        parse(name, &text(bytes))
    }

    fn to_bytes(&self, name: &Path, file: &ProblemFile) -> Result<Vec<u8>, IoError> {
        let problem = check(name, file)?;
        Ok(format(name, file, problem)?.into_bytes())
    }

    /// In the text that is there, remarks and all, only `[solution]` becomes another one.
    fn write_solution(&self, path: &Path, file: &ProblemFile) -> Result<(), IoError> {
        let problem = check(path, file)?;
        let anew = format(path, file, problem)?;
        let there = bytes(path).ok().and_then(|old| String::from_utf8(old).ok());
        let kept = there.and_then(|old| {
            let text = without_solution(&old)? + &solution(problem, file);
            // What is not as it was is written anew.
            let again = parse(path, &text).ok()?;
            let point = |file: &ProblemFile| file.solution.as_ref().map(|s| s.point.clone());
            (again.problem == file.problem && point(&again) == point(file)).then_some(text)
        });
        put(path, kept.unwrap_or(anew).as_bytes())
    }
}

/// The text without the lines of its solution. `None` of what is no TOML.
fn without_solution(text: &str) -> Option<String> {
    let table = toml::de::DeTable::parse(text).ok()?;
    let found = table.get_ref().iter().find(|(key, _)| key.get_ref() == "solution");
    let mut kept = text.to_owned();
    if let Some((key, value)) = found {
        let first = text[..key.span().start].rfind('\n').map_or(0, |at| at + 1);
        let ends = value.get_ref().as_table().into_iter().flatten().map(|(_, x)| x.span().end);
        let last = ends.fold(key.span().end, usize::max);
        let end = text[last..].find('\n').map_or(text.len(), |at| last + at + 1);
        kept.replace_range(first..end, "");
    }
    kept.truncate(kept.trim_end().len());
    kept.push('\n');
    Some(kept)
}

/// Whether a line begins with `key =`.
fn sets(text: &str, key: &str) -> bool {
    let sets = |rest: &str| rest.trim_start().starts_with('=');
    text.lines().any(|l| l.trim_start().strip_prefix(key).is_some_and(sets))
}

/// Reads the text of a file.
fn parse(path: &Path, text: &str) -> Result<ProblemFile, IoError> {
    let wrong = |e: &toml::de::Error| {
        let line = e.span().map_or(1, |s| 1 + text[..s.start].matches('\n').count());
        let expected = "a problem as docs/formats.md describes it";
        if sets(text, "format") {
            return IoError::data(
                path,
                "format",
                expected,
                "a scene, which `nonsmooth simulate` moves",
            );
        }
        IoError::data(path, format!("line {line}"), expected, e.message())
    };
    let known = of_problems();
    let parsed = toml::Deserializer::parse(text).map_err(|e| wrong(&e))?;
    let mut keys = Known(&known).deserialize(parsed).map_err(|e| wrong(&e))?;
    let Some(said) = take_text(&mut keys, "kind") else {
        return Err(wrong(&de::Error::missing_field("kind")));
    };
    let Some(read) = kinds().find(|read| read.kind.name() == said) else {
        let names: Vec<_> = kinds().map(|read| format!("\"{}\"", read.kind.name())).collect();
        let found = format!("\"{said}\"");
        return Err(IoError::data(path, "kind", format!("one of {}", names.join(", ")), found));
    };
    let (title, description) = (take_text(&mut keys, "title"), take_text(&mut keys, "description"));
    let names = match take(&mut keys, "names") {
        Some(Value::Texts(names)) => names,
        _ => vec![],
    };
    let room = text.len().max(1 << 20);
    let solution = match take(&mut keys, "solution") {
        Some(Value::Solution(keys)) => {
            Some(Keyed { kind: read.kind, group: "solution.", keys, room, names: &[] })
        }
        _ => None,
    };
    let mut stated = Keyed { kind: read.kind, group: "", keys, room, names: &names };
    let invalid = IoError::problem(path);
    stated.only(&known, &read.parts).map_err(&invalid)?;
    if let Some(solution) = &solution {
        solution.only(&of_solutions(), read.of_point).map_err(&invalid)?;
    }
    let point = |mut keyed: Keyed| {
        let point = (read.point)(&mut keyed)?;
        let partner = keyed.has(read.partner).then(|| keyed.vector(read.partner)).transpose()?;
        Ok(StoredPoint { point, partner, statuses: vec![] })
    };
    let solution = solution.map(point).transpose().map_err(&invalid)?;
    let problem = (read.problem)(&mut stated).map_err(&invalid)?;
    let content = ProblemFile {
        info: Info { title, description, names, ..Info::default() },
        solution,
        ..ProblemFile::new(problem)
    };
    check(path, &content)?;
    Ok(content)
}

/// The keys of a problem, or of its solution, whose kind is known.
struct Keyed<'a> {
    kind: Kind,
    /// What stands before the keys in messages.
    group: &'static str,
    keys: Keys,
    /// The most rows or columns that a matrix in the file can have: the vectors must have entries for them.
    room: usize,
    /// The names of variables in expressions, if they have any.
    names: &'a [String],
}

pub(super) fn wrong(
    place: impl Into<String>,
    expected: impl Into<String>,
    found: impl std::fmt::Display,
) -> ProblemError {
    let (place, expected) = (place.into(), expected.into());
    ProblemError::Value { place, expected, found: found.to_string() }
}

impl Keyed<'_> {
    /// No other keys than the kind has, in the order of those that any kind has.
    fn only(&self, all: &[(&'static str, Type)], known: &[&str]) -> Result<(), ProblemError> {
        let given = all.iter().map(|key| key.0).filter(|key| self.has(key));
        match given.into_iter().find(|key| !known.contains(key)) {
            Some(key) => {
                let (kind, known) = (self.kind.name(), known.join(", "));
                let expected = format!("the keys of kind \"{kind}\": {known}");
                Err(wrong(format!("{}{key}", self.group), expected, "this one"))
            }
            None => Ok(()),
        }
    }

    fn need(&mut self, key: &str) -> Result<Value, ProblemError> {
        take(&mut self.keys, key).ok_or_else(|| {
            let expected = format!("this key, as the kind is \"{}\"", self.kind.name());
            wrong(format!("{}{key}", self.group), expected, "none")
        })
    }

    /// The refusal of a part of another type than its name has in other kinds.
    fn shaped(name: &str, expected: &str) -> ProblemError {
        wrong(name, expected, "something else")
    }
}

impl Parts for Keyed<'_> {
    fn has(&self, name: &str) -> bool {
        self.keys.iter().any(|key| key.0 == name)
    }

    fn vector(&mut self, name: &'static str) -> Result<Vec<f64>, ProblemError> {
        match self.need(name)? {
            Value::Vector(x) => Ok(x),
            _ => Err(Self::shaped(name, "a vector")),
        }
    }

    fn count(&mut self, name: &'static str) -> Result<usize, ProblemError> {
        match self.need(name)? {
            Value::Count(n) => Ok(n),
            _ => Err(Self::shaped(name, "a number")),
        }
    }

    fn expressions(&mut self, name: &'static str) -> Result<Expressions, ProblemError> {
        match self.need(name)? {
            Value::Texts(texts) => Expressions::parse(&texts, self.names),
            _ => Err(Self::shaped(name, "an array of texts")),
        }
    }

    fn matrix(&mut self, name: &'static str) -> Result<Matrix, ProblemError> {
        match self.need(name)? {
            Value::Matrix(stated) => matrix_of(name, stated, self.room),
            _ => Err(Self::shaped(name, "a matrix")),
        }
    }

    fn set(&mut self, name: &'static str, variables: usize) -> Result<Set, ProblemError> {
        match self.need(name)? {
            Value::Set(stated) => set::read(stated, name, variables, self.names, self.room),
            _ => Err(Self::shaped(name, "a set")),
        }
    }
}

/// The matrix that is stated at `name`, with at most `room` rows and columns where they are only said.
pub(super) fn matrix_of(name: &str, stated: Given, room: usize) -> Result<Matrix, ProblemError> {
    match stated {
        Given::Rows(rows) => match Dense::from_rows(&rows) {
            Some(dense) => Ok(dense.into()),
            None => {
                let first = rows[0].len();
                let k = rows.iter().position(|r| r.len() != first).unwrap_or_default();
                let expected = format!("{first} entries, as in {name}[0]");
                Err(wrong(format!("{name}[{k}]"), expected, rows[k].len()))
            }
        },
        Given::Entries(Entries { shape: (rows, columns), entries }) => {
            if rows.max(columns) > room {
                let found = format!("{rows} × {columns}");
                let expected = "a matrix that the vectors can fit";
                return Err(wrong(format!("{name}.shape"), expected, found));
            }
            if let Some(k) = entries.iter().position(|e| e.0 >= rows || e.1 >= columns) {
                let expected =
                    format!("a row below {rows} and a column below {columns}, counted from 0");
                let found = format!("{} and {}", entries[k].0, entries[k].1);
                return Err(wrong(format!("{name}.entries[{k}]"), expected, found));
            }
            Ok(Csc::from_triplets(rows, columns, entries.iter().copied())?.into())
        }
    }
}

/// The refusal of a matrix without entries.
pub(super) fn operator(path: &Path) -> IoError {
    IoError::data(path, "M", "the entries of the matrix (dense or sparse)", "an operator")
}

/// The text of a file.
fn format(path: &Path, file: &ProblemFile, problem: &Complementarity) -> Result<String, IoError> {
    let mut out = String::new();
    if let Some(name) = with_complementarity!(problem, p => unstated(p)) {
        let found = "a function that is known by its values only";
        return Err(IoError::data(path, name, "expressions", found));
    }
    let (kind, statement) = with_complementarity!(problem, p => of(p));
    line(&mut out, &format!("# {statement}"));
    line(&mut out, &format!("kind = \"{}\"", kind.name()));
    for (key, said) in [("title", &file.info.title), ("description", &file.info.description)] {
        if let Some(said) = said {
            line(&mut out, &format!("{key} = {}", quoted(said)));
        }
    }
    if !file.info.names.is_empty() {
        let names: Vec<_> = file.info.names.iter().map(|name| quoted(name)).collect();
        line(&mut out, &format!("names = [{}]", names.join(", ")));
    }
    let (mut matrices, mut sets) = (vec![], vec![]);
    for (key, part) in with_complementarity!(problem, p => p.parts()) {
        match part {
            Part::Matrix(m) => matrices.push((key, m)),
            Part::Set(set) => sets.push((key, set)),
            Part::Vector(x) => vector(&mut out, key, x),
            Part::Count(n) => line(&mut out, &format!("{key} = {n}")),
            Part::Expressions(f) => {
                let texts = f.texts(&file.info.names).map_err(IoError::problem(path))?;
                line(&mut out, &format!("{key} = ["));
                texts.iter().for_each(|text| line(&mut out, &format!("  {},", quoted(text))));
                line(&mut out, "]");
            }
        }
    }
    // In TOML, what belongs to no table comes before all tables.
    for (name, m) in &matrices {
        if let Matrix::Dense(m) = m {
            line(&mut out, &format!("{name} = ["));
            for i in 0..m.nrows() {
                line(&mut out, &format!("  {},", list(m.row(i))));
            }
            line(&mut out, "]");
        }
    }
    for (name, m) in &matrices {
        match m {
            Matrix::Dense(_) => {}
            Matrix::Sparse(m) => {
                line(&mut out, &format!("\n[{name}]\nshape = [{}, {}]", m.nrows(), m.ncols()));
                line(&mut out, "entries = [ # row, column (from 0), value");
                for (i, j, x) in m.triplets() {
                    line(&mut out, &format!("  [{i}, {j}, {}],", Digits(x)));
                }
                line(&mut out, "]");
            }
            Matrix::Operator(_) => return Err(operator(path)),
        }
    }
    sets.iter().for_each(|(key, set)| set::write(&mut out, key, set, &file.info.names));
    Ok(out + &solution(problem, file))
}

/// The text of the solution, if there is one.
fn solution(problem: &Complementarity, file: &ProblemFile) -> String {
    let mut out = String::new();
    if let Some(stored) = &file.solution {
        line(&mut out, "\n[solution]");
        let partner = stored.partner.as_deref();
        let parts = with_complementarity!(problem, p => p.parts_of(&stored.point, partner));
        parts.into_iter().for_each(|(key, x)| vector(&mut out, key, x));
    }
    out
}

/// A function of the problem that is no expressions.
fn unstated<P: Stated>(problem: &P) -> Option<&'static str> {
    let parts = problem.parts();
    let functions = P::PARTS.iter().filter(|part| part.1 == Shape::Expressions);
    functions.map(|part| part.0).find(|name| parts.iter().all(|part| part.0 != *name))
}

fn of<P: Stated>(_: &P) -> (Kind, &'static str) {
    (P::KIND, P::STATEMENT)
}

pub(super) fn line(out: &mut String, text: &str) {
    // Writing to a String cannot fail.
    let _ = writeln!(out, "{text}");
}

pub(super) fn vector(out: &mut String, key: &str, x: &[f64]) {
    line(out, &format!("{key} = {}", list(x)));
}

pub(super) fn list(x: &[f64]) -> String {
    let each: Vec<_> = x.iter().map(|&x| Digits(x).to_string()).collect();
    format!("[{}]", each.join(", "))
}

/// A basic string of TOML.
pub(super) fn quoted(text: &str) -> String {
    let mut out = String::from("\"");
    for c in text.chars() {
        match c {
            '"' => out.push_str("\\\""),
            '\\' => out.push_str("\\\\"),
            '\n' => out.push_str("\\n"),
            '\t' => out.push_str("\\t"),
            '\r' => out.push_str("\\r"),
            c if c.is_control() => {
                let _ = write!(out, "\\u{:04X}", u32::from(c));
            }
            c => out.push(c),
        }
    }
    out.push('"');
    out
}
