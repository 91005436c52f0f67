//! The equations of Park and Kwak, and Leung, Chen and Chen, with the sliding angle in space.
//!
//! In the plane, with `x = r − ρu` and `R = mu max(0, x_N)`:
//!
//! ```text
//! Φ_N = min(ρ_N u_N, r_N)                                             (97)
//! Φ_T = ρ_T u_T + min(0, R + x_T) + max(0, x_T − R)                    (98)
//! ```
//!
//! which is Alart–Curnier's function, written otherwise. In space the sliding angle θ is a further unknown; here it is eliminated,
//! contact by contact, as the angle of `x_T = ‖x_T‖ (cos θ, sin θ)`: at a solution the direction against the sliding velocity, and
//! of r_T. With `t = (cos θ, sin θ)` and `s = t^⊥`, (98) holds along t and the impulse has no part across:
//!
//! ```text
//! Φ_t = ρ_T u_T·t + min(0, R + ‖x_T‖) + max(0, ‖x_T‖ − R),   Φ_s = r_T·s
//! ```
//!
//! that is Alart–Curnier's function in a frame that turns with the unknowns: the same zeros and merit, another Jacobian off the
//! solution, and so other Newton steps. Derivation: docs/derivations/sliding-angle.md.
//!
//! Source: ParkKwak1994; LeungChenChen1998; Acary, lecture (97)(98). Not differentiable where `x_T = 0`; the frame stands still there.

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use super::{ContactFunction, Linearisation, NewtonFunction, OneContact, Piece};
use crate::contact::law::cone::tangential_norm;
use crate::core::register::Named;
use crate::core::settings::Settings;

/// The function of Park and Kwak.
///
/// Newton's method on it is `newton_pk`: ParkKwak1994; LeungChenChen1998; Acary, lecture (97)(98); docs/derivations/sliding-angle.md. Fails: where `x_T` is nearly zero the frame turns fast and steps are short. In the plane it is `newton_ac`.
#[derive(Debug, Clone, Copy, Default, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(default)]
pub struct ParkKwak {}

impl Settings for ParkKwak {}

impl NewtonFunction for ParkKwak {
    const METHOD: Named = Named {
        name: "newton_pk",
        summary: "semismooth Newton on the equations of Park and Kwak, with the sliding angle in space",
        cites: &["ParkKwak1994", "LeungChenChen1998", "Acary2018"],
        variants: &[],
    };
}

impl<const D: usize> ContactFunction<D> for ParkKwak {
    fn linearise(&self, contact: &OneContact, u: &[f64; D], r: &[f64; D]) -> Linearisation<D> {
        let (mu, rho) = (contact.law.mu, contact.rho);
        let (mut out, x_n) = Linearisation::with_normal_part(u, r, &rho);
        let mut x = *r;
        for k in 1..D {
            x[k] -= rho.tangential * u[k];
        }
        let size = tangential_norm(&x);
        let radius = mu * x_n.max(0.0);
        let piece = Piece::of(size, radius);
        if mu <= 0.0 {
            out.set_no_friction(r);
            return out;
        }
        // The frame: t along x_T, s across it. In the plane t is a sign and nothing turns.
        let mut t = [0.0; D];
        t[1] = 1.0;
        if size > 0.0 {
            for k in 1..D {
                t[k] = x[k] / size;
            }
        }
        let mut s = [0.0; D];
        if D == 3 {
            (s[1], s[D - 1]) = (-t[D - 1], t[1]);
        }
        let dot = |a: &[f64; D], b: &[f64; D]| (1..D).map(|k| a[k] * b[k]).sum::<f64>();
        // Φ along t and across, with the derivatives by u and r in a frame at rest.
        let (along_u, along_r) = (rho.tangential * dot(u, &t), dot(r, &t));
        match piece {
            Piece::Stick => {
                out.phi[1] = along_u;
                for k in 1..D {
                    out.a[1][k] = rho.tangential * t[k];
                }
            }
            Piece::Slip | Piece::Open => {
                out.phi[1] = along_r - radius;
                out.b[1][1..D].copy_from_slice(&t[1..D]);
                if radius > 0.0 {
                    out.b[1][0] = -mu;
                    out.a[1][0] = mu * rho.normal;
                }
            }
        }
        if D == 3 {
            // r_T·s = ρ u_T·s, since x_T·s = 0: the smaller of the two is without cancellation.
            out.phi[D - 1] = match piece {
                Piece::Stick => rho.tangential * dot(u, &s),
                Piece::Slip | Piece::Open => dot(r, &s),
            };
            out.b[D - 1][1..D].copy_from_slice(&s[1..D]);
            if size > 0.0 {
                // The frame turns by dθ = s·dx/‖x_T‖: dt = s dθ, ds = −t dθ.
                // d(ρ u·t) = ρ t·du + ρ u·s dθ;  d(r·t) = t·dr + r·s dθ; and ρ u·s = r·s.
                let turn_t = out.phi[D - 1] / size;
                let turn_s = -along_r / size;
                for k in 1..D {
                    out.a[1][k] -= rho.tangential * turn_t * s[k];
                    out.b[1][k] += turn_t * s[k];
                    out.a[D - 1][k] -= rho.tangential * turn_s * s[k];
                    out.b[D - 1][k] += turn_s * s[k];
                }
            } else {
                // x_T = 0 sticks or is open; r_T = ρ u_T.
                if let Piece::Stick = piece {
                    for k in 1..D {
                        out.a[D - 1][k] = rho.tangential * s[k];
                        out.b[D - 1][k] = 0.0;
                    }
                }
            }
        }
        out
    }
}
