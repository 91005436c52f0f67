//! Optimisation methods for linear complementarity problems.

mod mprgp;

pub use mprgp::{Mprgp, Proportioning};
