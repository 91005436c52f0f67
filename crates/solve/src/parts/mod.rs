//! What two families share.

mod anderson;
mod coloring;
mod ordering;
mod team;

pub use anderson::{Accelerator, Anderson};
pub use coloring::Coloring;
pub use ordering::{Order, Ordering};
pub use team::{Meeting, Team};
