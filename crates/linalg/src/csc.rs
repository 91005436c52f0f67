//! General sparse matrices by compressed columns.

use std::sync::Arc;

use crate::MatrixError;

/// A sparse matrix by compressed columns, row indices sorted and unique within each column.
///
/// Storage: `8·nnz` bytes of values, `8·nnz` of row indices, `8·(ncols+1)` of pointers. Clones share it until one of them is changed, and compare equal at no cost.
#[derive(Debug, Clone)]
pub struct Csc {
    nrows: usize,
    ncols: usize,
    col_ptr: Arc<Vec<usize>>,
    row_idx: Arc<Vec<usize>>,
    values: Arc<Vec<f64>>,
}

impl PartialEq for Csc {
    fn eq(&self, other: &Self) -> bool {
        fn same<T: PartialEq>(a: &Arc<Vec<T>>, b: &Arc<Vec<T>>) -> bool {
            Arc::ptr_eq(a, b) || a == b
        }
        (self.nrows, self.ncols) == (other.nrows, other.ncols)
            && same(&self.col_ptr, &other.col_ptr)
            && same(&self.row_idx, &other.row_idx)
            && same(&self.values, &other.values)
    }
}

impl Csc {
    /// The `nrows × ncols` zero matrix.
    pub fn zeros(nrows: usize, ncols: usize) -> Self {
        Self::of(nrows, ncols, vec![0; ncols + 1], vec![], vec![])
    }

    /// Of arrays that fit each other.
    fn of(
        nrows: usize,
        ncols: usize,
        col_ptr: Vec<usize>,
        row_idx: Vec<usize>,
        values: Vec<f64>,
    ) -> Self {
        let (col_ptr, row_idx, values) = (col_ptr.into(), row_idx.into(), values.into());
        Self { nrows, ncols, col_ptr, row_idx, values }
    }

    /// The diagonal matrix with the given diagonal.
    pub fn diagonal(d: &[f64]) -> Self {
        let n = d.len();
        Self::of(n, n, (0..=n).collect(), (0..n).collect(), d.to_vec())
    }

    /// A matrix that takes the three arrays of compressed columns: column j has the rows `row_idx[col_ptr[j]..col_ptr[j + 1]]`, in increasing order. Nothing is copied.
    ///
    /// Errors: arrays whose lengths do not fit each other, pointers that decrease, rows out of range or out of order; each names its entry.
    pub fn from_vecs(
        nrows: usize,
        ncols: usize,
        col_ptr: Vec<usize>,
        row_idx: Vec<usize>,
        values: Vec<f64>,
    ) -> Result<Self, MatrixError> {
        let fits = |name: &str, expected: usize, found: usize| match expected == found {
            true => Ok(()),
            false => Err(MatrixError::shape(
                name,
                format!("{expected} entries"),
                format!("{found} entries"),
            )),
        };
        fits("col_ptr", ncols + 1, col_ptr.len())?;
        fits("values", row_idx.len(), values.len())?;
        if col_ptr[0] != 0 || col_ptr[ncols] != row_idx.len() {
            return Err(MatrixError::value(
                "col_ptr",
                format!("0 first and {} last", row_idx.len()),
                format!("{} first and {} last", col_ptr[0], col_ptr[ncols]),
            ));
        }
        for j in 0..ncols {
            let (begin, end) = (col_ptr[j], col_ptr[j + 1]);
            if begin > end || end > row_idx.len() {
                return Err(MatrixError::value(
                    format!("col_ptr[{}]", j + 1),
                    format!("from {begin} to {}", row_idx.len()),
                    end,
                ));
            }
            for k in begin..end {
                let least = if k > begin { row_idx[k - 1] + 1 } else { 0 };
                if row_idx[k] < least || row_idx[k] >= nrows {
                    return Err(MatrixError::value(
                        format!("row_idx[{k}]"),
                        format!("from {least} to {}", nrows.saturating_sub(1)),
                        row_idx[k],
                    ));
                }
            }
        }
        Ok(Self::of(nrows, ncols, col_ptr, row_idx, values))
    }

    /// Column pointers, row indices and values, as [`from_vecs`](Self::from_vecs) takes them. Copies what a clone shares.
    pub fn into_vecs(self) -> (Vec<usize>, Vec<usize>, Vec<f64>) {
        let (col_ptr, row_idx) =
            (Arc::unwrap_or_clone(self.col_ptr), Arc::unwrap_or_clone(self.row_idx));
        (col_ptr, row_idx, Arc::unwrap_or_clone(self.values))
    }

    /// Assembles `(row, column, value)` entries; duplicates are added in the order in which they come.
    ///
    /// Explicit zeros are kept: they belong to the structure that the caller stated.
    /// Errors: an index outside the matrix, by entry.
    pub fn from_triplets(
        nrows: usize,
        ncols: usize,
        entries: impl Iterator<Item = (usize, usize, f64)> + Clone,
    ) -> Result<Self, MatrixError> {
        let mut count = vec![0usize; ncols + 1];
        for (k, (i, j, _)) in entries.clone().enumerate() {
            if i >= nrows || j >= ncols {
                return Err(MatrixError::value(
                    format!("entry {k}"),
                    format!("an index inside {nrows} × {ncols}"),
                    format!("row {i}, column {j}"),
                ));
            }
            count[j + 1] += 1;
        }
        for j in 0..ncols {
            count[j + 1] += count[j];
        }
        // A stable bucket by columns, then a stable sort by rows, keeps duplicates in their order.
        let mut next = count.clone();
        let mut bucket = vec![(0usize, 0.0_f64); count[ncols]];
        for (i, j, x) in entries {
            bucket[next[j]] = (i, x);
            next[j] += 1;
        }
        Ok(Self::of_columns(nrows, &count, bucket))
    }

    /// Column j of `(row, value)` pairs `begins[j]..begins[j + 1]`: sorted here, with equal rows added.
    fn of_columns(nrows: usize, begins: &[usize], mut entries: Vec<(usize, f64)>) -> Self {
        let ncols = begins.len() - 1;
        let (mut row_idx, mut values) =
            (Vec::with_capacity(entries.len()), Vec::<f64>::with_capacity(entries.len()));
        let mut col_ptr = vec![0; ncols + 1];
        for j in 0..ncols {
            let column = &mut entries[begins[j]..begins[j + 1]];
            column.sort_by_key(|e| e.0);
            let start = row_idx.len();
            for &(i, x) in column.iter() {
                if row_idx.len() > start && *row_idx.last().expect("not empty") == i {
                    *values.last_mut().expect("not empty") += x;
                } else {
                    row_idx.push(i);
                    values.push(x);
                }
            }
            col_ptr[j + 1] = row_idx.len();
        }
        Self::of(nrows, ncols, col_ptr, row_idx, values)
    }

    /// The same matrix without stored zeros. Cost: O(nnz); nothing is copied where there are none.
    #[must_use]
    pub fn without_zeros(self) -> Self {
        if self.values.iter().all(|x| *x != 0.0) {
            return self;
        }
        let (mut col_ptr, mut row_idx, mut kept) = (vec![0; self.ncols + 1], vec![], vec![]);
        for j in 0..self.ncols {
            let (rows, values) = self.column(j);
            for (&i, &x) in rows.iter().zip(values).filter(|e| *e.1 != 0.0) {
                row_idx.push(i);
                kept.push(x);
            }
            col_ptr[j + 1] = kept.len();
        }
        Self::of(self.nrows, self.ncols, col_ptr, row_idx, kept)
    }

    /// The number of rows.
    pub fn nrows(&self) -> usize {
        self.nrows
    }

    /// The number of columns.
    pub fn ncols(&self) -> usize {
        self.ncols
    }

    /// The number of stored entries.
    pub fn nnz(&self) -> usize {
        self.values.len()
    }

    /// Column pointers (`ncols + 1` entries).
    pub fn col_ptr(&self) -> &[usize] {
        &self.col_ptr
    }

    /// Row indices, sorted within each column.
    pub fn row_idx(&self) -> &[usize] {
        &self.row_idx
    }

    /// Values, in the order of [`row_idx`](Csc::row_idx).
    pub fn values(&self) -> &[f64] {
        &self.values
    }

    /// Values, to be changed; the pattern stays. Copies them first where a clone shares them.
    pub fn values_mut(&mut self) -> &mut [f64] {
        Arc::make_mut(&mut self.values).as_mut_slice()
    }

    /// Column pointers, row indices, and the values to be changed: the structure stays.
    pub fn parts_mut(&mut self) -> (&[usize], &[usize], &mut [f64]) {
        (&self.col_ptr, &self.row_idx, Arc::make_mut(&mut self.values).as_mut_slice())
    }

    /// Row indices and values of column `j`.
    #[inline]
    pub fn column(&self, j: usize) -> (&[usize], &[f64]) {
        let range = self.col_ptr[j]..self.col_ptr[j + 1];
        (&self.row_idx[range.clone()], &self.values[range])
    }

    /// The matrix of these columns, in this order.
    pub fn columns(&self, which: &[usize]) -> Self {
        let entries = which.iter().enumerate().flat_map(|(k, &j)| {
            let (rows, values) = self.column(j);
            rows.iter().zip(values).map(move |(&i, &x)| (i, k, x))
        });
        Self::from_triplets(self.nrows, which.len(), entries).expect("rows in range")
    }

    /// All entries as `(row, column, value)`, column by column.
    pub fn triplets(&self) -> impl Iterator<Item = (usize, usize, f64)> + Clone + '_ {
        (0..self.ncols).flat_map(move |j| {
            let (rows, values) = self.column(j);
            rows.iter().zip(values).map(move |(&i, &x)| (i, j, x))
        })
    }

    /// The entry at row `i`, column `j` (zero where nothing is stored).
    pub fn get(&self, i: usize, j: usize) -> f64 {
        let (rows, values) = self.column(j);
        rows.binary_search(&i).map_or(0.0, |k| values[k])
    }

    /// The transpose. Cost: O(nnz).
    pub fn transpose(&self) -> Self {
        let mut col_ptr = vec![0; self.nrows + 1];
        for &i in &*self.row_idx {
            col_ptr[i + 1] += 1;
        }
        for i in 0..self.nrows {
            col_ptr[i + 1] += col_ptr[i];
        }
        let (mut row_idx, mut values) = (vec![0; self.nnz()], vec![0.0; self.nnz()]);
        let mut next = col_ptr.clone();
        for (i, j, x) in self.triplets() {
            row_idx[next[i]] = j;
            values[next[i]] = x;
            next[i] += 1;
        }
        Self::of(self.ncols, self.nrows, col_ptr, row_idx, values)
    }

    /// `y += a · A x`.
    pub fn mul_add(&self, a: f64, x: &[f64], y: &mut [f64]) {
        debug_assert_eq!((x.len(), y.len()), (self.ncols, self.nrows));
        for (j, &xj) in x.iter().enumerate() {
            let (rows, values) = self.column(j);
            let axj = a * xj;
            if axj != 0.0 {
                for (&i, &v) in rows.iter().zip(values) {
                    y[i] += v * axj;
                }
            }
        }
    }

    /// `y += a · Aᵀ x`.
    pub fn mul_transpose_add(&self, a: f64, x: &[f64], y: &mut [f64]) {
        debug_assert_eq!((x.len(), y.len()), (self.nrows, self.ncols));
        for (j, yj) in y.iter_mut().enumerate() {
            *yj += a * self.column_dot(j, x);
        }
    }

    /// `(Aᵀ x)_j`.
    #[inline]
    pub fn column_dot(&self, j: usize, x: &[f64]) -> f64 {
        let (rows, values) = self.column(j);
        rows.iter().zip(values).map(|(&i, &v)| v * x[i]).sum()
    }

    /// `max |a_ij − a_ji| / max |a_ij|`, zero for an empty matrix. Cost: O(nnz).
    pub fn asymmetry(&self) -> f64 {
        let t = self.transpose();
        let mut worst = 0.0_f64;
        let mut largest = 0.0_f64;
        for (i, j, x) in self.triplets() {
            largest = largest.max(x.abs());
            worst = worst.max((x - t.get(i, j)).abs());
        }
        if largest > 0.0 { worst / largest } else { 0.0 }
    }

    /// Every stored value is finite; the error names the entry of the matrix called `name`.
    pub fn check_finite(&self, name: &str) -> Result<(), MatrixError> {
        match self.triplets().find(|e| !e.2.is_finite()) {
            Some((i, j, x)) => {
                Err(MatrixError::value(format!("{name}[{i}, {j}]"), "a finite number", x))
            }
            None => Ok(()),
        }
    }

    /// The matrix has the shape that the problem asks for.
    pub fn check_shape(
        &self,
        name: &str,
        nrows: usize,
        ncols: usize,
        meaning: &str,
    ) -> Result<(), MatrixError> {
        if (self.nrows, self.ncols) == (nrows, ncols) {
            return Ok(());
        }
        Err(MatrixError::shape(
            name,
            format!("{nrows} × {ncols} ({meaning})"),
            format!("{} × {}", self.nrows, self.ncols),
        ))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn clones_share_until_one_is_changed() {
        let a = Csc::from_triplets(2, 2, [(0, 0, 1.0), (1, 1, 2.0)].into_iter()).unwrap();
        let mut b = a.clone();
        assert!(std::ptr::eq(a.values(), b.values()) && a == b);
        b.values_mut()[0] = 3.0;
        assert!(a.values() == [1.0, 2.0] && b.values() == [3.0, 2.0] && a != b);
        b.values_mut()[0] = 1.0;
        assert_eq!(a, b);
        assert_eq!(b.into_vecs().2, a.values());
    }

    #[test]
    fn duplicates_are_added_and_zeros_kept() {
        let entries = [(1, 0, 2.0), (0, 0, 1.0), (1, 0, 0.5), (0, 1, 0.0)];
        let a = Csc::from_triplets(2, 2, entries.into_iter()).unwrap();
        assert_eq!(a.nnz(), 3);
        assert_eq!((a.get(0, 0), a.get(1, 0), a.get(0, 1)), (1.0, 2.5, 0.0));
        let kept = a.clone().without_zeros();
        assert_eq!((kept.nnz(), kept.ncols(), kept.get(1, 0)), (2, 2, 2.5));
        assert_eq!(kept.clone().without_zeros(), kept);
    }

    #[test]
    fn an_index_outside_is_named() {
        let e = Csc::from_triplets(2, 2, [(0, 0, 1.0), (2, 0, 1.0)].into_iter()).unwrap_err();
        assert!(e.to_string().contains("entry 1") && e.to_string().contains("row 2"), "{e}");
    }

    #[test]
    fn products_agree_with_the_transpose() {
        let entries = [(0, 0, 1.0), (2, 0, -2.0), (1, 1, 3.0), (0, 2, 0.5)];
        let a = Csc::from_triplets(3, 4, entries.into_iter()).unwrap();
        let x = [1.0, 2.0, 3.0];
        let (mut y, mut z) = ([0.0; 4], [0.0; 4]);
        a.mul_transpose_add(2.0, &x, &mut y);
        a.transpose().mul_add(2.0, &x, &mut z);
        assert_eq!(y, z);
        assert_eq!(a.transpose().transpose(), a);
    }
}
