//! What methods for nonlinear problems share: where a solve is, one step of damped Newton methods, ways out of where these stall, proofs that there is nothing to find.

mod crash;
mod descent;
mod escape;
mod idle;
mod iterate;
mod nearby;
mod refute;
mod solve;
mod squares;

pub use crash::Crash;
pub use descent::{Descent, MEMORY_MOST, Options, Residual};
pub use escape::{Escape, Inner};
pub use idle::Idle;
pub use iterate::Iterate;
pub use nearby::nearby;
pub use refute::by_a_row;
pub use solve::{CHECK_EVERY, STATIONARY, Solve, UNDEFINED};
pub use squares::Squares;

/// What a step came to.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Moved {
    /// By Newton's direction.
    Newton,
    /// By Newton's direction of a regularised matrix.
    Regularised,
    /// Along the gradient of the merit.
    Gradient,
    /// Not at all: no direction decreases the merit.
    Stuck,
    /// Not at all: F or its Jacobian is not defined here, or the time is over.
    Undefined,
}

impl Moved {
    /// Whether the point is another one.
    pub fn moved(self) -> bool {
        matches!(self, Self::Newton | Self::Regularised | Self::Gradient)
    }

    /// Why a method ends that did not move.
    pub fn why(self) -> &'static str {
        if self == Self::Undefined { UNDEFINED } else { STATIONARY }
    }
}
