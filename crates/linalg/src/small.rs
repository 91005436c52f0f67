//! Kernels on D×D blocks, stored by rows as `[[f64; D]; D]`.

use crate::Real;

/// `y = A x`.
#[inline(always)]
pub fn mul<const D: usize>(a: &[[f64; D]; D], x: &[f64; D]) -> [f64; D] {
    let mut y = [0.0; D];
    for i in 0..D {
        for j in 0..D {
            y[i] += a[i][j] * x[j];
        }
    }
    y
}

/// The mean of the diagonal, `tr(A)/D`: the unit in which a contact's impulse becomes a velocity.
pub fn mean_diagonal<const D: usize>(a: &[[f64; D]; D]) -> f64 {
    (0..D).map(|i| a[i][i]).sum::<f64>() / D as f64
}

/// The eigenvalues of the symmetric part and, by rows, an orthonormal set of eigenvectors, by Jacobi's rotations (GolubVanLoan, section 8.5). An index without
/// off-diagonal entries keeps its place and its unit vector.
pub fn eigen<const D: usize>(w: &[[f64; D]; D]) -> ([f64; D], [[f64; D]; D]) {
    let (mut a, mut v) = (*w, [[0.0; D]; D]);
    for i in 0..D {
        v[i][i] = 1.0;
        for j in 0..D {
            a[i][j] = 0.5 * (w[i][j] + w[j][i]);
        }
    }
    for _ in 0..12 {
        let mut turned = false;
        for i in 0..D {
            for j in i + 1..D {
                let (p, q, off) = (a[i][i], a[j][j], a[i][j]);
                if off.abs() <= f64::EPSILON * (p * q).abs().sqrt() {
                    continue;
                }
                turned = true;
                // The smaller of the two angles: small entries of a graded matrix keep their digits.
                let theta = (q - p) / (2.0 * off);
                let t = theta.signum() / (theta.abs() + Real::hypot(theta, 1.0));
                let c = 1.0 / Real::hypot(t, 1.0);
                let s = t * c;
                for k in 0..D {
                    let (x, y) = (a[i][k], a[j][k]);
                    (a[i][k], a[j][k]) = (c * x - s * y, s * x + c * y);
                    let (x, y) = (v[i][k], v[j][k]);
                    (v[i][k], v[j][k]) = (c * x - s * y, s * x + c * y);
                }
                for k in 0..D {
                    let (x, y) = (a[k][i], a[k][j]);
                    (a[k][i], a[k][j]) = (c * x - s * y, s * x + c * y);
                }
                (a[i][j], a[j][i]) = (0.0, 0.0);
                (a[i][i], a[j][j]) = (p - t * off, q + t * off);
            }
        }
        if !turned {
            break;
        }
    }
    (std::array::from_fn(|k| a[k][k]), v)
}

/// The determinant, by elimination with partial pivoting.
pub fn determinant<const D: usize>(a: &[[f64; D]; D]) -> f64 {
    let mut m = *a;
    let mut product = 1.0;
    for k in 0..D {
        let p = (k..D).fold(k, |p, i| if m[i][k].abs() > m[p][k].abs() { i } else { p });
        if p != k {
            m.swap(k, p);
            product = -product;
        }
        product *= m[k][k];
        if product == 0.0 {
            return 0.0;
        }
        for i in k + 1..D {
            let f = m[i][k] / m[k][k];
            for j in k..D {
                m[i][j] -= f * m[k][j];
            }
        }
    }
    product
}

/// The inverse by Gauss–Jordan elimination with partial pivoting, or `None` where a pivot vanishes
/// relative to the largest entry of the block.
pub fn inverse<const D: usize>(a: &[[f64; D]; D]) -> Option<[[f64; D]; D]> {
    let largest = a.iter().flatten().fold(0.0_f64, |s, v| s.max(v.abs()));
    in_place(a, largest).or_else(|| with_exchanges(a, largest))
}

/// The inverse where no rows are to be exchanged, as of most blocks of contacts, to the same bits.
#[inline(always)]
fn in_place<const D: usize>(a: &[[f64; D]; D], largest: f64) -> Option<[[f64; D]; D]> {
    let mut m = *a;
    for k in 0..D {
        let pivot = m[k][k];
        let is_largest = (k + 1..D).all(|i| m[i][k].abs() < pivot.abs());
        if !(is_largest && pivot.abs() > 1e-14 * largest && pivot.is_finite()) {
            return None;
        }
        let d = 1.0 / pivot;
        m[k][k] = 1.0;
        m[k] = m[k].map(|x| x * d);
        for i in (0..D).filter(|&i| i != k) {
            let f = m[i][k];
            m[i][k] = 0.0;
            for j in 0..D {
                m[i][j] -= f * m[k][j];
            }
        }
    }
    Some(m)
}

fn with_exchanges<const D: usize>(a: &[[f64; D]; D], largest: f64) -> Option<[[f64; D]; D]> {
    let mut m = *a;
    let mut inv = [[0.0; D]; D];
    for i in 0..D {
        inv[i][i] = 1.0;
    }
    for k in 0..D {
        let p = (k + 1..D).fold(k, |p, i| if m[i][k].abs() >= m[p][k].abs() { i } else { p });
        if m[p][k].abs() <= 1e-14 * largest || !m[p][k].is_finite() {
            return None;
        }
        m.swap(k, p);
        inv.swap(k, p);
        let d = 1.0 / m[k][k];
        for j in 0..D {
            m[k][j] *= d;
            inv[k][j] *= d;
        }
        for i in 0..D {
            if i != k {
                let f = m[i][k];
                for j in 0..D {
                    m[i][j] -= f * m[k][j];
                    inv[i][j] -= f * inv[k][j];
                }
            }
        }
    }
    Some(inv)
}

/// The solution of `A x = b` by elimination with partial pivoting, or `None` where a pivot vanishes relative to the largest entry of the block, as of [`inverse`]. A third of its cost.
#[inline(always)]
pub fn solve<const D: usize>(a: &[[f64; D]; D], b: &[f64; D]) -> Option<[f64; D]> {
    let (mut m, mut x) = (*a, *b);
    let largest = a.iter().flatten().fold(0.0_f64, |s, v| s.max(v.abs()));
    for k in 0..D {
        let p = (k + 1..D).fold(k, |p, i| if m[i][k].abs() > m[p][k].abs() { i } else { p });
        // NaN too.
        if !(m[p][k].abs() > 1e-14 * largest && m[p][k].is_finite()) {
            return None;
        }
        m.swap(k, p);
        x.swap(k, p);
        let d = 1.0 / m[k][k];
        for i in k + 1..D {
            let f = m[i][k] * d;
            for j in k + 1..D {
                m[i][j] -= f * m[k][j];
            }
            x[i] -= f * x[k];
        }
        // The diagonal keeps its inverse.
        m[k][k] = d;
    }
    for k in (0..D).rev() {
        for j in k + 1..D {
            x[k] -= m[k][j] * x[j];
        }
        x[k] *= m[k][k];
    }
    Some(x)
}

/// The D consecutive entries of contact `c` in a stacked vector.
#[inline(always)]
pub fn block<const D: usize>(x: &[f64], c: usize) -> [f64; D] {
    let mut b = [0.0; D];
    b.copy_from_slice(&x[D * c..D * c + D]);
    b
}

/// The Euclidean norm of the tangential part `[x_1, …]` of a contact vector `[x_N, x_T…]`.
#[inline(always)]
pub fn tangential_norm<const D: usize>(x: &[f64; D]) -> f64 {
    match D {
        2 => x[1].abs(),
        3 => Real::hypot(x[1], x[2]),
        _ => x[1..].iter().map(|v| v * v).sum::<f64>().sqrt(),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn inverse_times_block_is_identity() {
        let a = [[0.0, 2.0, 1.0], [1.0, -3.0, 0.5], [4.0, 0.1, 2.0]];
        let b = inverse(&a).expect("invertible");
        for i in 0..3 {
            let column = mul(&a, &[b[0][i], b[1][i], b[2][i]]);
            for j in 0..3 {
                assert!((column[j] - f64::from(u8::from(i == j))).abs() < 1e-14);
            }
        }
    }

    #[test]
    fn without_exchanges_the_inverse_has_the_same_bits() {
        let (mut state, mut taken) = (1_u64, 0);
        let mut draw = || {
            state = state.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1);
            (state >> 40) as f64 / (1 << 23) as f64 - 1.0
        };
        for _ in 0..200 {
            let mut a: [[f64; 3]; 3] = std::array::from_fn(|_| std::array::from_fn(|_| draw()));
            (0..3).for_each(|k| a[k][k] += 0.7);
            if let Some(inverse) = in_place(&a, 2.0) {
                assert_eq!(Some(inverse), with_exchanges(&a, 2.0));
                taken += 1;
            }
        }
        assert!((50..200).contains(&taken), "{taken}");
    }

    #[test]
    fn a_solution_is_that_of_the_inverse() {
        let a = [[0.0, 2.0, 1.0], [1.0, -3.0, 0.5], [4.0, 0.1, 2.0]];
        let b = [1.0, -2.0, 0.5];
        let x = solve(&a, &b).expect("invertible");
        let y = mul(&inverse(&a).expect("invertible"), &b);
        assert!(x.iter().zip(&y).all(|(x, y)| (x - y).abs() < 1e-14), "{x:?} {y:?}");
        assert!(solve(&[[1.0, 2.0], [2.0, 4.0]], &[1.0, 0.0]).is_none());
        assert!(solve(&[[f64::NAN; 2]; 2], &[1.0, 0.0]).is_none());
    }

    #[test]
    fn determinants_are_those_of_the_rule_of_sarrus() {
        let a = [[0.0, 2.0, 1.0], [1.0, -3.0, 0.5], [4.0, 0.1, 2.0]];
        let triple = |i: usize, j: usize, k: usize| a[0][i] * a[1][j] * a[2][k];
        let even = triple(0, 1, 2) + triple(1, 2, 0) + triple(2, 0, 1);
        let odd = triple(2, 1, 0) + triple(1, 0, 2) + triple(0, 2, 1);
        assert!((determinant(&a) - (even - odd)).abs() < 1e-14);
        assert_eq!(determinant(&[[1.0, 2.0], [2.0, 4.0]]), 0.0);
        assert_eq!(determinant(&[[0.0, 1.0], [1.0, 0.0]]), -1.0);
        assert_eq!(determinant::<0>(&[]), 1.0);
    }

    #[test]
    fn a_rank_one_block_has_no_inverse() {
        assert!(inverse(&[[1.0, 2.0], [2.0, 4.0]]).is_none());
        assert!(inverse(&[[0.0; 3]; 3]).is_none());
    }

    #[test]
    fn eigenvectors_diagonalise() {
        let mut w = [[0.0; 5]; 5];
        for (i, row) in w.iter_mut().enumerate() {
            for (j, x) in row.iter_mut().enumerate() {
                *x = ((i * j) as f64).cos() * 10f64.powi(-(i as i32) - (j as i32));
            }
        }
        (0..5).for_each(|i| w[i][i] += 6.0 * 10f64.powi(-2 * (i as i32)));
        let (values, v) = eigen(&w);
        for i in 0..5 {
            let image = mul(&w, &v[i]);
            for k in 0..5 {
                assert!((image[k] - values[i] * v[i][k]).abs() < 1e-15, "{i} {k}");
            }
            for j in 0..5 {
                let dot: f64 = (0..5).map(|k| v[i][k] * v[j][k]).sum();
                assert!((dot - f64::from(u8::from(i == j))).abs() < 1e-14);
            }
            assert!(values[i] > 0.0);
        }
        let known = [[2.0, 1.0, 0.0], [1.0, 2.0, 0.0], [0.0, 0.0, 0.5]];
        let (values, v) = eigen(&known);
        assert!((values[0] + values[1] - 4.0).abs() < 1e-15 && values[2] == 0.5);
        assert_eq!(v[2], [0.0, 0.0, 1.0]);
    }
}
