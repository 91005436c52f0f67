//! What a solve uses up: wall clock, processor time, factorisations.

use std::time::Instant;

use cpu_time::ProcessTime;
use nonsmooth_linalg::budget::Scope;
use nonsmooth_linalg::factorisations;
use nonsmooth_problem::check::Measure;

use crate::SolveError;
use crate::core::limits::{Limit, Limits};
use crate::core::status::{Outcome, Status};

/// What a solve uses up, from the preparation of the workspace on.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Meter {
    /// When the solve was asked for: limits count from here, with the judge's preparation.
    pub(crate) begun: Instant,
    pub(super) wall: Instant,
    cpu: Option<ProcessTime>,
    factorisations: u64,
}

impl Meter {
    pub(crate) fn start(begun: Instant, limits: &Limits) -> Self {
        Self::since(Instant::now(), begun, limits)
    }

    /// As if started at `wall`.
    pub(super) fn since(wall: Instant, begun: Instant, limits: &Limits) -> Self {
        let cpu = limits.cpu_time.then(ProcessTime::now);
        Self { begun, wall, cpu, factorisations: factorisations() }
    }

    pub(crate) fn seconds(&self) -> f64 {
        self.seconds_at(Instant::now())
    }

    pub(super) fn seconds_at(&self, now: Instant) -> f64 {
        now.duration_since(self.wall).as_secs_f64()
    }

    /// What a failure of the preparation comes to: where a limit was reached, a preparation that was cut short proves nothing of the problem.
    pub(crate) fn ended(
        &self,
        measure: Measure,
        limits: &Limits,
        scope: &Scope,
        error: SolveError,
    ) -> Result<Outcome, SolveError> {
        let inapplicable = error.is_inapplicable();
        match (raised(scope), scope.refused()) {
            (Some(limit), _) if inapplicable => {
                let limit = limits.reached(self.begun).unwrap_or(limit);
                Ok(self.outcome(Status::Limit(limit), measure, 0))
            }
            (_, Some(refused)) if inapplicable => Err(refused.into()),
            _ => Err(error),
        }
    }

    pub(crate) fn outcome(&self, status: Status, measure: Measure, iterations: usize) -> Outcome {
        self.outcome_at(Instant::now(), status, measure, iterations)
    }

    pub(super) fn outcome_at(
        &self,
        now: Instant,
        status: Status,
        measure: Measure,
        iterations: usize,
    ) -> Outcome {
        Outcome {
            status,
            measure,
            iterations,
            factorisations: factorisations() - self.factorisations,
            seconds: self.seconds_at(now),
            cpu_seconds: self.cpu.map(|cpu| cpu.elapsed().as_secs_f64()),
        }
    }
}

/// The limit at which a kernel was cut short, if one was.
pub(super) fn raised(scope: &Scope) -> Option<Limit> {
    let limit = || if scope.cancelled() { Limit::Cancelled } else { Limit::Time };
    scope.raised().then(limit)
}
