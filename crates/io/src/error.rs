//! What can go wrong with a file.

use std::fmt::Display;
use std::path::{Path, PathBuf};

use nonsmooth_problem::{Kind, ProblemError};

use crate::listed;

/// What is wrong with a file. Each message is one line: the file, the place, what was expected and found.
///
/// A place is a dataset or group of the file, for example `/fclib_local/W/p`, or one entry of it, `.../p[3]`.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum IoError {
    /// The operating system refuses: no such file, no permission, no space, ...
    #[error("{}: expected {expected}, found: {cause}", file.display())]
    Os {
        /// The file.
        file: PathBuf,
        /// What the operation needed.
        expected: &'static str,
        /// The system's answer.
        cause: std::io::Error,
    },
    /// The file is not HDF5 at all.
    #[error("{}: expected an HDF5 file, found {found}", file.display())]
    NotHdf5 {
        /// The file.
        file: PathBuf,
        /// What it is instead.
        found: &'static str,
    },
    /// The HDF5 structure is damaged, or uses a feature of HDF5 that cannot be read.
    #[error("{}: {place}: expected intact HDF5 data, found: {found}", file.display())]
    Hdf5 {
        /// The file.
        file: PathBuf,
        /// The dataset or group at fault.
        place: String,
        /// How the damage showed.
        found: String,
    },
    /// The file holds no problem, or more than one.
    #[error("{}: /: expected one group of a problem (/fclib_local, /fclib_global, or the same of rolling friction), found {found}", file.display())]
    Root {
        /// The file.
        file: PathBuf,
        /// The groups that it has.
        found: String,
    },
    /// The file holds a kind of problem, or a link, that is not supported.
    #[error("{}: {place}: {what} is not supported yet", file.display())]
    Unsupported {
        /// The file.
        file: PathBuf,
        /// The group of the problem, or the link.
        place: String,
        /// The kind of problem, or of link.
        what: &'static str,
    },
    /// A dataset or group is absent, or has a wrong type, shape or value.
    #[error("{}: {place}: expected {expected}, found {found}", file.display())]
    Data {
        /// The file.
        file: PathBuf,
        /// The dataset, group or entry at fault.
        place: String,
        /// What must stand there.
        expected: String,
        /// What stands there.
        found: String,
    },
    /// The file holds no problem in a format that is known.
    #[error("{}: expected a file of {}, found {found}", file.display(), listed(|_| true))]
    Unknown {
        /// The file.
        file: PathBuf,
        /// What it is instead.
        found: &'static str,
    },
    /// The name of a file to be written means no format that can hold the problem.
    #[error("{}: expected a file name that ends in {known} for a problem {}", file.display(), kind.name())]
    Name {
        /// The file.
        file: PathBuf,
        /// The kind of problem.
        kind: Kind,
        /// The extensions of formats that can hold it.
        known: String,
    },
    /// The file holds, or is to hold, a problem of the other class.
    #[error("{}: expected a frictional contact problem, found a complementarity problem", file.display())]
    NoContacts {
        /// The file.
        file: PathBuf,
    },
    /// The parts of the problem, or of a point, are readable but do not make a valid one together.
    #[error("{}: {group}{problem}", file.display())]
    Problem {
        /// The file.
        file: PathBuf,
        /// The group of the part at fault and a slash, of formats that have groups.
        group: Box<str>,
        /// What is wrong with the problem.
        problem: ProblemError,
    },
}

impl IoError {
    pub(crate) fn os(file: &Path, expected: &'static str, cause: std::io::Error) -> Self {
        Self::Os { file: file.into(), expected, cause }
    }

    pub(crate) fn hdf5(file: &Path, place: impl Into<String>, found: impl Display) -> Self {
        Self::Hdf5 { file: file.into(), place: place.into(), found: one_line(found) }
    }

    pub(crate) fn data(
        file: &Path,
        place: impl Into<String>,
        expected: impl Into<String>,
        found: impl Display,
    ) -> Self {
        Self::Data {
            file: file.into(),
            place: place.into(),
            expected: expected.into(),
            found: one_line(found),
        }
    }

    /// Of a format without groups.
    pub(crate) fn problem(file: &Path) -> impl Fn(ProblemError) -> Self + '_ {
        move |problem| Self::Problem { file: file.into(), group: Box::default(), problem }
    }
}

/// Names and texts from a file may hold anything; a message is one line.
pub(crate) fn one_line(text: impl Display) -> String {
    text.to_string().replace(char::is_control, " ")
}
