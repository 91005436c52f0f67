//! Bases of complementary pivoting: columns of `[I, −M, −d]`, so that `B x_B = q` states `w = M z + d z0 + q`.
//!
//! | basis | kept | a pivot costs |
//! | --- | --- | --- |
//! | [`Tableau`] | `B⁻¹` times all columns | `4 n²`, all of it written |
//! | [`Factored`] | LU of the z-block, product-form updates | one solve with it and one product, dense or sparse |

mod factored;
mod tableau;

pub(super) use factored::Factored;
pub(super) use tableau::Tableau;

use nonsmooth_linalg::{Compensated, Matrix, Singular, dot, power_of_two};

use crate::complementarity::form::System;
use crate::core::trace::Variable;

/// M by columns.
#[derive(Debug, Clone)]
pub(super) enum Columns {
    /// All entries.
    Dense(Vec<f64>),
    /// Those that are not zero: pointers, rows, values.
    Sparse { ptr: Vec<usize>, idx: Vec<usize>, val: Vec<f64> },
}

/// The problem in units in which the largest entries of M are near 1: `R M C`, `R q`, R and C diagonal matrices of powers of two, so that nothing is rounded.
/// The path of complementary pivoting does not depend on them; its tolerances do.
#[derive(Debug, Clone)]
pub(super) struct Data {
    pub n: usize,
    /// The free variables, which come first, and as many equalities.
    pub free: usize,
    pub columns: Columns,
    pub q: Vec<f64>,
    /// The covering vector: the column of z0 is −d.
    pub d: Vec<f64>,
    /// The right-hand side of the symbolic perturbation, or zero.
    pub p: Vec<f64>,
    /// R, one power of two a row.
    pub row: Vec<f64>,
    /// C, one power of two a column.
    pub col: Vec<f64>,
}

/// Passes of the equilibration; each takes the square root of what is wrong with the largest entries.
const PASSES: usize = 6;

/// The power of two nearest to x > 0, in ratio.
fn nearest_power(x: f64) -> f64 {
    // Beyond this range M has entries that cannot be told from zero in any unit.
    const RANGE: f64 = 2.037_035_976_334_486e90; //  2³⁰⁰
    power_of_two(std::f64::consts::SQRT_2 * x).clamp(1.0 / RANGE, RANGE)
}

/// The largest entries of rows and columns of `R M C`.
fn largest(m: &Matrix, [row, col]: [&[f64]; 2], [rows, cols]: [&mut [f64]; 2]) {
    rows.fill(0.0);
    cols.fill(0.0);
    match m {
        Matrix::Dense(a) => {
            for (i, largest) in rows.iter_mut().enumerate() {
                let mut most = [0.0_f64; 4];
                for (j, ((x, c), column)) in a.row(i).iter().zip(col).zip(&mut *cols).enumerate() {
                    let x = x.abs() * row[i] * c;
                    *column = column.max(x);
                    most[j % 4] = most[j % 4].max(x);
                }
                *largest = most.into_iter().fold(0.0, f64::max);
            }
        }
        _ => {
            m.for_each(|i, j, x| {
                let x = x.abs() * row[i] * col[j];
                rows[i] = rows[i].max(x);
                cols[j] = cols[j].max(x);
            });
        }
    }
}

impl Data {
    /// The problem's data, scaled. `dense`: keep all entries.
    pub fn new(system: &System, dense: bool) -> Self {
        let columns = if dense {
            Columns::Dense(vec![])
        } else {
            Columns::Sparse { ptr: vec![], idx: vec![], val: vec![] }
        };
        let mut data = Self {
            n: 0,
            free: 0,
            columns,
            q: vec![],
            d: vec![],
            p: vec![],
            row: vec![],
            col: vec![],
        };
        data.fill(system);
        data
    }

    /// The data of another problem, in the same storage.
    pub fn fill(&mut self, system: &System) {
        let n = system.dim();
        (self.n, self.free) = (n, system.free());
        for v in [&mut self.d, &mut self.p] {
            v.clear();
            v.resize(n, 0.0);
        }
        self.equilibrate(system.matrix);
        let (row, col) = (&self.row, &self.col);
        self.q.clear();
        self.q.extend(system.q.iter().zip(row).map(|(q, r)| q * r));
        match &mut self.columns {
            Columns::Dense(values) => {
                values.clear();
                values.resize(n * n, 0.0);
                match system.matrix {
                    Matrix::Dense(a) => {
                        for i in 0..n {
                            for (j, (x, c)) in a.row(i).iter().zip(col).enumerate() {
                                values[i + j * n] = x * row[i] * c;
                            }
                        }
                    }
                    m => {
                        m.for_each(|i, j, x| values[i + j * n] = x * row[i] * col[j]);
                    }
                }
            }
            Columns::Sparse { ptr, idx, val } => {
                ptr.clear();
                ptr.resize(n + 1, 0);
                system.matrix.for_each(|_, j, x| ptr[j + 1] += usize::from(x != 0.0));
                (0..n).for_each(|j| ptr[j + 1] += ptr[j]);
                idx.clear();
                idx.resize(ptr[n], 0);
                val.clear();
                val.resize(ptr[n], 0.0);
                system.matrix.for_each(|i, j, x| {
                    if x != 0.0 {
                        let at = ptr[j];
                        ptr[j] += 1;
                        (idx[at], val[at]) = (i, x * row[i] * col[j]);
                    }
                });
                // Each pointer has moved to the end of its column.
                ptr.rotate_right(1);
                ptr[0] = 0;
            }
        }
    }

    /// R and C.
    fn equilibrate(&mut self, m: &Matrix) {
        let n = self.n;
        for v in [&mut self.row, &mut self.col] {
            v.clear();
            v.resize(n, 1.0);
        }
        // The largest entries of rows and columns; d and p serve as buffers.
        let (rows, cols) = (&mut self.d, &mut self.p);
        for _ in 0..PASSES {
            largest(m, [&self.row, &self.col], [rows, cols]);
            let mut changed = false;
            for (scale, largest) in [(&mut self.row, &*rows), (&mut self.col, &*cols)] {
                for (s, &l) in scale.iter_mut().zip(largest) {
                    if l > 0.0 && l.is_finite() {
                        let by = nearest_power(1.0 / l.sqrt());
                        changed |= by != 1.0;
                        *s *= by;
                    }
                }
            }
            if !changed {
                break;
            }
        }
        rows.fill(0.0);
        cols.fill(0.0);
    }

    /// Column j of M: `f(i, M_ij)` for its entries.
    #[inline]
    pub fn each(&self, j: usize, mut f: impl FnMut(usize, f64)) {
        match &self.columns {
            Columns::Dense(values) => {
                let column = &values[j * self.n..(j + 1) * self.n];
                column.iter().enumerate().for_each(|(i, &x)| f(i, x));
            }
            Columns::Sparse { ptr, idx, val } => {
                for k in ptr[j]..ptr[j + 1] {
                    f(idx[k], val[k]);
                }
            }
        }
    }

    /// `a += x` times the column of a variable in `[I, −M, −d]`.
    pub fn add_column(&self, v: Variable, x: f64, a: &mut [f64]) {
        match v {
            Variable::W(i) => a[i] += x,
            Variable::Z(j) => self.each(j, |i, m| a[i] -= m * x),
            Variable::Artificial => {
                a.iter_mut().zip(&self.d).for_each(|(a, d)| *a -= d * x);
            }
        }
    }

    /// The product of a row vector with the column of a variable in `[I, −M, −d]`.
    pub fn column_dot(&self, v: Variable, y: &[f64]) -> f64 {
        let mut sum = 0.0;
        match v {
            Variable::W(i) => sum = y[i],
            Variable::Z(j) => self.each(j, |i, m| sum -= m * y[i]),
            Variable::Artificial => sum = -dot(&self.d, y),
        }
        sum
    }

    /// `b − B x`, summed up in doubled precision.
    pub fn residual(
        &self,
        basic: &[Variable],
        b: &[f64],
        x: &[f64],
        sums: &mut [Compensated],
        out: &mut [f64],
    ) {
        for (sum, &b) in sums.iter_mut().zip(b) {
            *sum = Compensated::default();
            sum.add(b);
        }
        for (&v, &x) in basic.iter().zip(x).filter(|e| *e.1 != 0.0) {
            match v {
                Variable::W(i) => sums[i].add(-x),
                Variable::Z(j) => self.each(j, |i, m| sums[i].add_product(m, x)),
                Variable::Artificial => {
                    sums.iter_mut().zip(&self.d).for_each(|(s, &d)| s.add_product(d, x));
                }
            }
        }
        out.iter_mut().zip(sums).for_each(|(o, s)| *o = s.value());
    }
}

/// B⁻¹, in whatever form. Slots number the basic variables.
pub(super) trait Basis: Send {
    /// Makes the basis of these variables anew.
    fn renew(&mut self, data: &Data, basic: &[Variable]) -> Result<(), Singular>;

    /// Exchanges since it was made.
    fn age(&self) -> usize;

    /// `y = B⁻¹ a`, a the column of a nonbasic variable.
    fn column(&mut self, data: &Data, v: Variable, y: &mut [f64]);

    /// `x = B⁻¹ b`.
    fn solve(&mut self, data: &Data, b: &[f64], x: &mut [f64]);

    /// Row `slot` of B⁻¹.
    fn row(&mut self, data: &Data, slot: usize, out: &mut [f64]);

    /// `v` takes `slot`; `y` is its column.
    fn exchange(&mut self, slot: usize, v: Variable, y: &[f64]);
}
