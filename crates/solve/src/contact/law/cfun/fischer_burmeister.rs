//! The Fischer–Burmeister function over the second-order cone, and its smoothing.
//!
//! ```text
//! φ(x, y) = x + y − (x² + y² + 2ε² e)^½,   x = (mu r_N, r_T),  y = ρ (ũ_N/mu, ũ_T)     (116)(117)
//! ```
//!
//! with squares and root in the Jordan algebra. For ε = 0 it vanishes exactly where `x, y ∈ L`, `xᵀy = 0`; for ε > 0 where
//! `x, y` are interior and `x∘y = ε² e`. With `z = (x² + y² + 2ε²e)^½`: `∂φ/∂x = I − L(z)⁻¹L(x)`, `∂φ/∂y = I − L(z)⁻¹L(y)`.
//! On the boundary, where L(z) is singular, the limit ε → 0 is taken. Without friction it is the scalar function of
//! `(r_N, ρ u_N)`, with `Φ_T = r_T`.
//!
//! Source: FukushimaLuoTseng2001; Acary, lecture (116)(117). In the unscaled coordinates:
//! docs/derivations/cone-functions.md.

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use super::{ContactFunction, Linearisation, NewtonFunction, OneContact, SelfDual};
use crate::contact::law::cone::jordan::{self, Spectral};
use crate::core::register::Named;
use crate::core::settings::Settings;

/// The Fischer–Burmeister function.
///
/// Newton's method on it is `newton_fb`: FukushimaLuoTseng2001; Acary, lecture (111)–(116). Fails: coordinates stretched by mu: small coefficients of friction make it ill conditioned; and as the natural map.
#[derive(Debug, Clone, Copy, Default, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(default)]
pub struct FischerBurmeister {}

/// Its smoothing, with ε from [`OneContact::smoothing`].
///
/// Newton's method on it is `newton_fb_smooth`: FukushimaLuoTseng2001; Acary, lecture (117). Fails: as `newton_fb`.
#[derive(Debug, Clone, Copy, Default, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(default)]
pub struct SmoothedFischerBurmeister {}

impl Settings for FischerBurmeister {}

impl NewtonFunction for FischerBurmeister {
    const METHOD: Named = Named {
        name: "newton_fb",
        summary: "semismooth Newton on the Fischer-Burmeister function over the second-order cone",
        cites: &["FukushimaLuoTseng2001", "Acary2018"],
        variants: &[],
    };
}

impl<const D: usize> ContactFunction<D> for FischerBurmeister {
    fn linearise(&self, contact: &OneContact, u: &[f64; D], r: &[f64; D]) -> Linearisation<D> {
        function(&OneContact { smoothing: 0.0, ..*contact }, u, r)
    }
}

impl Settings for SmoothedFischerBurmeister {}

impl NewtonFunction for SmoothedFischerBurmeister {
    const METHOD: Named = Named {
        name: "newton_fb_smooth",
        summary: "smoothing Newton on the Fischer-Burmeister function over the second-order cone",
        cites: &["FukushimaLuoTseng2001", "Acary2018"],
        variants: &[],
    };
}

impl<const D: usize> ContactFunction<D> for SmoothedFischerBurmeister {
    const SMOOTHED: bool = true;

    fn linearise(&self, contact: &OneContact, u: &[f64; D], r: &[f64; D]) -> Linearisation<D> {
        function(contact, u, r)
    }
}

/// How φ is computed; the derivative is the same.
enum Formula<const D: usize> {
    /// `x + y − z`.
    Difference,
    /// `L(x + y + z)⁻¹ (2 x∘y − 2ε²e)`, since `(x + y)² − z² = 2 x∘y − 2ε²e`: no cancellation of a large x with z.
    Quotient(Spectral<D>),
}

/// The quotient is used where `L(x + y + z)` is conditioned better than this.
const WELL_INSIDE: f64 = 0.01;

fn function<const D: usize>(contact: &OneContact, u: &[f64; D], r: &[f64; D]) -> Linearisation<D> {
    let epsilon = contact.smoothing;
    if contact.law.mu <= 0.0 {
        return frictionless(contact, u, r);
    }
    let pair = SelfDual::new(contact, u, r);
    let SelfDual { x, y, .. } = &pair;
    let root = jordan::root_of_squares(x, y, epsilon);
    let z = root.point();
    let mut sum = *x;
    for k in 0..D {
        sum[k] += y[k];
    }
    let mut total = sum;
    for k in 0..D {
        total[k] += z[k];
    }
    let total = jordan::spectral(&total);
    let formula = if total.values[0] > WELL_INSIDE * total.values[1] {
        Formula::Quotient(total)
    } else {
        Formula::Difference
    };
    let phi = match formula {
        Formula::Quotient(total) => {
            let mut product = jordan::product(x, y).map(|v| 2.0 * v);
            product[0] -= 2.0 * epsilon * epsilon;
            total.divide(&product)
        }
        Formula::Difference => {
            let mut phi = sum;
            for k in 0..D {
                phi[k] -= z[k];
            }
            phi
        }
    };
    pair.pull_back(contact.law.mu, phi, &one_minus(&root, x), &one_minus(&root, y))
}

/// `I − L(z)⁻¹ L(x)`.
fn one_minus<const D: usize>(z: &Spectral<D>, x: &[f64; D]) -> [[f64; D]; D] {
    let l = jordan::operator(x);
    let mut out = [[0.0; D]; D];
    for j in 0..D {
        // L(x) is symmetric: its column j is its row j.
        let column = z.divide(&l[j]);
        for k in 0..D {
            out[k][j] = f64::from(u8::from(k == j)) - column[k];
        }
    }
    out
}

/// `x + y − √(x² + y² + 2ε²)` with `x = r_N`, `y = ρ u_N`; `Φ_T = r_T`.
fn frictionless<const D: usize>(
    contact: &OneContact,
    u: &[f64; D],
    r: &[f64; D],
) -> Linearisation<D> {
    let (x, y, epsilon) = (r[0], contact.rho_cone * u[0], contact.smoothing);
    let z = (x * x + y * y + 2.0 * epsilon * epsilon).sqrt();
    let mut out = Linearisation::zero();
    let (cx, cy) = if z > 0.0 { (x / z, y / z) } else { (0.0, 0.0) };
    out.phi[0] =
        if x + y > 0.0 { 2.0 * (x * y - epsilon * epsilon) / (x + y + z) } else { x + y - z };
    out.a[0][0] = contact.rho_cone * (1.0 - cy);
    out.b[0][0] = 1.0 - cx;
    out.set_no_friction(r);
    out
}
