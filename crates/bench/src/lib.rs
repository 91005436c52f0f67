//! Measurements of the solvers: campaigns, and what is made of their runs.
//!
//! A [`campaign`] runs problems × solvers × tolerances and writes [`runs`], lines of [`record`]s.
//! [`traits_table`] says what the problems are like. `examples/sweeps.rs` measures a sweep against streaming W once.

pub mod campaign;
pub mod record;
pub mod runs;
pub mod traits_table;
