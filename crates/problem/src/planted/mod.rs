//! Instances with a known solution, of any size.

mod friction;

pub use friction::{Planted, PlantedMix};
