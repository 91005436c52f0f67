//! Newton's method on a complementarity function, for nonlinear problems: [`Newton`] with F(x) in place of `M z + q`.
//!
//! A step is one of [`Descent`](crate::complementarity::parts::nonlinear::Descent): the direction of the method's own function, on the merit of a function whose square
//! is differentiable. Where no direction decreases the merit, the method begins again from a perturbed start, a few times.
//!
//! `line_search=none` takes all full steps; `goldstein_price` is Armijo's rule here.
//!
//! References: DeLucaFacchineiKanzow1996; Acary2018 (73)(74). Cost of a step: one LU of the pattern of JF. Fails: stationary points of the merit.

use nonsmooth_problem::{LcpPoint, Mcp};

use super::Newton;
use crate::complementarity::functions::NewtonFunction;
use crate::complementarity::parts::nonlinear::{CHECK_EVERY, Descent, Idle, Inner, Options, Solve};
use crate::core::line_search::LineSearch;
use crate::{SolveError, Solver, Step};

/// The workspace.
pub struct Work<F: NewtonFunction> {
    solve: Solve,
    descent: Descent<F, F::Merit>,
    idle: Idle,
}

/// Steps in which the residual must halve.
const PATIENCE: usize = 100;

fn options(search: LineSearch) -> Options {
    let plain = Options::default();
    match search {
        LineSearch::None => Options { slack: f64::INFINITY, gradient: false, ..plain },
        LineSearch::Armijo | LineSearch::GoldsteinPrice => Options { memory: 1, ..plain },
        LineSearch::Nonmonotone => plain,
    }
}

impl<F: NewtonFunction> Solver<Mcp> for Newton<F> {
    type Work = Work<F>;

    fn work(&self, problem: &Mcp) -> Result<Work<F>, SolveError> {
        let solve = Solve::new(problem);
        let (function, options) = (self.function, options(self.line_search));
        let descent = Descent::new(function, function.merit(), options, &solve.model);
        Ok(Work { solve, descent, idle: Idle::default() })
    }

    fn aim(&self, tolerance: f64, work: &mut Work<F>) {
        work.solve.aim(tolerance);
    }

    fn start(&self, _: &Mcp, point: &mut LcpPoint, work: &mut Work<F>) {
        work.solve.begin(point);
        if self.seed > 0 {
            work.solve.at.perturbed(&mut work.solve.model, self.start_number(0));
        }
        work.descent.restart(self.function, self.function.merit(), options(self.line_search));
        work.idle = Idle::default();
    }

    fn step(&self, _: &Mcp, _: &mut LcpPoint, work: &mut Work<F>) -> Step {
        let Work { solve, descent, idle } = work;
        let moved = descent.step(&mut solve.model, &mut solve.at);
        solve.note(moved);
        let idle_for = idle.note(solve.at.residual);
        if moved.moved() && idle_for <= PATIENCE {
            return solve.goes_on();
        }
        if solve.is_done() || solve.restarts == self.restarts {
            return solve.ends(moved.why());
        }
        solve.restarts += 1;
        solve.at.perturbed(&mut solve.model, self.start_number(solve.restarts));
        descent.restart(self.function, self.function.merit(), options(self.line_search));
        *idle = Idle::default();
        solve.goes_on()
    }

    fn publish(&self, _: &Mcp, point: &mut LcpPoint, work: &mut Work<F>) {
        work.solve.publish(point);
    }

    fn account(&self, work: &Work<F>) -> Vec<String> {
        work.solve.account(vec![])
    }

    fn check_every(&self, _: &Self::Work) -> usize {
        CHECK_EVERY
    }
}
