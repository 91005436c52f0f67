//! The stages between the sweeps and the proximal steps, each of which ends many problems and makes a start for the others; and alternating directions, for
//! those that the proximal steps take long for.

use nonsmooth_problem::check::Kinematic;

use super::alternating::Way;
use super::{Auto, FIRST, FIRST_SWEEPS, HybridWork, NEAR, NEWTON, Stage};
use crate::Step;
use crate::contact::form::{Disked, Linearised, OnContacts};

/// Rest is sought where contacts without impulse open no faster than this part of ‖q‖ after the sweeps (at rest at most 2e-3, in motion 1e-2 and more); it is
/// given up where its first iteration leaves more than this (at rest at most 5e-2, else .2 and more), and is not judged by its rate before so many.
const OPENING: f64 = 5e-3;
const REST_NEAR: f64 = 0.1;
const REST_FIRST: usize = 6;
/// Newton's method is tried below this error (most of its successes begin below 6e-3), with this ε, until so many iterations in a row have not halved the error.
const TRIAL_BELOW: f64 = 1e-2;
const TRIAL_EPSILON: f64 = 1e-9;
const TRIAL_IDLE: usize = 2;
const TRIAL: usize = 30;
/// After a trial in vain near a solution sweeps go on where they promised for as long as this, and at most while so many factorisations take.
const SWEPT_LONG: usize = 10 * FIRST_SWEEPS;
const SWEEP_AGAIN: f64 = 3.0;
/// The interior point ends after this many iterations, or below this error, or after so many iterations that did not halve the
/// error, or so many short steps in a row.
const INTERIOR: usize = 60;
/// Where Newton's iterations promise to take longer than this, the interior point is worth a trial.
const INTERIOR_COST: f64 = 20.0;
const INTERIOR_ERROR: f64 = 1e-8;
const INTERIOR_IDLE: usize = 10;
const INTERIOR_SHORT: (f64, usize) = (1e-6, 6);
/// Alternating directions are tried after so many Newton iterations, and, from the other start, again after so many.
const ALTERNATE_AFTER: [usize; 2] = [40, 160];
/// They start from the present impulses below this error, else from none: once, and once the other way.
const ALTERNATE_NEAR: f64 = 1e-2;
/// They have this many iterations at least, and promise more as long as what is left costs less than this many factorisations.
const ALTERNATE_FIRST: usize = 40;
const ALTERNATE_WORTH: f64 = 200.0;

impl<const D: usize> OnContacts<Auto, D> {
    /// Whichever of stages 2 to 4 comes first; `error` is that of the point.
    pub(super) fn begin_starts<P: Linearised<D> + Disked<D> + Kinematic<D>>(
        &self,
        problem: &P,
        point: &mut P::Point,
        work: &mut HybridWork<P, D>,
        error: f64,
    ) {
        if work.rest_sought {
            return self.begin_trial(problem, point, work, error);
        }
        work.rest_sought = true;
        let HybridWork { alternating, state, stage, newton, .. } = work;
        let quiet = newton.as_ref().is_some_and(|n| n.opening(P::impulses(point)) < OPENING);
        if quiet
            && alternating.get_or_insert_default().begin(problem, state, Way::Rest, None).is_ok()
        {
            work.rate.begin();
            *stage = Stage::Rest;
        } else {
            self.without_rest(problem, point, work, error);
        }
    }

    /// Stage 2: one iteration of the search for rest.
    pub(super) fn rest<P: Linearised<D> + Disked<D> + Kinematic<D>>(
        &self,
        problem: &P,
        point: &mut P::Point,
        work: &mut HybridWork<P, D>,
    ) -> Step {
        work.done.rest += 1;
        let (estimate, steps) = match self.alternated(problem, point, work) {
            Some(iterate) => iterate,
            None => return lost(),
        };
        let young = estimate < REST_NEAR && steps < REST_FIRST;
        if !young && !self.promises(problem, work, NEWTON) || estimate.is_nan() {
            let error = self.end_alternating(problem, point, work);
            self.without_rest(problem, point, work, error);
        }
        Step::Continue { estimate }
    }

    /// Back to the sweeps where they were left for stage 2 before they had time, else on to stage 3.
    fn without_rest<P: Linearised<D> + Disked<D> + Kinematic<D>>(
        &self,
        problem: &P,
        point: &mut P::Point,
        work: &mut HybridWork<P, D>,
        error: f64,
    ) {
        let costs = *work.costs.get_or_insert_with(|| problem.costs(&mut work.state));
        if self.sweeps_are_cheap(work, costs) {
            problem.enter(&mut work.state, point);
            work.rate.begin();
            work.stage = FIRST;
        } else {
            self.begin_trial(problem, point, work, error);
        }
    }

    /// Begins stage 3 where the error is small, else stage 4.
    fn begin_trial<P: Linearised<D> + Disked<D> + Kinematic<D>>(
        &self,
        problem: &P,
        point: &mut P::Point,
        work: &mut HybridWork<P, D>,
        error: f64,
    ) {
        let HybridWork { newton, inner_best, controller, .. } = work;
        let (true, Some(newton)) = (error < TRIAL_BELOW, newton) else {
            return begin_interior(problem, work);
        };
        let r = P::impulses(point);
        newton.focus(r, error, work.tolerance);
        newton.center(r, TRIAL_EPSILON, controller.kappa());
        inner_best.copy_from_slice(r);
        work.stage = Stage::Trial { idle: 0, least: error };
    }

    /// Stage 3: one Newton iteration, nearly without a proximal term; at its end the best point goes on.
    pub(super) fn trial<P: Linearised<D> + Disked<D> + Kinematic<D>>(
        &self,
        problem: &P,
        point: &mut P::Point,
        work: &mut HybridWork<P, D>,
        idle: usize,
        least: f64,
    ) -> Step {
        let HybridWork { newton, state, controller, inner_best, done, .. } = work;
        let Some(newton) = newton else { return lost() };
        let r = P::impulses(point);
        let iterate = newton.iterate(problem, state, r);
        done.trial += 1;
        let error = newton.error(r);
        let idle = if error < 0.5 * least { 0 } else { idle + 1 };
        if error < least {
            inner_best.copy_from_slice(r);
        }
        let least = error.min(least);
        if iterate.step > 0.0 && idle < TRIAL_IDLE && done.trial < TRIAL {
            work.stage = Stage::Trial { idle, least };
        } else {
            r.copy_from_slice(inner_best);
            controller.offer(least);
            if least < NEAR {
                self.pass_by(problem, point, work);
            } else {
                begin_interior(problem, work);
            }
        }
        Step::Continue { estimate: error }
    }

    /// On to stage 5 without stage 4, for as long as that promises more; by way of stage 6 where the sweeps promised for long: an error that lay still may
    /// fall again once a few contacts have changed sides. As many sweeps as there were, and no dearer than a few factorisations.
    fn pass_by<P: Linearised<D> + Disked<D> + Kinematic<D>>(
        &self,
        problem: &P,
        point: &mut P::Point,
        work: &mut HybridWork<P, D>,
    ) {
        work.controller.resume();
        work.passed_by = Some((work.done.newton, work.controller.error()));
        if work.done.sweeps < SWEPT_LONG {
            return self.subproblem_here(problem, point, work);
        }
        let costs = *work.costs.get_or_insert_with(|| problem.costs(&mut work.state));
        let most = SWEEP_AGAIN * costs.factorisation / costs.sweep;
        work.before.copy_from_slice(P::impulses(point));
        problem.enter(&mut work.state, point);
        work.stage = Stage::Between { left: work.done.sweeps.min(most as usize).max(1) };
    }

    /// Whether stage 4 was passed by in vain: Newton's iterations since have been too slow for what is left from this error.
    pub(super) fn passed_by_in_vain<P: Linearised<D> + Disked<D> + Kinematic<D>>(
        &self,
        work: &HybridWork<P, D>,
        error: f64,
    ) -> bool {
        work.passed_by.is_some_and(|(before, from)| {
            let fall = (from / error).ln() / (work.done.newton - before) as f64;
            let left = (error / work.tolerance).ln();
            error > work.tolerance && (fall <= 0.0 || left / fall > INTERIOR_COST)
        })
    }

    /// Stage 4: one iteration of the interior point; at its end the better of its best iterate and the swept point goes on.
    pub(super) fn interior<P: Linearised<D> + Disked<D> + Kinematic<D>>(
        &self,
        problem: &P,
        point: &mut P::Point,
        work: &mut HybridWork<P, D>,
    ) -> Step {
        let HybridWork { central, state, stage, done, tolerance, controller, .. } = work;
        let (Some(central), Stage::Interior { idle, short, least }) = (central, stage) else {
            return lost();
        };
        let ended = match central.iterate(problem, state) {
            Err(_) => true,
            Ok(now) => {
                done.interior += 1;
                *idle += 1;
                if now.error < 0.5 * *least {
                    (*idle, *least) = (0, now.error);
                }
                *short = if now.alpha < INTERIOR_SHORT.0 { *short + 1 } else { 0 };
                now.error <= tolerance.max(INTERIOR_ERROR)
                    || *idle >= INTERIOR_IDLE
                    || *short >= INTERIOR_SHORT.1
                    || done.interior >= INTERIOR
            }
        };
        let (r, error) = central.best();
        done.interior_error = error;
        if ended {
            if controller.offer(error) {
                P::impulses(point).copy_from_slice(r);
            }
            self.subproblem_here(problem, point, work);
        }
        Step::Continue { estimate: error }
    }

    /// Whether stage 7 comes now.
    pub(super) fn alternation_is_due<P: Linearised<D> + Disked<D> + Kinematic<D>>(
        &self,
        work: &HybridWork<P, D>,
    ) -> bool {
        let after = ALTERNATE_AFTER.get(work.done.alternations);
        after.is_some_and(|&after| work.done.newton >= after)
    }

    /// Begins stage 7 from a point with this error, or from none.
    pub(super) fn begin_alternating<P: Linearised<D> + Disked<D> + Kinematic<D>>(
        &self,
        problem: &P,
        point: &mut P::Point,
        work: &mut HybridWork<P, D>,
        error: f64,
    ) -> Step {
        let HybridWork { alternating, state, done, rate, stage, from_here, .. } = work;
        *from_here = if done.alternations == 0 { error < ALTERNATE_NEAR } else { !*from_here };
        done.alternations += 1;
        let start = from_here.then_some(&*P::impulses(point));
        rate.begin();
        *stage = Stage::Alternating;
        let begun = alternating.get_or_insert_default().begin(problem, state, Way::General, start);
        if begun.is_err() {
            self.subproblem_here(problem, point, work);
        }
        Step::Continue { estimate: error }
    }

    /// Stage 7: one iteration of alternating directions.
    pub(super) fn alternate<P: Linearised<D> + Disked<D> + Kinematic<D>>(
        &self,
        problem: &P,
        point: &mut P::Point,
        work: &mut HybridWork<P, D>,
    ) -> Step {
        work.done.alternating += 1;
        let (estimate, steps) = match self.alternated(problem, point, work) {
            Some(iterate) => iterate,
            None => return lost(),
        };
        let young = steps < ALTERNATE_FIRST;
        if !young && !self.promises(problem, work, ALTERNATE_WORTH) || estimate.is_nan() {
            self.end_alternating(problem, point, work);
            self.subproblem_here(problem, point, work);
        }
        Step::Continue { estimate }
    }

    /// One iteration of alternating directions, and how many there were; its impulses become the point's where it claims the tolerance.
    fn alternated<P: Linearised<D> + Disked<D> + Kinematic<D>>(
        &self,
        problem: &P,
        point: &mut P::Point,
        work: &mut HybridWork<P, D>,
    ) -> Option<(f64, usize)> {
        let HybridWork { alternating, state, rate, tolerance, .. } = work;
        let alternating = alternating.as_mut()?;
        let estimate = alternating.iterate(problem, state);
        rate.note(estimate);
        if estimate <= *tolerance {
            P::impulses(point).copy_from_slice(alternating.impulses());
        }
        Some((estimate, alternating.steps()))
    }

    /// Whether further solves promise the tolerance for less than so many factorisations.
    fn promises<P: Linearised<D> + Disked<D> + Kinematic<D>>(
        &self,
        problem: &P,
        work: &mut HybridWork<P, D>,
        factorisations: f64,
    ) -> bool {
        let costs = *work.costs.get_or_insert_with(|| problem.costs(&mut work.state));
        let limit = factorisations * costs.factorisation;
        work.rate.promises(work.tolerance, costs.solve, limit)
    }

    /// The better of the impulses of alternating directions and the point's; returns its error.
    fn end_alternating<P: Linearised<D> + Disked<D> + Kinematic<D>>(
        &self,
        problem: &P,
        point: &mut P::Point,
        work: &mut HybridWork<P, D>,
    ) -> f64 {
        let HybridWork { alternating, state, newton, controller, .. } = work;
        let (Some(alternating), Some(newton)) = (alternating, newton) else {
            return f64::INFINITY;
        };
        let r = P::impulses(point);
        let theirs = newton.look(problem, state, alternating.impulses());
        let ours = newton.look(problem, state, r);
        if theirs >= ours || theirs.is_nan() {
            return ours;
        }
        controller.offer(theirs);
        r.copy_from_slice(alternating.impulses());
        newton.look(problem, state, r)
    }
}

/// A stage without its part, which cannot be.
fn lost() -> Step {
    Step::Stuck("auto has lost its place".into())
}

/// Begins stage 4.
pub(super) fn begin_interior<P: Linearised<D> + Disked<D>, const D: usize>(
    problem: &P,
    work: &mut HybridWork<P, D>,
) {
    work.passed_by = None;
    let HybridWork { central, state, stage, .. } = work;
    let now = central.get_or_insert_default().begin(problem, state, 0.0, None);
    *stage = Stage::Interior { idle: 0, short: 0, least: now.error };
}
