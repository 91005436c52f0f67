//! Complementarity functions: maps that vanish exactly at the pairs `(u, r)` that obey the law, with an element of
//! their generalised Jacobian.

mod alart_curnier;

pub use alart_curnier::{Disk, Radii, alart_curnier};
