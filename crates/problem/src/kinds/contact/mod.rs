//! Frictional contact problems as plain validated data, their judges and planted instances.

pub mod factors;
mod global;
mod judge;
pub(crate) mod law;
mod local;
pub mod planted;
mod rows;

pub use global::{Dynamics, FrictionGlobal, GlobalGauge, GlobalPoint, RollingGlobal, RowsGlobal};
pub use judge::{ContactStatus, Impulses, Law, Motion, Weighed, friction_rows};
pub use law::{Coulomb, Rolling, RollingData};
pub use local::{FrictionLocal, LocalGauge, LocalPoint, RollingLocal, RowsLocal};
pub use rows::Bounds;

use crate::{Friction, Kind, Problem, ProblemError, with_friction};

impl Friction {
    /// Which kind of problem this is.
    pub fn kind(&self) -> Kind {
        with_friction!(self, p => p.kind())
    }

    /// nc.
    pub fn contacts(&self) -> usize {
        with_friction!(self, p => p.contacts())
    }

    /// The number of scalar unknowns.
    pub fn unknowns(&self) -> usize {
        with_friction!(self, p => p.unknowns())
    }

    /// mu, nc.
    pub fn mu(&self) -> &[f64] {
        with_friction!(self, p => &p.mu)
    }

    /// The coefficients of rolling friction, nc, or empty.
    pub fn mu_r(&self) -> &[f64] {
        with_friction!(self, p => p.rolling_coefficients())
    }

    /// Checks shapes and values.
    pub fn validate(&self) -> Result<(), ProblemError> {
        with_friction!(self, p => p.validate())
    }
}
