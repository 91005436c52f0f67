//! **Does a solution exist?** The criterion of existence, decided and certified.
//!
//! Problem: find a motion x with `u = A x + c ∈ int K*` at every contact (then a solution exists), or impulses `r ∈ K` that
//! feel no motion and have negative power (then the criterion fails), or normal impulses of that kind (then there is no
//! solution, whatever the friction); see `nonsmooth_problem::check::Existence`.
//!
//! Method: the free motion first; then Gauss–Seidel sweeps on the convex relaxation `K* ∋ u − τ e_N ⟂ r ∈ K`, whose velocities enter
//! int K* long before they converge (`approach`); then one second-order cone program, `max t` with `u − t e_N ∈ K*`,
//! whose solution is a motion and whose multipliers are the impulses that refute (`program`); for problems without a
//! solution the same program without friction, a linear one. What is found is polished and verified by the judge's
//! crate: a verdict never rests on a tolerance of the program.
//!
//! References: AcaryCadouxLemarechalMalick2011; KlarbringPang1998; GoulartChen2024.
//!
//! Cost: a sweep is one of NSGS; the program some 10 to 30 sparse factorisations with the pattern of `[0, Aᵀ; A, −I]`.
//! Fails: margins near rounding, and cones that touch the motions tangentially, stay unknown.

mod approach;
mod program;

use std::time::Instant;

use nonsmooth_problem::Friction;
use nonsmooth_problem::check::{Existence, Impulses, Kinematic, Kinematics};
use nonsmooth_problem::linalg::budget;
use nonsmooth_problem::with_friction;

use crate::form::Blockwise;
use crate::{Limit, Limits, guard};
use program::{Program, Widest};

/// How long an investigation may take.
struct Clock<'a> {
    start: Instant,
    limits: &'a Limits,
}

impl Clock<'_> {
    fn over(&self) -> bool {
        self.limits.reached(self.start).is_some() || budget::over()
    }

    /// What is said where a limit came first.
    fn late(&self) -> Existence {
        late(match self.limits.reached(self.start) {
            Some(limit) => limit,
            None => Limit::Time,
        })
    }

    /// Seconds.
    fn left(&self) -> Option<f64> {
        self.limits.time_limit.map(|t| t - self.start.elapsed().as_secs_f64())
    }
}

/// What is known of the existence of a solution, within the time limit of `limits`; its other entries, but for the flag of
/// cancellation and the limit on memory, are not used. A large problem is investigated on a thread of its own, see [`guard`].
pub fn of(problem: &Friction, limits: &Limits) -> Existence {
    if problem.unknowns() <= guard::SMALL {
        return with_friction!(problem, p => decide(p, limits));
    }
    let copy = problem.clone();
    let decided =
        guard::run(limits, || {}, move |limits| with_friction!(&copy, p => decide(p, limits)));
    decided.unwrap_or_else(late)
}

/// What is said where a limit came first.
fn late(limit: Limit) -> Existence {
    match limit {
        Limit::Cancelled => unknown("it was cancelled"),
        Limit::Time | Limit::Iterations => unknown("the time limit came first"),
    }
}

/// As [`of`], with the cheap attempts only: the free motion and a few hundred sweeps. What they cannot prove is unknown.
pub fn glance(problem: &Friction) -> Existence {
    with_friction!(problem, p => glance_at(p))
}

/// As [`of`], for a problem of a known kind.
pub fn decide<P: Blockwise<D> + Kinematic<D>, const D: usize>(
    problem: &P,
    limits: &Limits,
) -> Existence {
    let clock = Clock { start: Instant::now(), limits };
    let _scope = limits.budget(clock.start).enter();
    let kinematics = problem.kinematics();
    match approach::approach(problem, &kinematics, THOROUGH, &clock) {
        Some(found) => proved(problem, found),
        None => by_program(problem, &kinematics, &clock),
    }
}

/// As [`glance`], for a problem of a known kind.
pub fn glance_at<P: Blockwise<D> + Kinematic<D>, const D: usize>(problem: &P) -> Existence {
    let limits = Limits::default();
    let clock = Clock { start: Instant::now(), limits: &limits };
    match approach::approach(problem, &problem.kinematics(), SHORT, &clock) {
        Some(found) => proved(problem, found),
        None => unknown("a short search found no motion into the dual cone"),
    }
}

/// Sweeps for each margin that is tried.
const THOROUGH: usize = 600;
/// The same for a glance.
const SHORT: usize = 100;

fn unknown(why: &str) -> Existence {
    Existence::Unknown { why: why.into() }
}

/// What was found, if the theorem applies where it is used.
fn proved<P: Kinematic<D>, const D: usize>(problem: &P, found: Found) -> Existence {
    let (motion, margin) = match found {
        Found::Motion(motion, margin) => (motion, margin),
        Found::Contradiction(certificate) => return Existence::NoSolution { certificate },
    };
    let still = motion.iter().all(|&x| x == 0.0);
    match problem.monotone_up_to() {
        // A shift of W moves u by as much, unless nothing moves.
        Some(shift) if still || margin >= SHIFTED * shift => {
            Existence::Proved { motion, margin, shift }
        }
        Some(_) => unknown("the criterion holds, but by less than W is indefinite"),
        None => unknown(
            "the criterion holds, but M (or W) is not positive semidefinite, which its theorem asks for",
        ),
    }
}

/// What a search ended with.
enum Found {
    /// A verified motion into the dual cone and its margin.
    Motion(Vec<f64>, f64),
    /// A verified certificate that bilateral constraints contradict each other.
    Contradiction(Impulses),
}

/// The margin must exceed the shift that makes W semidefinite by this factor.
const SHIFTED: f64 = 10.0;

fn by_program<P: Kinematic<D>, const D: usize>(
    problem: &P,
    kinematics: &Kinematics<D>,
    clock: &Clock,
) -> Existence {
    if clock.over() {
        return clock.late();
    }
    let Some(widest) = Program::new(kinematics, &kinematics.mu).solve(clock) else {
        return unknown("the cone program could not be stated");
    };
    if let Some(margin) = kinematics.margin(&widest.motion) {
        return proved(problem, Found::Motion(widest.motion, margin));
    }
    if clock.over() {
        return clock.late();
    }
    // Can the normal velocities alone be made nonnegative?
    let without = vec![0.0; kinematics.mu.len()];
    if let Some(w) = Program::new(kinematics, &without).solve(clock) {
        let mut rays = w.rays(clock);
        if let Some(certificate) = rays.find(|ray| kinematics.refutes(ray)) {
            return Existence::NoSolution { certificate };
        }
    }
    // The multipliers lie on the boundary of K, where polishing would push some of them out: those of a slightly
    // narrower cone lie inside.
    let narrower: Vec<f64> = kinematics.mu.iter().map(|mu| mu * (1.0 - NARROWER)).collect();
    let again = || Program::new(kinematics, &narrower).solve(clock);
    let mut weak = None;
    for answer in std::iter::once_with(|| Some(widest)).chain(std::iter::once_with(again)) {
        for ray in answer.iter().flat_map(|w: &Widest<D>| w.rays(clock)) {
            if kinematics.refutes_criterion(&ray) {
                return Existence::CriterionRefuted { ray };
            }
            if weak.is_none() && kinematics.refutes_interior(&ray) {
                weak = Some(ray);
            }
        }
    }
    match weak {
        Some(ray) => Existence::Weak { ray },
        None if clock.over() => clock.late(),
        None => {
            unknown("neither a motion nor impulses could be verified: the margin is near rounding")
        }
    }
}

/// The relative amount by which friction is lowered for rays inside of K.
const NARROWER: f64 = 1e-3;
