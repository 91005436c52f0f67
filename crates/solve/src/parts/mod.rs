//! What two families share.

mod clarabel;
mod ordering;
mod sweep;

pub use clarabel::{Clarabel, Ended, Shape};
pub use ordering::{Order, Ordering};
pub use sweep::Sweep;
