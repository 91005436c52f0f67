//! What holds for all solvers and problems together.
//!
//! One program, since each that is linked compiles what is generic again, and tests of one program run side by side.

mod auto;
#[path = "../common/mod.rs"]
mod common;
mod complementarity;
mod conformance;
mod corpus;
mod derivatives;
mod friction_ncp;
mod hostile;
mod house;
mod interior;
mod nonlinear;
mod scales;
mod scenes;
mod three_paths;
mod traits;
