//! Instances with a known solution, of any size, and models whose optima are published.

pub mod classics;
mod friction;
mod linear;
mod obstacle;

pub use friction::{Planted, PlantedMix};
pub use linear::{PlantedBlocks, PlantedClass, PlantedLcp, PlantedMlcp};
pub use obstacle::{JournalBearing, Membrane, energy, torsion};
