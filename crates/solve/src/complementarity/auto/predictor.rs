//! A start for Newton's methods on grids: linear problems by multigrid, without a factorisation.
//!
//! Problem: `l ≤ x ≤ u ⟂ F(x)`, large, JF sparse and symmetric. Method: `z` solves `l ≤ z ≤ u ⟂ F(x) + JF(x)(z − x)` by `tnnmg`, and is the next x as long as the natural residual halves. What Newton's methods
//! would find face by face, a factorisation for some rows of points, is then known but for what the curvature of F moves.
//!
//! References: Josephy1979; GraserKornhuber2009. Cost: some dozen passes over JF for each of a dozen steps, three times at most. Fails: where JF is indefinite at x, and leaves x as it was.

use nonsmooth_linalg::{Csc, Matrix, norm};
use nonsmooth_problem::field::tentatively;
use nonsmooth_problem::{BoxLcp, LcpPoint, Mcp};

use super::Portfolio;
use super::plan::Plan;
use crate::{Limits, Session, Status};

/// From this many variables on; with fewer, factorisations are cheap.
const LARGE: usize = 5000;
/// At most so many entries a row.
const SPARSE: usize = 12;
/// Linear problems.
const ROUNDS: usize = 3;
/// The part of the first residual from which Newton's methods take a step or two, and end with more digits.
const NEAR: f64 = 1e-3;
/// Steps of multigrid for each, and to what residual.
const STEPS: usize = 40;
const CLOSE: f64 = 1e-6;

/// The workspace, and what came of it.
pub(super) struct Predictor {
    multigrid: Portfolio<BoxLcp>,
    /// Linear problems whose solution was taken.
    taken: usize,
    iterations: usize,
}

impl Predictor {
    pub(super) fn new() -> Self {
        let plan = |_: &BoxLcp, stage: usize| match stage {
            0 => Plan::new().then("tnnmg", STEPS, "a linearised problem").0,
            _ => vec![],
        };
        Self { multigrid: Portfolio::new(plan), taken: 0, iterations: 0 }
    }

    /// Moves the start, where that brings it nearer, and hands back where it was.
    pub(super) fn start(
        &mut self,
        problem: &Mcp,
        point: &mut LcpPoint,
        limits: &Limits,
    ) -> Option<LcpPoint> {
        (self.taken, self.iterations) = (0, 0);
        let moved = self.moved(problem, &point.z, limits)?;
        Some(LcpPoint { z: std::mem::replace(&mut point.z, moved) })
    }

    fn moved(&mut self, problem: &Mcp, start: &[f64], limits: &Limits) -> Option<Vec<f64>> {
        let (n, pattern) = (problem.dim(), problem.F.pattern());
        if n < LARGE || pattern.len() > SPARSE * n {
            return None;
        }
        let bounds = || problem.lower.iter().zip(&problem.upper);
        let mut evaluator = problem.F.evaluator();
        let (mut f, mut values) = (vec![0.0; n], vec![0.0; pattern.len()]);
        let mut x: Vec<f64> =
            start.iter().zip(bounds()).map(|(x, (l, u))| x.max(*l).min(*u)).collect();
        let (mut best, mut first, mut last) = (None, 0.0, f64::INFINITY);
        for round in 0..=ROUNDS {
            let smooth = tentatively(|| evaluator.jacobian(&x, &mut f, &mut values));
            if !smooth || f.iter().chain(&values).any(|x| !x.is_finite()) {
                return best;
            }
            let residual: Vec<f64> = x
                .iter()
                .zip(&f)
                .zip(bounds())
                .map(|((x, f), (l, u))| x - (x - f).max(*l).min(*u))
                .collect();
            let residual = norm(&residual);
            if residual > 0.5 * last {
                return best;
            }
            if round == 0 {
                first = residual;
            } else {
                best = Some(x.clone());
                self.taken = round;
            }
            last = residual;
            if round == ROUNDS || residual <= NEAR * first {
                return best;
            }
            let entries = pattern.places().zip(&values).map(|((i, j), &a)| (i, j, a));
            let Ok(jacobian) = Csc::from_triplets(n, n, entries) else { return best };
            if jacobian.asymmetry() > SYMMETRIC || (0..n).any(|i| jacobian.get(i, i) <= 0.0) {
                return best;
            }
            jacobian.mul_add(-1.0, &x, &mut f);
            let (lower, upper) = (problem.lower.clone(), problem.upper.clone());
            let linear = BoxLcp { M: Matrix::from(jacobian), q: f.clone(), lower, upper };
            // From zero, where the method makes a start of its own through the levels.
            let mut trial = LcpPoint { z: vec![0.0; n] };
            let limits = Limits { tolerance: CLOSE, ..limits.clone() };
            let Ok(outcome) = self.multigrid.solve(&linear, &mut trial, &limits, &mut |_| {})
            else {
                return best;
            };
            self.iterations += outcome.iterations;
            if outcome.status != Status::Solved {
                return best;
            }
            x = trial.z;
        }
        best
    }

    /// What was done, where something was.
    pub(super) fn account(&self) -> Option<String> {
        let problems = if self.taken == 1 { "problem" } else { "problems" };
        (self.taken > 0).then(|| {
            let (taken, steps) = (self.taken, self.iterations);
            format!("tnnmg (a start without factorisations): {taken} linearised {problems} in {steps} steps")
        })
    }
}

/// The asymmetry up to which `tnnmg` takes a matrix.
const SYMMETRIC: f64 = 1e-12;
