//! The primal–dual interior-point iteration that the methods of this house share: path following for
//!
//! ```text
//! K* ∋ W r + q + mu s e_N  ⟂  r ∈ K,     s = ‖u_T‖ (Coulomb's law)  or  s given (the convex problem).
//! ```
//!
//! In the scaled coordinates `x = X r`, `z = Z ũ`, `X = (w_c/υ) diag(mu, 1, 1)`, `Z = diag(1/mu, 1, 1)/υ`, `υ = ‖q‖/√nc`, both cones are
//! `L = {x_N ≥ ‖x_T‖}` and `xᵀz` is the power `rᵀũ` in units of `υ²/w_c`. The unknowns are x and z inside L with
//!
//! ```text
//! ρ = z − s e_N − Z (W r + q) = 0,     x ∘ z = τ e,  τ → 0,
//! ```
//!
//! where with Coulomb's law `s = ‖z_T‖` is a function of z. With the Nesterov–Todd scaling `S x = S⁻¹ z = λ` a Newton step satisfies
//!
//! ```text
//! S dx + S⁻¹ dz = d,   dz = G (Z W dr − ρ),   G = I + e nᵀ,  n = ∂s/∂z_T   (G = I where s is given)
//! (S² X + G Z W) dr = S d + G ρ
//! ```
//!
//! (`I − e nᵀ` has the inverse G because n has no normal component.) The second line is solved by
//! [`Linearised`], its rows turned to the eigenvectors of S and divided by `1 + s_i²`: eigenvalues of S² run
//! from τ to 1/τ, and in this form none of them swamps W. Mehrotra's predictor gives `d = −λ`, the corrector
//! `d = −λ + λ \ (σ τ e − (S dx) ∘ (S⁻¹ dz))`.
//!
//! A contact with mu = 0 has the half line in its normal component and `r_T = 0`.
//!
//! References: NesterovTodd1998; Mehrotra1992; TutuncuTohTodd2003 (formulas for the second-order cone). G and the exact law: the
//! derivation above.
//! Cost of an iteration: one factorisation, two solves, one product. Storage: 20 vectors and five D×D blocks a contact.
//! Fails: the exact law is not monotone; its central path can turn back, and then the steps shrink. With a given s the
//! method fails where the problem has no solution.

use nonsmooth_linalg::{Block, Singular, norm_of, small};

use super::nt::{Inner, Pair, Scaling, Shape};
use crate::contact::form::{Frictional, Linearised};
use crate::contact::law::cfun::natural_map;
use crate::contact::law::cone::tangential_norm;

/// Where s comes from.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Law {
    /// Coulomb's law, `s = ‖u_T‖`.
    Coulomb,
    /// The convex problem for a given s.
    Given,
}

/// What an iteration came to.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Iterate {
    /// The relative residual of the natural map, after the step.
    pub error: f64,
    /// `xᵀz/nc` after the step.
    pub tau: f64,
    /// `‖ρ‖/√nc` after the step.
    pub residual: f64,
    /// The part of the Newton step that was taken, in (0, 1].
    pub alpha: f64,
}

/// The iterate and the workspace, for contacts of dimension D. Allocates in [`begin`](Central::begin) only, and there only
/// where there are more contacts than before.
#[derive(Debug, Clone, Default)]
pub struct Central<const D: usize> {
    law: Option<Law>,
    /// `‖q‖`, or 1.
    scale: f64,
    /// δ of `s = √(‖z_T‖² + δ²)`, as a multiple of τ.
    smoothing: f64,
    delta: f64,
    /// X/mu and Z mu, one number each per contact: `w_c/υ` and mu; `1/υ` is shared.
    weight: Vec<f64>,
    mu: Vec<f64>,
    inverse_speed: f64,
    s: Vec<f64>,
    pub(in crate::contact) pairs: Vec<Pair<D>>,
    pub(in crate::contact) scalings: Vec<Scaling<D>>,
    pub(in crate::contact) rho: Vec<[f64; D]>,
    /// d of the Newton step.
    pub(in crate::contact) d: Vec<[f64; D]>,
    pub(in crate::contact) dx: Vec<[f64; D]>,
    pub(in crate::contact) dz: Vec<[f64; D]>,
    p: Vec<Block<D>>,
    q: Vec<Block<D>>,
    b: Vec<f64>,
    dr: Vec<f64>,
    wdr: Vec<f64>,
    r: Vec<f64>,
    u: Vec<f64>,
    best: Vec<f64>,
    best_error: f64,
    now: Option<Iterate>,
}

impl<const D: usize> Central<D> {
    /// Begins with Coulomb's law. `smoothing` κ ≥ 0 makes `s = √(‖z_T‖² + (κτ)²)`.
    ///
    /// `start`: impulses to begin near, kept `margin` inside the cones; else `x = z = e`.
    pub fn begin<P: Linearised<D> + Frictional<D>>(
        &mut self,
        problem: &P,
        state: &mut P::State,
        smoothing: f64,
        start: Option<(&[f64], f64)>,
    ) -> Iterate {
        self.law = Some(Law::Coulomb);
        self.smoothing = smoothing;
        self.s.clear();
        self.s.resize(problem.mu().len(), 0.0);
        self.enter(problem, state, start)
    }

    /// Begins with the convex problem for the given `s` (a velocity for each contact); `start` as above.
    pub fn begin_convex<P: Linearised<D> + Frictional<D>>(
        &mut self,
        problem: &P,
        state: &mut P::State,
        s: &[f64],
        start: Option<(&[f64], f64)>,
    ) -> Iterate {
        self.law = Some(Law::Given);
        self.smoothing = 0.0;
        self.s.clear();
        self.s.extend_from_slice(s);
        self.enter(problem, state, start)
    }

    fn enter<P: Linearised<D> + Frictional<D>>(
        &mut self,
        problem: &P,
        state: &mut P::State,
        start: Option<(&[f64], f64)>,
    ) -> Iterate {
        let n = problem.mu().len();
        self.scale = problem.velocity_scale(state);
        self.inverse_speed = (n as f64).sqrt() / self.scale;
        self.mu.clear();
        self.mu.extend_from_slice(problem.mu());
        self.weight.clear();
        let unit = |c| small::mean_diagonal(&problem.diagonal_block(state, c));
        self.weight.extend((0..n).map(unit));
        let mean = self.weight.iter().sum::<f64>() / n as f64;
        let mean = if mean > 0.0 && mean.is_finite() { mean } else { 1.0 };
        for w in &mut self.weight {
            *w = self.inverse_speed * if *w > 0.0 { *w } else { mean };
        }
        let zero = [0.0; D];
        for list in [&mut self.rho, &mut self.d, &mut self.dx, &mut self.dz] {
            list.clear();
            list.resize(n, zero);
        }
        for list in [&mut self.p, &mut self.q] {
            list.clear();
            list.resize(n, [zero; D]);
        }
        for list in
            [&mut self.b, &mut self.dr, &mut self.wdr, &mut self.r, &mut self.u, &mut self.best]
        {
            list.clear();
            list.resize(D * n, 0.0);
        }
        let shape = |mu: f64| if mu > 0.0 { Shape::SecondOrder } else { Shape::Line };
        self.pairs.clear();
        self.pairs.extend(self.mu.iter().map(|&mu| Pair {
            shape: shape(mu),
            x: Inner::unit(1.0),
            z: Inner::unit(1.0),
        }));
        if let Some((r, margin)) = start {
            self.r.copy_from_slice(r);
            problem.velocities(state, &self.r, &mut self.u);
            for c in 0..n {
                let x = self.scaled_impulse(c, &small::block(r, c));
                let mut z = self.scaled_velocity(c, &small::block(&self.u, c));
                z[0] += self.slide(c, tangential_norm(&z)).0;
                self.pairs[c].x = Inner::shifted(&x, margin);
                self.pairs[c].z = Inner::shifted(&z, margin);
                if self.mu[c] == 0.0 {
                    self.pairs[c].x = Inner::unit(x[0].max(margin));
                    self.pairs[c].z = Inner::unit(z[0].max(margin));
                }
            }
        }
        self.scalings.clear();
        self.scalings.extend(self.pairs.iter().map(Scaling::new));
        self.best_error = f64::INFINITY;
        self.look(problem, state, 0.0)
    }

    /// The impulses of the present iterate.
    pub fn r(&self) -> &[f64] {
        &self.r
    }

    /// The velocities `W r + q` of the present iterate.
    pub fn u(&self) -> &[f64] {
        &self.u
    }

    /// The impulses of the iterate with the smallest error since the beginning, and that error.
    pub fn best(&self) -> (&[f64], f64) {
        (&self.best, self.best_error)
    }

    /// Makes r and u those of the best iterate. To go on, begin again.
    pub fn restore<P: Linearised<D> + Frictional<D>>(&mut self, problem: &P, state: &mut P::State) {
        self.r.copy_from_slice(&self.best);
        problem.velocities(state, &self.r, &mut self.u);
    }

    /// The present iterate's numbers.
    pub fn now(&self) -> Option<&Iterate> {
        self.now.as_ref()
    }

    /// One predictor–corrector iteration. `Err`: the matrix is numerically singular; the iterate has not moved.
    pub fn iterate<P: Linearised<D> + Frictional<D>>(
        &mut self,
        problem: &P,
        state: &mut P::State,
    ) -> Result<Iterate, Singular> {
        let n = self.pairs.len();
        let before =
            self.now.unwrap_or(Iterate { error: 1.0, tau: 1.0, residual: 1.0, alpha: 0.0 });
        self.factorise(problem, state)?;
        for c in 0..n {
            self.d[c] = self.scalings[c].lambda.map(|l| -l);
        }
        self.newton(problem, state, 1.0);
        let affine = self.reach().min(1.0);
        let tau = self.tau_after(affine);
        let ratio = (tau / before.tau).clamp(0.0, 1.0);
        let mut sigma = ratio * ratio * ratio;
        // Complementarity must not run ahead of the equations, and a step that the boundary cut short is followed by
        // one that leads away from it.
        let behind = before.residual > 10.0 * before.tau.max(0.1 * before.error);
        let cut = self.now.is_some() && before.alpha > 0.0 && before.alpha < CUT;
        if behind || cut {
            sigma = sigma.max(BEHIND);
        }
        self.aim(sigma * before.tau, !(behind || cut));
        self.newton(problem, state, 1.0);
        let mut reach = self.reach();
        if reach < CUT && !cut {
            // The second-order term can point out of the cone: once more with the same factor, without it.
            self.aim(sigma.max(BEHIND) * before.tau, false);
            self.newton(problem, state, 1.0);
            reach = self.reach();
        }
        // Nearer to the boundary as the path ends, so that the tail is fast.
        let fraction = 1.0 - (0.1 * before.tau).clamp(1e-3, 1e-2);
        let alpha = (fraction * reach).min(1.0);
        self.advance(alpha);
        Ok(self.look(problem, state, alpha))
    }

    /// d towards `x ∘ z = τ e`, with Mehrotra's term from the present dx and dz or without.
    fn aim(&mut self, tau: f64, second_order: bool) {
        for c in 0..self.pairs.len() {
            let scaling = &self.scalings[c];
            let mut g = [0.0; D];
            g[0] = tau;
            if second_order {
                let (dx, dz) = self.scaled_step(c);
                let second = scaling.product(&dx, &dz);
                (0..D).for_each(|k| g[k] -= second[k]);
            }
            let correction = scaling.divide(&g);
            for k in 0..D {
                self.d[c][k] = correction[k] - scaling.lambda[k];
            }
        }
    }

    /// Factorises the matrix of the Newton step at the present iterate.
    pub(in crate::contact) fn factorise<P: Linearised<D> + Frictional<D>>(
        &mut self,
        problem: &P,
        state: &mut P::State,
    ) -> Result<(), Singular> {
        for c in 0..self.pairs.len() {
            let scaling = Scaling::new(&self.pairs[c]);
            self.scalings[c] = scaling;
            let (x, z) = (self.impulse_scale(c), self.velocity_scale(c));
            let n = self.slide_direction(c);
            let (mut p, mut q) = ([[0.0; D]; D], [[0.0; D]; D]);
            let rows = if scaling.shape == Shape::Line { 1 } else { D };
            for i in 0..rows {
                let v = &scaling.vectors[i];
                let square = scaling.values[i] * scaling.values[i];
                let (a, b) = (1.0 / (1.0 + square), square / (1.0 + square));
                for k in 0..D {
                    p[i][k] = a * (v[k] + v[0] * n[k]) * z[k]; //  vᵀ G Z
                    q[i][k] = b * v[k] * x[k];
                }
            }
            for i in rows..D {
                q[i][i] = x[i]; //                                  r_T = 0
            }
            (self.p[c], self.q[c]) = (p, q);
        }
        problem.linearise(state, &self.p, &self.q)
    }

    /// `dx` and `dz` for the present d, with ρ weighted.
    pub(in crate::contact) fn newton<P: Linearised<D> + Frictional<D>>(
        &mut self,
        problem: &P,
        state: &mut P::State,
        weight: f64,
    ) {
        for c in 0..self.pairs.len() {
            let scaling = &self.scalings[c];
            let n = self.slide_direction(c);
            let mut rho = self.rho[c].map(|v| weight * v);
            rho[0] += (1..D).map(|k| n[k] * rho[k]).sum::<f64>(); // G ρ
            let (d, rho) = (scaling.coordinates(&self.d[c]), scaling.coordinates(&rho));
            for i in 0..D {
                let value = scaling.values[i];
                self.b[D * c + i] = (value * d[i] + rho[i]) / (1.0 + value * value);
            }
            if scaling.shape == Shape::Line {
                (1..D).for_each(|i| self.b[D * c + i] = 0.0);
            }
        }
        problem.solve_linearised(state, &self.b, &mut self.dr, &mut self.wdr);
        for c in 0..self.pairs.len() {
            let dx = self.scaled_impulse(c, &small::block(&self.dr, c));
            let mut dz = self.scaled_velocity(c, &small::block(&self.wdr, c));
            (0..D).for_each(|k| dz[k] -= weight * self.rho[c][k]);
            let n = self.slide_direction(c);
            dz[0] += (1..D).map(|k| n[k] * dz[k]).sum::<f64>(); //      G (Z W dr − ρ)
            let scaling = &self.scalings[c];
            let d = scaling.coordinates(&self.d[c]);
            let (mut x, mut z) = (scaling.coordinates(&dx), scaling.coordinates(&dz));
            for i in 0..D {
                // Complementarity gives the one that is small from the other; the other way round it would magnify what
                // the solve left.
                let s = scaling.values[i];
                if s > 1.0 {
                    x[i] = (d[i] - z[i] / s) / s;
                } else {
                    z[i] = s * (d[i] - s * x[i]);
                }
            }
            (self.dx[c], self.dz[c]) = (scaling.back(&x), scaling.back(&z));
        }
    }

    /// `S dx` and `S⁻¹ dz`.
    fn scaled_step(&self, c: usize) -> ([f64; D], [f64; D]) {
        let scaling = &self.scalings[c];
        let x = scaling.apply(&self.dx[c]);
        let mut z = self.d[c];
        (0..D).for_each(|k| z[k] -= x[k]);
        (x, z)
    }

    pub(in crate::contact) fn reach(&self) -> f64 {
        let steps = self.dx.iter().zip(&self.dz);
        let reaches = self.pairs.iter().zip(steps).map(|(pair, (dx, dz))| pair.reach(dx, dz));
        reaches.fold(f64::INFINITY, f64::min)
    }

    fn tau_after(&self, alpha: f64) -> f64 {
        let steps = self.dx.iter().zip(&self.dz);
        let dots = self.pairs.iter().zip(steps).map(|(p, (dx, dz))| p.dot_after(dx, dz, alpha));
        dots.sum::<f64>() / self.pairs.len() as f64
    }

    pub(in crate::contact) fn advance(&mut self, alpha: f64) {
        for ((pair, dx), dz) in self.pairs.iter_mut().zip(&self.dx).zip(&self.dz) {
            pair.advance(dx, dz, alpha);
        }
    }

    /// Everything that follows from x and z.
    pub(in crate::contact) fn look<P: Linearised<D> + Frictional<D>>(
        &mut self,
        problem: &P,
        state: &mut P::State,
        alpha: f64,
    ) -> Iterate {
        let n = self.pairs.len();
        for c in 0..n {
            let (x, scale) = (self.pairs[c].x.vector(), self.impulse_scale(c));
            for k in 0..D {
                self.r[D * c + k] = x[k] / scale[k];
            }
            if self.mu[c] == 0.0 {
                (1..D).for_each(|k| self.r[D * c + k] = 0.0);
            }
        }
        problem.velocities(state, &self.r, &mut self.u);
        let tau = self.pairs.iter().map(Pair::dot).sum::<f64>() / n as f64;
        self.delta = self.smoothing * tau;
        let mut errors = 0.0;
        for c in 0..n {
            let u: [f64; D] = small::block(&self.u, c);
            let (free, z) = (self.scaled_velocity(c, &u), self.pairs[c].z.vector());
            let slide = self.slide(c, self.pairs[c].z.tangential()).0;
            let mut rho = [0.0; D];
            rho[0] = z[0] - slide - free[0];
            if self.mu[c] > 0.0 {
                (1..D).for_each(|k| rho[k] = z[k] - free[k]);
            } else {
                rho[0] = z[0] - free[0];
            }
            self.rho[c] = rho;
            let mut modified = u;
            modified[0] += self.mu[c]
                * match self.law {
                    Some(Law::Given) => self.s[c],
                    _ => tangential_norm(&u),
                };
            let w = self.weight[c] / self.inverse_speed;
            let x = small::block::<D>(&self.r, c).map(|r| w * r);
            errors += natural_map(&x, &modified, self.mu[c]).iter().map(|v| v * v).sum::<f64>();
        }
        let residual = norm_of(self.rho.iter().flatten().copied()) / (n as f64).sqrt();
        let error = errors.sqrt() / self.scale;
        if error < self.best_error {
            self.best_error = error;
            self.best.copy_from_slice(&self.r);
        }
        let now = Iterate { error, tau, residual, alpha };
        self.now = Some(now);
        now
    }

    /// The diagonal of X; 1 in the tangential components of a contact without friction.
    fn impulse_scale(&self, c: usize) -> [f64; D] {
        let mut x = [self.weight[c]; D];
        if self.mu[c] > 0.0 {
            x[0] *= self.mu[c];
        }
        x
    }

    /// The diagonal of Z.
    fn velocity_scale(&self, c: usize) -> [f64; D] {
        let mut z = [self.inverse_speed; D];
        if self.mu[c] > 0.0 {
            z[0] /= self.mu[c];
        }
        z
    }

    fn scaled_impulse(&self, c: usize, r: &[f64; D]) -> [f64; D] {
        let mut x = self.impulse_scale(c);
        (0..D).for_each(|k| x[k] *= r[k]);
        x
    }

    fn scaled_velocity(&self, c: usize, u: &[f64; D]) -> [f64; D] {
        let mut z = self.velocity_scale(c);
        (0..D).for_each(|k| z[k] *= u[k]);
        z
    }

    /// s of contact c in scaled velocity, and its derivative by ‖z_T‖.
    fn slide(&self, c: usize, size: f64) -> (f64, f64) {
        match self.law {
            _ if self.mu[c] == 0.0 => (0.0, 0.0),
            Some(Law::Given) => (self.inverse_speed * self.s[c], 0.0),
            _ if self.delta == 0.0 => (size, 1.0),
            _ => {
                let s = size.hypot(self.delta);
                (s, size / s)
            }
        }
    }

    /// `n = ∂s/∂z_T`, with a zero in front.
    fn slide_direction(&self, c: usize) -> [f64; D] {
        let z = &self.pairs[c].z;
        let slope = self.slide(c, z.tangential()).1;
        z.direction().map(|t| slope * t)
    }
}

/// σ while the equations lag behind complementarity, and where the boundary cuts steps short.
const BEHIND: f64 = 0.9;

/// Steps below this are cut short.
const CUT: f64 = 0.1;
