//! Splitting methods: block Gauss–Seidel over contacts.

mod circles;
mod colored;
mod coloring;
mod contact;
mod nsgs;
mod ordering;
mod psor;
mod team;

pub use colored::{Colored, ColoredSweeps};
pub use nsgs::{LocalChoice, LocalTolerance, Nsgs, Sweeps};
pub use ordering::{Order, Ordering};
pub use psor::Psor;
