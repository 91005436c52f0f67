//! The statement and the judge.
//!
//! This crate states the problems of nonsmooth mechanics as plain validated data ([`FrictionLocal`],
//! [`FrictionGlobal`], [`Lcp`], [`Mlcp`], …), says how far a point is from solving them ([`check`]),
//! and makes instances with a known solution ([`planted`]). It holds no algorithm: nothing here is shared with a solver's kernels.
//!
//! Notation follows `docs/notation.md` and FCLIB's letters.

mod any;
pub mod check;
mod complementarity;
mod dynamics;
mod error;
mod friction;
mod friction_global;
mod friction_local;
mod law;
pub mod planted;
mod problem;
mod rows;

pub use any::{
    AnyCounts, AnyGauge, AnyPoint, AnyProblem, AnyStatus, OfAny, OfAnyPoint, any_verdict,
};
pub use complementarity::{BoxLcp, Complementarity, Hlcp, HlcpPoint, Lcp, LcpPoint, Mlcp};
pub use dynamics::Dynamics;
pub use error::ProblemError;
pub use friction::Friction;
pub use friction_global::{FrictionGlobal, GlobalPoint, RowsGlobal};
pub use friction_local::{FrictionLocal, LocalPoint, RowsLocal};
pub use law::Coulomb;
pub use problem::{Kind, Problem};
pub use rows::Bounds;
