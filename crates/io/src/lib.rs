//! Files of nonsmooth mechanics.
//!
//! [`fclib`]: the HDF5 files of the FCLIB collection of frictional contact problems, read and written.
//! Every failure is an [`IoError`] whose message is one line that names the file, the place in it, what was
//! expected there and what was found. No file, however damaged, makes a function of this crate panic.

mod error;
pub mod fclib;

pub use error::IoError;
