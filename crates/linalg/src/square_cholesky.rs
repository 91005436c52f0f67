//! Cholesky factors of a symmetric positive definite matrix, dense or sparse, made again and again.

use faer::dyn_stack::{MemBuffer, MemStack};
use faer::linalg::cholesky::llt;
use faer::sparse::linalg::cholesky::{
    CholeskySymbolicParams, LltRef, SymbolicCholesky, SymmetricOrdering,
    factorize_symbolic_cholesky,
};
use faer::sparse::{SparseColMatRef, SymbolicSparseColMatRef};
use faer::{Conj, MatMut, MatRef, Par, Side};

use super::block_lu::Singular;
use super::inverse::{QUICK, count_factorisation};
use super::{Csc, Dense, Matrix, admit_sparse, budget};

/// `A = L Lᵀ` of a symmetric positive definite [`Matrix`]: faer's blocked factorisation of a dense one, its supernodal or simplicial one of a sparse one in
/// an order of approximate minimum degree, whose analysis is kept while the pattern stays.
///
/// The lower triangle is read. A factorisation of the same shape and pattern, and a solve, allocate nothing.
/// Cost: `1/3 n³` of a dense matrix. Storage: L, and what faer asks for beside it.
#[derive(Default)]
pub struct SquareCholesky {
    n: usize,
    /// L by columns if dense, as the analysis lays it out if sparse.
    values: Vec<f64>,
    /// Of a sparse matrix: column pointers, row indices and their analysis.
    pattern: (Vec<usize>, Vec<usize>),
    symbolic: Option<SymbolicCholesky<usize>>,
    buffer: Option<MemBuffer>,
    factorised: bool,
}

impl std::fmt::Debug for SquareCholesky {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.debug_struct("SquareCholesky")
            .field("n", &self.n)
            .field("factorised", &self.factorised)
            .finish()
    }
}

impl SquareCholesky {
    /// Factorises `a`. Counts as one factorisation.
    ///
    /// Errors: a matrix that is not positive definite within rounding, or has entries that are not finite.
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
        self.factorised = false;
        match a {
            Matrix::Dense(a) => self.dense(a)?,
            Matrix::Sparse(a) => self.sparse(a)?,
            Matrix::Operator(_) => panic!("an operator has no entries"),
        }
        self.factorised = true;
        Ok(())
    }

    fn dense(&mut self, a: &Dense) -> Result<(), Singular> {
        let n = a.nrows();
        if self.symbolic.is_some() || self.n != n || self.buffer.is_none() {
            let needed = 8.0 * (n as f64) * (n as f64);
            budget::admit("a dense Cholesky factorisation", needed).map_err(|_| Singular)?;
            let scratch = llt::factor::cholesky_in_place_scratch::<f64>(
                n,
                Par::Seq,
                faer::prelude::default(),
            );
            (self.symbolic, self.n, self.buffer) = (None, n, Some(MemBuffer::new(scratch)));
            self.values.resize(n * n, 0.0);
        }
        for j in 0..n {
            // Row j of a symmetric matrix is its column j; the part on and below the diagonal is read.
            for i in j..n {
                self.values[j * n + i] = a[(i, j)];
            }
        }
        let l = MatMut::from_column_major_slice_mut(&mut self.values, n, n);
        let stack = MemStack::new(self.buffer.as_mut().expect("made above"));
        llt::factor::cholesky_in_place(
            l,
            faer::prelude::default(),
            Par::Seq,
            stack,
            faer::prelude::default(),
        )
        .map_err(|_| Singular)?;
        let fine = |j: usize| self.values[j * n + j].is_finite() && self.values[j * n + j] > 0.0;
        (0..n).all(fine).then_some(()).ok_or(Singular)
    }

    fn sparse(&mut self, a: &Csc) -> Result<(), Singular> {
        if a.values().iter().any(|x| !x.is_finite()) {
            return Err(Singular);
        }
        let n = a.nrows();
        let pattern = SymbolicSparseColMatRef::new_checked(n, n, a.col_ptr(), None, a.row_idx());
        let same = self.pattern.0 == a.col_ptr() && self.pattern.1 == a.row_idx();
        if !same || self.symbolic.is_none() {
            let entries = a.triplets().map(|(i, j, _)| (i, j));
            let admitted = admit_sparse("a sparse Cholesky factorisation", n, entries, 1.0);
            admitted.map_err(|_| Singular)?;
            let symbolic = factorize_symbolic_cholesky(
                pattern,
                Side::Lower,
                SymmetricOrdering::Amd,
                CholeskySymbolicParams::default(),
            )
            .map_err(|_| Singular)?;
            let scratch = symbolic
                .factorize_numeric_llt_scratch::<f64>(Par::Seq, faer::prelude::default())
                .or(symbolic.solve_in_place_scratch::<f64>(1, Par::Seq));
            self.buffer = Some(MemBuffer::new(scratch));
            self.values.resize(symbolic.len_val(), 0.0);
            self.pattern.0.clear();
            self.pattern.0.extend_from_slice(a.col_ptr());
            self.pattern.1.clear();
            self.pattern.1.extend_from_slice(a.row_idx());
            self.n = n;
            self.symbolic = Some(symbolic);
        }
        let symbolic = self.symbolic.as_ref().expect("made above");
        symbolic
            .factorize_numeric_llt(
                &mut self.values,
                SparseColMatRef::new(pattern, a.values()),
                Side::Lower,
                faer::prelude::default(),
                Par::Seq,
                MemStack::new(self.buffer.as_mut().expect("made above")),
                faer::prelude::default(),
            )
            .map(|_| ())
            .map_err(|_| Singular)
    }

    /// `b ← A⁻¹ b`, without refinement.
    ///
    /// # Panics
    ///
    /// Unless the last [`factorise`](Self::factorise) was successful, or where the length is wrong.
    pub fn solve(&mut self, b: &mut [f64]) {
        assert!(self.factorised && b.len() == self.n, "factorised, of this order");
        let n = self.n;
        let rhs = MatMut::from_column_major_slice_mut(b, n, 1);
        let stack = MemStack::new(self.buffer.as_mut().expect("factorised"));
        match &self.symbolic {
            Some(symbolic) => LltRef::new(symbolic, &self.values).solve_in_place_with_conj(
                Conj::No,
                rhs,
                Par::Seq,
                stack,
            ),
            None => llt::solve::solve_in_place_with_conj(
                MatRef::from_column_major_slice(&self.values, n, n),
                Conj::No,
                rhs,
                Par::Seq,
                stack,
            ),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn example(n: usize, shift: f64) -> Dense {
        Dense::from_fn(n, n, |i, j| match i.abs_diff(j) {
            0 => 4.0 + shift + (i as f64).sin(),
            1 | 7 => -0.9,
            _ => 0.0,
        })
    }

    #[test]
    fn dense_and_sparse_factors_solve() {
        let (mut dense, mut sparse) = (SquareCholesky::default(), SquareCholesky::default());
        for shift in [0.0, 0.3] {
            let a = example(60, shift);
            let x: Vec<f64> = (0..60).map(|i| (i as f64).cos()).collect();
            for (factor, a) in
                [(&mut dense, Matrix::from(a.clone())), (&mut sparse, a.to_csc().into())]
            {
                factor.factorise(&a).unwrap();
                let mut b = vec![0.0; 60];
                a.mul(&x, &mut b);
                factor.solve(&mut b);
                assert!(x.iter().zip(&b).all(|(x, b)| (x - b).abs() < 1e-12));
            }
        }
    }

    #[test]
    fn indefinite_matrices_are_refused() {
        let indefinite = Dense::from_rows(&[[1.0, 2.0], [2.0, 1.0]]).unwrap();
        let nan = Dense::from_rows(&[[1.0, f64::NAN], [f64::NAN, 4.0]]).unwrap();
        let zero = Dense::zeros(2, 2);
        for a in [indefinite, nan, zero] {
            let mut factor = SquareCholesky::default();
            assert!(factor.factorise(&a.to_csc().into()).is_err(), "{a:?}");
            assert!(factor.factorise(&a.into()).is_err());
            factor.factorise(&example(5, 0.0).into()).unwrap();
        }
    }
}
