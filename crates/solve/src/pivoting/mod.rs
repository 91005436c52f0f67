//! Pivoting methods for linear complementarity problems.

mod basis;
mod lemke;
mod lemke_howson;
mod path;
mod start;

pub use lemke::{BasisKind, Covering, Lemke, LemkePath, LemkeWork, Ties};
pub use lemke_howson::{Equilibrium, game, lemke_howson};
