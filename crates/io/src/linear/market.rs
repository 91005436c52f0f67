//! Matrix Market: `NAME.mtx` is M, `NAME_q.mtx` beside it q. `NAME_l.mtx` and `NAME_u.mtx`, where they are, make it a box LCP;
//! `NAME_z.mtx` is a solution.
//!
//! Matrices are `coordinate` or `array`, `real` or `integer`, `general`, `symmetric` or `skew-symmetric`. Vectors are matrices of one column, or plain
//! lists of numbers. Values pass bit for bit; a matrix of `coordinate` is sparse, one of `array` dense.

use std::fmt::Write;
use std::path::{Path, PathBuf};

use nonsmooth_linalg::{Csc, Dense, Matrix};
use nonsmooth_problem::{AnyProblem, BoxLcp, Complementarity, Kind, Lcp, LcpPoint, OfAnyPoint};

use super::{Digits, check, toml};
use crate::format::{About, bytes, put};
use crate::tokens::{Tokens, text};
use crate::{Format, IoError, ProblemFile};

/// What stands between the name of the matrix and the extension of its vectors' files: q, lower and upper bounds, a solution.
const PARTS: [&str; 4] = ["_q", "_l", "_u", "_z"];

const KINDS: &[Kind] = &[Kind::Lcp, Kind::BoxLcp];

/// The format.
///
/// Errors of reading: no file of q; a file that is damaged, by its line; one bound without the other; parts that do not fit. Of writing: another kind; a
/// problem that is known by its products only; a file in the place of a vector that the content lacks.
#[derive(Debug, Clone, Copy)]
pub struct Market;

impl Format for Market {
    fn about(&self) -> &'static About {
        const ABOUT: About = About {
            name: "Matrix Market",
            extensions: &["mtx"],
            reads: KINDS,
            writes: KINDS,
            keeps_solutions: false,
            one_file: false,
            ..About::TEXT
        };
        &ABOUT
    }

    fn begins(&self, bytes: &[u8]) -> bool {
        bytes.starts_with(b"%%MatrixMarket")
    }

    fn holds_problem(&self, path: &Path, bytes: &[u8]) -> bool {
        self.begins(bytes) && !is_part(path)
    }

    fn parts(&self, path: &Path) -> Vec<PathBuf> {
        let vectors = vectors(path).into_iter().filter(|p| p.is_file());
        std::iter::once(path.into()).chain(vectors).collect()
    }

    /// The matrix without the vectors beside it, which is no problem yet.
    fn parse(&self, name: &Path, bytes: &[u8]) -> Result<ProblemFile, IoError> {
        parse(name, &text(bytes), [None; 4])
    }

    fn read(&self, path: &Path) -> Result<ProblemFile, IoError> {
        let matrix = bytes(path)?;
        let mut parts = [const { None }; 4];
        for (part, file) in parts.iter_mut().zip(&vectors(path)) {
            *part = if file.is_file() { Some(bytes(file)?) } else { None };
        }
        let parts = parts.each_ref().map(|part| part.as_deref().map(text));
        parse(path, &text(&matrix), parts.each_ref().map(Option::as_deref))
    }

    /// Refused: the vectors have files of their own.
    fn to_bytes(&self, name: &Path, _: &ProblemFile) -> Result<Vec<u8>, IoError> {
        let expected = "a name, as the vectors stand in files beside the matrix";
        Err(IoError::data(name, "the file", expected, "one stream of bytes"))
    }

    fn write(&self, path: &Path, file: &ProblemFile) -> Result<(), IoError> {
        write(path, file)
    }
}

/// The files of q, l, u and z that belong to the matrix in `path`.
fn vectors(path: &Path) -> [PathBuf; 4] {
    let stem = path.file_stem().unwrap_or_default().to_string_lossy();
    PARTS.map(|part| path.with_file_name(format!("{stem}{part}.mtx")))
}

/// Whether a file is the vector of a matrix beside it.
fn is_part(path: &Path) -> bool {
    let stem = path.file_stem().unwrap_or_default().to_string_lossy();
    let matrix = PARTS.iter().find_map(|part| stem.strip_suffix(part));
    matrix.is_some_and(|matrix| path.with_file_name(format!("{matrix}.mtx")).is_file())
}

/// Reads the texts of the matrix and of q, l, u and z, where they are; `path` is the name of the matrix in messages. Errors: as of [`Market`].
pub fn parse(
    path: impl AsRef<Path>,
    text: &str,
    parts: [Option<&str>; 4],
) -> Result<ProblemFile, IoError> {
    let path = path.as_ref();
    let m = matrix(path, text)?;
    let files = vectors(path);
    let name = |k: usize| files[k].file_name().unwrap_or_default().to_string_lossy().into_owned();
    let part = |k: usize| parts[k].map(|text| vector(&files[k], text)).transpose();
    let Some(q) = part(0)? else {
        let expected = format!("a file {} beside the matrix", name(0));
        return Err(IoError::data(path, "q", expected, "none"));
    };
    let problem = match (part(1)?, part(2)?) {
        (None, None) => Lcp::new(m, q).map(AnyProblem::from),
        (Some(l), Some(u)) => BoxLcp::new(m, q, l, u).map(AnyProblem::from),
        (l, _) => {
            let (missing, there) = if l.is_some() { (2, 1) } else { (1, 2) };
            let expected = format!("a file {} beside {}", name(missing), name(there));
            return Err(IoError::data(path, "bounds", expected, "none"));
        }
    };
    let problem = problem.map_err(IoError::problem(path))?;
    let solution = part(3)?.map(|z| LcpPoint { z }.into());
    let file = ProblemFile { solution, ..ProblemFile::new(problem) };
    check(path, &file)?;
    Ok(file)
}

/// What the first line says.
struct Banner {
    coordinate: bool,
    symmetry: Symmetry,
}

#[derive(Clone, Copy, PartialEq)]
enum Symmetry {
    General,
    Symmetric,
    Skew,
}

/// The words after the first line and the comments below it.
fn banner<'a>(path: &'a Path, text: &'a str) -> Result<(Banner, Tokens<'a>), IoError> {
    let mut tokens = Tokens::new(path, text);
    let first = tokens.line().trim().to_lowercase();
    let words: Vec<_> = first.split_whitespace().collect();
    let wrong = |expected: &str, found: &str| {
        Err(IoError::data(path, "line 1", expected, format!("`{found}`")))
    };
    let [_, "matrix", layout, field, symmetry] = words[..] else {
        return wrong("`%%MatrixMarket matrix LAYOUT FIELD SYMMETRY`", &first);
    };
    if words[0] != "%%matrixmarket" {
        return wrong("`%%MatrixMarket`", words[0]);
    }
    if !["coordinate", "array"].contains(&layout) {
        return wrong("coordinate or array", layout);
    }
    if !["real", "integer", "double"].contains(&field) {
        return wrong("real or integer", field);
    }
    let symmetry = match symmetry {
        "general" => Symmetry::General,
        "symmetric" => Symmetry::Symmetric,
        "skew-symmetric" => Symmetry::Skew,
        other => return wrong("general, symmetric or skew-symmetric", other),
    };
    loop {
        let mut ahead = tokens.clone();
        match ahead.word() {
            Some(word) if word.starts_with('%') => {
                ahead.line();
                tokens = ahead;
            }
            _ => break,
        }
    }
    Ok((Banner { coordinate: layout == "coordinate", symmetry }, tokens))
}

fn matrix(path: &Path, text: &str) -> Result<Matrix, IoError> {
    let (Banner { coordinate, symmetry }, mut t) = banner(path, text)?;
    let made = match coordinate {
        true => sparse(&mut t, symmetry)?.into(),
        false => dense(&mut t, symmetry)?.into(),
    };
    match t.word() {
        None => Ok(made),
        Some(word) => Err(t.wrong("after the last entry", "the end of the file", Some(word))),
    }
}

fn mirrored(t: &Tokens, symmetry: Symmetry, rows: usize, columns: usize) -> Result<(), IoError> {
    if symmetry != Symmetry::General && rows != columns {
        let found = format!("{rows} × {columns}");
        return Err(t.wrong("the shape", "a square matrix, as it is symmetric", Some(&found)));
    }
    Ok(())
}

fn sparse(t: &mut Tokens, symmetry: Symmetry) -> Result<Csc, IoError> {
    // A column without entries leaves no trace in the file, but a vector beside it must have its row.
    const MOST: usize = 1 << 40;
    let below = |n: usize| n <= MOST;
    let rows = t.one_of("the number of rows", "a whole number", below)?;
    let columns = t.one_of("the number of columns", "a whole number", below)?;
    mirrored(t, symmetry, rows, columns)?;
    let count = t.count("the number of entries")?;
    // Each row and column of a matrix without zero columns has an entry; more than the file has room for cannot be meant.
    if rows.max(columns) > t.left().max(1 << 20) {
        let found = format!("{rows} × {columns}");
        return Err(t.wrong("the shape", "a matrix that the entries can fill", Some(&found)));
    }
    let mut entries = Vec::with_capacity(2 * count);
    // Whether entries stand above the diagonal, and below it.
    let (mut above, mut below) = (false, false);
    for k in 0..count {
        let what = format!("entry {k}");
        let index = |t: &mut Tokens, size: usize| {
            let expected = format!("an index from 1 to {size}");
            t.one_of(&what, &expected, |i| (1..=size).contains(&i)).map(|i| i - 1)
        };
        let (i, j) = (index(t, rows)?, index(t, columns)?);
        let x = t.real(|| format!("entry {k}"))?;
        (above, below) = (above || i < j, below || i > j);
        let refused = match symmetry {
            Symmetry::Symmetric | Symmetry::Skew if above && below => {
                Some("entries of one triangle, as the other follows from it")
            }
            Symmetry::Skew if i == j && x != 0.0 => {
                Some("no diagonal, as the matrix is skew-symmetric")
            }
            _ => None,
        };
        if let Some(expected) = refused {
            return Err(t.wrong(&what, expected, Some(&format!("({}, {})", i + 1, j + 1))));
        }
        entries.push((i, j, x));
        match symmetry {
            Symmetry::Symmetric if i != j => entries.push((j, i, x)),
            Symmetry::Skew if i != j => entries.push((j, i, -x)),
            _ => {}
        }
    }
    let made = Csc::from_triplets(rows, columns, entries.iter().copied());
    made.map_err(|e| t.wrong("the entries", "indices inside the matrix", Some(&e.to_string())))
}

/// By columns; of a symmetric matrix the lower triangle, of a skew one without the diagonal.
fn dense(t: &mut Tokens, symmetry: Symmetry) -> Result<Dense, IoError> {
    let rows = t.count("the number of rows")?;
    let columns = t.count("the number of columns")?;
    mirrored(t, symmetry, rows, columns)?;
    let stated = match symmetry {
        Symmetry::General => rows.checked_mul(columns),
        Symmetry::Symmetric => rows.checked_mul(rows + 1).map(|n| n / 2),
        Symmetry::Skew => rows.checked_mul(rows.max(1) - 1).map(|n| n / 2),
    };
    if stated.is_none_or(|n| n > t.left() / 2 + 1) {
        let expected = format!("a file with {rows} × {columns} entries");
        return Err(t.wrong("the entries", &expected, None));
    }
    let mut m = Dense::zeros(rows, columns);
    for j in 0..columns {
        let first = match symmetry {
            Symmetry::General => 0,
            Symmetry::Symmetric => j,
            Symmetry::Skew => j + 1,
        };
        for i in first..rows {
            let x = t.real(|| format!("entry ({}, {})", i + 1, j + 1))?;
            m[(i, j)] = x;
            match symmetry {
                Symmetry::General => {}
                Symmetry::Symmetric => m[(j, i)] = x,
                Symmetry::Skew => m[(j, i)] = -x,
            }
        }
    }
    Ok(m)
}

/// A matrix of one column, or a list of numbers.
fn vector(path: &Path, text: &str) -> Result<Vec<f64>, IoError> {
    if !text.trim_start().starts_with("%%") {
        let mut t = Tokens::new(path, text);
        let mut all = vec![];
        let mut ahead = t.clone();
        while ahead.word().is_some() {
            all.push(t.real(|| format!("entry {}", all.len()))?);
            ahead = t.clone();
        }
        return Ok(all);
    }
    let m = matrix(path, text)?;
    if m.ncols() != 1 {
        return Err(IoError::data(
            path,
            "the shape",
            "one column",
            format!("{} columns", m.ncols()),
        ));
    }
    // Not by `for_each`, which passes over zeros and their signs.
    if let Matrix::Dense(m) = &m {
        return Ok(m.values().to_vec());
    }
    let mut all = vec![0.0; m.nrows()];
    m.for_each(|i, _, x| all[i] = x);
    Ok(all)
}

/// Writes M to `path` and the vectors beside it, with the solution if there is one.
fn write(path: &Path, file: &ProblemFile) -> Result<(), IoError> {
    let (m, q, bounds) = match check(path, file)? {
        Complementarity::Lcp(p) => (&p.M, &p.q, None),
        Complementarity::Box(p) => (&p.M, &p.q, Some((&p.lower, &p.upper))),
        _ => {
            let expected =
                "a problem with one matrix and one vector (LCP or box LCP); TOML holds the others";
            return Err(IoError::data(path, "the problem", expected, "another kind"));
        }
    };
    let matrix = match m {
        Matrix::Dense(m) => {
            let mut out =
                format!("%%MatrixMarket matrix array real general\n{} {}\n", m.nrows(), m.ncols());
            for j in 0..m.ncols() {
                (0..m.nrows()).for_each(|i| line(&mut out, m[(i, j)]));
            }
            out
        }
        Matrix::Sparse(m) => {
            let (rows, columns, nnz) = (m.nrows(), m.ncols(), m.nnz());
            let mut out =
                format!("%%MatrixMarket matrix coordinate real general\n{rows} {columns} {nnz}\n");
            for (i, j, x) in m.triplets() {
                let _ = write!(out, "{} {} ", i + 1, j + 1);
                line(&mut out, x);
            }
            out
        }
        Matrix::Operator(_) => return Err(toml::operator(path)),
    };
    let parts = [
        Some(&q[..]),
        bounds.map(|b| &b.0[..]),
        bounds.map(|b| &b.1[..]),
        file.solution.as_ref().and_then(|s| LcpPoint::of(&s.point)).map(|point| &point.z[..]),
    ];
    let files = vectors(path);
    let each = || files.iter().zip(parts);
    if let Some((file, _)) = each().find(|(file, x)| x.is_none() && file.exists()) {
        let expected = "no such file, as it would become a part of the problem";
        return Err(IoError::data(file, "the file", expected, "one"));
    }
    put(path, matrix.as_bytes())?;
    for (file, x) in each() {
        if let Some(x) = x {
            let mut out = format!("%%MatrixMarket matrix array real general\n{} 1\n", x.len());
            x.iter().for_each(|&x| line(&mut out, x));
            put(file, out.as_bytes())?;
        }
    }
    Ok(())
}

fn line(out: &mut String, x: f64) {
    // Writing to a String cannot fail.
    let _ = writeln!(out, "{}", Digits(x));
}
