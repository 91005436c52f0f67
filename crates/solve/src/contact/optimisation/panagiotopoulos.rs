//! **Panagiotopoulos' alternation**: a normal and a tangential convex problem in turn.
//!
//! Problem: `u = W r + q`, `K* ∋ u + mu‖u_T‖e_N ⟂ r ∈ K` for each contact.
//!
//! Method: with r_T held, the normal impulses solve `0 ≤ u_N ⟂ r_N ≥ 0`, for symmetric W a quadratic program over half lines; with r_N held,
//! the tangential ones solve the maximal dissipation `−u_T ∈ N_{D(θ)}(r_T)`, `θ = mu r_N`, a quadratic program over disks. Each as exactly
//! as the outer error deserves. It is block Gauss–Seidel between the two directions, where Tresca's fixed point solves both at once.
//!
//! References: Panagiotopoulos1975; Acary, lecture, section on optimisation; AcaryBremondHuber2018.
//!
//! Cost of a step: two convex problems: sweeps over the contacts, products with W (projected gradient) or factorisations (active set), at most
//! `inner_iterations` each. Storage: 7 vectors and, for active sets, a factor.
//!
//! Fails: as Tresca's fixed point, and it is slow where normal and tangential directions are strongly coupled (bodies that
//! roll or tip), since each half knows nothing of the other.

use nonsmooth_linalg::{Block, budget, small};
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use super::convex::Convex;
use super::sets::Set;
use crate::contact::form::{Access, Blockwise, Frictional, Linearised, OnContacts};
use crate::contact::law::cone::ConvexSet;
use crate::core::ranges::{at_least, below};
use crate::core::register::{About, Described, Solves};
use crate::core::settings::{Settings, described};
use crate::{SolveError, Solver, Step};

/// The solver of the halves, and how exactly each is solved.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields, default)]
pub struct Panagiotopoulos {
    /// The solver of the two convex problems.
    pub inner: HalfSolver,
    /// The inner residual to reach, as a share of the last outer one, in (0, 1).
    pub inner_share: f64,
    /// At most this many sweeps, gradient steps or factorisations for each of the two problems.
    pub inner_iterations: usize,
}

/// The solvers of the normal and the tangential problem.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
pub enum HalfSolver {
    /// Projected Gauss-Seidel sweeps over the contacts.
    #[default]
    Sweeps,
    /// Spectral projected gradient: products with W only.
    ProjectedGradient,
    /// Semismooth Newton, which here is the primal-dual active set method.
    ActiveSet,
}

impl Default for Panagiotopoulos {
    fn default() -> Self {
        Self { inner: HalfSolver::default(), inner_share: 0.1, inner_iterations: 50 }
    }
}

impl Settings for Panagiotopoulos {
    fn validate(&self) -> Result<(), String> {
        below("inner_share", self.inner_share, 1.0)?;
        at_least("inner_iterations", self.inner_iterations, 1)
    }
}

impl Described for Panagiotopoulos {
    const ABOUT: &'static About = &About {
        name: "panagiotopoulos",
        family: "optimisation",
        solves: Solves::Law,
        summary: "Panagiotopoulos' alternation of a normal and a tangential convex problem",
        needs: &[],
        cites: &["Panagiotopoulos1975", "Acary2018", "AcaryBremondHuber2018"],
        variants: &["inner=projected_gradient", "inner=active_set"],
        settings: described::<Self>,
    };
}

/// The convex module that both halves share, and the step lengths of a visit.
pub struct AlternationWork<P: Blockwise<D> + Frictional<D> + Linearised<D>, const D: usize> {
    convex: Convex<P, D>,
    /// Step lengths of a visit: 1/W_NN, and 1 over the largest eigenvalue of W_TT; 0 where they are not positive.
    lengths: Vec<[f64; 2]>,
    error: f64,
}

#[derive(Debug, Clone, Copy, PartialEq)]
enum Half {
    Normal,
    Tangential,
}

impl<P: Blockwise<D> + Frictional<D> + Linearised<D>, const D: usize> Solver<P>
    for OnContacts<Panagiotopoulos, D>
{
    type Work = AlternationWork<P, D>;

    fn work(&self, problem: &P) -> Result<Self::Work, SolveError> {
        let access = match self.0.inner {
            HalfSolver::Sweeps => Access::Visits,
            HalfSolver::ProjectedGradient => Access::Products,
            HalfSolver::ActiveSet => Access::Newton,
        };
        let convex = Convex::new(problem, access)?;
        let mut work = AlternationWork { convex, lengths: vec![], error: 1.0 };
        work.fill(problem);
        Ok(work)
    }

    fn refill(&self, problem: &P, work: &mut Self::Work) -> Result<(), SolveError> {
        work.convex.refill(problem)?;
        work.fill(problem);
        Ok(())
    }

    fn start(&self, problem: &P, point: &mut P::Point, work: &mut Self::Work) {
        let (r, convex) = (P::impulses(point), &mut work.convex);
        convex.evaluate(problem, r);
        work.error = convex.coulomb(problem.mu(), r, &convex.y);
    }

    fn step(&self, problem: &P, point: &mut P::Point, work: &mut Self::Work) -> Step {
        if let Some(ray) = problem.contradiction(&work.convex.state) {
            return Step::NoSolution(ray.clone().into());
        }
        if self.0.inner == HalfSolver::Sweeps {
            problem.enter(&mut work.convex.state, point);
        }
        let r = P::impulses(point);
        let tolerance = (self.0.inner_share * work.error).clamp(1e-15, 0.1);
        for half in [Half::Normal, Half::Tangential] {
            work.state(problem.mu(), r, half);
            let most = self.0.inner_iterations;
            match self.0.inner {
                HalfSolver::Sweeps => work.sweeps(problem, r, half, tolerance, most),
                HalfSolver::ProjectedGradient => {
                    work.convex.gradient(problem, r, tolerance, most);
                }
                HalfSolver::ActiveSet => {
                    work.convex.newton(problem, r, tolerance, most);
                }
            }
        }
        if self.0.inner == HalfSolver::Sweeps {
            work.convex.evaluate(problem, r);
        }
        work.error = work.convex.coulomb(problem.mu(), r, &work.convex.y);
        Step::Continue { estimate: work.error }
    }

    fn publish(&self, problem: &P, point: &mut P::Point, work: &mut Self::Work) {
        problem.complete(&mut work.convex.state, point);
    }
}

impl<P: Blockwise<D> + Frictional<D> + Linearised<D>, const D: usize> AlternationWork<P, D> {
    fn fill(&mut self, problem: &P) {
        let inverse = |x: f64| if x > 0.0 { 1.0 / x } else { 0.0 };
        self.lengths.clear();
        self.lengths.extend((0..problem.mu().len()).map(|c| {
            let w = problem.diagonal_block(&self.convex.state, c);
            [inverse(w[0][0]), inverse(tangential_stiffness(&w))]
        }));
    }

    /// The sets of one half, with the other held.
    fn state(&mut self, mu: &[f64], r: &[f64], half: Half) {
        for (c, (set, mu)) in self.convex.sets.iter_mut().zip(mu).enumerate() {
            let held: [f64; D] = small::block(r, c);
            *set = match half {
                Half::Normal => Set::Normal(held),
                Half::Tangential => Set::Tangential { normal: held[0], theta: mu * held[0] },
            };
        }
    }

    /// Projected Gauss–Seidel on one half until a sweep moves by less than `tolerance`.
    fn sweeps(&mut self, problem: &P, r: &mut [f64], half: Half, tolerance: f64, most: usize) {
        let Self { convex, lengths, .. } = self;
        for _ in 0..most {
            let mut moves = 0.0;
            for (c, (set, lengths)) in convex.sets.iter().zip(&*lengths).enumerate() {
                let length = match half {
                    Half::Normal => lengths[0],
                    Half::Tangential => lengths[1],
                };
                let old: [f64; D] = small::block(r, c);
                let u = problem.velocity(&convex.state, r, c);
                let new = set.project(&std::array::from_fn(|k| old[k] - length * u[k]));
                let dr: [f64; D] = std::array::from_fn(|k| new[k] - old[k]);
                r[D * c..D * c + D].copy_from_slice(&new);
                problem.moved(&mut convex.state, c, &dr);
                moves += dr.iter().map(|v| (convex.unit[c] * v).powi(2)).sum::<f64>();
            }
            if moves.sqrt() <= tolerance * convex.scale || budget::over() {
                break;
            }
        }
    }
}

/// The largest eigenvalue of the symmetric part of `W_TT`.
fn tangential_stiffness<const D: usize>(w: &Block<D>) -> f64 {
    if D == 2 {
        return w[1][1];
    }
    let (a, d, b) = (w[1][1], w[2][2], 0.5 * (w[1][2] + w[2][1]));
    0.5 * (a + d) + (0.25 * (a - d) * (a - d) + b * b).sqrt()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_stiffness_is_the_largest_eigenvalue() {
        assert_eq!(tangential_stiffness(&[[9.0, 1.0], [1.0, 2.5]]), 2.5);
        // [3, 1; 1, 3] has the eigenvalues 2 and 4.
        let w = [[9.0, 0.0, 0.0], [0.0, 3.0, 1.5], [0.0, 0.5, 3.0]];
        assert!((tangential_stiffness(&w) - 4.0).abs() < 1e-15);
    }
}
