//! **ADMM**, the alternating direction method of multipliers with exact projection on the cones.
//!
//! Problem: `u = W r + q`, `K* ∋ u + s ⟂ r ∈ K`, `s = mu‖u_T‖ e_N` for each contact.
//!
//! Method: r is split into r (for W) and z (for K), tied by scaled multipliers y in the metric `w_c = tr(W_cc)/D`:
//!
//! ```text
//! (W + (η + ρ) w) r⁺ = η w r + ρ w (z − y) − q − s,    s = mu‖u_T‖ e_N with the dual velocity u = −ρ w y,
//! t = α r⁺ + (1 − α) z + y,    z⁺ = P_K(t),    y⁺ = t − z⁺.
//! ```
//!
//! s moves with every iteration instead of in an outer loop, so the fixed points obey the exact law. The matrix is factorised once
//! for each ρ; ρ is fixed, or `√(λ_min λ_max)` of W in that metric, or from there balanced between the two residuals.
//! The iteration is Douglas–Rachford splitting, which asks W for monotony, not for symmetry: the full W is factorised,
//! and its skew part needs no treatment. (The rule for ρ from eigenvalues assumes symmetry; where W is not symmetric it is a guess.)
//!
//! References: Carpentier2024; BoydParikhChuPeleatoEckstein2011 for over-relaxation and balancing; EcksteinBertsekas1992 for the splitting;
//! WalkerNi2011 for the acceleration.
//!
//! Cost of a step: one solve with the factor, refined with products with W; at most `factorisations` factorisations a solve.
//! Storage: the factor of W in contact or velocity space and 9 vectors.
//! Fails: no proof with the moving s; W with a negative symmetric part; slow where no ρ suits all contacts.

use nonsmooth_linalg::{Block, small};
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use crate::contact::form::{Access, Frictional, Linearised, OnContacts};
use crate::contact::law::cone;
use crate::contact::parts::Accelerator;
use crate::core::ranges::{at_least, at_most, nonnegative};
use crate::core::register::{About, Described, Solves};
use crate::core::settings::{Settings, described};
use crate::{SolveError, Solver, Step};

/// How ρ is chosen and adapted, and how much is over-relaxed and extrapolated.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields, default)]
pub struct Admm {
    /// How rho is chosen.
    pub rule: RhoRule,
    /// The penalty in units of w_c; 0 takes the geometric mean of the extreme eigenvalues of W in that metric.
    pub rho: f64,
    /// Over-relaxation, in [1, 1.9].
    pub alpha: f64,
    /// The weight of the step from the last r, in units of w_c.
    pub eta: f64,
    /// Steps between two adaptations of rho.
    pub adapt_every: usize,
    /// At most this many factorisations in a solve, at least 2.
    pub factorisations: usize,
    /// Anderson acceleration with at most this many differences; 0 for none.
    pub anderson: usize,
    /// Steps between two evaluations of the true residual, unless the cheap estimate asks for one earlier.
    pub check_every: usize,
}

/// How ρ is chosen.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
pub enum RhoRule {
    /// rho throughout.
    Fixed,
    /// From rho, balanced between the primal and the dual residual.
    #[default]
    Balanced,
}

impl Default for Admm {
    fn default() -> Self {
        Self {
            rule: RhoRule::Balanced,
            rho: 0.0,
            alpha: 1.6,
            eta: 1e-6,
            adapt_every: 20,
            factorisations: 30,
            anderson: 0,
            check_every: 20,
        }
    }
}

impl Settings for Admm {
    fn validate(&self) -> Result<(), String> {
        nonnegative("rho", self.rho)?;
        nonnegative("eta", self.eta)?;
        if !(1.0..=1.9).contains(&self.alpha) {
            return Err(format!("alpha: expected a number in [1, 1.9], found {}", self.alpha));
        }
        at_least("factorisations", self.factorisations, 2)?;
        at_most("anderson", self.anderson, 50)?;
        at_least("adapt_every", self.adapt_every, 1)?;
        at_least("check_every", self.check_every, 1)
    }
}

impl Described for Admm {
    const ABOUT: &'static About = &About {
        name: "admm",
        family: "proximal",
        solves: Solves::Law,
        summary: "alternating direction method of multipliers with exact projection on the cones",
        needs: &[
            "W (or M) with a positive semidefinite symmetric part; the full W is factorised, so it need not be symmetric",
        ],
        cites: &["Carpentier2024", "EcksteinBertsekas1992", "BoydParikhChuPeleatoEckstein2011"],
        variants: &["rule=fixed", "alpha=1", "anderson=5"],
        settings: described::<Self>,
    };
}

/// The workspace: the problem's view with its factorisation, and the iterate.
pub struct StepsWork<P: Linearised<D> + Frictional<D>, const D: usize> {
    state: P::State,
    /// `w_c`, positive.
    unit: Vec<f64>,
    scale: f64,
    rho: f64,
    identity: Vec<Block<D>>,
    penalty: Vec<Block<D>>,
    q: Vec<f64>,
    r: Vec<f64>,
    z: Vec<f64>,
    y: Vec<f64>,
    t: Vec<f64>,
    right: Vec<f64>,
    wr: Vec<f64>,
    accelerator: Accelerator,
    factorisations: usize,
    steps: usize,
    failed: bool,
}

/// Eigenvalues below this part of the largest count as this part.
const LEAST_EIGENVALUE: f64 = 1e-4;
/// Enough for a guess.
const POWER_STEPS: usize = 15;
/// Residuals whose ratio is below this are balanced.
const BALANCED: f64 = 5.0;

impl<P: Linearised<D> + Frictional<D>, const D: usize> Solver<P> for OnContacts<Admm, D> {
    type Work = StepsWork<P, D>;

    fn work(&self, problem: &P) -> Result<Self::Work, SolveError> {
        let m = D * problem.mu().len();
        let mut work = StepsWork {
            state: problem.state(Access::Newton)?,
            unit: vec![],
            scale: 1.0,
            rho: 1.0,
            identity: vec![],
            penalty: vec![],
            q: vec![],
            r: vec![],
            z: vec![],
            y: vec![],
            t: vec![],
            right: vec![],
            wr: vec![],
            accelerator: Accelerator::new(self.0.anderson, m),
            factorisations: 0,
            steps: 0,
            failed: false,
        };
        work.fill(problem);
        Ok(work)
    }

    fn refill(&self, problem: &P, work: &mut Self::Work) -> Result<(), SolveError> {
        problem.refill(&mut work.state)?;
        work.fill(problem);
        Ok(())
    }

    fn start(&self, problem: &P, point: &mut P::Point, work: &mut Self::Work) {
        (work.factorisations, work.steps, work.failed) = (0, 0, false);
        work.accelerator.forget();
        work.rho = if self.0.rho > 0.0 { self.0.rho } else { work.spectral(problem) };
        work.factorise(problem, self.0.eta);
        // From the point: z on the cone, u of z, and its dual velocity on the dual cone.
        let start = P::impulses(point);
        problem.velocities(&mut work.state, start, &mut work.wr);
        for (c, &mu) in problem.mu().iter().enumerate() {
            let z = cone::project(&small::block::<D>(start, c), mu);
            let mut u: [f64; D] = small::block(&work.wr, c);
            u[0] += mu * cone::tangential_norm(&u);
            // P_K*(ũ) = ũ + P_K(−ũ).
            let polar = cone::project(&u.map(|x| -x), mu);
            for k in 0..D {
                let i = D * c + k;
                (work.r[i], work.z[i]) = (z[k], z[k]);
                work.y[i] = -(u[k] + polar[k]) / (work.rho * work.unit[c]);
            }
        }
    }

    fn step(&self, problem: &P, _: &mut P::Point, work: &mut Self::Work) -> Step {
        if let Some(ray) = problem.contradiction(&work.state) {
            return Step::NoSolution(ray.clone().into());
        }
        if work.failed {
            return Step::Stuck("W + rho w cannot be factorised".into());
        }
        let Admm { alpha, eta, .. } = self.0;
        let StepsWork { state, unit, rho, q, r, z, y, t, right, wr, accelerator, .. } = work;
        if accelerator.is_on() {
            for i in 0..t.len() {
                t[i] = z[i] + y[i];
            }
            accelerator.begin(t);
        }
        for (c, (&mu, &w)) in problem.mu().iter().zip(&*unit).enumerate() {
            let dual: [f64; D] = std::array::from_fn(|k| -*rho * w * y[D * c + k]);
            for i in D * c..D * c + D {
                right[i] = eta * w * r[i] + *rho * w * (z[i] - y[i]) - q[i];
            }
            right[D * c] -= mu * cone::tangential_norm(&dual);
        }
        let left = problem.solve_linearised(state, right, r, wr);
        if !left.is_finite() {
            return Step::Stuck("the linear system of a step has no finite solution".into());
        }
        for i in 0..t.len() {
            t[i] = alpha * r[i] + (1.0 - alpha) * z[i] + y[i];
        }
        if accelerator.is_on() {
            accelerator.advance(t, |i| unit[i / D]);
        }
        let (mut primal, mut dual) = (0.0, 0.0);
        for (c, (&mu, &w)) in problem.mu().iter().zip(&*unit).enumerate() {
            let on_cone = cone::project(&small::block::<D>(t, c), mu);
            for k in 0..D {
                let i = D * c + k;
                primal += (w * (r[i] - on_cone[k])).powi(2);
                dual += (*rho * w * (on_cone[k] - z[i])).powi(2);
                z[i] = on_cone[k];
                y[i] = t[i] - z[i];
            }
        }
        let (primal, dual) = (primal.sqrt() / work.scale, dual.sqrt() / work.scale);
        work.steps += 1;
        if self.0.rule == RhoRule::Balanced && work.steps.is_multiple_of(self.0.adapt_every) {
            work.balance(problem, &self.0, primal / dual);
        }
        Step::Continue { estimate: primal.max(dual) }
    }

    fn publish(&self, problem: &P, point: &mut P::Point, work: &mut Self::Work) {
        P::impulses(point).copy_from_slice(&work.z);
        problem.complete(&mut work.state, point);
    }

    fn check_every(&self, _: &Self::Work) -> usize {
        self.0.check_every
    }
}

impl<P: Linearised<D> + Frictional<D>, const D: usize> StepsWork<P, D> {
    fn fill(&mut self, problem: &P) {
        let n = problem.mu().len();
        self.scale = problem.velocity_scale(&self.state);
        problem.units(&self.state, &mut self.unit);
        self.identity.clear();
        self.identity.resize(n, diagonal(1.0));
        let vectors = [
            &mut self.q,
            &mut self.r,
            &mut self.z,
            &mut self.y,
            &mut self.t,
            &mut self.right,
            &mut self.wr,
        ];
        for x in vectors {
            x.clear();
            x.resize(D * n, 0.0);
        }
        self.accelerator.resize(D * n);
        problem.velocities(&mut self.state, &self.z, &mut self.q);
    }

    /// Factorises `W + (η + ρ) w`.
    fn factorise(&mut self, problem: &P, eta: f64) {
        let Self { state, unit, rho, identity, penalty, .. } = self;
        penalty.clear();
        penalty.extend(unit.iter().map(|w| diagonal((eta + *rho) * w)));
        self.failed = problem.linearise(state, identity, penalty).is_err();
        self.factorisations += 1;
    }

    /// `√(λ_min λ_max)` of W in the metric of w, by the power method on W and on the inverse of `W + ε w`.
    fn spectral(&mut self, problem: &P) -> f64 {
        let largest = self.power(|work, x, y| {
            problem.velocities(&mut work.state, x, y);
            for i in 0..y.len() {
                y[i] = (y[i] - work.q[i]) / work.unit[i / D];
            }
        });
        let shift = LEAST_EIGENVALUE * largest;
        self.rho = shift;
        self.factorise(problem, 0.0);
        if self.failed {
            return largest;
        }
        let inverse = self.power(|work, x, y| {
            for i in 0..x.len() {
                work.right[i] = work.unit[i / D] * x[i];
            }
            let StepsWork { state, right, wr, .. } = work;
            problem.solve_linearised(state, right, y, wr);
        });
        let smallest = (1.0 / inverse - shift).clamp(shift, largest);
        (smallest * largest).sqrt()
    }

    /// The largest eigenvalue of a map that is symmetric in the metric of w, in modulus.
    fn power(&mut self, map: impl Fn(&mut Self, &[f64], &mut [f64])) -> f64 {
        let (mut x, mut y) = (std::mem::take(&mut self.r), std::mem::take(&mut self.t));
        for (i, x) in x.iter_mut().enumerate() {
            *x = 1.0 + (i as f64 * 0.618_033_988_749_895).fract();
        }
        let mut eigenvalue = 1.0;
        for _ in 0..POWER_STEPS {
            let size = |x: &[f64], unit: &[f64]| {
                let squares = x.iter().enumerate().map(|(i, x)| unit[i / D] * x * x);
                squares.sum::<f64>().sqrt()
            };
            map(self, &x, &mut y);
            let (before, after) = (size(&x, &self.unit), size(&y, &self.unit));
            if !(after / before > 0.0 && (after / before).is_finite()) {
                eigenvalue = 1.0;
                break;
            }
            eigenvalue = after / before;
            x.iter_mut().zip(&y).for_each(|(x, y)| *x = y / after);
        }
        (self.r, self.t) = (x, y);
        eigenvalue
    }

    /// Another ρ where one residual is much larger than the other.
    fn balance(&mut self, problem: &P, settings: &Admm, ratio: f64) {
        let far = !(1.0 / BALANCED..=BALANCED).contains(&ratio);
        let possible = ratio > 0.0 && ratio.is_finite();
        if !far || !possible || self.factorisations >= settings.factorisations {
            return;
        }
        let factor = ratio.sqrt().clamp(0.1, 10.0);
        self.rho *= factor;
        // The multipliers are scaled by ρ.
        self.y.iter_mut().for_each(|y| *y /= factor);
        self.accelerator.forget();
        self.factorise(problem, settings.eta);
    }
}

/// `x I`.
fn diagonal<const D: usize>(x: f64) -> Block<D> {
    let mut block = [[0.0; D]; D];
    for k in 0..D {
        block[k][k] = x;
    }
    block
}

#[cfg(test)]
mod tests {
    use nonsmooth_linalg::{Bsr, Csc};
    use nonsmooth_problem::planted::Planted;
    use nonsmooth_problem::{FrictionLocal, Problem};

    use super::*;
    use crate::{Driver, Limits, Session, Status};

    /// One frictionless contact with `W = 2 I`, `q = (−2, 0)`, from r = 0: w = 2, `u = q`, `P_K*(q) = 0`, so y = 0. With ρ = 1, η = 0:
    /// `(2 + 2) r = 2`, r = 1/2; `t = 1.5 · 1/2`, z = 3/4, y = 0.
    #[test]
    fn a_step_by_hand() {
        let w = Bsr::from_csc(&Csc::diagonal(&[2.0; 2]));
        let problem = FrictionLocal::<2>::new(w, vec![-2.0, 0.0], vec![0.0]).unwrap();
        let settings = Admm { rho: 1.0, eta: 0.0, alpha: 1.5, ..Admm::default() };
        let solver = OnContacts::<_, 2>(settings);
        let mut work = solver.work(&problem).unwrap();
        let mut point = problem.origin();
        solver.start(&problem, &mut point, &mut work);
        let step = solver.step(&problem, &mut point, &mut work);
        solver.publish(&problem, &mut point, &mut work);
        assert!((work.r[0] - 0.5).abs() < 1e-12 && (point.r[0] - 0.75).abs() < 1e-12);
        // Primal 2 · 1/4 / 2, dual 2 · 3/4 / 2.
        assert!(matches!(step, Step::Continue { estimate } if (estimate - 0.75).abs() < 1e-12));
    }

    #[test]
    fn eigenvalues_give_rho() {
        let w = Bsr::from_csc(&Csc::diagonal(&[1.0, 3.0]));
        let problem = FrictionLocal::<2>::new(w, vec![-1.0, 0.0], vec![0.1]).unwrap();
        let solver = OnContacts::<_, 2>(Admm::default());
        let mut work = solver.work(&problem).unwrap();
        // w = 2: eigenvalues 1/2 and 3/2.
        assert!((work.spectral(&problem) - 0.75_f64.sqrt()).abs() < 1e-2);
    }

    #[test]
    fn skew_matrices_and_every_rule() {
        let planted = Planted { contacts: 15, dofs: 90, skew: 0.1, seed: 8, ..Planted::default() };
        let (problem, known) = planted.local::<3>();
        for (rule, rho, anderson) in [
            (RhoRule::Fixed, 1.0, 0),
            (RhoRule::Fixed, 0.0, 0),
            (RhoRule::Balanced, 100.0, 0),
            (RhoRule::Balanced, 0.0, 5),
        ] {
            let settings = Admm { rule, rho, anderson, ..Admm::default() };
            let mut driver = Driver::new(OnContacts::<_, 3>(settings));
            let mut point = problem.origin();
            let limits = Limits { tolerance: 1e-11, max_iterations: 50_000, ..Limits::default() };
            let outcome = driver.solve(&problem, &mut point, &limits, &mut |_| {}).unwrap();
            assert_eq!(outcome.status, Status::Solved, "{rule:?} {rho} {anderson}");
            assert!(outcome.factorisations <= 31);
            let size = known.r.iter().fold(0.0_f64, |m, x| m.max(x.abs()));
            let far = point.r.iter().zip(&known.r).fold(0.0_f64, |m, (a, b)| m.max((a - b).abs()));
            assert!(far < 1e-8 * size, "{far}");
        }
    }
}
