//! LU of a square matrix, dense or sparse, made again and again.

use faer::linalg::solvers::{PartialPivLu, SolveCore};
use faer::sparse::linalg::solvers::{Lu, SymbolicLu};
use faer::sparse::{SparseColMatRef, SymbolicSparseColMatRef};
use faer::{Conj, Mat, MatMut};

use super::block_lu::Singular;
use super::inverse::{QUICK, count_factorisation};
use super::{Csc, Matrix, admit_sparse, budget};

/// LU with row pivoting of a square [`Matrix`]: faer's blocked LU of a dense one, its supernodal or simplicial LU of a sparse one, whose symbolic
/// analysis is kept while the pattern stays.
///
/// Unlike [`Inverse`](super::Inverse) it copies nothing of the matrix, does not look for components, and does not refine: the caller knows the system.
/// Cost: `2/3 n³` of a dense matrix.
#[derive(Debug, Clone, Default)]
pub struct SquareLu {
    factor: Option<Factor>,
    /// The pattern that the analysis belongs to: column pointers and row indices.
    pattern: (Vec<usize>, Vec<usize>),
    symbolic: Option<SymbolicLu<usize>>,
}

#[derive(Debug, Clone)]
enum Factor {
    Dense(PartialPivLu<f64>),
    Sparse(Lu<usize, f64>),
}

impl SquareLu {
    /// Factorises `a`. Counts as one factorisation.
    ///
    /// Errors: a matrix with entries that are not finite, or on which elimination breaks down: exactly singular. One that is merely close to singular is
    /// factorised; its solutions show it.
    ///
    /// # Panics
    ///
    /// Where `a` is not square, or known by its products only.
    pub fn factorise(&mut self, a: &Matrix) -> Result<(), Singular> {
        assert_eq!(a.nrows(), a.ncols(), "a square matrix");
        count_factorisation();
        if a.nrows() > QUICK && budget::over() {
            return Err(Singular);
        }
        self.factor = None;
        let factor = match a {
            Matrix::Dense(a) => {
                let n = a.nrows();
                admit_dense(n)?;
                let a = Mat::from_fn(n, n, |i, j| a[(i, j)]);
                let lu = a.partial_piv_lu();
                let regular = |i: usize| lu.U()[(i, i)] != 0.0 && lu.U()[(i, i)].is_finite();
                (0..n).all(regular).then_some(Factor::Dense(lu)).ok_or(Singular)?
            }
            Matrix::Sparse(a) => Factor::Sparse(self.sparse(a)?),
            Matrix::Operator(_) => panic!("an operator has no entries"),
        };
        self.factor = Some(factor);
        self.reproduces(a)
    }

    fn sparse(&mut self, a: &Csc) -> Result<Lu<usize, f64>, Singular> {
        if a.values().iter().any(|x| !x.is_finite()) {
            return Err(Singular);
        }
        let n = a.nrows();
        let pattern = SymbolicSparseColMatRef::new_checked(n, n, a.col_ptr(), None, a.row_idx());
        let same = self.pattern.0 == a.col_ptr() && self.pattern.1 == a.row_idx();
        if !same || self.symbolic.is_none() {
            let entries = a.triplets().map(|(i, j, _)| (i, j));
            admit_sparse("a sparse LU factorisation", n, entries, 2.0).map_err(|_| Singular)?;
            self.symbolic = Some(SymbolicLu::try_new(pattern).map_err(|_| Singular)?);
            self.pattern.0.clear();
            self.pattern.0.extend_from_slice(a.col_ptr());
            self.pattern.1.clear();
            self.pattern.1.extend_from_slice(a.row_idx());
        }
        let symbolic = self.symbolic.clone().ok_or(Singular)?;
        Lu::try_new_with_symbolic(symbolic, SparseColMatRef::new(pattern, a.values()))
            .map_err(|_| Singular)
    }

    /// A zero pivot of the sparse LU shows in a solution that is not finite.
    fn reproduces(&mut self, a: &Matrix) -> Result<(), Singular> {
        let mut x: Vec<f64> =
            (0..a.nrows()).map(|i| 1.0 + (i as f64 * 0.618_034).fract()).collect();
        self.solve(&mut x);
        if x.iter().all(|x| x.is_finite()) {
            return Ok(());
        }
        self.factor = None;
        Err(Singular)
    }

    /// `b ← A⁻¹ b`, without refinement. Allocates a buffer.
    ///
    /// # Panics
    ///
    /// Before the first successful [`factorise`](Self::factorise), or where the length is wrong.
    pub fn solve(&self, b: &mut [f64]) {
        let n = b.len();
        let b = MatMut::from_column_major_slice_mut(b, n, 1);
        match self.factor.as_ref().expect("factorised") {
            Factor::Dense(lu) => lu.solve_in_place_with_conj(Conj::No, b),
            Factor::Sparse(lu) => lu.solve_in_place_with_conj(Conj::No, b),
        }
    }

    /// `b ← A⁻ᵀ b`, as [`solve`](Self::solve).
    ///
    /// # Panics
    ///
    /// As [`solve`](Self::solve).
    pub fn solve_transpose(&self, b: &mut [f64]) {
        let n = b.len();
        let b = MatMut::from_column_major_slice_mut(b, n, 1);
        match self.factor.as_ref().expect("factorised") {
            Factor::Dense(lu) => lu.solve_transpose_in_place_with_conj(Conj::No, b),
            Factor::Sparse(lu) => lu.solve_transpose_in_place_with_conj(Conj::No, b),
        }
    }
}

fn admit_dense(n: usize) -> Result<(), Singular> {
    let needed = 8.0 * (n as f64) * (n as f64);
    budget::admit("a dense LU factorisation", needed).map_err(|_| Singular)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::Dense;

    fn example(n: usize, shift: f64) -> Dense {
        Dense::from_fn(n, n, |i, j| {
            let near = i.abs_diff(j) <= 2 || (i * j) % 17 == 5;
            let x = ((3 * i + 7 * j) as f64 + shift).sin();
            if i == j { 3.0 + x } else { x * f64::from(u8::from(near)) }
        })
    }

    #[test]
    fn dense_and_sparse_factors_solve_both_ways() {
        let mut lu = [SquareLu::default(), SquareLu::default()];
        for shift in [0.0, 0.3] {
            let dense = example(60, shift);
            let x: Vec<f64> = (0..60).map(|i| (i as f64).cos()).collect();
            for (lu, a) in lu.iter_mut().zip([Matrix::from(dense.clone()), dense.to_csc().into()]) {
                lu.factorise(&a).unwrap();
                let mut b = vec![0.0; 60];
                a.mul(&x, &mut b);
                lu.solve(&mut b);
                assert!(x.iter().zip(&b).all(|(x, b)| (x - b).abs() < 1e-12));
                a.mul_transpose(&x, &mut b);
                lu.solve_transpose(&mut b);
                assert!(x.iter().zip(&b).all(|(x, b)| (x - b).abs() < 1e-12));
            }
        }
    }

    #[test]
    fn singular_matrices_are_refused() {
        let zero_row = Dense::from_rows(&[[1.0, 2.0], [0.0, 0.0]]).unwrap();
        let twice = Dense::from_rows(&[[1.0, 2.0], [2.0, 4.0]]).unwrap();
        let nan = Dense::from_rows(&[[1.0, f64::NAN], [2.0, 4.0]]).unwrap();
        for a in [zero_row, twice, nan] {
            assert!(SquareLu::default().factorise(&a.to_csc().into()).is_err(), "{a:?}");
            assert!(SquareLu::default().factorise(&a.into()).is_err());
        }
    }
}
