//! Matrices and factorisations: what problems are stated with, judged with and solved with. Knows no problem.
//!
//! [`small`]: D×D blocks on arrays. [`Csc`]: general sparse. [`Bsr`]: block-sparse rows, the storage of W.
//! [`Dense`], [`Matrix`]: the matrices of complementarity problems, dense, sparse or known by products.
//! [`Inverse`]: factorisation of M (or of M with bilateral constraints) behind one face.
//! [`SquareLu`]: LU of a dense or sparse square matrix, made again and again.
//! [`RankLu`]: LU of a sparse matrix that may be singular, with the columns that depend on others named.
//! [`BlockLu`]: LU of Newton matrices, analysed once and factorised many times.
//! [`Compensated`], [`Doubled`]: sums and numbers in doubled precision.
//! [`Delassus`]: W = Hᵀ M⁻¹ H as an operator, never formed, or condensed into a [`Bsr`].
//! All of them are made from slices, and from and to matrices of faer, and with the features `nalgebra` and `sprs` of those crates.
//! [`Passes`]: sweeps of several threads one behind the other, with the bits of one.
//! [`pieces`]: work over long vectors on several threads, with the bits of one.
//! [`LargePages`]: an allocator for programs that hold large arrays.
//! [`budget`]: the time and memory that all of these may use.

mod block_lu;
mod bsr;
pub mod budget;
mod compensated;
mod convert;
mod csc;
mod delassus;
mod dense;
mod doubled;
mod error;
mod fill;
mod groups;
mod inverse;
mod matrix;
mod pages;
mod passes;
pub mod pieces;
mod rank_lu;
mod roots;
mod row;
pub mod small;
mod square_cholesky;
mod square_lu;

pub use block_lu::{BlockLu, Singular, Slot};
pub use bsr::{Block, BlockRow, Bsr};
pub use compensated::Compensated;
pub use csc::Csc;
pub use delassus::{Delassus, Moving};
pub use dense::Dense;
pub use doubled::{Doubled, Real, power_of_two};
pub use error::MatrixError;
pub use fill::admit_sparse;
pub use groups::Groups;
pub use inverse::{Inverse, Refine, factorisations, is_positive_definite, uncounted};
pub use matrix::{Matrix, Operator};
pub use pages::LargePages;
pub use passes::{Parts, Passes};
pub use rank_lu::RankLu;
pub use square_cholesky::SquareCholesky;
pub use square_lu::SquareLu;

/// `xᵀ y`, as eight sums side by side, which are vectorised.
#[inline]
pub fn dot(x: &[f64], y: &[f64]) -> f64 {
    let ((x8, x), (y8, y)) = (x.as_chunks::<8>(), y.as_chunks::<8>());
    let mut sums = [0.0; 8];
    for (x, y) in x8.iter().zip(y8) {
        for k in 0..8 {
            sums[k] += x[k] * y[k];
        }
    }
    let rest: f64 = x.iter().zip(y).map(|(x, y)| x * y).sum();
    sums.iter().sum::<f64>() + rest
}

/// The Euclidean norm, scaled so that neither overflow nor underflow of the squares spoils it.
#[inline]
pub fn norm(x: &[f64]) -> f64 {
    norm_of(x.iter().copied())
}

/// `‖x‖`, or 1 where x = 0: what errors are relative to.
#[inline]
pub fn norm_or_one(x: &[f64]) -> f64 {
    match norm(x) {
        size if size > 0.0 => size,
        _ => 1.0,
    }
}

/// [`norm`] of values that are computed as they come; they are run through more than once only where the plain sum
/// of squares leaves the range of f64, or where every value is zero or not finite.
#[inline]
pub fn norm_of(x: impl Iterator<Item = f64> + Clone) -> f64 {
    let plain = x.clone().map(|v| v * v).sum::<f64>();
    if plain.is_finite() && plain > f64::MIN_POSITIVE / f64::EPSILON {
        return plain.sqrt();
    }
    let largest = x.clone().fold(0.0_f64, |a, v| a.max(v.abs()));
    if largest == 0.0 || !largest.is_finite() {
        return if x.clone().any(f64::is_nan) { f64::NAN } else { largest };
    }
    largest * x.map(|v| (v / largest) * (v / largest)).sum::<f64>().sqrt()
}
