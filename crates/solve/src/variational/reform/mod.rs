//! Variational inequalities as complementarity problems.

mod multipliers;

pub use multipliers::Multipliers;
