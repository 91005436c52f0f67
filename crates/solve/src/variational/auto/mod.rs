//! **auto** for variational inequalities: the multipliers' complementarity problem where there is one, projections else and after it.
//!
//! Problem: find x ∈ X with `F(x)ᵀ(y − x) ≥ 0` for all y ∈ X. Method: over polyhedra of many dense rows first those rows that matter (`rows.rs`); over boxes and polyhedra the `auto` of mixed complementarity problems, on the problem itself or with multipliers as variables; then, and over
//! other sets at once, the hyperplane projection and the extragradient method by turns, each from the best point so far. The turns come again with budgets that grow, of iterations, never of seconds, so that a run repeats itself; all share
//! the limits of the solve, and the natural residual of the inequality judges them all. After the first turns a proof is looked for that there is no solution, in exact arithmetic: multipliers do it for boxes and polyhedra, a relaxation for cones.
//!
//! References: the solvers' own files; FacchineiPang2003. Cost: that of the solvers tried. Fails: where F is not monotone and the set is a ball or a cone: projections need monotone F.

mod rows;

use nonsmooth_linalg::budget;
use nonsmooth_problem::{LcpPoint, Problem, Set, Vi};
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use super::parts::Projector;
use super::projection::NO_PROJECTION;
use super::reform::Multipliers;
use crate::core::exact_cones::Refutation;
use crate::core::portfolio::{Candidate, Portfolio};
use crate::core::register::{About, Described, Solves};
use crate::core::settings::{Settings, SettingsMap, described};
use crate::core::trace::Trace;
use crate::{Limits, Observer, Outcome, Sample, Session, SolveError, Status};
use rows::Rows;

/// The hyperparameters of `auto` for variational inequalities; none needs to be set.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields, default)]
pub struct VariationalAuto {
    /// The iterations of the complementarity problem's `auto` in its first turn; ten times as many in each that follows.
    pub multipliers: usize,
    /// The iterations of a projection method in its first turn; four times as many in each that follows.
    pub projections: usize,
}

impl Default for VariationalAuto {
    fn default() -> Self {
        Self { multipliers: 1000, projections: 5000 }
    }
}

impl Settings for VariationalAuto {}

impl Described for VariationalAuto {
    const ABOUT: &'static About = &About {
        name: "auto",
        family: "auto",
        solves: Solves::Law,
        summary: "needs no setting: over boxes and polyhedra the auto of mcp behind multipliers, then projections",
        needs: &[],
        cites: &["FacchineiPang2003"],
        variants: &[],
        settings: described::<Self>,
    };
}

/// Turns after which no budget is too small any more.
const TURNS: usize = 10;
/// Entries of the rows of polyhedra, zeros included, above which projections are too dear: they are stored dense.
const DENSE: usize = 10_000_000;
/// What the search for a proof that there is no solution may cost over balls and cones, see `ExactCones::within`: some tenths of a second.
const WORK: u64 = 20_000_000;

impl VariationalAuto {
    /// A session without history.
    pub fn session(self) -> AutoSession {
        let proof = Refutation::default();
        let found = proof.clone();
        let plan = move |problem: &Vi, stage| {
            // Multipliers have looked for it themselves.
            let unseen = stage == 1 && !Multipliers::applies(&problem.set);
            if unseen && found.search(problem, WORK) {
                return vec![];
            }
            self.plan(problem, stage)
        };
        AutoSession {
            portfolio: Portfolio::new(plan),
            proof,
            rows: Rows::default(),
            by_rows: false,
            iterations: self.multipliers,
        }
    }

    fn plan(&self, problem: &Vi, stage: usize) -> Vec<Candidate> {
        if stage >= TURNS || (stage > 0 && is_empty(problem)) {
            return vec![];
        }
        let grown = |first: usize, by: usize| first.saturating_mul(by.pow(stage as u32));
        let candidate = |name: &'static str, iterations, because: &str, anew| Candidate {
            name: name.into(),
            settings: SettingsMap::new(),
            iterations,
            because: because.into(),
            anew,
        };
        let mut plan = vec![];
        if projects(problem) {
            let steps = grown(self.projections, 4);
            plan.push(candidate("hyperplane", steps, "needs values of F and projections", false));
            plan.push(candidate("extragradient", steps, "needs no hyperplane", false));
        }
        if Multipliers::applies(&problem.set) {
            let because = if problem.set.bounds().is_some() {
                "over a box it is a complementarity problem"
            } else {
                "over a polyhedron its multipliers are variables"
            };
            let steps = grown(self.multipliers, 10);
            let multipliers = candidate("multipliers/auto", steps, because, true);
            // At first, and after the projections where these had their turn.
            plan.insert(if stage == 0 { 0 } else { plan.len() }, multipliers);
        }
        plan
    }
}

/// Whether the set is known to have no point; not where that costs too much, or the time is over.
fn is_empty(problem: &Vi) -> bool {
    let mut nearest = vec![0.0; problem.dim()];
    projects(problem)
        && !Projector::new(&problem.set).onto(&problem.start, &mut nearest)
        && !budget::over()
}

/// Whether the projection on the set is affordable.
fn projects(problem: &Vi) -> bool {
    let entries = |set: &Set| match set {
        Set::Polyhedron { A, C, .. } => (A.nrows() + C.nrows()).saturating_mul(A.ncols()),
        _ => 0,
    };
    problem.set.parts().into_iter().map(|(_, set)| entries(set)).sum::<usize>() <= DENSE
}

/// The session: the solvers of the plan, and what is said where none of them can succeed.
pub struct AutoSession {
    portfolio: Portfolio<Vi>,
    /// What the plan has come upon.
    proof: Refutation,
    /// Where rows are many, and whether it ended the solve.
    rows: Rows,
    by_rows: bool,
    /// Of the complementarity problem's `auto`.
    iterations: usize,
}

impl Session<Vi> for AutoSession {
    fn observe(
        &mut self,
        problem: &Vi,
        point: &mut LcpPoint,
        limits: &Limits,
        observer: &mut dyn Observer<Vi>,
    ) -> Result<Outcome, SolveError> {
        let begun = std::time::Instant::now();
        self.proof.clear();
        limits.validate()?;
        problem.validate_point(point)?;
        self.by_rows = false;
        if Rows::applies(problem) {
            let found = self.rows.observe(problem, point, limits, self.iterations, observer)?;
            self.by_rows = found.is_some();
            if let Some(outcome) = found {
                return Ok(outcome);
            }
        }
        let left = limits.left(begun);
        let mut outcome = self.portfolio.observe(problem, point, &left, observer)?;
        self.proof.settle(&mut outcome);
        if matches!(outcome.status, Status::Stalled(_)) {
            let _scope = limits.budget(begun).enter();
            if is_empty(problem) {
                outcome.status = Status::Stalled(NO_PROJECTION.into());
            }
        }
        Ok(outcome)
    }

    fn history(&self) -> &[Sample] {
        if self.by_rows { self.rows.history() } else { self.portfolio.history() }
    }

    fn trace(&self) -> Trace {
        if self.by_rows { Trace::None } else { self.portfolio.trace() }
    }

    fn account(&self) -> Vec<String> {
        if self.by_rows { self.rows.account() } else { self.portfolio.account() }
    }

    fn gauge(&mut self) -> Option<&mut <Vi as nonsmooth_problem::Problem>::Gauge> {
        if self.by_rows { self.rows.gauge() } else { self.portfolio.gauge() }
    }
}
