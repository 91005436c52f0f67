//! LU of block matrices with a symmetric pattern (first version; the supernodal one replaces it behind the same face).

use faer::linalg::solvers::Solve;
use faer::sparse::{SparseColMat, Triplet};

/// A numerically singular matrix.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Singular;

/// Where a block lies.
#[derive(Debug, Clone, Copy)]
pub struct Slot(u32);

/// LU of a block matrix.
#[derive(Debug, Clone)]
pub struct BlockLu {
    start: Vec<usize>,
    place: std::collections::HashMap<(u32, u32), u32>,
    blocks: Vec<(usize, usize, Vec<f64>)>,
    factor: Option<faer::sparse::linalg::solvers::Lu<usize, f64>>,
}

impl BlockLu {
    /// Analyses the pattern.
    pub fn new(sizes: &[usize], edges: impl Iterator<Item = (u32, u32)>) -> Self {
        let mut start = vec![0];
        for s in sizes {
            start.push(start[start.len() - 1] + s);
        }
        let mut out = Self { start, place: Default::default(), blocks: vec![], factor: None };
        let diagonal = (0..sizes.len() as u32).map(|i| (i, i));
        for (i, j) in diagonal.chain(edges.flat_map(|(i, j)| [(i, j), (j, i)])) {
            let n = out.blocks.len() as u32;
            if let std::collections::hash_map::Entry::Vacant(e) = out.place.entry((i, j)) {
                e.insert(n);
                let size = sizes[i as usize] * sizes[j as usize];
                out.blocks.push((i as usize, j as usize, vec![0.0; size]));
            }
        }
        out
    }

    /// The number of unknowns.
    pub fn dim(&self) -> usize {
        self.start[self.start.len() - 1]
    }

    /// Of one factorisation, roughly.
    pub fn flops(&self) -> f64 {
        (self.dim() as f64).powi(2)
    }

    /// Values to zero.
    pub fn clear(&mut self) {
        self.blocks.iter_mut().for_each(|b| b.2.fill(0.0));
    }

    /// The handle of a block.
    pub fn slot(&self, i: usize, j: usize) -> Slot {
        Slot(self.place[&(i as u32, j as u32)])
    }

    /// Adds a block by its handle.
    pub fn add_at(&mut self, slot: Slot, block: &[f64]) {
        self.blocks[slot.0 as usize].2.iter_mut().zip(block).for_each(|(a, b)| *a += b);
    }

    /// Adds a block.
    pub fn add(&mut self, i: usize, j: usize, block: &[f64]) {
        self.add_at(self.slot(i, j), block);
    }

    /// Factorises.
    pub fn factorise(&mut self) -> Result<(), Singular> {
        super::inverse::count_factorisation();
        let n = self.dim();
        let mut triplets = vec![];
        for (i, j, b) in &self.blocks {
            let (r, c) = (self.start[*i], self.start[*j]);
            let width = self.start[j + 1] - c;
            for (k, v) in b.iter().enumerate() {
                triplets.push(Triplet::new(r + k / width, c + k % width, *v));
            }
        }
        let a = SparseColMat::<usize, f64>::try_new_from_triplets(n, n, &triplets)
            .map_err(|_| Singular)?;
        self.factor = Some(a.sp_lu().map_err(|_| Singular)?);
        Ok(())
    }

    /// Solves.
    pub fn solve(&mut self, x: &mut [f64]) {
        let n = x.len();
        if let Some(f) = &self.factor {
            f.solve_in_place(faer::MatMut::from_column_major_slice_mut(x, n, 1));
        }
    }
}
