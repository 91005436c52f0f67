//! The sweeps of stage 1, accelerated on trial, one by one from the first ones on and later ten at a time: what a trial has cost counts for nothing where it is taken back.

use nonsmooth_linalg::budget;

use super::{Auto, GLANCE, HybridWork};
use crate::contact::form::{Disked, Linearised, OnContacts};

/// A trial of so many steps has left its mark on the point: where the sweeps no longer promise anything it is taken back before they are left.
const MARKED: usize = 4;

impl<const D: usize> OnContacts<Auto, D> {
    /// Before a sweep: where it begins. True: accelerated one by one, those since the first [`GLANCE`] were in vain, and the point is where these had come.
    pub(super) fn accelerate_early<P: Linearised<D> + Disked<D>>(
        &self,
        problem: &P,
        point: &mut P::Point,
        work: &mut HybridWork<P, D>,
    ) -> bool {
        let HybridWork { early, state, sweep, rate, done, mark, bounded, .. } = work;
        if early.is_on() {
            if early.move_on(problem, state, point) {
                return false;
            }
            work.forget_the_trial();
            return true;
        }
        // Sweeps that threads share come many at a time.
        if done.sweeps == GLANCE && early.is_due() && !*bounded && sweep.together(GLANCE) == 1 {
            early.turn_on(problem, state, P::impulses(point));
            *mark = (rate.clone(), done.sweeps);
        }
        false
    }

    /// After a sweep that ran away: back to where a trial began, if one is under way.
    pub(super) fn goes_back_early<P: Linearised<D> + Disked<D>>(
        &self,
        problem: &P,
        point: &mut P::Point,
        work: &mut HybridWork<P, D>,
    ) -> bool {
        let on = work.early.is_on();
        if on {
            work.early.go_back(problem, &mut work.state, point);
            work.forget_the_trial();
        }
        on
    }

    /// Before a step of sweeps: where it begins.
    pub(super) fn accelerate<P: Linearised<D> + Disked<D>>(
        &self,
        problem: &P,
        point: &mut P::Point,
        work: &mut HybridWork<P, D>,
    ) {
        if !work.acceleration.move_on(problem, &mut work.state, point) {
            work.forget_the_trial();
        } else if work.acceleration.on_trial() == Some(0) {
            work.mark = (work.rate.clone(), work.done.sweeps);
        }
    }

    /// Where the sweeps no longer promise anything: back to where a trial began, if one is under way and has left its mark.
    pub(super) fn goes_back<P: Linearised<D> + Disked<D>>(
        &self,
        problem: &P,
        point: &mut P::Point,
        work: &mut HybridWork<P, D>,
    ) -> bool {
        let marked = work.acceleration.on_trial().is_some_and(|steps| steps >= MARKED);
        // Out of time, what the trial came to is the best there is.
        if !marked || budget::over() {
            return false;
        }
        work.acceleration.go_back(problem, &mut work.state, point);
        work.forget_the_trial();
        true
    }
}

impl<P: Linearised<D> + Disked<D>, const D: usize> HybridWork<P, D> {
    /// The point is the one where the trial began.
    fn forget_the_trial(&mut self) {
        let (rate, sweeps) = &self.mark;
        self.done.taken_back += self.done.sweeps - sweeps;
        (self.rate, self.done.sweeps) = (rate.clone(), *sweeps);
    }
}
