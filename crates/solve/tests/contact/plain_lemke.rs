//! Lemke's method on a dense tableau with lexicographic ratios, plain enough to be read at a glance; free variables are eliminated first.

use std::cmp::Ordering;

use nonsmooth_problem::LcpPoint;
use nonsmooth_problem::check::Certificate;
use nonsmooth_solve::complementarity::form::Complementary;
use nonsmooth_solve::{SolveError, Solver, Step};

#[derive(Debug, Clone, Copy)]
pub struct PlainLemke;

impl<P: Complementary> Solver<P> for PlainLemke {
    type Work = usize;

    fn work(&self, problem: &P) -> Result<usize, SolveError> {
        problem.system()?.needs_entries()?;
        Ok(0)
    }

    fn start(&self, _: &P, _: &mut LcpPoint, _: &mut usize) {}

    fn step(&self, problem: &P, point: &mut LcpPoint, _: &mut usize) -> Step {
        let system = problem.system().unwrap();
        let (n, free) = (system.dim(), system.free());
        let matrix = system.matrix.to_dense().unwrap();
        // Columns: w (or the zero of an equation), z, z_0, right-hand side; w − M z − z_0 = q.
        let covered = |i: usize| if i < free { 0.0 } else { 1.0 };
        let mut tableau: Vec<Vec<f64>> = (0..n)
            .map(|i| {
                let w = (0..n).map(|j| f64::from(u8::from(i == j)));
                let z = matrix.row(i).iter().map(|m| -m);
                w.chain(z).chain([-covered(i), system.q[i]]).collect()
            })
            .collect();
        let mut basis: Vec<usize> = (0..n).collect();
        for j in 0..free {
            let size = |i: &usize| tableau[*i][n + j].abs();
            let row = (0..free).filter(|i| basis[*i] < n);
            let row = row.max_by(|a, b| size(a).total_cmp(&size(b))).unwrap();
            if size(&row) < 1e-12 {
                return Step::Stuck("the block of the free variables is singular".into());
            }
            pivot(&mut tableau, &mut basis, row, n + j);
        }
        let last = 2 * n + 1;
        let least = (free..n).min_by(|a, b| tableau[*a][last].total_cmp(&tableau[*b][last]));
        if let Some(row) = least.filter(|i| tableau[*i][last] < 0.0) {
            let mut entering = basis[row] + n;
            pivot(&mut tableau, &mut basis, row, 2 * n);
            for _ in 0..100 * n {
                let Some(row) = leaving(&tableau, &basis, entering, n, free) else {
                    let mut z = vec![0.0; n];
                    let mut set = |column: usize, x: f64| {
                        if (n..2 * n).contains(&column) {
                            z[column - n] = x;
                        }
                    };
                    set(entering, 1.0);
                    (0..n).for_each(|i| set(basis[i], -tableau[i][entering]));
                    return Step::NoSolution(Certificate::Ray { z, z0: 0.0 });
                };
                let left = basis[row];
                pivot(&mut tableau, &mut basis, row, entering);
                if left == 2 * n {
                    break;
                }
                entering = if left < n { left + n } else { left - n };
            }
        }
        point.z.fill(0.0);
        for (i, &column) in basis.iter().enumerate() {
            if (n..2 * n).contains(&column) {
                point.z[column - n] = tableau[i][last];
            }
        }
        Step::Done
    }
}

/// The row of the least ratio among the pairs, ties broken by the rows of the basis' inverse; z_0 leaves where it may.
fn leaving(
    tableau: &[Vec<f64>],
    basis: &[usize],
    entering: usize,
    n: usize,
    free: usize,
) -> Option<usize> {
    let mut best: Option<usize> = None;
    for i in free..n {
        let a = tableau[i][entering];
        if a <= 1e-10 {
            continue;
        }
        let Some(k) = best else {
            best = Some(i);
            continue;
        };
        let b = tableau[k][entering];
        let (x, y) = (tableau[i][2 * n + 1] / a, tableau[k][2 * n + 1] / b);
        // What differs by rounding only is equal.
        let compare = |x: f64, y: f64| {
            let equal = (x - y).abs() <= 1e-11 * x.abs().max(y.abs()).max(1.0);
            if equal { Ordering::Equal } else { x.total_cmp(&y) }
        };
        let order = match compare(x, y) {
            Ordering::Equal if basis[k] == 2 * n => continue,
            Ordering::Equal if basis[i] == 2 * n => Ordering::Less,
            Ordering::Equal => {
                let rows = (0..n).map(|j| compare(tableau[i][j] / a, tableau[k][j] / b));
                rows.fold(Ordering::Equal, Ordering::then)
            }
            order => order,
        };
        if order.is_lt() {
            best = Some(i);
        }
    }
    best
}

fn pivot(tableau: &mut [Vec<f64>], basis: &mut [usize], row: usize, column: usize) {
    let scale = tableau[row][column];
    tableau[row].iter_mut().for_each(|x| *x /= scale);
    let pivot = tableau[row].clone();
    for (i, other) in tableau.iter_mut().enumerate() {
        let factor = other[column];
        if i != row && factor != 0.0 {
            other.iter_mut().zip(&pivot).for_each(|(x, p)| *x -= factor * p);
        }
    }
    basis[row] = column;
}
