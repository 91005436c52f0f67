//! Linear complementarity problems as text: LCP, MLCP, horizontal and box-constrained.
//!
//! | format | extension | read | written |
//! | --- | --- | --- | --- |
//! | [`toml`]: our own, with solution and texts; docs/lcp-format.md | `.toml` | all kinds | all kinds |
//! | [`market`]: Matrix Market, `NAME.mtx` with `NAME_q.mtx` beside | `.mtx` | LCP, box | LCP, box |
//! | [`siconos`]: the test data of Siconos | `.dat` | LCP, MLCP, relay | |

pub mod market;
pub mod siconos;
mod tokens;
pub mod toml;

use std::fs::File;
use std::path::Path;

use nonsmooth_problem::{Complementarity, HlcpPoint, LcpPoint, Problem, with_complementarity};

use crate::{Content, IoError, read_any};

/// What a file of a linear complementarity problem holds.
#[derive(Debug, Clone, PartialEq)]
pub struct LinearFile {
    /// The problem.
    pub problem: Complementarity,
    /// A name in a few words.
    pub title: Option<String>,
    /// What its author says about it.
    pub description: Option<String>,
    /// A solution, if one is stored. Nothing says how accurate it is.
    pub solution: Option<LinearPoint>,
}

impl LinearFile {
    /// A file with the problem alone.
    pub fn new(problem: Complementarity) -> Self {
        Self { problem, title: None, description: None, solution: None }
    }
}

/// A point as files store it.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct LinearPoint {
    /// z; `(u, v)` of a mixed problem, x of a horizontal one.
    pub z: Vec<f64>,
    /// `w` of the complementary pairs; s of a horizontal problem, where it belongs to the point. Elsewhere it follows from z and may be absent.
    pub w: Option<Vec<f64>>,
}

impl LinearPoint {
    /// The point of an LCP, an MLCP or a box LCP.
    pub fn to_lcp(&self) -> LcpPoint {
        LcpPoint { z: self.z.clone() }
    }

    /// The point of a horizontal problem.
    pub fn to_hlcp(&self) -> HlcpPoint {
        HlcpPoint { x: self.z.clone(), s: self.w.clone().unwrap_or_default() }
    }

    /// It fits the problem: lengths, finite numbers.
    fn check(&self, path: &Path, problem: &Complementarity) -> Result<(), IoError> {
        let wrong = |problem| IoError::Linear { file: path.into(), problem };
        let pairs = match problem {
            Complementarity::Lcp(p) => p.validate_point(&self.to_lcp()).map(|()| p.dim()),
            Complementarity::Mlcp(p) => p.validate_point(&self.to_lcp()).map(|()| p.pairs()),
            Complementarity::Box(p) => p.validate_point(&self.to_lcp()).map(|()| p.dim()),
            Complementarity::Hlcp(p) => p.validate_point(&self.to_hlcp()).map(|()| p.dim()),
        };
        let pairs = pairs.map_err(wrong)?;
        let Some(w) = &self.w else { return Ok(()) };
        let refuse = |place: String, expected: String, found: String| {
            Err(IoError::data(path, place, expected, found))
        };
        if w.len() != pairs {
            let found = format!("{} entries", w.len());
            return refuse("solution.w".into(), format!("{pairs} entries (pairs)"), found);
        }
        match w.iter().position(|x| !x.is_finite()) {
            Some(k) => {
                refuse(format!("solution.w[{k}]"), "a finite number".into(), w[k].to_string())
            }
            None => Ok(()),
        }
    }
}

/// Reads a file in any of the formats above.
///
/// Errors: anything that is missing, of a wrong type or shape, not finite or out of range, by its line or key; a file of a contact problem.
pub fn read(path: impl AsRef<Path>) -> Result<LinearFile, IoError> {
    let path = path.as_ref();
    match read_any(path)? {
        Content::Linear(file) => Ok(file),
        Content::Friction(_) => Err(IoError::Unknown {
            file: path.into(),
            found: "a frictional contact problem".into(),
        }),
    }
}

/// Writes a file in the format of its extension, `.toml` or `.mtx`, in place of the one of that name if there is one.
///
/// Errors: another extension; a problem that is not valid or is known by its products only; a point that does not fit; what the system refuses.
pub fn write(path: impl AsRef<Path>, content: &LinearFile) -> Result<(), IoError> {
    let path = path.as_ref();
    match path.extension().and_then(|e| e.to_str()) {
        Some("toml") => toml::write(path, content),
        Some("mtx") => market::write(path, content),
        _ => Err(IoError::data(path, "the name", "an extension .toml or .mtx", "another")),
    }
}

/// The problem and its solution are valid.
fn check(path: &Path, content: &LinearFile) -> Result<(), IoError> {
    let valid = with_complementarity!(&content.problem, p => p.validate());
    valid.map_err(|problem| IoError::Linear { file: path.into(), problem })?;
    content.solution.as_ref().map_or(Ok(()), |s| s.check(path, &content.problem))
}

pub(crate) const READABLE: &str = "a readable file";

/// Opens a regular file.
pub(crate) fn open(path: &Path) -> Result<File, IoError> {
    let refused = |e| IoError::os(path, READABLE, e);
    if std::fs::metadata(path).map_err(refused)?.is_dir() {
        return Err(IoError::Unknown { file: path.into(), found: "a directory".into() });
    }
    File::open(path).map_err(refused)
}

/// The text of a file.
fn text(path: &Path) -> Result<String, IoError> {
    use std::io::Read;
    let mut bytes = vec![];
    open(path)?.read_to_end(&mut bytes).map_err(|e| IoError::os(path, READABLE, e))?;
    // What is no number ends a problem's data in Siconos' files: remarks may be in any encoding.
    match String::from_utf8(bytes) {
        Ok(text) => Ok(text),
        Err(e) => Ok(String::from_utf8_lossy(e.as_bytes()).into_owned()),
    }
}

/// A number with as many digits as tell it from all others.
struct Digits(f64);

impl std::fmt::Display for Digits {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        // `{:?}` is the shortest text that reads back as the same bits; of infinities it is `inf`.
        write!(f, "{:?}", self.0)
    }
}
