//! Interior points for linear complementarity problems: LCP, MLCP and horizontal LCP alike. The linear algebra, the start, and the ways to end are
//! [`parts::pairs`](crate::complementarity::parts::pairs).
//!
//! | method | neighbourhood | factorisations an iteration | guarantee |
//! | --- | --- | --- | --- |
//! | [`MizunoToddYe`] | `N₂(θ)`, narrow | two | `O(√n L)` iterations from a feasible start |
//! | [`MehrotraType`] | `N₋∞(ε)`, wide | one | none as good, and far fewer iterations |

mod mehrotra;
mod mty;

pub use mehrotra::{MehrotraType, MehrotraWork};
pub use mty::{MizunoToddYe, MtyWork};
