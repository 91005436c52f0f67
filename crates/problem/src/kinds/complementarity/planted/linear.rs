//! Linear complementarity problems with a planted solution.
//!
//! A matrix of the class is drawn, and z, w with `z_i w_i = 0`; then `q = w − M z`, summed in doubled precision and rounded once. Values of z
//! and w that are not zero lie between 1 and 2 before scaling. Scales are powers of two, so they spoil no digit. Where the matrix has a null space or is not
//! in P, there may be solutions besides the one planted.

use rand::{RngExt, SeedableRng};
use rand_pcg::Pcg64;
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use crate::check::Certificate;
use crate::planted::{Recipe, share, size};
use crate::{BoxLcp, Hlcp, HlcpPoint, Lcp, LcpPoint, Mlcp};
use nonsmooth_linalg::{Compensated, Csc, Dense, Matrix};

/// The classes from which matrices are drawn.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
pub enum PlantedClass {
    /// Symmetric positive definite: `G Gᵀ + diag`.
    Spd,
    /// A nonsingular M-matrix that is not symmetric: off-diagonal entries are negative, rows sum to something positive.
    MMatrix,
    /// Strictly dominant diagonals, off-diagonal entries of both signs: H₊.
    HPlus,
    /// A P-matrix neither positive definite nor in H₊: block triangular after a permutation, with diagonal blocks `D₁ [1 2 0; 0 1 2; 2 0 1] D₂`.
    P,
    /// Positive definite, not symmetric: `AᵀA + B + diag(d)` with B skew, after the generator "lcprand" of DussaultFrappierGilbert2024.
    Lcprand,
    /// Symmetric positive semidefinite of rank at most n/2, a tenth of its rows and columns repeated.
    Psd,
    /// `[H −Aᵀ; A 0]`: the optimality conditions of a convex quadratic program; some rows of A are repeated.
    Kkt,
    /// Copositive-plus and in general not semidefinite: a semidefinite matrix plus a nonnegative one that has a positive diagonal where it has entries.
    CopositivePlus,
    /// The LCP of StewartTrinkle1996 for contacts with friction, six unknowns each: copositive, not copositive-plus.
    Contact,
    /// `[0 A; Bᵀ 0]` with A, B > 0 and `q = −e`: an equilibrium of a bimatrix game.
    Bimatrix,
}

impl PlantedClass {
    /// Every class, for tests that go through them.
    pub const ALL: [Self; 10] = [
        Self::Spd,
        Self::MMatrix,
        Self::HPlus,
        Self::P,
        Self::Lcprand,
        Self::Psd,
        Self::Kkt,
        Self::CopositivePlus,
        Self::Contact,
        Self::Bimatrix,
    ];

    /// Rows and columns may have different scales without leaving the class.
    fn two_sided(self) -> bool {
        matches!(self, Self::MMatrix | Self::HPlus | Self::P | Self::Bimatrix)
    }
}

/// What to plant.
///
/// ```
/// use nonsmooth_problem::check::Judged;
/// use nonsmooth_problem::planted::{PlantedClass, PlantedLcp};
///
/// let (problem, known) = PlantedLcp { n: 30, class: PlantedClass::P, ..PlantedLcp::default() }.lcp();
/// assert!(problem.judge(&known, 1e-13)?.solved);
/// # Ok::<(), nonsmooth_problem::ProblemError>(())
/// ```
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields, default)]
pub struct PlantedLcp {
    /// The number of variables, at least 2; a multiple of 6 for contact, or rounded up to one.
    pub n: usize,
    /// The class of the matrix.
    pub class: PlantedClass,
    /// The share of entries that are not zero, about; 1 gives a dense matrix.
    pub density: f64,
    /// The share of variables with z > 0 among those that are not degenerate.
    pub active: f64,
    /// The share of variables with z = w = 0.
    pub degenerate: f64,
    /// Rows and columns are scaled by powers of two from 10^-decades to 10^decades.
    pub decades: f64,
    /// The seed: the same seed gives the same problem to the bit.
    pub seed: u64,
}

impl Default for PlantedLcp {
    fn default() -> Self {
        Self {
            n: 20,
            class: PlantedClass::Spd,
            density: 1.0,
            active: 0.5,
            degenerate: 0.0,
            decades: 0.0,
            seed: 0,
        }
    }
}

/// A whole number of variables that a machine can hold.
const MOST: usize = 100_000_000;

impl Recipe for PlantedLcp {
    fn validate(&self) -> Result<(), String> {
        size("n", self.n, 2..=MOST)?;
        share("density", self.density)?;
        share("active", self.active)?;
        share("degenerate", self.degenerate)?;
        match (0.0..=20.0).contains(&self.decades) {
            true => Ok(()),
            false => Err(format!("decades: expected from 0 to 20, found {}", self.decades)),
        }
    }
}

/// Entries to be added up.
type Entries = Vec<(usize, usize, f64)>;

impl PlantedLcp {
    /// An LCP and a solution of it.
    pub fn lcp(&self) -> (Lcp, LcpPoint) {
        let mut rng = Pcg64::seed_from_u64(self.seed);
        let n = self.rows();
        let mut pairs = self.pairs(n, &mut rng);
        let mut entries = self.entries(n, None, &mut rng);
        if self.class == PlantedClass::Bimatrix {
            entries = self.game(n, &mut pairs, &mut rng);
        }
        let (row, column) = self.scales(n, &mut rng);
        let m = self.matrix(n, entries, &row, &column);
        // In the new units: z over the scale of its column, w times that of its row.
        let z: Vec<_> = pairs.iter().zip(&column).map(|(p, c)| p.0 / c).collect();
        let w: Vec<_> = pairs.iter().zip(&row).map(|(p, r)| p.1 * r).collect();
        let q = if self.class == PlantedClass::Bimatrix {
            row.iter().map(|r| -r).collect()
        } else {
            minus_product(&w, &[(&m, &z)])
        };
        let problem = Lcp { M: m, q };
        problem.validate().expect("a planted problem is valid");
        (problem, LcpPoint { z })
    }

    /// The fewest variables of a problem without a solution.
    pub const LEAST_INFEASIBLE: usize = 6;

    /// An LCP without a solution, and a Farkas vector that proves it. `None` of a class in which every problem, or every feasible one, is
    /// solvable: all but `Psd`, `Kkt` and `CopositivePlus`. Fewer than [`LEAST_INFEASIBLE`](Self::LEAST_INFEASIBLE) variables are as many. What proves it vanishes with M to the last
    /// bit, while n is below a thousand: the entries that it meets are of few bits.
    pub fn infeasible(&self) -> Option<(Lcp, Certificate)> {
        use PlantedClass::{CopositivePlus, Kkt, Psd};
        if !matches!(self.class, Psd | Kkt | CopositivePlus) {
            return None;
        }
        let mut rng = Pcg64::seed_from_u64(self.seed);
        let n = self.rows().max(Self::LEAST_INFEASIBLE);
        let pairs = self.pairs(n, &mut rng);
        // A vector y ≥ 0 on a few rows, with yᵀ M = 0.
        let first = self.farkas_rows(n);
        let mut y = vec![0.0; n];
        for k in first.clone() {
            y[k] = f64::from(rng.random_range(1..3_u8));
        }
        let entries = self.entries(n, Some(&y), &mut rng);
        let (row, column) = self.scales(n, &mut rng);
        let m = self.matrix(n, entries, &row, &column);
        let z: Vec<_> = pairs.iter().zip(&column).map(|(p, c)| p.0 / c).collect();
        let w: Vec<_> = pairs.iter().zip(&row).map(|(p, r)| p.1 * r).collect();
        let mut q = minus_product(&w, &[(&m, &z)]);
        let gain: f64 = first.clone().map(|k| y[k] * pairs[k].1).sum();
        // yᵀ q = yᵀ w so far.
        for k in first.clone() {
            q[k] -= row[k] * (gain + 1.0 + y[k]) / (first.len() as f64 * y[k]);
        }
        y.iter_mut().zip(&row).for_each(|(y, r)| *y /= r);
        let problem = Lcp { M: m, q };
        problem.validate().expect("a planted problem is valid");
        Some((problem, Certificate::Farkas { y }))
    }

    /// A horizontal problem `X M x − X s = q`, X nonsingular and sparse, and a solution of it. Monotone where M is semidefinite.
    pub fn hlcp(&self) -> (Hlcp, HlcpPoint) {
        let (lcp, LcpPoint { z }) = self.lcp();
        let n = lcp.dim();
        let mut rng = Pcg64::seed_from_u64(self.seed ^ 0x5eed);
        let mut s = vec![0.0; n];
        lcp.M.mul(&z, &mut s);
        for i in 0..n {
            // Of a pair one is zero to the bit.
            let w = s[i] + lcp.q[i];
            s[i] =
                if z[i] > 0.0 || w.abs() <= 1e-9 * (lcp.q[i].abs() + s[i].abs()) { 0.0 } else { w };
        }
        // X: a unit diagonal and a smaller entry beside it.
        let other: Vec<_> = (0..n)
            .map(|i| {
                (rng.random_range(0..n), if n > 1 { rng.random_range(-0.5..0.5) } else { 0.0 }, i)
            })
            .filter(|(j, _, i)| i != j)
            .collect();
        let m = lcp.M.to_csc().expect("planted matrices have entries");
        let rows = m.transpose();
        let mixed = other.iter().flat_map(|&(j, x, i)| {
            let (columns, values) = rows.column(j);
            columns.iter().zip(values).map(move |(&k, v)| (i, k, x * v)).collect::<Vec<_>>()
        });
        let q_entries: Vec<_> = m.triplets().chain(mixed).collect();
        let unit = (0..n).map(|i| (i, i, -1.0));
        let r_entries: Vec<_> = unit.chain(other.iter().map(|&(j, x, i)| (i, j, -x))).collect();
        let big = Csc::from_triplets(n, n, q_entries.into_iter()).expect("in range");
        let r = Csc::from_triplets(n, n, r_entries.into_iter()).expect("in range");
        let kept = |a: Csc| match &lcp.M {
            Matrix::Dense(_) => Matrix::from(a).to_dense().map(Matrix::from).expect("entries"),
            _ => Matrix::from(a),
        };
        let (big, r) = (kept(big), kept(r));
        let minus = minus_product(&vec![0.0; n], &[(&big, &z), (&r, &s)]);
        let problem = Hlcp { Q: big, R: r, q: minus.iter().map(|q| -q).collect() };
        problem.validate().expect("a planted problem is valid");
        (problem, HlcpPoint { x: z, s })
    }

    /// A box LCP with the same matrix, and a solution of it: variables inside, at either bound, fixed, free; `degenerate` of them at a bound with `w_i = 0`.
    pub fn boxed(&self) -> (BoxLcp, LcpPoint) {
        let mut rng = Pcg64::seed_from_u64(self.seed);
        let n = self.rows();
        let entries = self.entries(n, None, &mut rng);
        let (row, column) = self.scales(n, &mut rng);
        let m = self.matrix(n, entries, &row, &column);
        let (mut z, mut w) = (vec![0.0; n], vec![0.0; n]);
        let (mut lower, mut upper) = (vec![0.0; n], vec![0.0; n]);
        for i in 0..n {
            let value: f64 = rng.random_range(-2.0..2.0);
            let (below, above) = (rng.random_range(1.0..2.0), rng.random_range(1.0..2.0));
            let force = rng.random_range(1.0..2.0);
            let unbounded = rng.random_range(0.0..1.0) < 0.2;
            let degenerate = rng.random_range(0.0..1.0) < self.degenerate;
            // Inside, at l, at u, fixed.
            let kind = rng.random_range(0..if degenerate { 2 } else { 7 });
            let (l, u, force) = match (degenerate, kind) {
                (true, 0) => (value, value + above, 0.0),
                (true, _) => (value - below, value, 0.0),
                (_, 0..3) if unbounded => (f64::NEG_INFINITY, f64::INFINITY, 0.0),
                (_, 0..3) => (value - below, value + above, 0.0),
                (_, 3..5) => (value, if unbounded { f64::INFINITY } else { value + above }, force),
                (_, 5) => {
                    (if unbounded { f64::NEG_INFINITY } else { value - below }, value, -force)
                }
                _ => (value, value, if value > 0.0 { force } else { -force }),
            };
            (z[i], w[i]) = (value / column[i], force * row[i]);
            (lower[i], upper[i]) = (l / column[i], u / column[i]);
        }
        let q = minus_product(&w, &[(&m, &z)]);
        let problem = BoxLcp { M: m, q, lower, upper };
        problem.validate().expect("a planted problem is valid");
        (problem, LcpPoint { z })
    }

    fn rows(&self) -> usize {
        match self.class {
            PlantedClass::Contact => 6 * self.n.div_ceil(6).max(1),
            _ => self.n.max(2),
        }
    }

    fn is_dense(&self) -> bool {
        self.density >= 1.0
    }

    /// About how many entries a row has besides the diagonal.
    fn neighbours(&self, n: usize) -> usize {
        let count = (self.density.clamp(0.0, 1.0) * n as f64).round() as usize;
        count.clamp(2, n.max(2)).min(n - 1)
    }

    /// `(z_i, w_i)`, one of them zero or both.
    fn pairs(&self, n: usize, rng: &mut Pcg64) -> Vec<(f64, f64)> {
        let pair = |_| {
            let value = rng.random_range(1.0..2.0);
            let (share, side) = (rng.random_range(0.0..1.0), rng.random_range(0.0..1.0));
            match (share < self.degenerate, side < self.active) {
                (true, _) => (0.0, 0.0),
                (_, true) => (value, 0.0),
                _ => (0.0, value),
            }
        };
        (0..n).map(pair).collect()
    }

    /// Scales of rows and columns, powers of two.
    fn scales(&self, n: usize, rng: &mut Pcg64) -> (Vec<f64>, Vec<f64>) {
        let most = self.decades.abs() * std::f64::consts::LOG2_10;
        let mut draw = || (0..n).map(|_| rng.random_range(-most..=most).round().exp2()).collect();
        let row: Vec<f64> = draw();
        let column: Vec<f64> = draw();
        if self.class.two_sided() { (row, column) } else { (row.clone(), row) }
    }

    fn matrix(&self, n: usize, entries: Entries, row: &[f64], column: &[f64]) -> Matrix {
        let scaled = entries.iter().map(|&(i, j, x)| (i, j, row[i] * x * column[j]));
        if self.is_dense() {
            let mut out = Dense::zeros(n, n);
            scaled.for_each(|(i, j, x)| out[(i, j)] += x);
            return out.into();
        }
        Csc::from_triplets(n, n, scaled).expect("rows and columns in range").into()
    }

    /// The rows on which Farkas vectors of infeasible problems live.
    fn farkas_rows(&self, n: usize) -> std::ops::Range<usize> {
        match self.class {
            // Constraints of the program: the last rows.
            PlantedClass::Kkt => n - n.div_ceil(3)..n - n.div_ceil(3) + 2,
            _ => 0..3,
        }
    }

    /// The entries of M; with `yᵀ M = 0` where y is given.
    fn entries(&self, n: usize, y: Option<&[f64]>, rng: &mut Pcg64) -> Entries {
        let mut out = vec![];
        let k = self.neighbours(n);
        match self.class {
            PlantedClass::Spd => {
                self.gram(&mut out, (0..n).collect(), n, None, rng);
                out.extend((0..n).map(|i| (i, i, rng.random_range(0.5..1.0))));
            }
            PlantedClass::MMatrix | PlantedClass::HPlus => {
                let mut sums = vec![0.0; n];
                for i in 0..n {
                    for j in self.others(i, n, k, rng) {
                        let x = -rng.random_range(0.1..1.0);
                        let flip = self.class == PlantedClass::HPlus && rng.random_range(0..2) == 0;
                        sums[i] -= x;
                        out.push((i, j, if flip { -x } else { x }));
                    }
                }
                let margin = |sum: &f64| sum * rng.random_range(1.01..1.2) + 0.1;
                let diagonal: Vec<_> = sums.iter().map(margin).collect();
                out.extend(diagonal.iter().enumerate().map(|(i, &d)| (i, i, d)));
            }
            PlantedClass::P => self.blocks(&mut out, n, k, rng),
            PlantedClass::Lcprand => {
                // Five standard deviations of U(−1, 1) as there; A has n rows.
                self.gram(&mut out, (0..n).collect(), n, None, rng);
                for i in 0..n {
                    for j in self.others(i, n, k, rng).into_iter().filter(|&j| j > i) {
                        let x = rng.random_range(-1.0..1.0);
                        out.extend([(i, j, x), (j, i, -x)]);
                    }
                }
                out.extend((0..n).map(|i| (i, i, rng.random_range(0.01..0.3))));
            }
            PlantedClass::Psd => {
                self.gram(&mut out, repeated(n, rng), n.div_ceil(2) - 1, y, rng);
            }
            PlantedClass::Kkt => {
                let m = n.div_ceil(3);
                let h = n - m;
                self.gram(&mut out, (0..h).collect(), h.div_ceil(2), None, rng);
                let like = repeated(m, rng);
                let mut rows: Vec<Vec<(usize, f64)>> = vec![];
                for i in 0..m {
                    let row = match like[i] {
                        same if same < i => rows[same].clone(),
                        _ => (self.others(h, h, k.min(h), rng).into_iter())
                            .map(|j| (j, rng.random_range(-1.0..1.0)))
                            .collect(),
                    };
                    rows.push(row);
                }
                if let Some(y) = y {
                    // The second row cancels the first.
                    let ratio = -y[h] / y[h + 1];
                    rows[1] = rows[0].iter().map(|&(j, x)| (j, ratio * x)).collect();
                }
                for (i, row) in rows.iter().enumerate() {
                    out.extend(row.iter().flat_map(|&(j, x)| [(h + i, j, x), (j, h + i, -x)]));
                }
            }
            PlantedClass::CopositivePlus => {
                self.gram(&mut out, (0..n).collect(), n.div_ceil(2), y, rng);
                let half = n.div_ceil(2);
                for i in half..n {
                    out.push((i, i, rng.random_range(0.1..1.0)));
                    let others = self.others(i - half, n - half, k.min(n - half), rng);
                    out.extend(others.iter().map(|&j| (i, half + j, rng.random_range(0.0..3.0))));
                }
            }
            PlantedClass::Contact => self.contacts(&mut out, n / 6, rng),
            PlantedClass::Bimatrix => {
                let a = n / 2;
                for i in 0..n {
                    let columns = if i < a { a..n } else { 0..a };
                    out.extend(columns.map(|j| (i, j, rng.random_range(0.1..1.0))));
                }
            }
        }
        out
    }

    /// `count` different indices below n, without i; all others where the matrix is dense.
    fn others(&self, i: usize, n: usize, count: usize, rng: &mut Pcg64) -> Vec<usize> {
        if self.is_dense() || 2 * count >= n {
            return (0..n).filter(|&j| j != i).collect();
        }
        let mut found: Vec<_> = (0..count).map(|_| rng.random_range(0..n)).collect();
        found.sort_unstable();
        found.dedup();
        found.retain(|&j| j != i);
        found
    }

    /// Adds `G Gᵀ`, G with this many columns; row i of G is that of `like[i]`. With y given, `yᵀ G = 0`.
    fn gram(
        &self,
        out: &mut Entries,
        like: Vec<usize>,
        columns: usize,
        y: Option<&[f64]>,
        rng: &mut Pcg64,
    ) {
        let n = like.len();
        let mut copies = vec![vec![]; n];
        like.iter().enumerate().for_each(|(i, &j)| copies[j].push(i));
        // A column with m entries gives m² entries of the product.
        let per_column = if self.is_dense() {
            n
        } else {
            ((self.density * (n * n) as f64 / columns.max(1) as f64).sqrt().round() as usize)
                .clamp(2, 32)
                .min(n)
        };
        let size = 1.0 / (per_column as f64).sqrt();
        let dense = self.is_dense();
        let mut sum = if dense { vec![0.0; n * n] } else { vec![] };
        let mut column: Vec<(usize, f64)> = vec![];
        for c in 0..columns {
            column.clear();
            // Every row is met by some column, as far as there are enough.
            let first = (c * n) / columns.max(1);
            let mut rows: Vec<_> = if per_column == n {
                (0..n).collect()
            } else {
                std::iter::once(first)
                    .chain((1..per_column).map(|_| rng.random_range(0..n)))
                    .collect()
            };
            rows.sort_unstable();
            rows.dedup();
            for i in rows {
                let mut x = size * rng.random_range(-1.0..1.0);
                if y.is_some() {
                    x = (x * FEW_BITS).round() / FEW_BITS;
                }
                column.extend(copies[i].iter().map(|&k| (k, x)));
            }
            if let Some(y) = y {
                cancel(&mut column, y);
            }
            for &(i, a) in &column {
                for &(j, b) in &column {
                    if dense {
                        sum[i * n + j] += a * b;
                    } else {
                        out.push((i, j, a * b));
                    }
                }
            }
        }
        out.extend(sum.iter().enumerate().map(|(k, &x)| (k / n, k % n, x)));
    }

    /// Blocks `D₁ [1 2 0; 0 1 2; 2 0 1] D₂`, anything above them, and a permutation of all.
    fn blocks(&self, out: &mut Entries, n: usize, k: usize, rng: &mut Pcg64) {
        let mut order: Vec<_> = (0..n).collect();
        for i in (1..n).rev() {
            order.swap(i, rng.random_range(0..=i));
        }
        let scale: Vec<(f64, f64)> =
            (0..n).map(|_| (rng.random_range(0.5..2.0), rng.random_range(0.5..2.0))).collect();
        let mut entries = vec![];
        for start in (0..n).step_by(3) {
            let size = 3.min(n - start);
            for a in 0..size {
                let (i, next) = (start + a, start + (a + 1) % size);
                entries.push((i, i, scale[i].0 * scale[i].1));
                if next != i && (size == 3 || next > i) {
                    entries.push((i, next, 2.0 * scale[i].0 * scale[next].1));
                }
                let above = n - (start + size);
                if above > 0 {
                    let others = self.others(above, above, k.min(above), rng);
                    let coupling = if self.is_dense() { 3.0 / n as f64 } else { 1.0 };
                    entries.extend(
                        others.iter().map(|&j| {
                            (i, start + size + j, coupling * rng.random_range(-2.0..2.0))
                        }),
                    );
                }
            }
        }
        out.extend(entries.into_iter().map(|(i, j, x)| (order[i], order[j], x)));
    }

    /// `[[W_NN, W_NT D, 0], [Dᵀ W_TN, Dᵀ W_TT D, E], [mu, −Eᵀ, 0]]` with four directions; contact c has the rows 6 c to 6 c + 5: r_N, β, λ.
    fn contacts(&self, out: &mut Entries, contacts: usize, rng: &mut Pcg64) {
        const AXES: [[f64; 3]; 5] =
            [[1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0], [0.0, -1.0, 0.0], [0.0, 0.0, -1.0]];
        // Bodies of three degrees of freedom and unit mass; each contact touches two of them.
        let bodies = contacts.div_ceil(2).max(2);
        let mut touched: Vec<[(usize, [f64; 9]); 2]> = vec![];
        for c in 0..contacts {
            let a = c % bodies;
            let b = (a + 1 + rng.random_range(0..bodies - 1)) % bodies;
            let mut map = || std::array::from_fn(|_| rng.random_range(-1.0..1.0));
            touched.push([(a, map()), (b, map())]);
        }
        let mut at_body = vec![vec![]; bodies];
        for (c, sides) in touched.iter().enumerate() {
            sides.iter().for_each(|(body, map)| at_body[*body].push((c, map)));
        }
        for met in &at_body {
            for &(c, a) in met {
                for &(d, b) in met {
                    // W_cd = A Bᵀ, seen along the axes.
                    let w = |k: usize, l: usize| {
                        (0..3).map(|x| a[3 * k + x] * b[3 * l + x]).sum::<f64>()
                    };
                    for (i, along) in AXES.iter().enumerate() {
                        for (j, other) in AXES.iter().enumerate() {
                            let entry: f64 =
                                (0..9).map(|t| along[t / 3] * w(t / 3, t % 3) * other[t % 3]).sum();
                            out.push((6 * c + i, 6 * d + j, entry));
                        }
                    }
                }
            }
        }
        for c in 0..contacts {
            out.push((6 * c + 5, 6 * c, rng.random_range(0.2..0.9)));
            out.extend(
                (1..5).flat_map(|i| [(6 * c + i, 6 * c + 5, 1.0), (6 * c + 5, 6 * c + i, -1.0)]),
            );
        }
    }

    /// The entries of a game with `q = −e` of which the first of each pair are an equilibrium; sets the second of each.
    fn game(&self, n: usize, pairs: &mut [(f64, f64)], rng: &mut Pcg64) -> Entries {
        let a = n / 2;
        // Each side plays something.
        for range in [0..a, a..n] {
            if range.clone().all(|i| pairs[i].0 == 0.0) {
                pairs[range.start] = (1.0, 0.0);
            }
        }
        let mut out = vec![];
        for i in 0..n {
            let columns = if i < a { a..n } else { 0..a };
            let mut row: Vec<_> = columns.map(|j| (j, rng.random_range(0.1..1.0))).collect();
            let payoff: f64 = row.iter().map(|&(j, x)| x * pairs[j].0).sum();
            let wanted = 1.0 + pairs[i].1;
            row.iter_mut().for_each(|e| e.1 *= wanted / payoff);
            out.extend(row.into_iter().map(|(j, x)| (i, j, x)));
        }
        out
    }
}

/// For each of n rows the row that it repeats: a tenth of them, at least one, repeat an earlier one, the others themselves.
fn repeated(n: usize, rng: &mut Pcg64) -> Vec<usize> {
    let first = n - n.div_ceil(10).min(n - 1);
    (0..n).map(|i| if i < first { i } else { rng.random_range(0..first) }).collect()
}

/// Products of numbers of so few bits below one, and sums of a thousand of them, are exact.
const FEW_BITS: f64 = (1 << 18) as f64;

/// Changes the column so that its product with y, of ones and twos, vanishes.
fn cancel(column: &mut Vec<(usize, f64)>, y: &[f64]) {
    let sum: f64 = column.iter().map(|&(i, x)| y[i] * x).sum();
    match column.iter().filter(|e| y[e.0] > 0.0).count() {
        0 => {}
        // A single entry has nothing to cancel against.
        1 => column.retain(|e| y[e.0] == 0.0),
        _ => {
            let last = column.iter_mut().rfind(|e| y[e.0] > 0.0).expect("there are two");
            last.1 -= sum / y[last.0];
        }
    }
}

/// `w − Σ A x`, in doubled precision, rounded once.
fn minus_product(w: &[f64], terms: &[(&Matrix, &Vec<f64>)]) -> Vec<f64> {
    let mut sums: Vec<_> = w.iter().map(|&w| Compensated::from(w)).collect();
    for (m, x) in terms {
        m.for_each(|i, j, a| sums[i].add_product(-a, x[j]));
    }
    sums.into_iter().map(Compensated::value).collect()
}

/// What the blocks of a planted mixed problem are like. `[A C; D B]` is positive semidefinite, with `D = −Cᵀ`.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
pub enum PlantedBlocks {
    /// A and B are positive definite: the problem reduces to an LCP.
    Regular,
    /// A has half its rank: the problem does not reduce.
    SingularA,
    /// A is positive definite, B = 0: the optimality conditions of a program with inequalities.
    NoB,
}

impl PlantedBlocks {
    /// Every shape of the blocks, for tests that go through them.
    pub const ALL: [Self; 3] = [Self::Regular, Self::SingularA, Self::NoB];
}

/// A mixed problem to plant.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields, default)]
pub struct PlantedMlcp {
    /// The number of free variables, at least 1.
    pub free: usize,
    /// The number of complementary pairs, at least 1.
    pub pairs: usize,
    /// What the blocks are like: all regular, A of half its rank, or B zero.
    pub blocks: PlantedBlocks,
    /// Equalities that repeat another one, so that A has more rows than columns.
    pub redundant: usize,
    /// The share of entries that are not zero, about; 1 gives a dense matrix.
    pub density: f64,
    /// The share of pairs with v = w = 0.
    pub degenerate: f64,
    /// The seed: the same seed gives the same problem to the bit.
    pub seed: u64,
}

impl Default for PlantedMlcp {
    fn default() -> Self {
        Self {
            free: 8,
            pairs: 12,
            blocks: PlantedBlocks::Regular,
            redundant: 0,
            density: 1.0,
            degenerate: 0.0,
            seed: 0,
        }
    }
}

impl Recipe for PlantedMlcp {
    fn validate(&self) -> Result<(), String> {
        size("free", self.free, 1..=MOST)?;
        size("pairs", self.pairs, 1..=MOST)?;
        size("redundant", self.redundant, 0..=MOST)?;
        share("density", self.density)?;
        share("degenerate", self.degenerate)
    }
}

impl PlantedMlcp {
    /// A mixed problem and a solution of it.
    pub fn mlcp(&self) -> (Mlcp, LcpPoint) {
        let mut rng = Pcg64::seed_from_u64(self.seed);
        let (free, pairs) = (self.free.max(1), self.pairs.max(1));
        let n = free + pairs;
        let style = PlantedLcp {
            density: self.density,
            degenerate: self.degenerate,
            ..PlantedLcp::default()
        };
        let mut entries: Entries = vec![];
        let mut gram = |size: usize, at: usize, definite: bool, entries: &mut Entries| {
            let columns = if definite { size } else { size / 2 };
            let mut block = vec![];
            style.gram(&mut block, (0..size).collect(), columns, None, &mut rng);
            if definite {
                block.extend((0..size).map(|i| (i, i, 0.5)));
            }
            entries.extend(block.into_iter().map(|(i, j, x)| (at + i, at + j, x)));
        };
        gram(free, 0, self.blocks != PlantedBlocks::SingularA, &mut entries);
        if self.blocks != PlantedBlocks::NoB {
            gram(pairs, free, true, &mut entries);
        }
        let k = style.neighbours(n);
        for i in 0..free {
            // Each free variable is held by a pair of its own, as far as there are enough.
            let mut coupled = style.others(pairs, pairs, k.min(pairs), &mut rng);
            coupled.push(i % pairs);
            coupled.sort_unstable();
            coupled.dedup();
            for j in coupled {
                let x = rng.random_range(-1.0..1.0);
                entries.extend([(i, free + j, x), (free + j, i, -x)]);
            }
        }
        // Equalities first: the redundant ones go between A and B.
        let extra = self.redundant;
        let like: Vec<_> = (0..extra).map(|_| rng.random_range(0..free)).collect();
        let factor: Vec<f64> = (0..extra).map(|_| f64::from(rng.random_range(1..4_u8))).collect();
        let mut placed: Entries = vec![];
        for (i, j, x) in entries {
            placed.push((if i < free { i } else { i + extra }, j, x));
            for (k, _) in like.iter().enumerate().filter(|(_, l)| **l == i) {
                placed.push((free + k, j, factor[k] * x));
            }
        }
        let m: Matrix = if self.density >= 1.0 {
            let mut out = Dense::zeros(n + extra, n);
            placed.iter().for_each(|&(i, j, x)| out[(i, j)] += x);
            out.into()
        } else {
            Csc::from_triplets(n + extra, n, placed.into_iter()).expect("in range").into()
        };
        let known = style.pairs(pairs, &mut rng);
        let z: Vec<f64> = (0..free)
            .map(|_| rng.random_range(-2.0..2.0))
            .chain(known.iter().map(|p| p.0))
            .collect();
        let w: Vec<f64> =
            std::iter::repeat_n(0.0, free + extra).chain(known.iter().map(|p| p.1)).collect();
        let mut q = minus_product(&w, &[(&m, &z)]);
        // A repeated equality is the same to the bit, so that the two never contradict each other.
        for k in 0..extra {
            q[free + k] = factor[k] * q[like[k]];
        }
        let problem = Mlcp { M: m, q, equalities: free + extra, free };
        problem.validate().expect("a planted problem is valid");
        (problem, LcpPoint { z })
    }
}
