//! A problem of pairs in units in which its entries are about one.
//!
//! `E (Q Z) z' + E (R S) s' + E c/θ = 0` with `z = θ Z z'`, `s = θ S s'`; E, Z, S are diagonal and, like θ, powers of two, so that both problems are the
//! same to the last bit.
//!
//! Path following sees products `x_i s_i`, and a problem stays monotone only where `Z_i S_i` is the same for all pairs. With R = −I that is
//! `E = Z` up to a factor, which is what a symmetric M gets. Of any other M the scaling that makes all its row and column sums equal is found first;
//! where E and Z then differ by more than a factor of a thousand between pairs, the rows and columns were evidently scaled by different hands,
//! and this undoes it; else both are replaced by their mean.

use nonsmooth_problem::linalg::{Compensated, Csc, Dense, Matrix, norm};

use crate::form::Equations;

/// Sweeps over the matrix in search of a scaling.
const SWEEPS: usize = 30;
/// E/Z may differ by this factor between pairs before it counts as intended.
const SPREAD: f64 = 1e3;

/// The scaled problem, and the weights with which the judge sees its residuals.
#[derive(Debug, Clone, Default)]
pub struct Scaled {
    congruent: bool,
    /// E Q Z.
    pub matrix: Option<Matrix>,
    /// E R S; none where it is −I.
    pub slack: Option<Matrix>,
    /// E c/θ.
    pub c: Vec<f64>,
    /// The number of free variables.
    pub free: usize,
    /// Whether the matrix is symmetric (and there is no R).
    pub symmetric: bool,
    e: Vec<f64>,
    dz: Vec<f64>,
    ds: Vec<f64>,
    theta: f64,
    norm_q: f64,
    abs_q: Vec<f64>,
    /// Largest modulus and sum of moduli: of rows of M; with R of columns of Q, R and rows of both.
    largest: Vec<f64>,
    sums: Vec<f64>,
    slack_largest: Vec<f64>,
    slack_sums: Vec<f64>,
    /// Sizes of rows and columns while the scaling is sought.
    sizes: [Vec<f64>; 3],
}

impl Scaled {
    /// With E = Z whatever the matrix, for methods that need `Z M Z` to be monotone where M is. Empty, to be filled.
    pub fn congruent() -> Self {
        Self { congruent: true, ..Self::default() }
    }

    /// Takes another problem; memory is kept.
    pub fn refill(&mut self, problem: &Equations) {
        let Equations { matrix, slack, q, free } = *problem;
        let n = q.len();
        self.free = free;
        self.symmetric = slack.is_none() && symmetric(matrix);
        for v in &mut self.sizes {
            v.resize(n, 0.0);
        }
        for v in [&mut self.e, &mut self.dz] {
            v.clear();
            v.resize(n, 1.0);
        }
        match slack {
            None if self.symmetric => self.symmetric_scaling(matrix),
            None => self.general_scaling(matrix),
            Some(slack) => self.horizontal_scaling(matrix, slack),
        }
        for x in self.e.iter_mut().chain(&mut self.dz) {
            *x = power_of_two(*x);
        }
        self.ds.clear();
        match slack {
            None => self.ds.extend(self.e[free..].iter().map(|e| 1.0 / e)),
            Some(_) => self.ds.extend(self.dz.iter().map(|z| 1.0 / z)),
        }
        let Self { e, dz, ds, .. } = self;
        refill_scaled(&mut self.matrix, matrix, e, dz);
        match slack {
            None => self.slack = None,
            Some(slack) => refill_scaled(&mut self.slack, slack, e, ds),
        }
        let sign = if slack.is_some() { -1.0 } else { 1.0 };
        let largest = q.iter().zip(&self.e).fold(0.0_f64, |l, (q, e)| l.max((q * e).abs()));
        self.theta = if largest > 0.0 { power_of_two(largest) } else { 1.0 };
        self.c.clear();
        self.c.extend(q.iter().zip(&self.e).map(|(q, e)| sign * q * e / self.theta));
        self.norm_q = norm(q);
        self.abs_q.clear();
        self.abs_q.extend(q.iter().map(|q| q.abs()));
        for v in [&mut self.largest, &mut self.sums, &mut self.slack_largest, &mut self.slack_sums]
        {
            v.clear();
            v.resize(n, 0.0);
        }
        let by_column = slack.is_some();
        matrix.for_each(|i, j, x| {
            let k = if by_column { j } else { i };
            self.largest[k] = self.largest[k].max(x.abs());
            self.sums[i] += x.abs();
        });
        if let Some(slack) = slack {
            slack.for_each(|i, j, x| {
                self.slack_largest[j] = self.slack_largest[j].max(x.abs());
                self.slack_sums[i] += x.abs();
            });
        }
        let all = self.largest.iter_mut().chain(&mut self.sums);
        for x in all.chain(&mut self.slack_largest).chain(&mut self.slack_sums) {
            if *x == 0.0 {
                *x = 1.0;
            }
        }
    }

    /// E = Z with entries of at most about one.
    fn symmetric_scaling(&mut self, m: &Matrix) {
        let Self { e, sizes: [largest, ..], .. } = self;
        for _ in 0..3 {
            largest.fill(0.0);
            m.for_each(|i, j, x| largest[i] = largest[i].max((e[i] * x * e[j]).abs()));
            e.iter_mut().zip(largest.iter()).for_each(|(d, l)| *d /= root(*l));
        }
        self.dz.copy_from_slice(&self.e);
    }

    /// Equal sums of rows and columns, near enough; then one E = Z for all, unless the problem was made to differ.
    fn general_scaling(&mut self, m: &Matrix) {
        let Self { e, dz: d, sizes: [rows, columns, _], .. } = &mut *self;
        for _ in 0..SWEEPS {
            rows.fill(0.0);
            columns.fill(0.0);
            m.for_each(|i, j, x| {
                let size = (e[i] * x * d[j]).abs();
                rows[i] += size;
                columns[j] += size;
            });
            e.iter_mut().zip(rows.iter()).for_each(|(e, r)| *e /= root(*r));
            d.iter_mut().zip(columns.iter()).for_each(|(d, c)| *d /= root(*c));
            let off = rows.iter().chain(columns.iter()).filter(|x| **x > 0.0);
            if off.fold(1.0_f64, |l, x| l.max(x.max(1.0 / x))) < 1.2 {
                break;
            }
        }
        let ratio = |(e, d): (&f64, &f64)| e / d;
        let pairs = || self.e[self.free..].iter().zip(&self.dz[self.free..]).map(ratio);
        let most = pairs().fold(0.0_f64, f64::max);
        let least = pairs().fold(f64::INFINITY, f64::min);
        if self.congruent || most <= SPREAD * least {
            let from = if self.congruent { 0 } else { self.free };
            for (e, d) in self.e.iter_mut().zip(&mut self.dz).skip(from) {
                let mean = (*e * *d).sqrt();
                (*e, *d) = (mean, mean);
            }
        }
    }

    /// Columns of Q and R of equal size, then rows of about one.
    fn horizontal_scaling(&mut self, q: &Matrix, r: &Matrix) {
        let Self { e, dz: d, sizes: [of_q, of_r, rows], .. } = self;
        for v in [&mut *of_q, &mut *of_r, &mut *rows] {
            v.fill(0.0);
        }
        q.for_each(|_, j, x| of_q[j] = of_q[j].max(x.abs()));
        r.for_each(|_, j, x| of_r[j] = of_r[j].max(x.abs()));
        for (d, (q, r)) in d.iter_mut().zip(of_q.iter().zip(of_r.iter())) {
            if *q > 0.0 && *r > 0.0 {
                *d = root(r / q);
            }
        }
        q.for_each(|i, j, x| rows[i] = rows[i].max((x * d[j]).abs()));
        r.for_each(|i, j, x| rows[i] = rows[i].max((x / d[j]).abs()));
        for (e, row) in e.iter_mut().zip(rows.iter()) {
            if *row > 0.0 {
                *e = 1.0 / row;
            }
        }
    }

    /// The number of rows, and of z.
    pub fn dim(&self) -> usize {
        self.c.len()
    }

    /// The number of pairs.
    pub fn pairs(&self) -> usize {
        self.dim() - self.free
    }

    /// The scaled matrix.
    pub fn matrix(&self) -> &Matrix {
        self.matrix.as_ref().expect("filled")
    }

    /// z and s in the caller's units to scaled ones.
    pub fn enter(&self, z: &mut [f64], s: &mut [f64]) {
        z.iter_mut().zip(&self.dz).for_each(|(z, d)| *z /= self.theta * d);
        s.iter_mut().zip(&self.ds).for_each(|(s, d)| *s /= self.theta * d);
    }

    /// z and s in scaled units to the caller's.
    pub fn leave(&self, z: &mut [f64], s: &mut [f64]) {
        z.iter_mut().zip(&self.dz).for_each(|(z, d)| *z *= self.theta * d);
        s.iter_mut().zip(&self.ds).for_each(|(s, d)| *s *= self.theta * d);
    }

    /// A combination of scaled rows as one of the caller's: `y = E y'`.
    pub fn rows_leave(&self, y: &mut [f64]) {
        y.iter_mut().zip(&self.e).for_each(|(y, e)| *y *= e);
    }

    /// A bound of variable j, in scaled units.
    pub fn bound(&self, j: usize, bound: f64) -> f64 {
        bound / (self.theta * self.dz[j])
    }

    /// `r = Q z + R s + c`.
    pub fn residual(&self, z: &[f64], s: &[f64], r: &mut [f64]) {
        self.matrix().mul(z, r);
        r.iter_mut().zip(&self.c).for_each(|(r, c)| *r += c);
        match &self.slack {
            None => r[self.free..].iter_mut().zip(s).for_each(|(r, s)| *r -= s),
            Some(Matrix::Sparse(slack)) => slack.mul_add(1.0, s, r),
            Some(slack) => {
                if let Matrix::Dense(d) = slack {
                    for (i, r) in r.iter_mut().enumerate() {
                        *r += d.row(i).iter().zip(s).map(|(a, s)| a * s).sum::<f64>();
                    }
                }
            }
        }
    }

    /// [`residual`](Self::residual) in doubled precision, with room for the sums.
    pub fn residual_precisely(
        &self,
        z: &[f64],
        s: &[f64],
        r: &mut [f64],
        sums: &mut Vec<Compensated>,
    ) {
        sums.clear();
        sums.extend(self.c.iter().map(|&c| Compensated::from(c)));
        self.matrix().for_each(|i, j, x| sums[i].add_product(x, z[j]));
        match &self.slack {
            None => sums[self.free..].iter_mut().zip(s).for_each(|(r, s)| r.add(-s)),
            Some(slack) => {
                slack.for_each(|i, j, x| sums[i].add_product(x, s[j]));
            }
        }
        r.iter_mut().zip(sums.iter()).for_each(|(r, sum)| *r = sum.value());
    }

    /// `w = M z + c` of a problem without R, in doubled precision.
    pub fn product_precisely(&self, z: &[f64], w: &mut [f64], sums: &mut Vec<Compensated>) {
        sums.clear();
        sums.extend(self.c.iter().map(|&c| Compensated::from(c)));
        self.matrix().for_each(|i, j, x| sums[i].add_product(x, z[j]));
        w.iter_mut().zip(sums.iter()).for_each(|(w, sum)| *w = sum.value());
    }

    /// The residual as the judge measures it, of a problem without R and with bounds in scaled units, from z between them and `w = M z + c`.
    pub fn merit_between(&self, z: &[f64], w: &[f64], lower: &[f64], upper: &[f64]) -> f64 {
        let unit = if self.norm_q > 0.0 { self.norm_q } else { 1.0 };
        let reach =
            z.iter().zip(&self.dz).fold(0.0_f64, |l, (z, d)| l.max((z * d).abs())) * self.theta;
        let (mut sum, mut worst) = (0.0, 0.0_f64);
        for i in 0..z.len() {
            let to_z = self.theta * self.dz[i];
            let w = self.theta / self.e[i] * w[i];
            // w, or less where a bound is nearer.
            let natural = |s: f64| match w > 0.0 {
                true => w.min(s * to_z * (z[i] - lower[i])),
                false => w.max(s * to_z * (z[i] - upper[i])),
            };
            sum += (natural(self.largest[i]) / unit).powi(2);
            let terms = self.abs_q[i] + self.sums[i] * reach;
            let row = natural(self.sums[i]).abs();
            worst = worst.max(if terms > 0.0 { row / terms } else { row });
        }
        let merit = sum.sqrt().max(worst);
        if merit.is_nan() { f64::INFINITY } else { merit }
    }

    /// The residual as the judge measures it, from z, s and `r = Q z + R s + c`: the larger of the relative one and the worst row.
    pub fn merit(&self, z: &[f64], s: &[f64], r: &[f64]) -> f64 {
        let unit = if self.norm_q > 0.0 { self.norm_q } else { 1.0 };
        let largest = |v: &[f64], d: &[f64]| {
            v.iter().zip(d).fold(0.0_f64, |l, (v, d)| l.max((v * d).abs())) * self.theta
        };
        let z_reach = largest(z, &self.dz);
        let (mut sum, mut worst) = (0.0, 0.0_f64);
        let mut add = |residual: f64, row: f64, terms: f64| {
            sum += (residual / unit).powi(2);
            // A row without terms is compared with itself.
            worst = worst.max(if terms > 0.0 { row.abs() / terms } else { row.abs() });
        };
        match &self.slack {
            None => {
                for i in 0..z.len() {
                    let unit = self.theta / self.e[i];
                    let terms = self.abs_q[i] + self.sums[i] * z_reach;
                    if i < self.free {
                        add(unit * r[i], unit * r[i], terms);
                    } else {
                        let w = unit * (s[i - self.free] + r[i]);
                        let z = self.theta * self.dz[i] * z[i];
                        add((self.largest[i] * z).min(w), (self.sums[i] * z).min(w), terms);
                    }
                }
            }
            Some(_) => {
                let s_reach = largest(s, &self.ds);
                for i in 0..z.len() {
                    let w = self.theta / self.e[i] * r[i];
                    let terms =
                        self.abs_q[i] + self.sums[i] * z_reach + self.slack_sums[i] * s_reach;
                    add(w, w, terms);
                    let x = self.largest[i] * self.theta * self.dz[i] * z[i];
                    let y = self.slack_largest[i] * self.theta * self.ds[i] * s[i];
                    add(x.min(y), 0.0, 0.0);
                }
            }
        }
        let merit = sum.sqrt().max(worst);
        if merit.is_nan() { f64::INFINITY } else { merit }
    }
}

/// Whether `a_ij = a_ji` to the last bits of the largest entry.
fn symmetric(m: &Matrix) -> bool {
    let mut largest = 0.0_f64;
    m.for_each(|_, _, x| largest = largest.max(x.abs()));
    let near = |a: f64, b: f64| (a - b).abs() <= 1e-15 * largest;
    match m {
        Matrix::Dense(m) => (0..m.nrows()).all(|i| (0..i).all(|j| near(m[(i, j)], m[(j, i)]))),
        Matrix::Sparse(m) => m.triplets().all(|(i, j, x)| i == j || near(x, m.get(j, i))),
        Matrix::Operator(_) => false,
    }
}

/// `√x`, 1 of nothing.
fn root(x: f64) -> f64 {
    if x > 0.0 { x.sqrt() } else { 1.0 }
}

/// The power of two nearest to x > 0 in ratio, within a range whose products are safe.
fn power_of_two(x: f64) -> f64 {
    x.log2().round().clamp(-300.0, 300.0).exp2()
}

/// `out = diag(e) a diag(d)`, in the memory of `out` where its storage is alike.
fn refill_scaled(out: &mut Option<Matrix>, a: &Matrix, e: &[f64], d: &[f64]) {
    match (&mut *out, a) {
        (Some(Matrix::Dense(to)), Matrix::Dense(a))
            if (to.nrows(), to.ncols()) == (a.nrows(), a.ncols()) =>
        {
            scale_dense(to, a, e, d);
        }
        (Some(Matrix::Sparse(to)), Matrix::Sparse(a)) if alike(to, a) => scale_sparse(to, a, e, d),
        (_, Matrix::Dense(a)) => {
            let mut to = Dense::zeros(a.nrows(), a.ncols());
            scale_dense(&mut to, a, e, d);
            *out = Some(to.into());
        }
        (_, Matrix::Sparse(a)) => {
            let mut to = a.clone();
            scale_sparse(&mut to, a, e, d);
            *out = Some(to.into());
        }
        (_, Matrix::Operator(_)) => *out = None,
    }
}

/// The same pattern.
pub fn alike(a: &Csc, b: &Csc) -> bool {
    a.nrows() == b.nrows() && a.col_ptr() == b.col_ptr() && a.row_idx() == b.row_idx()
}

fn scale_dense(to: &mut Dense, a: &Dense, e: &[f64], d: &[f64]) {
    for (i, e) in e.iter().enumerate() {
        let row = to.row_mut(i).iter_mut().zip(a.row(i)).zip(d);
        row.for_each(|((to, a), d)| *to = e * a * d);
    }
}

fn scale_sparse(to: &mut Csc, a: &Csc, e: &[f64], d: &[f64]) {
    let mut k = 0;
    let values = to.values_mut();
    for (j, d) in d.iter().enumerate() {
        let (rows, column) = a.column(j);
        for (&i, x) in rows.iter().zip(column) {
            values[k] = e[i] * x * d;
            k += 1;
        }
    }
}
