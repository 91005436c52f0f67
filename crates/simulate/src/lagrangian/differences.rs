//! Derivatives by central differences of fourth order.

use nonsmooth_linalg::{Dense, budget, power_of_two};

/// Of `f(x + shift δ)`, which of them make 12 δ f'(x), and how.
const STENCIL: [(f64, f64); 4] = [(1.0, 8.0), (-1.0, -8.0), (2.0, -1.0), (-2.0, 1.0)];

/// `∂f/∂t` of f: R → Rᵐ into `out` by the same formula with `δ = 2⁻⁷ span` rounded to a power of two, so that times are exact. The error is `(ωδ)⁴/30` of the rate of what
/// turns with ω, 1e-10 for ω = 1/span, and some `1e-14 |f| / span` by rounding.
pub(super) fn rate(t: f64, span: f64, out: &mut [f64], mut f: impl FnMut(f64, &mut [f64])) {
    let step = power_of_two(span) / 128.0;
    let mut values = vec![0.0; out.len()];
    out.fill(0.0);
    for (shift, weight) in STENCIL {
        values.fill(0.0);
        f(t + shift * step, &mut values);
        out.iter_mut().zip(&values).for_each(|(o, f)| *o += weight * f / (12.0 * step));
    }
}

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
        for (shift, weight) in STENCIL {
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
