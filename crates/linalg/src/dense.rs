//! Dense matrices by rows.

use faer::linalg::matmul::matmul;
use faer::{Accum, ColMut, ColRef, MatRef, Par};

use super::Csc;

/// A dense matrix by rows: row i is contiguous. Storage: `8·nrows·ncols` bytes.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Dense {
    nrows: usize,
    ncols: usize,
    values: Vec<f64>,
}

impl Dense {
    /// The `nrows × ncols` zero matrix.
    pub fn zeros(nrows: usize, ncols: usize) -> Self {
        Self { nrows, ncols, values: vec![0.0; nrows * ncols] }
    }

    /// The matrix with the entries `f(i, j)`.
    pub fn from_fn(nrows: usize, ncols: usize, mut f: impl FnMut(usize, usize) -> f64) -> Self {
        let values = (0..nrows * ncols).map(|k| f(k / ncols, k % ncols)).collect();
        Self { nrows, ncols, values }
    }

    /// The matrix with these rows; `None` where their lengths differ.
    pub fn from_rows<R: AsRef<[f64]>>(rows: &[R]) -> Option<Self> {
        let ncols = rows.first().map_or(0, |r| r.as_ref().len());
        let even = rows.iter().all(|r| r.as_ref().len() == ncols);
        let values = || rows.iter().flat_map(|r| r.as_ref().iter().copied()).collect();
        even.then(|| Self { nrows: rows.len(), ncols, values: values() })
    }

    /// The number of rows.
    pub fn nrows(&self) -> usize {
        self.nrows
    }

    /// The number of columns.
    pub fn ncols(&self) -> usize {
        self.ncols
    }

    /// Row i.
    #[inline]
    pub fn row(&self, i: usize) -> &[f64] {
        &self.values[i * self.ncols..(i + 1) * self.ncols]
    }

    /// Row i, to be changed.
    #[inline]
    pub fn row_mut(&mut self, i: usize) -> &mut [f64] {
        &mut self.values[i * self.ncols..(i + 1) * self.ncols]
    }

    /// All entries, row by row.
    pub fn values(&self) -> &[f64] {
        &self.values
    }

    /// All entries, row by row, to be changed.
    pub fn values_mut(&mut self) -> &mut [f64] {
        &mut self.values
    }

    /// Becomes the `nrows × ncols` zero matrix, in the memory it has.
    pub fn reset(&mut self, nrows: usize, ncols: usize) {
        (self.nrows, self.ncols) = (nrows, ncols);
        self.values.clear();
        self.values.resize(nrows * ncols, 0.0);
    }

    /// `y += a · A x`, in the order of operations and with the instructions that suit the processor.
    pub fn mul_add(&self, a: f64, x: &[f64], y: &mut [f64]) {
        let m = MatRef::from_row_major_slice(&self.values, self.nrows, self.ncols);
        let (x, y) = (ColRef::from_slice(x), ColMut::from_slice_mut(y));
        matmul(y.as_mat_mut(), Accum::Add, m, x.as_mat(), a, Par::Seq);
    }

    /// `y += a · Aᵀ x`, as [`mul_add`](Self::mul_add).
    pub fn mul_transpose_add(&self, a: f64, x: &[f64], y: &mut [f64]) {
        let m = MatRef::from_row_major_slice(&self.values, self.nrows, self.ncols).transpose();
        let (x, y) = (ColRef::from_slice(x), ColMut::from_slice_mut(y));
        matmul(y.as_mat_mut(), Accum::Add, m, x.as_mat(), a, Par::Seq);
    }

    /// The entries that are not zero, as a sparse matrix.
    pub fn to_csc(&self) -> Csc {
        let there = (0..self.nrows).flat_map(|i| {
            let each = self.row(i).iter().enumerate();
            each.filter(|(_, x)| **x != 0.0).map(move |(j, &x)| (i, j, x))
        });
        Csc::from_triplets(self.nrows, self.ncols, there).expect("in range")
    }
}

impl std::ops::Index<(usize, usize)> for Dense {
    type Output = f64;
    #[inline]
    fn index(&self, (i, j): (usize, usize)) -> &f64 {
        &self.values[i * self.ncols + j]
    }
}

impl std::ops::IndexMut<(usize, usize)> for Dense {
    #[inline]
    fn index_mut(&mut self, (i, j): (usize, usize)) -> &mut f64 {
        &mut self.values[i * self.ncols + j]
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn products_are_those_of_the_entries() {
        let a = Dense::from_fn(7, 19, |i, j| ((3 * i + 5 * j) as f64).sin());
        let (x, y): (Vec<_>, Vec<_>) =
            ((0..19).map(|j| (j as f64).cos()).collect(), (0..7).map(|i| i as f64).collect());
        let (mut ax, mut aty) = (vec![1.0; 7], vec![1.0; 19]);
        a.mul_add(2.0, &x, &mut ax);
        a.mul_transpose_add(-1.0, &y, &mut aty);
        for i in 0..7 {
            let sum: f64 = (0..19).map(|j| a[(i, j)] * x[j]).sum();
            assert!((ax[i] - 1.0 - 2.0 * sum).abs() < 1e-13);
        }
        for j in 0..19 {
            let sum: f64 = (0..7).map(|i| a[(i, j)] * y[i]).sum();
            assert!((aty[j] - 1.0 + sum).abs() < 1e-13);
        }
    }
}
