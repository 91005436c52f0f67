//! **Cadoux' approach**: Coulomb's friction as a fixed point on the sliding speeds, with a second-order cone program inside.
//!
//! Problem: `u = W r + q`, `K* ∋ u + mu‖u_T‖e_N ⟂ r ∈ K` for each contact.
//!
//! Method: with the speeds `s_c = ‖u_T‖` frozen, `K* ∋ u + mu s e_N ⟂ r ∈ K` is the optimality condition of
//! `min ½ rᵀWr + (q + mu s e_N)ᵀ r` over K. Its solution has unique velocities u(s); Coulomb's law is `F(s) = ‖u_T(s)‖ = s`.
//! Three updates: the fixed point `s ← F(s)`, Newton on `F(s) − s`, Anderson's combination of past steps.
//!
//! Newton needs F'(s), which is not available column by column at a reasonable price, but is not needed either: implicit
//! differentiation of the natural map `r = P_K(r − ρ(u + mu s e_N))` gives `(I − J) dr + ρJ (W dr + mu ds e_N) = 0`, and Newton asks
//! for `ds = F(s) − s + nᵀ du_T`, `n = u_T/‖u_T‖`. With ds eliminated the two are one sparse system,
//! `[I − J + ρJ (I + mu e_N nᵀ) W] dr = −ρJ mu (F(s) − s) e_N`: one factorisation, no Krylov method.
//! A step that does not lower ‖F(s) − s‖ is taken back and replaced by fixed-point steps.
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
use crate::contact::law::cone;
use crate::contact::parts::{Accelerator, ConvexIp, Shape};
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
    /// s, F(s), F(s) − s and the Newton step.
    s: Vec<f64>,
    image: Vec<f64>,
    gap: Vec<f64>,
    ds: Vec<f64>,
    /// F(s) where the last Newton step began.
    held: Vec<f64>,
    error: f64,
    newton: Trial,
}

/// Newton steps after an interior point that did not reach its tolerance.
const POLISH: usize = 5;

/// Whether the present s came from a Newton step, and what to do if it is no better.
#[derive(Debug, Clone, Copy, Default)]
struct Trial {
    /// ‖F(s) − s‖ before the Newton step that led here.
    before: Option<f64>,
    /// Newton steps taken back so far.
    refused: usize,
    /// Fixed-point steps to go before the next Newton step.
    wait: usize,
}

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
        Ok(CadouxWork {
            convex,
            conic,
            interior: ConvexIp::new(),
            accelerator: Accelerator::new(self.0.depth(), n),
            u: vec![0.0; D * n],
            s: vec![0.0; n],
            image: vec![0.0; n],
            gap: vec![0.0; n],
            ds: vec![0.0; n],
            held: vec![0.0; n],
            error: 1.0,
            newton: Trial::default(),
        })
    }

    fn refill(&self, problem: &P, work: &mut Self::Work) -> Result<(), SolveError> {
        work.convex.refill(problem)?;
        if let Some(conic) = &mut work.conic {
            conic.refill(problem, &work.convex)?;
        }
        let n = problem.mu().len();
        let speeds = [&mut work.s, &mut work.image, &mut work.gap, &mut work.ds, &mut work.held];
        for x in speeds {
            x.resize(n, 0.0);
        }
        work.u.resize(D * n, 0.0);
        work.accelerator.resize(n);
        Ok(())
    }

    fn start(&self, problem: &P, point: &mut P::Point, work: &mut Self::Work) {
        let r = P::impulses(point);
        work.evaluate(problem, r);
        // Without impulses to begin with, the convex relaxation.
        let warm = r.iter().any(|r| *r != 0.0);
        for (s, image) in work.s.iter_mut().zip(&work.image) {
            *s = if warm { *image } else { 0.0 };
        }
        work.newton = Trial::default();
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
            convex.shift[c] = mu * self.s[c]; //                              q + mu s e_N
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
                self.interior.begin(problem, state, &self.s, None);
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
        for (c, image) in self.image.iter_mut().enumerate() {
            let u: [f64; D] = nonsmooth_linalg::small::block(&self.u, c);
            *image = cone::tangential_norm(&u);
        }
        self.error = self.convex.coulomb(problem.mu(), r, &self.u);
    }

    /// The next speeds.
    fn update(&mut self, problem: &P, r: &[f64], settings: &Cadoux) {
        let mut square = 0.0;
        for (c, gap) in self.gap.iter_mut().enumerate() {
            *gap = self.image[c] - self.s[c];
            // The speed of a contact without friction does not matter.
            square += if problem.mu()[c] > 0.0 { *gap * *gap } else { 0.0 };
        }
        let merit = square.sqrt();
        let refused =
            self.newton.before.take().is_some_and(|before| merit.is_nan() || merit >= before);
        if refused {
            // Back to where it began, and on by the fixed point.
            self.newton.refused += 1;
            self.newton.wait = self.newton.refused.min(10);
            self.s.copy_from_slice(&self.held);
            return;
        }
        if settings.update == Update::Newton && self.newton.wait == 0 {
            let Self { convex, u, gap, ds, .. } = self;
            if convex.speeds(problem, r, u, gap, ds) {
                self.newton.before = Some(merit);
                self.held.copy_from_slice(&self.image);
                for (s, ds) in self.s.iter_mut().zip(&self.ds) {
                    *s = (*s + ds).max(0.0);
                }
                return;
            }
        }
        self.newton.wait = self.newton.wait.saturating_sub(1);
        if self.accelerator.is_on() {
            self.accelerator.begin(&self.s);
            self.accelerator.advance(&mut self.image, &|c| f64::from(problem.mu()[c] > 0.0));
            for (s, image) in self.s.iter_mut().zip(&self.image) {
                *s = image.max(0.0);
            }
            return;
        }
        for (s, gap) in self.s.iter_mut().zip(&self.gap) {
            *s += settings.relaxation * gap; //                               s ← F(s)
        }
    }
}
