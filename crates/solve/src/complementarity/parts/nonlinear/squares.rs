//! A step of NE/SQP: Gauss–Newton on the natural residual, inside the box.
//!
//! ```text
//! min ½ Σ_{i bound} (H_i + d_i)² + ½ Σ_{i function} (F_i + ∇F_i d)²   over   l ≤ x + d ≤ u
//! ```
//!
//! A row is one of its bound where `x_i − F_i` is outside `[l_i, u_i]`, of its function elsewhere. The program is convex and always has a solution; `1e-10 ‖d‖²` makes it one.
//! It is solved by projected Newton steps (Bertsekas): the variables that the gradient holds at a bound stay there, the normal equations of the others are solved, and the
//! step is cut at the bounds. Then Armijo on `θ = ½‖H‖²`: `θ(x + td) ≤ θ(x) − σ t z`, `z = ½ Σ_bound d_i² + ½ Σ_function (∇F_i d)²`; where z = 0 the point is stationary.
//!
//! References: PangGabriel1993; Bertsekas1982. Cost: a few LU factorisations of the pattern of JFᵀJF.

use nonsmooth_linalg::budget::{self, Pace};
use nonsmooth_linalg::{Csc, Matrix};

use super::{Inner, Iterate, Moved};
use crate::complementarity::form::Model;
use crate::complementarity::parts::factor::Factor;

/// σ
const SIGMA: f64 = 1e-4;
const REGULARISED: f64 = 1e-10;
/// Projected Newton steps on one program.
const STEPS: usize = 60;
/// The shortest step.
const SHORTEST: f64 = 1e-10;
/// A program is solved if its projected gradient is below this part of the first one.
const SOLVED: f64 = 1e-10;

/// The memory of such steps.
#[derive(Default)]
pub struct Squares {
    /// Whether each row is one of its bound.
    bound: Vec<bool>,
    /// The row's value: H or F.
    value: Vec<f64>,
    d: Vec<f64>,
    trial: Vec<f64>,
    trial_f: Vec<f64>,
    gradient: Vec<f64>,
    step: Vec<f64>,
    product: Vec<f64>,
    held: Vec<bool>,
}

impl Squares {
    /// Of problems with n variables.
    pub fn new(n: usize) -> Self {
        let zeros = || vec![0.0; n];
        Self {
            bound: vec![false; n],
            value: zeros(),
            d: zeros(),
            trial: zeros(),
            trial_f: zeros(),
            gradient: zeros(),
            step: zeros(),
            product: zeros(),
            held: vec![false; n],
        }
    }

    /// `A d` into the product: rows of the identity, or of the Jacobian.
    fn multiply(&mut self, model: &Model, d: &[f64]) {
        self.product.fill(0.0);
        model.matrix().mul_add(1.0, d, &mut self.product);
        for (i, p) in self.product.iter_mut().enumerate() {
            if self.bound[i] {
                *p = d[i];
            }
        }
    }

    /// `Aᵀ y` into the gradient, y in the product; what it overwrites is of no use afterwards.
    fn multiply_transposed(&mut self, model: &Model) {
        self.gradient.fill(0.0);
        for (i, y) in self.product.iter_mut().enumerate().filter(|(i, _)| self.bound[*i]) {
            self.gradient[i] = std::mem::take(y);
        }
        model.matrix().mul_transpose_add(1.0, &self.product, &mut self.gradient);
    }

    /// `AᵀA` with the regularisation, a column at a time; none where the time is over.
    fn normal(&self, model: &Model) -> Option<Csc> {
        let n = self.d.len();
        let a = model.matrix();
        let rows = a.transpose();
        let (mut pointers, mut all, mut values) = (vec![0], vec![], vec![]);
        let mut sums = vec![0.0; n];
        let mut places = vec![];
        // The column that last had an entry in each row.
        let mut latest = vec![n; n];
        let mut pace = Pace::default();
        for k in 0..n {
            let mut add = |j: usize, x: f64| {
                if latest[j] != k {
                    (latest[j], sums[j]) = (k, 0.0);
                    places.push(j);
                }
                sums[j] += x;
            };
            let (of_function, entries) = a.column(k);
            for (&i, &b) in of_function.iter().zip(entries).filter(|(i, _)| !self.bound[**i]) {
                let (columns, others) = rows.column(i);
                if pace.over(columns.len() as f64) {
                    return None;
                }
                columns.iter().zip(others).for_each(|(&j, &a)| add(j, a * b));
            }
            let of_bound = if self.bound[k] { 1.0 } else { 0.0 };
            add(k, of_bound + REGULARISED);
            places.sort_unstable();
            values.extend(places.iter().map(|&j| sums[j]));
            all.append(&mut places);
            pointers.push(all.len());
        }
        Csc::from_vecs(n, n, pointers, all, values).ok()
    }

    /// The solution d of the program; false where the normal equations are singular or not finite.
    fn direct(&mut self, model: &Model, at: &Iterate) -> bool {
        let n = self.d.len();
        self.d.fill(0.0);
        let Some(all) = self.normal(model) else { return false };
        let mut matrix = Matrix::from(all.clone());
        let mut factor = Factor::new(&matrix);
        let mut first = None;
        for _ in 0..STEPS {
            if budget::over() {
                return false;
            }
            // Aᵀ(r + A d) + εd
            let d = std::mem::take(&mut self.d);
            self.multiply(model, &d);
            self.product.iter_mut().zip(&self.value).for_each(|(p, r)| *p += r);
            self.multiply_transposed(model);
            self.gradient.iter_mut().zip(&d).for_each(|(g, d)| *g += REGULARISED * d);
            self.d = d;
            let mut most: f64 = 0.0;
            for i in 0..n {
                let (l, u) = model.bounds(i);
                let (x, g) = (at.x[i] + self.d[i], self.gradient[i]);
                self.held[i] = (x <= l && g >= 0.0) || (x >= u && g <= 0.0);
                if !self.held[i] {
                    most = most.max(g.abs());
                }
            }
            // The first one is what the others are compared with.
            let limit = SOLVED * *first.get_or_insert(most);
            if most <= limit || most == 0.0 {
                return true;
            }
            let Matrix::Sparse(to) = &mut matrix else { unreachable!("made sparse") };
            let (pointers, rows) = (all.col_ptr(), all.row_idx());
            for j in 0..n {
                for k in pointers[j]..pointers[j + 1] {
                    let i = rows[k];
                    to.values_mut()[k] = match (self.held[i] || self.held[j], i == j) {
                        (false, _) => all.values()[k],
                        (true, true) => 1.0,
                        (true, false) => 0.0,
                    };
                }
            }
            let factorised =
                factor.factorise(&matrix) || (factor.distrust() && factor.factorise(&matrix));
            if !factorised {
                return false;
            }
            for i in 0..n {
                self.step[i] = if self.held[i] { 0.0 } else { -self.gradient[i] };
            }
            factor.solve(&mut self.step);
            if !self.step.iter().all(|x| x.is_finite()) {
                return false;
            }
            if !self.improve(model, at) {
                return true;
            }
        }
        true
    }

    /// Goes along the projected step as far as the program's value decreases; false where it does not.
    fn improve(&mut self, model: &Model, at: &Iterate) -> bool {
        let d = std::mem::take(&mut self.d);
        let before = self.program(model, &d);
        let mut t = 1.0;
        let mut trial = std::mem::take(&mut self.trial);
        let found = loop {
            for i in 0..d.len() {
                trial[i] = model.project(i, at.x[i] + d[i] + t * self.step[i]) - at.x[i];
            }
            if self.program(model, &trial) < before {
                break true;
            }
            t *= 0.5;
            if t < SHORTEST {
                break false;
            }
        };
        (self.d, self.trial) = if found { (trial, d) } else { (d, trial) };
        found
    }

    /// The value of the program at d.
    fn program(&mut self, model: &Model, d: &[f64]) -> f64 {
        self.multiply(model, d);
        let rows = self.product.iter().zip(&self.value).map(|(p, r)| (p + r).powi(2));
        0.5 * (rows.sum::<f64>() + REGULARISED * d.iter().map(|d| d * d).sum::<f64>())
    }
}

/// θ
fn merit(model: &Model, x: &[f64], f: &[f64]) -> f64 {
    0.5 * (0..x.len()).map(|i| model.residual(i, x[i], f[i]).powi(2)).sum::<f64>()
}

impl Inner for Squares {
    fn step(&mut self, model: &mut Model, at: &mut Iterate) -> Moved {
        if !model.linearise(&at.x, &mut at.f) {
            return Moved::Undefined;
        }
        for i in 0..at.x.len() {
            let (l, u) = model.bounds(i);
            let beyond = at.x[i] - at.f[i];
            self.bound[i] = beyond < l || beyond > u;
            self.value[i] = model.residual(i, at.x[i], at.f[i]);
        }
        let theta = merit(model, &at.x, &at.f);
        if !theta.is_finite() {
            return Moved::Undefined;
        }
        if !self.direct(model, at) {
            return Moved::Stuck;
        }
        let d = std::mem::take(&mut self.d);
        self.multiply(model, &d);
        self.d = d;
        let z = 0.5 * self.product.iter().map(|p| p * p).sum::<f64>();
        // Stationary: the linearised residual cannot be made smaller.
        if z <= f64::EPSILON * theta || z.is_nan() {
            return Moved::Stuck;
        }
        let mut t = 1.0;
        while t >= SHORTEST {
            for i in 0..at.x.len() {
                self.trial[i] = model.project(i, at.x[i] + t * self.d[i]);
            }
            let defined = model.value(&self.trial, &mut self.trial_f);
            if defined && merit(model, &self.trial, &self.trial_f) <= theta - SIGMA * t * z {
                std::mem::swap(&mut at.x, &mut self.trial);
                std::mem::swap(&mut at.f, &mut self.trial_f);
                at.measure(model);
                return Moved::Newton;
            }
            t *= 0.5;
        }
        Moved::Stuck
    }

    fn forget(&mut self) {}
}
