//! **Tresca fixed point** (Haslinger): Coulomb's friction as a sequence of convex problems with given thresholds.
//!
//! Problem: `u = W r + q`, `K* ∋ u + mu‖u_T‖e_N ⟂ r ∈ K` for each contact.
//!
//! Method: with `θ_c = mu r_N` frozen, the law is that of Tresca: `0 ≤ u_N ⟂ r_N ≥ 0`, `‖r_T‖ ≤ θ` with r_T against u_T, which for symmetric W
//! is `min ½ rᵀWr + qᵀr` over the cylinders `R₊ × D(θ)`. Solve it as exactly as the outer error deserves, take the new
//! thresholds, repeat. Coulomb's solutions are the fixed points.
//!
//! References: HaslingerDostalKucera2002; Acary, lecture (118)–(122); AcaryBremondHuber2018.
//!
//! Cost of a step: one convex problem: `inner_iterations` products with W at most (projected gradient), a few factorisations (active set),
//! or 10 to 20 of Clarabel's (conic, which allocates). Storage: 7 vectors and, for the latter two, a factor.
//!
//! Fails: a contraction only where mu times the coupling of normal and tangential directions is small; else it may circle, which `relaxation`
//! below 1 helps against. A nonsymmetric W is honoured (the convex problem becomes a variational inequality).

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use super::MEMORY;
use super::inner::{CylinderSolver, Cylinders, Effort};
use super::sets::Set;
use crate::contact::form::{Explicit, Frictional, Linearised, OnContacts};
use crate::contact::parts::Accelerator;
use crate::core::ranges::{at_least, at_most, below, up_to};
use crate::core::register::{About, Described, Solves};
use crate::core::settings::{Settings, described};
use crate::{SolveError, Solver, Step};

/// The hyperparameters of the Tresca fixed point.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields, default)]
pub struct Tresca {
    /// The solver of the convex problem with given thresholds.
    pub inner: CylinderSolver,
    /// The thresholds move by this share of the way to mu r_N, in (0, 1].
    pub relaxation: f64,
    /// How many past steps (at most 50) Anderson's acceleration of the thresholds combines; 0 is the plain fixed point.
    pub anderson: usize,
    /// The inner residual to reach, as a share of the last outer one, in (0, 1).
    pub inner_share: f64,
    /// At most this many inner iterations a step: gradient steps, factorisations or conic iterations.
    pub inner_iterations: usize,
}

impl Default for Tresca {
    fn default() -> Self {
        Self {
            inner: CylinderSolver::default(),
            relaxation: 1.0,
            anderson: 0,
            inner_share: 0.1,
            inner_iterations: 100,
        }
    }
}

impl Settings for Tresca {
    fn validate(&self) -> Result<(), String> {
        up_to("relaxation", self.relaxation, 1.0)?;
        at_most("anderson", self.anderson, MEMORY)?;
        below("inner_share", self.inner_share, 1.0)?;
        at_least("inner_iterations", self.inner_iterations, 1)
    }
}

impl Described for Tresca {
    const ABOUT: &'static About = &About {
        name: "tresca",
        family: "optimisation",
        solves: Solves::Law,
        summary: "Tresca fixed point (Haslinger): convex problems over cylinders of given thresholds",
        needs: &[],
        cites: &["HaslingerDostalKucera2002", "Acary2018", "AcaryBremondHuber2018"],
        variants: &["inner=projected_gradient", "inner=conic", "anderson=5"],
        settings: described::<Self>,
    };
}

/// The cylinders' convex solver, the thresholds θ, and the impulses' image of them.
pub struct TrescaWork<P: Linearised<D> + Frictional<D> + Explicit<D>, const D: usize> {
    inner: Cylinders<P, D>,
    theta: Vec<f64>,
    /// The thresholds that follow from the impulses.
    image: Vec<f64>,
    accelerator: Accelerator,
    error: f64,
}

impl<P: Linearised<D> + Frictional<D> + Explicit<D>, const D: usize> Solver<P>
    for OnContacts<Tresca, D>
{
    type Work = TrescaWork<P, D>;

    fn work(&self, problem: &P) -> Result<Self::Work, SolveError> {
        let inner = Cylinders::new(problem, self.0.inner)?;
        let n = problem.mu().len();
        let accelerator = Accelerator::new(self.0.anderson, n);
        let (theta, image) = (vec![0.0; n], vec![0.0; n]);
        Ok(TrescaWork { inner, theta, image, accelerator, error: 1.0 })
    }

    fn refill(&self, problem: &P, work: &mut Self::Work) -> Result<(), SolveError> {
        work.inner.refill(problem)?;
        let n = problem.mu().len();
        work.theta.resize(n, 0.0);
        work.image.resize(n, 0.0);
        work.accelerator.resize(n);
        Ok(())
    }

    fn start(&self, problem: &P, point: &mut P::Point, work: &mut Self::Work) {
        let r = P::impulses(point);
        for (c, (theta, mu)) in work.theta.iter_mut().zip(problem.mu()).enumerate() {
            *theta = mu * r[D * c].max(0.0);
        }
        work.accelerator.forget();
        work.inner.convex.evaluate(problem, r);
        work.error = work.inner.convex.coulomb(problem.mu(), r, &work.inner.convex.y);
    }

    fn step(&self, problem: &P, point: &mut P::Point, work: &mut Self::Work) -> Step {
        let Self::Work { inner, theta, image, accelerator, error } = work;
        if let Some(ray) = problem.contradiction(&inner.convex.state) {
            return Step::NoSolution(ray.clone().into());
        }
        let r = P::impulses(point);
        for (set, theta) in inner.convex.sets.iter_mut().zip(&*theta) {
            *set = Set::Cylinder(*theta); //                                      θ
        }
        let effort = Effort {
            tolerance: (self.0.inner_share * *error).clamp(1e-15, 0.1),
            most: self.0.inner_iterations,
            polish: self.0.inner_iterations,
        };
        if let Err(why) = inner.solve(problem, r, theta, self.0.inner, effort) {
            return Step::Stuck(why.into());
        }
        *error = inner.convex.coulomb(problem.mu(), r, &inner.convex.y);
        for (c, (image, mu)) in image.iter_mut().zip(problem.mu()).enumerate() {
            let target = mu * r[D * c].max(0.0);
            *image = theta[c] + self.0.relaxation * (target - theta[c]); //       θ ← mu r_N
        }
        if accelerator.is_on() {
            let unit = &inner.convex.unit;
            accelerator.begin(theta);
            accelerator.advance(image, |c| unit[c]);
        }
        for (theta, image) in theta.iter_mut().zip(&*image) {
            *theta = image.max(0.0);
        }
        Step::Continue { estimate: *error }
    }

    fn publish(&self, problem: &P, point: &mut P::Point, work: &mut Self::Work) {
        problem.complete(&mut work.inner.convex.state, point);
    }
}

#[cfg(test)]
mod tests {
    use nonsmooth_linalg::{Bsr, Csc};
    use nonsmooth_problem::{FrictionLocal, Problem};

    use super::*;

    #[test]
    fn one_sliding_contact_takes_two_steps() {
        // W = I: r_N = 1, and with θ = mu r_N = 1/2 the tangential impulse is −θ t.
        let w = Bsr::<3>::from_csc(&Csc::diagonal(&[1.0; 3]));
        let problem = FrictionLocal::new(w, vec![-1.0, 2.0, 0.0], vec![0.5]).unwrap();
        for inner in
            [CylinderSolver::ActiveSet, CylinderSolver::ProjectedGradient, CylinderSolver::Conic]
        {
            let solver = OnContacts::<_, 3>(Tresca { inner, ..Tresca::default() });
            let (mut work, mut point) = (solver.work(&problem).unwrap(), problem.origin());
            solver.start(&problem, &mut point, &mut work);
            for expected in [[1.0, 0.0, 0.0], [1.0, -0.5, 0.0]] {
                work.error = 1e-10; // the convex problem is solved this well
                let step = solver.step(&problem, &mut point, &mut work);
                assert!(matches!(step, Step::Continue { .. }), "{inner:?}: {step:?}");
                let off = (0..3).fold(0.0_f64, |a, k| a.max((point.r[k] - expected[k]).abs()));
                assert!(off < 1e-9, "{inner:?}: {:?}", point.r);
            }
        }
    }
}
