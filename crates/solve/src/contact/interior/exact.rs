//! **Nonsmooth interior point**: a primal–dual interior-point method on Coulomb's law itself.
//!
//! Problem: `K* ∋ W r + q + mu‖u_T‖ e_N ⟂ r ∈ K`; in scaled coordinates `L ∋ z ⟂ x ∈ L`, `z = Z (W r + q) + ‖z_T‖ e_N`.
//!
//! Method: Mehrotra's predictor–corrector with Nesterov–Todd scaling. ‖z_T‖ is differentiated like any other term
//! (`G = I + e nᵀ`), which costs the symmetry of the matrix and the monotonicity of the problem; where that cuts the steps short, a part of its
//! slope may do (`least_slope`). Optionally
//! the path from the start, where both the equations' residual and complementarity shrink with one parameter, is
//! followed by its arc length, so that it may turn back (`path=continuation`).
//!
//! References: NesterovTodd1998; Mehrotra1992; the exact law: the derivation in `parts::central`; the arc length: Keller1977.
//! Cost of a step: one factorisation of `Q + P W`, two solves and two products; up to four with `least_slope`, with continuation up to six of each.
//! Storage: 20 vectors and five blocks a contact.
//! Fails: the steps can shrink to nothing away from a solution, mostly near sticking contacts, where the kink of ‖u_T‖ lies on
//! the cone's boundary; it then ends as stuck. A starter more than a solver where impacts are large.

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use crate::contact::form::{Access, Disked, Linearised, OnContacts};
use crate::contact::parts::{Central, CentralIterate, Pursuit};
use crate::core::ranges::{at_least, nonnegative, up_to};
use crate::core::register::{About, Described, Solves};
use crate::core::settings::{Settings, described};
use crate::{SolveError, Solver, Step};

/// How the central path is followed.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
pub enum Path {
    /// Towards smaller complementarity only, by Mehrotra's predictor and corrector.
    #[default]
    Mehrotra,
    /// By its arc length, so that it may turn back.
    Continuation,
}

/// How the path is followed, from where a warm start begins, and when the method gives up.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields, default)]
pub struct Interior {
    /// How the central path is followed.
    pub path: Path,
    /// Smooths ‖u_T‖ to √(‖u_T‖² + δ²), δ this many times the complementarity; 0 for the exact law throughout.
    pub smoothing: f64,
    /// Begin near the starting point, this far inside the cones in units of the free velocity; 0 for a cold start.
    pub warm_margin: f64,
    /// Where the boundary cuts a step short, it is computed anew with a part of the slope of ‖u_T‖, at least this, in (0, 1]; 1: always all. Not with continuation.
    pub least_slope: f64,
    /// Steps without a smaller residual after which it gives up.
    pub patience: usize,
}

impl Default for Interior {
    fn default() -> Self {
        Self {
            path: Path::Mehrotra,
            smoothing: 0.0,
            warm_margin: 0.0,
            least_slope: 1.0,
            patience: 30,
        }
    }
}

impl Settings for Interior {
    fn validate(&self) -> Result<(), String> {
        nonnegative("smoothing", self.smoothing)?;
        nonnegative("warm_margin", self.warm_margin)?;
        up_to("least_slope", self.least_slope, 1.0)?;
        at_least("patience", self.patience, 1)
    }
}

impl Described for Interior {
    const ABOUT: &'static About = &About {
        name: "ip",
        family: "interior",
        solves: Solves::Law,
        summary: "nonsmooth interior point: Mehrotra's predictor-corrector with Nesterov-Todd scaling on Coulomb's law itself",
        needs: &[],
        cites: &["NesterovTodd1998", "Mehrotra1992", "TutuncuTohTodd2003", "Keller1977"],
        variants: &["smoothing=0.1", "warm_margin=0.1", "least_slope=0.2", "path=continuation"],
        settings: described::<Self>,
    };
}

/// Steps this short are no progress,
const SHORT: f64 = 1e-6;
/// and after this many of them in a row there will be none.
const MANY_SHORT: usize = 6;

/// The iterate with its factors, and the arc along which it moves.
pub struct PursuedWork<P: Linearised<D> + Disked<D>, const D: usize> {
    state: P::State,
    core: Central<P::Law, D>,
    pursuit: Pursuit<P::Law, D>,
    short: usize,
    since_best: usize,
}

impl<P: Linearised<D> + Disked<D>, const D: usize> Solver<P> for OnContacts<Interior, D> {
    type Work = PursuedWork<P, D>;

    fn work(&self, problem: &P) -> Result<Self::Work, SolveError> {
        let state = problem.state(Access::Newton)?;
        let core = Central::default().know_at_least(self.0.least_slope);
        let pursuit = Pursuit::default();
        Ok(PursuedWork { state, core, pursuit, short: 0, since_best: 0 })
    }

    fn refill(&self, problem: &P, work: &mut Self::Work) -> Result<(), SolveError> {
        problem.refill(&mut work.state)
    }

    fn start(&self, problem: &P, point: &mut P::Point, work: &mut Self::Work) {
        let Interior { path, smoothing, warm_margin, .. } = self.0;
        let r = &*P::impulses(point);
        let warm = (warm_margin > 0.0).then_some((r, warm_margin));
        match path {
            Path::Mehrotra => work.core.begin(problem, &mut work.state, smoothing, warm),
            Path::Continuation => work.pursuit.begin(problem, &mut work.state, smoothing, warm),
        };
        (work.short, work.since_best) = (0, 0);
    }

    fn step(&self, problem: &P, point: &mut P::Point, work: &mut Self::Work) -> Step {
        if let Some(ray) = problem.contradiction(&work.state) {
            return Step::NoSolution(ray.clone().into());
        }
        let PursuedWork { state, core, pursuit, .. } = work;
        let (best, stepped) = match self.0.path {
            Path::Mehrotra => (core.best().1, core.iterate(problem, state)),
            Path::Continuation => (pursuit.core().best().1, pursuit.iterate(problem, state)),
        };
        let Ok(CentralIterate { error, alpha, .. }) = stepped else {
            return Step::Stuck("the matrix of the interior-point step is singular".into());
        };
        let core = match self.0.path {
            Path::Mehrotra => &work.core,
            Path::Continuation => work.pursuit.core(),
        };
        P::impulses(point).copy_from_slice(core.r());
        work.short = if alpha < SHORT { work.short + 1 } else { 0 };
        work.since_best = if error < 0.9 * best { 0 } else { work.since_best + 1 };
        let stuck = match self.0.path {
            Path::Mehrotra => work.short >= MANY_SHORT,
            Path::Continuation => work.pursuit.stuck(),
        };
        if stuck {
            return Step::Stuck("the step lengths went to zero".into());
        }
        if work.since_best >= self.0.patience {
            return Step::Stuck("the residual has not decreased for too many steps".into());
        }
        Step::Continue { estimate: error }
    }

    fn publish(&self, problem: &P, point: &mut P::Point, work: &mut Self::Work) {
        problem.complete(&mut work.state, point);
    }
}
