//! A nonlinear problem, seen by the methods that solve it.

use nonsmooth_linalg::{Csc, Matrix};
use nonsmooth_problem::Mcp;
use nonsmooth_problem::field::{Evaluator, Pattern, tentatively};

/// `l ≤ x ≤ u ⟂ F(x) + λ(x − c)` with its values and Jacobians; λ = 0 unless a proximal method sets it.
pub struct Model {
    field: Box<dyn Evaluator>,
    pattern: Pattern,
    /// The Jacobian; its pattern has the whole diagonal.
    matrix: Matrix,
    /// Where the entries of the field's pattern, and those of the diagonal, stand in the matrix.
    places: Vec<usize>,
    diagonal: Vec<usize>,
    values: Vec<f64>,
    /// A point beside one where the Jacobian is infinite, and F there.
    beside: [Vec<f64>; 2],
    lower: Vec<f64>,
    upper: Vec<f64>,
    /// What the rows of F and JF are multiplied by, if they are: powers of two, so that nothing is rounded.
    weights: Vec<f64>,
    weighed: bool,
    lambda: f64,
    centre: Vec<f64>,
    /// How often F, and JF, were evaluated.
    pub evaluations: [u64; 2],
}

/// Rows whose values and slopes at the start are smaller or larger are solved in other units: residuals are absolute there, and squares of merits have an end.
const LEAST: f64 = 1e-12;
const MOST: f64 = 1e100;

/// How far a variable is moved, in units of its size, at which a derivative is infinite: that of a root or a power at a bound, say. The steep slope beside it
/// keeps the variable where it is, or lets it go.
const BESIDE: [f64; 4] = [1e-10, 1e-8, 1e-6, 1e-4];

impl Model {
    /// The model of a problem.
    pub fn new(problem: &Mcp) -> Self {
        let n = problem.dim();
        let pattern = problem.F.pattern().clone();
        let all = pattern.places().map(|(i, j)| (i, j, 0.0));
        let with_diagonal = all.chain((0..n).map(|i| (i, i, 0.0)));
        let matrix = Csc::from_triplets(n, n, with_diagonal).expect("places of a square matrix");
        let place = |i: usize, j: usize| {
            let rows = matrix.column(j).0;
            matrix.col_ptr()[j] + rows.binary_search(&i).expect("a place of the pattern")
        };
        Self {
            field: problem.F.evaluator(),
            places: pattern.places().map(|(i, j)| place(i, j)).collect(),
            diagonal: (0..n).map(|i| place(i, i)).collect(),
            values: vec![0.0; pattern.len()],
            beside: [vec![0.0; n], vec![0.0; n]],
            matrix: matrix.into(),
            pattern,
            lower: problem.lower.clone(),
            upper: problem.upper.clone(),
            weights: vec![1.0; n],
            weighed: false,
            lambda: 0.0,
            centre: vec![0.0; n],
            evaluations: [0; 2],
        }
    }

    /// The number of variables.
    pub fn dim(&self) -> usize {
        self.lower.len()
    }

    /// `[l_i, u_i]`.
    #[inline]
    pub fn bounds(&self, i: usize) -> (f64, f64) {
        (self.lower[i], self.upper[i])
    }

    /// l and u.
    pub fn boxed(&self) -> (&[f64], &[f64]) {
        (&self.lower, &self.upper)
    }

    /// The point of `[l_i, u_i]` nearest to x.
    #[inline]
    pub fn project(&self, i: usize, x: f64) -> f64 {
        x.max(self.lower[i]).min(self.upper[i])
    }

    /// Where the Jacobian of F may not be zero.
    pub fn pattern(&self) -> &Pattern {
        &self.pattern
    }

    /// From now on F has the proximal term `λ(x − c)`.
    pub fn pull(&mut self, lambda: f64, centre: &[f64]) {
        self.lambda = lambda;
        self.centre.copy_from_slice(centre);
    }

    /// From now on F is itself.
    pub fn release(&mut self) {
        self.lambda = 0.0;
    }

    /// λ.
    pub fn lambda(&self) -> f64 {
        self.lambda
    }

    /// From now on the rows of F have their own units.
    pub fn unweigh(&mut self) {
        self.weighed = false;
    }

    /// From now on rows that are very small or very large at x, where the model was linearised last, to `f`, are multiplied by powers of two.
    pub fn weigh(&mut self, x: &[f64], f: &[f64]) {
        self.weights.iter_mut().zip(f).for_each(|(size, f)| *size = f.abs());
        for ((i, j), v) in self.pattern.places().zip(&self.values) {
            self.weights[i] = self.weights[i].max(v.abs() * x[j].abs().max(1.0));
        }
        self.weighed = false;
        for size in &mut self.weights {
            let ordinary = *size == 0.0 || !size.is_finite() || (LEAST..MOST).contains(size);
            self.weighed |= !ordinary;
            *size =
                if ordinary { 1.0 } else { (-size.log2().round()).clamp(-1000.0, 1000.0).exp2() };
        }
    }

    fn apply_weights(&self, f: &mut [f64]) {
        if self.weighed {
            f.iter_mut().zip(&self.weights).for_each(|(f, w)| *f *= w);
        }
    }

    fn add_term(&self, x: &[f64], f: &mut [f64]) {
        if self.lambda != 0.0 {
            for ((f, x), c) in f.iter_mut().zip(x).zip(&self.centre) {
                *f += self.lambda * (x - c);
            }
        }
    }

    /// F(x). False where it is not defined: a step that leaves its domain is a try.
    pub fn value(&mut self, x: &[f64], f: &mut [f64]) -> bool {
        self.evaluations[0] += 1;
        let defined = tentatively(|| self.field.value(x, f));
        self.apply_weights(f);
        self.add_term(x, f);
        defined
    }

    /// F(x) and the [`matrix`](Self::matrix) JF(x). False where F is not defined, or JF neither at x nor beside it, or the time is over.
    pub fn linearise(&mut self, x: &[f64], f: &mut [f64]) -> bool {
        self.evaluations[1] += 1;
        let defined = self.field.jacobian(x, f, &mut self.values) || self.beside(x, f);
        self.apply_weights(f);
        self.add_term(x, f);
        let Matrix::Sparse(matrix) = &mut self.matrix else { unreachable!("made sparse") };
        let values = matrix.values_mut();
        values.fill(0.0);
        // Places are all different.
        self.places.iter().zip(&self.values).for_each(|(&k, v)| values[k] = *v);
        if self.weighed {
            let rows = self.pattern.places().map(|(i, _)| self.weights[i]);
            self.places.iter().zip(rows).for_each(|(&k, w)| values[k] *= w);
        }
        if self.lambda != 0.0 {
            self.diagonal.iter().for_each(|&k| values[k] += self.lambda);
        }
        defined
    }

    /// F(x), and the Jacobian where the variables that make it infinite are moved inside their bounds.
    fn beside(&mut self, x: &[f64], f: &mut [f64]) -> bool {
        let infinite = self.pattern.places().zip(&self.values).filter(|(_, v)| !v.is_finite());
        let mut columns: Vec<usize> = infinite.map(|((_, j), _)| j).collect();
        if columns.is_empty() || !self.field.value(x, f) {
            return false;
        }
        columns.sort_unstable();
        columns.dedup();
        let [y, scratch] = &mut self.beside;
        y.copy_from_slice(x);
        BESIDE.iter().any(|distance| {
            for &j in &columns {
                let (l, u) = (self.lower[j], self.upper[j]);
                let d = (distance * x[j].abs().max(1.0)).min(0.5 * (u - l));
                y[j] = if x[j] + d <= u { x[j] + d } else { x[j] - d };
            }
            self.evaluations[1] += 1;
            tentatively(|| self.field.jacobian(y, scratch, &mut self.values))
        })
    }

    /// JF at the point last linearised.
    pub fn matrix(&self) -> &Csc {
        let Matrix::Sparse(matrix) = &self.matrix else { unreachable!("made sparse") };
        matrix
    }

    /// Where the diagonal stands among the entries of the matrix.
    pub fn diagonal(&self) -> &[usize] {
        &self.diagonal
    }

    /// `x_i − mid(l_i, u_i, x_i − f_i)`
    #[inline]
    pub fn residual(&self, i: usize, x: f64, f: f64) -> f64 {
        // The smaller of the two differences is computed without the larger.
        if x - f <= self.lower[i] {
            x - self.lower[i]
        } else if x - f >= self.upper[i] {
            x - self.upper[i]
        } else {
            f
        }
    }

    /// The natural residual `‖x − mid(l, u, x − f)‖_∞`; NaN where an entry is.
    pub fn natural(&self, x: &[f64], f: &[f64]) -> f64 {
        let mut most: f64 = 0.0;
        for i in 0..x.len() {
            let r = self.residual(i, x[i], f[i]).abs();
            if r.is_nan() {
                return f64::NAN;
            }
            most = most.max(r);
        }
        most
    }
}
