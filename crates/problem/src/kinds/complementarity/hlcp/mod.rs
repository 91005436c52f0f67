//! The horizontal linear complementarity problem.

mod judge;

pub use judge::HlcpGauge;

use super::square;
use super::stated::{Part, Parts, Shape, Stated, plural};
use crate::check::{self, Certificate, ConeSystem, Evidence, Measure};
use crate::error::vector;
use crate::{Kind, OfAny, Problem, ProblemError};
use nonsmooth_linalg::Matrix;

/// `Q x + R s = q`, `0 ≤ x ⟂ s ≥ 0`: lecture (33). An LCP is `Q = M, R = −I`, with −q on the right.
#[derive(Debug, Clone, PartialEq)]
#[allow(non_snake_case)]
pub struct Hlcp {
    /// n × n.
    pub Q: Matrix,
    /// n × n.
    pub R: Matrix,
    /// n.
    pub q: Vec<f64>,
}

/// A point of a horizontal problem.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct HlcpPoint {
    /// n.
    pub x: Vec<f64>,
    /// n.
    pub s: Vec<f64>,
}

#[allow(non_snake_case)]
impl Hlcp {
    /// States a problem, validated.
    ///
    /// Errors: matrices that are not square or of different order, a wrong length, a value that is not finite.
    pub fn new(
        Q: impl Into<Matrix>,
        R: impl Into<Matrix>,
        q: Vec<f64>,
    ) -> Result<Self, ProblemError> {
        let problem = Self { Q: Q.into().without_zeros(), R: R.into().without_zeros(), q };
        problem.validate()?;
        Ok(problem)
    }

    /// Checks shapes and values; the fields are public, so call it after changing them.
    pub fn validate(&self) -> Result<(), ProblemError> {
        square("Q", &self.Q)?;
        square("R", &self.R)?;
        self.R.check_shape("R", self.Q.nrows(), self.Q.nrows(), "as Q")?;
        vector("q", &self.q, self.Q.nrows(), "rows of Q")
    }

    /// The number of pairs n.
    pub fn dim(&self) -> usize {
        self.q.len()
    }
}

impl Problem for Hlcp {
    type Point = HlcpPoint;
    type Gauge = HlcpGauge;

    fn kind(&self) -> Kind {
        Self::KIND
    }

    fn unknowns(&self) -> usize {
        2 * self.dim()
    }

    fn origin(&self) -> HlcpPoint {
        HlcpPoint { x: vec![0.0; self.dim()], s: vec![0.0; self.dim()] }
    }

    fn validate(&self) -> Result<(), ProblemError> {
        Self::validate(self)
    }

    fn validate_point(&self, point: &HlcpPoint) -> Result<(), ProblemError> {
        vector("x", &point.x, self.dim(), "pairs")?;
        vector("s", &point.s, self.dim(), "pairs")
    }

    fn copy_point(from: &HlcpPoint, to: &mut HlcpPoint) {
        to.x.clone_from(&from.x);
        to.s.clone_from(&from.s);
    }

    fn gauge(&self) -> Result<HlcpGauge, ProblemError> {
        Ok(HlcpGauge::new(self))
    }

    fn regauge(&self, gauge: &mut HlcpGauge) -> Result<(), ProblemError> {
        gauge.refill(self);
        Ok(())
    }

    fn measure(&self, point: &HlcpPoint, gauge: &mut HlcpGauge) -> Measure {
        gauge.measure(self, point, false)
    }

    fn certify(&self, point: &HlcpPoint, gauge: &mut HlcpGauge) -> Measure {
        gauge.measure(self, point, true)
    }

    fn tidy(&self, point: &mut HlcpPoint, gauge: &mut HlcpGauge, boldly: bool) -> bool {
        gauge.tidy(point, boldly)
    }

    fn partner(&self, point: &HlcpPoint) -> Vec<f64> {
        point.s.clone()
    }

    fn evidence(&self, certificate: &Certificate) -> Evidence {
        check::weigh(self, certificate)
    }

    fn cones(&self) -> Option<ConeSystem> {
        check::Exactly::system(self, None)
    }

    fn assembled(&self, unknowns: &[f64]) -> Self::Point {
        let (x, s) = unknowns.split_at(self.dim());
        HlcpPoint { x: x.to_vec(), s: s.to_vec() }
    }
}

impl Stated for Hlcp {
    const STATEMENT: &'static str = "Q x + R s = q, 0 <= x, s >= 0, x's = 0";
    const PARTS: &'static [(&'static str, Shape)] =
        &[("Q", Shape::Matrix), ("R", Shape::Matrix), ("q", Shape::Vector)];
    const SOLUTION: &'static [&'static str] = &["x", "s"];
    const ROW: &'static str = "pair";

    fn parts(&self) -> Vec<(&'static str, Part<'_>)> {
        vec![
            ("q", Part::Vector(&self.q)),
            ("Q", Part::Matrix(&self.Q)),
            ("R", Part::Matrix(&self.R)),
        ]
    }

    fn from_parts(parts: &mut dyn Parts) -> Result<Self, ProblemError> {
        Self::new(parts.matrix("Q")?, parts.matrix("R")?, parts.vector("q")?)
    }

    fn point_parts<'a>(
        &self,
        point: &'a HlcpPoint,
        _: Option<&'a [f64]>,
    ) -> Vec<(&'static str, &'a [f64])> {
        vec![("x", &point.x), ("s", &point.s)]
    }

    fn point_from_parts<E>(
        mut part: impl FnMut(&'static str) -> Result<Vec<f64>, E>,
    ) -> Result<HlcpPoint, E> {
        Ok(HlcpPoint { x: part("x")?, s: part("s")? })
    }

    /// s belongs to the point.
    fn kept(&self, _: Vec<f64>) -> Option<Vec<f64>> {
        None
    }

    fn pairs(&self) -> usize {
        self.dim()
    }

    fn size(&self) -> String {
        plural(self.dim(), "pair")
    }

    fn sizes(&self) -> Vec<(&'static str, usize)> {
        vec![("pairs", self.dim())]
    }
}
