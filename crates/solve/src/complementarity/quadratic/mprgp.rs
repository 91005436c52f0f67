//! **MPRGP**: conjugate gradients on the present face, gradient projections to add bounds to it, proportioning to drop them.
//!
//! Problem: `−w_i ∈ N_[l_i, u_i](z_i)`, `w = M z + q`, M symmetric positive semidefinite: the minimum of `φ(z) = ½zᵀMz + qᵀz` on `[l, u]`.
//!
//! Method: with the free gradient `φ` (w_i where z_i is strictly inside) and the chopped gradient `β` (the part of w_i that pushes z_i off its bound), a point is
//! *proportional* if `‖β‖² ≤ Γ² φ̃ᵀφ`, φ̃ the reduced free gradient. A proportional point takes a conjugate gradient step on its face; where that would leave the
//! bounds, it goes as far as it can and then takes a projected gradient step `P(z − ᾱ φ)`. Any other point takes a step along β. All in the metric of the diagonal D of M, which
//! is conjugate gradients with diagonal preconditioning and makes the method indifferent to the units of single variables.
//!
//! References: DostalSchoberl2005; Dostal2009, chapter 5.
//!
//! Cost of a step: one product with M, two where the face changes. Storage: five vectors; M by its products only.
//! Fails: needs a symmetric M without negative diagonal. Where M is not positive semidefinite, or φ has no lower bound on `[l, u]`, it ends on a ray. Steps grow with the root of the
//! condition of D⁻¹M.

use nonsmooth_linalg::Matrix;
use nonsmooth_problem::LcpPoint;
use nonsmooth_problem::check::Certificate;
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use crate::complementarity::form::{Bounded, Bounds, System, system};
use crate::core::ranges::{at_least, below, positive};
use crate::core::register::{About, Described, Solves};
use crate::core::settings::{Settings, described};
use crate::{SolveError, Solver, Step};

/// When bounds are dropped, and how long the projected steps are.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields, default)]
pub struct Mprgp {
    /// Γ: how large the gradient at the bounds may be, in units of that inside, before bounds are dropped; positive.
    pub gamma: f64,
    /// The length of the projected gradient step in units of 1/‖D⁻¹M‖, in (0, 2).
    pub expansion: f64,
    /// Steps between two evaluations of the true residual, unless the estimate asks for one earlier.
    pub check_every: usize,
}

impl Default for Mprgp {
    fn default() -> Self {
        Self { gamma: 2.0, expansion: 1.9, check_every: 50 }
    }
}

impl Settings for Mprgp {
    fn validate(&self) -> Result<(), String> {
        positive("gamma", self.gamma)?;
        below("expansion", self.expansion, 2.0)?;
        at_least("check_every", self.check_every, 1)
    }
}

impl Described for Mprgp {
    const ABOUT: &'static About = &About {
        name: "mprgp",
        family: "quadratic",
        solves: Solves::Law,
        summary: "conjugate gradients on the face, gradient projections between faces; by products only",
        needs: &["a symmetric positive semidefinite M"],
        cites: &["DostalSchoberl2005", "Dostal2009"],
        variants: &["gamma=0.1"],
        settings: described::<Self>,
    };
}

/// The gradient with its free and chopped parts, and the direction with its product.
#[derive(Debug, Clone, Default)]
pub struct ProportioningWork {
    /// D.
    d: Vec<f64>,
    /// w.
    g: Vec<f64>,
    /// The direction: z moves along −p.
    p: Vec<f64>,
    mp: Vec<f64>,
    /// ‖D⁻¹M‖, estimated.
    norm: f64,
    scale: f64,
    /// ᾱ.
    alpha: f64,
    steps: usize,
    at: Gradients,
}

/// The sizes of the parts of the gradient, squared, in the metric of D.
#[derive(Debug, Clone, Copy, Default)]
struct Gradients {
    /// `‖β‖²`.
    chopped: f64,
    /// `φ̃ᵀφ`.
    reduced: f64,
    /// The natural residual, in the unit of q.
    residual: f64,
}

/// Steps after which w is computed anew; the direction stays, for a new start would cost more than what it corrects.
const DRIFT: usize = 50;

/// The largest `|M_ij − M_ji|`, in units of the largest entry, of a matrix that counts as symmetric.
const SYMMETRIC: f64 = 1e-12;

/// Products for the estimate of ‖D⁻¹M‖.
const POWERS: usize = 12;

impl<P: Bounded> Solver<P> for Mprgp {
    type Work = ProportioningWork;

    fn work(&self, problem: &P) -> Result<ProportioningWork, SolveError> {
        let mut work = ProportioningWork::default();
        work.fill(&problem.system()?)?;
        Ok(work)
    }

    fn refill(&self, problem: &P, work: &mut ProportioningWork) -> Result<(), SolveError> {
        work.fill(&problem.system()?)
    }

    fn start(&self, problem: &P, point: &mut LcpPoint, work: &mut ProportioningWork) {
        let system = system(problem);
        let project = |(i, z): (usize, &mut f64)| *z = system.bounds.project(i, *z);
        point.z.iter_mut().enumerate().for_each(project);
        work.alpha = self.expansion / work.norm;
        work.steps = 0;
        work.renew(&system, &point.z);
        work.at = work.gradients(&system.bounds, &point.z);
    }

    fn step(&self, problem: &P, point: &mut LcpPoint, work: &mut ProportioningWork) -> Step {
        let system = system(problem);
        let bounds = system.bounds;
        let z = &mut point.z;
        work.steps += 1;
        if work.steps.is_multiple_of(DRIFT) {
            work.gradient(&system, z);
        }
        let proportional = work.at.chopped <= self.gamma.powi(2) * work.at.reduced;
        if !proportional {
            work.chopped_direction(&bounds, z);
        }
        product(system.matrix, &work.p, &mut work.mp);
        let Taken { slope, alpha, blocked, curvature } = work.longest(&bounds, z);
        if slope <= 0.0 {
            if work.at.residual == 0.0 {
                return Step::Done;
            }
            // Rounding has spoilt the conjugate direction; that of the gradient has a slope.
            work.renew(&system, z);
            work.at = work.gradients(&bounds, z);
            return Step::Continue { estimate: work.at.residual / work.scale };
        }
        if alpha == f64::INFINITY {
            // φ falls for ever: M p = 0, and −p is a Farkas vector.
            let y = work.p.iter().map(|p| -p).collect();
            return Step::NoSolution(Certificate::Farkas { y });
        }
        for i in 0..z.len() {
            z[i] = bounds.project(i, z[i] - alpha * work.p[i]);
            work.g[i] -= alpha * work.mp[i];
        }
        if blocked && proportional {
            work.expand(&system, z);
        } else if proportional && curvature > 0.0 {
            work.conjugate(&bounds, z, curvature);
        } else {
            work.free_direction(&bounds, z);
        }
        work.at = work.gradients(&bounds, z);
        Step::Continue { estimate: work.at.residual / work.scale }
    }

    fn check_every(&self, _: &Self::Work) -> usize {
        self.check_every
    }
}

/// A step along −p.
struct Taken {
    /// `wᵀp`.
    slope: f64,
    /// Infinite where nothing ends the way.
    alpha: f64,
    /// A bound cut it short.
    blocked: bool,
    /// `pᵀMp`.
    curvature: f64,
}

impl ProportioningWork {
    fn fill(&mut self, system: &System) -> Result<(), SolveError> {
        let n = system.dim();
        let Self { d, g, p, mp, scale, .. } = self;
        for x in [&mut *g, &mut *p, &mut *mp] {
            x.resize(n, 0.0);
        }
        *scale = system.scale();
        d.clear();
        match system.matrix {
            Matrix::Dense(a) => d.extend((0..n).map(|i| a[(i, i)])),
            Matrix::Sparse(a) => d.extend((0..n).map(|i| a.get(i, i))),
            Matrix::Operator(a) => d.extend(a.diagonal().unwrap_or_else(|| vec![1.0; n])),
        }
        if let Some(i) = d.iter().position(|d| *d < 0.0) {
            let found = format!("M[{i}, {i}] = {}", d[i]);
            return Err(SolveError::needs("a positive semidefinite M", found));
        }
        // A zero diagonal is that of a row of zeros; any positive number is a metric for it.
        let mean = d.iter().sum::<f64>() / n as f64;
        let mean = if mean > 0.0 { mean } else { 1.0 };
        d.iter_mut().filter(|d| **d == 0.0).for_each(|d| *d = mean);
        let asymmetry = asymmetry(system.matrix, g, p, mp);
        if asymmetry > SYMMETRIC {
            let found = format!("max |M_ij - M_ji| / max |M_ij| = {asymmetry:.1e}");
            return Err(SolveError::needs("a symmetric M", found));
        }
        self.norm = self.power(system.matrix);
        Ok(())
    }

    /// ‖D⁻¹M‖ by the power method, which tends to it from below.
    fn power(&mut self, matrix: &Matrix) -> f64 {
        let Self { d, p, mp, .. } = self;
        p.iter_mut().enumerate().for_each(|(i, p)| *p = noise(i) / d[i].sqrt());
        let mut norm = 0.0_f64;
        for _ in 0..POWERS {
            product(matrix, p, mp);
            let (mut energy, mut size) = (0.0, 0.0);
            for i in 0..p.len() {
                energy += p[i] * mp[i];
                size += d[i] * p[i] * p[i];
            }
            norm = norm.max(energy / size);
            let length = size.sqrt();
            for i in 0..p.len() {
                p[i] = mp[i] / (d[i] * length);
            }
        }
        // D itself, where M is zero or the estimate is none.
        if norm > 0.0 && norm.is_finite() { 1.1 * norm } else { 1.0 }
    }

    /// `w = M z + q`.
    fn gradient(&mut self, system: &System, z: &[f64]) {
        product(system.matrix, z, &mut self.g);
        self.g.iter_mut().zip(system.q).for_each(|(g, q)| *g += q);
    }

    /// w, and the direction from there.
    fn renew(&mut self, system: &System, z: &[f64]) {
        self.gradient(system, z);
        self.free_direction(&system.bounds, z);
    }

    /// `p = D⁻¹φ`.
    fn free_direction(&mut self, bounds: &Bounds, z: &[f64]) {
        for i in 0..z.len() {
            self.p[i] = free(bounds, i, z[i], self.g[i]) / self.d[i];
        }
    }

    /// `p = D⁻¹β`.
    fn chopped_direction(&mut self, bounds: &Bounds, z: &[f64]) {
        for i in 0..z.len() {
            self.p[i] = chopped(bounds, i, z[i], self.g[i]) / self.d[i];
        }
    }

    /// The next direction, M-conjugate to the last.
    fn conjugate(&mut self, bounds: &Bounds, z: &[f64], curvature: f64) {
        let mut product = 0.0;
        for i in 0..z.len() {
            product += free(bounds, i, z[i], self.g[i]) / self.d[i] * self.mp[i];
        }
        let gamma = product / curvature;
        for i in 0..z.len() {
            self.p[i] = free(bounds, i, z[i], self.g[i]) / self.d[i] - gamma * self.p[i];
        }
    }

    /// The projected gradient step from a point that has met a bound.
    fn expand(&mut self, system: &System, z: &mut [f64]) {
        let before = energy(&self.g, system.q, z);
        for i in 0..z.len() {
            let phi = free(&system.bounds, i, z[i], self.g[i]);
            z[i] = system.bounds.project(i, z[i] - self.alpha / self.d[i] * phi);
        }
        self.renew(system, z);
        let after = energy(&self.g, system.q, z);
        // Only ᾱ > 2/‖D⁻¹M‖ lets φ grow: the estimate of the norm was too low.
        if after > before + 1e-12 * before.abs() {
            self.alpha *= 0.5;
        }
    }

    /// How far to go along −p.
    fn longest(&self, bounds: &Bounds, z: &[f64]) -> Taken {
        let (mut slope, mut curvature, mut size) = (0.0, 0.0, 0.0);
        let mut most = f64::INFINITY;
        for i in 0..z.len() {
            let p = self.p[i];
            slope += self.g[i] * p;
            curvature += p * self.mp[i];
            size += self.d[i] * p * p;
            if p > 0.0 {
                most = most.min((z[i] - bounds.lower(i)) / p);
            } else if p < 0.0 {
                most = most.min((z[i] - bounds.upper(i)) / p);
            }
        }
        // At the level of the rounding in M p.
        let flat = curvature <= 1e-15 * self.norm * size;
        let alpha = if flat { f64::INFINITY } else { slope / curvature };
        let curvature = if flat { 0.0 } else { curvature };
        Taken { slope, alpha: alpha.min(most), blocked: alpha > most, curvature }
    }

    fn gradients(&self, bounds: &Bounds, z: &[f64]) -> Gradients {
        let mut at = Gradients::default();
        for i in 0..z.len() {
            let (g, d) = (self.g[i], self.d[i]);
            let beta = chopped(bounds, i, z[i], g);
            if beta != 0.0 {
                at.chopped += beta * beta / d;
                at.residual += beta * beta;
            }
            let phi = free(bounds, i, z[i], g);
            if phi != 0.0 {
                let room =
                    (if phi > 0.0 { z[i] - bounds.lower(i) } else { bounds.upper(i) - z[i] }) * d;
                at.reduced += phi.abs().min(room / self.alpha) * phi.abs() / d;
                at.residual += phi.abs().min(room).powi(2);
            }
        }
        at.residual = at.residual.sqrt();
        at
    }
}

/// `φ_i`: w_i strictly between the bounds, else 0.
#[inline]
fn free(bounds: &Bounds, i: usize, z: f64, g: f64) -> f64 {
    if z > bounds.lower(i) && z < bounds.upper(i) { g } else { 0.0 }
}

/// `β_i`: at a bound, the part of w_i that pushes z_i inside.
#[inline]
fn chopped(bounds: &Bounds, i: usize, z: f64, g: f64) -> f64 {
    let (lower, upper) = (bounds.lower(i), bounds.upper(i));
    if z <= lower && z >= upper {
        0.0
    } else if z <= lower {
        g.min(0.0)
    } else if z >= upper {
        g.max(0.0)
    } else {
        0.0
    }
}

/// `φ = ½ zᵀ(w + q)`.
fn energy(g: &[f64], q: &[f64], z: &[f64]) -> f64 {
    0.5 * z.iter().zip(g).zip(q).map(|((z, g), q)| z * (g + q)).sum::<f64>()
}

/// `y = M x`, M symmetric: by columns, which a sparse matrix has at hand.
fn product(matrix: &Matrix, x: &[f64], y: &mut [f64]) {
    match matrix {
        Matrix::Sparse(a) => y.iter_mut().enumerate().for_each(|(j, y)| *y = a.column_dot(j, x)),
        _ => matrix.mul(x, y),
    }
}

/// How far M is from symmetric; of an operator `|yᵀMx − xᵀMy|` for two vectors.
fn asymmetry(matrix: &Matrix, x: &mut [f64], y: &mut [f64], product: &mut [f64]) -> f64 {
    match matrix {
        Matrix::Dense(_) => matrix.asymmetry().unwrap_or(f64::INFINITY),
        Matrix::Sparse(a) => {
            let (mut worst, mut largest) = (0.0_f64, 0.0_f64);
            for (i, j, v) in a.triplets() {
                largest = largest.max(v.abs());
                worst = worst.max((v - a.get(j, i)).abs());
            }
            if largest > 0.0 { worst / largest } else { 0.0 }
        }
        Matrix::Operator(a) => {
            x.iter_mut().enumerate().for_each(|(i, x)| *x = noise(2 * i));
            y.iter_mut().enumerate().for_each(|(i, y)| *y = noise(2 * i + 1));
            a.mul(x, product);
            let one: f64 = y.iter().zip(&*product).map(|(y, mx)| y * mx).sum();
            let size: f64 = y.iter().zip(&*product).map(|(y, mx)| (y * mx).abs()).sum();
            a.mul(y, product);
            let other: f64 = x.iter().zip(&*product).map(|(x, my)| x * my).sum();
            if size > 0.0 { (one - other).abs() / size } else { 0.0 }
        }
    }
}

/// Pseudo-random in (−1, 1), the same for the same index.
fn noise(k: usize) -> f64 {
    // Weyl's sequence, spread by a sine.
    let x = (k as f64 * 0.618_033_988_749_895).fract() * 12_345.678;
    (x.sin() * 1e4).fract()
}
