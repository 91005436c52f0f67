//! What two families share.

mod ordering;
mod sweep;

pub use ordering::{Order, Ordering};
pub use sweep::Sweep;
