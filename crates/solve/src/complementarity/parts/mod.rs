//! What two families of the wing share.

pub mod game;
pub mod pairs;
mod tableau;

pub use tableau::{Cycle, Polished, Tableau, equilibrate, refuting_row};
