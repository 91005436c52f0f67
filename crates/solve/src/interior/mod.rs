//! Interior-point methods with Nesterov–Todd scaling: on the convex problem, and on Coulomb's law itself.
//! The iteration is [`parts::Central`](crate::parts::Central). Those of linear complementarity problems are in [`linear`].

mod convex;
mod exact;
pub mod linear;

pub use convex::{ConvexRelaxation, Relaxed};
pub use exact::{Interior, Path, Pursued};
