//! What the wings stand on: the contract of a solver, the one loop, settings, the shape of the registry, and the few numerical means that several use.

pub(crate) mod boxed;
pub(crate) mod clarabel;
pub(crate) mod drive;
pub(crate) mod error;
pub(crate) mod exact_cones;
pub mod guard;
pub(crate) mod guarded;
pub(crate) mod limits;
pub mod line_search;
pub(crate) mod meter;
pub(crate) mod portfolio;
pub(crate) mod ranges;
pub(crate) mod reformulation;
pub(crate) mod register;
pub(crate) mod session;
pub mod settings;
pub(crate) mod solver;
pub mod spelling;
pub(crate) mod status;
pub mod step_rule;
pub mod trace;
pub(crate) mod via;
pub(crate) mod via_session;
pub(crate) mod visits;
