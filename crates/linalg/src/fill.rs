//! How much memory a sparse factorisation takes, before it begins.

use faer::Side;
use faer::sparse::SymbolicSparseColMatRef;
use faer::sparse::linalg::cholesky::{
    CholeskySymbolicParams, SymmetricOrdering, factorize_symbolic_cholesky,
};

use super::Csc;
use super::budget::{self, TooLarge};

/// Beside L's entries: indices, fronts and what the library adds to fill columns up.
const OVERHEAD: f64 = 1.5;

/// Whether there is the memory to factorise a sparse matrix of order `n` whose pattern, with its transpose, is that of `entries`: `factors` factors with the fill of a Cholesky
/// factor (1 of LLᵀ, 2 of LU, whose row exchanges may add more).
///
/// Where a full triangle fits, that is the answer; else the pattern is analysed, in an order of approximate minimum degree.
pub fn admit_sparse(
    what: &'static str,
    n: usize,
    entries: impl Iterator<Item = (usize, usize)> + Clone,
    factors: f64,
) -> Result<(), TooLarge> {
    let each = 8.0 * factors * OVERHEAD;
    if budget::fits(each * 0.5 * (n as f64) * (n as f64)) {
        return Ok(());
    }
    let lower = entries.map(|(i, j)| (i.max(j), i.min(j), 1.0));
    let diagonal = (0..n).map(|i| (i, i, 1.0));
    // Out of range: the factorisation itself will say so.
    let Ok(a) = Csc::from_triplets(n, n, lower.chain(diagonal)) else { return Ok(()) };
    let pattern = SymbolicSparseColMatRef::new_checked(n, n, a.col_ptr(), None, a.row_idx());
    let symbolic = factorize_symbolic_cholesky(
        pattern,
        Side::Lower,
        SymmetricOrdering::Amd,
        CholeskySymbolicParams::default(),
    );
    match symbolic {
        Ok(symbolic) => budget::admit(what, each * symbolic.len_val() as f64),
        // The analysis itself does not fit.
        Err(_) => budget::admit(what, each * 0.5 * (n as f64) * (n as f64)),
    }
}

#[cfg(test)]
mod tests {
    use super::super::budget::Budget;
    use super::*;

    #[test]
    fn a_chain_is_admitted_where_a_full_matrix_is_not() {
        let n = 3000;
        let chain = (1..n).map(|i| (i, i - 1));
        let full = (0..n).flat_map(|i| (0..i).map(move |j| (i, j)));
        let memory = Some(4 << 20);
        let _scope = Budget { memory, ..Budget::default() }.enter();
        assert_eq!(admit_sparse("the factor", n, chain, 2.0), Ok(()));
        let refused = admit_sparse("the factor", n, full, 2.0).unwrap_err();
        assert!(refused.needed > 5e7 && refused.needed < 3e8, "{refused}");
    }
}
