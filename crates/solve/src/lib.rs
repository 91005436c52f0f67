//! All numerics: contracts, the one loop, and one file per algorithm, in wings that never open each other's files.
//!
//! A *problem* (crate `nonsmooth-problem`) is data with its own judge. A *solver* is a struct that is its
//! hyperparameters, with `work` and `step` ([`Solver`]). [`Driver`] is the only loop: it counts, times, judges and
//! keeps the best point. [`registry`] lists what exists, by kind of problem; the command line, its help,
//! `docs/solvers.md` and the conformance tests come from it.
//!
//! | room | what |
//! | --- | --- |
//! | [`contact`] | frictional contact: the law, forms of the problem, families of methods |
//! | [`complementarity`] | complementarity problems, linear and nonlinear: functions, forms, families of methods, reformulations |
//! | [`bridges`] | from contact to complementarity: facets, and friction as a nonlinear problem |
//! | [`variational`] | variational inequalities over simple sets: projection methods, multipliers |
//! | `core` | what the wings stand on: the contract of a solver, the loop, settings, the shape of the registry |
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

pub mod bridges;
pub mod complementarity;
pub mod contact;
mod core;
mod derivative;
pub mod diagnose;
mod door;
pub mod existence;
mod multistart;
pub mod registry;
pub mod variational;

pub use self::complementarity::guarantees;
pub use derivative::derivative_within;
pub use door::{Answer, Kept, Solvable, Solve, solve};
pub use multistart::{Found, multistart};

pub use self::core::boxed::Boxed;
pub use self::core::drive::Driver;
pub use self::core::error::SolveError;
pub use self::core::limits::{Limit, Limits, THREADS_MOST};
pub use self::core::reformulation::Reformulation;
pub use self::core::session::{Observer, Progress, Sample, Session};
pub use self::core::solver::{Solver, Step};
pub use self::core::status::{Outcome, Status};
pub use self::core::via::Via;
pub use self::core::via_session::ViaSession;
pub use self::core::{guard, line_search, settings, spelling, trace};
