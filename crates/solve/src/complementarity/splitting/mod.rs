//! Splitting methods for linear complementarity problems.

mod aggregates;
mod pgs;
mod projected_jacobi;
mod psor;
mod rows;
mod rpgs;
mod rpsor;
mod splitting_ls;
mod tnnmg;

pub use pgs::Pgs;
pub use projected_jacobi::ProjectedJacobi;
pub use psor::Psor;
pub use rows::Direction;
pub use rpgs::Rpgs;
pub use rpsor::Rpsor;
pub use splitting_ls::{SplittingLs, Sweep};
pub use tnnmg::Tnnmg;
