//! The linearisation of a nonlinear problem, solved along an arc.

use nonsmooth_linalg::Csc;

use super::{End, Linear, Start, Tracer};
use crate::complementarity::form::Model;

/// Which of y with `π(y) = x` an arc begins at.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Cell<'a> {
    /// That with the smallest residual of the normal map: `l_i − F_i` where x_i is at its lower bound and `F_i > 0`, likewise above, x_i elsewhere.
    Preimage,
    /// `x − F(x)`: the cell in which Newton's method on the minimum makes its step. Its projection is not x, so it is for [`Start::Basis`].
    Minimum,
    /// This one.
    Of(&'a [f64]),
}

/// `l ≤ z ≤ u ⟂ F(x) + (JF(x) + λI)(z − x)`, and what an arc found of it.
pub struct Linearised {
    tracer: Tracer,
    matrix: Csc,
    q: Vec<f64>,
    y: Vec<f64>,
    end: Vec<f64>,
    /// All pivots so far.
    pub pivots: usize,
}

impl Linearised {
    /// For problems of this model.
    pub fn new(model: &Model) -> Self {
        let n = model.dim();
        let zeros = || vec![0.0; n];
        Self {
            tracer: Tracer::new(n),
            matrix: model.matrix().clone(),
            q: zeros(),
            y: zeros(),
            end: zeros(),
            pivots: 0,
        }
    }

    /// Follows the arc of the linearisation at x, where the model was linearised and F is f, by at most `pivots` pivots.
    pub fn solve(
        &mut self,
        model: &Model,
        (x, f): (&[f64], &[f64]),
        lambda: f64,
        (start, cell): (Start, Cell),
        pivots: usize,
    ) -> End {
        self.solve_until(model, (x, f), lambda, (start, cell), pivots, 1.0)
    }

    /// As [`solve`](Self::solve), to `t = until` in place of 1.
    pub fn solve_until(
        &mut self,
        model: &Model,
        (x, f): (&[f64], &[f64]),
        lambda: f64,
        (start, cell): (Start, Cell),
        pivots: usize,
        until: f64,
    ) -> End {
        let Self { tracer, matrix, q, y, end, .. } = self;
        let values = matrix.values_mut();
        values.copy_from_slice(model.matrix().values());
        model.diagonal().iter().for_each(|&k| values[k] += lambda);
        q.copy_from_slice(f);
        matrix.mul_add(-1.0, x, q);
        let (lower, upper) = model.boxed();
        for i in 0..x.len() {
            y[i] = match cell {
                Cell::Minimum => x[i] - f[i],
                Cell::Of(y) => y[i],
                Cell::Preimage if x[i] <= lower[i] => lower[i] - f[i].max(0.0),
                Cell::Preimage if x[i] >= upper[i] => upper[i] - f[i].min(0.0),
                Cell::Preimage => x[i],
            };
        }
        let problem = Linear { matrix, q, lower, upper };
        let found = tracer.follow_until(&problem, start, y, pivots, until);
        self.pivots += tracer.pivots();
        for (i, (end, y)) in end.iter_mut().zip(&*y).enumerate() {
            *end = model.project(i, *y);
        }
        found
    }

    /// z where the arc ended, or where t was the largest.
    pub fn end(&self) -> &[f64] {
        &self.end
    }

    /// y there.
    pub fn normal_end(&self) -> &[f64] {
        &self.y
    }

    /// The largest t.
    pub fn reached(&self) -> f64 {
        self.tracer.reached()
    }

    /// Whether columns of the first basis depended on others.
    pub fn was_singular(&self) -> bool {
        self.tracer.dependent() > 0
    }
}
