//! Tresca's cylinder `T_θ = R₊ × D(θ)`: friction with a threshold that does not depend on the pressure.
//!
//! Source: Acary, lecture (118)–(122).

use super::{ConvexSet, Disk};

/// `{x_N ≥ 0, ‖x_T‖ ≤ θ}`.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Cylinder {
    /// θ; negative is none.
    pub threshold: f64,
}

/// The tangential part by itself, in an array that holds the normal component as zero: the disk then is that of the plane.
fn tangential<const D: usize>(x: &[f64; D]) -> [f64; D] {
    let mut t = *x;
    t[0] = 0.0;
    t
}

impl<const D: usize> ConvexSet<D> for Cylinder {
    fn project(&self, x: &[f64; D]) -> [f64; D] {
        let mut p = Disk { radius: self.threshold }.project(&tangential(x));
        p[0] = x[0].max(0.0);
        p
    }

    fn jacobian(&self, x: &[f64; D]) -> [[f64; D]; D] {
        let mut out = Disk { radius: self.threshold }.jacobian(&tangential(x));
        out[0][0] = f64::from(u8::from(x[0] > 0.0));
        out
    }
}
