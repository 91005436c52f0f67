//! When a proximal subproblem is solved, what ε the next one has, how many sweeps come between, and when to try something else.
//!
//! The numbers were chosen on a part of the problems of Siconos' numerics, of simulated rigid bodies and of this project's own
//! scenes, by counts of factorisations; docs/choosing.md has the evidence. What made the difference on the 217 problems of the corpus: the interior
//! point as a starter (2024 contacts at rest: 9 factorisations instead of 98); ρ = 30/w_c in the self-dual metric of each contact instead of
//! one ε for all (mass ratios: 12 instead of thousands); giving up a subproblem after 10 idle iterations, and staying above twice the ε at
//! which one failed (a pile of 120 spheres: not solved before). Tried and dropped: Anderson acceleration of the proximal steps (no gain on
//! six hard problems), ρ from 1/w_c to 10/w_c and above 100/w_c.

use crate::contact::auto::proximal_newton::Inner;

/// ε never leaves this range.
const EPSILON: (f64, f64) = (1e-9, 1e3);
/// Newton iterations on one subproblem.
const ITERATIONS: usize = 30;
/// A subproblem has failed after this many iterations that did not lower its residual by a fifth.
const PATIENCE: usize = 10;
/// What counts as lower.
const LOWER: f64 = 0.8;
/// A subproblem solved by this factor is solved if no more comes in a few iterations.
const ENOUGH: (f64, usize) = (0.05, 3);
/// ε stays above this multiple of one at which a subproblem has failed, and that floor sinks after a few successes.
const FLOOR: f64 = 2.0;
const SINK: (f64, usize) = (0.3, 3);
/// Sweeps between two subproblems.
const MOST_SWEEPS: usize = 300;
/// Sweeps from zero.
const LONG: (usize, usize) = (50, 30_000);
/// Most of them with one projection a contact: on chutes and pyramids of spheres most of what they bring they have brought by then.
const MOST_PROJECTED: usize = 8000;
/// The least share of the time that sweeps have.
const LEAST_SHARE: f64 = 0.02;
/// Of two points whose errors differ by no more than this factor the newer is as good: a strategy goes on from it. Where W is nearly singular, proximal steps lead along a curve on which the error
/// stays what it is, or rises a little, for hundreds of steps before it falls; going back to the least error undid them.
const AS_GOOD: f64 = 2.0;
/// From below this error no strategy begins anew at zero.
const KEPT_BELOW: f64 = 1e-6;
/// A strategy is left after this many factorisations that did not halve the error, and each later one half as late again.
const PATIENT: f64 = 200.0;
const MORE_PATIENT: f64 = 1.5;

/// κ of ρ = κ/w_c, the share of the time for sweeps, and where it goes on from.
const STRATEGIES: [(f64, f64, Origin); 4] = [
    (30.0, 0.3, Origin::Best),
    (100.0, 1.0, Origin::Projected),
    (10.0, 1.0, Origin::Swept),
    (30.0, 3.0, Origin::Best),
];

/// Where a strategy goes on from.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Origin {
    /// The best point so far, the newest of those that are as good.
    Best,
    /// What long sweeps from zero come to, good or bad.
    Swept,
    /// What long sweeps with one projection a contact come to from zero, if that is better than the best point so far; once, for they come to the same each time.
    Projected,
}

/// How a subproblem ended.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Verdict {
    /// Its best iterate solves it.
    Solved,
    /// Its best iterate is not good, but better than the start.
    Better,
    /// Back to the start.
    Failed,
}

/// The state of the control.
#[derive(Debug, Clone, Copy, Default)]
pub(super) struct Controller {
    epsilon: f64,
    floor: f64,
    successes: usize,
    failures: usize,
    /// The relative residual of the problem at the present impulses, and the smallest so far.
    error: f64,
    least: f64,
    /// Of the present subproblem.
    inner: Subproblem,
    /// The share of the time for sweeps, now.
    share: f64,
    strategy: usize,
    /// [`Origin::Projected`] has been.
    projected: bool,
    /// Strategies in a row without success.
    idle: usize,
    /// The error to reach and the factorisations since it was set.
    halved: f64,
    spent: f64,
    budget: f64,
}

#[derive(Debug, Clone, Copy, Default)]
struct Subproblem {
    iterations: usize,
    /// Iterations since the residual last fell markedly.
    idle: usize,
    initial: f64,
    target: f64,
    best: f64,
}

impl Controller {
    /// Begins with the first strategy at a point with this error.
    pub(super) fn begin(&mut self, error: f64) {
        *self = Self { error, least: error, epsilon: 1.0, budget: PATIENT, ..Self::default() };
        self.halved = 0.5 * error;
        self.share = STRATEGIES[0].1;
    }

    /// A starter offers a point with this error: whether to take it.
    pub(super) fn offer(&mut self, error: f64) -> bool {
        let better = error < self.error;
        if better {
            self.error = error;
            self.resume();
        }
        better
    }

    /// The present point is a good start: ε by its error.
    pub(super) fn resume(&mut self) {
        self.epsilon = self.error.clamp(1e-5, 1.0);
    }

    /// The error of the best point so far.
    pub(super) fn least(&self) -> f64 {
        self.least
    }

    /// The error of the present point.
    pub(super) fn error(&self) -> f64 {
        self.error
    }

    pub(super) fn epsilon(&self) -> f64 {
        self.epsilon
    }

    pub(super) fn kappa(&self) -> f64 {
        STRATEGIES[self.strategy].0
    }

    /// Strategies in a row that have not halved the error.
    pub(super) fn strategies(&self) -> usize {
        self.idle
    }

    /// A subproblem begins: the error of the problem and its own residual there. True: the point to go on from.
    pub(super) fn start(&mut self, error: f64, residual: f64, tolerance: f64) -> bool {
        self.inner = Subproblem {
            initial: residual,
            best: residual,
            target: (1e-3 * error).min(1e-4).max(0.1 * tolerance),
            ..Subproblem::default()
        };
        self.error = error;
        self.record(error)
    }

    /// Takes note of an error; true: the point to go on from ([`AS_GOOD`]).
    fn record(&mut self, error: f64) -> bool {
        let as_good = error <= AS_GOOD * self.least;
        self.least = error.min(self.least);
        // An error of zero that the judge does not believe cannot be halved.
        if error <= self.halved && self.halved > 0.0 {
            (self.halved, self.spent, self.idle) = (0.5 * error, 0.0, 0);
            self.budget = PATIENT;
        }
        as_good
    }

    /// Notes an iteration; true: the best of this subproblem.
    pub(super) fn observe(&mut self, iterate: &Inner) -> bool {
        self.spent += 1.0;
        let inner = &mut self.inner;
        inner.iterations += 1;
        inner.idle += 1;
        let better = iterate.residual < inner.best;
        if better {
            if iterate.residual < LOWER * inner.best {
                inner.idle = 0;
            }
            inner.best = iterate.residual;
        }
        better
    }

    /// Whether the subproblem is over, and how it ended.
    pub(super) fn verdict(&self, iterate: &Inner) -> Option<Verdict> {
        let inner = &self.inner;
        let enough = inner.best <= ENOUGH.0 * inner.initial;
        let patience = if enough { ENOUGH.1 } else { PATIENCE };
        let goes_on = iterate.residual > inner.target
            && inner.iterations < ITERATIONS
            && inner.idle < patience
            && iterate.step > 0.0;
        if goes_on {
            return None;
        }
        let kept = inner.best < 0.2 * inner.initial && !(self.failures + 1).is_multiple_of(3);
        Some(if inner.best <= inner.target || enough {
            Verdict::Solved
        } else if kept {
            Verdict::Better
        } else {
            Verdict::Failed
        })
    }

    /// The subproblem has ended at a point with this error: the next ε. True: the point to go on from.
    pub(super) fn end(&mut self, verdict: Verdict, error: f64) -> bool {
        let epsilon = self.epsilon;
        if verdict == Verdict::Solved {
            self.failures = 0;
            self.successes += 1;
            if self.successes >= SINK.1 {
                self.floor *= SINK.0;
                self.successes = 0;
            }
            let factor = match self.inner.iterations - self.inner.idle {
                0..=4 => 0.1,
                5..=8 => 0.25,
                9..=15 => 0.5,
                _ => 0.8,
            };
            self.epsilon = (factor * epsilon).max(self.floor.min(epsilon));
        } else {
            self.failures += 1;
            self.successes = 0;
            self.floor = FLOOR * epsilon;
            self.epsilon = epsilon * if self.failures == 1 { 4.0 } else { 10.0 };
        }
        self.epsilon = self.epsilon.clamp(EPSILON.0, EPSILON.1);
        self.error = error;
        self.record(error)
    }

    /// How many sweeps come next, if a factorisation is worth `ratio` of them.
    pub(super) fn sweeps(&self, ratio: f64) -> usize {
        let iterations = (self.inner.iterations - self.inner.idle).max(1) as f64;
        ((self.share * iterations * ratio) as usize).clamp(1, MOST_SWEEPS)
    }

    /// How many sweeps from zero there are, if a factorisation is worth `ratio` of them.
    pub(super) fn long_sweeps(&self, from: Origin, ratio: f64) -> usize {
        let most = if from == Origin::Projected { MOST_PROJECTED } else { LONG.1 };
        ((self.budget * ratio) as usize).clamp(LONG.0, most)
    }

    /// The sweeps have ended with this error; returns by which factor it grew, and gives sweeps that help more time.
    pub(super) fn swept(&mut self, error: f64) -> f64 {
        let growth = error / self.error;
        let share = if growth > 1.0 { 0.5 } else { 2.0 } * self.share;
        self.share = share.clamp(LEAST_SHARE, STRATEGIES[self.strategy].1);
        growth
    }

    /// Whether the error has not halved for long.
    pub(super) fn is_stuck(&self) -> bool {
        self.spent > self.budget
    }

    /// Whether sweeps with one projection a contact may come now, as for the first time.
    pub(super) fn projects(&mut self) -> bool {
        !std::mem::replace(&mut self.projected, true)
    }

    /// Goes over to another strategy; returns where it goes on from.
    pub(super) fn change(&mut self) -> Origin {
        self.strategy = (self.strategy + 1) % STRATEGIES.len();
        self.idle += 1;
        self.spent = 0.0;
        self.budget *= MORE_PATIENT;
        self.floor = 0.0;
        self.failures = 0;
        let (_, share, mut from) = STRATEGIES[self.strategy];
        if self.least < KEPT_BELOW {
            from = Origin::Best;
        }
        if from == Origin::Projected && !self.projects() {
            from = Origin::Best;
        }
        self.share = share;
        self.epsilon = if from == Origin::Best { self.least.clamp(1e-4, 1.0) } else { 1.0 };
        if from != Origin::Best {
            // What sweeps from zero come to is not compared with what there was just now.
            self.error = f64::INFINITY;
        }
        from
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn of_points_as_good_the_newest_goes_on() {
        let mut controller = Controller::default();
        controller.begin(1e-3);
        assert!(controller.end(Verdict::Solved, 1e-4));
        assert!(controller.end(Verdict::Solved, 1.5e-4));
        assert_eq!(controller.least(), 1e-4);
        // Measured by the least of all, not by the last: it cannot creep upwards.
        assert!(!controller.end(Verdict::Solved, 2.5e-4));
        assert!(!controller.end(Verdict::Failed, f64::NAN));
        assert_eq!(controller.least(), 1e-4);
    }

    #[test]
    fn an_error_of_zero_is_stuck_like_any_other() {
        let mut controller = Controller::default();
        controller.begin(1e-3);
        let iterations = (0..2000).take_while(|_| {
            controller.observe(&Inner { residual: 0.0, step: 1.0 });
            controller.end(Verdict::Solved, 0.0);
            !controller.is_stuck()
        });
        assert!(iterations.count() < 400);
    }

    #[test]
    fn near_a_solution_no_strategy_begins_at_zero() {
        for (error, expected) in [
            (1e-4, [Origin::Projected, Origin::Swept, Origin::Best, Origin::Best]),
            (1e-8, [Origin::Best; 4]),
        ] {
            let mut controller = Controller::default();
            controller.begin(error);
            assert_eq!([(); 4].map(|()| controller.change()), expected, "{error:e}");
        }
    }
}
