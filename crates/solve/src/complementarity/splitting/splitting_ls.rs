//! **Splitting with line search**: a sweep gives a direction, the energy says how far to go.
//!
//! Problem: `−w_i ∈ N_[l_i, u_i](z_i)`, `w = M z + q`, M symmetric: the stationary points of `φ(z) = ½zᵀMz + qᵀz` on `[l, u]`.
//!
//! Method: z* is what a PSOR sweep (or a Jacobi step) makes of z, `d = z* − z`. Then `z ← z + α d`: α = 1 where `dᵀMd ≤ 0`, else the minimiser
//! `−wᵀd / dᵀMd` of φ along d, cut back to where z stays within its bounds. φ falls in every step, also with a Jacobi step, which alone may diverge.
//!
//! References: Acary2018 (16)–(18), with φ as the objective in all three; CottlePangStone2009, section 5.5.
//!
//! Cost of a step: two passes over M (one with Jacobi), one more every 50 steps. Storage: M by rows, w, d, M d.
//! Fails: needs a symmetric M with positive diagonal. Where M is not positive semidefinite it finds stationary points only, and φ may have no lower bound.

use nonsmooth_problem::LcpPoint;
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use super::rows::{Pass, Rows, is_fixed, is_free};
use crate::complementarity::form::{Bounded, Bounds, System, system};
use crate::core::ranges::{at_least, below};
use crate::core::register::{About, Described, Solves};
use crate::core::settings::{Settings, described};
use crate::{SolveError, Solver, Step};

/// The splitting that gives the direction.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
pub enum Sweep {
    /// One sweep in the order of the indices.
    Psor,
    /// One projected step of every variable at once.
    Jacobi,
}

/// The sweep that gives the direction, and its relaxation.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields, default)]
pub struct SplittingLs {
    /// Where the direction comes from.
    pub sweep: Sweep,
    /// Relaxation of the sweep, in (0, 2).
    pub omega: f64,
    /// Steps between two evaluations of the true residual, unless the estimate asks for one earlier.
    pub check_every: usize,
}

impl Default for SplittingLs {
    fn default() -> Self {
        Self { sweep: Sweep::Psor, omega: 1.3, check_every: 50 }
    }
}

impl Settings for SplittingLs {
    fn validate(&self) -> Result<(), String> {
        below("omega", self.omega, 2.0)?;
        at_least("check_every", self.check_every, 1)
    }
}

impl Described for SplittingLs {
    const ABOUT: &'static About = &About {
        name: "splitting_ls",
        family: "splitting",
        solves: Solves::Law,
        summary: "a PSOR or Jacobi sweep gives the direction, an exact line search on the energy the step",
        needs: &["the entries of M", "a symmetric M", "a positive diagonal of M"],
        cites: &["Acary2018", "CottlePangStone2009"],
        variants: &["sweep=jacobi"],
        settings: described::<Self>,
    };
}

/// The workspace: M by rows, the steps, w, d, M d.
#[derive(Debug, Clone, Default)]
pub struct SearchedWork {
    rows: Rows,
    /// `ω / M_ii`.
    step: Vec<f64>,
    w: Vec<f64>,
    d: Vec<f64>,
    md: Vec<f64>,
    scale: f64,
    steps: usize,
}

/// Steps after which w is computed anew.
const DRIFT: usize = 50;

/// The largest `|M_ij − M_ji|`, in units of the largest entry, of a matrix that counts as symmetric.
const SYMMETRIC: f64 = 1e-12;

impl<P: Bounded> Solver<P> for SplittingLs {
    type Work = SearchedWork;

    fn work(&self, problem: &P) -> Result<SearchedWork, SolveError> {
        let mut work = SearchedWork::default();
        self.fill(&problem.system()?, &mut work)?;
        Ok(work)
    }

    fn refill(&self, problem: &P, work: &mut SearchedWork) -> Result<(), SolveError> {
        self.fill(&problem.system()?, work)
    }

    fn start(&self, problem: &P, point: &mut LcpPoint, work: &mut SearchedWork) {
        let bounds = system(problem).bounds;
        point.z.iter_mut().enumerate().for_each(|(i, z)| *z = bounds.project(i, *z));
        work.steps = 0;
    }

    fn step(&self, problem: &P, point: &mut LcpPoint, work: &mut SearchedWork) -> Step {
        let System { matrix, q, bounds } = system(problem);
        let SearchedWork { rows, step, w, d, md, scale, steps } = work;
        let z = &mut point.z;
        if steps.is_multiple_of(DRIFT) {
            rows.mul(matrix, z, w);
            w.iter_mut().zip(q).for_each(|(w, q)| *w += q);
        }
        *steps += 1;
        match self.sweep {
            Sweep::Psor => {
                d.clone_from(z);
                let pass = Pass { q, bounds, step, backward: false };
                rows.sweep(matrix, &pass, z, |_, _| 0.0, |_, _| {});
                // d = z* − z, and z back in its place.
                for (z, d) in z.iter_mut().zip(d.iter_mut()) {
                    let old = *d;
                    *d = *z - old;
                    *z = old;
                }
            }
            Sweep::Jacobi => {
                for (i, d) in d.iter_mut().enumerate() {
                    *d = bounds.project(i, z[i] - step[i] * w[i]) - z[i];
                }
            }
        }
        rows.mul(matrix, d, md);
        let alpha = along(z, d, w, md, &bounds); //                        (17), (18)
        let mut sum = 0.0;
        for i in 0..z.len() {
            sum += (rows.diagonal[i] * d[i]).powi(2);
            z[i] = bounds.project(i, z[i] + alpha * d[i]);
            w[i] += alpha * md[i];
        }
        Step::Continue { estimate: sum.sqrt() / (*scale * self.omega) }
    }

    fn check_every(&self, _: &Self::Work) -> usize {
        self.check_every
    }
}

impl SplittingLs {
    fn fill(&self, system: &System, work: &mut SearchedWork) -> Result<(), SolveError> {
        let SearchedWork { rows, step, w, d, md, scale, .. } = work;
        rows.fill(system)?;
        let asymmetry = rows.asymmetry(system.matrix);
        if asymmetry > SYMMETRIC {
            let found = format!("max |M_ij - M_ji| / max |M_ij| = {asymmetry:.1e}");
            return Err(SolveError::needs("a symmetric M", found));
        }
        rows.needs_diagonal(&system.bounds)?;
        for (i, &d) in rows.diagonal.iter().enumerate() {
            if d < 0.0 && is_free(&system.bounds, i) {
                let found = format!("M[{i}, {i}] = {d}");
                return Err(SolveError::needs("a positive diagonal of M", found));
            }
        }
        step.clear();
        step.extend(rows.diagonal.iter().enumerate().map(|(i, &d)| {
            if d == 0.0 || is_fixed(&system.bounds, i) { 0.0 } else { self.omega / d }
        }));
        for x in [w, d, md] {
            x.resize(system.dim(), 0.0);
        }
        *scale = system.scale();
        Ok(())
    }
}

/// The step along d: see the head of this file. `w = ∇φ(z)`.
fn along(z: &[f64], d: &[f64], w: &[f64], md: &[f64], bounds: &Bounds) -> f64 {
    let (mut slope, mut curvature, mut noise) = (0.0, 0.0, 0.0);
    let mut most = f64::INFINITY;
    for i in 0..z.len() {
        slope += w[i] * d[i];
        curvature += d[i] * md[i];
        noise += (d[i] * md[i]).abs();
        if d[i] < 0.0 {
            most = most.min((bounds.lower(i) - z[i]) / d[i]);
        } else if d[i] > 0.0 {
            most = most.min((bounds.upper(i) - z[i]) / d[i]);
        }
    }
    // Neither a curvature nor a slope at the level of rounding says how far to go.
    if curvature <= 1e-14 * noise || slope >= 0.0 {
        return 1.0;
    }
    (-slope / curvature).min(most.max(1.0))
}
