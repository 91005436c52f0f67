//! A solver whose type is forgotten, and who follows it from outside.

use nonsmooth_problem::Problem;
use nonsmooth_problem::check::Measure;

use crate::SolveError;
use crate::core::limits::Limits;
use crate::core::status::Outcome;
use crate::core::trace::Trace;

/// One visit of the judge.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Sample {
    /// Steps done so far.
    pub iteration: usize,
    /// Seconds since the start of the solve.
    pub seconds: f64,
    /// The relative residual; where another criterion is worse (bilateral constraints, dynamics), that.
    pub relative: f64,
}

/// What a watcher sees after every step.
#[derive(Debug, Clone, Copy)]
pub struct Progress {
    /// The last visit of the judge.
    pub judged: Sample,
    /// The smallest residual judged so far.
    pub best: f64,
    /// Steps done so far.
    pub iteration: usize,
    /// Seconds since the start of the solve.
    pub seconds: f64,
}

/// Who follows a solve from outside.
pub trait Observer<P: Problem> {
    /// Called after every step, judged or not.
    fn step(&mut self, progress: &Progress);

    /// Whether [`best`](Self::best) is to be called, which costs a judgement of the start.
    fn keeps_best(&self) -> bool {
        false
    }

    /// Called with each point that would be returned if the solve stopped now.
    fn best(&mut self, _point: &P::Point, _measure: &Measure) {}
}

/// An observer of steps alone.
struct Steps<'a>(&'a mut dyn FnMut(&Progress));

impl<P: Problem> Observer<P> for Steps<'_> {
    fn step(&mut self, progress: &Progress) {
        (self.0)(progress);
    }
}

/// A solver whose type is forgotten: what the registry hands out. One virtual call per solve, none per step.
pub trait Session<P: Problem>: Send {
    /// Solves `problem` from `point`, which is overwritten with the best point found whatever stops the solve.
    ///
    /// `watch` is called after every step, but for a large problem with a limit on time or a flag to cancel: then now and then. Errors are the
    /// caller's mistakes only.
    ///
    /// `problem` must pass [`Problem::validate`], which a warm session does not ask again at each solve: with fields that were changed to something else (a negative coefficient, a vector that is too
    /// short) it may panic or answer another problem. [`Solve::again`](crate::Solve::again) asks.
    fn solve(
        &mut self,
        problem: &P,
        point: &mut P::Point,
        limits: &Limits,
        watch: &mut dyn FnMut(&Progress),
    ) -> Result<Outcome, SolveError> {
        self.observe(problem, point, limits, &mut Steps(watch))
    }

    /// As [`solve`](Self::solve), with an observer who may also see the best point so far.
    fn observe(
        &mut self,
        problem: &P,
        point: &mut P::Point,
        limits: &Limits,
        observer: &mut dyn Observer<P>,
    ) -> Result<Outcome, SolveError>;

    /// The judge's visits during the last solve, thinned evenly where there were very many.
    fn history(&self) -> &[Sample];

    /// The method's own record of the last solve, if [`Limits::trace`] asked for it and the method keeps one.
    fn trace(&self) -> Trace;

    /// What the solver says that it did during the last solve; empty where it has nothing to tell.
    fn account(&self) -> Vec<String>;

    /// The judge's gauge of the problem last solved, where there is a whole one: for a verdict without another preparation.
    fn gauge(&mut self) -> Option<&mut P::Gauge> {
        None
    }

    /// Hands over a gauge of the problem that is solved next, which then prepares none of its own; by default it is not used.
    fn lend(&mut self, gauge: Box<P::Gauge>) {
        drop(gauge);
    }

    /// Takes the gauge out, where [`gauge`](Self::gauge) shows one.
    fn reclaim(&mut self) -> Option<Box<P::Gauge>> {
        None
    }
}
