//! Numerical methods for nonsmooth mechanical systems: state, solve and judge frictional contact and complementarity problems.
//!
//! # The door
//!
//! [`solve`]`(&problem)` solves any problem with the default solver, which needs no setting; [`Solve`] says how where that is to be said;
//! [`read`]`(path)` reads a problem from a file. What comes out is an [`Answer`]: the point, the status, the judge's verdict.
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
//! use nonsmooth::{Bsr, FrictionLocal, Motion, Solve, solve};
//!
//! let identity = [[1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]];
//! let problem = FrictionLocal::<3>::new(
//!     Bsr::from_rows(1, &[vec![(0, identity)]]), // W: one contact, one block, 1/kg
//!     vec![-1.0, 2.0, 0.0],                      // q: the free velocity [N, T1, T2], m/s
//!     vec![0.5],                                 // mu
//! )?;
//!
//! let answer = solve(&problem)?;
//! assert!(answer.is_solved()); // the judge's word, who shares nothing with the solver
//! assert_eq!(answer.verdict.statuses[0].status, Motion::Slip);
//! assert!((answer.point.r[1] + 0.5).abs() < 1e-8); // r_T = −mu r_N against the sliding velocity
//!
//! // By another method, more closely, from there.
//! let again = Solve::new().solver("nsgs").set("omega", 0.9).tolerance(1e-12).warm(&answer.point);
//! assert!(again.run(&problem)?.verdict.measure.relative <= 1e-12);
//! # Ok::<(), Box<dyn std::error::Error>>(())
//! ```
//!
//! Linear complementarity problems, `0 ≤ z ⟂ M z + q ≥ 0`, go through the same door. This one has no solution, which is proved:
//!
//! ```
//! use nonsmooth::{Dense, Lcp, Problem, Status, solve};
//!
//! let m = Dense::from_rows(&[[-2.0, 1.0], [1.0, -2.0]]).expect("two rows of two");
//! let problem = Lcp::new(m, vec![-1.0, -1.0])?;
//! let answer = solve(&problem)?;
//! assert!(matches!(answer.status, Status::Infeasible(_)));
//! // Verified by the problem's own judge, from M and q alone, in exact arithmetic.
//! assert!(problem.verify(answer.certificate().expect("a proof")));
//! # Ok::<(), Box<dyn std::error::Error>>(())
//! ```
//!
//! Nonlinear problems `l ≤ x ≤ u ⟂ F(x)` take F as [`field::Expressions`], as a function that is generic over its numbers, whose sparse Jacobian is then exact, or as closures.
//! Josephy's problem, with F written as one would:
//!
//! ```
//! # #[cfg(feature = "duals")] {
//! use nonsmooth::field::{Duals, Function, Number};
//! use nonsmooth::{Mcp, solve};
//!
//! struct Josephy;
//!
//! impl Function for Josephy {
//!     fn dim(&self) -> usize {
//!         4
//!     }
//!
//!     fn at<T: Number>(&self, x: &[T], f: &mut [T]) {
//!         let [a, b, c, d] = [x[0], x[1], x[2], x[3]];
//!         f[0] = a * a * 3.0 + a * b * 2.0 + b * b * 2.0 + c + d * 3.0 - 6.0;
//!         f[1] = a * a * 2.0 + a + b * b + c * 3.0 + d * 2.0 - 2.0;
//!         f[2] = a * a * 3.0 + a * b + b * b * 2.0 + c * 2.0 + d * 3.0 - 1.0;
//!         f[3] = a * a + b * b * 3.0 + c * 2.0 + d * 3.0 - 3.0;
//!     }
//! }
//!
//! let start = vec![0.0; 4];
//! let problem = Mcp::ncp(Duals::new(Josephy, &start)?, start)?; // 0 ≤ x ⟂ F(x) ≥ 0
//! let answer = solve(&problem)?;
//! assert!(answer.is_solved());
//! assert!((answer.point.z[0] - 6f64.sqrt() / 2.0).abs() < 1e-6);
//! # }
//! # Ok::<(), Box<dyn std::error::Error>>(())
//! ```
//!
//! # What is here
//!
//! | to | |
//! | --- | --- |
//! | state a problem | [`FrictionLocal`], [`FrictionGlobal`], [`Lcp`], [`Mlcp`], [`Hlcp`], [`BoxLcp`], [`Mcp`] with its [`field`], [`Vi`] over a [`Set`]; [`AnyProblem`] where the kind is known only from a file |
//! | solve it | [`solve`], [`Solve`], [`Answer`]; [`session`] for many problems of one shape, step by step, without allocation |
//! | judge a point | [`Judged::judge`], [`Verdict`]; [`exists`] asks whether there is a solution at all |
//! | differentiate a solution | [`Derivative::of`], with respect to any of its data, forwards and backwards; [`derivative_within`] limits |
//! | read and write files | [`read`] a problem; [`ProblemFile`] with all that a file holds, in any of the [`FORMATS`] |
//! | make matrices | [`Csc`], [`Bsr`], [`Dense`]: from slices, from faer, and behind features from nalgebra and sprs |
//! | make problems | [`Planted`], with a known solution; [`Scene`], of bodies |
//! | move bodies | [`simulate`]: a world or a Lagrangian system, step by step, every step judged |
//! | write a solver | [`Solver`], [`Step`], [`Driver`] |
//!
//! The crates below (`nonsmooth-problem`, `nonsmooth-solve`, `nonsmooth-io`, `nonsmooth-scenes`, `nonsmooth-simulate`) have all the rest: kernels, single methods, forms.

#[doc(inline)]
pub use nonsmooth_solve::{Answer, Kept, Solvable, Solve, solve};

#[doc(inline)]
pub use nonsmooth_analysis::derivative;
pub use nonsmooth_analysis::derivative::Derivative;
#[doc(inline)]
pub use nonsmooth_io::read;
pub use nonsmooth_solve::derivative_within;

pub use nonsmooth_io::{FORMATS, Format, Info, IoError, ProblemFile, StoredPoint, fclib, linear};
pub use nonsmooth_linalg::{Bsr, Csc, Dense, Matrix, Operator};
pub use nonsmooth_problem::check::{
    Certificate, ContactStatus, Existence, Judged, Measure, Motion, Proof, RowCounts, RowStatus,
    SetCounts, SetStatus, StatusCounts, Verdict,
};
pub use nonsmooth_problem::field;
pub use nonsmooth_problem::planted::{Planted, PlantedLcp};
pub use nonsmooth_problem::{
    AnyCounts, AnyPoint, AnyProblem, AnyStatus, BoxLcp, Complementarity, Friction, FrictionGlobal,
    FrictionLocal, GlobalPoint, Hlcp, HlcpPoint, Kind, Lcp, LcpPoint, LocalPoint, Mcp, Mlcp,
    Problem, ProblemError, RollingGlobal, RollingLocal, RowsGlobal, RowsLocal, Set, Vi,
};
pub use nonsmooth_problem::{with_complementarity, with_friction, with_problem};
pub use nonsmooth_scenes::{Scene, SceneError};
#[doc(inline)]
pub use nonsmooth_simulate as simulate;
pub use nonsmooth_solve::existence::of as exists;
pub use nonsmooth_solve::registry::{session, solver_names};
pub use nonsmooth_solve::settings;
pub use nonsmooth_solve::{
    Driver, Limit, Limits, Outcome, Progress, Sample, Session, SolveError, Solver, Status, Step,
};

/// The README's program compiles.
#[cfg(doctest)]
#[doc = include_str!("../../../README.md")]
struct Readme;

/// The program on Lagrangian systems runs.
#[cfg(doctest)]
#[doc = include_str!("../../../docs/simulation/lagrangian.md")]
struct Lagrangian;

/// The program on variational inequalities runs.
#[cfg(all(doctest, feature = "duals"))]
#[doc = include_str!("../../../docs/nonlinear/variational.md")]
struct Variational;
