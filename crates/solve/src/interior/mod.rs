//! Interior-point methods with Nesterov–Todd scaling: on the convex problem, and on Coulomb's law itself.
//! The iteration is [`parts::Central`](crate::parts::Central).

mod convex;
mod exact;

pub use convex::{ConvexRelaxation, Relaxed};
pub use exact::{Interior, Path, Pursued};
