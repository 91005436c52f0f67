//! Matrices from slices, and from and to those of other crates: faer always, nalgebra and sprs behind the features of their names.
//!
//! Every conversion copies. Sparse ones keep the entries that are stored, zeros included.

use faer::sparse::{SparseColMat, SparseColMatRef, Triplet};
use faer::{Mat, MatRef};

use super::{Bsr, Csc, Dense, MatrixError};

impl Csc {
    /// A matrix from the three arrays of compressed columns: column j has the rows `row_idx[col_ptr[j]..col_ptr[j + 1]]`, in increasing order.
    ///
    /// Errors: arrays whose lengths do not fit each other, pointers that decrease, rows out of range or out of order; each names its entry.
    pub fn from_parts(
        nrows: usize,
        ncols: usize,
        col_ptr: &[usize],
        row_idx: &[usize],
        values: &[f64],
    ) -> Result<Self, MatrixError> {
        Self::from_vecs(nrows, ncols, col_ptr.to_vec(), row_idx.to_vec(), values.to_vec())
    }
}

impl Dense {
    /// A matrix from its entries row by row.
    ///
    /// Errors: another number of entries than `nrows · ncols`.
    pub fn from_row_slice(nrows: usize, ncols: usize, values: &[f64]) -> Result<Self, MatrixError> {
        counted(nrows, ncols, values)?;
        Ok(Self::from_fn(nrows, ncols, |i, j| values[i * ncols + j]))
    }

    /// A matrix from its entries column by column.
    ///
    /// Errors: another number of entries than `nrows · ncols`.
    pub fn from_column_slice(
        nrows: usize,
        ncols: usize,
        values: &[f64],
    ) -> Result<Self, MatrixError> {
        counted(nrows, ncols, values)?;
        Ok(Self::from_fn(nrows, ncols, |i, j| values[i + j * nrows]))
    }
}

fn counted(nrows: usize, ncols: usize, values: &[f64]) -> Result<(), MatrixError> {
    if Some(values.len()) == nrows.checked_mul(ncols) {
        return Ok(());
    }
    Err(MatrixError::shape(
        "values",
        format!("{nrows} × {ncols} entries"),
        format!("{} entries", values.len()),
    ))
}

impl<const D: usize> Bsr<D> {
    /// A matrix of `nrows × ncols` blocks from its entries row by row, `D·nrows × D·ncols` of them; blocks of zeros are absent.
    ///
    /// Errors: another number of entries.
    pub fn from_row_slice(nrows: usize, ncols: usize, values: &[f64]) -> Result<Self, MatrixError> {
        let (rows, columns) = (D * nrows, D * ncols);
        counted(rows, columns, values)?;
        let entries = values.iter().enumerate().filter(|(_, x)| **x != 0.0);
        let entries = entries.map(|(k, &x)| (k / columns, k % columns, x));
        Ok(Self::from_csc(&Csc::from_triplets(rows, columns, entries)?))
    }
}

impl From<MatRef<'_, f64>> for Dense {
    fn from(a: MatRef<'_, f64>) -> Self {
        Self::from_fn(a.nrows(), a.ncols(), |i, j| a[(i, j)])
    }
}

impl From<&Mat<f64>> for Dense {
    fn from(a: &Mat<f64>) -> Self {
        a.as_ref().into()
    }
}

impl From<&Dense> for Mat<f64> {
    fn from(a: &Dense) -> Self {
        Mat::from_fn(a.nrows(), a.ncols(), |i, j| a.row(i)[j])
    }
}

impl From<SparseColMatRef<'_, usize, f64>> for Csc {
    /// Entries that stand twice are added.
    fn from(a: SparseColMatRef<'_, usize, f64>) -> Self {
        let entries: Vec<_> = a.triplet_iter().map(|t| (t.row, t.col, *t.val)).collect();
        Self::from_triplets(a.nrows(), a.ncols(), entries.into_iter())
            .expect("indices of a valid matrix")
    }
}

impl From<&SparseColMat<usize, f64>> for Csc {
    fn from(a: &SparseColMat<usize, f64>) -> Self {
        a.as_ref().into()
    }
}

impl From<&Csc> for SparseColMat<usize, f64> {
    fn from(a: &Csc) -> Self {
        let entries: Vec<_> = a.triplets().map(|(i, j, x)| Triplet::new(i, j, x)).collect();
        SparseColMat::try_new_from_triplets(a.nrows(), a.ncols(), &entries)
            .expect("indices of a valid matrix")
    }
}

#[cfg(feature = "nalgebra")]
mod with_nalgebra {
    use nalgebra::DMatrix;

    use crate::Dense;

    impl From<&DMatrix<f64>> for Dense {
        fn from(a: &DMatrix<f64>) -> Self {
            Self::from_fn(a.nrows(), a.ncols(), |i, j| a[(i, j)])
        }
    }

    impl From<&Dense> for DMatrix<f64> {
        fn from(a: &Dense) -> Self {
            DMatrix::from_row_slice(a.nrows(), a.ncols(), a.values())
        }
    }
}

#[cfg(feature = "sprs")]
mod with_sprs {
    use sprs::{CsMat, TriMat};

    use crate::Csc;

    impl From<&CsMat<f64>> for Csc {
        fn from(a: &CsMat<f64>) -> Self {
            let entries: Vec<_> = a.iter().map(|(x, (i, j))| (i, j, *x)).collect();
            Self::from_triplets(a.rows(), a.cols(), entries.into_iter())
                .expect("indices of a valid matrix")
        }
    }

    impl From<&Csc> for CsMat<f64> {
        fn from(a: &Csc) -> Self {
            let mut entries = TriMat::with_capacity((a.nrows(), a.ncols()), a.nnz());
            a.triplets().for_each(|(i, j, x)| entries.add_triplet(i, j, x));
            entries.to_csc()
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn sparse() -> Csc {
        let entries = [(0, 0, 1.0), (2, 0, -2.0), (1, 2, 3.0), (2, 2, 0.0)];
        Csc::from_triplets(3, 3, entries.into_iter()).unwrap()
    }

    fn dense() -> Dense {
        Dense::from_rows(&[[1.0, 2.0, 3.0], [4.0, 5.0, 6.0]]).unwrap()
    }

    #[test]
    fn slices() {
        assert_eq!(Dense::from_row_slice(2, 3, &[1.0, 2.0, 3.0, 4.0, 5.0, 6.0]), Ok(dense()));
        assert_eq!(Dense::from_column_slice(2, 3, &[1.0, 4.0, 2.0, 5.0, 3.0, 6.0]), Ok(dense()));
        let a = sparse();
        let again = Csc::from_parts(3, 3, a.col_ptr(), a.row_idx(), a.values());
        assert_eq!(again, Ok(a));
        let w = [1.0, 0.0, 0.0, 0.0, 0.0, 2.0, 0.0, 0.0, 0.0, 0.0, 3.0, 0.0, 0.0, 0.0, 0.0, 4.0];
        let w = Bsr::<2>::from_row_slice(2, 2, &w).unwrap();
        assert_eq!((w.nblocks(), w.get(1, 1)), (2, Some(&[[3.0, 0.0], [0.0, 4.0]])));
    }

    #[test]
    fn mistakes_are_named() {
        let said = |e: MatrixError| e.to_string();
        assert_eq!(
            said(Dense::from_row_slice(2, 2, &[1.0]).unwrap_err()),
            "values: expected 2 × 2 entries, found 1 entries"
        );
        let parts = |ptr: &[usize], idx: &[usize], x: &[f64]| {
            Csc::from_parts(2, 2, ptr, idx, x).unwrap_err().to_string()
        };
        assert_eq!(parts(&[0, 1], &[0], &[1.0]), "col_ptr: expected 3 entries, found 2 entries");
        assert_eq!(parts(&[0, 1, 1], &[0], &[]), "values: expected 1 entries, found 0 entries");
        assert_eq!(parts(&[0, 2, 1], &[0], &[1.0]), "col_ptr[1]: expected from 0 to 1, found 2");
        assert_eq!(
            parts(&[1, 1, 1], &[0], &[1.0]),
            "col_ptr: expected 0 first and 1 last, found 1 first and 1 last"
        );
        assert_eq!(
            parts(&[0, 2, 2], &[1, 0], &[1.0, 1.0]),
            "row_idx[1]: expected from 2 to 1, found 0"
        );
        assert_eq!(parts(&[0, 1, 1], &[2], &[1.0]), "row_idx[0]: expected from 0 to 1, found 2");
    }

    #[test]
    fn faer_and_back() {
        let m: Mat<f64> = (&dense()).into();
        assert_eq!((m[(1, 2)], Dense::from(&m)), (6.0, dense()));
        let s: SparseColMat<usize, f64> = (&sparse()).into();
        assert_eq!(Csc::from(&s), sparse());
    }

    #[cfg(feature = "nalgebra")]
    #[test]
    fn nalgebra_and_back() {
        let m: nalgebra::DMatrix<f64> = (&dense()).into();
        assert_eq!((m[(1, 2)], Dense::from(&m)), (6.0, dense()));
    }

    #[cfg(feature = "sprs")]
    #[test]
    fn sprs_and_back() {
        let s: sprs::CsMat<f64> = (&sparse()).into();
        assert_eq!(Csc::from(&s), sparse());
        assert_eq!(Csc::from(&s.to_csr()), sparse());
    }
}
