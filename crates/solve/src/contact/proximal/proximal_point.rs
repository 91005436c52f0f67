//! **Proximal point**: an outer loop around any solver of frictional contact.
//!
//! Problem: `u = W r + q`, `K* ∋ u + mu‖u_T‖e_N ⟂ r ∈ K` for each contact.
//!
//! Method: `r_{k+1}` solves the problem with `u_α = u + α_k w_c (r − r_k)` in place of u, `w_c = tr(W_cc)/D`, by the inner solver, to a part of the
//! residual that r_k has in the problem itself. The inner problem has the regular matrix `W + α w`, so inner solvers that need a regular or
//! well-conditioned W work on hyperstatic problems; at the fixed point the added term vanishes, so no accuracy is lost. α is fixed, or follows
//! the residual, `α = σ e^ν`, or falls while the inner solver succeeds and rises where it fails.
//!
//! References: Rockafellar1976; AcaryBremondHuber2018, section on proximal point (α fixed and `σ e^ν`).
//!
//! Cost of a step: one step of the inner solver, and one product with W every few of them. Storage: a copy of the problem and the inner solver's.
//! Fails: the law is not monotone, so a small α is needed for a fast outer loop and a large one for the inner solver, and they may not meet.

use nonsmooth_linalg::small;
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use crate::Boxed;
use crate::contact::form::{Access, Disked, Linear, Overwrite, Regularised};
use crate::contact::law::cfun::natural_residual;
use crate::core::ranges::{at_least, below, positive};
use crate::core::register::{Composed, Registered};
use crate::core::settings::Settings;
use crate::{SolveError, Solver, Step};
use nonsmooth_problem::Kind;

/// The hyperparameters of the outer loop.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields, default)]
pub struct ProximalPoint {
    /// How alpha changes from one inner problem to the next.
    pub prox_rule: AlphaRule,
    /// The first alpha, in units of w_c; the only one where prox_rule is fixed.
    pub prox_alpha: f64,
    /// No rule lets alpha fall below it.
    pub prox_alpha_min: f64,
    /// sigma of `alpha = sigma e^nu`, e the relative residual.
    pub prox_sigma: f64,
    /// nu of `alpha = sigma e^nu`.
    pub prox_nu: f64,
    /// An inner problem is solved when its residual is below this part of the residual that the outer loop began it with.
    pub prox_tolerance: f64,
    /// At most this many inner steps for an inner problem.
    pub prox_steps: usize,
}

/// How α changes.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
pub enum AlphaRule {
    /// Not at all, but where the inner solver fails.
    Fixed,
    /// `sigma e^nu` with the relative residual e.
    Residual,
    /// A third after an inner problem that was solved, four times as much after one that was not.
    #[default]
    Success,
}

impl Default for ProximalPoint {
    fn default() -> Self {
        Self {
            prox_rule: AlphaRule::Success,
            prox_alpha: 1.0,
            prox_alpha_min: 1e-8,
            prox_sigma: 5.0,
            prox_nu: 1.0,
            prox_tolerance: 0.1,
            prox_steps: 500,
        }
    }
}

impl Settings for ProximalPoint {
    fn validate(&self) -> Result<(), String> {
        positive("prox_alpha", self.prox_alpha)?;
        positive("prox_alpha_min", self.prox_alpha_min)?;
        positive("prox_sigma", self.prox_sigma)?;
        positive("prox_nu", self.prox_nu)?;
        below("prox_tolerance", self.prox_tolerance, 1.0)?;
        at_least("prox_steps", self.prox_steps, 1)
    }
}

/// The proximal point method as a prefix, on contacts of dimension D.
pub struct Proximal<const D: usize>;

impl<P, const D: usize> Composed<P> for Proximal<D>
where
    P: Linear<D> + Disked<D> + Overwrite + Send + 'static,
    Regularised<P>: Registered<Point = P::Point> + Linear<D>,
{
    type To = Regularised<P>;
    type Settings = ProximalPoint;
    const NAME: &'static str = "proximal";
    const SUMMARY: &'static str =
        "proximal point: the solver works on problems with W + alpha w in place of W";
    const FROM: &'static [Kind] = &[
        Kind::FrictionLocal2d,
        Kind::FrictionLocal3d,
        Kind::FrictionGlobal2d,
        Kind::FrictionGlobal3d,
        Kind::RollingLocal3d,
        Kind::RollingGlobal3d,
    ];
    const CITES: &'static [&'static str] = &["Rockafellar1976", "AcaryBremondHuber2018"];
    const KEYS: &'static str = "prox_";

    fn compose(settings: ProximalPoint, inner: Boxed<Regularised<P>>) -> Boxed<P> {
        Boxed::new(Outer::<_, D> { settings, inner })
    }
}

/// α at which even the inner problem's solution is hardly more than r_k.
const ALPHA_MOST: f64 = 1e6;
/// The factor of α after an inner problem that was solved.
const SUCCESS: f64 = 0.3;
/// As above, where it was not solved.
const FAILURE: f64 = 4.0;

/// The outer loop around the solver `inner`.
#[derive(Debug, Clone)]
pub struct Outer<S, const D: usize> {
    /// The outer loop's hyperparameters.
    pub settings: ProximalPoint,
    /// The solver of the inner problems.
    pub inner: S,
}

/// The inner problem with its workspace and point, and what the outer loop measures with.
pub struct OuterWork<P: Linear<D> + Disked<D>, S: Solver<Regularised<P>>, const D: usize> {
    problem: Regularised<P>,
    work: S::Work,
    point: P::Point,
    /// A view of the problem itself.
    state: P::State,
    unit: Vec<f64>,
    u: Vec<f64>,
    alpha: f64,
    /// Steps on the present inner problem; since the last look.
    steps: usize,
    since: usize,
    /// The residual in the problem itself that r_k had.
    begun_with: f64,
    /// Inner problems in a row that brought nothing.
    failures: usize,
    /// Why the inner solver could not be told of its problem.
    broken: Option<SolveError>,
}

/// Inner problems in a row that may bring nothing.
const FAILURES_MOST: usize = 20;

impl<P, S, const D: usize> Solver<P> for Outer<S, D>
where
    P: Linear<D> + Disked<D> + Overwrite + Send,
    S: Solver<Regularised<P>>,
{
    type Work = OuterWork<P, S, D>;

    fn work(&self, problem: &P) -> Result<Self::Work, SolveError> {
        let state = problem.state(Access::Products)?;
        let (mut unit, m) = (vec![], D * problem.contacts());
        problem.units(&state, &mut unit);
        let alpha = self.settings.prox_alpha;
        let weight = unit.iter().map(|w| alpha * w).collect();
        let center = vec![0.0; m];
        let regularised = Regularised { base: problem.clone(), weight, center };
        Ok(OuterWork {
            work: self.inner.work(&regularised)?,
            point: problem.origin(),
            problem: regularised,
            state,
            unit,
            u: vec![0.0; m],
            alpha,
            steps: 0,
            since: 0,
            begun_with: f64::INFINITY,
            failures: 0,
            broken: None,
        })
    }

    fn refill(&self, problem: &P, work: &mut Self::Work) -> Result<(), SolveError> {
        problem.refill(&mut work.state)?;
        problem.units(&work.state, &mut work.unit);
        let m = D * problem.contacts();
        work.u.resize(m, 0.0);
        work.problem.center.resize(m, 0.0);
        work.problem.base.overwrite(problem);
        work.weigh(self.settings.prox_alpha);
        self.inner.refill(&work.problem, &mut work.work)
    }

    fn start(&self, _: &P, point: &mut P::Point, work: &mut Self::Work) {
        P::copy_point(point, &mut work.point);
        work.failures = 0;
        (work.begun_with, _) = work.residuals();
        work.broken = self.begin(work).err();
    }

    fn step(&self, problem: &P, _: &mut P::Point, work: &mut Self::Work) -> Step {
        if let Some(ray) = problem.contradiction(&work.state) {
            return Step::NoSolution(ray.clone().into());
        }
        if let Some(error) = &work.broken {
            return Step::Stuck(error.to_string().into());
        }
        let step = self.inner.step(&work.problem, &mut work.point, &mut work.work);
        work.steps += 1;
        work.since += 1;
        let (ended, done) = match step {
            Step::Continue { .. } => (work.steps >= self.settings.prox_steps, false),
            Step::Done => (true, true),
            Step::Stuck(_) => (true, false),
            // A proof about the problem itself, whose judge the inner problem has.
            Step::NoSolution(ray) if problem.verify(&ray) => return Step::NoSolution(ray),
            Step::NoSolution(_) => (true, false),
        };
        if !ended && work.since < self.inner.check_every(&work.work) {
            return Step::Continue { estimate: f64::NAN };
        }
        work.since = 0;
        self.inner.publish(&work.problem, &mut work.point, &mut work.work);
        let (error, inner_error) = work.residuals();
        let solved = inner_error <= self.settings.prox_tolerance * work.begun_with;
        if !ended && !solved {
            return Step::Continue { estimate: error };
        }
        let better = inner_error < work.begun_with;
        if better {
            work.failures = 0;
            work.begun_with = error;
        } else {
            // NaN included: what the inner solver did is worth nothing.
            work.failures += 1;
            P::impulses(&mut work.point).copy_from_slice(&work.problem.center);
        }
        let alpha = self.next_alpha(work.alpha, solved || (done && better), error);
        if alpha > ALPHA_MOST || work.failures > FAILURES_MOST {
            return Step::Stuck("the inner solver makes no progress, whatever the weight".into());
        }
        work.weigh(alpha);
        work.broken = self.begin(work).err();
        Step::Continue { estimate: if better { error } else { f64::NAN } }
    }

    fn publish(&self, _: &P, point: &mut P::Point, work: &mut Self::Work) {
        self.inner.publish(&work.problem, &mut work.point, &mut work.work);
        P::copy_point(&work.point, point);
    }

    fn check_every(&self, work: &Self::Work) -> usize {
        self.inner.check_every(&work.work)
    }
}

impl<S, const D: usize> Outer<S, D> {
    /// Begins an inner problem around the present point: another problem, which the inner solver must be told of.
    fn begin<P>(&self, work: &mut OuterWork<P, S, D>) -> Result<(), SolveError>
    where
        P: Linear<D> + Disked<D>,
        S: Solver<Regularised<P>>,
    {
        (work.steps, work.since) = (0, 0);
        work.problem.center.copy_from_slice(P::impulses(&mut work.point));
        self.inner.refill(&work.problem, &mut work.work)?;
        self.inner.start(&work.problem, &mut work.point, &mut work.work);
        Ok(())
    }

    fn next_alpha(&self, alpha: f64, success: bool, error: f64) -> f64 {
        let ProximalPoint { prox_rule, prox_alpha_min, prox_sigma, prox_nu, .. } = self.settings;
        match (prox_rule, success) {
            (AlphaRule::Fixed, _) => alpha,
            (_, false) => FAILURE * alpha,
            (AlphaRule::Success, true) => (SUCCESS * alpha).max(prox_alpha_min),
            (AlphaRule::Residual, true) => {
                (prox_sigma * error.powf(prox_nu)).min(ALPHA_MOST).max(prox_alpha_min)
            }
        }
    }
}

impl<P: Linear<D> + Disked<D>, S: Solver<Regularised<P>>, const D: usize> OuterWork<P, S, D> {
    fn weigh(&mut self, alpha: f64) {
        self.alpha = alpha;
        self.problem.weight.clear();
        self.problem.weight.extend(self.unit.iter().map(|w| alpha * w));
    }

    /// The relative residuals of the present point: in the problem itself, and in the inner problem.
    fn residuals(&mut self) -> (f64, f64) {
        let Self { problem, point, state, unit, u, .. } = self;
        let r = P::impulses(point);
        problem.base.velocities(state, r, u);
        let (mut own, mut inner) = (0.0, 0.0);
        for (c, &w) in unit.iter().enumerate() {
            let law = problem.base.law(c);
            let r_c: [f64; D] = small::block(r, c);
            let mut u_c: [f64; D] = small::block(u, c);
            own += natural_residual(w, &r_c, &u_c, law);
            let weight = problem.weight[c];
            for k in 0..D {
                u_c[k] += weight * (r_c[k] - problem.center[D * c + k]);
            }
            inner += natural_residual(w + weight, &r_c, &u_c, law);
        }
        let scale = problem.base.velocity_scale(state);
        (own.sqrt() / scale, inner.sqrt() / scale)
    }
}
