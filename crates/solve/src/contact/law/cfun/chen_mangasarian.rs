//! The Chen–Mangasarian class of smoothings of the natural map, over the second-order cone.
//!
//! ```text
//! φ_ε(x, y) = x − P_ε(x − y),   P_ε(z) = ε ĝ(λ₁/ε) c₁ + ε ĝ(λ₂/ε) c₂,   x = (mu r_N, r_T),  y = ρ (ũ_N/mu, ũ_T)
//! ĝ(a) = (√(a² + 4) + a)/2      Chen–Harker–Kanzow–Smale
//! ĝ(a) = ln(1 + eᵃ)             neural network
//! ```
//!
//! with the spectral decomposition of `z = x − y`. As ε → 0, `P_ε → P_L`, and φ becomes the natural map in these coordinates.
//! `ĝ(a) − a = ĝ(−a)` for both, so `φ = y − P_ε(−z)`: the form without cancellation where z is inside L. Without friction it is
//! the scalar function of `(r_N, ρ u_N)`, with `Φ_T = r_T`.
//!
//! Source: ChenMangasarian1996; FukushimaLuoTseng2001, section 4; Acary, lecture, after (117). In the unscaled coordinates:
//! docs/derivations/cone-functions.md.

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use super::{ContactFunction, Linearisation, NewtonFunction, OneContact, SelfDual};
use crate::contact::law::cone::jordan;
use crate::core::register::Named;
use crate::core::settings::Settings;

/// ĝ.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
pub enum Kernel {
    /// `(sqrt(a^2 + 4) + a)/2`, of Chen and Harker, Kanzow, and Smale.
    #[default]
    Chks,
    /// `ln(1 + exp(a))`, of neural networks.
    NeuralNetwork,
}

impl Kernel {
    /// `ε ĝ(λ/ε)` and its derivative `ĝ'(λ/ε)`; `max(0, λ)` for ε = 0.
    fn positive_part(self, lambda: f64, epsilon: f64) -> (f64, f64) {
        if epsilon <= 0.0 {
            return if lambda > 0.0 { (lambda, 1.0) } else { (0.0, 0.0) };
        }
        match self {
            Kernel::Chks => {
                let root = (lambda * lambda + 4.0 * epsilon * epsilon).sqrt();
                let value = if lambda > 0.0 {
                    0.5 * (root + lambda)
                } else {
                    2.0 * epsilon * epsilon / (root - lambda)
                };
                (value, value / root)
            }
            Kernel::NeuralNetwork => {
                let small = (-lambda.abs() / epsilon).exp();
                let value = lambda.max(0.0) + epsilon * small.ln_1p();
                let slope = if lambda > 0.0 { 1.0 } else { small } / (1.0 + small);
                (value, slope)
            }
        }
    }
}

/// The smoothed natural map with the kernel given; ε is [`OneContact::smoothing`].
///
/// Newton's method on it is `newton_cm`: ChenMangasarian1996; FukushimaLuoTseng2001, section 4. Fails: as `newton_fb`.
#[derive(Debug, Clone, Copy, Default, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(default)]
pub struct ChenMangasarian {
    /// The smoothing of the positive part.
    pub kernel: Kernel,
}

/// Where z lies with respect to L, for the form of φ.
enum Piece {
    Inside,
    Polar,
    Outside,
}

impl Settings for ChenMangasarian {}

impl NewtonFunction for ChenMangasarian {
    const METHOD: Named = Named {
        name: "newton_cm",
        summary: "smoothing Newton on the Chen-Mangasarian class over the second-order cone",
        cites: &["ChenMangasarian1996", "FukushimaLuoTseng2001", "Acary2018"],
        variants: &["kernel=neural_network"],
    };
}

impl<const D: usize> ContactFunction<D> for ChenMangasarian {
    const SMOOTHED: bool = true;

    fn linearise(&self, contact: &OneContact, u: &[f64; D], r: &[f64; D]) -> Linearisation<D> {
        let part = |lambda: f64| self.kernel.positive_part(lambda, contact.smoothing);
        if contact.law.mu <= 0.0 {
            let y = contact.rho_cone * u[0];
            let mut out = Linearisation::zero();
            let (value, slope) = part(r[0] - y);
            out.phi[0] = if r[0] > y { y - part(y - r[0]).0 } else { r[0] - value };
            out.a[0][0] = contact.rho_cone * slope;
            out.b[0][0] = 1.0 - slope;
            out.set_no_friction(r);
            return out;
        }
        let pair = SelfDual::new(contact, u, r);
        let SelfDual { x, y, .. } = &pair;
        let mut z = *x;
        for k in 0..D {
            z[k] -= y[k];
        }
        let spectral = jordan::spectral(&z);
        let [low, high] = spectral.values;
        let piece = if low > 0.0 {
            Piece::Inside
        } else if high <= 0.0 {
            Piece::Polar
        } else {
            Piece::Outside
        };
        let mut phi = match piece {
            Piece::Inside => *y,
            Piece::Polar | Piece::Outside => *x,
        };
        let away = match piece {
            Piece::Inside => spectral.map(|l| part(-l).0).point(),
            Piece::Polar | Piece::Outside => spectral.map(|l| part(l).0).point(),
        };
        for k in 0..D {
            phi[k] -= away[k];
        }
        // ∂φ/∂x = I − P', ∂φ/∂y = P'.
        let at = [part(low), part(high)];
        let slope = spectral.derivative([at[0].0, at[1].0], [at[0].1, at[1].1]);
        let mut rest = slope.map(|row| row.map(|v| -v));
        for k in 0..D {
            rest[k][k] += 1.0;
        }
        pair.pull_back(contact.law.mu, phi, &rest, &slope)
    }
}
