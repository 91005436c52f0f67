//! The central path followed by its arc length, so that it may turn back.
//!
//! From the start `x = z = e` of [`Central`], where the equations leave `ρ = ρ₀`, the path is
//!
//! ```text
//! ρ(x, z) = θ ρ₀,     x ∘ z = θ e,     θ from 1 to 0.
//! ```
//!
//! With Coulomb's law θ need not decrease along it: at a turning point the matrix of the Newton step is singular, and a
//! method that asks for a smaller θ stops. Here θ is an unknown like x and z. Where z_T of a sticking contact passes through
//! zero the path has a kink, at which Newton's method goes to and fro; with `s = √(‖z_T‖² + δ²)`, `δ = κθ`, it is smooth, and
//! its derivative by θ has the term `κδ/s`.
//!
//! Predictor: along the unit tangent `(ẋ, ż, θ̇)`, by a length h that ends well inside the cones and at a positive θ.
//! Corrector: Newton on the path's equations with the step orthogonal to the tangent, two solutions with one factor each, for
//! the equations' residual and their derivative by θ. Each point is brought so near to the path that Newton's method
//! converges from it. The predictor's distance from the path grows as h²: h follows from a distance to aim at, which rises
//! after easy steps and falls after refused ones. Lengths and angles are measured in the local metric
//! `‖S dx‖² + ‖S⁻¹ dz‖²`, in which a step from θ to θ/2 is as long near the end as at the start (in the Euclidean one it solved
//! 6 of Siconos' 37 problems instead of 36). Near the end Mehrotra's steps take over, which are faster there.
//!
//! References: Keller1977 (pseudo-arclength).
//! Cost of a step: at most `1 + CORRECTORS` factorisations. Storage: [`Central`]'s and eight vectors.
//! Fails: the path may end on the boundary, or run away to infinity.

use nonsmooth_linalg::{Singular, budget};

use super::nt::{Pair, Scaling};
use super::{Central, CentralIterate};
use crate::contact::form::{Disked, Linearised};
use crate::contact::law::DiskLaw;

/// The path's present point and the workspace.
#[derive(Debug, Clone)]
pub struct Pursuit<L, const D: usize> {
    /// Holds θ too, while the path is followed.
    core: Central<L, D>,
    /// The unit tangent of the last point, with the sign of travel.
    tangent: Direction<D>,
    /// The derivative by −θ at the present point, as it is last known.
    slope: Direction<D>,
    /// ρ₀.
    first: Vec<[f64; D]>,
    /// How ρ falls with θ: ρ₀, and the derivative of s.
    fall: Vec<[f64; D]>,
    /// The point to go back to.
    kept: Vec<Pair<D>>,
    /// The sign of the determinant at the start, until then zero.
    orientation: f64,
    length: f64,
    /// The distance from the path that a predictor aims at.
    target: f64,
    /// Steps that were refused in a row.
    refused: usize,
    end: End,
}

/// Mehrotra's steps at the end of the path.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
enum End {
    #[default]
    NotYet,
    Now {
        short: usize,
        /// θ to go back to.
        theta: f64,
    },
    Failed,
}

#[derive(Debug, Clone, Default)]
struct Direction<const D: usize> {
    x: Vec<[f64; D]>,
    z: Vec<[f64; D]>,
    theta: f64,
}

/// Newton corrections of one step.
const CORRECTORS: usize = 5;
/// The largest relative distance from the path, after the correctors. With 0.3 walls were lost: the next correctors did not
/// converge from there.
const NEAR: f64 = 0.03;
/// The distance that a predictor aims at is at most and at least this; it grows by a factor after a step with so few
/// corrections, and shrinks to a part of what was too far.
const FARTHEST: f64 = 0.9;
const NEAREST: f64 = 0.02;
const EASY: usize = 2;
const FARTHER: f64 = 1.25;
const NEARER: f64 = 0.7;
/// The length changes by these factors at most, from one step to the next and after a refusal.
const CHANGE: (f64, f64) = (0.5, 2.0);
const CHANGE_BACK: (f64, f64) = (0.1, 0.7);
/// ρ cannot follow θ below this.
const ROUNDING: f64 = 1e-11;
/// Below this θ the path is left for Mehrotra's steps, which end superlinearly,
const END: f64 = 1e-8;
/// until this many of them in a row
const MANY_SHORT: usize = 3;
/// were shorter than this: then the path is taken up again where it was left.
const SHORT: f64 = 1e-2;
/// So many steps refused in a row, or steps shorter than this, are no progress.
const MANY_REFUSED: usize = 20;
const SHORTEST: f64 = 1e-12;

impl<L, const D: usize> Default for Pursuit<L, D> {
    fn default() -> Self {
        Self {
            core: Central::default(),
            tangent: Direction::default(),
            slope: Direction::default(),
            first: vec![],
            fall: vec![],
            kept: vec![],
            orientation: 0.0,
            length: 0.0,
            target: FARTHEST,
            refused: 0,
            end: End::default(),
        }
    }
}

impl<L: DiskLaw<D>, const D: usize> Pursuit<L, D> {
    /// Begins at `x = z = e`, with `smoothing` κ ≥ 0 and `start` as in [`Central::begin`].
    pub fn begin<P: Linearised<D> + Disked<D, Law = L>>(
        &mut self,
        problem: &P,
        state: &mut P::State,
        smoothing: f64,
        start: Option<(&[f64], f64)>,
    ) -> CentralIterate {
        let now = self.core.begin_centred(problem, state, smoothing, start);
        let n = self.core.pairs.len();
        for direction in [&mut self.tangent, &mut self.slope] {
            for list in [&mut direction.x, &mut direction.z] {
                list.clear();
                list.resize(n, [0.0; D]);
            }
        }
        self.slope.theta = -1.0;
        self.first.clear();
        self.first.extend_from_slice(&self.core.rho);
        self.kept.clear();
        self.kept.extend_from_slice(&self.core.pairs);
        self.core.theta = Some(now.tau);
        (self.length, self.refused) = (f64::INFINITY, 0);
        (self.target, self.orientation) = (FARTHEST, 0.0);
        self.end = End::NotYet;
        // ρ = θ ρ₀ at the start.
        self.first.iter_mut().flatten().for_each(|rho| *rho /= now.tau);
        self.fall.clear();
        self.fall.resize(self.first.len(), [0.0; D]);
        now
    }

    /// Zero once the path is left for Mehrotra's steps.
    fn theta(&self) -> f64 {
        self.core.theta.unwrap_or(0.0)
    }

    /// The iterate, and the best one so far.
    pub fn core(&self) -> &Central<L, D> {
        &self.core
    }

    /// One step along the path: a predictor and its correctors. `alpha` of the answer is the step's length, zero
    /// where the step was refused.
    pub fn iterate<P: Linearised<D> + Disked<D, Law = L>>(
        &mut self,
        problem: &P,
        state: &mut P::State,
    ) -> Result<CentralIterate, Singular> {
        let theta = self.theta();
        if self.end == End::NotYet && theta < END && self.refused == 0 {
            self.kept.copy_from_slice(&self.core.pairs);
            self.core.theta = None;
            self.end = End::Now { short: 0, theta };
        }
        if let End::Now { short, theta } = self.end {
            let now = self.core.iterate(problem, state)?;
            let short = if now.alpha < SHORT { short + 1 } else { 0 };
            self.end = End::Now { short, theta };
            if short == MANY_SHORT {
                self.end = End::Failed;
                return Ok(self.go_back(problem, state, theta));
            }
            return Ok(now);
        }
        if self.refused == 0 {
            self.core.factorise(problem, state)?;
            self.differentiate(problem, state);
            self.turn(problem, state);
        }
        self.kept.copy_from_slice(&self.core.pairs);
        // The predictor.
        self.core.dx.copy_from_slice(&self.tangent.x);
        self.core.dz.copy_from_slice(&self.tangent.z);
        let mut longest = 0.9 * self.core.reach();
        if self.tangent.theta < 0.0 {
            longest = longest.min(0.95 * theta / -self.tangent.theta);
        }
        let length = self.length.min(longest).min(1e6);
        self.core.advance(length);
        self.core.theta = Some(theta + length * self.tangent.theta);
        self.core.look(problem, state, length);
        let mut corrections = 0;
        let mut distance = self.distance();
        let predicted = distance.max(NEAREST);
        while corrections < CORRECTORS && distance.is_finite() {
            // One correction at least: a point that is taken over as far from the path as it was allowed to be would look like a
            // predictor's, and be followed by the shortest of steps.
            if distance <= NEAR && corrections > 0 {
                break;
            }
            if budget::over() || self.correct(problem, state).is_err() {
                break;
            }
            corrections += 1;
            let now = self.distance();
            // Newton's method that does not contract will not do so later.
            if now > 2.0 * distance && corrections > 1 {
                break;
            }
            distance = now;
        }
        if distance > NEAR || distance.is_nan() {
            self.target = (NEARER * self.target.min(predicted)).max(NEAREST);
            let (least, most) = CHANGE_BACK;
            self.length = length * (self.target / predicted).sqrt().clamp(least, most);
            self.refused += 1;
            return Ok(self.go_back(problem, state, theta));
        }
        self.refused = 0;
        if corrections <= EASY {
            self.target = (FARTHER * self.target).min(FARTHEST);
        }
        let (least, most) = CHANGE;
        self.length = length * (self.target / predicted).sqrt().clamp(least, most);
        Ok(self.core.look(problem, state, length))
    }

    /// To the point that was kept, at its θ.
    fn go_back<P: Linearised<D> + Disked<D, Law = L>>(
        &mut self,
        problem: &P,
        state: &mut P::State,
        theta: f64,
    ) -> CentralIterate {
        self.core.pairs.copy_from_slice(&self.kept);
        self.core.theta = Some(theta);
        self.core.look(problem, state, 0.0)
    }

    /// The path has come to an end: steps of no length, or none that is accepted.
    pub fn stuck(&self) -> bool {
        self.refused == MANY_REFUSED || self.length < SHORTEST * self.theta().max(1e-6)
    }

    /// `slope`: the derivative of (x, z) by −θ along the path.
    fn differentiate<P: Linearised<D> + Disked<D, Law = L>>(
        &mut self,
        problem: &P,
        state: &mut P::State,
    ) {
        let core = &mut self.core;
        for c in 0..core.pairs.len() {
            let mut minus_e = [0.0; D];
            minus_e[0] = -1.0;
            core.d[c] = core.scalings[c].divide(&minus_e);
        }
        for (c, (fall, first)) in self.fall.iter_mut().zip(&self.first).enumerate() {
            *fall = *first;
            fall[0] += core.slide_by_theta(c);
        }
        std::mem::swap(&mut core.rho, &mut self.fall);
        core.newton(problem, state, 1.0);
        std::mem::swap(&mut core.rho, &mut self.fall);
        self.slope.x.copy_from_slice(&core.dx);
        self.slope.z.copy_from_slice(&core.dz);
    }

    /// The unit tangent. θ falls along it where the determinant of the equations in (x, z) has the sign that it had at the
    /// start, and rises where it has the other. The scalar product with the last tangent says the same on a smooth path; at
    /// bends of ‖z_T‖ it was wrong, and the path was followed back to where it came from.
    fn turn<P: Linearised<D> + Disked<D, Law = L>>(&mut self, problem: &P, state: &mut P::State) {
        let theta = self.theta();
        let Self { core, slope, tangent, orientation, .. } = self;
        let size = core.product(slope, slope, theta).sqrt();
        let now = core.orientation(problem, state);
        if *orientation == 0.0 {
            *orientation = now;
        }
        let sign = now * *orientation;
        for (to, from) in [(&mut tangent.x, &slope.x), (&mut tangent.z, &slope.z)] {
            to.iter_mut().zip(from).for_each(|(t, s)| *t = s.map(|v| sign * v / size));
        }
        tangent.theta = -sign / size;
    }

    /// The largest relative distance of the present point from the path.
    fn distance(&self) -> f64 {
        let theta = self.theta();
        let mut largest = 0.0_f64;
        for pair in &self.core.pairs {
            let scaling = Scaling::new(pair);
            let mut off = scaling.product(&scaling.lambda, &scaling.lambda);
            off[0] -= theta;
            let size = off.iter().map(|v| v * v).sum::<f64>().sqrt();
            largest = largest.max(size / theta);
        }
        let (mut off, mut size) = (0.0, 1.0);
        for (rho, first) in self.core.rho.iter().zip(&self.first) {
            for k in 0..D {
                off += (rho[k] - theta * first[k]).powi(2);
                size += first[k] * first[k];
            }
        }
        // Below the rounding of the equations there is no path to be near to.
        largest.max((off / size).sqrt() / theta.max(ROUNDING))
    }

    /// One Newton step on the path's equations, orthogonal to the tangent.
    fn correct<P: Linearised<D> + Disked<D, Law = L>>(
        &mut self,
        problem: &P,
        state: &mut P::State,
    ) -> Result<(), Singular> {
        self.core.factorise(problem, state)?;
        self.differentiate(problem, state);
        let theta = self.theta();
        let Self { core, tangent, slope, first, .. } = self;
        core.aim(theta, false);
        for (rho, first) in core.rho.iter_mut().zip(&*first) {
            rho.iter_mut().zip(first).for_each(|(rho, first)| *rho -= theta * first);
        }
        core.newton(problem, state, 1.0);
        let across = core.product(tangent, slope, theta);
        let missing = core.inner((&tangent.x, &tangent.z), (&core.dx, &core.dz)) / theta;
        let change = missing / across;
        if !change.is_finite() {
            return Err(Singular);
        }
        for c in 0..core.pairs.len() {
            for k in 0..D {
                core.dx[c][k] -= change * slope.x[c][k];
                core.dz[c][k] -= change * slope.z[c][k];
            }
        }
        let mut alpha = (0.95 * core.reach()).min(1.0);
        if change < 0.0 {
            alpha = alpha.min(0.95 * theta / -change);
        }
        core.advance(alpha);
        core.theta = Some(theta + alpha * change);
        core.look(problem, state, alpha);
        Ok(())
    }
}

impl<L: DiskLaw<D>, const D: usize> Central<L, D> {
    /// The scalar product of two directions in the local metric, in which the path towards a small θ looks the same as
    /// towards a large one: `(aₓᵀS²bₓ + a_zᵀS⁻²b_z)/θ + nc a_θ b_θ/θ²`.
    fn product(&self, a: &Direction<D>, b: &Direction<D>, theta: f64) -> f64 {
        let along = self.pairs.len() as f64 * (a.theta / theta) * (b.theta / theta);
        self.inner((&a.x, &a.z), (&b.x, &b.z)) / theta + along
    }

    /// `aₓᵀS²bₓ + a_zᵀS⁻²b_z`.
    fn inner(&self, a: (&[[f64; D]], &[[f64; D]]), b: (&[[f64; D]], &[[f64; D]])) -> f64 {
        let dot = |a: [f64; D], b: [f64; D]| (0..D).map(|k| a[k] * b[k]).sum::<f64>();
        let contact = |c: usize| {
            let s = &self.scalings[c];
            // Of a half line only the normal part counts, and the others are zero.
            dot(s.apply(&a.0[c]), s.apply(&b.0[c]))
                + dot(s.apply_inverse(&a.1[c]), s.apply_inverse(&b.1[c]))
        };
        (0..self.pairs.len()).map(contact).sum()
    }
}
