//! The convex subproblems that the methods of this family share, and their solvers.
//!
//! Problem: find r in a product C of convex sets with `(W r + b)ᵀ (r' − r) ≥ 0` for all r' in C, which for
//! symmetric W is `min ½ rᵀWr + bᵀr`. `b = q + shift`.
//!
//! Two methods that need no conic solver:
//! *spectral projected gradient* in the metric `diag(w_c)`: `d = P_C(r − α y/w_c) − r`, the longest step to which the objective agrees
//! (nonmonotone over ten steps, else the exact minimiser), α the inverse Rayleigh quotient of d; one product with W a step;
//! *semismooth Newton* on the natural map `φ = r − P_C(r − ρ y)`, `ρ = 10/w_c`: `(I − J + ρ J W) dr = −φ` with J an element of ∂P_C, halved
//! while ‖φ‖ does not fall, gradient steps where that does not help. On cylinders it is the primal–dual active set method.
//!
//! References: BirginMartinezRaydan2000; HueberStadlerWohlmuth2008.

use nonsmooth_linalg::{Block, budget, small};

use super::sets::Set;
use crate::SolveError;
use crate::contact::form::{Access, Frictional, Linear, Linearised};
use crate::contact::law::Coulomb;
use crate::contact::law::cfun::natural_residual;
use crate::contact::law::cone::ConvexSet;

/// Gradient steps between two evaluations of the true gradient.
const REFRESH: usize = 50;
/// How many values of the objective a nonmonotone step may look back on.
const MEMORY: usize = 10;
/// Halvings of a Newton step.
const HALVINGS: usize = 8;
/// Gradient steps in place of a Newton step that does not help.
const RESCUE: usize = 10;
/// ρ of the natural map, in units of 1/w_c.
const RHO: f64 = 10.0;

/// A convex subproblem and the memory of its solvers.
pub(super) struct Convex<P: Linear<D> + Frictional<D>, const D: usize> {
    pub(super) state: P::State,
    /// `w_c`, positive.
    pub(super) unit: Vec<f64>,
    /// `‖q‖`.
    pub(super) scale: f64,
    /// `W 0 + q`.
    pub(super) q: Vec<f64>,
    /// What is added to the normal velocities.
    pub(super) shift: Vec<f64>,
    pub(super) sets: Vec<Set<D>>,
    /// `W r + b` at the present impulses.
    pub(super) y: Vec<f64>,
    d: Vec<f64>,
    wd: Vec<f64>,
    trial: Vec<f64>,
    trial_y: Vec<f64>,
    newton: Newton<D>,
}

/// The blocks of a Newton system.
struct Newton<const D: usize> {
    p: Vec<Block<D>>,
    q: Vec<Block<D>>,
    phi: Vec<f64>,
}

impl<P: Linear<D> + Frictional<D>, const D: usize> Convex<P, D> {
    pub(super) fn new(problem: &P, access: Access) -> Result<Self, SolveError> {
        let n = problem.mu().len();
        let m = D * n;
        let mut convex = Self {
            state: problem.state(access)?,
            unit: Vec::with_capacity(n),
            scale: 1.0,
            q: vec![],
            shift: vec![],
            sets: vec![],
            y: vec![],
            d: vec![],
            wd: vec![],
            trial: vec![],
            trial_y: vec![],
            newton: Newton { p: vec![], q: vec![], phi: vec![0.0; m] },
        };
        convex.fill(problem);
        Ok(convex)
    }

    pub(super) fn refill(&mut self, problem: &P) -> Result<(), SolveError> {
        problem.refill(&mut self.state)?;
        self.fill(problem);
        Ok(())
    }

    fn fill(&mut self, problem: &P) {
        let n = problem.mu().len();
        for x in [
            &mut self.q,
            &mut self.y,
            &mut self.d,
            &mut self.wd,
            &mut self.trial,
            &mut self.trial_y,
            &mut self.newton.phi,
        ] {
            x.clear();
            x.resize(D * n, 0.0);
        }
        for blocks in [&mut self.newton.p, &mut self.newton.q] {
            blocks.clear();
            blocks.resize(n, [[0.0; D]; D]);
        }
        self.shift.clear();
        self.shift.resize(n, 0.0);
        self.sets.clear();
        self.sets.extend(problem.mu().iter().map(|&mu| Set::Cone(mu)));
        self.scale = problem.velocity_scale(&self.state);
        problem.velocities(&mut self.state, &self.d, &mut self.q);
        problem.units(&self.state, &mut self.unit);
    }

    /// The mean of `w_c`.
    pub(super) fn mean_unit(&self) -> f64 {
        self.unit.iter().sum::<f64>() / self.unit.len().max(1) as f64
    }

    /// `y = W r + q + shift`.
    pub(super) fn evaluate(&mut self, problem: &P, r: &[f64]) {
        problem.velocities(&mut self.state, r, &mut self.y);
        add_shift::<D>(&self.shift, &mut self.y);
    }

    /// Projects `r` on the sets; `y` no longer belongs to it.
    pub(super) fn restrict(&mut self, r: &mut [f64]) {
        project_all(&self.sets, r, &mut self.trial);
        r.copy_from_slice(&self.trial);
    }

    /// The relative natural residual of the subproblem at `r`, whose `y` is known.
    pub(super) fn residual(&self, r: &[f64]) -> f64 {
        (weighted_map(&self.sets, &self.unit, 1.0, r, &self.y)).sqrt() / self.scale
    }

    /// The relative residual of Coulomb's law at `r` with the velocities `u`.
    pub(super) fn coulomb(&self, mu: &[f64], r: &[f64], u: &[f64]) -> f64 {
        let mut sum = 0.0;
        for (c, (&mu, &w)) in mu.iter().zip(&self.unit).enumerate() {
            sum +=
                natural_residual(w, &small::block::<D>(r, c), &small::block(u, c), Coulomb { mu });
        }
        sum.sqrt() / self.scale
    }

    /// Spectral projected gradient from `r` (whose `y` is known) until the residual is at most `tolerance`, at most `most` steps.
    /// `y` belongs to the new `r`. Returns the residual.
    pub(super) fn gradient(
        &mut self,
        problem: &P,
        r: &mut [f64],
        tolerance: f64,
        most: usize,
    ) -> f64 {
        self.restrict(r);
        self.evaluate(problem, r);
        // Objective values relative to the first, and the last step lengths.
        let (mut values, mut lengths) = ([0.0; MEMORY], [f64::INFINITY; MEMORY]);
        let (mut value, mut alpha) = (0.0, 1.0);
        for step in 1..=most {
            let (mut slope, mut size, mut terms) = (0.0_f64, 0.0_f64, 0.0_f64);
            for (c, (set, &w)) in self.sets.iter().zip(&self.unit).enumerate() {
                let x: [f64; D] =
                    std::array::from_fn(|k| r[D * c + k] - alpha / w * self.y[D * c + k]);
                let p = set.project(&x);
                for k in 0..D {
                    let d = p[k] - r[D * c + k];
                    self.d[D * c + k] = d;
                    slope += self.y[D * c + k] * d;
                    terms += (self.y[D * c + k] * r[D * c + k]).abs();
                    size += w * d * d;
                }
            }
            let moved: f64 = (self.unit.iter().enumerate())
                .map(|(c, w)| w * w * (D * c..D * c + D).map(|i| self.d[i].powi(2)).sum::<f64>())
                .sum();
            // ‖d(α)‖ grows with α and ‖d(α)‖/α falls: this bounds the residual from above.
            let bound = moved.sqrt() / (self.scale * alpha.min(1.0));
            if bound <= tolerance || !bound.is_finite() || budget::over() {
                break;
            }
            // The rounding of r on the boundary hides a slope as small as this: then short steps, without the objective.
            let blind = -slope <= 16.0 * f64::EPSILON * terms;
            problem.velocities(&mut self.state, &self.d, &mut self.wd);
            let curvature: f64 = (self.wd.iter_mut().zip(&self.q).zip(&self.d))
                .map(|((wd, q), d)| {
                    *wd -= q;
                    *wd * d
                })
                .sum();
            let highest = values.iter().take(step.min(MEMORY)).fold(f64::MIN, |a, v| a.max(*v));
            let whole = slope + 0.5 * curvature;
            let agreed = value + whole <= highest + 1e-4 * slope;
            let t = if blind || agreed || curvature <= 0.0 {
                1.0
            } else {
                (-slope / curvature).min(1.0)
            };
            value += t * slope + 0.5 * t * t * curvature;
            values[step % MEMORY] = value;
            for i in 0..r.len() {
                r[i] += t * self.d[i];
                self.y[i] += t * self.wd[i];
            }
            alpha = if curvature > 0.0 { (size / curvature).clamp(1e-8, 1e8) } else { 1e2 };
            lengths[step % MEMORY] = alpha;
            if blind {
                alpha = lengths.iter().fold(alpha, |a, l| a.min(*l));
            }
            if step % REFRESH == 0 {
                self.evaluate(problem, r);
            }
        }
        self.evaluate(problem, r);
        self.residual(r)
    }
}

impl<P: Linearised<D> + Frictional<D>, const D: usize> Convex<P, D> {
    /// Semismooth Newton from `r` (whose `y` is known) until the residual is at most `tolerance`, at most `most` factorisations.
    /// `y` belongs to the new `r`. Returns the residual.
    pub(super) fn newton(
        &mut self,
        problem: &P,
        r: &mut [f64],
        tolerance: f64,
        most: usize,
    ) -> f64 {
        let mut residual = self.residual(r);
        for _ in 0..most {
            if residual <= tolerance || !residual.is_finite() || budget::over() {
                break;
            }
            if !self.newton_step(problem, r) {
                // No direction, or none that helps.
                let before = residual;
                residual = self.gradient(problem, r, tolerance, RESCUE);
                if residual >= before {
                    break;
                }
                continue;
            }
            residual = self.residual(r);
        }
        residual
    }

    /// One damped Newton step; false where it does not help.
    fn newton_step(&mut self, problem: &P, r: &mut [f64]) -> bool {
        let Newton { p, q, phi } = &mut self.newton;
        for (c, (set, &w)) in self.sets.iter().zip(&self.unit).enumerate() {
            let rho = RHO / w;
            let at: [f64; D] = small::block(r, c);
            let x: [f64; D] = std::array::from_fn(|k| at[k] - rho * self.y[D * c + k]);
            let projected = set.project(&x);
            let jacobian = set.jacobian(&x);
            for k in 0..D {
                phi[D * c + k] = projected[k] - at[k]; //              −φ
                for l in 0..D {
                    p[c][k][l] = rho * jacobian[k][l];
                    q[c][k][l] = f64::from(u8::from(k == l)) - jacobian[k][l];
                }
            }
        }
        let merit = weighted_map(&self.sets, &self.unit, RHO, r, &self.y);
        if problem.linearise(&mut self.state, p, q).is_err() {
            return false;
        }
        let left = problem.solve_linearised(&mut self.state, phi, &mut self.d, &mut self.wd);
        if !left.is_finite() {
            return false;
        }
        let mut t = 1.0;
        for _ in 0..=HALVINGS {
            for i in 0..r.len() {
                self.trial[i] = r[i] + t * self.d[i];
                self.trial_y[i] = self.y[i] + t * self.wd[i];
            }
            let now = weighted_map(&self.sets, &self.unit, RHO, &self.trial, &self.trial_y);
            if now <= (1.0 - 1e-4 * t) * merit {
                r.copy_from_slice(&self.trial);
                self.evaluate(problem, r);
                return true;
            }
            t *= 0.5;
        }
        false
    }
}

fn add_shift<const D: usize>(shift: &[f64], y: &mut [f64]) {
    for (c, s) in shift.iter().enumerate() {
        y[D * c] += s;
    }
}

fn project_all<const D: usize>(sets: &[Set<D>], x: &[f64], out: &mut [f64]) {
    for (c, set) in sets.iter().enumerate() {
        out[D * c..D * c + D].copy_from_slice(&set.project(&small::block(x, c)));
    }
}

/// `Σ (w_c/ρ)² ‖r_c − P(r_c − ρ y_c/w_c)‖²`: squares of velocities.
fn weighted_map<const D: usize>(
    sets: &[Set<D>],
    unit: &[f64],
    rho: f64,
    r: &[f64],
    y: &[f64],
) -> f64 {
    let mut sum = 0.0;
    for (c, (set, &w)) in sets.iter().zip(unit).enumerate() {
        let x: [f64; D] = std::array::from_fn(|k| r[D * c + k] - rho / w * y[D * c + k]);
        let p = set.project(&x);
        let square: f64 = (0..D).map(|k| (r[D * c + k] - p[k]).powi(2)).sum();
        sum += (w / rho) * (w / rho) * square;
    }
    sum
}

#[cfg(test)]
mod tests {
    use nonsmooth_problem::FrictionLocal;
    use nonsmooth_problem::planted::Planted;

    use super::*;
    use crate::contact::optimisation::inner::{CylinderSolver, Cylinders, Effort};

    fn problem(dofs: usize, seed: u64) -> FrictionLocal<3> {
        Planted { contacts: 12, dofs, seed, mu: (0.1, 0.6), ..Planted::default() }.local().0
    }

    #[test]
    fn the_solvers_agree_on_cylinders() {
        // 36 unknowns; the last two W have the ranks 30 and 12.
        for (dofs, seed) in [(60, 1), (60, 2), (30, 3), (12, 4)] {
            let problem = problem(dofs, seed);
            let theta: Vec<f64> = (0..12).map(|c| 0.05 * (c % 4) as f64).collect();
            let mut velocities = vec![];
            for choice in [
                CylinderSolver::ActiveSet,
                CylinderSolver::ProjectedGradient,
                CylinderSolver::Conic,
            ] {
                let mut inner = Cylinders::new(&problem, choice).unwrap();
                for (set, theta) in inner.convex.sets.iter_mut().zip(&theta) {
                    *set = Set::Cylinder(*theta);
                }
                let mut r = vec![0.0; 36];
                inner.convex.evaluate(&problem, &r);
                let most = if choice == CylinderSolver::ProjectedGradient { 100_000 } else { 100 };
                let effort = Effort { tolerance: 1e-12, most, polish: 20 };
                let reached = inner.solve(&problem, &mut r, &theta, choice, effort).unwrap();
                assert!(reached <= 1e-12, "{choice:?} {dofs}: {reached:.1e}");
                for (set, r) in inner.convex.sets.iter().zip(r.chunks(3)) {
                    let r: [f64; 3] = r.try_into().unwrap();
                    let p = set.project(&r);
                    assert!((0..3).all(|k| (p[k] - r[k]).abs() < 1e-9), "{choice:?} {r:?}");
                }
                velocities.push(inner.convex.y);
            }
            for other in &velocities[1..] {
                let gaps = other.iter().zip(&velocities[0]).map(|(a, b)| (a - b).abs());
                let off = gaps.fold(0.0_f64, f64::max);
                assert!(off < 1e-9, "dofs {dofs}: {off:.1e}");
            }
        }
    }
}
