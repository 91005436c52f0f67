//! What two families share.

mod anderson;
mod coloring;
mod ordering;
mod proximal_newton;
mod sweep;
mod team;

pub use anderson::{Accelerator, Anderson};
pub use coloring::Coloring;
pub use ordering::{Order, Ordering};
pub use proximal_newton::{Iterate, ProximalNewton};
pub use sweep::Sweep;
pub use team::{Meeting, Team};
