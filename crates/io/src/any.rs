//! Files of any kind that this crate reads, told apart by extension and content.

use std::io::Read;
use std::path::{Path, PathBuf};

use nonsmooth_problem::AnyProblem;

use crate::IoError;
use crate::fclib::{self, FclibFile};
use crate::linear::{self, LinearFile, market};

/// What a file holds.
// One a file: its size does not matter.
#[allow(clippy::large_enum_variant)]
#[derive(Debug, Clone, PartialEq)]
pub enum Content {
    /// A frictional contact problem.
    Friction(FclibFile),
    /// A linear complementarity problem.
    Linear(LinearFile),
}

impl Content {
    /// The problem alone.
    pub fn into_problem(self) -> AnyProblem {
        match self {
            Content::Friction(file) => file.problem.into(),
            Content::Linear(file) => file.problem.into(),
        }
    }
}

/// The formats.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Format {
    Fclib,
    Toml,
    Market,
    Siconos,
}

/// The first bytes of every Matrix Market file.
const MARKET: &[u8] = b"%%MatrixMarket";
/// Bytes that a glance takes in.
const GLANCE: u64 = 4096;

/// Reads a file of any kind. The extension says which: `.hdf5`, `.h5` FCLIB's, `.toml` ours, `.mtx` Matrix Market; of others, such as
/// Siconos' `.dat`, the first bytes.
///
/// Errors: as [`fclib::read`] and [`linear::read`]; a content of no known kind.
pub fn read_any(path: impl AsRef<Path>) -> Result<Content, IoError> {
    let path = path.as_ref();
    match format(path)? {
        Some(Format::Fclib) => fclib::read(path).map(Content::Friction),
        Some(Format::Toml) => linear::toml::read(path).map(Content::Linear),
        Some(Format::Market) => market::read(path).map(Content::Linear),
        Some(Format::Siconos) => linear::siconos::read(path).map(Content::Linear),
        None => Err(IoError::Unknown { file: path.into(), found: describe(&glance(path)?) }),
    }
}

/// The problem in a file of any kind; [`read_any`] gives the rest of what it holds too.
///
/// Errors: as [`read_any`].
pub fn read(path: impl AsRef<Path>) -> Result<AnyProblem, IoError> {
    Ok(read_any(path)?.into_problem())
}

/// Whether a file looks like one that holds a problem, from its extension and first bytes: to find problems among other files. The
/// vectors beside a Matrix Market matrix are none, nor are TOML files without a `kind`.
pub fn holds_problem(path: &Path) -> bool {
    match (by_extension(path), glance(path)) {
        (Some(Format::Fclib), _) => true,
        (Some(Format::Toml), Ok(bytes)) => {
            let text = String::from_utf8_lossy(&bytes);
            text.lines().any(|l| l.trim_start().strip_prefix("kind").is_some_and(is_key))
        }
        (Some(Format::Market), Ok(bytes)) => bytes.starts_with(MARKET) && !market::is_part(path),
        (None, Ok(bytes)) => {
            path.extension().is_some_and(|e| e == "dat")
                && is_number(&String::from_utf8_lossy(&bytes))
        }
        _ => false,
    }
}

/// The files that a problem consists of, the named one first.
pub fn parts(path: &Path) -> Vec<PathBuf> {
    let mut all = vec![path.to_path_buf()];
    if by_extension(path) == Some(Format::Market) {
        all.extend(market::vectors(path).into_iter().filter(|p| p.is_file()));
    }
    all
}

fn by_extension(path: &Path) -> Option<Format> {
    match path.extension()?.to_str()?.to_ascii_lowercase().as_str() {
        "hdf5" | "h5" => Some(Format::Fclib),
        "toml" => Some(Format::Toml),
        "mtx" => Some(Format::Market),
        _ => None,
    }
}

fn format(path: &Path) -> Result<Option<Format>, IoError> {
    if let Some(format) = by_extension(path) {
        return Ok(Some(format));
    }
    let bytes = glance(path)?;
    if crate::hdf5::is_hdf5(&bytes) {
        return Ok(Some(Format::Fclib));
    }
    if bytes.starts_with(MARKET) {
        return Ok(Some(Format::Market));
    }
    Ok(is_number(&String::from_utf8_lossy(&bytes)).then_some(Format::Siconos))
}

/// The rest of a line after a word that may be a key.
fn is_key(rest: &str) -> bool {
    rest.trim_start().starts_with('=')
}

/// Whether a text begins with a number.
fn is_number(text: &str) -> bool {
    text.split_whitespace().next().is_some_and(|word| word.parse::<f64>().is_ok())
}

fn describe(bytes: &[u8]) -> String {
    match std::str::from_utf8(bytes) {
        _ if bytes.is_empty() => "an empty file".into(),
        Ok(_) => "another text".into(),
        Err(e) if bytes.len() as u64 == GLANCE && e.error_len().is_none() => "another text".into(),
        Err(_) => "other data".into(),
    }
}

/// The first bytes of a file.
fn glance(path: &Path) -> Result<Vec<u8>, IoError> {
    let mut bytes = vec![];
    let file = linear::open(path)?;
    file.take(GLANCE)
        .read_to_end(&mut bytes)
        .map_err(|e| IoError::os(path, linear::READABLE, e))?;
    Ok(bytes)
}
