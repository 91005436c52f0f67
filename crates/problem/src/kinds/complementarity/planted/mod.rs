//! Complementarity problems with a planted solution, from the literature, and of obstacles.

pub mod classics;
mod linear;
mod nonlinear;
mod obstacle;
mod pendulum;

pub use linear::{PlantedBlocks, PlantedClass, PlantedLcp, PlantedMlcp};
pub(crate) use nonlinear::with_values;
pub use nonlinear::{Bratu, ClassicName, HarkerPang, NashCournot, NonlinearClassic};
pub use obstacle::{JournalBearing, Membrane, Obstacle, Torsion, energy};
pub use pendulum::PendulumStep;
