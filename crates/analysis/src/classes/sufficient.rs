//! Sufficient matrices by their principal pivotal transforms.
//!
//! A matrix is sufficient exactly if every principal pivotal transform has nonnegative diagonal entries and principal submatrices of order two that are
//! sufficient (CottleGuu1992). A submatrix that is not column sufficient refutes the column sufficiency of M, since transforms keep the products `x_i (M x)_i`.

use super::Witness;
use super::finding::{entry, insufficient};
use super::interval::Interval;
use super::minors::symmetric_scale;
use super::tableau::Tableau;
use nonsmooth_linalg::Matrix;

/// What the transforms say of a small matrix.
#[derive(Debug, Clone, Default)]
pub(super) struct Transforms {
    /// A negative minor: not even P0.
    pub(super) negative: Option<Vec<usize>>,
    /// Against column and row sufficiency.
    pub(super) against: [Option<Witness>; 2],
    /// Rounding hides a sign.
    pub(super) doubtful: bool,
    /// The operations ran out.
    pub(super) cut: bool,
}

impl Transforms {
    pub(super) fn of(m: &Matrix, mut operations: u64) -> Self {
        let n = m.nrows();
        let mut out = Self::default();
        if n > 24 || operations < ((n * n) as u64) << n {
            out.cut = true;
            return out;
        }
        let scale = symmetric_scale(m);
        let at = |i: usize, j: usize| {
            Interval::from(entry(m, i, j)) * Interval::from(scale[i]) * Interval::from(scale[j])
        };
        let visited = Tableau::new(n, at).visit(&mut operations, &mut |set, t| out.look(n, set, t));
        out.doubtful |= visited.doubtful;
        out.cut |= visited.cut;
        out
    }

    /// Looks at one transform. False to stop.
    fn look(&mut self, n: usize, set: u32, t: &Tableau) -> bool {
        let rows = |set: u32| (0..n).filter(|i| set >> i & 1 == 1).collect::<Vec<_>>();
        if t.d.is_negative() {
            self.negative = Some(rows(set));
            return false;
        }
        for i in 0..n {
            let a = t.at(i, i);
            if a.is_negative() {
                self.negative = Some(rows(set ^ 1 << i));
                return false;
            }
            self.doubtful |= !a.is_nonnegative();
            for j in i + 1..n {
                let (b, c, d) = (t.at(i, j), t.at(j, i), t.at(j, j));
                let minor = Interval::cross(a, d, b, c);
                if minor.is_negative() {
                    self.negative = Some(rows(set ^ 1 << i ^ 1 << j));
                    return false;
                }
                self.doubtful |= !minor.is_nonnegative();
                // Where a diagonal entry is zero, it matters which others are.
                let hidden = |x: Interval| x.sign().is_none();
                self.doubtful |= (!a.is_positive() || !d.is_positive()) && (hidden(b) || hidden(c));
                for (side, found) in insufficient(t, i, j).into_iter().enumerate() {
                    if found && self.against[side].is_none() {
                        let witness = Witness::Transform { pivots: rows(set), pair: [i, j] };
                        self.against[side] = Some(witness);
                    }
                }
            }
        }
        !self.against.iter().all(Option::is_some)
    }
}
