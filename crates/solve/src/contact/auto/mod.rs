//! **auto**: one method for every frictional contact problem, which needs no setting.
//!
//! Problem: `u = W r + q`, `K* ∋ u + mu‖u_T‖e_N ⟂ r ∈ K` for each contact, W of any rank, local or global, in the plane or in space.
//!
//! Method, each stage only where the one before it would take longer:
//!
//! 1. **Sweeps**: exact Gauss–Seidel for as long as its rate of convergence promises the tolerance sooner than a few
//!    factorisations would, and after stage 2 until they have cost one. Many problems end here. Between them, here and in stage 6, the contacts that
//!    still move are followed where they are few ([`Sweep::follow`]), or the sweeps are accelerated, where a trial shows that it helps: one by one from the fifth on
//!    ([`EarlyAcceleration`]), else ten at a time after thirty ([`Acceleration`]). A problem that falls apart into islands is solved island by island after a few of them, one that is stated by its bodies when they are left (`apart.rs`).
//! 2. **Rest** (`parts/alternating.rs`): impulses within the cones that leave nothing moving, where the sweeps show nothing that flies apart: after five of them where they
//!    still move much, else after the others. One factorisation and a few solves end structures at rest, whatever their height; two solves tell where nothing comes of it. Where contacts
//!    open because weights have yet to come down to them, as in walls with head joints, it comes at once where they open slowly, when the sweeps have cost a factorisation where they open fast.
//! 3. **Trial**: Newton's iterations of stage 5 without its proximal term, where the sweeps came near or the structure is not hyperstatic, until three in a row have not halved the error; there sweeps come to
//!    its rescue a few times.
//! 4. **Interior point** on the exact law ([`Central`]), a starter, from well inside the cones about the impulses so far: some 8 to 20 iterations lead near the solution of a problem
//!    at rest; where the central path turns back it is left again. Where it failed far off, or little slides, on the convex relaxation (s = 0, `relaxed.rs`), whose path does not: where nothing slides its solution
//!    obeys the law; where it comes near, stages 8, sweeps with one projection and 9 come next, which find what little slides; else once more on the exact law, from where the relaxation's equations first hold.
//! 5. **Proximal point, semismooth Newton inside** (`proximal_newton.rs`): ε falls as fast as the subproblems are solved
//!    easily, and rises where they are not. It keeps full accuracy on hyperstatic problems. Steps are whole where W has no spread (walls, columns, arches), else shortened by a line search.
//! 6. **Sweeps between the proximal steps**, while they help: they move the impulses within the null space of W, which Newton leaves
//!    where they are. After a trial in vain from near a solution they come first where stage 1 was long.
//! 7. **The central path by its arc length** ([`Pursuit`]), where Newton's iterations promise to be many: it turns back with the
//!    path where stage 4 is stuck. Up to three times, each time smoothed by less and for longer. Walls that are shaken end here.
//! 8. **Alternating directions** (`parts/alternating.rs`) after many proximal steps, for as long as they promise more.
//! 9. **Motion and impulses in turn** (`in_turn.rs`), where a problem is stated by its bodies, once, after many proximal steps that are still far off or at the first change of strategy:
//!    what moves with what rests as its support, then the impulses of all from that motion.
//! 10. **Cadoux' fixed point** (`cadoux.rs`): the sliding speeds held, a convex problem solved, the speeds renewed by Newton's method. Before each change of strategy, while it comes as near, for as many factorisations as
//!     a strategy takes; where a problem is small already after a few Newton iterations in vain. Few degrees of freedom under friction of 1 and more, on which sweeps diverge and Newton's iterations go round, end here.
//! 11. **Another strategy** (other ρ, more sweeps, a start from zero but near a solution) where the error has not halved for long; at the first time
//!     the existence of a solution is investigated, and a problem without one is given up with its certificate; where that is one by the last digits only, the loop asks for more
//!     ([`Solver::go_on`]), and Cadoux' fixed point of a small problem begins anew. That first time sweeps with
//!     one projection a contact ([`Projection`]) are tried from zero, if they have not been: where exact ones circle, these may come near or end.
//!
//! A problem with scalar rows that have bounds begins with sweeps, which visit them too. The later stages know no bounds; where sweeps promise little, those
//! of the rows that are at their bounds are sought as a set (`held.rs`), each time with all stages on the problem of the rest.
//!
//! A starting point is taken where a sweep from it ends no farther off than one from zero impulses; near a solution it makes stages 2 and 4 needless.
//!
//! References: AcaryBremondHuber2018 for the evidence that proximal Newton methods solve hyperstatic problems; AlartCurnier1991; the
//! parts' own files.
//!
//! Cost: a sweep is one pass over W; an iteration of 3 to 5 one factorisation of a matrix over the bodies (global) or the contacts
//! (local), a step of 7 two or three, one of 10 some 10 to 20. The choice goes by counted operations, never by the clock, so a run repeats itself bit by bit.
//! Fails: impacts on thousands of hyperstatic contacts may need more factorisations than patience allows.

mod accelerated;
mod account;
mod apart;
mod cadoux;
mod controller;
mod held;
mod in_turn;
mod proximal_newton;
mod relaxed;
mod starts;

use nonsmooth_linalg::budget::Pace;
use nonsmooth_linalg::{Groups, budget};
use nonsmooth_problem::check::{Certificate, Existence, Kinematic};
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use crate::contact::auto::proximal_newton::ProximalNewton;
use crate::contact::existence;
use crate::contact::form::{
    Access, Blockwise, Costs, Disked, Linearised, OnContacts, Parted, has_bounds,
};
use crate::contact::law::local::{LocalSolver, Projection};
use crate::contact::parts::{
    Acceleration, Alternating, Central, EarlyAcceleration, Pursuit, Rate, Sweep, put_within_bounds,
    sweep_rows,
};
use crate::core::register::{About, Described, Solves};
use crate::core::settings::{Settings, described};
use crate::{Limits, SolveError, Solver, Step};
use account::{Done, Start};
use apart::Apart;
use cadoux::Cadoux;
use controller::{Controller, Origin, Verdict};
use held::Held;
use in_turn::InTurn;
use starts::{Halvings, PassedBy};

/// The hyperparameters of `auto`; none needs to be set.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields, default)]
pub struct Auto {
    /// Whether an interior point may make the start; false goes from the sweeps to the proximal point method at once.
    pub interior: bool,
    /// Whether, where no strategy helps, the motion of what moves and the impulses of all are sought in turn; false goes on with other strategies.
    pub in_turn: bool,
    /// Give up after this many strategies in a row that have not halved the error; 0 goes on until a limit ends the solve.
    pub strategies: usize,
}

impl Default for Auto {
    fn default() -> Self {
        Self { interior: true, in_turn: true, strategies: 12 }
    }
}

impl Settings for Auto {}

impl Described for Auto {
    const ABOUT: &'static About = &About {
        name: "auto",
        family: "auto",
        solves: Solves::Law,
        summary: "needs no setting: sweeps, a search for rest, interior point, proximal semismooth Newton, ADMM, each while it promises more than the next",
        needs: &[],
        cites: &[
            "AcaryBremondHuber2018",
            "AlartCurnier1991",
            "Acary2018",
            "HintermullerItoKunisch2002",
            "Cadoux2009",
            "Anderson1965",
        ],
        variants: &["interior=false"],
        settings: described::<Self>,
    };
}

/// A first stage of sweeps is at least this long, unless it ends at the tolerance.
const FIRST_SWEEPS: usize = 30;
/// After so many of them rest is looked for once, which costs about as much as the others.
const GLANCE: usize = 5;
/// Sweeps of a step.
const SWEEPS_A_STEP: usize = 10;
/// Steps of sweeps between two looks of the judge, each of which costs some three sweeps; other steps are judged one by one.
const SWEEPS_JUDGED: usize = 5;
/// So many times as many where threads share the sweeps.
const SWEEPS_JUDGED_SHARED: usize = 4;
/// Where a look costs more than a step, so many steps at most go between two of them.
const LOOKED_LATE: f64 = 20.0;
/// Sweeps go on while what is left of them promises to cost less than this many factorisations. What comes after them costs 1 to 50; by hindsight, on 340 problems, leaving them at 2 to 3.5
/// costs 1.08 of the better way in the geometric mean, at 0 1.12, at 6 1.2 and at 10 1.4. Where W has spread, so many times what a factorisation is worth where many are to come: in piles and flows
/// they often are.
const SWEEPS_WORTH: f64 = 3.0;
const SWEEPS_WORTH_SPREAD: f64 = 10.0;
/// The interior point begins far from any point given; below this error one is better off without it, and no sweep from zero comes as near but where sweeps end at once.
const NEAR: f64 = 1e-4;
/// Above this error between two proximal steps, sweeps.
const SWEEP_ABOVE: f64 = 1e-9;
/// Below it only where so many subproblems in a row have ended within the tolerance and the judge goes on asking: single contacts, whose loads are too small beside those of others for the error to show
/// them, are not done. What a linear solve makes of them is the rounding of the others; sweeps solve each in its own unit. Each time twice as many.
const REFUSED: u32 = 3;
/// Doublings, at most.
const DOUBLED: u32 = 8;
/// ω of the sweeps with one projection a contact, as that of `psor`.
const OMEGA: f64 = 1.3;
/// Sweeps that raise the error by more than this factor are taken back.
const TAKE_BACK: f64 = 5.0;
/// Problems of so few unknowns are enumerated after so many Newton iterations: milliseconds, and a last word.
const TINY: usize = 24;
const EARLY: usize = 20;
/// Impulses that make velocities so many times those of the loads run away: it is time to ask for existence.
const RUNAWAY: f64 = 1e7;
/// An investigation of existence may take this long, in seconds.
const INVESTIGATION: f64 = 2.0;
/// Strategies in a row that have not halved the error, where all choices of the contacts' states are refuted up to rounding.
const REFUTED: usize = 2;

/// The workspace. The later stages' parts are made when they are first needed.
pub struct HybridWork<P: Linearised<D> + Disked<D>, const D: usize> {
    state: P::State,
    /// The problem has rows with bounds.
    bounded: bool,
    sweep: Sweep<P::Law, D>,
    projected: Option<Box<Sweep<P::Law, D, Projection>>>,
    in_turn: Option<Box<InTurn<P::Law, D>>>,
    cadoux: Option<Box<Cadoux<P::Law, D>>>,
    /// It comes at a change of strategy after so many of them.
    cadoux_after: usize,
    apart: Option<Box<Apart<P, D>>>,
    /// Whether the problem falls apart has been asked; room for it.
    parted: bool,
    groups: Groups,
    held: Option<Box<Held<P, D>>>,
    /// So many sweeps come before the next search for the rows at their bounds.
    hold_after: usize,
    /// The impulses from which that search began, contacts and rows: where it ends without a set it may have sent them anywhere.
    searched_from: Option<[Vec<f64>; 2]>,
    alternating: Option<Box<Alternating<D>>>,
    central: Option<Box<Central<P::Law, D>>>,
    pursuit: Option<Box<Pursuit<P::Law, D>>>,
    newton: Option<Box<ProximalNewton<P::Law, D>>>,
    controller: Controller,
    costs: Option<Costs>,
    scale: f64,
    tolerance: f64,
    stage: Stage,
    /// The last step left the point where it was.
    still: bool,
    /// Of the sweeps, of the alternating directions.
    rate: Rate,
    early: EarlyAcceleration,
    acceleration: Acceleration,
    /// The rate and the sweeps where the trial of either began.
    mark: (Rate, usize),
    /// Whether W has spread, where that was asked, and room for finding it out.
    spread: Option<bool>,
    units: Vec<f64>,
    /// The impulses of the best iterate of the present subproblem; those before the sweeps between; those of the best point, or a newer one that is as good.
    inner_best: Vec<f64>,
    before: Vec<f64>,
    best: Vec<f64>,
    existence: Option<Existence>,
    /// An exact solution, rounded, that the judge has yet to see.
    exact: Option<P::Point>,
    asked: bool,
    /// There is none by so little that a point may pass: no such word any more.
    doubted: bool,
    rest: RestSearch,
    /// Motion and impulses have been sought in turn, or cannot be.
    turned: bool,
    /// The interior point was left out: after so many Newton iterations, at this error.
    passed_by: Option<PassedBy>,
    /// Alternating directions last began at the point, not at no impulses.
    from_here: bool,
    /// Subproblems in a row that ended within the tolerance and were not enough.
    refused: u32,
    pace: Pace,
    done: Done,
}

impl<P: Linearised<D> + Disked<D>, const D: usize> HybridWork<P, D> {
    /// What steps cost; counted once.
    fn costs(&mut self, problem: &P) -> Costs {
        *self.costs.get_or_insert_with(|| problem.costs(&mut self.state))
    }

    /// Begins so many sweeps of stage 6 at the point, whose impulses the state knows.
    fn begin_between(&mut self, point: &mut P::Point, left: usize) {
        self.before.copy_from_slice(P::impulses(point));
        self.acceleration.begin_again();
        self.stage = Stage::Between { left };
    }
}

/// Where the method stands.
#[derive(Debug, Clone, Copy, PartialEq)]
enum Stage {
    Sweeps { claims: usize },
    Rest,
    Trial { idle: usize, least: f64, rescues: usize },
    Interior { halvings: Halvings, short: usize, before: usize },
    Relaxed { halvings: Halvings, equations: Halvings },
    Newton,
    Between { left: usize },
    Projected { left: usize },
    InTurn,
    Cadoux,
    Pursuit { halvings: Halvings, most: usize },
    Alternating,
    Held,
    Apart,
}

impl Stage {
    /// Whether its steps leave the point where it is, all but the last and those that claim the tolerance, which say so.
    fn stands_still(self) -> bool {
        use Stage::*;
        let starts = matches!(self, Rest | Interior { .. } | Relaxed { .. });
        starts || matches!(self, InTurn | Cadoux | Pursuit { .. } | Alternating | Apart)
    }
}

/// Whether stage 2 is still to come.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq)]
enum RestSearch {
    /// Nobody has looked.
    #[default]
    Open,
    /// Something flies apart: not before the sweeps have cost a factorisation.
    PutOff,
    /// It has been, or there is no use for it.
    Done,
}

impl<P: Linearised<D> + Disked<D> + Kinematic<D> + Parted<D> + Send, const D: usize> Solver<P>
    for OnContacts<Auto, D>
{
    type Work = HybridWork<P, D>;

    fn work(&self, problem: &P) -> Result<Self::Work, SolveError> {
        let bounded = has_bounds(problem);
        let state = problem.state(if bounded { Access::Rows } else { Access::Newton })?;
        Ok(HybridWork {
            bounded,
            sweep: Sweep::new(problem, &state),
            projected: None,
            in_turn: None,
            cadoux: None,
            cadoux_after: 0,
            held: None,
            hold_after: FIRST_SWEEPS,
            searched_from: None,
            apart: None,
            parted: false,
            groups: Groups::default(),
            alternating: None,
            central: None,
            pursuit: None,
            newton: None,
            controller: Controller::default(),
            costs: None,
            scale: problem.velocity_scale(&state),
            tolerance: 0.0,
            stage: FIRST,
            still: false,
            rate: Rate::default(),
            early: EarlyAcceleration::default(),
            acceleration: Acceleration::default(),
            mark: (Rate::default(), 0),
            spread: None,
            units: vec![],
            inner_best: vec![],
            before: vec![],
            best: vec![],
            existence: None,
            exact: None,
            asked: false,
            doubted: false,
            rest: RestSearch::default(),
            turned: false,
            passed_by: None,
            from_here: false,
            refused: 0,
            pace: Pace::default(),
            done: Done::default(),
            state,
        })
    }

    fn refill(&self, problem: &P, work: &mut Self::Work) -> Result<(), SolveError> {
        if has_bounds(problem) != work.bounded {
            *work = self.work(problem)?;
            return Ok(());
        }
        problem.refill(&mut work.state)?;
        work.sweep.fill(problem, &work.state);
        if let Some(projected) = &mut work.projected {
            projected.fill(problem, &work.state);
        }
        work.scale = problem.velocity_scale(&work.state);
        work.costs = None;
        if let Some(newton) = &mut work.newton {
            newton.fill(problem, &work.state);
        }
        Ok(())
    }

    fn aim(&self, tolerance: f64, work: &mut Self::Work) {
        work.tolerance = tolerance;
    }

    fn start(&self, problem: &P, point: &mut P::Point, work: &mut Self::Work) {
        work.done = Done::default();
        if work.bounded {
            put_within_bounds(problem, point);
        } else {
            work.done.start = self.choose_start(problem, point, work);
        }
        self.begin(problem, point, work);
    }

    fn step(&self, problem: &P, point: &mut P::Point, work: &mut Self::Work) -> Step {
        if let Some(ray) = problem.contradiction(&work.state).filter(|_| !work.doubted) {
            return Step::NoSolution(ray.clone().into());
        }
        // The judge has seen it, and goes on asking.
        work.exact = None;
        work.still = work.stage.stands_still();
        match work.stage {
            Stage::Sweeps { claims } => self.sweep(problem, point, work, claims),
            Stage::Rest => self.rest(problem, point, work),
            Stage::Trial { .. } => self.trial(problem, point, work),
            Stage::Interior { .. } => self.interior(problem, point, work),
            Stage::Relaxed { .. } => self.relaxed(problem, point, work),
            Stage::Newton => self.newton(problem, point, work),
            Stage::Between { left } => self.between(problem, point, work, left),
            Stage::Projected { left } => self.projected(problem, point, work, left),
            Stage::InTurn => self.take_turns(problem, point, work),
            Stage::Cadoux => self.cadoux(problem, point, work),
            Stage::Pursuit { .. } => self.pursue(problem, point, work),
            Stage::Alternating => self.alternate(problem, point, work),
            Stage::Held => self.hold(problem, point, work),
            Stage::Apart => self.part(problem, point, work),
        }
    }

    fn publish(&self, problem: &P, point: &mut P::Point, work: &mut Self::Work) {
        if work.stage == Stage::Apart {
            problem.enter(&mut work.state, point);
        }
        match &work.exact {
            // Its velocities and multipliers are exact too.
            Some(exact) => P::copy_point(exact, point),
            None => problem.complete(&mut work.state, point),
        }
    }

    fn check_every(&self, work: &Self::Work) -> usize {
        let costs = work.costs.as_ref();
        let affordable = |step: fn(&Costs) -> f64| {
            costs.map_or(1, |costs| (costs.look / step(costs)).clamp(1.0, LOOKED_LATE) as usize)
        };
        match work.stage {
            // What has been judged already.
            stage if work.still && stage.stands_still() => usize::MAX,
            // One thread judges.
            Stage::Sweeps { .. } | Stage::Between { .. } | Stage::Projected { .. } => {
                let judged = SWEEPS_JUDGED * work.sweep.together(SWEEPS_JUDGED_SHARED);
                judged.max(affordable(|costs| SWEEPS_A_STEP as f64 * costs.sweep))
            }
            Stage::Trial { .. } | Stage::Newton => affordable(|costs| costs.factorisation),
            _ => 1,
        }
    }

    fn go_on(&self, problem: &P, point: &mut P::Point, work: &mut Self::Work) -> bool {
        work.doubted = true;
        // The first stage has yet to make the parts of the later ones, or fit them to this problem.
        if !matches!(work.stage, Stage::Sweeps { .. } | Stage::Held | Stage::Apart) {
            problem.enter(&mut work.state, point);
            if !self.insist_on_cadoux(problem, work) {
                self.subproblem_here(problem, point, work);
            }
        }
        true
    }

    fn account(&self, work: &Self::Work) -> Vec<String> {
        account::of(self, work)
    }
}

const FIRST: Stage = Stage::Sweeps { claims: 0 };

/// Whether sweeps that move so much, relative to ‖q‖, are on their way to infinity: before the judge sees numbers that are none.
fn runs_away(estimate: f64) -> bool {
    estimate.is_nan() || estimate > RUNAWAY
}

/// `count` sweeps, fewer where they run away or the budget is over; returns what the last one moved, in units of `scale`.
fn swept<P: Blockwise<D> + Disked<D>, S: LocalSolver<D, P::Law>, const D: usize>(
    sweep: &mut Sweep<P::Law, D, S>,
    problem: &P,
    state: &mut P::State,
    r: &mut [f64],
    (count, scale): (usize, f64),
) -> f64 {
    let together = sweep.together(count);
    let mut moves = 0.0;
    for _ in 0..count / together {
        moves = sweep.sweeps(problem, state, r, together).sqrt() / scale;
        if runs_away(moves) || budget::over() {
            break;
        }
    }
    moves
}

impl<const D: usize> OnContacts<Auto, D> {
    /// Begins stage 1 at a point.
    fn begin<P: Linearised<D> + Disked<D>>(
        &self,
        problem: &P,
        point: &mut P::Point,
        work: &mut HybridWork<P, D>,
    ) {
        problem.enter(&mut work.state, point);
        work.stage = FIRST;
        work.rate.begin();
        work.early.begin();
        work.acceleration.begin();
        (work.existence, work.exact, work.asked) = (None, None, false);
        work.doubted = false;
        (work.passed_by, work.rest, work.spread) = (None, RestSearch::default(), None);
        (work.turned, work.in_turn) = (false, None);
        (work.cadoux_after, work.refused) = (0, 0);
        work.parted = false;
        if let Some(apart) = &mut work.apart {
            apart.restart();
        }
        (work.held, work.hold_after) = (None, FIRST_SWEEPS);
        work.searched_from = None;
    }

    /// Puts zero in place of impulses from which a sweep ends farther off than from zero: a bad guess costs a sweep, contacts that came or
    /// went are no reason to refuse the rest of a good one, and of several solutions the one given stays.
    fn choose_start<P: Linearised<D> + Disked<D>>(
        &self,
        problem: &P,
        point: &mut P::Point,
        work: &mut HybridWork<P, D>,
    ) -> Start {
        if P::impulses(point).iter().all(|x| *x == 0.0) {
            return Start::Zero;
        }
        let HybridWork { state, sweep, before: given, inner_best: u, scale, .. } = work;
        given.clear();
        given.extend_from_slice(P::impulses(point));
        u.resize(given.len(), 0.0);
        // What is near already needs no comparison.
        problem.enter(state, point);
        problem.velocities(state, given, u);
        if sweep.residual(u, given) < NEAR * *scale {
            return Start::Given;
        }
        let mut after_a_sweep = |point: &mut P::Point| {
            problem.enter(state, point);
            let r = P::impulses(point);
            sweep.sweep(problem, state, r);
            problem.velocities(state, r, u);
            sweep.residual(u, r)
        };
        let theirs = after_a_sweep(point);
        P::impulses(point).fill(0.0);
        let ours = after_a_sweep(point);
        if theirs <= ours {
            P::impulses(point).copy_from_slice(given);
            Start::Given
        } else {
            P::impulses(point).fill(0.0);
            // The same run as from zero: the one-contact solvers forget where they were.
            sweep.fill(problem, state);
            Start::Refused
        }
    }

    /// Stage 1. `claims`: how often the sweeps thought that they had arrived.
    fn sweep<P: Linearised<D> + Disked<D> + Kinematic<D> + Parted<D> + Send>(
        &self,
        problem: &P,
        point: &mut P::Point,
        work: &mut HybridWork<P, D>,
        claims: usize,
    ) -> Step {
        let mut estimate = f64::NAN;
        if !work.bounded && !work.early.is_on() {
            self.accelerate(problem, point, work);
        }
        let together = work.sweep.together(SWEEPS_A_STEP);
        // At most: of a small problem the clock is looked at by the loop alone.
        let passes = together as f64 * (problem.unknowns() as f64).powi(2);
        let mut left = SWEEPS_A_STEP;
        while left > 0 {
            if self.accelerate_early(problem, point, work) {
                left = SWEEPS_A_STEP - GLANCE;
            }
            left -= together;
            let (r, lambda) = P::all_impulses(point);
            let moves = work.sweep.sweeps(problem, &mut work.state, r, together)
                + sweep_rows(problem, &mut work.state, (r, lambda), 1.0);
            work.done.sweeps += together;
            if work.pace.over(passes) {
                break;
            }
            estimate = moves.sqrt() / work.scale;
            if runs_away(estimate) {
                break;
            }
            let swept = work.done.sweeps;
            if (GLANCE..GLANCE + together).contains(&swept)
                && (problem.bodies().is_none() && self.falls_apart(problem, point, work, estimate)
                    || self.rests_at_a_glance(problem, point, work, estimate))
            {
                return Step::Continue { estimate };
            }
            if estimate <= 0.3 * work.tolerance && claims < SWEEPS_A_STEP {
                work.stage = Stage::Sweeps { claims: claims + 1 };
                return Step::Continue { estimate };
            }
        }
        work.rate.note(estimate);
        self.follow(problem, point, work, estimate);
        if work.bounded {
            return self.sweep_with_rows(problem, point, work, estimate);
        }
        if runs_away(estimate) && !budget::over() {
            if self.goes_back_early(problem, point, work) {
                return Step::Continue { estimate: f64::NAN };
            }
            // Where W is not positive semidefinite a sweep may send the impulses to infinity.
            P::impulses(point).fill(0.0);
            problem.enter(&mut work.state, point);
            self.leave_sweeps(problem, point, work);
            return Step::Continue { estimate: f64::NAN };
        }
        if work.done.sweeps < FIRST_SWEEPS && estimate > 0.0 {
            return Step::Continue { estimate };
        }
        let costs = work.costs(problem);
        let limits = [SWEEPS_WORTH * costs.factorisation, SWEEPS_WORTH_SPREAD * costs.worth];
        let cost = SWEEPS_A_STEP as f64 * costs.sweep;
        let [without, with] = limits.map(|limit| work.rate.promises(work.tolerance, cost, limit));
        // Whether W has spread costs a pass over it, and is asked only where it matters.
        let promising =
            if with != without && starts::has_spread(problem, work) { with } else { without }
                || work.rest != RestSearch::Open && self.sweeps_are_cheap(work, costs);
        // By its bodies an island costs a factorisation to state: only where sweeps are left.
        let stays = promising || self.goes_back(problem, point, work);
        if !stays && !self.falls_apart(problem, point, work, estimate) {
            self.leave_sweeps(problem, point, work);
        }
        Step::Continue { estimate }
    }

    /// After sweeps whose last one moved so much: the contacts that still move, where they are few.
    fn follow<P: Linearised<D> + Disked<D>>(
        &self,
        problem: &P,
        point: &mut P::Point,
        work: &mut HybridWork<P, D>,
        estimate: f64,
    ) {
        if !runs_away(estimate) && !work.acceleration.is_on() && !work.early.is_on() {
            let r = P::impulses(point);
            work.done.followed += work.sweep.follow(problem, &mut work.state, r);
        }
    }

    /// Whether the sweeps so far are worth less than one factorisation: then they have time to find their pace.
    fn sweeps_are_cheap<P: Linearised<D> + Disked<D>>(
        &self,
        work: &HybridWork<P, D>,
        costs: Costs,
    ) -> bool {
        (work.done.sweeps as f64) * costs.sweep < costs.worth
    }

    /// The parts of the later stages, and the error of the point.
    fn look_round<P: Linearised<D> + Disked<D> + Kinematic<D>>(
        &self,
        problem: &P,
        point: &mut P::Point,
        work: &mut HybridWork<P, D>,
    ) -> f64 {
        self.make_room_for_cadoux(problem, work);
        let HybridWork { newton, state, controller, .. } = work;
        let newton = newton.get_or_insert_with(|| Box::new(ProximalNewton::new(problem, state)));
        work.alternating.get_or_insert_default().make_room(problem.contacts());
        let r = P::impulses(point);
        for buffer in [&mut work.inner_best, &mut work.before, &mut work.best] {
            buffer.resize(r.len(), 0.0);
        }
        work.best.copy_from_slice(r);
        let error = newton.look(problem, state, r);
        controller.begin(error);
        // The search for rest begins at no impulses: not from a point that came near.
        if work.done.start == Start::Given && error < NEAR {
            work.rest = RestSearch::Done;
        }
        error
    }

    /// Whichever stage comes first after the sweeps.
    fn leave_sweeps<P: Linearised<D> + Disked<D> + Kinematic<D>>(
        &self,
        problem: &P,
        point: &mut P::Point,
        work: &mut HybridWork<P, D>,
    ) {
        let error = self.look_round(problem, point, work);
        if !self.0.interior {
            self.subproblem(problem, point, work, error);
        } else {
            self.begin_starts(problem, point, work, error);
        }
    }

    /// Begins a proximal subproblem about the present impulses, from which their velocities have yet to be computed.
    fn subproblem_here<P: Linearised<D> + Disked<D> + Kinematic<D>>(
        &self,
        problem: &P,
        point: &mut P::Point,
        work: &mut HybridWork<P, D>,
    ) {
        let HybridWork { newton, state, .. } = work;
        let Some(newton) = newton else { return };
        let error = newton.look(problem, state, P::impulses(point));
        self.subproblem(problem, point, work, error);
    }

    /// Begins a proximal subproblem about the present impulses, whose velocities and error are known.
    fn subproblem<P: Linearised<D> + Disked<D> + Kinematic<D>>(
        &self,
        problem: &P,
        point: &mut P::Point,
        work: &mut HybridWork<P, D>,
        error: f64,
    ) {
        let whole = !starts::has_spread(problem, work);
        let HybridWork { newton, controller, .. } = work;
        let Some(newton) = newton else { return };
        let r = P::impulses(point);
        newton.focus(r, error, work.tolerance);
        newton.center(r, controller.epsilon(), controller.kappa(), whole);
        work.inner_best.copy_from_slice(r);
        if controller.start(error, newton.residual(r), work.tolerance) {
            work.best.copy_from_slice(r);
        }
        work.stage = Stage::Newton;
    }

    /// Stage 5: one Newton iteration; at the end of the subproblem what comes next.
    fn newton<P: Linearised<D> + Disked<D> + Kinematic<D>>(
        &self,
        problem: &P,
        point: &mut P::Point,
        work: &mut HybridWork<P, D>,
    ) -> Step {
        let HybridWork { newton, state, controller, inner_best, best, done, passed_by, .. } = work;
        let Some(newton) = newton else {
            return starts::lost();
        };
        let r = P::impulses(point);
        let iterate = newton.iterate(problem, state, r);
        done.newton += 1;
        if controller.observe(&iterate) {
            inner_best.copy_from_slice(r);
        }
        let estimate = newton.error(r);
        let astray = passed_by.as_mut().is_some_and(|by| by.goes_astray(estimate, controller));
        let verdict = if astray { Some(Verdict::Failed) } else { controller.verdict(&iterate) };
        let Some(verdict) = verdict else {
            return Step::Continue { estimate };
        };
        done.subproblems += 1;
        match verdict {
            Verdict::Solved => r.copy_from_slice(inner_best),
            Verdict::Better => {
                done.failed += 1;
                r.copy_from_slice(inner_best);
            }
            Verdict::Failed => {
                done.failed += 1;
                r.copy_from_slice(newton.centre());
            }
        }
        let error = newton.look(problem, state, r);
        if controller.end(verdict, error) {
            best.copy_from_slice(r);
        }
        if self.cadoux_is_due(problem, work) {
            return self.begin_cadoux(problem, work);
        }
        if self.passed_by_in_vain(work, error) {
            starts::begin_interior(problem, work, None);
            return Step::Continue { estimate: error };
        }
        if let Some(chase) = self.chase_due(work, error) {
            return self.begin_pursuit(problem, work, error, chase);
        }
        if self.turns_are_due(work, error) && self.begin_turns(problem, work) {
            return Step::Continue { estimate: error };
        }
        if self.alternation_is_due(work) {
            return self.begin_alternating(problem, point, work, error);
        }
        if work.controller.is_stuck() {
            return self.other_strategy(problem, point, work);
        }
        if !work.asked && work.done.newton >= EARLY && problem.unknowns() <= TINY {
            work.asked = true;
            if let Some(existence) = existence::enumerated(problem)
                && let Some(step) = self.decided(problem, point, work, &existence)
            {
                work.existence = Some(existence);
                return step;
            }
        }
        if work.sweep.largest(P::impulses(point)) > RUNAWAY * work.scale {
            match &work.existence {
                None => return self.other_strategy(problem, point, work),
                // They run where the certificate points.
                Some(Existence::NearlyNoSolution { certificate, .. }) => {
                    return Step::NoSolution(certificate.clone());
                }
                _ => {}
            }
        }
        problem.enter(&mut work.state, point);
        work.refused = if error <= work.tolerance { work.refused + 1 } else { 0 };
        if error > SWEEP_ABOVE || work.refused >= REFUSED {
            let costs = work.costs(problem);
            let left = work.controller.sweeps(costs.worth / costs.sweep);
            let doubled = work.refused.saturating_sub(REFUSED).min(DOUBLED);
            work.begin_between(point, left << doubled);
        } else {
            self.subproblem(problem, point, work, error);
        }
        Step::Continue { estimate: error }
    }

    /// Stage 6: sweeps on the problem itself; taken back where they spoil more than they mend.
    fn between<P: Linearised<D> + Disked<D> + Kinematic<D>>(
        &self,
        problem: &P,
        point: &mut P::Point,
        work: &mut HybridWork<P, D>,
        left: usize,
    ) -> Step {
        let count = left.min(2 * SWEEPS_A_STEP);
        let HybridWork { sweep, state, scale, acceleration, .. } = work;
        if acceleration.is_trusted() {
            acceleration.move_on(problem, state, point);
        }
        let estimate = swept(sweep, problem, state, P::impulses(point), (count, *scale));
        work.done.between += count;
        self.follow(problem, point, work, estimate);
        if left > count && !runs_away(estimate) {
            work.stage = Stage::Between { left: left - count };
            return Step::Continue { estimate };
        }
        let Some(newton) = &mut work.newton else {
            return starts::lost();
        };
        let r = P::impulses(point);
        let error = newton.look(problem, &mut work.state, r);
        let factor = work.controller.swept(error);
        if factor > TAKE_BACK && error > work.tolerance || factor.is_nan() {
            r.copy_from_slice(&work.before);
            self.subproblem_here(problem, point, work);
        } else {
            self.subproblem(problem, point, work, error);
        }
        Step::Continue { estimate: error }
    }

    /// Sweeps with one projection a contact, from zero, of stage 11 or after alternating directions where little slides; the better of what they come to and the best point goes on.
    fn projected<P: Linearised<D> + Disked<D> + Kinematic<D>>(
        &self,
        problem: &P,
        point: &mut P::Point,
        work: &mut HybridWork<P, D>,
        left: usize,
    ) -> Step {
        let count = left.min(2 * SWEEPS_A_STEP);
        let HybridWork { projected, newton, state, scale, best, controller, .. } = work;
        let (Some(projected), Some(newton)) = (projected, newton) else {
            return starts::lost();
        };
        let r = P::impulses(point);
        let estimate = swept(projected, problem, state, r, (count, *scale));
        work.done.projected += count;
        if left > count && !runs_away(estimate) {
            work.stage = Stage::Projected { left: left - count };
            return Step::Continue { estimate };
        }
        let error = newton.look(problem, state, r);
        if error >= controller.least() || error.is_nan() {
            r.copy_from_slice(best);
        }
        let far = error.min(controller.least()) >= NEAR;
        if !(far && self.begin_turns(problem, work)) {
            self.subproblem_here(problem, point, work);
        }
        Step::Continue { estimate: error }
    }

    /// Whether there is a solution: asked once, and the states of few contacts at the second change of strategy.
    fn investigated<P: Linearised<D> + Disked<D> + Kinematic<D>>(
        &self,
        problem: &P,
        work: &mut HybridWork<P, D>,
    ) -> Existence {
        let limits = Limits { time_limit: Some(INVESTIGATION), ..Limits::default() };
        let decide = || existence::by_motions::<P, D>(problem, &limits);
        let mut known = work.existence.get_or_insert_with(decide).clone();
        if work.done.strategies == 1 {
            known = existence::by_states(problem, known, &limits);
            work.existence = Some(known.clone());
        }
        known
    }

    /// What follows from what is known of the existence of a solution, if something does.
    fn decided<P: Linearised<D> + Disked<D> + Kinematic<D>>(
        &self,
        problem: &P,
        point: &mut P::Point,
        work: &mut HybridWork<P, D>,
        existence: &Existence,
    ) -> Option<Step> {
        match existence {
            Existence::NoSolution { proof } => {
                (!work.doubted).then(|| Step::NoSolution(proof.certificate().clone()))
            }
            // An exact solution, found on the way: the judge has the last word on its rounding.
            Existence::Solved { coefficients, .. } => {
                let x = problem.cones()?.unknowns_at(&coefficients.0);
                let exact = problem.assembled(&x);
                P::copy_point(&exact, point);
                problem.enter(&mut work.state, point);
                work.best.clear();
                work.best.extend_from_slice(P::impulses(point));
                self.subproblem_here(problem, point, work);
                work.exact = Some(exact);
                Some(Step::Continue { estimate: 0.0 })
            }
            _ => None,
        }
    }

    /// Stage 11, and stage 10 before it. The first time it is asked whether there is a solution at all.
    fn other_strategy<P: Linearised<D> + Disked<D> + Kinematic<D>>(
        &self,
        problem: &P,
        point: &mut P::Point,
        work: &mut HybridWork<P, D>,
    ) -> Step {
        if work.cadoux_after <= work.done.strategies && !self.cadoux_is_in_vain(work) {
            work.cadoux_after = work.done.strategies + 1;
            return self.begin_cadoux(problem, work);
        }
        let existence = self.investigated(problem, work);
        if work.done.strategies == 0 && !work.asked {
            if let Some(step) = self.decided(problem, point, work, &existence) {
                work.done.strategies += 1;
                return step;
            }
        } else if let Existence::NoSolution { proof } = &existence
            && !work.doubted
        {
            return Step::NoSolution(proof.certificate().clone());
        }
        work.done.strategies += 1;
        let most = match &work.existence {
            Some(Existence::NearlyNoSolution {
                certificate: Certificate::Separating { .. },
                ..
            }) => self.0.strategies.min(REFUTED),
            _ => self.0.strategies,
        };
        if self.0.strategies > 0 && work.controller.strategies() >= most {
            if let Some(Existence::NearlyNoSolution { certificate, .. }) = &work.existence {
                return Step::NoSolution(certificate.clone());
            }
            let why = format!(
                "no strategy halves the error any more; existence of a solution: {}",
                existence.name()
            );
            return Step::Stuck(why.into());
        }
        let from = work.controller.change();
        if from == Origin::Projected {
            self.begin_projected(problem, point, work);
            return Step::Continue { estimate: f64::NAN };
        }
        let r = P::impulses(point);
        if from == Origin::Best {
            r.copy_from_slice(&work.best)
        } else {
            r.fill(0.0)
        }
        if work.passed_by.is_some() {
            starts::begin_interior(problem, work, None);
        } else if from == Origin::Best {
            self.subproblem_here(problem, point, work);
        } else {
            // Some problems want nothing but sweeps, tens of thousands: as many as the strategy before took time for.
            problem.enter(&mut work.state, point);
            let left = self.long_sweeps(problem, work, from);
            work.begin_between(point, left);
        }
        Step::Continue { estimate: f64::NAN }
    }

    /// So many sweeps from there.
    fn long_sweeps<P: Linearised<D> + Disked<D>>(
        &self,
        problem: &P,
        work: &mut HybridWork<P, D>,
        from: Origin,
    ) -> usize {
        let costs = work.costs(problem);
        work.controller.long_sweeps(from, costs.worth / costs.sweep)
    }

    /// Begins sweeps with one projection a contact, from zero.
    fn begin_projected<P: Linearised<D> + Disked<D>>(
        &self,
        problem: &P,
        point: &mut P::Point,
        work: &mut HybridWork<P, D>,
    ) {
        let left = self.long_sweeps(problem, work, Origin::Projected);
        P::impulses(point).fill(0.0);
        problem.enter(&mut work.state, point);
        let HybridWork { projected, state, stage, .. } = work;
        let sweep = || Box::new(Sweep::with(Projection { step: OMEGA }, problem, state));
        projected.get_or_insert_with(sweep);
        *stage = Stage::Projected { left };
    }
}
