//! The basis as an LU of its z-block and product-form updates.

use nonsmooth_linalg::{Csc, Dense, Matrix, Singular, SquareLu};

use super::{Basis, Columns, Data};
use crate::complementarity::parts::product_form::Updates;
use crate::core::trace::Variable;

/// B at its last renewal, in the order of its slots, with α the basic z (and z0) and β the rows whose w is nonbasic:
///
/// ```text
///       α         w
/// β  [ −K        0 ]      K = [M, d]_βα
///    [ −[M, d]   I ]
/// ```
///
/// Only K is factorised; the w follow by a product. Each exchange since then is an elementary matrix, a column of the tableau (product form).
/// Cost of a pivot: one solve with K (`2 k²`), one product (`2 k (n − k)`), the updates (`2 n` each); sparse: in proportion to the entries that are not zero.
#[derive(Debug, Clone, Default)]
pub(in super::super) struct Factored {
    lu: SquareLu,
    /// The columns of K, and their slots.
    core: Vec<(Variable, usize)>,
    /// β.
    beta: Vec<usize>,
    /// The rows of the basic w, and their slots.
    others: Vec<(usize, usize)>,
    /// `[M, d]` in those rows, by rows; dense only.
    below: Dense,
    /// Entries by basic w.
    lower: Vec<f64>,
    updates: Updates,
    /// Entries by rows of M, and by columns of K.
    rows: Vec<f64>,
    solution: Vec<f64>,
    /// The place of a row in β.
    place: Vec<usize>,
}

/// Entries of a line of the cache.
const LINE: usize = 8;

impl Factored {
    /// `x = B⁻¹ b` of the basis at its renewal; `self.rows` is b, and is overwritten.
    fn solve_base(&mut self, data: &Data, x: &mut [f64]) {
        let Self { lu, core, beta, others, below, lower, rows, solution, .. } = self;
        solution.clear();
        solution.extend(beta.iter().map(|&i| rows[i]));
        if !core.is_empty() && solution.iter().any(|x| *x != 0.0) {
            lu.solve(solution);
        }
        for (t, &(_, slot)) in solution.iter_mut().zip(core.iter()) {
            *t = -*t;
            x[slot] = *t;
        }
        match &data.columns {
            Columns::Dense(_) => {
                lower.clear();
                lower.extend(others.iter().map(|&(i, _)| rows[i]));
                if !core.is_empty() && !others.is_empty() {
                    below.mul_add(1.0, solution, lower);
                }
                others.iter().zip(lower.iter()).for_each(|(&(_, slot), y)| x[slot] = *y);
            }
            Columns::Sparse { .. } => {
                for (&t, &(v, _)) in solution.iter().zip(core.iter()) {
                    if t != 0.0 {
                        data.add_column(v, -t, rows);
                    }
                }
                others.iter().for_each(|&(i, slot)| x[slot] = rows[i]);
            }
        }
    }

    /// K as a matrix.
    fn core_matrix(&mut self, data: &Data) -> Matrix {
        let k = self.core.len();
        match &data.columns {
            Columns::Dense(values) => {
                let (core, beta) = (&self.core, &self.beta);
                let mut out = Dense::zeros(k, k);
                for (a, &i) in beta.iter().enumerate() {
                    for (entry, &(v, _)) in out.row_mut(a).iter_mut().zip(core) {
                        *entry = match v {
                            Variable::Z(j) => values[i + j * data.n],
                            _ => data.d[i],
                        };
                    }
                }
                out.into()
            }
            Columns::Sparse { .. } => {
                self.place.clear();
                self.place.resize(data.n, usize::MAX);
                self.beta.iter().enumerate().for_each(|(a, &i)| self.place[i] = a);
                let mut entries = vec![];
                for (c, &(v, _)) in self.core.iter().enumerate() {
                    let mut keep = |i: usize, x: f64| {
                        if self.place[i] != usize::MAX && x != 0.0 {
                            entries.push((self.place[i], c, x));
                        }
                    };
                    match v {
                        Variable::Z(j) => data.each(j, keep),
                        _ => data.d.iter().enumerate().for_each(|(i, &d)| keep(i, d)),
                    }
                }
                Csc::from_triplets(k, k, entries.iter().copied()).expect("in range").into()
            }
        }
    }
}

impl Basis for Factored {
    fn renew(&mut self, data: &Data, basic: &[Variable]) -> Result<(), Singular> {
        let n = data.n;
        self.updates.clear();
        self.core.clear();
        self.others.clear();
        self.beta.clear();
        self.place.clear();
        self.place.resize(n, usize::MAX);
        for (slot, &v) in basic.iter().enumerate() {
            match v {
                Variable::W(i) => {
                    self.others.push((i, slot));
                    self.place[i] = slot;
                }
                v => self.core.push((v, slot)),
            }
        }
        self.beta.extend((0..n).filter(|&i| self.place[i] == usize::MAX));
        self.rows.resize(n, 0.0);
        if self.beta.len() != self.core.len() {
            return Err(Singular);
        }
        if !self.core.is_empty() {
            let matrix = self.core_matrix(data);
            self.lu.factorise(&matrix)?;
        }
        if let Columns::Dense(values) = &data.columns {
            self.below.reset(self.others.len(), self.core.len());
            let column = |v: Variable| match v {
                Variable::Z(j) => &values[j * n..(j + 1) * n],
                _ => &data.d,
            };
            // Some columns at a time: they are read in order, and rows written in lines.
            for (c, chunk) in self.core.chunks(LINE).enumerate() {
                for (m, &(i, _)) in self.others.iter().enumerate() {
                    let row = &mut self.below.row_mut(m)[c * LINE..];
                    row.iter_mut().zip(chunk).for_each(|(x, &(v, _))| *x = column(v)[i]);
                }
            }
        }
        Ok(())
    }

    fn age(&self) -> usize {
        self.updates.len()
    }

    fn column(&mut self, data: &Data, v: Variable, y: &mut [f64]) {
        self.rows.fill(0.0);
        data.add_column(v, 1.0, &mut self.rows);
        self.solve_base(data, y);
        self.updates.forward(y);
    }

    fn solve(&mut self, data: &Data, b: &[f64], x: &mut [f64]) {
        self.rows.copy_from_slice(b);
        self.solve_base(data, x);
        self.updates.forward(x);
    }

    fn row(&mut self, data: &Data, slot: usize, out: &mut [f64]) {
        // s, by slots.
        let mut s = std::mem::take(&mut self.rows);
        s.fill(0.0);
        s[slot] = 1.0;
        self.updates.backward(&mut s);
        let Self { lu, core, beta, others, below, lower, solution, .. } = self;
        out.fill(0.0);
        others.iter().for_each(|&(i, slot)| out[i] = s[slot]);
        // Kᵀ ρ_β = −(s_α + [M, d]ᵀ ρ_w).
        solution.clear();
        match &data.columns {
            Columns::Dense(_) => {
                solution.extend(core.iter().map(|&(_, slot)| -s[slot]));
                lower.clear();
                lower.extend(others.iter().map(|&(i, _)| out[i]));
                if !core.is_empty() && lower.iter().any(|x| *x != 0.0) {
                    below.mul_transpose_add(-1.0, lower, solution);
                }
            }
            // The column in B is −[M, d]; rows in β are still zero.
            Columns::Sparse { .. } => {
                solution.extend(core.iter().map(|&(v, slot)| data.column_dot(v, out) - s[slot]));
            }
        }
        if !core.is_empty() && solution.iter().any(|x| *x != 0.0) {
            lu.solve_transpose(solution);
        }
        beta.iter().zip(solution.iter()).for_each(|(&i, &t)| out[i] = t);
        self.rows = s;
    }

    fn exchange(&mut self, slot: usize, _: Variable, y: &[f64]) {
        self.updates.push(slot, y);
    }
}
