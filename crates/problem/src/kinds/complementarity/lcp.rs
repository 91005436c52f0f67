//! The linear complementarity problem.

use super::judge::{Data, InZ};
use super::stated::{Part, Parts, Shape, Stated, plural};
use super::{mixed, square};
use crate::check::ConeSystem;
use crate::check::proof::{Claim, Exactly};
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
    /// z, and w where it is known.
    pub(super) fn parts<'a>(&'a self, w: Option<&'a [f64]>) -> Vec<(&'static str, &'a [f64])> {
        std::iter::once(("z", &self.z[..])).chain(w.map(|w| ("w", w))).collect()
    }

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
        let problem = Self { M: M.into().without_zeros(), q };
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

impl Stated for Lcp {
    const STATEMENT: &'static str = "0 <= z, w = M z + q >= 0, z'w = 0";
    const PARTS: &'static [(&'static str, Shape)] = &[("M", Shape::Matrix), ("q", Shape::Vector)];
    const SOLUTION: &'static [&'static str] = &["z", "w"];

    fn parts(&self) -> Vec<(&'static str, Part<'_>)> {
        vec![("q", Part::Vector(&self.q)), ("M", Part::Matrix(&self.M))]
    }

    fn from_parts(parts: &mut dyn Parts) -> Result<Self, ProblemError> {
        Self::new(parts.matrix("M")?, parts.vector("q")?)
    }

    fn point_parts<'a>(
        &self,
        point: &'a LcpPoint,
        w: Option<&'a [f64]>,
    ) -> Vec<(&'static str, &'a [f64])> {
        point.parts(w)
    }

    fn point_from_parts<E>(
        mut part: impl FnMut(&'static str) -> Result<Vec<f64>, E>,
    ) -> Result<LcpPoint, E> {
        Ok(LcpPoint { z: part("z")? })
    }

    fn pairs(&self) -> usize {
        self.dim()
    }

    fn size(&self) -> String {
        plural(self.dim(), "variable")
    }

    fn classified(&self) -> Option<&Matrix> {
        Some(&self.M)
    }
}

impl InZ for Lcp {
    fn data(&self) -> Data<'_> {
        Data { matrix: &self.M, q: &self.q, equalities: 0, free: 0, bounds: None }
    }
}

/// `w − M z = q`.
impl Exactly for Lcp {
    fn system(&self, wanted: Option<&[bool]>) -> Option<ConeSystem> {
        mixed(&self.M, &self.q, 0, 0, wanted)
    }

    fn rows(&self) -> usize {
        self.q.len()
    }

    fn is_plausible(&self, y: &Claim) -> bool {
        plausible(&self.M, &self.q, y)
    }
}

/// Whether `qᵀ y < 0` and `Mᵀ y ≤ 0`, up to much more than rounding: exact numbers of a large matrix are not made in vain.
fn plausible(m: &Matrix, q: &[f64], y: &Claim) -> bool {
    let Claim::Doubles(y) = y else { return true };
    let terms = q.iter().zip(y).map(|(q, y)| q * y);
    let (power, size) = terms.fold((0.0, 0.0), |(sum, size), t: f64| (sum + t, size + t.abs()));
    let mut slopes = vec![(0.0, 0.0); m.ncols()];
    m.for_each(|i, j, x| {
        let (sum, size) = &mut slopes[j];
        *sum += x * y[i];
        *size += (x * y[i]).abs();
    });
    let nearly = |(sum, size): &(f64, f64)| *sum <= 1e-6 * size;
    nearly(&(power, size)) && slopes.iter().all(nearly)
}
