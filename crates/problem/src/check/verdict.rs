//! The full verdict on a point: residuals, the status of each contact, the worst contacts.

use std::fmt;

use serde::Serialize;

use super::contact::Law;
use super::local::LawGauge;
use super::{ContactStatus, Measure, Motion, over};
use crate::{FrictionGlobal, FrictionLocal, GlobalPoint, LocalPoint, Problem, ProblemError};
use nonsmooth_linalg::small;

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
    /// The relative velocity u recomputed from the impulses, D·nc; of a linear complementarity problem `w = M z + q`.
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

impl<const D: usize> Judged for FrictionLocal<D> {
    type Status = ContactStatus;
    type Counts = StatusCounts;

    fn verdict(&self, point: &LocalPoint, gauge: &mut Self::Gauge, tolerance: f64) -> Verdict {
        let measure = self.certify(point, gauge);
        verdict::<_, D>(measure, &gauge.law, &point.r, gauge.velocity(), |c| self.law(c), tolerance)
    }
}

impl<const D: usize> Judged for FrictionGlobal<D> {
    type Status = ContactStatus;
    type Counts = StatusCounts;

    fn verdict(&self, point: &GlobalPoint, gauge: &mut Self::Gauge, tolerance: f64) -> Verdict {
        let measure = self.certify(point, gauge);
        verdict::<_, D>(measure, &gauge.law, &point.r, gauge.velocity(), |c| self.law(c), tolerance)
    }
}

fn verdict<L: Law<D>, const D: usize>(
    measure: Measure,
    gauge: &LawGauge,
    r: &[f64],
    u: &[f64],
    law: impl Fn(usize) -> L,
    tolerance: f64,
) -> Verdict {
    let margin = if gauge.norm_q > 0.0 { tolerance * gauge.norm_q } else { tolerance };
    let mut counts = StatusCounts::default();
    let mut statuses = Vec::with_capacity(gauge.w.len());
    let mut worst = Vec::with_capacity(gauge.w.len());
    for (c, &w) in gauge.w.iter().enumerate() {
        let law = law(c);
        let x = small::block::<D>(r, c).map(|v| w * v);
        let modified = law.modified_velocity(&small::block(u, c));
        let s = law.status(&x, &modified, margin);
        match s.status {
            Motion::Open => counts.open += 1,
            Motion::Stick => counts.stick += 1,
            Motion::Slip => counts.slip += 1,
        }
        counts.at_limit += usize::from(s.at_limit);
        counts.degenerate += usize::from(s.degenerate);
        statuses.push(s);
        let share = law.natural_map(&x, &modified).iter().map(|v| v * v).sum::<f64>().sqrt();
        worst.push((c, over(share, gauge.norm_q)));
    }
    worst.sort_by(|a, b| b.1.total_cmp(&a.1));
    worst.truncate(10);
    Verdict {
        measure,
        solved: measure.passes(tolerance),
        counts,
        statuses,
        velocity: u.to_vec(),
        worst,
    }
}
