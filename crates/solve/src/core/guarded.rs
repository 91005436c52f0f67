//! A session that keeps its limits, whatever its solver does; see [`guard`](crate::core::guard).

use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::{Arc, Mutex};
use std::time::Instant;

use nonsmooth_problem::Problem;
use nonsmooth_problem::check::Measure;

use super::register::bare;
use crate::core::guard::{self, locked};
use crate::core::meter::Meter;
use crate::core::register::Registered;
use crate::core::settings::SettingsMap;
use crate::core::trace::Trace;
use crate::{Limits, Observer, Outcome, Progress, Sample, Session, SolveError, Status};

/// A session that keeps its limits.
pub(super) struct Guarded<P: Registered> {
    /// None where it was given up: the next solve makes another one.
    session: Option<Box<dyn Session<P>>>,
    name: String,
    settings: SettingsMap,
    /// Of a solve that was given up.
    history: Vec<Sample>,
    account: Vec<String>,
}

/// What the two threads share.
struct Seen<P: Problem> {
    /// Whether the caller's thread asks for progress.
    asked: AtomicBool,
    told: Mutex<Told<P>>,
}

struct Told<P: Problem> {
    progress: Option<Progress>,
    best: Option<(P::Point, Measure)>,
}

/// The observer on the thread of the solve, and its tolerance.
struct Relay<P: Problem>(Arc<Seen<P>>, f64);

impl<P: Problem> Observer<P> for Relay<P> {
    fn step(&mut self, progress: &Progress) {
        if self.0.asked.load(Ordering::Relaxed) {
            locked(&self.0.told).progress = Some(*progress);
            self.0.asked.store(false, Ordering::Relaxed);
        }
    }

    fn keeps_best(&self) -> bool {
        true
    }

    fn best(&mut self, point: &P::Point, measure: &Measure) {
        let mut told = locked(&self.0.told);
        match &mut told.best {
            // A solve that is given up has no answer that were more than the best point.
            Some((kept, of)) if measure.passes(self.1) || measure.is_better_than(of) => {
                P::copy_point(point, kept);
                *of = *measure;
            }
            Some(_) => {}
            none => *none = Some((point.clone(), *measure)),
        }
    }
}

impl<P: Registered> Guarded<P> {
    pub(super) fn new(session: Box<dyn Session<P>>, name: &str, settings: &SettingsMap) -> Self {
        Self {
            session: Some(session),
            name: name.into(),
            settings: settings.clone(),
            history: vec![],
            account: vec![],
        }
    }
}

impl<P: Registered> Session<P> for Guarded<P> {
    fn observe(
        &mut self,
        problem: &P,
        point: &mut P::Point,
        limits: &Limits,
        observer: &mut dyn Observer<P>,
    ) -> Result<Outcome, SolveError> {
        limits.validate()?;
        let mut session = match self.session.take() {
            Some(session) => session,
            None => bare(&self.name, &self.settings)?,
        };
        let unlimited = limits.time_limit.is_none() && limits.cancel.is_none();
        if unlimited || problem.burden() <= guard::SMALL {
            let outcome = session.observe(problem, point, limits, observer);
            self.session = Some(session);
            return outcome;
        }
        let meter = Meter::start(Instant::now(), limits);
        self.history.clear();
        self.account.clear();
        let told = Mutex::new(Told { progress: None, best: None });
        let seen = Arc::new(Seen { asked: AtomicBool::new(true), told });
        let copy = (problem.clone(), point.clone(), seen.clone());
        let left = limits.time_limit.map(|t| t - meter.seconds());
        let left = Limits { time_limit: left.map(|t| t.max(0.0)), ..limits.clone() };
        let history = &mut self.history;
        let mut last = None;
        let tick = || {
            let progress = locked(&seen.told).progress.take();
            if let Some(progress) = progress {
                seen.asked.store(true, Ordering::Relaxed);
                if history.last().is_none_or(|s: &Sample| *s != progress.judged) {
                    history.push(progress.judged);
                }
                last = Some(progress);
                observer.step(&progress);
            }
        };
        let done = guard::run(&left, tick, move |limits| {
            let (problem, mut point, seen) = copy;
            let outcome =
                session.observe(&problem, &mut point, limits, &mut Relay(seen, limits.tolerance));
            (session, point, outcome)
        });
        match done {
            Ok((session, found, outcome)) => {
                self.session = Some(session);
                P::copy_point(&found, point);
                outcome
            }
            Err(limit) => {
                let best = locked(&seen.told).best.take();
                let measure = match best {
                    Some((best, measure)) => {
                        P::copy_point(&best, point);
                        measure
                    }
                    None => Measure::unknown(),
                };
                self.account.push(format!(
                    "{} was given up in the middle of an operation that cannot be interrupted",
                    self.name
                ));
                let solved = measure.passes(limits.tolerance);
                let status = if solved { Status::Solved } else { Status::Limit(limit) };
                // The factorisations of the other thread are not known here.
                Ok(meter.outcome(status, measure, last.map_or(0, |p| p.iteration)))
            }
        }
    }

    fn history(&self) -> &[Sample] {
        self.session.as_ref().map_or(&self.history, |session| session.history())
    }

    fn trace(&self) -> Trace {
        self.session.as_ref().map_or(Trace::None, |session| session.trace())
    }

    fn account(&self) -> Vec<String> {
        self.session.as_ref().map_or_else(|| self.account.clone(), |session| session.account())
    }

    fn gauge(&mut self) -> Option<&mut P::Gauge> {
        self.session.as_mut()?.gauge()
    }
}
