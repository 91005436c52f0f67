//! **Does a solution exist?** The criterion of existence, decided and certified.
//!
//! Problem: find a motion x with `u = A x + c ∈ int K*` at every contact (then a solution exists), or impulses `r ∈ K` that
//! feel no motion and have negative power (then the criterion fails), or normal impulses of that kind (then there is no
//! solution, whatever the friction); see `nonsmooth_problem::check::Existence`.
//!
//! Method: the free motion first; then Gauss–Seidel sweeps on the convex relaxation `K* ∋ u − τ e_N ⟂ r ∈ K`, whose velocities enter
//! int K* long before they converge (`approach`); then one second-order cone program, `max t` with `u − t e_N ∈ K*`,
//! whose solution is a motion and whose multipliers are the impulses that refute (`program`); for problems without a
//! solution the same program without friction, a linear one. What is found is polished, made exact and verified by the judge's
//! crate: a verdict never rests on a tolerance of the program. Problems of few contacts that these means leave open are decided by
//! enumeration of their cases in exact arithmetic (`core/exact_cones.rs`), in space refuted case by case, with sectors of sliding directions (`sectors`).
//!
//! References: AcaryCadouxLemarechalMalick2011; KlarbringPang1998; GoulartChen2024.
//!
//! Cost: a sweep is one of NSGS; the program some 10 to 30 sparse factorisations with the pattern of `[0, Aᵀ; A, −I]`.
//! Fails: margins near rounding, and cones that touch the motions tangentially, stay unknown.

mod approach;
mod least_squares;
mod program;
mod sectors;

use std::time::Instant;

use nonsmooth_linalg::budget;
use nonsmooth_problem::Friction;
use nonsmooth_problem::check::{
    Certificate, Evidence, ExactVector, Existence, Impulses, Kinematic, Kinematics, rounded,
};
use nonsmooth_problem::with_friction;

use crate::contact::form::{Blockwise, Disked, Rows, has_bounds};
use crate::core::exact_cones::{ExactCones, Found as ExactlyFound, is_representable};
use crate::core::guard;
use crate::{Limit, Limits};
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
pub(crate) fn late(limit: Limit) -> Existence {
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
pub fn decide<P: Blockwise<D> + Disked<D> + Kinematic<D>, const D: usize>(
    problem: &P,
    limits: &Limits,
) -> Existence {
    let begun = Instant::now();
    let found = by_motions(problem, limits);
    by_states(problem, found, &limits.left(begun))
}

/// Where motions have not told, what the states of a few contacts in space tell.
pub(crate) fn by_states<P: Blockwise<D> + Disked<D> + Kinematic<D>, const D: usize>(
    problem: &P,
    found: Existence,
    limits: &Limits,
) -> Existence {
    use Existence::{CriterionRefuted, Unknown, Weak};
    let open = matches!(found, CriterionRefuted { .. } | Weak { .. } | Unknown { .. });
    if !open || has_bounds(problem) {
        return found;
    }
    let _scope = limits.budget(Instant::now()).enter();
    sectors::investigate(problem).unwrap_or(found)
}

/// As [`decide`], by motions, and by enumeration where contacts are polyhedral.
pub(crate) fn by_motions<P: Blockwise<D> + Disked<D> + Kinematic<D>, const D: usize>(
    problem: &P,
    limits: &Limits,
) -> Existence {
    let clock = Clock { start: Instant::now(), limits };
    let _scope = limits.budget(clock.start).enter();
    let kinematics = problem.kinematics();
    if has_bounds(problem) {
        return by_cases(problem, &kinematics, &clock).unwrap_or_else(of_bounds);
    }
    let found = approach::approach(problem, &kinematics, THOROUGH, &clock);
    let first = found.map(|found| proved(problem, &kinematics, found));
    if let Some(decided) = first.as_ref().filter(|found| is_decided(found)) {
        return decided.clone();
    }
    // What holds up to rounding, or not by the theorem, exact enumeration may decide.
    by_cases(problem, &kinematics, &clock)
        .or(first)
        .unwrap_or_else(|| by_program(problem, &kinematics, &clock))
}

/// What exact enumeration of the cases says of a small problem, if anything.
pub(crate) fn enumerated<P: Rows<D> + Kinematic<D>, const D: usize>(
    problem: &P,
) -> Option<Existence> {
    let limits = Limits::default();
    let clock = Clock { start: Instant::now(), limits: &limits };
    by_cases(problem, &problem.kinematics(), &clock)
}

/// What is said of a problem with rows that have bounds, which the theorem does not speak of.
fn of_bounds() -> Existence {
    unknown(
        "the criterion knows no scalar rows with bounds, and there are too many cases to enumerate",
    )
}

fn is_decided(existence: &Existence) -> bool {
    existence.is_proved() || matches!(existence, Existence::NoSolution { .. })
}

/// Problems of so few contacts are decided by exact enumeration of their cases, if they are polyhedral; in space the enumeration may still refute.
const FEW: usize = 8;
/// What an enumeration may cost, see [`ExactCones::within`]: about half a second.
const WORK: u64 = 50_000_000;

/// Decides small problems by [`ExactCones`]: those in the plane or without friction altogether, in space those that even a relaxation of the law refutes.
fn by_cases<P: Rows<D> + Kinematic<D>, const D: usize>(
    problem: &P,
    kinematics: &Kinematics<D>,
    clock: &Clock,
) -> Option<Existence> {
    if kinematics.mu.len() > FEW || problem.unknowns() > 12 * FEW {
        return None;
    }
    let bounded = has_bounds(problem);
    let system = problem.cones()?;
    let complete = system.complete;
    let mut search = ExactCones::within(WORK, system);
    while !search.is_cut_short() && !clock.over() {
        match search.advance() {
            None => {}
            Some(ExactlyFound::Solution(t)) => {
                let system = search.system();
                return (complete && system.solved_by(&t)).then(|| Existence::Solved {
                    representable: is_representable(problem, system, &t),
                    coefficients: ExactVector(t),
                });
            }
            Some(ExactlyFound::Nothing(vectors)) => {
                // Normal impulses say more to a reader. With bounds the rows of a vector are others.
                if let [vector] = &vectors[..]
                    && !bounded
                    && let Some(impulses) = normal(kinematics, vector)
                    && let Evidence::Proved(proof) = problem.evidence(&impulses.into())
                {
                    return Some(Existence::NoSolution { proof });
                }
                return match problem.evidence(&Certificate::Separating { vectors }) {
                    Evidence::Proved(proof) => Some(Existence::NoSolution { proof }),
                    _ => None,
                };
            }
        }
    }
    None
}

/// The normal impulses and multipliers of a separating vector, whose rows of contacts and constraints come before those that define bounds.
fn normal<const D: usize>(kinematics: &Kinematics<D>, vector: &ExactVector) -> Option<Impulses> {
    let m = kinematics.contact_rows();
    let binds = |c: usize| (1..D).filter(move |&k| kinematics.coefficient(c, k) > 0.0).count();
    let bounds: usize = (0..kinematics.mu.len()).map(binds).sum();
    let first = vector.0.len().checked_sub(bounds + kinematics.constant.len())?;
    let mut r: Vec<f64> = vector.0[first..first + m].iter().map(rounded).collect();
    r.iter_mut().enumerate().filter(|(i, _)| i % D != 0).for_each(|(_, r)| *r = 0.0);
    let lambda = vector.0[first + m..first + kinematics.constant.len()].iter().map(rounded);
    Some(Impulses { r, lambda: lambda.collect() })
}

/// As [`glance`], for a problem of a known kind.
pub fn glance_at<P: Blockwise<D> + Disked<D> + Kinematic<D>, const D: usize>(
    problem: &P,
) -> Existence {
    let limits = Limits::default();
    let clock = Clock { start: Instant::now(), limits: &limits };
    if has_bounds(problem) {
        return of_bounds();
    }
    let kinematics = problem.kinematics();
    match approach::approach(problem, &kinematics, SHORT, &clock) {
        Some(found) => proved(problem, &kinematics, found),
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

/// What was found is worth.
fn proved<P: Kinematic<D>, const D: usize>(
    problem: &P,
    kinematics: &Kinematics<D>,
    found: Found,
) -> Existence {
    match found {
        Found::Motion(motion, margin) => Existence::by_motion(problem, kinematics, motion, margin),
        Found::Contradiction(certificate) => refuted(problem, certificate),
    }
}

/// What impulses prove that refute the problem up to rounding.
fn refuted<P: Kinematic<D>, const D: usize>(problem: &P, certificate: Impulses) -> Existence {
    match problem.evidence(&certificate.clone().into()) {
        Evidence::Proved(proof) => Existence::NoSolution { proof },
        Evidence::Nearly { change } => {
            Existence::NearlyNoSolution { certificate: certificate.into(), change }
        }
        Evidence::Nothing => unknown("impulses that seem to refute the problem do not"),
    }
}

/// What a search ended with.
enum Found {
    /// A verified motion into the dual cone and its margin.
    Motion(Vec<f64>, f64),
    /// A verified certificate that bilateral constraints contradict each other.
    Contradiction(Impulses),
}

fn by_program<P: Kinematic<D>, const D: usize>(
    problem: &P,
    kinematics: &Kinematics<D>,
    clock: &Clock,
) -> Existence {
    if clock.over() {
        return clock.late();
    }
    // With rolling friction a cone inside K*, which is none of second order: mu‖u_T‖ + mu_r‖u_R‖ ≤ √2‖(mu u_T, mu_r u_R)‖.
    let inner = if kinematics.mu_r.is_empty() { 1.0 } else { std::f64::consts::SQRT_2 };
    let Some(widest) = Program::new(kinematics, inner).solve(clock) else {
        return unknown("the cone program could not be stated");
    };
    if let Some(margin) = kinematics.margin(&widest.motion) {
        return Existence::by_motion(problem, kinematics, widest.motion, margin);
    }
    if clock.over() {
        return clock.late();
    }
    // Can the normal velocities alone be made nonnegative?
    if let Some(w) = Program::new(kinematics, 0.0).solve(clock) {
        let mut nearly = None;
        for ray in w.rays(clock).filter(|ray| kinematics.refutes(ray)) {
            match refuted(problem, ray) {
                proved @ Existence::NoSolution { .. } => return proved,
                near @ Existence::NearlyNoSolution { .. } => nearly = nearly.or(Some(near)),
                _ => {}
            }
        }
        if let Some(near) = nearly {
            return near;
        }
    }
    // The multipliers lie on the boundary of K, where polishing would push some of them out: those of a slightly
    // narrower cone lie inside.
    let again = || Program::new(kinematics, 1.0 - NARROWER).solve(clock);
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
