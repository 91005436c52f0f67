//! A problem in pure numbers: rows and columns of M scaled to entries of at most about one, q to a largest entry of about one.
//!
//! `ŵ = R w / σ`, `ẑ = C⁻¹ z / σ`, `M̂ = R M C`, `q̂ = R q / σ`. All factors are powers of two, so nothing is rounded: a residual of the scaled problem is one
//! of the problem itself. R and C come from alternate scaling by the roots of the largest entries (Ruiz2001).

use nonsmooth_linalg::{Compensated, Csc, Dense, Matrix};

use crate::SolveError;
use crate::complementarity::form::Rows;

/// Sweeps of the scaling; each halves the logarithm of what is left to do.
const SWEEPS: usize = 8;

/// M̂, q̂ and the bounds of ẑ, with the powers of two that lead back.
#[derive(Debug, Clone)]
pub struct Scaled {
    /// M̂. Sparse: with a stored entry wherever a row meets its own variable.
    pub matrix: Matrix,
    /// q̂.
    pub q: Vec<f64>,
    /// Lower bounds of ẑ; −∞ where there is none.
    pub lower: Vec<f64>,
    /// Upper bounds of ẑ; ∞ where there is none.
    pub upper: Vec<f64>,
    /// The first rows, which are equalities.
    pub equalities: usize,
    /// The first variables, which belong to no row.
    pub free: usize,
    /// `z = unit ẑ`: C σ.
    unit: Vec<f64>,
    row: Vec<f64>,
    sums: Vec<Compensated>,
}

/// The power of two next to `x > 0`, 1 where x is zero or leaves the range.
fn power(x: f64) -> f64 {
    let y = x.log2().round().exp2();
    if y.is_normal() { y } else { 1.0 }
}

impl Scaled {
    /// Scales a problem.
    ///
    /// Errors: a matrix without entries.
    pub fn new(rows: &Rows) -> Result<Self, SolveError> {
        rows.needs_entries()?;
        let matrix = match rows.matrix {
            Matrix::Sparse(a) => Matrix::Sparse(with_pairs(a, rows.equalities, rows.free)),
            other => other.clone(),
        };
        let mut scaled = Self {
            matrix,
            q: vec![],
            lower: vec![],
            upper: vec![],
            equalities: 0,
            free: 0,
            unit: vec![],
            row: vec![],
            sums: vec![],
        };
        scaled.fill(rows);
        Ok(scaled)
    }

    /// Scales another problem into the same memory. False where that does not fit, and nothing was done.
    pub fn refill(&mut self, rows: &Rows) -> bool {
        let shape = (rows.matrix.nrows(), rows.matrix.ncols());
        let same = shape == (self.q.len(), self.unit.len())
            && (self.equalities, self.free) == (rows.equalities, rows.free);
        let copied = same
            && match (&mut self.matrix, rows.matrix) {
                (Matrix::Dense(to), Matrix::Dense(from)) => {
                    to.values_mut().copy_from_slice(from.values());
                    true
                }
                (Matrix::Sparse(to), Matrix::Sparse(from)) => copy_values(from, to),
                _ => false,
            };
        if copied {
            self.fill(rows);
        }
        copied
    }

    /// From the unscaled matrix in place of M̂.
    fn fill(&mut self, rows: &Rows) {
        let (m, n) = (rows.matrix.nrows(), rows.matrix.ncols());
        (self.equalities, self.free) = (rows.equalities, rows.free);
        let (mut row, mut column) = (std::mem::take(&mut self.row), std::mem::take(&mut self.unit));
        row.clear();
        row.resize(m, 1.0);
        column.clear();
        column.resize(n, 1.0);
        self.lower.resize(m.max(n), 0.0);
        self.upper.resize(n, 0.0);
        self.sums.resize(m, Compensated::default());
        self.q.resize(m, 0.0);
        // The largest entries of rows and columns, in memory that is free for now.
        let (of_row, of_column) = (&mut self.q, &mut self.upper);
        for _ in 0..SWEEPS {
            of_row.fill(0.0);
            of_column.fill(0.0);
            self.matrix.for_each(|i, j, x| {
                let x = (x * row[i] * column[j]).abs();
                of_row[i] = of_row[i].max(x);
                of_column[j] = of_column[j].max(x);
            });
            let apply = |scale: &mut [f64], largest: &[f64]| {
                for (s, &x) in scale.iter_mut().zip(largest).filter(|(_, x)| **x > 0.0) {
                    *s /= x.sqrt();
                }
            };
            apply(&mut row, of_row);
            apply(&mut column, of_column);
        }
        row.iter_mut().chain(&mut column).for_each(|x| *x = power(*x));
        match &mut self.matrix {
            Matrix::Dense(a) => {
                for (i, &r) in row.iter().enumerate() {
                    a.row_mut(i).iter_mut().zip(&column).for_each(|(x, c)| *x *= r * c);
                }
            }
            Matrix::Sparse(a) => {
                let mut k = 0;
                for (j, &c) in column.iter().enumerate() {
                    while k < a.col_ptr()[j + 1] {
                        let r = row[a.row_idx()[k]];
                        a.values_mut()[k] *= r * c;
                        k += 1;
                    }
                }
            }
            Matrix::Operator(_) => {}
        }
        // σ: the size of w at the point of the box that is nearest to zero.
        self.lower.truncate(n);
        for (j, x) in self.upper.iter_mut().enumerate() {
            *x = rows.bounds.project(j, 0.0) / column[j];
        }
        self.matrix.mul(&self.upper, &mut self.q);
        let at_origin = self.q.iter().zip(rows.q).zip(&row);
        let sigma = at_origin.fold(0.0_f64, |m, ((w, q), r)| m.max((w + r * q).abs()));
        let sigma = if sigma > 0.0 { power(sigma) } else { 1.0 };
        for ((to, q), r) in self.q.iter_mut().zip(rows.q).zip(&row) {
            *to = r * q / sigma;
        }
        column.iter_mut().for_each(|c| *c *= sigma);
        for (j, &c) in column.iter().enumerate() {
            self.lower[j] = rows.bounds.lower(j) / c;
            self.upper[j] = rows.bounds.upper(j) / c;
        }
        (self.row, self.unit) = (row, column);
    }

    /// Rows of M̂: as many as variables, except in rectangular MLCP.
    pub fn nrows(&self) -> usize {
        self.q.len()
    }

    /// Entries of ẑ, without multipliers or slacks.
    pub fn dim(&self) -> usize {
        self.unit.len()
    }

    /// The variable of row i, with its bounds; `None` of an equality.
    #[inline]
    pub fn variable(&self, i: usize) -> Option<usize> {
        i.checked_sub(self.equalities).map(|k| self.free + k)
    }

    /// `ŵ_i` over `w_i`, up to a factor that all rows have in common.
    pub fn row(&self, i: usize) -> f64 {
        self.row[i]
    }

    /// ẑ of z.
    pub fn enter(&self, z: &[f64], x: &mut [f64]) {
        for ((x, z), c) in x.iter_mut().zip(z).zip(&self.unit) {
            *x = z / c;
        }
    }

    /// z of ẑ, within its bounds.
    pub fn leave(&self, x: &[f64], z: &mut [f64]) {
        for (j, z) in z.iter_mut().enumerate() {
            *z = x[j].max(self.lower[j]).min(self.upper[j]) * self.unit[j];
        }
    }

    /// `ŵ = M̂ ẑ + q̂`; in doubled precision where it must be more than a difference of rounded numbers.
    pub fn multiply(&mut self, x: &[f64], w: &mut [f64], precisely: bool) {
        if !precisely {
            self.matrix.mul(x, w);
            w.iter_mut().zip(&self.q).for_each(|(w, q)| *w += q);
            return;
        }
        let Self { matrix, q, sums, .. } = self;
        sums.iter_mut().zip(&*q).for_each(|(sum, q)| *sum = Compensated::from(*q));
        matrix.for_each(|i, j, a| sums[i].add_product(a, x[j]));
        w.iter_mut().zip(&*sums).for_each(|(w, sum)| *w = sum.value());
    }
}

/// A with an entry, zero if need be, in row `equalities + k` and column `free + k`.
fn with_pairs(a: &Csc, equalities: usize, free: usize) -> Csc {
    let pairs = (equalities..a.nrows()).map(|i| (i, free + i - equalities, 0.0));
    Csc::from_triplets(a.nrows(), a.ncols(), a.triplets().chain(pairs)).expect("in range")
}

/// Copies entries into a matrix that has these and maybe more; false where it has not.
fn copy_values(from: &Csc, to: &mut Csc) -> bool {
    let fits = (0..from.ncols()).all(|j| {
        let (rows, there) = (from.column(j).0, to.column(j).0);
        let mut there = there.iter();
        rows.iter().all(|r| there.any(|t| t == r))
    });
    if !fits {
        return false;
    }
    to.values_mut().fill(0.0);
    for j in 0..from.ncols() {
        let mut k = to.col_ptr()[j];
        let (rows, values) = from.column(j);
        for (&r, &x) in rows.iter().zip(values) {
            while to.row_idx()[k] != r {
                k += 1;
            }
            to.values_mut()[k] = x;
        }
    }
    true
}

/// The matrices of Newton's method: `J = diag(e) E + diag(f) M̂`, E the pairing of rows with variables.
#[derive(Debug, Clone)]
pub struct Jacobian {
    /// J.
    pub matrix: Matrix,
    /// Sparse: where E's entries are among the values.
    pairs: Vec<usize>,
}

impl Jacobian {
    /// Memory for the Jacobians of this problem.
    pub fn new(scaled: &Scaled) -> Self {
        let pairs = match &scaled.matrix {
            Matrix::Sparse(a) => (scaled.equalities..a.nrows())
                .map(|i| {
                    let j = scaled.free + i - scaled.equalities;
                    let at = a.column(j).0.binary_search(&i).expect("pairs are stored");
                    a.col_ptr()[j] + at
                })
                .collect(),
            _ => vec![],
        };
        Self { matrix: scaled.matrix.clone(), pairs }
    }

    /// Assembles `diag(e) E + diag(f) (M̂ + λE)`.
    pub fn assemble(&mut self, scaled: &Scaled, e: &[f64], f: &[f64], lambda: f64) {
        let p = scaled.equalities;
        match (&mut self.matrix, &scaled.matrix) {
            (Matrix::Dense(to), Matrix::Dense(a)) => {
                for (i, &f) in f.iter().enumerate() {
                    to.row_mut(i).iter_mut().zip(a.row(i)).for_each(|(to, a)| *to = f * a);
                    if let Some(j) = scaled.variable(i) {
                        to[(i, j)] += e[i] + lambda * f;
                    }
                }
            }
            (Matrix::Sparse(to), Matrix::Sparse(a)) => {
                let entries = to.values_mut().iter_mut().zip(a.row_idx()).zip(a.values());
                entries.for_each(|((to, &i), a)| *to = f[i] * a);
                for ((&k, e), f) in self.pairs.iter().zip(&e[p..]).zip(&f[p..]) {
                    to.values_mut()[k] += e + lambda * f;
                }
            }
            _ => {}
        }
    }

    /// `[−I J; Jᵀ λI]`: with `(−Φ, 0)` on the right its solution is `(Φ + J d, d)` with the least `‖Φ + J d‖² + λ‖d‖²`.
    pub fn augmented(&self, lambda: f64) -> Matrix {
        let (m, n) = (self.matrix.nrows(), self.matrix.ncols());
        match &self.matrix {
            Matrix::Sparse(a) => {
                let j = a.triplets().flat_map(|(i, j, x)| [(i, m + j, x), (m + j, i, x)]);
                let diagonal = (0..m + n).map(|i| (i, i, if i < m { -1.0 } else { lambda }));
                let all = j.chain(diagonal);
                Csc::from_triplets(m + n, m + n, all).expect("in range").into()
            }
            other => {
                let mut to = Dense::zeros(m + n, m + n);
                other.for_each(|i, j, x| {
                    to[(i, m + j)] = x;
                    to[(m + j, i)] = x;
                });
                (0..m + n).for_each(|i| to[(i, i)] = if i < m { -1.0 } else { lambda });
                to.into()
            }
        }
    }
}
