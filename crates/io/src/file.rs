//! What a file holds, whatever its format and the kind of its problem.

use std::path::Path;

use nonsmooth_problem::{
    AnyPoint, AnyProblem, AnyStatus, Friction, Problem, Stated, with_complementarity,
};

use crate::{IoError, format};

/// A problem with what stands beside it in a file.
#[derive(Debug, Clone, PartialEq)]
pub struct ProblemFile {
    /// The problem.
    pub problem: AnyProblem,
    /// What its author says about it.
    pub info: Info,
    /// A solution, if one is stored. Nothing says how accurate it is.
    pub solution: Option<StoredPoint>,
    /// Points to start from.
    pub guesses: Vec<StoredPoint>,
    /// What a drawing needs besides the problem, as text that this crate does not read: bodies and where they touch, as `nonsmooth-scenes` writes them.
    pub drawing: Option<String>,
}

/// What the author of a file says about its problem. `None`: not in the file. Formats keep as much of it as they have places for.
#[derive(Debug, Clone, PartialEq, Eq, Default)]
pub struct Info {
    /// A name in a few words.
    pub title: Option<String>,
    /// What it is.
    pub description: Option<String>,
    /// FCLIB's remarks on the mathematics.
    pub math_info: Option<String>,
    /// FCLIB's number of degrees of freedom; anything but one non-negative C int reads as `None`.
    pub dofs: Option<usize>,
    /// The number of bodies in older files of FCLIB, read like `dofs`.
    pub involved_ds: Option<usize>,
    /// Names of the variables of a complementarity problem, one for each; empty: none.
    pub names: Vec<String>,
}

/// A point as files store it.
#[derive(Debug, Clone, PartialEq)]
pub struct StoredPoint {
    /// The unknowns.
    pub point: AnyPoint,
    /// What follows from them: u of contacts, w of complementary pairs. Of a horizontal problem `None`, as s belongs to the point. A format that
    /// must have it computes it where it is `None`.
    pub partner: Option<Vec<f64>>,
    /// What each contact or row does, where the judge was asked; of points that were read: empty.
    pub statuses: Vec<AnyStatus>,
}

impl ProblemFile {
    /// A file with the problem alone.
    pub fn new(problem: impl Into<AnyProblem>) -> Self {
        Self {
            problem: problem.into(),
            info: Info::default(),
            solution: None,
            guesses: vec![],
            drawing: None,
        }
    }

    /// Reads a file of any format in [`FORMATS`](crate::FORMATS). The extension says which; of names without a known one, the first bytes.
    ///
    /// Errors: a content of no known format; anything that is missing, of a wrong type or shape, not finite or out of range, by its place in the file.
    pub fn read(path: impl AsRef<Path>) -> Result<Self, IoError> {
        format::read_file(path.as_ref())
    }

    /// Reads what the bytes of a file are, whose format its beginning says; `name` stands for it in messages.
    ///
    /// Errors: as [`read`](Self::read).
    pub fn parse(name: impl AsRef<Path>, bytes: &[u8]) -> Result<Self, IoError> {
        let name = name.as_ref();
        format::sniffed(name, bytes)?.parse(name, bytes)
    }

    /// Writes a file in the format of its extension, in place of the one of that name if there is one: it is completed beside the old one and then
    /// renamed, so that nobody sees half of it.
    ///
    /// Errors: an extension of no format that can hold the kind of problem; a problem that is not valid or is known by its products only; a point that
    /// does not fit; a target that is no regular file (a directory, a device, ...); what the format cannot hold; what the system refuses.
    pub fn write(&self, path: impl AsRef<Path>) -> Result<(), IoError> {
        let path = path.as_ref();
        format::writer(path, self.problem.kind())?.write(path, self)
    }

    /// The problem of contacts in a file that must hold one; `path` is its name in messages.
    ///
    /// Errors: another one.
    pub fn contacts(&self, path: &Path) -> Result<&Friction, IoError> {
        match &self.problem {
            AnyProblem::Friction(problem) => Ok(problem),
            AnyProblem::Complementarity(_) => Err(IoError::NoContacts { file: path.into() }),
        }
    }

    /// Writes the solution into the file at `path`, from which this was read. Where the format allows it, all else in that file stays as it is, known
    /// to this crate or not.
    ///
    /// Errors: as [`write`](Self::write); none to write; a file whose problem the point does not fit.
    pub fn write_solution(&self, path: impl AsRef<Path>) -> Result<(), IoError> {
        let path = path.as_ref();
        format::writer(path, self.problem.kind())?.write_solution(path, self)
    }
}

impl StoredPoint {
    /// A point of the problem (of its lengths), with what [`Problem::partner`] gives, or the judge with more digits.
    pub fn new(problem: &AnyProblem, point: AnyPoint, partner: Vec<f64>) -> Self {
        let partner = match problem {
            AnyProblem::Friction(_) => Some(partner),
            AnyProblem::Complementarity(linear) => {
                with_complementarity!(linear, p => p.kept(partner))
            }
        };
        Self { point, partner, statuses: vec![] }
    }
}

/// Points without their partners.
impl<P: Into<AnyPoint>> From<P> for StoredPoint {
    fn from(point: P) -> Self {
        Self { point: point.into(), partner: None, statuses: vec![] }
    }
}
