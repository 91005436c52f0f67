//! Methods that regularise by the distance to a point that they know: ADMM and the proximal point method.

mod admm;
mod proximal_point;

pub use admm::{Admm, RhoRule};
pub use proximal_point::{AlphaRule, Outer, Proximal, ProximalPoint};
