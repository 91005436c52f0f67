//! The textbook's dense tableau.

use nonsmooth_problem::linalg::Singular;

use super::{Basis, Data};
use crate::trace::Variable;

/// The condensed tableau: `B⁻¹` times the column of every nonbasic variable, rows by slots. A pivot is one exchange step of `2 n²` operations that
/// reads and writes all of it. Storage: `8 n (n + 1)` bytes.
#[derive(Debug, Clone, Default)]
pub(in super::super) struct Tableau {
    n: usize,
    /// n × (n + 1), by rows.
    entries: Vec<f64>,
    /// Where the column of a nonbasic variable is: of the z, the w and z0; or the slot of a basic one.
    place: Vec<Place>,
    age: usize,
    /// The row of the pivot.
    pivot: Vec<f64>,
    rows: Vec<usize>,
    /// Rows from which w has gone.
    taken: Vec<bool>,
}

#[derive(Debug, Clone, Copy, PartialEq)]
enum Place {
    Column(usize),
    Row(usize),
}

/// A pivot of a fresh basis below this, in units of its column in the rows that are to be taken, is zero.
const SINGULAR: f64 = 1e-14;

impl Tableau {
    fn index(&self, v: Variable) -> usize {
        match v {
            Variable::Z(j) => j,
            Variable::W(i) => self.n + i,
            Variable::Artificial => 2 * self.n,
        }
    }

    fn at(&self, i: usize, j: usize) -> f64 {
        self.entries[i * (self.n + 1) + j]
    }

    /// The exchange step on entry (r, s).
    fn pivot(&mut self, r: usize, s: usize) {
        let width = self.n + 1;
        let inverse = 1.0 / self.at(r, s);
        self.pivot.clear();
        self.pivot.extend(self.entries[r * width..(r + 1) * width].iter().map(|x| x * inverse));
        self.pivot[s] = inverse;
        for (i, row) in self.entries.chunks_exact_mut(width).enumerate() {
            if i == r {
                row.copy_from_slice(&self.pivot);
            } else if row[s] != 0.0 {
                let y = row[s];
                row[s] = 0.0;
                row.iter_mut().zip(&self.pivot).for_each(|(x, p)| *x -= y * p);
            }
        }
    }
}

impl Basis for Tableau {
    fn renew(&mut self, data: &Data, basic: &[Variable]) -> Result<(), Singular> {
        let n = data.n;
        let width = n + 1;
        self.n = n;
        self.age = 0;
        // The basis of the w: columns −M and −d.
        self.entries.clear();
        self.entries.resize(n * width, 0.0);
        for j in 0..n {
            data.each(j, |i, x| self.entries[i * width + j] = -x);
        }
        for (i, d) in data.d.iter().enumerate() {
            self.entries[i * width + n] = -d;
        }
        self.place.clear();
        self.place.extend((0..n).map(Place::Column));
        self.place.extend((0..n).map(Place::Row));
        self.place.push(Place::Column(n));
        // Rows whose w has to leave.
        self.rows.clear();
        self.rows.extend(0..n);
        self.taken.clear();
        self.taken.resize(n, false);
        for v in basic {
            if let Variable::W(i) = v {
                self.rows[*i] = usize::MAX;
            }
        }
        for &v in basic {
            let index = self.index(v);
            let Place::Column(s) = self.place[index] else { continue };
            let mut size = 0.0_f64;
            let taken = |i: usize| self.rows[i] == i || self.taken[i];
            match v {
                Variable::Z(j) => data.each(j, |i, x| {
                    if taken(i) {
                        size = size.max(x.abs())
                    }
                }),
                _ => (0..n).filter(|&i| taken(i)).for_each(|i| size = size.max(data.d[i].abs())),
            }
            let free = (0..n).filter(|&i| self.rows[i] == i);
            let best = free.max_by(|&a, &b| self.at(a, s).abs().total_cmp(&self.at(b, s).abs()));
            let Some(r) = best.filter(|&r| self.at(r, s).abs() > SINGULAR * size) else {
                return Err(Singular);
            };
            self.pivot(r, s);
            self.rows[r] = usize::MAX;
            self.taken[r] = true;
            self.place[index] = Place::Row(r);
            self.place[n + r] = Place::Column(s);
        }
        // Each row into its slot.
        self.rows.clear();
        self.rows.resize(n, 0);
        for (slot, &v) in basic.iter().enumerate() {
            let index = self.index(v);
            let Place::Row(r) = self.place[index] else { return Err(Singular) };
            self.rows[slot] = r;
            self.place[index] = Place::Row(slot);
        }
        for slot in 0..n {
            let mut from = self.rows[slot];
            // What was in an earlier slot has been swapped away from there.
            while from < slot {
                from = self.rows[from];
            }
            if from != slot {
                let (a, b) = (slot * width, from * width);
                let (low, high) = self.entries.split_at_mut(b);
                low[a..a + width].swap_with_slice(&mut high[..width]);
            }
        }
        let finite = self.entries.iter().all(|x| x.is_finite());
        finite.then_some(()).ok_or(Singular)
    }

    fn age(&self) -> usize {
        self.age
    }

    fn column(&mut self, _: &Data, v: Variable, y: &mut [f64]) {
        match self.place[self.index(v)] {
            Place::Column(s) => {
                let rows = self.entries.chunks_exact(self.n + 1);
                y.iter_mut().zip(rows).for_each(|(y, row)| *y = row[s]);
            }
            Place::Row(r) => {
                y.fill(0.0);
                y[r] = 1.0;
            }
        }
    }

    fn solve(&mut self, _: &Data, b: &[f64], x: &mut [f64]) {
        x.fill(0.0);
        for (j, &b) in b.iter().enumerate() {
            match self.place[self.n + j] {
                Place::Row(r) => x[r] += b,
                Place::Column(s) => {
                    let rows = self.entries.chunks_exact(self.n + 1);
                    x.iter_mut().zip(rows).for_each(|(x, row)| *x += row[s] * b);
                }
            }
        }
    }

    fn row(&mut self, _: &Data, slot: usize, out: &mut [f64]) {
        for (j, out) in out.iter_mut().enumerate() {
            *out = match self.place[self.n + j] {
                Place::Column(s) => self.at(slot, s),
                Place::Row(r) => f64::from(u8::from(r == slot)),
            };
        }
    }

    fn exchange(&mut self, slot: usize, leaving: Variable, v: Variable, _: &[f64]) {
        let (enters, leaves) = (self.index(v), self.index(leaving));
        if let Place::Column(s) = self.place[enters] {
            self.pivot(slot, s);
            self.place[enters] = Place::Row(slot);
            self.place[leaves] = Place::Column(s);
        }
        self.age += 1;
    }
}
