//! One contact with rolling friction: the judge's answers from the definition of the cone with two disks.
//!
//! With `a = ‖y_T‖`, `b = ‖y_R‖` the nearest point of `K = {‖x_T‖ ≤ mu x_N, ‖x_R‖ ≤ mu_r x_N}` to y is
//! `(n, y_T − α y_T/a, y_R − β y_R/b)`, where `n = y_N + mu α + mu_r β` and each excess is `α = (a − mu n)⁺`, `β = (b − mu_r n)⁺`. With
//! `A = a − mu y_N`, `B = b − mu_r y_N` that is one of four cases: none, one or both are positive, or n = 0.

use super::contact::{ContactStatus, Law, Motion, difference, length};
use crate::{Kind, Rolling};
use nonsmooth_linalg::{Real, norm, power_of_two};

/// The rows of a disk.
fn part<T: Real, const D: usize>(x: &[T; D], disk: usize) -> &[T] {
    let half = (D - 1) / 2;
    &x[1 + disk * half..1 + (disk + 1) * half]
}

/// The length of a disk's part.
fn size<T: Real, const D: usize>(x: &[T; D], disk: usize) -> T {
    part(x, disk).iter().fold(T::from(0.0), |length, &t| length.hypot(t))
}

/// Where a point lies with respect to K and its polar cone.
enum Place<T> {
    Inside,
    Polar,
    /// `(α d, β d, d)`: the excesses over the disks times a divisor, which T need not divide.
    Outside([T; 2], T),
}

impl Rolling {
    fn place<T: Real, const D: usize>(self, y: &[T; D]) -> Place<T> {
        let Self { mu, mu_r } = self;
        let [friction, rolling, zero, one] = [mu, mu_r, 0.0, 1.0].map(T::from);
        let (a, b) = (size(y, 0), size(y, 1));
        let (over_a, over_b) = (a - friction * y[0], b - rolling * y[0]);
        if over_a <= zero && over_b <= zero && y[0] >= zero {
            return Place::Inside;
        }
        if y[0] + friction * a + rolling * b <= zero {
            return Place::Polar;
        }
        let (of_a, of_b) = (one + T::of_product(mu, mu), one + T::of_product(mu_r, mu_r));
        let both = T::of_product(mu, mu_r);
        // n is the same for both, so that an excess of one disk lowers that of the other.
        let (left_a, left_b) = (of_b * over_a - both * over_b, of_a * over_b - both * over_a);
        if left_b <= zero {
            Place::Outside([over_a, zero], of_a)
        } else if left_a <= zero {
            Place::Outside([zero, over_b], of_b)
        } else {
            Place::Outside([left_a, left_b], of_a + T::of_product(mu_r, mu_r))
        }
    }

    /// `√(1 + mu² + mu_r²)`.
    fn secant(self) -> f64 {
        1.0.hypot(self.mu).hypot(self.mu_r)
    }
}

/// `ũ = u + (mu‖u_T‖ + mu_r‖u_R‖) e_N`, `K = {‖x_T‖ ≤ mu x_N, ‖x_R‖ ≤ mu_r x_N}`, `K* = {mu‖y_T‖ + mu_r‖y_R‖ ≤ y_N}`, rows N, T, R.
impl<const D: usize> Law<D> for Rolling {
    type Rolling = Vec<f64>;
    const FITS: bool = D == 5;
    const DISKS: usize = 2;
    const LOCAL: Kind = Kind::RollingLocal3d;
    const GLOBAL: Kind = Kind::RollingGlobal3d;

    fn of(mu: &[f64], mu_r: &Vec<f64>, c: usize) -> Self {
        Self { mu: mu[c], mu_r: mu_r[c] }
    }

    #[inline(always)]
    fn coefficient(self, disk: usize) -> f64 {
        if disk == 0 { self.mu } else { self.mu_r }
    }

    fn modified_velocity<T: Real>(self, u: &[T; D]) -> [T; D] {
        let mut modified = *u;
        modified[0] = modified[0] + T::from(self.mu) * size(u, 0) + T::from(self.mu_r) * size(u, 1);
        modified
    }

    fn growth(self) -> f64 {
        1.0 + self.mu + self.mu_r
    }

    /// `ũ + (−mu α − mu_r β, α y_T/a, β y_R/b)` outside of both cones: what is far larger than the map does not enter.
    fn natural_map<T: Real>(self, x: &[T; D], modified: &[T; D]) -> [f64; D] {
        let y = difference(x, modified);
        let (excess, divisor) = match self.place(&y) {
            Place::Inside => return modified.map(|v| v.value()),
            Place::Polar => return x.map(|v| v.value()),
            Place::Outside(excess, divisor) => (excess, divisor),
        };
        let shift = T::from(self.mu) * excess[0] + T::from(self.mu_r) * excess[1];
        let mut map = [0.0; D];
        map[0] = (divisor * modified[0] - shift).value() / divisor.value();
        let half = (D - 1) / 2;
        for disk in 0..2 {
            let t = size(&y, disk);
            // A power of two keeps t from underflow.
            let per = 1.0 / power_of_two(t.value());
            let whole = divisor * t.times_power(per);
            for k in 1 + disk * half..1 + (disk + 1) * half {
                map[k] = if t > T::from(0.0) {
                    (whole * modified[k] + excess[disk] * y[k].times_power(per)).value()
                        / whole.value()
                } else {
                    modified[k].value()
                };
            }
        }
        map
    }

    fn distance_to_cone<T: Real>(self, x: &[T; D]) -> f64 {
        match self.place(x) {
            Place::Inside => 0.0,
            Place::Polar => length(&x.map(|v| v.value())),
            Place::Outside([a, b], divisor) => {
                let [a, b] = [a, b].map(|over| over.value() / divisor.value());
                (self.mu * a + self.mu_r * b).hypot(a).hypot(b)
            }
        }
    }

    /// With Moreau's decomposition the size of the nearest point of K to −ũ.
    fn distance_to_dual(self, u: &[f64; D]) -> f64 {
        if u[0] >= 0.0 {
            return 0.0;
        }
        let opposite = self.modified_velocity(u).map(|v| -v);
        match self.place(&opposite) {
            Place::Inside => length(&opposite),
            Place::Polar => 0.0,
            Place::Outside([a, b], divisor) => {
                // Of the two parts on their limits −u_N is what is left along K's edge.
                if a > 0.0 && b > 0.0 {
                    return -u[0] / self.secant();
                }
                let n = opposite[0] + (self.mu * a + self.mu_r * b) / divisor;
                let (s, t) = (size(&opposite, 0), size(&opposite, 1));
                n.hypot(s.min(self.mu * n)).hypot(t.min(self.mu_r * n))
            }
        }
    }

    fn softened(self) -> Self {
        Self { mu: self.mu.min(1.0), mu_r: self.mu_r.min(1.0) }
    }

    fn is_at_rest_or_open(self, x: &[f64; D], modified: &[f64; D], error: f64) -> bool {
        let Self { mu, mu_r } = self;
        let y = difference(x, modified);
        let (a, b) = (size(&y, 0), size(&y, 1));
        let margin = (1.0 + mu + mu_r) * error;
        (a - mu * y[0] < -margin && b - mu_r * y[0] < -margin) || y[0] + mu * a + mu_r * b < -margin
    }

    /// As of Coulomb's law, each disk by itself: the angular velocity is compared with its moment.
    fn apart(self, x: &[f64; D], u: &[f64; D]) -> f64 {
        let mut most = u[0].max(0.0).min(norm(x)).max((-x[0]).max(0.0));
        for (disk, coefficient) in [(0, self.mu), (1, self.mu_r)] {
            let sliding = size(u, disk);
            let mut square = 0.0;
            for (x_k, u_k) in part(x, disk).iter().zip(part(u, disk)) {
                square += (x_k + coefficient * x[0] * (u_k / sliding)).powi(2);
            }
            let across = if sliding > 0.0 { square.sqrt() } else { 0.0 };
            let pulling = size(x, disk) - coefficient * x[0].max(0.0);
            most = most.max(sliding.min(across)).max(pulling);
        }
        most
    }

    /// Open, or by what slides; and whether it rolls.
    fn status(self, x: &[f64; D], modified: &[f64; D], margin: f64) -> ContactStatus {
        let y = difference(x, modified);
        let into_polar = (-y[0] - self.mu * size(&y, 0) - self.mu_r * size(&y, 1)) / self.secant();
        let into = [0, 1].map(|disk| {
            let coefficient = Law::<D>::coefficient(self, disk);
            (coefficient * y[0] - size(&y, disk)) / 1.0.hypot(coefficient)
        });
        let rests = |disk: usize| into[disk] >= 0.0 || size(modified, disk) <= margin;
        let rough = self.mu > 0.0;
        let status = if into_polar >= 0.0 {
            Motion::Open
        } else if rough && rests(0) {
            Motion::Stick
        } else {
            Motion::Slip
        };
        let near =
            |disk: usize| Law::<D>::coefficient(self, disk) > 0.0 && into[disk].abs() <= margin;
        let resists = status != Motion::Open && self.mu_r > 0.0;
        ContactStatus {
            status,
            at_limit: status == Motion::Stick && (near(0) || into[0] < 0.0),
            degenerate: into_polar.abs() <= margin || near(0) || near(1),
            rolls: resists && !rests(1),
            at_rolling_limit: resists && rests(1) && (near(1) || into[1] < 0.0),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn points() -> impl Iterator<Item = [f64; 5]> {
        (0..200).map(|i| {
            let a = f64::from(i) * 0.7;
            [2.0 * a.sin(), a.cos() * 1.5, (1.3 * a).sin(), (0.3 * a).cos(), (2.1 * a).sin()]
        })
    }

    /// A point of K.
    fn inside(law: Rolling, b: f64) -> [f64; 5] {
        let n = (b * 0.377).rem_euclid(4.0);
        let (t, r) = (law.mu * n * (b * 0.113).sin(), law.mu_r * n * (b * 0.271).cos());
        [n, t * b.cos(), t * b.sin(), r * (1.7 * b).cos(), r * (1.7 * b).sin()]
    }

    fn laws() -> [Rolling; 5] {
        [(0.5, 0.2), (0.0, 0.3), (0.7, 0.0), (0.0, 0.0), (2.0, 3.0)]
            .map(|(mu, mu_r)| Rolling { mu, mu_r })
    }

    #[test]
    fn the_nearest_point_is_nearer_than_any_other_of_the_cone() {
        for law in laws() {
            for x in points() {
                // The natural map with ũ = y − … : x − P_K(x) is the map of (x, 0) up to sign.
                let map = Law::<5>::natural_map(law, &x, &[0.0; 5]);
                let p: [f64; 5] = std::array::from_fn(|k| x[k] - map[k]);
                assert!(Law::<5>::distance_to_cone(law, &p) < 1e-14, "{law:?} {x:?} {p:?}");
                let best = Law::<5>::distance_to_cone(law, &x);
                assert!((length(&map) - best).abs() < 1e-14);
                for j in 0..500 {
                    let q = inside(law, f64::from(j));
                    assert!(length(&difference(&x, &q)) >= best - 1e-12, "{law:?} {x:?} {q:?}");
                    // The variational inequality of a projection.
                    let along: f64 = (0..5).map(|k| map[k] * (q[k] - p[k])).sum();
                    assert!(along <= 1e-12, "{law:?} {x:?}");
                }
            }
        }
    }

    #[test]
    fn the_distance_to_the_dual_is_that_of_the_modified_velocity() {
        for law in laws() {
            for u in points() {
                let modified = Law::<5>::modified_velocity(law, &u);
                // Moreau: ũ + P_K(−ũ) is the nearest point of K*.
                let minus = modified.map(|v| -v);
                let map = Law::<5>::natural_map(law, &minus, &[0.0; 5]);
                let size = length(&std::array::from_fn::<f64, 5, _>(|k| minus[k] - map[k]));
                let found = Law::<5>::distance_to_dual(law, &u);
                assert!((found - size).abs() < 1e-13, "{law:?} {u:?}: {found} {size}");
            }
        }
    }

    #[test]
    fn statuses_of_known_contacts() {
        let law = Rolling { mu: 0.5, mu_r: 0.1 };
        let of = |x: [f64; 5], u: [f64; 5]| {
            let s = Law::<5>::status(law, &x, &Law::<5>::modified_velocity(law, &u), 1e-9);
            (s.status, s.rolls, s.at_limit, s.degenerate)
        };
        let o = 0.0;
        assert_eq!(of([o; 5], [1.0, o, 2.0, 1.0, o]), (Motion::Open, false, false, false));
        assert_eq!(of([2.0, 0.3, o, 0.1, o], [o; 5]), (Motion::Stick, false, false, false));
        // Rolling without sliding: the moment on its limit, against the angular velocity.
        let rolling = of([2.0, 0.3, o, -0.2, o], [o, o, o, 3.0, o]);
        assert_eq!(rolling, (Motion::Stick, true, false, false));
        let sliding = of([2.0, -1.0, o, 0.1, o], [o, 3.0, o, o, o]);
        assert_eq!(sliding, (Motion::Slip, false, false, false));
        let both = of([2.0, -1.0, o, o, 0.2], [o, 3.0, o, o, -1.0]);
        assert_eq!(both, (Motion::Slip, true, false, false));
    }
}
