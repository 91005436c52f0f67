//! What two families share.

mod clarabel;
mod central;
mod conic;
pub mod nt;
mod ordering;
mod proximal_newton;
mod sweep;

pub use clarabel::{Clarabel, Ended, Shape};
pub use central::{Central, Iterate};
pub use conic::{ConvexEnd, ConvexIp};
pub use ordering::{Order, Ordering};
pub use proximal_newton::{Iterate, ProximalNewton};
pub use sweep::Sweep;
