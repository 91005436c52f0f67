//! A complementary basis that holds the free variables of a mixed problem, where A alone does not give one.

use super::basis::Data;
use crate::core::trace::Variable;

/// A pivot above this is taken, in units of the largest entries of the equilibrated M; the largest first.
const LEVELS: [f64; 3] = [1e-2, 1e-5, 1e-9];

/// The tableau of the elimination.
struct Elimination {
    n: usize,
    free: usize,
    /// By rows.
    t: Vec<f64>,
    rows: Vec<Variable>,
    columns: Vec<Variable>,
    pivot: Vec<f64>,
}

/// The basic variables, one a row: as many free z as can be, each w that had to leave replaced by its z.
///
/// First the free z take rows of equalities (Gauss–Jordan on A). Where A is singular, a free z that is left takes a row of a complementary w, whose z takes
/// the row of an equality that is left, or that of another w, and so on: an alternating path, the shortest one, so that its pivots are entries of one and
/// the same tableau. A free z and an equality that no path connects stay as they are, nonbasic and basic: the equality is redundant, or not satisfiable, or has
/// complementary variables only; `Path::violation` tells.
/// Cost: `2 n²` a pivot, dense.
pub(super) fn with_free_variables(data: &Data) -> Vec<Variable> {
    let n = data.n;
    let mut t = vec![0.0; n * n];
    for j in 0..n {
        data.each(j, |i, x| t[i * n + j] = -x);
    }
    let mut e = Elimination {
        n,
        free: data.free,
        t,
        rows: (0..n).map(Variable::W).collect(),
        columns: (0..n).map(Variable::Z).collect(),
        pivot: vec![],
    };
    e.equalities();
    for level in LEVELS {
        while let Some(path) = e.path(level) {
            path.into_iter().for_each(|(r, s)| e.exchange(r, s));
        }
    }
    e.rows
}

impl Elimination {
    fn at(&self, r: usize, s: usize) -> f64 {
        self.t[r * self.n + s]
    }

    /// The variable of row r and that of column s change places.
    fn exchange(&mut self, r: usize, s: usize) {
        let n = self.n;
        let inverse = 1.0 / self.at(r, s);
        self.pivot.clear();
        self.pivot.extend(self.t[r * n..(r + 1) * n].iter().map(|x| x * inverse));
        self.pivot[s] = inverse;
        for (i, row) in self.t.chunks_exact_mut(n).enumerate() {
            let y = row[s];
            if i == r {
                row.copy_from_slice(&self.pivot);
            } else if y != 0.0 {
                row[s] = 0.0;
                row.iter_mut().zip(&self.pivot).for_each(|(x, p)| *x -= y * p);
            }
        }
        std::mem::swap(&mut self.rows[r], &mut self.columns[s]);
    }

    /// Rows whose equality is left.
    fn open_rows(&self) -> Vec<usize> {
        let open = |r: &usize| matches!(self.rows[*r], Variable::W(i) if i < self.free);
        (0..self.n).filter(open).collect()
    }

    /// Columns whose free variable is left.
    fn open_columns(&self) -> Vec<usize> {
        let open = |s: &usize| matches!(self.columns[*s], Variable::Z(j) if j < self.free);
        (0..self.n).filter(open).collect()
    }

    /// Free variables into the rows of equalities, the largest pivot first.
    fn equalities(&mut self) {
        loop {
            let (rows, columns) = (self.open_rows(), self.open_columns());
            let pairs = rows.iter().flat_map(|&r| columns.iter().map(move |&s| (r, s)));
            let size = |e: &(usize, usize)| self.at(e.0, e.1).abs();
            match pairs.max_by(|a, b| size(a).total_cmp(&size(b))) {
                Some((r, s)) if self.at(r, s).abs() > LEVELS[2] => self.exchange(r, s),
                _ => return,
            }
        }
    }

    /// The pivots of a shortest alternating path from a free variable to an equality, over entries above `level`.
    fn path(&self, level: f64) -> Option<Vec<(usize, usize)>> {
        let n = self.n;
        for first in self.open_columns() {
            // For each row, the column from which it was reached.
            let mut from = vec![usize::MAX; n];
            let mut queue = std::collections::VecDeque::from([first]);
            while let Some(s) = queue.pop_front() {
                for r in 0..n {
                    if from[r] != usize::MAX || self.at(r, s).abs() <= level {
                        continue;
                    }
                    let Variable::W(i) = self.rows[r] else { continue };
                    from[r] = s;
                    if i < self.free {
                        return Some(self.back(&from, r, first));
                    }
                    // Its z enters next.
                    if let Some(next) = self.columns.iter().position(|&v| v == Variable::Z(i)) {
                        queue.push_back(next);
                    }
                }
            }
        }
        None
    }

    /// The pivots of the path that ends in row r, in their order.
    fn back(&self, from: &[usize], mut r: usize, first: usize) -> Vec<(usize, usize)> {
        let mut pivots = vec![];
        loop {
            let s = from[r];
            pivots.push((r, s));
            if s == first {
                break;
            }
            let Variable::Z(i) = self.columns[s] else { break };
            let Some(row) = self.rows.iter().position(|&v| v == Variable::W(i)) else { break };
            r = row;
        }
        pivots.reverse();
        pivots
    }
}
