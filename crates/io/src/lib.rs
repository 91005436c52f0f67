//! Files of nonsmooth mechanics.
//!
//! [`fclib`]: the HDF5 files of the FCLIB collection of frictional contact problems, read and written.
//! [`linear`]: linear complementarity problems in our own TOML, in Matrix Market and in Siconos' text.
//! [`read_any`] knows them all apart.
//! Every failure is an [`IoError`] whose message is one line that names the file, the place in it, what was
//! expected there and what was found. No file, however damaged, makes a function of this crate panic.

mod any;
mod error;
pub mod fclib;
mod hdf5;
pub mod linear;
mod replace;

pub use any::{Content, holds_problem, parts, read, read_any};
pub use error::IoError;
pub use replace::beside;
