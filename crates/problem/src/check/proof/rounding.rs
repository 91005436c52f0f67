//! Whether a point is an exact solution, rounded to doubles: no point is better then, however large its residual.

use super::exact::{Equation, Exact, exact, rounded, satisfying};

/// Points of more unknowns are not looked at.
pub(crate) const FEW: usize = 48;
/// How far a rounded number may be from what it was, in units of itself.
const BIT: f64 = 2.0 * f64::EPSILON;

/// The exact numbers next to `values` that satisfy all equations `Σ a_j x_j + constant = 0`; those that are not `movable` stay. `None` where a number would move
/// by more than its last bit, or the equations contradict each other.
///
/// Cost: an elimination in rational numbers, some milliseconds.
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
