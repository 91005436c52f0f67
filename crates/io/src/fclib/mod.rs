//! FCLIB's HDF5 files: one frictional contact problem each, with an optional solution and guesses.
//!
//! ```text
//! /fclib_local                            /fclib_global
//!    spacedim       2 or 3                   spacedim       2 or 3
//!    W/             m × m                    M/             n × n
//!    V/  R/         m × p, p × p             H/             n × m
//!    vectors/q      m                        G/             n × p
//!    vectors/mu     nc                       vectors/f      n
//!    vectors/s      p                        vectors/w      m
//!    info/          texts                    vectors/mu     nc
//!                                            vectors/b      p
//! /solution    v (n, global only)            info/          texts
//!              u, r (m), l (p)
//! /guesses     number_of_guesses, 1/, 2/, ... each like /solution
//! ```
//!
//! with m = spacedim · nc; V, R, s and G, b come together or not at all. A matrix is a group of `m`, `n`,
//! `nz`, `nzmax`, `p`, `i`, `x`, zero-based: triplets with row `i`, column `p` (`nz ≥ 0` entries), compressed
//! columns (`nz = -1`) or compressed rows (`nz = -2`). All three are read, in any order, duplicates added in
//! the order of the file; triplets are written, because other readers of global files know nothing else.
//!
//! Written files hold 32-bit integers and 64-bit reals in HDF5 1.8's format. Any width of integer and of real
//! is read, integers where reals belong, and reals that are whole numbers where integers belong. Otherwise
//! values pass bit for bit in both directions.

mod read;
mod write;

use std::panic::{AssertUnwindSafe, catch_unwind};
use std::path::Path;

use nonsmooth_problem::{Friction, FrictionGlobal, FrictionLocal, GlobalPoint, LocalPoint};

use crate::IoError;

/// What an FCLIB file holds.
#[derive(Debug, Clone, PartialEq)]
pub struct FclibFile {
    /// The problem.
    pub problem: Friction,
    /// What its author says about it.
    pub info: Info,
    /// `/solution`, if there is one. Nothing says how accurate it is.
    pub solution: Option<StoredPoint>,
    /// `/guesses/1`, `/guesses/2`, ...: points to start from.
    pub guesses: Vec<StoredPoint>,
}

impl FclibFile {
    /// A file with the problem alone.
    pub fn new(problem: Friction) -> Self {
        Self { problem, info: Info::default(), solution: None, guesses: vec![] }
    }
}

/// The group `info` of a problem. `None`: not in the file.
#[derive(Debug, Clone, PartialEq, Eq, Default)]
pub struct Info {
    /// The dataset `title`.
    pub title: Option<String>,
    /// The dataset `description`.
    pub description: Option<String>,
    /// The dataset `math_info`.
    pub math_info: Option<String>,
    /// The attribute `numberOfDegreeOfFreedom`; anything but one non-negative integer reads as `None`.
    pub dofs: Option<usize>,
    /// The attribute `numberOfInvolvedDS` of older files: the number of bodies, read like `dofs`.
    pub involved_ds: Option<usize>,
}

/// A point as `/solution` and `/guesses/k` store it. Its lengths must fit the problem of the file.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct StoredPoint {
    /// `v`: generalised velocities, n, of a global problem; `None` (or empty) for a local one.
    pub v: Option<Vec<f64>>,
    /// `u`: relative velocities at the contacts, m.
    pub u: Vec<f64>,
    /// `r`: contact impulses, m.
    pub r: Vec<f64>,
    /// `l`: multipliers of the bilateral constraints, p; `None` (or empty) without any.
    pub lambda: Option<Vec<f64>>,
}

impl StoredPoint {
    /// A point of a local problem (of its lengths), with its relative velocity.
    pub fn from_local<const D: usize>(problem: &FrictionLocal<D>, point: &LocalPoint) -> Self {
        Self {
            v: None,
            u: problem.velocity(point),
            r: point.r.clone(),
            lambda: some(&point.lambda),
        }
    }

    /// A point of a global problem (of its lengths), with its relative velocity.
    pub fn from_global<const D: usize>(problem: &FrictionGlobal<D>, point: &GlobalPoint) -> Self {
        let mut u = vec![0.0; problem.w.len()];
        problem.velocity_into(&point.v, &mut u);
        Self { v: some(&point.v), u, r: point.r.clone(), lambda: some(&point.lambda) }
    }

    /// The unknowns of a local problem.
    pub fn to_local(&self) -> LocalPoint {
        LocalPoint { r: self.r.clone(), lambda: self.lambda.clone().unwrap_or_default() }
    }

    /// The unknowns of a global problem.
    pub fn to_global(&self) -> GlobalPoint {
        let LocalPoint { r, lambda } = self.to_local();
        GlobalPoint { v: self.v.clone().unwrap_or_default(), r, lambda }
    }
}

fn some(x: &[f64]) -> Option<Vec<f64>> {
    (!x.is_empty()).then(|| x.to_vec())
}

/// Reads a file: the problem, its info, the solution and the guesses.
///
/// Errors: anything that is missing, of a wrong type or shape, not finite or out of range, by its place in
/// the file; rolling friction, by its group. A `/solution` needs `u` and `r`, `v` if the problem is global,
/// `l` if it has bilateral constraints; [`read_problem`] does not look at it.
/// Not read: `nzmax`, matrix info (`conditioning`, ...), guesses beyond `number_of_guesses`, other groups.
///
/// Soft and external links are not followed. Where a part of the problem is one, the error says so if the group is
/// of HDF5's old format (the default of the C library and h5py); in groups of the new format they cannot be
/// told from nothing, so that an optional part behind one reads as absent.
pub fn read(path: impl AsRef<Path>) -> Result<FclibFile, IoError> {
    read::read(path.as_ref(), true)
}

/// Reads the problem of a file, whatever its `/solution` and `/guesses` hold. Errors: as [`read`].
pub fn read_problem(path: impl AsRef<Path>) -> Result<Friction, IoError> {
    Ok(read::read(path.as_ref(), false)?.problem)
}

/// Writes a file, in place of the one of that name if there is one.
///
/// The file holds what `content` does and nothing else: what [`read`] skips (other groups, `conditioning`, ...)
/// does not pass from one file to another; [`write_solution`] keeps it.
///
/// The new file is completed beside the old one and then renamed, so that nobody sees half of it.
/// Errors: a problem that is not valid, a point that does not fit it, a text that holds a NUL character,
/// more than 2³¹ − 1 entries in one matrix, a target that is no regular file (a directory, a device, ...), and
/// what the system refuses.
pub fn write(path: impl AsRef<Path>, content: &FclibFile) -> Result<(), IoError> {
    write::write(path.as_ref(), content)
}

/// Sets `/solution` in an existing file and keeps all else in it, known to this crate or not.
///
/// The file is replaced by renaming, as in [`write()`]: other hard links to it keep the old content. The space of
/// an old `/solution` is not all used again: each call makes the file some hundred bytes larger.
/// Soft and external links that stand directly in the root group are the exception to keeping all: a file with
/// them may be refused or, if HDF5 keeps the group densely or converted it from the old format, lose them.
/// Errors: a file whose problem cannot be read, a point that does not fit it, a target that is no regular file, and
/// what the system refuses.
pub fn write_solution(path: impl AsRef<Path>, solution: &StoredPoint) -> Result<(), IoError> {
    write::write_solution(path.as_ref(), solution)
}

/// The lengths of `v`, of `u` and `r`, and of `l` that fit a problem; `None`: the kind of problem has no such part.
#[derive(Clone, Copy)]
struct Sizes {
    v: Option<usize>,
    contacts: usize,
    lambda: Option<usize>,
}

impl Sizes {
    fn of(problem: &Friction) -> Self {
        fn local<const D: usize>(p: &FrictionLocal<D>) -> Sizes {
            let lambda = p.bilateral.as_ref().map(|b| b.s.len());
            Sizes { v: None, contacts: D * p.contacts(), lambda }
        }
        fn global<const D: usize>(p: &FrictionGlobal<D>) -> Sizes {
            let lambda = p.bilateral.as_ref().map(|b| b.b.len());
            Sizes { v: Some(p.dofs()), contacts: D * p.contacts(), lambda }
        }
        match problem {
            Friction::Local2(p) => local(p),
            Friction::Local3(p) => local(p),
            Friction::Global2(p) => global(p),
            Friction::Global3(p) => global(p),
        }
    }

    /// The parts of a point: name in FCLIB, length and what the length counts.
    ///
    /// A part without entries is stored, as FCLIB does: `l` belongs to a matrix G or R even if that has no column.
    fn parts(self) -> [(&'static str, Option<usize>, &'static str); 4] {
        [
            ("v", self.v, "degrees of freedom"),
            ("u", Some(self.contacts), "components of the contacts"),
            ("r", Some(self.contacts), "components of the contacts"),
            ("l", self.lambda, "bilateral constraints"),
        ]
    }
}

/// Runs what handles a file's bytes by the HDF5 library.
///
/// No damage is known that makes that library panic. If one does, the caller still gets an error (after the
/// panic hook's message: the hook is the program's, not this library's to change).
fn guarded<T>(file: &Path, run: impl FnOnce() -> Result<T, IoError>) -> Result<T, IoError> {
    let caught = catch_unwind(AssertUnwindSafe(run));
    caught.unwrap_or_else(|_| Err(IoError::hdf5(file, "/", "damage that stopped the HDF5 reader")))
}

/// The root group of a problem.
fn group(problem: &Friction) -> &'static str {
    match problem {
        Friction::Local2(_) | Friction::Local3(_) => "/fclib_local",
        Friction::Global2(_) | Friction::Global3(_) => "/fclib_global",
    }
}

/// `x` has `len` entries, all finite.
fn check_vector(
    file: &Path,
    place: &str,
    x: &[f64],
    len: usize,
    meaning: &str,
) -> Result<(), IoError> {
    if x.len() != len {
        let expected = format!("{len} entries ({meaning})");
        return Err(IoError::data(file, place, expected, format!("{} entries", x.len())));
    }
    check_finite(file, place, x)
}

fn check_finite(file: &Path, place: &str, x: &[f64]) -> Result<(), IoError> {
    match x.iter().position(|v| !v.is_finite()) {
        Some(k) => Err(IoError::data(file, format!("{place}[{k}]"), "a finite number", x[k])),
        None => Ok(()),
    }
}
