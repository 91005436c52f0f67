//! Least squares with nonnegative unknowns, `min ‖A t − b‖, t ≥ 0`, dense and small.
//!
//! Method: the columns in use are kept as Q R; the one that points most along what is left comes in, and where that makes some coefficient negative the step is cut short and the column whose coefficient vanishes goes.
//! The columns that another problem like it used come first.
//!
//! Optimality: `ρ = b − A t` has `Aᵀρ ≤ 0`, with equality where t > 0. So where ρ is not zero `y = −ρ` separates b from all nonnegative combinations: `Aᵀy ≥ 0`, `yᵀb = −‖ρ‖²`.
//!
//! References: LawsonHanson1974, ch. 23.
//! Cost: `rows · columns` for one that comes, as much as all columns in use for one that goes.

use nonsmooth_linalg::{dot, norm};

/// A column that points less than this along what is left, both of length 1, is of no use.
const ALONG: f64 = 1e-12;
/// What is left of a column, of its length, that depends on those in use.
const DEPENDENT: f64 = 1e-11;

/// The problem, and its solution.
#[derive(Debug, Default)]
pub(super) struct LeastSquares {
    rows: usize,
    /// Of each row whether it counts.
    counts: Vec<bool>,
    b: Vec<f64>,
    columns: Vec<f64>,
    /// Of each column its length, or what no length is below.
    sizes: Vec<f64>,
    /// The columns in use, with the orthonormal basis and the triangle that are made of them, by columns of `rows` entries.
    used: Vec<usize>,
    q: Vec<f64>,
    r: Vec<f64>,
    t: Vec<f64>,
    residual: Vec<f64>,
}

impl LeastSquares {
    /// Another problem, without columns yet.
    pub(super) fn begin(&mut self, b: &[f64]) {
        self.rows = b.len();
        self.counts.clear();
        self.counts.resize(b.len(), true);
        self.b.clear();
        self.b.extend_from_slice(b);
        for x in [&mut self.columns, &mut self.q, &mut self.r, &mut self.t] {
            x.clear();
        }
        self.used.clear();
    }

    /// One more column.
    pub(super) fn push(&mut self, column: &[f64]) {
        self.columns.extend_from_slice(column);
    }

    /// Rows that do not count.
    pub(super) fn leave_out(&mut self, rows: std::ops::Range<usize>) {
        self.counts[rows].fill(false);
    }

    /// All is said; the columns to begin with.
    pub(super) fn start(&mut self, with: impl Iterator<Item = usize>) {
        let Self { rows, counts, b, columns, .. } = self;
        for x in std::iter::once(&mut b[..]).chain(columns.chunks_mut(*rows)) {
            x.iter_mut()
                .zip(counts.iter())
                .filter(|(_, counts)| !**counts)
                .for_each(|(x, _)| *x = 0.0);
        }
        self.t.resize(self.columns.len() / self.rows, 0.0);
        self.sizes.clear();
        self.sizes.extend(self.columns.chunks(self.rows).map(|a| norm(a).max(f64::MIN_POSITIVE)));
        for j in with {
            self.take(j);
        }
        // No coefficients are known yet that were nonnegative: what is negative goes.
        loop {
            let t = self.coefficients();
            let Some(worst) =
                (0..t.len()).filter(|&k| t[k] <= 0.0).min_by(|&a, &b| t[a].total_cmp(&t[b]))
            else {
                self.put(&t);
                return;
            };
            self.drop_from(worst);
        }
    }

    /// Solves it, and returns `‖b − A t‖`; zero, which is no answer, where the method goes round.
    pub(super) fn solve(&mut self) -> f64 {
        let n = self.t.len();
        // Columns that rounding has sent away again, until another one has come.
        let mut refused = vec![false; n];
        for _ in 0..10 * (self.rows + n) {
            self.see();
            let left = norm(&self.residual);
            let along = |j: usize| dot(self.column(j), &self.residual) / self.sizes[j];
            let best = (0..n)
                .filter(|&j| !refused[j] && !self.used.contains(&j))
                .map(|j| (j, along(j)))
                .max_by(|a, b| a.1.total_cmp(&b.1));
            let Some((j, _)) = best.filter(|(_, x)| *x > ALONG * left && left > f64::EPSILON)
            else {
                return left;
            };
            refused[j] = true;
            if self.take(j) && self.go_on() {
                refused.fill(false);
            }
        }
        0.0
    }

    /// Goes to the least over the columns in use, of which the last one is new, as far as no coefficient becomes negative; false where that one goes again at once.
    fn go_on(&mut self) -> bool {
        let new = *self.used.last().expect("one has come");
        let mut stays = true;
        loop {
            let t = self.coefficients();
            let limit = |k: usize| {
                let now = self.t[self.used[k]];
                if now > 0.0 { now / (now - t[k]) } else { 0.0 }
            };
            let blocking = (0..t.len()).filter(|&k| t[k] <= 0.0);
            let Some(k) = blocking.min_by(|&a, &b| limit(a).total_cmp(&limit(b))) else {
                self.put(&t);
                return stays;
            };
            stays &= self.used[k] != new;
            let step = limit(k);
            for (&j, t) in self.used.iter().zip(&t) {
                self.t[j] += step * (t - self.t[j]);
            }
            self.drop_from(k);
        }
    }

    /// t_j.
    pub(super) fn coefficient(&self, j: usize) -> f64 {
        self.t[j]
    }

    /// `b − A t`.
    pub(super) fn residual(&self) -> &[f64] {
        &self.residual
    }

    fn column(&self, j: usize) -> &[f64] {
        &self.columns[self.rows * j..][..self.rows]
    }

    /// The residual: of b what is orthogonal to the columns in use.
    fn see(&mut self) {
        let Self { rows, b, q, residual, .. } = self;
        residual.clone_from(b);
        // The second time for what the rounding of the first has left.
        for q in q.chunks(*rows).chain(q.chunks(*rows)) {
            let along = dot(q, residual);
            residual.iter_mut().zip(q).for_each(|(x, q)| *x -= along * q);
        }
    }

    /// Takes a column into use; false where it depends on those that are.
    fn take(&mut self, j: usize) -> bool {
        let rows = self.rows;
        let mut x = self.column(j).to_vec();
        let size = norm(&x);
        let mut triangle = vec![0.0; rows];
        for _ in 0..2 {
            for (k, q) in self.q.chunks(rows).enumerate() {
                let along = dot(q, &x);
                triangle[k] += along;
                x.iter_mut().zip(q).for_each(|(x, q)| *x -= along * q);
            }
        }
        let left = norm(&x);
        if self.used.len() == rows || left <= DEPENDENT * size {
            return false;
        }
        x.iter_mut().for_each(|x| *x /= left);
        triangle[self.used.len()] = left;
        self.q.extend_from_slice(&x);
        self.r.extend_from_slice(&triangle);
        self.used.push(j);
        true
    }

    /// Puts the k-th column in use out of it.
    fn drop_from(&mut self, k: usize) {
        let after = self.used.split_off(k);
        self.q.truncate(self.rows * k);
        self.r.truncate(self.rows * k);
        self.t[after[0]] = 0.0;
        for &j in &after[1..] {
            if !self.take(j) {
                self.t[j] = 0.0;
            }
        }
    }

    /// The coefficients of the columns in use without regard to signs: `R t = Qᵀ b`.
    fn coefficients(&self) -> Vec<f64> {
        let rows = self.rows;
        let mut t: Vec<f64> = self.q.chunks(rows).map(|q| dot(q, &self.b)).collect();
        for k in (0..t.len()).rev() {
            let column = &self.r[rows * k..][..rows];
            t[k] /= column[k];
            let now = t[k];
            t[..k].iter_mut().zip(column).for_each(|(t, r)| *t -= r * now);
        }
        t
    }

    fn put(&mut self, t: &[f64]) {
        self.t.fill(0.0);
        self.used.iter().zip(t).for_each(|(&j, t)| self.t[j] = *t);
    }
}

#[cfg(test)]
mod tests {
    use rand::{RngExt, SeedableRng};
    use rand_pcg::Pcg64Mcg;

    use super::*;

    /// The conditions of optimality, which are sufficient, from any start.
    #[test]
    fn the_least_is_found_from_any_start() {
        let mut random = Pcg64Mcg::seed_from_u64(3);
        let (mut solvable, mut not) = (0, 0);
        for case in 0..400 {
            let (m, n) = (random.random_range(1..9), random.random_range(1..20));
            let rank = random.random_range(1..=m);
            let mut number = || random.random_range(-1.0..1.0);
            let basis: Vec<Vec<f64>> =
                (0..rank).map(|_| (0..m).map(|_| number()).collect()).collect();
            let columns: Vec<Vec<f64>> = (0..n)
                .map(|_| {
                    let factors: Vec<f64> = (0..rank).map(|_| number()).collect();
                    (0..m)
                        .map(|i| factors.iter().zip(&basis).map(|(f, b)| f * b[i]).sum())
                        .collect()
                })
                .collect();
            let b: Vec<f64> = (0..m).map(|_| number()).collect();
            let mut least = vec![];
            for start in [0, n / 2, n] {
                let mut squares = LeastSquares::default();
                squares.begin(&b);
                columns.iter().for_each(|c| squares.push(c));
                let out = case % 3 == 0 && m > 2;
                if out {
                    squares.leave_out(0..1);
                }
                squares.start(0..start);
                let left = squares.solve();
                let t: Vec<f64> = (0..n).map(|j| squares.coefficient(j)).collect();
                assert!(t.iter().all(|t| *t >= 0.0));
                let mut rho = b.clone();
                columns.iter().zip(&t).for_each(|(c, t)| (0..m).for_each(|i| rho[i] -= t * c[i]));
                if out {
                    rho[0] = 0.0;
                }
                let size: f64 = t.iter().sum::<f64>() + 1.0;
                (0..m).for_each(|i| assert!((rho[i] - squares.residual()[i]).abs() < 1e-9 * size));
                for (c, t) in columns.iter().zip(&t) {
                    let along: f64 = (0..m).map(|i| rho[i] * c[i]).sum();
                    assert!(along < 1e-9 * size && (*t == 0.0 || along > -1e-9 * size), "{along}");
                }
                least.push(left);
            }
            assert!(least.iter().all(|l| (l - least[0]).abs() < 1e-9), "{least:?}");
            if least[0] < 1e-9 { solvable += 1 } else { not += 1 }
        }
        assert!(solvable > 50 && not > 50, "{solvable} {not}");
    }
}
