//! The textbook's dense tableau.

use nonsmooth_linalg::{Singular, budget};

use super::{Basis, Data};
use crate::core::trace::Variable;

/// `B⁻¹ [I, −M, −d]`, all of it: the first n columns are B⁻¹. A pivot is one Gauss–Jordan step of `4 n²` operations that reads and writes all of it. Plain on
/// purpose: the others are measured by it. (Without the columns of basic variables it would be half of that.) Storage: `8 n (2 n + 1)` bytes.
#[derive(Debug, Clone, Default)]
pub(in super::super) struct Tableau {
    n: usize,
    /// n × (2 n + 1), rows by slots.
    entries: Vec<f64>,
    age: usize,
    /// The row of the pivot.
    pivot: Vec<f64>,
    /// The row of a slot, while the basis is made.
    rows: Vec<usize>,
    /// Rows that a basic variable has taken, and those that some z or z0 is to take.
    taken: Vec<bool>,
    open: Vec<bool>,
}

/// A pivot of a fresh basis below this, in units of its column in the rows that are to be taken, is zero.
const SINGULAR: f64 = 1e-14;

impl Tableau {
    fn column_of(&self, v: Variable) -> usize {
        match v {
            Variable::W(i) => i,
            Variable::Z(j) => self.n + j,
            Variable::Artificial => 2 * self.n,
        }
    }

    fn width(&self) -> usize {
        2 * self.n + 1
    }

    fn at(&self, i: usize, j: usize) -> f64 {
        self.entries[i * self.width() + j]
    }

    /// The Gauss–Jordan step on entry (r, s).
    fn pivot(&mut self, r: usize, s: usize) {
        let width = self.width();
        let inverse = 1.0 / self.at(r, s);
        self.pivot.clear();
        self.pivot.extend(self.entries[r * width..(r + 1) * width].iter().map(|x| x * inverse));
        self.pivot[s] = 1.0;
        for (i, row) in self.entries.chunks_exact_mut(width).enumerate() {
            let y = row[s];
            if i == r {
                row.copy_from_slice(&self.pivot);
            } else if y != 0.0 {
                row.iter_mut().zip(&self.pivot).for_each(|(x, p)| *x -= y * p);
                row[s] = 0.0;
            }
        }
    }
}

impl Basis for Tableau {
    fn renew(&mut self, data: &Data, basic: &[Variable]) -> Result<(), Singular> {
        let n = data.n;
        self.n = n;
        self.age = 0;
        let width = self.width();
        let needed = 8.0 * n as f64 * width as f64;
        budget::admit("the dense tableau", needed).map_err(|_| Singular)?;
        self.entries.clear();
        self.entries.resize(n * width, 0.0);
        for j in 0..n {
            self.entries[j * width + j] = 1.0;
            data.each(j, |i, x| self.entries[i * width + n + j] = -x);
        }
        for (i, d) in data.d.iter().enumerate() {
            self.entries[i * width + 2 * n] = -d;
        }
        for v in [&mut self.taken, &mut self.open] {
            v.clear();
            v.resize(n, false);
        }
        self.open.fill(true);
        for v in basic {
            if let Variable::W(i) = v {
                self.taken[*i] = true;
                self.open[*i] = false;
            }
        }
        // Each z into the row where its entry is largest.
        self.rows.clear();
        for &v in basic {
            if let Variable::W(i) = v {
                self.rows.push(i);
                continue;
            }
            let mut size = 0.0_f64;
            match v {
                Variable::Z(j) => data.each(j, |i, x| {
                    if self.open[i] {
                        size = size.max(x.abs());
                    }
                }),
                _ => {
                    (0..n).filter(|&i| self.open[i]).for_each(|i| size = size.max(data.d[i].abs()))
                }
            }
            let s = self.column_of(v);
            let left = (0..n).filter(|&i| !self.taken[i]);
            let best = left.max_by(|&a, &b| self.at(a, s).abs().total_cmp(&self.at(b, s).abs()));
            let Some(r) = best.filter(|&r| self.at(r, s).abs() > SINGULAR * size) else {
                return Err(Singular);
            };
            self.pivot(r, s);
            self.taken[r] = true;
            self.rows.push(r);
        }
        // Each row into its slot.
        for slot in 0..n {
            let mut from = self.rows[slot];
            // What was in an earlier slot has been swapped away from there.
            while from < slot {
                from = self.rows[from];
            }
            if from != slot {
                let (low, high) = self.entries.split_at_mut(from * width);
                low[slot * width..(slot + 1) * width].swap_with_slice(&mut high[..width]);
            }
        }
        let finite = self.entries.iter().all(|x| x.is_finite());
        finite.then_some(()).ok_or(Singular)
    }

    fn age(&self) -> usize {
        self.age
    }

    fn column(&mut self, _: &Data, v: Variable, y: &mut [f64]) {
        let (s, width) = (self.column_of(v), self.width());
        y.iter_mut().zip(self.entries.chunks_exact(width)).for_each(|(y, row)| *y = row[s]);
    }

    fn solve(&mut self, _: &Data, b: &[f64], x: &mut [f64]) {
        for (x, row) in x.iter_mut().zip(self.entries.chunks_exact(self.width())) {
            *x = row.iter().zip(b).map(|(inverse, b)| inverse * b).sum();
        }
    }

    fn row(&mut self, _: &Data, slot: usize, out: &mut [f64]) {
        let width = self.width();
        out.copy_from_slice(&self.entries[slot * width..slot * width + self.n]);
    }

    fn exchange(&mut self, slot: usize, v: Variable, _: &[f64]) {
        self.pivot(slot, self.column_of(v));
        self.age += 1;
    }
}
