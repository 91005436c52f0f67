//! All numerics: contracts, the one loop, and one file per algorithm.
//!
//! A *problem* (crate `nonsmooth-problem`) is data with its own judge. A *solver* is a struct that is its
//! hyperparameters, with `work` and `step` ([`Solver`]). [`Driver`] is the only loop: it counts, times, judges and
//! keeps the best point. [`registry`] lists what exists, by kind of problem; the command line, its help,
//! `docs/solvers.md` and the conformance tests come from it.
//!
//! ```
//! use nonsmooth_problem::{FrictionLocal, Problem, planted::Planted};
//! use nonsmooth_solve::{Limits, Status, registry};
//!
//! let (problem, _known) = Planted::default().local::<3>();
//! let mut session = registry::session::<FrictionLocal<3>>("auto", &Default::default())?;
//! let mut point = problem.origin();
//! let outcome = session.solve(&problem, &mut point, &Limits::default(), &mut |_| {})?;
//! assert_eq!(outcome.status, Status::Solved);
//! assert!(outcome.measure.relative <= 1e-8);
//! # Ok::<(), nonsmooth_solve::SolveError>(())
//! ```

pub mod auto;
pub mod cfun;
pub mod cone;
pub mod diagnose;
mod drive;
mod error;
pub mod existence;
pub mod form;
pub mod guarantees;
pub mod guard;
pub mod interior;
pub mod local;
pub mod newton;
pub mod optimisation;
pub mod parts;
pub mod pivoting;
pub mod projection;
pub mod proximal;
pub mod reform;
pub mod registry;
pub mod settings;
mod solver;
pub mod splitting;
pub mod trace;
mod via;

pub use drive::{Driver, Limit, Limits, Observer, Outcome, Progress, Sample, Session, Status};
pub use error::SolveError;
pub use reform::Reformulation;
pub use solver::{Solver, Step};
pub use via::Via;
