//! The law of one contact: cones with their projections, complementarity functions with their Jacobians, one-contact solvers.

pub mod cfun;
pub mod cone;
pub mod local;
