//! The projection on a polyhedron by a dual active-set method.
//!
//! ```text
//! min ½ ‖y − p‖²,  g_k y ≥ h_k,  = h_k
//! ```
//!
//! From y = p, the solution without constraints, one violated constraint after the other is made active: y moves along the part of its normal that is orthogonal to the active ones,
//! multipliers along with it; those that would become negative leave. Each step raises the dual function, so the method ends; an empty polyhedron shows by a direction of
//! unlimited ascent. Source: GoldfarbIdnani1983, section 3, with the identity for the matrix. Cost: for k active rows `n k` operations a step, and about 2k steps.

use nonsmooth_linalg::{Csc, budget};

/// Rows that are nearer than this to the span of others lie in it, and excesses smaller than this in units of what cancels in them are none.
const ROUNDING: f64 = 1e-13;

/// The rows of norm 1, those of equalities first, and what steps need.
#[derive(Debug, Clone)]
pub(super) struct Polyhedron {
    n: usize,
    equalities: usize,
    rows: Vec<Vec<f64>>,
    rhs: Vec<f64>,
    /// Of the active rows, with the sign of the side that they hold on: an orthonormal basis, R by columns, multipliers.
    active: Vec<(usize, f64)>,
    basis: Vec<Vec<f64>>,
    columns: Vec<Vec<f64>>,
    multipliers: Vec<f64>,
}

#[allow(non_snake_case)]
impl Polyhedron {
    pub(super) fn new(A: &Csc, b: &[f64], C: &Csc, d: &[f64]) -> Self {
        let n = A.ncols();
        let k = C.nrows();
        let mut rows = vec![vec![0.0; n]; k + A.nrows()];
        C.triplets().for_each(|(i, j, x)| rows[i][j] = x);
        A.triplets().for_each(|(i, j, x)| rows[k + i][j] = -x);
        let mut rhs: Vec<f64> = d.iter().copied().chain(b.iter().map(|b| -b)).collect();
        for (row, rhs) in rows.iter_mut().zip(&mut rhs) {
            let size = nonsmooth_linalg::norm(row);
            if size > 0.0 {
                row.iter_mut().for_each(|g| *g /= size);
                *rhs /= size;
            }
        }
        let (active, basis, columns, multipliers) = Default::default();
        Self { n, equalities: k, rows, rhs, active, basis, columns, multipliers }
    }

    pub(super) fn dim(&self) -> usize {
        self.n
    }

    /// `y = P(p)`. False where the polyhedron is empty, or the time is over.
    pub(super) fn onto(&mut self, p: &[f64], y: &mut [f64]) -> bool {
        y.copy_from_slice(p);
        self.active.clear();
        self.basis.clear();
        self.columns.clear();
        self.multipliers.clear();
        // Each step raises the dual function; rounding may not for ever.
        for _ in 0..10 * (self.rows.len() + 1) {
            if budget::over() {
                return false;
            }
            let Some((k, sign)) = self.violated(y) else { return true };
            if !self.enter(k, sign, y) {
                return false;
            }
        }
        true
    }

    /// `h_k − g_k y`, and what cancels in it.
    fn excess(&self, k: usize, y: &[f64]) -> (f64, f64) {
        let terms = || self.rows[k].iter().zip(y).map(|(g, y)| g * y);
        let (h, sum, sizes) =
            (self.rhs[k], terms().sum::<f64>(), terms().map(f64::abs).sum::<f64>());
        (h - sum, sizes + h.abs())
    }

    /// The constraint that is violated most, equalities first, and its side.
    fn violated(&self, y: &[f64]) -> Option<(usize, f64)> {
        let inactive = |k: &usize| self.active.iter().all(|(active, _)| active != k);
        let worst = |rows: std::ops::Range<usize>, both: bool| {
            let each = rows.filter(inactive).map(|k| {
                let (excess, size) = self.excess(k, y);
                let share = if size > 0.0 { excess / size } else { 0.0 };
                (k, if both { share.abs() } else { share }, excess.signum())
            });
            let worst = each.max_by(|a, b| a.1.total_cmp(&b.1))?;
            (worst.1 > ROUNDING).then_some((worst.0, worst.2))
        };
        let all = self.rows.len();
        worst(0..self.equalities, true).or_else(|| worst(self.equalities..all, false))
    }

    /// Moves y until constraint k holds on its side, with equality. False where nothing makes it hold, or the time is over.
    fn enter(&mut self, k: usize, sign: f64, y: &mut [f64]) -> bool {
        let g: Vec<f64> = self.rows[k].iter().map(|g| sign * g).collect();
        let mut multiplier = 0.0;
        loop {
            if budget::over() {
                return false;
            }
            // z, the part of g that is orthogonal to the active rows, and g − z = Σ r_j g_j.
            let mut z = g.clone();
            let along = self.orthogonalise(&mut z);
            let square: f64 = z.iter().map(|z| z * z).sum();
            let r = self.upwards(along.clone());
            let independent = square.sqrt() > 1e-10;
            let whole =
                if independent { sign * self.excess(k, y).0 / square } else { f64::INFINITY };
            // The multiplier of an inequality that vanishes first.
            let vanishing = (0..self.active.len())
                .filter(|&j| self.active[j].0 >= self.equalities && r[j] > ROUNDING);
            let first = vanishing
                .map(|j| (self.multipliers[j] / r[j], j))
                .min_by(|a, b| a.0.total_cmp(&b.0));
            let step = first.map_or(whole, |(t, _)| t.min(whole));
            if !step.is_finite() {
                return false;
            }
            let step = step.max(0.0);
            self.multipliers.iter_mut().zip(&r).for_each(|(u, r)| *u -= step * r);
            multiplier += step;
            if independent {
                y.iter_mut().zip(&z).for_each(|(y, z)| *y += step * z);
            }
            match first {
                Some((t, j)) if t < whole => self.leave(j),
                _ => {
                    self.append(z, along);
                    self.active.push((k, sign));
                    self.multipliers.push(multiplier);
                    return true;
                }
            }
        }
    }

    /// `R⁻¹ c`
    fn upwards(&self, mut c: Vec<f64>) -> Vec<f64> {
        for j in (0..c.len()).rev() {
            let column = &self.columns[j];
            c[j] /= column[j];
            let top = c[j];
            c[..j].iter_mut().zip(column).for_each(|(c, r)| *c -= r * top);
        }
        c
    }

    /// Takes the j-th active row out; the basis of those after it is made again, as far as the time reaches.
    fn leave(&mut self, j: usize) {
        self.active.remove(j);
        self.multipliers.remove(j);
        self.basis.truncate(j);
        self.columns.truncate(j);
        for at in j..self.active.len() {
            if budget::over() {
                return;
            }
            let (k, sign) = self.active[at];
            let mut z: Vec<f64> = self.rows[k].iter().map(|g| sign * g).collect();
            let along = self.orthogonalise(&mut z);
            self.append(z, along);
        }
    }

    /// Takes the part of z in the span of the active rows off; its coordinates in the basis.
    fn orthogonalise(&self, z: &mut [f64]) -> Vec<f64> {
        let mut along = vec![0.0; self.basis.len()];
        // Twice is enough.
        for _ in 0..2 {
            for (q, along) in self.basis.iter().zip(&mut along) {
                let c: f64 = q.iter().zip(&*z).map(|(q, z)| q * z).sum();
                z.iter_mut().zip(q).for_each(|(z, q)| *z -= c * q);
                *along += c;
            }
        }
        along
    }

    fn append(&mut self, mut z: Vec<f64>, mut along: Vec<f64>) {
        let size = nonsmooth_linalg::norm(&z);
        z.iter_mut().for_each(|z| *z /= size);
        along.push(size);
        self.basis.push(z);
        self.columns.push(along);
    }
}
