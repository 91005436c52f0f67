//! The judge's projections.
//!
//! | set | projection |
//! | --- | --- |
//! | box | of each variable |
//! | ball, second-order cone | along the line to the centre, in the half-plane of the axis |
//! | polyhedron | of the variables that rows join by themselves: by Newton's method on the dual (`sparse.rs`) where rows are many and have few entries, else, and where that does not find it, by nonnegative least squares (`dense.rs`) |

mod dense;
mod sparse;

use nonsmooth_linalg::Groups;

use super::super::Set;
use super::{distance, norm};
use dense::{Dense, Span};
use sparse::Sparse;

/// Up to so many rows times variables, and where one in so many of these has an entry, rows are stored dense.
const SMALL: usize = 4096;
const FILLED: usize = 8;

/// A projection with what it keeps from one time to the next.
pub(in super::super) struct Projection {
    /// Of a polyhedron.
    blocks: Vec<Block>,
    /// The norms of −A's and C's rows.
    norms: Vec<f64>,
    /// What was projected last, with b and d, and its projection.
    last: Option<[Vec<f64>; 4]>,
}

/// The rows of a part of a polyhedron, divided by their norms: `g_k` of −A and then of C.
struct Rows {
    variables: usize,
    inequalities: usize,
    starts: Vec<usize>,
    columns: Vec<usize>,
    values: Vec<f64>,
}

impl Rows {
    fn len(&self) -> usize {
        self.starts.len() - 1
    }

    fn row(&self, k: usize) -> (&[usize], &[f64]) {
        let range = self.starts[k]..self.starts[k + 1];
        (&self.columns[range.clone()], &self.values[range])
    }
}

/// Variables that rows join, and these rows.
struct Block {
    variables: Vec<usize>,
    names: Vec<usize>,
    rows: Rows,
    sparse: Option<Sparse>,
    /// Made where it is needed.
    dense: Option<Dense>,
    /// Whether it has found the last projection.
    by_dense: bool,
    rhs: Vec<f64>,
    parts: [Vec<f64>; 3],
}

/// What a method says.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Found {
    Yes,
    /// Another one has to tell.
    Unknown,
    /// The time is over.
    Over,
}

impl Projection {
    pub(in super::super) fn new(set: &Set) -> Self {
        let mut out = Self { blocks: vec![], norms: vec![], last: None };
        if let Set::Polyhedron { A, C, .. } = set {
            let mut rows = vec![vec![]; A.nrows() + C.nrows()];
            A.triplets().for_each(|(i, j, a)| rows[i].push((j, -a)));
            C.triplets().for_each(|(i, j, a)| rows[A.nrows() + i].push((j, a)));
            for row in &mut rows {
                let size = norm(&row.iter().map(|(_, g)| *g).collect::<Vec<_>>());
                let size = if size > 0.0 { size } else { 1.0 };
                row.iter_mut().for_each(|(_, g)| *g /= size);
                out.norms.push(size);
            }
            out.blocks = blocks(A.ncols(), A.nrows(), &rows);
        }
        out
    }

    /// `y = P_X(p)`, which may be near x. False where the set is empty, or the projection was not found.
    pub(in super::super) fn onto(
        &mut self,
        set: &Set,
        p: &[f64],
        x: &[f64],
        y: &mut [f64],
    ) -> bool {
        match set {
            Set::Box { lower, upper } => {
                for i in 0..p.len() {
                    y[i] = p[i].max(lower[i]).min(upper[i]);
                }
                true
            }
            Set::Polyhedron { b, d, .. } => {
                if let Some([from, of_b, of_d, to]) = &self.last
                    && from == p
                    && of_b == b
                    && of_d == d
                {
                    y.copy_from_slice(to);
                    return true;
                }
                let found = self.onto_polyhedron(b, d, p, x, y);
                self.last = found.then(|| [p.to_vec(), b.clone(), d.clone(), y.to_vec()]);
                found
            }
            Set::Ball { centre, radius } => {
                let far = distance(p, centre);
                let share = if far > *radius { radius / far } else { 1.0 };
                for i in 0..p.len() {
                    y[i] = if share < 1.0 { centre[i] + share * (p[i] - centre[i]) } else { p[i] };
                }
                true
            }
            Set::SecondOrderCone { .. } => {
                // In the half-plane of (x_1, ‖x̄‖): onto the ray along (1, 1).
                let (t, far) = (p[0], norm(&p[1..]));
                let (height, share) = match (far <= t, far <= -t) {
                    (true, _) => (t, 1.0),
                    (_, true) => (0.0, 0.0),
                    _ => (0.5 * t + 0.5 * far, (0.5 * t + 0.5 * far) / far),
                };
                y[0] = height;
                for i in 1..p.len() {
                    y[i] = share * p[i];
                }
                true
            }
            Set::Product(_) => true,
        }
    }

    fn onto_polyhedron(
        &mut self,
        b: &[f64],
        d: &[f64],
        p: &[f64],
        x: &[f64],
        y: &mut [f64],
    ) -> bool {
        // What no row touches stays.
        y.copy_from_slice(p);
        let rhs = |k: usize| match b.get(k) {
            Some(b) => -b / self.norms[k],
            None => d[k - b.len()] / self.norms[k],
        };
        self.blocks.iter_mut().all(|block| block.onto(rhs, p, x, y))
    }

    /// The rows that the last projection met with a force, and the equations, ascending; of dependent ones some that are not. As far as the time reaches.
    pub(in super::super) fn held(&self) -> Vec<usize> {
        let mut held: Vec<usize> = self.blocks.iter().flat_map(Block::held).collect();
        held.sort_unstable();
        held
    }
}

/// The rows of a polyhedron in n variables, the first m of them inequalities, by the variables that they join; together where they are few.
fn blocks(n: usize, m: usize, rows: &[Vec<(usize, f64)>]) -> Vec<Block> {
    let (variables, names) = if rows.len() * n <= SMALL {
        (vec![(0..n).collect()], vec![(0..rows.len()).collect()])
    } else {
        let mut groups = Groups::new(n);
        for row in rows {
            row.windows(2).for_each(|two| groups.join(two[0].0, two[1].0));
        }
        let (numbers, members) = (groups.numbers(), groups.members());
        let mut names: Vec<Vec<usize>> = vec![vec![]; members.len()];
        for (k, row) in rows.iter().enumerate() {
            // One without entries is anybody's.
            names[row.first().map_or(0, |(j, _)| numbers[*j])].push(k);
        }
        (members, names)
    };
    let mut place = vec![0; n];
    for variables in &variables {
        variables.iter().enumerate().for_each(|(at, &j)| place[j] = at);
    }
    let parts = variables.into_iter().zip(names).filter(|(_, names)| !names.is_empty());
    parts.map(|(variables, names)| Block::new(variables, names, m, rows, &place)).collect()
}

impl Block {
    fn new(
        variables: Vec<usize>,
        names: Vec<usize>,
        m: usize,
        rows: &[Vec<(usize, f64)>],
        place: &[usize],
    ) -> Self {
        let mut own = Rows {
            variables: variables.len(),
            inequalities: names.partition_point(|&k| k < m),
            starts: vec![0],
            columns: vec![],
            values: vec![],
        };
        for &k in &names {
            own.columns.extend(rows[k].iter().map(|(j, _)| place[*j]));
            own.values.extend(rows[k].iter().map(|(_, g)| *g));
            own.starts.push(own.columns.len());
        }
        let all = own.len() * own.variables;
        let is_sparse = all > SMALL && own.values.len() <= all / FILLED;
        let sparse = if is_sparse { Sparse::new(&own) } else { None };
        Self {
            variables,
            names,
            rows: own,
            sparse,
            dense: None,
            by_dense: true,
            rhs: vec![],
            parts: [vec![], vec![], vec![]],
        }
    }

    /// The part of `y = P(p)`. False where it is not found.
    fn onto(&mut self, rhs: impl Fn(usize) -> f64, p: &[f64], x: &[f64], y: &mut [f64]) -> bool {
        self.rhs.clear();
        self.rhs.extend(self.names.iter().map(|&k| rhs(k)));
        let [own_p, own_x, own_y] = &mut self.parts;
        for (own, all) in [(&mut *own_p, p), (own_x, x), (own_y, p)] {
            own.clear();
            own.extend(self.variables.iter().map(|&j| all[j]));
        }
        let found = match &mut self.sparse {
            Some(sparse) => sparse.onto(&self.rhs, own_p, own_y),
            None => Found::Unknown,
        };
        self.by_dense = found == Found::Unknown;
        let found = match found {
            Found::Yes => true,
            Found::Over => false,
            Found::Unknown => {
                let dense = self.dense.get_or_insert_with(|| Dense::new(&self.rows));
                dense.onto(&self.rhs, own_p, own_x, own_y)
            }
        };
        self.variables.iter().zip(&*own_y).for_each(|(&j, own)| y[j] = *own);
        found
    }

    fn held(&self) -> Vec<usize> {
        let mut pushing = vec![];
        match (&self.sparse, &self.dense) {
            (Some(sparse), _) if !self.by_dense => sparse.pushing(&self.rhs, &mut pushing),
            (_, Some(dense)) => dense.pushing(&mut pushing),
            _ => {}
        }
        let all: Vec<usize> = (self.rows.inequalities..self.rows.len()).chain(pushing).collect();
        let dense = |k: usize| {
            let mut row = vec![0.0; self.rows.variables];
            let (of, g) = self.rows.row(k);
            of.iter().zip(g).for_each(|(&j, g)| row[j] = *g);
            row.into_iter()
        };
        let span = Span::of(all.iter().map(|&k| dense(k)));
        let independent = all.iter().zip(&span.r).filter(|(_, r)| r.is_some());
        independent.map(|(&k, _)| self.names[k]).collect()
    }
}

#[cfg(test)]
mod tests;
