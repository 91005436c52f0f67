//! Methods that see friction through convex optimisation: something of the law is frozen so that the rest is the
//! optimality condition of a convex problem; that is solved, and what was frozen is brought up to date.
//!
//! | method | frozen | convex problem over |
//! | --- | --- | --- |
//! | Tresca (Haslinger) | the thresholds `θ = mu r_N` | cylinders |
//! | Panagiotopoulos | in turn r_T, and r_N with `θ = mu r_N` | half lines, disks |
//! | Cadoux | the sliding speeds `s = ‖u_T‖` | Coulomb cones |

mod cadoux;
mod convex;
mod inner;
mod panagiotopoulos;
mod sets;
mod tresca;

pub use cadoux::{Cadoux, CadouxWork, ConeSolver, Update};
pub use inner::CylinderSolver;
pub use panagiotopoulos::{AlternationWork, HalfSolver, Panagiotopoulos};
pub use tresca::{Tresca, TrescaWork};

/// The most steps that an accelerator remembers.
const MEMORY: usize = 50;
