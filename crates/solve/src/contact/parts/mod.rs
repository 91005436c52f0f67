//! What two families of the wing share.

mod acceleration;
mod alternating;
mod anderson;
mod central;
mod clarabel;
mod conic;
mod early;
pub mod nt;
mod pursuit;
mod rate;
mod rows;
mod speeds;
mod sweep;

pub use acceleration::Acceleration;
pub use alternating::{Alternating, REST, Way};
pub use anderson::{Accelerator, Anderson};
pub use central::{Central, Iterate as CentralIterate};
pub use clarabel::{Clarabel, Ended, Shape};
pub use conic::{ConvexEnd, ConvexIp};
pub use early::EarlyAcceleration;
pub use pursuit::Pursuit;
pub use rate::Rate;
pub use rows::{asked, put_within_bounds, sweep_rows};
pub use speeds::Speeds;
pub use sweep::{NEGLIGIBLE, Sweep};
