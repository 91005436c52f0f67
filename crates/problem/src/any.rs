//! A problem whose kind is known only when a file is read, and its point.
//!
//! [`Friction`] and [`Complementarity`] hold the kinds of their wings; a problem of any kind is one of theirs. It is a [`Problem`] itself, with its judge.

use crate::check::{
    Certificate, ConeSystem, ContactStatus, Evidence, Judged, Measure, RowCounts, RowStatus,
    SetCounts, SetStatus, StatusCounts, Verdict, VerdictOf,
};
use crate::{
    Complementarity, Friction, GlobalPoint, HlcpPoint, Kind, LcpPoint, LocalPoint, Problem,
    ProblemError, Stated, with_complementarity, with_problem,
};

/// A problem of any kind.
// One a file: its size does not matter.
#[allow(clippy::large_enum_variant)]
#[derive(Debug, Clone, PartialEq)]
pub enum AnyProblem {
    /// Contacts.
    Friction(Friction),
    /// Complementarity, and variational inequalities.
    Complementarity(Complementarity),
}

/// A point of a problem of any kind.
#[derive(Debug, Clone, PartialEq)]
pub enum AnyPoint {
    /// Of a [`FrictionLocal`](crate::FrictionLocal).
    Local(LocalPoint),
    /// Of a [`FrictionGlobal`](crate::FrictionGlobal).
    Global(GlobalPoint),
    /// Of a problem in z.
    Lcp(LcpPoint),
    /// Of a horizontal problem.
    Hlcp(HlcpPoint),
}

/// The judge's constants and buffers for a problem of any kind.
pub struct AnyGauge(Box<dyn std::any::Any + Send>);

/// What a contact or a row does, or where a point is with respect to a constraint.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum AnyStatus {
    /// Of a contact: open, sticking or slipping.
    Contact(ContactStatus),
    /// Of a row: at which of its bounds, between them, or an equality.
    Row(RowStatus),
    /// Of a constraint of a set: within it or at its border.
    Set(SetStatus),
}

/// How many contacts, rows or constraints do what.
#[derive(Debug, Clone, Copy, PartialEq, serde::Serialize)]
#[serde(untagged)]
pub enum AnyCounts {
    /// Of a problem of frictional contact.
    Contacts(StatusCounts),
    /// Of a complementarity problem.
    Rows(RowCounts),
    /// Of a variational inequality: the constraints of its set.
    Sets(SetCounts),
}

impl Default for AnyCounts {
    fn default() -> Self {
        Self::Contacts(StatusCounts::default())
    }
}

/// The kinds that an [`AnyProblem`] may hold: what becomes one, with point, status and counts. The list of kinds says which they are.
pub trait OfAny:
    Judged<Point: OfAnyPoint, Gauge: 'static, Status: Into<AnyStatus>, Counts: Into<AnyCounts>>
    + Into<AnyProblem>
{
    /// Which kind it is.
    const KIND: Kind;
}

/// Points that an [`AnyPoint`] may hold.
pub trait OfAnyPoint: Sized + Into<AnyPoint> + 'static {
    /// The point, if it is one of this type.
    fn of(any: &AnyPoint) -> Option<&Self>;

    /// As [`of`](Self::of), to be changed.
    fn of_mut(any: &mut AnyPoint) -> Option<&mut Self>;
}

macro_rules! point_of_any {
    ($($variant:ident, $point:ty;)*) => {$(
        impl OfAnyPoint for $point {
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

macro_rules! any_from {
    ($($from:ty => $any:ident, |$x:ident| $made:expr;)*) => {$(
        impl From<$from> for $any {
            fn from($x: $from) -> Self {
                $made
            }
        }
    )*};
}

any_from! {
    ContactStatus => AnyStatus, |status| Self::Contact(status);
    RowStatus => AnyStatus, |status| Self::Row(status);
    SetStatus => AnyStatus, |status| Self::Set(status);
    StatusCounts => AnyCounts, |counts| Self::Contacts(counts);
    RowCounts => AnyCounts, |counts| Self::Rows(counts);
    SetCounts => AnyCounts, |counts| Self::Sets(counts);
}

/// The verdict with statuses and counts of any kind.
pub fn any_verdict<P: OfAny>(verdict: VerdictOf<P>) -> VerdictOf<AnyProblem> {
    let Verdict { measure, solved, counts, statuses, velocity, worst } = verdict;
    let statuses = statuses.into_iter().map(Into::into).collect();
    Verdict { measure, solved, counts: counts.into(), statuses, velocity, worst }
}

impl AnyProblem {
    /// The parts of a valid point by the names that files have for them, with [`Problem::partner`] among them: r, u and l of contacts (v first, of a global
    /// problem), z and w of pairs. None where the point is another kind's.
    pub fn point_parts<'a>(
        &self,
        point: &'a AnyPoint,
        partner: &'a [f64],
    ) -> Vec<(&'static str, &'a [f64])> {
        match (point, self) {
            (AnyPoint::Local(LocalPoint { r, lambda }), Self::Friction(_)) => {
                vec![("r", r), ("u", partner), ("l", lambda)]
            }
            (AnyPoint::Global(GlobalPoint { v, r, lambda }), Self::Friction(_)) => {
                vec![("v", v), ("r", r), ("u", partner), ("l", lambda)]
            }
            (point, Self::Complementarity(stated)) => {
                with_complementarity!(stated, p => p.parts_of(point, Some(partner)))
            }
            (_, Self::Friction(_)) => vec![],
        }
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

    fn asks_functions(&self) -> bool {
        with_problem!(self, p => p.asks_functions())
    }

    fn origin(&self) -> AnyPoint {
        with_problem!(self, p => p.origin().into())
    }

    fn validate(&self) -> Result<(), ProblemError> {
        with_problem!(self, p => Problem::validate(p))
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
        with_problem!(self, p => p.assembled(unknowns).into())
    }
}

impl Judged for AnyProblem {
    type Status = AnyStatus;
    type Counts = AnyCounts;

    fn verdict(&self, any: &AnyPoint, of: &mut AnyGauge, tolerance: f64) -> VerdictOf<Self> {
        fn judged<P: OfAny>(
            problem: &P,
            any: &AnyPoint,
            of: &mut AnyGauge,
            tolerance: f64,
        ) -> VerdictOf<AnyProblem> {
            any_verdict::<P>(problem.verdict(point(problem, any), gauge(problem, of), tolerance))
        }
        with_problem!(self, p => judged(p, any, of, tolerance))
    }
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
            let any: AnyProblem = problem.clone().into();
            let point: AnyPoint = known.clone().into();
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
