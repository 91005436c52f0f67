//! The hot kernel of block Gauss–Seidel: `Σ_k B_k x_{j_k}` over the blocks of one row.
//!
//! With AVX2 and FMA (found at run time) a 3×3 block costs four loads and three multiply–adds: its rows are loaded as four
//! lanes, the fourth of which gathers garbage that is dropped at the end. Two accumulators a row hide the latency. Results differ from the
//! plain kernel's by rounding only; on one machine they are always the same bits.

use super::small;

/// `Σ_k B_k x_{j_k}`; every column index is below `x.len() / D`.
#[inline(always)]
pub(super) fn times<const D: usize>(cols: &[u32], blocks: &[[[f64; D]; D]], x: &[f64]) -> [f64; D] {
    #[cfg(target_arch = "x86_64")]
    if std::arch::is_x86_feature_detected!("avx2") && std::arch::is_x86_feature_detected!("fma") {
        // SAFETY: the features were just found, and a block matrix keeps its column indices below its
        // number of block columns, which its products compare with the length of x.
        unsafe {
            if D == 3 {
                return cast(avx2::times3(cols, blocks.as_ptr().cast(), x));
            }
            if D == 2 {
                return cast(avx2::times2(cols, blocks.as_ptr().cast(), x));
            }
        }
    }
    plain(cols, blocks, x)
}

#[inline(always)]
fn plain<const D: usize>(cols: &[u32], blocks: &[[[f64; D]; D]], x: &[f64]) -> [f64; D] {
    let mut sum = [0.0; D];
    for (&j, b) in cols.iter().zip(blocks) {
        let y = small::mul(b, &small::block(x, j as usize));
        for k in 0..D {
            sum[k] += y[k];
        }
    }
    sum
}

/// The same array under another name for its length.
#[cfg(target_arch = "x86_64")]
#[inline(always)]
fn cast<const A: usize, const D: usize>(x: [f64; A]) -> [f64; D] {
    std::array::from_fn(|k| x[k])
}

#[cfg(target_arch = "x86_64")]
mod avx2 {
    use std::arch::x86_64::*;

    /// SAFETY: `blocks` points to `cols.len()` blocks; every index j has `3 j + 3 <= x.len()`; AVX2 and FMA exist.
    #[target_feature(enable = "avx2,fma")]
    pub(super) unsafe fn times3(cols: &[u32], blocks: *const [f64; 9], x: &[f64]) -> [f64; 3] {
        let first_three = _mm256_set_epi64x(0, -1, -1, -1);
        let mut sum = [[_mm256_setzero_pd(); 3]; 2];
        let add = |sum: &mut [__m256d; 3], k: usize| {
            // SAFETY: lanes 0 to 3 of rows 0 and 1 lie inside the block; row 2 and x are masked to theirs.
            unsafe {
                let b = blocks.add(k).cast::<f64>();
                let j = *cols.get_unchecked(k) as usize;
                let xj = _mm256_maskload_pd(x.as_ptr().add(3 * j), first_three);
                sum[0] = _mm256_fmadd_pd(_mm256_loadu_pd(b), xj, sum[0]);
                sum[1] = _mm256_fmadd_pd(_mm256_loadu_pd(b.add(3)), xj, sum[1]);
                sum[2] = _mm256_fmadd_pd(_mm256_maskload_pd(b.add(6), first_three), xj, sum[2]);
            }
        };
        let pairs = cols.len() / 2;
        for p in 0..pairs {
            add(&mut sum[0], 2 * p);
            add(&mut sum[1], 2 * p + 1);
        }
        if cols.len() % 2 == 1 {
            add(&mut sum[0], cols.len() - 1);
        }
        let [even, odd] = sum;
        [0, 1, 2].map(|i| {
            let s = _mm256_add_pd(even[i], odd[i]);
            let low = _mm256_castpd256_pd128(s);
            let pair = _mm_add_sd(low, _mm_unpackhi_pd(low, low));
            _mm_cvtsd_f64(_mm_add_sd(pair, _mm256_extractf128_pd::<1>(s)))
        })
    }

    /// SAFETY: `blocks` points to `cols.len()` blocks; every index j has `2 j + 2 <= x.len()`; AVX2 and FMA exist.
    #[target_feature(enable = "avx2,fma")]
    pub(super) unsafe fn times2(cols: &[u32], blocks: *const [f64; 4], x: &[f64]) -> [f64; 2] {
        let mut sum = [_mm256_setzero_pd(); 2];
        for (k, &j) in cols.iter().enumerate() {
            // SAFETY: a block is four lanes, x_j two, repeated for the two rows.
            unsafe {
                let b = _mm256_loadu_pd(blocks.add(k).cast::<f64>());
                let xj = _mm256_broadcast_pd(&*x.as_ptr().add(2 * j as usize).cast::<__m128d>());
                sum[k % 2] = _mm256_fmadd_pd(b, xj, sum[k % 2]);
            }
        }
        let s = _mm256_add_pd(sum[0], sum[1]);
        let rows = [_mm256_castpd256_pd128(s), _mm256_extractf128_pd::<1>(s)];
        rows.map(|row| _mm_cvtsd_f64(_mm_add_sd(row, _mm_unpackhi_pd(row, row))))
    }
}

/// Asks for the line of the cache at an address.
#[inline(always)]
pub(crate) fn prefetch<T>(x: *const T) {
    #[cfg(target_arch = "x86_64")]
    // SAFETY: a prefetch changes nothing that a program can see, and faults at no address.
    unsafe {
        use std::arch::x86_64::{_MM_HINT_T0, _mm_prefetch};
        _mm_prefetch::<_MM_HINT_T0>(x.cast());
    }
    #[cfg(not(target_arch = "x86_64"))]
    let _ = x;
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_fast_kernel_agrees_with_the_plain_one() {
        fn agrees<const D: usize>() {
            for n in 0..9_usize {
                let cols: Vec<u32> = (0..n as u32).map(|k| (k * 5) % 7).collect();
                let blocks: Vec<[[f64; D]; D]> = (0..n)
                    .map(|b| {
                        std::array::from_fn(|k| {
                            std::array::from_fn(|l| ((b * 9 + k * 3 + l) as f64).sin())
                        })
                    })
                    .collect();
                // Exactly as long as the largest index asks for: a kernel that reads beyond shows under a sanitizer.
                let x: Vec<f64> = (0..7 * D).map(|i| (i as f64 * 0.7).cos()).collect();
                let (fast, slow) = (times(&cols, &blocks, &x), plain(&cols, &blocks, &x));
                assert!((0..D).all(|k| (fast[k] - slow[k]).abs() < 1e-14), "{fast:?} {slow:?}");
            }
        }
        agrees::<2>();
        agrees::<3>();
    }
}
