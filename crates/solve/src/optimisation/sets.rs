//! The convex sets of the subproblems, one factor a contact.

use crate::cone;

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

/// Where the tangential part lies with respect to its disk.
#[derive(Debug, Clone, Copy, PartialEq)]
enum Disk {
    Inside,
    /// Outside, at this distance from the axis.
    Outside(f64),
    /// The disk is a point.
    Point,
}

impl Disk {
    #[inline(always)]
    fn piece<const D: usize>(x: &[f64; D], theta: f64) -> Self {
        let size = cone::tangential_norm(x);
        if theta <= 0.0 {
            Disk::Point
        } else if size <= theta {
            Disk::Inside
        } else {
            Disk::Outside(size)
        }
    }
}

impl<const D: usize> Set<D> {
    /// The nearest point of the set.
    #[inline(always)]
    pub(super) fn project(&self, x: &[f64; D]) -> [f64; D] {
        let disk = |theta: f64, normal: f64| {
            let factor = match Disk::piece(x, theta) {
                Disk::Inside => 1.0,
                Disk::Outside(size) => theta / size,
                Disk::Point => 0.0,
            };
            let mut p = x.map(|v| factor * v);
            p[0] = normal;
            p
        };
        match *self {
            Set::Cone(mu) => cone::project(x, mu),
            Set::Cylinder(theta) => disk(theta, x[0].max(0.0)),
            Set::Normal(held) => {
                let mut p = held;
                p[0] = x[0].max(0.0);
                p
            }
            Set::Tangential { normal, theta } => disk(theta, normal),
        }
    }

    /// An element of the B-subdifferential of the projection: its derivative where it has one.
    pub(super) fn jacobian(&self, x: &[f64; D]) -> [[f64; D]; D] {
        let mut out = [[0.0; D]; D];
        let pressed = f64::from(u8::from(x[0] > 0.0));
        match *self {
            Set::Cone(mu) => return cone_jacobian(x, mu),
            Set::Cylinder(theta) => {
                disk_jacobian(x, theta, &mut out);
                out[0][0] = pressed;
            }
            Set::Normal(_) => out[0][0] = pressed,
            Set::Tangential { theta, .. } => disk_jacobian(x, theta, &mut out),
        }
        out
    }
}

/// The tangential rows: I inside, `R Γ(x_T)` outside, 0 where the disk is a point.
fn disk_jacobian<const D: usize>(x: &[f64; D], theta: f64, out: &mut [[f64; D]; D]) {
    match Disk::piece(x, theta) {
        Disk::Inside => (1..D).for_each(|k| out[k][k] = 1.0),
        Disk::Outside(size) => {
            for k in 1..D {
                for l in 1..D {
                    let identity = f64::from(u8::from(k == l));
                    out[k][l] = theta / size * (identity - x[k] * x[l] / (size * size));
                }
            }
        }
        Disk::Point => {}
    }
}

fn cone_jacobian<const D: usize>(x: &[f64; D], mu: f64) -> [[f64; D]; D] {
    let mut out = [[0.0; D]; D];
    match cone::region(x, mu) {
        cone::Region::Inside => (0..D).for_each(|k| out[k][k] = 1.0),
        cone::Region::Polar => {}
        cone::Region::Outside => {
            // p = n (1, mu t), n = (x_N + mu‖x_T‖)/(1 + mu²).
            let size = cone::tangential_norm(x);
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
