//! Cones and sets: projection and its Jacobian. Kernels only; nothing here knows of a problem.

mod coulomb;
mod disk;
pub mod jordan;
mod product;
mod rolling;
mod tresca;

pub use coulomb::{Dual, Region, project, projection_jacobian, region, tangential_norm};
pub use disk::Disk;
pub use product::Product;
pub use rolling::rolling_natural_map;
pub use tresca::Cylinder;

/// A closed convex set of D-vectors with its Euclidean projection.
pub trait ConvexSet<const D: usize> {
    /// The nearest point of the set.
    fn project(&self, x: &[f64; D]) -> [f64; D];

    /// An element of the B-subdifferential of the projection at `x`: its derivative where it has one, else the
    /// derivative of a neighbouring piece.
    fn jacobian(&self, x: &[f64; D]) -> [[f64; D]; D];
}

#[cfg(test)]
mod tests;
