//! What two families share.

mod central;
mod conic;
pub mod nt;
mod ordering;
mod proximal_newton;
mod pursuit;
mod sweep;

pub use central::{Central, Iterate as CentralIterate};
pub use conic::{ConvexEnd, ConvexIp};
pub use ordering::{Order, Ordering};
pub use proximal_newton::{Inner, ProximalNewton};
pub use pursuit::Pursuit;
pub use sweep::Sweep;
