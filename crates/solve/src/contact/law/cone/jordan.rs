//! The Jordan algebra of the second-order cone `L = {x_N ≥ ‖x_T‖}` in D dimensions.
//!
//! ```text
//! x∘y = (xᵀy, x_N y_T + y_N x_T),   e = (1, 0),   det x = x_N² − ‖x_T‖²
//! x = λ₁ c₁ + λ₂ c₂,   λ = x_N ∓ ‖x_T‖,   c = (1, ∓t)/2,   t = x_T/‖x_T‖
//! ```
//!
//! Functions act on the spectral values: `f(x) = f(λ₁) c₁ + f(λ₂) c₂`. Coulomb's cone and its dual become L in the coordinates
//! `(mu r_N, r_T)` and `(ũ_N/mu, ũ_T)`.
//!
//! Near the boundary `λ₁` is small and the differences that make it cancel; what can be had without them is:
//! `det(x² + y²)` is a sum of squares ([`root_of_squares`]).
//!
//! References: FukushimaLuoTseng2001, section 2 and proposition 4; Acary, lecture (112)–(115), in scaled coordinates.

use super::tangential_norm;

/// `x = λ₁ c₁ + λ₂ c₂` with `c = (1, ∓t)/2`.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Spectral<const D: usize> {
    /// λ₁ ≤ λ₂.
    pub values: [f64; 2],
    /// `(0, t)`, ‖t‖ = 1; any direction where `x_T = 0`.
    pub axis: [f64; D],
}

/// `x = λ₁ c₁ + λ₂ c₂` with `λ = x_N ∓ ‖x_T‖`; any axis where `x_T = 0`.
#[inline(always)]
pub fn spectral<const D: usize>(x: &[f64; D]) -> Spectral<D> {
    let size = tangential_norm(x);
    Spectral { values: [x[0] - size, x[0] + size], axis: axis(x, size) }
}

#[inline(always)]
fn axis<const D: usize>(x: &[f64; D], size: f64) -> [f64; D] {
    let mut axis = [0.0; D];
    axis[1] = 1.0;
    if size > 0.0 {
        for k in 1..D {
            axis[k] = x[k] / size;
        }
    }
    axis
}

impl<const D: usize> Spectral<D> {
    /// `λ₁ c₁ + λ₂ c₂`.
    #[inline(always)]
    pub fn point(&self) -> [f64; D] {
        let [low, high] = self.values;
        let mut x = [0.5 * (low + high); D];
        for k in 1..D {
            x[k] = 0.5 * (high - low) * self.axis[k];
        }
        x
    }

    /// `f(x) = f(λ₁) c₁ + f(λ₂) c₂`.
    #[inline(always)]
    pub fn map(&self, f: impl Fn(f64) -> f64) -> Self {
        Self { values: self.values.map(f), axis: self.axis }
    }

    /// The derivative of `f(x)`, given `f(λ)`, `f'(λ)`:
    /// `[b, c tᵀ; c t, a I + (b − a) t tᵀ]`, `b, c = (f'(λ₂) ± f'(λ₁))/2`, `a = (f(λ₂) − f(λ₁))/(λ₂ − λ₁)`.
    pub fn derivative(&self, f: [f64; 2], slope: [f64; 2]) -> [[f64; D]; D] {
        let b = 0.5 * (slope[1] + slope[0]);
        let c = 0.5 * (slope[1] - slope[0]);
        let gap = self.values[1] - self.values[0];
        let size = self.values[0].abs().max(self.values[1].abs());
        // Where the values meet, the quotient is the derivative.
        let a = if gap > 1e-9 * size { (f[1] - f[0]) / gap } else { b };
        let mut out = [[0.0; D]; D];
        out[0][0] = b;
        for k in 1..D {
            out[0][k] = c * self.axis[k];
            out[k][0] = c * self.axis[k];
            for l in 1..D {
                let identity = f64::from(u8::from(k == l));
                out[k][l] = a * identity + (b - a) * self.axis[k] * self.axis[l];
            }
        }
        out
    }

    /// `L(x)⁻¹ b` for x with these values, λ₁ ≥ 0: in the eigenvectors `(1, ∓t)` and those across t. An eigenvalue of zero
    /// counts as infinite (a pseudo-inverse).
    #[inline(always)]
    pub fn divide(&self, b: &[f64; D]) -> [f64; D] {
        let [low, high] = self.values;
        let over = |x: f64, eigenvalue: f64| if eigenvalue > 0.0 { x / eigenvalue } else { 0.0 };
        let along: f64 = (1..D).map(|k| self.axis[k] * b[k]).sum();
        let (minus, plus) = (over(b[0] - along, low), over(b[0] + along, high));
        let middle = 0.5 * (low + high);
        let mut x = [0.5 * (plus + minus); D];
        for k in 1..D {
            let across = over(b[k] - along * self.axis[k], middle);
            x[k] = 0.5 * (plus - minus) * self.axis[k] + across;
        }
        x
    }
}

/// `x∘y`.
#[inline(always)]
pub fn product<const D: usize>(x: &[f64; D], y: &[f64; D]) -> [f64; D] {
    let mut z = [0.0; D];
    for k in 0..D {
        z[0] += x[k] * y[k];
    }
    for k in 1..D {
        z[k] = x[0] * y[k] + y[0] * x[k];
    }
    z
}

/// `det x = λ₁ λ₂`, as a product: the difference of squares would cancel near the boundary.
#[inline(always)]
pub fn det<const D: usize>(x: &[f64; D]) -> f64 {
    let size = tangential_norm(x);
    (x[0] - size) * (x[0] + size)
}

/// `√x` for x in L (114): the element of L whose square is x. Spectral values below zero count as zero.
pub fn sqrt<const D: usize>(x: &[f64; D]) -> [f64; D] {
    spectral(x).map(|l| l.max(0.0).sqrt()).point()
}

/// `|x| = √(x∘x)`.
pub fn abs<const D: usize>(x: &[f64; D]) -> [f64; D] {
    spectral(x).map(f64::abs).point()
}

/// `x⁻¹` with `x∘x⁻¹ = e`, or `None` on the boundary of L ∪ −L.
pub fn inverse<const D: usize>(x: &[f64; D]) -> Option<[f64; D]> {
    let spectral = spectral(x);
    spectral.values.iter().all(|l| *l != 0.0).then(|| spectral.map(f64::recip).point())
}

/// The matrix of `y ↦ x∘y`.
pub fn operator<const D: usize>(x: &[f64; D]) -> [[f64; D]; D] {
    let mut l = [[0.0; D]; D];
    for k in 0..D {
        l[k][k] = x[0];
        l[0][k] = x[k];
        l[k][0] = x[k];
    }
    l
}

/// The quadratic representation `2 L(x)² − L(x²) = 2 x xᵀ − det(x) diag(1, −1, …)`: maps L onto L, and e to x².
pub fn quadratic<const D: usize>(x: &[f64; D]) -> [[f64; D]; D] {
    let det = det(x);
    let mut q = [[0.0; D]; D];
    for k in 0..D {
        for l in 0..D {
            q[k][l] = 2.0 * x[k] * x[l];
        }
        q[k][k] += if k == 0 { -det } else { det };
    }
    q
}

/// The projection on L, `(x + |x|)/2` (115).
pub fn project<const D: usize>(x: &[f64; D]) -> [f64; D] {
    spectral(x).map(|l| l.max(0.0)).point()
}

/// `(x² + y² + 2ε² e)^½`, with spectral values of full relative precision up to the boundary.
///
/// `w = x² + y²` has `λ₂ = w_N + ‖w_T‖` and `λ₁ = det(w)/λ₂`, where
/// `det w = det(x)² + det(y)² + 2 ((x_N y_N − x_Tᵀy_T)² + ‖x_N y_T − y_N x_T‖² + ‖x_T × y_T‖²)`.
pub fn root_of_squares<const D: usize>(x: &[f64; D], y: &[f64; D], epsilon: f64) -> Spectral<D> {
    let mut w = [0.0; D];
    for k in 0..D {
        w[0] += x[k] * x[k] + y[k] * y[k];
    }
    for k in 1..D {
        w[k] = 2.0 * (x[0] * x[k] + y[0] * y[k]);
    }
    let size = tangential_norm(&w);
    let high = w[0] + size;
    let dot: f64 = (1..D).map(|k| x[k] * y[k]).sum();
    let mut cross = (x[0] * y[0] - dot).powi(2);
    for k in 1..D {
        cross += (x[0] * y[k] - y[0] * x[k]).powi(2);
        for l in k + 1..D {
            cross += (x[k] * y[l] - x[l] * y[k]).powi(2);
        }
    }
    let det = det(x).powi(2) + det(y).powi(2) + 2.0 * cross;
    let low = if high > 0.0 { det / high } else { 0.0 };
    let shift = 2.0 * epsilon * epsilon;
    Spectral { values: [(low + shift).sqrt(), (high + shift).sqrt()], axis: axis(&w, size) }
}

#[cfg(test)]
mod tests {
    use nonsmooth_linalg::small::mul;

    use super::*;

    /// Points of all regions, of the boundary, and near it.
    fn points() -> Vec<[f64; 3]> {
        let mut points = vec![
            [0.0; 3],
            [1.0, 0.0, 0.0],
            [-2.0, 0.0, 0.0],
            [1.0, 0.6, 0.8],
            [-1.0, 0.6, -0.8],
            [1.0 + 1e-9, 0.6, 0.8],
        ];
        for i in 0..40 {
            let a = f64::from(i);
            points.push([2.0 * (0.7 * a).sin(), 1.5 * (1.3 * a).cos(), (0.9 * a).sin()]);
        }
        points
    }

    fn close(a: &[f64; 3], b: &[f64; 3], tolerance: f64) -> bool {
        (0..3).all(|k| (a[k] - b[k]).abs() <= tolerance)
    }

    #[test]
    fn identities_of_the_algebra() {
        let e = [1.0, 0.0, 0.0];
        for x in points() {
            assert_eq!(product(&x, &e), x);
            assert!(close(&spectral(&x).point(), &x, 1e-15));
            assert!(close(&product(&abs(&x), &abs(&x)), &product(&x, &x), 1e-14));
            let square = product(&x, &x);
            assert!(close(&mul(&quadratic(&x), &e), &square, 1e-14));
            let half: [f64; 3] = std::array::from_fn(|k| 0.5 * (x[k] + abs(&x)[k]));
            assert!(close(&half, &project(&x), 1e-15));
            if let Some(inverse) = inverse(&x) {
                let scale = inverse.iter().fold(1.0_f64, |m, v| m.max(v.abs()));
                assert!(close(&product(&x, &inverse), &e, 1e-15 * scale * scale), "{x:?}");
                // Q(x) x⁻¹ = x.
                assert!(close(&mul(&quadratic(&x), &inverse), &x, 1e-14 * scale), "{x:?}");
            }
            for y in points() {
                assert_eq!(product(&x, &y), product(&y, &x));
                assert!(close(&mul(&operator(&x), &y), &product(&x, &y), 1e-15));
                // Jordan: x²∘(x∘y) = x∘(x²∘y).
                let left = product(&square, &product(&x, &y));
                assert!(close(&left, &product(&x, &product(&square, &y)), 1e-13));
                // det(Q(x) y) = det(x)² det(y).
                let image = det(&mul(&quadratic(&x), &y));
                assert!((image - det(&x).powi(2) * det(&y)).abs() < 1e-10);
            }
        }
        assert!(inverse(&[1.0, 0.6, 0.8]).is_none());
    }

    #[test]
    fn roots_square_to_their_arguments() {
        for x in points() {
            for y in points() {
                let w: [f64; 3] = std::array::from_fn(|k| product(&x, &x)[k] + product(&y, &y)[k]);
                let root = root_of_squares(&x, &y, 0.0);
                assert!(root.values[0] >= 0.0);
                let point = root.point();
                assert!(close(&product(&point, &point), &w, 1e-13));
                assert!(close(&sqrt(&w), &point, 1e-6), "{x:?} {y:?}");
                let smoothed = root_of_squares(&x, &y, 0.3);
                let square = product(&smoothed.point(), &smoothed.point());
                assert!(close(&square, &[w[0] + 0.18, w[1], w[2]], 1e-13));
                let back = smoothed.divide(&product(&smoothed.point(), &y));
                assert!(close(&back, &y, 1e-13));
            }
        }
    }

    #[test]
    fn the_small_spectral_value_keeps_its_digits_at_the_boundary() {
        // x = a(1, t), y = b(1, −t): x² + y² = (2a² + 2b², …) has the roots 2b and 2a exactly.
        for b in [1e-3, 1e-8, 1e-13] {
            let (x, y) = ([5.0, 3.0, 4.0], [5.0 * b, -3.0 * b, -4.0 * b]);
            let root = root_of_squares(&x, &y, 0.0);
            assert!((root.values[0] / (10.0 * b) - 1.0).abs() < 1e-14, "{b} {root:?}");
            assert!((root.values[1] / 10.0 - 1.0).abs() < 1e-14);
        }
    }

    #[test]
    fn derivatives_of_spectral_functions() {
        // The square, whose derivative is 2 L(x), and the exponential by finite differences.
        for x in points() {
            let s = spectral(&x);
            let f = s.values.map(|l| l * l);
            let d = s.derivative(f, s.values.map(|l| 2.0 * l));
            let l = operator(&x);
            for i in 0..3 {
                assert!(close(&d[i], &l[i].map(|v| 2.0 * v), 1e-12), "{x:?} {d:?}");
            }
            let e = s.derivative(s.values.map(f64::exp), s.values.map(f64::exp));
            for j in 0..3 {
                let shifted = |h: f64| {
                    let mut y = x;
                    y[j] += h;
                    spectral(&y).map(f64::exp).point()
                };
                let (up, down) = (shifted(1e-6), shifted(-1e-6));
                for i in 0..3 {
                    assert!((e[i][j] - (up[i] - down[i]) / 2e-6).abs() < 1e-6, "{x:?}");
                }
            }
        }
    }
}
