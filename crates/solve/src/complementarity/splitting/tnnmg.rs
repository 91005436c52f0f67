//! **TNNMG** (truncated nonsmooth Newton multigrid): Gauss–Seidel finds the face, multigrid solves the linear system on it.
//!
//! Problem: `−w_i ∈ N_[l_i, u_i](z_i)`, `w = M z + q`, M symmetric positive definite with a positive diagonal: the minimum of `½zᵀMz + qᵀz` on `[l, u]`.
//!
//! Method: projected Gauss–Seidel sweeps; then, on the face of the variables strictly inside their bounds, an approximate solution c of `M c = −w` by conjugate gradients,
//! preconditioned by a multigrid cycle from which what is at a bound is truncated (`aggregates.rs`); then z goes along the projected correction `P(z + c) − z`, as far as the
//! energy falls. A start at zero is replaced by that of a cascade: the same method on the aggregates, from the coarsest on.
//!
//! References: GraserKornhuber2009 (the method), Kornhuber1994 (truncation, monotone multigrid), Notay2010 and NotayVassilevski2008 (the preconditioner).
//!
//! Cost of a step: some 10 passes over M for each step of conjugate gradients. Storage: M by rows and half as much again.
//! Converges globally for symmetric positive definite M, and as fast as the linear solver once the face is found. On grids the steps hardly depend on the number of points.
//! Fails: needs a symmetric M with a positive diagonal. Where M is indefinite, Gauss–Seidel diverges. Positive entries off the diagonal make the aggregates poor.

use nonsmooth_linalg::{Csc, Matrix, budget};
use nonsmooth_problem::LcpPoint;
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use super::aggregates::{Level, cycle, levels, truncate};
use super::rows::{Rows, dot};
use crate::complementarity::form::{Bounded, Bounds, System, system};
use crate::core::ranges::{at_least, below};
use crate::core::register::{About, Described, Solves};
use crate::core::settings::{Settings, described};
use crate::{SolveError, Solver, Step};

/// How many sweeps find the face, and how closely the linear system on it is solved.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields, default)]
pub struct Tnnmg {
    /// Sweeps of projected Gauss-Seidel a step, in alternating directions.
    pub sweeps: usize,
    /// The linear system is solved to this part of its residual, in (0, 1).
    pub reduction: f64,
    /// At most this many steps of conjugate gradients for that.
    pub gradients: usize,
    /// Whether a start at zero is replaced by that of a cascade through the levels.
    pub cascade: bool,
}

impl Default for Tnnmg {
    fn default() -> Self {
        Self { sweeps: 4, reduction: 0.1, gradients: 10, cascade: true }
    }
}

impl Settings for Tnnmg {
    fn validate(&self) -> Result<(), String> {
        at_least("sweeps", self.sweeps, 1)?;
        below("reduction", self.reduction, 1.0)?;
        at_least("gradients", self.gradients, 1)
    }
}

impl Described for Tnnmg {
    const ABOUT: &'static About = &About {
        name: "tnnmg",
        family: "splitting",
        solves: Solves::Law,
        summary: "truncated nonsmooth Newton multigrid: Gauss-Seidel finds the face, aggregation multigrid solves on it",
        needs: &["the entries of M", "a symmetric M", "a positive diagonal of M"],
        cites: &["GraserKornhuber2009", "Kornhuber1994", "Notay2010", "NotayVassilevski2008"],
        variants: &["cascade=false"],
        settings: described::<Self>,
    };
}

/// The largest `|M_ij − M_ji|`, in units of the largest entry, of a matrix that counts as symmetric.
const SYMMETRIC: f64 = 1e-12;
/// Steps that do not halve the residual, after which it is over: the residual need not fall while the face grows, some rows of points a step.
const IDLE: usize = 50;
/// Steps on each level of the cascade.
const CASCADE: usize = 4;
/// Sweeps by which the stiffness of a level is compared with that of the next one.
const SMOOTH: usize = 6;

/// The hierarchy and the face.
#[derive(Debug, Clone, Default)]
pub struct TnnmgWork {
    levels: Vec<Level>,
    scale: f64,
    face: Face,
    /// The residual that is to be halved, and the steps since it was.
    mark: f64,
    since: usize,
}

/// Which variables are at a bound, as the hierarchy has it, and the vectors of the linear solves.
#[derive(Debug, Clone, Default)]
struct Face {
    fixed: Vec<bool>,
    /// `M z + q`.
    w: Vec<f64>,
    r: Vec<f64>,
    x: Vec<f64>,
    p: Vec<f64>,
    product: Vec<f64>,
    preconditioned: Vec<f64>,
    /// Steps of conjugate gradients so far.
    gradients: usize,
}

impl<P: Bounded> Solver<P> for Tnnmg {
    type Work = TnnmgWork;

    fn work(&self, problem: &P) -> Result<TnnmgWork, SolveError> {
        let system = problem.system()?;
        let mut rows = Rows::default();
        rows.fill(&system)?;
        rows.needs_diagonal(&system.bounds)?;
        let asymmetry = rows.asymmetry(system.matrix);
        if asymmetry > SYMMETRIC {
            let found = format!("max |M_ij - M_ji| / max |M_ij| = {asymmetry:.1e}");
            return Err(SolveError::needs("a symmetric M", found));
        }
        let copy;
        let matrix: &Csc = match system.matrix {
            Matrix::Sparse(a) => a,
            other => {
                copy = other.to_csc().unwrap_or_else(|| Csc::zeros(0, 0));
                &copy
            }
        };
        Ok(TnnmgWork { levels: levels(matrix), scale: system.scale(), ..TnnmgWork::default() })
    }

    fn start(&self, problem: &P, point: &mut LcpPoint, work: &mut TnnmgWork) {
        let system = system(problem);
        let z = &mut point.z;
        truncate(&mut work.levels, |_| false);
        if self.cascade && z.iter().all(|z| *z == 0.0) {
            self.descend(&mut work.levels, &system, z);
        }
        z.iter_mut().enumerate().for_each(|(i, z)| *z = system.bounds.project(i, *z));
        work.face.begin(z.len());
        (work.mark, work.since) = (f64::INFINITY, 0);
    }

    fn step(&self, problem: &P, point: &mut LcpPoint, work: &mut TnnmgWork) -> Step {
        let System { q, bounds, .. } = system(problem);
        let residual = self.improve(&mut work.levels, q, &bounds, &mut point.z, &mut work.face);
        work.since += 1;
        if residual <= 0.5 * work.mark {
            (work.mark, work.since) = (residual, 0);
        } else if work.since >= IDLE && residual > 0.0 {
            return Step::Stuck("no progress: the residual is not halved any more".into());
        }
        Step::Continue { estimate: residual / work.scale }
    }

    fn account(&self, work: &TnnmgWork) -> Vec<String> {
        let (levels, steps) = (work.levels.len(), work.face.gradients);
        vec![format!("{levels} levels, {steps} steps of conjugate gradients")]
    }

    fn check_every(&self, _: &Self::Work) -> usize {
        10
    }
}

impl Tnnmg {
    /// One step on the first of these levels; the natural residual, in the unit of q.
    fn improve(
        &self,
        levels: &mut [Level],
        q: &[f64],
        bounds: &Bounds,
        z: &mut [f64],
        face: &mut Face,
    ) -> f64 {
        let n = z.len();
        for k in (0..self.sweeps).take_while(|_| !budget::over()) {
            relax(&levels[0], q, bounds, z, k % 2 == 1);
        }
        let at_bound = |i: usize| z[i] <= bounds.lower(i) || z[i] >= bounds.upper(i);
        let known = face.fixed.len() == n && (0..n).all(|i| face.fixed[i] == at_bound(i));
        if !known {
            face.fixed.clear();
            face.fixed.extend((0..n).map(at_bound));
            truncate(levels, |i| face.fixed[i]);
        }
        levels[0].mul(z, &mut face.w);
        face.w.iter_mut().zip(q).for_each(|(w, q)| *w += q);
        self.solve(levels, face, known);
        let Face { w, x, p, product, .. } = face;
        let mut slope = 0.0;
        for i in 0..n {
            p[i] = bounds.project(i, z[i] + x[i]) - z[i];
            slope -= w[i] * p[i];
        }
        levels[0].mul(p, product);
        let curvature = dot(p, product);
        if slope > 0.0 {
            // As far as the energy falls, and no farther than the bounds, which are one step away or more.
            let room = |(i, p): (usize, &f64)| match *p {
                p if p > 0.0 => (bounds.upper(i) - z[i]) / p,
                p if p < 0.0 => (bounds.lower(i) - z[i]) / p,
                _ => f64::INFINITY,
            };
            let most = p.iter().enumerate().map(room).fold(f64::INFINITY, f64::min).max(1.0);
            let alpha = if curvature > 0.0 { (slope / curvature).min(most) } else { 1.0 };
            for i in 0..n {
                z[i] = bounds.project(i, z[i] + alpha * p[i]);
                w[i] += alpha * product[i];
            }
        }
        let diagonal = &levels[0].diagonal;
        let natural = |i: usize| z[i] - bounds.project(i, z[i] - w[i] / diagonal[i]);
        (0..n).map(|i| (diagonal[i] * natural(i)).powi(2)).sum::<f64>().sqrt()
    }

    /// `x ≈ M⁻¹ (−w)` on the face; more closely where the face is that of the step before.
    fn solve(&self, levels: &mut [Level], face: &mut Face, known: bool) {
        let Face { fixed, w, r, x, p, product, preconditioned, gradients } = face;
        x.fill(0.0);
        for (i, r) in r.iter_mut().enumerate() {
            *r = if levels[0].inverse[i] == 0.0 || fixed[i] { 0.0 } else { -w[i] };
        }
        let (reduction, most) = if known {
            (self.reduction.powi(3), 3 * self.gradients)
        } else {
            (self.reduction, self.gradients)
        };
        let target = reduction * dot(r, r).sqrt();
        let mut curvature = 0.0;
        for k in 0..most {
            if dot(r, r).sqrt() <= target || budget::over() {
                break;
            }
            *gradients += 1;
            cycle(levels, r, preconditioned);
            // Conjugate to the last direction; the preconditioner is another one each time.
            let beta = if k > 0 { dot(preconditioned, product) / curvature } else { 0.0 };
            p.iter_mut().zip(&*preconditioned).for_each(|(p, y)| *p = y - beta * *p);
            levels[0].mul(p, product);
            curvature = dot(p, product);
            if curvature <= 0.0 {
                break;
            }
            let alpha = dot(p, r) / curvature;
            for i in 0..x.len() {
                x[i] += alpha * p[i];
                if levels[0].inverse[i] != 0.0 {
                    r[i] -= alpha * product[i];
                }
            }
        }
    }

    /// A start by the same method on the aggregates, from the coarsest on: z constant on each, between the means of the bounds.
    ///
    /// Constants are too stiff a space for the derivatives in M: the loads are scaled up by how much so.
    fn descend(&self, levels: &mut [Level], system: &System, z: &mut [f64]) {
        let n = z.len();
        let bounds = (0..n).map(|i| (system.bounds.lower(i), system.bounds.upper(i)));
        let (lower, upper): (Vec<f64>, Vec<f64>) = bounds.unzip();
        let mut loads = vec![(system.q.to_vec(), lower, upper)];
        for k in 1..levels.len() {
            let (above, below) = levels.split_at_mut(k);
            let (fine, coarse) = (&above[k - 1], &below[0]);
            let (q, l, u) = &loads[k - 1];
            let mut sizes = vec![0.0; coarse.order()];
            fine.aggregate.iter().for_each(|&a| sizes[a as usize] += 1.0);
            let sum = |x: &[f64]| {
                let mut sum = vec![0.0; coarse.order()];
                fine.aggregate.iter().zip(x).for_each(|(&a, x)| sum[a as usize] += x);
                sum
            };
            let mean = |x: &[f64]| -> Vec<f64> {
                sum(x).iter().zip(&sizes).map(|(s, size)| s / size).collect()
            };
            let soft = softness(fine, coarse, &sizes);
            let next: Vec<f64> = sum(q).iter().map(|q| q / soft).collect();
            let (l, u) = (mean(l), mean(u));
            loads.push((next, l, u));
        }
        let mut coarser: Option<Vec<f64>> = None;
        for k in (1..levels.len()).rev() {
            let (q, lower, upper) = &loads[k];
            let bounds = Bounds::Box { lower, upper };
            let mut here = match (&coarser, levels[k].aggregate.is_empty()) {
                (Some(c), false) => levels[k].aggregate.iter().map(|&a| c[a as usize]).collect(),
                _ => vec![0.0; q.len()],
            };
            here.iter_mut().enumerate().for_each(|(i, z)| *z = bounds.project(i, *z));
            let mut face = Face::default();
            face.begin(q.len());
            truncate(&mut levels[k..], |_| false);
            for _ in 0..CASCADE {
                self.improve(&mut levels[k..], q, &bounds, &mut here, &mut face);
            }
            coarser = Some(here);
        }
        if let Some(coarse) = coarser {
            z.iter_mut().zip(&levels[0].aggregate).for_each(|(z, &a)| *z = coarse[a as usize]);
        }
        truncate(levels, |_| false);
    }
}

impl Face {
    fn begin(&mut self, n: usize) {
        self.fixed.clear();
        self.gradients = 0;
        let Self { w, r, x, p, product, preconditioned, .. } = self;
        for v in [w, r, x, p, product, preconditioned] {
            v.resize(n, 0.0);
        }
    }
}

/// One visit of every variable, each to where its row vanishes or to its bound.
fn relax(level: &Level, q: &[f64], bounds: &Bounds, z: &mut [f64], backward: bool) {
    let n = z.len();
    let mut visit = |i: usize| {
        let d = level.diagonal[i];
        if d > 0.0 {
            z[i] = bounds.project(i, z[i] - (q[i] + level.dot(i, z)) / d);
        }
    };
    if backward {
        (0..n).rev().for_each(&mut visit);
    } else {
        (0..n).for_each(&mut visit);
    }
}

/// The energy of a smooth vector that is constant on aggregates, smoothed on the finer level, in units of what it is on the coarse one; in (0, 1].
fn softness(fine: &Level, coarse: &Level, sizes: &[f64]) -> f64 {
    let zero = vec![0.0; fine.order()];
    let smooth = |level: &Level, v: &mut [f64], sweeps: usize| {
        for k in 0..sweeps {
            level.sweep(&zero[..v.len()], v, k % 2 == 1);
        }
    };
    let energy =
        |level: &Level, v: &[f64]| (0..v.len()).map(|i| v[i] * level.dot(i, v)).sum::<f64>();
    // Any vector without structure will do.
    let mut v: Vec<f64> =
        (0..coarse.order()).map(|i| (i as f64 * 0.618_033_988_749_895).fract() - 0.5).collect();
    smooth(coarse, &mut v, 2 * SMOOTH);
    let size: f64 = v.iter().zip(sizes).map(|(v, s)| s * v * v).sum();
    let on_coarse = energy(coarse, &v) / size;
    let mut v: Vec<f64> = fine.aggregate.iter().map(|&a| v[a as usize]).collect();
    smooth(fine, &mut v, SMOOTH);
    let on_fine = energy(fine, &v) / dot(&v, &v);
    let soft = on_fine / on_coarse;
    if soft > 0.0 && soft < 1.0 { soft } else { 1.0 }
}
