//! What `auto` has done, stage by stage, and the account that it gives of it.

use nonsmooth_problem::check::Kinematic;

use super::{Auto, HybridWork, Stage};
use crate::contact::form::{Disked, Linearised, OnContacts, Parted};

/// Where the solve began.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq)]
pub(super) enum Start {
    /// The caller gave no other point.
    #[default]
    Zero,
    /// The caller's point.
    Given,
    /// Zero, though the caller gave a point.
    Refused,
}

/// What has been done, for the account.
#[derive(Debug, Clone, Copy, Default)]
pub(super) struct Done {
    pub(super) start: Start,
    pub(super) sweeps: usize,
    /// Accelerated sweeps after which all went back to where they began.
    pub(super) taken_back: usize,
    /// Passes over the contacts that moved most, between any sweeps.
    pub(super) followed: usize,
    pub(super) rest: usize,
    pub(super) trial: usize,
    pub(super) interior: usize,
    pub(super) interior_error: f64,
    /// On the convex relaxation after that, and the least error of the law on the way.
    pub(super) relaxed: usize,
    pub(super) relaxed_error: f64,
    pub(super) subproblems: usize,
    pub(super) failed: usize,
    pub(super) newton: usize,
    pub(super) between: usize,
    pub(super) projected: usize,
    /// Rounds of motion and impulses, bodies that moved in the last one, and all; and the least error.
    pub(super) turns: [usize; 3],
    pub(super) turned_error: f64,
    /// Convex problems of given sliding speeds, and the least error of their solutions.
    pub(super) convex: usize,
    pub(super) convex_error: f64,
    /// How often, the steps of all, and the error of the last.
    pub(super) pursuits: usize,
    pub(super) pursued: usize,
    pub(super) pursued_error: f64,
    /// How often, and how many iterations in all.
    pub(super) alternations: usize,
    pub(super) alternating: usize,
    /// Searches for the rows at their bounds.
    pub(super) searches: usize,
    pub(super) strategies: usize,
}

/// One line for each stage that came, in the order of the stages.
pub(super) fn of<P: Linearised<D> + Disked<D> + Kinematic<D> + Parted<D> + Send, const D: usize>(
    auto: &OnContacts<Auto, D>,
    work: &HybridWork<P, D>,
) -> Vec<String> {
    let Done { start, sweeps, rest, trial, interior, interior_error, .. } = work.done;
    let Done { subproblems, failed, newton, between, alternating, .. } = work.done;
    let Done { followed, projected, pursued, pursued_error, .. } = work.done;
    let mut lines = vec![];
    match start {
        Start::Zero => {}
        Start::Given => lines.push("started from the point given".into()),
        Start::Refused => lines.push("started from zero: the point given is farther off".into()),
    }
    lines.push(match work.done.taken_back {
        0 => format!("{sweeps} Gauss-Seidel sweeps"),
        back => format!("{sweeps} Gauss-Seidel sweeps, and {back} accelerated ones in vain"),
    });
    if followed > 0 {
        lines.push(format!("{followed} passes over the contacts that moved most in a sweep"));
    }
    if rest > 0 {
        lines.push(match work.stage {
            Stage::Rest => format!("impulses at rest, found in {rest} iterations"),
            _ => "impulses at rest, sought in vain".into(),
        });
    }
    if trial > 0 {
        lines.push(format!("{trial} Newton iterations on trial"));
    }
    if between > 0 && subproblems == 0 {
        lines.push(format!("{between} sweeps after them"));
    }
    if interior > 0 {
        lines.push(format!(
            "{interior} interior-point iterations on the exact law, to {interior_error:.1e}"
        ));
    }
    if work.done.relaxed > 0 {
        lines.push(format!(
            "{} interior-point iterations on the convex relaxation, to {:.1e}",
            work.done.relaxed, work.done.relaxed_error
        ));
    }
    if subproblems > 0 {
        let epsilon = work.controller.epsilon();
        lines.push(format!(
            "{subproblems} proximal subproblems ({failed} not solved, last epsilon \
             {epsilon:.0e}) in {newton} Newton iterations, {between} sweeps between them"
        ));
    }
    if pursued > 0 {
        lines.push(format!("{pursued} steps along the central path, to {pursued_error:.1e}"));
    }
    if alternating > 0 {
        lines.push(format!("{alternating} iterations of alternating directions"));
    }
    if projected > 0 {
        lines.push(format!("{projected} sweeps with one projection a contact, from zero"));
    }
    let [rounds, moving, bodies] = work.done.turns;
    if rounds > 0 {
        lines.push(format!(
            "motion and impulses in turn, {rounds} times, at last with {moving} of {bodies} bodies moving, to {:.1e}",
            work.done.turned_error
        ));
    }
    if work.done.convex > 0 {
        lines.push(format!(
            "{} convex problems with given sliding speeds, to {:.1e}",
            work.done.convex, work.done.convex_error
        ));
    }
    if let Some(apart) = work.apart.as_ref().filter(|apart| apart.was_used()) {
        lines.push(apart.account(auto));
    }
    if let Some(held) = &work.held {
        let [sets, rows] = held.counts();
        let inside = held.account(auto);
        lines.push(format!(
            "rows at their bounds: {rows}, in set {sets} that was tried; the rest: {inside}"
        ));
    } else if work.done.searches > 0 {
        lines.push("rows at their bounds, sought in vain".into());
    }
    if work.done.strategies > 0 {
        lines.push(format!("{} changes of strategy", work.done.strategies));
    }
    if let Some(existence) = &work.existence {
        lines.push(format!("existence of a solution: {}", existence.name()));
    }
    lines
}
