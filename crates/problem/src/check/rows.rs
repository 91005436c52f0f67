//! Sums of matrix–vector products, row by row, plainly or in doubled precision.

use nonsmooth_linalg::{Bsr, Compensated, Csc, Doubled, Matrix, norm_of, pieces};

/// Fewer columns are not worth another thread.
const COLUMNS: usize = 2000;

/// One compensated sum for each row, and the sum of the sizes of its terms.
#[derive(Debug, Clone, Default)]
pub(crate) struct Rows {
    sums: Vec<Compensated>,
    sizes: Vec<f64>,
    plainly: bool,
}

impl Rows {
    /// Carries doubled precision from now on, or not.
    pub(crate) fn precisely(&mut self, precisely: bool) {
        self.plainly = !precisely;
    }

    /// Begins with `x`.
    pub(crate) fn start(&mut self, x: &[f64]) {
        self.sums.clear();
        self.sums.extend(x.iter().map(|&x| Compensated::from(x)));
        self.sizes.clear();
        self.sizes.extend(x.iter().map(|x| x.abs()));
    }

    /// Begins with the sums of others, and their precision.
    pub(crate) fn start_from(&mut self, others: &Self) {
        self.sums.clone_from(&others.sums);
        self.sizes.clone_from(&others.sizes);
        self.plainly = others.plainly;
    }

    /// Begins with `n` zeros.
    pub(crate) fn start_at_zero(&mut self, n: usize) {
        self.sums.clear();
        self.sums.resize(n, Compensated::default());
        self.sizes.clear();
        self.sizes.resize(n, 0.0);
    }

    /// Adds `sign · A x`.
    pub(crate) fn add(&mut self, sign: f64, a: &Csc, x: &[f64]) {
        if self.plainly {
            for (j, &xj) in x.iter().enumerate() {
                let (rows, values) = a.column(j);
                for (&i, &v) in rows.iter().zip(values) {
                    let product = sign * v * xj;
                    self.sums[i].add_plainly(product);
                    self.sizes[i] += product.abs();
                }
            }
        } else {
            fused::add(&mut self.sums, &mut self.sizes, (sign, a, x));
        }
    }

    /// Adds `sign · A x`; false, and nothing added, where A is known by its products only.
    pub(crate) fn add_matrix(&mut self, sign: f64, a: &Matrix, x: &[f64]) -> bool {
        match a {
            Matrix::Sparse(a) => self.add(sign, a, x),
            Matrix::Dense(a) if self.plainly => {
                for i in 0..a.nrows() {
                    let [sum, size] = dot(a.row(i), x);
                    self.sums[i].add_plainly(sign * sum);
                    self.sizes[i] += size;
                }
            }
            Matrix::Dense(a) => {
                for i in 0..a.nrows() {
                    for (&a, &x) in a.row(i).iter().zip(x).filter(|e| *e.1 != 0.0) {
                        self.add_product(i, sign * a, x);
                    }
                }
            }
            Matrix::Operator(_) => return false,
        }
        true
    }

    /// Adds `x`.
    pub(crate) fn add_vector(&mut self, x: &[f64]) {
        for (row, &x) in x.iter().enumerate() {
            self.add_product(row, 1.0, x);
        }
    }

    /// Adds `Aᵀ x`, column by column on all threads that the budget allows.
    pub(crate) fn add_transposed(&mut self, a: &Csc, x: &[f64]) {
        let Self { sums, sizes, plainly } = self;
        let rows = (&mut sums[..a.ncols()], &mut sizes[..a.ncols()]);
        pieces::writing_both(COLUMNS, rows, |first, sums, sizes| {
            if !*plainly {
                return fused::add_transposed(sums, sizes, (a, first, x));
            }
            for (j, (of_sums, of_sizes)) in (first..).zip(sums.iter_mut().zip(sizes)) {
                let (rows, values) = a.column(j);
                let (mut sum, mut size) = (*of_sums, *of_sizes);
                for (&i, &v) in rows.iter().zip(values) {
                    let product = v * x[i];
                    sum.add_plainly(product);
                    size += product.abs();
                }
                (*of_sums, *of_sizes) = (sum, size);
            }
        });
    }

    /// Adds `a b` to a row.
    #[inline(always)]
    pub(crate) fn add_product(&mut self, row: usize, a: f64, b: f64) {
        let product = a * b;
        if self.plainly {
            self.sums[row].add_plainly(product);
        } else {
            self.sums[row].add_product(a, b);
        }
        self.sizes[row] += product.abs();
    }

    /// Adds `W x` in doubled precision.
    pub(crate) fn add_blocks<const D: usize>(&mut self, w: &Bsr<D>, x: &[f64]) {
        fused::add_blocks(&mut self.sums, &mut self.sizes, (w, x));
    }

    /// The sums, each rounded once.
    pub(crate) fn values(&self) -> impl Iterator<Item = f64> + Clone + '_ {
        self.sums.iter().map(|s| s.value())
    }

    /// The sums, each as a number and what it has lost.
    pub(crate) fn parts(&self) -> impl Iterator<Item = (f64, f64)> + '_ {
        self.sums.iter().map(|s| s.into_parts())
    }

    /// The sums with all their digits. Each is wrong by at most [`doubt`]`(n)` times the size of its n terms.
    pub(crate) fn doubled(&self) -> impl Iterator<Item = Doubled> + Clone + '_ {
        self.sums.iter().map(|s| s.doubled())
    }

    /// The sizes of the terms of each sum.
    pub(crate) fn sizes(&self) -> &[f64] {
        &self.sizes
    }

    /// The Euclidean norm of the sums.
    pub(crate) fn norm(&self) -> f64 {
        norm_of(self.values())
    }
}

/// What a compensated sum of `n` terms may be wrong by, over the size of its terms (OgitaRumpOishi2005, the bound of Dot2 before its last
/// rounding).
pub(crate) fn doubt(n: usize) -> f64 {
    let gamma = 0.5 * f64::EPSILON * (n + 2) as f64;
    gamma * gamma
}

/// Adds `W x` plainly to the sums, and the sizes of its terms to theirs.
pub(crate) fn add_blocks_plainly<const D: usize>(
    sums: &mut [f64],
    sizes: &mut [f64],
    w: &Bsr<D>,
    x: &[f64],
) {
    fused::add_blocks_plainly(sums, sizes, (w, x));
}

/// The kernels, each compiled twice: the error of a product costs one operation on a machine with fused
/// multiplication and addition (found at run time), else seventeen. Both make the same bits, but of plain sums.
mod fused {
    use nonsmooth_linalg::{Bsr, Compensated, Csc, small};

    /// Defines a kernel that calls the faster of the two bodies.
    macro_rules! kernel {
        ($name:ident $([const $D:ident])?, $body:ident, $sum:ty, $data:ty) => {
            pub(crate) fn $name$(<const $D: usize>)?(
                sums: &mut [$sum],
                sizes: &mut [f64],
                data: $data,
            ) {
                #[cfg(target_arch = "x86_64")]
                {
                    #[target_feature(enable = "avx2,fma")]
                    fn with_fma$(<const $D: usize>)?(
                        sums: &mut [$sum],
                        sizes: &mut [f64],
                        data: $data,
                    ) {
                        $body::<true $(, $D)?>(sums, sizes, data);
                    }
                    if std::arch::is_x86_feature_detected!("avx2")
                        && std::arch::is_x86_feature_detected!("fma")
                    {
                        // SAFETY: the features were just found.
                        return unsafe { with_fma(sums, sizes, data) };
                    }
                }
                $body::<false $(, $D)?>(sums, sizes, data);
            }
        };
    }
    kernel!(add, add_by, Compensated, (f64, &Csc, &[f64]));
    kernel!(add_transposed, add_transposed_by, Compensated, (&Csc, usize, &[f64]));
    kernel!(add_blocks[const D], add_blocks_by, Compensated, (&Bsr<D>, &[f64]));
    kernel!(add_blocks_plainly[const D], add_blocks_plainly_by, f64, (&Bsr<D>, &[f64]));

    #[inline(always)]
    fn add_by<const FUSED: bool>(
        sums: &mut [Compensated],
        sizes: &mut [f64],
        (sign, a, x): (f64, &Csc, &[f64]),
    ) {
        for (j, &xj) in x.iter().enumerate() {
            let (rows, values) = a.column(j);
            for (&i, &v) in rows.iter().zip(values) {
                sums[i].add_product_by::<FUSED>(sign * v, xj);
                sizes[i] += (v * xj).abs();
            }
        }
    }

    #[inline(always)]
    fn add_transposed_by<const FUSED: bool>(
        sums: &mut [Compensated],
        sizes: &mut [f64],
        (a, first, x): (&Csc, usize, &[f64]),
    ) {
        for (j, (sum, size)) in (first..).zip(sums.iter_mut().zip(sizes)) {
            let (rows, values) = a.column(j);
            for (&i, &v) in rows.iter().zip(values) {
                sum.add_product_by::<FUSED>(v, x[i]);
                *size += (v * x[i]).abs();
            }
        }
    }

    #[inline(always)]
    fn add_blocks_by<const FUSED: bool, const D: usize>(
        sums: &mut [Compensated],
        sizes: &mut [f64],
        (w, x): (&Bsr<D>, &[f64]),
    ) {
        let (sums, sizes) = (sums.as_chunks_mut::<D>().0, sizes.as_chunks_mut::<D>().0);
        for (i, (of_sums, of_sizes)) in sums.iter_mut().zip(sizes).enumerate() {
            // In registers, not in memory.
            let (mut sum, mut size) = (*of_sums, *of_sizes);
            let (cols, blocks) = w.row(i);
            for (&j, block) in cols.iter().zip(blocks) {
                let x: [f64; D] = small::block(x, j as usize);
                for k in 0..D {
                    for l in 0..D {
                        sum[k].add_product_by::<FUSED>(block[k][l], x[l]);
                        size[k] += (block[k][l] * x[l]).abs();
                    }
                }
            }
            (*of_sums, *of_sizes) = (sum, size);
        }
    }

    #[inline(always)]
    fn add_blocks_plainly_by<const FUSED: bool, const D: usize>(
        sums: &mut [f64],
        sizes: &mut [f64],
        (w, x): (&Bsr<D>, &[f64]),
    ) {
        let (sums, sizes) = (sums.as_chunks_mut::<D>().0, sizes.as_chunks_mut::<D>().0);
        for (i, (of_sums, of_sizes)) in sums.iter_mut().zip(sizes).enumerate() {
            let (mut sum, mut size) = (*of_sums, *of_sizes);
            let (cols, blocks) = w.row(i);
            for (&j, block) in cols.iter().zip(blocks) {
                let x: [f64; D] = small::block(x, j as usize);
                for k in 0..D {
                    for l in 0..D {
                        let product = block[k][l] * x[l];
                        sum[k] += product;
                        size[k] += product.abs();
                    }
                }
            }
            (*of_sums, *of_sizes) = (sum, size);
        }
    }
}

/// `Σ a_j x_j` and `Σ |a_j x_j|`, each as four sums side by side.
fn dot(a: &[f64], x: &[f64]) -> [f64; 2] {
    let ((a4, a), (x4, x)) = (a.as_chunks::<4>(), x.as_chunks::<4>());
    let (mut sums, mut sizes) = ([0.0; 4], [0.0; 4]);
    for (a, x) in a4.iter().zip(x4) {
        for k in 0..4 {
            let product = a[k] * x[k];
            sums[k] += product;
            sizes[k] += product.abs();
        }
    }
    let (mut sum, mut size): (f64, f64) = (sums.iter().sum(), sizes.iter().sum());
    for (a, x) in a.iter().zip(x) {
        sum += a * x;
        size += (a * x).abs();
    }
    [sum, size]
}
