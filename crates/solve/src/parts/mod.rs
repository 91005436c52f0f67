//! What two families share.

mod central;
mod conic;
mod line_search;
pub mod nt;
mod ordering;
mod proximal_newton;
mod sweep;

pub use central::{Central, Iterate as CentralIterate};
pub use conic::{ConvexEnd, ConvexIp};
pub use line_search::{Found, LineSearch, Search};
pub use ordering::{Order, Ordering};
pub use proximal_newton::{Inner, ProximalNewton};
pub use sweep::Sweep;
