//! Interior-point methods with Nesterov–Todd scaling: on the convex problem, and on Coulomb's law itself.
//! The iteration is [`parts::Central`](crate::contact::parts::Central).

mod convex;
mod exact;
mod pursuit;

pub use convex::ConvexRelaxation;
pub use exact::{Interior, Path};
