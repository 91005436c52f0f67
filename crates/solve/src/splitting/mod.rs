//! Splitting methods: block Gauss–Seidel over contacts, and those of linear complementarity problems.

mod circles;
mod colored;
mod contact;
pub mod linear;
mod nsgs;
mod psor;

pub use colored::{Colored, ColoredSweeps};
pub use nsgs::{LocalChoice, LocalTolerance, Nsgs, Sweeps};
pub use psor::Psor;
