//! What two families share.

mod clarabel;
mod ordering;

pub use clarabel::{Clarabel, ConvexSet, Ended};
pub use ordering::{Order, Ordering};
