//! Instances with a known solution, of any size, and models whose optima are published.

pub use crate::kinds::complementarity::planted::{
    Bratu, ClassicName, HarkerPang, JournalBearing, Membrane, NashCournot, NonlinearClassic,
    Obstacle, PendulumStep, PlantedBlocks, PlantedClass, PlantedLcp, PlantedMlcp, Torsion,
    classics, energy,
};
pub use crate::kinds::contact::planted::{Planted, PlantedMix};
pub use crate::kinds::variational::planted::{BallsAndCones, Traffic};

/// What makes problems by its fields, which are documented, defaulted and read as settings are.
pub trait Recipe {
    /// The ranges that types do not express. The message names the field, what is expected and what was found.
    fn validate(&self) -> Result<(), String>;
}

/// Fails unless x is a share.
pub(crate) fn share(key: &str, x: f64) -> Result<(), String> {
    match (0.0..=1.0).contains(&x) {
        true => Ok(()),
        false => Err(format!("{key}: expected a number from 0 to 1, found {x}")),
    }
}

/// Fails unless n is in a range.
pub(crate) fn size(
    key: &str,
    n: usize,
    range: std::ops::RangeInclusive<usize>,
) -> Result<(), String> {
    match range.contains(&n) {
        true => Ok(()),
        false => {
            Err(format!("{key}: expected from {} to {}, found {n}", range.start(), range.end()))
        }
    }
}

/// Fails unless x is finite.
pub(crate) fn finite(key: &str, x: f64) -> Result<(), String> {
    match x.is_finite() {
        true => Ok(()),
        false => Err(format!("{key}: expected a finite number, found {x}")),
    }
}
