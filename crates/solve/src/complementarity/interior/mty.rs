//! **The predictor–corrector method of Mizuno, Todd and Ye** in the narrow neighbourhood.
//!
//! Problem: `Q x + R s = q`, `0 ≤ x ⟂ s ≥ 0` (lecture (33)); an LCP is `Q = M`, `R = −I`, and free variables of an MLCP have equations without a pair.
//!
//! Method: within `N₂(θ) = {‖x ∘ s − μ e‖₂ ≤ θ μ}` (lecture (44), corrected) a predictor towards μ = 0 goes as far as `N₂(2θ)` reaches; a
//! corrector towards the central path, with μ fixed, brings the iterate back to `N₂(θ)`. Each is a step of Newton's method with its own matrix.
//!
//! The theory presumes a feasible start in `N₂(θ)`, which nobody has. Here the start `x = s = ξ e` is in the centre but does not obey the equations;
//! a predictor of length α shortens their residual by `1 − α`, a corrector leaves it, so it vanishes in proportion to μ. The bound `O(√n L)` on the number of
//! iterations is the one for feasible starts; for this start the literature's bound is `O(n L)`, with ξ above all entries of a solution. Without
//! progress it begins again once, with a larger ξ.
//!
//! References: MizunoToddYe1993; Potra1996 (infeasible start); Acary2018 (33)-(45).
//! Cost of a step: two factorisations of `M + X⁻¹S` (Cholesky where M is symmetric positive semidefinite, else LU; analysed once), two solves, two products.
//! Storage: a scaled copy of the matrices, that matrix, its factors, 20 vectors.
//! Fails: M that is not monotone; it says so when a corrector does not come back to the neighbourhood. Where there is no solution the iterates grow, and
//! of a monotone problem their direction is a certificate (sought up to 5000 variables). The record has two rows an iteration, and μ in the units of the scaled problem.

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use crate::complementarity::form::Paired;
use crate::complementarity::parts::pairs::{PairPath, SINGULAR};
use crate::core::ranges::{at_least, positive, up_to};
use crate::core::register::{About, Described, Solves};
use crate::core::settings::{Settings, described};
use crate::core::trace::Trace;
use crate::{SolveError, Solver, Step};

/// Predictor and corrector by turns, between two narrow neighbourhoods of the central path.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields, default)]
pub struct MizunoToddYe {
    /// θ of the inner neighbourhood, in (0, 0.25]; that of the predictor is 2θ.
    pub theta: f64,
    /// ξ of the start `x = s = ξ e`, in units in which the largest entries of M and q are about one.
    pub start: f64,
    /// Iterations without progress after which it gives up, at least 1.
    pub patience: usize,
}

impl Default for MizunoToddYe {
    fn default() -> Self {
        Self { theta: 0.25, start: 1.0, patience: 100 }
    }
}

impl Settings for MizunoToddYe {
    fn validate(&self) -> Result<(), String> {
        up_to("theta", self.theta, 0.25)?;
        positive("start", self.start)?;
        at_least("patience", self.patience, 1)
    }
}

impl Described for MizunoToddYe {
    const ABOUT: &'static About = &About {
        name: "ip_mty",
        family: "interior",
        solves: Solves::Law,
        summary: "interior points in the narrow neighbourhood: predictor and corrector of Mizuno, Todd and Ye",
        needs: &["a monotone problem (of an LCP: M positive semidefinite) to be sure of its end"],
        cites: &["MizunoToddYe1993", "Potra1996", "Acary2018"],
        variants: &["theta=0.1"],
        settings: described::<Self>,
    };
}

/// The iterate with its Newton system; a second problem of the same shape reuses both.
pub struct MtyWork {
    path: PairPath,
}

/// The residual may lag behind μ by this factor.
const PACE: f64 = 1e2;
/// Correctors in a row, of which theory needs one.
const CORRECTORS: usize = 4;

impl<P: Paired> Solver<P> for MizunoToddYe {
    type Work = MtyWork;

    fn work(&self, problem: &P) -> Result<MtyWork, SolveError> {
        let mut work = MtyWork { path: PairPath::default() };
        work.path.refill(&problem.equations()?);
        Ok(work)
    }

    fn refill(&self, problem: &P, work: &mut MtyWork) -> Result<(), SolveError> {
        work.path.refill(&problem.equations()?);
        Ok(())
    }

    fn start(&self, _: &P, point: &mut P::Point, work: &mut MtyWork) {
        P::read(point, &mut work.path.z, &mut work.path.s);
        work.path.begin(self.start);
    }

    fn step(&self, _: &P, _: &mut P::Point, work: &mut MtyWork) -> Step {
        let path = &mut work.path;
        if let Some(end) = path.ended() {
            return end;
        }
        let outside = "a corrector does not come back to the neighbourhood: M may not be monotone";
        // Predictor, (43) with σ = 0: x ∘ s becomes (1 − α) x ∘ s + α² dx ∘ ds.
        if path.factorise().is_err() || !path.direct(1.0, |product, _| -product) {
            return path.given_up(SINGULAR, self.start);
        }
        let step = self.length(path);
        if step == 0.0 || path.advance(step).is_none() {
            return path.given_up("no step stays in the neighbourhood", self.start);
        }
        path.record(step);
        // Corrector, σ = 1: the residual stays.
        for _ in 0..CORRECTORS {
            let mu = path.now().mu;
            if path.factorise().is_err() || !path.direct(0.0, |product, _| mu - product) {
                return path.given_up(SINGULAR, self.start);
            }
            let mut step = path.boundary();
            while path.ahead(step).delta > 2.0 * self.theta && step > 1e-3 {
                step *= 0.5;
            }
            if path.advance(step).is_none() {
                return path.given_up(outside, self.start);
            }
            path.record(step);
            if path.now().delta <= self.theta {
                return path.concluded(self.patience, self.start);
            }
        }
        path.given_up(outside, self.start)
    }

    fn publish(&self, _: &P, point: &mut P::Point, work: &mut MtyWork) {
        work.path.publish(|z, s| P::write(z, s, point));
    }

    fn record(&self, on: bool, work: &mut MtyWork) {
        work.path.recorder.begin(on);
    }

    fn trace(&self, work: &MtyWork) -> Trace {
        Trace::Path(work.path.recorder.rows())
    }

    fn account(&self, work: &MtyWork) -> Vec<String> {
        work.path.account()
    }
}

impl MizunoToddYe {
    /// The longest predictor that stays in `N₂(2θ)`, by bisection on a quartic whose coefficients are three sums; zero where there is none.
    fn length(&self, path: &PairPath) -> f64 {
        let free = path.z.len() - path.s.len();
        let pairs = || {
            let x = path.z[free..].iter().zip(&path.dz[free..]);
            x.zip(path.s.iter().zip(&path.ds)).map(|((x, dx), (s, ds))| (x * s, dx * ds))
        };
        let m = path.s.len() as f64;
        let (mut mu, mut bend) = (0.0, 0.0);
        for (p, d) in pairs() {
            mu += p / m;
            bend += d / m;
        }
        let [mut a, mut b, mut c] = [0.0; 3];
        for (p, d) in pairs() {
            let (p, d) = (p / mu - 1.0, (d - bend) / mu);
            a += p * p;
            b += p * d;
            c += d * d;
        }
        let bend = bend / mu;
        let fits = |step: f64| {
            let rest = 1.0 - step;
            let level = rest + step * step * bend;
            let squares = rest * rest * a + 2.0 * rest * step * step * b + step.powi(4) * c;
            level > 0.0
                && squares <= (2.0 * self.theta * level).powi(2)
                && path.keeps_pace(step, 1.0, level * mu, PACE)
        };
        let most = path.boundary() * (1.0 - 1e-12);
        if fits(most) {
            return most;
        }
        let (mut low, mut high) = (0.0, most);
        for _ in 0..60 {
            let middle = 0.5 * (low + high);
            if fits(middle) { low = middle } else { high = middle }
        }
        low
    }
}
