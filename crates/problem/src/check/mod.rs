//! The judge: how far a point is from solving a problem, computed from the problem's data alone.
//!
//! Nothing here is shared with a solver: products with W are written out plainly, the distance to the cone
//! comes from its definition, and a test confronts both with the solvers' kernels. The status that a user sees
//! is decided by [`Measure::passes`] at the `relative` residual.

mod certificate;
mod contact;
mod global;
mod local;
mod verdict;

pub use certificate::Certificate;
pub(crate) use certificate::{refutes_global, refutes_local};
pub use contact::{ContactStatus, Motion};
pub use global::GlobalGauge;
pub use local::LocalGauge;
pub use verdict::{Judged, StatusCounts, Verdict};

use serde::Serialize;

/// The dynamics residual that still counts as rounding.
pub const DYNAMICS_TOLERANCE: f64 = 1e-10;

/// The residuals of a point. With `x_c = w_c r_c`, `w_c = tr(W_cc)/D`, `ũ_c = u_c + mu‖u_T‖e_N`:
///
/// | field | formula |
/// | --- | --- |
/// | `absolute` | `‖(x_c − P_K(x_c − ũ_c))_c‖₂`, a velocity in m/s |
/// | `relative` | `absolute / ‖q‖₂`; **decides**. With q = 0, `absolute` itself |
/// | `paper` | `‖r − P_K(r − ũ)‖₂ / ‖q‖₂` (natural map with ρ = 1) |
/// | `peer` | `‖r − P_K(r − ũ)‖₂ / max(‖q‖, ‖r‖, ‖u‖)` |
///
/// u is recomputed from r (for global problems through the dynamics, with `q = Hᵀ M⁻¹ f + w`). Where a contact's
/// `w_c` is not positive, the mean over the contacts stands in (1 if that is not positive either), so that
/// such a contact is still judged.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct Measure {
    /// The unscaled residual in velocity units.
    pub absolute: f64,
    /// The unit-free residual that decides.
    pub relative: f64,
    /// The residual of the published campaigns.
    pub paper: f64,
    /// The residual that Siconos reports.
    pub peer: f64,
    /// Infeasibility of the impulses: `‖(dist(x_c, K))_c‖ / ‖q‖`.
    pub primal: f64,
    /// Infeasibility of the velocities: `‖(dist(ũ_c, K*))_c‖ / ‖q‖`.
    pub dual: f64,
    /// Complementarity: `Σ |x_c · ũ_c| / ‖q‖²`.
    pub complementarity: f64,
    /// Global problems: `‖M v − H r − f − G λ‖ / max(‖f‖, ‖H r‖)`, the worse of the caller's v and the judge's own.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub dynamics: Option<f64>,
    /// Bilateral constraints: their violation over the size of the terms that should cancel.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub bilateral: Option<f64>,
    /// The contact with the largest share in `absolute`.
    pub worst_contact: usize,
    /// That contact's share, over `‖q‖`.
    pub worst: f64,
}

impl Measure {
    /// The residuals of a point that nobody has looked at: none of them passes, each is worse than any other.
    pub fn unknown() -> Self {
        let never = f64::INFINITY;
        Self {
            absolute: never,
            relative: never,
            paper: never,
            peer: never,
            primal: never,
            dual: never,
            complementarity: never,
            dynamics: None,
            bilateral: None,
            worst_contact: 0,
            worst: never,
        }
    }

    /// The decision: relative residual and bilateral violation within `tolerance`, dynamics at rounding level.
    pub fn passes(&self, tolerance: f64) -> bool {
        self.relative <= tolerance
            && self.bilateral.is_none_or(|b| b <= tolerance)
            && self.dynamics.is_none_or(|d| d <= DYNAMICS_TOLERANCE)
    }

    /// One number to compare two points of the same problem: the largest of what [`passes`](Self::passes)
    /// compares with the tolerance, infinite where the point is not finite or the dynamics are violated.
    pub fn merit(&self) -> f64 {
        let merit = self.relative.max(self.bilateral.unwrap_or(0.0));
        // f64::max ignores a NaN: ask each part.
        if self.relative.is_nan()
            || self.bilateral.is_some_and(f64::is_nan)
            || self.dynamics.is_some_and(|d| d.is_nan() || d > DYNAMICS_TOLERANCE)
        {
            return f64::INFINITY;
        }
        merit
    }
}

/// `a / b`, or `a` itself where `b` is zero: a residual with nothing to scale by is absolute.
fn over(a: f64, b: f64) -> f64 {
    if b > 0.0 { a / b } else { a }
}
