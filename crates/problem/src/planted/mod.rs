//! Instances with a known solution, of any size.

mod friction;
mod linear;

pub use friction::{Planted, PlantedMix};
pub use linear::{PlantedBlocks, PlantedClass, PlantedLcp, PlantedMlcp};
