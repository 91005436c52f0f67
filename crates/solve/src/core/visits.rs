//! The judge's visits during a solve: how closely a point is looked at, the best point so far, and the history.

use std::time::Instant;

use nonsmooth_linalg::{budget, factorisations};
use nonsmooth_problem::Problem;
use nonsmooth_problem::check::Measure;

use crate::core::meter::Meter;
use crate::core::session::{Progress, Sample};

/// The factor from a solver's own estimate to the judge's residual, learned at each judgement: the two are proportional, near enough.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Calibration(f64);

impl Calibration {
    /// Nothing learned yet.
    pub(crate) fn new() -> Self {
        Self(1.0)
    }

    /// Learns from a judgement at an estimate; NaN teaches nothing.
    pub(crate) fn learn(&mut self, residual: f64, estimate: f64) {
        let ratio = residual / estimate;
        self.0 = if ratio.is_finite() && ratio > 0.0 { ratio } else { 1.0 };
    }

    /// Whether an estimate promises that the judge will be content.
    pub(crate) fn promises(self, estimate: f64, tolerance: f64) -> bool {
        self.0 * estimate <= tolerance
    }
}

/// The judge's visits during a solve, thinned evenly where there are very many.
#[derive(Debug)]
pub(crate) struct History {
    samples: Vec<Sample>,
    /// Every `stride`-th visit is kept.
    stride: usize,
    visits: usize,
}

impl History {
    /// The most samples that are kept.
    const MOST: usize = 4096;

    /// An empty one, with room for all that it may keep.
    pub(crate) fn new() -> Self {
        Self { samples: Vec::with_capacity(Self::MOST), stride: 1, visits: 0 }
    }

    pub(crate) fn clear(&mut self) {
        self.samples.clear();
        (self.stride, self.visits) = (1, 0);
    }

    /// Notes a visit; one that is `worth_it` is kept whatever the stride.
    pub(crate) fn note(&mut self, sample: Sample, worth_it: bool) {
        if self.samples.len() == Self::MOST {
            let mut k = 0;
            self.samples.retain(|_| {
                k += 1;
                k % 2 == 1
            });
            self.stride = self.stride.saturating_mul(2);
        }
        if worth_it || self.visits.is_multiple_of(self.stride) {
            self.samples.push(sample);
        }
        self.visits += 1;
    }

    pub(crate) fn samples(&self) -> &[Sample] {
        &self.samples
    }
}

/// The most steps between two looks at a point of which a single contact is not done: a look costs several steps.
const MOST_WAIT: usize = 16;

/// The certified residuals of the point last measured, or those of the same with its variables exactly on their bounds, then in `tidied`, where they are better; which.
pub(crate) fn closely<P: Problem>(
    problem: &P,
    point: &P::Point,
    gauge: &mut P::Gauge,
    tidied: &mut P::Point,
    tolerance: f64,
) -> (Measure, bool) {
    let mut plain = None;
    for boldly in [true, false] {
        P::copy_point(point, tidied);
        if !problem.tidy(tidied, gauge, boldly) {
            continue;
        }
        let measure = problem.certify(tidied, gauge);
        let plain = plain.insert(problem.certify(point, gauge));
        if measure.passes(tolerance) || measure.is_better_than(plain) {
            return (measure, true);
        }
    }
    (plain.unwrap_or_else(|| problem.certify(point, gauge)), false)
}

/// The certified residuals of a start of which nothing has come; where they are not finite, those of the origin, which then takes its place.
pub(crate) fn fallen_back<P: Problem>(
    problem: &P,
    point: &mut P::Point,
    gauge: &mut P::Gauge,
) -> Measure {
    let start = problem.certify(point, gauge);
    if start.merit().is_finite() {
        return start;
    }
    let mut origin = problem.origin();
    let _ = problem.measure(&origin, gauge);
    problem.follow_impulses(&mut origin, gauge);
    let measure = problem.certify(&origin, gauge);
    if !measure.is_better_than(&start) {
        return start;
    }
    *point = origin;
    measure
}

/// The start is one of the points that an unsolved problem's solve may return: where its residuals, certified if `closely` or where it looks solved at the tolerance, are smaller than those of `point`, it takes its place. Cost: one
/// judgement, of a global problem one more. Allocates nothing.
pub(crate) fn or_start<P: Problem>(
    problem: &P,
    start: &mut P::Point,
    point: &mut P::Point,
    gauge: &mut P::Gauge,
    measure: Measure,
    how: (f64, bool),
) -> Measure {
    if *start == *point {
        return measure;
    }
    let first = of_start(problem, start, gauge, how);
    if !first.is_better_than(&measure) {
        return measure;
    }
    P::copy_point(start, point);
    first
}

/// The residuals of a start, which is given by its impulses alone; certified if `closely`, or where it looks solved at the tolerance: nobody may look at it again.
pub(super) fn of_start<P: Problem>(
    problem: &P,
    start: &mut P::Point,
    gauge: &mut P::Gauge,
    (tolerance, closely): (f64, bool),
) -> Measure {
    let plain = problem.measure(start, gauge);
    let plain = match problem.follow_impulses(start, gauge) && !closely {
        true => problem.measure(start, gauge),
        false => plain,
    };
    if closely || plain.passes(tolerance) { problem.certify(start, gauge) } else { plain }
}

/// A solve that has not halved its merit in so many steps is asked whether it is at the floor; a factorisation counts as three steps more.
pub(super) const IDLE: u64 = 1200;

/// Since when a solve gets no further.
#[derive(Debug, Clone, Copy)]
struct Halved {
    merit: f64,
    iteration: usize,
    factorisations: u64,
    /// The work without a halving after which the floor is looked at.
    patience: u64,
}

impl Halved {
    fn now(merit: f64, iteration: usize) -> Self {
        Self { merit, iteration, factorisations: factorisations(), patience: IDLE }
    }
}

/// How a point is looked at.
#[derive(Clone, Copy, PartialEq)]
pub(super) enum Look {
    /// To steer by, and if it looks solved again to decide by.
    Plainly,
    /// To decide by at once: the solver's estimate promises a solution.
    Promised,
    /// In doubled precision even if it seems no solution: a solver's last word.
    Closely,
}

/// What a look found beside the residuals.
#[derive(Default)]
struct Seen {
    /// The residuals to decide by, where they were needed.
    certified: Option<Measure>,
    /// They are those of the point in `tidied`.
    tidied: bool,
    /// The residual to steer by: what a bound adds to it is no part of how it falls.
    steered: Option<f64>,
}

/// The judge's visits, the best point among them, and the history.
pub(super) struct Judge<'a, P: Problem> {
    pub(super) gauge: &'a mut P::Gauge,
    /// The start, as long as no point has finite residuals.
    pub(super) best: &'a mut P::Point,
    /// The point last certified with its variables exactly on their bounds.
    pub(super) tidied: &'a mut P::Point,
    history: &'a mut History,
    pub(super) meter: Meter,
    /// When the last visit ended.
    pub(super) seen: Instant,
    /// Whether the latest point counts as the best.
    latest: bool,
    pub(super) last: Measure,
    pub(super) best_measure: Measure,
    /// The best point's residuals in doubled precision, where they were needed.
    pub(super) certified: Option<Measure>,
    /// When the best merit was last halved.
    halved: Halved,
    /// The own residual of the contact for which a point was last refused, the step from which it is asked again, and the last wait.
    own: Option<f64>,
    own_again: usize,
    own_wait: usize,
    pub(super) calibration: Calibration,
    /// No promise has been broken yet: a broken one costs a look in vain.
    trusting: bool,
}

impl<'a, P: Problem> Judge<'a, P> {
    pub(super) fn new(
        gauge: &'a mut P::Gauge,
        best: &'a mut P::Point,
        tidied: &'a mut P::Point,
        history: &'a mut History,
        meter: Meter,
        latest: bool,
    ) -> Self {
        let nothing = Measure::unknown();
        Self {
            gauge,
            best,
            tidied,
            history,
            meter,
            seen: meter.wall,
            latest,
            last: nothing,
            best_measure: nothing,
            certified: None,
            halved: Halved::now(f64::INFINITY, 0),
            own: None,
            own_again: 0,
            own_wait: 0,
            calibration: Calibration::new(),
            trusting: true,
        }
    }

    /// Whether the point is now the best.
    pub(super) fn judge(
        &mut self,
        problem: &P,
        point: &P::Point,
        iteration: usize,
        tolerance: f64,
        look: Look,
    ) -> bool {
        let promised = look == Look::Promised && self.trusting;
        let accepted = promised.then(|| problem.accept(point, self.gauge, tolerance)).flatten();
        self.trusting &= !promised || accepted.is_some();
        let seen = match accepted {
            Some((bounds, steered)) => {
                self.last = bounds;
                Seen { certified: Some(bounds), tidied: false, steered: Some(steered) }
            }
            None => self.look(problem, point, iteration, tolerance, look),
        };
        // What passes counts as the best, though its merit may be that of a point with a contact that is not done.
        let mut better = self.last.merit().is_finite()
            && (self.latest && !(budget::over() && self.last.merit() >= f64::MAX)
                || self.last.is_better_than(&self.best_measure)
                || self.last.passes(tolerance));
        // Residuals may be finite where an impulse that nothing feels is not.
        if better && problem.validate_point(point).is_err() {
            (self.last, better) = (Measure::unknown(), false);
        }
        if better {
            self.best_measure = self.last;
            self.certified = seen.certified;
            P::copy_point(if seen.tidied { self.tidied } else { point }, self.best);
        }
        let merit = self.last.merit();
        let relative = seen.steered.unwrap_or(merit);
        self.seen = Instant::now();
        let seconds = self.meter.seconds_at(self.seen);
        let sample = Sample { iteration, seconds, relative };
        self.history.note(sample, merit <= self.best_measure.merit());
        better
    }

    /// The residuals of the point, in `last`: to steer by, and to decide by where it looks solved or is a last word.
    fn look(
        &mut self,
        problem: &P,
        point: &P::Point,
        iteration: usize,
        tolerance: f64,
        look: Look,
    ) -> Seen {
        self.last = problem.measure(point, self.gauge);
        let mut seen = Seen::default();
        if !self.last.passes(tolerance) {
            // What is zero but for rounding may hide how good the rest is.
            P::copy_point(point, self.tidied);
            if problem.tidy(self.tidied, self.gauge, true) {
                let measure = problem.measure(self.tidied, self.gauge);
                if measure.is_better_than(&self.last) {
                    (self.last, seen.tidied) = (measure, true);
                }
                if measure.passes(tolerance) {
                    // Back to the point that is to be tidied for good.
                    let _ = problem.measure(point, self.gauge);
                }
            }
        }
        if let (Some(own), true) = (self.own, iteration < self.own_again) {
            // Refused a moment ago for a single contact: as yet as good as then.
            self.last.own = Some(own);
        } else if look == Look::Closely || self.last.passes(tolerance) {
            // What looks solved is looked at again, in doubled precision.
            match problem.accept(point, self.gauge, tolerance) {
                Some((bounds, steered)) => (self.last, seen.steered) = (bounds, Some(steered)),
                None => (self.last, seen.tidied) = self.certify(problem, point, tolerance),
            }
            seen.certified = Some(self.last);
            if self.last.fails_own_only(tolerance) {
                self.own = self.last.own;
                self.own_wait = (2 * self.own_wait).clamp(1, MOST_WAIT);
                self.own_again = iteration + self.own_wait;
            }
        }
        seen
    }

    /// [`closely`] of the point last measured.
    pub(super) fn certify(
        &mut self,
        problem: &P,
        point: &P::Point,
        tolerance: f64,
    ) -> (Measure, bool) {
        closely(problem, point, self.gauge, self.tidied, tolerance)
    }

    /// The work since the best merit was last halved, where it is time to look at the floor.
    pub(super) fn idle(&mut self, iteration: usize) -> Option<u64> {
        let merit = self.best_measure.merit();
        if merit <= 0.5 * self.halved.merit {
            self.halved = Halved::now(merit, iteration);
            return None;
        }
        let Halved { iteration: since, factorisations: before, patience, .. } = self.halved;
        let work = (iteration - since) as u64 + 3 * (factorisations() - before);
        if work < patience {
            return None;
        }
        self.halved.patience *= 2;
        Some(work)
    }

    /// The best point's residuals in doubled precision.
    pub(super) fn certify_best(&mut self, problem: &P) -> Measure {
        let measure = *self.certified.get_or_insert_with(|| problem.certify(self.best, self.gauge));
        self.best_measure = measure;
        measure
    }

    pub(super) fn progress(&self, iteration: usize) -> Progress {
        let last = self.history.samples().last().copied();
        // The clock is looked at once for a step.
        let seconds = match last {
            Some(sample) if sample.iteration == iteration => sample.seconds,
            _ => self.meter.seconds(),
        };
        let judged = last.unwrap_or(Sample { iteration, seconds, relative: f64::NAN });
        Progress { judged, best: self.best_measure.merit(), iteration, seconds }
    }
}
