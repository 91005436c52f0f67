//! ρ of each contact, from its block of W.

use nonsmooth_linalg::Block;
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use crate::contact::law::cfun::Radii;

/// The rules for ρ.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
pub enum RhoRule {
    /// `rho / w_c`, w_c the mean diagonal of the contact's block of W.
    Fixed,
    /// `rho` over the Frobenius norm of the contact's block.
    Norm,
    /// `rho` over the largest eigenvalues of the block's parts: `W_NN` for the normal, `W_TT` for the tangential part,
    /// the whole block where they are not treated apart.
    #[default]
    Spectral,
    /// Spectral; where the line search fails, rho is multiplied by 10, 0.1, 100 and 1 in turn.
    Adaptive,
}

/// The factors of [`RhoRule::Adaptive`].
pub(super) const LADDER: [f64; 4] = [1.0, 10.0, 0.1, 100.0];

/// `ρ w_c` for the parts and for the whole: pure numbers.
pub(super) fn radii<const D: usize>(
    rule: RhoRule,
    rho: f64,
    w: &Block<D>,
    unit: f64,
) -> (Radii, f64) {
    let over = |size: f64| if size > 0.0 && size.is_finite() { rho * unit / size } else { rho };
    let uniform = |size: f64| (Radii { normal: over(size), tangential: over(size) }, over(size));
    match rule {
        RhoRule::Fixed => uniform(unit),
        RhoRule::Norm => {
            // The Frobenius norm over √D: that of the identity is 1.
            let squares: f64 = w.iter().flatten().map(|x| x * x).sum();
            uniform((squares / D as f64).sqrt())
        }
        RhoRule::Spectral | RhoRule::Adaptive => {
            let mut tangential = *w;
            tangential[0] = [0.0; D];
            tangential.iter_mut().for_each(|row| row[0] = 0.0);
            let parts =
                Radii { normal: over(w[0][0]), tangential: over(largest_eigenvalue(&tangential)) };
            (parts, over(largest_eigenvalue(w)))
        }
    }
}

/// The largest eigenvalue of the symmetric part, by Jacobi rotations.
fn largest_eigenvalue<const D: usize>(w: &Block<D>) -> f64 {
    let mut a = *w;
    for i in 0..D {
        for j in 0..D {
            a[i][j] = 0.5 * (w[i][j] + w[j][i]);
        }
    }
    for _ in 0..8 {
        for i in 0..D {
            for j in i + 1..D {
                if a[i][j] == 0.0 {
                    continue;
                }
                let theta = 0.5 * (2.0 * a[i][j]).atan2(a[i][i] - a[j][j]);
                let (s, c) = theta.sin_cos();
                for k in 0..D {
                    let (x, y) = (a[i][k], a[j][k]);
                    (a[i][k], a[j][k]) = (c * x + s * y, c * y - s * x);
                }
                for k in 0..D {
                    let (x, y) = (a[k][i], a[k][j]);
                    (a[k][i], a[k][j]) = (c * x + s * y, c * y - s * x);
                }
            }
        }
    }
    (0..D).map(|k| a[k][k]).fold(f64::NEG_INFINITY, f64::max)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn eigenvalues_of_known_blocks() {
        let w = [[2.0, 1.0, 0.0], [1.0, 2.0, 0.0], [0.0, 0.0, 0.5]];
        assert!((largest_eigenvalue(&w) - 3.0).abs() < 1e-14);
        // A skew part changes nothing.
        let skewed = [[2.0, 1.5, 0.0], [0.5, 2.0, -1.0], [0.0, 1.0, 0.5]];
        assert!((largest_eigenvalue(&skewed) - 3.0).abs() < 1e-14);
        // (1, 1, 1) of the matrix of ones.
        assert!((largest_eigenvalue(&[[1.0; 3]; 3]) - 3.0).abs() < 1e-14);
    }

    #[test]
    fn rho_is_a_pure_number() {
        let w = [[2.0, 1.0, 0.0], [1.0, 2.0, 0.0], [0.0, 0.0, 0.5]];
        for rule in [RhoRule::Fixed, RhoRule::Norm, RhoRule::Spectral] {
            let one = radii(rule, 1.0, &w, 1.5);
            let other = radii(rule, 1.0, &w.map(|row| row.map(|x| 1e6 * x)), 1.5e6);
            assert!((one.0.normal / other.0.normal - 1.0).abs() < 1e-12);
            assert!((one.1 / other.1 - 1.0).abs() < 1e-12);
        }
        let (parts, whole) = radii(RhoRule::Spectral, 2.0, &w, 1.5);
        assert!((parts.normal - 1.5).abs() < 1e-14 && (parts.tangential - 1.5).abs() < 1e-14);
        assert!((whole - 1.0).abs() < 1e-14);
        assert_eq!(radii(RhoRule::Fixed, 3.0, &w, 1.5).1, 3.0);
    }
}
