//! The Alart–Curnier function of one frictional contact and its Jean–Moreau variant.
//!
//! With `x_N = r_N − ρ_N u_N`, `x_T = r_T − ρ_T u_T`:
//!
//! ```text
//! Φ_N = r_N − max(0, x_N)                                             (88)
//! Φ_T = r_T − P_{D(R)}(x_T),  R = mu max(0, x_N)  (Alart–Curnier)      (89)
//!                             R = mu max(0, r_N)  (Jean–Moreau)
//! ```
//!
//! With rolling friction there is a second disk, `Φ_R = r_R − P_{D(mu_r max(0, x_N))}(r_R − ρ_R u_R)`.
//!
//! Vanishes exactly at the solutions of `K* ∋ u + mu‖u_T‖e_N ⟂ r ∈ K`, for any ρ > 0.
//! Source: AlartCurnier1991; Jean1999; Acary, lecture (88)–(94) with the Jacobian as corrected in docs/notation.md.

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use super::{ContactFunction, Linearisation, NewtonFunction, OneContact, Piece, Radii};
use crate::contact::law::DiskLaw;
use crate::core::register::Named;
use crate::core::settings::Settings;

/// Which radius the friction disk has.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Disk {
    /// `R = mu max(0, r_N − ρ_N u_N)`.
    AlartCurnier,
    /// `R = mu max(0, r_N)`.
    JeanMoreau,
}

/// The Alart–Curnier function.
///
/// Newton's method on it is `newton_ac`: AlartCurnier1991; Acary, lecture (88)–(96). Fails: as the skeleton: rank deficient W with much sticking.
#[derive(Debug, Clone, Copy, Default, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(default)]
pub struct AlartCurnier {}

/// The Jean–Moreau variant.
///
/// Newton's method on it is `newton_jm`: Jean1999; Acary, lecture (88)–(96), with the radius mu r_N. Fails: as the skeleton. The radius sees r_N, which may be negative on the way: such contacts count as open.
#[derive(Debug, Clone, Copy, Default, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(default)]
pub struct JeanMoreau {}

impl Settings for AlartCurnier {}

impl NewtonFunction for AlartCurnier {
    const METHOD: Named = Named {
        name: "newton_ac",
        summary: "semismooth Newton on the Alart-Curnier function",
        cites: &[
            "AlartCurnier1991",
            "Acary2018",
            "GoldsteinPrice1967",
            "GrippoLamparielloLucidi1986",
        ],
        variants: &[
            "line_search=none",
            "line_search=goldstein_price",
            "line_search=nonmonotone",
            "rho_rule=fixed",
            "rho_rule=norm",
            "rho_rule=adaptive",
            "warm_up=0",
        ],
    };
}

impl<L: DiskLaw<D>, const D: usize> ContactFunction<D, L> for AlartCurnier {
    fn linearise(&self, contact: &OneContact<L>, u: &[f64; D], r: &[f64; D]) -> Linearisation<D> {
        alart_curnier(Disk::AlartCurnier, u, r, contact.law, contact.rho)
    }
}

impl Settings for JeanMoreau {}

impl NewtonFunction for JeanMoreau {
    const METHOD: Named = Named {
        name: "newton_jm",
        summary: "semismooth Newton on the Jean-Moreau function",
        cites: &["AlartCurnier1991", "Jean1999", "Acary2018"],
        variants: &[],
    };
}

impl<L: DiskLaw<D>, const D: usize> ContactFunction<D, L> for JeanMoreau {
    fn linearise(&self, contact: &OneContact<L>, u: &[f64; D], r: &[f64; D]) -> Linearisation<D> {
        alart_curnier(Disk::JeanMoreau, u, r, contact.law, contact.rho)
    }
}

/// Evaluates the function and one element of its B-subdifferential.
pub fn alart_curnier<L: DiskLaw<D>, const D: usize>(
    disk: Disk,
    u: &[f64; D],
    r: &[f64; D],
    law: L,
    rho: Radii,
) -> Linearisation<D> {
    let (mut out, x_n) = Linearisation::with_normal_part(u, r, &rho);
    let pressure = match disk {
        Disk::AlartCurnier => x_n,
        Disk::JeanMoreau => r[0],
    };
    for which in 0..L::DISKS {
        let (mu, rho_t) = (law.coefficient(which), rho.of_disk(which));
        let mut x = [0.0; D];
        for k in L::rows(which) {
            x[k] = r[k] - rho_t * u[k];
        }
        let size = x[L::rows(which)].iter().map(|v| v * v).sum::<f64>().sqrt();
        let radius = mu * pressure.max(0.0);
        match Piece::of(size, radius) {
            Piece::Stick => {
                for k in L::rows(which) {
                    out.phi[k] = rho_t * u[k];
                    out.a[k][k] = rho_t;
                }
            }
            Piece::Open => {
                for k in L::rows(which) {
                    out.phi[k] = r[k];
                    out.b[k][k] = 1.0;
                }
            }
            Piece::Slip => {
                for k in L::rows(which) {
                    let t_k = x[k] / size;
                    out.phi[k] = r[k] - radius * t_k;
                    // ∂R/∂r_N = mu in both variants; ∂R/∂u_N = −mu ρ_N with the Alart–Curnier disk.
                    out.b[k][0] = -mu * t_k;
                    if disk == Disk::AlartCurnier {
                        out.a[k][0] = mu * rho.normal * t_k;
                    }
                    for l in L::rows(which) {
                        // R Γ(x_T), Γ = (I − t tᵀ)/‖x_T‖.
                        let identity = f64::from(u8::from(k == l));
                        let gamma = radius * (identity - t_k * x[l] / size) / size;
                        out.a[k][l] = rho_t * gamma;
                        out.b[k][l] = identity - gamma;
                    }
                }
            }
        }
    }
    out
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::contact::law::Coulomb;

    /// One point for each combination of pieces, away from kinks.
    const POINTS: [([f64; 3], [f64; 3], &str); 5] = [
        ([0.1, 0.01, -0.02], [2.0, 0.2, 0.1], "stick"),
        ([0.1, 0.5, -0.9], [2.0, 0.2, 0.1], "slip"),
        ([-0.3, -1.5, 0.4], [0.7, -0.3, 0.6], "slip, penetrating"),
        ([3.0, 0.5, -0.9], [-0.2, 0.3, 0.1], "open"),
        ([3.0, 1.5, -0.9], [0.4, 0.3, 0.1], "separating, r_N > 0: the variants differ"),
    ];

    #[test]
    fn the_jacobian_agrees_with_finite_differences_on_every_piece() {
        let rho = Radii { normal: 0.7, tangential: 1.3, rolling: 1.3 };
        for disk in [Disk::AlartCurnier, Disk::JeanMoreau] {
            for (u, r, name) in POINTS {
                let at = alart_curnier(disk, &u, &r, Coulomb { mu: 0.6 }, rho);
                let h = 1e-6;
                for l in 0..3 {
                    let step = |x: &[f64; 3], s: f64| {
                        let mut y = *x;
                        y[l] += s;
                        y
                    };
                    let phi = |u: &[f64; 3], r: &[f64; 3]| {
                        alart_curnier(disk, u, r, Coulomb { mu: 0.6 }, rho).phi
                    };
                    let (up, um) = (phi(&step(&u, h), &r), phi(&step(&u, -h), &r));
                    let (rp, rm) = (phi(&u, &step(&r, h)), phi(&u, &step(&r, -h)));
                    for k in 0..3 {
                        let (du, dr) = ((up[k] - um[k]) / (2.0 * h), (rp[k] - rm[k]) / (2.0 * h));
                        assert!((du - at.a[k][l]).abs() < 1e-8, "{disk:?} {name} A[{k}][{l}]");
                        assert!((dr - at.b[k][l]).abs() < 1e-8, "{disk:?} {name} B[{k}][{l}]");
                    }
                }
            }
        }
    }

    #[test]
    fn at_a_kink_the_jacobian_is_that_of_a_neighbouring_piece() {
        // ‖x_T‖ = R exactly: stick and slip meet.
        let (rho, mu) = (Radii::uniform(1.0), Coulomb { mu: 0.5 });
        let (u, r) = ([0.0; 3], [2.0, 0.6, 0.8]);
        for disk in [Disk::AlartCurnier, Disk::JeanMoreau] {
            let kink = alart_curnier(disk, &u, &r, mu, rho);
            let neighbours = [0.999, 1.001].map(|s| {
                let near = [2.0, 0.6 * s, 0.8 * s];
                alart_curnier(disk, &u, &near, mu, rho)
            });
            let distance = |n: &Linearisation<3>| {
                let pairs = (kink.a.iter().flatten().zip(n.a.iter().flatten()))
                    .chain(kink.b.iter().flatten().zip(n.b.iter().flatten()));
                pairs.map(|(x, y)| (x - y).abs()).fold(0.0, f64::max)
            };
            assert!(neighbours.iter().any(|n| distance(n) < 1e-2), "{disk:?}");
        }
    }

    #[test]
    fn vanishes_at_the_law_and_only_there() {
        let rho = Radii { normal: 0.7, tangential: 1.3, rolling: 1.3 };
        let mu = Coulomb { mu: 0.5 };
        let law = [
            ([0.0; 3], [2.0, 0.3, 0.1]),
            ([0.0, 3.0, 4.0], [2.0, -0.6, -0.8]),
            ([1.0, 3.0, 4.0], [0.0; 3]),
        ];
        let not_law = [
            ([0.0, 3.0, 4.0], [2.0, 0.6, 0.8]),
            ([0.1, 0.0, 0.0], [2.0, 0.0, 0.0]),
            ([-0.1, 0.0, 0.0], [0.0; 3]),
        ];
        for disk in [Disk::AlartCurnier, Disk::JeanMoreau] {
            let size = |(u, r): &([f64; 3], [f64; 3])| {
                let phi = alart_curnier(disk, u, r, mu, rho).phi;
                phi.iter().map(|v| v.abs()).fold(0.0, f64::max)
            };
            assert!(law.iter().all(|p| size(p) < 1e-15));
            assert!(not_law.iter().all(|p| size(p) > 1e-2));
        }
    }
}
