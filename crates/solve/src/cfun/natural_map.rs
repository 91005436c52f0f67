//! The natural map of the cone complementarity problem.
//!
//! ```text
//! Φ = r − P_K(r − ρ ũ),   ũ = u + mu‖u_T‖ e_N          (108)(109)
//! ```
//!
//! Vanishes exactly at the solutions, for any ρ > 0. Its kinks are those of the projection and, in every stick and at no speed,
//! that of ‖u_T‖; so it is semismooth, not smooth, at sticking contacts.
//!
//! Source: AcaryBremondHuber2018; Acary, lecture (108)(109), with the sign of docs/notation.md.

use super::{ContactFunction, Law, Linearisation, modified_velocity};
use crate::cone::{self, Region};

/// The natural map.
#[derive(Debug, Clone, Copy, Default)]
pub struct NaturalMap;

impl<const D: usize> ContactFunction<D> for NaturalMap {
    fn linearise(&self, law: &Law, u: &[f64; D], r: &[f64; D]) -> Linearisation<D> {
        let (mu, rho) = (law.mu, law.rho_cone);
        let (modified, t) = modified_velocity(u, mu, 0.0);
        let mut x = *r;
        for k in 0..D {
            x[k] -= rho * modified[k];
        }
        let mut out = Linearisation::zero();
        // The differences of r and its projection are written without cancellation.
        match cone::region(&x, mu) {
            Region::Inside => out.phi = modified.map(|v| rho * v),
            Region::Polar => out.phi = *r,
            Region::Outside => {
                // ρ ũ + d n, with the distance d of x from K and the outward normal n.
                let size = cone::tangential_norm(&x);
                let scale = (size - mu * x[0]) / (1.0 + mu * mu);
                out.phi[0] = rho * modified[0] - mu * scale;
                for k in 1..D {
                    out.phi[k] = rho * modified[k] + scale * (x[k] / size);
                }
            }
        }
        // ∂Φ/∂r = I − P', ∂Φ/∂u = ρ P' ∂ũ/∂u, ∂ũ/∂u = I + mu e_N tᵀ.
        let slope = cone::projection_jacobian(&x, mu);
        for k in 0..D {
            for l in 0..D {
                out.b[k][l] = f64::from(u8::from(k == l)) - slope[k][l];
                out.a[k][l] = rho * (slope[k][l] + mu * slope[k][0] * t[l]);
            }
        }
        out
    }
}
