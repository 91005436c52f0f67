//! Submatrices that decide for the whole: strong components, connected components.

use nonsmooth_linalg::{Csc, Dense, Groups, Matrix};

/// The strong components of the graph with an edge from i to j for each `M_ij ≠ 0`, rows in rising order; a component comes before those that reach it.
///
/// Method: Tarjan's, without recursion. Cost: O(nnz).
pub(super) fn strong_components(m: &Matrix) -> Vec<Vec<usize>> {
    const NONE: u32 = u32::MAX;
    let n = m.nrows();
    if let Matrix::Dense(a) = m
        && a.values().iter().all(|x| *x != 0.0)
    {
        return vec![(0..n).collect()];
    }
    let mut start = vec![0_usize; n + 1];
    m.for_each(|i, j, x| start[i + 1] += usize::from(x != 0.0 && i != j));
    (0..n).for_each(|i| start[i + 1] += start[i]);
    let (mut target, mut next) = (vec![0_u32; start[n]], start.clone());
    m.for_each(|i, j, x| {
        if x != 0.0 && i != j {
            target[next[i]] = j as u32;
            next[i] += 1;
        }
    });
    // `next` becomes the edge that a vertex is at.
    next.copy_from_slice(&start);
    let (mut number, mut low) = (vec![NONE; n], vec![0_u32; n]);
    let mut on_stack = vec![false; n];
    let (mut stack, mut path) = (vec![], vec![]);
    let mut count = 0;
    let mut found = vec![];
    for root in 0..n {
        if number[root] != NONE {
            continue;
        }
        path.push(root);
        while let Some(&v) = path.last() {
            if number[v] == NONE {
                (number[v], low[v]) = (count, count);
                count += 1;
                stack.push(v);
                on_stack[v] = true;
            }
            if next[v] < start[v + 1] {
                let to = target[next[v]] as usize;
                next[v] += 1;
                if number[to] == NONE {
                    path.push(to);
                } else if on_stack[to] {
                    low[v] = low[v].min(number[to]);
                }
                continue;
            }
            path.pop();
            if let Some(&parent) = path.last() {
                low[parent] = low[parent].min(low[v]);
            }
            if low[v] == number[v] {
                let at = stack.iter().rposition(|&x| x == v).expect("v is on the stack");
                let mut rows = stack.split_off(at);
                rows.iter().for_each(|&i| on_stack[i] = false);
                rows.sort_unstable();
                found.push(rows);
            }
        }
    }
    found
}

/// The connected components of the graph with the edges for which `joined(i, j, M_ij)`.
pub(super) fn components(
    m: &Matrix,
    mut joined: impl FnMut(usize, usize, f64) -> bool,
) -> Vec<Vec<usize>> {
    let mut groups = Groups::new(m.nrows());
    m.for_each(|i, j, x| {
        if i != j && x != 0.0 && joined(i, j, x) {
            groups.join(i, j);
        }
    });
    groups.members()
}

/// Takes principal submatrices, each at the cost of its own columns.
pub(super) struct Cutter<'a> {
    matrix: &'a Matrix,
    place: Vec<usize>,
}

impl<'a> Cutter<'a> {
    pub(super) fn new(matrix: &'a Matrix) -> Self {
        Self { matrix, place: vec![usize::MAX; matrix.nrows()] }
    }

    /// The rows and columns of that set; dense where the matrix is, or it is small.
    pub(super) fn cut(&mut self, rows: &[usize]) -> Matrix {
        const SMALL: usize = 32;
        let k = rows.len();
        match self.matrix {
            Matrix::Dense(a) => Dense::from_fn(k, k, |i, j| a[(rows[i], rows[j])]).into(),
            Matrix::Sparse(a) => {
                rows.iter().enumerate().for_each(|(at, &i)| self.place[i] = at);
                let mut entries = vec![];
                for (j, &column) in rows.iter().enumerate() {
                    let (there, values) = a.column(column);
                    let inside =
                        there.iter().zip(values).filter(|(i, _)| self.place[**i] != usize::MAX);
                    entries.extend(inside.map(|(&i, &x)| (self.place[i], j, x)));
                }
                rows.iter().for_each(|&i| self.place[i] = usize::MAX);
                if k <= SMALL {
                    let mut out = Dense::zeros(k, k);
                    entries.iter().for_each(|&(i, j, x)| out[(i, j)] = x);
                    return out.into();
                }
                Csc::from_triplets(k, k, entries.into_iter()).expect("places in range").into()
            }
            Matrix::Operator(_) => Csc::zeros(k, k).into(),
        }
    }
}
