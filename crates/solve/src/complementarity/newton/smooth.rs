//! **smooth**: Chen's and Mangasarian's smoothing method for nonlinear problems.
//!
//! Problem: `l ≤ x ≤ u ⟂ F(x)`. Method: the plus function of the natural residual is replaced by `p(v, β) = v + ln(1 + e^{−βv})/β`, one damped Newton step is made
//! on the smooth equations `H_β(x) = 0`, and β grows as the natural residual falls.
//!
//! ```text
//! lower bound   x − l − p(x − l − F)
//! upper bound   x − u + p(u − x + F)
//! both          x − l − p(x − l − F) + p(x − u − F)
//! none          F
//! ```
//!
//! `|p(v, β) − v⁺| ≤ ln 2/β`. β is at least `1/√r` for a natural residual r ≥ 1, `1/r` below, `1/r²` near the end. Where the search fails β grows tenfold.
//!
//! References: ChenMangasarian1996; Acary2018. Cost of a step: one LU of the pattern of JF. Fails: where JF is singular along the way, and at stationary points.

use nonsmooth_problem::{LcpPoint, Mcp};
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use crate::complementarity::functions::Slope;
use crate::complementarity::parts::nonlinear::{
    CHECK_EVERY, Crash, Descent, Idle, Inner, Moved, Options, Residual, STATIONARY, Solve,
};
use crate::core::ranges::positive;
use crate::core::register::{About, Described, Solves};
use crate::core::settings::{Settings, described};
use crate::{SolveError, Solver, Step};

/// The hyperparameters.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields, default)]
pub struct Smooth {
    /// The first β, in units of one over those of x.
    pub beta: f64,
    /// Whether projected Newton steps that look for the active set come first.
    pub crash: bool,
}

impl Default for Smooth {
    fn default() -> Self {
        Self { beta: 1.0, crash: true }
    }
}

impl Settings for Smooth {
    fn validate(&self) -> Result<(), String> {
        positive("beta", self.beta)
    }
}

impl Described for Smooth {
    const ABOUT: &'static About = &About {
        name: "smooth",
        family: "newton",
        solves: Solves::Law,
        summary: "Chen's and Mangasarian's smoothing of the natural residual, one Newton step for each parameter",
        needs: &[],
        cites: &["ChenMangasarian1996", "Acary2018"],
        variants: &["crash=false"],
        settings: described::<Self>,
    };
}

/// The smoothed natural residual.
#[derive(Debug, Clone, Copy)]
struct Smoothed {
    beta: f64,
}

impl Smoothed {
    /// `p(v, β)` and its slope.
    fn plus(self, v: f64) -> (f64, f64) {
        let t = self.beta * v;
        // ln(1 + e^−|t|), of which neither side overflows.
        let rest = (-t.abs()).exp();
        (v.max(0.0) + rest.ln_1p() / self.beta, if t >= 0.0 { 1.0 } else { rest } / (1.0 + rest))
    }
}

impl Residual for Smoothed {
    fn at(&self, x: f64, f: f64, (l, u): (f64, f64)) -> Slope {
        match (l.is_finite(), u.is_finite()) {
            (false, false) => Slope { value: f, z: 0.0, w: 1.0 },
            (true, true) if l == u => Slope { value: x - l, z: 1.0, w: 0.0 },
            (true, false) => {
                let (p, w) = self.plus(x - l - f);
                Slope { value: x - l - p, z: 1.0 - w, w }
            }
            (false, true) => {
                let (p, w) = self.plus(u - x + f);
                Slope { value: x - u + p, z: 1.0 - w, w }
            }
            (true, true) => {
                let ((p, w), (q, v)) = (self.plus(x - l - f), self.plus(x - u - f));
                Slope { value: x - l - p + q, z: 1.0 - w + v, w: w - v }
            }
        }
    }
}

/// The workspace.
pub struct Work {
    solve: Solve,
    crash: Crash,
    descent: Descent<Smoothed, Smoothed>,
    beta: f64,
    idle: Idle,
}

/// Steps in which the residual must halve.
const PATIENCE: usize = 100;
/// The largest β.
const LARGEST: f64 = 1e16;
/// Below this residual β is the square of its inverse.
const NEAR: f64 = 1e-3;
const MONOTONE: Options = Options { memory: 1, slack: 1.0, least: 1e-10, gradient: true };

impl Solver<Mcp> for Smooth {
    type Work = Work;

    fn work(&self, problem: &Mcp) -> Result<Work, SolveError> {
        let solve = Solve::new(problem);
        let function = Smoothed { beta: self.beta };
        let descent = Descent::new(function, function, MONOTONE, &solve.model);
        let crash = Crash::new(&solve.model);
        Ok(Work { solve, crash, descent, beta: self.beta, idle: Idle::default() })
    }

    fn aim(&self, tolerance: f64, work: &mut Work) {
        work.solve.aim(tolerance);
    }

    fn start(&self, _: &Mcp, point: &mut LcpPoint, work: &mut Work) {
        work.solve.begin(point);
        work.crash.begin(self.crash);
        (work.beta, work.idle) = (self.beta, Idle::default());
    }

    fn step(&self, _: &Mcp, _: &mut LcpPoint, work: &mut Work) -> Step {
        let Work { solve, crash, descent, beta, idle } = work;
        if !crash.is_over() {
            crash.step(&mut solve.model, &mut solve.at);
            return solve.goes_on();
        }
        let r = solve.at.residual;
        let wanted = match r {
            r if r >= 1.0 => 1.0 / r.sqrt(),
            r if r > NEAR => 1.0 / r,
            r => 1.0 / (r * r),
        };
        *beta = beta.max(wanted).min(LARGEST);
        let function = Smoothed { beta: *beta };
        descent.restart(function, function, MONOTONE);
        let moved = descent.step(&mut solve.model, &mut solve.at);
        solve.note(moved);
        if idle.note(solve.at.residual) > PATIENCE || moved == Moved::Undefined {
            return solve.ends(moved.why());
        }
        if !moved.moved() {
            if *beta >= LARGEST {
                return solve.ends(STATIONARY);
            }
            *beta = (10.0 * *beta).min(LARGEST);
        }
        solve.goes_on()
    }

    fn publish(&self, _: &Mcp, point: &mut LcpPoint, work: &mut Work) {
        work.solve.publish(point);
    }

    fn account(&self, work: &Work) -> Vec<String> {
        let (crash, beta) = (work.crash.steps(), work.beta);
        work.solve.account(vec![format!("crash steps {crash}, last beta {beta:.1e}")])
    }

    fn check_every(&self, _: &Self::Work) -> usize {
        CHECK_EVERY
    }
}
