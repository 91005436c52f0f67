//! Pivoting methods for linear complementarity problems.

mod basis;
mod lemke;
mod path;
mod start;

pub use lemke::{BasisKind, Covering, Lemke, LemkePath, LemkeWork, Ties};
