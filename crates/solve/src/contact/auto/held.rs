//! The rows at their bounds, sought as a set.
//!
//! Problem: contacts, and rows `c_j` with `−c_j ∈ N_[l_j, u_j](λ_j)`.
//!
//! Method: a primal-dual active set (HintermullerItoKunisch2002). With `t_j = λ_j − c_j/w_j`, `w_j = ∂c_j/∂λ_j`, a row with `t_j ≤ l_j` or `t_j ≥ u_j` is held at that
//! bound and its impulse is a load; all others are bilateral constraints, `c_j = 0`. What is left is a contact problem without bounds, which `auto` itself solves, from the impulses before; then the
//! rows are asked again. The set that comes out twice is the solution's. Where one comes back that was tried before, of the rows that ask for another place
//! the last one alone gets it (Murty1974: this ends where all is linear and the matrix is P).
//!
//! Cost: a solve of the rest for each set, of which a handful are tried. Storage: the problem of the rest and its workspace.
//! Fails: where the rows that are let go contradict each other, or nothing solves the rest; then it is asked whether there is a solution at all, and sweeps go on.

use nonsmooth_linalg::budget;
use nonsmooth_problem::check::Kinematic;

use super::starts::lost;
use super::{Auto, FIRST, HybridWork, SWEEPS_A_STEP, Stage, runs_away};
use crate::contact::form::{Disked, Linearised, OnContacts, Parted};
use crate::contact::parts::{asked, put_within_bounds};
use crate::{SolveError, Solver, Step};

/// Rows are asked where the contacts are so near to their law, relative to the loads, or at the tolerance.
const SETTLED: f64 = 1e-6;
/// After so many steps rows are asked wherever the contacts are: with the wrong rows let go there may be no solution.
const PATIENCE: usize = 40;
/// A row asks for another place where it misses the law by more than this part of the tolerance.
const MISSED: f64 = 0.1;
/// So many sets are tried; each is remembered.
const SETS_MOST: usize = 200;
/// Sweeps go on while so few are left, and after a search for those at their bounds in vain until they are so many times as many.
const SWEEPS_WITH_ROWS: f64 = 100.0;
const AGAIN: usize = 10;

impl<const D: usize> OnContacts<Auto, D> {
    /// After sweeps over contacts and rows with bounds, whose last one moved so much.
    pub(super) fn sweep_with_rows<
        P: Linearised<D> + Disked<D> + Kinematic<D> + Parted<D> + Send,
    >(
        &self,
        problem: &P,
        point: &mut P::Point,
        work: &mut HybridWork<P, D>,
        estimate: f64,
    ) -> Step {
        let lost = runs_away(estimate) && !budget::over();
        let few = work.rate.left(work.tolerance) * (SWEEPS_A_STEP as f64) < SWEEPS_WITH_ROWS;
        if lost && work.done.searches > 0 {
            let Some([r, lambda]) = work.searched_from.take() else {
                let asked = self.ask(problem, point, work);
                let stuck = || Step::Stuck("sweeps send the impulses to infinity".into());
                return asked.unwrap_or_else(stuck);
            };
            let to = P::all_impulses(point);
            to.0.copy_from_slice(&r);
            to.1.copy_from_slice(&lambda);
            problem.enter(&mut work.state, point);
            work.rate.begin();
            return Step::Continue { estimate: f64::NAN };
        }
        if lost {
            let (r, lambda) = P::all_impulses(point);
            r.fill(0.0);
            lambda.fill(0.0);
            put_within_bounds(problem, point);
        } else if estimate == 0.0 {
            // Where nothing moves any more and the judge goes on asking, sweeps are at their end.
            if let Some(step) = self.ask(problem, point, work) {
                return step;
            }
            if work.done.searches > 0 {
                return Step::Stuck("sweeps move nothing any more".into());
            }
        } else if work.done.sweeps < work.hold_after
            || few && work.done.sweeps < AGAIN * work.hold_after
        {
            // Few promise to be left, and yet it may be that they never come to an end.
            return Step::Continue { estimate };
        }
        work.done.searches += 1;
        work.hold_after = AGAIN * work.done.sweeps;
        let (r, lambda) = P::all_impulses(point);
        work.searched_from = Some([r.to_vec(), lambda.to_vec()]);
        problem.enter(&mut work.state, point);
        if let Ok(held) = Held::begin(self, problem, &work.state, point, work.tolerance) {
            work.held = Some(Box::new(held));
            work.stage = Stage::Held;
        }
        Step::Continue { estimate }
    }

    /// A step on the problem without the rows at their bounds.
    pub(super) fn hold<P: Linearised<D> + Disked<D> + Kinematic<D> + Parted<D> + Send>(
        &self,
        problem: &P,
        point: &mut P::Point,
        work: &mut HybridWork<P, D>,
    ) -> Step {
        let HybridWork { held, sweep, state, units: u, scale, tolerance, .. } = work;
        let Some(held) = held else {
            return lost();
        };
        let residual = |state: &mut P::State, point: &mut P::Point| {
            let r = P::impulses(point);
            u.resize(r.len(), 0.0);
            problem.velocities(state, r, u);
            sweep.residual(u, r) / *scale
        };
        match held.step(self, problem, (state, point), (*tolerance, *scale), residual) {
            Came::Further(estimate) => Step::Continue { estimate },
            Came::End => {
                // The state has entered the point that it left.
                work.held = None;
                work.stage = FIRST;
                work.rate.begin();
                let asked = self.ask(problem, point, work);
                asked.unwrap_or(Step::Continue { estimate: f64::NAN })
            }
        }
    }

    /// Whether there is a solution at all, asked once where a search ended in vain: what follows from that, if something does.
    fn ask<P: Linearised<D> + Disked<D> + Kinematic<D>>(
        &self,
        problem: &P,
        point: &mut P::Point,
        work: &mut HybridWork<P, D>,
    ) -> Option<Step> {
        if std::mem::replace(&mut work.asked, true) {
            return None;
        }
        let existence = self.investigated(problem, work);
        self.decided(problem, point, work, &existence)
    }
}

/// The present set, and the problem of the rest.
pub(super) struct Held<P: Linearised<D> + Disked<D>, const D: usize> {
    problem: P,
    point: P::Point,
    work: HybridWork<P, D>,
    /// The impulse of each row that is held.
    held: Vec<Option<f64>>,
    tried: Vec<Vec<Option<f64>>>,
    /// Steps since the rest was looked at, and since it was begun.
    since: usize,
    steps: usize,
}

/// What a step came to.
pub(super) enum Came {
    /// The rest goes on; the error of the contacts, NaN where it was not looked at.
    Further(f64),
    /// No set is left, or the rest cannot be solved.
    End,
}

impl<P, const D: usize> Held<P, D>
where
    P: Linearised<D> + Disked<D> + Kinematic<D> + Parted<D> + Send,
{
    /// Begins with the rows that are at their bounds at a point, whose velocities `state` has.
    pub(super) fn begin(
        method: &OnContacts<Auto, D>,
        problem: &P,
        state: &P::State,
        point: &mut P::Point,
        tolerance: f64,
    ) -> Result<Self, SolveError> {
        let held = places(problem, state, point, 0.0, None);
        let inner = problem.holding(&held);
        let mut work = method.work(&inner)?;
        method.aim(tolerance, &mut work);
        let origin = inner.origin();
        let mut this =
            Self { problem: inner, point: origin, work, held, tried: vec![], since: 0, steps: 0 };
        this.start(method, point);
        Ok(this)
    }

    /// Begins to solve the rest, from the impulses of a point of the whole.
    fn start(&mut self, method: &OnContacts<Auto, D>, whole: &mut P::Point) {
        self.tried.push(self.held.clone());
        (self.since, self.steps) = (0, 0);
        self.point = self.problem.origin();
        let (r, lambda) = P::all_impulses(whole);
        let (own, multipliers) = P::all_impulses(&mut self.point);
        own.copy_from_slice(r);
        let free = lambda.iter().zip(&self.held).filter(|(_, held)| held.is_none());
        multipliers.iter_mut().zip(free).for_each(|(to, (from, _))| *to = *from);
        method.start(&self.problem, &mut self.point, &mut self.work);
    }

    /// One step of the rest; where that has settled, what the rows say of it. `whole` gets the impulses, and `state` enters it; `residual` is then that of the contacts.
    pub(super) fn step(
        &mut self,
        method: &OnContacts<Auto, D>,
        problem: &P,
        (state, whole): (&mut P::State, &mut P::Point),
        (tolerance, scale): (f64, f64),
        residual: impl FnOnce(&mut P::State, &mut P::Point) -> f64,
    ) -> Came {
        let step = method.step(&self.problem, &mut self.point, &mut self.work);
        self.since += 1;
        self.steps += 1;
        match step {
            Step::Continue { .. } if self.since < method.check_every(&self.work) => {
                return Came::Further(f64::NAN);
            }
            Step::Continue { .. } | Step::Done => {}
            Step::Stuck(_) | Step::NoSolution(_) => return Came::End,
        }
        self.since = 0;
        method.publish(&self.problem, &mut self.point, &mut self.work);
        self.lift(problem, whole);
        problem.enter(state, whole);
        let error = residual(state, whole);
        let settled = error <= SETTLED.max(tolerance);
        if !settled && self.steps < PATIENCE {
            return Came::Further(error);
        }
        let slack = MISSED * tolerance * scale;
        let next = places(problem, state, whole, slack, Some(&self.held));
        if next == self.held {
            return Came::Further(error);
        }
        let Some(next) = self.untried(next) else { return Came::End };
        self.held = next;
        self.problem = problem.holding(&self.held);
        if method.refill(&self.problem, &mut self.work).is_err() {
            return Came::End;
        }
        self.start(method, whole);
        Came::Further(f64::NAN)
    }

    /// The set, or the one that differs in its last change alone, if it was not tried before.
    fn untried(&self, mut next: Vec<Option<f64>>) -> Option<Vec<Option<f64>>> {
        if self.tried.len() >= SETS_MOST {
            return None;
        }
        if self.tried.contains(&next) {
            let last = (0..next.len()).rev().find(|&j| next[j] != self.held[j])?;
            next[..last].copy_from_slice(&self.held[..last]);
        }
        (!self.tried.contains(&next)).then_some(next)
    }

    /// The impulses of the rest and of the rows that are held, between the bounds.
    fn lift(&mut self, problem: &P, whole: &mut P::Point) {
        let (own, multipliers) = P::all_impulses(&mut self.point);
        let (r, lambda) = P::all_impulses(whole);
        r.copy_from_slice(own);
        let mut free = multipliers.iter();
        for (j, (lambda, held)) in lambda.iter_mut().zip(&self.held).enumerate() {
            let [l, u] = problem.bounds().map_or([f64::NEG_INFINITY, f64::INFINITY], |b| b.of(j));
            let of_rest = || free.next().copied().unwrap_or(0.0);
            *lambda = held.unwrap_or_else(of_rest).clamp(l, u);
        }
    }

    /// The sets tried, and how many rows are held in the last.
    pub(super) fn counts(&self) -> [usize; 2] {
        [self.tried.len(), self.held.iter().flatten().count()]
    }

    /// What was done to solve the last rest.
    pub(super) fn account(&self, method: &OnContacts<Auto, D>) -> String {
        method.account(&self.work).join("; ")
    }
}

/// The impulse at which each row is to be held, by its impulse and velocity at a point; a row stays as it is `held` where it misses the law, or moves where it is let go, by no more than `slack`, a velocity.
fn places<P: Linearised<D> + Disked<D>, const D: usize>(
    problem: &P,
    state: &P::State,
    point: &mut P::Point,
    slack: f64,
    held: Option<&[Option<f64>]>,
) -> Vec<Option<f64>> {
    let (r, lambda) = P::all_impulses(point);
    let mut places = vec![None; lambda.len()];
    let Some(bounds) = problem.bounds() else { return places };
    for j in bounds.bounded() {
        let [l, u] = bounds.of(j);
        let w = problem.row_response(state, j);
        let c = problem.row_velocity(state, r, lambda, j);
        places[j] = if w <= 0.0 {
            // Nothing that it does moves it.
            Some(if c.abs() <= slack { lambda[j] } else { asked([l, u], lambda[j], c, w, 1.0) })
        } else if let Some(held) = held
            && held[j].map_or(c, |_| bounds.residual(j, lambda[j], c, w)).abs() <= slack
        {
            held[j]
        } else {
            let aim = lambda[j] - c / w;
            if aim <= l {
                Some(l)
            } else if aim >= u {
                Some(u)
            } else {
                None
            }
        };
    }
    places
}
