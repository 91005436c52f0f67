//! What two families of the wing share.

pub mod factor;
pub mod game;
pub mod nonlinear;
pub mod pairs;
mod tableau;

pub use tableau::{Cycle, Polished, Tableau, equilibrate, refuting_row};
