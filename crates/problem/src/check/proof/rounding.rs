//! Whether a point is an exact solution, rounded to doubles: no point is better then, however large its residual.

use super::exact::{Equation, Exact, exact, rounded, satisfying};

/// Points of so few unknowns are looked at whatever their error,
const FEW: usize = 48;
/// and of so many where it is one that usual tolerances refuse: the rounding of a triangular M with 60 unknowns may be 1e13 units.
const MANY: usize = 300;
const REFUSED: f64 = 1e-10;
/// How far a rounded number may be from what it was, in units of itself.
const BIT: f64 = 2.0 * f64::EPSILON;

/// Whether exact arithmetic is not too dear for a point of so many unknowns with this error.
pub(crate) fn worth_a_look(unknowns: usize, error: f64) -> bool {
    unknowns <= if error > REFUSED { MANY } else { FEW }
}

/// The exact numbers next to `values` that satisfy all equations `Σ a_j x_j + constant = 0`; those that are not `movable` stay. `None` where a number would move
/// by more than its last bit, or the equations contradict each other.
///
/// Cost: an elimination in rational numbers, some milliseconds, .1 s at most; less where the computation of this thread is over before.
pub(crate) fn exactly_near(
    equations: Vec<(Vec<(usize, f64)>, f64)>,
    values: &[f64],
    movable: &[bool],
) -> Option<Vec<Exact>> {
    let weights: Vec<f64> =
        values.iter().zip(movable).map(|(x, m)| if *m { x.abs() } else { 0.0 }).collect();
    let equations = equations.into_iter().map(|(terms, constant)| Equation {
        terms: terms.into_iter().map(|(j, a)| (j, exact(a))).collect(),
        constant: exact(constant),
    });
    let given: Vec<Exact> = values.iter().map(|&x| exact(x)).collect();
    let found = satisfying(equations.collect(), &given, &weights, 100_000)?;
    let near =
        |(x, given): (&Exact, &f64)| rounded(&(x - exact(*given))).abs() <= BIT * given.abs();
    found.iter().zip(values).all(near).then_some(found)
}
