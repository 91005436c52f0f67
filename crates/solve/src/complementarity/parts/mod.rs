//! What two families of the wing share.

pub mod arc;
pub mod cycles;
pub mod factor;
pub mod game;
pub mod nonlinear;
pub mod pairs;
pub mod product_form;
mod tableau;

pub use tableau::{Cycle, Polished, Tableau, equilibrate, equilibrate_entries, refuting_row};
