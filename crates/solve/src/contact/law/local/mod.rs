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

/// What tells the impulse of a contact at rest: the inverse of its block, or where the block is singular (a contact whose motion the bodies cannot follow in
/// every direction) a generalised one.
#[derive(Debug, Clone)]
struct Rest<const D: usize> {
    inverse: [[f64; D]; D],
    /// The inverse is a generalised one: not every velocity has an impulse.
    singular: bool,
}

/// What is left of the velocity of a contact at rest is rounding, in units of its terms.
const AT_REST: f64 = 1e-13;

impl<const D: usize> Rest<D> {
    /// `None` where the block moves nothing.
    fn new(w: &[[f64; D]; D]) -> Option<Self> {
        if let Some(inverse) = small::inverse(w) {
            return Some(Self { inverse, singular: false });
        }
        if let Some(inverse) = generalised_inverse(w) {
            return Some(Self { inverse, singular: true });
        }
        let mut shifted = *w;
        for k in 0..D {
            shifted[k][k] += 1e-12 * small::mean_diagonal(w).abs();
        }
        small::inverse(&shifted).map(|inverse| Self { inverse, singular: false })
    }

    /// r with `W r + q = 0`; `None` where a singular block has none.
    #[inline(always)]
    fn impulse(&self, w: &[[f64; D]; D], q: &[f64; D]) -> Option<[f64; D]> {
        let r = small::mul(&self.inverse, q).map(|x| -x);
        if self.singular { self.refined(w, q, r) } else { Some(r) }
    }

    #[cold]
    fn refined(&self, w: &[[f64; D]; D], q: &[f64; D], mut r: [f64; D]) -> Option<[f64; D]> {
        let step = small::mul(&self.inverse, &velocity(w, q, &r));
        for k in 0..D {
            r[k] -= step[k];
        }
        let size = |x: &[f64; D]| x.iter().fold(0.0_f64, |most, x| most.max(x.abs()));
        let left = size(&velocity(w, q, &r));
        (left <= AT_REST * (size(q) + norm_bound(w) * size(&r))).then_some(r)
    }
}

/// G with `W G W = W` of a symmetric, positive semidefinite block with `W_NN > 0`: `r = −G q` has the smallest tangential part of all r with `W r + q = 0`, so it is the limit of sliding without speed,
/// and where `q_N < 0` and it is outside of K there is a solution that slides. With the eigenpairs (λ, v) of the Schur complement, `p = (−W_NT v / W_NN, v)`:
/// `G = e_N e_Nᵀ / W_NN + Σ p pᵀ / λ` over λ ≠ 0.
fn generalised_inverse<const D: usize>(w: &[[f64; D]; D]) -> Option<[[f64; D]; D]> {
    let largest = w.iter().flatten().fold(0.0_f64, |s, v| s.max(v.abs()));
    // As of a pivot of the plain inverse.
    let zero = 1e-14 * largest;
    let symmetric = (0..D).all(|i| (0..i).all(|j| (w[i][j] - w[j][i]).abs() <= zero));
    let normal = 1.0 / w[0][0];
    if !(symmetric && normal > 0.0 && normal.is_finite() && largest.is_finite()) {
        return None;
    }
    let mut schur = [[0.0; D]; D];
    for i in 1..D {
        for j in 1..D {
            schur[i][j] = w[i][j] - w[i][0] * normal * w[0][j];
        }
    }
    let (values, vectors) = small::eigen(&schur);
    let mut inverse = [[0.0; D]; D];
    inverse[0][0] = normal;
    for (value, mut p) in values.into_iter().zip(vectors).filter(|(value, _)| value.abs() > zero) {
        p[0] = -normal * (1..D).map(|k| w[0][k] * p[k]).sum::<f64>();
        for i in 0..D {
            for j in 0..D {
                inverse[i][j] += p[i] * p[j] / value;
            }
        }
    }
    inverse.iter().flatten().all(|x| x.is_finite()).then_some(inverse)
}

/// A bound on the spectral radius of a block: the smaller of its row-sum and Frobenius norms.
fn norm_bound<const D: usize>(w: &[[f64; D]; D]) -> f64 {
    let rows = w.iter().map(|r| r.iter().map(|x| x.abs()).sum::<f64>()).fold(0.0, f64::max);
    rows.min(w.iter().flatten().map(|x| x * x).sum::<f64>().sqrt())
}
