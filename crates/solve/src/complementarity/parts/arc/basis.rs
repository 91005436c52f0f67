//! The basis of an arc: its columns, its LU, and the pivots since.

use nonsmooth_linalg::{Csc, RankLu};

use super::super::cycles::word;
use super::super::equilibrate_entries;
use super::super::product_form::Updates;

/// A variable of the arc.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Variable {
    /// x_i, column A e_i.
    X(usize),
    /// w_i, column −e_i.
    W(usize),
    /// v_i, column e_i.
    V(usize),
    /// Zero for ever; column e_i.
    Artificial(usize),
    /// t, column r.
    T,
}

impl Variable {
    /// A random word.
    pub fn word(self) -> u64 {
        word(match self {
            Self::X(i) => 4 * i as u64,
            Self::W(i) => 4 * i as u64 + 1,
            Self::V(i) => 4 * i as u64 + 2,
            Self::Artificial(i) => 4 * i as u64 + 3,
            Self::T => u64::MAX,
        })
    }
}

/// n columns of `[A, −I, I, r]`.
#[derive(Debug)]
pub struct Basis {
    /// A, its rows and columns multiplied by powers of two.
    pub a: Csc,
    pub rows: Vec<f64>,
    pub columns: Vec<f64>,
    /// The column of t.
    pub r: Vec<f64>,
    /// The variable of each slot.
    pub basic: Vec<Variable>,
    pub lu: RankLu,
    updates: Updates,
    buffer: Vec<f64>,
    scratch: Vec<f64>,
}

impl Basis {
    pub fn new(n: usize) -> Self {
        Self {
            a: Csc::zeros(n, n),
            rows: vec![1.0; n],
            columns: vec![1.0; n],
            r: vec![0.0; n],
            basic: vec![Variable::T; n],
            lu: RankLu::default(),
            updates: Updates::default(),
            buffer: vec![0.0; n],
            scratch: vec![],
        }
    }

    /// Takes A, scaled.
    pub fn take(&mut self, a: &Csc) {
        self.a.clone_from(a);
        let n = a.ncols();
        let visit = |each: &mut dyn FnMut(usize, usize, f64)| {
            a.triplets().for_each(|(i, j, x)| each(i, j, x));
        };
        equilibrate_entries(n, n, visit, &mut self.rows, &mut self.columns, &mut self.scratch);
        let Self { a, rows, columns, .. } = self;
        let (starts, indices, values) = a.parts_mut();
        for (j, column) in columns.iter().enumerate() {
            for k in starts[j]..starts[j + 1] {
                values[k] *= rows[indices[k]] * column;
            }
        }
    }

    /// `to += x · column`.
    pub fn add_column(&self, v: Variable, x: f64, to: &mut [f64]) {
        match v {
            Variable::X(i) => {
                let (rows, values) = self.a.column(i);
                rows.iter().zip(values).for_each(|(&k, a)| to[k] += a * x);
            }
            Variable::W(i) => to[i] -= x,
            Variable::V(i) | Variable::Artificial(i) => to[i] += x,
            Variable::T => to.iter_mut().zip(&self.r).for_each(|(t, r)| *t += r * x),
        }
    }

    /// Factorises the basis as it is; [`lu`](Self::lu) says what was replaced.
    pub fn renew(&mut self) -> Result<(), ()> {
        self.updates.clear();
        let n = self.basic.len();
        let mut entries = Vec::with_capacity(self.a.nnz() + n);
        for (slot, &v) in self.basic.iter().enumerate() {
            match v {
                Variable::X(i) => {
                    let (rows, values) = self.a.column(i);
                    let column = rows.iter().zip(values).filter(|e| *e.1 != 0.0);
                    entries.extend(column.map(|(&k, &a)| (k, slot, a)));
                }
                Variable::W(i) => entries.push((i, slot, -1.0)),
                Variable::V(i) | Variable::Artificial(i) => entries.push((i, slot, 1.0)),
                Variable::T => {
                    let column = self.r.iter().enumerate().filter(|e| *e.1 != 0.0);
                    entries.extend(column.map(|(k, &r)| (k, slot, r)));
                }
            }
        }
        let matrix = Csc::from_triplets(n, n, entries.iter().copied()).expect("in range");
        self.lu.factorise(&matrix).map_err(|_| ())
    }

    /// Pivots since the last factorisation.
    pub fn age(&self) -> usize {
        self.updates.len()
    }

    /// `y = B⁻¹ a`.
    pub fn column(&mut self, v: Variable, y: &mut [f64]) {
        let mut b = std::mem::take(&mut self.buffer);
        b.fill(0.0);
        self.add_column(v, 1.0, &mut b);
        self.solve(&mut b, y);
        self.buffer = b;
    }

    /// `x = B⁻¹ b`; b is overwritten.
    pub fn solve(&self, b: &mut [f64], x: &mut [f64]) {
        self.lu.solve(b, x);
        self.updates.forward(x);
    }

    /// A variable takes a slot; `y` is its column.
    pub fn exchange(&mut self, slot: usize, v: Variable, y: &[f64]) {
        self.updates.push(slot, y);
        self.basic[slot] = v;
    }
}
