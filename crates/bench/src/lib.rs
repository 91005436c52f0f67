//! Measurements of the solvers: campaigns, and what is made of their runs.
//!
//! A [`campaign`] runs problems × solvers × tolerances and writes [`runs`], lines of [`record`]s; [`foreign`] measurements of
//! other programs join them. [`profile`]s and [`tables`] are computed from runs, [`figures`] drawn, a
//! [`report`] for browsers and a [`page`] of Markdown written, and two campaigns set against each other by [`compare`]. [`traits_table`] says what the problems are like. Examples measure single
//! kernels: `sweeps` a sweep against streaming W once, `factorisation` Newton's factorisations against faer's, `lemke` its bases, `fields` a function and its derivatives, `flush` what a growing trajectory costs; `warm` a session's solves.

pub mod campaign;
pub mod compare;
pub mod draw;
pub mod figures;
pub mod foreign;
pub mod page;
pub mod profile;
pub mod record;
pub mod report;
pub mod runs;
pub mod tables;
pub mod traits_table;

/// A number that is one.
fn finite(x: f64) -> Option<f64> {
    Some(x).filter(|x| x.is_finite())
}

pub use nonsmooth_problem::plural;
