//! Our own format: a linear complementarity problem as TOML, for people to read and write. docs/formats.md describes it.
//!
//! Numbers are written with as many digits as tell them from all others, so what is written reads back bit for bit, and so does the storage of the
//! matrices (dense or sparse).

use std::fmt::Write;
use std::path::Path;

use nonsmooth_linalg::{Csc, Dense, Matrix};
use nonsmooth_problem::{
    AnyPoint, BoxLcp, Complementarity, Hlcp, HlcpPoint, Kind, Lcp, LcpPoint, Mlcp, OfAnyPoint,
    ProblemError,
};
use serde::Deserialize;
use serde::de::{self, Deserializer, MapAccess, SeqAccess, Visitor};

use super::{Digits, check, unknowns};
use crate::format::About;
use crate::tokens::text;
use crate::{Format, Info, IoError, ProblemFile, StoredPoint};

/// All keys of all kinds; which belong to a kind is said by [`KEYS`].
#[derive(Debug, Default, Deserialize)]
#[serde(deny_unknown_fields)]
#[allow(non_snake_case)]
struct Keys {
    kind: String,
    title: Option<String>,
    description: Option<String>,
    names: Option<Vec<String>>,
    M: Option<Stated>,
    Q: Option<Stated>,
    R: Option<Stated>,
    A: Option<Stated>,
    B: Option<Stated>,
    C: Option<Stated>,
    D: Option<Stated>,
    q: Option<Vec<f64>>,
    a: Option<Vec<f64>>,
    b: Option<Vec<f64>>,
    lower: Option<Vec<f64>>,
    upper: Option<Vec<f64>>,
    free: Option<usize>,
    equalities: Option<usize>,
    solution: Option<Solution>,
}

/// All keys of solutions.
#[derive(Debug, Default, Deserialize)]
#[serde(deny_unknown_fields)]
struct Solution {
    z: Option<Vec<f64>>,
    w: Option<Vec<f64>>,
    u: Option<Vec<f64>>,
    v: Option<Vec<f64>>,
    x: Option<Vec<f64>>,
    s: Option<Vec<f64>>,
}

/// A matrix as it is stated: rows, or a shape and entries.
#[derive(Debug)]
enum Stated {
    Rows(Vec<Vec<f64>>),
    Entries(Entries),
}

#[derive(Debug, Deserialize)]
#[serde(deny_unknown_fields)]
struct Entries {
    shape: (usize, usize),
    entries: Vec<(usize, usize, f64)>,
}

impl<'de> Deserialize<'de> for Stated {
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        struct Either;
        impl<'de> Visitor<'de> for Either {
            type Value = Stated;

            fn expecting(&self, f: &mut std::fmt::Formatter) -> std::fmt::Result {
                f.write_str("a matrix: an array of rows, or a table of shape and entries")
            }

            fn visit_seq<A: SeqAccess<'de>>(self, all: A) -> Result<Stated, A::Error> {
                Vec::deserialize(de::value::SeqAccessDeserializer::new(all)).map(Stated::Rows)
            }

            fn visit_map<A: MapAccess<'de>>(self, all: A) -> Result<Stated, A::Error> {
                let map = de::value::MapAccessDeserializer::new(all);
                Entries::deserialize(map).map(Stated::Entries)
            }
        }
        deserializer.deserialize_any(Either)
    }
}

/// The keys of each kind besides `kind`, `title`, `description`, `names` and `solution`; the `[solution]`'s.
const KEYS: [(Kind, &[&str], &[&str]); 4] = [
    (Kind::Lcp, &["M", "q"], &["z", "w"]),
    (Kind::Mlcp, &["M", "q", "free", "equalities", "A", "B", "C", "D", "a", "b"], &["u", "v", "w"]),
    (Kind::Hlcp, &["Q", "R", "q"], &["x", "s"]),
    (Kind::BoxLcp, &["M", "q", "lower", "upper"], &["z", "w"]),
];

const KINDS: &[Kind] = &[Kind::Lcp, Kind::Mlcp, Kind::Hlcp, Kind::BoxLcp];

/// The format.
///
/// Errors of reading: what is no TOML or has a wrong type, by its line; what is missing, superfluous, of a wrong shape or not finite, by its key. Of writing:
/// a problem that is known by its products only.
#[derive(Debug, Clone, Copy)]
pub struct Toml;

impl Format for Toml {
    fn about(&self) -> &'static About {
        const ABOUT: About = About {
            name: "TOML",
            extensions: &["toml"],
            reads: KINDS,
            writes: KINDS,
            ..About::TEXT
        };
        &ABOUT
    }

    /// Whether a line sets `kind`, which no other TOML file of ours has at its top.
    fn begins(&self, bytes: &[u8]) -> bool {
        let sets = |rest: &str| rest.trim_start().starts_with('=');
        text(bytes).lines().any(|l| l.trim_start().strip_prefix("kind").is_some_and(sets))
    }

    fn parse(&self, name: &Path, bytes: &[u8]) -> Result<ProblemFile, IoError> {
        parse(name, &text(bytes))
    }

    fn to_bytes(&self, name: &Path, file: &ProblemFile) -> Result<Vec<u8>, IoError> {
        let problem = check(name, file)?;
        Ok(format(file, problem).ok_or_else(|| operator(name))?.into_bytes())
    }
}

/// Reads the text of a file.
fn parse(path: &Path, text: &str) -> Result<ProblemFile, IoError> {
    let keys: Keys = toml::from_str(text).map_err(|e| {
        let line = e.span().map_or(1, |s| 1 + text[..s.start].matches('\n').count());
        IoError::data(
            path,
            format!("line {line}"),
            "a problem as docs/formats.md describes it",
            e.message(),
        )
    })?;
    let file = Keyed { path, kind: Kind::Lcp, room: text.len().max(1 << 20) };
    let Some(&(kind, of_problem, of_point)) = KEYS.iter().find(|k| k.0.name() == keys.kind) else {
        let names: Vec<_> = KEYS.iter().map(|k| format!("\"{}\"", k.0.name())).collect();
        let found = format!("\"{}\"", keys.kind);
        return Err(IoError::data(path, "kind", format!("one of {}", names.join(", ")), found));
    };
    let file = Keyed { kind, ..file };
    file.only(&keys.given(), of_problem, "")?;
    if let Some(solution) = &keys.solution {
        file.only(&solution.given(), of_point, "solution.")?;
    }
    let Keys { title, description, names, solution, .. } = &keys;
    let (title, description) = (title.clone(), description.clone());
    let names = names.clone().unwrap_or_default();
    let solution = solution.as_ref().map(|solution| file.point(solution)).transpose()?;
    let content = ProblemFile {
        info: Info { title, description, names, ..Info::default() },
        solution,
        ..ProblemFile::new(file.problem(keys)?)
    };
    check(path, &content)?;
    Ok(content)
}

impl Keys {
    /// The keys that the file has.
    fn given(&self) -> Vec<&'static str> {
        let there = [
            ("M", self.M.is_some()),
            ("Q", self.Q.is_some()),
            ("R", self.R.is_some()),
            ("A", self.A.is_some()),
            ("B", self.B.is_some()),
            ("C", self.C.is_some()),
            ("D", self.D.is_some()),
            ("q", self.q.is_some()),
            ("a", self.a.is_some()),
            ("b", self.b.is_some()),
            ("lower", self.lower.is_some()),
            ("upper", self.upper.is_some()),
            ("free", self.free.is_some()),
            ("equalities", self.equalities.is_some()),
        ];
        there.into_iter().filter(|k| k.1).map(|k| k.0).collect()
    }
}

impl Solution {
    fn given(&self) -> Vec<&'static str> {
        let there = [
            ("z", self.z.is_some()),
            ("w", self.w.is_some()),
            ("u", self.u.is_some()),
            ("v", self.v.is_some()),
            ("x", self.x.is_some()),
            ("s", self.s.is_some()),
        ];
        there.into_iter().filter(|k| k.1).map(|k| k.0).collect()
    }
}

/// A file whose kind is known.
struct Keyed<'a> {
    path: &'a Path,
    kind: Kind,
    /// The most rows or columns that a matrix in the file can have: the vectors must have entries for them.
    room: usize,
}

impl Keyed<'_> {
    fn wrong(
        &self,
        place: impl Into<String>,
        expected: impl Into<String>,
        found: impl std::fmt::Display,
    ) -> IoError {
        IoError::data(self.path, place, expected, found)
    }

    /// No other keys than the kind has.
    fn only(&self, given: &[&str], known: &[&str], group: &str) -> Result<(), IoError> {
        match given.iter().find(|k| !known.contains(k)) {
            Some(key) => {
                let expected =
                    format!("the keys of kind \"{}\": {}", self.kind.name(), known.join(", "));
                Err(self.wrong(format!("{group}{key}"), expected, "this one"))
            }
            None => Ok(()),
        }
    }

    fn need<T>(&self, key: &str, value: Option<T>) -> Result<T, IoError> {
        value.ok_or_else(|| {
            let expected = format!("this key, as the kind is \"{}\"", self.kind.name());
            self.wrong(key, expected, "none")
        })
    }

    fn matrix(&self, name: &str, stated: Option<Stated>) -> Result<Matrix, IoError> {
        match self.need(name, stated)? {
            Stated::Rows(rows) => match Dense::from_rows(&rows) {
                Some(dense) => Ok(dense.into()),
                None => {
                    let first = rows[0].len();
                    let k = rows.iter().position(|r| r.len() != first).unwrap_or_default();
                    let expected = format!("{first} entries, as in {name}[0]");
                    Err(self.wrong(format!("{name}[{k}]"), expected, rows[k].len()))
                }
            },
            Stated::Entries(Entries { shape: (rows, columns), entries }) => {
                if rows.max(columns) > self.room {
                    let found = format!("{rows} × {columns}");
                    return Err(self.wrong(
                        format!("{name}.shape"),
                        "a matrix that the vectors can fit",
                        found,
                    ));
                }
                if let Some(k) = entries.iter().position(|e| e.0 >= rows || e.1 >= columns) {
                    let expected =
                        format!("a row below {rows} and a column below {columns}, counted from 0");
                    let found = format!("{} and {}", entries[k].0, entries[k].1);
                    return Err(self.wrong(format!("{name}.entries[{k}]"), expected, found));
                }
                let made = Csc::from_triplets(rows, columns, entries.iter().copied());
                made.map(Matrix::from).map_err(|problem| self.invalid(problem.into()))
            }
        }
    }

    fn invalid(&self, problem: ProblemError) -> IoError {
        IoError::problem(self.path)(problem)
    }

    fn problem(&self, k: Keys) -> Result<Complementarity, IoError> {
        let made = match self.kind {
            Kind::Lcp => {
                Lcp::new(self.matrix("M", k.M)?, self.need("q", k.q)?).map(Complementarity::Lcp)
            }
            Kind::BoxLcp => {
                let (lower, upper) = (self.need("lower", k.lower)?, self.need("upper", k.upper)?);
                BoxLcp::new(self.matrix("M", k.M)?, self.need("q", k.q)?, lower, upper)
                    .map(Complementarity::Box)
            }
            Kind::Hlcp => {
                Hlcp::new(self.matrix("Q", k.Q)?, self.matrix("R", k.R)?, self.need("q", k.q)?)
                    .map(Complementarity::Hlcp)
            }
            _ => return self.mixed(k),
        };
        made.map_err(|problem| self.invalid(problem))
    }

    /// An MLCP, as M, q and the number of free variables, or by its blocks.
    fn mixed(&self, k: Keys) -> Result<Complementarity, IoError> {
        let given = k.given();
        let blocks = ["A", "B", "C", "D", "a", "b"];
        let block = given.iter().find(|g| blocks.contains(g));
        let whole = given.iter().find(|g| !blocks.contains(g));
        let made = match (block, whole) {
            (Some(block), Some(whole)) => {
                let expected = "either M, q and free, or A, B, C, D, a and b";
                return Err(self.wrong(*block, expected, format!("both this and {whole}")));
            }
            (None, _) => {
                let free = self.need("free", k.free)?;
                let (matrix, q) = (self.matrix("M", k.M)?, self.need("q", k.q)?);
                Mlcp::rectangular(matrix, q, k.equalities.unwrap_or(free), free)
            }
            (Some(_), None) => {
                let (a, b) = (self.need("a", k.a)?, self.need("b", k.b)?);
                let a_matrix = self.matrix("A", k.A)?;
                let (p, n, m) = (a.len(), a_matrix.ncols(), b.len());
                // What is not stated is zero.
                let mut sparse = matches!(a_matrix, Matrix::Sparse(_));
                let mut other = |name, stated: Option<Stated>, rows, columns| match stated {
                    None => Ok(Csc::zeros(rows, columns)),
                    stated => {
                        let block = self.matrix(name, stated)?;
                        sparse |= matches!(block, Matrix::Sparse(_));
                        Ok(block.to_csc().unwrap_or_else(|| Csc::zeros(rows, columns)))
                    }
                };
                let b_matrix = other("B", k.B, m, m)?;
                let c_matrix = other("C", k.C, p, m)?;
                let d_matrix = other("D", k.D, m, n)?;
                let a_matrix = a_matrix.to_csc().unwrap_or_else(|| Csc::zeros(p, n));
                Mlcp::from_blocks([&a_matrix, &b_matrix, &c_matrix, &d_matrix], &a, &b).map(
                    |made| {
                        match made.M.to_dense() {
                            // Rows make a dense matrix, entries a sparse one.
                            Some(dense) if !sparse => Mlcp { M: dense.into(), ..made },
                            _ => made,
                        }
                    },
                )
            }
        };
        made.map(Complementarity::Mlcp).map_err(|problem| self.invalid(problem))
    }

    fn point(&self, s: &Solution) -> Result<StoredPoint, IoError> {
        let need = |key: &str, value: &Option<Vec<f64>>| {
            self.need(&format!("solution.{key}"), value.clone())
        };
        let point: AnyPoint = match self.kind {
            Kind::Hlcp => HlcpPoint { x: need("x", &s.x)?, s: need("s", &s.s)? }.into(),
            Kind::Mlcp => LcpPoint { z: [need("u", &s.u)?, need("v", &s.v)?].concat() }.into(),
            _ => LcpPoint { z: need("z", &s.z)? }.into(),
        };
        Ok(StoredPoint { point, partner: s.w.clone(), statuses: vec![] })
    }
}

/// The refusal of a matrix without entries.
pub(super) fn operator(path: &Path) -> IoError {
    IoError::data(path, "M", "the entries of the matrix (dense or sparse)", "an operator")
}

/// The text of a file; `None` of an operator.
fn format(file: &ProblemFile, problem: &Complementarity) -> Option<String> {
    let mut out = String::new();
    let kind = match problem {
        Complementarity::Lcp(_) => (Kind::Lcp, "0 <= z, w = M z + q >= 0, z'w = 0"),
        Complementarity::Mlcp(_) => (
            Kind::Mlcp,
            "A u + C v + a = 0, 0 <= v, w = D u + B v + b >= 0, v'w = 0; M = [A C; D B], q = (a, b)",
        ),
        Complementarity::Hlcp(_) => (Kind::Hlcp, "Q x + R s = q, 0 <= x, s >= 0, x's = 0"),
        Complementarity::Box(_) => {
            (Kind::BoxLcp, "-(M z + q) in the normal cone of [lower, upper] at z")
        }
    };
    line(&mut out, &format!("# {}", kind.1));
    line(&mut out, &format!("kind = \"{}\"", kind.0.name()));
    for (key, said) in [("title", &file.info.title), ("description", &file.info.description)] {
        if let Some(said) = said {
            line(&mut out, &format!("{key} = {}", quoted(said)));
        }
    }
    if !file.info.names.is_empty() {
        let names: Vec<_> = file.info.names.iter().map(|name| quoted(name)).collect();
        line(&mut out, &format!("names = [{}]", names.join(", ")));
    }
    let matrices: Vec<(&str, &Matrix)> = match problem {
        Complementarity::Lcp(p) => {
            vector(&mut out, "q", &p.q);
            vec![("M", &p.M)]
        }
        Complementarity::Mlcp(p) => {
            line(&mut out, &format!("free = {}", p.free));
            if p.equalities != p.free {
                line(&mut out, &format!("equalities = {}", p.equalities));
            }
            vector(&mut out, "q", &p.q);
            vec![("M", &p.M)]
        }
        Complementarity::Hlcp(p) => {
            vector(&mut out, "q", &p.q);
            vec![("Q", &p.Q), ("R", &p.R)]
        }
        Complementarity::Box(p) => {
            vector(&mut out, "q", &p.q);
            vector(&mut out, "lower", &p.lower);
            vector(&mut out, "upper", &p.upper);
            vec![("M", &p.M)]
        }
    };
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
            Matrix::Operator(_) => return None,
        }
    }
    if let Some(StoredPoint { point, partner, .. }) = &file.solution {
        line(&mut out, "\n[solution]");
        let (z, w) = (unknowns(point), partner.as_deref());
        let parts = match problem {
            Complementarity::Mlcp(p) => {
                vec![("u", Some(&z[..p.free])), ("v", Some(&z[p.free..])), ("w", w)]
            }
            Complementarity::Hlcp(_) => vec![("x", Some(z)), ("s", slack(point))],
            _ => vec![("z", Some(z)), ("w", w)],
        };
        for (key, x) in parts {
            if let Some(x) = x {
                vector(&mut out, key, x);
            }
        }
    }
    Some(out)
}

/// s of a horizontal problem's point.
fn slack(point: &AnyPoint) -> Option<&[f64]> {
    HlcpPoint::of(point).map(|point| &point.s[..])
}

fn line(out: &mut String, text: &str) {
    // Writing to a String cannot fail.
    let _ = writeln!(out, "{text}");
}

fn vector(out: &mut String, key: &str, x: &[f64]) {
    line(out, &format!("{key} = {}", list(x)));
}

fn list(x: &[f64]) -> String {
    let each: Vec<_> = x.iter().map(|&x| Digits(x).to_string()).collect();
    format!("[{}]", each.join(", "))
}

/// A basic string of TOML.
fn quoted(text: &str) -> String {
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
