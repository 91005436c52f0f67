//! The linear complementarity problem with two bounds.

use super::judge::{Data, InZ};
use super::square;
use super::stated::{Part, Parts, Shape, Stated, plural};
use crate::LcpPoint;
use crate::ProblemError;
use crate::check::ConeSystem;
use crate::check::proof::{Exactly, bounded, columns, exacts};
use crate::error::{bounds, vector};
use nonsmooth_linalg::Matrix;

/// `−(M z + q) ∈ N_[l, u](z)`: with `w = M z + q`, `w_i ≥ 0` where `z_i = l_i`, `w_i ≤ 0` where `z_i = u_i`, and `w_i = 0` between.
///
/// Bounds may be infinite: `l = 0, u = ∞` is an LCP, `l = −∞, u = ∞` an equation.
#[derive(Debug, Clone, PartialEq)]
#[allow(non_snake_case)]
pub struct BoxLcp {
    /// n × n.
    pub M: Matrix,
    /// n.
    pub q: Vec<f64>,
    /// l, n; −∞ allowed.
    pub lower: Vec<f64>,
    /// u, n; ∞ allowed.
    pub upper: Vec<f64>,
}

#[allow(non_snake_case)]
impl BoxLcp {
    /// States a problem, validated.
    ///
    /// Errors: a matrix that is not square, a wrong length, an entry of M or q that is not finite, bounds that are NaN or cross.
    pub fn new(
        M: impl Into<Matrix>,
        q: Vec<f64>,
        lower: Vec<f64>,
        upper: Vec<f64>,
    ) -> Result<Self, ProblemError> {
        let problem = Self { M: M.into().without_zeros(), q, lower, upper };
        problem.validate()?;
        Ok(problem)
    }

    /// Checks shapes and values; the fields are public, so call it after changing them.
    pub fn validate(&self) -> Result<(), ProblemError> {
        square("M", &self.M)?;
        let n = self.M.nrows();
        vector("q", &self.q, n, "rows of M")?;
        bounds([&self.lower, &self.upper], n, "rows of M")
    }

    /// The number of variables n.
    pub fn dim(&self) -> usize {
        self.q.len()
    }
}

// The point of the box that is nearest to zero.
problem_in_z!(BoxLcp, problem => problem.dim(), {
    let bounds = problem.lower.iter().zip(&problem.upper);
    bounds.map(|(&l, &u)| 0.0_f64.clamp(l, u)).collect()
});

impl Stated for BoxLcp {
    const STATEMENT: &'static str = "-(M z + q) in the normal cone of [lower, upper] at z";
    const PARTS: &'static [(&'static str, Shape)] = &[
        ("M", Shape::Matrix),
        ("q", Shape::Vector),
        ("lower", Shape::Vector),
        ("upper", Shape::Vector),
    ];
    const SOLUTION: &'static [&'static str] = &["z", "w"];

    fn parts(&self) -> Vec<(&'static str, Part<'_>)> {
        vec![
            ("q", Part::Vector(&self.q)),
            ("lower", Part::Vector(&self.lower)),
            ("upper", Part::Vector(&self.upper)),
            ("M", Part::Matrix(&self.M)),
        ]
    }

    fn from_parts(parts: &mut dyn Parts) -> Result<Self, ProblemError> {
        let (lower, upper) = (parts.vector("lower")?, parts.vector("upper")?);
        Self::new(parts.matrix("M")?, parts.vector("q")?, lower, upper)
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
        let bounded = |all: &[f64]| all.iter().filter(|x| x.is_finite()).count();
        let variables = plural(self.dim(), "variable");
        let (lower, upper) = (bounded(&self.lower), bounded(&self.upper));
        format!("{variables}, {} and {upper} upper", plural(lower, "lower bound"))
    }

    fn classified(&self) -> Option<&Matrix> {
        Some(&self.M)
    }
}

impl InZ for BoxLcp {
    fn data(&self) -> Data<'_> {
        let bounds = Some((&self.lower[..], &self.upper[..]));
        Data { matrix: &self.M, q: &self.q, equalities: 0, free: 0, bounds }
    }
}

/// `w − M (z − z₀) = q + M z₀` with z₀ at a bound of each variable.
impl Exactly for BoxLcp {
    fn system(&self, wanted: Option<&[bool]>) -> Option<ConeSystem> {
        let mut system = ConeSystem::new(exacts(&self.q), wanted);
        let all = columns(&self.M, -1, &|i| system.wants(i))?;
        for (j, column) in all.into_iter().enumerate() {
            let unknown = bounded(&mut system, j, column, [self.lower[j], self.upper[j]]);
            system.unknowns.push(unknown);
        }
        Some(system)
    }

    fn rows(&self) -> usize {
        self.q.len()
    }
}
