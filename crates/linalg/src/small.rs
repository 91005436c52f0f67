//! Kernels on D×D blocks, stored by rows as `[[f64; D]; D]`.

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

/// The inverse by Gauss–Jordan elimination with partial pivoting, or `None` where a pivot vanishes
/// relative to the largest entry of the block.
pub fn inverse<const D: usize>(a: &[[f64; D]; D]) -> Option<[[f64; D]; D]> {
    let mut m = *a;
    let mut inv = [[0.0; D]; D];
    for i in 0..D {
        inv[i][i] = 1.0;
    }
    let largest = a.iter().flatten().fold(0.0_f64, |s, v| s.max(v.abs()));
    for k in 0..D {
        let p = (k..D).max_by(|&i, &j| m[i][k].abs().total_cmp(&m[j][k].abs()))?;
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
        3 => x[1].hypot(x[2]),
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
    fn a_rank_one_block_has_no_inverse() {
        assert!(inverse(&[[1.0, 2.0], [2.0, 4.0]]).is_none());
        assert!(inverse(&[[0.0; 3]; 3]).is_none());
    }
}
