//! `auto`.

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use crate::form::{Access, Costs, Linearised};
use crate::parts::{ProximalNewton, Sweep};
use crate::settings::Settings;
use crate::{SolveError, Solver, Step};

/// The hyperparameters.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields, default)]
pub struct Auto {
    /// kappa.
    pub kappa: f64,
    /// Sweeps between.
    pub sweep_fraction: f64,
    /// rule
    pub rule: usize,
    /// first epsilon
    pub epsilon: f64,
    /// print
    pub verbose: bool,
    /// idle
    pub patience: usize,
    /// floor factor
    pub floor: f64,
    /// revert
    pub revert: f64,
}

impl Default for Auto {
    fn default() -> Self {
        Self {
            kappa: 30.0,
            sweep_fraction: 0.3,
            rule: 0,
            epsilon: 1.0,
            verbose: false,
            patience: 10,
            floor: 2.0,
            revert: 5.0,
        }
    }
}

impl Settings for Auto {}

/// For contacts of dimension D.
#[derive(Debug, Clone)]
pub struct Hybrid<const D: usize>(pub Auto);

/// The workspace.
pub struct HybridWork<P: Linearised<D>, const D: usize> {
    state: P::State,
    sweep: Sweep<D>,
    newton: Option<Box<ProximalNewton<D>>>,
    scale: f64,
    tolerance: f64,
    phase: Phase,
    costs: Option<Costs>,
    sweeps: usize,
    /// log10 estimates of the sweeps
    last_estimate: f64,
    outer: Outer,
    best_r: Vec<f64>,
    before: Vec<f64>,
}

#[derive(Debug, Clone, Copy, PartialEq)]
enum Phase {
    Sweeps,
    Inner,
    Between { left: usize },
}

#[derive(Debug, Clone, Copy, Default)]
struct Outer {
    count: usize,
    inner: usize,
    initial: f64,
    target: f64,
    best: f64,
    failures: usize,
    epsilon: f64,
    error: f64,
    /// Not below this for now: subproblems there have failed.
    floor: f64,
    successes: usize,
    /// Iterations since the residual last fell markedly.
    idle: usize,
    fraction: f64,
    before_error: f64,
    least: f64,
    factorisations: usize,
}

impl<P: Linearised<D>, const D: usize> Solver<P> for Hybrid<D> {
    type Work = HybridWork<P, D>;

    fn work(&self, problem: &P) -> Result<Self::Work, SolveError> {
        let state = problem.state(Access::Newton)?;
        let m = D * problem.mu().len();
        Ok(HybridWork {
            sweep: Sweep::new(problem, &state),
            newton: None,
            scale: problem.velocity_scale(&state),
            state,
            tolerance: 1e-12,
            phase: Phase::Sweeps,
            costs: None,
            sweeps: 0,
            last_estimate: f64::NAN,
            outer: Outer::default(),
            best_r: vec![0.0; m],
            before: vec![0.0; m],
        })
    }

    fn refill(&self, problem: &P, work: &mut Self::Work) -> Result<(), SolveError> {
        problem.refill(&mut work.state)?;
        work.sweep.fill(problem, &work.state);
        work.scale = problem.velocity_scale(&work.state);
        if let Some(n) = &mut work.newton {
            n.fill(problem, &work.state);
        }
        let m = D * problem.mu().len();
        work.best_r.resize(m, 0.0);
        work.before.resize(m, 0.0);
        Ok(())
    }

    fn aim(&self, tolerance: f64, work: &mut Self::Work) {
        work.tolerance = tolerance;
    }

    fn start(&self, problem: &P, point: &mut P::Point, work: &mut Self::Work) {
        problem.enter(&mut work.state, point);
        work.phase = Phase::Sweeps;
        work.sweeps = 0;
        work.outer =
            Outer { least: f64::INFINITY, fraction: self.0.sweep_fraction, ..Outer::default() };
    }

    fn step(&self, problem: &P, point: &mut P::Point, work: &mut Self::Work) -> Step {
        if let Some(ray) = problem.contradiction(&work.state) {
            return Step::NoSolution(ray.clone());
        }
        match work.phase {
            Phase::Sweeps => self.sweep_first(problem, point, work),
            Phase::Inner => self.inner(problem, point, work),
            Phase::Between { left } => {
                let n = left.min(20);
                let mut moves = 0.0;
                for _ in 0..n {
                    moves = work.sweep.sweep(problem, &mut work.state, P::impulses(point));
                }
                let estimate = moves.sqrt() / work.scale;
                if left > n {
                    work.phase = Phase::Between { left: left - n };
                } else {
                    self.begin_outer(problem, point, work, true);
                }
                Step::Continue { estimate }
            }
        }
    }

    fn publish(&self, problem: &P, point: &mut P::Point, work: &mut Self::Work) {
        problem.complete(&mut work.state, point);
    }
}

impl<const D: usize> Hybrid<D> {
    fn sweep_first<P: Linearised<D>>(
        &self,
        problem: &P,
        point: &mut P::Point,
        work: &mut HybridWork<P, D>,
    ) -> Step {
        let mut estimate = 0.0;
        for _ in 0..10 {
            let moves = work.sweep.sweep(problem, &mut work.state, P::impulses(point));
            work.sweeps += 1;
            estimate = moves.sqrt() / work.scale;
            if estimate <= 0.3 * work.tolerance {
                return Step::Continue { estimate };
            }
        }
        let rate = (estimate / work.last_estimate).powf(0.1);
        work.last_estimate = estimate;
        if work.sweeps >= 30 {
            let costs = *work.costs.get_or_insert_with(|| problem.costs(&mut work.state));
            let left = (work.tolerance / estimate).ln() / rate.ln();
            let newton = 10.0 * costs.factorisation;
            let go_on = rate < 1.0
                && left * costs.sweep < newton
                && (work.sweeps as f64) * costs.sweep < 3.0 * newton;
            if !go_on && work.sweeps >= 50 {
                if self.0.verbose {
                    eprintln!(
                        "sweeps {} estimate {estimate:.1e} rate {rate:.4} costs {costs:?}",
                        work.sweeps
                    );
                }
                work.outer.epsilon = self.0.epsilon;
                self.begin_outer(problem, point, work, false);
            }
        }
        Step::Continue { estimate }
    }

    fn begin_outer<P: Linearised<D>>(
        &self,
        problem: &P,
        point: &mut P::Point,
        work: &mut HybridWork<P, D>,
        swept: bool,
    ) {
        let HybridWork { newton, state, outer, best_r, before, .. } = work;
        let newton = newton.get_or_insert_with(|| Box::new(ProximalNewton::new(problem, state)));
        newton.kappa = self.0.kappa;
        let r = P::impulses(point);
        problem.velocities(state, r, &mut newton.u);
        let mut error = newton.error(r);
        if swept {
            if error > outer.error {
                outer.fraction = (0.5 * outer.fraction).max(0.02);
            } else {
                outer.fraction = (2.0 * outer.fraction).min(self.0.sweep_fraction);
            }
            if error > self.0.revert * outer.error {
                r.copy_from_slice(before);
                problem.velocities(state, r, &mut newton.u);
                error = newton.error(r);
            }
        }
        if error < outer.least {
            outer.least = error;
        }
        newton.center(r, outer.epsilon);
        outer.error = error;
        outer.initial = newton.residual(r);
        outer.target = (1e-3 * error).clamp(1e-15, 1e-4);
        outer.best = outer.initial;
        outer.inner = 0;
        outer.idle = 0;
        best_r.copy_from_slice(r);
        work.phase = Phase::Inner;
    }

    fn inner<P: Linearised<D>>(
        &self,
        problem: &P,
        point: &mut P::Point,
        work: &mut HybridWork<P, D>,
    ) -> Step {
        let HybridWork { newton, state, outer, best_r, before, .. } = work;
        let Some(newton) = newton else { return Step::Stuck("no".into()) };
        let r = P::impulses(point);
        let iterate = newton.iterate(problem, state, r);
        outer.inner += 1;
        outer.factorisations += 1;
        outer.idle += 1;
        if iterate.residual < outer.best {
            if iterate.residual < 0.8 * outer.best {
                outer.idle = 0;
            }
            outer.best = iterate.residual;
            best_r.copy_from_slice(r);
        }
        let error = newton.error(r);
        let estimate = Step::Continue { estimate: error };
        if iterate.residual > outer.target
            && outer.inner < 30
            && outer.idle < self.0.patience
            && iterate.step > 0.0
        {
            return estimate;
        }
        let n = outer.inner;
        let converged = iterate.residual <= outer.target;
        let eps = outer.epsilon;
        if converged {
            outer.failures = 0;
            let factor = match self.0.rule {
                0 => match n {
                    0..=4 => 0.1,
                    5..=8 => 0.25,
                    9..=15 => 0.5,
                    _ => 0.8,
                },
                _ => match n {
                    0..=4 => 0.1,
                    5..=7 => 0.3,
                    8..=12 => 0.6,
                    13..=18 => 1.0,
                    _ => 1.5,
                },
            };
            outer.successes += 1;
            if outer.successes >= 3 {
                outer.floor *= 0.3;
                outer.successes = 0;
            }
            outer.epsilon = (factor * eps).max(outer.floor.min(eps));
        } else {
            outer.floor = self.0.floor * eps;
            outer.successes = 0;
            outer.failures += 1;
            if outer.best < 0.2 * outer.initial && !outer.failures.is_multiple_of(3) {
                r.copy_from_slice(best_r);
            } else {
                r.copy_from_slice(newton.centre());
            }
            outer.epsilon *= if outer.failures == 1 { 4.0 } else { 10.0 };
        }
        outer.epsilon = outer.epsilon.clamp(1e-9, 1e3);
        problem.velocities(state, r, &mut newton.u);
        let error = newton.error(r);
        if self.0.verbose {
            eprintln!(
                "outer {} eps {eps:.1e} inner {n} {} prox {:.1e}→{:.1e} error {:.2e}→{error:.2e} nfac {}",
                outer.count,
                if converged { "ok " } else { "FAIL" },
                outer.initial,
                outer.best,
                outer.error,
                outer.factorisations
            );
        }
        outer.count += 1;
        outer.error = error;
        before.copy_from_slice(r);
        let costs = *work.costs.get_or_insert_with(|| problem.costs(&mut work.state));
        let sweeps = outer.fraction * n as f64 * costs.factorisation / costs.sweep;
        problem.enter(&mut work.state, point);
        if error > 1e-9 {
            work.phase = Phase::Between { left: (sweeps as usize).clamp(1, 300) };
        } else {
            self.begin_outer(problem, point, work, false);
        }
        Step::Continue { estimate: error }
    }
}
