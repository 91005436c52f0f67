//! What two families share.

mod anderson;
mod central;
mod coloring;
mod conic;
pub mod nt;
mod ordering;
mod proximal_newton;
mod sweep;
mod team;

pub use anderson::{Accelerator, Anderson};
pub use central::{Central, Iterate as CentralIterate};
pub use coloring::Coloring;
pub use conic::{ConvexEnd, ConvexIp};
pub use ordering::{Order, Ordering};
pub use proximal_newton::{Inner, ProximalNewton};
pub use sweep::Sweep;
pub use team::Team;
