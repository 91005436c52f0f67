//! A step of a damped semismooth Newton method on the residuals of a complementarity function.
//!
//! ```text
//! Φ_i = ψ(x_i, F_i; l_i, u_i),   B = diag(∂ψ/∂x) + diag(∂ψ/∂F) JF,   B d = −Φ,   x ← π(x + t d)
//! ```
//!
//! The merit is `Ψ = ½‖Φ‖²` of a function that may be another than the direction's. A step of length t = 1, ½, ¼, … is taken where
//! `Ψ(x(t)) ≤ R − σ ∇Ψᵀ(x − x(t))`, R the largest of the last merits. Where B is singular, the same with `JF + λI`; where no length decreases Ψ, along the gradient.
//!
//! References: DeLucaFacchineiKanzow1996; GrippoLamparielloLucidi1986; Munson2002 (projected arc, regularisation). Cost: one LU of the pattern of JF and one evaluation
//! for each length.

use nonsmooth_linalg::{Matrix, norm};

use super::{Inner, Iterate, Moved};
use crate::complementarity::form::Model;
use crate::complementarity::functions::{self, ScalarFunction, Slope};
use crate::complementarity::parts::factor::Factor;

/// A function of a variable with its bounds and its F that is zero where the three obey the law.
pub trait Residual: Copy + Send + Sync {
    /// Its value and slopes.
    fn at(&self, x: f64, f: f64, bounds: (f64, f64)) -> Slope;
}

impl<F: ScalarFunction> Residual for F {
    #[inline]
    fn at(&self, x: f64, f: f64, (l, u): (f64, f64)) -> Slope {
        functions::boxed(self, x, f, l, u)
    }
}

/// More merits than this are no memory but the whole history.
pub const MEMORY_MOST: usize = 10_000;

/// How a step is chosen.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Options {
    /// Of how many merits the largest is the reference; 1: monotone.
    pub memory: usize,
    /// The reference at the beginning, in units of the first merit.
    pub slack: f64,
    /// The shortest length.
    pub least: f64,
    /// Whether steps along the gradient are taken.
    pub gradient: bool,
}

impl Default for Options {
    fn default() -> Self {
        Self { memory: 10, slack: 1.0, least: 1e-10, gradient: true }
    }
}

const SIGMA: f64 = 1e-4;
/// A linear system is solved if its residual is below this part of the right-hand side.
const SOLVED: f64 = 1e-6;
/// Lengths along the gradient.
const LENGTHS: usize = 60;

/// The memory of a method that makes such steps with the function D, on the merit of F.
pub struct Descent<D, F> {
    direction: D,
    merit: F,
    options: Options,
    matrix: Matrix,
    factor: Factor,
    phi: Vec<f64>,
    of_x: Vec<f64>,
    of_f: Vec<f64>,
    gradient: Vec<f64>,
    weights: Vec<f64>,
    d: Vec<f64>,
    right: Vec<f64>,
    trial: Vec<f64>,
    trial_f: Vec<f64>,
    /// The last merits.
    last: Vec<f64>,
    /// Ψ and R at the point that was looked at.
    merit_here: f64,
    reference: f64,
}

/// Φ of the function at a point, with its slopes where these are asked for; ½‖Φ‖².
fn residuals<F: Residual>(
    f: &F,
    model: &Model,
    x: &[f64],
    value: &[f64],
    mut row: impl FnMut(usize, Slope),
) -> f64 {
    let mut sum = 0.0;
    for i in 0..x.len() {
        let at = f.at(x[i], value[i], model.bounds(i));
        sum += 0.5 * at.value * at.value;
        row(i, at);
    }
    sum
}

impl<D: Residual, F: Residual> Inner for Descent<D, F> {
    fn step(&mut self, model: &mut Model, at: &mut Iterate) -> Moved {
        let Some(merit) = self.look(model, at) else { return Moved::Undefined };
        let lambda = (0.1 * merit).clamp(1e-8, 1.0);
        for (k, lambda) in [0.0, lambda, (10.0 * lambda).min(1.0)].into_iter().enumerate() {
            if !self.solve(model, at, lambda) {
                continue;
            }
            if self.search(model, at) {
                return if k == 0 { Moved::Newton } else { Moved::Regularised };
            }
        }
        if self.options.gradient && self.downhill(model, at) {
            return Moved::Gradient;
        }
        Moved::Stuck
    }

    fn forget(&mut self) {
        self.last.clear();
        self.factor.trust();
    }
}

impl<D: Residual, F: Residual> Descent<D, F> {
    /// For problems of this model.
    pub fn new(direction: D, merit: F, options: Options, model: &Model) -> Self {
        let n = model.dim();
        let matrix: Matrix = model.matrix().clone().into();
        let zeros = || vec![0.0; n];
        Self {
            direction,
            merit,
            options,
            factor: Factor::new(&matrix),
            matrix,
            phi: zeros(),
            of_x: zeros(),
            of_f: zeros(),
            gradient: zeros(),
            weights: zeros(),
            d: zeros(),
            right: zeros(),
            trial: zeros(),
            trial_f: zeros(),
            last: vec![],
            merit_here: 0.0,
            reference: 0.0,
        }
    }

    /// Begins anew, with other functions and options.
    pub fn restart(&mut self, direction: D, merit: F, options: Options) {
        (self.direction, self.merit, self.options) = (direction, merit, options);
        self.forget();
    }

    /// Linearises F where the iterate is; Ψ there, which is remembered. None where it is not defined.
    pub fn look(&mut self, model: &mut Model, at: &mut Iterate) -> Option<f64> {
        if !model.linearise(&at.x, &mut at.f) {
            return None;
        }
        let merit = self.differentiate(model, at);
        if !merit.is_finite() {
            return None;
        }
        self.merit_here = merit;
        self.reference = self.remember(merit);
        Some(merit)
    }

    /// Goes from the point [looked](Self::look) at towards another one, by the first length that decreases Ψ enough. Whether there was one.
    pub fn towards(&mut self, model: &mut Model, at: &mut Iterate, end: &[f64]) -> bool {
        self.d.iter_mut().zip(end).zip(&at.x).for_each(|((d, e), x)| *d = e - x);
        self.search(model, at)
    }

    /// Slopes of the merit, its gradient; Ψ.
    fn differentiate(&mut self, model: &Model, at: &Iterate) -> f64 {
        let Self { phi, of_x, of_f, gradient, weights, merit, .. } = self;
        let value = residuals(merit, model, &at.x, &at.f, |i, slope| {
            (phi[i], of_x[i], of_f[i]) = (slope.value, slope.z, slope.w);
        });
        gradient.iter_mut().zip(&*of_x).zip(&*phi).for_each(|((g, s), p)| *g = s * p);
        weights.iter_mut().zip(&*of_f).zip(&*phi).for_each(|((w, s), p)| *w = s * p);
        model.matrix().mul_transpose_add(1.0, weights, gradient);
        value
    }

    /// The reference R, with this merit among those remembered.
    fn remember(&mut self, merit: f64) -> f64 {
        let Options { memory, slack, .. } = self.options;
        let most = |last: &[f64]| last.iter().fold(merit, |m, v| m.max(*v));
        if self.last.is_empty() {
            self.last.resize(memory, slack * merit);
            return most(&self.last);
        }
        // The largest goes.
        let largest = (0..self.last.len()).max_by(|&a, &b| self.last[a].total_cmp(&self.last[b]));
        if let Some(k) = largest {
            self.last[k] = merit;
        }
        most(&self.last)
    }

    /// d of the direction's function with `JF + λI`. False where the matrix is singular, or d does not descend.
    fn solve(&mut self, model: &Model, at: &Iterate, lambda: f64) -> bool {
        let n = at.x.len();
        let Self { direction, right, of_x, of_f, matrix, .. } = self;
        residuals(direction, model, &at.x, &at.f, |i, slope| {
            (right[i], of_x[i], of_f[i]) = (-slope.value, slope.z, slope.w);
        });
        let Matrix::Sparse(to) = matrix else { unreachable!("made sparse") };
        let from = model.matrix();
        for j in 0..n {
            let range = from.col_ptr()[j]..from.col_ptr()[j + 1];
            let rows = &from.row_idx()[range.clone()];
            let values = &mut to.values_mut()[range.clone()];
            for ((to, &i), &x) in values.iter_mut().zip(rows).zip(&from.values()[range]) {
                *to = of_f[i] * x;
            }
        }
        for (i, &k) in model.diagonal().iter().enumerate() {
            to.values_mut()[k] += of_x[i] + lambda * of_f[i];
        }
        let size = norm(right);
        if size == 0.0 {
            return false;
        }
        loop {
            if self.factor.factorise(&self.matrix) {
                let Self { matrix, factor, d, right, weights, .. } = self;
                d.copy_from_slice(right);
                factor.solve(d);
                for _ in 0..2 {
                    matrix.mul(d, weights);
                    weights.iter_mut().zip(&*right).for_each(|(w, r)| *w = r - *w);
                    let rest = norm(weights);
                    if rest <= 1e-12 * size || !rest.is_finite() {
                        break;
                    }
                    factor.solve(weights);
                    d.iter_mut().zip(&*weights).for_each(|(d, w)| *d += w);
                }
                matrix.mul(d, weights);
                weights.iter_mut().zip(&*right).for_each(|(w, r)| *w -= r);
                if norm(weights) <= SOLVED * size {
                    break;
                }
            }
            if !self.factor.distrust() {
                return false;
            }
        }
        let d = &self.d;
        let slope: f64 = self.gradient.iter().zip(d).map(|(g, d)| g * d).sum();
        let length = norm(d);
        d.iter().all(|d| d.is_finite()) && slope <= -1e-8 * length.powf(2.1).min(length)
    }

    /// Goes along the projected direction; whether Ψ decreased enough.
    fn search(&mut self, model: &mut Model, at: &mut Iterate) -> bool {
        let mut t = 1.0;
        while t >= self.options.least {
            for i in 0..at.x.len() {
                self.trial[i] = model.project(i, at.x[i] + t * self.d[i]);
            }
            if self.accepts(model, at) {
                return true;
            }
            t *= 0.5;
        }
        false
    }

    /// Whether Ψ at the trial point is small enough; then that is where the iterate is.
    fn accepts(&mut self, model: &mut Model, at: &mut Iterate) -> bool {
        if !model.value(&self.trial, &mut self.trial_f) {
            return false;
        }
        let merit = residuals(&self.merit, model, &self.trial, &self.trial_f, |_, _| {});
        let moves = at.x.iter().zip(&self.trial);
        let slope: f64 = self.gradient.iter().zip(moves).map(|(g, (x, y))| g * (x - y)).sum();
        let enough = merit <= self.reference - SIGMA * slope.max(0.0);
        if !enough || self.trial == at.x {
            return false;
        }
        std::mem::swap(&mut at.x, &mut self.trial);
        std::mem::swap(&mut at.f, &mut self.trial_f);
        at.measure(model);
        true
    }

    /// Goes from the point [looked](Self::look) at along the projected gradient, first as far as is best for the linearisation. Whether Ψ decreased enough.
    pub fn downhill(&mut self, model: &mut Model, at: &mut Iterate) -> bool {
        // The slopes were those of the direction.
        self.differentiate(model, at);
        let Self { weights, of_x, of_f, gradient, .. } = self;
        weights.fill(0.0);
        model.matrix().mul_add(1.0, gradient, weights);
        let along = |((w, s), (f, g)): ((&f64, &f64), (&f64, &f64))| (f * w + s * g).powi(2);
        let pairs = weights.iter().zip(&*of_x).zip(of_f.iter().zip(&*gradient));
        let curvature: f64 = pairs.map(along).sum();
        let square = norm(gradient).powi(2);
        let stationary = square <= 1e-30 * self.merit_here.max(f64::MIN_POSITIVE);
        if stationary || square.is_nan() {
            return false;
        }
        let mut t = if curvature > 0.0 { square / curvature } else { 1.0 };
        for _ in 0..LENGTHS {
            for i in 0..at.x.len() {
                self.trial[i] = model.project(i, at.x[i] - t * self.gradient[i]);
            }
            if self.accepts(model, at) {
                return true;
            }
            t *= 0.5;
        }
        false
    }
}
