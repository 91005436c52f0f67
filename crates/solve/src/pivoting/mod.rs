//! Pivoting methods for linear complementarity problems: finite, on complementary (or almost complementary) bases.

mod bard;
mod basis;
mod block;
mod criss_cross;
mod enumeration;
mod keller;
mod lemke;
mod lemke_howson;
mod murty;
mod path;
mod start;

pub use bard::{Bard, BardPivoting};
pub use block::{BlockPivoting, BlockPrincipal};
pub use criss_cross::{CrissCross, CrissCrossPivoting};
pub use enumeration::{Enumerate, Enumeration, Face, Solutions, all_solutions};
pub use keller::{Keller, KellerPivoting};
pub use lemke::{BasisKind, Covering, Lemke, LemkePath, LemkeWork, Ties};
pub use lemke_howson::{Equilibrium, game, lemke_howson};
pub use murty::{Murty, MurtyPivoting};

/// Pivots between two visits of the judge: the bases on the way are rarely worth a visit, but the best of them survives a limit.
const CHECK_EVERY: usize = 100;
