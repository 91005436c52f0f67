//! Splitting methods: block Gauss–Seidel.

mod circles;
mod colored;
mod contact;
mod nsgs;
mod psor;

pub use colored::{Colored, ColoredSweeps};
pub use nsgs::{LocalChoice, LocalTolerance, Nsgs, Sweeps};
pub use psor::Psor;
