//! The stages between the sweeps and the proximal steps, each of which ends many problems and makes a start for the others; and alternating directions, for
//! those that the proximal steps take long for.

use nonsmooth_problem::check::{Kinematic, Law};

use super::controller::Controller;
use super::proximal_newton::ProximalNewton;
use super::relaxed::nearly_rests;
use super::{Auto, Done, FIRST, FIRST_SWEEPS, HybridWork, NEAR, RestSearch, Stage, swept};
use crate::Step;
use crate::contact::form::{Disked, Linearised, OnContacts};
use crate::contact::law::DiskLaw;
use crate::contact::parts::{Central, REST, Way};

/// Rest is sought at once where contacts without impulse open no faster than this part of ‖q‖ after the sweeps (at rest at most 2e-3, in motion 1e-2 and more); or, where W has not
/// spread, no faster than this part of the error: the weight of what stands above has yet to come down to them (in walls with head joints at rest .1 to .6, in motion mostly above 1; polyhedra in a box
/// .4 to .5, in vain), and up to the last figure once the sweeps have cost a factorisation.
const OPENING: f64 = 5e-3;
const FALLING_AT_ONCE: f64 = 0.35;
const FALLING: f64 = 0.6;
/// At a glance where there are so many contacts and a sweep still moves so much of ‖q‖: others are nearly at the end of their sweeps.
const GLANCE_CONTACTS: usize = 10;
const GLANCE_ABOVE: f64 = 1e-2;
/// It is given up where an iteration has claimed so much less than the tolerance: its impulses have been judged, in vain.
const CLAIMED: f64 = 1e-2;
/// Newton's method is tried with this ε, until so many iterations in a row have not halved the error, or its first direction leads this far; where W has little spread, below this error.
const TRIAL_BELOW: f64 = 1e-2;
const TRIAL_EPSILON: f64 = 1e-9;
const TRIAL_IDLE: usize = 3;
const TRIAL_REACH: f64 = 20.0;
const TRIAL: usize = 30;
/// W has spread from here on: 0.17 to 0.3 in walls, columns and arches, 0.33 to 0.7 in piles and flows.
const SPREAD: f64 = 0.33;
/// Where it has, sweeps come to the trial's rescue so many times, so many at first, then twice as many each time, at most while four factorisations take; they are taken back where they raise the
/// error by more than a factor.
const RESCUES: usize = 3;
const RESCUE: usize = 20;
const RESCUE_COST: f64 = 4.0;
const RESCUE_TAKE_BACK: f64 = 5.0;
/// After a trial in vain near a solution sweeps go on where they promised for as long as this, and at most while so many factorisations take.
const SWEPT_LONG: usize = 10 * FIRST_SWEEPS;
const SWEEP_AGAIN: f64 = 3.0;
/// The interior point ends after this many iterations, or below this error, or after so many iterations that did not halve the
/// error, or so many short steps in a row; such steps know at least this part of the slope of ‖u_T‖. Before its first halving it has longer where W has not spread: in walls of thousands
/// of bodies it takes some 20 iterations to come into sight of the solution, and ten to reach it.
pub(super) const INTERIOR: usize = 60;
/// It begins at the point's impulses and their velocities, so far inside the cones, in units of the mean load a contact: nearer to the boundary its steps are cut short.
const INTERIOR_MARGIN: f64 = 0.7;
/// Where Newton's iterations promise to take longer than this, the interior point is worth a trial; not before so many, which is what one subproblem in vain takes.
const INTERIOR_COST: f64 = 20.0;
const IN_VAIN: usize = 12;
/// Nor is it passed by any longer where so many iterations in a row have raised the error by more than this factor.
const ASTRAY: (f64, usize) = (30.0, 3);
const INTERIOR_ERROR: f64 = 1e-8;
pub(super) const INTERIOR_IDLE: usize = 10;
const INTERIOR_FIRST: usize = 30;
const INTERIOR_SLOPE: f64 = 0.2;
const INTERIOR_SHORT: (f64, usize) = (1e-6, 6);
/// The central path is followed by its arc length after so many Newton iterations that promise to take so many more since the
/// interior point, with `δ = κθ`, where W has little spread: in piles and flows the path turns too often. It ends below the error
/// of the interior point, or after so many steps that did not halve its own. Another κ has another path, and which of them leads
/// to the end cannot be foreseen; where one came no nearer than this, the others are not tried.
const PURSUITS: [Chase; 3] = [
    Chase { after: 60, smoothing: 0.5, idle: 40 },
    Chase { after: 180, smoothing: 0.25, idle: 160 },
    Chase { after: 400, smoothing: 0.1, idle: 320 },
];
const PURSUE_COST: f64 = 60.0;
const PURSUE_AGAIN: f64 = 1e-3;

pub(super) struct Chase {
    after: usize,
    smoothing: f64,
    idle: usize,
}

/// Motion and impulses are sought in turn after so many Newton iterations that are still farther off than this and promise as many more as for stage 7.
const TURN_AFTER: usize = 100;
const TURN_ABOVE: f64 = 1e-3;

/// Alternating directions are tried after so many Newton iterations, and, from the other start, again after so many.
const ALTERNATE_AFTER: [usize; 2] = [40, 160];
/// They start from the present impulses below this error, else from none: once, and once the other way.
const ALTERNATE_NEAR: f64 = 1e-2;
/// They have this many iterations at least, and promise more as long as what is left costs less than this many factorisations.
const ALTERNATE_FIRST: usize = 40;
const ALTERNATE_WORTH: f64 = 200.0;
/// Where the relaxation says that little slides they come before Newton's iterations, from none, and are worth more: 200 end pyramids with bases of 6 and 7 spheres, 500 of 5 and 9 too.
const ALTERNATE_WORTH_AT_REST: f64 = 500.0;

impl<const D: usize> OnContacts<Auto, D> {
    /// Whichever of stages 2 to 4 comes first; `error` is that of the point.
    pub(super) fn begin_starts<P: Linearised<D> + Disked<D> + Kinematic<D>>(
        &self,
        problem: &P,
        point: &mut P::Point,
        work: &mut HybridWork<P, D>,
        error: f64,
    ) {
        if work.rest == RestSearch::Done {
            return self.begin_trial(problem, point, work, error);
        }
        let costs = work.costs(problem);
        let opening = self.opening(point, work);
        let quiet = opening < OPENING;
        let at_once = quiet || opening < FALLING_AT_ONCE * error && !has_spread(problem, work);
        if !at_once && work.rest == RestSearch::Open && self.sweeps_are_cheap(work, costs) {
            work.rest = RestSearch::PutOff;
            return self.without_rest(problem, point, work, error);
        }
        work.rest = RestSearch::Done;
        let falls = opening < FALLING * error;
        if !quiet && (!falls || has_spread(problem, work)) {
            return self.begin_trial(problem, point, work, error);
        }
        if !self.seek_rest(problem, work) {
            self.without_rest(problem, point, work, error);
        }
    }

    /// Begins stage 2 after a few sweeps, whose last one moved so much, where nothing flies apart.
    pub(super) fn rests_at_a_glance<P: Linearised<D> + Disked<D> + Kinematic<D>>(
        &self,
        problem: &P,
        point: &mut P::Point,
        work: &mut HybridWork<P, D>,
        moves: f64,
    ) -> bool {
        let ends_soon = problem.contacts() < GLANCE_CONTACTS || moves < GLANCE_ABOVE;
        if ends_soon || work.bounded || !self.0.interior {
            return false;
        }
        self.look_round(problem, point, work);
        if work.rest == RestSearch::Open && self.opening(point, work) < OPENING {
            work.rest = RestSearch::Done;
            return self.seek_rest(problem, work);
        }
        problem.enter(&mut work.state, point);
        false
    }

    /// How fast the contacts without impulse open, in units of ‖q‖.
    fn opening<P: Linearised<D> + Disked<D> + Kinematic<D>>(
        &self,
        point: &mut P::Point,
        work: &HybridWork<P, D>,
    ) -> f64 {
        work.newton.as_ref().map_or(f64::NAN, |newton| newton.opening(P::impulses(point)))
    }

    /// Begins stage 2 if the matrix can be factorised.
    fn seek_rest<P: Linearised<D> + Disked<D> + Kinematic<D>>(
        &self,
        problem: &P,
        work: &mut HybridWork<P, D>,
    ) -> bool {
        let HybridWork { alternating, state, stage, rate, .. } = work;
        let begun = alternating.get_or_insert_default().begin(problem, state, Way::Rest, None);
        if begun.is_ok() {
            rate.begin();
            *stage = Stage::Rest;
        }
        begun.is_ok()
    }

    /// Stage 2: one iteration of the search for rest.
    pub(super) fn rest<P: Linearised<D> + Disked<D> + Kinematic<D>>(
        &self,
        problem: &P,
        point: &mut P::Point,
        work: &mut HybridWork<P, D>,
    ) -> Step {
        // It has claimed the tolerance, and the judge did not agree.
        if work.rate.left(CLAIMED * work.tolerance) < 0.0 {
            let error = self.end_alternating(problem, point, work);
            self.without_rest(problem, point, work, error);
            return Step::Continue { estimate: error };
        }
        work.done.rest += 1;
        let Some((estimate, _)) = self.alternated(problem, point, work) else {
            return lost();
        };
        let Some(alternating) = &work.alternating else {
            return lost();
        };
        let (young, hopeless) = (alternating.is_young(), alternating.is_hopeless(estimate));
        if hopeless || !young && !self.promises(problem, work, REST) {
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
        let costs = work.costs(problem);
        if work.done.sweeps < FIRST_SWEEPS || self.sweeps_are_cheap(work, costs) {
            problem.enter(&mut work.state, point);
            work.rate.begin();
            work.acceleration.begin_again();
            work.stage = FIRST;
        } else {
            self.begin_trial(problem, point, work, error);
        }
    }

    /// Begins stage 3 where that promises something at a point with this error, else stage 4.
    fn begin_trial<P: Linearised<D> + Disked<D> + Kinematic<D>>(
        &self,
        problem: &P,
        point: &mut P::Point,
        work: &mut HybridWork<P, D>,
        error: f64,
    ) {
        let spread = has_spread(problem, work);
        let HybridWork { newton, inner_best, controller, .. } = work;
        let (true, Some(newton)) = (error < TRIAL_BELOW || spread, newton) else {
            return begin_interior(problem, work, Some(P::impulses(point)));
        };
        let r = P::impulses(point);
        newton.focus(r, error, work.tolerance);
        centre_trial(newton, controller, r, inner_best);
        work.stage = Stage::Trial { idle: 0, least: error, rescues: 0 };
    }

    /// Stage 3: one Newton iteration, nearly without a proximal term; at its end the best point goes on.
    pub(super) fn trial<P: Linearised<D> + Disked<D> + Kinematic<D>>(
        &self,
        problem: &P,
        point: &mut P::Point,
        work: &mut HybridWork<P, D>,
    ) -> Step {
        let HybridWork { newton, state, controller, inner_best, done, stage, .. } = work;
        let (Some(newton), &mut Stage::Trial { idle, least, rescues }) = (newton, &mut *stage)
        else {
            return lost();
        };
        let r = P::impulses(point);
        let iterate = newton.iterate(problem, state, r);
        done.trial += 1;
        let error = newton.error(r);
        let idle = if error < 0.5 * least { 0 } else { idle + 1 };
        if error < least {
            inner_best.copy_from_slice(r);
        }
        let least = error.min(least);
        let astray = iterate.step == 0.0 || done.trial == 1 && newton.reach() > TRIAL_REACH;
        let over = astray || done.trial >= TRIAL;
        if !over && idle < TRIAL_IDLE {
            *stage = Stage::Trial { idle, least, rescues };
            return Step::Continue { estimate: error };
        }
        r.copy_from_slice(inner_best);
        if !over && least >= NEAR && rescues < RESCUES && work.spread == Some(true) {
            return self.rescue(problem, point, work, least, rescues);
        }
        controller.offer(least);
        if least < NEAR {
            self.pass_by(problem, point, work);
        } else {
            begin_interior(problem, work, Some(P::impulses(point)));
        }
        Step::Continue { estimate: least }
    }

    /// Sweeps where Newton's iterations lie still at an error, for stage 3 to go on from: they change the sides of contacts that Newton's directions do not.
    fn rescue<P: Linearised<D> + Disked<D> + Kinematic<D>>(
        &self,
        problem: &P,
        point: &mut P::Point,
        work: &mut HybridWork<P, D>,
        least: f64,
        rescues: usize,
    ) -> Step {
        let costs = work.costs(problem);
        let most = RESCUE_COST * costs.factorisation / costs.sweep;
        problem.enter(&mut work.state, point);
        let HybridWork { newton, state, controller, inner_best, done, sweep, stage, scale, .. } =
            work;
        let Some(newton) = newton else { return lost() };
        let r = P::impulses(point);
        let count = (RESCUE << rescues).min(most as usize).max(1);
        swept(sweep, problem, state, r, (count, *scale));
        done.between += count;
        let mut error = newton.look(problem, state, r);
        if error > RESCUE_TAKE_BACK * least || error.is_nan() {
            r.copy_from_slice(inner_best);
            error = newton.look(problem, state, r);
        }
        centre_trial(newton, controller, r, inner_best);
        *stage = Stage::Trial { idle: 0, least: error, rescues: rescues + 1 };
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
        work.passed_by = Some(PassedBy::from(&work.done, &work.controller));
        if work.done.sweeps < SWEPT_LONG {
            return self.subproblem_here(problem, point, work);
        }
        let costs = work.costs(problem);
        let most = SWEEP_AGAIN * costs.worth / costs.sweep;
        problem.enter(&mut work.state, point);
        work.begin_between(point, work.done.sweeps.min(most as usize).max(1));
    }

    /// Whether stage 4 was passed by in vain: Newton's iterations since have led far off, or have been too slow for what is left from this error.
    pub(super) fn passed_by_in_vain<P: Linearised<D> + Disked<D> + Kinematic<D>>(
        &self,
        work: &HybridWork<P, D>,
        error: f64,
    ) -> bool {
        work.passed_by.is_some_and(|PassedBy { after, from, astray }| {
            let iterations = work.done.newton - after;
            astray >= ASTRAY.1
                || iterations >= IN_VAIN
                    && takes_longer([from, error], iterations, work.tolerance, INTERIOR_COST)
        })
    }

    /// Stage 4: one iteration of the interior point; at its end the better of its best iterate and the swept point goes on.
    pub(super) fn interior<P: Linearised<D> + Disked<D> + Kinematic<D>>(
        &self,
        problem: &P,
        point: &mut P::Point,
        work: &mut HybridWork<P, D>,
    ) -> Step {
        let HybridWork { central, state, stage, done, tolerance, .. } = work;
        let (Some(central), Stage::Interior { halvings, short, before }) = (central, stage) else {
            return lost();
        };
        let (ended, may_wait) = match central.iterate(problem, state) {
            Err(_) => (true, false),
            Ok(now) => {
                done.interior += 1;
                let idle = halvings.idle_at(now.error);
                *short = if now.alpha < INTERIOR_SHORT.0 { *short + 1 } else { 0 };
                let iterations = done.interior - *before;
                let over = now.error <= tolerance.max(INTERIOR_ERROR)
                    || *short >= INTERIOR_SHORT.1
                    || iterations >= INTERIOR;
                let first = idle == iterations && idle < INTERIOR_FIRST;
                (over || idle >= INTERIOR_IDLE, first && !over)
            }
        };
        done.interior_error = central.best().1;
        if ended && (!may_wait || has_spread(problem, work)) {
            return self.after_interior(problem, point, work);
        }
        Step::Continue { estimate: work.done.interior_error }
    }

    /// How stage 7 goes if it comes now: Newton's iterations since stage 4 promise to be many.
    pub(super) fn chase_due<P: Linearised<D> + Disked<D> + Kinematic<D>>(
        &self,
        work: &HybridWork<P, D>,
        error: f64,
    ) -> Option<&'static Chase> {
        let Done { interior, interior_error, newton, pursuits, pursued_error, .. } = work.done;
        let far = pursuits > 0 && pursued_error > PURSUE_AGAIN;
        let may = interior > 0 && work.spread == Some(false) && !far;
        let slow = takes_longer([interior_error, error], newton, work.tolerance, PURSUE_COST);
        PURSUITS.get(pursuits).filter(|chase| may && newton >= chase.after && slow)
    }

    /// Begins stage 7.
    pub(super) fn begin_pursuit<P: Linearised<D> + Disked<D> + Kinematic<D>>(
        &self,
        problem: &P,
        work: &mut HybridWork<P, D>,
        error: f64,
        chase: &Chase,
    ) -> Step {
        let HybridWork { pursuit, state, stage, done, .. } = work;
        done.pursuits += 1;
        let now = pursuit.get_or_insert_default().begin(problem, state, chase.smoothing, None);
        *stage = Stage::Pursuit { halvings: Halvings::from(now.error), most: chase.idle };
        Step::Continue { estimate: error }
    }

    /// Stage 7: one step along the path; at its end the better of its best iterate and the present point goes on.
    pub(super) fn pursue<P: Linearised<D> + Disked<D> + Kinematic<D>>(
        &self,
        problem: &P,
        point: &mut P::Point,
        work: &mut HybridWork<P, D>,
    ) -> Step {
        let HybridWork { pursuit, state, stage, done, tolerance, controller, .. } = work;
        let (Some(path), Stage::Pursuit { halvings, most }) = (pursuit, stage) else {
            return lost();
        };
        done.pursued += 1;
        let ended = match path.iterate(problem, state) {
            Err(_) => true,
            Ok(now) => {
                let idle = halvings.idle_at(now.error);
                now.error <= tolerance.max(INTERIOR_ERROR) || idle >= *most || path.stuck()
            }
        };
        let best = path.core().best();
        done.pursued_error = best.1;
        if ended {
            take(best, controller, P::impulses(point));
            self.subproblem_here(problem, point, work);
        }
        Step::Continue { estimate: work.done.pursued_error }
    }

    /// Whether stage 9 comes now: far from a solution, where Newton's iterations promise to be many.
    pub(super) fn turns_are_due<P: Linearised<D> + Disked<D> + Kinematic<D>>(
        &self,
        work: &HybridWork<P, D>,
        error: f64,
    ) -> bool {
        let Done { interior_error, newton, .. } = work.done;
        let slow = takes_longer([interior_error, error], newton, work.tolerance, PURSUE_COST);
        newton >= TURN_AFTER && error > TURN_ABOVE && slow
    }

    /// Whether stage 8 comes now.
    pub(super) fn alternation_is_due<P: Linearised<D> + Disked<D> + Kinematic<D>>(
        &self,
        work: &HybridWork<P, D>,
    ) -> bool {
        let after = ALTERNATE_AFTER.get(work.done.alternations);
        after.is_some_and(|&after| work.done.newton >= after)
    }

    /// Begins stage 8 from a point with this error, or from none.
    pub(super) fn begin_alternating<P: Linearised<D> + Disked<D> + Kinematic<D>>(
        &self,
        problem: &P,
        point: &mut P::Point,
        work: &mut HybridWork<P, D>,
        error: f64,
    ) -> Step {
        let HybridWork { alternating, state, done, rate, stage, from_here, .. } = work;
        *from_here = match done.alternations {
            0 => error < ALTERNATE_NEAR && !nearly_rests(done),
            _ => !*from_here,
        };
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

    /// Stage 8: one iteration of alternating directions.
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
        let first = nearly_rests(&work.done);
        let worth = if first { ALTERNATE_WORTH_AT_REST } else { ALTERNATE_WORTH };
        if !young && !self.promises(problem, work, worth) || estimate.is_nan() {
            self.end_alternating(problem, point, work);
            self.subproblem_here(problem, point, work);
            if first && work.controller.projects() {
                self.begin_projected(problem, point, work);
            }
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
        let HybridWork { alternating, state, rate, tolerance, still, .. } = work;
        let alternating = alternating.as_mut()?;
        let estimate = alternating.iterate(problem, state);
        rate.note(estimate);
        if estimate <= *tolerance {
            *still = false;
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
        let costs = work.costs(problem);
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
        let HybridWork { alternating, state, newton, controller, still, .. } = work;
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
        *still = false;
        r.copy_from_slice(alternating.impulses());
        newton.look(problem, state, r)
    }
}

/// Newton's iterations of stage 3 begin about `r`, the best so far.
fn centre_trial<L: DiskLaw<D>, const D: usize>(
    newton: &mut ProximalNewton<L, D>,
    controller: &Controller,
    r: &[f64],
    best: &mut [f64],
) {
    newton.center(r, TRIAL_EPSILON, controller.kappa(), false);
    best.copy_from_slice(r);
}

/// Whether an error that fell so in so many iterations takes more than `most` others to the tolerance.
fn takes_longer([from, to]: [f64; 2], iterations: usize, tolerance: f64, most: f64) -> bool {
    let fall = (from / to).ln() / iterations as f64;
    to > tolerance && (fall <= 0.0 || (to / tolerance).ln() / fall > most)
}

/// The impulses of an iterate with its error become the point's where they are better.
pub(super) fn take((theirs, error): (&[f64], f64), controller: &mut Controller, ours: &mut [f64]) {
    if controller.offer(error) {
        ours.copy_from_slice(theirs);
    }
}

/// Where stage 4 was passed by.
#[derive(Debug, Clone, Copy)]
pub(super) struct PassedBy {
    /// Newton's iterations and the error until then.
    after: usize,
    from: f64,
    /// Iterations in a row far above the best error.
    astray: usize,
}

impl PassedBy {
    fn from(done: &Done, controller: &Controller) -> Self {
        Self { after: done.newton, from: controller.error(), astray: 0 }
    }

    /// Whether Newton's iterations, the last one with this error, lead away for too long.
    pub(super) fn goes_astray(&mut self, error: f64, controller: &Controller) -> bool {
        let far = error > ASTRAY.0 * controller.error() || error.is_nan();
        self.astray = if far { self.astray + 1 } else { 0 };
        self.astray >= ASTRAY.1
    }
}

/// How an error falls by halves.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Halvings {
    least: f64,
    idle: usize,
}

impl Halvings {
    pub(super) fn from(error: f64) -> Self {
        Self { least: error, idle: 0 }
    }

    /// How many errors up to this one there have been since the last halving.
    pub(super) fn idle_at(&mut self, error: f64) -> usize {
        let halved = error < 0.5 * self.least;
        *self = if halved { Self::from(error) } else { Self { idle: self.idle + 1, ..*self } };
        self.idle
    }
}

/// A stage without its part, which cannot be.
pub(super) fn lost() -> Step {
    Step::Stuck("auto has lost its place".into())
}

/// Whether W has spread; found out once.
pub(super) fn has_spread<P: Linearised<D> + Disked<D>, const D: usize>(
    problem: &P,
    work: &mut HybridWork<P, D>,
) -> bool {
    let HybridWork { spread, state, units, .. } = work;
    *spread.get_or_insert_with(|| problem.spread(state, units) >= SPREAD)
}

/// Where an interior point begins that knows impulses: near them, or, with two disks a contact, at the cones' units all the same. Two cones that share their normal impulse
/// cannot both be as far from their boundaries as they have to.
pub(super) fn inside<L: Law<D>, const D: usize>(r: &[f64]) -> Option<(&[f64], f64)> {
    (L::DISKS == 1).then_some((r, INTERIOR_MARGIN))
}

/// Begins stage 4, near impulses or at the cones' units.
pub(super) fn begin_interior<P: Linearised<D> + Disked<D>, const D: usize>(
    problem: &P,
    work: &mut HybridWork<P, D>,
    near: Option<&[f64]>,
) {
    work.passed_by = None;
    let HybridWork { central, state, stage, done, .. } = work;
    let central = central.get_or_insert_with(interior_point);
    let now = central.begin(problem, state, 0.0, near.and_then(inside::<P::Law, D>));
    let (halvings, before) = (Halvings::from(now.error), done.interior);
    *stage = Stage::Interior { halvings, short: 0, before };
}

/// Begins stage 4 anew at the iterate that the relaxation kept, if it did.
pub(super) fn begin_interior_kept<P: Linearised<D> + Disked<D>, const D: usize>(
    problem: &P,
    work: &mut HybridWork<P, D>,
) -> bool {
    let HybridWork { central, state, stage, done, .. } = work;
    let Some(central) = central.as_mut().filter(|central| central.has_kept()) else {
        return false;
    };
    let now = central.begin_kept(problem, state);
    let (halvings, before) = (Halvings::from(now.error), done.interior);
    *stage = Stage::Interior { halvings, short: 0, before };
    true
}

/// That of stage 4, without a workspace yet.
pub(super) fn interior_point<L: DiskLaw<D>, const D: usize>() -> Box<Central<L, D>> {
    Box::new(Central::default().know_at_least(INTERIOR_SLOPE))
}
