//! Frictional contact problems as plain validated data, their judges and planted instances.

mod global;
mod judge;
mod law;
mod local;
pub mod planted;
mod rows;

pub use global::{Dynamics, FrictionGlobal, GlobalGauge, GlobalPoint, RowsGlobal};
pub use judge::{ContactStatus, Impulses, Law, Motion};
pub use law::Coulomb;
pub use local::{FrictionLocal, LocalGauge, LocalPoint, RowsLocal};
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

    /// Checks shapes and values.
    pub fn validate(&self) -> Result<(), ProblemError> {
        with_friction!(self, p => p.validate())
    }
}
