//! What a solve comes to: its status, which is the judge's word, and its outcome.

use std::borrow::Cow;

use nonsmooth_problem::Problem;
use nonsmooth_problem::check::{Certificate, Evidence, Measure, Proof};

use crate::core::limits::Limit;

/// The answer to "is it solved, and if not, why did it stop". `Solved` is the judge's word, never the solver's.
#[derive(Debug, Clone, PartialEq)]
pub enum Status {
    /// The judge accepts the point at the tolerance asked for.
    Solved,
    /// There is no solution: proved, in exact arithmetic on the stored data.
    Infeasible(Proof),
    /// There is no solution for data that differ from those stored by rounding; nothing is known of the problem as stored.
    NearlyInfeasible {
        /// What holds nearly.
        certificate: Certificate,
        /// The relative change of the data that makes it true.
        change: f64,
    },
    /// The solver ended on a ray that the judge does not accept as a proof.
    NoConclusion(Certificate),
    /// A limit came first.
    Limit(Limit),
    /// The solver could not go on.
    Stalled(Cow<'static, str>),
}

impl Status {
    /// What the status rests on, where it is about there being no solution.
    pub fn certificate(&self) -> Option<&Certificate> {
        match self {
            Status::Infeasible(proof) => Some(proof.certificate()),
            Status::NearlyInfeasible { certificate, .. } | Status::NoConclusion(certificate) => {
                Some(certificate)
            }
            _ => None,
        }
    }

    /// Whether it says that there is no solution, proved or up to rounding.
    pub fn refutes(&self) -> bool {
        matches!(self, Status::Infeasible(_) | Status::NearlyInfeasible { .. })
    }

    /// A short name: `solved`, `infeasible`, `nearly_infeasible`, `no_conclusion`, `iteration_limit`,
    /// `time_limit`, `cancelled`, `stalled`.
    pub fn name(&self) -> &'static str {
        match self {
            Status::Solved => "solved",
            Status::Infeasible(_) => "infeasible",
            Status::NearlyInfeasible { .. } => "nearly_infeasible",
            Status::NoConclusion(_) => "no_conclusion",
            Status::Limit(Limit::Iterations) => "iteration_limit",
            Status::Limit(Limit::Time) => "time_limit",
            Status::Limit(Limit::Cancelled) => "cancelled",
            Status::Stalled(_) => "stalled",
        }
    }
}

impl std::fmt::Display for Status {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        match self {
            Status::Solved => f.write_str("solved"),
            Status::Infeasible(proof) => {
                write!(f, "infeasible: {proof}; proved in exact arithmetic")?;
                // The default tolerance: what is meant contradicts itself by more.
                match proof.margin() {
                    margin if margin < 1e-8 => {
                        write!(f, ", if only by {margin:.0e} of the largest right-hand side")
                    }
                    _ => Ok(()),
                }
            }
            Status::NearlyInfeasible { certificate, change } => write!(
                f,
                "not solved, nearly infeasible: {certificate}, up to rounding: a relative change of the data by {change:.0e} would make it so"
            ),
            Status::NoConclusion(_) => {
                f.write_str("no conclusion: the solver ended on a ray that proves nothing")
            }
            Status::Limit(Limit::Iterations) => f.write_str("not solved: iteration limit reached"),
            Status::Limit(Limit::Time) => f.write_str("not solved: time limit reached"),
            Status::Limit(Limit::Cancelled) => f.write_str("not solved: cancelled"),
            Status::Stalled(why) => write!(f, "not solved: {why}"),
        }
    }
}

/// What a solve came to. The point itself is the caller's, overwritten with the best one judged.
#[derive(Debug, Clone, PartialEq)]
pub struct Outcome {
    /// Whether it is solved and, if not, why it stopped.
    pub status: Status,
    /// The judge's residuals of the point returned. Where a bound of them was enough to see that it passes ([`Problem::accept`]), that bound, larger by about the rounding of plain
    /// arithmetic; [`Judged::judge`](nonsmooth_problem::check::Judged::judge) tells the last digits.
    pub measure: Measure,
    /// Steps done.
    pub iterations: usize,
    /// Matrices factorised for the solve, as far as they grow with the problem: M, a Newton matrix, but not the
    /// blocks of single contacts, nor what the judge factorises for itself.
    pub factorisations: u64,
    /// Wall clock of the solve: set-up of the workspace, steps and judgements, but no file and no final report. The judge's own preparation is left out, but where on several threads
    /// it runs beside that set-up and is waited for, and in a session of a small problem, where it takes less than a look at the clock would.
    pub seconds: f64,
    /// Processor time of the whole process meanwhile, all threads, if [`Limits::cpu_time`](crate::Limits::cpu_time) asked for it: below `seconds` where the process had to wait.
    pub cpu_seconds: Option<f64>,
}

/// Whether a proof that there is no solution ends the search for one. A point that passes the check at the tolerance is what a user asked for, whatever the last digits of the data say; so a
/// proof that leaves room for such a point is kept, and is the last word only when as much work as it took, or [`MODEST`] work on a small problem, has found none.
pub(crate) fn is_final(proof: &Proof, tolerance: f64) -> bool {
    proof.margin() > ROOM * tolerance
}

/// Points that pass may miss a row by so many tolerances: one error is taken over all rows.
const ROOM: f64 = 100.0;

/// Iterations in the face of a proof, on a small problem.
pub(crate) const MODEST: usize = 3000;

/// The judge's word on a certificate that a solver has found.
pub(crate) fn concluded<P: Problem>(problem: &P, certificate: Certificate) -> Status {
    match problem.evidence(&certificate) {
        Evidence::Proved(proof) => Status::Infeasible(proof),
        Evidence::Nearly { change } => Status::NearlyInfeasible { certificate, change },
        Evidence::Nothing => Status::NoConclusion(certificate),
    }
}
