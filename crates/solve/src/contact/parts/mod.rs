//! What two families of the wing share.

mod anderson;
mod central;
mod clarabel;
mod conic;
pub mod nt;
mod pursuit;
mod rows;
mod sweep;

pub use anderson::{Accelerator, Anderson};
pub use central::{Central, Iterate as CentralIterate};
pub use clarabel::{Clarabel, Ended, Shape};
pub use conic::{ConvexEnd, ConvexIp};
pub use pursuit::Pursuit;
pub use rows::{put_within_bounds, sweep_rows};
pub use sweep::{NEGLIGIBLE, Sweep};
