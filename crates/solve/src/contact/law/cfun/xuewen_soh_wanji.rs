//! The direct equations of Xuewen, Soh and Wanji.
//!
//! ```text
//! Φ₁ = min(ρ_N u_N, r_N)
//! Φ₂ = min(ρ_T‖u_T‖, mu r_N − ‖r_T‖)                                                 (99)
//! Φ₃ = (|u_T × r_T| + max(0, u_Tᵀ r_T)) / (‖u_T‖ + ‖r_T‖/ρ_T)
//! ```
//!
//! The third is divided by what makes it an impulse like the others; its zeros are the same (`0/0` counts as 0). In the plane
//! there is one tangential component and no cross product: `Φ_T = |Φ₂| + max(0, u_T r_T)/(…)`. Without friction `Φ_T = r_T`.
//!
//! Vanishes exactly at the solutions. |·| has its kink at every sliding solution and ‖u_T‖ at every sticking one, and the
//! Jacobian is singular where a contact sticks with `r_T = 0`: a method built on it needs a good start and a way out.
//!
//! Source: Acary, lecture (99), which cites Xuewen, Soh and Wanji (2000), with `u_Tᵀr_T` as in docs/notation.md.

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use super::{ContactFunction, Linearisation, NewtonFunction, OneContact, direction};
use crate::contact::law::cone::tangential_norm;
use crate::core::register::Named;
use crate::core::settings::Settings;

/// The function of Xuewen, Soh and Wanji.
///
/// Newton's method on it is `newton_xsw`: Acary, lecture (99). Fails: |·| and ‖·‖ have their kinks at every solution, and contacts that stick with `r_T = 0` make the matrix singular: it leans on its rescues more than the others.
#[derive(Debug, Clone, Copy, Default, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(default)]
pub struct XuewenSohWanji {}

/// Which argument a minimum takes.
#[derive(Clone, Copy, PartialEq)]
enum Smaller {
    Velocity,
    Impulse,
}

impl Smaller {
    fn of(velocity: f64, impulse: f64) -> Self {
        if velocity < impulse { Smaller::Velocity } else { Smaller::Impulse }
    }
}

impl Settings for XuewenSohWanji {}

impl NewtonFunction for XuewenSohWanji {
    const METHOD: Named = Named {
        name: "newton_xsw",
        summary: "semismooth Newton on the direct equations of Xuewen, Soh and Wanji",
        cites: &["Acary2018"],
        variants: &[],
    };
}

impl<const D: usize> ContactFunction<D> for XuewenSohWanji {
    fn linearise(&self, contact: &OneContact, u: &[f64; D], r: &[f64; D]) -> Linearisation<D> {
        let mut out = Linearisation::zero();
        match Smaller::of(contact.rho.normal * u[0], r[0]) {
            Smaller::Velocity => {
                out.phi[0] = contact.rho.normal * u[0];
                out.a[0][0] = contact.rho.normal;
            }
            Smaller::Impulse => {
                out.phi[0] = r[0];
                out.b[0][0] = 1.0;
            }
        }
        if contact.law.mu <= 0.0 {
            out.set_no_friction(r);
            return out;
        }
        let rho = contact.rho.tangential;
        let (speed, size) = (tangential_norm(u), tangential_norm(r));
        // At a norm's kink, a direction that keeps the rows independent: u_T and r_T against each other. Each is an element of
        // the subdifferential.
        let against = |x: &[f64; D]| direction(x).map(|t| t.map(|v| -v));
        let mut first = [0.0; D];
        first[1] = 1.0;
        let along_r = direction(r).or_else(|| against(u)).unwrap_or(first);
        let along_u = direction(u).unwrap_or(along_r.map(|v| -v));
        match Smaller::of(rho * speed, contact.law.mu * r[0] - size) {
            Smaller::Velocity => {
                out.phi[1] = rho * speed;
                for l in 1..D {
                    out.a[1][l] = rho * along_u[l];
                }
            }
            Smaller::Impulse => {
                out.phi[1] = contact.law.mu * r[0] - size;
                out.b[1][0] = contact.law.mu;
                for l in 1..D {
                    out.b[1][l] = -along_r[l];
                }
            }
        }
        // Φ₃ = n/d with its derivatives by u and r.
        let d = speed + size / rho;
        let (mut n, mut du, mut dr) = (0.0, [0.0; D], [0.0; D]);
        let along: f64 = (1..D).map(|k| u[k] * r[k]).sum();
        if along > 0.0 {
            n += along;
            for k in 1..D {
                du[k] += r[k];
                dr[k] += u[k];
            }
        }
        if D == 3 {
            let cross = u[1] * r[D - 1] - u[D - 1] * r[1];
            let sign = if cross < 0.0 { -1.0 } else { 1.0 };
            n += sign * cross;
            du[1] += sign * r[D - 1];
            du[D - 1] -= sign * r[1];
            dr[D - 1] += sign * u[1];
            dr[1] -= sign * u[D - 1];
        }
        let value = if d > 0.0 { n / d } else { 0.0 };
        if d > 0.0 {
            for k in 1..D {
                du[k] = (du[k] - value * along_u[k]) / d;
                dr[k] = (dr[k] - value * along_r[k] / rho) / d;
            }
        }
        if D == 3 {
            out.phi[D - 1] = value;
            out.a[D - 1] = du;
            out.b[D - 1] = dr;
        } else {
            let sign = if out.phi[1] < 0.0 { -1.0 } else { 1.0 };
            out.phi[1] = sign * out.phi[1] + value;
            for k in 0..D {
                out.a[1][k] = sign * out.a[1][k] + du[k];
                out.b[1][k] = sign * out.b[1][k] + dr[k];
            }
        }
        out
    }
}
