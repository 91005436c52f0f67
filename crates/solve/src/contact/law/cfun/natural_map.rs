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

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use super::{ContactFunction, Linearisation, NewtonFunction, OneContact};
use crate::contact::law::cone::{self, Region};
use crate::contact::law::{ContactLaw, DiskLaw};
use crate::core::register::Named;
use crate::core::settings::Settings;

/// `x − P_K(x − ũ)` by the three regions of the cone, so that a large x does not round ũ away.
#[inline(always)]
pub fn natural_map<const D: usize>(x: &[f64; D], modified: &[f64; D], mu: f64) -> [f64; D] {
    let mut y = *x;
    for k in 0..D {
        y[k] -= modified[k];
    }
    match cone::region(&y, mu) {
        Region::Inside => *modified,
        Region::Polar => *x,
        Region::Outside => {
            // ũ + d n, with the distance d of y from K and the outward normal n.
            let size = cone::tangential_norm(&y);
            let scale = (size - mu * y[0]) / (1.0 + mu * mu);
            let mut phi = *modified;
            phi[0] -= mu * scale;
            for k in 1..D {
                phi[k] += scale * (y[k] / size);
            }
            phi
        }
    }
}

/// One contact's part of the natural residual, `‖w r − P_K(w r − ũ)‖²`.
#[inline(always)]
pub fn natural_residual<L: ContactLaw<D>, const D: usize>(
    w: f64,
    r: &[f64; D],
    u: &[f64; D],
    law: L,
) -> f64 {
    let mut modified = *u;
    modified[0] += law.shift(u);
    law.natural(&r.map(|r| w * r), &modified).iter().map(|v| v * v).sum()
}

/// The natural map.
///
/// Newton's method on it is `newton_nm`: AcaryBremondHuber2018; Acary, lecture (108)–(110). Fails: ‖u_T‖ has its kink at every sticking contact, so fewer starts converge than with Alart–Curnier.
#[derive(Debug, Clone, Copy, Default, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(default)]
pub struct NaturalMap {}

impl Settings for NaturalMap {}

impl NewtonFunction for NaturalMap {
    const METHOD: Named = Named {
        name: "newton_nm",
        summary: "semismooth Newton on the natural map of the cone",
        cites: &["AcaryBremondHuber2018", "Acary2018"],
        variants: &[],
    };
}

impl<L: DiskLaw<D>, const D: usize> ContactFunction<D, L> for NaturalMap {
    fn linearise(&self, contact: &OneContact<L>, u: &[f64; D], r: &[f64; D]) -> Linearisation<D> {
        let (law, rho) = (contact.law, contact.rho_cone);
        let mut modified = *u;
        modified[0] += law.shift(u);
        let t = law.slope(u);
        let scaled = modified.map(|v| rho * v);
        let mut out = Linearisation::zero();
        out.phi = law.natural(r, &scaled);
        let mut x = *r;
        for k in 0..D {
            x[k] -= scaled[k];
        }
        // ∂Φ/∂r = I − P', ∂Φ/∂u = ρ P' ∂ũ/∂u, ∂ũ/∂u = I + e_N tᵀ, t = ∂shift/∂u.
        let slope = law.jacobian(&x);
        for k in 0..D {
            for l in 0..D {
                out.b[k][l] = f64::from(u8::from(k == l)) - slope[k][l];
                out.a[k][l] = rho * (slope[k][l] + slope[k][0] * t[l]);
            }
        }
        out
    }
}
