//! LU of block matrices with a symmetric pattern and any values: analysed once, factorised many times.
//!
//! `R A C = Pᵀ L U` with R, C powers of two and P exchanging rows inside fronts only. Nodes are ordered (below); neighbours in the tree of
//! elimination with (nearly) equal structure are eliminated together in dense fronts; each front takes over the remainders of its children (multifrontal
//! method). The order never depends on values: rows are exchanged within a front's own pivots, and a pivot that vanishes against the scaled matrix is
//! replaced, so the caller refines.
//!
//! Two orders are known: approximate minimum degree, the best on chains, towers, walls and all that is small, and nested dissection, the best on large graphs
//! in space: half of the operations for piles of 4000 bodies, a quarter for 30 000, less than a fifth for 100 000. Minimum degree comes first. Where its
//! factorisation would take longer than a dissection does, by the operations that its tree of elimination says, the graph is dissected too, and
//! the order with fewer operations taken. Counts decide and no clock, so that equal patterns are ordered alike everywhere.
//!
//! Threads share it in two ways: subtrees of the tree of elimination that are alike in cost go side by side, each with a stack of its own, and the few
//! large fronts above them cut their products into strips of columns. Each entry is made of the same sums in the same order
//! whoever makes it, so the factors are the same bits for every number of threads. Solves go through the same subtrees side by side.
//!
//! References: DuffReid1983 (fronts), Liu1992 (tree, supernodes, stack), AmestoyDavisDuff1996 (minimum degree), George1973, LiptonRoseTarjan1979,
//! KarypisKumar1998, FiducciaMattheyses1982 (dissection), GilbertNgPeyton1994 (counts), LiDemmel2003 (static pivots), AshcraftGrimes1989 (merging).
//! Storage: 8 bytes an entry of L, U and A, and a stack of remainders.
//! Cost of a factorisation: [`BlockLu::flops`]; of a solve: one pass over L and U.
//!
//! Fails where elimination in a fixed order grows beyond double precision: the residual that the caller measures then says so.

mod dissection;
mod factor;
mod kernel;
mod plan;
mod substitute;
mod symbolic;

use kernel::Simd;
use symbolic::Symbolic;

use super::budget::{self, TooLarge};
use super::inverse::count_factorisation;

/// A factorisation of more operations than this, some milliseconds, is shared among the threads that the budget allows.
const SHARED: f64 = 5e7;

/// A matrix that cannot be factorised: without a non-zero entry, with one that is not finite, or with factors that overflow; or one for which there is
/// not time or memory enough (see [`budget`]).
#[derive(Debug, Clone, Copy, PartialEq, Eq, thiserror::Error)]
#[error("a singular matrix")]
pub struct Singular;

/// The handle of a block, for [`BlockLu::add_at`]; of no use for another pattern.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Slot {
    at: usize,
    /// From one column to the next among the values.
    stride: u32,
    rows: u32,
    columns: u32,
}

/// LU factors of a square matrix of blocks whose pattern is symmetric, values need not be.
///
/// ```
/// use nonsmooth_linalg::BlockLu;
/// let mut a = BlockLu::new(&[1, 2], [(0, 1)].into_iter()).unwrap();
/// a.add(0, 0, &[2.0]);
/// a.add(0, 1, &[1.0, 0.0]);
/// a.add(1, 0, &[0.0, 1.0]);
/// a.add(1, 1, &[0.0, 1.0, 4.0, 0.0]);
/// a.factorise().unwrap();
/// let mut x = [3.0, 1.0, 5.0];
/// a.solve(&mut x);
/// assert_eq!(x, [1.0, 1.0, 1.0]);
/// ```
#[derive(Debug, Clone)]
pub struct BlockLu {
    symbolic: Symbolic,
    simd: Simd,
    /// A, block by block, in the order in which fronts take them up.
    values: Vec<f64>,
    /// R and C in the order of elimination.
    row_scale: Vec<f64>,
    column_scale: Vec<f64>,
    lower: Vec<f64>,
    upper: Vec<f64>,
    remainders: Vec<f64>,
    /// Minus the inverses of the unit lower triangles of the diagonal blocks.
    triangles: Vec<f64>,
    /// Of each pivot: its inverse, and the row of its front that it was exchanged with.
    inverses: Vec<f64>,
    swaps: Vec<u32>,
    /// A right-hand side in the order of elimination, and the part of it that a front sees.
    x: Vec<f64>,
    z: Vec<f64>,
    perturbed: usize,
    negative: bool,
}

impl BlockLu {
    /// Analyses the pattern: node i has `sizes[i]` unknowns; `edges` are the coupled nodes, in one or both orientations.
    ///
    /// The entries of the factors are allocated by the first factorisation: who only wants to know what one costs pays for the analysis alone. Cost: near
    /// linear in the blocks of L.
    /// Errors: factors that take more memory than there is (see [`budget::admit`]).
    pub fn new(sizes: &[usize], edges: impl Iterator<Item = (u32, u32)>) -> Result<Self, TooLarge> {
        Self::of(Symbolic::new(sizes, edges))
    }

    fn of(symbolic: Symbolic) -> Result<Self, TooLarge> {
        let s = &symbolic;
        let entries = [s.values_len, s.lower_len, s.upper_len, s.stack_len, s.triangles_len];
        budget::admit("the factorisation", 8.0 * entries.iter().map(|&n| n as f64).sum::<f64>())?;
        let n = symbolic.dim;
        Ok(Self {
            simd: Simd::best(),
            values: vec![],
            row_scale: vec![1.0; n],
            column_scale: vec![1.0; n],
            lower: vec![],
            upper: vec![],
            remainders: vec![],
            triangles: vec![],
            inverses: vec![1.0; n],
            swaps: vec![0; n],
            x: vec![0.0; n],
            z: vec![0.0; symbolic.widest],
            perturbed: 0,
            negative: false,
            symbolic,
        })
    }

    /// The number of unknowns.
    pub fn dim(&self) -> usize {
        self.symbolic.dim
    }

    /// Floating-point operations of one factorisation, for callers who choose between forms.
    pub fn flops(&self) -> f64 {
        self.symbolic.flops
    }

    /// Entries of L and U together.
    pub fn factor_len(&self) -> usize {
        self.symbolic.lower_len + self.symbolic.upper_len
    }

    /// The number of dense fronts.
    pub fn fronts(&self) -> usize {
        self.symbolic.fronts.len()
    }

    /// Sets all values to zero; the pattern stays.
    pub fn clear(&mut self) {
        self.values.fill(0.0);
        self.values.resize(self.symbolic.values_len, 0.0);
    }

    /// The handle of block (i, j), so that repeated assembly needs no search.
    ///
    /// Panics if i and j are not coupled.
    pub fn slot(&self, i: usize, j: usize) -> Slot {
        let groups = &self.symbolic.groups;
        let entry = self.symbolic.find(groups.of[i] as usize, groups.of[j] as usize);
        let entry = entry.unwrap_or_else(|| panic!("block ({i}, {j}) is not in the pattern"));
        let place = &self.symbolic.places[self.symbolic.number[entry] as usize];
        let (row, column) = (groups.within[i] as usize, groups.within[j] as usize);
        Slot {
            at: place.values + column * place.rows as usize + row,
            stride: place.rows,
            rows: groups.node_sizes[i],
            columns: groups.node_sizes[j],
        }
    }

    /// Whether matrices of this pattern, or of a part of it, can be factorised with this analysis.
    pub fn serves(&self, sizes: &[usize], mut edges: impl Iterator<Item = (u32, u32)>) -> bool {
        let groups = &self.symbolic.groups;
        let mut pairs = groups.node_sizes.iter().zip(sizes);
        let coupled = |(i, j): (u32, u32)| {
            let (i, j) = (groups.of[i as usize] as usize, groups.of[j as usize] as usize);
            self.symbolic.find(i, j).is_some()
        };
        groups.node_sizes.len() == sizes.len()
            && pairs.all(|(a, b)| *a as usize == *b)
            && edges.all(coupled)
    }

    /// `A_ij += block`, by rows, `sizes[i] × sizes[j]`.
    ///
    /// Panics if i and j are not coupled, or if the block has another size.
    pub fn add(&mut self, i: usize, j: usize, block: &[f64]) {
        self.add_at(self.slot(i, j), block);
    }

    /// [`add`](BlockLu::add) without the search.
    #[inline]
    pub fn add_at(&mut self, slot: Slot, block: &[f64]) {
        let (rows, columns, stride) =
            (slot.rows as usize, slot.columns as usize, slot.stride as usize);
        assert_eq!(block.len(), rows * columns, "the size of a block");
        if self.values.is_empty() {
            self.clear();
        }
        let values = &mut self.values[slot.at..];
        match (rows, columns) {
            (3, 3) => add_transposed::<3>(block, values, stride),
            (6, 6) => add_transposed::<6>(block, values, stride),
            (1, 1) => values[0] += block[0],
            _ => {
                for c in 0..columns {
                    let column = &mut values[c * stride..c * stride + rows];
                    for (r, a) in column.iter_mut().enumerate() {
                        *a += block[r * columns + c];
                    }
                }
            }
        }
    }

    /// `y = A x` with the values last added, nodes concatenated.
    pub fn multiply(&self, x: &[f64], y: &mut [f64]) {
        let order = &self.symbolic.order;
        y.fill(0.0);
        // Without values, none were added: A = 0.
        let places = if self.values.is_empty() { &[][..] } else { &self.symbolic.places };
        for p in places {
            let columns = self.values[p.values..].chunks_exact(p.rows as usize);
            for (column, &c) in columns.zip(&order[p.column as usize..]).take(p.columns as usize) {
                for (a, &r) in column.iter().zip(&order[p.row as usize..]) {
                    y[r as usize] += a * x[c as usize];
                }
            }
        }
    }

    /// Pivots that the last factorisation replaced: the matrix is singular to working precision in that many directions, or
    /// its order of elimination unlucky.
    pub fn perturbed(&self) -> usize {
        self.perturbed
    }

    /// The sign of the determinant of what was last factorised, 1 or −1; of a matrix with replaced pivots that of the one in its place.
    pub fn sign(&self) -> f64 {
        if self.negative { -1.0 } else { 1.0 }
    }

    /// Factorises the values added so far, which stay.
    ///
    /// Rows and columns are scaled by powers of two to a largest entry of about one; a pivot below ε^(3/4) of that becomes
    /// ε^(1/2). Large matrices are factorised on as many threads as the budget in force allows, with the same bits for any number.
    /// Errors: see [`Singular`]; the factors are then of no use.
    pub fn factorise(&mut self) -> Result<(), Singular> {
        count_factorisation();
        let team = if self.flops() < SHARED { None } else { budget::team() };
        if let Some(team) = &team {
            self.symbolic.share(team.current_num_threads());
        }
        self.make_room();
        self.scale()?;
        let outcome = match team {
            Some(team) => {
                let limits = budget::current();
                team.install(|| self.eliminate_shared(&limits))
            }
            None => self.eliminate(),
        };
        // What a thread of the team was told, the present one is told too.
        let outcome = outcome.ok_or_else(|| {
            budget::over();
            Singular
        })?;
        self.perturbed = outcome.perturbed;
        self.negative = outcome.negative;
        if outcome.broken { Err(Singular) } else { Ok(()) }
    }

    /// Allocates the values and the entries of the factors, where that has not been done.
    fn make_room(&mut self) {
        let Self { symbolic: s, values, lower, upper, remainders, triangles, .. } = self;
        for (entries, count) in [
            (values, s.values_len),
            (lower, s.lower_len),
            (upper, s.upper_len),
            (remainders, s.stack_len),
            (triangles, s.triangles_len),
        ] {
            if entries.len() < count {
                *entries = vec![0.0; count];
            }
        }
    }

    /// Powers of two such that first each row, then each column has a largest entry between one and two.
    fn scale(&mut self) -> Result<(), Singular> {
        let (rows, columns) = (&mut self.row_scale, &mut self.column_scale);
        rows.fill(0.0);
        columns.fill(0.0);
        for p in &self.symbolic.places {
            let height = p.rows as usize;
            let block = &self.values[p.values..p.values + height * p.columns as usize];
            let scale = &mut rows[p.row as usize..p.row as usize + height];
            match height {
                3 => row_maxima(block, 3, scale),
                6 => row_maxima(block, 6, scale),
                12 => row_maxima(block, 12, scale),
                _ => row_maxima(block, height, scale),
            }
        }
        if rows.iter().any(|r| !r.is_finite())
            || (!rows.is_empty() && rows.iter().all(|&r| r == 0.0))
        {
            return Err(Singular);
        }
        rows.iter_mut().for_each(|r| *r = inverse_power(*r));
        for p in &self.symbolic.places {
            let height = p.rows as usize;
            let block = &self.values[p.values..p.values + height * p.columns as usize];
            let scale = &rows[p.row as usize..p.row as usize + height];
            let columns = &mut columns[p.column as usize..];
            match height {
                3 => column_maxima(block, 3, scale, columns),
                6 => column_maxima(block, 6, scale, columns),
                12 => column_maxima(block, 12, scale, columns),
                _ => column_maxima(block, height, scale, columns),
            }
        }
        columns.iter_mut().for_each(|c| *c = inverse_power(*c));
        Ok(())
    }
}

/// The power of two by which x comes to lie between one and two; one for zero.
fn inverse_power(x: f64) -> f64 {
    let exponent = (x.to_bits() >> 52) & 0x7ff;
    if x == 0.0 {
        1.0
    } else {
        // Subnormal numbers and the largest stay a little outside.
        f64::from_bits((2046 - exponent.clamp(1, 2045)) << 52)
    }
}

/// The largest entries of the rows of a block by columns of `height`, which is a constant after inlining. NaN
/// is passed over: it is met again in a pivot.
#[inline(always)]
fn row_maxima(block: &[f64], height: usize, largest: &mut [f64]) {
    let largest = &mut largest[..height];
    for column in block.chunks_exact(height) {
        for i in 0..height {
            let a = column[i].abs();
            largest[i] = if a > largest[i] { a } else { largest[i] };
        }
    }
}

/// The largest entries of its columns, rows scaled.
#[inline(always)]
fn column_maxima(block: &[f64], height: usize, scale: &[f64], largest: &mut [f64]) {
    let scale = &scale[..height];
    for (column, largest) in block.chunks_exact(height).zip(largest) {
        for i in 0..height {
            let a = (column[i] * scale[i]).abs();
            *largest = if a > *largest { a } else { *largest };
        }
    }
}

/// Adds a D×D block by rows to columns.
#[inline(always)]
fn add_transposed<const D: usize>(block: &[f64], to: &mut [f64], stride: usize) {
    let block = &block[..D * D];
    for c in 0..D {
        let column = &mut to[c * stride..c * stride + D];
        for r in 0..D {
            column[r] += block[r * D + c];
        }
    }
}

#[cfg(test)]
mod tests;
