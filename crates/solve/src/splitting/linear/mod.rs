//! Splitting methods for linear complementarity problems.

mod projected_jacobi;

pub use projected_jacobi::{Jacobi, ProjectedJacobi};
