//! Instances with a known solution, of any size.

pub mod classics;
mod friction;

pub use friction::{Planted, PlantedMix};
