//! The matrix of a complementarity problem: dense, sparse, or known by its products only.

use std::sync::Arc;

use super::{Csc, Dense};
use crate::MatrixError;

/// A matrix that is known by its products. Methods that need entries refuse it by name.
pub trait Operator: Send + Sync + std::fmt::Debug {
    /// The number of rows.
    fn nrows(&self) -> usize;

    /// The number of columns.
    fn ncols(&self) -> usize;

    /// `y = A x`.
    fn mul(&self, x: &[f64], y: &mut [f64]);

    /// `y = Aᵀ x`.
    fn mul_transpose(&self, x: &[f64], y: &mut [f64]);

    /// The diagonal, where somebody knows it: projection methods step by it.
    fn diagonal(&self) -> Option<Vec<f64>> {
        None
    }
}

/// A matrix as a complementarity problem states it.
#[derive(Debug, Clone)]
pub enum Matrix {
    /// All entries, by rows.
    Dense(Dense),
    /// The entries that are not zero, by columns.
    Sparse(Csc),
    /// Products only.
    Operator(Arc<dyn Operator>),
}

impl PartialEq for Matrix {
    /// Operators are equal where they are the same object.
    fn eq(&self, other: &Self) -> bool {
        match (self, other) {
            (Self::Dense(a), Self::Dense(b)) => a == b,
            (Self::Sparse(a), Self::Sparse(b)) => a == b,
            (Self::Operator(a), Self::Operator(b)) => Arc::ptr_eq(a, b),
            _ => false,
        }
    }
}

impl From<Dense> for Matrix {
    fn from(a: Dense) -> Self {
        Self::Dense(a)
    }
}

impl From<Csc> for Matrix {
    fn from(a: Csc) -> Self {
        Self::Sparse(a)
    }
}

impl Matrix {
    /// The number of rows.
    pub fn nrows(&self) -> usize {
        match self {
            Self::Dense(a) => a.nrows(),
            Self::Sparse(a) => a.nrows(),
            Self::Operator(a) => a.nrows(),
        }
    }

    /// The number of columns.
    pub fn ncols(&self) -> usize {
        match self {
            Self::Dense(a) => a.ncols(),
            Self::Sparse(a) => a.ncols(),
            Self::Operator(a) => a.ncols(),
        }
    }

    /// The same matrix without the zeros that a sparse one stores, which are as dear to every method as other entries.
    #[must_use]
    pub fn without_zeros(self) -> Self {
        match self {
            Self::Sparse(a) => Self::Sparse(a.without_zeros()),
            other => other,
        }
    }

    /// The number of stored entries; `None` of an operator.
    pub fn nnz(&self) -> Option<usize> {
        match self {
            Self::Dense(a) => Some(a.values().len()),
            Self::Sparse(a) => Some(a.nnz()),
            Self::Operator(_) => None,
        }
    }

    /// Calls `f(i, j, x)` for every stored entry; zeros of a dense matrix are passed over. False, and nothing called, for an operator.
    pub fn for_each(&self, mut f: impl FnMut(usize, usize, f64)) -> bool {
        match self {
            Self::Dense(a) => {
                for i in 0..a.nrows() {
                    a.row(i)
                        .iter()
                        .enumerate()
                        .filter(|e| *e.1 != 0.0)
                        .for_each(|(j, &x)| f(i, j, x));
                }
            }
            Self::Sparse(a) => a.triplets().for_each(|(i, j, x)| f(i, j, x)),
            Self::Operator(_) => return false,
        }
        true
    }

    /// `y = A x`.
    pub fn mul(&self, x: &[f64], y: &mut [f64]) {
        match self {
            Self::Dense(a) => {
                for (i, y) in y.iter_mut().enumerate() {
                    *y = a.row(i).iter().zip(x).map(|(a, x)| a * x).sum();
                }
            }
            Self::Sparse(a) => {
                y.fill(0.0);
                a.mul_add(1.0, x, y);
            }
            Self::Operator(a) => a.mul(x, y),
        }
    }

    /// `y = Aᵀ x`.
    pub fn mul_transpose(&self, x: &[f64], y: &mut [f64]) {
        match self {
            Self::Dense(a) => {
                y.fill(0.0);
                for (i, &x) in x.iter().enumerate().filter(|(_, x)| **x != 0.0) {
                    y.iter_mut().zip(a.row(i)).for_each(|(y, a)| *y += a * x);
                }
            }
            Self::Sparse(a) => {
                y.fill(0.0);
                a.mul_transpose_add(1.0, x, y);
            }
            Self::Operator(a) => a.mul_transpose(x, y),
        }
    }

    /// The diagonal; `None` of an operator that does not know it.
    pub fn diagonal(&self) -> Option<Vec<f64>> {
        let n = self.nrows().min(self.ncols());
        match self {
            Self::Dense(a) => Some((0..n).map(|i| a[(i, i)]).collect()),
            Self::Sparse(a) => Some((0..n).map(|i| a.get(i, i)).collect()),
            Self::Operator(a) => a.diagonal(),
        }
    }

    /// As a dense matrix; `None` of an operator.
    pub fn to_dense(&self) -> Option<Dense> {
        if let Self::Dense(a) = self {
            return Some(a.clone());
        }
        let mut out = Dense::zeros(self.nrows(), self.ncols());
        self.for_each(|i, j, x| out[(i, j)] = x).then_some(out)
    }

    /// As a sparse matrix; `None` of an operator.
    pub fn to_csc(&self) -> Option<Csc> {
        match self {
            Self::Dense(a) => Some(a.to_csc()),
            Self::Sparse(a) => Some(a.clone()),
            Self::Operator(_) => None,
        }
    }

    /// `max |a_ij − a_ji| / max |a_ij|` of a square matrix; `None` of an operator.
    pub fn asymmetry(&self) -> Option<f64> {
        match self {
            Self::Dense(a) => {
                let (mut worst, mut largest) = (0.0_f64, 0.0_f64);
                for i in 0..a.nrows() {
                    for j in 0..a.ncols() {
                        largest = largest.max(a[(i, j)].abs());
                        worst = worst.max((a[(i, j)] - a[(j, i)]).abs());
                    }
                }
                Some(if largest > 0.0 { worst / largest } else { 0.0 })
            }
            Self::Sparse(a) => Some(a.asymmetry()),
            Self::Operator(_) => None,
        }
    }

    /// Every entry is finite; the error names the entry of the matrix called `name`.
    pub fn check_finite(&self, name: &str) -> Result<(), MatrixError> {
        let mut bad = None;
        self.for_each(|i, j, x| {
            if !x.is_finite() && bad.is_none() {
                bad = Some((i, j, x));
            }
        });
        match bad {
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
        if (self.nrows(), self.ncols()) == (nrows, ncols) {
            return Ok(());
        }
        Err(MatrixError::shape(
            name,
            format!("{nrows} × {ncols} ({meaning})"),
            format!("{} × {}", self.nrows(), self.ncols()),
        ))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn both_storages_say_the_same() {
        let dense = Dense::from_rows(&[[1.0, 0.0, -2.0], [0.5, 3.0, 0.0]]).unwrap();
        let (a, b) = (Matrix::from(dense.clone()), Matrix::from(dense.to_csc()));
        let mut y = [[0.0; 2]; 2];
        let mut z = [[0.0; 3]; 2];
        for (k, m) in [&a, &b].into_iter().enumerate() {
            m.mul(&[1.0, 2.0, 3.0], &mut y[k]);
            m.mul_transpose(&[1.0, 2.0], &mut z[k]);
            assert_eq!(m.to_dense().unwrap(), dense);
            assert_eq!(m.diagonal().unwrap(), [1.0, 3.0]);
        }
        assert_eq!((y[0], z[0]), ([-5.0, 6.5], [2.0, 6.0, -2.0]));
        assert_eq!((y[0], z[0]), (y[1], z[1]));
        assert!(Dense::from_rows(&[vec![1.0], vec![]]).is_none());
    }
}
