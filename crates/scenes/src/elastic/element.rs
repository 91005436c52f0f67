//! The trilinear hexahedron of eight nodes (H8) with right angles.
//!
//! Local coordinates ξ run from 0 to 1 along each side; node a is the corner whose coordinates are the bits of a. With
//! `N_a = Π_i (ξ_i or 1 − ξ_i)` the 2×2×2 Gauss points integrate stiffness and mass exactly (Hughes1987, chapter 3).

use crate::vec3::{Vec3, dot};

/// A matrix of an element: entry `[3a + i][3b + j]` between component i of node a and j of node b.
pub(super) type Matrix = [[f64; 24]; 24];

/// The values of the shape functions at ξ.
pub(super) fn shapes(xi: Vec3) -> [f64; 8] {
    std::array::from_fn(|a| (0..3).map(|k| factor(a, k, xi[k])).product())
}

/// The gradients of the shape functions at ξ, 1/m.
fn gradients(xi: Vec3, sides: Vec3) -> [Vec3; 8] {
    let slope = |a: usize, k: usize| (if a >> k & 1 == 1 { 1.0 } else { -1.0 }) / sides[k];
    std::array::from_fn(|a| {
        std::array::from_fn(|i| {
            (0..3).map(|k| if k == i { slope(a, k) } else { factor(a, k, xi[k]) }).product()
        })
    })
}

fn factor(a: usize, k: usize, xi: f64) -> f64 {
    if a >> k & 1 == 1 { xi } else { 1.0 - xi }
}

/// `Σ_g (V/8) term(ξ_g)`: symmetric to the last digit where `term` is.
fn integral(sides: Vec3, term: impl Fn(Vec3, &mut dyn FnMut(usize, usize, f64))) -> Matrix {
    let weight = sides.iter().product::<f64>() / 8.0;
    let mut out = [[0.0; 24]; 24];
    let points = [0.5 - 0.5 / 3.0_f64.sqrt(), 0.5 + 0.5 / 3.0_f64.sqrt()];
    for g in 0..8 {
        let xi = [0, 1, 2].map(|k| points[g >> k & 1]);
        term(xi, &mut |row, column, x| out[row][column] += weight * x);
    }
    out
}

/// `∫ λ ∂_iN_a ∂_jN_b + G (∂_jN_a ∂_iN_b + δ_ij ∇N_a·∇N_b)` for Lamé's λ and G (Pa), N/m.
pub(super) fn stiffness(sides: Vec3, lambda: f64, shear: f64) -> Matrix {
    integral(sides, |xi, add| {
        let d = gradients(xi, sides);
        for (row, column) in pairs() {
            let ((a, i), (b, j)) = ((row / 3, row % 3), (column / 3, column % 3));
            let same = if i == j { dot(d[a], d[b]) } else { 0.0 };
            add(row, column, lambda * (d[a][i] * d[b][j]) + shear * (d[a][j] * d[b][i] + same));
        }
    })
}

/// `∫ ρ δ_ij N_a N_b`, kg; `lumped`: its row sums on the diagonal, an eighth of the mass at each node.
pub(super) fn mass(sides: Vec3, density: f64, lumped: bool) -> Matrix {
    let eighth = density * sides.iter().product::<f64>() / 8.0;
    if lumped {
        let entry = |row, column| if row == column { eighth } else { 0.0 };
        return std::array::from_fn(|row| std::array::from_fn(|column| entry(row, column)));
    }
    integral(sides, |xi, add| {
        let n = shapes(xi);
        for (row, column) in pairs().filter(|(row, column)| row % 3 == column % 3) {
            add(row, column, density * (n[row / 3] * n[column / 3]));
        }
    })
}

fn pairs() -> impl Iterator<Item = (usize, usize)> {
    (0..24 * 24).map(|k| (k / 24, k % 24))
}
