//! LU of a square sparse matrix that names the columns which depend on others.

use faer::dyn_stack::{MemBuffer, MemStack};
use faer::sparse::SymbolicSparseColMatRef;
use faer::sparse::linalg::colamd;

use super::Csc;
use super::block_lu::Singular;
use super::budget::{self, Pace};
use super::inverse::count_factorisation;

/// A candidate for the pivot is at least this part of the largest one.
const THRESHOLD: f64 = 0.1;
/// Where all candidates are below this part of the terms that made the column, the column depends on those before it.
const DEPENDENT: f64 = 1e-11;
/// A row that is not eliminated yet, a column without a pivot.
const NONE: usize = usize::MAX;

/// LU with threshold pivoting of a sparse square matrix that may be singular: a column that depends on the others is replaced by a unit column, and named.
///
/// Column after column (left-looking): columns with one entry first, then an order of approximate minimum degree. Unlike [`SquareLu`](super::SquareLu), which only
/// says that a matrix is singular, it finishes in any case; simplex-like methods begin from such a basis.
/// Cost: in proportion to the operations of the elimination; n log n beside them. References: GilbertPeierls1988.
#[derive(Debug, Clone, Default)]
pub struct RankLu {
    n: usize,
    /// The columns in the order of elimination, and the row of each pivot.
    order: Vec<usize>,
    pivot_row: Vec<usize>,
    pivots: Vec<f64>,
    /// L without its diagonal by columns, its rows those of the matrix.
    lower: Columns,
    /// U without its diagonal by columns, its rows places in the order of elimination.
    upper: Columns,
    /// The place at which a row was eliminated.
    place: Vec<usize>,
    /// Column and row: the column is replaced by the unit vector of the row.
    replaced: Vec<(usize, usize)>,
    work: Work,
}

#[derive(Debug, Clone, Default)]
struct Columns {
    starts: Vec<usize>,
    rows: Vec<usize>,
    values: Vec<f64>,
}

impl Columns {
    fn clear(&mut self) {
        self.starts.clear();
        self.starts.push(0);
        self.rows.clear();
        self.values.clear();
    }

    fn push(&mut self, row: usize, value: f64) {
        self.rows.push(row);
        self.values.push(value);
    }

    fn close(&mut self) {
        self.starts.push(self.rows.len());
    }

    fn column(&self, k: usize) -> (&[usize], &[f64]) {
        let range = self.starts[k]..self.starts[k + 1];
        (&self.rows[range.clone()], &self.values[range])
    }
}

#[derive(Debug, Clone, Default)]
struct Work {
    /// A column while it is eliminated, and what its rows were reached by.
    x: Vec<f64>,
    mark: Vec<usize>,
    /// Rows reached, in an order that ends with the first to be eliminated.
    reached: Vec<usize>,
    stack: Vec<(usize, usize)>,
    /// The entries of each row.
    counts: Vec<usize>,
}

impl RankLu {
    /// Factorises `a`. Counts as one factorisation.
    ///
    /// Errors: entries that are not finite; time or memory that is not there. A singular matrix is none: see [`replaced`](Self::replaced).
    ///
    /// # Panics
    ///
    /// Where `a` is not square.
    pub fn factorise(&mut self, a: &Csc) -> Result<(), Singular> {
        assert_eq!(a.nrows(), a.ncols(), "a square matrix");
        count_factorisation();
        let n = a.nrows();
        if a.values().iter().any(|x| !x.is_finite()) {
            return Err(Singular);
        }
        self.n = n;
        self.order.clear();
        self.pivot_row.clear();
        self.pivots.clear();
        self.replaced.clear();
        self.lower.clear();
        self.upper.clear();
        self.place.clear();
        self.place.resize(n, NONE);
        let Work { x, mark, counts, .. } = &mut self.work;
        x.clear();
        x.resize(n, 0.0);
        mark.clear();
        mark.resize(n, NONE);
        counts.clear();
        counts.resize(n, 0);
        a.row_idx().iter().for_each(|&i| counts[i] += 1);
        let rest = self.singletons(a);
        let rest = self.arrange(a, rest);
        let mut pace = Pace::default();
        let mut dependent = vec![];
        let mut admitted = a.nnz();
        for j in rest {
            let operations = self.eliminate(a, j, &mut dependent);
            let entries = self.lower.rows.len() + self.upper.rows.len();
            if entries > admitted {
                // They grow by doubling.
                admitted = 2 * entries;
                let bytes = 16.0 * 2.0 * entries as f64;
                budget::admit("a sparse LU factorisation", bytes).map_err(|_| Singular)?;
            }
            if pace.over(operations) {
                return Err(Singular);
            }
        }
        let free = (0..n).filter(|&i| self.place[i] == NONE).collect::<Vec<_>>();
        for (j, i) in dependent.into_iter().zip(free) {
            self.replaced.push((j, i));
            self.pivot(j, i, 1.0);
            self.upper.close();
            self.lower.close();
        }
        let finite = self.lower.values.iter().chain(&self.upper.values).all(|x| x.is_finite());
        finite.then_some(()).ok_or(Singular)
    }

    /// The columns that depend on others, each with the row of the unit column that stands in its place.
    pub fn replaced(&self) -> &[(usize, usize)] {
        &self.replaced
    }

    fn pivot(&mut self, j: usize, i: usize, value: f64) {
        self.place[i] = self.order.len();
        self.order.push(j);
        self.pivot_row.push(i);
        self.pivots.push(value);
    }

    /// Columns with one entry outside the rows eliminated are pivots without an elimination; the other columns.
    fn singletons(&mut self, a: &Csc) -> Vec<usize> {
        let n = self.n;
        let by_rows = a.transpose();
        let mut left: Vec<usize> = (0..n).map(|j| a.column(j).0.len()).collect();
        let mut queue: Vec<usize> = (0..n).filter(|&j| left[j] == 1).collect();
        let mut done = vec![false; n];
        while let Some(j) = queue.pop() {
            let (rows, values) = a.column(j);
            let open = rows.iter().zip(values).find(|(i, _)| self.place[**i] == NONE);
            let size = values.iter().fold(0.0_f64, |m, x| m.max(x.abs()));
            match open {
                Some((&i, &x)) if x.abs() > 1e-3 * size => {
                    for (&row, &x) in rows.iter().zip(values) {
                        if row != i && x != 0.0 {
                            self.upper.push(self.place[row], x);
                        }
                    }
                    self.upper.close();
                    self.lower.close();
                    self.pivot(j, i, x);
                    done[j] = true;
                    for &k in by_rows.column(i).0 {
                        left[k] -= 1;
                        if left[k] == 1 && !done[k] {
                            queue.push(k);
                        }
                    }
                }
                _ => {}
            }
        }
        (0..n).filter(|&j| !done[j]).collect()
    }

    /// The other columns in an order of little fill.
    fn arrange(&self, a: &Csc, rest: Vec<usize>) -> Vec<usize> {
        let k = rest.len();
        if k < 2 {
            return rest;
        }
        let mut number = vec![NONE; self.n];
        let open = (0..self.n).filter(|&i| self.place[i] == NONE);
        open.enumerate().for_each(|(row, i)| number[i] = row);
        let (mut starts, mut rows) = (vec![0], vec![]);
        for &j in &rest {
            rows.extend(a.column(j).0.iter().map(|&i| number[i]).filter(|&i| i != NONE));
            starts.push(rows.len());
        }
        let pattern = SymbolicSparseColMatRef::new_checked(k, k, &starts, None, &rows);
        let mut memory = MemBuffer::new(colamd::order_scratch::<usize>(k, k, rows.len()));
        let (mut order, mut inverse) = (vec![0; k], vec![0; k]);
        let control = colamd::Control::default();
        let stack = MemStack::new(&mut memory);
        if colamd::order(&mut order, &mut inverse, pattern, control, stack).is_err() {
            return rest;
        }
        order.into_iter().map(|c| rest[c]).collect()
    }

    /// Eliminates column j; the operations that it took.
    fn eliminate(&mut self, a: &Csc, j: usize, dependent: &mut Vec<usize>) -> f64 {
        let (rows, values) = a.column(j);
        self.work.reached.clear();
        for &i in rows {
            self.reach(i, j);
        }
        let Work { x, reached, counts, .. } = &mut self.work;
        let mut size = 0.0_f64;
        for (&i, &v) in rows.iter().zip(values) {
            x[i] = v;
            size = size.max(v.abs());
        }
        let mut operations = reached.len();
        for &i in reached.iter().rev() {
            let k = self.place[i];
            if k == NONE {
                continue;
            }
            let xi = x[i];
            if xi != 0.0 {
                size = size.max(xi.abs());
                self.upper.push(k, xi);
                let (rows, values) = self.lower.column(k);
                rows.iter().zip(values).for_each(|(&r, &l)| x[r] -= l * xi);
                operations += rows.len();
            }
        }
        let open = || reached.iter().copied().filter(|&i| self.place[i] == NONE);
        let largest = open().fold(0.0_f64, |m, i| m.max(x[i].abs()));
        let found = if largest > DEPENDENT * size && largest > 0.0 {
            open().filter(|&i| x[i].abs() >= THRESHOLD * largest).min_by_key(|&i| counts[i])
        } else {
            None
        };
        match found {
            None => {
                dependent.push(j);
                // What was pushed belongs to no column.
                let end = *self.upper.starts.last().expect("closed");
                self.upper.rows.truncate(end);
                self.upper.values.truncate(end);
            }
            Some(pivot) => {
                let value = x[pivot];
                for i in open().filter(|&i| i != pivot && x[i] != 0.0) {
                    self.lower.rows.push(i);
                    self.lower.values.push(x[i] / value);
                }
                self.upper.close();
                self.lower.close();
            }
        }
        for &i in reached.iter() {
            if found == Some(i) {
                continue;
            }
            x[i] = 0.0;
        }
        if let Some(i) = found {
            let value = std::mem::take(&mut self.work.x[i]);
            self.pivot(j, i, value);
        }
        operations as f64
    }

    /// Adds to the rows reached those that row i leads to, each after all that it leads to.
    fn reach(&mut self, i: usize, j: usize) {
        let Work { mark, reached, stack, .. } = &mut self.work;
        if mark[i] == j {
            return;
        }
        mark[i] = j;
        stack.push((i, 0));
        while let Some((row, next)) = stack.last_mut() {
            let k = self.place[*row];
            let further = match k {
                NONE => None,
                k => {
                    let rows = self.lower.column(k).0;
                    rows.get(*next).copied()
                }
            };
            match further {
                Some(r) => {
                    *next += 1;
                    if mark[r] != j {
                        mark[r] = j;
                        stack.push((r, 0));
                    }
                }
                None => {
                    reached.push(*row);
                    stack.pop();
                }
            }
        }
    }

    /// `x = A⁻¹ b`, A with the columns that were replaced; b is overwritten.
    pub fn solve(&self, b: &mut [f64], x: &mut [f64]) {
        for k in 0..self.n {
            let t = b[self.pivot_row[k]];
            if t != 0.0 {
                let (rows, values) = self.lower.column(k);
                rows.iter().zip(values).for_each(|(&i, &l)| b[i] -= l * t);
            }
        }
        for k in (0..self.n).rev() {
            let t = b[self.pivot_row[k]] / self.pivots[k];
            x[self.order[k]] = t;
            if t != 0.0 {
                let (places, values) = self.upper.column(k);
                places.iter().zip(values).for_each(|(&p, &u)| b[self.pivot_row[p]] -= u * t);
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use rand::{RngExt, SeedableRng};
    use rand_pcg::Pcg64Mcg;

    use super::*;

    fn random(n: usize, per_column: usize, rng: &mut Pcg64Mcg) -> Csc {
        let mut entries = vec![];
        for j in 0..n {
            for _ in 0..rng.random_range(1..=per_column) {
                entries.push((rng.random_range(0..n), j, rng.random_range(-1.0..1.0)));
            }
            if rng.random_bool(0.7) {
                entries.push((j, j, 2.0));
            }
        }
        Csc::from_triplets(n, n, entries.into_iter()).unwrap()
    }

    /// The matrix with the columns that were replaced.
    fn mended(a: &Csc, replaced: &[(usize, usize)]) -> Csc {
        let is = |j: usize| replaced.iter().any(|r| r.0 == j);
        let kept: Vec<_> = a.triplets().filter(|e| !is(e.1)).collect();
        let units = replaced.iter().map(|&(j, i)| (i, j, 1.0));
        Csc::from_triplets(a.nrows(), a.ncols(), kept.into_iter().chain(units)).unwrap()
    }

    #[test]
    fn solutions_satisfy_the_mended_system() {
        let mut rng = Pcg64Mcg::seed_from_u64(5);
        let mut lu = RankLu::default();
        let mut singular = 0;
        for case in 0..200 {
            let n = 1 + case % 40;
            let a = random(n, 4, &mut rng);
            lu.factorise(&a).unwrap();
            let a = mended(&a, lu.replaced());
            singular += usize::from(!lu.replaced().is_empty());
            let known: Vec<f64> = (0..n).map(|i| (i as f64).cos()).collect();
            let (mut b, mut x) = (vec![0.0; n], vec![0.0; n]);
            a.mul_add(1.0, &known, &mut b);
            let right = b.clone();
            lu.solve(&mut b, &mut x);
            let mut rest = right;
            a.mul_add(-1.0, &x, &mut rest);
            assert!(rest.iter().all(|r| r.abs() < 1e-9), "{case}: {rest:?}");
        }
        assert!(singular > 20, "{singular}");
    }

    #[test]
    fn dependent_columns_are_named() {
        // Column 2 is the sum of columns 0 and 1.
        let entries = [(0, 0, 1.0), (1, 0, 2.0), (1, 1, 1.0), (2, 1, 3.0)];
        let sum = [(0, 2, 1.0), (1, 2, 3.0), (2, 2, 3.0)];
        let a = Csc::from_triplets(3, 3, entries.into_iter().chain(sum)).unwrap();
        let mut lu = RankLu::default();
        lu.factorise(&a).unwrap();
        assert_eq!(lu.replaced().len(), 1);
        lu.factorise(&Csc::zeros(4, 4)).unwrap();
        assert_eq!(lu.replaced().len(), 4);
        let nan = Csc::diagonal(&[1.0, f64::NAN]);
        assert!(lu.factorise(&nan).is_err());
    }
}
