//! The loop over steps: halvings, limits, observers. What moves is a [`Driven`].

use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};

use nonsmooth_solve::{Limit, Limits, Status};

use crate::SimulateError;
use crate::error::require;
use crate::report::{RunReport, StepReport, StepStatus};

/// The status of a step that the caller's flag ended; it is not taken.
pub(crate) const CANCELLED: StepStatus = StepStatus::Solver(Status::Limit(Limit::Cancelled));

/// Whether a run goes on.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Control {
    /// It does.
    Continue,
    /// It ends here.
    Stop,
}

/// Who follows a run of a simulation `S`: recorders, plots, tests.
pub trait Observer<S = crate::Simulation> {
    /// Called before each step, of length h.
    fn before(&mut self, _simulation: &mut S, _h: f64) {}

    /// Called after each step.
    fn step(&mut self, simulation: &S, report: &StepReport) -> Control;
}

impl<S> Observer<S> for () {
    fn step(&mut self, _: &S, _: &StepReport) -> Control {
        Control::Continue
    }
}

impl<S, F: FnMut(&S, &StepReport) -> Control> Observer<S> for F {
    fn step(&mut self, simulation: &S, report: &StepReport) -> Control {
        self(simulation, report)
    }
}

/// A simulation as the loop sees it: steps are tried first, and then taken or not.
pub(crate) trait Driven {
    /// All that the next step depends on.
    type State: Clone;

    fn time(&self) -> f64;
    fn state(&mut self) -> &mut Self::State;
    fn limits(&self) -> &Limits;
    /// How often a step that fails may be cut in two.
    fn halvings(&self) -> u8;
    /// Whether the state, and what moves it, are such that a step can be tried.
    fn check(&mut self) -> Result<(), SimulateError>;
    /// A step as it would be.
    fn attempt(&mut self, h: f64) -> Result<StepReport, SimulateError>;
    /// Takes the step tried last.
    fn take(&mut self, report: &mut StepReport, h: f64) -> Result<(), SimulateError>;
    /// Forgets it.
    fn discard(&mut self);
}

/// Does one step of length h, in halves where it fails and may be cut.
pub(crate) fn step<S: Driven>(simulation: &mut S, h: f64) -> Result<StepReport, SimulateError> {
    require(|| "h".into(), h, h > 0.0, "a positive number")?;
    simulation.check()?;
    advance(simulation, h, 0)
}

/// Whether the state is that after the step.
fn is_taken(report: &StepReport) -> bool {
    report.status != StepStatus::NotFinite && report.status != CANCELLED
}

fn advance<S: Driven>(s: &mut S, h: f64, level: u8) -> Result<StepReport, SimulateError> {
    let mut report = s.attempt(h)?;
    let solved = report.status == StepStatus::Solved;
    let cancelled = report.status == CANCELLED;
    if !solved && !cancelled && level < s.halvings() {
        let before = s.state().clone();
        let halves = advance(s, 0.5 * h, level + 1).and_then(|first| match is_taken(&first) {
            false => Ok(first),
            true => advance(s, 0.5 * h, level + 1).map(|second| match is_taken(&second) {
                false => second,
                true => joined(first, second),
            }),
        });
        return match halves {
            Ok(report) if is_taken(&report) => Ok(report),
            // Half an answer is none: the state is that before the step.
            left => {
                *s.state() = before;
                s.discard();
                left.map(|report| StepReport { t: s.time(), h, ..report })
            }
        };
    }
    if is_taken(&report) {
        s.take(&mut report, h)?;
        report.t = s.time();
    } else {
        s.discard();
    }
    Ok(report)
}

/// Steps of length h until `until`; the last one is shorter where h does not divide what is left.
pub(crate) fn run<S: Driven>(
    simulation: &mut S,
    until: f64,
    h: f64,
    observer: &mut dyn Observer<S>,
) -> Result<RunReport, SimulateError> {
    require(|| "h".into(), h, h > 0.0, "a positive number")?;
    require(|| "until".into(), until, until >= 0.0, "a time of at least 0 s")?;
    let counted = h > f64::EPSILON * until.abs();
    require(|| "h".into(), h, counted, "a step that moves the time, above 2.3e-16 of it")?;
    simulation.check()?;
    let mut run = RunReport { t: simulation.time(), ..RunReport::default() };
    // What is left of the last step up to the rounding of the sum that time is is no step: t/h terms, each rounded by ε t.
    let summed = f64::EPSILON * until.abs() * (until.abs() / h).max(4.0);
    let left = until - simulation.time();
    if left <= summed.min(1e-3 * h) {
        return Ok(run);
    }
    let shortest = h.min(left);
    let rounding = summed.clamp(1e-9 * shortest, 1e-3 * shortest);
    while simulation.time() < until - rounding {
        if is_cancelled(simulation.limits()) {
            run.stopped = true;
            break;
        }
        let left = until - simulation.time();
        let h = if left < h * (1.0 - 1e-9) { left } else { h };
        observer.before(simulation, h);
        let report = step(simulation, h)?;
        if report.status == CANCELLED {
            // Half an answer is none: the state is that before the step.
            run.stopped = true;
            break;
        }
        run.note(&report);
        let ended = report.status == StepStatus::NotFinite;
        if observer.step(simulation, &report) == Control::Stop || ended {
            run.stopped = true;
            break;
        }
    }
    Ok(run)
}

fn is_cancelled(limits: &Limits) -> bool {
    let set = |flag: &Arc<AtomicBool>| flag.load(Ordering::Relaxed);
    limits.cancel.as_ref().is_some_and(set)
}

/// The report of two halves of a step.
fn joined(first: StepReport, second: StepReport) -> StepReport {
    let depth = |s: &StepStatus| match s {
        StepStatus::Halved(n) => Some(n + 1),
        StepStatus::Solved => Some(1),
        _ => None,
    };
    let status = match (depth(&first.status), depth(&second.status)) {
        (Some(a), Some(b)) => StepStatus::Halved(a.max(b)),
        (None, _) => first.status.clone(),
        (_, None) => second.status.clone(),
    };
    let mut drift = second.drift;
    drift.penetration = drift.penetration.max(first.drift.penetration);
    drift.quaternion = drift.quaternion.max(first.drift.quaternion);
    drift.joints = drift.joints.max(first.drift.joints);
    let mut timings = second.timings;
    timings.detection += first.timings.detection;
    timings.assembly += first.timings.assembly;
    timings.solve += first.timings.solve;
    timings.total += first.timings.total;
    StepReport {
        status,
        h: first.h + second.h,
        residual: first.residual.max(second.residual),
        energy: first.energy.then(second.energy),
        newton: first.newton.max(second.newton),
        drift,
        timings,
        ..second
    }
}

#[cfg(test)]
mod tests {
    use crate::{Body, MoreauJean, Shape, Simulation, World};

    #[test]
    fn a_time_that_is_reached_has_no_step_left() {
        for h in [1e-4, 3e-3, 0.7] {
            let mut world = World::default();
            world.add(Body::solid(Shape::Sphere { radius: 0.1 }, 1.0).unwrap());
            let mut simulation = Simulation::new(world, MoreauJean::default()).unwrap();
            let mut steps =
                |until: f64, h: f64| simulation.run(until, h, &mut ()).unwrap().steps as usize;
            assert_eq!(steps(0.4, h), (0.4 / h).ceil() as usize);
            assert_eq!([steps(0.4, h), steps(0.4, h), steps(0.2, h)], [0; 3], "{h}");
            // What is more than rounding is left, however little it is.
            assert_eq!([steps(0.4 + 1e-9, h), steps(0.4 + 2e-9, 1e-10)], [1, 10], "{h}");
        }
    }
}
