//! **Cadoux' approach**: Coulomb's friction as a fixed point on the sliding speeds, with a second-order cone program inside.
//!
//! Problem: `u = W r + q`, `K* ∋ u + mu‖u_T‖e_N ⟂ r ∈ K` for each contact.
//!
//! Method: with the speeds `s_c = ‖u_T‖` frozen, `K* ∋ u + mu s e_N ⟂ r ∈ K` is the optimality condition of
//! `min ½ rᵀWr + (q + mu s e_N)ᵀ r` over K. Its solution has unique velocities u(s); Coulomb's law is `F(s) = ‖u_T(s)‖ = s`.
//! Three updates: the fixed point `s ← F(s)`, Newton on `F(s) − s`, Anderson's combination of past steps.
//!
//! Newton costs one factorisation and is taken back where it does not help: [`Speeds`] has the derivation.
//!
//! References: Cadoux2009; AcaryCadouxLemarechalMalick2011; Acary, lecture (123)(124).
//!
//! Cost of a step: one conic problem (10 to 30 factorisations) and, for Newton, one factorisation more. Storage: 10 vectors and a factor.
//!
//! Fails: the fixed point is a contraction for small mu only, and slow on hyperstatic problems with impacts (rates of 0.8 to 0.97, or
//! above one); Newton meets directions of no descent there. Where the convex problem is unbounded (no v with `Hᵀv + w` in
//! K*) the method cannot start, though Coulomb's problem may have a solution: Clarabel then says so, the others run to a limit.

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use super::MEMORY;
use super::convex::Convex;
use super::inner::{Conic, Effort};
use super::sets::Set;
use crate::contact::form::{Access, Explicit, Frictional, Linearised, OnContacts};
use crate::contact::law::Coulomb;
use crate::contact::parts::{Accelerator, ConvexIp, Shape, Speeds};
use crate::core::ranges::{at_least, at_most, below, up_to};
use crate::core::register::{About, Described, Solves};
use crate::core::settings::{Settings, described};
use crate::{SolveError, Solver, Step};

/// The convex solver inside, the update of the speeds, and how exact the inner solves are.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields, default)]
pub struct Cadoux {
    /// The solver of the convex problem with given speeds.
    pub inner: ConeSolver,
    /// How the speeds are brought up to date.
    pub update: Update,
    /// Fixed-point steps go this share of the way to F(s), in (0, 1].
    pub relaxation: f64,
    /// How many past steps Anderson's update combines, at least 1.
    pub memory: usize,
    /// The inner residual to reach, as a share of the last outer one, in (0, 1).
    pub inner_share: f64,
    /// At most this many inner iterations a step: factorisations, conic iterations or gradient steps.
    pub inner_iterations: usize,
}

/// The solvers of the convex problem with given speeds.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
pub enum ConeSolver {
    /// Our own interior point with Nesterov-Todd scaling.
    #[default]
    Interior,
    /// Clarabel's interior point, polished by Newton steps.
    Clarabel,
    /// Semismooth Newton on the natural map, from the last impulses.
    Newton,
    /// Spectral projected gradient: products with W only.
    ProjectedGradient,
}

/// The updates of the sliding speeds.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
pub enum Update {
    /// `s <- F(s)`.
    FixedPoint,
    /// Newton on `F(s) - s`, with fixed-point steps where it does not help.
    #[default]
    Newton,
    /// The fixed point, accelerated by Anderson's combination of past steps.
    Anderson,
}

impl Default for Cadoux {
    fn default() -> Self {
        Self {
            inner: ConeSolver::default(),
            update: Update::default(),
            relaxation: 1.0,
            memory: 5,
            inner_share: 0.01,
            inner_iterations: 60,
        }
    }
}

impl Cadoux {
    /// The memory of the accelerator.
    fn depth(&self) -> usize {
        if self.update == Update::Anderson { self.memory } else { 0 }
    }
}

impl Settings for Cadoux {
    fn validate(&self) -> Result<(), String> {
        up_to("relaxation", self.relaxation, 1.0)?;
        at_least("memory", self.memory, 1)?;
        at_most("memory", self.memory, MEMORY)?;
        below("inner_share", self.inner_share, 1.0)?;
        at_least("inner_iterations", self.inner_iterations, 1)
    }
}

impl Described for Cadoux {
    const ABOUT: &'static About = &About {
        name: "cadoux",
        family: "optimisation",
        solves: Solves::Law,
        summary: "Cadoux' approach: second-order cone programs of given sliding speeds, Newton on the speeds",
        needs: &[],
        cites: &["Cadoux2009", "AcaryCadouxLemarechalMalick2011", "Acary2018"],
        variants: &[
            "update=fixed_point",
            "update=anderson",
            "inner=clarabel",
            "inner=newton",
            "inner=projected_gradient",
        ],
        settings: described::<Self>,
    };
}

/// The speeds s with their image F(s), and the memory of each inner solver, made when first used.
pub struct CadouxWork<P: Linearised<D> + Frictional<D> + Explicit<D>, const D: usize> {
    convex: Convex<P, D>,
    conic: Option<Conic<D>>,
    interior: ConvexIp<D>,
    accelerator: Accelerator,
    u: Vec<f64>,
    /// s and F(s).
    speeds: Speeds<Coulomb, D>,
    error: f64,
}

/// Newton steps after an interior point that did not reach its tolerance.
const POLISH: usize = 5;

impl<P: Linearised<D> + Frictional<D> + Explicit<D>, const D: usize> Solver<P>
    for OnContacts<Cadoux, D>
{
    type Work = CadouxWork<P, D>;

    fn work(&self, problem: &P) -> Result<Self::Work, SolveError> {
        let products =
            self.0.inner == ConeSolver::ProjectedGradient && self.0.update != Update::Newton;
        let access = if products { Access::Products } else { Access::Newton };
        let convex = Convex::new(problem, access)?;
        let conic = (self.0.inner == ConeSolver::Clarabel)
            .then(|| Conic::new(problem, &convex, Shape::Coulomb))
            .transpose()?;
        let n = problem.mu().len();
        let speeds = Speeds::new(problem, &convex.state);
        Ok(CadouxWork {
            convex,
            conic,
            interior: ConvexIp::new(),
            accelerator: Accelerator::new(self.0.depth(), n),
            u: vec![0.0; D * n],
            speeds,
            error: 1.0,
        })
    }

    fn refill(&self, problem: &P, work: &mut Self::Work) -> Result<(), SolveError> {
        work.convex.refill(problem)?;
        if let Some(conic) = &mut work.conic {
            conic.refill(problem, &work.convex)?;
        }
        let n = problem.mu().len();
        work.speeds.fill(problem, &work.convex.state);
        work.u.resize(D * n, 0.0);
        work.accelerator.resize(n);
        Ok(())
    }

    fn start(&self, problem: &P, point: &mut P::Point, work: &mut Self::Work) {
        let r = P::impulses(point);
        work.evaluate(problem, r);
        // Without impulses to begin with, the convex relaxation.
        let warm = r.iter().any(|r| *r != 0.0);
        if warm {
            work.speeds.begin_at_image();
        } else {
            work.speeds.begin();
        }
        work.accelerator.forget();
    }

    fn step(&self, problem: &P, point: &mut P::Point, work: &mut Self::Work) -> Step {
        if let Some(ray) = problem.contradiction(&work.convex.state) {
            return Step::NoSolution(ray.clone().into());
        }
        let r = P::impulses(point);
        if let Err(why) = work.solve(problem, r, &self.0) {
            return Step::Stuck(why.into());
        }
        work.evaluate(problem, r);
        work.update(problem, r, &self.0);
        Step::Continue { estimate: work.error }
    }

    fn publish(&self, problem: &P, point: &mut P::Point, work: &mut Self::Work) {
        problem.complete(&mut work.convex.state, point);
    }
}

impl<P: Linearised<D> + Frictional<D> + Explicit<D>, const D: usize> CadouxWork<P, D> {
    /// The convex problem with the present speeds.
    fn solve(&mut self, problem: &P, r: &mut [f64], settings: &Cadoux) -> Result<(), &'static str> {
        let convex = &mut self.convex;
        for (c, &mu) in problem.mu().iter().enumerate() {
            convex.shift[c] = mu * self.speeds.s[c]; //                              q + mu s e_N
            convex.sets[c] = Set::Cone(mu);
        }
        let effort = Effort {
            tolerance: (settings.inner_share * self.error).clamp(1e-15, 0.1),
            most: settings.inner_iterations,
            polish: settings.inner_iterations,
        };
        match (settings.inner, &mut self.conic) {
            (ConeSolver::Clarabel, Some(conic)) => {
                conic.solve(problem, convex, r, &[], effort)?;
            }
            (ConeSolver::Interior, _) => {
                let state = &mut convex.state;
                self.interior.begin(problem, state, &self.speeds.s, None);
                self.interior.solve(problem, state, effort.tolerance, effort.most);
                r.copy_from_slice(self.interior.r());
                convex.evaluate(problem, r);
                // Where the interior point ended short of it.
                convex.newton(problem, r, effort.tolerance, POLISH);
            }
            (ConeSolver::ProjectedGradient, _) => {
                convex.gradient(problem, r, effort.tolerance, effort.most);
            }
            _ => {
                convex.evaluate(problem, r);
                convex.newton(problem, r, effort.tolerance, effort.most);
            }
        }
        Ok(())
    }

    /// u, F(s) = ‖u_T‖ and the error at `r`.
    fn evaluate(&mut self, problem: &P, r: &[f64]) {
        problem.velocities(&mut self.convex.state, r, &mut self.u);
        self.speeds.see(&self.u);
        self.error = self.convex.coulomb(problem.mu(), r, &self.u);
    }

    /// The next speeds.
    fn update(&mut self, problem: &P, r: &[f64], settings: &Cadoux) {
        let Self { convex, speeds, accelerator, u, .. } = self;
        let newton = settings.update == Update::Newton;
        if speeds.newton(problem, &mut convex.state, (r, u), newton) {
            return;
        }
        if accelerator.is_on() {
            let (Speeds { s, image, .. }, mu) = (speeds, problem.mu());
            accelerator.begin(s);
            accelerator.advance(image, |c| f64::from(mu[c] > 0.0));
            s.iter_mut().zip(image).for_each(|(s, image)| *s = image.max(0.0));
            return;
        }
        speeds.advance(settings.relaxation); //                           s ← F(s)
    }
}
