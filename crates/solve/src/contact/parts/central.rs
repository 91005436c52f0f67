//! The primal–dual interior-point iteration that the methods of this house share: path following for
//!
//! ```text
//! K* ∋ W r + q + mu s e_N  ⟂  r ∈ K,     s = ‖u_T‖ (Coulomb's law)  or  s given (the convex problem).
//! ```
//!
//! In the scaled coordinates `x = X r`, `z = Z ũ`, `X = f_c (w_c/υ) diag(mu, 1, 1)`, `Z = f_c diag(1/mu, 1, 1)/υ`, `υ = ‖q‖/√nc`, both cones are
//! `L = {x_N ≥ ‖x_T‖}` and `xᵀz` is the power `rᵀũ` in units of `υ²/(f_c² w_c)`. f_c is a power of two near `√(w̄/w_c)`, w̄ the geometric mean of the w_c: the central path
//! gives all contacts about the same power, in units of `υ²/w̄`. (With `f_c = 1` it gives a contact of a part 10⁶ times as heavy 10⁶ times as much as one of a light part, and ends far from the solution.)
//! The unknowns are x and z inside L with
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
//! `d = −λ + λ \ (σ τ e − (S dx) ∘ (S⁻¹ dz))`. On the convex relaxation, and wherever some w_c is far from w̄, ρ is weighted by `1 − σ`, σ = (1 − α)³ with α the predictor's length: equations and complementarity then shrink alike, and a step
//! that would be cut short centres only; one that is cut short all the same is computed anew without Mehrotra's term. (With the whole of ρ two of 77 problems with large mass ratios fewer are solved.)
//!
//! The exact law is not monotone, and its steps may shrink to nothing where those of the convex problem (n = 0 in G) do not: where asked for, a step that the boundary cuts short
//! is computed anew with `G = I + γ e nᵀ`, γ < 1, which damps what is not monotone; s itself stays exact, so that the iterates converge to the law, linearly as long as γ < 1.
//!
//! Where equations and complementarity shrink alike x and z begin at the solution of `x + z = 0, ρ = 0`, that is of `min ½ rᵀW r + qᵀr + ½‖x‖²` in these units, each moved along e until it is inside L: with
//! it the equations never lag far behind complementarity. (From `x = z = e` they lag sixtyfold where masses differ by 10⁶, and steps of a hundredth centre without getting nearer.)
//!
//! A contact with mu = 0 has the half line in its normal component and `r_T = 0`.
//!
//! With rolling friction a contact has two cones that share r_N: `x_k = A_k x̂`, `A_k = diag(mu_k in N, 1 in disk k)`, `x̂ = f_c w_c r/υ`, and the normal velocity is split
//! between them, `ẑ = Σ A_k z_k`. Complementarity eliminates the split: `f_c (T w_c/υ + G W/υ) dr = Σ A_k S_k d_k + G ρ` with `T = Σ A_k S_k² A_k`,
//! whose eigenvectors take the place of those of S.
//!
//! References: NesterovTodd1998; Mehrotra1992; TutuncuTohTodd2003 (formulas for the second-order cone); the start: Vandenberghe2010, section 7.3. G and the exact law: the
//! derivation above.
//! Cost of an iteration: one factorisation, two solves, one product; up to three factorisations and six solves more where steps are cut short. Storage: 20 vectors and five D×D blocks a contact.
//! Fails: the exact law is not monotone; its central path can turn back, and then the steps shrink. With a given s the
//! method fails where the problem has no solution.

use nonsmooth_linalg::{Block, Singular, norm, norm_of, small};

use super::nt::{Inner, Pair, Scaling, Shape};
use crate::contact::form::{Disked, Linearised};
use crate::contact::law::{DiskLaw, cone};

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
#[derive(Debug, Clone)]
pub struct Central<L, const D: usize> {
    law: Option<Law>,
    /// `‖q‖`, or 1.
    scale: f64,
    /// δ of `s = √(‖z_T‖² + δ²)`, as a multiple of τ.
    smoothing: f64,
    /// What δ is that multiple of in place of τ, where a path is followed.
    pub(in crate::contact) theta: Option<f64>,
    delta: f64,
    /// Of each contact X in the disk, `f_c w_c/υ`, and Z there, `f_c/υ`.
    weight: Vec<f64>,
    speed: Vec<f64>,
    laws: Vec<L>,
    s: Vec<f64>,
    /// Of each disk of each contact, in the rows N and those of the disk; and all that is a pair's.
    pub(in crate::contact) pairs: Vec<Pair<D>>,
    pub(in crate::contact) scalings: Vec<Scaling<D>>,
    /// Of each contact, as p, q and what follows.
    pub(in crate::contact) rho: Vec<[f64; D]>,
    /// Eigenvalues and eigenvectors, by rows, of T, of contacts with two cones.
    turned: Vec<([f64; D], Block<D>)>,
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
    /// An iterate to come back to.
    kept: Vec<Pair<D>>,
    /// Equations and complementarity shrink alike.
    alike: bool,
    /// The largest |log₂(w_c/w̄)|.
    spread: f64,
    /// The part of ∂s/∂z that the step knows, in (0, 1], and the least.
    share: f64,
    least_share: f64,
}

impl<L, const D: usize> Default for Central<L, D> {
    fn default() -> Self {
        Self {
            law: None,
            scale: 1.0,
            smoothing: 0.0,
            theta: None,
            delta: 0.0,
            weight: vec![],
            speed: vec![],
            laws: vec![],
            s: vec![],
            pairs: vec![],
            scalings: vec![],
            rho: vec![],
            turned: vec![],
            d: vec![],
            dx: vec![],
            dz: vec![],
            p: vec![],
            q: vec![],
            b: vec![],
            dr: vec![],
            wdr: vec![],
            r: vec![],
            u: vec![],
            best: vec![],
            best_error: f64::INFINITY,
            now: None,
            kept: vec![],
            alike: false,
            spread: 0.0,
            share: 1.0,
            least_share: 1.0,
        }
    }
}

impl<L: DiskLaw<D>, const D: usize> Central<L, D> {
    /// Steps that the boundary cuts short know a part of the slope of s only, at least this, in (0, 1]; 1, the default: always all of it.
    pub fn know_at_least(mut self, share: f64) -> Self {
        self.least_share = share;
        self
    }

    /// Begins with Coulomb's law. `smoothing` κ ≥ 0 makes `s = √(‖z_T‖² + (κτ)²)`.
    ///
    /// `start`: impulses to begin near, kept `margin` inside the cones; else `x = z = e`, or near where the equations hold if the w_c are far from even.
    pub fn begin<P: Linearised<D> + Disked<D, Law = L>>(
        &mut self,
        problem: &P,
        state: &mut P::State,
        smoothing: f64,
        start: Option<(&[f64], f64)>,
    ) -> Iterate {
        let now = self.begin_centred(problem, state, smoothing, start);
        self.near_equations_if_uneven(problem, state, now, start.is_none())
    }

    /// As [`begin`](Self::begin), but at `x = z = e` whatever the w_c: a path is followed from a point on it.
    pub fn begin_centred<P: Linearised<D> + Disked<D, Law = L>>(
        &mut self,
        problem: &P,
        state: &mut P::State,
        smoothing: f64,
        start: Option<(&[f64], f64)>,
    ) -> Iterate {
        self.law = Some(Law::Coulomb);
        (self.share, self.alike) = (1.0, false);
        self.theta = None;
        self.smoothing = smoothing;
        self.s.clear();
        self.s.resize(L::DISKS * problem.contacts(), 0.0);
        self.enter(problem, state, start)
    }

    /// Begins with the convex problem for the given `s` (a velocity for each disk of each contact); `start` as above.
    pub fn begin_convex<P: Linearised<D> + Disked<D, Law = L>>(
        &mut self,
        problem: &P,
        state: &mut P::State,
        s: &[f64],
        start: Option<(&[f64], f64)>,
    ) -> Iterate {
        self.s.clear();
        self.s.extend_from_slice(s);
        let now = self.enter_given(problem, state, start);
        self.near_equations_if_uneven(problem, state, now, start.is_none())
    }

    /// Begins with the convex relaxation, s = 0, at the point nearest to where the equations hold: one factorisation.
    pub fn begin_relaxed<P: Linearised<D> + Disked<D, Law = L>>(
        &mut self,
        problem: &P,
        state: &mut P::State,
    ) -> Iterate {
        self.s.clear();
        self.s.resize(L::DISKS * problem.contacts(), 0.0);
        let now = self.enter_given(problem, state, None);
        self.near_equations(problem, state, now)
    }

    fn near_equations_if_uneven<P: Linearised<D> + Disked<D, Law = L>>(
        &mut self,
        problem: &P,
        state: &mut P::State,
        now: Iterate,
        cold: bool,
    ) -> Iterate {
        let uneven = cold && self.spread > SPREAD;
        if uneven { self.near_equations(problem, state, now) } else { now }
    }

    /// From the start `now` to the point nearest to where the equations hold; from there equations and complementarity shrink alike.
    fn near_equations<P: Linearised<D> + Disked<D, Law = L>>(
        &mut self,
        problem: &P,
        state: &mut P::State,
        now: Iterate,
    ) -> Iterate {
        self.alike = true;
        if self.enter_nearest(problem, state).is_err() {
            return now;
        }
        self.look(problem, state, 0.0)
    }

    /// Begins with the convex problem for the s that is set.
    fn enter_given<P: Linearised<D> + Disked<D, Law = L>>(
        &mut self,
        problem: &P,
        state: &mut P::State,
        start: Option<(&[f64], f64)>,
    ) -> Iterate {
        (self.law, self.smoothing, self.alike) = (Some(Law::Given), 0.0, false);
        self.enter(problem, state, start)
    }

    /// Keeps the present iterate, for [`begin_kept`](Self::begin_kept).
    pub fn keep(&mut self) {
        self.kept.clone_from(&self.pairs);
    }

    /// Whether an iterate has been kept since the beginning.
    pub fn has_kept(&self) -> bool {
        !self.kept.is_empty()
    }

    /// Begins with Coulomb's law at the iterate that was kept on the same problem; equations and complementarity go on to shrink as they did.
    pub fn begin_kept<P: Linearised<D> + Disked<D, Law = L>>(
        &mut self,
        problem: &P,
        state: &mut P::State,
    ) -> Iterate {
        (self.law, self.share) = (Some(Law::Coulomb), 1.0);
        std::mem::swap(&mut self.pairs, &mut self.kept);
        self.kept.clear();
        self.best_error = f64::INFINITY;
        self.look(problem, state, 0.0)
    }

    /// From the cones' units to the solution of `x + z = 0, ρ = 0`, moved inside the cones: one factorisation.
    fn enter_nearest<P: Linearised<D> + Disked<D, Law = L>>(
        &mut self,
        problem: &P,
        state: &mut P::State,
    ) -> Result<(), Singular> {
        self.factorise(problem, state)?;
        for (d, scaling) in self.d.iter_mut().zip(&self.scalings) {
            *d = scaling.lambda.map(|l| -2.0 * l);
        }
        self.newton(problem, state, 1.0);
        // How far x and z of a pair are outside, in its units.
        let outside = |y: &[f64; D], pair: &Pair<D>| match pair.shape {
            Shape::Line => -y[0],
            Shape::SecondOrder => norm(&y[1..]) - y[0],
        };
        let mut worst = [f64::NEG_INFINITY; 2];
        for (i, pair) in self.pairs.iter().enumerate() {
            let units = [pair.x.normal(), pair.z.normal()];
            let ends = [(&mut self.dx[i], &pair.x), (&mut self.dz[i], &pair.z)];
            for (k, (step, from)) in ends.into_iter().enumerate() {
                step[0] += from.normal();
                worst[k] = worst[k].max(outside(step, pair) / units[k]);
            }
        }
        let far = worst.map(|worst| if worst > -LEAST_MARGIN { 1.0 + worst } else { 0.0 });
        for (i, pair) in self.pairs.iter_mut().enumerate() {
            let units = [pair.x.normal(), pair.z.normal()];
            let ends = [(&mut pair.x, &mut self.dx[i]), (&mut pair.z, &mut self.dz[i])];
            for (k, (end, y)) in ends.into_iter().enumerate() {
                y[0] += far[k] * units[k];
                let least = LEAST_MARGIN * units[k];
                *end = match pair.shape {
                    Shape::Line => Inner::unit(y[0].max(least)),
                    Shape::SecondOrder => Inner::shifted(y, least),
                };
            }
        }
        Ok(())
    }

    fn enter<P: Linearised<D> + Disked<D, Law = L>>(
        &mut self,
        problem: &P,
        state: &mut P::State,
        start: Option<(&[f64], f64)>,
    ) -> Iterate {
        let n = problem.contacts();
        self.scale = problem.velocity_scale(state);
        self.laws.clear();
        self.laws.extend((0..n).map(|c| problem.law(c)));
        problem.units(state, &mut self.weight);
        self.balance((n as f64).sqrt() / self.scale);
        let zero = [0.0; D];
        self.rho.clear();
        self.rho.resize(n, zero);
        for list in [&mut self.d, &mut self.dx, &mut self.dz] {
            list.clear();
            list.resize(L::DISKS * n, zero);
        }
        self.turned.clear();
        self.turned.resize(if L::DISKS > 1 { n } else { 0 }, (zero, [zero; D]));
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
        self.kept.clear();
        self.pairs.clear();
        for i in 0..L::DISKS * n {
            let shape = if self.mu(i) > 0.0 { Shape::SecondOrder } else { Shape::Line };
            // One cone begins at x = z = e, two at the same r_N.
            let a = self.normal(i) / self.mean_normal(i / L::DISKS);
            self.pairs.push(Pair { shape, x: Inner::unit(a), z: Inner::unit(1.0 / a) });
        }
        if let Some((r, margin)) = start {
            self.r.copy_from_slice(r);
            problem.velocities(state, &self.r, &mut self.u);
            for c in 0..n {
                let (mut r, u) = (small::block(r, c), small::block(&self.u, c));
                if L::DISKS > 1 {
                    // Both cones must hold the same r_N.
                    let inside = |k: usize| norm(&r[L::rows(k)]) / self.laws[c].coefficient(k);
                    let least = (0..L::DISKS).map(inside).filter(|x| x.is_finite());
                    r[0] = least.fold(r[0], f64::max) + margin / self.weight[c];
                }
                for i in L::DISKS * c..L::DISKS * (c + 1) {
                    let margin = if L::DISKS > 1 { LEAST_MARGIN * margin } else { margin };
                    let x = self.scaled_impulse(i, &r);
                    let mut z = self.scaled_velocity(i, &u);
                    z[0] /= L::DISKS as f64;
                    z[0] += self.slide(i, cone::tangential_norm(&z)).0;
                    self.pairs[i].x = Inner::shifted(&x, margin);
                    self.pairs[i].z = Inner::shifted(&z, margin);
                    if self.mu(i) == 0.0 {
                        self.pairs[i].x = Inner::unit(x[0].max(margin));
                        self.pairs[i].z = Inner::unit(z[0].max(margin));
                    }
                }
            }
        }
        self.scalings.clear();
        self.scalings.extend(self.pairs.iter().map(Scaling::new));
        self.best_error = f64::INFINITY;
        self.look(problem, state, 0.0)
    }

    /// X and Z of the contacts, whose w_c stand in `weight`, and 1/υ.
    fn balance(&mut self, per_speed: f64) {
        let logs = self.weight.iter().map(|w| w.log2()).filter(|log| log.is_finite());
        let (sum, count) = logs.fold((0.0, 0.0), |(sum, count), log| (sum + log, count + 1.0));
        let mean = if count > 0.0 { sum / count } else { 0.0 };
        let far = |w: &f64| (w.log2() - mean).abs();
        self.spread = self.weight.iter().map(far).filter(|far| far.is_finite()).fold(0.0, f64::max);
        self.speed.clear();
        for w in &mut self.weight {
            let power = (0.5 * (mean - w.log2())).round();
            let factor = if power.is_finite() { power.clamp(-FACTOR, FACTOR).exp2() } else { 1.0 };
            self.speed.push(factor * per_speed);
            *w *= factor * per_speed;
        }
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
    pub fn restore<P: Linearised<D> + Disked<D, Law = L>>(
        &mut self,
        problem: &P,
        state: &mut P::State,
    ) {
        self.r.copy_from_slice(&self.best);
        problem.velocities(state, &self.r, &mut self.u);
    }

    /// The present iterate's numbers.
    pub fn now(&self) -> Option<&Iterate> {
        self.now.as_ref()
    }

    /// One predictor–corrector iteration. `Err`: the matrix is numerically singular; the iterate has not moved.
    pub fn iterate<P: Linearised<D> + Disked<D, Law = L>>(
        &mut self,
        problem: &P,
        state: &mut P::State,
    ) -> Result<Iterate, Singular> {
        let before =
            self.now.unwrap_or(Iterate { error: 1.0, tau: 1.0, residual: 1.0, alpha: 0.0 });
        let mut reach = self.direction(problem, state, &before)?;
        for _ in 0..RETRIES {
            if reach >= CUT || !self.know_less() {
                break;
            }
            reach = self.direction(problem, state, &before)?;
        }
        if reach >= LONG {
            self.share = (MORE * self.share).min(1.0);
        } else if reach < CUT {
            self.know_less();
        }
        // Nearer to the boundary as the path ends, so that the tail is fast.
        let fraction = 1.0 - (0.1 * before.tau).clamp(1e-3, 1e-2);
        let alpha = (fraction * reach).min(1.0);
        self.advance(alpha);
        Ok(self.look(problem, state, alpha))
    }

    /// dx and dz of the predictor and corrector at the present share; returns how far they reach.
    fn direction<P: Linearised<D> + Disked<D, Law = L>>(
        &mut self,
        problem: &P,
        state: &mut P::State,
        before: &Iterate,
    ) -> Result<f64, Singular> {
        self.factorise(problem, state)?;
        for (d, scaling) in self.d.iter_mut().zip(&self.scalings) {
            *d = scaling.lambda.map(|l| -l);
        }
        self.newton(problem, state, 1.0);
        let affine = self.reach().min(1.0);
        let tau = self.tau_after(affine);
        let ratio = (tau / before.tau).clamp(0.0, 1.0);
        let mut sigma = if self.alike { (1.0 - affine).powi(3) } else { ratio * ratio * ratio };
        // Complementarity must not run ahead of the equations, which converge linearly where only a part of the slope is known, and a step that
        // the boundary cut short is followed by one that leads away from it.
        let lead = if self.share < 1.0 { LEAD_OF_PART } else { LEAD };
        let behind = !self.alike && before.residual > lead * before.tau.max(0.1 * before.error);
        let cut = self.now.is_some() && before.alpha > 0.0 && before.alpha < CUT;
        if behind || cut {
            sigma = sigma.max(BEHIND);
        }
        self.aim(sigma * before.tau, !(behind || cut));
        self.newton(problem, state, self.share_of_rho(sigma));
        let reach = self.reach();
        if reach >= CUT || cut {
            return Ok(reach);
        }
        // The second-order term can point out of the cone: once more with the same factor, without it.
        let sigma = sigma.max(BEHIND);
        self.aim(sigma * before.tau, false);
        self.newton(problem, state, self.share_of_rho(sigma));
        Ok(self.reach())
    }

    /// The weight of ρ in a step that aims at σ times the present complementarity.
    fn share_of_rho(&self, sigma: f64) -> f64 {
        if self.alike { 1.0 - sigma } else { 1.0 }
    }

    /// A smaller share of the slope of the exact law; false where there is none to be had.
    fn know_less(&mut self) -> bool {
        let less = (LESS * self.share).max(self.least_share);
        let changes = self.law == Some(Law::Coulomb) && less < self.share;
        if changes {
            self.share = less;
        }
        changes
    }

    /// d towards `x ∘ z = τ e`, with Mehrotra's term from the present dx and dz or without.
    pub(in crate::contact) fn aim(&mut self, tau: f64, second_order: bool) {
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
    pub(in crate::contact) fn factorise<P: Linearised<D> + Disked<D, Law = L>>(
        &mut self,
        problem: &P,
        state: &mut P::State,
    ) -> Result<(), Singular> {
        for (scaling, pair) in self.scalings.iter_mut().zip(&self.pairs) {
            *scaling = Scaling::new(pair);
        }
        for c in 0..self.laws.len() {
            (self.p[c], self.q[c]) =
                if L::DISKS == 1 { self.blocks_of_one(c) } else { self.blocks_of_two(c) };
        }
        problem.linearise(state, &self.p, &self.q)
    }

    /// P and Q of a contact with one cone.
    fn blocks_of_one(&self, c: usize) -> (Block<D>, Block<D>) {
        let scaling = &self.scalings[c];
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
        (p, q)
    }

    /// P and Q of a contact with two cones, in the eigenvectors of T, which are kept.
    fn blocks_of_two(&mut self, c: usize) -> (Block<D>, Block<D>) {
        let mut t = [[0.0; D]; D];
        for k in 0..L::DISKS {
            let i = L::DISKS * c + k;
            let scaling = &self.scalings[i];
            let rows = if scaling.shape == Shape::Line { 1 } else { D };
            for (v, s) in scaling.vectors.iter().zip(scaling.values).take(rows) {
                let v = self.of_disk(i, v); //                      T = Σ A S² A
                for a in 0..D {
                    (0..D).for_each(|b| t[a][b] += s * s * v[a] * v[b]);
                }
            }
        }
        let (values, vectors) = small::eigen(&t);
        self.turned[c] = (values, vectors);
        let n = self.whole_slide_direction(c);
        let (mut p, mut q) = ([[0.0; D]; D], [[0.0; D]; D]);
        for i in 0..D {
            if self.is_still(c, i) {
                q[i][i] = self.weight[c]; //                        r_T = 0
                continue;
            }
            let (v, scale) = (&vectors[i], 1.0 / (1.0 + values[i]));
            for k in 0..D {
                p[i][k] = scale * (v[k] + v[0] * n[k]) * self.speed[c];
                q[i][k] = scale * values[i] * v[k] * self.weight[c];
            }
        }
        (p, q)
    }

    /// The sign of `det(S² X + G Z W)` of the last factorisation, times one that is the same for all of them: that of the matrix
    /// solved, whose rows are turned, by eigenvectors that need not be right-handed.
    pub(in crate::contact) fn orientation<P: Linearised<D> + Disked<D, Law = L>>(
        &self,
        problem: &P,
        state: &mut P::State,
    ) -> f64 {
        let handed = |c: usize| {
            let mut rows = if L::DISKS == 1 { self.scalings[c].vectors } else { self.turned[c].1 };
            for k in 1..D {
                if self.is_still(c, k) {
                    rows[k] = std::array::from_fn(|l| f64::from(u8::from(k == l)));
                }
            }
            small::determinant(&rows).signum()
        };
        problem.orientation(state) * (0..self.laws.len()).map(handed).product::<f64>()
    }

    /// `dx` and `dz` for the present d, with ρ weighted.
    pub(in crate::contact) fn newton<P: Linearised<D> + Disked<D, Law = L>>(
        &mut self,
        problem: &P,
        state: &mut P::State,
        weight: f64,
    ) {
        for c in 0..self.laws.len() {
            let b = if L::DISKS == 1 {
                self.side_of_one(c, weight)
            } else {
                self.side_of_two(c, weight)
            };
            self.b[D * c..D * c + D].copy_from_slice(&b);
        }
        problem.solve_linearised(state, &self.b, &mut self.dr, &mut self.wdr);
        for c in 0..self.laws.len() {
            if L::DISKS == 1 {
                self.step_of_one(c, weight);
            } else {
                self.step_of_two(c, weight);
            }
        }
    }

    /// The right-hand side of a contact with one cone.
    fn side_of_one(&self, c: usize, weight: f64) -> [f64; D] {
        let scaling = &self.scalings[c];
        let n = self.slide_direction(c);
        let mut rho = self.rho[c].map(|v| weight * v);
        rho[0] += (1..D).map(|k| n[k] * rho[k]).sum::<f64>(); // G ρ
        let (d, rho) = (scaling.coordinates(&self.d[c]), scaling.coordinates(&rho));
        let mut b = [0.0; D];
        for i in 0..D {
            let value = scaling.values[i];
            b[i] = (value * d[i] + rho[i]) / (1.0 + value * value);
        }
        if scaling.shape == Shape::Line {
            (1..D).for_each(|i| b[i] = 0.0);
        }
        b
    }

    /// dx and dz of a contact with one cone.
    fn step_of_one(&mut self, c: usize, weight: f64) {
        let dx = self.scaled_impulse(c, &small::block(&self.dr, c));
        let mut dz = self.scaled_velocity(c, &small::block(&self.wdr, c));
        (0..D).for_each(|k| dz[k] -= weight * self.rho[c][k]);
        let n = self.slide_direction(c);
        dz[0] += (1..D).map(|k| n[k] * dz[k]).sum::<f64>(); //      G (Z W dr − ρ)
        (self.dx[c], self.dz[c]) = self.completed(c, &dx, &dz);
    }

    /// dx and dz of a pair, whichever is small from the other: complementarity the other way round would magnify what the solve left.
    fn completed(&self, i: usize, dx: &[f64; D], dz: &[f64; D]) -> ([f64; D], [f64; D]) {
        let scaling = &self.scalings[i];
        let d = scaling.coordinates(&self.d[i]);
        let (mut x, mut z) = (scaling.coordinates(dx), scaling.coordinates(dz));
        for k in 0..D {
            let s = scaling.values[k];
            if s > 1.0 {
                x[k] = (d[k] - z[k] / s) / s;
            } else {
                z[k] = s * (d[k] - s * x[k]);
            }
        }
        (scaling.back(&x), scaling.back(&z))
    }

    /// The right-hand side of a contact with two cones, `Vᵀ(Σ A S d + G ρ)/(1 + t)`.
    fn side_of_two(&self, c: usize, weight: f64) -> [f64; D] {
        let n = self.whole_slide_direction(c);
        let mut side = self.rho[c].map(|v| weight * v);
        side[0] += (1..D).map(|k| n[k] * side[k]).sum::<f64>();
        for i in L::DISKS * c..L::DISKS * (c + 1) {
            let of_d = self.of_disk(i, &self.scalings[i].apply(&self.d[i]));
            (0..D).for_each(|k| side[k] += of_d[k]);
        }
        let (values, vectors) = &self.turned[c];
        let turned = small::mul(vectors, &side);
        std::array::from_fn(
            |i| {
                if self.is_still(c, i) { 0.0 } else { turned[i] / (1.0 + values[i]) }
            },
        )
    }

    /// dx and dz of a contact with two cones. What of the normal velocity goes to which follows from complementarity where that is least sensitive, and from the sum where it is not.
    fn step_of_two(&mut self, c: usize, weight: f64) {
        let dr: [f64; D] = small::block(&self.dr, c);
        let wdr: [f64; D] = small::block(&self.wdr, c);
        let n = self.whole_slide_direction(c);
        let mut sum: [f64; D] =
            std::array::from_fn(|k| self.speed[c] * wdr[k] - weight * self.rho[c][k]);
        sum[0] += (1..D).map(|k| n[k] * sum[k]).sum::<f64>(); //    dẑ = G (W dr/υ − ρ)
        let pairs = [L::DISKS * c, L::DISKS * c + L::DISKS - 1];
        let dx = pairs.map(|i| self.of_disk(i, &dr.map(|r| self.weight[c] * r)));
        let mut dz = [0, 1].map(|k| self.of_disk(pairs[k], &sum));
        let sensitivity = pairs.map(|i| {
            let scaling = &self.scalings[i];
            let mut unit = [0.0; D];
            unit[0] = self.normal(i);
            norm(&scaling.apply(&unit))
        });
        let (sure, other) = if sensitivity[0] <= sensitivity[1] { (0, 1) } else { (1, 0) };
        let scaling = &self.scalings[pairs[sure]];
        let x = scaling.apply(&dx[sure]);
        let d = &self.d[pairs[sure]];
        let from: [f64; D] = std::array::from_fn(|k| d[k] - x[k]);
        dz[sure][0] = scaling.apply(&from)[0];
        let [of_sure, of_other] = [sure, other].map(|k| self.normal(pairs[k]));
        dz[other][0] = (sum[0] - of_sure * dz[sure][0]) / of_other;
        for k in 0..2 {
            let i = pairs[k];
            (self.dx[i], self.dz[i]) = self.completed(i, &dx[k], &dz[k]);
        }
        // Both hold the same r_N.
        let r_n = self.dx[pairs[sure]][0] / of_sure;
        self.dx[pairs[other]][0] = of_other * r_n;
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
    pub(in crate::contact) fn look<P: Linearised<D> + Disked<D, Law = L>>(
        &mut self,
        problem: &P,
        state: &mut P::State,
        alpha: f64,
    ) -> Iterate {
        let n = self.laws.len();
        for c in 0..n {
            for k in 0..L::DISKS {
                let i = L::DISKS * c + k;
                let (x, scale) = (self.pairs[i].x.vector(), self.impulse_scale(i));
                if k == 0 {
                    self.r[D * c] = x[0] / scale[0];
                }
                for row in L::rows(k) {
                    self.r[D * c + row] = if self.mu(i) > 0.0 { x[row] / scale[row] } else { 0.0 };
                }
            }
        }
        problem.velocities(state, &self.r, &mut self.u);
        let tau = self.pairs.iter().map(Pair::dot).sum::<f64>() / self.pairs.len() as f64;
        self.delta = self.smoothing * self.theta.unwrap_or(tau);
        let mut errors = 0.0;
        for c in 0..n {
            let u: [f64; D] = small::block(&self.u, c);
            self.rho[c] =
                if L::DISKS == 1 { self.gap_of_one(c, &u) } else { self.gap_of_two(c, &u) };
            let law = self.laws[c];
            let mut modified = u;
            modified[0] += match self.law {
                Some(Law::Given) => {
                    let of = |k: usize| law.coefficient(k) * self.s[L::DISKS * c + k];
                    (0..L::DISKS).map(of).sum()
                }
                _ => law.shift(&u),
            };
            let w = self.weight[c] / self.speed[c];
            let x = small::block::<D>(&self.r, c).map(|r| w * r);
            errors += law.natural(&x, &modified).iter().map(|v| v * v).sum::<f64>();
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

    /// ρ of a contact with one cone.
    fn gap_of_one(&self, c: usize, u: &[f64; D]) -> [f64; D] {
        let (free, z) = (self.scaled_velocity(c, u), self.pairs[c].z.vector());
        let slide = self.slide(c, self.pairs[c].z.tangential()).0;
        let mut rho = [0.0; D];
        rho[0] = z[0] - slide - free[0];
        if self.mu(c) > 0.0 {
            (1..D).for_each(|k| rho[k] = z[k] - free[k]);
        } else {
            rho[0] = z[0] - free[0];
        }
        rho
    }

    /// ρ of a contact with two cones, `Σ A_k (z_k − s_k e) − u/υ`.
    fn gap_of_two(&self, c: usize, u: &[f64; D]) -> [f64; D] {
        let mut rho = u.map(|u| -self.speed[c] * u);
        for k in 0..L::DISKS {
            let i = L::DISKS * c + k;
            let mut z = self.pairs[i].z.vector();
            z[0] -= self.slide(i, self.pairs[i].z.tangential()).0;
            let z = self.of_disk(i, &z);
            (0..D).for_each(|k| rho[k] += z[k]);
        }
        (1..D).filter(|&k| self.is_still(c, k)).for_each(|k| rho[k] = 0.0);
        rho
    }

    /// The coefficient of pair i.
    fn mu(&self, i: usize) -> f64 {
        self.laws[i / L::DISKS].coefficient(i % L::DISKS)
    }

    /// A of pair i in the normal direction: its coefficient, 1 of a half line.
    fn normal(&self, i: usize) -> f64 {
        if self.mu(i) > 0.0 { self.mu(i) } else { 1.0 }
    }

    /// The geometric mean of A in the normal direction.
    fn mean_normal(&self, c: usize) -> f64 {
        let product: f64 = (0..L::DISKS).map(|k| self.normal(L::DISKS * c + k)).product();
        if L::DISKS == 1 { product } else { product.sqrt() }
    }

    /// `A_k y`.
    fn of_disk(&self, i: usize, y: &[f64; D]) -> [f64; D] {
        let mut out = [0.0; D];
        out[0] = self.normal(i) * y[0];
        if self.mu(i) > 0.0 {
            L::rows(i % L::DISKS).for_each(|k| out[k] = y[k]);
        }
        out
    }

    /// Whether row k of contact c is of a disk that is a point.
    fn is_still(&self, c: usize, k: usize) -> bool {
        k > 0 && self.laws[c].coefficient((k - 1) * L::DISKS / (D - 1)) <= 0.0
    }

    /// The diagonal of X; of one cone 1 in the tangential components of a contact without friction, of two zero beside the disk.
    fn impulse_scale(&self, i: usize) -> [f64; D] {
        let weight = self.weight[i / L::DISKS];
        let mut x = self.in_disk(i, weight);
        x[0] = weight * self.normal(i);
        x
    }

    /// The diagonal of Z.
    fn velocity_scale(&self, i: usize) -> [f64; D] {
        let speed = self.speed[i / L::DISKS];
        let mut z = self.in_disk(i, speed);
        z[0] = speed / self.normal(i);
        z
    }

    fn in_disk(&self, i: usize, value: f64) -> [f64; D] {
        let mut out = [0.0; D];
        L::rows(i % L::DISKS).for_each(|k| out[k] = value);
        out
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

    /// s of pair i in scaled velocity, and what the step knows of its derivative by ‖z_T‖.
    fn slide(&self, i: usize, size: f64) -> (f64, f64) {
        match self.law {
            _ if self.mu(i) == 0.0 => (0.0, 0.0),
            Some(Law::Given) => (self.speed[i / L::DISKS] * self.s[i], 0.0),
            _ if self.delta == 0.0 => (size, self.share),
            _ => {
                let s = size.hypot(self.delta);
                (s, self.share * size / s)
            }
        }
    }

    /// How the normal equation of a contact falls with θ where `δ = κθ`: `∂(Σ A s)/∂θ`, in units of speed.
    pub(in crate::contact) fn slide_by_theta(&self, c: usize) -> f64 {
        let of_disk = |i: usize| {
            let s = self.slide(i, self.pairs[i].z.tangential()).0;
            let weight = if L::DISKS == 1 { 1.0 } else { self.normal(i) };
            if s > 0.0 { weight * self.smoothing * self.delta / s } else { 0.0 }
        };
        (L::DISKS * c..L::DISKS * (c + 1)).map(of_disk).sum()
    }

    /// `n = ∂s/∂z_T`, with a zero in front.
    fn slide_direction(&self, i: usize) -> [f64; D] {
        let z = &self.pairs[i].z;
        let slope = self.slide(i, z.tangential()).1;
        z.direction().map(|t| slope * t)
    }

    /// `∂(Σ mu_k s_k)/∂ẑ`, with a zero in front.
    fn whole_slide_direction(&self, c: usize) -> [f64; D] {
        let mut n = [0.0; D];
        for k in 0..L::DISKS {
            let i = L::DISKS * c + k;
            let of_disk = self.slide_direction(i);
            L::rows(k).for_each(|row| n[row] = self.mu(i) * of_disk[row]);
        }
        n
    }
}

/// The largest power of two between the units of two contacts.
const FACTOR: f64 = 200.0;

/// All but paths that are followed begin near where the equations hold, as the relaxation does, where some w_c is this far from their mean, as a power of two.
const SPREAD: f64 = 6.0;

/// σ while the equations lag behind complementarity, and where the boundary cuts steps short.
const BEHIND: f64 = 0.9;

/// The equations lag behind above this many times complementarity, and above this where the step knows a part of the slope only.
const LEAD: f64 = 10.0;
const LEAD_OF_PART: f64 = 3.0;

/// Steps below this are cut short,
const CUT: f64 = 0.1;
/// and above this long: the step may know more of the slope of s after a long one, by a factor, and knows less after one that is cut short; at once so many times.
const LONG: f64 = 0.5;
const MORE: f64 = 1.1;
const LESS: f64 = 0.7;
const RETRIES: usize = 3;

/// Of a start that has already been put inside: what is left to keep it off the boundary.
const LEAST_MARGIN: f64 = 1e-3;
