//! Derivatives by central differences of fourth order.

use nonsmooth_linalg::{Dense, budget, power_of_two};

/// `out[i][j] = ∂f_i/∂x_j` of f: Rⁿ → Rᵐ at x, `out` being m × n:
///
/// ```text
/// f'(x) = (8 (f(x + δ) − f(x − δ)) − (f(x + 2δ) − f(x − 2δ))) / 12δ + O(δ⁴),     δ = 2⁻¹⁰ max(|x_j|, typical), a power of two.
/// ```
///
/// The error is some 1e-13 of f for functions that change over `typical`, and rounding alone for polynomials of degree four. 4 n values of f are asked for; x is as
/// before afterwards. `work` are three vectors of any length.
pub(super) fn jacobian(
    x: &mut [f64],
    typical: f64,
    work: &mut Vec<f64>,
    out: &mut Dense,
    mut f: impl FnMut(&[f64], &mut [f64]),
) {
    let m = out.nrows();
    work.clear();
    work.resize(m, 0.0);
    for j in 0..x.len() {
        if budget::over() {
            return;
        }
        let at = x[j];
        let step = power_of_two(at.abs().max(typical)) / 1024.0;
        for (shift, weight) in [(1.0, 8.0), (-1.0, -8.0), (2.0, -1.0), (-2.0, 1.0)] {
            x[j] = at + shift * step;
            work.fill(0.0);
            f(x, work);
            for i in 0..m {
                out[(i, j)] += weight * work[i] / (12.0 * step);
            }
        }
        x[j] = at;
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn differences_are_the_derivative_to_1e_12() {
        let mut out = Dense::zeros(2, 3);
        let mut x = [0.3, -1.2, 4.0];
        jacobian(&mut x, 1.0, &mut vec![], &mut out, |x, y| {
            y[0] = x[0].sin() * x[1].cos();
            y[1] = x[2].powi(3) * x[0];
        });
        let (s, c) = (0.3_f64.sin(), 0.3_f64.cos());
        let exact =
            [[c * (-1.2_f64).cos(), -s * (-1.2_f64).sin(), 0.0], [64.0, 0.0, 3.0 * 16.0 * 0.3]];
        for i in 0..2 {
            for j in 0..3 {
                let error = (out[(i, j)] - exact[i][j]).abs();
                assert!(error <= 1e-12 * (1.0 + exact[i][j].abs()), "{i} {j} {error:e}");
            }
        }
        assert_eq!(x, [0.3, -1.2, 4.0]);
    }
}
