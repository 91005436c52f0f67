//! Capabilities that the families of solvers are generic over, and which problem offers which.
//!
//! | capability | what a family may ask | offered by |
//! | --- | --- | --- |
//! | [`Bounded`] | M, q and the bounds of a linear complementarity problem with one variable a row | LCP, square MLCP, box LCP |
//! | [`Rowwise`] | the same of any shape: equalities need not be as many as free variables | LCP, MLCP, box LCP |
//! | [`Complementary`] | in addition, that variables are free or nonnegative | LCP, square MLCP |
//! | [`Model`] | values and Jacobians of a nonlinear F with its bounds, and a proximal term | MCP |
//! | [`Paired`] | Q, R, q of equations between complementary pairs | LCP, square MLCP, hLCP |

mod bounded;
mod nonlinear;
mod pairs;

pub use bounded::{Bounded, Bounds, Complementary, Rows, Rowwise, System, system};
pub use nonlinear::Model;
pub use pairs::{Equations, Paired};
