//! The convex sets of the subproblems, one factor a contact.

use crate::contact::law::Coulomb;
use crate::contact::law::cone::{ConvexSet, Cylinder};

/// The set that a contact's impulse lies in.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) enum Set<const D: usize> {
    /// The Coulomb cone of the coefficient given.
    Cone(f64),
    /// Tresca's cylinder `r_N ≥ 0`, `‖r_T‖ ≤ θ`.
    Cylinder(f64),
    /// `r_N ≥ 0` with the tangential part held.
    Normal([f64; D]),
    /// `‖r_T‖ ≤ θ` with `r_N` held.
    Tangential {
        /// `r_N`.
        normal: f64,
        /// θ.
        theta: f64,
    },
}

impl<const D: usize> ConvexSet<D> for Set<D> {
    #[inline(always)]
    fn project(&self, x: &[f64; D]) -> [f64; D] {
        match *self {
            Set::Cone(mu) => Coulomb { mu }.project(x),
            Set::Cylinder(threshold) => Cylinder { threshold }.project(x),
            Set::Normal(held) => {
                let mut p = held;
                p[0] = x[0].max(0.0);
                p
            }
            Set::Tangential { normal, theta } => {
                let mut p = Cylinder { threshold: theta }.project(x);
                p[0] = normal;
                p
            }
        }
    }

    fn jacobian(&self, x: &[f64; D]) -> [[f64; D]; D] {
        match *self {
            Set::Cone(mu) => Coulomb { mu }.jacobian(x),
            Set::Cylinder(threshold) => Cylinder { threshold }.jacobian(x),
            Set::Normal(_) => {
                let mut out = [[0.0; D]; D];
                out[0][0] = f64::from(u8::from(x[0] > 0.0));
                out
            }
            Set::Tangential { theta, .. } => {
                let mut out = Cylinder { threshold: theta }.jacobian(x);
                out[0][0] = 0.0;
                out
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const SETS: [Set<3>; 6] = [
        Set::Cone(0.7),
        Set::Cone(0.0),
        Set::Cylinder(0.8),
        Set::Cylinder(0.0),
        Set::Normal([1.0, 0.2, -0.4]),
        Set::Tangential { normal: 0.3, theta: 0.8 },
    ];
    const POINTS: [[f64; 3]; 5] =
        [[2.0, 0.3, 0.2], [1.0, 0.9, -1.2], [-2.0, 0.4, 0.3], [-0.1, 1.0, 0.5], [0.6, 0.0, 2.0]];

    #[test]
    fn projections_are_nearest_points() {
        for set in SETS {
            for x in POINTS {
                let p = set.project(&x);
                let again = set.project(&p);
                assert!((0..3).all(|k| (p[k] - again[k]).abs() < 1e-15), "{set:?} {x:?}");
                // (x − p)·(y − p) ≤ 0 for all y of the set.
                for z in POINTS {
                    let y = set.project(&z);
                    let angle: f64 = (0..3).map(|k| (x[k] - p[k]) * (y[k] - p[k])).sum();
                    assert!(angle <= 1e-14, "{set:?} {x:?} {y:?}");
                }
            }
        }
    }

    #[test]
    fn jacobians_agree_with_finite_differences() {
        for set in SETS {
            for x in POINTS {
                let jacobian = set.jacobian(&x);
                for l in 0..3 {
                    let at = |h: f64| {
                        let mut y = x;
                        y[l] += h;
                        set.project(&y)
                    };
                    let (up, down) = (at(1e-6), at(-1e-6));
                    for k in 0..3 {
                        let slope = (up[k] - down[k]) / 2e-6;
                        assert!((slope - jacobian[k][l]).abs() < 1e-8, "{set:?} {x:?} {k} {l}");
                    }
                }
            }
        }
    }
}
