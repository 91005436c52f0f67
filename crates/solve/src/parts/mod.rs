//! What two families share.

mod line_search;
mod ordering;
mod sweep;

pub use line_search::{Found, LineSearch, Search};
pub use ordering::{Order, Ordering};
pub use sweep::Sweep;
