//! Sums of matrix–vector products, row by row, plainly or in doubled precision.

use crate::linalg::{Compensated, Csc, Doubled, Matrix, norm_of};

/// One compensated sum for each row, and the sum of the sizes of its terms.
#[derive(Debug, Clone, Default)]
pub(super) struct Rows {
    sums: Vec<Compensated>,
    sizes: Vec<f64>,
    plainly: bool,
}

impl Rows {
    /// Carries doubled precision from now on, or not.
    pub(super) fn precisely(&mut self, precisely: bool) {
        self.plainly = !precisely;
    }

    /// Begins with `x`.
    pub(super) fn start(&mut self, x: &[f64]) {
        self.sums.clear();
        self.sums.extend(x.iter().map(|&x| Compensated::from(x)));
        self.sizes.clear();
        self.sizes.extend(x.iter().map(|x| x.abs()));
    }

    /// Begins with `n` zeros.
    pub(super) fn start_at_zero(&mut self, n: usize) {
        self.sums.clear();
        self.sums.resize(n, Compensated::default());
        self.sizes.clear();
        self.sizes.resize(n, 0.0);
    }

    /// Adds `sign · A x`.
    pub(super) fn add(&mut self, sign: f64, a: &Csc, x: &[f64]) {
        for (j, &xj) in x.iter().enumerate() {
            let (rows, values) = a.column(j);
            for (&i, &v) in rows.iter().zip(values) {
                self.add_product(i, sign * v, xj);
            }
        }
    }

    /// Adds `sign · A x`; false, and nothing added, where A is known by its products only.
    pub(super) fn add_matrix(&mut self, sign: f64, a: &Matrix, x: &[f64]) -> bool {
        match a {
            Matrix::Sparse(a) => self.add(sign, a, x),
            Matrix::Dense(a) => {
                for i in 0..a.nrows() {
                    for (&a, &x) in a.row(i).iter().zip(x) {
                        self.add_product(i, sign * a, x);
                    }
                }
            }
            Matrix::Operator(_) => return false,
        }
        true
    }

    /// Adds `x`.
    pub(super) fn add_vector(&mut self, x: &[f64]) {
        for (row, &x) in x.iter().enumerate() {
            self.add_product(row, 1.0, x);
        }
    }

    /// Adds `Aᵀ x`.
    pub(super) fn add_transposed(&mut self, a: &Csc, x: &[f64]) {
        for j in 0..a.ncols() {
            let (rows, values) = a.column(j);
            for (&i, &v) in rows.iter().zip(values) {
                self.add_product(j, v, x[i]);
            }
        }
    }

    /// Adds `a b` to a row.
    #[inline(always)]
    pub(super) fn add_product(&mut self, row: usize, a: f64, b: f64) {
        let product = a * b;
        if self.plainly {
            self.sums[row].add_plainly(product);
        } else {
            self.sums[row].add_product(a, b);
        }
        self.sizes[row] += product.abs();
    }

    /// Adds `Σ B x` to D rows from `first` on, for blocks B, in doubled precision.
    pub(super) fn add_blocks<'a, const D: usize>(
        &mut self,
        first: usize,
        blocks: impl Iterator<Item = (&'a [[f64; D]; D], [f64; D])>,
    ) {
        // In registers, not in memory.
        let mut sums: [Compensated; D] = std::array::from_fn(|k| self.sums[first + k]);
        let mut sizes: [f64; D] = std::array::from_fn(|k| self.sizes[first + k]);
        for (block, x) in blocks {
            for k in 0..D {
                for l in 0..D {
                    sums[k].add_product(block[k][l], x[l]);
                    sizes[k] += (block[k][l] * x[l]).abs();
                }
            }
        }
        self.sums[first..first + D].copy_from_slice(&sums);
        self.sizes[first..first + D].copy_from_slice(&sizes);
    }

    /// The sums, each rounded once.
    pub(super) fn values(&self) -> impl Iterator<Item = f64> + Clone + '_ {
        self.sums.iter().map(|s| s.value())
    }

    /// The sums with all their digits. Each is wrong by at most [`doubt`]`(n)` times the size of its n terms.
    pub(super) fn doubled(&self) -> impl Iterator<Item = Doubled> + Clone + '_ {
        self.sums.iter().map(|s| s.doubled())
    }

    /// The sizes of the terms of each sum.
    pub(super) fn sizes(&self) -> &[f64] {
        &self.sizes
    }

    /// The Euclidean norm of the sums.
    pub(super) fn norm(&self) -> f64 {
        norm_of(self.values())
    }
}

/// What a compensated sum of `n` terms may be wrong by, over the size of its terms (OgitaRumpOishi2005, the bound of Dot2 before its last
/// rounding).
pub(super) fn doubt(n: usize) -> f64 {
    let gamma = 0.5 * f64::EPSILON * (n + 2) as f64;
    gamma * gamma
}
