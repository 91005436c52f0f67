//! Reformulations within the wing: each a problem of one kind made of one of another, with the way back.

mod mixed;
pub mod presolve;
mod reduce;
mod split;

pub use mixed::Mixed;
pub use presolve::Presolve;
pub use reduce::Reduce;
pub use split::Split;
