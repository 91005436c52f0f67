//! Interior points of the second-order cone `L = {x_N ≥ ‖x_T‖}`, kept by their margins, and Nesterov–Todd scaling.
//!
//! A point is kept as `plus = x_N + ‖x_T‖`, `minus = x_N − ‖x_T‖` and the unit direction t of x_T. Near the boundary `minus`
//! is far below the rounding of x_N, and all that an interior-point method does depends on it: so it is a variable
//! of its own, moved by `det(x + αd) = det x + 2α xᵀJd + α² det d`, `J = diag(1, −I)`, which loses no digits.
//!
//! The scaling of a pair (x, z) is the symmetric positive definite S with `S x = S⁻¹ z = λ` that maps L onto L:
//! `S² = η (2 w wᵀ − J)`, `η = √(det z/det x)`, `w = (z̄ + J x̄)/(2γ)`, `γ² = (1 + x̄ᵀz̄)/2`, bars for unit determinants
//! (NesterovTodd1998; the formulas for the second-order cone: TutuncuTohTodd2003). It is kept by its eigenvalues `√η ω`, `√η/ω`, `√η` with
//! `ω = w_N + ‖w_T‖`, and its eigenvectors `(1, ±t)/√2` and `(0, t⊥)`.
//!
//! A half line (a contact without friction) is the case where only x_N exists; its eigenvectors are the unit vectors and S moves N alone.

use nonsmooth_linalg::{Block, small};

use crate::contact::law::cone::tangential_norm;

/// A point inside the cone.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Inner<const D: usize> {
    plus: f64,
    minus: f64,
    /// `x_T/‖x_T‖`, with a zero in front; any unit vector where `x_T = 0`.
    t: [f64; D],
}

/// Which cone a contact has, in the scaled coordinates.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Shape {
    /// `{x_N ≥ ‖x_T‖}`.
    SecondOrder,
    /// `{x_N ≥ 0, x_T = 0}` for x, `{z_N ≥ 0}` for z: no friction.
    Line,
}

/// The unit vector along the tangential part of `x`, which has length `size`.
fn direction<const D: usize>(x: &[f64; D], size: f64) -> [f64; D] {
    let mut t = [0.0; D];
    if size > 0.0 {
        for k in 1..D {
            t[k] = x[k] / size;
        }
    } else {
        t[1] = 1.0;
    }
    t
}

fn tangential_dot<const D: usize>(a: &[f64; D], b: &[f64; D]) -> f64 {
    (1..D).map(|k| a[k] * b[k]).sum()
}

/// `1 + aᵀb` of two unit vectors, exact where they are nearly opposite.
fn one_plus_cosine<const D: usize>(a: &[f64; D], b: &[f64; D]) -> f64 {
    0.5 * (1..D).map(|k| (a[k] + b[k]) * (a[k] + b[k])).sum::<f64>()
}

impl<const D: usize> Inner<D> {
    /// The multiple `a > 0` of the cone's unit `e = (1, 0)`.
    pub fn unit(a: f64) -> Self {
        Self { plus: a, minus: a, t: direction(&[0.0; D], 0.0) }
    }

    /// The point nearest to `x`, in its normal component, whose margin is at least `margin > 0`.
    pub fn shifted(x: &[f64; D], margin: f64) -> Self {
        let size = tangential_norm(x);
        let minus = (x[0] - size).max(margin);
        Self { plus: minus + 2.0 * size, minus, t: direction(x, size) }
    }

    /// `x_N`.
    #[inline(always)]
    pub fn normal(&self) -> f64 {
        0.5 * (self.plus + self.minus)
    }

    /// `‖x_T‖`.
    #[inline(always)]
    pub fn tangential(&self) -> f64 {
        0.5 * (self.plus - self.minus)
    }

    /// The direction of x_T, with a zero in front.
    #[inline(always)]
    pub fn direction(&self) -> &[f64; D] {
        &self.t
    }

    /// `x_N − ‖x_T‖ > 0`.
    pub fn margin(&self) -> f64 {
        self.minus
    }

    /// The vector.
    #[inline(always)]
    pub fn vector(&self) -> [f64; D] {
        let size = self.tangential();
        let mut x = [self.normal(); D];
        for k in 1..D {
            x[k] = size * self.t[k];
        }
        x
    }

    /// `xᵀz`.
    #[inline(always)]
    pub fn dot(&self, z: &Self) -> f64 {
        0.5 * (self.plus * z.minus + self.minus * z.plus)
            + self.tangential() * z.tangential() * one_plus_cosine(&self.t, &z.t)
    }

    /// `√det x`.
    fn root(&self) -> f64 {
        self.plus.sqrt() * self.minus.sqrt()
    }

    /// `xᵀ J d`.
    fn turn(&self, d: &[f64; D]) -> f64 {
        let along = tangential_dot(&self.t, d);
        0.5 * (self.plus * (d[0] - along) + self.minus * (d[0] + along))
    }

    /// `x_N + tᵀx_T` for a unit vector t.
    fn along(&self, t: &[f64; D]) -> f64 {
        self.minus + self.tangential() * one_plus_cosine(t, &self.t)
    }

    /// The largest α for which `x + α d` is in the cone; infinite where there is none.
    pub fn reach(&self, d: &[f64; D]) -> f64 {
        let size = tangential_norm(d);
        let a = (d[0] - size) * (d[0] + size);
        let b = self.turn(d);
        let c = self.plus * self.minus;
        // The smallest positive root of det(x + α d) = c + 2bα + aα²; b² ≥ ac inside the cone.
        let root = (b * b - a * c).max(0.0).sqrt();
        if b < 0.0 {
            c / (root - b)
        } else if a < 0.0 {
            (root + b) / -a
        } else {
            f64::INFINITY
        }
    }

    /// Moves to `x + α d`, for α below [`reach`](Self::reach).
    pub fn advance(&mut self, d: &[f64; D], alpha: f64) {
        let size = tangential_norm(d);
        let a = (d[0] - size) * (d[0] + size);
        let det = self.plus * self.minus + alpha * (2.0 * self.turn(d) + alpha * a);
        let mut x = self.vector();
        for k in 0..D {
            x[k] += alpha * d[k];
        }
        let size = tangential_norm(&x);
        let plus = x[0] + size;
        let direct = x[0] - size;
        let minus = if direct > 0.25 * plus { direct } else { det / plus };
        // Rounding alone can bring a step below the reach to the boundary.
        self.minus = if minus > 0.0 { minus } else { 1e-6 * self.minus };
        self.plus = plus.max(self.minus);
        self.t = direction(&x, size);
    }
}

/// Fills the rows from the third on with an orthonormal basis of what is across the unit vector t: the reflection that takes the first tangent to ±t takes the others there.
fn across<const D: usize>(t: &[f64; D], vectors: &mut Block<D>) {
    let mut v = *t;
    v[1] += if t[1] < 0.0 { -1.0 } else { 1.0 };
    let square = tangential_dot(&v, &v);
    for i in 2..D {
        for k in 1..D {
            vectors[i][k] = f64::from(u8::from(i == k)) - 2.0 * v[i] * v[k] / square;
        }
    }
}

/// A pair (x, z) inside the cone, and inside its dual.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Pair<const D: usize> {
    /// Fixed by mu: a half line without friction, else the second-order cone.
    pub shape: Shape,
    /// In the cone. Of a half line only the normal part counts.
    pub x: Inner<D>,
    /// In the dual cone. Of a half line only the normal part counts.
    pub z: Inner<D>,
}

impl<const D: usize> Pair<D> {
    /// `xᵀz`.
    pub fn dot(&self) -> f64 {
        match self.shape {
            Shape::SecondOrder => self.x.dot(&self.z),
            Shape::Line => self.x.plus * self.z.plus,
        }
    }

    /// `(x + α dx)ᵀ(z + α dz)`.
    pub fn dot_after(&self, dx: &[f64; D], dz: &[f64; D], alpha: f64) -> f64 {
        let (x, z) = (self.x.vector(), self.z.vector());
        let parts = if self.shape == Shape::Line { 1 } else { D };
        let mut sum = self.dot();
        for k in 0..parts {
            sum += alpha * (x[k] * dz[k] + dx[k] * z[k] + alpha * dx[k] * dz[k]);
        }
        sum
    }

    /// The largest α for which both `x + α dx` and `z + α dz` are in their cones.
    pub fn reach(&self, dx: &[f64; D], dz: &[f64; D]) -> f64 {
        let line = |x: f64, d: f64| if d < 0.0 { -x / d } else { f64::INFINITY };
        match self.shape {
            Shape::SecondOrder => self.x.reach(dx).min(self.z.reach(dz)),
            Shape::Line => line(self.x.plus, dx[0]).min(line(self.z.plus, dz[0])),
        }
    }

    /// Moves both by α.
    pub fn advance(&mut self, dx: &[f64; D], dz: &[f64; D], alpha: f64) {
        let line = |x: &mut Inner<D>, d: f64| {
            let moved = x.plus + alpha * d;
            *x = Inner::unit(if moved > 0.0 { moved } else { 1e-6 * x.plus });
        };
        match self.shape {
            Shape::SecondOrder => {
                self.x.advance(dx, alpha);
                self.z.advance(dz, alpha);
            }
            Shape::Line => {
                line(&mut self.x, dx[0]);
                line(&mut self.z, dz[0]);
            }
        }
    }
}

/// The Nesterov–Todd scaling of a pair.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Scaling<const D: usize> {
    /// Fixed by mu: a half line without friction, else the second-order cone.
    pub shape: Shape,
    /// The eigenvectors of S, by rows.
    pub vectors: Block<D>,
    /// The eigenvalues of S. Of a half line only the first counts.
    pub values: [f64; D],
    /// `λ = S x = S⁻¹ z`.
    pub lambda: [f64; D],
    /// `det λ = √(det x det z)`.
    det: f64,
}

impl<const D: usize> Scaling<D> {
    /// The scaling of `pair`.
    pub fn new(pair: &Pair<D>) -> Self {
        let (x, z) = (&pair.x, &pair.z);
        if pair.shape == Shape::Line {
            let mut vectors = [[0.0; D]; D];
            (0..D).for_each(|k| vectors[k][k] = 1.0);
            let (mut values, mut lambda) = ([1.0; D], [0.0; D]);
            values[0] = (z.plus / x.plus).sqrt();
            lambda[0] = x.plus.sqrt() * z.plus.sqrt();
            let det = lambda[0] * lambda[0];
            return Self { shape: pair.shape, vectors, values, lambda, det };
        }
        let (root_x, root_z) = (x.root(), z.root());
        let (x_plus, x_minus) = (x.plus / root_x, x.minus / root_x);
        let (z_plus, z_minus) = (z.plus / root_z, z.minus / root_z);
        let (x_t, z_t) = (0.5 * (x_plus - x_minus), 0.5 * (z_plus - z_minus));
        let product =
            0.5 * (x_plus * z_minus + x_minus * z_plus) + x_t * z_t * one_plus_cosine(&x.t, &z.t);
        let two_gamma = 2.0 * (0.5 * (1.0 + product)).sqrt();
        let mut w = [0.5 * (x_plus + x_minus + z_plus + z_minus) / two_gamma; D];
        for k in 1..D {
            w[k] = (z_t * z.t[k] - x_t * x.t[k]) / two_gamma;
        }
        let size = tangential_norm(&w);
        let omega = w[0] + size;
        let t = direction(&w, size);
        let root_eta = (root_z / root_x).sqrt();
        let half = std::f64::consts::FRAC_1_SQRT_2;
        let (mut vectors, mut values) = ([[0.0; D]; D], [root_eta; D]);
        values[0] = root_eta * omega;
        values[1] = root_eta / omega;
        (vectors[0][0], vectors[1][0]) = (half, half);
        for k in 1..D {
            vectors[0][k] = half * t[k];
            vectors[1][k] = -half * t[k];
        }
        if D == 3 {
            (vectors[2][1], vectors[2][2]) = (-t[2], t[1]);
        } else if D > 3 {
            across(&t, &mut vectors);
        }
        // The coordinates of x and z by margins: plain products would lose the small ones.
        let coordinates = |p: &Inner<D>| {
            let mut y = [0.0; D];
            y[0] = half * p.along(&t);
            y[1] = half * p.along(&t.map(|v| -v));
            for i in 2..D {
                y[i] = p.tangential() * (0..D).map(|k| vectors[i][k] * p.t[k]).sum::<f64>();
            }
            y
        };
        let (cx, cz) = (coordinates(x), coordinates(z));
        let mut scaled = [0.0; D];
        for k in 0..D {
            scaled[k] = 0.5 * (values[k] * cx[k] + cz[k] / values[k]);
        }
        let mut scaling =
            Self { shape: pair.shape, vectors, values, lambda: [0.0; D], det: root_x * root_z };
        scaling.lambda = scaling.back(&scaled);
        scaling
    }

    /// Coordinates along the eigenvectors.
    #[inline(always)]
    pub fn coordinates(&self, x: &[f64; D]) -> [f64; D] {
        small::mul(&self.vectors, x)
    }

    /// The vector with the given coordinates along the eigenvectors.
    #[inline(always)]
    pub fn back(&self, y: &[f64; D]) -> [f64; D] {
        let mut x = [0.0; D];
        for i in 0..D {
            for k in 0..D {
                x[k] += self.vectors[i][k] * y[i];
            }
        }
        x
    }

    /// `S x`.
    pub fn apply(&self, x: &[f64; D]) -> [f64; D] {
        let mut y = self.coordinates(x);
        (0..D).for_each(|k| y[k] *= self.values[k]);
        self.back(&y)
    }

    /// `S⁻¹ z`.
    pub fn apply_inverse(&self, z: &[f64; D]) -> [f64; D] {
        let mut y = self.coordinates(z);
        (0..D).for_each(|k| y[k] /= self.values[k]);
        self.back(&y)
    }

    /// The d with `λ ∘ d = g`.
    #[inline(always)]
    pub fn divide(&self, g: &[f64; D]) -> [f64; D] {
        let l = &self.lambda;
        let mut d = [0.0; D];
        if self.shape == Shape::Line {
            d[0] = g[0] / l[0];
            return d;
        }
        d[0] = (l[0] * g[0] - tangential_dot(l, g)) / self.det;
        for k in 1..D {
            d[k] = (g[k] - d[0] * l[k]) / l[0];
        }
        d
    }

    /// `a ∘ b = (aᵀb, a_N b_T + b_N a_T)`.
    #[inline(always)]
    pub fn product(&self, a: &[f64; D], b: &[f64; D]) -> [f64; D] {
        let mut c = [0.0; D];
        c[0] = a[0] * b[0];
        if self.shape == Shape::SecondOrder {
            c[0] += tangential_dot(a, b);
            for k in 1..D {
                c[k] = a[0] * b[k] + b[0] * a[k];
            }
        }
        c
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Points inside the cone: anywhere, near the boundary, on the axis.
    fn points() -> Vec<[f64; 3]> {
        let mut all = vec![[1.0, 0.0, 0.0], [2.0, 1.0, -1.0], [0.3, -0.1, 0.2], [1e3, 10.0, 900.0]];
        for gap in [1e-2, 1e-5, 1e-9] {
            for angle in [0.3_f64, 2.0, 4.0, 3.44] {
                all.push([0.7 + gap, 0.7 * angle.cos(), 0.7 * angle.sin()]);
            }
        }
        all
    }

    fn near(a: &[f64], b: &[f64], relative: f64) -> bool {
        let size = a.iter().chain(b).fold(0.0_f64, |s, v| s.max(v.abs()));
        a.iter().zip(b).all(|(a, b)| (a - b).abs() <= relative * size)
    }

    #[test]
    fn the_scaling_maps_x_and_z_to_the_same_point() {
        for a in points() {
            for b in points() {
                let pair = Pair {
                    shape: Shape::SecondOrder,
                    x: Inner::shifted(&a, 1e-300),
                    z: Inner::shifted(&b, 1e-300),
                };
                let s = Scaling::new(&pair);
                let twice = s.apply(&s.apply(&a));
                // S² x = z, to what the condition of S² leaves.
                let condition = s.values.iter().fold(0.0_f64, |m, v| m.max(*v))
                    / s.values.iter().fold(f64::MAX, |m, v| m.min(*v));
                assert!(near(&twice, &b, 1e-14 * condition * condition + 1e-12), "{a:?} {b:?}");
                assert!(near(&s.apply(&a), &s.lambda, 1e-14 * condition + 1e-12));
                let l = &s.lambda;
                let det = (l[0] - tangential_norm(l)) * (l[0] + tangential_norm(l));
                assert!((det - s.det).abs() <= 1e-9 * l[0] * l[0], "{a:?} {b:?}");
                // λ ∘ (λ \ g) = g.
                let g = [0.3, -0.2, 0.9];
                let tolerance = 1e-13 * l[0] * l[0] / s.det + 1e-13;
                assert!(near(&s.product(l, &s.divide(&g)), &g, tolerance), "{a:?} {b:?}");
            }
        }
    }

    #[test]
    fn the_reach_ends_on_the_boundary() {
        for x in points() {
            for d in [[1.0, 0.5, 0.2], [-1.0, 0.2, 0.1], [0.1, -1.0, 1.0], [0.0, 0.0, 1.0]] {
                let p = Inner::shifted(&x, 1e-300);
                let reach = p.reach(&d);
                let at = |alpha: f64| {
                    let y = [x[0] + alpha * d[0], x[1] + alpha * d[1], x[2] + alpha * d[2]];
                    (y[0] - tangential_norm(&y), y[0])
                };
                if reach.is_infinite() {
                    assert!(at(1e6).0 > 0.0, "{x:?} {d:?}");
                } else {
                    let (end, size) = at(reach);
                    assert!(end.abs() <= 1e-13 * (size.abs() + x[0]), "{x:?} {d:?}: {end:e}");
                    assert!(at(0.5 * reach).0 > 0.0 && at(1.5 * reach + 1e-9).0 < 0.0);
                }
            }
        }
    }

    #[test]
    fn margins_survive_below_the_rounding_of_the_point() {
        let mut x = Inner::shifted(&[1.0, 0.6, 0.8], 1e-30);
        assert_eq!(x.margin(), 1e-30);
        // Along the axis by as much as the margin: it doubles.
        x.advance(&[1e-30, 0.0, 0.0], 1.0);
        assert!((x.margin() - 2e-30).abs() < 1e-44, "{:e}", x.margin());
        // Half the way to the boundary halves it, to second order.
        let d = [-1e-3, 6e-4, 8e-4];
        let half = 0.5 * x.reach(&d);
        x.advance(&d, half);
        assert!((x.margin() - 1e-30).abs() < 1e-40, "{:e}", x.margin());
    }

    #[test]
    fn in_the_plane_and_on_the_half_line() {
        let pair = Pair {
            shape: Shape::SecondOrder,
            x: Inner::shifted(&[1.0, 0.4], 1e-300),
            z: Inner::shifted(&[2.0, -1.9], 1e-300),
        };
        let s = Scaling::new(&pair);
        assert!(near(&s.apply(&s.apply(&[1.0, 0.4])), &[2.0, -1.9], 1e-12));
        let pair = Pair { shape: Shape::Line, x: Inner::unit(4.0), z: Inner::unit(9.0) };
        let s = Scaling::<3>::new(&pair);
        assert_eq!((s.values[0], s.lambda[0]), (1.5, 6.0));
        assert_eq!(pair.reach(&[-2.0, 9.0, 9.0], &[1.0, 9.0, 9.0]), 2.0);
    }
}
