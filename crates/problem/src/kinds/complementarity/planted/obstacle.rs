//! Obstacle problems on grids: large sparse symmetric complementarity problems whose optimal energies are published.
//!
//! All minimise an energy `φ(z) = ½ zᵀ M z + qᵀ z` ([`energy`]) between bounds, M being a 5-point matrix of order `nx·ny` over the interior points of a rectangle:
//! symmetric, positive definite, an M-matrix. The point `(i, j)`, at `x = (i + 1) h_x`, `y = (j + 1) h_y`, has the index `i + nx·j`.
//!
//! | maker | problem | reference |
//! | --- | --- | --- |
//! | [`Membrane`] | a membrane between obstacles | MoreToraldo1991 |
//! | [`Torsion`] | elastic-plastic torsion of a square bar | MoreToraldo1991 |
//! | [`JournalBearing`] | pressure in a journal bearing | MoreToraldo1991 |

use std::f64::consts::TAU;
use std::sync::Arc;

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use crate::planted::{Recipe, finite, size};
use crate::{BoxLcp, Lcp};
use nonsmooth_linalg::{Csc, Matrix, Operator};

/// `φ(z) = ½ zᵀ M z + qᵀ z`. LCP(M, q) with symmetric M are the conditions of its minimum on `z ≥ 0`.
#[allow(non_snake_case)]
pub fn energy(M: &Matrix, q: &[f64], z: &[f64]) -> f64 {
    let mut product = vec![0.0; q.len()];
    M.mul(z, &mut product);
    z.iter().zip(&product).zip(q).map(|((z, mz), q)| z * (0.5 * mz + q)).sum()
}

/// A membrane on a rectangle, held at zero along its rim and pulled up by a uniform load: `φ(u) = ½ ∫ |∇u|² − load ∫ u` by finite differences.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Membrane {
    /// Interior points along x, at least 1.
    pub nx: usize,
    /// Interior points along y, at least 1.
    pub ny: usize,
    /// Extent along x.
    pub width: f64,
    /// Extent along y.
    pub height: f64,
    /// The load, a force per area.
    pub load: f64,
    /// The weight of the differences across the rim; 1 for the discretisation of the energy above. MoreToraldo1991's problems, as CUTEst states them, count these
    /// differences from the inside only: 0.5.
    pub rim: f64,
}

impl Default for Membrane {
    /// The unit square, 20 × 20 points.
    fn default() -> Self {
        Self { nx: 20, ny: 20, width: 1.0, height: 1.0, load: 1.0, rim: 1.0 }
    }
}

impl Membrane {
    /// The unit square with n × n interior points.
    pub fn square(n: usize) -> Self {
        Self { nx: n, ny: n, ..Self::default() }
    }

    /// `h_x` and `h_y`.
    pub fn spacing(&self) -> (f64, f64) {
        (self.width / (self.nx + 1) as f64, self.height / (self.ny + 1) as f64)
    }

    /// The stiffness of a difference along x and along y.
    fn stiffnesses(&self) -> (f64, f64) {
        let (hx, hy) = self.spacing();
        (hy / hx, hx / hy)
    }

    /// M.
    pub fn stiffness(&self) -> Csc {
        let (kx, ky) = self.stiffnesses();
        let across = |place: usize, n: usize| if place == 0 || place == n { self.rim } else { 1.0 };
        five_points(self.nx, self.ny, &|i, _| kx * across(i, self.nx), &|_, j| {
            ky * across(j, self.ny)
        })
    }

    /// M, known by its products only: nothing is stored.
    pub fn operator(&self) -> Matrix {
        Matrix::Operator(Arc::new(*self))
    }

    /// q.
    pub fn forces(&self) -> Vec<f64> {
        let (hx, hy) = self.spacing();
        vec![-self.load * hx * hy; self.nx * self.ny]
    }

    /// The values of `f(x, y)` at the interior points.
    pub fn sample(&self, f: impl Fn(f64, f64) -> f64) -> Vec<f64> {
        let (hx, hy) = self.spacing();
        let at = |k: usize| f((k % self.nx + 1) as f64 * hx, (k / self.nx + 1) as f64 * hy);
        (0..self.nx * self.ny).map(at).collect()
    }

    /// The membrane above an obstacle: an LCP in the gap `z = u − ψ`.
    pub fn above(&self, obstacle: impl Fn(f64, f64) -> f64) -> Lcp {
        self.above_with(Matrix::from(self.stiffness()), obstacle)
    }

    /// As [`above`](Self::above), with M as an operator.
    pub fn above_by_products(&self, obstacle: impl Fn(f64, f64) -> f64) -> Lcp {
        self.above_with(self.operator(), obstacle)
    }

    #[allow(non_snake_case)]
    fn above_with(&self, M: Matrix, obstacle: impl Fn(f64, f64) -> f64) -> Lcp {
        let mut q = vec![0.0; self.nx * self.ny];
        M.mul(&self.sample(obstacle), &mut q);
        q.iter_mut().zip(self.forces()).for_each(|(q, f)| *q += f);
        Lcp { M, q }
    }

    /// The membrane between two obstacles, `lower ≤ upper`: a box LCP in u.
    pub fn between(
        &self,
        lower: impl Fn(f64, f64) -> f64,
        upper: impl Fn(f64, f64) -> f64,
    ) -> BoxLcp {
        BoxLcp {
            M: self.stiffness().into(),
            q: self.forces(),
            lower: self.sample(lower),
            upper: self.sample(upper),
        }
    }
}

impl Operator for Membrane {
    fn nrows(&self) -> usize {
        self.nx * self.ny
    }

    fn ncols(&self) -> usize {
        self.nx * self.ny
    }

    fn mul(&self, x: &[f64], y: &mut [f64]) {
        let (kx, ky) = self.stiffnesses();
        let n = self.nx;
        let rim = |place: usize, n: usize| {
            f64::from(u8::from(place == 0)) + f64::from(u8::from(place + 1 == n))
        };
        let lines = x.len() / n;
        for j in 0..lines {
            let x_here = &x[n * j..n * (j + 1)];
            let y_here = &mut y[n * j..n * (j + 1)];
            let inner = 2.0 * (kx + ky) - (1.0 - self.rim) * ky * rim(j, lines);
            y_here.iter_mut().zip(x_here).for_each(|(y, x)| *y = inner * x);
            for i in [0, n - 1].iter().take(if n > 1 { 2 } else { 1 }) {
                y_here[*i] -= (1.0 - self.rim) * kx * rim(*i, n) * x_here[*i];
            }
            y_here[1..].iter_mut().zip(x_here).for_each(|(y, x)| *y -= kx * x);
            y_here.iter_mut().zip(&x_here[1..]).for_each(|(y, x)| *y -= kx * x);
            if j > 0 {
                let below = &x[n * (j - 1)..n * j];
                y_here.iter_mut().zip(below).for_each(|(y, x)| *y -= ky * x);
            }
            if j + 1 < lines {
                let above = &x[n * (j + 1)..];
                y_here.iter_mut().zip(above).for_each(|(y, x)| *y -= ky * x);
            }
        }
    }

    fn mul_transpose(&self, x: &[f64], y: &mut [f64]) {
        self.mul(x, y);
    }

    fn diagonal(&self) -> Option<Vec<f64>> {
        let (kx, ky) = self.stiffnesses();
        let ends = |place: usize, n: usize| {
            let rim = |there: bool| if there { self.rim } else { 1.0 };
            rim(place == 0) + rim(place + 1 == n)
        };
        let each = |k: usize| kx * ends(k % self.nx, self.nx) + ky * ends(k / self.nx, self.ny);
        Some((0..self.nx * self.ny).map(each).collect())
    }
}

/// The most points of a grid along a side.
const SIDE: usize = 10_000;

/// A membrane on the unit square above the obstacle `sin(3.2 x) sin(3.3 y)`.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields, default)]
pub struct Obstacle {
    /// Interior points along each side: n^2 variables.
    pub n: usize,
    /// The load that pulls the membrane up, a force per area; negative loads press it down.
    pub load: f64,
}

impl Default for Obstacle {
    fn default() -> Self {
        Self { n: 20, load: 1.0 }
    }
}

impl Obstacle {
    /// As an LCP in the gap.
    pub fn lcp(&self) -> Lcp {
        let membrane = Membrane { load: self.load, ..Membrane::square(self.n) };
        membrane.above(|x, y| (3.2 * x).sin() * (3.3 * y).sin())
    }
}

impl Recipe for Obstacle {
    fn validate(&self) -> Result<(), String> {
        size("n", self.n, 1..=SIDE)?;
        finite("load", self.load)
    }
}

/// Elastic-plastic torsion of a bar of square section, side 1: `−Δu = load` where `|u|` is less than the distance to the rim, which it does not exceed.
///
/// CUTEst's TORSION1 with parameter Q is `n = 2Q − 2`, with its weight of the rim.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields, default)]
pub struct Torsion {
    /// Interior points along each side: n^2 variables.
    pub n: usize,
    /// The angle of twist, as a load.
    pub load: f64,
}

impl Default for Torsion {
    fn default() -> Self {
        Self { n: 20, load: 5.0 }
    }
}

impl Torsion {
    /// As a box LCP.
    pub fn boxed(&self) -> BoxLcp {
        let distance = |x: f64, y: f64| x.min(1.0 - x).min(y).min(1.0 - y);
        let membrane = Membrane { load: self.load, rim: 0.5, ..Membrane::square(self.n) };
        membrane.between(|x, y| -distance(x, y), distance)
    }
}

impl Recipe for Torsion {
    fn validate(&self) -> Result<(), String> {
        size("n", self.n, 1..=SIDE)?;
        finite("load", self.load)
    }
}

/// The pressure in the lubricant of a journal bearing, which cavitates rather than becoming negative: the LCP of
/// `min ½ ∫ ω |∇v|² − ε ∫ sin(ξ) v` over `v ≥ 0` on `(0, 2π) × (0, 2b)`, `v = 0` on the rim, `ω = (1 + ε cos ξ)³`, of eccentricity ε and half width b, by linear finite elements on right triangles.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields, default)]
pub struct JournalBearing {
    /// Interior points along the circumference.
    pub nx: usize,
    /// Interior points along the axis.
    pub ny: usize,
    /// The eccentricity, between 0 and 1.
    pub eccentricity: f64,
    /// Half of the axial extent, positive.
    pub half_width: f64,
}

impl Default for JournalBearing {
    /// The one whose optima are published: ε = 0.1, b = 10.
    fn default() -> Self {
        Self { nx: 50, ny: 50, eccentricity: 0.1, half_width: 10.0 }
    }
}

impl Recipe for JournalBearing {
    fn validate(&self) -> Result<(), String> {
        size("nx", self.nx, 1..=SIDE)?;
        size("ny", self.ny, 1..=SIDE)?;
        let Self { eccentricity, half_width, .. } = *self;
        if !(eccentricity > 0.0 && eccentricity < 1.0) {
            return Err(format!("eccentricity: expected a number in (0, 1), found {eccentricity}"));
        }
        match half_width > 0.0 && half_width.is_finite() {
            true => Ok(()),
            false => Err(format!("half_width: expected a positive number, found {half_width}")),
        }
    }
}

impl JournalBearing {
    /// As an LCP.
    pub fn lcp(&self) -> Lcp {
        let (hx, hy) = (TAU / (self.nx + 1) as f64, 2.0 * self.half_width / (self.ny + 1) as f64);
        let film = |i: usize| (1.0 + self.eccentricity * (i as f64 * hx).cos()).powi(3); // ω(ξ_i), 0 ≤ i ≤ nx + 1
        // The two triangles at a difference weigh a third of ω at each of their corners.
        let kx = |i: usize, _| 0.5 * hy / hx * (film(i) + film(i + 1));
        let ky = |i: usize, _| hx / hy / 6.0 * (film(i) + 4.0 * film(i + 1) + film(i + 2));
        let q = |k: usize| -hx * hy * self.eccentricity * ((k % self.nx + 1) as f64 * hx).sin();
        Lcp {
            M: five_points(self.nx, self.ny, &kx, &ky).into(),
            q: (0..self.nx * self.ny).map(q).collect(),
        }
    }
}

/// The matrix of `½ Σ k (difference)²`: `kx(i, j)` belongs to the difference on the left of point `(i, j)`, `0 ≤ i ≤ nx`, `ky(i, j)` to that below it, `0 ≤ j ≤ ny`.
fn five_points(
    nx: usize,
    ny: usize,
    kx: &dyn Fn(usize, usize) -> f64,
    ky: &dyn Fn(usize, usize) -> f64,
) -> Csc {
    let entries = (0..nx * ny).flat_map(|k| {
        let (i, j) = (k % nx, k / nx);
        let (left, right) = (kx(i, j), kx(i + 1, j));
        let (below, above) = (ky(i, j), ky(i, j + 1));
        [
            (j > 0).then(|| (k, k - nx, -below)),
            (i > 0).then(|| (k, k - 1, -left)),
            Some((k, k, left + right + below + above)),
            (i + 1 < nx).then(|| (k, k + 1, -right)),
            (j + 1 < ny).then(|| (k, k + nx, -above)),
        ]
        .into_iter()
        .flatten()
    });
    Csc::from_triplets(nx * ny, nx * ny, entries).expect("in range")
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_operator_is_the_matrix() {
        for (nx, ny, rim) in [(1, 1, 0.5), (1, 4, 0.5), (5, 1, 1.0), (2, 3, 0.5), (7, 4, 1.0)] {
            let membrane = Membrane { nx, ny, rim, width: 2.0, height: 0.7, ..Membrane::default() };
            let matrix = Matrix::from(membrane.stiffness());
            let x: Vec<f64> = (0..nx * ny).map(|k| (k as f64 * 0.9).sin() + 0.2).collect();
            let (mut a, mut b) = (vec![0.0; nx * ny], vec![0.0; nx * ny]);
            matrix.mul(&x, &mut a);
            membrane.mul(&x, &mut b);
            for (a, b) in a.iter().zip(&b) {
                assert!((a - b).abs() <= 1e-13 * (1.0 + a.abs()), "{nx} {ny} {rim}: {a} {b}");
            }
            for (a, b) in matrix.diagonal().unwrap().iter().zip(membrane.diagonal().unwrap()) {
                assert!((a - b).abs() <= 1e-14 * a, "{nx} {ny} {rim}: {a} {b}");
            }
        }
    }

    #[test]
    fn the_problems_are_valid_and_symmetric() {
        let bearing = JournalBearing { nx: 6, ny: 9, ..JournalBearing::default() }.lcp();
        bearing.validate().unwrap();
        assert_eq!(bearing.M.asymmetry(), Some(0.0));
        let bar = Torsion { n: 8, load: 5.0 }.boxed();
        bar.validate().unwrap();
        assert_eq!(bar.M.asymmetry(), Some(0.0));
        // One point, summed over its triangles by hand.
        let one = JournalBearing { nx: 1, ny: 1, eccentricity: 0.5, half_width: 1.0 }.lcp();
        let (hx, hy) = (std::f64::consts::PI, 1.0);
        // ω at ξ = 0, π, 2π: 1.5³, 0.5³, 1.5³.
        let (rim, mid) = (3.375, 0.125);
        let by_hand = hy / hx * (rim + mid) + hx / hy / 3.0 * (2.0 * rim + 4.0 * mid);
        assert!((one.M.diagonal().unwrap()[0] - by_hand).abs() < 1e-13);
    }
}
