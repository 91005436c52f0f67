//! Measurements of the solvers: campaigns, and what is made of their runs.
//!
//! A [`campaign`] runs problems × solvers × tolerances and writes [`runs`], lines of [`record`]s; [`foreign`] measurements of
//! other programs join them. [`profile`]s and [`tables`] are computed from runs, [`figures`] drawn, and two campaigns set
//! against each other by [`compare`]. [`traits_table`] says what the problems are like. `examples/sweeps.rs` measures a
//! sweep against streaming W once.

pub mod campaign;
pub mod compare;
pub mod draw;
pub mod figures;
pub mod foreign;
pub mod profile;
pub mod record;
pub mod runs;
pub mod tables;
pub mod traits_table;

/// `1 run`, `2 runs`.
fn plural(n: usize, what: &str) -> String {
    format!("{n} {what}{}", if n == 1 { "" } else { "s" })
}
