//! Proximal point steps whose subproblems a semismooth Newton method on the Alart–Curnier function solves.
//!
//! Problem: `u = W r + q`, `K* ∋ u + mu‖u_T‖e_N ⟂ r ∈ K` for each contact, W possibly rank deficient.
//!
//! Outer k: the law for `u_ε = u + ε E (r − r_k)` in place of u, E diagonal in units of W. Its W + εE is regular, the bias
//! vanishes where `r = r_k`, so hyperstatic problems lose no accuracy.
//! Inner: Newton on Φ(u_ε, r) = 0, `(∂Φ/∂r + ε ∂Φ/∂u E + ∂Φ/∂u W) Δr = −Φ`, with a line search on ‖Φ/ρ‖ or with whole steps. Where many contacts are between
//! sticking and sliding a whole step raises ‖Φ/ρ‖ and yet gives them their sides, as an active set method does, where shorter ones creep.
//!
//! The metric: with K made self-dual (`D = diag(mu, 1, 1)`, `x = D r`, `W' = D⁻¹ W D⁻¹`) one number a contact,
//! `w_c = tr(W'_cc)/D`, measures normal and tangential directions alike: ρ = κ/((1 + ε) w_c), E = w_c, both carried back by D.
//!
//! References: AlartCurnier1991; AcaryBremondHuber2018 (proximal point); Rockafellar1976.
//! Near the end of a solve to a tolerance that the rounding of `W r + q` would hide, velocities come in doubled precision, so that Newton
//! sees the residual of the impulses as they are stored.
//!
//! Cost of an iteration: one factorisation of `Q + P W`, one to five products with W, O(nc) a trial of the line search.

use nonsmooth_linalg::{Block, norm_of, small};

use crate::contact::form::{Disked, Linearised};
use crate::contact::law::DiskLaw;
use crate::contact::law::cfun::{Disk, Radii, alart_curnier, natural_residual};

/// Trials of the line search.
const TRIALS: usize = 8;
/// Sufficient decrease.
const ARMIJO: f64 = 1e-3;
/// mu below this is treated as this in the metric; contacts without friction have none.
const LEAST_MU: f64 = 1e-6;

/// The state of the method.
pub struct ProximalNewton<L, const D: usize> {
    contacts: Vec<Contact<L>>,
    /// `‖q‖`.
    scale: f64,
    epsilon: f64,
    kappa: f64,
    /// r_k.
    center: Vec<f64>,
    /// The velocities of the present impulses.
    u: Vec<f64>,
    phi: Vec<f64>,
    p: Vec<Block<D>>,
    q: Vec<Block<D>>,
    dr: Vec<f64>,
    du: Vec<f64>,
    trial_r: Vec<f64>,
    trial_u: Vec<f64>,
    failures: usize,
    /// Steps are taken whole.
    whole: bool,
    /// Velocities are computed in doubled precision.
    precise: bool,
}

/// Plain sums of W r are wrong by about this share of their terms.
const ROUNDING: f64 = 4.0 * f64::EPSILON;
/// Doubled precision begins where the error is below this multiple of that rounding.
const PRECISE_BELOW: f64 = 1e4;

#[derive(Debug, Clone, Copy)]
struct Contact<L> {
    law: L,
    /// `tr(W_cc)/D`.
    unit: f64,
    /// `w_c` of the self-dual metric along the normal and in each disk: of Coulomb's law `w mu²` and `w`, in general `w` and `w/mu_k²` times the same.
    normal: f64,
    disks: [f64; 2],
}

impl<L> Contact<L> {
    /// E of row k.
    #[inline(always)]
    fn weight<const D: usize>(&self, k: usize) -> f64
    where
        L: DiskLaw<D>,
    {
        if k == 0 { self.normal } else { self.disks[(k - 1) * L::DISKS / (D - 1)] }
    }
}

/// What an iteration came to.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Inner {
    /// The relative natural residual of the subproblem.
    pub residual: f64,
    /// The step length; 0 where the linear system could not be solved.
    pub step: f64,
}

impl<L: DiskLaw<D>, const D: usize> ProximalNewton<L, D> {
    /// For `problem`.
    pub fn new<P: Linearised<D> + Disked<D, Law = L>>(problem: &P, state: &P::State) -> Self {
        let mut out = Self {
            contacts: vec![],
            scale: 1.0,
            epsilon: 1.0,
            kappa: 10.0,
            center: vec![],
            u: vec![],
            phi: vec![],
            p: vec![],
            q: vec![],
            dr: vec![],
            du: vec![],
            trial_r: vec![],
            trial_u: vec![],
            failures: 0,
            whole: false,
            precise: false,
        };
        out.fill(problem, state);
        out
    }

    /// Takes another problem; allocates nothing where the number of contacts is the same.
    pub fn fill<P: Linearised<D> + Disked<D, Law = L>>(&mut self, problem: &P, state: &P::State) {
        let nc = problem.contacts();
        self.scale = problem.velocity_scale(state);
        self.precise = false;
        self.contacts.clear();
        for c in 0..nc {
            let (w, law) = (problem.diagonal_block(state, c), problem.law(c));
            let unit = small::mean_diagonal(&w).abs();
            // In units of the first disk, r_N mu and r_k mu/mu_k: Coulomb's D = diag(mu, 1, 1).
            let m = [0, L::DISKS - 1].map(|disk| match law.coefficient(disk) {
                mu if mu > 0.0 => mu.max(LEAST_MU),
                _ => 1.0,
            });
            let ratio = [1.0, (m[1] / m[0]).powi(2)];
            let mut trace = 0.0;
            for disk in 0..L::DISKS {
                trace += ratio[disk] * L::rows(disk).map(|k| w[k][k]).sum::<f64>();
            }
            let self_dual = (w[0][0] / (m[0] * m[0]) + trace) / D as f64;
            let w = if self_dual > 0.0 { self_dual } else { 1.0 };
            let disks = ratio.map(|ratio| w / ratio);
            self.contacts.push(Contact { law, unit, normal: w * m[0] * m[0], disks });
        }
        for x in [
            &mut self.center,
            &mut self.u,
            &mut self.phi,
            &mut self.dr,
            &mut self.du,
            &mut self.trial_r,
            &mut self.trial_u,
        ] {
            x.resize(D * nc, 0.0);
        }
        self.p.resize(nc, [[0.0; D]; D]);
        self.q.resize(nc, [[0.0; D]; D]);
    }

    /// Takes `r` as the present impulses: computes their velocities, on which [`error`](Self::error) and [`residual`](Self::residual)
    /// rest, and returns the error.
    pub fn look<P: Linearised<D> + Disked<D, Law = L>>(
        &mut self,
        problem: &P,
        state: &mut P::State,
        r: &[f64],
    ) -> f64 {
        self.update(problem, state, r);
        self.error(r)
    }

    fn update<P: Linearised<D> + Disked<D, Law = L>>(
        &mut self,
        problem: &P,
        state: &mut P::State,
        r: &[f64],
    ) {
        if self.precise {
            problem.velocities_precisely(state, r, &mut self.u);
        } else {
            problem.velocities(state, r, &mut self.u);
        }
    }

    /// Chooses the precision of velocities near `r`, whose relative error is known, for a solve to `tolerance`.
    pub fn focus(&mut self, r: &[f64], error: f64, tolerance: f64) {
        let squares = r
            .chunks(D)
            .zip(&self.contacts)
            .map(|(r, c)| r.iter().map(|r| (c.unit * r / self.scale).powi(2)).sum::<f64>());
        let rounding = ROUNDING * squares.sum::<f64>().sqrt();
        self.precise = rounding > 0.1 * tolerance && error < PRECISE_BELOW * rounding;
    }

    /// Starts the subproblem of `epsilon` about `r`, with ρ = `kappa`/w_c, whose steps are taken `whole` or after a line search.
    pub fn center(&mut self, r: &[f64], epsilon: f64, kappa: f64, whole: bool) {
        self.center.copy_from_slice(r);
        self.epsilon = epsilon;
        self.kappa = kappa;
        self.failures = 0;
        self.whole = whole;
    }

    /// How far the last Newton direction leads, as a velocity over ‖q‖: `‖(w_c Δr_c)_c‖/‖q‖`. Of impulses that no load asks for it is large: the matrix is nearly singular.
    pub fn reach(&self) -> f64 {
        let of =
            |(dr, c): (&[f64], &Contact<L>)| dr.iter().map(|x| (c.unit * x).powi(2)).sum::<f64>();
        self.dr.chunks(D).zip(&self.contacts).map(of).sum::<f64>().sqrt() / self.scale
    }

    /// `r_k`.
    pub fn centre(&self) -> &[f64] {
        &self.center
    }

    /// The relative natural residual of the problem itself at r.
    pub fn error(&self, r: &[f64]) -> f64 {
        self.natural(&self.u, r, 0.0)
    }

    /// How fast contacts without impulse open at r, relative to ‖q‖.
    pub fn opening(&self, r: &[f64]) -> f64 {
        let contacts = r.chunks(D).zip(self.u.chunks(D));
        let opening = contacts.filter(|(r, u)| r[0] == 0.0 && u[0] > 0.0);
        opening.map(|(_, u)| u[0] * u[0]).sum::<f64>().sqrt() / self.scale
    }

    /// How fast contacts with impulse slide at r, relative to ‖q‖.
    pub fn sliding(&self, r: &[f64]) -> f64 {
        let contacts = r.chunks(D).zip(self.u.chunks(D)).filter(|(r, _)| r[0] > 0.0);
        norm_of(contacts.flat_map(|(_, u)| u[1..].iter().copied())) / self.scale
    }

    /// The relative natural residual with ε: `‖( w r − P_K(w r − ũ_ε) )_c‖ / ‖q‖`, `w = w_c + ε E`.
    fn natural(&self, u: &[f64], r: &[f64], epsilon: f64) -> f64 {
        let mut sum = 0.0;
        for (c, contact) in self.contacts.iter().enumerate() {
            let (ue, rc) = (self.shifted(u, r, c, epsilon), small::block::<D>(r, c));
            let w = contact.unit + epsilon * contact.disks[0];
            sum += natural_residual(w, &rc, &ue, contact.law);
        }
        sum.sqrt() / self.scale
    }

    /// `u_ε` of contact c.
    #[inline(always)]
    fn shifted(&self, u: &[f64], r: &[f64], c: usize, epsilon: f64) -> [f64; D] {
        let contact = &self.contacts[c];
        let mut ue: [f64; D] = small::block(u, c);
        if epsilon > 0.0 {
            for k in 0..D {
                let i = D * c + k;
                ue[k] += epsilon * contact.weight::<D>(k) * (r[i] - self.center[i]);
            }
        }
        ue
    }

    #[inline(always)]
    fn radii(&self, contact: &Contact<L>) -> Radii {
        let kappa = self.kappa / (1.0 + self.epsilon);
        let [tangential, rolling] = contact.disks.map(|w| kappa / w);
        Radii { normal: kappa / contact.normal, tangential, rolling }
    }

    /// `‖Φ/ρ‖² / ‖q‖²` at `(u, r)`.
    fn merit(&self, u: &[f64], r: &[f64]) -> f64 {
        let mut sum = 0.0;
        for (c, contact) in self.contacts.iter().enumerate() {
            let ue = self.shifted(u, r, c, self.epsilon);
            let rho = self.radii(contact);
            let phi = value(&ue, &small::block(r, c), contact.law, rho);
            sum += (phi[0] / rho.normal).powi(2);
            for disk in 0..L::DISKS {
                let rho = rho.of_disk(disk);
                sum += phi[L::rows(disk)].iter().map(|x| (x / rho).powi(2)).sum::<f64>();
            }
        }
        sum / (self.scale * self.scale)
    }

    /// One Newton iteration on `r` and `u`.
    pub fn iterate<P: Linearised<D> + Disked<D, Law = L>>(
        &mut self,
        problem: &P,
        state: &mut P::State,
        r: &mut [f64],
    ) -> Inner {
        for c in 0..self.contacts.len() {
            let contact = self.contacts[c];
            let ue = self.shifted(&self.u, r, c, self.epsilon);
            let rho = self.radii(&contact);
            let piece =
                alart_curnier(Disk::AlartCurnier, &ue, &small::block(r, c), contact.law, rho);
            let (mut q, epsilon) = (piece.b, self.epsilon);
            for row in 0..D {
                self.phi[D * c + row] = -piece.phi[row];
                for k in 0..D {
                    q[row][k] += epsilon * contact.weight::<D>(k) * piece.a[row][k];
                }
            }
            self.p[c] = piece.a;
            self.q[c] = q;
        }
        let failed = Inner { residual: f64::INFINITY, step: 0.0 };
        if problem.linearise(state, &self.p, &self.q).is_err() {
            return failed;
        }
        problem.solve_linearised(state, &self.phi, &mut self.dr, &mut self.du);
        if !self.dr.iter().all(|x| x.is_finite()) {
            return failed;
        }
        let step = if self.whole { 1.0 } else { self.search(r) };
        r.iter_mut().zip(&self.dr).for_each(|(r, d)| *r += step * d);
        self.update(problem, state, r);
        Inner { residual: self.natural(&self.u, r, self.epsilon), step }
    }

    /// The step length: the first that decreases the merit enough, else the best of those tried, but every fifth time the
    /// smallest, which leads out of cycles.
    fn search(&mut self, r: &[f64]) -> f64 {
        let start = self.merit(&self.u, r).sqrt();
        let (mut step, mut best) = (1.0, (f64::INFINITY, 1.0));
        for _ in 0..=TRIALS {
            for i in 0..r.len() {
                self.trial_r[i] = r[i] + step * self.dr[i];
                self.trial_u[i] = self.u[i] + step * self.du[i];
            }
            let merit = self.merit(&self.trial_u, &self.trial_r).sqrt();
            if merit <= (1.0 - ARMIJO * step) * start {
                return step;
            }
            if merit < best.0 {
                best = (merit, step);
            }
            step *= 0.5;
        }
        self.failures += 1;
        if self.failures.is_multiple_of(5) { 2.0 * step } else { best.1 }
    }

    /// The relative natural residual of the present subproblem.
    pub fn residual(&self, r: &[f64]) -> f64 {
        self.natural(&self.u, r, self.epsilon)
    }
}

/// The value of the Alart–Curnier function alone.
#[inline(always)]
fn value<L: DiskLaw<D>, const D: usize>(
    u: &[f64; D],
    r: &[f64; D],
    law: L,
    rho: Radii,
) -> [f64; D] {
    let x_n = r[0] - rho.normal * u[0];
    let mut phi = *r;
    if x_n <= 0.0 {
        return phi;
    }
    phi[0] = rho.normal * u[0];
    for disk in 0..L::DISKS {
        let (radius, rho) = (law.coefficient(disk) * x_n, rho.of_disk(disk));
        let mut x = [0.0; D];
        let mut square = 0.0;
        for k in L::rows(disk) {
            x[k] = r[k] - rho * u[k];
            square += x[k] * x[k];
        }
        if square <= radius * radius {
            for k in L::rows(disk) {
                phi[k] = rho * u[k];
            }
        } else {
            let factor = radius / square.sqrt();
            for k in L::rows(disk) {
                phi[k] = r[k] - factor * x[k];
            }
        }
    }
    phi
}
