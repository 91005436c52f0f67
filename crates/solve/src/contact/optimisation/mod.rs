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

fn fraction(name: &str, value: f64) -> Result<(), String> {
    if value > 0.0 && value < 1.0 {
        Ok(())
    } else {
        Err(format!("{name}: expected a number in (0, 1), found {value}"))
    }
}

/// The most steps that an accelerator remembers.
const MEMORY: usize = 50;

fn at_most(name: &str, value: usize, most: usize) -> Result<(), String> {
    if value > most {
        Err(format!("{name}: expected at most {most}, found {value}"))
    } else {
        Ok(())
    }
}

fn positive(name: &str, value: usize) -> Result<(), String> {
    if value == 0 { Err(format!("{name}: expected at least 1, found 0")) } else { Ok(()) }
}
