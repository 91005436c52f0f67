//! **Projected Jacobi**: every contact takes one projection step, all from the same velocities.
//!
//! Problem: `u = W r + q`, `K* ∋ u + mu‖u_T‖e_N ⟂ r ∈ K` for each contact.
//!
//! Method: `r_c ← P_K(r_c − (ω/w_c) ũ_c)` with `w_c = tr(W_cc)/D` and `ũ = u + mu‖u_T‖e_N`. No contact sees the new
//! impulses of the others before the next step, so the order of the contacts does not matter.
//!
//! References: AcaryBremondHuber2018; Acary, lecture (105)(106).
//!
//! Cost of a step: one product with W. Storage: u and w_c.
//! Fails: diverges unless ω is below about 2 over the largest eigenvalue of W in units of w_c; slow on long chains of contacts.

use nonsmooth_linalg::small::{self, tangential_norm};
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use crate::contact::form::{Access, Frictional, Linear, OnContacts};
use crate::contact::law::cone;
use crate::core::ranges::{at_least, positive};
use crate::core::register::{About, Described, Solves};
use crate::core::settings::{Settings, described};
use crate::{SolveError, Solver, Step};

/// The length of the steps, the same share of 1/w_c for all contacts.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields, default)]
pub struct Jacobi {
    /// The step in units of 1/w_c, positive.
    pub omega: f64,
    /// Steps between two evaluations of the true residual, unless the estimate asks for one earlier.
    pub check_every: usize,
}

impl Default for Jacobi {
    fn default() -> Self {
        Self { omega: 0.1, check_every: 20 }
    }
}

impl Settings for Jacobi {
    fn validate(&self) -> Result<(), String> {
        positive("omega", self.omega)?;
        at_least("check_every", self.check_every, 1)
    }
}

impl Described for Jacobi {
    const ABOUT: &'static About = &About {
        name: "jacobi",
        family: "splitting",
        solves: Solves::Law,
        summary: "projected Jacobi: one projection step of every contact at once",
        needs: &[],
        cites: &["AcaryBremondHuber2018", "Acary2018"],
        variants: &["omega=0.05"],
        settings: described::<Self>,
    };
}

/// The problem's view, the velocities, and w_c.
pub struct JacobiWork<P: Linear<D>, const D: usize> {
    state: P::State,
    u: Vec<f64>,
    unit: Vec<f64>,
}

impl<P: Linear<D> + Frictional<D>, const D: usize> Solver<P> for OnContacts<Jacobi, D> {
    type Work = JacobiWork<P, D>;

    fn work(&self, problem: &P) -> Result<Self::Work, SolveError> {
        let mut work =
            JacobiWork { state: problem.state(Access::Products)?, u: vec![], unit: vec![] };
        fill(problem, &mut work);
        Ok(work)
    }

    fn refill(&self, problem: &P, work: &mut Self::Work) -> Result<(), SolveError> {
        problem.refill(&mut work.state)?;
        fill(problem, work);
        Ok(())
    }

    fn start(&self, _: &P, _: &mut P::Point, _: &mut Self::Work) {}

    fn step(&self, problem: &P, point: &mut P::Point, work: &mut Self::Work) -> Step {
        let r = P::impulses(point);
        problem.velocities(&mut work.state, r, &mut work.u); //        u = W r + q
        let mut moves = 0.0;
        for (c, (&mu, &w)) in problem.mu().iter().zip(&work.unit).enumerate() {
            let mut u: [f64; D] = small::block(&work.u, c);
            u[0] += mu * tangential_norm(&u); //                       ũ_c
            let old: [f64; D] = small::block(r, c);
            let mut x = old;
            for k in 0..D {
                x[k] -= self.0.omega / w * u[k];
            }
            let new = cone::project(&x, mu); //                        P_K(r_c − (ω/w_c) ũ_c)
            r[D * c..D * c + D].copy_from_slice(&new);
            moves += (0..D).map(|k| (w * (new[k] - old[k])).powi(2)).sum::<f64>();
        }
        let scale = problem.velocity_scale(&work.state) * self.0.omega.min(1.0);
        Step::Continue { estimate: moves.sqrt() / scale }
    }

    fn publish(&self, problem: &P, point: &mut P::Point, work: &mut Self::Work) {
        problem.complete(&mut work.state, point);
    }

    fn check_every(&self, _: &Self::Work) -> usize {
        self.0.check_every
    }
}

/// Everything that depends on the problem's values, in memory that is kept.
fn fill<P: Linear<D>, const D: usize>(problem: &P, work: &mut JacobiWork<P, D>) {
    work.u.resize(D * problem.contacts(), 0.0);
    problem.units(&work.state, &mut work.unit);
}
