//! The linear system of a pair of variables: formed, factorised, solved.
//!
//! A direction with `s dx + x ds = γ` for every pair is `dx = dx⁰ + α t`, `ds = ds⁰ − β t` with `α = x/(x+s)`, `β = s/(x+s)`, so no coefficient exceeds one,
//! however small x or s. `Q dz + R ds = ρ` becomes
//!
//! ```text
//! (Q diag(α) − R diag(β)) t = ρ − Q dx⁰ − R ds⁰,
//! ```
//!
//! and with R = −I, rows divided and columns multiplied by √α, `(A M A + diag(β)) t = A (ρ + γ/x)`, `A = diag(√α)`: symmetric where M is, positive
//! definite where M is monotone. This is `M + X⁻¹S` in a good scale. Free variables have α = 1, β = 0. With α and β zero or one the same matrix is that of a
//! guess which variables are positive.

use nonsmooth_linalg::{Csc, Dense, Matrix, Singular, SquareCholesky, SquareLu};

use super::scale::{Scaled, alike};

/// What is added to the diagonal in turn where Cholesky's method finds the matrix not positive definite.
const SHIFTS: [f64; 4] = [0.0, 1e-15, 1e-13, 1e-11];
/// Steps of refinement of a solve.
const REFINEMENTS: usize = 3;

/// The matrix, its factors, and the maps from entries of Q and R to its own.
#[derive(Debug, Default)]
pub struct Newton {
    matrix: Option<Matrix>,
    pattern: Option<[Csc; 2]>,
    /// Where the entries of Q, those of R, and the diagonal are in a sparse matrix.
    of_q: Vec<usize>,
    of_r: Vec<usize>,
    diagonal: Vec<usize>,
    cholesky: SquareCholesky,
    lu: SquareLu,
    /// The factor is Cholesky's.
    positive: bool,
    /// Cholesky's method has failed before: M is not positive semidefinite.
    indefinite: bool,
    root: Vec<f64>,
    b: Vec<f64>,
    product: Vec<f64>,
}

impl Newton {
    /// Prepares for another problem: of the same pattern, nothing is analysed anew.
    pub fn refill(&mut self, scaled: &Scaled) {
        let n = scaled.dim();
        self.indefinite = false;
        for v in [&mut self.root, &mut self.b, &mut self.product] {
            v.resize(n, 0.0);
        }
        match (scaled.matrix(), &scaled.slack) {
            (Matrix::Sparse(q), None) => self.lay_out(q, None),
            (Matrix::Sparse(q), Some(Matrix::Sparse(r))) => self.lay_out(q, Some(r)),
            _ => {
                let fits = matches!(&self.matrix, Some(Matrix::Dense(d)) if d.nrows() == n);
                if !fits {
                    self.matrix = Some(Dense::zeros(n, n).into());
                    self.pattern = None;
                }
            }
        }
    }

    /// The pattern of `Q + R` with the diagonal, and where each entry is in it.
    fn lay_out(&mut self, q: &Csc, r: Option<&Csc>) {
        let empty = Csc::zeros(0, 0);
        let r_or_empty = r.unwrap_or(&empty);
        let known = self.pattern.as_ref();
        if known.is_some_and(|[a, b]| alike(a, q) && alike(b, r_or_empty)) {
            return;
        }
        let n = q.nrows();
        let diagonal = (0..n).map(|i| (i, i, 0.0));
        let entries = q.triplets().chain(r_or_empty.triplets()).chain(diagonal);
        let all = Csc::from_triplets(n, n, entries).expect("in range");
        let place = |i: usize, j: usize| {
            let rows = all.column(j).0;
            all.col_ptr()[j] + rows.binary_search(&i).expect("in the pattern")
        };
        self.of_q = q.triplets().map(|(i, j, _)| place(i, j)).collect();
        self.of_r = r_or_empty.triplets().map(|(i, j, _)| place(i, j)).collect();
        self.diagonal = (0..n).map(|i| place(i, i)).collect();
        self.pattern = Some([q.clone(), r_or_empty.clone()]);
        self.matrix = Some(all.into());
    }

    /// Forms and factorises the matrix for α and β of all variables. `shift` is added to the β of variables whose β is below it, and to the free ones, where
    /// there is no R: a proximal term, whose bias the caller removes.
    pub fn factorise(
        &mut self,
        scaled: &Scaled,
        alpha: &[f64],
        beta: &[f64],
        shift: f64,
    ) -> Result<(), Singular> {
        self.form(scaled, alpha, beta, shift);
        self.positive = scaled.symmetric && !self.indefinite;
        if self.positive {
            let mut added = 0.0;
            for shift in SHIFTS {
                if shift > 0.0 {
                    self.add_to_diagonal(shift - added);
                    added = shift;
                }
                let matrix = self.matrix.as_ref().expect("filled");
                if self.cholesky.factorise(matrix).is_ok() {
                    return Ok(());
                }
            }
            self.add_to_diagonal(-added);
            (self.indefinite, self.positive) = (true, false);
        }
        let matrix = self.matrix.as_ref().expect("filled");
        if self.lu.factorise(matrix).is_ok() {
            return Ok(());
        }
        if scaled.slack.is_some() {
            return Err(Singular);
        }
        self.add_to_diagonal(1e-12);
        self.lu.factorise(self.matrix.as_ref().expect("filled"))
    }

    fn add_to_diagonal(&mut self, shift: f64) {
        match self.matrix.as_mut() {
            Some(Matrix::Dense(k)) => (0..k.nrows()).for_each(|i| k[(i, i)] += shift),
            Some(Matrix::Sparse(k)) => {
                let values = k.values_mut();
                self.diagonal.iter().for_each(|&d| values[d] += shift);
            }
            _ => {}
        }
    }

    fn form(&mut self, scaled: &Scaled, alpha: &[f64], beta: &[f64], shift: f64) {
        let Self { matrix, of_q, of_r, diagonal, root, .. } = self;
        root.iter_mut().zip(alpha).for_each(|(r, a)| *r = a.sqrt());
        match (matrix.as_mut(), scaled.matrix(), &scaled.slack) {
            (Some(Matrix::Sparse(k)), Matrix::Sparse(q), None) => {
                let values = k.values_mut();
                values.fill(0.0);
                for ((i, j, x), &at) in q.triplets().zip(of_q.iter()) {
                    values[at] = root[i] * x * root[j];
                }
                for (&at, beta) in diagonal.iter().zip(beta) {
                    values[at] += beta.max(shift);
                }
            }
            (Some(Matrix::Sparse(k)), Matrix::Sparse(q), Some(Matrix::Sparse(r))) => {
                let values = k.values_mut();
                values.fill(0.0);
                for ((_, j, x), &at) in q.triplets().zip(of_q.iter()) {
                    values[at] += x * alpha[j];
                }
                for ((_, j, x), &at) in r.triplets().zip(of_r.iter()) {
                    values[at] -= x * beta[j];
                }
            }
            (Some(Matrix::Dense(k)), Matrix::Dense(q), None) => {
                for i in 0..k.nrows() {
                    let row = k.row_mut(i).iter_mut().zip(q.row(i)).zip(root.iter());
                    row.for_each(|((k, x), r)| *k = root[i] * x * r);
                    k[(i, i)] += beta[i].max(shift);
                }
            }
            (Some(Matrix::Dense(k)), q, Some(r)) => {
                k.values_mut().fill(0.0);
                q.for_each(|i, j, x| k[(i, j)] += x * alpha[j]);
                r.for_each(|i, j, x| k[(i, j)] -= x * beta[j]);
            }
            _ => unreachable!("laid out for this problem"),
        }
    }

    /// `t ← K⁻¹ t`, once.
    pub fn solve_once(&mut self, t: &mut [f64]) {
        if self.positive {
            self.cholesky.solve(t);
        } else {
            self.lu.solve(t);
        }
    }

    /// `t ← K⁻¹ t`, refined against K.
    pub fn solve(&mut self, t: &mut [f64]) {
        let mut b = std::mem::take(&mut self.b);
        let mut product = std::mem::take(&mut self.product);
        b.copy_from_slice(t);
        self.solve_once(t);
        let size = largest(&b);
        let mut last = f64::INFINITY;
        for _ in 0..REFINEMENTS {
            self.matrix.as_ref().expect("filled").mul(t, &mut product);
            product.iter_mut().zip(&b).for_each(|(p, b)| *p = b - *p);
            let error = largest(&product);
            // NaN ends it as well.
            if !(error > 4.0 * f64::EPSILON * size && error < 0.5 * last) {
                break;
            }
            last = error;
            self.solve_once(&mut product);
            t.iter_mut().zip(&product).for_each(|(t, p)| *t += p);
        }
        (self.b, self.product) = (b, product);
    }

    /// Whether the last factor was Cholesky's.
    pub fn is_positive(&self) -> bool {
        self.positive
    }

    /// √α of the last factorisation.
    pub fn root(&self) -> &[f64] {
        &self.root
    }
}

fn largest(x: &[f64]) -> f64 {
    x.iter().fold(0.0, |l: f64, x| if x.is_nan() { f64::NAN } else { l.max(x.abs()) })
}
