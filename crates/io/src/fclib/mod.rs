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
//! /nonsmooth   drawing
//! ```
//!
//! `/fclib_global_rolling` is `/fclib_global` with spacedim 5, rolling friction, and `vectors/mu_r` (nc). FCLIB has no local form of it; `/fclib_local_rolling`, which converted files have,
//! is `/fclib_local` likewise.
//!
//! with m = spacedim · nc; V, R, s and G, b come together or not at all. Scalar rows that are no bilateral constraints have `vectors/lower` and `vectors/upper` (p each,
//! infinities allowed) beside s or b: an addition of ours, which other readers of FCLIB do not see. So is the group `/nonsmooth`, whose text `drawing` says what
//! the bodies look like ([`ProblemFile::drawing`]). A matrix is a group of `m`, `n`,
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

use nonsmooth_problem::check::Law;
use nonsmooth_problem::{Friction, FrictionGlobal, FrictionLocal, Kind, ProblemError};

use crate::folder::check_finite;
use crate::format::{About, bytes};
use crate::hdf5::is_hdf5;
use crate::{Format, IoError, ProblemFile, StoredPoint};

const SOLUTION: &str = "/solution";
/// The group of our own and the text in it.
const DRAWING: (&str, &str) = ("nonsmooth", "drawing");
const KINDS: &[Kind] = &[
    Kind::FrictionLocal2d,
    Kind::FrictionLocal3d,
    Kind::FrictionGlobal2d,
    Kind::FrictionGlobal3d,
    Kind::RollingLocal3d,
    Kind::RollingGlobal3d,
];

/// The format.
///
/// Reading: a `/solution` needs `u` and `r`, `v` if the problem is global, `l` if it has bilateral constraints.
/// Not read: `nzmax` but as the length of arrays of triplets with room beyond `nz`, matrix info (`conditioning`, ...), guesses beyond `number_of_guesses`, other groups. Soft links are followed, up to 16 in a
/// row; one that leads nowhere is an error that says where to. External links are refused. The cost is proportional to the size of the file in time and
/// memory, whatever the file says of itself; a dataset that the file has no room for is refused before anything is allocated by its size.
///
/// Writing: what is not read does not pass from one file to another. Texts with a NUL character and more than 2³¹ − 1 entries in one matrix are refused.
///
/// Writing a solution alone keeps all else in the file, known to this crate or not. Other hard links to it keep the old content. Where an old `/solution`
/// holds the same parts as plain 64-bit reals, their values are replaced where they stand and the file keeps its size; else the space of the old
/// one is not used again. Refused are a `/solution` that is a soft link, and soft links in the root group that would be lost.
#[derive(Debug, Clone, Copy)]
pub struct Fclib;

impl Format for Fclib {
    fn about(&self) -> &'static About {
        const ABOUT: About = About {
            name: "FCLIB's HDF5",
            extensions: &["hdf5", "h5"],
            reads: KINDS,
            writes: KINDS,
            solution: SOLUTION,
            guess: Some("/guesses/1"),
            ..About::TEXT
        };
        &ABOUT
    }

    fn begins(&self, bytes: &[u8]) -> bool {
        is_hdf5(bytes)
    }

    /// Damaged files are to be seen.
    fn holds_problem(&self, _: &Path, _: &[u8]) -> bool {
        true
    }

    fn parse(&self, name: &Path, bytes: &[u8]) -> Result<ProblemFile, IoError> {
        read::parse(name, bytes)
    }

    fn to_bytes(&self, name: &Path, file: &ProblemFile) -> Result<Vec<u8>, IoError> {
        write::to_bytes(name, file)
    }

    fn write(&self, path: &Path, file: &ProblemFile) -> Result<(), IoError> {
        write::write(path, file)
    }

    fn write_solution(&self, path: &Path, file: &ProblemFile) -> Result<(), IoError> {
        match &file.solution {
            Some(solution) => write_solution(path, solution),
            None => Err(IoError::data(path, SOLUTION, "a point to write", "none")),
        }
    }
}

/// Reads the problem of a file, whatever its `/solution` and `/guesses` hold. Errors: as of [`Fclib`].
pub fn read_problem(path: impl AsRef<Path>) -> Result<Friction, IoError> {
    let path = path.as_ref();
    read::problem(path, &bytes(path)?)
}

/// Sets `/solution` in an existing file, whatever it is so far, and keeps all else in it. Errors: as of [`Fclib`]; a point that does not fit.
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
        fn local<const D: usize, L: Law<D>>(p: &FrictionLocal<D, L>) -> Sizes {
            let lambda = p.rows.as_ref().map(|b| b.s.len());
            Sizes { v: None, contacts: D * p.contacts(), lambda }
        }
        fn global<const D: usize, L: Law<D>>(p: &FrictionGlobal<D, L>) -> Sizes {
            let lambda = p.rows.as_ref().map(|b| b.b.len());
            Sizes { v: Some(p.dofs()), contacts: D * p.contacts(), lambda }
        }
        match problem {
            Friction::Local2(p) => local(p),
            Friction::Local3(p) => local(p),
            Friction::RollingLocal(p) => local(p),
            Friction::Global2(p) => global(p),
            Friction::Global3(p) => global(p),
            Friction::RollingGlobal(p) => global(p),
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
        Friction::RollingLocal(_) => "/fclib_local_rolling",
        Friction::RollingGlobal(_) => "/fclib_global_rolling",
    }
}

/// What is wrong with a problem, by where in its group FCLIB keeps the part at fault: matrices have capital letters.
fn invalid(file: &Path, group: &str) -> impl Fn(ProblemError) -> IoError {
    move |problem| {
        let (ProblemError::Shape { place, .. }
        | ProblemError::Value { place, .. }
        | ProblemError::Empty { place }
        | ProblemError::Singular { place, .. }) = &problem;
        let vectors = if place.starts_with(char::is_uppercase) { "" } else { "vectors/" };
        IoError::Problem { file: file.into(), group: format!("{group}/{vectors}").into(), problem }
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
