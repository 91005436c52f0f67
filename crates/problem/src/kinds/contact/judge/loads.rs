//! What the loads of a problem make of each contact: its share, in its own unit, of the largest load that can reach it.

/// The rows of a problem as nodes that its couplings join, each with the unit of its velocity.
///
/// With `A` the matrix from impulses to velocities, rows and columns may be in any units, `A → diag(s) A diag(t)`: the ratio
/// of the units of two rows is `s_i/s_j = √(|A_ij||A_ii| / (|A_ji||A_jj|))`, of symmetric A that of the roots of its diagonal. The load that
/// reaches row i is then `ω_i = max_j |q_j| s_i/s_j` over all rows j coupled to i, however far. In a wall at rest every contact but those
/// of the ground has rounding for its q; they share the load of the ground. (The load of one hop was tried: it refused walls at rest.)
///
/// Cost: a union-find over the couplings, once a problem.
#[derive(Debug, Clone, Default)]
pub(crate) struct Loads {
    parent: Vec<usize>,
    /// `log₂ s` over that of the parent; sums of logarithms neither over- nor underflow.
    level: Vec<f64>,
    /// `log₂` of the largest load of a root, in its unit.
    most: Vec<f64>,
    /// ω.
    reaching: Vec<f64>,
    /// How many groups of rows are not coupled with each other.
    groups: usize,
}

impl Loads {
    /// Begins with `n` rows, none coupled.
    pub(crate) fn start(&mut self, n: usize) {
        self.parent.clear();
        self.parent.extend(0..n);
        self.level.clear();
        self.level.resize(n, 0.0);
        self.groups = n;
    }

    /// Whether all rows are coupled: more couplings change nothing.
    pub(crate) fn are_joined(&self) -> bool {
        self.groups <= 1
    }

    /// The root of i, and `log₂` of the unit of i over that of the root; the path to it is shortened.
    fn root(&mut self, i: usize) -> (usize, f64) {
        let (mut root, mut total) = (i, 0.0);
        while self.parent[root] != root {
            total += self.level[root];
            root = self.parent[root];
        }
        let (mut at, mut rest) = (i, total);
        while self.parent[at] != root && at != root {
            let next = self.parent[at];
            let own = std::mem::replace(&mut self.level[at], rest);
            self.parent[at] = root;
            rest -= own;
            at = next;
        }
        (root, total)
    }

    /// Whether i and j hang below the same root at once, as most rows do that are coupled already.
    #[inline(always)]
    pub(crate) fn are_coupled(&self, i: usize, j: usize) -> bool {
        self.parent[i] == self.parent[j]
    }

    /// Whether i and j are coupled by now, however far.
    pub(crate) fn are_in_one_group(&mut self, i: usize, j: usize) -> bool {
        self.are_coupled(i, j) || self.root(i).0 == self.root(j).0
    }

    /// Rows i and j are coupled; `ratio` is that of their units, asked for where they were not coupled before.
    pub(crate) fn couple(&mut self, i: usize, j: usize, ratio: impl FnOnce() -> f64) {
        if self.are_coupled(i, j) {
            return;
        }
        let ((a, of_i), (b, of_j)) = (self.root(i), self.root(j));
        if a != b {
            let ratio = ratio();
            let ratio = if ratio > 0.0 && ratio.is_finite() { ratio.log2() } else { 0.0 };
            // log s_i − log s_j = ratio, with log s_i = of_i + level(a).
            self.groups -= 1;
            self.parent[a] = b;
            self.level[a] = ratio + of_j - of_i;
        }
    }

    /// Sets ω from the moduli of the loads, by row.
    pub(crate) fn spread(&mut self, loads: impl Iterator<Item = f64>) {
        let n = self.parent.len();
        self.most.clear();
        self.most.resize(n, f64::NEG_INFINITY);
        for (i, load) in loads.enumerate() {
            let (root, level) = self.root(i);
            self.most[root] = self.most[root].max(load.log2() - level);
        }
        self.reaching.clear();
        for i in 0..n {
            let (root, level) = self.root(i);
            self.reaching.push((self.most[root] + level).exp2());
        }
    }

    /// ω_i: zero where no load reaches row i; unbounded where loads were never given.
    pub(crate) fn reaching(&self, i: usize) -> f64 {
        self.reaching.get(i).copied().unwrap_or(f64::INFINITY)
    }
}

/// What rounding a few operations on terms of a typical size leaves, over that size.
pub(crate) const ROUNDING: f64 = 16.0 * f64::EPSILON;
/// Impulses are not so many times larger than what the loads ask for, if they are not to be those of a problem without a solution.
const REACH: f64 = 1e5;

impl Loads {
    /// The violation of an equation of row i beyond what is excused, and the size that it is compared with: its terms are no larger than the loads make them, nor is the rounding of
    /// `typical` terms. `violation` makes both of that rounding.
    pub(crate) fn excused(
        &self,
        i: usize,
        typical: f64,
        violation: impl FnOnce(f64) -> (f64, f64),
    ) -> (f64, f64) {
        let load = match self.reaching(i) {
            load if load > 0.0 => load,
            _ => f64::INFINITY,
        };
        let (violation, size) = violation(ROUNDING * typical.min(REACH * load));
        (violation, size.min(load))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// ω of a symmetric chain with the diagonal `d`, each row coupled to the next.
    fn chain(d: &[f64], q: &[f64]) -> Vec<f64> {
        let mut loads = Loads::default();
        loads.start(d.len());
        for i in 1..d.len() {
            loads.couple(i, i - 1, || (d[i] / d[i - 1]).sqrt());
        }
        loads.spread(q.iter().map(|q| q.abs()));
        (0..d.len()).map(|i| loads.reaching(i)).collect()
    }

    #[test]
    fn a_load_reaches_the_end_of_a_chain_in_the_unit_of_each() {
        let omega = chain(&[4.0, 1.0, 64.0, 16.0], &[6.0, 0.0, 1e-17, 0.0]);
        assert_eq!(omega, [6.0, 3.0, 24.0, 12.0]);
    }

    #[test]
    fn units_change_nothing() {
        let scale = [300, -300, 200, -500];
        let units = scale.map(|e| 2.0_f64.powi(e));
        let (d, q) = ([4.0, 1.0, 2.0, 3.0], [1.0, 2.0, 0.5, 0.0]);
        let plain = chain(&d, &q);
        let other: Vec<_> = (0..4).map(|i| q[i] * units[i]).collect();
        // s_i from the ratio of neighbours, as a matrix in other units gives it.
        let mut loads = Loads::default();
        loads.start(4);
        for i in [2, 1, 3] {
            let ratio = (d[i] / d[i - 1]).sqrt() * 2.0_f64.powi(scale[i] - scale[i - 1]);
            loads.couple(i, i - 1, || ratio);
        }
        loads.spread(other.iter().copied());
        for i in 0..4 {
            assert!((loads.reaching(i) / units[i] / plain[i] - 1.0).abs() < 1e-12);
        }
    }

    #[test]
    fn no_load_reaches_another_island() {
        let mut loads = Loads::default();
        loads.start(3);
        loads.couple(0, 1, || 1.0);
        loads.spread([1.0, 0.0, 0.0].into_iter());
        assert_eq!([0, 1, 2].map(|i| loads.reaching(i)), [1.0, 1.0, 0.0]);
    }
}
