//! Block-sparse rows: the hot storage of W.

use std::sync::Arc;

use super::{Csc, row};

/// A D×D block, by rows.
pub type Block<const D: usize> = [[f64; D]; D];

/// One block row: `(block column, block)`, sorted by column.
pub type BlockRow<const D: usize> = Vec<(u32, Block<D>)>;

/// A block-sparse matrix by compressed block rows with D×D blocks, column indices sorted in each row.
///
/// Storage: `8·D²` bytes a block plus 4 of index. One product streams that once. Clones share it until one of them is changed.
#[derive(Debug, Clone, PartialEq)]
pub struct Bsr<const D: usize> {
    of: Arc<Rows<D>>,
}

#[derive(Debug, Clone, PartialEq)]
struct Rows<const D: usize> {
    ncols: usize,
    row_ptr: Vec<usize>,
    col_idx: Vec<u32>,
    blocks: Vec<Block<D>>,
}

impl<const D: usize> Rows<D> {
    fn empty(ncols: usize) -> Self {
        Self { ncols, row_ptr: vec![0], col_idx: vec![], blocks: vec![] }
    }
}

impl<const D: usize> Bsr<D> {
    /// Gathers a general sparse matrix into blocks; blocks without a stored entry are absent.
    ///
    /// Panics unless the rows and columns of `a` are multiples of D: who has a caller's matrix asks before.
    pub fn from_csc(a: &Csc) -> Self {
        assert!(a.nrows().is_multiple_of(D) && a.ncols().is_multiple_of(D));
        let (nr, nc) = (a.nrows() / D, a.ncols() / D);
        // First pass: which blocks exist; `mark[i]` is the last block column seen in block row i.
        let mut mark = vec![usize::MAX; nr];
        let mut row_ptr = vec![0usize; nr + 1];
        for j in 0..nc {
            for jj in D * j..D * j + D {
                for &i in a.column(jj).0 {
                    if mark[i / D] != j {
                        mark[i / D] = j;
                        row_ptr[i / D + 1] += 1;
                    }
                }
            }
        }
        for i in 0..nr {
            row_ptr[i + 1] += row_ptr[i];
        }
        let nblocks = row_ptr[nr];
        let mut col_idx = vec![0u32; nblocks];
        let mut blocks = vec![[[0.0; D]; D]; nblocks];
        let mut next = row_ptr.clone();
        mark.fill(usize::MAX);
        for j in 0..nc {
            for jj in 0..D {
                let (rows, values) = a.column(D * j + jj);
                for (&i, &x) in rows.iter().zip(values) {
                    let bi = i / D;
                    if mark[bi] != j {
                        mark[bi] = j;
                        col_idx[next[bi]] = u32::try_from(j).expect("fewer than 2³² contacts");
                        next[bi] += 1;
                    }
                    blocks[next[bi] - 1][i % D][jj] = x;
                }
            }
        }
        Self { of: Arc::new(Rows { ncols: nc, row_ptr, col_idx, blocks }) }
    }

    /// Assembles a matrix from block rows, columns ascending below `ncols` in each: a problem checks that those of its W do.
    pub fn from_rows(ncols: usize, rows: &[BlockRow<D>]) -> Self {
        let mut out = Rows::empty(ncols);
        for row in rows {
            out.col_idx.extend(row.iter().map(|e| e.0));
            out.blocks.extend(row.iter().map(|e| e.1));
            out.row_ptr.push(out.blocks.len());
        }
        Self { of: Arc::new(out) }
    }

    /// This matrix's own memory, whose values are no longer needed.
    fn anew(&mut self) -> &mut Rows<D> {
        if Arc::get_mut(&mut self.of).is_none() {
            self.of = Arc::new(Rows::empty(0));
        }
        Arc::get_mut(&mut self.of).expect("no clone shares it")
    }

    /// Empties the matrix, keeping its memory, to be filled again by [`push`](Self::push) and [`end_row`](Self::end_row).
    pub fn clear(&mut self, ncols: usize) {
        let own = self.anew();
        own.ncols = ncols;
        own.row_ptr.truncate(1);
        own.col_idx.clear();
        own.blocks.clear();
    }

    /// Appends a block to the row that is being filled; its column lies after those that the row has.
    #[inline]
    pub fn push(&mut self, column: usize, block: Block<D>) {
        let own = Arc::make_mut(&mut self.of);
        debug_assert!(column < own.ncols);
        own.col_idx.push(column as u32);
        own.blocks.push(block);
    }

    /// Ends the row that is being filled.
    #[inline]
    pub fn end_row(&mut self) {
        let own = Arc::make_mut(&mut self.of);
        own.row_ptr.push(own.blocks.len());
    }

    /// Rows with these numbers of blocks, keeping the memory: where they begin, their columns and blocks, which have old values until they are written, columns
    /// ascending in each row.
    pub fn lay_out(
        &mut self,
        ncols: usize,
        lengths: impl Iterator<Item = usize>,
    ) -> (&[usize], &mut [u32], &mut [Block<D>]) {
        let own = self.anew();
        own.ncols = ncols;
        own.row_ptr.truncate(1);
        let mut end = 0;
        own.row_ptr.extend(lengths.map(|n| {
            end += n;
            end
        }));
        own.col_idx.resize(end, 0);
        own.blocks.resize(end, [[0.0; D]; D]);
        (&own.row_ptr, &mut own.col_idx, &mut own.blocks)
    }

    /// The number of block rows.
    pub fn nrows(&self) -> usize {
        self.of.row_ptr.len() - 1
    }

    /// The number of block columns.
    pub fn ncols(&self) -> usize {
        self.of.ncols
    }

    /// The number of stored blocks.
    pub fn nblocks(&self) -> usize {
        self.of.blocks.len()
    }

    /// Block column indices and blocks of block row `i`.
    #[inline(always)]
    pub fn row(&self, i: usize) -> (&[u32], &[Block<D>]) {
        let range = self.of.row_ptr[i]..self.of.row_ptr[i + 1];
        (&self.of.col_idx[range.clone()], &self.of.blocks[range])
    }

    /// All blocks, row by row.
    pub fn blocks(&self) -> &[Block<D>] {
        &self.of.blocks
    }

    /// The block at `(i, j)`, or `None` where nothing is stored.
    pub fn get(&self, i: usize, j: usize) -> Option<&Block<D>> {
        let (cols, blocks) = self.row(i);
        cols.binary_search(&u32::try_from(j).ok()?).ok().map(|k| &blocks[k])
    }

    /// The diagonal block of row `i`, zero where nothing is stored.
    pub fn diagonal_block(&self, i: usize) -> Block<D> {
        self.get(i, i).copied().unwrap_or([[0.0; D]; D])
    }

    /// Changes the block of each row and column in place.
    pub fn change(&mut self, mut change: impl FnMut(usize, usize, &mut Block<D>)) {
        let Rows { row_ptr, col_idx, blocks, .. } = Arc::make_mut(&mut self.of);
        for i in 0..row_ptr.len() - 1 {
            for k in row_ptr[i]..row_ptr[i + 1] {
                change(i, col_idx[k] as usize, &mut blocks[k]);
            }
        }
    }

    /// `(A x)_i`, the product of block row `i`.
    #[inline(always)]
    pub fn row_product(&self, i: usize, x: &[f64]) -> [f64; D] {
        assert_eq!(x.len(), D * self.of.ncols);
        let (cols, blocks) = self.row(i);
        row::times(cols, blocks, x)
    }

    /// `y = A x + y0`.
    pub fn mul_plus(&self, x: &[f64], y0: &[f64], y: &mut [f64]) {
        for i in 0..self.nrows() {
            let p = self.row_product(i, x);
            for k in 0..D {
                y[D * i + k] = p[k] + y0[D * i + k];
            }
        }
    }

    /// `A − B`, on the union of the two patterns.
    pub fn minus(&self, other: &Self) -> Self {
        let rows: Vec<BlockRow<D>> = (0..self.nrows())
            .map(|i| {
                let mut cols: Vec<u32> =
                    self.row(i).0.iter().chain(other.row(i).0).copied().collect();
                cols.sort_unstable();
                cols.dedup();
                cols.into_iter().map(|j| (j, [[0.0; D]; D])).collect()
            })
            .collect();
        let mut out = Self::from_rows(self.of.ncols, &rows);
        let fits = out.set_difference(self, other);
        debug_assert!(fits);
        out
    }

    /// Overwrites this matrix with `a − b` without allocating; false where its pattern does not hold theirs.
    pub fn set_difference(&mut self, a: &Self, b: &Self) -> bool {
        if (self.nrows(), self.ncols()) != (a.nrows(), a.ncols()) || a.nrows() != b.nrows() {
            return false;
        }
        let Rows { row_ptr, col_idx, blocks, .. } = Arc::make_mut(&mut self.of);
        blocks.fill([[0.0; D]; D]);
        for (sign, term) in [(1.0, a), (-1.0, b)] {
            for i in 0..term.nrows() {
                let (cols, theirs) = term.row(i);
                for (j, block) in cols.iter().zip(theirs) {
                    let range = row_ptr[i]..row_ptr[i + 1];
                    let Ok(at) = col_idx[range.clone()].binary_search(j) else {
                        return false;
                    };
                    let entries = blocks[range.start + at].iter_mut().flatten();
                    entries.zip(block.iter().flatten()).for_each(|(x, y)| *x += sign * y);
                }
            }
        }
        true
    }

    /// The general sparse matrix with the same entries, blocks written in full.
    pub fn to_csc(&self) -> Csc {
        let entries = (0..self.nrows()).flat_map(move |i| {
            let (cols, blocks) = self.row(i);
            cols.iter().zip(blocks).flat_map(move |(&j, b)| {
                (0..D * D).map(move |k| (D * i + k / D, D * j as usize + k % D, b[k / D][k % D]))
            })
        });
        Csc::from_triplets(D * self.nrows(), D * self.of.ncols, entries).expect("indices in range")
    }

    /// `‖A − Aᵀ‖_F / ‖A‖_F`, zero for a zero matrix.
    pub fn asymmetry(&self) -> f64 {
        let (mut skew, mut all) = (0.0, 0.0);
        for i in 0..self.nrows() {
            let (cols, blocks) = self.row(i);
            for (&j, b) in cols.iter().zip(blocks) {
                let other = self.get(j as usize, i);
                for k in 0..D {
                    for l in 0..D {
                        let t = other.map_or(0.0, |o| o[l][k]);
                        // An entry whose mirror block is absent stands for both of the pair.
                        let weight = if other.is_some() { 1.0 } else { 2.0 };
                        skew += weight * (b[k][l] - t) * (b[k][l] - t);
                        all += b[k][l] * b[k][l];
                    }
                }
            }
        }
        if all > 0.0 { (skew / all).sqrt() } else { 0.0 }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn example() -> Csc {
        let entries =
            [(0, 0, 1.0), (1, 0, 2.0), (3, 0, 3.0), (2, 3, 4.0), (0, 3, -1.0), (3, 3, 5.0)];
        Csc::from_triplets(4, 4, entries.into_iter()).unwrap()
    }

    #[test]
    fn blocks_hold_the_entries_of_the_sparse_matrix() {
        let (a, b) = (example(), Bsr::<2>::from_csc(&example()));
        assert_eq!((b.nrows(), b.ncols(), b.nblocks()), (2, 2, 4));
        let back = b.to_csc();
        for i in 0..4 {
            for j in 0..4 {
                assert_eq!(back.get(i, j), a.get(i, j));
            }
        }
        assert_eq!(Bsr::<2>::from_csc(&back), b);
    }

    #[test]
    fn a_matrix_filled_again_is_the_one_made_of_rows() {
        let rows = vec![vec![(0, [[1.0, 2.0], [3.0, 4.0]]), (2, [[5.0; 2]; 2])], vec![]];
        let mut again = Bsr::<2>::from_csc(&example());
        again.clear(3);
        for row in &rows {
            row.iter().for_each(|&(j, block)| again.push(j as usize, block));
            again.end_row();
        }
        assert_eq!(again, Bsr::from_rows(3, &rows));
    }

    #[test]
    fn clones_share_until_one_is_changed() {
        let original = Bsr::<2>::from_csc(&example());
        let is_shared = |a: &Bsr<2>, b: &Bsr<2>| std::ptr::eq(a.blocks(), b.blocks());
        let mut changed = original.clone();
        assert!(is_shared(&original, &changed));
        changed.change(|_, _, block| block[0][0] += 1.0);
        let mut refilled = original.clone();
        let lengths = (0..2).map(|i| original.row(i).0.len());
        let (_, columns, blocks) = refilled.lay_out(2, lengths);
        columns.iter_mut().zip(0..).for_each(|(c, k)| *c = k % 2);
        blocks.fill([[7.0; 2]; 2]);
        let mut cleared = original.clone();
        cleared.clear(1);
        assert_eq!(original, Bsr::<2>::from_csc(&example()));
        assert!(changed != original && refilled != original && cleared != original);
    }

    #[test]
    fn the_product_agrees_with_the_sparse_one() {
        let (a, b) = (example(), Bsr::<2>::from_csc(&example()));
        let x = [1.0, -2.0, 3.0, 0.5];
        let mut y = [0.0; 4];
        a.mul_add(1.0, &x, &mut y);
        let mut z = [0.0; 4];
        b.mul_plus(&x, &[0.0; 4], &mut z);
        assert_eq!(y, z);
    }

    #[test]
    fn asymmetry_of_a_matrix_with_one_sided_entries() {
        // A = [[0, 1], [0, 0]] in 1×1 blocks: ‖A − Aᵀ‖_F = √2 ‖A‖_F, with and without stored zeros.
        let one = Csc::from_triplets(2, 2, [(0, 1, 1.0)].into_iter()).unwrap();
        let both = Csc::from_triplets(2, 2, [(0, 1, 1.0), (1, 0, 0.0)].into_iter()).unwrap();
        for a in [one, both] {
            assert!((Bsr::<1>::from_csc(&a).asymmetry() - 2.0_f64.sqrt()).abs() < 1e-15);
        }
    }
}
