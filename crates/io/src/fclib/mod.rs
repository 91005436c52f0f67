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
//! is read, reals of half precision too, integers where reals belong, and reals that are whole numbers where integers belong. Otherwise
//! values pass bit for bit in both directions. All layouts of HDF5 up to 2.0 are read (groups, soft links, chunks, deflate, shuffle, checksums, scaleoffset, LZF).

mod read;
mod write;

use std::panic::{AssertUnwindSafe, catch_unwind};
use std::path::Path;

use nonsmooth_problem::{
    Friction, FrictionGlobal, FrictionLocal, GlobalPoint, LocalPoint, Problem,
};

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
    /// The attribute `numberOfDegreeOfFreedom`; anything but one non-negative C int reads as `None`.
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
        Self { v: None, u: problem.partner(point), r: point.r.clone(), lambda: some(&point.lambda) }
    }

    /// A point of a global problem (of its lengths), with its relative velocity.
    pub fn from_global<const D: usize>(problem: &FrictionGlobal<D>, point: &GlobalPoint) -> Self {
        let u = problem.partner(point);
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
/// Soft links are followed, up to 16 in a row; one that leads nowhere is an error that says where to. External links are refused.
///
/// Cost: proportional to the size of the file in time and memory, whatever the file says of itself; a dataset that the file has no room for is
/// refused before anything is allocated by its size.
pub fn read(path: impl AsRef<Path>) -> Result<FclibFile, IoError> {
    let path = path.as_ref();
    read::parse(path, &read::bytes(path)?, true)
}

/// Reads a file that is in memory already; `name` stands for it in messages. Errors and cost: as [`read`].
pub fn read_bytes(name: impl AsRef<Path>, bytes: &[u8]) -> Result<FclibFile, IoError> {
    read::parse(name.as_ref(), bytes, true)
}

/// Reads the problem of a file, whatever its `/solution` and `/guesses` hold. Errors: as [`read`].
pub fn read_problem(path: impl AsRef<Path>) -> Result<Friction, IoError> {
    let path = path.as_ref();
    Ok(read::parse(path, &read::bytes(path)?, false)?.problem)
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

/// The bytes of the file that [`write()`] makes; `name` stands for it in messages. Errors: as [`write()`], but for the system's.
pub fn to_bytes(name: impl AsRef<Path>, content: &FclibFile) -> Result<Vec<u8>, IoError> {
    write::to_bytes(name.as_ref(), content)
}

/// Sets `/solution` in an existing file and keeps all else in it, known to this crate or not.
///
/// The file is replaced by renaming, as in [`write()`]: other hard links to it keep the old content. Where an old `/solution` holds the same parts as
/// plain 64-bit reals, their values are replaced where they stand and the file keeps its size; else the space of the old one is not used again.
/// Errors: a file whose problem cannot be read, a point that does not fit it, a target that is no regular file, a `/solution` that is a soft link,
/// soft links in the root group that would be lost, and what the system refuses.
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
            let lambda = p.rows.as_ref().map(|b| b.s.len());
            Sizes { v: None, contacts: D * p.contacts(), lambda }
        }
        fn global<const D: usize>(p: &FrictionGlobal<D>) -> Sizes {
            let lambda = p.rows.as_ref().map(|b| b.b.len());
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

/// Runs what edits a file's bytes by the HDF5 library.
///
/// No damage is known that makes that library panic. If one does, the caller still gets an error (after the
/// panic hook's message: the hook is the program's, not this library's to change).
fn guarded<T>(file: &Path, run: impl FnOnce() -> Result<T, IoError>) -> Result<T, IoError> {
    let caught = catch_unwind(AssertUnwindSafe(run));
    caught.unwrap_or_else(|_| Err(IoError::hdf5(file, "/", "damage that stopped the HDF5 editor")))
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
