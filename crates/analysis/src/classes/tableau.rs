//! Principal pivotal transforms of small matrices, without fractions.
//!
//! With `d = det M_αα` the tableau holds `T = d N`, N the principal pivotal transform of M on α. Its entries are minors of M, so integers stay integers.

use std::cmp::Ordering;

use super::interval::Interval;

/// `d N` and d.
#[derive(Debug, Clone)]
pub(super) struct Tableau {
    n: usize,
    values: Vec<Interval>,
    /// det M_αα
    pub(super) d: Interval,
}

/// The sum of the principal pivots visited.
#[derive(Debug, Clone, Copy, Default)]
pub(super) struct Visited {
    /// Rounding hides whether a transform exists.
    pub(super) doubtful: bool,
    /// The operations ran out.
    pub(super) cut: bool,
}

impl Tableau {
    pub(super) fn new(n: usize, entry: impl Fn(usize, usize) -> Interval) -> Self {
        let values = (0..n * n).map(|k| entry(k / n, k % n)).collect();
        Self { n, values, d: Interval::from(1.0) }
    }

    #[inline]
    pub(super) fn at(&self, i: usize, j: usize) -> Interval {
        self.values[i * self.n + j]
    }

    /// Exchanges z_k and w_k; the entry (k, k) is not zero.
    pub(super) fn pivot(&self, k: usize) -> Self {
        let p = self.at(k, k);
        let entry = |i: usize, j: usize| match (i == k, j == k) {
            (true, true) => self.d,
            (true, false) => -self.at(k, j),
            (false, true) => self.at(i, k),
            _ => Interval::cross(p, self.at(i, j), self.at(i, k), self.at(k, j)) / self.d,
        };
        Self { d: p, ..Self::new(self.n, entry) }
    }

    /// Exchanges two pairs at once, where both diagonal entries are zero and the other two are not.
    pub(super) fn pivot_pair(&self, k: usize, l: usize) -> Self {
        let (a, b) = (self.at(k, l), self.at(l, k));
        // The inverse of [0 a; b 0] is [0 1/b; 1/a 0], times d d' = −a b.
        let d = -(a * b) / self.d;
        let other = |x: usize| if x == k { l } else { k };
        // −adj(T_bb) T_bj / d: adj [0 a; b 0] = [0 −a; −b 0].
        let row = |x: usize, j: usize| {
            let c = if x == k { a } else { b };
            c * self.at(other(x), j) / self.d
        };
        let inside = |x: usize| x == k || x == l;
        let entry = |i: usize, j: usize| match (inside(i), inside(j)) {
            (true, true) if i == j => Interval::ZERO,
            (true, true) => -self.at(i, j),
            (true, false) => row(i, j),
            (false, true) => -(self.at(i, other(j)) * self.at(other(j), j)) / self.d,
            _ => {
                (d * self.at(i, j) + self.at(i, k) * row(k, j) + self.at(i, l) * row(l, j)) / self.d
            }
        };
        Self { d, ..Self::new(self.n, entry) }
    }

    /// The transform on `set` alone; `None` where a pivot is not surely different from zero, or three pairs would have to be exchanged at once.
    pub(super) fn transformed(self, set: &[usize]) -> Option<Self> {
        let mut left = set.to_vec();
        let mut now = self;
        while !left.is_empty() {
            let sure = |x: Interval| matches!(x.sign(), Some(Ordering::Less | Ordering::Greater));
            if let Some(place) = left.iter().position(|&k| sure(now.at(k, k))) {
                now = now.pivot(left.swap_remove(place));
                continue;
            }
            let pair = left.iter().enumerate().find_map(|(a, &k)| {
                let b = left.iter().position(|&l| {
                    l != k
                        && now.at(k, k).is_zero()
                        && now.at(l, l).is_zero()
                        && sure(now.at(k, l) * now.at(l, k))
                })?;
                Some((a.min(b), a.max(b)))
            });
            let (a, b) = pair?;
            let (l, k) = (left.swap_remove(b), left.swap_remove(a));
            now = now.pivot_pair(k, l);
        }
        Some(now)
    }

    /// Calls `f` with every α that single pivots and pairs with zero diagonals reach, and its tableau, until f says to stop.
    ///
    /// Of a symmetric matrix, and as long as diagonals are nonnegative and pairs sufficient, these are all α with `det M_αα ≠ 0`.
    /// Cost: n² operations each, at most 2ⁿ.
    pub(super) fn visit(
        self,
        operations: &mut u64,
        f: &mut impl FnMut(u32, &Self) -> bool,
    ) -> Visited {
        let mut state = Visit { seen: vec![false; 1 << self.n], doubts: vec![], cut: false };
        state.go(0, &self, operations, f);
        let doubtful = state.doubts.iter().any(|&set| !state.seen[set as usize]);
        Visited { doubtful, cut: state.cut }
    }
}

struct Visit {
    seen: Vec<bool>,
    doubts: Vec<u32>,
    cut: bool,
}

impl Visit {
    /// False to stop.
    fn go(
        &mut self,
        set: u32,
        tableau: &Tableau,
        operations: &mut u64,
        f: &mut impl FnMut(u32, &Tableau) -> bool,
    ) -> bool {
        let n = tableau.n;
        self.seen[set as usize] = true;
        if *operations < (n * n) as u64 {
            self.cut = true;
            return false;
        }
        *operations -= (n * n) as u64;
        if !f(set, tableau) {
            return false;
        }
        for k in (0..n).filter(|k| set >> k & 1 == 0) {
            let next = set | 1 << k;
            match tableau.at(k, k).sign() {
                _ if self.seen[next as usize] => {}
                Some(Ordering::Equal) => {
                    for l in (k + 1..n).filter(|l| set >> l & 1 == 0) {
                        let next = next | 1 << l;
                        let product = tableau.at(k, l) * tableau.at(l, k);
                        if self.seen[next as usize] || !tableau.at(l, l).is_zero() {
                            continue;
                        }
                        match product.sign() {
                            Some(Ordering::Equal) => {}
                            Some(_) => {
                                if !self.go(next, &tableau.pivot_pair(k, l), operations, f) {
                                    return false;
                                }
                            }
                            None => self.doubts.push(next),
                        }
                    }
                }
                Some(_) => {
                    if !self.go(next, &tableau.pivot(k), operations, f) {
                        return false;
                    }
                }
                None => self.doubts.push(next),
            }
        }
        true
    }
}

/// The sign of the determinant of the matrix with these entries, where rounding does not hide it. Units of rows and columns do not matter.
pub(super) fn determinant_sign(
    n: usize,
    entry: impl Fn(usize, usize) -> Interval,
) -> Option<Ordering> {
    let mut a: Vec<_> = (0..n * n).map(|k| entry(k / n, k % n)).collect();
    // Rows, then columns, by powers of two: the products of n pivots of any size leave the range of doubles.
    for (along, across) in [(n, 1), (1, n)] {
        for line in 0..n {
            let at = |k: usize| line * along + k * across;
            let size = (0..n).fold(0.0_f64, |size, k| size.max(a[at(k)].middle().abs()));
            if size > 0.0 && size.is_finite() {
                let unit = Interval::from((-size.log2().round()).exp2());
                (0..n).for_each(|k| a[at(k)] = a[at(k)] * unit);
            }
        }
    }
    let mut d = Interval::from(1.0);
    let mut swapped = false;
    for k in 0..n {
        // The pivot that is farthest from zero among those surely different from it.
        let size = |i: usize| {
            let x = a[i * n + k];
            if x.sign().is_some() { x.middle().abs() } else { 0.0 }
        };
        let p = (k..n).max_by(|&i, &j| size(i).total_cmp(&size(j)))?;
        if size(p) == 0.0 {
            let zero = (k..n).all(|i| a[i * n + k].is_zero());
            return zero.then_some(Ordering::Equal);
        }
        if p != k {
            swapped = !swapped;
            (0..n).for_each(|j| a.swap(p * n + j, k * n + j));
        }
        let pivot = a[k * n + k];
        for i in k + 1..n {
            for j in k + 1..n {
                a[i * n + j] = Interval::cross(pivot, a[i * n + j], a[i * n + k], a[k * n + j]) / d;
            }
        }
        d = pivot;
    }
    let sign = d.sign()?;
    Some(if swapped { sign.reverse() } else { sign })
}

#[cfg(test)]
mod tests {
    use super::*;

    fn tableau(rows: &[&[f64]]) -> Tableau {
        Tableau::new(rows.len(), |i, j| rows[i][j].into())
    }

    #[test]
    fn pivots_undo_themselves_and_pairs_are_two_pivots() {
        let m = tableau(&[&[2.0, 1.0, 3.0], &[-1.0, 4.0, 5.0], &[7.0, 1.0, 6.0]]);
        let twice = m.pivot(1).pivot(1);
        for k in 0..9 {
            assert!((twice.values[k] * m.d - m.values[k] * twice.d).is_zero(), "{k}");
        }
        // The transform on {0, 1} of a matrix with zeros there is the limit of that with small entries; here it is checked by its products.
        let m = tableau(&[&[0.0, 2.0, 3.0], &[-4.0, 0.0, 5.0], &[7.0, 1.0, 6.0]]);
        let t = m.pivot_pair(0, 1);
        assert!((t.d - 8.0.into()).is_zero());
        // w = M z with z = (1, 1, 1): w = (5, 1, 14); so N (w_0, w_1, z_2) = (z_0, z_1, w_2).
        let x = [5.0, 1.0, 1.0].map(Interval::from);
        let y: Vec<_> =
            (0..3).map(|i| (0..3).fold(Interval::ZERO, |s, j| s + t.at(i, j) * x[j])).collect();
        for (y, known) in y.iter().zip([8.0, 8.0, 112.0]) {
            assert!((*y - known.into()).is_zero(), "{y:?}");
        }
    }

    #[test]
    fn determinants_have_exact_signs() {
        let sign = |rows: &[&[f64]]| determinant_sign(rows.len(), |i, j| rows[i][j].into());
        assert_eq!(sign(&[&[0.0, 1.0], &[1.0, 0.0]]), Some(Ordering::Less));
        assert_eq!(
            sign(&[&[1.0, 2.0, 3.0], &[4.0, 5.0, 6.0], &[7.0, 8.0, 9.0]]),
            Some(Ordering::Equal)
        );
        assert_eq!(
            sign(&[&[1.0, 2.0, 3.0], &[4.0, 5.0, 6.0], &[7.0, 8.0, 9.000001]]),
            Some(Ordering::Less)
        );
        assert_eq!(sign(&[]), Some(Ordering::Greater));
    }

    #[test]
    fn all_principal_transforms_are_visited_once() {
        let m = tableau(&[&[0.0, 1.0, 0.0], &[-1.0, 0.0, 0.0], &[0.0, 0.0, 1.0]]);
        let mut sets = vec![];
        let visited = m.visit(&mut 1000, &mut |set, _| {
            sets.push(set);
            true
        });
        sets.sort_unstable();
        assert_eq!(sets, [0b000, 0b011, 0b100, 0b111]);
        assert!(!visited.doubtful && !visited.cut);
    }
}
