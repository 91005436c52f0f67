//! Cones and sets: projection and its Jacobian. Kernels only; nothing here knows of a problem.

mod coulomb;

pub use coulomb::{Region, project, region, tangential_norm};
