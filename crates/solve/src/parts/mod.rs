//! What two families share.

mod clarabel;
mod ordering;
mod proximal_newton;
mod sweep;

pub use clarabel::{Clarabel, Ended, Shape};
pub use ordering::{Order, Ordering};
pub use proximal_newton::{Iterate, ProximalNewton};
pub use sweep::Sweep;
