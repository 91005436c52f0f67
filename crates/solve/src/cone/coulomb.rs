//! The Coulomb cone `K = {‖x_T‖ ≤ mu x_N}` in D dimensions, `[x_N, x_T]`.
//!
//! K is the second-order cone stretched by mu. Its projection has three regions, told apart by the signs of
//! `mu x_N − ‖x_T‖` (inside K) and `−x_N − mu‖x_T‖` (inside the polar cone −K*). `mu = 0` is a half line.
//!
//! Source: Acary, lecture (112)–(115), in unscaled coordinates.

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
