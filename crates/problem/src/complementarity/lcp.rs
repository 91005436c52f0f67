//! The linear complementarity problem.

use super::square;
use crate::error::vector;
use crate::{Problem, ProblemError};
use nonsmooth_linalg::Matrix;

/// `0 ≤ z ⟂ w = M z + q ≥ 0`: LCP(M, q), lecture (6).
#[derive(Debug, Clone, PartialEq)]
#[allow(non_snake_case)]
pub struct Lcp {
    /// n × n, of any kind.
    pub M: Matrix,
    /// n.
    pub q: Vec<f64>,
}

/// A point of a linear complementarity problem. `w = M z + q` follows from it.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct LcpPoint {
    /// The variables: z, or `(u, v)` of a mixed problem.
    pub z: Vec<f64>,
}

impl LcpPoint {
    /// `w = M z + q` of this point, in plain arithmetic; what the judge computes of it is in its verdict.
    ///
    /// # Panics
    ///
    /// Where the point is not one of `problem`.
    pub fn w(&self, problem: &impl Problem<Point = Self>) -> Vec<f64> {
        problem.partner(self)
    }
}

#[allow(non_snake_case)]
impl Lcp {
    /// States a problem, validated.
    ///
    /// Errors: no rows, a matrix that is not square, a wrong length, a value that is not finite; each names its entry.
    pub fn new(M: impl Into<Matrix>, q: Vec<f64>) -> Result<Self, ProblemError> {
        let problem = Self { M: M.into(), q };
        problem.validate()?;
        Ok(problem)
    }

    /// Checks shapes and values; the fields are public, so call it after changing them.
    pub fn validate(&self) -> Result<(), ProblemError> {
        square("M", &self.M)?;
        vector("q", &self.q, self.M.nrows(), "rows of M")
    }

    /// The number of variables n.
    pub fn dim(&self) -> usize {
        self.q.len()
    }
}

problem_in_z!(Lcp, problem => problem.dim(), vec![0.0; problem.dim()]);
