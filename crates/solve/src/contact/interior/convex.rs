//! **The convex relaxation** by a primal–dual interior-point method. It does *not* solve Coulomb's law.
//!
//! Problem: `min ½ rᵀW r + qᵀr` over `r ∈ K`, or `K* ∋ W r + q ⟂ r ∈ K`: Coulomb's law without De Saxcé's term `mu‖u_T‖`, as if
//! a contact that slides with u_T had to open with `u_N = mu‖u_T‖`. Where nothing slides its solutions are Coulomb's.
//!
//! Method: first impulses in K with `W r + q = 0`, a minimum of zero, by alternating directions with a penalty that vanishes (`parts::alternating`), for as long as they promise to end for
//! less than ten factorisations. Then Mehrotra's predictor–corrector with Nesterov–Todd scaling, from where the equations and `x + z = 0` hold, moved inside the cones, see `parts::central`. It ends
//! when the convex problem is solved to rounding; the judge measures the residual of Coulomb's law, so that a problem whose
//! contacts slide ends as not solved.
//!
//! References: Acary, lecture (123)(124) with s = 0; EcksteinBertsekas1992; NesterovTodd1998; Mehrotra1992; Vandenberghe2010.
//! Cost of a step: one solve and one projection a contact, all with one factorisation; of the interior point one factorisation of `Q + P W`, two solves, two products. Storage: 26 vectors and seven blocks a contact.
//! Fails: where the relaxation has no solution (r grows without bound).

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use crate::contact::form::{Access, Frictional, Linearised, OnContacts};
use crate::contact::parts::{Alternating, ConvexIp, REST, Rate, Way};
use crate::core::ranges::{at_least, positive};
use crate::core::register::{About, Described, Solves};
use crate::core::settings::{Settings, described};
use crate::{SolveError, Solver, Step};

/// What the search for rest promises is compared with this residual, below any that is asked for.
const RESTS: f64 = 1e-13;

/// When the convex problem counts as solved, and when as hopeless.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields, default)]
pub struct ConvexRelaxation {
    /// The relative residual of the convex problem at which it has finished, positive.
    pub convex_tolerance: f64,
    /// Steps without a smaller residual of the convex problem after which it gives up.
    pub patience: usize,
}

impl Default for ConvexRelaxation {
    fn default() -> Self {
        Self { convex_tolerance: 1e-13, patience: 30 }
    }
}

impl Settings for ConvexRelaxation {
    fn validate(&self) -> Result<(), String> {
        positive("convex_tolerance", self.convex_tolerance)?;
        at_least("patience", self.patience, 1)
    }
}

impl Described for ConvexRelaxation {
    const ABOUT: &'static About = &About {
        name: "convex_relaxation",
        family: "interior",
        solves: Solves::Relaxation,
        summary: "search for rest and interior point on the convex relaxation (s = 0), which is Coulomb's law only where nothing slides",
        needs: &[],
        cites: &[
            "EcksteinBertsekas1992",
            "NesterovTodd1998",
            "Mehrotra1992",
            "Vandenberghe2010",
            "Acary2018",
        ],
        variants: &[],
        settings: described::<Self>,
    };
}

/// What a step does.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Stage {
    Rest,
    Interior,
}

/// The iterate on the cones with its factors.
pub struct RelaxedWork<P: Linearised<D> + Frictional<D>, const D: usize> {
    state: P::State,
    rest: Alternating<D>,
    rate: Rate,
    stage: Stage,
    ip: ConvexIp<D>,
    error: f64,
    since_best: usize,
}

impl<P: Linearised<D> + Frictional<D>, const D: usize> RelaxedWork<P, D> {
    /// One iteration of the search for rest, whose impulses become r.
    fn seek_rest(&mut self, problem: &P, r: &mut [f64]) {
        let Self { rest, rate, state, .. } = self;
        let estimate = rest.iterate(problem, state);
        rate.note(estimate);
        r.copy_from_slice(rest.impulses());
        let costs = problem.costs(state);
        let promises = |limit| rate.promises(RESTS, costs.solve, limit);
        let goes_on = rest.is_young() || promises(REST * costs.factorisation);
        if rest.is_hopeless(estimate) || !goes_on {
            self.begin_interior(problem);
        }
    }

    fn begin_interior(&mut self, problem: &P) {
        self.stage = Stage::Interior;
        self.error = self.ip.begin_relaxed(problem, &mut self.state).error;
        self.since_best = 0;
    }
}

impl<P: Linearised<D> + Frictional<D>, const D: usize> Solver<P>
    for OnContacts<ConvexRelaxation, D>
{
    type Work = RelaxedWork<P, D>;

    fn work(&self, problem: &P) -> Result<Self::Work, SolveError> {
        let state = problem.state(Access::Newton)?;
        Ok(RelaxedWork {
            state,
            rest: Alternating::default(),
            rate: Rate::default(),
            stage: Stage::Rest,
            ip: ConvexIp::new(),
            error: f64::INFINITY,
            since_best: 0,
        })
    }

    fn refill(&self, problem: &P, work: &mut Self::Work) -> Result<(), SolveError> {
        problem.refill(&mut work.state)
    }

    fn start(&self, problem: &P, _: &mut P::Point, work: &mut Self::Work) {
        work.rate.begin();
        work.stage = Stage::Rest;
        if work.rest.begin(problem, &mut work.state, Way::Rest, None).is_err() {
            work.begin_interior(problem);
        }
    }

    fn step(&self, problem: &P, point: &mut P::Point, work: &mut Self::Work) -> Step {
        if let Some(ray) = problem.contradiction(&work.state) {
            return Step::NoSolution(ray.clone().into());
        }
        if work.stage == Stage::Rest {
            work.seek_rest(problem, P::impulses(point));
            return Step::Continue { estimate: f64::NAN };
        }
        let Ok(now) = work.ip.iterate(problem, &mut work.state) else {
            return Step::Stuck("the matrix of the interior-point step is singular".into());
        };
        P::impulses(point).copy_from_slice(work.ip.r());
        if now.error <= self.0.convex_tolerance {
            return Step::Stuck(
                "the convex relaxation is solved, and its solution does not obey Coulomb's law"
                    .into(),
            );
        }
        work.since_best = if now.error < 0.9 * work.error { 0 } else { work.since_best + 1 };
        work.error = work.error.min(now.error);
        if work.since_best >= self.0.patience {
            return Step::Stuck(
                "the convex relaxation could not be solved to its tolerance".into(),
            );
        }
        Step::Continue { estimate: f64::NAN }
    }

    fn publish(&self, problem: &P, point: &mut P::Point, work: &mut Self::Work) {
        problem.complete(&mut work.state, point);
    }
}
