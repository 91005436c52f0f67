//! The problem as entries of matrices, for solvers that take nothing else.

use nonsmooth_problem::linalg::Csc;

use super::Linear;

/// The symmetric part of W as data. With unknowns `x = (r, z)`, r first:
///
/// ```text
/// W_s r = (P x + Eᵀ y)_r   where   E x = 0,   (P x + Eᵀ y)_z = 0.
/// ```
///
/// So `min ½ rᵀW_s r + bᵀ r` is `min ½ xᵀP x + bᵀ r` under `E x = 0`. Bilateral constraints are part of it.
#[derive(Debug, Clone)]
pub struct Model {
    /// P, symmetric and positive semidefinite where W is.
    pub quadratic: Csc,
    /// E; no rows where W itself is known.
    pub linear: Csc,
    /// Whether W_s is W up to rounding. Elsewhere `(W − W_s) r` belongs on the right-hand side.
    pub symmetric: bool,
}

/// Problems that can state the entries of their matrices.
pub trait Explicit<const D: usize>: Linear<D> {
    /// The data; made anew at each call.
    fn model(&self, state: &Self::State) -> Model;
}

/// What counts as rounding in the symmetry of a matrix.
const ROUNDING: f64 = 1e-13;

/// The symmetric part of `a`, and whether that is all of it.
pub(super) fn symmetric_part(a: &Csc) -> (Csc, bool) {
    let halves = a.triplets().flat_map(|(i, j, x)| [(i, j, 0.5 * x), (j, i, 0.5 * x)]);
    let part = Csc::from_triplets(a.nrows(), a.ncols(), halves).expect("a square matrix");
    (part, a.asymmetry() <= ROUNDING)
}
