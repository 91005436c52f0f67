//! Numerical methods for nonsmooth mechanical systems: state, solve and judge frictional contact and linear complementarity problems.
//!
//! Unilateral contact with exact Coulomb friction, contact by contact:
//!
//! ```text
//! K* ∋ u + mu‖u_T‖ e_N  ⟂  r ∈ K,   K = {‖r_T‖ ≤ mu r_N},   u = W r + q.
//! ```
//!
//! A box of 1 kg on the floor is pressed down and pushed sideways beyond what friction holds:
//!
//! ```
//! use nonsmooth::{Bsr, FrictionLocal, Judged, Limits, Motion, Problem, Status, session};
//!
//! let identity = [[1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]];
//! let problem = FrictionLocal::<3>::new(
//!     Bsr::from_rows(1, &[vec![(0, identity)]]), // W: one contact, one block, 1/kg
//!     vec![-1.0, 2.0, 0.0],                      // q: the free velocity [N, T1, T2], m/s
//!     vec![0.5],                                 // mu
//! )?;
//!
//! let mut solver = session::<FrictionLocal<3>>("auto", &Default::default())?;
//! let mut point = problem.origin();
//! let outcome = solver.solve(&problem, &mut point, &Limits::default(), &mut |_| {})?;
//! assert_eq!(outcome.status, Status::Solved);
//!
//! // The judge shares nothing with the solver: it recomputes everything from the problem's data.
//! let verdict = problem.judge(&point, 1e-8)?;
//! println!("relative residual {:.1e}, {:?}", verdict.measure.relative, verdict.counts);
//! assert!(verdict.solved);
//! assert_eq!(verdict.statuses[0].status, Motion::Slip);
//! assert!((point.r[1] + 0.5).abs() < 1e-8); // r_T = −mu r_N against the sliding velocity
//! # Ok::<(), Box<dyn std::error::Error>>(())
//! ```
//!
//! Linear complementarity problems, `0 ≤ z ⟂ M z + q ≥ 0`, are stated and solved the same way. This one has no solution, which is proved:
//!
//! ```
//! use nonsmooth::{Dense, Lcp, Limits, Problem, Status, session};
//!
//! let m = Dense::from_rows(&[[-2.0, 1.0], [1.0, -2.0]]).expect("two rows of two");
//! let problem = Lcp::new(m, vec![-1.0, -1.0])?;
//! let mut point = problem.origin();
//! let outcome = session::<Lcp>("auto", &Default::default())?
//!     .solve(&problem, &mut point, &Limits::default(), &mut |_| {})?;
//! let Status::Infeasible(proof) = outcome.status else { panic!("{}", outcome.status) };
//! assert!(problem.verify(proof.certificate())); // by the problem's own judge, from M and q alone, in exact arithmetic
//! # Ok::<(), Box<dyn std::error::Error>>(())
//! ```
//!
//! | module | what |
//! | --- | --- |
//! | [`problem`] | the statement as plain validated data, the judge, instances with a known solution |
//! | [`solve`] | the contract of a solver, the one loop, the registry, the algorithms |
//! | [`dynamics`] | rigid bodies, elastic solids, contacts and scenes that become problems |
//! | [`io`] | FCLIB's HDF5 files, and linear complementarity problems as text, read and written |
//!
//! What most programs need is re-exported at the root.

pub use nonsmooth_dynamics as dynamics;
pub use nonsmooth_io as io;
pub use nonsmooth_problem as problem;
pub use nonsmooth_solve as solve;

pub use nonsmooth_dynamics::{Scene, SceneError};
pub use nonsmooth_io::{Content, IoError, fclib, read_any};
pub use nonsmooth_problem::check::{Certificate, Existence, Judged, Measure, Motion, Verdict};
pub use nonsmooth_problem::linalg::{Bsr, Csc, Dense, Matrix, Operator};
pub use nonsmooth_problem::planted::Planted;
pub use nonsmooth_problem::{
    BilateralGlobal, BilateralLocal, BoxLcp, Complementarity, Friction, FrictionGlobal,
    FrictionLocal, GlobalPoint, Hlcp, HlcpPoint, Kind, Lcp, LcpPoint, LocalPoint, Mlcp, Problem,
    ProblemError,
};
pub use nonsmooth_problem::{with_complementarity, with_friction};
pub use nonsmooth_solve::registry::{session, solver_names};
pub use nonsmooth_solve::settings;
pub use nonsmooth_solve::{Driver, Limits, Outcome, Session, SolveError, Solver, Status, Step};

/// The README's program compiles.
#[cfg(doctest)]
#[doc = include_str!("../../../README.md")]
struct Readme;
