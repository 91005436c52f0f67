//! The formats of files, and how they are told apart.

use std::fs::File;
use std::io::Read;
use std::path::{Path, PathBuf};

use nonsmooth_problem::{AnyProblem, Kind, Problem};

use crate::fclib::Fclib;
use crate::linear::market::Market;
use crate::linear::toml::Toml;
use crate::nl::Nl;
use crate::replace::{WRITABLE, replace};
use crate::siconos::Siconos;
use crate::table::Csv;
use crate::{IoError, ProblemFile};

/// All formats, as help texts, messages and searches list them. A new one is a type with this trait and its line here.
pub static FORMATS: [&dyn Format; 6] = [&Fclib, &Toml, &Market, &Nl, &Siconos, &Csv];

/// What a format is.
#[derive(Debug, Clone, Copy)]
pub struct About {
    /// Its name, for people.
    pub name: &'static str,
    /// The extensions that mean it, in lower case; the first is that of new files.
    pub extensions: &'static [&'static str],
    /// Whether these mean no other format: else the first bytes must tell.
    pub owns_extensions: bool,
    /// The kinds of problems that it reads.
    pub reads: &'static [Kind],
    /// The kinds of problems that it writes.
    pub writes: &'static [Kind],
    /// Whether its files hold problems; else a solution alone.
    pub holds_problems: bool,
    /// Whether the file of a problem has room for solution and texts.
    pub keeps_solutions: bool,
    /// Whether a problem is one file, which may as well be a stream.
    pub one_file: bool,
    /// What the place of the solution is called.
    pub solution: &'static str,
    /// What the place of the first guess is called; `None` of a format that has no guesses.
    pub guess: Option<&'static str>,
}

impl About {
    /// What most texts have in common.
    pub(crate) const TEXT: Self = Self {
        name: "",
        extensions: &[],
        owns_extensions: true,
        reads: &[],
        writes: &[],
        holds_problems: true,
        keeps_solutions: true,
        one_file: true,
        solution: "[solution]",
        guess: None,
    };

    /// The extensions of new files and others, as they stand in names.
    fn endings(&self) -> impl Iterator<Item = String> {
        self.extensions.iter().map(|e| format!(".{e}"))
    }
}

/// A format of files.
pub trait Format: Sync + std::fmt::Debug {
    /// What it is.
    fn about(&self) -> &'static About;

    /// Whether a file that begins with these bytes, of whatever name, is of this format.
    fn begins(&self, bytes: &[u8]) -> bool;

    /// Whether a file of an extension of this format that begins with these bytes holds a problem.
    fn holds_problem(&self, _path: &Path, bytes: &[u8]) -> bool {
        self.begins(bytes)
    }

    /// The files that a problem consists of, the named one first.
    fn parts(&self, path: &Path) -> Vec<PathBuf> {
        vec![path.into()]
    }

    /// The content of a file that consists of these bytes; `name` stands for it in messages.
    ///
    /// Errors: whatever keeps it from being a valid problem, by its place.
    fn parse(&self, name: &Path, bytes: &[u8]) -> Result<ProblemFile, IoError>;

    /// Reads a file. Errors: as [`parse`](Self::parse); what the system refuses.
    fn read(&self, path: &Path) -> Result<ProblemFile, IoError> {
        self.parse(path, &bytes(path)?)
    }

    /// The bytes of a file; `name` stands for it in messages.
    ///
    /// Errors: content that is not valid, or that the format cannot hold, or not in one file.
    fn to_bytes(&self, name: &Path, file: &ProblemFile) -> Result<Vec<u8>, IoError>;

    /// Writes a file as [`ProblemFile::write`] says. Errors: as [`to_bytes`](Self::to_bytes); what the system refuses.
    fn write(&self, path: &Path, file: &ProblemFile) -> Result<(), IoError> {
        put(path, &self.to_bytes(path, file)?)
    }

    /// Writes the solution of a file that was read from `path`, as [`ProblemFile::write_solution`] says. Errors: as [`write`](Self::write).
    fn write_solution(&self, path: &Path, file: &ProblemFile) -> Result<(), IoError> {
        self.write(path, file)
    }
}

/// Bytes that a glance takes in.
const GLANCE: u64 = 4096;

/// The problem in a file of any format; [`ProblemFile::read`] gives the rest of what it holds too.
///
/// Errors: as [`ProblemFile::read`].
pub fn read(path: impl AsRef<Path>) -> Result<AnyProblem, IoError> {
    Ok(ProblemFile::read(path)?.problem)
}

/// The format of a file: by its extension, else by its first bytes.
///
/// Errors: a content of no known format; what the system refuses, where the content is asked for.
pub fn format(path: &Path) -> Result<&'static dyn Format, IoError> {
    if let Some(format) = of_extension(path).filter(|f| f.about().owns_extensions) {
        return Ok(format);
    }
    sniffed(path, &glance(path)?)
}

/// What a file of any format holds. A pipe is read once: what a glance took in would be gone.
pub(crate) fn read_file(path: &Path) -> Result<ProblemFile, IoError> {
    let told = of_extension(path).is_some_and(|f| f.about().owns_extensions);
    if told || std::fs::metadata(path).is_ok_and(|m| m.is_file()) {
        return format(path)?.read(path);
    }
    let bytes = bytes(path)?;
    sniffed(path, &bytes)?.parse(path, &bytes)
}

/// The format of a file by its first bytes; `path` is its name in messages.
///
/// Errors: a content of no known format.
pub fn sniffed(path: &Path, bytes: &[u8]) -> Result<&'static dyn Format, IoError> {
    let format = FORMATS.into_iter().find(|f| f.begins(bytes));
    format.ok_or_else(|| IoError::Unknown { file: path.into(), found: kind_of(bytes) })
}

/// The format whose files have an extension, given without its dot.
pub fn named(extension: &str) -> Option<&'static dyn Format> {
    let extension = extension.to_ascii_lowercase();
    FORMATS.into_iter().find(|f| f.about().extensions.contains(&extension.as_str()))
}

/// The format in which a file of that name holds a problem of a kind: that of its extension, or that of the file that is there.
///
/// Errors: none that can; the message names the extensions of those that can.
pub fn writer(path: &Path, kind: Kind) -> Result<&'static dyn Format, IoError> {
    let writes = |format: &&dyn Format| format.about().writes.contains(&kind);
    format(path).ok().filter(writes).ok_or_else(|| {
        let known: Vec<_> =
            FORMATS.into_iter().filter(writes).flat_map(|f| f.about().endings()).collect();
        IoError::Name { file: path.into(), kind, known: or(&known) }
    })
}

/// The name under which the problem of a file is kept with a solution: its own, or with the extension of a format that has room for one. Where several
/// formats share what the file's holds, the file is read to know the kind.
pub fn keeper(path: &Path) -> PathBuf {
    let Some(poor) = of_extension(path).filter(|f| !f.about().keeps_solutions) else {
        return path.into();
    };
    let rich = |kinds: &[Kind]| {
        FORMATS.into_iter().map(Format::about).find(|about| {
            let all = kinds.iter().all(|kind| about.writes.contains(kind));
            about.holds_problems && about.keeps_solutions && all
        })
    };
    let of_file = || rich(&[poor.read(path).ok()?.problem.kind()]);
    let about = rich(poor.about().reads).or_else(of_file);
    about.map_or_else(|| path.into(), |about| path.with_extension(about.extensions[0]))
}

/// Whether a file looks like one that holds a problem, from its extension and first bytes: to find problems among other files. The
/// vectors beside a Matrix Market matrix are none, nor are TOML files without a `kind`.
pub fn holds_problem(path: &Path) -> bool {
    let format = of_extension(path);
    format.is_some_and(|f| f.holds_problem(path, &glance(path).unwrap_or_default()))
}

/// The files that a problem consists of, the named one first.
pub fn parts(path: &Path) -> Vec<PathBuf> {
    of_extension(path).map_or_else(|| vec![path.into()], |format| format.parts(path))
}

/// The names and extensions of the formats that read problems of some kinds, for help texts: `A (.a), B (.b) or C (.c)`.
pub fn listed(kinds: impl Fn(Kind) -> bool) -> String {
    let reads = |f: &&dyn Format| f.about().reads.iter().any(|&kind| kinds(kind));
    let each = FORMATS.into_iter().filter(reads).map(|f| {
        let extensions: Vec<_> = f.about().endings().collect();
        format!("{} ({})", f.about().name, extensions.join(", "))
    });
    or(&each.collect::<Vec<_>>())
}

/// `a, b or c`.
fn or(all: &[String]) -> String {
    match all {
        [] => "none".into(),
        [one] => one.clone(),
        [others @ .., last] => format!("{} or {last}", others.join(", ")),
    }
}

fn of_extension(path: &Path) -> Option<&'static dyn Format> {
    named(path.extension()?.to_str()?)
}

/// What the first bytes of a file are, if they begin none of a known format.
fn kind_of(bytes: &[u8]) -> &'static str {
    let cut = |e: std::str::Utf8Error| bytes.len() as u64 == GLANCE && e.error_len().is_none();
    match std::str::from_utf8(bytes) {
        _ if bytes.is_empty() => "an empty file",
        Err(e) if !cut(e) => "other data",
        _ => "another text",
    }
}

const READABLE: &str = "a readable file";

/// Opens a regular file.
fn open(path: &Path) -> Result<File, IoError> {
    let refused = |e| IoError::os(path, READABLE, e);
    if std::fs::metadata(path).map_err(refused)?.is_dir() {
        return Err(IoError::Unknown { file: path.into(), found: "a directory" });
    }
    File::open(path).map_err(refused)
}

/// The first bytes of a file.
fn glance(path: &Path) -> Result<Vec<u8>, IoError> {
    let mut bytes = vec![];
    let read = open(path)?.take(GLANCE).read_to_end(&mut bytes);
    read.map(|_| bytes).map_err(|e| IoError::os(path, READABLE, e))
}

/// The bytes of a file.
pub(crate) fn bytes(path: &Path) -> Result<Vec<u8>, IoError> {
    let mut bytes = vec![];
    let read = open(path)?.read_to_end(&mut bytes);
    read.map(|_| bytes).map_err(|e| IoError::os(path, READABLE, e))
}

/// Puts a file of these bytes in place of another.
pub(crate) fn put(path: &Path, bytes: &[u8]) -> Result<(), IoError> {
    replace(path, |temporary| {
        std::fs::write(temporary, bytes).map_err(|e| IoError::os(path, WRITABLE, e))
    })
}
