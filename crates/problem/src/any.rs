//! A problem whose kind is known only when a file is read, and its point.
//!
//! [`Friction`] and [`Complementarity`] list the kinds of their wings; a problem of any kind is one of theirs. It is a [`Problem`] itself, with its judge.

use crate::check::{
    Certificate, ConeSystem, ContactStatus, Evidence, Judged, Measure, RowCounts, RowStatus,
    StatusCounts, Verdict, VerdictOf,
};
use crate::{
    BoxLcp, Complementarity, Friction, FrictionGlobal, FrictionLocal, GlobalPoint, Hlcp, HlcpPoint,
    Kind, Lcp, LcpPoint, LocalPoint, Mlcp, Problem, ProblemError,
};

/// A problem of any kind.
// One a file: its size does not matter.
#[allow(clippy::large_enum_variant)]
#[derive(Debug, Clone, PartialEq)]
pub enum AnyProblem {
    /// Frictional contact.
    Friction(Friction),
    /// Linear complementarity.
    Complementarity(Complementarity),
}

/// Evaluates an expression for whichever problem an [`AnyProblem`] holds.
#[macro_export]
macro_rules! with_problem {
    ($any:expr, $problem:ident => $body:expr) => {
        match $any {
            $crate::AnyProblem::Friction(any) => $crate::with_friction!(any, $problem => $body),
            $crate::AnyProblem::Complementarity(any) => {
                $crate::with_complementarity!(any, $problem => $body)
            }
        }
    };
}

/// A point of a problem of any kind.
#[derive(Debug, Clone, PartialEq)]
pub enum AnyPoint {
    /// Of a [`FrictionLocal`].
    Local(LocalPoint),
    /// Of a [`FrictionGlobal`].
    Global(GlobalPoint),
    /// Of an [`Lcp`], [`Mlcp`] or [`BoxLcp`].
    Lcp(LcpPoint),
    /// Of an [`Hlcp`].
    Hlcp(HlcpPoint),
}

/// The judge's constants and buffers for a problem of any kind.
pub struct AnyGauge(Box<dyn std::any::Any + Send>);

/// What a contact or a row does.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum AnyStatus {
    /// A contact.
    Contact(ContactStatus),
    /// A row.
    Row(RowStatus),
}

/// How many contacts or rows do what.
#[derive(Debug, Clone, Copy, PartialEq, serde::Serialize)]
#[serde(untagged)]
pub enum AnyCounts {
    /// Contacts.
    Contacts(StatusCounts),
    /// Rows.
    Rows(RowCounts),
}

impl Default for AnyCounts {
    fn default() -> Self {
        Self::Contacts(StatusCounts::default())
    }
}

/// The kinds that an [`AnyProblem`] may hold, with their points.
pub trait OfAny: Judged<Point: OfAnyPoint, Gauge: 'static> {
    /// As a problem of any kind.
    fn into_any(self) -> AnyProblem;

    /// The verdict, with the statuses of any kind.
    fn any_verdict(verdict: VerdictOf<Self>) -> VerdictOf<AnyProblem>;
}

/// Points that an [`AnyPoint`] may hold.
pub trait OfAnyPoint: Sized + Into<AnyPoint> {
    /// As a point of any kind.
    fn into_any(self) -> AnyPoint;

    /// The point, if it is one of this type.
    fn of(any: &AnyPoint) -> Option<&Self>;

    /// As [`of`](Self::of), to be changed.
    fn of_mut(any: &mut AnyPoint) -> Option<&mut Self>;
}

macro_rules! point_of_any {
    ($($variant:ident, $point:ty;)*) => {$(
        impl OfAnyPoint for $point {
            fn into_any(self) -> AnyPoint {
                AnyPoint::$variant(self)
            }

            fn of(any: &AnyPoint) -> Option<&Self> {
                match any {
                    AnyPoint::$variant(point) => Some(point),
                    _ => None,
                }
            }

            fn of_mut(any: &mut AnyPoint) -> Option<&mut Self> {
                match any {
                    AnyPoint::$variant(point) => Some(point),
                    _ => None,
                }
            }
        }

        impl From<$point> for AnyPoint {
            fn from(point: $point) -> Self {
                AnyPoint::$variant(point)
            }
        }
    )*};
}

point_of_any! {
    Local, LocalPoint;
    Global, GlobalPoint;
    Lcp, LcpPoint;
    Hlcp, HlcpPoint;
}

macro_rules! of_any {
    ($($wing:ident::$variant:ident, $problem:ty, $status:ident, $counts:ident;)*) => {$(
        impl OfAny for $problem {
            fn into_any(self) -> AnyProblem {
                AnyProblem::$wing($wing::$variant(self))
            }

            fn any_verdict(verdict: VerdictOf<Self>) -> VerdictOf<AnyProblem> {
                let Verdict { measure, solved, counts, statuses, velocity, worst } = verdict;
                Verdict {
                    measure,
                    solved,
                    counts: AnyCounts::$counts(counts),
                    statuses: statuses.into_iter().map(AnyStatus::$status).collect(),
                    velocity,
                    worst,
                }
            }
        }

        impl From<$problem> for AnyProblem {
            fn from(problem: $problem) -> Self {
                problem.into_any()
            }
        }
    )*};
}

of_any! {
    Friction::Local2, FrictionLocal<2>, Contact, Contacts;
    Friction::Local3, FrictionLocal<3>, Contact, Contacts;
    Friction::Global2, FrictionGlobal<2>, Contact, Contacts;
    Friction::Global3, FrictionGlobal<3>, Contact, Contacts;
    Complementarity::Lcp, Lcp, Row, Rows;
    Complementarity::Mlcp, Mlcp, Row, Rows;
    Complementarity::Hlcp, Hlcp, Row, Rows;
    Complementarity::Box, BoxLcp, Row, Rows;
}

impl From<Friction> for AnyProblem {
    fn from(problem: Friction) -> Self {
        AnyProblem::Friction(problem)
    }
}

impl From<Complementarity> for AnyProblem {
    fn from(problem: Complementarity) -> Self {
        AnyProblem::Complementarity(problem)
    }
}

/// The point of the problem's kind.
///
/// # Panics
///
/// Where it is another's: points are validated before they are used.
fn point<'a, P: OfAny>(_: &P, any: &'a AnyPoint) -> &'a P::Point {
    P::Point::of(any).expect("a validated point is of the problem's kind")
}

fn tidied<P: OfAny>(problem: &P, any: &mut AnyPoint, of: &mut AnyGauge, boldly: bool) -> bool {
    let point = P::Point::of_mut(any).expect("a validated point is of the problem's kind");
    problem.tidy(point, gauge(problem, of), boldly)
}

fn prepared<P: OfAny>(problem: &P) -> Result<AnyGauge, ProblemError> {
    Ok(AnyGauge(Box::new(problem.gauge()?)))
}

fn validated<P: OfAny>(problem: &P, any: &AnyPoint) -> Result<(), ProblemError> {
    let refused = || ProblemError::shape("point", problem.kind().name(), "that of another kind");
    problem.validate_point(P::Point::of(any).ok_or_else(refused)?)
}

fn gauge<'a, P: OfAny>(_: &P, any: &'a mut AnyGauge) -> &'a mut P::Gauge {
    any.0.downcast_mut().expect("a gauge is of the problem that made it")
}

impl Problem for AnyProblem {
    type Point = AnyPoint;
    type Gauge = AnyGauge;

    fn kind(&self) -> Kind {
        with_problem!(self, p => p.kind())
    }

    fn unknowns(&self) -> usize {
        with_problem!(self, p => p.unknowns())
    }

    fn origin(&self) -> AnyPoint {
        with_problem!(self, p => p.origin().into_any())
    }

    fn validate_point(&self, any: &AnyPoint) -> Result<(), ProblemError> {
        with_problem!(self, p => validated(p, any))
    }

    fn copy_point(from: &AnyPoint, to: &mut AnyPoint) {
        to.clone_from(from);
    }

    fn gauge(&self) -> Result<AnyGauge, ProblemError> {
        with_problem!(self, p => prepared(p))
    }

    fn measure(&self, any: &AnyPoint, of: &mut AnyGauge) -> Measure {
        with_problem!(self, p => p.measure(point(p, any), gauge(p, of)))
    }

    fn certify(&self, any: &AnyPoint, of: &mut AnyGauge) -> Measure {
        with_problem!(self, p => p.certify(point(p, any), gauge(p, of)))
    }

    fn tidy(&self, any: &mut AnyPoint, of: &mut AnyGauge, boldly: bool) -> bool {
        with_problem!(self, p => tidied(p, any, of, boldly))
    }

    fn partner(&self, any: &AnyPoint) -> Vec<f64> {
        with_problem!(self, p => p.partner(point(p, any)))
    }

    fn evidence(&self, certificate: &Certificate) -> Evidence {
        with_problem!(self, p => p.evidence(certificate))
    }

    fn cones(&self) -> Option<ConeSystem> {
        with_problem!(self, p => p.cones())
    }

    fn assembled(&self, unknowns: &[f64]) -> AnyPoint {
        with_problem!(self, p => p.assembled(unknowns).into_any())
    }
}

impl Judged for AnyProblem {
    type Status = AnyStatus;
    type Counts = AnyCounts;

    fn verdict(&self, any: &AnyPoint, of: &mut AnyGauge, tolerance: f64) -> VerdictOf<Self> {
        with_problem!(self, p => any_of(p, p.verdict(point(p, any), gauge(p, of), tolerance)))
    }
}

fn any_of<P: OfAny>(_: &P, verdict: VerdictOf<P>) -> VerdictOf<AnyProblem> {
    P::any_verdict(verdict)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::planted::{Planted, PlantedLcp};

    /// A problem that has forgotten its kind says the same as the problem itself.
    #[test]
    fn a_problem_of_any_kind_judges_like_itself() {
        fn check<P: OfAny + Clone>(problem: &P, known: &P::Point)
        where
            P::Point: Clone,
        {
            let any = problem.clone().into_any();
            let point = known.clone().into_any();
            assert_eq!((any.kind(), any.unknowns()), (problem.kind(), problem.unknowns()));
            let (own, verdict) =
                (problem.judge(known, 1e-8).unwrap(), any.judge(&point, 1e-8).unwrap());
            assert!(own.solved && verdict.solved);
            assert_eq!(own.measure.relative.to_bits(), verdict.measure.relative.to_bits());
            assert_eq!(own.velocity, verdict.velocity);
            assert_eq!(own.statuses.len(), verdict.statuses.len());
            assert!(any.judge(&any.origin(), 1e-8).is_ok());
        }
        let planted = Planted { contacts: 4, dofs: 24, ..Planted::default() };
        let (local, point) = planted.local::<3>();
        check(&local, &point);
        let (global, point) = planted.global::<2>();
        check(&global, &point);
        let (lcp, point) = PlantedLcp::default().lcp();
        check(&lcp, &point);
        let another = AnyPoint::Lcp(LcpPoint { z: vec![0.0; 12] });
        let said = AnyProblem::from(local).judge(&another, 1e-8).unwrap_err().to_string();
        assert!(said.contains("that of another kind"), "{said}");
    }
}
