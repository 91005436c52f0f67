//! What every kind of problem offers to the loop that drives the solvers.

use crate::check::{Certificate, ConeSystem, Evidence, Measure};
use crate::{Kind, ProblemError};

/// A problem, stated: validated data, the shape of its unknown, and its own judge.
///
/// The judge is split in two so that a loop may call it without allocating: a [`Gauge`](Problem::Gauge) holds
/// what depends on the problem alone (norms, diagonal blocks, buffers) and [`measure`](Problem::measure) uses it.
pub trait Problem {
    /// The unknown of the problem.
    type Point: std::fmt::Debug + Clone + PartialEq + Send;
    /// The judge's constants and buffers for one problem.
    type Gauge: Send;

    /// Which kind of problem this is.
    fn kind(&self) -> Kind;

    /// The number of scalar unknowns that a solver works on.
    fn unknowns(&self) -> usize;

    /// What the time of a judgement grows with: the unknowns, and whatever else there is more of.
    fn burden(&self) -> usize {
        self.unknowns()
    }

    /// Whether a judgement asks functions of a caller's, which take whatever time they take.
    fn asks_functions(&self) -> bool {
        false
    }

    /// The point with all parts zero, of the lengths that the problem asks for.
    fn origin(&self) -> Self::Point;

    /// Checks shapes and values, of fields that a caller may have changed. Cost: one pass over the data.
    fn validate(&self) -> Result<(), ProblemError>;

    /// A caller's point, checked: every part has the right length and holds finite numbers.
    fn validate_point(&self, point: &Self::Point) -> Result<(), ProblemError>;

    /// Overwrites `to` with `from` without allocating when the lengths agree.
    fn copy_point(from: &Self::Point, to: &mut Self::Point);

    /// Prepares the judge. Cost: one pass over the data, and for global problems one factorisation of M.
    fn gauge(&self) -> Result<Self::Gauge, ProblemError>;

    /// Prepares the judge for another problem, reusing `gauge`'s memory where the shape allows.
    fn regauge(&self, gauge: &mut Self::Gauge) -> Result<(), ProblemError> {
        *gauge = self.gauge()?;
        Ok(())
    }

    /// The residuals of `point`, recomputed from the data of the problem alone, in plain arithmetic where that is
    /// much cheaper: to steer by. Allocates nothing.
    fn measure(&self, point: &Self::Point, gauge: &mut Self::Gauge) -> Measure;

    /// The residuals of `point` with all products in doubled precision: to decide by. Allocates nothing.
    fn certify(&self, point: &Self::Point, gauge: &mut Self::Gauge) -> Measure;

    /// The residuals of `point`, none below what [`certify`](Self::certify) finds but for what decides nothing, where plain arithmetic with a bound of its rounding is enough to see that it
    /// passes at `tolerance`: much cheaper, and for most points of well scaled problems enough. Second, their merit without what the bound adds: to steer by. `None` says nothing of the point.
    /// Allocates nothing.
    fn accept(
        &self,
        _point: &Self::Point,
        _gauge: &mut Self::Gauge,
        _tolerance: f64,
    ) -> Option<(Measure, f64)> {
        None
    }

    /// Puts `point`, the one last measured with `gauge`, exactly where it is but for rounding: variables on the bounds that they are nearer to, in the judge's
    /// units, than their partners are to zero, and impulses to zero that are rounding of the loads; `boldly`, also what is below rounding in units of the whole problem. Says whether that changed it; by default nothing
    /// does. The result is a candidate, to be measured in its turn. Allocates nothing.
    fn tidy(&self, _point: &mut Self::Point, _gauge: &mut Self::Gauge, _boldly: bool) -> bool {
        false
    }

    /// Puts in `point`, the one last measured with `gauge`, what follows from its impulses as the judge has it: velocities and multipliers of a global problem. Says whether there is such a
    /// part, and it is finite. Allocates nothing.
    fn follow_impulses(&self, _point: &mut Self::Point, _gauge: &mut Self::Gauge) -> bool {
        false
    }

    /// What is complementary to the unknown, at a valid point and in plain arithmetic: the relative velocity u, or `w = M z + q`; of an hLCP its s. What the judge
    /// computes of it is in its verdict.
    fn partner(&self, point: &Self::Point) -> Vec<f64>;

    /// What `certificate`, which claims that the problem has no solution, is worth: decided from the data alone, in exact arithmetic.
    fn evidence(&self, certificate: &Certificate) -> Evidence;

    /// Whether `certificate` proves that the problem has no solution.
    fn verify(&self, certificate: &Certificate) -> bool {
        matches!(self.evidence(certificate), Evidence::Proved(_))
    }

    /// The problem in exact numbers; `None` where its matrix is known by its products only.
    fn cones(&self) -> Option<ConeSystem>;

    /// The point with these unknowns, in the order of [`ConeSystem::unknowns`].
    fn assembled(&self, unknowns: &[f64]) -> Self::Point;
}
