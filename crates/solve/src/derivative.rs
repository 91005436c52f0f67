//! Derivatives of solutions within limits.

use std::time::Instant;

use nonsmooth_analysis::derivative::{Derivative, DerivativeError};
use nonsmooth_problem::{AnyPoint, AnyProblem, Problem};

use crate::Limits;
use crate::core::guard;

/// [`Derivative::of`] at the tolerance of `limits`, within its limits on time and memory and its flag to cancel; its other entries are not used. With more than 300 unknowns it works on
/// a copy of the problem on a thread of its own, as solves do, so that a single long factorisation is given up soon after the limit. `tick` is called some hundred times a second meanwhile.
///
/// Errors: those of [`Derivative::of`]; [`DerivativeError::Interrupted`] at a limit.
pub fn derivative_within(
    problem: &AnyProblem,
    point: &AnyPoint,
    limits: &Limits,
    tick: impl FnMut(),
) -> Result<Derivative, DerivativeError> {
    let make = |problem: &AnyProblem, point: &AnyPoint, limits: &Limits| {
        let _scope = limits.budget(Instant::now()).enter();
        Derivative::of(problem, point, limits.tolerance)
    };
    if problem.unknowns() <= guard::SMALL {
        return make(problem, point, limits);
    }
    let (problem, point) = (problem.clone(), point.clone());
    let made = guard::run(limits, tick, move |limits| make(&problem, &point, limits));
    made.unwrap_or(Err(DerivativeError::Interrupted))
}
