//! The projection on polyhedra by nonnegative least squares, with an orthonormal basis of the rows that hold.
//!
//! ```text
//! min_u ‖[Gᵀ; hᵀ] u − e_{n+1}‖,  u_k ≥ 0 of inequalities;  s along the residual: the rows with u_k > 0 hold with equality
//! ```
//!
//! There is no such y where the residual vanishes: the polyhedron is empty. Source: LawsonHanson1974, ch. 23. Cost: for k active rows `n k` operations for one that comes or goes. The rows on which a point lies that is taken to be near y are tried first, else those of the last projection, at the first time those that p violates; what is not
//! positive with all the others goes at once. Wherever it begins it ends at y.

use nonsmooth_linalg::budget;

use super::super::norm;
use super::Rows;

/// Columns that are nearer to others than this are their combinations.
const DEPENDENT: f64 = 1e-12;

/// A plane is no farther away, in units of what is violated, so that nothing overflows.
const FARTHEST: f64 = 1e100;

/// A point is in the set where rows contradict each other, if they exceed by no more than so many times what rounding makes of an excess.
const WITHIN: f64 = 16.0;

/// Excesses smaller than this, in units of the row's terms, are those of a row on which a point lies.
const ON: f64 = 1e-7;

/// The rows with all their entries, and those that held last.
pub(super) struct Dense {
    rows: Vec<Vec<f64>>,
    equalities: usize,
    passive: Vec<usize>,
}

impl Dense {
    pub(super) fn new(rows: &Rows) -> Self {
        let mut dense = vec![vec![0.0; rows.variables]; rows.len()];
        for (k, row) in dense.iter_mut().enumerate() {
            let (of, g) = rows.row(k);
            of.iter().zip(g).for_each(|(&j, g)| row[j] = *g);
        }
        Self { rows: dense, equalities: rows.len() - rows.inequalities, passive: vec![] }
    }

    #[cfg(test)]
    pub(super) fn into_rows(self) -> Vec<Vec<f64>> {
        self.rows
    }

    /// The inequalities that the last projection met with a force.
    pub(super) fn pushing(&self, to: &mut Vec<usize>) {
        let bounds = self.rows.len() - self.equalities;
        to.extend(self.passive.iter().copied().filter(|&k| k < bounds));
    }

    /// `y = P(p)`, of rows with these right sides. False where there is none, or the time is over.
    pub(super) fn onto(&mut self, rhs: &[f64], p: &[f64], x: &[f64], y: &mut [f64]) -> bool {
        let Self { rows, equalities, passive } = self;
        let (n, m, bounds) = (p.len(), rows.len(), rows.len() - *equalities);
        // What rounding leaves of a row on which p lies is no violation: at a vertex with more rows than unknowns these would contradict each other.
        let rounding = (n + 3) as f64 * f64::EPSILON;
        let h = |(k, &at): (usize, &f64)| {
            let noise = rounding * (at.abs() + dot_moduli(&rows[k], p));
            let h = at - dot(&rows[k], p);
            (if h.abs() <= noise { 0.0 } else { h }, noise)
        };
        let (mut h, mut noise): (Vec<f64>, Vec<f64>) = rhs.iter().enumerate().map(h).unzip();
        y.copy_from_slice(p);
        // The unit is what p violates: beside a plane that is far away all that would be rounding.
        let violations = h.iter().enumerate().map(|(k, h)| if k < bounds { *h } else { h.abs() });
        let size = violations.fold(0.0, f64::max);
        if size == 0.0 {
            passive.clear();
            return true;
        }
        h.iter_mut().for_each(|h| *h = (*h / size).max(-FARTHEST));
        noise.iter_mut().for_each(|noise| *noise /= size);
        let column = |k: usize| rows[k].iter().copied().chain([h[k]]);
        let is_on = |&k: &usize| {
            let size = rhs[k].abs() + dot_moduli(&rows[k], x);
            (rhs[k] - dot(&rows[k], x)).abs() <= ON * size
        };
        let on: Vec<usize> = (0..bounds).filter(is_on).collect();
        passive.retain(|&k| k < bounds);
        if !on.is_empty() {
            *passive = on;
        }
        if passive.is_empty() {
            // The worst of them, as many as can well be independent.
            passive.extend((0..bounds).filter(|&k| h[k] > 0.0));
            passive.sort_by(|a, b| h[*b].total_cmp(&h[*a]));
            passive.truncate(n.div_ceil(2));
        }
        passive.extend(bounds..m);
        let mut u = vec![0.0; m];
        let mut known = Span::of(passive.iter().map(|&k| column(k)));
        // Of the last time, what is positive with all the others.
        loop {
            if budget::over() {
                return false;
            }
            let next = known.least_squares(n);
            let keeps = |k: usize, z: f64| k >= bounds || z > 0.0;
            passive.iter().zip(&next).for_each(|(&k, &z)| u[k] = if keeps(k, z) { z } else { 0.0 });
            if passive.iter().zip(&next).all(|(&k, &z)| keeps(k, z)) {
                break;
            }
            let gone = known.without(passive, |k| keeps(k, u[k]));
            known.complete(gone, passive, column);
        }
        // Whether it has begun anew, with the equations alone: rows on which a point lies may contradict each other by their rounding.
        let mut anew = false;
        // Columns that are combinations of the passive ones.
        let mut blocked = vec![false; m];
        let mut is_passive = vec![false; m];
        for _ in 0..3 * m + 10 {
            if budget::over() {
                return false;
            }
            // Least squares over the passive columns, one after the other dropped that would be negative.
            loop {
                let next = known.least_squares(n);
                let (mut alpha, mut least) = (1.0, None);
                for (&k, &z) in
                    passive.iter().zip(&next).filter(|(k, z)| **k < bounds && **z <= 0.0)
                {
                    let share = if u[k] > 0.0 { u[k] / (u[k] - z) } else { 0.0 };
                    if least.is_none() || share < alpha {
                        (alpha, least) = (share, Some(k));
                    }
                }
                passive.iter().zip(&next).for_each(|(&k, &z)| u[k] += alpha * (z - u[k]));
                let Some(least) = least else { break };
                u[least] = 0.0;
                let stays = |k: usize| k >= bounds || u[k] > 0.0;
                let gone = known.without(passive, stays);
                known.complete(gone, passive, column);
                blocked.fill(false);
                if budget::over() {
                    return false;
                }
            }
            let mut residual = vec![0.0; n + 1];
            residual[n] = 1.0;
            for &k in passive.iter() {
                residual.iter_mut().zip(column(k)).for_each(|(r, e)| *r -= u[k] * e);
            }
            if norm(&residual) < DEPENDENT {
                if anew || passive.iter().all(|&k| k >= bounds) {
                    return noise.iter().any(|noise| WITHIN * noise >= 1.0);
                }
                anew = true;
                passive.retain(|&k| k >= bounds);
                known = Span::of(passive.iter().map(|&k| column(k)));
                u.fill(0.0);
                blocked.fill(false);
                continue;
            }
            let slope = |k: usize| dot(&rows[k], &residual[..n]) + h[k] * residual[n];
            passive.iter().for_each(|&k| is_passive[k] = true);
            let open = (0..bounds).filter(|&k| !blocked[k] && !is_passive[k]);
            let least = DEPENDENT * norm(&residual);
            let rises = |k: usize, slope: f64| slope > least + noise[k] * residual[n].abs();
            let steep = open.map(|k| (k, slope(k))).filter(|&(k, slope)| rises(k, slope));
            let steepest = steep.max_by(|a, b| a.1.total_cmp(&b.1));
            is_passive.fill(false);
            match steepest {
                Some((k, _)) => {
                    passive.push(k);
                    known.push(column(k));
                    let grown = known.least_squares(n);
                    // Against the slope, which is rounding then.
                    if grown.last().is_none_or(|z| *z <= 0.0) {
                        passive.pop();
                        known.pop();
                        blocked[k] = true;
                    }
                }
                None => {
                    let nearest = nearest(passive, rows, &h, n);
                    y.iter_mut().zip(nearest).for_each(|(y, s)| *y += size * s);
                    return !budget::over() && y.iter().all(|y| y.is_finite());
                }
            }
        }
        false
    }
}

/// `Σ x_i y_i`.
fn dot(x: &[f64], y: &[f64]) -> f64 {
    summed(x, y, |xy| xy)
}

/// `Σ |x_i y_i|`.
fn dot_moduli(x: &[f64], y: &[f64]) -> f64 {
    summed(x, y, f64::abs)
}

/// `Σ f(x_i y_i)`, in eight sums, which one instruction adds up.
#[inline(always)]
fn summed(x: &[f64], y: &[f64], f: impl Fn(f64) -> f64) -> f64 {
    let mut sums = [0.0; 8];
    let (a, b) = (x.chunks_exact(8), y.chunks_exact(8));
    let rest: f64 = a.remainder().iter().zip(b.remainder()).map(|(x, y)| f(x * y)).sum();
    for (x, y) in a.zip(b) {
        for k in 0..8 {
            sums[k] += f(x[k] * y[k]);
        }
    }
    sums.iter().sum::<f64>() + rest
}

/// Columns one after the other: orthonormal ones with the same span as far as they are independent, and R by columns; of dependent ones none.
pub(super) struct Span {
    q: Vec<Vec<f64>>,
    pub(super) r: Vec<Option<Vec<f64>>>,
}

impl Span {
    /// As far as the time reaches.
    pub(super) fn of<C: Iterator<Item = f64>>(columns: impl Iterator<Item = C>) -> Self {
        let mut out = Self { q: vec![], r: vec![] };
        for column in columns {
            if budget::over() {
                break;
            }
            out.push(column);
        }
        out
    }

    /// Takes away the columns that do not stay, and these from the list of their names; what is left may lack columns at its end, see [`complete`](Self::complete).
    ///
    /// Cost: the entries of those that are left, for each; of many as much as making them again.
    fn without(&mut self, names: &mut Vec<usize>, stays: impl Fn(usize) -> bool) -> usize {
        let gone: Vec<usize> = (0..names.len()).filter(|&at| !stays(names[at])).collect();
        names.retain(|&k| stays(k));
        let first = gone.first().copied().unwrap_or(names.len());
        // What depends on others may not do so without them.
        let turns = self.r[first..].iter().all(Option::is_some) && 4 * gone.len() < self.r.len();
        if turns {
            for &at in gone.iter().rev() {
                if budget::over() {
                    self.q.clear();
                    self.r.clear();
                    return 0;
                }
                self.remove(at);
            }
            return names.len();
        }
        self.r.truncate(first);
        self.q.truncate(self.r.iter().flatten().count());
        first
    }

    /// The columns of these names from the first on that is not there.
    fn complete<C: Iterator<Item = f64>>(
        &mut self,
        first: usize,
        names: &[usize],
        column: impl Fn(usize) -> C,
    ) {
        for &k in &names[first..] {
            if budget::over() {
                return;
            }
            self.push(column(k));
        }
    }

    /// Without the column at this place, where none after it depends on others: turns in the planes of neighbours make R triangular again.
    fn remove(&mut self, at: usize) {
        self.r.remove(at);
        let place = self.r[..at].iter().flatten().count();
        for i in place..self.q.len() - 1 {
            let mut columns = self.r[at..].iter_mut().flatten().skip(i - place);
            let Some(first) = columns.next() else { break };
            let (a, b) = (first[i], first[i + 1]);
            let size = a.hypot(b);
            let (c, s) = if size > 0.0 { (a / size, b / size) } else { (1.0, 0.0) };
            first[i] = size;
            first.truncate(i + 1);
            for r in columns {
                (r[i], r[i + 1]) = (c * r[i] + s * r[i + 1], c * r[i + 1] - s * r[i]);
            }
            let (left, right) = self.q.split_at_mut(i + 1);
            for (x, y) in left[i].iter_mut().zip(&mut right[0]) {
                (*x, *y) = (c * *x + s * *y, c * *y - s * *x);
            }
        }
        self.q.pop();
    }

    /// One column more. Cost: its entries times the columns that are there.
    fn push(&mut self, column: impl Iterator<Item = f64>) {
        let Self { q, r } = self;
        let mut x: Vec<f64> = column.collect();
        let before = norm(&x);
        let mut along = vec![0.0; q.len()];
        // Twice is enough, and once where little cancels.
        let mut left = before;
        for _ in 0..2 {
            let size = left;
            for (q, along) in q.iter().zip(&mut along) {
                let c = dot(q, &x);
                x.iter_mut().zip(q).for_each(|(x, q)| *x -= c * q);
                *along += c;
            }
            left = norm(&x);
            if left > 0.7 * size {
                break;
            }
        }
        if left <= DEPENDENT * before {
            r.push(None);
            return;
        }
        along.push(left);
        x.iter_mut().for_each(|x| *x /= left);
        q.push(x);
        r.push(Some(along));
    }

    /// Without the last column.
    fn pop(&mut self) {
        if let Some(Some(_)) = self.r.pop() {
            self.q.pop();
        }
    }

    /// `min ‖Σ_k u_k e_k − e_{n+1}‖` over the columns, of n + 1 entries; 0 for those that depend on the ones before.
    fn least_squares(&self, n: usize) -> Vec<f64> {
        let Self { q, r } = self;
        let mut right: Vec<f64> = q.iter().map(|q| q[n]).collect();
        let mut u = vec![0.0; r.len()];
        let mut at = q.len();
        for (u, r) in u.iter_mut().zip(r).rev() {
            let Some(r) = r else { continue };
            at -= 1;
            *u = right[at] / r[at];
            right.iter_mut().zip(r).take(at).for_each(|(b, r)| *b -= r * *u);
        }
        u
    }
}

/// The least s with `g_k s = h_k` of these rows, as far as they are independent.
fn nearest(which: &[usize], rows: &[Vec<f64>], h: &[f64], n: usize) -> Vec<f64> {
    let Span { q, r } = Span::of(which.iter().map(|&k| rows[k].iter().copied()));
    let (mut s, mut along) = (vec![0.0; n], vec![]);
    for (&k, r) in which.iter().zip(&r) {
        let Some(r) = r else { continue };
        let at = along.len();
        let known: f64 = r.iter().zip(&along).map(|(r, z)| r * z).sum();
        let z = (h[k] - known) / r[at];
        s.iter_mut().zip(&q[at]).for_each(|(s, q)| *s += z * q);
        along.push(z);
    }
    s
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn columns_that_go_leave_the_least_squares_of_the_others() {
        let (n, k) = (12, 9);
        let entry = |i: usize, j: usize| ((i * 37 + j * 91) as f64 * 0.618).sin();
        let column = |j: usize| (0..=n).map(move |i| entry(i, j));
        for gone in [vec![0], vec![8], vec![3, 4], vec![0, 8], vec![1, 2, 3, 5, 7]] {
            let mut names: Vec<usize> = (0..k).collect();
            let mut span = Span::of(names.iter().map(|&j| column(j)));
            let first = span.without(&mut names, |j| !gone.contains(&j));
            span.complete(first, &names, column);
            assert_eq!(names.len(), k - gone.len());
            let plain = Span::of(names.iter().map(|&j| column(j))).least_squares(n);
            for (a, b) in span.least_squares(n).iter().zip(&plain) {
                assert!((a - b).abs() < 1e-12, "{gone:?}: {a} {b}");
            }
        }
        // A column that was a multiple of one that goes is there afterwards.
        let twice =
            |j: usize| (0..=n).map(move |i| if j == 2 { 2.0 * entry(i, 0) } else { entry(i, j) });
        let mut names = vec![0, 1, 2, 3, 4, 5];
        let mut span = Span::of(names.iter().map(|&j| twice(j)));
        assert!(span.r[2].is_none());
        let first = span.without(&mut names, |j| j != 0);
        span.complete(first, &names, twice);
        let plain = Span::of(names.iter().map(|&j| twice(j))).least_squares(n);
        assert!(span.least_squares(n).iter().zip(&plain).all(|(a, b)| (a - b).abs() < 1e-12));
    }
}
