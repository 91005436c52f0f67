//! Linear complementarity problems, seen as equations between pairs: what interior points follow.

use nonsmooth_linalg::Matrix;
use nonsmooth_problem::{Hlcp, HlcpPoint, Lcp, LcpPoint, Mlcp, Problem};

use super::Bounded;
use crate::SolveError;

/// A problem `Q z + R s + c = 0`, `z = (u, x)` with u free, `0 ≤ x ⟂ s ≥ 0`. Offered by [`Lcp`], [`Mlcp`] (with as many equalities as free
/// variables; `Q = M`, `R = −I` on the pairs) and [`Hlcp`].
pub trait Paired: Problem {
    /// The problem's data.
    ///
    /// Errors: as many equalities as free variables are needed, and the entries of the matrices.
    fn equations(&self) -> Result<Equations<'_>, SolveError>;

    /// z and s of a point; s only where points have one.
    fn read(point: &Self::Point, z: &mut [f64], s: &mut [f64]);

    /// Writes z and s to a point.
    fn write(z: &[f64], s: &[f64], point: &mut Self::Point);
}

/// The data of a [`Paired`] problem.
#[derive(Debug, Clone, Copy)]
pub struct Equations<'a> {
    /// Q, or M: n × n.
    pub matrix: &'a Matrix,
    /// R; none where it is −I on the pairs.
    pub slack: Option<&'a Matrix>,
    /// q, with c = q where there is no R, and c = −q where there is one.
    pub q: &'a [f64],
    /// The number of free variables, which come first.
    pub free: usize,
}

impl<'a> Equations<'a> {
    /// Refuses matrices that are known by their products only.
    fn with_entries(self) -> Result<Self, SolveError> {
        let operator = |m: &Matrix| matches!(m, Matrix::Operator(_));
        if operator(self.matrix) || self.slack.is_some_and(operator) {
            return Err(SolveError::needs(
                "the entries of the matrix (dense or sparse)",
                "an operator",
            ));
        }
        Ok(self)
    }
}

/// The same for all problems in z with bounds.
fn of_bounded<P: Bounded>(problem: &P) -> Result<Equations<'_>, SolveError> {
    let system = problem.system()?;
    let (matrix, q, free) = (system.matrix, system.q, system.free());
    Equations { matrix, slack: None, q, free }.with_entries()
}

impl Paired for Lcp {
    fn equations(&self) -> Result<Equations<'_>, SolveError> {
        of_bounded(self)
    }

    fn read(point: &LcpPoint, z: &mut [f64], _: &mut [f64]) {
        z.copy_from_slice(&point.z);
    }

    fn write(z: &[f64], _: &[f64], point: &mut LcpPoint) {
        point.z.copy_from_slice(z);
    }
}

impl Paired for Mlcp {
    fn equations(&self) -> Result<Equations<'_>, SolveError> {
        of_bounded(self)
    }

    fn read(point: &LcpPoint, z: &mut [f64], _: &mut [f64]) {
        z.copy_from_slice(&point.z);
    }

    fn write(z: &[f64], _: &[f64], point: &mut LcpPoint) {
        point.z.copy_from_slice(z);
    }
}

impl Paired for Hlcp {
    fn equations(&self) -> Result<Equations<'_>, SolveError> {
        Equations { matrix: &self.Q, slack: Some(&self.R), q: &self.q, free: 0 }.with_entries()
    }

    fn read(point: &HlcpPoint, z: &mut [f64], s: &mut [f64]) {
        z.copy_from_slice(&point.x);
        s.copy_from_slice(&point.s);
    }

    fn write(z: &[f64], s: &[f64], point: &mut HlcpPoint) {
        point.x.copy_from_slice(z);
        point.s.copy_from_slice(s);
    }
}
