//! Methods that leave stationary points by proximal problems with moving centres, each with another method inside.

mod escaping;
mod proxi;
mod qpcomp;
mod semicomp;

pub use proxi::Proxi;
pub use qpcomp::Qpcomp;
pub use semicomp::Semicomp;
