//! The statement and the judge.
//!
//! This crate states the problems of nonsmooth mechanics as plain validated data ([`FrictionLocal`],
//! [`FrictionGlobal`], [`Lcp`], [`Mlcp`], …), says how far a point is from solving them ([`check`]),
//! and makes instances with a known solution ([`planted`]). It holds no algorithm: nothing here is shared with a solver's kernels.
//!
//! Notation follows `docs/notation.md` and FCLIB's letters.

mod any;
pub mod check;
mod error;
pub mod field;
mod kinds;
pub mod planted;
mod problem;

pub use any::{
    AnyCounts, AnyGauge, AnyPoint, AnyProblem, AnyStatus, OfAny, OfAnyPoint, any_verdict,
};
pub use error::ProblemError;
pub use kinds::complementarity::{
    BoxLcp, Hlcp, HlcpPoint, Lcp, LcpPoint, Mcp, Mlcp, Part, Parts, Shape, Stated, plural,
};
pub use kinds::contact::factors;
pub use kinds::contact::{
    Bounds, Coulomb, Dynamics, FrictionGlobal, FrictionLocal, GlobalPoint, LocalPoint, Rolling,
    RollingData, RollingGlobal, RollingLocal, RowsGlobal, RowsLocal, Weighed,
};
pub use kinds::variational::{Constraints, Set, Vi};
pub use kinds::{Complementarity, Friction, Kind};
pub use problem::Problem;
