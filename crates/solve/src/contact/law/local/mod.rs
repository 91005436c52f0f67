//! One-contact solvers: given `u = W r + q` with a single D×D block, find r that obeys the law, or come closer.
//!
//! Block Gauss–Seidel is generic over them, so the kernel inlines. A frictionless contact (`mu = 0`) has the closed
//! form [`frictionless`], and a contact in the plane the closed form of [`Exact`]; neither depends on the choice. The projecting solvers take any law.

mod exact;
mod newton;
mod projection;
mod quartic;
mod rolling;

use nonsmooth_linalg::small;

use crate::contact::law::{ContactLaw, Coulomb};

pub use exact::Exact;
pub use newton::Newton;
pub use projection::{Projection, ProjectionIterated};
pub use quartic::Quartic;
pub use rolling::RollingExact;

/// A solver of one contact with the law L.
pub trait LocalSolver<const D: usize, L = Coulomb>: Send + Sync {
    /// What it keeps for one contact between visits.
    type Memo: Send + Sync;

    /// From now on a contact need not be solved more exactly than this, in units of velocity; 0 asks for all that rounding
    /// allows. Ignored by solvers that have nothing to save.
    fn tolerate(&mut self, _velocity: f64) {}

    /// Prepares for the block `w` of a contact that is not frictionless.
    fn prepare(&self, w: &[[f64; D]; D], law: L) -> Self::Memo;

    /// A new impulse for the contact: `q` is its velocity without its own impulse, `r` its present impulse.
    fn solve(
        &self,
        memo: &mut Self::Memo,
        w: &[[f64; D]; D],
        q: &[f64; D],
        law: L,
        r: &[f64; D],
    ) -> [f64; D];
}

/// `0 ≤ W_NN r_N + q_N ⟂ r_N ≥ 0`, `r_T = 0`.
#[inline(always)]
pub fn frictionless<const D: usize>(w: &[[f64; D]; D], q: &[f64; D], r: &[f64; D]) -> [f64; D] {
    let mut out = [0.0; D];
    if q[0] < 0.0 {
        // Without W_NN > 0 nothing moves the contact: keep what it has.
        out[0] = if w[0][0] > 0.0 { -q[0] / w[0][0] } else { r[0].max(0.0) };
    }
    out
}

/// `u = W r + q`.
#[inline(always)]
fn velocity<const D: usize>(w: &[[f64; D]; D], q: &[f64; D], r: &[f64; D]) -> [f64; D] {
    let mut u = small::mul(w, r);
    for k in 0..D {
        u[k] += q[k];
    }
    u
}

/// ũ.
#[inline(always)]
fn modified_velocity<L: ContactLaw<D>, const D: usize>(
    w: &[[f64; D]; D],
    q: &[f64; D],
    law: L,
    r: &[f64; D],
) -> [f64; D] {
    let mut u = velocity(w, q, r);
    u[0] += law.shift(&u);
    u
}

/// The inverse of a block, or of the block with a small multiple of its mean diagonal added where it is singular
/// (a contact whose motion the bodies cannot follow in every direction).
fn inverse_or_regularised<const D: usize>(w: &[[f64; D]; D]) -> Option<[[f64; D]; D]> {
    small::inverse(w).or_else(|| {
        let mut shifted = *w;
        for k in 0..D {
            shifted[k][k] += 1e-12 * small::mean_diagonal(w).abs();
        }
        small::inverse(&shifted)
    })
}

/// A bound on the spectral radius of a block: the smaller of its row-sum and Frobenius norms.
fn norm_bound<const D: usize>(w: &[[f64; D]; D]) -> f64 {
    let rows = w.iter().map(|r| r.iter().map(|x| x.abs()).sum::<f64>()).fold(0.0, f64::max);
    rows.min(w.iter().flatten().map(|x| x * x).sum::<f64>().sqrt())
}
