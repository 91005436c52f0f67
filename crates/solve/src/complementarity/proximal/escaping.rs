//! The solver that the methods of the family are: a crash, then the escape around the inner method of each.

use nonsmooth_problem::{LcpPoint, Mcp};

use crate::complementarity::form::Model;
use crate::complementarity::parts::nonlinear::{
    CHECK_EVERY, Crash, Escape, Inner, Moved, STATIONARY, Solve, UNDEFINED,
};
use crate::{SolveError, Solver, Step};

/// What tells one method of the family from another.
pub trait Escaping: Send + Sync {
    /// What descends.
    type Inner: Inner;

    /// The inner method, for problems of this model.
    fn inner(&self, model: &Model) -> Self::Inner;

    /// Whether projected Newton steps that look for the active set come first.
    fn crash(&self) -> bool;
}

/// The workspace of a method with the inner method I.
pub struct Work<I> {
    solve: Solve,
    crash: Crash,
    escape: Escape<I>,
}

impl<M: Escaping> Solver<Mcp> for M {
    type Work = Work<M::Inner>;

    fn work(&self, problem: &Mcp) -> Result<Self::Work, SolveError> {
        let solve = Solve::new(problem);
        let escape = Escape::new(self.inner(&solve.model), problem.dim());
        Ok(Work { crash: Crash::new(&solve.model), escape, solve })
    }

    fn aim(&self, tolerance: f64, work: &mut Self::Work) {
        work.solve.aim(tolerance);
    }

    fn start(&self, _: &Mcp, point: &mut LcpPoint, work: &mut Self::Work) {
        work.solve.begin(point);
        work.crash.begin(self.crash());
        work.escape.begin();
    }

    fn step(&self, _: &Mcp, _: &mut LcpPoint, work: &mut Self::Work) -> Step {
        let Work { solve, crash, escape } = work;
        if !crash.is_over() {
            crash.step(&mut solve.model, &mut solve.at);
            return solve.goes_on();
        }
        if solve.at.least == f64::INFINITY {
            return solve.ends(UNDEFINED);
        }
        let moved = escape.step(&mut solve.model, &mut solve.at);
        solve.note(moved);
        if moved == Moved::Stuck { solve.ends(STATIONARY) } else { solve.goes_on() }
    }

    fn publish(&self, _: &Mcp, point: &mut LcpPoint, work: &mut Self::Work) {
        work.solve.publish(point);
    }

    fn account(&self, work: &Self::Work) -> Vec<String> {
        let [escapes, centres] = work.escape.counts;
        work.solve.account(vec![format!(
            "crash steps {}, escapes {escapes} with {centres} proximal problems",
            work.crash.steps()
        )])
    }

    fn check_every(&self, _: &Self::Work) -> usize {
        CHECK_EVERY
    }
}
