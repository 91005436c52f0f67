//! Optimisation methods for linear complementarity problems: M as the Hessian of a convex quadratic program.

mod mprgp;
mod qp;

pub use mprgp::Mprgp;
pub use qp::{Form, QpWork, QuadraticProgram};
