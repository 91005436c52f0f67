//! What two families share.

pub mod nt;
mod ordering;

pub use ordering::{Order, Ordering};
