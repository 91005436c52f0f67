//! Which entries of q are the rounding of sums that cancel.
//!
//! A membrane above a sloping plane has `q = L g − f`, and L g, which should be zero, is some 1e-16 of the load f. As a unit such an entry asks its row to hold to the sixteenth part
//! of a sixteenth digit. Whether an entry is small is a question of the units of rows and columns: they are those in which the entries of the matrix are near one,
//!
//! ```text
//! min Σ_ij (log₂|M_ij| + ρ_i + γ_j)²,      load of row i: 2^ρ_i |q_i|,      of column j with a finite bound x: |x| / 2^γ_j
//! ```
//!
//! and what is compared hangs together: entries of q count as rounding beside the largest load of their component of the matrix's graph.
//!
//! Reference: CurtisReid1972, with the rows eliminated and conjugate gradients on the columns. Cost: a pass over the matrix where no unit jumps from one row to the next; else two an
//! iteration, few of a dense matrix.

use nonsmooth_linalg::Matrix;

/// A unit this many times that of a neighbour asks whether the neighbour's is rounding.
const JUMP: f64 = 1e10;
/// Below 2 to this power of the largest load an entry of q is rounding.
const ROUNDING: f64 = -40.0;
/// Iterations of conjugate gradients, and the change in a column's log₂ unit that ends them.
const ITERATIONS: usize = 100;
const ENOUGH: f64 = 0.1;

/// The loads of a problem, kept while units are made of them; and room.
#[derive(Debug, Clone, Default)]
pub(crate) struct Noise {
    /// |q|, and of each column the smaller modulus of its bounds.
    rows: Vec<f64>,
    columns: Vec<Vec<f64>>,
    /// Of the columns of all matrices, one after the other.
    balance: Balance,
    /// The component of each row and column.
    roots: Vec<usize>,
    largest: Vec<f64>,
}

/// The unknowns of the units, and the room of their solution.
#[derive(Debug, Clone, Default)]
struct Balance {
    /// ρ and γ.
    rho: Vec<f64>,
    gamma: Vec<f64>,
    /// Entries of each row and column.
    in_row: Vec<f64>,
    in_column: Vec<f64>,
    residual: Vec<f64>,
    direction: Vec<f64>,
    image: Vec<f64>,
}

impl Noise {
    /// Keeps the loads.
    pub(crate) fn keep(&mut self, rows: &[f64], columns: &[&mut Vec<f64>]) {
        self.rows.clear();
        self.rows.extend_from_slice(rows);
        self.columns.resize_with(columns.len(), Vec::new);
        for (to, from) in self.columns.iter_mut().zip(columns) {
            to.clear();
            to.extend_from_slice(from);
        }
    }

    /// Whether the unit of a row is far below what its neighbours hand on. `next` is room.
    pub(crate) fn jumps(matrices: &[&Matrix], units: &[f64], next: &mut Vec<f64>) -> bool {
        let mut far = false;
        for m in matrices {
            next.clear();
            next.resize(m.ncols(), 0.0);
            m.for_each(|i, j, x| {
                if x != 0.0 {
                    next[j] = next[j].max(units[i] / x.abs());
                }
            });
            m.for_each(|i, j, x| {
                far |= units[i] > 0.0 && x.abs() * next[j] > JUMP * units[i];
            });
        }
        far
    }

    /// Where some of the loads that were kept are rounding, puts the others back; whether there are such.
    pub(crate) fn without(
        &mut self,
        matrices: &[&Matrix],
        rows: &mut [f64],
        columns: &mut [&mut Vec<f64>],
    ) -> bool {
        self.balance.solve(matrices, rows.len());
        self.connect(matrices, rows.len());
        let Self { rows: loads, columns: bounds, balance, roots, largest } = self;
        largest.clear();
        largest.resize(roots.len(), f64::NEG_INFINITY);
        let of_row = |i: usize| loads[i].log2() + balance.rho[i];
        for i in 0..loads.len() {
            largest[roots[i]] = largest[roots[i]].max(of_row(i));
        }
        for (j, bound) in bounds.iter().flatten().enumerate() {
            let root = roots[loads.len() + j];
            largest[root] = largest[root].max(bound.log2() - balance.gamma[j]);
        }
        let is_noise = |i: usize| loads[i] > 0.0 && of_row(i) < largest[roots[i]] + ROUNDING;
        if !(0..loads.len()).any(is_noise) {
            return false;
        }
        for (i, to) in rows.iter_mut().enumerate() {
            *to = if is_noise(i) { 0.0 } else { loads[i] };
        }
        for (to, from) in columns.iter_mut().zip(bounds) {
            to.copy_from_slice(from);
        }
        true
    }

    /// The components of the graph.
    fn connect(&mut self, matrices: &[&Matrix], rows: usize) {
        let columns: usize = matrices.iter().map(|m| m.ncols()).sum();
        let roots = &mut self.roots;
        roots.clear();
        roots.extend(0..rows + columns);
        each(matrices, |i, j, _| {
            let (a, b) = (root(roots, i), root(roots, rows + j));
            roots[a.max(b)] = a.min(b);
        });
        for k in 0..roots.len() {
            roots[k] = root(roots, k);
        }
    }
}

/// The root of k, whose path becomes half as long.
fn root(roots: &mut [usize], mut k: usize) -> usize {
    while roots[k] != k {
        roots[k] = roots[roots[k]];
        k = roots[k];
    }
    k
}

/// Calls `f(i, j, log₂|x|)` for every entry of the matrices, one beside the other.
fn each(matrices: &[&Matrix], mut f: impl FnMut(usize, usize, f64)) {
    let mut before = 0;
    for m in matrices {
        m.for_each(|i, j, x| {
            if x != 0.0 {
                f(i, before + j, x.abs().log2());
            }
        });
        before += m.ncols();
    }
}

impl Balance {
    fn solve(&mut self, matrices: &[&Matrix], rows: usize) {
        let n = matrices.iter().map(|m| m.ncols()).sum();
        for x in [&mut self.rho, &mut self.in_row] {
            x.clear();
            x.resize(rows, 0.0);
        }
        let Self { rho, gamma, in_row, in_column, residual, direction, image } = self;
        for x in [&mut *gamma, in_column, residual, direction, image] {
            x.clear();
            x.resize(n, 0.0);
        }
        // With γ = 0 the best ρ is less the mean of each row.
        each(matrices, |i, j, log| {
            (in_row[i], in_column[j]) = (in_row[i] + 1.0, in_column[j] + 1.0);
            rho[i] -= log;
        });
        rho.iter_mut().zip(&*in_row).filter(|(_, n)| **n > 0.0).for_each(|(rho, n)| *rho /= n);
        each(matrices, |i, j, log| residual[j] -= log + rho[i]);
        let mut power = 0.0;
        for iteration in 0..ITERATIONS {
            let mut change = 0.0_f64;
            let mut next = 0.0;
            for (r, n) in residual.iter().zip(&*in_column).filter(|(_, n)| **n > 0.0) {
                change = change.max((r / n).abs());
                next += r * r / n;
            }
            if change <= ENOUGH {
                break;
            }
            let beta = if iteration > 0 { next / power } else { 0.0 };
            power = next;
            for j in (0..n).filter(|&j| in_column[j] > 0.0) {
                direction[j] = residual[j] / in_column[j] + beta * direction[j];
            }
            // What the direction changes in ρ, kept in the room of the rows' units until they are made at the end.
            rho.fill(0.0);
            each(matrices, |i, j, _| rho[i] -= direction[j]);
            rho.iter_mut().zip(&*in_row).filter(|(_, n)| **n > 0.0).for_each(|(r, n)| *r /= n);
            for j in 0..n {
                image[j] = in_column[j] * direction[j];
            }
            each(matrices, |i, j, _| image[j] += rho[i]);
            let curvature: f64 = direction.iter().zip(&*image).map(|(d, a)| d * a).sum();
            if curvature <= 0.0 {
                break;
            }
            let alpha = power / curvature;
            for j in 0..n {
                gamma[j] += alpha * direction[j];
                residual[j] -= alpha * image[j];
            }
        }
        rho.fill(0.0);
        each(matrices, |i, j, log| rho[i] -= log + gamma[j]);
        rho.iter_mut().zip(&*in_row).filter(|(_, n)| **n > 0.0).for_each(|(rho, n)| *rho /= n);
    }
}
