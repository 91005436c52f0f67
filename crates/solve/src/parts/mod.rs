//! What two families share.

mod ordering;

pub use ordering::{Order, Ordering};
