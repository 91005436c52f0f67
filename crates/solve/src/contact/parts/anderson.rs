//! Anderson acceleration of a fixed point iteration `x ← g(x)`, type II, with a safeguard.
//!
//! With `f = g(x) − x` and the differences `ΔF`, `ΔG` of the last m pairs: `γ = argmin ‖f − ΔF γ‖`, `x ← g(x) − ΔG γ`. The least
//! squares problem lives in a thin QR factorisation of ΔF, to which the newest column is appended by Gram–Schmidt (twice) and from
//! which the oldest is taken by rotations. While the condition number of R is above a limit the oldest column goes: old differences
//! are the ones that fit worst.
//!
//! References: Anderson1965; WalkerNi2011 for the QR form and the control of the condition number.
//! Cost of a proposal: about 8 m products of length n. Storage: 2 m + 4 vectors. A nonsmooth g has no theory: hence the safeguard.

use nonsmooth_linalg::{budget, dot, pieces};

/// The largest condition number (1-norm) of R.
const CONDITION: f64 = 1e8;

/// A piece of a vector that one thread works on; with those of the other vectors it stays in the cache.
const PIECE: usize = 2048;
/// Columns whose products are taken at once.
const GROUP: usize = 6;

/// Differences of f and g, and the QR factorisation of the former.
#[derive(Debug, Clone)]
pub struct Anderson {
    depth: usize,
    n: usize,
    /// Orthonormal columns, one after the other.
    q: Vec<f64>,
    /// Upper triangular, by columns of length `depth`.
    r: Vec<f64>,
    /// The columns of ΔG; that of column j of ΔF is number `slots[j]`.
    dg: Vec<f64>,
    slots: Vec<usize>,
    f_last: Vec<f64>,
    g_last: Vec<f64>,
    has_last: bool,
    gamma: Vec<f64>,
    inverse: Vec<f64>,
}

impl Anderson {
    /// Keeps at most `depth` differences of vectors of length n.
    pub fn new(depth: usize, n: usize) -> Self {
        let mut anderson = Self {
            depth,
            n: 0,
            q: vec![],
            r: vec![0.0; depth * depth],
            dg: vec![],
            slots: Vec::with_capacity(depth),
            f_last: vec![],
            g_last: vec![],
            has_last: false,
            gamma: vec![0.0; depth],
            inverse: vec![0.0; depth * depth],
        };
        anderson.resize(n);
        anderson
    }

    /// Begins anew with vectors of length n; allocates nothing where n is the same.
    pub fn resize(&mut self, n: usize) {
        self.n = n;
        self.q.resize(self.depth * n, 0.0);
        self.dg.resize(self.depth * n, 0.0);
        self.f_last.resize(n, 0.0);
        self.g_last.resize(n, 0.0);
        self.clear();
    }

    /// Drops the past steps and keeps the memory.
    pub fn clear(&mut self) {
        self.slots.clear();
        self.has_last = false;
    }

    /// Takes `f(x)` and `g(x)` and turns g into the next x; returns the number of differences used. f may be any invertible linear
    /// image of `g(x) − x`: it only sets the norm of the least squares problem. It proposes nothing where the budget is over.
    pub fn propose(&mut self, f: &[f64], g: &mut [f64]) -> usize {
        if self.depth == 0 {
            return 0;
        }
        if self.has_last {
            self.append(f, g);
            while self.slots.len() > 1 && self.condition() > CONDITION {
                self.drop_oldest();
            }
        }
        let (k, n) = (if budget::over() { 0 } else { self.slots.len() }, self.n);
        dots(&self.q[..k * n], f, &mut self.gamma);
        for j in (0..k).rev() {
            for i in j + 1..k {
                self.gamma[j] -= self.r[i * self.depth + j] * self.gamma[i];
            }
            self.gamma[j] /= self.r[j * self.depth + j];
        }
        // The last pair, and the proposal.
        let Self { slots, gamma, dg, f_last, g_last, has_last, .. } = self;
        *has_last = true;
        pieces::writing(n, PIECE, [g, f_last, g_last], |piece, [x, f_last, g_last]| {
            f_last.copy_from_slice(&f[piece.clone()]);
            g_last.copy_from_slice(x);
            for (&slot, gamma) in slots[..k].iter().zip(&*gamma) {
                add(x, -gamma, &dg[slot * n..][piece.clone()]);
            }
            []
        });
        k
    }

    /// Appends the difference to the last pair as a column.
    fn append(&mut self, f: &[f64], g: &[f64]) {
        if self.slots.len() == self.depth {
            self.drop_oldest();
        }
        let (k, n, depth) = (self.slots.len(), self.n, self.depth);
        let (done, rest) = self.q.split_at_mut(k * n);
        let column = &mut rest[..n];
        let f_last = &self.f_last;
        let [square] = pieces::writing(n, PIECE, [&mut *column], |piece, [column]| {
            difference(column, &f[piece.clone()], &f_last[piece]);
            [dot(column, column)]
        });
        let size = square.sqrt();
        let r = &mut self.r[k * depth..(k + 1) * depth];
        r.fill(0.0);
        let mut left = size;
        for _ in 0..2 {
            if budget::over() {
                return;
            }
            let along = &mut self.gamma[..k];
            dots(done, column, along);
            r.iter_mut().zip(&*along).for_each(|(r, along)| *r += along);
            left = take_out(column, along, done);
        }
        // A column that the others span, or that is not finite, adds nothing.
        if !(left > size / CONDITION && left.is_finite()) {
            return;
        }
        r[k] = left;
        let slot = (0..depth).find(|s| !self.slots.contains(s)).unwrap_or(0);
        let (dg, g_last) = (&mut self.dg[slot * n..(slot + 1) * n], &self.g_last);
        pieces::writing(n, PIECE, [column, dg], |piece, [column, dg]| {
            column.iter_mut().for_each(|x| *x /= left);
            difference(dg, &g[piece.clone()], &g_last[piece]);
            []
        });
        self.slots.push(slot);
    }

    /// Takes the first column out: R without it is a Hessenberg matrix, which rotations make triangular.
    fn drop_oldest(&mut self) {
        let (k, n, depth) = (self.slots.len(), self.n, self.depth);
        self.slots.remove(0);
        self.r.copy_within(depth..k * depth, 0);
        for i in 0..k - 1 {
            let (a, b) = (self.r[i * depth + i], self.r[i * depth + i + 1]);
            let h = a.hypot(b);
            let (c, s) = if h > 0.0 { (a / h, b / h) } else { (1.0, 0.0) };
            for j in i..k - 1 {
                let (x, y) = (self.r[j * depth + i], self.r[j * depth + i + 1]);
                self.r[j * depth + i] = c * x + s * y;
                self.r[j * depth + i + 1] = c * y - s * x;
            }
            let (left, right) = self.q.split_at_mut((i + 1) * n);
            pieces::writing(n, PIECE, [&mut left[i * n..], &mut right[..n]], |_, [x, y]| {
                for (x, y) in x.iter_mut().zip(y) {
                    (*x, *y) = (c * *x + s * *y, c * *y - s * *x);
                }
                []
            });
        }
    }

    /// `‖R‖ ‖R⁻¹‖` in the 1-norm.
    fn condition(&mut self) -> f64 {
        let (k, depth) = (self.slots.len(), self.depth);
        let (mut norm, mut inverse_norm) = (0.0_f64, 0.0_f64);
        for j in 0..k {
            let r = |i: usize, j: usize| self.r[j * depth + i];
            norm = norm.max((0..=j).map(|i| r(i, j).abs()).sum());
            let x = &mut self.inverse[j * depth..(j + 1) * depth];
            x[j] = 1.0 / r(j, j);
            for i in (0..j).rev() {
                let sum: f64 = (i + 1..=j).map(|l| r(i, l) * x[l]).sum();
                x[i] = -sum / r(i, i);
            }
            inverse_norm = inverse_norm.max(x[..=j].iter().map(|x| x.abs()).sum());
        }
        norm * inverse_norm
    }
}

/// A proposal is taken back when the residual that it leads to exceeds that of the step before by this factor.
const GROWTH: f64 = 2.0;

/// [`Anderson`] with a safeguard: a proposal that makes `‖g(x) − x‖` grow is taken back, and its history forgotten.
///
/// ```text
/// begin(x) ── g ── advance(g) ── x may be moved ── begin(x) ── …
/// ```
#[derive(Debug, Clone)]
pub struct Accelerator {
    anderson: Anderson,
    /// x, the last g that was no proposal, and f.
    start: Vec<f64>,
    plain: Vec<f64>,
    f: Vec<f64>,
    /// `‖f‖` where the last proposal was made; infinite before the first.
    size: f64,
    proposed: bool,
}

impl Accelerator {
    /// Accelerates with at most `depth` differences.
    pub fn new(depth: usize, n: usize) -> Self {
        let n = if depth > 0 { n } else { 0 };
        Self {
            anderson: Anderson::new(depth, n),
            start: vec![0.0; n],
            plain: vec![0.0; n],
            f: vec![0.0; n],
            size: f64::INFINITY,
            proposed: false,
        }
    }

    /// Begins anew with vectors of length n; allocates nothing where n is the same.
    pub fn resize(&mut self, n: usize) {
        let n = if self.anderson.depth > 0 { n } else { 0 };
        self.anderson.resize(n);
        for x in [&mut self.start, &mut self.plain, &mut self.f] {
            x.resize(n, 0.0);
        }
        self.forget();
    }

    /// Forgets the history, as after a change of the map g.
    pub fn forget(&mut self) {
        self.anderson.clear();
        (self.size, self.proposed) = (f64::INFINITY, false);
    }

    /// Whether there is anything to do.
    pub fn is_on(&self) -> bool {
        self.anderson.depth > 0
    }

    /// Takes the x from which the next g is computed.
    pub fn begin(&mut self, x: &[f64]) {
        self.start.copy_from_slice(x);
    }

    /// Turns `g(x)` into the next x; returns `‖( weight(i) f_i )_i‖`, `f = g(x) − x`.
    pub fn advance(&mut self, g: &mut [f64], weight: impl Fn(usize) -> f64 + Sync) -> f64 {
        let Self { f, start, .. } = self;
        let [square] = pieces::writing(g.len(), PIECE, [&mut *f], |piece, [f]| {
            for (f, i) in f.iter_mut().zip(piece) {
                *f = weight(i) * (g[i] - start[i]);
            }
            [dot(f, f)]
        });
        let size = square.sqrt();
        if self.proposed && (size.is_nan() || size > GROWTH * self.size) {
            self.anderson.clear();
            self.proposed = false;
            g.copy_from_slice(&self.plain);
            return size;
        }
        self.size = size;
        self.plain.copy_from_slice(g);
        self.proposed = self.anderson.propose(&self.f, g) > 0;
        size
    }

    /// Puts the last `g(x)` back in place of what was proposed for it, and forgets the history.
    pub fn take_back(&mut self, x: &mut [f64]) {
        if self.proposed {
            x.copy_from_slice(&self.plain);
        }
        self.forget();
    }
}

/// The products of x with columns of its length.
fn dots(columns: &[f64], x: &[f64], products: &mut [f64]) {
    let n = x.len();
    for (columns, products) in columns.chunks((GROUP * n).max(1)).zip(products.chunks_mut(GROUP)) {
        let sums: [f64; GROUP] = pieces::sums(n, PIECE, |piece| {
            let mut sums = [0.0; GROUP];
            for (sum, column) in sums.iter_mut().zip(columns.chunks_exact(n)) {
                *sum = dot(&column[piece.clone()], &x[piece.clone()]);
            }
            sums
        });
        products.iter_mut().zip(sums).for_each(|(product, sum)| *product = sum);
    }
}

/// `x ← x − Σ along_j column_j`; returns its norm.
fn take_out(x: &mut [f64], along: &[f64], columns: &[f64]) -> f64 {
    let n = x.len();
    let [square] = pieces::writing(n, PIECE, [x], |piece, [x]| {
        for (along, column) in along.iter().zip(columns.chunks_exact(n)) {
            add(x, -along, &column[piece.clone()]);
        }
        [dot(x, x)]
    });
    square.sqrt()
}

/// `z = x − y`.
fn difference(z: &mut [f64], x: &[f64], y: &[f64]) {
    z.iter_mut().zip(x).zip(y).for_each(|((z, x), y)| *z = x - y);
}

fn add(y: &mut [f64], a: f64, x: &[f64]) {
    y.iter_mut().zip(x).for_each(|(y, x)| *y += a * x);
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A vector that looks random.
    fn noise(seed: usize, n: usize) -> Vec<f64> {
        let wave = |i: usize| ((seed * 977 + i * 131) as f64 * 0.618).sin();
        (0..n).map(|i| (wave(i) * 43_758.545_3).fract()).collect()
    }

    /// The proposal by the normal equations of the last `depth` differences, solved directly.
    fn direct(depth: usize, fs: &[Vec<f64>], gs: &[Vec<f64>]) -> Vec<f64> {
        let last = fs.len() - 1;
        let first = last.saturating_sub(depth);
        let difference = |x: &[Vec<f64>], j: usize| -> Vec<f64> {
            x[j + 1].iter().zip(&x[j]).map(|(a, b)| a - b).collect()
        };
        let df: Vec<_> = (first..last).map(|j| difference(fs, j)).collect();
        let dg: Vec<_> = (first..last).map(|j| difference(gs, j)).collect();
        let k = df.len();
        // Gaussian elimination with the matrix of scalar products, well conditioned here.
        let mut a: Vec<Vec<f64>> = (0..k)
            .map(|i| {
                let mut row: Vec<f64> = (0..k).map(|j| dot(&df[i], &df[j])).collect();
                row.push(dot(&df[i], &fs[last]));
                row
            })
            .collect();
        for i in 0..k {
            for l in 0..k {
                if l != i {
                    let m = a[l][i] / a[i][i];
                    for c in 0..=k {
                        a[l][c] -= m * a[i][c];
                    }
                }
            }
        }
        let mut x = gs[last].clone();
        for i in 0..k {
            add(&mut x, -a[i][k] / a[i][i], &dg[i]);
        }
        x
    }

    #[test]
    fn proposals_are_those_of_the_least_squares_problem() {
        let (depth, n) = (3, 8);
        let mut anderson = Anderson::new(depth, n);
        let (mut fs, mut gs) = (vec![], vec![]);
        for k in 0..9 {
            fs.push(noise(2 * k, n));
            gs.push(noise(2 * k + 1, n));
            let mut x = gs[k].clone();
            assert_eq!(anderson.propose(&fs[k], &mut x), k.min(depth));
            let expected = direct(depth, &fs, &gs);
            for (x, e) in x.iter().zip(&expected) {
                assert!((x - e).abs() < 1e-11, "{k}: {x} {e}");
            }
        }
    }

    #[test]
    fn dependent_differences_are_left_out() {
        let mut anderson = Anderson::new(4, 5);
        let f = noise(1, 5);
        for k in 0..6 {
            let fk: Vec<f64> = f.iter().map(|x| x / (k + 1) as f64).collect();
            let mut g = fk.clone();
            assert!(anderson.propose(&fk, &mut g) <= 1, "all differences are multiples of one");
            assert!(g.iter().all(|x| x.is_finite()));
        }
    }

    #[test]
    fn an_affine_map_is_solved_in_as_many_steps_as_it_has_dimensions() {
        // g(x) = A x + b with a rotation and a shrinking: 0.9 in one plane, 0.5 along the axis.
        let g = |x: &[f64]| vec![0.9 * x[1] + 1.0, -0.9 * x[0] + 0.3 * x[2], 0.5 * x[2] + 2.0];
        let mut accelerator = Accelerator::new(3, 3);
        let mut x = vec![0.0; 3];
        for _ in 0..5 {
            accelerator.begin(&x);
            x = g(&x);
            accelerator.advance(&mut x, |_| 1.0);
        }
        let gx = g(&x);
        assert!(x.iter().zip(&gx).all(|(a, b)| (a - b).abs() < 1e-12), "{x:?} {gx:?}");
    }

    #[test]
    fn a_proposal_that_makes_things_worse_is_taken_back() {
        let mut a = Accelerator::new(1, 1);
        a.begin(&[0.0]);
        let mut x = [1.0];
        a.advance(&mut x, |_| 1.0); // f = 1, nothing to compare with: x = 1
        a.begin(&x);
        x = [1.5];
        a.advance(&mut x, |_| 1.0); // f = 0.5; the secant step: x = 2
        assert!((x[0] - 2.0).abs() < 1e-14);
        a.begin(&x);
        x = [12.0];
        a.advance(&mut x, |_| 1.0); // f = 10 > 2 · 0.5: back to the plain 1.5
        assert_eq!(x, [1.5]);
    }
}
