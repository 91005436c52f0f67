//! The convex relaxation where the interior point on the exact law has failed, far from a solution or where little slides: its path turns back where contacts between sliding and sticking are many, the convex one never does. Where nothing slides at the
//! solution the two have the same; where little slides the relaxation's is near, and alternating directions, sweeps with one projection a contact, both from zero, and motion and impulses in turn come before
//! Newton's iterations, which do not end there. Pyramids of spheres at rest and hit. Where it is not, as with large mass ratios, the exact law has a second trial, from a centre of the relaxation's path.

use nonsmooth_problem::check::Kinematic;

use super::starts::{Halvings, INTERIOR, INTERIOR_IDLE, begin_interior_kept, lost, take};
use super::{Auto, Done, HybridWork, Stage};
use crate::Step;
use crate::contact::form::{Disked, Linearised, OnContacts};
use crate::contact::parts::CentralIterate;

/// The interior point has failed above this error.
const FAILED_ABOVE: f64 = 1e-3;
/// Above this one it tells nothing of how much slides. Of 77 problems, most of them with mass ratios to 10⁶, 68 are solved in 2 s with .03, 67 with .1 and with .3, but 66 without.
const FAILED_FAR_ABOVE: f64 = 0.03;
/// More than this part of ‖q‖ slides in flows and piles, for which the relaxation is of no use: .4 to .6 of it in chutes and in piles that are hit, .02 to .26 in pyramids of spheres.
const SLIDING: f64 = 0.3;
/// Little slides where the relaxation comes nearer than this: 3e-3 to 6e-3 in pyramids of spheres with mu = .6, at .4 and where they are shaken .01 and more.
const NEARLY_RESTS: f64 = 1e-2;
/// The exact law begins anew, where the relaxation did not come near, at the first of its iterates whose equations hold to this part of complementarity: there its path is.
const CENTRED: f64 = 0.1;
/// The relaxation is as good as solved, and its solution slides, where its own error is below this part of that of the law.
const SLIDES: f64 = 0.1;

impl<const D: usize> OnContacts<Auto, D> {
    /// What comes after stage 4, whose best iterate has yet to be taken where it is better than the point: stage 5, by way of the relaxation where it failed and little slides.
    pub(super) fn after_interior<P: Linearised<D> + Disked<D> + Kinematic<D>>(
        &self,
        problem: &P,
        point: &mut P::Point,
        work: &mut HybridWork<P, D>,
    ) -> Step {
        let HybridWork {
            central, newton, state, controller, inner_best, done, stage, still, ..
        } = work;
        let (Some(central), Some(newton)) = (central, newton) else {
            return lost();
        };
        let r = P::impulses(point);
        let failed = done.interior_error > FAILED_ABOVE && done.relaxed == 0;
        let relaxes = failed && {
            newton.look(problem, state, r);
            done.interior_error > FAILED_FAR_ABOVE || newton.sliding(r) < SLIDING
        };
        take(central.best(), controller, r);
        *still = false;
        let estimate = controller.error();
        if relaxes {
            inner_best.copy_from_slice(r);
            done.relaxed_error = f64::INFINITY;
            let now = central.begin_relaxed(problem, state);
            let [halvings, equations] = [now.error, now.residual].map(Halvings::from);
            *stage = Stage::Relaxed { halvings, equations };
        } else {
            self.subproblem_here(problem, point, work);
        }
        Step::Continue { estimate }
    }

    /// One iteration on the relaxation; at its end the best by the law goes on where it is better than the point.
    pub(super) fn relaxed<P: Linearised<D> + Disked<D> + Kinematic<D>>(
        &self,
        problem: &P,
        point: &mut P::Point,
        work: &mut HybridWork<P, D>,
    ) -> Step {
        let HybridWork {
            central,
            newton,
            state,
            stage,
            done,
            tolerance,
            still,
            controller,
            inner_best,
            ..
        } = work;
        let (Some(central), Some(newton), Stage::Relaxed { halvings, equations }) =
            (central, newton, stage)
        else {
            return lost();
        };
        let r = P::impulses(point);
        done.relaxed += 1;
        let (ended, error) = match central.iterate(problem, state) {
            Err(_) => (true, f64::INFINITY),
            Ok(now) => {
                let error = newton.look(problem, state, central.r());
                let solved = now.error < SLIDES * error;
                let idle = halvings.idle_at(now.error).min(equations.idle_at(now.residual));
                (solved || idle >= INTERIOR_IDLE || done.relaxed >= INTERIOR, error)
            }
        };
        let centred = |now: &CentralIterate| now.residual < CENTRED * now.tau;
        if !central.has_kept() && central.now().is_some_and(centred) {
            central.keep();
        }
        if error < done.relaxed_error {
            done.relaxed_error = error;
            inner_best.copy_from_slice(central.r());
        }
        if error <= *tolerance {
            *still = false;
            r.copy_from_slice(central.r());
        }
        if ended {
            take((inner_best, done.relaxed_error), controller, r);
            *still = false;
            let error = controller.error();
            if nearly_rests(&work.done) {
                return self.begin_alternating(problem, point, work, error);
            }
            if !begin_interior_kept(problem, work) {
                self.subproblem_here(problem, point, work);
            }
        }
        Step::Continue { estimate: error }
    }
}

/// Whether the relaxation came near, and Newton's iterations have yet to begin.
pub(super) fn nearly_rests(done: &Done) -> bool {
    done.relaxed > 0 && done.relaxed_error < NEARLY_RESTS && done.newton == 0
}
