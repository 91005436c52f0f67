//! What two families share.

mod anderson;
mod central;
mod clarabel;
mod coloring;
mod conic;
mod exact_cones;
mod line_search;
pub mod nt;
mod ordering;
pub mod pairs;
mod proximal_newton;
mod pursuit;
mod sweep;
mod tableau;
mod team;

pub use anderson::{Accelerator, Anderson};
pub use central::{Central, Iterate as CentralIterate};
pub use clarabel::{Clarabel, Ended, Shape, admit_program};
pub use coloring::Coloring;
pub use conic::{ConvexEnd, ConvexIp};
pub use exact_cones::{ExactCones, Found as ExactlyFound};
pub use line_search::{Found, LineSearch, Search};
pub use ordering::{Order, Ordering};
pub use proximal_newton::{Inner, ProximalNewton};
pub use pursuit::Pursuit;
pub use sweep::Sweep;
pub use tableau::{Cycle, Polished, Tableau, equilibrate, refuting_row};
pub use team::Team;
