//! The equations of the pieces that are not `x = l`, factorised.

use nonsmooth_linalg::budget::{self, Budget};
use nonsmooth_linalg::{Csc, Matrix, SquareLu};
use nonsmooth_problem::ProblemError;

use super::DerivativeError;

/// What an unknown does.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) enum Column {
    /// It follows from the equations; its place among those that do.
    Free(usize),
    /// It stays at zero.
    Zero,
    /// It moves with the lower bound of this number,
    Lower(usize),
    /// or with the upper one.
    Upper(usize),
}

/// What the unknowns do.
#[derive(Debug, Clone, Default)]
pub(super) struct Columns {
    all: Vec<Column>,
    free: usize,
}

/// The letters of bounds.
pub(super) const LOWER: &str = "lower";
pub(super) const UPPER: &str = "upper";

impl Columns {
    /// The next unknowns follow from the equations.
    pub(super) fn free(&mut self, count: usize) {
        self.all.extend((self.free..self.free + count).map(Column::Free));
        self.free += count;
    }

    /// The next unknown is fixed.
    pub(super) fn fixed(&mut self, how: Column) {
        self.all.push(how);
    }

    /// Moves the unknowns that are at bounds with them.
    pub(super) fn at_bounds(&self, letter: &str, change: &[f64], dx: &mut [f64]) {
        for (dx, column) in dx.iter_mut().zip(&self.all) {
            match column {
                Column::Lower(k) if letter == LOWER => *dx += change[*k],
                Column::Upper(k) if letter == UPPER => *dx += change[*k],
                _ => {}
            }
        }
    }

    /// The gradient with respect to bounds, given that with respect to the unknowns.
    pub(super) fn of_bounds(&self, letter: &str, count: usize, gradient: &[f64]) -> Vec<f64> {
        let mut out = vec![0.0; count];
        for (g, column) in gradient.iter().zip(&self.all) {
            match column {
                Column::Lower(k) if letter == LOWER => out[*k] = *g,
                Column::Upper(k) if letter == UPPER => out[*k] = *g,
                _ => {}
            }
        }
        out
    }

    fn place(&self, j: usize) -> Option<usize> {
        match self.all[j] {
            Column::Free(place) => Some(place),
            _ => None,
        }
    }
}

/// `Σ a_k x_k + Σ b_k y_k + c mu = 0` for changes, of the `width` entries of x and y from `x` and `y` on.
#[derive(Debug, Clone, Copy)]
pub(super) struct Equation {
    pub(super) x: usize,
    pub(super) y: usize,
    pub(super) width: usize,
    pub(super) a: [f64; 3],
    pub(super) b: [f64; 3],
    pub(super) c: f64,
    pub(super) contact: usize,
}

impl Equation {
    /// `y = 0`.
    pub(super) fn zero(y: usize) -> Self {
        Self { x: 0, y, width: 1, a: [0.0; 3], b: [1.0, 0.0, 0.0], c: 0.0, contact: 0 }
    }

    /// The entries of y with their coefficients.
    fn of_y(&self) -> impl Iterator<Item = (usize, f64)> + use<> {
        let (y, b) = (self.y, self.b);
        (0..self.width).map(move |k| (y + k, b[k])).filter(|(_, b)| *b != 0.0)
    }

    fn of_x(&self) -> impl Iterator<Item = (usize, f64)> + use<> {
        let (x, a) = (self.x, self.a);
        (0..self.width).map(move |k| (x + k, a[k])).filter(|(_, a)| *a != 0.0)
    }
}

/// The equations `(A + B S) dx = −B load − c dmu` of the unknowns that are free.
#[derive(Debug)]
pub(super) struct Equations {
    pub(super) columns: Columns,
    equations: Vec<Equation>,
    /// What rows and columns are multiplied with before the factorisation: velocities and impulses stand beside each other.
    rows: Vec<f64>,
    scales: Vec<f64>,
    lu: SquareLu,
}

impl Equations {
    /// Factorises them for a matrix S.
    ///
    /// Errors: singular ones, more memory than there is, a limit of time.
    pub(super) fn factorised(
        s: &Csc,
        columns: Columns,
        equations: Vec<Equation>,
    ) -> Result<Self, DerivativeError> {
        let n = columns.free;
        if equations.len() != n {
            return Err(DerivativeError::Singular);
        }
        // Which equations have an entry of y.
        let mut users: Vec<Vec<(usize, f64)>> = vec![vec![]; s.nrows()];
        let mut entries: Vec<(usize, usize, f64)> = vec![];
        for (i, equation) in equations.iter().enumerate() {
            equation.of_y().for_each(|(y, b)| users[y].push((i, b)));
            for (x, a) in equation.of_x() {
                let place = columns.place(x).expect("the impulse of a contact is free as a whole");
                entries.push((i, place, a));
            }
        }
        for j in 0..s.ncols() {
            let Some(place) = columns.place(j) else { continue };
            let (at, values) = s.column(j);
            for (&y, &s) in at.iter().zip(values) {
                entries.extend(users[y].iter().map(|&(i, b)| (i, place, b * s)));
            }
        }
        drop(users);
        let mut made = Self {
            columns,
            equations,
            rows: vec![1.0; n],
            scales: vec![1.0; n],
            lu: SquareLu::default(),
        };
        if n > 0 {
            made.balance(&mut entries)?;
            made.factorise(entries)?;
        }
        Ok(made)
    }

    /// Makes the mean of the logarithms of each row and column nearly zero, so that no choice of units matters, and then the largest modulus of each row 1.
    ///
    /// Source: CurtisReid1972.
    fn balance(&mut self, entries: &mut [(usize, usize, f64)]) -> Result<(), DerivativeError> {
        let n = self.rows.len();
        let logarithms: Vec<(usize, usize, f64)> = entries
            .iter()
            .filter(|entry| entry.2 != 0.0)
            .map(|&(i, j, x)| (i, j, x.abs().ln()))
            .collect();
        let mut counts = [vec![0.0; n], vec![0.0; n]];
        for &(i, j, x) in &logarithms {
            if !x.is_finite() {
                return Err(DerivativeError::Singular);
            }
            counts[0][i] += 1.0;
            counts[1][j] += 1.0;
        }
        if counts.iter().flatten().any(|count| *count == 0.0) {
            return Err(DerivativeError::Singular);
        }
        let (mut of_rows, mut of_columns) = (vec![0.0; n], vec![0.0; n]);
        for _ in 0..ROUNDS {
            if budget::over() {
                return Err(DerivativeError::Interrupted);
            }
            of_rows.fill(0.0);
            logarithms.iter().for_each(|&(i, j, x)| of_rows[i] -= x + of_columns[j]);
            of_rows.iter_mut().zip(&counts[0]).for_each(|(x, count)| *x /= count);
            of_columns.fill(0.0);
            logarithms.iter().for_each(|&(i, j, x)| of_columns[j] -= x + of_rows[i]);
            of_columns.iter_mut().zip(&counts[1]).for_each(|(x, count)| *x /= count);
        }
        let scale = |x: &f64| x.clamp(-300.0, 300.0).exp();
        self.rows = of_rows.iter().map(scale).collect();
        self.scales = of_columns.iter().map(scale).collect();
        let mut largest = vec![0.0_f64; n];
        for (i, j, x) in &mut *entries {
            *x *= self.rows[*i] * self.scales[*j];
            largest[*i] = largest[*i].max(x.abs());
        }
        if largest.iter().any(|x| !(*x > 0.0 && x.is_finite())) {
            return Err(DerivativeError::Singular);
        }
        entries.iter_mut().for_each(|(i, _, x)| *x /= largest[*i]);
        self.rows.iter_mut().zip(&largest).for_each(|(row, x)| *row /= x);
        Ok(())
    }

    fn factorise(&mut self, entries: Vec<(usize, usize, f64)>) -> Result<(), DerivativeError> {
        let n = self.rows.len();
        let system = Csc::from_triplets(n, n, entries.into_iter()).map_err(ProblemError::from)?;
        // Of few unknowns or a full matrix all entries are less work.
        let full = n <= FEW || 4 * system.nnz() > n * n;
        let system = match full {
            true => Matrix::from(system).to_dense().map(Matrix::from),
            false => Some(system.into()),
        };
        let system = system.expect("a matrix with entries");
        admitted(|| self.lu.factorise(&system))?;
        match inverse_norm(&self.lu, n) <= REGULAR {
            true => Ok(()),
            false => Err(DerivativeError::Singular),
        }
    }

    /// The change of the unknowns that are free, among zeros.
    pub(super) fn forward(&self, load: &[f64], mu: Option<&[f64]>) -> Vec<f64> {
        let of = |equation: &Equation| {
            let sum: f64 = equation.of_y().map(|(y, b)| b * load[y]).sum();
            -sum - mu.map_or(0.0, |mu| mu.get(equation.contact).map_or(0.0, |m| equation.c * m))
        };
        let mut right: Vec<f64> =
            self.equations.iter().zip(&self.rows).map(|(e, scale)| scale * of(e)).collect();
        if !right.is_empty() {
            self.lu.solve(&mut right);
        }
        let all = self.columns.all.iter().map(|column| match column {
            Column::Free(place) => self.scales[*place] * right[*place],
            _ => 0.0,
        });
        all.collect()
    }

    /// Adds `Bᵀ λ` to s and `cᵀ λ` to mu, with λ the adjoint of the gradient `g` with respect to x.
    pub(super) fn backward(&self, g: &[f64], s: &mut [f64], mu: &mut [f64]) {
        let mut lambda = vec![0.0; self.rows.len()];
        for (j, column) in self.columns.all.iter().enumerate() {
            if let Column::Free(place) = *column {
                lambda[place] = -self.scales[place] * g[j];
            }
        }
        if !lambda.is_empty() {
            self.lu.solve_transpose(&mut lambda);
        }
        for ((equation, scale), lambda) in self.equations.iter().zip(&self.rows).zip(&lambda) {
            let lambda = scale * lambda;
            equation.of_y().for_each(|(y, b)| s[y] += b * lambda);
            if equation.c != 0.0 {
                mu[equation.contact] += equation.c * lambda;
            }
        }
    }
}

/// A factorisation, within the memory and the time that there are.
pub(super) fn admitted<E>(
    factorise: impl FnOnce() -> Result<(), E>,
) -> Result<(), DerivativeError> {
    let scope = Budget::default().enter();
    let done = factorise();
    if let Some(refused) = scope.refused() {
        return Err(DerivativeError::TooLarge(refused));
    }
    if budget::over() {
        return Err(DerivativeError::Interrupted);
    }
    done.map_err(|_| DerivativeError::Singular)
}

/// Rounds of balancing. Each halves, at least, what units of whole kinds of rows and columns are apart.
const ROUNDS: usize = 30;

/// The largest `‖K⁻¹‖₁` of equations that are balanced and that a derivative is believed with: a quarter of the digits is then left.
const REGULAR: f64 = 1e12;

/// A lower bound of `‖K⁻¹‖₁`, nearly always within a factor of three, by a few solves.
///
/// Source: Higham1988, algorithm 2.4 without its last test.
fn inverse_norm(lu: &SquareLu, n: usize) -> f64 {
    let mut x = vec![1.0 / n as f64; n];
    let mut best = 0.0_f64;
    for _ in 0..5 {
        lu.solve(&mut x);
        let norm = x.iter().map(|x| x.abs()).sum::<f64>();
        if norm.is_nan() || norm <= best {
            return if norm.is_nan() { f64::INFINITY } else { best };
        }
        best = norm;
        x.iter_mut().for_each(|x| *x = 1.0_f64.copysign(*x));
        lu.solve_transpose(&mut x);
        let largest = (0..n).max_by(|&i, &j| x[i].abs().total_cmp(&x[j].abs())).unwrap_or(0);
        x.fill(0.0);
        x[largest] = 1.0;
    }
    best
}

/// Systems up to this size are factorised with all their entries.
const FEW: usize = 100;
