//! The scalar rows of a local problem that have bounds, with the free rows eliminated.

use nonsmooth_linalg::{Csc, Inverse, MatrixError, Refine};
use nonsmooth_problem::RowsLocal;

use super::DETERMINED;

/// The rows B that have bounds, where the free ones F hold exactly, `λ_F = −R_FF⁻¹ (V_Fᵀ r + R_FB λ_B + s_F)`:
///
/// ```text
/// u   = … + (V_B − V_F R_FF⁻¹ R_FB) λ_B,
/// c_B = (V_Bᵀ − R_BF R_FF⁻¹ V_Fᵀ) r + (R_BB − R_BF R_FF⁻¹ R_FB) λ_B + s_B − R_BF R_FF⁻¹ s_F.
/// ```
///
/// All rows are kept in their places, of free ones and of what these determine nothing but the velocity. Cost: two solves with R_FF a row.
pub(super) struct Bounded {
    /// What λ_B does to u, by columns.
    pub(super) effect: Csc,
    /// What r does to c_B, by columns of the transpose.
    reads: Csc,
    /// What λ_B does to c_B, likewise.
    own: Csc,
    free_velocity: Vec<f64>,
}

impl Bounded {
    /// `inverse` is that of R_FF.
    pub(super) fn new(
        b: &RowsLocal,
        free: &[usize],
        inverse: &Inverse,
    ) -> Result<Self, MatrixError> {
        let p = b.s.len();
        let of_free = b.V.columns(free);
        let mut place = vec![None; p];
        free.iter().enumerate().for_each(|(k, &j)| place[j] = Some(k));
        // R need not be symmetric: its rows are the columns of Rᵀ.
        let rows_of = b.R.transpose();
        let square = b.R.columns(free).transpose().columns(free);
        let transposed = Inverse::of_multipliers(&square, "R")?;
        let solved = |inverse: &Inverse, (rows, values): (&[usize], &[f64])| {
            let mut x = vec![0.0; free.len()];
            for (&i, &value) in rows.iter().zip(values) {
                place[i].iter().for_each(|&k: &usize| x[k] = value);
            }
            let mut scratch = vec![0.0; inverse.scratch_len()];
            inverse.solve_with(&mut x, &mut scratch, Refine::Fully);
            x
        };
        let without = |j: usize, x: &[f64]| {
            let mut column = vec![0.0; b.V.nrows()];
            let (rows, values) = b.V.column(j);
            rows.iter().zip(values).for_each(|(&i, v)| column[i] = *v);
            of_free.mul_add(-1.0, x, &mut column);
            column
        };
        let (mut effect, mut reads, mut own) = (vec![], vec![], vec![]);
        let mut free_velocity = vec![0.0; p];
        for j in b.bounds.bounded() {
            let kept = |column: Vec<f64>| {
                let all = column.into_iter().enumerate().filter(|(_, x)| *x != 0.0);
                all.map(move |(i, x)| (i, j, x))
            };
            let y = solved(&transposed, rows_of.column(j));
            let mut row = vec![0.0; p];
            for k in b.bounds.bounded() {
                let (rows, values) = b.R.column(k);
                for (&i, value) in rows.iter().zip(values) {
                    row[k] += match place[i] {
                        _ if i == j => *value,
                        Some(f) => -y[f] * value,
                        None => 0.0,
                    };
                }
            }
            let through: f64 = free.iter().zip(&y).map(|(&i, y)| y * b.s[i]).sum();
            free_velocity[j] = b.s[j] - through;
            if row[j] <= DETERMINED * b.R.get(j, j) && b.R.get(j, j) > 0.0 {
                continue;
            }
            effect.extend(kept(without(j, &solved(inverse, b.R.column(j)))));
            reads.extend(kept(without(j, &y)));
            own.extend(kept(row));
        }
        let (m, n) = (b.V.nrows(), p);
        Ok(Self {
            effect: Csc::from_triplets(m, n, effect.into_iter())?,
            reads: Csc::from_triplets(m, n, reads.into_iter())?,
            own: Csc::from_triplets(n, n, own.into_iter())?,
            free_velocity,
        })
    }

    /// `∂c_j/∂λ_j`.
    pub(super) fn response(&self, j: usize) -> f64 {
        self.own.get(j, j)
    }

    /// c_j; of λ the rows with bounds are looked at.
    pub(super) fn velocity(&self, r: &[f64], lambda: &[f64], j: usize) -> f64 {
        self.free_velocity[j] + self.reads.column_dot(j, r) + self.own.column_dot(j, lambda)
    }
}
