//! **auto** for variational inequalities: Newton's methods behind multipliers where they apply, then projections.
//!
//! Problem: find x ∈ X with `F(x)ᵀ(y − x) ≥ 0` for all y ∈ X. Method: over boxes and polyhedra the multipliers' complementarity problem by `semismooth` and, where that does not solve it, by `proxi`,
//! each from the start; over other sets, and in the end, the hyperplane projection and the extragradient method by turns, each from where the one before ended. A method that says that it has finished, or that it cannot go on, is left for the next.
//!
//! References: the solvers' own files; FacchineiPang2003. Cost: that of the solvers tried. Fails: where F is not monotone and the set is a ball or a cone: projections need monotone F.

use nonsmooth_problem::{LcpPoint, Mcp, Vi};
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use super::projection::{Extragradient, Hyperplane};
use super::reform::Multipliers;
use crate::core::boxed::BoxedWork;
use crate::core::register::{About, Described, Solves, solver};
use crate::core::settings::{Settings, SettingsMap, described};
use crate::{Boxed, SolveError, Solver, Step, Via};

/// The hyperparameters of `auto` for variational inequalities; none needs to be set.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields, default)]
pub struct VariationalAuto {
    /// The most steps of each of Newton's methods.
    pub newton: usize,
    /// The steps of a projection method in its turn.
    pub projections: usize,
}

impl Default for VariationalAuto {
    fn default() -> Self {
        Self { newton: 300, projections: 5000 }
    }
}

impl Settings for VariationalAuto {}

impl Described for VariationalAuto {
    const ABOUT: &'static About = &About {
        name: "auto",
        family: "auto",
        solves: Solves::Law,
        summary: "needs no setting: Newton's methods behind multipliers where they apply, then projections",
        needs: &[],
        cites: &["FacchineiPang2003"],
        variants: &[],
        settings: described::<Self>,
    };
}

/// One of the solvers tried.
struct Stage {
    name: &'static str,
    solver: Boxed<Vi>,
    steps: usize,
    /// From the start of the solve, not from where the one before ended.
    anew: bool,
}

/// The solvers to come, and the one at work.
pub struct Work {
    stages: Vec<Stage>,
    at: usize,
    current: Option<(BoxedWork<Vi>, usize)>,
    start: LcpPoint,
    tolerance: f64,
    account: Vec<String>,
}

impl VariationalAuto {
    fn stages(&self, problem: &Vi) -> Vec<Stage> {
        let mut stages = vec![];
        if Multipliers::applies(&problem.set) {
            for name in ["semismooth", "proxi"] {
                if let Some(Ok(newton)) = solver::<Mcp>(name, &SettingsMap::new()) {
                    let solver = Boxed::new(Via { reformulation: Multipliers, solver: newton });
                    stages.push(Stage { name, solver, steps: self.newton, anew: true });
                }
            }
        }
        let steps = self.projections;
        let mut projection = |name, solver| stages.push(Stage { name, solver, steps, anew: false });
        projection("hyperplane", Boxed::new(Hyperplane::default()));
        projection("extragradient", Boxed::new(Extragradient::default()));
        stages
    }
}

impl Work {
    /// The next solver at work, the projections by turns. False where none begins.
    fn next(&mut self, problem: &Vi, point: &mut LcpPoint) -> bool {
        // Each once more, at most.
        for _ in 0..2 * self.stages.len() {
            let stage = &self.stages[self.at];
            match stage.solver.work(problem) {
                Ok(mut work) => {
                    if stage.anew {
                        point.z.copy_from_slice(&self.start.z);
                    }
                    stage.solver.aim(self.tolerance, &mut work);
                    stage.solver.start(problem, point, &mut work);
                    self.current = Some((work, 0));
                    return true;
                }
                Err(refused) => self.account.push(format!("{}: {refused}", stage.name)),
            }
            self.advance();
        }
        false
    }

    fn advance(&mut self) {
        self.at += 1;
        if self.at == self.stages.len() {
            self.at -= 2;
        }
    }
}

impl Solver<Vi> for VariationalAuto {
    type Work = Work;

    fn work(&self, problem: &Vi) -> Result<Work, SolveError> {
        Ok(Work {
            stages: self.stages(problem),
            at: 0,
            current: None,
            start: LcpPoint { z: problem.start.clone() },
            tolerance: 1e-8,
            account: vec![],
        })
    }

    fn aim(&self, tolerance: f64, work: &mut Work) {
        work.tolerance = tolerance;
    }

    fn start(&self, _: &Vi, point: &mut LcpPoint, work: &mut Work) {
        (work.at, work.current) = (0, None);
        work.account.clear();
        work.start.z.clone_from(&point.z);
    }

    fn step(&self, problem: &Vi, point: &mut LcpPoint, work: &mut Work) -> Step {
        if work.current.is_none() && !work.next(problem, point) {
            return Step::Stuck("no method applies".into());
        }
        let Work { stages, at, current: Some((inner, steps)), account, .. } = work else {
            return Step::Stuck("no method applies".into());
        };
        let stage = &stages[*at];
        *steps += 1;
        let why = match stage.solver.step(problem, point, inner) {
            Step::Continue { estimate } if *steps < stage.steps => {
                return Step::Continue { estimate };
            }
            Step::Continue { .. } => "its steps are done".to_owned(),
            Step::Done => "it has finished".to_owned(),
            Step::Stuck(why) => why.into_owned(),
            Step::NoSolution(_) => "it ended on a ray".to_owned(),
        };
        account.push(format!("{}: {} steps, {why}", stage.name, *steps));
        stage.solver.publish(problem, point, inner);
        let (last, steps) = (work.at + 1 == work.stages.len(), *steps);
        // A projection that cannot go on at once will not in its next turn.
        if last && steps <= 1 {
            return Step::Stuck(why.into());
        }
        work.current = None;
        work.advance();
        // The judge looks at what there is.
        Step::Continue { estimate: 0.0 }
    }

    fn publish(&self, problem: &Vi, point: &mut LcpPoint, work: &mut Work) {
        if let Some((inner, _)) = &mut work.current {
            work.stages[work.at].solver.publish(problem, point, inner);
        }
    }

    fn account(&self, work: &Work) -> Vec<String> {
        let mut account = work.account.clone();
        if let Some((_, steps)) = &work.current {
            account.push(format!("{}: {steps} steps", work.stages[work.at].name));
        }
        account
    }

    fn check_every(&self) -> usize {
        10
    }
}
