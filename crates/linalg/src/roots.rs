//! Cholesky factors of a matrix that falls into small blocks, as the masses of rigid bodies do.

use super::Inverse;

/// Blocks up to this size have roots: rigid bodies have 1, 3 or 6 unknowns that belong together.
const LARGEST: usize = 6;

/// L of `A = L Lᵀ`, lower triangular, for each connected component of A on its own.
#[derive(Debug, Clone)]
pub(crate) struct Roots {
    /// By rows, packed: `L_00, L_10, L_11, …` of one component after the other.
    lower: Vec<f64>,
    /// Where the factor of each component begins.
    ptr: Vec<u32>,
}

impl Roots {
    /// Those of the matrix that `inverse` inverts; none where it is regularised, or a component is larger than six unknowns, not symmetric or not
    /// positive definite. Cost: k³/3 for a component of size k.
    pub(crate) fn of(inverse: &Inverse) -> Option<Self> {
        if inverse.is_regularised() || inverse.component_sizes().any(|size| size > LARGEST) {
            return None;
        }
        let mut roots = Self { lower: vec![], ptr: vec![] };
        for k in 0..inverse.component_sizes().len() {
            roots.ptr.push(u32::try_from(roots.lower.len()).ok()?);
            roots.push(inverse, inverse.component(k))?;
        }
        Some(roots)
    }

    /// Factorises the block on `index`.
    fn push(&mut self, inverse: &Inverse, index: &[usize]) -> Option<()> {
        let matrix = inverse.matrix();
        let start = self.lower.len();
        let at = |i: usize, j: usize| start + i * (i + 1) / 2 + j;
        for (i, &row) in index.iter().enumerate() {
            for (j, &column) in index[..=i].iter().enumerate() {
                let mut entry = matrix.get(row, column);
                if entry != matrix.get(column, row) {
                    return None;
                }
                for l in 0..j {
                    entry -= self.lower[at(i, l)] * self.lower[at(j, l)];
                }
                let root = if i == j { entry.sqrt() } else { entry / self.lower[at(j, j)] };
                self.lower.push(root);
            }
            let pivot = self.lower[at(i, i)];
            (pivot > 0.0 && pivot.is_finite()).then_some(())?;
        }
        Some(())
    }

    /// `x ← L⁻¹ x` within component k, for each of the D columns of x, given by rows.
    #[inline]
    pub(crate) fn solve<const D: usize>(&self, k: usize, x: &mut [[f64; D]]) {
        let lower = &self.lower[self.ptr[k] as usize..];
        for i in 0..x.len() {
            let (before, now) = x.split_at_mut(i);
            let row = &lower[i * (i + 1) / 2..][..=i];
            for k in 0..D {
                let sum: f64 = row.iter().zip(&*before).map(|(l, x)| l * x[k]).sum();
                now[0][k] = (now[0][k] - sum) / row[i];
            }
        }
    }

    /// `y = Lᵀ x` for all components of `inverse`.
    pub(crate) fn transposed(&self, inverse: &Inverse, x: &[f64], y: &mut [f64]) {
        for (k, &start) in self.ptr.iter().enumerate() {
            let index = inverse.component(k);
            let mut row = start as usize;
            for (i, &to) in index.iter().enumerate() {
                y[to] = 0.0;
                for (l, &at) in self.lower[row..=row + i].iter().zip(index) {
                    y[at] += l * x[to];
                }
                row += i + 1;
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::Csc;

    #[test]
    fn roots_of_masses_give_back_their_inverse() {
        let entries = [
            (0, 0, 4.0),
            (1, 1, 2.0),
            (1, 3, 0.5),
            (3, 1, 0.5),
            (3, 3, 3.0),
            (3, 4, -0.25),
            (4, 3, -0.25),
            (4, 4, 1.0),
            (2, 2, 9.0),
        ];
        let a = Csc::from_triplets(5, 5, entries.into_iter()).unwrap();
        let inverse = Inverse::new(&a, "A").unwrap();
        let roots = Roots::of(&inverse).unwrap();
        let x = [1.0, -2.0, 3.0, 0.5, -1.5];
        let mut y = [0.0; 5];
        roots.transposed(&inverse, &x, &mut y);
        // ‖Lᵀx‖² = xᵀ A x, and L⁻¹ A x = Lᵀ x.
        let mut ax = [0.0; 5];
        a.mul_add(1.0, &x, &mut ax);
        for k in 0..3 {
            let index = inverse.component(k);
            let mut local: Vec<[f64; 1]> = index.iter().map(|&i| [ax[i]]).collect();
            roots.solve(k, &mut local);
            index.iter().zip(local).for_each(|(&i, x)| assert!((x[0] - y[i]).abs() < 1e-14));
        }
        let product = |a: &[f64], b: &[f64]| a.iter().zip(b).map(|(a, b)| a * b).sum::<f64>();
        assert!((product(&y, &y) - product(&x, &ax)).abs() < 1e-13);
    }

    #[test]
    fn only_small_symmetric_positive_blocks_have_roots() {
        let of = |entries: &[(usize, usize, f64)], n| {
            let a = Csc::from_triplets(n, n, entries.iter().copied()).unwrap();
            Roots::of(&Inverse::new(&a, "A").unwrap())
        };
        assert!(of(&[(0, 0, 1.0), (0, 1, 0.5), (1, 0, 0.25), (1, 1, 1.0)], 2).is_none());
        assert!(of(&[(0, 0, -1.0)], 1).is_none());
        assert!(of(&[(0, 0, 1.0), (0, 1, 2.0), (1, 0, 2.0), (1, 1, 1.0)], 2).is_none());
        let chain =
            (0..7).flat_map(|i| [(i, i, 2.0), (i, (i + 1) % 7, -0.5), ((i + 1) % 7, i, -0.5)]);
        assert!(of(&chain.collect::<Vec<_>>(), 7).is_none());
    }
}
