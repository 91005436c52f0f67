//! The function of Hüeber, Stadler and Wohlmuth, in these variables.
//!
//! With `x = r − ρu` and `R = mu max(0, x_N)`:
//!
//! ```text
//! Φ_N = r_N − max(0, x_N),    C = max(R, ‖x_T‖) r_T − R x_T,    Φ_T = C / max(R, ‖x_T‖)
//! ```
//!
//! C itself also vanishes at `r_T = ρ_T u_T` with `R = 0`, which is no solution; divided by its factor it is Alart–Curnier's value. The
//! Newton matrix is that of C, divided by the factor held fixed: it differs from Alart–Curnier's by terms that vanish with Φ.
//! While sliding it has the block `E = (R/‖x_T‖)(I − F)`, `F = r_T x_Tᵀ/(R ‖x_T‖)` in `(I − E) dr_T + ρ_T E du_T − t dR`, which can
//! be indefinite far from the solution. The *modified* block bounds F (`R` becomes `max(R, ‖r_T‖)`) and damps it by
//! `β = 1/(1 − αδ)` where the angle between r_T and x_T is obtuse (`α < 0` its cosine, `δ = min(‖r_T‖/R, 1)`).
//!
//! Source: HueberStadlerWohlmuth2008, sections 3 and 4. In these variables: docs/derivations/hueber-stadler-wohlmuth.md.

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use super::{ContactFunction, Linearisation, NewtonFunction, OneContact, Piece};
use crate::contact::law::cone::tangential_norm;
use crate::core::register::Named;
use crate::core::settings::Settings;

/// The derivative that is used while sliding.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
pub enum SlipBlock {
    /// Bounded and damped: equal to the exact one at solutions.
    #[default]
    Modified,
    /// The derivative of C.
    Exact,
}

/// The function of Hüeber, Stadler and Wohlmuth.
///
/// Newton's method on it is `newton_hsw`: HueberStadlerWohlmuth2008; docs/derivations/hueber-stadler-wohlmuth.md. Fails: as `newton_ac`; the modified block is not a derivative, so a short step need not decrease the merit.
#[derive(Debug, Clone, Copy, Default, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(default)]
pub struct HueberStadlerWohlmuth {
    /// The derivative while sliding.
    pub slip: SlipBlock,
}

impl Settings for HueberStadlerWohlmuth {}

impl NewtonFunction for HueberStadlerWohlmuth {
    const METHOD: Named = Named {
        name: "newton_hsw",
        summary: "semismooth Newton on the function of Hueber, Stadler and Wohlmuth",
        cites: &["HueberStadlerWohlmuth2008"],
        variants: &["slip=exact"],
    };
}

impl<const D: usize> ContactFunction<D> for HueberStadlerWohlmuth {
    fn linearise(&self, contact: &OneContact, u: &[f64; D], r: &[f64; D]) -> Linearisation<D> {
        let (mu, rho) = (contact.law.mu, contact.rho);
        let (mut out, x_n) = Linearisation::with_normal_part(u, r, &rho);
        let mut x = *r;
        for k in 1..D {
            x[k] -= rho.tangential * u[k];
        }
        let (size, radius) = (tangential_norm(&x), mu * x_n.max(0.0));
        match Piece::of(size, radius) {
            Piece::Open => out.set_no_friction(r),
            Piece::Stick => {
                // d(R ρ u_T)/R = ρ du_T + (ρ u_T/R) dR, dR = mu (dr_N − ρ_N du_N).
                for k in 1..D {
                    out.phi[k] = rho.tangential * u[k];
                    out.a[k][k] = rho.tangential;
                    let relative = mu * out.phi[k] / radius;
                    out.a[k][0] = -relative * rho.normal;
                    out.b[k][0] = relative;
                }
            }
            Piece::Slip => {
                let along: f64 = (1..D).map(|k| r[k] * x[k]).sum();
                let length = tangential_norm(r);
                let (bound, beta) = match self.slip {
                    SlipBlock::Exact => (radius, 1.0),
                    // α δ = r·x/(‖r‖‖x‖) min(‖r‖/R, 1) = r·x/(‖x‖ max(R, ‖r‖)).
                    SlipBlock::Modified => {
                        let bound = radius.max(length);
                        let cosine = along / (size * bound);
                        (bound, if cosine < 0.0 { 1.0 / (1.0 - cosine) } else { 1.0 })
                    }
                };
                for k in 1..D {
                    let t_k = x[k] / size;
                    out.phi[k] = r[k] - radius * t_k;
                    out.b[k][0] = -mu * t_k;
                    out.a[k][0] = mu * rho.normal * t_k;
                    for l in 1..D {
                        let identity = f64::from(u8::from(k == l));
                        let f = r[k] * x[l] / (bound * size);
                        let e = radius / size * (identity - beta * f);
                        out.b[k][l] = identity - e;
                        out.a[k][l] = rho.tangential * e;
                    }
                }
            }
        }
        out
    }
}

#[cfg(test)]
mod tests {
    use super::super::Radii;
    use super::*;
    use crate::contact::law::Coulomb;

    /// `(r_N − max(0, x_N), C)`, from the definition.
    fn raw(law: &OneContact, u: &[f64; 3], r: &[f64; 3]) -> [f64; 3] {
        let x: [f64; 3] = std::array::from_fn(|k| {
            r[k] - if k == 0 { law.rho.normal } else { law.rho.tangential } * u[k]
        });
        let (radius, size) = (law.law.mu * x[0].max(0.0), x[1].hypot(x[2]));
        let m = radius.max(size);
        [r[0] - x[0].max(0.0), m * r[1] - radius * x[1], m * r[2] - radius * x[2]]
    }

    #[test]
    fn the_exact_block_is_the_derivative_of_the_product_form() {
        let law = OneContact {
            law: Coulomb { mu: 0.6 },
            rho: Radii { normal: 0.7, tangential: 1.3, rolling: 1.3 },
            rho_cone: 1.0,
            smoothing: 0.0,
        };
        let exact = HueberStadlerWohlmuth { slip: SlipBlock::Exact };
        for (u, r) in [
            ([0.1, 0.01, -0.02], [2.0, 0.2, 0.1]),
            ([0.1, 0.5, -0.9], [2.0, 0.2, 0.1]),
            ([-0.3, -1.5, 0.4], [0.7, -0.3, 0.6]),
        ] {
            let at = exact.linearise(&law, &u, &r);
            let x_t = [r[1] - 1.3 * u[1], r[2] - 1.3 * u[2]];
            let m = (0.6 * (r[0] - 0.7 * u[0])).max(x_t[0].hypot(x_t[1]));
            let factor = [1.0, m, m];
            for l in 0..3 {
                let h = 1e-6;
                let step = |x: &[f64; 3], h: f64| {
                    let mut y = *x;
                    y[l] += h;
                    y
                };
                let slope = |p: [f64; 3], q: [f64; 3], k: usize| (p[k] - q[k]) / (2.0 * h);
                let by_u = (raw(&law, &step(&u, h), &r), raw(&law, &step(&u, -h), &r));
                let by_r = (raw(&law, &u, &step(&r, h)), raw(&law, &u, &step(&r, -h)));
                for k in 0..3 {
                    assert!((raw(&law, &u, &r)[k] / factor[k] - at.phi[k]).abs() < 1e-14);
                    assert!((slope(by_u.0, by_u.1, k) / factor[k] - at.a[k][l]).abs() < 1e-8);
                    assert!((slope(by_r.0, by_r.1, k) / factor[k] - at.b[k][l]).abs() < 1e-8);
                }
            }
        }
    }

    #[test]
    fn the_modified_block_is_exact_at_a_sliding_solution() {
        let law = OneContact {
            law: Coulomb { mu: 0.5 },
            rho: Radii { normal: 0.7, tangential: 1.3, rolling: 1.3 },
            rho_cone: 1.0,
            smoothing: 0.0,
        };
        let (u, r) = ([0.0, 3.0, 4.0], [2.0, -0.6, -0.8]);
        let at = |slip| HueberStadlerWohlmuth { slip }.linearise(&law, &u, &r);
        let (exact, modified) = (at(SlipBlock::Exact), at(SlipBlock::Modified));
        for (x, y) in exact.b.iter().flatten().zip(modified.b.iter().flatten()) {
            assert!((x - y).abs() < 1e-15);
        }
        // Far from it, r against x and too large: the exact block is indefinite, the modified one is not.
        let (u, r) = ([0.0, 6.0, 0.0], [1.0, 3.0, 0.0]);
        let along = |slip| HueberStadlerWohlmuth { slip }.linearise(&law, &u, &r).b[1][1];
        assert!(along(SlipBlock::Exact) < along(SlipBlock::Modified));
        assert!(along(SlipBlock::Modified) > 0.0);
    }
}
