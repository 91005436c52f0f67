//! The block structure of W.

use serde::{Deserialize, Serialize};

use nonsmooth_linalg::{Bsr, Csc, Groups};

/// Which contacts feel which: the D×D blocks of W that are stored.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
pub struct Pattern {
    /// The number of block rows: contacts.
    pub rows: usize,
    /// The number of blocks.
    pub blocks: usize,
    /// The fewest blocks of a row.
    pub row_min: usize,
    /// The most blocks of a row.
    pub row_max: usize,
    /// The number of groups of contacts that do not feel each other.
    pub groups: usize,
}

impl Pattern {
    /// The structure of a stored W.
    pub fn of<const D: usize>(w: &Bsr<D>) -> Self {
        Self::gather(w.nrows(), |c, felt| {
            felt.extend(w.row(c).0.iter().map(|&j| j as usize));
        })
    }

    /// The structure that `W = Hᵀ M⁻¹ H` would have: contacts feel each other that touch the same group of `bodies`,
    /// the degrees of freedom that M or bilateral constraints connect.
    pub(super) fn condensed<const D: usize>(h: &Csc, bodies: &mut Groups) -> Self {
        let nc = h.ncols() / D;
        let mut touching = vec![vec![]; h.nrows()];
        let touched: Vec<Vec<usize>> = (0..nc)
            .map(|c| {
                let rows = (D * c..D * c + D).flat_map(|j| h.column(j).0);
                let mut all: Vec<_> = rows.map(|&i| bodies.root(i)).collect();
                all.sort_unstable();
                all.dedup();
                all.iter().for_each(|&body| touching[body].push(c));
                all
            })
            .collect();
        Self::gather(nc, |c, felt| {
            felt.extend(touched[c].iter().flat_map(|&body| &touching[body]));
        })
    }

    /// From the contacts that each contact feels, perhaps listed more than once.
    fn gather(contacts: usize, feels: impl Fn(usize, &mut Vec<usize>)) -> Self {
        let mut groups = Groups::new(contacts);
        let mut pattern =
            Self { rows: contacts, blocks: 0, row_min: usize::MAX, row_max: 0, groups: 0 };
        if contacts == 0 {
            return Self { row_min: 0, ..pattern };
        }
        let mut felt = vec![];
        let mut seen_by = vec![usize::MAX; contacts];
        for c in 0..contacts {
            felt.clear();
            feels(c, &mut felt);
            let mut blocks = 0;
            for &other in &felt {
                if seen_by[other] != c {
                    seen_by[other] = c;
                    blocks += 1;
                    groups.join(c, other);
                }
            }
            pattern.blocks += blocks;
            pattern.row_min = pattern.row_min.min(blocks);
            pattern.row_max = pattern.row_max.max(blocks);
        }
        pattern.groups = groups.sizes().len();
        pattern
    }

    /// The mean number of blocks of a row.
    pub fn row_mean(&self) -> f64 {
        self.blocks as f64 / self.rows.max(1) as f64
    }
}
