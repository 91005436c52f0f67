//! The field F and the projection step that the projection methods share.

use nonsmooth_linalg::small;

use crate::SolveError;
use crate::contact::form::{Access, Linear};
use crate::contact::law::ContactLaw;
use crate::contact::law::cone::ConvexSet;
use crate::core::step_rule::{Ratio, StepRule};

/// Enough for a step length; the power method's estimate is from below by a few percent.
const POWER_STEPS: usize = 20;

/// F at the present impulses and at a trial point, and the step length that outlives a step.
pub struct Field<P: Linear<D>, const D: usize> {
    pub(super) state: P::State,
    /// `w_c`, positive.
    unit: Vec<f64>,
    /// `‖q‖`.
    scale: f64,
    /// F(r) at the present impulses, and a second set for a trial.
    pub(super) f: Vec<f64>,
    pub(super) trial_f: Vec<f64>,
    pub(super) trial: Vec<f64>,
    pub(super) rho: f64,
}

impl<P: Linear<D>, const D: usize> Field<P, D> {
    pub(super) fn new(problem: &P) -> Result<Self, SolveError> {
        let m = D * problem.contacts();
        let mut field = Self {
            state: problem.state(Access::Products)?,
            unit: Vec::with_capacity(m / D),
            scale: 1.0,
            f: vec![0.0; m],
            trial_f: vec![0.0; m],
            trial: vec![0.0; m],
            rho: 1.0,
        };
        field.fill(problem);
        Ok(field)
    }

    pub(super) fn refill(&mut self, problem: &P) -> Result<(), SolveError> {
        problem.refill(&mut self.state)?;
        let m = D * problem.contacts();
        for x in [&mut self.f, &mut self.trial_f, &mut self.trial] {
            x.resize(m, 0.0);
        }
        self.fill(problem);
        Ok(())
    }

    fn fill(&mut self, problem: &P) {
        self.scale = problem.velocity_scale(&self.state);
        problem.units(&self.state, &mut self.unit);
        self.rho = 1.0;
    }

    /// `f = F(r)`.
    pub(super) fn evaluate(state: &mut P::State, problem: &P, r: &[f64], f: &mut [f64]) {
        problem.velocities(state, r, f);
        for c in 0..problem.contacts() {
            let u: [f64; D] = small::block(f, c);
            f[D * c] += problem.law(c).shift(&u);
        }
    }

    /// `trial = P_K(r − ρ F)` with the field at r or, if `at_trial`, at the trial point.
    pub(super) fn project(&mut self, problem: &P, r: &[f64], at_trial: bool) {
        self.project_by(self.rho, problem, r, at_trial);
    }

    /// As [`project`](Self::project), with another step length.
    pub(super) fn project_by(&mut self, rho: f64, problem: &P, r: &[f64], at_trial: bool) {
        let f = if at_trial { &self.trial_f } else { &self.f };
        for (c, &w) in self.unit.iter().enumerate() {
            let mut x: [f64; D] = small::block(r, c);
            for k in 0..D {
                x[k] -= rho / w * f[D * c + k];
            }
            let p = problem.law(c).project(&x);
            self.trial[D * c..D * c + D].copy_from_slice(&p);
        }
    }

    /// From `f = F(r)`: `trial = P_K(r − ρ F(r))` and `trial_f = F(trial)` with a ρ that the rule accepts; the ratio.
    pub(super) fn predict(&mut self, rule: &StepRule, problem: &P, r: &[f64]) -> f64 {
        let mut rho = self.rho;
        rule.shorten(&mut rho, |rho| {
            self.rho = rho;
            self.project(problem, r, false);
            Self::evaluate(&mut self.state, problem, &self.trial, &mut self.trial_f);
            match rule.rule {
                Ratio::Khobotov => self.lipschitz_ratio(r),
                Ratio::SolodovTseng => self.monotone_ratio(r),
            }
        })
    }

    /// The largest eigenvalue of `diag(w)^(-1/2) W diag(w)^(-1/2)`, by the power method.
    pub(super) fn largest_eigenvalue(&mut self, problem: &P) -> f64 {
        // x ← W x, with the free velocity taken off: velocities(x) − velocities(0).
        let m = self.f.len();
        self.trial.fill(0.0);
        problem.velocities(&mut self.state, &self.trial, &mut self.trial_f);
        for (i, x) in self.trial.iter_mut().enumerate() {
            *x = 1.0 + (i as f64 * 0.618_033_988_749_895).fract();
        }
        let mut eigenvalue = 1.0;
        for _ in 0..POWER_STEPS {
            problem.velocities(&mut self.state, &self.trial, &mut self.f);
            let (mut along, mut size) = (0.0, 0.0);
            for i in 0..m {
                let w = self.unit[i / D];
                let y = (self.f[i] - self.trial_f[i]) / w;
                along += w * y * y;
                size += w * self.trial[i] * self.trial[i];
                self.trial[i] = y;
            }
            eigenvalue = (along / size).sqrt();
            let scale = 1.0 / along.sqrt();
            if !(eigenvalue > 0.0 && eigenvalue.is_finite() && scale.is_finite()) {
                return 1.0;
            }
            self.trial.iter_mut().for_each(|x| *x *= scale);
        }
        eigenvalue
    }

    /// `‖r − trial‖` in units of velocity, over `‖q‖`, for a step of length one: an estimate of the relative residual.
    pub(super) fn estimate(&self, r: &[f64]) -> f64 {
        let moved = self.weighted_squares(r, &self.trial, |w| w * w).sqrt();
        moved / (self.scale * self.rho.min(1.0))
    }

    /// `ρ ‖F(r) − F(trial)‖ / ‖r − trial‖` in the dual and the primal metric; NaN where nothing moved.
    pub(super) fn lipschitz_ratio(&self, r: &[f64]) -> f64 {
        let fields = self.weighted_squares(&self.f, &self.trial_f, |w| 1.0 / w);
        let points = self.weighted_squares(r, &self.trial, |w| w);
        self.rho * (fields / points).sqrt()
    }

    /// `ρ |(F(r) − F(trial))ᵀ(r − trial)| / ‖r − trial‖²`; NaN where nothing moved.
    pub(super) fn monotone_ratio(&self, r: &[f64]) -> f64 {
        let product: f64 =
            (0..r.len()).map(|i| (self.f[i] - self.trial_f[i]) * (r[i] - self.trial[i])).sum();
        self.rho * product.abs() / self.weighted_squares(r, &self.trial, |w| w)
    }

    /// The step along −F(trial) from r to the hyperplane `F(trial)ᵀ(x − trial) = 0`.
    pub(super) fn step_to_hyperplane(&self, r: &[f64]) -> f64 {
        self.step_along(&self.trial_f, r)
    }

    fn step_along(&self, normal: &[f64], r: &[f64]) -> f64 {
        let (mut ahead, mut size) = (0.0, 0.0);
        for (i, f) in normal.iter().enumerate() {
            ahead += f * (r[i] - self.trial[i]);
            size += f * f / self.unit[i / D];
        }
        ahead / size
    }

    /// `F(r) ← w (r − trial) − ρ (F(r) − F(trial))`.
    pub(super) fn residual_normal(&mut self, r: &[f64]) {
        for i in 0..r.len() {
            let w = self.unit[i / D];
            let difference = self.f[i] - self.trial_f[i];
            self.f[i] = w * (r[i] - self.trial[i]) - self.rho * difference;
        }
    }

    /// The step along −F(r) from r to the hyperplane `F(r)ᵀ(x − trial) = 0`.
    pub(super) fn step_along_normal(&self, r: &[f64]) -> f64 {
        self.step_along(&self.f, r)
    }

    /// `Σ weight(w_c) ‖x_c − y_c‖²`.
    fn weighted_squares(&self, x: &[f64], y: &[f64], weight: impl Fn(f64) -> f64) -> f64 {
        let square = |c: usize| (D * c..D * c + D).map(|i| (x[i] - y[i]).powi(2)).sum::<f64>();
        self.unit.iter().enumerate().map(|(c, &w)| weight(w) * square(c)).sum()
    }
}
