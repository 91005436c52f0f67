//! One contact: what the judge asks of a law, and Coulomb's answers from the definitions: distances to the cones, natural map, status.

use serde::{Deserialize, Serialize};

use crate::kinds::contact::law::RollingData;
use crate::{Coulomb, Kind};
use nonsmooth_linalg::{Real, norm, norm_of, power_of_two, small};

/// What a contact does.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Motion {
    /// No impulse, separating: `r = 0`.
    Open,
    /// Pressed and at rest: `u = 0`, `r` in K.
    Stick,
    /// Pressed and sliding: `u_N = 0`, `u_T ≠ 0`, `r` on the boundary of K against the sliding velocity.
    Slip,
}

/// The status of a contact and whether it is certain at the tolerance asked for.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize)]
pub struct ContactStatus {
    /// Open, stick or slip: the region of the cone in which `x − ũ` lies, and whether there is motion.
    pub status: Motion,
    /// Sticking at the limit of friction: at rest, with the impulse on the boundary of K. Where impulses are not unique one answer has a contact there, another one does not.
    pub at_limit: bool,
    /// The margin to another status is below the tolerance.
    pub degenerate: bool,
    /// Pressed and rolling against rolling friction: `u_R ≠ 0`, the moment on the boundary of its disk. Never without rolling friction.
    #[serde(skip_serializing_if = "std::ops::Not::not")]
    pub rolls: bool,
    /// Pressed and not rolling, with the moment on the boundary of its disk. Never without rolling friction.
    #[serde(skip_serializing_if = "std::ops::Not::not")]
    pub at_rolling_limit: bool,
}

/// `‖x_T‖` of `[x_N, x_T…]`.
pub(super) fn tangential<T: Real, const D: usize>(x: &[T; D]) -> T {
    match D {
        2 => x[1].modulus(),
        3 => x[1].hypot(x[2]),
        _ => x[1..].iter().fold(T::from(0.0), |length, &t| length.hypot(t)),
    }
}

/// `‖x‖`.
pub(crate) fn length<T: Real, const D: usize>(x: &[T; D]) -> T {
    x[0].hypot(tangential(x))
}

/// `x − y`.
pub(super) fn difference<T: Real, const D: usize>(x: &[T; D], y: &[T; D]) -> [T; D] {
    std::array::from_fn(|k| x[k] - y[k])
}

/// The law of a contact as the judge states it: `K* ∋ ũ ⟂ r ∈ K` with a closed convex cone K and a modified velocity ũ of u. Nothing of it is a solver's.
///
/// `x = w r` is an impulse in units of velocity. What nearly cancels is done in T, the rest plainly.
pub trait Law<const D: usize>: Copy + std::fmt::Debug + PartialEq + Send + Sync + 'static {
    /// What a problem keeps of its coefficients beside mu.
    type Rolling: RollingData;
    /// Whether contacts of D components can obey it.
    const FITS: bool;
    /// How many disks K has, of `(D − 1)/DISKS` rows each: of friction, of rolling friction.
    const DISKS: usize;
    /// The kind of the local problem with this law.
    const LOCAL: Kind;
    /// The kind of the global problem with this law.
    const GLOBAL: Kind;

    /// The law of contact c.
    fn of(mu: &[f64], mu_r: &Self::Rolling, c: usize) -> Self;

    /// The coefficient of a disk, `‖r_disk‖ ≤ coefficient r_N`.
    fn coefficient(self, disk: usize) -> f64;

    /// ũ.
    fn modified_velocity<T: Real>(self, u: &[T; D]) -> [T; D];

    /// A constant L with `‖ũ(u) − ũ(u')‖ ≤ L ‖u − u'‖`.
    fn growth(self) -> f64;

    /// The natural map `x − P_K(x − ũ)`.
    fn natural_map<T: Real>(self, x: &[T; D], modified: &[T; D]) -> [f64; D];

    /// `dist(x, K)`.
    fn distance_to_cone<T: Real>(self, x: &[T; D]) -> f64;

    /// `dist(ũ, K*)`, from u.
    fn distance_to_dual(self, u: &[f64; D]) -> f64;

    /// The law with coefficients of at most 1. By its K* velocities into the obstacle are measured: with more friction K* is nearly the whole space, and any of them near it.
    fn softened(self) -> Self;

    /// Whether `x − ũ`, which plain arithmetic knows up to `error`, surely lies in K or in its polar cone, so that the natural map is ũ or x itself and no difference.
    fn is_at_rest_or_open(self, x: &[f64; D], modified: &[f64; D], error: f64) -> bool;

    /// How far x and u are from each part of the law by itself.
    fn apart(self, x: &[f64; D], u: &[f64; D]) -> f64;

    /// What the contact does; `margin` is a velocity.
    fn status(self, x: &[f64; D], modified: &[f64; D], margin: f64) -> ContactStatus;
}

/// De Saxcé's `ũ = u + mu‖u_T‖ e_N`, `K = {‖x_T‖ ≤ mu x_N}`, `K* = {mu‖y_T‖ ≤ y_N}`.
impl<const D: usize> Law<D> for Coulomb {
    type Rolling = ();
    const FITS: bool = D == 2 || D == 3;
    const DISKS: usize = 1;
    const LOCAL: Kind = if D == 2 { Kind::FrictionLocal2d } else { Kind::FrictionLocal3d };
    const GLOBAL: Kind = if D == 2 { Kind::FrictionGlobal2d } else { Kind::FrictionGlobal3d };

    fn of(mu: &[f64], (): &(), c: usize) -> Self {
        Self { mu: mu[c] }
    }

    #[inline(always)]
    fn coefficient(self, _: usize) -> f64 {
        self.mu
    }

    #[inline(always)]
    fn modified_velocity<T: Real>(self, u: &[T; D]) -> [T; D] {
        let mut modified = *u;
        modified[0] = modified[0] + T::from(self.mu) * tangential(u);
        modified
    }

    #[inline(always)]
    fn growth(self) -> f64 {
        1.0 + self.mu
    }

    /// With `y = x − ũ` it is ũ where y lies in K, x where y lies in the polar cone, and else `ũ + d n` with the distance d of y
    /// from K and the outward normal n: the difference of x and a projection would round ũ away where x is large.
    #[inline(always)]
    fn natural_map<T: Real>(self, x: &[T; D], modified: &[T; D]) -> [f64; D] {
        let mu = self.mu;
        let y = difference(x, modified);
        let (t, zero, friction) = (tangential(&y), T::from(0.0), T::from(mu));
        let outside = t - friction * y[0];
        if outside <= zero && y[0] >= zero {
            return modified.map(|v| v.value());
        }
        if y[0] + friction * t <= zero {
            return x.map(|v| v.value());
        }
        // d n = outside/square (−mu, y_T/t), square = 1 + mu²; times the divisors, that T need not divide. A power of two keeps t from underflow.
        let square = T::from(1.0) + T::of_product(mu, mu);
        let per = 1.0 / power_of_two(t.value());
        let divisor = square * t.times_power(per);
        std::array::from_fn(|k| match k {
            0 => (square * modified[0] - friction * outside).value() / square.value(),
            _ if t > zero => {
                (divisor * modified[k] + outside * y[k].times_power(per)).value() / divisor.value()
            }
            _ => modified[k].value(),
        })
    }

    /// In the half-plane of `(x_N, ‖x_T‖)`: to the ray `(cos φ, sin φ)`, `tan φ = mu`, or to the apex.
    #[inline(always)]
    fn distance_to_cone<T: Real>(self, x: &[T; D]) -> f64 {
        let mu = self.mu;
        let t = tangential(x);
        let outside = t - T::from(mu) * x[0];
        if outside <= T::from(0.0) && x[0] >= T::from(0.0) {
            0.0
        } else if x[0] + T::from(mu) * t <= T::from(0.0) {
            length(&x.map(|v| v.value()))
        } else {
            outside.value() / Real::hypot(1.0, mu)
        }
    }

    /// With Moreau's decomposition the size of the nearest point of K to −ũ, of which `−u_N` is the part along K's side.
    #[inline(always)]
    fn distance_to_dual(self, u: &[f64; D]) -> f64 {
        let mu = self.mu;
        let modified = self.modified_velocity(u);
        if u[0] >= 0.0 {
            0.0
        } else if tangential(u) + mu * modified[0] <= 0.0 {
            length(&modified)
        } else {
            -u[0] / Real::hypot(1.0, mu)
        }
    }

    #[inline(always)]
    fn softened(self) -> Self {
        Self { mu: self.mu.min(1.0) }
    }

    #[inline(always)]
    fn is_at_rest_or_open(self, x: &[f64; D], modified: &[f64; D], error: f64) -> bool {
        let mu = self.mu;
        let y = difference(x, modified);
        let (t, margin) = (tangential(&y), (1.0 + mu) * error);
        t - mu * y[0] < -margin || y[0] + mu * t < -margin
    }

    /// `r ∈ K`, `u_N > 0` only where r = 0, and `x_T = −mu x_N u_T/‖u_T‖` where `u_T ≠ 0`. With `u_N ≥ 0` all of that is the same as `K* ∋ ũ ⟂ r ∈ K`, but with much
    /// friction K* is nearly the whole space and K nearly a half space, where far from the law is near in the distance to cones.
    #[inline(always)]
    fn apart(self, x: &[f64; D], u: &[f64; D]) -> f64 {
        let mu = self.mu;
        let pressed = u[0].max(0.0).min(norm(x));
        let sliding = small::tangential_norm(u);
        let across = if sliding > 0.0 {
            norm_of((1..D).map(|k| x[k] + mu * x[0] * (u[k] / sliding)))
        } else {
            0.0
        };
        let pulling = (-x[0]).max(small::tangential_norm(x) - mu * x[0].max(0.0)).max(0.0);
        pressed.max(sliding.min(across)).max(pulling)
    }

    /// The region of the cone in which `x − ũ` lies: outside of both cones it slips if it moves, and else sticks at the limit.
    #[inline(always)]
    fn status(self, x: &[f64; D], modified: &[f64; D], margin: f64) -> ContactStatus {
        let mu = self.mu;
        let y = difference(x, modified);
        let t = tangential(&y);
        let secant = (1.0 + mu * mu).sqrt();
        // Signed distances of y into K and into its polar cone −K*.
        let into_cone = (mu * y[0] - t) / secant;
        let into_polar = (-y[0] - mu * t) / secant;
        // A frictionless contact slides or is open: its cone has no interior to be in or near to.
        let rough = mu > 0.0;
        let status = if into_polar >= 0.0 {
            Motion::Open
        } else if rough && (into_cone >= 0.0 || tangential(modified) <= margin) {
            Motion::Stick
        } else {
            Motion::Slip
        };
        let near_boundary = rough && into_cone.abs() <= margin;
        ContactStatus {
            status,
            at_limit: status == Motion::Stick && (near_boundary || into_cone < 0.0),
            degenerate: into_polar.abs() <= margin || near_boundary,
            rolls: false,
            at_rolling_limit: false,
        }
    }
}

/// What one contact adds to the residuals, from x and ũ.
pub(crate) struct Share {
    /// `‖x − P_K(x − ũ)‖²`.
    pub residual: f64,
    /// `dist(x, K)²`.
    pub primal: f64,
    /// `dist(ũ, K*)²` of the [softened](Law::softened) law.
    pub dual: f64,
    /// `|x · ũ|`.
    pub complementarity: f64,
}

impl Share {
    /// From x, u and ũ.
    pub(crate) fn new<T: Real, L: Law<D>, const D: usize>(
        law: L,
        x: &[T; D],
        u: &[T; D],
        modified: &[T; D],
    ) -> Self {
        let square = |x: [f64; D]| x.iter().map(|v| v * v).sum::<f64>();
        let products = x.iter().zip(modified).map(|(&a, &b)| a * b);
        Self {
            residual: square(law.natural_map(x, modified)),
            primal: law.distance_to_cone(x).powi(2),
            dual: law.softened().distance_to_dual(&u.map(|v| v.value())).powi(2),
            complementarity: products.fold(T::from(0.0), |sum, p| sum + p).value().abs(),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_three_regions() {
        let mu = 0.5;
        let at_rest = ([2.0, 0.1, 0.2], [0.0; 3]);
        assert_eq!(Coulomb { mu }.status(&at_rest.0, &at_rest.1, 1e-9).status, Motion::Stick);
        let sliding = ([2.0, -1.0, 0.0], Coulomb { mu }.modified_velocity(&[0.0, 3.0, 0.0]));
        assert_eq!(Coulomb { mu }.status(&sliding.0, &sliding.1, 1e-9).status, Motion::Slip);
        let flying = ([0.0; 3], Coulomb { mu }.modified_velocity(&[1.0, 3.0, 0.0]));
        assert_eq!(Coulomb { mu }.status(&flying.0, &flying.1, 1e-9).status, Motion::Open);
        for (x, u) in [at_rest, sliding, flying] {
            assert!(Coulomb { mu }.natural_map(&x, &u).iter().all(|v| v.abs() < 1e-15));
            assert!(!Coulomb { mu }.status(&x, &u, 1e-9).degenerate);
        }
        assert!(Coulomb { mu }.status(&[0.0; 3], &[0.0; 3], 1e-9).degenerate);
        assert!(Coulomb { mu }.status(&[2.0, -1.0, 0.0], &[0.0; 3], 1e-9).degenerate);
    }

    /// On the boundary of K the velocity decides, not the last bit of the impulse.
    #[test]
    fn what_does_not_move_sticks_at_the_limit() {
        let law = Coulomb { mu: 0.5 };
        let on_boundary = |t: f64, u: f64| {
            law.status(&[2.0, -t, 0.0], &law.modified_velocity(&[0.0, u, 0.0]), 1e-9)
        };
        for t in [1.0, 1.0 + 1e-12, 1.0 - 1e-12] {
            let at_rest = on_boundary(t, 0.0);
            assert_eq!((at_rest.status, at_rest.at_limit), (Motion::Stick, true), "{t}");
            let moving = on_boundary(t, 1e-3);
            assert_eq!((moving.status, moving.at_limit), (Motion::Slip, false), "{t}");
        }
        let inside = on_boundary(0.5, 0.0);
        assert_eq!((inside.status, inside.at_limit), (Motion::Stick, false));
    }

    #[test]
    fn frictionless_contacts_slide_or_are_open() {
        let pressed = Coulomb { mu: 0.0 }.status(&[1.0, 0.0, 0.0], &[0.0, 0.0, 0.0], 1e-9);
        assert_eq!(
            pressed,
            ContactStatus {
                status: Motion::Slip,
                at_limit: false,
                degenerate: false,
                rolls: false,
                at_rolling_limit: false
            }
        );
        let open = Coulomb { mu: 0.0 }.status(&[0.0; 3], &[1.0, 5.0, 0.0], 1e-9);
        assert_eq!(
            open,
            ContactStatus {
                status: Motion::Open,
                at_limit: false,
                degenerate: false,
                rolls: false,
                at_rolling_limit: false
            }
        );
    }

    #[test]
    fn without_friction_and_tangential_parts_the_normal_part_decides() {
        // A pulling impulse is no solution, an open contact is one.
        for (x, modified, residual) in [
            ([-5.0, 0.0], [0.0, 0.0], 5.0),
            ([0.0, 0.0], [1.0, 0.0], 0.0),
            ([5.0, 0.0], [0.0, 0.0], 0.0),
        ] {
            let phi = Coulomb { mu: 0.0 }.natural_map(&x, &modified);
            assert_eq!((phi[0].abs(), phi[1]), (residual, 0.0), "{x:?} {modified:?}");
        }
        assert_eq!(Coulomb { mu: 0.0 }.distance_to_cone(&[-5.0, 0.0, 0.0]), 5.0);
        assert_eq!(Coulomb { mu: 0.0 }.distance_to_dual(&[5.0, 0.0, 0.0]), 0.0);
        assert_eq!(Coulomb { mu: 0.0 }.distance_to_dual(&[-5.0, 0.0, 0.0]), 5.0);
    }

    #[test]
    fn the_nearest_point_is_nearer_than_any_other_of_the_cone() {
        for mu in [0.0, 0.3, 2.0] {
            for i in 0..60 {
                let a = f64::from(i) * 0.7;
                let x = [2.0 * a.sin(), a.cos() * 1.5, (1.3 * a).sin()];
                let best = Coulomb { mu }.distance_to_cone(&x);
                for j in 0..2000 {
                    let b = f64::from(j);
                    let n = (b * 0.377).rem_euclid(4.0);
                    let t = mu * n * (b * 0.113).sin();
                    let p = [n, t * b.cos(), t * b.sin()];
                    let d = (0..3).map(|k| (x[k] - p[k]).powi(2)).sum::<f64>().sqrt();
                    assert!(d >= best - 1e-12, "mu {mu} x {x:?} p {p:?}");
                }
            }
        }
    }
}
