//! The rows of M in memory order, and the sweep over them that every Gauss–Seidel method here shares.
//!
//! Dense matrices are read where they are. Sparse ones, stored by columns, are copied by rows once: values, 32-bit column indices, each row beginning with its
//! diagonal and going round (`j = i, i + 1, …, n, 1, …, i − 1`). The variable that a forward sweep changed last thereby enters a sum last, and the sum need not
//! wait for it.
//!
//! Cost of a sweep: one pass over the entries. Storage: 12 bytes an entry of a sparse matrix, none of a dense one.

use nonsmooth_linalg::{Csc, Dense, Matrix};
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use crate::SolveError;
use crate::complementarity::form::{Bounds, System};

/// The order in which a method visits the variables.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
pub enum Direction {
    /// From the first to the last.
    Forward,
    /// Forward and backward in turn, one a step.
    Symmetric,
}

/// The entries of M by rows, and its diagonal.
#[derive(Debug, Clone, Default)]
pub(super) struct Rows {
    sparse: SparseRows,
    /// `M_ii`.
    pub diagonal: Vec<f64>,
}

#[derive(Debug, Clone, Default)]
struct SparseRows {
    start: Vec<usize>,
    column: Vec<u32>,
    value: Vec<f64>,
}

/// What a sweep asks of the rows.
trait Row {
    /// `(M z)_i`.
    fn dot(&self, i: usize, z: &[f64]) -> f64;

    /// `(M z)_i` without one of its products, and the factors of that: of the variable that the sweep has changed last, where the row knows it. What does not
    /// wait for that variable is computed while it is.
    fn parted(&self, i: usize, z: &[f64]) -> (f64, [f64; 2]);
}

impl Row for &Dense {
    #[inline]
    fn dot(&self, i: usize, z: &[f64]) -> f64 {
        dot(self.row(i), z)
    }

    #[inline]
    fn parted(&self, i: usize, z: &[f64]) -> (f64, [f64; 2]) {
        (dot(self.row(i), z), [0.0; 2])
    }
}

impl Row for &SparseRows {
    #[inline]
    fn dot(&self, i: usize, z: &[f64]) -> f64 {
        let range = self.start[i]..self.start[i + 1];
        let (columns, values) = (&self.column[range.clone()], &self.value[range]);
        columns.iter().zip(values).map(|(&j, &v)| v * z[j as usize]).sum()
    }

    #[inline]
    fn parted(&self, i: usize, z: &[f64]) -> (f64, [f64; 2]) {
        let range = self.start[i]..self.start[i + 1];
        let (columns, values) = (&self.column[range.clone()], &self.value[range]);
        let (Some((&last, columns)), Some((&v, values))) =
            (columns.split_last(), values.split_last())
        else {
            return (0.0, [0.0; 2]);
        };
        let head = columns.iter().zip(values).map(|(&j, &v)| v * z[j as usize]).sum();
        (head, [v, z[last as usize]])
    }
}

/// One visit of every variable.
pub(super) struct Pass<'a> {
    pub q: &'a [f64],
    pub bounds: Bounds<'a>,
    /// The step `ω / δ_i`, by which w_i is multiplied.
    pub step: &'a [f64],
    pub backward: bool,
}

impl Rows {
    /// Takes M; allocates nothing where its shape and number of entries are those of before.
    ///
    /// Errors: an operator; more columns than 32 bits can count.
    pub fn fill(&mut self, system: &System) -> Result<(), SolveError> {
        system.needs_entries()?;
        let n = system.dim();
        if u32::try_from(n).is_err() {
            return Err(SolveError::needs("less than 2^32 variables", n.to_string()));
        }
        self.diagonal.clear();
        match system.matrix {
            Matrix::Dense(a) => self.diagonal.extend((0..n).map(|i| a[(i, i)])),
            Matrix::Sparse(a) => {
                self.diagonal.extend((0..n).map(|i| a.get(i, i)));
                self.sparse.fill(a);
            }
            Matrix::Operator(_) => {}
        }
        Ok(())
    }

    /// `max |M_ij − M_ji| / max |M_ij|`, without a copy.
    pub fn asymmetry(&self, matrix: &Matrix) -> f64 {
        let Matrix::Sparse(a) = matrix else { return matrix.asymmetry().unwrap_or(f64::INFINITY) };
        let (mut worst, mut largest) = (0.0_f64, 0.0_f64);
        for (i, j, x) in a.triplets() {
            largest = largest.max(x.abs());
            worst = worst.max((x - a.get(j, i)).abs());
        }
        if largest > 0.0 { worst / largest } else { 0.0 }
    }

    /// `(M z)_i` of every i.
    pub fn mul(&self, matrix: &Matrix, z: &[f64], y: &mut [f64]) {
        match matrix {
            Matrix::Dense(a) => y.iter_mut().enumerate().for_each(|(i, y)| *y = a.dot(i, z)),
            _ => y.iter_mut().enumerate().for_each(|(i, y)| *y = (&self.sparse).dot(i, z)),
        }
    }

    /// `z_i ← P(z_i − step_i (w_i + extra(i, z_i)))` for every i in turn; calls `moved(i, Δz_i)`.
    pub fn sweep(
        &self,
        matrix: &Matrix,
        pass: &Pass,
        z: &mut [f64],
        extra: impl Fn(usize, f64) -> f64,
        moved: impl FnMut(usize, f64),
    ) {
        match matrix {
            Matrix::Dense(a) => sweep(a, pass, z, extra, moved),
            _ => sweep(&self.sparse, pass, z, extra, moved),
        }
    }

    /// The signs that make the equalities of a mixed problem agree with monotonicity: of the diagonal or, where that is zero, such that `M_ij` and `M_ji`
    /// are opposite. An equality may be multiplied by −1; the row of a pair may not.
    pub fn signs(&self, system: &System, signs: &mut Vec<f64>) {
        signs.clear();
        signs.extend(self.diagonal.iter().enumerate().map(|(i, &d)| {
            let negative = match system.matrix {
                _ if !is_free(&system.bounds, i) => false,
                _ if d != 0.0 => d < 0.0,
                Matrix::Dense(a) => {
                    let row = a.row(i).iter().enumerate();
                    row.map(|(j, &x)| x * a[(j, i)]).sum::<f64>() > 0.0
                }
                Matrix::Sparse(a) => {
                    let range = self.sparse.start[i]..self.sparse.start[i + 1];
                    range
                        .map(|k| self.sparse.value[k] * a.get(self.sparse.column[k] as usize, i))
                        .sum::<f64>()
                        > 0.0
                }
                Matrix::Operator(_) => false,
            };
            if negative { -1.0 } else { 1.0 }
        }));
    }

    /// Refuses a diagonal by which a variable cannot be relaxed: a free one needs a nonzero one, others a positive one, fixed ones none.
    pub fn needs_diagonal(&self, bounds: &Bounds) -> Result<(), SolveError> {
        for (i, &d) in self.diagonal.iter().enumerate() {
            if is_free(bounds, i) && d == 0.0 {
                return Err(SolveError::needs(
                    "a nonzero diagonal of M at free variables",
                    format!("M[{i}, {i}] = 0"),
                ));
            }
            if !is_free(bounds, i) && !is_fixed(bounds, i) && d <= 0.0 {
                return Err(SolveError::needs(
                    "a positive diagonal of M",
                    format!("M[{i}, {i}] = {d}"),
                ));
            }
        }
        Ok(())
    }
}

pub(super) fn is_free(bounds: &Bounds, i: usize) -> bool {
    bounds.lower(i) == f64::NEG_INFINITY && bounds.upper(i) == f64::INFINITY
}

/// Both bounds are the same.
pub(super) fn is_fixed(bounds: &Bounds, i: usize) -> bool {
    bounds.lower(i) == bounds.upper(i)
}

impl SparseRows {
    fn fill(&mut self, a: &Csc) {
        let n = a.nrows();
        let start = &mut self.start;
        start.clear();
        start.resize(n + 1, 0);
        a.row_idx().iter().for_each(|&i| start[i + 1] += 1);
        for i in 0..n {
            start[i + 1] += start[i];
        }
        self.column.clear();
        self.column.resize(a.nnz(), 0);
        self.value.clear();
        self.value.resize(a.nnz(), 0.0);
        for (i, j, x) in a.triplets() {
            let k = start[i];
            (self.column[k], self.value[k]) = (j as u32, x);
            start[i] += 1;
        }
        // The cursors have come to the ends of the rows, which are the beginnings of the next.
        start.copy_within(0..n, 1);
        start[0] = 0;
        for i in 0..n {
            let range = start[i]..start[i + 1];
            let below = self.column[range.clone()].partition_point(|&j| (j as usize) < i);
            self.column[range.clone()].rotate_left(below);
            self.value[range].rotate_left(below);
        }
    }
}

fn sweep(
    rows: impl Row,
    pass: &Pass,
    z: &mut [f64],
    extra: impl Fn(usize, f64) -> f64,
    mut moved: impl FnMut(usize, f64),
) {
    let n = z.len();
    let mut visit = |i: usize| {
        let old = z[i];
        let (head, [v, x]) = rows.parted(i, z);
        let step = pass.step[i];
        let most = old - step * (pass.q[i] + head + extra(i, old));
        let new = pass.bounds.project(i, most - (step * v) * x);
        if new != old {
            z[i] = new;
            moved(i, new - old);
        }
    };
    if pass.backward {
        (0..n).rev().for_each(&mut visit);
    } else {
        (0..n).for_each(&mut visit);
    }
}

/// Four sums side by side, which one instruction adds.
pub(super) fn dot(a: &[f64], b: &[f64]) -> f64 {
    let (heads_a, tail_a) = a.as_chunks::<4>();
    let (heads_b, tail_b) = b[..a.len()].as_chunks::<4>();
    let mut sums = [0.0; 4];
    for (a, b) in heads_a.iter().zip(heads_b) {
        for k in 0..4 {
            sums[k] += a[k] * b[k];
        }
    }
    let tail: f64 = tail_a.iter().zip(tail_b).map(|(a, b)| a * b).sum();
    (sums[0] + sums[1]) + (sums[2] + sums[3]) + tail
}
