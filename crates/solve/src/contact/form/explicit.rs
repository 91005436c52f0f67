//! The problem as entries of matrices, for solvers that take nothing else.

use nonsmooth_linalg::Csc;
use nonsmooth_problem::{FrictionGlobal, FrictionLocal};

use super::Linear;
use crate::contact::law::DiskLaw;

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
fn symmetric_part(a: &Csc) -> (Csc, bool) {
    let halves = a.triplets().flat_map(|(i, j, x)| [(i, j, 0.5 * x), (j, i, 0.5 * x)]);
    let part = Csc::from_triplets(a.nrows(), a.ncols(), halves).expect("a square matrix");
    (part, a.asymmetry() <= ROUNDING)
}

impl<const D: usize, L: DiskLaw<D>> Explicit<D> for FrictionLocal<D, L> {
    fn model(&self, state: &Self::State) -> Model {
        let (quadratic, symmetric) = symmetric_part(&state.operator(self).0.to_csc());
        let linear = Csc::zeros(0, quadratic.ncols());
        Model { quadratic, linear, symmetric }
    }
}

impl<const D: usize, L: DiskLaw<D>> Explicit<D> for FrictionGlobal<D, L> {
    /// `x = (r, v, λ)`, `½ vᵀ M_s v`, `M_s v = H r + G λ`: the multipliers of the equalities are −v, so that
    /// `W_s r = Hᵀ v` and `Gᵀ v = 0`.
    fn model(&self, _: &Self::State) -> Model {
        let (mass, symmetric) = symmetric_part(&self.M);
        let (n, m) = (self.dofs(), self.w.len());
        let size = m + n + self.multipliers();
        let quadratic = mass.triplets().map(|(i, j, x)| (m + i, m + j, x));
        let quadratic = Csc::from_triplets(size, size, quadratic).expect("indices in range");
        let dynamics = (mass.triplets().map(|(i, j, x)| (i, m + j, x)))
            .chain(self.H.triplets().map(|(i, j, x)| (i, j, -x)));
        let bilateral = self.rows.iter().flat_map(|b| b.G.triplets());
        let linear = dynamics.chain(bilateral.map(|(i, j, x)| (i, m + n + j, -x)));
        let linear = Csc::from_triplets(n, size, linear).expect("indices in range");
        Model { quadratic, linear, symmetric }
    }
}
