//! What two families share.

mod ordering;
mod proximal_newton;
mod sweep;

pub use ordering::{Order, Ordering};
pub use proximal_newton::{Iterate, ProximalNewton};
pub use sweep::Sweep;
