//! Instances with a known solution, of any size, and models whose optima are published.

mod friction;
mod obstacle;

pub use friction::{Planted, PlantedMix};
pub use obstacle::{JournalBearing, Membrane, energy, torsion};
