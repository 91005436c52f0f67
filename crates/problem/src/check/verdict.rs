//! The full verdict on a point: residuals, the status of each contact, the worst contacts.

use std::fmt;

use serde::Serialize;

use super::{ContactStatus, Measure};
use crate::{Problem, ProblemError};

/// Everything that the judge says of a point.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Verdict<Status = ContactStatus, Counts = StatusCounts> {
    /// The residuals, each with its unit, recomputed from the data.
    pub measure: Measure,
    /// Whether they pass at the tolerance asked for.
    pub solved: bool,
    /// How many contacts, or rows, do what.
    pub counts: Counts,
    /// The status of each contact, or row.
    #[serde(skip)]
    pub statuses: Vec<Status>,
    /// The relative velocity u recomputed from the impulses, D·nc; of a complementarity problem `w = M z + q`, or F(x).
    #[serde(skip)]
    pub velocity: Vec<f64>,
    /// The contacts with the largest residuals over `‖q‖`, or the rows with the largest errors, worst first, at most ten.
    pub worst: Vec<(usize, f64)>,
}

/// How many contacts are open, stick and slip (they add up), and how many of those are at a limit.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq, Serialize)]
pub struct StatusCounts {
    /// Contacts without impulse.
    pub open: usize,
    /// Contacts at rest.
    pub stick: usize,
    /// Sliding contacts.
    pub slip: usize,
    /// Contacts, counted among those that stick, whose impulse is at the limit of friction.
    pub at_limit: usize,
    /// Contacts, counted above as well, whose margin to another status is below the tolerance.
    pub degenerate: usize,
    /// Contacts, counted above as well, that roll against rolling friction.
    #[serde(skip_serializing_if = "is_zero")]
    pub rolling: usize,
}

fn is_zero(count: &usize) -> bool {
    *count == 0
}

/// The verdict on a point of a problem P.
pub type VerdictOf<P> = Verdict<<P as Judged>::Status, <P as Judged>::Counts>;

/// A problem whose judge can say what each contact, or row, does.
pub trait Judged: Problem {
    /// What a contact, or a row, may do.
    type Status: fmt::Debug + Clone + Send + 'static;
    /// How many do what.
    type Counts: fmt::Debug + Clone + Default + Serialize + Send + 'static;

    /// The full verdict on a valid `point` at `tolerance`, with a gauge of this problem, which is prepared once for all points: of a global problem, M
    /// factorised. Allocates; the loop uses [`Problem::measure`].
    fn verdict(
        &self,
        point: &Self::Point,
        gauge: &mut Self::Gauge,
        tolerance: f64,
    ) -> VerdictOf<Self>;

    /// The full verdict on `point` at `tolerance`.
    ///
    /// Errors: a point of the wrong shape or with entries that are not finite, a singular M.
    fn judge(&self, point: &Self::Point, tolerance: f64) -> Result<VerdictOf<Self>, ProblemError> {
        self.validate_point(point)?;
        Ok(self.verdict(point, &mut self.gauge()?, tolerance))
    }
}
