//! ρ of each contact, from its block of W.

use nonsmooth_linalg::{Block, small};
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use crate::contact::law::DiskLaw;
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
pub(super) fn radii<L: DiskLaw<D>, const D: usize>(
    rule: RhoRule,
    rho: f64,
    w: &Block<D>,
    unit: f64,
) -> (Radii, f64) {
    let over = |size: f64| if size > 0.0 && size.is_finite() { rho * unit / size } else { rho };
    let uniform = |size: f64| (Radii::uniform(over(size)), over(size));
    match rule {
        RhoRule::Fixed => uniform(unit),
        RhoRule::Norm => {
            // The Frobenius norm over √D: that of the identity is 1.
            let squares: f64 = w.iter().flatten().map(|x| x * x).sum();
            uniform((squares / D as f64).sqrt())
        }
        RhoRule::Spectral | RhoRule::Adaptive => {
            let of_disk = |part: &Block<D>| over(largest_eigenvalue(part));
            let parts = Radii::of::<L, D>(w, |w| over(w[0][0]), of_disk);
            (parts, over(largest_eigenvalue(w)))
        }
    }
}

/// The largest eigenvalue of the symmetric part.
fn largest_eigenvalue<const D: usize>(w: &Block<D>) -> f64 {
    small::eigen(w).0.into_iter().fold(f64::NEG_INFINITY, f64::max)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::contact::law::Coulomb;

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
            let one = radii::<Coulomb, 3>(rule, 1.0, &w, 1.5);
            let other = radii::<Coulomb, 3>(rule, 1.0, &w.map(|row| row.map(|x| 1e6 * x)), 1.5e6);
            assert!((one.0.normal / other.0.normal - 1.0).abs() < 1e-12);
            assert!((one.1 / other.1 - 1.0).abs() < 1e-12);
        }
        let (parts, whole) = radii::<Coulomb, 3>(RhoRule::Spectral, 2.0, &w, 1.5);
        assert!((parts.normal - 1.5).abs() < 1e-14 && (parts.tangential - 1.5).abs() < 1e-14);
        assert!((whole - 1.0).abs() < 1e-14);
        assert_eq!(radii::<Coulomb, 3>(RhoRule::Fixed, 3.0, &w, 1.5).1, 3.0);
    }
}
