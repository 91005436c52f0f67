//! What two families share.

pub mod nt;
mod ordering;
mod sweep;

pub use ordering::{Order, Ordering};
pub use sweep::Sweep;
