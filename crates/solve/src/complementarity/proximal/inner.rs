//! The loop that the methods of the family share: a crash, then the escape around their inner method.

use nonsmooth_problem::LcpPoint;

use crate::Step;
use crate::complementarity::form::Model;
use crate::complementarity::parts::nonlinear::{
    Crash, Descent, Escape, Inner, Iterate, Moved, Options, Residual, STATIONARY, Solve, UNDEFINED,
};

/// The workspace of a method with the inner method I.
pub struct Work<I> {
    pub solve: Solve,
    pub crash: Crash,
    pub escape: Escape<I>,
}

impl<I: Inner> Work<I> {
    pub fn new(solve: Solve, inner: I) -> Self {
        let n = solve.model.dim();
        Self { crash: Crash::new(&solve.model), escape: Escape::new(inner, n), solve }
    }

    pub fn begin(&mut self, point: &LcpPoint, crash: bool) {
        self.solve.begin(point);
        self.crash.begin(crash);
        self.escape.begin();
    }

    pub fn step(&mut self) -> Step {
        let Self { solve, crash, escape } = self;
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

    pub fn account(&self) -> Vec<String> {
        let [escapes, centres] = self.escape.counts;
        self.solve.account(vec![format!(
            "crash steps {}, escapes {escapes} with {centres} proximal problems",
            self.crash.steps()
        )])
    }
}

/// Damped Newton steps as an inner method.
pub struct Damped<D, F> {
    pub descent: Descent<D, F>,
    pub function: (D, F),
    pub options: Options,
}

impl<D: Residual, F: Residual> Inner for Damped<D, F> {
    fn step(&mut self, model: &mut Model, at: &mut Iterate) -> Moved {
        self.descent.step(model, at)
    }

    fn forget(&mut self) {
        self.descent.restart(self.function.0, self.function.1, self.options);
    }
}
