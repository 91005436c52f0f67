//! One contact: distance to the cone, natural map and status, from the definitions.

use serde::Serialize;

use nonsmooth_linalg::{Real, power_of_two};

/// What a contact does.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, Serialize)]
#[serde(rename_all = "snake_case")]
pub enum Motion {
    /// No impulse, separating: `r = 0`.
    Open,
    /// Pressed and at rest: `u = 0`, `r` inside K.
    Stick,
    /// Pressed and sliding: `u_N = 0`, `r` on the boundary of K against the sliding velocity.
    Slip,
}

/// The status of a contact and whether it is certain at the tolerance asked for.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize)]
pub struct ContactStatus {
    /// Open, stick or slip: the region of the cone in which `x − ũ` lies.
    pub status: Motion,
    /// The margin to another status is below the tolerance.
    pub degenerate: bool,
}

/// `‖x_T‖` of `[x_N, x_T…]`.
fn tangential<T: Real, const D: usize>(x: &[T; D]) -> T {
    match D {
        2 => x[1].modulus(),
        3 => x[1].hypot(x[2]),
        _ => x[1..].iter().fold(T::from(0.0), |length, &t| length.hypot(t)),
    }
}

/// `‖x‖`.
pub(super) fn length<T: Real, const D: usize>(x: &[T; D]) -> T {
    x[0].hypot(tangential(x))
}

/// `x − y`.
fn difference<T: Real, const D: usize>(x: &[T; D], y: &[T; D]) -> [T; D] {
    std::array::from_fn(|k| x[k] - y[k])
}

/// `ũ = u + mu‖u_T‖ e_N`, De Saxcé's modified velocity.
pub(super) fn modified_velocity<T: Real, const D: usize>(u: &[T; D], mu: f64) -> [T; D] {
    let mut modified = *u;
    modified[0] = modified[0] + T::from(mu) * tangential(u);
    modified
}

/// `dist(x, K)`, `K = {‖x_T‖ ≤ mu x_N}`. In the half-plane of `(x_N, ‖x_T‖)`: to the ray `(cos φ, sin φ)`, `tan φ = mu`, or to the apex.
///
/// What nearly cancels is done in T, the rest plainly: so are all distances here.
pub(super) fn distance_to_cone<T: Real, const D: usize>(x: &[T; D], mu: f64) -> f64 {
    let t = tangential(x);
    let outside = t - T::from(mu) * x[0];
    if outside <= T::from(0.0) && x[0] >= T::from(0.0) {
        0.0
    } else if x[0] + T::from(mu) * t <= T::from(0.0) {
        length(&x.map(|v| v.value()))
    } else {
        outside.value() / 1.0.hypot(mu)
    }
}

/// `dist(ũ, K*)`, `K* = {mu‖y_T‖ ≤ y_N}`, from u: with Moreau's decomposition the size of the nearest point of K to −ũ, of which `−u_N` is
/// the part along K's side.
fn distance_to_dual<const D: usize>(u: &[f64; D], mu: f64) -> f64 {
    let modified = modified_velocity(u, mu);
    if u[0] >= 0.0 {
        0.0
    } else if tangential(u) + mu * modified[0] <= 0.0 {
        length(&modified)
    } else {
        -u[0] / 1.0.hypot(mu)
    }
}

/// The natural map `x − P_K(x − ũ)`.
///
/// With `y = x − ũ` it is ũ where y lies in K, x where y lies in the polar cone, and else `ũ + d n` with the distance d of y
/// from K and the outward normal n: the difference of x and a projection would round ũ away where x is large.
pub(super) fn natural_map<T: Real, const D: usize>(
    x: &[T; D],
    modified: &[T; D],
    mu: f64,
) -> [f64; D] {
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

/// What one contact adds to the residuals, from x and ũ.
pub(super) struct Share {
    /// `‖x − P_K(x − ũ)‖²`.
    pub residual: f64,
    /// `dist(x, K)²`.
    pub primal: f64,
    /// `dist(ũ, K*)²`, with mu > 1 as far as with mu = 1: much friction opens K* to nearly the whole space, and a velocity into the obstacle is near it.
    pub dual: f64,
    /// `|x · ũ|`.
    pub complementarity: f64,
}

impl Share {
    /// From x, u and ũ.
    pub(super) fn new<T: Real, const D: usize>(
        x: &[T; D],
        u: &[T; D],
        modified: &[T; D],
        mu: f64,
    ) -> Self {
        let square = |x: [f64; D]| x.iter().map(|v| v * v).sum::<f64>();
        let opening = ((1.0 + mu * mu) / (1.0 + mu.min(1.0).powi(2))).min(f64::MAX);
        let products = x.iter().zip(modified).map(|(&a, &b)| a * b);
        Self {
            residual: square(natural_map(x, modified, mu)),
            primal: distance_to_cone(x, mu).powi(2),
            dual: opening * distance_to_dual(&u.map(|v| v.value()), mu).powi(2),
            complementarity: products.fold(T::from(0.0), |sum, p| sum + p).value().abs(),
        }
    }
}

/// Whether `x − ũ`, which plain arithmetic knows up to `error`, surely lies in K or in its polar cone, so that the natural map is ũ or x itself and no difference.
pub(super) fn is_at_rest_or_open<const D: usize>(
    x: &[f64; D],
    modified: &[f64; D],
    mu: f64,
    error: f64,
) -> bool {
    let y = difference(x, modified);
    let (t, margin) = (tangential(&y), (1.0 + mu) * error);
    t - mu * y[0] < -margin || y[0] + mu * t < -margin
}

/// The status of a contact from `x = w r` and ũ; `margin` is a velocity.
pub(super) fn status<const D: usize>(
    x: &[f64; D],
    modified: &[f64; D],
    mu: f64,
    margin: f64,
) -> ContactStatus {
    let y = difference(x, modified);
    let t = tangential(&y);
    let secant = (1.0 + mu * mu).sqrt();
    // Signed distances of y into K and into its polar cone −K*.
    let into_cone = (mu * y[0] - t) / secant;
    let into_polar = (-y[0] - mu * t) / secant;
    let status = if into_polar >= 0.0 {
        Motion::Open
    } else if mu > 0.0 && into_cone >= 0.0 {
        Motion::Stick
    } else {
        Motion::Slip
    };
    // A frictionless contact slides or is open: its cone has no interior to be near to.
    let near_stick = mu > 0.0 && into_cone.abs() <= margin;
    ContactStatus { status, degenerate: into_polar.abs() <= margin || near_stick }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_three_regions() {
        let mu = 0.5;
        let at_rest = ([2.0, 0.1, 0.2], [0.0; 3]);
        assert_eq!(status(&at_rest.0, &at_rest.1, mu, 1e-9).status, Motion::Stick);
        let sliding = ([2.0, -1.0, 0.0], modified_velocity(&[0.0, 3.0, 0.0], mu));
        assert_eq!(status(&sliding.0, &sliding.1, mu, 1e-9).status, Motion::Slip);
        let flying = ([0.0; 3], modified_velocity(&[1.0, 3.0, 0.0], mu));
        assert_eq!(status(&flying.0, &flying.1, mu, 1e-9).status, Motion::Open);
        for (x, u) in [at_rest, sliding, flying] {
            assert!(natural_map(&x, &u, mu).iter().all(|v| v.abs() < 1e-15));
            assert!(!status(&x, &u, mu, 1e-9).degenerate);
        }
        assert!(status(&[0.0; 3], &[0.0; 3], mu, 1e-9).degenerate);
        assert!(status(&[2.0, -1.0, 0.0], &[0.0; 3], mu, 1e-9).degenerate);
    }

    #[test]
    fn frictionless_contacts_slide_or_are_open() {
        let pressed = status(&[1.0, 0.0, 0.0], &[0.0, 0.0, 0.0], 0.0, 1e-9);
        assert_eq!(pressed, ContactStatus { status: Motion::Slip, degenerate: false });
        let open = status(&[0.0; 3], &[1.0, 5.0, 0.0], 0.0, 1e-9);
        assert_eq!(open, ContactStatus { status: Motion::Open, degenerate: false });
    }

    #[test]
    fn without_friction_and_tangential_parts_the_normal_part_decides() {
        // A pulling impulse is no solution, an open contact is one.
        for (x, modified, residual) in [
            ([-5.0, 0.0], [0.0, 0.0], 5.0),
            ([0.0, 0.0], [1.0, 0.0], 0.0),
            ([5.0, 0.0], [0.0, 0.0], 0.0),
        ] {
            let phi = natural_map(&x, &modified, 0.0);
            assert_eq!((phi[0].abs(), phi[1]), (residual, 0.0), "{x:?} {modified:?}");
        }
        assert_eq!(distance_to_cone(&[-5.0, 0.0, 0.0], 0.0), 5.0);
        assert_eq!(distance_to_dual(&[5.0, 0.0, 0.0], 0.0), 0.0);
        assert_eq!(distance_to_dual(&[-5.0, 0.0, 0.0], 0.0), 5.0);
    }

    #[test]
    fn the_nearest_point_is_nearer_than_any_other_of_the_cone() {
        for mu in [0.0, 0.3, 2.0] {
            for i in 0..60 {
                let a = f64::from(i) * 0.7;
                let x = [2.0 * a.sin(), a.cos() * 1.5, (1.3 * a).sin()];
                let best = distance_to_cone(&x, mu);
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
