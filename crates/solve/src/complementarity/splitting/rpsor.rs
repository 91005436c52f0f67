//! **Regularised PSOR** (RPSOR): over-relaxed sweeps on `M + R` inside a proximal loop, for matrices with zeros on the diagonal.
//!
//! Problem: `−w_i ∈ N_[l_i, u_i](z_i)`, `w = M z + q`; an LCP is `l = 0, u = ∞`.
//!
//! Method: the proximal point method solves `−(w + R (z − z̃)) ∈ N(z)`, R = diag(ρ_i), and moves the centre z̃ to the solution; here by sweeps
//! `z_i ← P(z_i − ω/(M_ii + ρ_i) (w_i + ρ_i (z_i − z̃_i)))` until their moves are a fraction of the proximal move `R (z − z̃)`. `ρ_i = rho/s_i²`, where
//! the scales s make all rows of `s_i |M_ij| s_j` sum to about 1: that does not depend on units, and `M + R` is about diagonally dominant for rho = 1. rho falls while the sweeps need few steps, and rises, for good, where they do not converge. Equalities are taken with the sign
//! that suits a monotone problem.
//!
//! References: Acary2018 (14)(15), the latter with `+ρ(z_i − z̃_i)`; Rockafellar1976.
//!
//! Cost of a step: one pass over M. Storage: M by rows, z̃, ρ and the steps.
//! Fails: converges for monotone problems (M positive semidefinite), for others perhaps; needs a nonnegative diagonal. Slow where M is ill conditioned.

use nonsmooth_problem::LcpPoint;
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use super::rows::{Direction, Pass, Rows, is_fixed, is_free};
use crate::complementarity::form::{Bounded, System, system};
use crate::core::ranges::{at_least, below, positive};
use crate::core::register::{About, Described, Solves};
use crate::core::settings::{Settings, described};
use crate::{SolveError, Solver, Step};

/// The relaxation of the sweeps, and how strongly the proximal term regularises.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields, default)]
pub struct Rpsor {
    /// Relaxation of the sweeps, in (0, 2).
    pub omega: f64,
    /// The regularisation in units of the balanced row sums of |M|, positive. With adapt, the first one.
    pub rho: f64,
    /// Whether rho follows the number of sweeps that the inner problems take.
    pub adapt: bool,
    /// The inner residual, in units of the proximal move, at which the centre moves; in (0, 1).
    pub fraction: f64,
    /// The order of the visits.
    pub direction: Direction,
    /// Steps between two evaluations of the true residual, unless the estimate asks for one earlier.
    pub check_every: usize,
}

impl Default for Rpsor {
    fn default() -> Self {
        Self {
            omega: 1.2,
            rho: 1.0,
            adapt: true,
            fraction: 0.2,
            direction: Direction::Forward,
            check_every: 50,
        }
    }
}

impl Settings for Rpsor {
    fn validate(&self) -> Result<(), String> {
        below("omega", self.omega, 2.0)?;
        positive("rho", self.rho)?;
        below("fraction", self.fraction, 1.0)?;
        at_least("check_every", self.check_every, 1)
    }
}

impl Described for Rpsor {
    const ABOUT: &'static About = &About {
        name: "rpsor",
        family: "splitting",
        solves: Solves::Law,
        summary: "PSOR inside a proximal loop, for zeros on the diagonal",
        needs: &["the entries of M", "a nonnegative diagonal of M"],
        cites: &["Acary2018", "Rockafellar1976"],
        variants: &["adapt=false", "direction=symmetric"],
        settings: described::<Self>,
    };
}

/// The workspace: M by rows, the centre, the regularisation and the steps.
#[derive(Debug, Clone, Default)]
pub struct ProximalWork {
    rows: Rows,
    /// ±1, −1 only of equalities.
    signs: Vec<f64>,
    /// z̃.
    center: Vec<f64>,
    /// ρ_i for rho = 1.
    unit: Vec<f64>,
    /// ρ_i, with the sign of the row.
    rho: Vec<f64>,
    /// `ω / (M_ii + ρ_i)`, with the sign of the row.
    step: Vec<f64>,
    scale: f64,
    backward: bool,
    inner: Inner,
}

/// The inner problem's course.
#[derive(Debug, Clone, Copy, Default)]
struct Inner {
    /// rho now.
    rho: f64,
    /// rho goes no lower: the sweeps did not converge there.
    least: f64,
    /// Sweeps since the centre moved.
    sweeps: usize,
    /// The smallest moves among them.
    smallest: f64,
}

/// Inner sweeps after which rho may fall, and after which it rises.
const FEW: usize = 6;
const MANY: usize = 60;

/// Sweeps that balance |M|.
const BALANCES: usize = 8;

impl<P: Bounded> Solver<P> for Rpsor {
    type Work = ProximalWork;

    fn work(&self, problem: &P) -> Result<ProximalWork, SolveError> {
        let mut work = ProximalWork::default();
        work.fill(&problem.system()?)?;
        Ok(work)
    }

    fn refill(&self, problem: &P, work: &mut ProximalWork) -> Result<(), SolveError> {
        work.fill(&problem.system()?)
    }

    fn start(&self, problem: &P, point: &mut LcpPoint, work: &mut ProximalWork) {
        let bounds = system(problem).bounds;
        point.z.iter_mut().enumerate().for_each(|(i, z)| *z = bounds.project(i, *z));
        work.center.clone_from(&point.z);
        work.backward = false;
        work.inner = Inner { rho: self.rho, ..Inner::default() };
        work.regularise(&system(problem), self.omega);
    }

    fn step(&self, problem: &P, point: &mut LcpPoint, work: &mut ProximalWork) -> Step {
        let system = system(problem);
        let ProximalWork { rows, center, rho, step, scale, backward, inner, .. } = work;
        let pass = Pass { q: system.q, bounds: system.bounds, step, backward: *backward };
        let mut sum = 0.0;
        let note = |i: usize, move_i: f64| {
            sum += ((rows.diagonal[i] + rho[i]) * move_i).powi(2);
        };
        let proximal = |i: usize, z: f64| rho[i] * (z - center[i]); //    ρ_i (z_i − z̃_i)
        rows.sweep(system.matrix, &pass, &mut point.z, proximal, note);
        *backward = self.direction == Direction::Symmetric && !*backward;
        let moves = sum.sqrt() / self.omega;
        let each = point.z.iter().zip(center.iter()).zip(rho.iter());
        let pull = each.map(|((z, c), rho)| (rho * (z - c)).powi(2)).sum::<f64>().sqrt();
        inner.sweeps += 1;
        let estimate = (moves + pull) / *scale;
        let grown = inner.sweeps > 1 && moves > 10.0 * inner.smallest;
        inner.smallest = if inner.sweeps == 1 { moves } else { inner.smallest.min(moves) };
        if self.adapt && (grown || inner.sweeps >= MANY) {
            // Back to the last point that is known to be one.
            if grown {
                point.z.clone_from(center);
            }
            (inner.least, inner.sweeps) = (1.5 * inner.rho, 0);
            inner.rho *= 2.0;
            work.regularise(&system, self.omega);
        } else if moves <= self.fraction * pull {
            center.clone_from(&point.z);
            let few = inner.sweeps <= FEW;
            inner.sweeps = 0;
            if self.adapt && few && 0.7 * inner.rho >= inner.least {
                inner.rho *= 0.7;
                work.regularise(&system, self.omega);
            }
        }
        Step::Continue { estimate }
    }

    fn check_every(&self, _: &Self::Work) -> usize {
        self.check_every
    }
}

impl ProximalWork {
    fn fill(&mut self, system: &System) -> Result<(), SolveError> {
        self.rows.fill(system)?;
        for (i, &d) in self.rows.diagonal.iter().enumerate() {
            if d < 0.0 && !is_free(&system.bounds, i) && !is_fixed(&system.bounds, i) {
                let found = format!("M[{i}, {i}] = {d}");
                return Err(SolveError::needs("a nonnegative diagonal of M", found));
            }
        }
        self.rows.signs(system, &mut self.signs);
        self.scale = system.scale();
        self.equilibrate(system);
        Ok(())
    }

    /// `unit_i = 1/s_i²` such that the rows of `s_i |M_ij| s_j`, M taken symmetrically, have the sum 1, as far as some sweeps get.
    fn equilibrate(&mut self, system: &System) {
        let Self { unit, rho: sums, step: s, .. } = self;
        let n = system.dim();
        s.clear();
        s.resize(n, 1.0);
        for _ in 0..BALANCES {
            sums.clear();
            sums.resize(n, 0.0);
            system.matrix.for_each(|i, j, x| {
                let half = 0.5 * x.abs() * s[i] * s[j];
                sums[i] += half;
                sums[j] += half;
            });
            let balanced =
                |(s, sum): (&mut f64, &f64)| *s /= if *sum > 0.0 { sum.sqrt() } else { 1.0 };
            s.iter_mut().zip(&*sums).for_each(balanced);
        }
        unit.clear();
        unit.extend(s.iter().map(|s| 1.0 / (s * s)));
        // A variable that nothing depends on is regularised like the others are on average.
        let known = || sums.iter().zip(&*unit).filter(|(sum, _)| **sum > 0.0);
        let mean = known().map(|(_, unit)| unit).sum::<f64>() / known().count().max(1) as f64;
        let mean = if mean > 0.0 { mean } else { 1.0 };
        let unknown = unit.iter_mut().zip(&*sums).filter(|(_, sum)| **sum == 0.0);
        unknown.for_each(|(unit, _)| *unit = mean);
    }

    fn regularise(&mut self, system: &System, omega: f64) {
        let Self { rows, signs, unit, rho, step, inner, .. } = self;
        rho.clear();
        rho.extend(unit.iter().zip(&*signs).map(|(unit, sign)| sign * inner.rho * unit));
        step.clear();
        step.extend(rows.diagonal.iter().zip(&*rho).enumerate().map(|(i, (&d, &rho))| {
            if is_fixed(&system.bounds, i) { 0.0 } else { omega / (d + rho) }
        }));
    }
}
