//! Splitting methods: block Gauss–Seidel.

mod nsgs;

pub use nsgs::{LocalChoice, Nsgs, Sweeps};
