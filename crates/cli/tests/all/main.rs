//! The command line as a user has it.
//!
//! One program, since each that is linked compiles what is generic again, and tests of one program run side by side.

mod ampl;
mod answers;
mod bench;
mod bench_report;
mod campaign;
mod commands;
#[path = "../common/mod.rs"]
mod common;
mod documents;
mod files;
mod killed;
mod linear;
mod mistakes;
mod nonlinear;
mod siconos;
mod simulate;
mod streams;
