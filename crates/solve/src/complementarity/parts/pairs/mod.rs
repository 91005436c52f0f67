//! Path following for pairs: what the interior points for linear complementarity problems share.
//!
//! ```text
//! Q z + R s + c = 0,   z = (u, x),   x ∘ s = μ e,   x, s > 0,   μ → 0
//! ```
//!
//! [`PairPath`] keeps an iterate of the [`Scaled`] problem, gives directions ([`Newton`]), moves along them, and knows three ways to end: the
//! iterate itself is good enough; a guess which variables are positive solves the problem to rounding ([`PairPath::polish`]); the iterates run away
//! along a vector that refutes the problem ([`PairPath::refute`]).

mod newton;
mod polish;
mod refute;
mod scale;

pub use newton::Newton;
pub use polish::{Polish, Polished};
pub use refute::{Side, clean, hopeless_row};
pub use scale::Scaled;

use nonsmooth_linalg::{Singular, norm};
use nonsmooth_problem::check::Certificate;

use crate::Step;
use crate::complementarity::form::Equations;
use crate::core::trace::{PathPoint, Recorder};

/// A given point with a residual above this is not begun at.
const WARM: f64 = 0.1;
/// A residual that is worth the name of a solution.
const ACCURATE: f64 = 1e-11;
/// The factor of ξ at the second start.
const ENLARGED: f64 = 1e3;
/// Refutations that are tried, at most.
const ATTEMPTS: usize = 8;
/// Iterations without progress after which it is asked whether there is a solution.
const STANDSTILL: usize = 4;
/// μ that is nothing.
const VANISHED: f64 = 1e-32;
/// The reason of a solve that ends because K cannot be factorised.
pub const SINGULAR: &str = "the matrix of the step is singular";

/// What the products `x_i s_i` are like, here or a step ahead.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Ahead {
    /// `xᵀs / m`.
    pub mu: f64,
    /// `‖x∘s/μ − 1‖₂`.
    pub delta: f64,
    /// `min x_i s_i / μ`.
    pub least: f64,
}

/// The iterate, its direction, and the workspace.
#[derive(Debug, Default)]
pub struct PairPath {
    /// The problem in scaled units, in which the whole path is computed.
    pub scaled: Scaled,
    /// `(u, x)`.
    pub z: Vec<f64>,
    /// s, one a pair.
    pub s: Vec<f64>,
    /// `Q z + R s + c`.
    pub r: Vec<f64>,
    /// The step of `(u, x)`.
    pub dz: Vec<f64>,
    /// The step of s.
    pub ds: Vec<f64>,
    newton: Newton,
    polish: Polish,
    alpha: Vec<f64>,
    beta: Vec<f64>,
    gamma: Vec<f64>,
    t: Vec<f64>,
    /// The point to publish where it is better than the iterate: the one given, or a polished guess.
    best: Best,
    /// `‖r‖` and μ at the start.
    begin: (f64, f64),
    /// The last partition `x > s`, and whether the one before was the same.
    partition: Vec<bool>,
    settled: bool,
    /// The merit below which the next guess is tried.
    try_below: f64,
    /// The size of x above which the next refutation is tried.
    refute_above: f64,
    /// One row an iteration, kept when the caller asks for a trace.
    pub recorder: Recorder<PathPoint>,
    /// The last merit of the iterate.
    pub merit: f64,
    /// The row that no z makes nonnegative.
    hopeless: Option<usize>,
    /// Zero is a solution.
    trivial: bool,
    /// Began near the caller's point.
    warm: bool,
    /// Began again with a larger ξ.
    enlarged: bool,
    attempts: usize,
    /// Iterations of the solve, those since the last progress, and the least `μ + ‖r‖` at the time.
    iterations: usize,
    idle: usize,
    least: f64,
}

#[derive(Debug, Default)]
struct Best {
    z: Vec<f64>,
    s: Vec<f64>,
    merit: f64,
}

impl PairPath {
    /// Takes a problem; memory is kept.
    pub fn refill(&mut self, problem: &Equations) {
        self.scaled.refill(problem);
        self.newton.refill(&self.scaled);
        let (n, m) = (self.scaled.dim(), self.scaled.pairs());
        for v in [&mut self.z, &mut self.r, &mut self.dz, &mut self.t] {
            v.resize(n, 0.0);
        }
        for v in [&mut self.alpha, &mut self.beta, &mut self.best.z] {
            v.resize(n, 0.0);
        }
        for v in [&mut self.s, &mut self.ds, &mut self.gamma, &mut self.best.s] {
            v.resize(m, 0.0);
        }
        self.hopeless = hopeless_row(problem, &mut self.partition);
        self.partition.clear();
        self.partition.resize(m, false);
    }

    /// Begins near the z and s in place if they are worth it, else at `x = s = ξ e`.
    pub fn begin(&mut self, xi: f64) {
        self.iterations = 0;
        self.best.merit = f64::INFINITY;
        self.enlarged = false;
        self.attempts = 0;
        self.trivial = self.zero_solves();
        self.warm = self.begin_near(WARM);
        if !self.warm {
            self.begin_cold(xi);
        }
    }

    /// Whether zero is a solution; then it is the best point.
    fn zero_solves(&mut self) -> bool {
        let Scaled { c, free, slack, .. } = &self.scaled;
        let solves = match slack {
            None => c[..*free].iter().all(|c| *c == 0.0) && c[*free..].iter().all(|c| *c >= 0.0),
            Some(_) => c.iter().all(|c| *c == 0.0),
        };
        if solves {
            self.best.z.fill(0.0);
            self.best.s.fill(0.0);
            self.best.merit = 0.0;
        }
        solves
    }

    /// What ends the solve before an iteration: nothing to solve for, or nothing to hope for.
    pub fn ended(&mut self) -> Option<Step> {
        self.iterations += 1;
        if self.trivial {
            return Some(Step::Done);
        }
        if let Some(row) = self.hopeless {
            return Some(Step::NoSolution(Certificate::Row { row }));
        }
        self.s.is_empty().then(|| {
            self.polish(true);
            if self.estimate() <= ACCURATE { Step::Done } else { Step::Stuck(SINGULAR.into()) }
        })
    }

    /// What an iteration comes to: the end is tried where it looks near, an iterate that runs away is looked at.
    pub fn concluded(&mut self, patience: usize, xi: f64) -> Step {
        let Ahead { mu, .. } = self.now();
        if self.polish(mu <= VANISHED) || mu <= VANISHED {
            return Step::Done;
        }
        if let Some(y) = self.refute(self.idle == STANDSTILL) {
            return Step::NoSolution(Certificate::Farkas { y });
        }
        let (r0, mu0) = self.begin;
        let left = mu / mu0 + norm(&self.r) / if r0 > self.rounding() { r0 } else { 1.0 };
        if left < 0.9 * self.least {
            (self.least, self.idle) = (left, 0);
        } else {
            self.idle += 1;
        }
        if self.idle > patience {
            return self
                .given_up("no progress: M may not be monotone, or there is no solution", xi);
        }
        Step::Continue { estimate: self.estimate() }
    }

    /// The last attempts before the method says that it is stuck.
    pub fn given_up(&mut self, why: &'static str, xi: f64) -> Step {
        self.polish(true);
        if self.estimate() <= ACCURATE {
            return Step::Done;
        }
        if let Some(y) = self.refute(true) {
            return Step::NoSolution(Certificate::Farkas { y });
        }
        if self.warm {
            // The caller's point was of no use.
            self.warm = false;
            self.begin_cold(xi);
            return Step::Continue { estimate: self.estimate() };
        }
        if !self.enlarged {
            // Solutions much larger than ξ are beyond the reach of short steps.
            self.enlarged = true;
            self.begin_cold(ENLARGED * xi);
            return Step::Continue { estimate: self.estimate() };
        }
        Step::Stuck(why.into())
    }

    /// The number of the iteration.
    pub fn iteration(&self) -> usize {
        self.iterations
    }

    /// What the solve did, for its user.
    pub fn account(&self) -> Vec<String> {
        let kind = if self.newton.is_positive() { "Cholesky" } else { "LU" };
        let mut said = vec![format!("matrices factorised by {kind}")];
        if self.warm {
            said.push("began near the given point".into());
        }
        if self.enlarged {
            said.push("began again with a larger start, without progress from the first".into());
        }
        if self.best.merit < self.merit {
            said.push("the answer comes from the positive variables, once they were known".into());
        }
        said
    }

    /// Begins at `x = s = ξ e`, u = 0.
    pub fn begin_cold(&mut self, xi: f64) {
        let free = self.scaled.free;
        self.z[..free].fill(0.0);
        self.z[free..].fill(xi);
        self.s.fill(xi);
        self.begin_here();
    }

    /// Begins near the z and s in place, in the caller's units, if that is worth it: on the central path's hyperbola `x s = μ` with the differences x − s
    /// that they have. False, and nothing begun, where their residual is no better than `worst`.
    pub fn begin_near(&mut self, worst: f64) -> bool {
        let Self { scaled, z, s, r, .. } = self;
        let free = scaled.free;
        scaled.enter(z, s);
        if scaled.slack.is_none() {
            // w is what the equation makes of z.
            s.fill(0.0);
            scaled.residual(z, s, r);
            s.copy_from_slice(&r[free..]);
            r[free..].fill(0.0);
        } else {
            scaled.residual(z, s, r);
        }
        let merit = scaled.merit(z, s, r);
        if merit < self.best.merit {
            self.best.merit = merit;
            self.best.z.copy_from_slice(z);
            self.best.s.copy_from_slice(s);
        }
        if merit.is_nan() || merit > worst {
            return false;
        }
        let size =
            z[free..].iter().zip(s.iter()).fold(0.0_f64, |l, (x, s)| l.max(x.abs()).max(s.abs()));
        let mu = (merit * size).max(1e-8 * size).max(1e-12) * size.max(1e-12);
        for (x, s) in z[free..].iter_mut().zip(s.iter_mut()) {
            let gap = *x - *s;
            let root = (gap * gap + 4.0 * mu).sqrt();
            // The larger of the two without cancellation, the other from the product.
            let larger = 0.5 * (gap.abs() + root);
            (*x, *s) = if gap > 0.0 { (larger, mu / larger) } else { (mu / larger, larger) };
        }
        self.begin_here();
        true
    }

    fn begin_here(&mut self) {
        self.scaled.residual(&self.z, &self.s, &mut self.r);
        self.begin = (norm(&self.r), self.now().mu);
        self.settled = false;
        self.try_below = 1e-4;
        self.refute_above = 0.0;
        self.merit = self.scaled.merit(&self.z, &self.s, &self.r);
        (self.idle, self.least) = (0, f64::INFINITY);
        self.note_partition();
    }

    /// x.
    pub fn x(&self) -> &[f64] {
        &self.z[self.scaled.free..]
    }

    /// `x_i s_i` summed up at the iterate.
    pub fn now(&self) -> Ahead {
        self.ahead(0.0)
    }

    /// `x_i s_i` summed up a step ahead.
    pub fn ahead(&self, step: f64) -> Ahead {
        let free = self.scaled.free;
        let pairs = || {
            let x = self.z[free..].iter().zip(&self.dz[free..]);
            let s = self.s.iter().zip(&self.ds);
            x.zip(s).map(
                |((x, dx), (s, ds))| {
                    if step == 0.0 { x * s } else { (x + step * dx) * (s + step * ds) }
                },
            )
        };
        let m = self.s.len() as f64;
        let mu = pairs().sum::<f64>() / m;
        let (mut squares, mut least) = (0.0, f64::INFINITY);
        for p in pairs() {
            squares += (p / mu - 1.0).powi(2);
            least = least.min(p);
        }
        Ahead { mu, delta: squares.sqrt(), least: least / mu }
    }

    /// The longest step, at most one, that keeps x and s nonnegative.
    pub fn boundary(&self) -> f64 {
        let free = self.scaled.free;
        let x = self.z[free..].iter().zip(&self.dz[free..]);
        let mut step = 1.0_f64;
        for (x, dx) in x.chain(self.s.iter().zip(&self.ds)) {
            if *dx < 0.0 {
                step = step.min(-x / dx);
            }
        }
        step
    }

    /// Whether a step keeps the residual from lagging behind: `‖r‖/μ` at most `factor` times that of the start, unless r is rounding.
    pub fn keeps_pace(&self, step: f64, eta: f64, mu: f64, factor: f64) -> bool {
        let r = (1.0 - step * eta) * norm(&self.r);
        let (r0, mu0) = self.begin;
        r <= self.rounding() || r * mu0 <= factor * r0 * mu
    }

    /// The residual that rounding explains.
    fn rounding(&self) -> f64 {
        let size = |v: &[f64]| v.iter().fold(0.0_f64, |l, x| l.max(x.abs()));
        let n = self.scaled.dim() as f64;
        1e-14 * n.sqrt() * (1.0 + size(&self.z) + size(&self.s))
    }

    /// Factorises the matrix of the iterate.
    pub fn factorise(&mut self) -> Result<(), Singular> {
        let free = self.scaled.free;
        self.alpha[..free].fill(1.0);
        self.beta[..free].fill(0.0);
        for (k, s) in self.s.iter().enumerate() {
            let x = self.z[free + k];
            self.alpha[free + k] = x / (x + s);
            self.beta[free + k] = s / (x + s);
        }
        self.newton.factorise(&self.scaled, &self.alpha, &self.beta, 0.0)
    }

    /// The direction with `Q dz + R ds = −η r` and `s dx + x ds = γ`, `γ_i = of(i, x_i s_i, dx_i ds_i)` with the direction before. False where it is not
    /// finite.
    pub fn direct(&mut self, eta: f64, of: impl Fn(f64, f64) -> f64) -> bool {
        let Self { scaled, newton, z, s, r, dz, ds, gamma, t, alpha, beta, .. } = self;
        let free = scaled.free;
        for (k, g) in gamma.iter_mut().enumerate() {
            *g = of(z[free + k] * s[k], dz[free + k] * ds[k]);
        }
        if scaled.slack.is_none() {
            for (i, t) in t.iter_mut().enumerate() {
                let rho = -eta * r[i];
                let more = if i < free { 0.0 } else { gamma[i - free] / z[i] };
                *t = newton.root()[i] * (rho + more);
            }
            newton.solve(t);
            dz.iter_mut().zip(newton.root()).zip(t.iter()).for_each(|((d, a), t)| *d = a * t);
            scaled.matrix().mul(dz, t);
            for k in 0..s.len() {
                let i = free + k;
                // The small one of the two is taken from complementarity.
                if z[i] < s[k] {
                    ds[k] = t[i] + eta * r[i];
                    dz[i] = (gamma[k] - z[i] * ds[k]) / s[k];
                } else {
                    ds[k] = (gamma[k] - s[k] * dz[i]) / z[i];
                }
            }
        } else {
            for k in 0..s.len() {
                (dz[k], ds[k]) =
                    if z[k] < s[k] { (gamma[k] / s[k], 0.0) } else { (0.0, gamma[k] / z[k]) };
            }
            // ρ − Q dx⁰ − R ds⁰ = −(η r + (Q dx⁰ + R ds⁰ + c) − c)
            scaled.residual(dz, ds, t);
            t.iter_mut()
                .zip(r.iter())
                .zip(&scaled.c)
                .for_each(|((t, r), c)| *t = -(eta * r + (*t - c)));
            newton.solve(t);
            for k in 0..s.len() {
                dz[k] += alpha[k] * t[k];
                ds[k] -= beta[k] * t[k];
            }
        }
        dz.iter().chain(ds.iter()).all(|d| d.is_finite())
    }

    /// Takes a step. `None` where the iterate would no longer be positive.
    pub fn advance(&mut self, step: f64) -> Option<()> {
        self.z.iter_mut().zip(&self.dz).for_each(|(z, d)| *z += step * d);
        self.s.iter_mut().zip(&self.ds).for_each(|(s, d)| *s += step * d);
        let positive = |x: &f64| *x > 0.0 && x.is_finite();
        if !(self.x().iter().all(positive) && self.s.iter().all(positive)) {
            return None;
        }
        self.scaled.residual(&self.z, &self.s, &mut self.r);
        self.merit = self.scaled.merit(&self.z, &self.s, &self.r);
        self.note_partition();
        Some(())
    }

    fn note_partition(&mut self) {
        let free = self.scaled.free;
        let mut settled = true;
        for (k, active) in self.partition.iter_mut().enumerate() {
            let now = self.z[free + k] > self.s[k];
            settled &= *active == now;
            *active = now;
        }
        self.settled = settled;
    }

    /// Keeps a row of the record.
    pub fn record(&mut self, step: f64) {
        let Ahead { mu, delta, least } = self.now();
        let unit = norm(&self.scaled.c);
        let residual = norm(&self.r) / if unit > 0.0 { unit } else { 1.0 };
        self.recorder.push(PathPoint {
            iteration: self.iterations,
            mu,
            delta,
            least,
            step,
            residual,
        });
    }

    /// Tries the guess which variables are positive, if it looks ripe (or anyway). Says whether its point is a solution to rounding.
    pub fn polish(&mut self, anyway: bool) -> bool {
        let ripe = self.settled && self.merit <= self.try_below;
        if !(ripe || anyway) {
            return false;
        }
        self.try_below = 1e-3 * self.merit;
        let Self { scaled, newton, polish, best, z, s, alpha, beta, t, .. } = self;
        let found = polish.run(scaled, newton, z, s, alpha, beta, t);
        if found.merit < best.merit {
            best.merit = found.merit;
            best.z.copy_from_slice(&polish.z);
            best.s.copy_from_slice(&polish.s);
        }
        found.exact
    }

    /// Looks for a vector that refutes the problem where the iterates run away; a Farkas vector in the caller's units.
    pub fn refute(&mut self, anyway: bool) -> Option<Vec<f64>> {
        let free = self.scaled.free;
        let size = |v: &[f64]| v.iter().fold(0.0_f64, |l, x| l.max(x.abs()));
        let reach = size(&self.z[free..]).max(size(&self.s));
        if (!anyway && reach < self.refute_above) || self.attempts == ATTEMPTS {
            return None;
        }
        // Tried again once the iterates are ten times as large.
        self.refute_above = 10.0 * reach.max(1.0);
        let found = refute::farkas(&self.scaled, &self.z, &self.s)?;
        self.attempts += usize::from(found.is_none());
        found
    }

    /// The point to publish, in the caller's units: the better one of the iterate and the polished guess.
    pub fn publish(&mut self, write: impl FnOnce(&[f64], &[f64])) {
        let Self { scaled, best, z, s, dz, ds, merit, .. } = self;
        // The direction is not needed any more: the next one is made from scratch.
        if best.merit < *merit {
            dz.copy_from_slice(&best.z);
            ds.copy_from_slice(&best.s);
        } else {
            dz.copy_from_slice(z);
            ds.copy_from_slice(s);
        }
        scaled.leave(dz, ds);
        write(dz, ds);
    }

    /// The least merit met so far, the polished guess included.
    pub fn estimate(&self) -> f64 {
        self.merit.min(self.best.merit)
    }
}
