//! **Mehrotra's predictor–corrector** in the wide neighbourhood, from an infeasible start.
//!
//! Problem: `Q x + R s = q`, `0 ≤ x ⟂ s ≥ 0` (lecture (33)); an LCP is `Q = M`, `R = −I`, and free variables of an MLCP have equations without a pair.
//!
//! Method: Newton's direction for `Q x + R s = q`, `x ∘ s = σ μ e`, with σ from how far the direction for σ = 0 goes, and with the second-order term of that
//! direction; one step length for x and s (an LCP allows no two), cut back until the iterate is in `N₋∞(ε) = {x_i s_i ≥ ε μ}` (lecture (45)) and the
//! residual of the equations keeps pace with μ. The start is `x = s = ξ e`, or, where the given point is a good one, on the hyperbolas
//! `x_i s_i = μ` next to it. It ends with the equations of the variables that turned out positive, so degenerate problems end accurately too.
//!
//! References: Mehrotra1992; Wright1997; Acary2018 (33)-(45); KojimaMegiddoNomaYoshise1991 for monotone problems.
//! Cost of a step: one factorisation of `M + X⁻¹S` (Cholesky where M is symmetric positive semidefinite, else LU; analysed once), two solves, three products.
//! Storage: a scaled copy of the matrices, that matrix, its factors, 20 vectors.
//! Fails: M that is not monotone may stop it (it often does not). Where there is no solution the iterates grow, and of a monotone problem their
//! direction is a certificate (sought up to 5000 variables). The record has μ in the units of the scaled problem.

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use crate::complementarity::form::Paired;
use crate::complementarity::parts::pairs::{PairPath, SINGULAR};
use crate::core::ranges::{at_least, positive, up_to};
use crate::core::register::{About, Described, Solves};
use crate::core::settings::{Settings, described};
use crate::core::trace::Trace;
use crate::{SolveError, Solver, Step};

/// The neighbourhood, the size of the start, and when the method gives up.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields, default)]
pub struct MehrotraType {
    /// ε of the neighbourhood `x_i s_i ≥ ε μ`, in (0, 0.5].
    pub epsilon: f64,
    /// ξ of the start `x = s = ξ e`, in units in which the largest entries of M and q are about one.
    pub start: f64,
    /// Iterations without progress after which it gives up, at least 1.
    pub patience: usize,
}

impl Default for MehrotraType {
    fn default() -> Self {
        Self { epsilon: 1e-3, start: 1.0, patience: 30 }
    }
}

impl Settings for MehrotraType {
    fn validate(&self) -> Result<(), String> {
        up_to("epsilon", self.epsilon, 0.5)?;
        positive("start", self.start)?;
        at_least("patience", self.patience, 1)
    }
}

impl Described for MehrotraType {
    const ABOUT: &'static About = &About {
        name: "ip_mehrotra",
        family: "interior",
        solves: Solves::Law,
        summary: "interior points in the wide neighbourhood: Mehrotra's predictor and corrector, infeasible start",
        needs: &["a monotone problem (of an LCP: M positive semidefinite) to be sure of its end"],
        cites: &["Mehrotra1992", "Wright1997", "Acary2018", "KojimaMegiddoNomaYoshise1991"],
        variants: &["epsilon=0.01"],
        settings: described::<Self>,
    };
}

/// The iterate with its Newton system; a second problem of the same shape reuses both.
pub struct MehrotraWork {
    path: PairPath,
}

/// The residual may lag behind μ by this factor.
const PACE: f64 = 1e2;
/// Below this step length another direction is tried.
const SHORT: f64 = 0.1;

impl<P: Paired> Solver<P> for MehrotraType {
    type Work = MehrotraWork;

    fn work(&self, problem: &P) -> Result<MehrotraWork, SolveError> {
        let mut work = MehrotraWork { path: PairPath::default() };
        work.path.refill(&problem.equations()?);
        Ok(work)
    }

    fn refill(&self, problem: &P, work: &mut MehrotraWork) -> Result<(), SolveError> {
        work.path.refill(&problem.equations()?);
        Ok(())
    }

    fn start(&self, _: &P, point: &mut P::Point, work: &mut MehrotraWork) {
        P::read(point, &mut work.path.z, &mut work.path.s);
        work.path.begin(self.start);
    }

    fn step(&self, _: &P, _: &mut P::Point, work: &mut MehrotraWork) -> Step {
        let path = &mut work.path;
        if let Some(end) = path.ended() {
            return end;
        }
        if path.factorise().is_err() {
            return path.given_up(SINGULAR, self.start);
        }
        let mu = path.now().mu;
        // The predictor, σ = 0, says how much centring the corrector needs.
        if !path.direct(1.0, |product, _| -product) {
            return path.given_up(SINGULAR, self.start);
        }
        let ahead = path.ahead(path.boundary()).mu;
        let sigma = (ahead / mu).clamp(0.0, 1.0).powi(3).max(1e-9);
        let mut step = 0.0;
        if path.direct(1.0, |product, second| sigma * mu - product - second) {
            step = self.length(path, mu);
        }
        if step < SHORT && path.direct(1.0, |product, _| 0.5 * mu - product) {
            step = self.length(path, mu);
        }
        if step == 0.0 || path.advance(step).is_none() {
            return path.given_up("no step stays in the neighbourhood", self.start);
        }
        path.record(step);
        path.concluded(self.patience, self.start)
    }

    fn publish(&self, _: &P, point: &mut P::Point, work: &mut MehrotraWork) {
        work.path.publish(|z, s| P::write(z, s, point));
    }

    fn record(&self, on: bool, work: &mut MehrotraWork) {
        work.path.recorder.begin(on);
    }

    fn trace(&self, work: &MehrotraWork) -> Trace {
        Trace::Path(work.path.recorder.rows())
    }

    fn account(&self, work: &MehrotraWork) -> Vec<String> {
        work.path.account()
    }
}

impl MehrotraType {
    /// The longest step, near enough, that stays in the neighbourhood; zero where there is none.
    fn length(&self, path: &PairPath, mu: f64) -> f64 {
        let boundary = path.boundary();
        // All but the whole way as μ vanishes, as superlinear convergence asks for.
        let mut step =
            boundary * if boundary < 1.0 { (1.0 - mu).clamp(0.99, 1.0 - 1e-9) } else { 1.0 };
        for _ in 0..60 {
            let ahead = path.ahead(step);
            if ahead.mu > 0.0
                && ahead.least >= self.epsilon
                && path.keeps_pace(step, 1.0, ahead.mu, PACE)
            {
                return step;
            }
            step *= 0.8;
        }
        0.0
    }
}
