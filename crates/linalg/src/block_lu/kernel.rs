//! Dense kernels of the fronts, on column-major storage: `C −= A B`, a narrow pivoted panel, `X U⁻¹`, `y −= A x`.
//!
//! Each exists for AVX-512, for AVX2 with FMA and in plain loops; which one runs is found out at run time. A product holds up to
//! three vectors by eight (AVX2: four) columns of C in registers while it walks along K, over rows of A that it has packed
//! where enough columns of B share them. Results of the three differ by rounding only; on one machine they are always the same bits.

/// Widest panel that is factorised column by column; the diagonal blocks whose inverses are kept have this size.
pub(super) const WIDTH: usize = 8;

/// Pivots below this, where rows and columns are scaled to a largest entry of one to two, are replaced ...
const TINY: f64 = 1.8e-12; // ε^(3/4)
/// ... by this: the growth that follows leaves half of the digits to refinement.
const SUBSTITUTE: f64 = 1.5e-8; // ε^(1/2)

/// The instructions that the kernels use; one exists only where this machine has them.
#[derive(Debug, Clone, Copy)]
pub(super) struct Simd(Level);

#[derive(Debug, Clone, Copy)]
enum Level {
    #[cfg(target_arch = "x86_64")]
    Avx512,
    #[cfg(target_arch = "x86_64")]
    Avx2,
    Plain,
}

impl Simd {
    /// All that this machine has, the best first.
    pub(super) fn all() -> impl Iterator<Item = Self> {
        let mut found = [None, None, Some(Self(Level::Plain))];
        #[cfg(target_arch = "x86_64")]
        {
            let avx2 = is_x86_feature_detected!("avx2") && is_x86_feature_detected!("fma");
            let avx512 = avx2 && is_x86_feature_detected!("avx512f");
            found[0] = avx512.then_some(Self(Level::Avx512));
            found[1] = avx2.then_some(Self(Level::Avx2));
        }
        found.into_iter().flatten()
    }

    /// The best that this machine has.
    pub(super) fn best() -> Self {
        Self::all().next().unwrap_or(Self(Level::Plain))
    }
}

/// The part of a column-major array that starts at `at`, columns `ld` apart.
#[derive(Debug, Clone, Copy)]
pub(super) struct At {
    pub at: usize,
    pub ld: usize,
}

impl At {
    /// The entries that a part of `rows × columns` spans, from the first entry of the array on.
    fn end(self, rows: usize, columns: usize) -> usize {
        if rows == 0 || columns == 0 { 0 } else { self.at + (columns - 1) * self.ld + rows }
    }
}

/// What came of the pivots of a panel.
#[derive(Debug, Clone, Copy, Default)]
pub(super) struct Pivots {
    pub perturbed: usize,
    pub broken: bool,
    /// Whether their determinant is negative.
    pub negative: bool,
}

impl Pivots {
    /// Those of other fronts, too.
    pub(super) fn add(&mut self, other: Self) {
        self.perturbed += other.perturbed;
        self.broken |= other.broken;
        self.negative ^= other.negative;
    }
}

/// A usable pivot in place of `pivot`.
#[inline(always)]
fn mended(pivot: f64, outcome: &mut Pivots) -> f64 {
    if pivot.abs() >= TINY {
        outcome.broken |= !pivot.is_finite();
        return pivot;
    }
    outcome.broken |= pivot.is_nan();
    outcome.perturbed += 1;
    SUBSTITUTE.copysign(pivot)
}

/// `C −= A B` (`C = −A B` if `set`) with A m×k, B k×n.
pub(super) fn product(
    simd: Simd,
    (m, n, k): (usize, usize, usize),
    (a, pa): (&[f64], At),
    (b, pb): (&[f64], At),
    (c, pc): (&mut [f64], At),
    set: bool,
) {
    assert!(pa.end(m, k) <= a.len() && pb.end(k, n) <= b.len() && pc.end(m, n) <= c.len());
    let b = b.as_ptr().wrapping_add(pb.at);
    // SAFETY: the three parts lie inside their slices, as was just asserted, and `c` overlaps none.
    unsafe { product_at(simd, (m, n, k), (a, pa), (b, pb.ld), (c, pc), set) }
}

/// [`product`] with B and C in the same columns of one array, in different rows.
pub(super) fn product_below(
    simd: Simd,
    (m, n, k): (usize, usize, usize),
    (a, pa): (&[f64], At),
    (bc, pb, pc): (&mut [f64], At, At),
) {
    assert!(pa.end(m, k) <= a.len() && pb.end(k, n) <= bc.len() && pc.end(m, n) <= bc.len());
    assert!(pb.ld == pc.ld && pb.at + k <= pc.at && pc.at + m <= pb.at + pb.ld);
    let b = bc.as_ptr().wrapping_add(pb.at);
    // SAFETY: the parts lie inside their slices; in each column B's rows end before C's begin.
    unsafe { product_at(simd, (m, n, k), (a, pa), (b, pb.ld), (bc, pc), false) }
}

/// `B ← −N B` for a square N of at most [`WIDTH`] rows, columns [`WIDTH`] apart.
pub(super) fn replace(
    simd: Simd,
    (k, n): (usize, usize),
    negative: &[f64],
    (b, pb): (&mut [f64], At),
) {
    assert!(k <= WIDTH && negative.len() == WIDTH * WIDTH && pb.end(k, n) <= b.len());
    let source = b.as_ptr().wrapping_add(pb.at);
    let a = (negative, At { at: 0, ld: WIDTH });
    // SAFETY: inside the slice; with at most WIDTH rows a tile has read all of its columns of B before it writes any.
    unsafe { product_at(simd, (k, n, k), a, (source, pb.ld), (b, pb), true) }
}

/// SAFETY: the parts lie inside their arrays; in each group of columns, entries of B are read before C overwrites them.
unsafe fn product_at(
    simd: Simd,
    (m, n, k): (usize, usize, usize),
    (a, pa): (&[f64], At),
    (b, ldb): (*const f64, usize),
    (c, pc): (&mut [f64], At),
    set: bool,
) {
    if m == 0 || n == 0 || (k == 0 && !set) {
        return;
    }
    let a = a.as_ptr().wrapping_add(pa.at);
    let c = c.as_mut_ptr().wrapping_add(pc.at);
    // SAFETY: handed on; a `Simd` exists only where its features do.
    unsafe {
        match simd.0 {
            #[cfg(target_arch = "x86_64")]
            Level::Avx512 => avx512::product(m, n, k, a, pa.ld, b, ldb, c, pc.ld, set),
            #[cfg(target_arch = "x86_64")]
            Level::Avx2 => avx2::product(m, n, k, a, pa.ld, b, ldb, c, pc.ld, set),
            Level::Plain => plain::product(m, n, k, a, pa.ld, b, ldb, c, pc.ld, set),
        }
    }
}

/// `P X = L U` for the leading `rows` rows of a panel of `swaps.len() ≤ WIDTH` columns, pivots by rows: unit L below the
/// diagonal, U on and above. `swaps[j]`: the row (counted from the panel's first) exchanged with row j. `inverses`: 1/U_jj.
pub(super) fn factor_panel(
    simd: Simd,
    rows: usize,
    (x, px): (&mut [f64], At),
    swaps: &mut [u32],
    inverses: &mut [f64],
) -> Pivots {
    let w = swaps.len();
    assert!(w <= WIDTH && w <= rows && inverses.len() == w && px.end(rows, w) <= x.len());
    let x = x.as_mut_ptr().wrapping_add(px.at);
    // SAFETY: inside the slice, as asserted.
    let found = unsafe {
        match simd.0 {
            #[cfg(target_arch = "x86_64")]
            Level::Avx512 => avx512::factor_panel(rows, x, px.ld, swaps, inverses),
            #[cfg(target_arch = "x86_64")]
            Level::Avx2 => avx2::factor_panel(rows, x, px.ld, swaps, inverses),
            Level::Plain => plain::factor_panel(rows, x, px.ld, swaps, inverses),
        }
    };
    let exchanges = swaps.iter().enumerate().filter(|(j, p)| *j != **p as usize).count();
    let below = inverses.iter().filter(|inverse| **inverse < 0.0).count();
    Pivots { negative: (exchanges + below) % 2 == 1, ..found }
}

/// `X ← X U⁻¹` for `rows` rows below a panel that [`factor_panel`] has factorised; `pu`: its diagonal block.
pub(super) fn right_solve(
    simd: Simd,
    rows: usize,
    (x, pu, px): (&mut [f64], At, At),
    inverses: &[f64],
) {
    let w = inverses.len();
    assert!((1..=WIDTH).contains(&w) && px.end(rows, w) <= x.len() && pu.end(w, w) <= x.len());
    assert!(pu.ld == px.ld && (rows == 0 || pu.at + w <= px.at));
    let (x, u) = (x.as_mut_ptr().wrapping_add(px.at), x.as_ptr().wrapping_add(pu.at));
    // SAFETY: inside the slice, as asserted; U's rows end before X's begin.
    unsafe {
        match simd.0 {
            #[cfg(target_arch = "x86_64")]
            Level::Avx512 => avx512::right_solve(rows, x, u, px.ld, inverses),
            #[cfg(target_arch = "x86_64")]
            Level::Avx2 => avx2::right_solve(rows, x, u, px.ld, inverses),
            Level::Plain => plain::right_solve(rows, x, u, px.ld, inverses),
        }
    }
}

/// `y −= A x`.
pub(super) fn product_vector(simd: Simd, (a, pa): (&[f64], At), x: &[f64], y: &mut [f64]) {
    let (m, k) = (y.len(), x.len());
    assert!(pa.end(m, k) <= a.len());
    let a = a.as_ptr().wrapping_add(pa.at);
    // SAFETY: inside the slice, as asserted.
    unsafe {
        match simd.0 {
            #[cfg(target_arch = "x86_64")]
            Level::Avx512 => avx512::product_vector(m, k, a, pa.ld, x.as_ptr(), y.as_mut_ptr()),
            #[cfg(target_arch = "x86_64")]
            Level::Avx2 => avx2::product_vector(m, k, a, pa.ld, x.as_ptr(), y.as_mut_ptr()),
            Level::Plain => plain::product_vector(m, k, a, pa.ld, x, y),
        }
    }
}

/// The loops that AVX-512 and AVX2 share; the module around them defines vectors, masks and `TILE` (vectors × columns).
///
/// SAFETY of every function: its pointers are good for the rows and columns that it is told.
#[cfg(target_arch = "x86_64")]
macro_rules! kernels {
    ($features:literal) => {
        /// Rows of A packed at a time along K: 24 KiB, so that they stay in the first cache.
        const DEPTH: usize = 128;
        /// Columns of B and C at a time: 240 KiB of B, which stay in the second cache.
        const SPAN: usize = 240;

        #[repr(align(64))]
        struct Packed([std::mem::MaybeUninit<f64>; DEPTH * ROWS * LANES]);

        #[allow(clippy::too_many_arguments)]
        #[target_feature(enable = $features)]
        pub(super) unsafe fn product(
            m: usize,
            n: usize,
            k: usize,
            a: *const f64,
            lda: usize,
            b: *const f64,
            ldb: usize,
            c: *mut f64,
            ldc: usize,
            set: bool,
        ) {
            let mut buffer = Packed([std::mem::MaybeUninit::uninit(); DEPTH * ROWS * LANES]);
            let mut j = 0;
            while j < n {
                let columns = SPAN.min(n - j);
                // SAFETY: columns j to j + columns of B and C.
                unsafe {
                    let (b, c) = (b.add(j * ldb), c.add(j * ldc));
                    product_span(m, columns, k, a, lda, b, ldb, c, ldc, set, &mut buffer);
                }
                j += columns;
            }
        }

        #[allow(clippy::too_many_arguments)]
        #[target_feature(enable = $features)]
        unsafe fn product_span(
            m: usize,
            n: usize,
            k: usize,
            a: *const f64,
            lda: usize,
            b: *const f64,
            ldb: usize,
            c: *mut f64,
            ldc: usize,
            set: bool,
            buffer: &mut Packed,
        ) {
            let mut p = 0;
            // SAFETY: tiles cut the m×n part into pieces; the buffer holds DEPTH columns of ROWS vectors.
            unsafe {
                loop {
                    let depth = DEPTH.min(k - p);
                    let set = set && p == 0;
                    let (b, a) = (b.add(p), a.wrapping_add(p * lda));
                    let mut i = 0;
                    while i < m {
                        let left = (m - i).div_ceil(LANES);
                        // Four vectors as two and two rather than three and one.
                        let vectors = if left == ROWS + 1 { left / 2 } else { left.min(ROWS) };
                        let rows = (vectors * LANES).min(m - i);
                        let last = first(rows - (vectors - 1) * LANES);
                        let (mut a, mut lda) = (a.wrapping_add(i), lda);
                        let c = c.add(i);
                        // Packed rows are filled up with zeros: loads need no mask.
                        let mut full = rows == vectors * LANES;
                        if n > 3 * COLUMNS && depth > 4 {
                            full = true;
                            let to = buffer.0.as_mut_ptr().cast::<f64>();
                            for q in 0..depth {
                                for v in 0..vectors {
                                    let mask = if v + 1 == vectors { last } else { first(LANES) };
                                    let x = load(a.add(q * lda + v * LANES), mask);
                                    store_all(to.add((q * vectors + v) * LANES), x);
                                }
                            }
                            (a, lda) = (to, vectors * LANES);
                        }
                        match (vectors, full) {
                            (1, false) => {
                                strip::<1, false>(n, depth, a, lda, b, ldb, c, ldc, last, set)
                            }
                            (1, true) => {
                                strip::<1, true>(n, depth, a, lda, b, ldb, c, ldc, last, set)
                            }
                            (2, false) => {
                                strip::<2, false>(n, depth, a, lda, b, ldb, c, ldc, last, set)
                            }
                            (2, true) => {
                                strip::<2, true>(n, depth, a, lda, b, ldb, c, ldc, last, set)
                            }
                            (_, false) => {
                                strip::<3, false>(n, depth, a, lda, b, ldb, c, ldc, last, set)
                            }
                            (_, true) => {
                                strip::<3, true>(n, depth, a, lda, b, ldb, c, ldc, last, set)
                            }
                        }
                        i += rows;
                    }
                    p += depth;
                    if p == k {
                        break;
                    }
                }
            }
        }

        #[allow(clippy::too_many_arguments)]
        #[target_feature(enable = $features)]
        unsafe fn strip<const V: usize, const FULL: bool>(
            n: usize,
            k: usize,
            a: *const f64,
            lda: usize,
            b: *const f64,
            ldb: usize,
            c: *mut f64,
            ldc: usize,
            last: Mask,
            set: bool,
        ) {
            let mut j = 0;
            // SAFETY: columns j to j + N of B and C.
            unsafe {
                while j < n {
                    let columns = COLUMNS.min(n - j);
                    let (b, c) = (b.add(j * ldb), c.add(j * ldc));
                    match columns {
                        1 => tile::<V, 1, FULL>(k, a, lda, b, ldb, c, ldc, last, set),
                        2 => tile::<V, 2, FULL>(k, a, lda, b, ldb, c, ldc, last, set),
                        3 => tile::<V, 3, FULL>(k, a, lda, b, ldb, c, ldc, last, set),
                        4 => tile::<V, 4, FULL>(k, a, lda, b, ldb, c, ldc, last, set),
                        5 => tile::<V, 5, FULL>(k, a, lda, b, ldb, c, ldc, last, set),
                        6 => tile::<V, 6, FULL>(k, a, lda, b, ldb, c, ldc, last, set),
                        7 => tile::<V, 7, FULL>(k, a, lda, b, ldb, c, ldc, last, set),
                        _ => tile::<V, 8, FULL>(k, a, lda, b, ldb, c, ldc, last, set),
                    }
                    j += columns;
                }
            }
        }

        #[allow(clippy::too_many_arguments)]
        #[target_feature(enable = $features)]
        unsafe fn tile<const V: usize, const N: usize, const FULL: bool>(
            k: usize,
            a: *const f64,
            lda: usize,
            b: *const f64,
            ldb: usize,
            c: *mut f64,
            ldc: usize,
            last: Mask,
            set: bool,
        ) {
            let mut sum = [[zero(); V]; N];
            // SAFETY: V vectors of rows, the last masked, and N columns.
            unsafe {
                for p in 0..k {
                    let mut x = [zero(); V];
                    for v in 0..V {
                        let from = a.add(p * lda + v * LANES);
                        x[v] = if v + 1 == V && !FULL { load(from, last) } else { load_all(from) };
                    }
                    for j in 0..N {
                        let y = all(*b.add(p + j * ldb));
                        for v in 0..V {
                            sum[j][v] = minus(x[v], y, sum[j][v]);
                        }
                    }
                }
                for j in 0..N {
                    for v in 0..V {
                        let to = c.add(j * ldc + v * LANES);
                        if v + 1 == V {
                            let old = if set { zero() } else { load(to, last) };
                            store(to, last, plus(old, sum[j][v]));
                        } else {
                            let old = if set { zero() } else { load_all(to) };
                            store_all(to, plus(old, sum[j][v]));
                        }
                    }
                }
            }
        }

        #[target_feature(enable = $features)]
        pub(super) unsafe fn factor_panel(
            rows: usize,
            x: *mut f64,
            ld: usize,
            swaps: &mut [u32],
            inverses: &mut [f64],
        ) -> super::Pivots {
            let w = swaps.len();
            let mut outcome = super::Pivots::default();
            // Chunks start at the panel's first row for every column, so that what one column stores the next one loads whole.
            let end = |i: usize| first(LANES.min(rows - i));
            for j in 0..w {
                // SAFETY: rows and columns of the panel; lanes beyond its rows are masked.
                unsafe {
                    let column = x.add(j * ld);
                    let start = j / LANES * LANES;
                    let mut largest = zero();
                    let mut i = start;
                    while i < rows {
                        let inside =
                            if i == start { and_not(end(i), first(j - i)) } else { end(i) };
                        largest = larger(largest, load(column.add(i), inside));
                        i += LANES;
                    }
                    let largest = reduce(largest);
                    let mut p = j;
                    i = start;
                    while i < rows {
                        let inside =
                            if i == start { and_not(end(i), first(j - i)) } else { end(i) };
                        if let Some(lane) = find(load(column.add(i), inside), largest, inside) {
                            p = i + lane;
                            break;
                        }
                        i += LANES;
                    }
                    swaps[j] = p as u32;
                    if p != j {
                        for c in 0..w {
                            std::ptr::swap(x.add(c * ld + j), x.add(c * ld + p));
                        }
                    }
                    let pivot = super::mended(*column.add(j), &mut outcome);
                    *column.add(j) = pivot;
                    inverses[j] = 1.0 / pivot;
                    let inverse = all(1.0 / pivot);
                    i = start;
                    let after = (j + 1) - start;
                    while i < rows {
                        let inside = end(i);
                        let below = if i == start {
                            and_not(inside, first(after.min(LANES)))
                        } else {
                            inside
                        };
                        let old = load(column.add(i), inside);
                        let l = keep(times(old, inverse), below);
                        store(column.add(i), inside, blend(old, l, below));
                        for c in j + 1..w {
                            let to = x.add(c * ld + i);
                            let y = all(*x.add(c * ld + j));
                            store(to, inside, minus(l, y, load(to, inside)));
                        }
                        i += LANES;
                    }
                }
            }
            outcome
        }

        #[target_feature(enable = $features)]
        pub(super) unsafe fn right_solve(
            rows: usize,
            x: *mut f64,
            u: *const f64,
            ld: usize,
            inverses: &[f64],
        ) {
            // SAFETY: handed on.
            unsafe {
                match inverses.len() {
                    1 => right_solve_of::<1>(rows, x, u, ld, inverses),
                    2 => right_solve_of::<2>(rows, x, u, ld, inverses),
                    3 => right_solve_of::<3>(rows, x, u, ld, inverses),
                    4 => right_solve_of::<4>(rows, x, u, ld, inverses),
                    5 => right_solve_of::<5>(rows, x, u, ld, inverses),
                    6 => right_solve_of::<6>(rows, x, u, ld, inverses),
                    7 => right_solve_of::<7>(rows, x, u, ld, inverses),
                    _ => right_solve_of::<8>(rows, x, u, ld, inverses),
                }
            }
        }

        #[target_feature(enable = $features)]
        unsafe fn right_solve_of<const W: usize>(
            rows: usize,
            x: *mut f64,
            u: *const f64,
            ld: usize,
            inverses: &[f64],
        ) {
            let mut i = 0;
            while i < rows {
                let mask = first(LANES.min(rows - i));
                let mut done = [zero(); W];
                for j in 0..W {
                    // SAFETY: row chunk i of column j, masked; U's column j down to row j.
                    unsafe {
                        let at = x.add(j * ld + i);
                        let mut y = load(at, mask);
                        for p in 0..j {
                            y = minus(done[p], all(*u.add(j * ld + p)), y);
                        }
                        done[j] = times(y, all(inverses[j]));
                        store(at, mask, done[j]);
                    }
                }
                i += LANES;
            }
        }

        #[target_feature(enable = $features)]
        pub(super) unsafe fn product_vector(
            m: usize,
            k: usize,
            a: *const f64,
            lda: usize,
            x: *const f64,
            y: *mut f64,
        ) {
            let mut i = 0;
            // SAFETY: strips cut the rows into pieces.
            unsafe {
                while i < m {
                    let vectors = (m - i).div_ceil(LANES).min(4);
                    let rows = (vectors * LANES).min(m - i);
                    let last = first(rows - (vectors - 1) * LANES);
                    let (a, y) = (a.add(i), y.add(i));
                    match vectors {
                        1 => product_vector_of::<1, 4>(k, a, lda, x, y, last),
                        2 => product_vector_of::<2, 2>(k, a, lda, x, y, last),
                        3 => product_vector_of::<3, 2>(k, a, lda, x, y, last),
                        _ => product_vector_of::<4, 2>(k, a, lda, x, y, last),
                    }
                    i += rows;
                }
            }
        }

        /// V vectors of rows, P columns at a time, each with sums of its own to hide the latency.
        #[target_feature(enable = $features)]
        unsafe fn product_vector_of<const V: usize, const P: usize>(
            k: usize,
            a: *const f64,
            lda: usize,
            x: *const f64,
            y: *mut f64,
            last: Mask,
        ) {
            let mut sum = [[zero(); V]; P];
            // SAFETY: V vectors of rows, the last masked.
            unsafe {
                let mut p = 0;
                while p + P <= k {
                    for q in 0..P {
                        let z = all(*x.add(p + q));
                        for v in 0..V {
                            let from = a.add((p + q) * lda + v * LANES);
                            let b = if v + 1 == V { load(from, last) } else { load_all(from) };
                            sum[q][v] = minus(b, z, sum[q][v]);
                        }
                    }
                    p += P;
                }
                while p < k {
                    let z = all(*x.add(p));
                    for v in 0..V {
                        let from = a.add(p * lda + v * LANES);
                        let b = if v + 1 == V { load(from, last) } else { load_all(from) };
                        sum[0][v] = minus(b, z, sum[0][v]);
                    }
                    p += 1;
                }
                for v in 0..V {
                    let mut s = sum[0][v];
                    for q in 1..P {
                        s = plus(s, sum[q][v]);
                    }
                    let to = y.add(v * LANES);
                    if v + 1 == V {
                        store(to, last, plus(load(to, last), s));
                    } else {
                        store_all(to, plus(load_all(to), s));
                    }
                }
            }
        }
    };
}

#[cfg(target_arch = "x86_64")]
mod avx512 {
    use std::arch::x86_64::*;

    const LANES: usize = 8;
    const ROWS: usize = 3;
    const COLUMNS: usize = 8;
    type Vector = __m512d;
    type Mask = __mmask8;

    kernels!("avx512f");

    /// The first n lanes.
    #[inline(always)]
    fn first(n: usize) -> Mask {
        ((1_u32 << n) - 1) as Mask
    }

    #[inline(always)]
    fn and_not(a: Mask, b: Mask) -> Mask {
        a & !b
    }

    #[inline]
    #[target_feature(enable = "avx512f")]
    fn zero() -> Vector {
        _mm512_setzero_pd()
    }

    #[inline]
    #[target_feature(enable = "avx512f")]
    fn all(x: f64) -> Vector {
        _mm512_set1_pd(x)
    }

    /// c − a b
    #[inline]
    #[target_feature(enable = "avx512f")]
    fn minus(a: Vector, b: Vector, c: Vector) -> Vector {
        _mm512_fnmadd_pd(a, b, c)
    }

    #[inline]
    #[target_feature(enable = "avx512f")]
    fn plus(a: Vector, b: Vector) -> Vector {
        _mm512_add_pd(a, b)
    }

    #[inline]
    #[target_feature(enable = "avx512f")]
    fn times(a: Vector, b: Vector) -> Vector {
        _mm512_mul_pd(a, b)
    }

    /// a in the lanes of the mask, else zero.
    #[inline]
    #[target_feature(enable = "avx512f")]
    fn keep(a: Vector, mask: Mask) -> Vector {
        _mm512_maskz_mov_pd(mask, a)
    }

    /// b in the lanes of the mask, else a.
    #[inline]
    #[target_feature(enable = "avx512f")]
    fn blend(a: Vector, b: Vector, mask: Mask) -> Vector {
        _mm512_mask_blend_pd(mask, a, b)
    }

    /// The larger of a and |b|; a where b is NaN.
    #[inline]
    #[target_feature(enable = "avx512f")]
    fn larger(a: Vector, b: Vector) -> Vector {
        _mm512_max_pd(_mm512_abs_pd(b), a)
    }

    #[inline]
    #[target_feature(enable = "avx512f")]
    fn reduce(a: Vector) -> f64 {
        _mm512_reduce_max_pd(a)
    }

    /// The first lane of the mask where |a| = x.
    #[inline]
    #[target_feature(enable = "avx512f")]
    fn find(a: Vector, x: f64, mask: Mask) -> Option<usize> {
        let equal =
            _mm512_mask_cmp_pd_mask::<_CMP_EQ_OQ>(mask, _mm512_abs_pd(a), _mm512_set1_pd(x));
        (equal != 0).then_some(equal.trailing_zeros() as usize)
    }

    /// SAFETY: `from` is good for the lanes of the mask.
    #[inline]
    #[target_feature(enable = "avx512f")]
    unsafe fn load(from: *const f64, mask: Mask) -> Vector {
        // SAFETY: by the caller.
        unsafe { _mm512_maskz_loadu_pd(mask, from) }
    }

    /// SAFETY: `from` is good for all lanes.
    #[inline]
    #[target_feature(enable = "avx512f")]
    unsafe fn load_all(from: *const f64) -> Vector {
        // SAFETY: by the caller.
        unsafe { _mm512_loadu_pd(from) }
    }

    /// SAFETY: `to` is good for the lanes of the mask.
    #[inline]
    #[target_feature(enable = "avx512f")]
    unsafe fn store(to: *mut f64, mask: Mask, x: Vector) {
        // SAFETY: by the caller.
        unsafe { _mm512_mask_storeu_pd(to, mask, x) }
    }

    /// SAFETY: `to` is good for all lanes.
    #[inline]
    #[target_feature(enable = "avx512f")]
    unsafe fn store_all(to: *mut f64, x: Vector) {
        // SAFETY: by the caller.
        unsafe { _mm512_storeu_pd(to, x) }
    }
}

#[cfg(target_arch = "x86_64")]
mod avx2 {
    use std::arch::x86_64::*;

    const LANES: usize = 4;
    const ROWS: usize = 3;
    const COLUMNS: usize = 4;
    type Vector = __m256d;
    /// Lanes of all ones where the mask holds.
    type Mask = __m256i;

    kernels!("avx2,fma");

    /// The first n lanes.
    #[inline]
    #[target_feature(enable = "avx2,fma")]
    fn first(n: usize) -> Mask {
        _mm256_cmpgt_epi64(_mm256_set1_epi64x(n as i64), _mm256_set_epi64x(3, 2, 1, 0))
    }

    #[inline]
    #[target_feature(enable = "avx2,fma")]
    fn and_not(a: Mask, b: Mask) -> Mask {
        _mm256_andnot_si256(b, a)
    }

    #[inline]
    #[target_feature(enable = "avx2,fma")]
    fn zero() -> Vector {
        _mm256_setzero_pd()
    }

    #[inline]
    #[target_feature(enable = "avx2,fma")]
    fn all(x: f64) -> Vector {
        _mm256_set1_pd(x)
    }

    /// c − a b
    #[inline]
    #[target_feature(enable = "avx2,fma")]
    fn minus(a: Vector, b: Vector, c: Vector) -> Vector {
        _mm256_fnmadd_pd(a, b, c)
    }

    #[inline]
    #[target_feature(enable = "avx2,fma")]
    fn plus(a: Vector, b: Vector) -> Vector {
        _mm256_add_pd(a, b)
    }

    #[inline]
    #[target_feature(enable = "avx2,fma")]
    fn times(a: Vector, b: Vector) -> Vector {
        _mm256_mul_pd(a, b)
    }

    /// a in the lanes of the mask, else zero.
    #[inline]
    #[target_feature(enable = "avx2,fma")]
    fn keep(a: Vector, mask: Mask) -> Vector {
        _mm256_and_pd(a, _mm256_castsi256_pd(mask))
    }

    /// b in the lanes of the mask, else a.
    #[inline]
    #[target_feature(enable = "avx2,fma")]
    fn blend(a: Vector, b: Vector, mask: Mask) -> Vector {
        _mm256_blendv_pd(a, b, _mm256_castsi256_pd(mask))
    }

    #[inline]
    #[target_feature(enable = "avx2,fma")]
    fn abs(a: Vector) -> Vector {
        _mm256_andnot_pd(_mm256_set1_pd(-0.0), a)
    }

    /// The larger of a and |b|; a where b is NaN.
    #[inline]
    #[target_feature(enable = "avx2,fma")]
    fn larger(a: Vector, b: Vector) -> Vector {
        _mm256_max_pd(abs(b), a)
    }

    #[inline]
    #[target_feature(enable = "avx2,fma")]
    fn reduce(a: Vector) -> f64 {
        let half = _mm_max_pd(_mm256_castpd256_pd128(a), _mm256_extractf128_pd::<1>(a));
        _mm_cvtsd_f64(_mm_max_sd(half, _mm_unpackhi_pd(half, half)))
    }

    /// The first lane of the mask where |a| = x.
    #[inline]
    #[target_feature(enable = "avx2,fma")]
    fn find(a: Vector, x: f64, mask: Mask) -> Option<usize> {
        let equal = keep(_mm256_cmp_pd::<_CMP_EQ_OQ>(abs(a), _mm256_set1_pd(x)), mask);
        let lanes = _mm256_movemask_pd(equal);
        (lanes != 0).then_some(lanes.trailing_zeros() as usize)
    }

    /// SAFETY: `from` is good for the lanes of the mask.
    #[inline]
    #[target_feature(enable = "avx2,fma")]
    unsafe fn load(from: *const f64, mask: Mask) -> Vector {
        // SAFETY: by the caller.
        unsafe { _mm256_maskload_pd(from, mask) }
    }

    /// SAFETY: `from` is good for all lanes.
    #[inline]
    #[target_feature(enable = "avx2,fma")]
    unsafe fn load_all(from: *const f64) -> Vector {
        // SAFETY: by the caller.
        unsafe { _mm256_loadu_pd(from) }
    }

    /// SAFETY: `to` is good for the lanes of the mask.
    #[inline]
    #[target_feature(enable = "avx2,fma")]
    unsafe fn store(to: *mut f64, mask: Mask, x: Vector) {
        // SAFETY: by the caller.
        unsafe { _mm256_maskstore_pd(to, mask, x) }
    }

    /// SAFETY: `to` is good for all lanes.
    #[inline]
    #[target_feature(enable = "avx2,fma")]
    unsafe fn store_all(to: *mut f64, x: Vector) {
        // SAFETY: by the caller.
        unsafe { _mm256_storeu_pd(to, x) }
    }
}

/// The same in plain loops.
///
/// SAFETY of every function: its pointers are good for the rows and columns that it is told.
mod plain {
    #[allow(clippy::too_many_arguments)]
    pub(super) unsafe fn product(
        m: usize,
        n: usize,
        k: usize,
        a: *const f64,
        lda: usize,
        b: *const f64,
        ldb: usize,
        c: *mut f64,
        ldc: usize,
        set: bool,
    ) {
        // Eight rows of one column at a time: all of B's column is read before C's is written where they coincide.
        for j in 0..n {
            for i in (0..m).step_by(super::WIDTH) {
                let rows = super::WIDTH.min(m - i);
                let mut sum = [0.0; super::WIDTH];
                // SAFETY: rows i to i + rows of A and C, column j of B and C.
                unsafe {
                    for p in 0..k {
                        let y = *b.add(p + j * ldb);
                        for l in 0..rows {
                            sum[l] -= *a.add(p * lda + i + l) * y;
                        }
                    }
                    for l in 0..rows {
                        let to = c.add(j * ldc + i + l);
                        *to = if set { sum[l] } else { *to + sum[l] };
                    }
                }
            }
        }
    }

    pub(super) unsafe fn factor_panel(
        rows: usize,
        x: *mut f64,
        ld: usize,
        swaps: &mut [u32],
        inverses: &mut [f64],
    ) -> super::Pivots {
        let w = swaps.len();
        let mut outcome = super::Pivots::default();
        for j in 0..w {
            // SAFETY: rows and columns of the panel.
            unsafe {
                let column = x.add(j * ld);
                let mut p = j;
                for i in j + 1..rows {
                    if (*column.add(i)).abs() > (*column.add(p)).abs() {
                        p = i;
                    }
                }
                swaps[j] = p as u32;
                if p != j {
                    for c in 0..w {
                        std::ptr::swap(x.add(c * ld + j), x.add(c * ld + p));
                    }
                }
                *column.add(j) = super::mended(*column.add(j), &mut outcome);
                inverses[j] = 1.0 / *column.add(j);
                for i in j + 1..rows {
                    *column.add(i) *= inverses[j];
                }
                for c in j + 1..w {
                    let (to, y) = (x.add(c * ld), *x.add(c * ld + j));
                    for i in j + 1..rows {
                        *to.add(i) -= *column.add(i) * y;
                    }
                }
            }
        }
        outcome
    }

    pub(super) unsafe fn right_solve(
        rows: usize,
        x: *mut f64,
        u: *const f64,
        ld: usize,
        inverses: &[f64],
    ) {
        for j in 0..inverses.len() {
            // SAFETY: column j of X, U down to its diagonal.
            unsafe {
                for p in 0..j {
                    let y = *u.add(j * ld + p);
                    for i in 0..rows {
                        *x.add(j * ld + i) -= *x.add(p * ld + i) * y;
                    }
                }
                for i in 0..rows {
                    *x.add(j * ld + i) *= inverses[j];
                }
            }
        }
    }

    pub(super) unsafe fn product_vector(
        m: usize,
        k: usize,
        a: *const f64,
        lda: usize,
        x: &[f64],
        y: &mut [f64],
    ) {
        for p in 0..k {
            for i in 0..m {
                // SAFETY: an entry of A.
                y[i] -= unsafe { *a.add(p * lda + i) } * x[p];
            }
        }
    }
}
