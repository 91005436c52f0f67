//! A problem of pairs in units in which its entries are about one.
//!
//! `E (Q Z) z' + E (R S) s' + E c/θ = 0` with `z = θ Z z'`, `s = θ S s'`; E, Z, S are diagonal and, like θ, powers of two, so that both problems are the
//! same to the last bit.
//!
//! Path following sees products `x_i s_i`, and a problem stays monotone only where `Z_i S_i` is the same for all pairs. With R = −I that is
//! `E = Z` up to a factor, which is what a symmetric M gets. Of any other M the scaling that makes all its row and column sums equal is found first;
//! where E and Z then differ by more than a factor of a thousand between pairs, the rows and columns were evidently scaled by different hands,
//! and this undoes it; else both are replaced by their mean.

use nonsmooth_linalg::{Compensated, Csc, Dense, Matrix};

use crate::complementarity::form::Equations;

/// Sweeps over the matrix in search of a scaling.
const SWEEPS: usize = 30;
/// E/Z may differ by this factor between pairs before it counts as intended.
const SPREAD: f64 = 1e3;

/// The scaled problem, and the units in which the judge sees its residuals.
#[derive(Debug, Clone, Default)]
pub struct Scaled {
    congruent: bool,
    /// E Q Z.
    pub matrix: Option<Matrix>,
    /// E R S; none where it is −I.
    pub slack: Option<Matrix>,
    /// E c/θ.
    pub c: Vec<f64>,
    /// How many variables are free (u): the first ones of z.
    pub free: usize,
    /// Whether the matrix is symmetric (and there is no R).
    pub symmetric: bool,
    e: Vec<f64>,
    dz: Vec<f64>,
    ds: Vec<f64>,
    theta: f64,
    /// The unit of each row that q makes, see [`LinearGauge`](nonsmooth_problem::check::LinearGauge).
    units: Vec<f64>,
    /// Sizes of rows and columns: while the scaling is sought, and of errors at the point judged.
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
        self.find_units(|_| 0.0);
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

    /// m: pairs `(x_i, s_i)`, without the free variables.
    pub fn pairs(&self) -> usize {
        self.dim() - self.free
    }

    /// E Q Z of the problem that was scaled last.
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

    /// Tells the units of rows about bounds of z, in scaled units.
    pub fn bounded(&mut self, lower: &[f64], upper: &[f64]) {
        self.find_units(|j| {
            let least = lower[j].abs().min(upper[j].abs());
            if least.is_finite() { least } else { 0.0 }
        });
    }

    /// What q, and bounds of this size, make of each row: once from q to the columns and back, then on to rows that have nothing yet.
    fn find_units(&mut self, bound: impl Fn(usize) -> f64) {
        let n = self.c.len();
        let Self { matrix, slack, c, units, sizes: [next, of_z, of_s], .. } = self;
        let matrix = matrix.as_ref().expect("filled");
        units.clear();
        units.extend(c.iter().map(|c| c.abs()));
        for v in [&mut *next, &mut *of_z, &mut *of_s] {
            v.clear();
            v.resize(n, 0.0);
        }
        of_z.iter_mut().enumerate().for_each(|(j, x)| *x = bound(j));
        let parts = [Some(matrix), slack.as_ref()];
        for generation in 0..4 {
            for (a, of) in parts.iter().zip([&mut *of_z, &mut *of_s]) {
                next.fill(0.0);
                if let Some(a) = a {
                    a.for_each(|i, j, x| {
                        if x != 0.0 && (generation == 0 || of[j] == 0.0) {
                            next[j] = next[j].max(units[i] / x.abs());
                        }
                    });
                }
                of.iter_mut().zip(next.iter()).for_each(|(to, x)| *to = to.max(*x));
            }
            next.fill(0.0);
            for (a, of) in parts.iter().zip([&*of_z, &*of_s]) {
                if let Some(a) = a {
                    a.for_each(|i, j, x| {
                        if generation == 0 || units[i] == 0.0 {
                            next[i] = next[i].max(x.abs() * of[j]);
                        }
                    });
                }
            }
            units.iter_mut().zip(next.iter()).for_each(|(to, x)| *to = to.max(*x));
            if units.iter().all(|x| *x > 0.0) {
                break;
            }
        }
        units.iter_mut().filter(|x| **x == 0.0).for_each(|x| *x = f64::INFINITY);
    }

    /// What an error of a row, and a distance of z or s from a bound, count at (z, s): as the judge has it, whose units are the same in every scaling.
    fn find_effects(&mut self, z: &[f64], s: &[f64]) {
        let Self { matrix, slack, c, units, sizes: [scale, of_z, of_s], .. } = self;
        let matrix = matrix.as_ref().expect("filled");
        scale.iter_mut().zip(c.iter()).for_each(|(d, c)| *d = c.abs());
        matrix.for_each(|i, j, x| scale[i] += (x * z[j]).abs());
        if let Some(slack) = slack {
            slack.for_each(|i, j, x| scale[i] += (x * s[j]).abs());
        }
        scale.iter_mut().zip(units.iter()).for_each(|(d, unit)| *d = d.min(*unit));
        of_z.fill(0.0);
        matrix.for_each(|i, j, x| of_z[j] = of_z[j].max(error(x, scale[i])));
        if let Some(slack) = slack {
            of_s.fill(0.0);
            slack.for_each(|i, j, x| of_s[j] = of_s[j].max(error(x, scale[i])));
        }
    }

    /// The residual as the judge measures it, of a problem without R and with bounds in scaled units, from z between them and `w = M z + c`.
    pub fn merit_between(&mut self, z: &[f64], w: &[f64], lower: &[f64], upper: &[f64]) -> f64 {
        self.find_effects(z, &[]);
        let [scale, of_z, _] = &self.sizes;
        let mut worst = Worst::default();
        for i in 0..z.len() {
            let part = error(w[i], scale[i]);
            let bound = if w[i] > 0.0 { lower[i] } else { upper[i] };
            worst.add(if bound.is_finite() {
                part.min((z[i] - bound).abs() * of_z[i])
            } else {
                part
            });
        }
        worst.value()
    }

    /// The residual as the judge measures it, from z, s and `r = Q z + R s + c`.
    pub fn merit(&mut self, z: &[f64], s: &[f64], r: &[f64]) -> f64 {
        self.find_effects(z, s);
        let free = self.free;
        let [scale, of_z, of_s] = &self.sizes;
        let mut worst = Worst::default();
        for i in 0..z.len() {
            match &self.slack {
                None if i < free => worst.add(error(r[i], scale[i])),
                None => {
                    let w = s[i - free] + r[i];
                    let (x, part) = (z[i].abs() * of_z[i], error(w, scale[i]));
                    worst.add(if w > 0.0 { part.min(x) } else { part });
                    worst.add(if z[i] < 0.0 { x } else { 0.0 });
                }
                Some(_) => {
                    let (x, y) = (z[i].abs() * of_z[i], s[i].abs() * of_s[i]);
                    worst.add(error(r[i], scale[i]));
                    worst.add(x.min(y));
                    worst.add(if z[i] < 0.0 { x } else { 0.0 });
                    worst.add(if s[i] < 0.0 { y } else { 0.0 });
                }
            }
        }
        worst.value()
    }
}

/// The largest number met, infinite after one that is none.
#[derive(Default)]
struct Worst(f64);

impl Worst {
    fn add(&mut self, x: f64) {
        self.0 = if x.is_nan() { f64::INFINITY } else { self.0.max(x) };
    }

    fn value(self) -> f64 {
        self.0
    }
}

/// `|x|/d`, 0/0 = 0.
fn error(x: f64, d: f64) -> f64 {
    if x == 0.0 { 0.0 } else { x.abs() / d }
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
