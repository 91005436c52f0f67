//! **auto** for nonlinear complementarity problems: quick methods first, then those that leave stationary points, then other starts.
//!
//! Problem: `l ≤ x ≤ u ⟂ F(x)`. Method: an affine F, known by its expressions, is the linear `auto`'s, with its certificates. Others go through a plan of solvers, each from the
//! start of the solve; what is left of time and iterations goes to perturbed starts. The first that solves the problem ends the solve. Before them a row is looked for whose sign over the whole box
//! leaves no solution, on large grids a start by multigrid (`predictor.rs`), and after the first ones have failed a proof in exact arithmetic, of the relaxation in which each nonlinear term lies between its bounds.
//!
//! The judge's residual is relative; the natural residual, which other programs report, is absolute. A solution is brought to a hundredth of the tolerance in it too, where a few steps of Newton's method and the choice
//! among the doubles around the point (`nearby.rs`) do so.
//!
//! References: Munson2002; Billups1995; the solvers' own files. Cost: that of the solvers tried. Fails: where all of them do.

use std::borrow::Cow;
use std::time::Instant;

use nonsmooth_problem::check::Measure;
use nonsmooth_problem::{BoxLcp, LcpPoint, Mcp, Problem};

use super::plan::Plan;
use super::predictor::Predictor;
use super::{Auto, Candidate, Planned, Portfolio};
use crate::complementarity::parts::nonlinear::{by_a_row, nearby};
use crate::complementarity::reform::Presolve;
use crate::complementarity::reform::presolve::reduces;
use crate::core::exact_cones::Refutation;
use crate::core::meter::Meter;
use crate::core::register::Composed;
use crate::core::trace::Trace;
use crate::{Limits, Observer, Outcome, Progress, Sample, Session, SolveError, Status};

/// Up to this many variables arcs come before Newton's steps.
const FEW: usize = 500;

/// From so many on arcs come last.
const MANY: usize = 2000;

/// Iterations of arcs before another method is asked, where they are few: most problems need less. And after it has failed.
const SHORT: usize = 40;
const LONG: usize = 300;

/// Stages of the linear `auto` of an affine F; then arcs have their turn, for which the rest of the time is.
const LINEAR: usize = 4;

/// What the search for a proof may cost after the first stage, see `ExactCones::within`: some tenths of a second.
const WORK: u64 = 20_000_000;

impl Auto {
    /// A session for nonlinear problems, without history.
    pub fn nonlinear(self) -> AutoSession {
        let proof = Refutation::default();
        let found = proof.clone();
        let plan = move |problem: &Mcp, stage| {
            if stage == 1 && found.search(problem, WORK) {
                return vec![];
            }
            self.plan_of(problem, stage)
        };
        AutoSession {
            linear: Portfolio::new(move |problem: &BoxLcp, stage| match stage {
                0..LINEAR => problem.plan(&self, stage),
                _ => vec![],
            }),
            nonlinear: Portfolio::new(plan),
            proof,
            refuted: None,
            searched: false,
            predictor: Predictor::new(),
            polish: Portfolio::new(polish),
            affine: None,
        }
    }

    /// The solvers of a stage; without what a presolve takes away, where there is something.
    fn plan_of(&self, problem: &Mcp, stage: usize) -> Vec<Candidate> {
        let reduces = reduces(problem);
        let named = |name: &'static str| -> Cow<'static, str> {
            if reduces { format!("{}/{name}", Presolve::NAME).into() } else { name.into() }
        };
        let plan = Plan::new();
        let plan = match stage {
            0 => {
                let arcs = |plan: Plan, most: usize| {
                    plan.anew(named("path"), most, "goes along the pieces of the linearisation")
                };
                let newton = |plan: Plan| {
                    plan.anew(named("semismooth"), 60, "fast where the start is good")
                        .with("restarts", false)
                };
                // Pivots are the cheaper the fewer variables there are. On grids a crash finds the face row of points by row of points, up to its end, and arcs cross a cell for each point that changes sides:
                // from some thousand variables on other steps of Newton's come before them.
                let plan = match problem.dim() {
                    ..=FEW => arcs(newton(arcs(plan, SHORT)), LONG),
                    n => {
                        let plan = newton(plan).with("crash", false);
                        let plan = match n >= MANY {
                            true => plan.anew(named("newton_pfb"), 300, "before many pivots"),
                            false => plan,
                        };
                        arcs(plan, LONG)
                    }
                };
                plan.anew(named("proxi"), 150, "leaves stationary points").anew(
                    named("smooth"),
                    100,
                    "another way",
                )
            }
            1 => plan
                .anew(named("semismooth"), 600, "with other options")
                .anew(named("newton_pfb"), 300, "another memory, other starts")
                .anew(named("newton_fb"), 100, "another function")
                .anew(named("miles"), 60, "linearises complementarity")
                .anew(named("semicomp"), 3000, "leaves stationary points")
                .anew(named("newton_fb"), 600, "other starts")
                .anew(named("miles"), 200, "longer")
                .anew(named("proxi"), 3000, "without crash")
                .with("crash", false),
            _ => {
                let first = 1 + (stage - 2) * self.restarts;
                (first..first + self.restarts).fold(plan, |plan, seed| {
                    plan.anew(named("semismooth"), 200, "from another start")
                        .with("restarts", false)
                        .with("seed", seed)
                })
            }
        };
        plan.0
    }
}

/// A few Newton steps from a solution.
fn polish(problem: &Mcp, stage: usize) -> Vec<Candidate> {
    if stage > 0 {
        return vec![];
    }
    let named = |name: &'static str| -> Cow<'static, str> {
        if reduces(problem) { format!("{}/{name}", Presolve::NAME).into() } else { name.into() }
    };
    // Where the Jacobian is singular each step of the arcs halves the distance.
    Plan::new()
        .then(named("newton_min"), 5, "to the last digits")
        .then(named("path"), 10, "to the last digits")
        .0
}

/// What the natural residual of a solution is brought to, in units of the tolerance, but for what no double need reach.
const FINER: f64 = 1e-2;
const FINEST: f64 = 1e-10;
/// More variables have it brought to the tolerance itself: a step may cost as much as the solve.
const CHEAP: usize = 5000;

/// That residual.
fn fine(problem: &Mcp, tolerance: f64) -> f64 {
    match problem.dim() <= CHEAP {
        true => (FINER * tolerance).max(FINEST).min(tolerance),
        false => tolerance,
    }
}

/// The session: the linear `auto` of affine problems, the plan of others.
pub struct AutoSession {
    linear: Portfolio<BoxLcp>,
    nonlinear: Portfolio<Mcp>,
    /// What the plan has come upon.
    proof: Refutation,
    /// Why there is no solution, where that was found; and whether solvers were tried.
    refuted: Option<String>,
    searched: bool,
    predictor: Predictor,
    /// Of what solves a problem in units of its rows, but not yet in those of F.
    polish: Portfolio<Mcp>,
    /// The account of the linear solve, if there was one, and whether its word was the last.
    affine: Option<(Vec<String>, bool)>,
}

impl AutoSession {
    /// The solve of a problem that is not affine.
    fn observe_nonlinear(
        &mut self,
        problem: &Mcp,
        point: &mut LcpPoint,
        limits: &Limits,
        observer: &mut dyn Observer<Mcp>,
    ) -> Result<Outcome, SolveError> {
        let begun = Instant::now();
        let scope = limits.budget(begun).enter();
        if let Some(proof) = by_a_row(problem) {
            let measure = problem.certify(point, &mut problem.gauge()?);
            let outcome =
                Meter::start(begun, limits).outcome(Status::Infeasible(proof), measure, 0);
            self.refuted = Some("a row has one sign on the whole box: there is no solution".into());
            return Ok(outcome);
        }
        drop(scope);
        self.proof.clear();
        self.searched = true;
        let given = self.predictor.start(problem, point, &limits.left(begun));
        let mut outcome = self.nonlinear.observe(problem, point, &limits.left(begun), observer)?;
        if let Some(mut trial) = given
            && matches!(outcome.status, Status::Stalled(_))
        {
            // From where the caller wanted to begin.
            let max_iterations = limits.max_iterations.saturating_sub(outcome.iterations);
            let left = Limits { max_iterations, ..limits.left(begun) };
            let other = self.nonlinear.observe(problem, &mut trial, &left, observer)?;
            if other.status == Status::Solved || other.measure.is_better_than(&outcome.measure) {
                (*point, outcome) = (trial, other);
            }
        }
        if self.proof.settle(&mut outcome) {
            let why = "the bounds of the terms that are not linear leave no solution, in exact arithmetic";
            self.refuted = Some(why.into());
        }
        Ok(outcome)
    }

    /// Makes the natural residual of a solution as small as [`fine`] says, where that is to be had.
    fn finish(
        &mut self,
        problem: &Mcp,
        point: &mut LcpPoint,
        outcome: Outcome,
        limits: &Limits,
        observer: &mut dyn Observer<Mcp>,
    ) -> Result<Outcome, SolveError> {
        let Measure { absolute, relative, .. } = outcome.measure;
        let target = fine(problem, limits.tolerance);
        let rough = outcome.status == Status::Solved && absolute > target && absolute.is_finite();
        let steps = limits.max_iterations.saturating_sub(outcome.iterations);
        if !rough || steps == 0 {
            return Ok(outcome);
        }
        let begun = Instant::now();
        let mut outcome = outcome;
        let mut finer = point.clone();
        // The two residuals fall together.
        let closer = 0.5 * relative.min(limits.tolerance) * (target / absolute);
        let tolerance = closer.max(f64::EPSILON);
        let left = Limits { tolerance, max_iterations: steps, ..limits.clone() };
        let polished = self.polish.observe(problem, &mut finer, &left, observer)?;
        outcome.iterations += polished.iterations;
        outcome.factorisations += polished.factorisations;
        let better = |measure: &Measure, than: &Measure| {
            measure.absolute < than.absolute && measure.passes(limits.tolerance)
        };
        if better(&polished.measure, &outcome.measure) {
            (*point, outcome.measure) = (finer.clone(), polished.measure);
        } else {
            finer.z.copy_from_slice(&point.z);
        }
        let scope = limits.budget(begun).enter();
        if outcome.measure.absolute > target && nearby(problem, &mut finer.z, target) {
            let measure = problem.certify(&finer, &mut problem.gauge()?);
            if better(&measure, &outcome.measure) {
                (*point, outcome.measure) = (finer, measure);
            }
        }
        drop(scope);
        outcome.seconds += begun.elapsed().as_secs_f64();
        Ok(outcome)
    }

    /// What was done for a problem that is not affine.
    fn nonlinear_account(&self) -> Vec<String> {
        let before = if self.searched { self.nonlinear.account() } else { vec![] };
        let start = self.predictor.account().filter(|_| self.searched);
        start.into_iter().chain(before).chain(self.refuted.clone()).collect()
    }
}

/// Sees the linear problem's solve as one of the nonlinear problem: the points are the same.
struct Same<'a>(&'a mut dyn Observer<Mcp>);

impl Observer<BoxLcp> for Same<'_> {
    fn step(&mut self, progress: &Progress) {
        self.0.step(progress);
    }

    fn keeps_best(&self) -> bool {
        self.0.keeps_best()
    }

    fn best(&mut self, point: &LcpPoint, measure: &nonsmooth_problem::check::Measure) {
        self.0.best(point, measure);
    }
}

impl Session<Mcp> for AutoSession {
    fn observe(
        &mut self,
        problem: &Mcp,
        point: &mut LcpPoint,
        limits: &Limits,
        observer: &mut dyn Observer<Mcp>,
    ) -> Result<Outcome, SolveError> {
        limits.validate()?;
        problem.validate_point(point)?;
        self.affine = None;
        (self.refuted, self.searched) = (None, false);
        let begun = Instant::now();
        let Some((linear, _)) = problem.affine() else {
            let outcome = self.observe_nonlinear(problem, point, limits, observer)?;
            return self.finish(problem, point, outcome, &limits.left(begun), observer);
        };
        let mut trial = point.clone();
        let outcome = self.linear.observe(&linear, &mut trial, limits, &mut Same(observer))?;
        let mut account = vec!["F is affine: the linear auto".to_owned()];
        account.extend(self.linear.account().into_iter().map(|line| format!("  {line}")));
        let measure = problem.certify(&trial, &mut problem.gauge()?);
        // Proofs and solutions are looked at again: the coefficients may be rounded.
        let status = match &outcome.status {
            Status::Solved if measure.passes(limits.tolerance) => Some(Status::Solved),
            Status::Infeasible(proof) => match problem.evidence(proof.certificate()) {
                nonsmooth_problem::check::Evidence::Proved(proof) => {
                    Some(Status::Infeasible(proof))
                }
                _ => None,
            },
            Status::Limit(limit) => Some(Status::Limit(*limit)),
            _ => None,
        };
        self.affine = Some((account, status.is_some()));
        if let Some(status) = status {
            *point = trial;
            let outcome = Outcome { status, measure, ..outcome };
            return self.finish(problem, point, outcome, &limits.left(begun), observer);
        }
        let max_iterations = limits.max_iterations.saturating_sub(outcome.iterations);
        let left = Limits { max_iterations, ..limits.left(begun) };
        let then = self.observe_nonlinear(problem, point, &left, observer)?;
        let then = self.finish(problem, point, then, &limits.left(begun), observer)?;
        let mut status = then.status;
        if !matches!(status, Status::Solved) {
            // What is known of the linear problem is more than that nothing solved it.
            let near = matches!(outcome.status, Status::NearlyInfeasible { .. });
            if near && !matches!(status, Status::Limit(_)) {
                status = outcome.status;
            }
            if measure.is_better_than(&then.measure) {
                *point = trial;
                return Ok(Outcome { status, measure, ..then });
            }
        }
        Ok(Outcome { status, iterations: outcome.iterations + then.iterations, ..then })
    }

    fn history(&self) -> &[Sample] {
        match self.affine {
            Some((_, true)) => self.linear.history(),
            _ if !self.searched => &[],
            _ => self.nonlinear.history(),
        }
    }

    fn trace(&self) -> Trace {
        match self.affine {
            Some((_, true)) => self.linear.trace(),
            _ if !self.searched => Trace::None,
            _ => self.nonlinear.trace(),
        }
    }

    fn account(&self) -> Vec<String> {
        match &self.affine {
            Some((account, true)) => account.clone(),
            Some((account, false)) => [account.clone(), self.nonlinear_account()].concat(),
            None => self.nonlinear_account(),
        }
    }
}
