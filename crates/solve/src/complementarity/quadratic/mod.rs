//! Optimisation methods for linear complementarity problems: M as the Hessian of a convex quadratic program.

mod mprgp;
mod ne_sqp;
mod qp;

pub use mprgp::Mprgp;
pub use ne_sqp::NeSqp;
pub use qp::{Form, QpWork, QuadraticProgram};
