//! Linear complementarity problems as convex quadratic programs.

mod qp;

pub use qp::{Form, Programmed, QpWork, QuadraticProgram};
