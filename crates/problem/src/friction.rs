//! A frictional contact problem whose form and dimension are known only when a file is read.

use crate::{FrictionGlobal, FrictionLocal, Kind, Problem, ProblemError};

/// Any of the frictional contact problems.
#[derive(Debug, Clone, PartialEq)]
pub enum Friction {
    /// `u = W r + q` in the plane.
    Local2(FrictionLocal<2>),
    /// `u = W r + q` in space.
    Local3(FrictionLocal<3>),
    /// `M v = H r + f` in the plane.
    Global2(FrictionGlobal<2>),
    /// `M v = H r + f` in space.
    Global3(FrictionGlobal<3>),
}

/// Evaluates an expression for whichever problem a [`Friction`] holds.
#[macro_export]
macro_rules! with_friction {
    ($any:expr, $problem:ident => $body:expr) => {
        match $any {
            $crate::Friction::Local2($problem) => $body,
            $crate::Friction::Local3($problem) => $body,
            $crate::Friction::Global2($problem) => $body,
            $crate::Friction::Global3($problem) => $body,
        }
    };
}

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
