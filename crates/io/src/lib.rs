//! Files of nonsmooth mechanics.
//!
//! A [`ProblemFile`] is what any of them holds: a problem of any kind, what is said about it, a solution, guesses. [`FORMATS`] lists the
//! formats: [`fclib`], the HDF5 files of the FCLIB collection of frictional contact problems; [`linear`], complementarity problems in our
//! own TOML, in Matrix Market; [`nl`], AMPL's models of nonlinear ones; [`siconos`], Siconos' text of either; [`table`], solutions as comma-separated values. [`trajectory`] is what a simulation leaves
//! behind; [`vtk`] and [`gltf`] show it in other programs.
//! Every failure is an [`IoError`] whose message is one line that names the file, the place in it, what was
//! expected there and what was found. No file, however damaged, makes a function of this crate panic.

mod error;
pub mod fclib;
mod file;
mod folder;
mod format;
pub mod gltf;
mod hdf5;
pub mod linear;
mod mesh;
pub mod nl;
mod replace;
pub mod siconos;
pub mod table;
mod tokens;
pub mod trajectory;
pub mod vtk;

pub use error::IoError;
pub use file::{Info, ProblemFile, StoredPoint};
pub use format::{
    About, FORMATS, Format, format, holds_problem, keeper, listed, named, parts, read, sniffed,
    writer,
};
pub use mesh::Mesh;
pub use replace::beside;
