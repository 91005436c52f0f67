//! What is asked before a program goes to Clarabel, whose factorisations cannot be interrupted.

use clarabel::algebra::CscMatrix;
use nonsmooth_linalg::admit_sparse;
use nonsmooth_linalg::budget::{self, TooLarge};

/// Whether there is the memory for the factor of Clarabel's matrix `[P, Aᵀ; A, ·]`.
pub fn admit_program(p: &CscMatrix<f64>, a: &CscMatrix<f64>) -> Result<(), TooLarge> {
    let entries = |m: &CscMatrix<f64>, below: usize| {
        let all = (0..m.n).flat_map(|j| (m.colptr[j]..m.colptr[j + 1]).map(move |k| (k, j)));
        all.map(|(k, j)| (below + m.rowval[k], j)).collect::<Vec<_>>()
    };
    let order = p.n + a.m;
    let needed = 6.0 * (order as f64) * (order as f64);
    if budget::fits(needed) {
        return Ok(());
    }
    let pattern = [entries(p, 0), entries(a, p.n)].concat();
    admit_sparse("the factorisation of a cone program", order, pattern.into_iter(), 1.0)
}
