//! Projection methods for the variational inequality `r ∈ K: F(r)ᵀ(r' − r) ≥ 0 ∀ r' ∈ K`,
//! `F(r) = W r + q + (mu‖u_T‖ e_N)_c`.
//!
//! All work in the metric `diag(w_c)`, `w_c = tr(W_cc)/D`: K is a product of cones, so a step length per contact
//! `ρ / w_c` leaves the solutions as they are and makes ρ a pure number. They need products with W only, so global
//! problems are solved in product form, `W r = Hᵀ M⁻¹ (H r)`.

mod de_saxce;
mod extragradient;
mod field;
mod fixed_point;
mod hyperplane;

pub use crate::core::step_rule::{Ratio, StepRule};
pub use de_saxce::DeSaxce;
pub use extragradient::Extragradient;
pub use field::Field;
pub use fixed_point::FixedPoint;
pub use hyperplane::{Hyperplane, Normal};

use crate::contact::form::Linear;
use crate::{SolveError, Solver, Step};

/// What tells one projection method from another; [`Projected`] makes a solver of it.
pub trait Method: Send + Sync {
    /// Prepares for the first step: `r` is the starting point.
    fn begin<P: Linear<D>, const D: usize>(&self, problem: &P, r: &[f64], field: &mut Field<P, D>);

    /// One step on `r`; an estimate of the relative residual before it.
    fn advance<P: Linear<D>, const D: usize>(
        &self,
        problem: &P,
        r: &mut [f64],
        field: &mut Field<P, D>,
    ) -> f64;

    /// Steps between two visits of the judge.
    fn check_every(&self) -> usize;
}

/// A projection method for contacts of dimension D.
#[derive(Debug, Clone, Copy)]
pub struct Projected<M, const D: usize>(pub M);

impl<M: Method, P: Linear<D>, const D: usize> Solver<P> for Projected<M, D> {
    type Work = Field<P, D>;

    fn work(&self, problem: &P) -> Result<Self::Work, SolveError> {
        Field::new(problem)
    }

    fn refill(&self, problem: &P, field: &mut Self::Work) -> Result<(), SolveError> {
        field.refill(problem)
    }

    fn start(&self, problem: &P, point: &mut P::Point, field: &mut Self::Work) {
        self.0.begin(problem, P::impulses(point), field);
    }

    fn step(&self, problem: &P, point: &mut P::Point, field: &mut Self::Work) -> Step {
        if let Some(ray) = problem.contradiction(&field.state) {
            return Step::NoSolution(ray.clone().into());
        }
        Step::Continue { estimate: self.0.advance(problem, P::impulses(point), field) }
    }

    fn publish(&self, problem: &P, point: &mut P::Point, field: &mut Self::Work) {
        problem.complete(&mut field.state, point);
    }

    fn check_every(&self, _: &Self::Work) -> usize {
        self.0.check_every()
    }
}
