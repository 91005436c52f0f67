//! Interior-point methods with Nesterov–Todd scaling: on the convex problem, and on Coulomb's law itself.
//! The iteration is [`parts::Central`](crate::contact::parts::Central), and along the arc [`parts::Pursuit`](crate::contact::parts::Pursuit).

mod convex;
mod exact;

pub use convex::ConvexRelaxation;
pub use exact::{Interior, Path};
