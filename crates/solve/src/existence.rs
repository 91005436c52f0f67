//! Does a solution exist? Of contact problems by the criterion ([`criterion`]), of complementarity problems by what is here.
//!
//! Method, the cheapest proof first: the class of M (with a P or strictly copositive matrix, and on a bounded box, every q has a solution); `auto`, whose proof of
//! infeasibility or whose point it is; at that point the problem is a linear system, which is solved in fractions; few pairs are enumerated in exact arithmetic. A point that
//! only passes the check proves nothing, and is called nearly so.
//!
//! References: CottlePangStone2009 (theorems 3.3.7, 3.8.5); FacchineiPang2003 (corollary 2.2.5: continuous maps on compact convex sets).

use std::time::Instant;

use nonsmooth_analysis::{Class, Classes, Effort};
use nonsmooth_linalg::Matrix;
use nonsmooth_problem::check::{Certificate, Evidence, ExactVector, Existence};
use nonsmooth_problem::{AnyPoint, AnyProblem, Complementarity, Friction, Problem, field};

use crate::contact::existence as criterion;
use crate::core::exact_cones::{ExactCones, Found, is_representable};
use crate::core::guard;
use crate::{Limit, Limits, Solve, Status};

pub use crate::contact::existence::{decide, glance, glance_at};

/// What is known of the existence of a solution, within the time limit of `limits`; its other entries, but for the flag of cancellation and the limit on memory, are
/// not used.
pub fn of(problem: &AnyProblem, limits: &Limits) -> Existence {
    match problem {
        AnyProblem::Friction(contacts) => of_contacts(contacts, limits),
        AnyProblem::Complementarity(linear) => of_complementarity(linear, limits),
    }
}

/// As [`of`], of a contact problem.
pub fn of_contacts(problem: &Friction, limits: &Limits) -> Existence {
    criterion::of(problem, limits)
}

/// As [`of`], of a complementarity problem.
pub fn of_complementarity(problem: &Complementarity, limits: &Limits) -> Existence {
    classified(problem, None, limits)
}

/// As [`of_complementarity`]; `known`: the [`classes`] of the problem's matrix, where somebody has asked for them before.
pub(crate) fn classified(
    problem: &Complementarity,
    known: Option<Classes>,
    limits: &Limits,
) -> Existence {
    let copy = problem.clone();
    let decided = guard::run(limits, || {}, move |limits| decided(&copy, known, limits));
    decided.unwrap_or_else(criterion::late)
}

/// The classes of a matrix, as far as they cost no more than a solve.
pub(crate) fn classes(m: &Matrix) -> Classes {
    match m.nrows() {
        0..=MANY => Classes::of(m, Effort::default()),
        _ => Classes::quick(m),
    }
}

/// Rows above which a class is not asked for more than a glance.
const MANY: usize = 500;
/// Rows up to which a system is solved in fractions, and what that may cost, see [`ExactCones::within`]: some ten seconds.
const ROWS: usize = 200;
const WORK: u64 = 1_000_000_000;
/// Pairs up to which all cases are enumerated.
const PAIRS: usize = 20;

fn decided(linear: &Complementarity, known: Option<Classes>, limits: &Limits) -> Existence {
    let begun = Instant::now();
    let _scope = limits.budget(begun).enter();
    if let Some(by_class) = by_class(linear, known) {
        return by_class;
    }
    let problem = AnyProblem::Complementarity(linear.clone());
    let left = |share: f64| {
        let spent = begun.elapsed().as_secs_f64();
        let time_limit = limits.time_limit.map(|t| share * (t - spent).max(0.0));
        Limits { time_limit, tolerance: ENOUGH, trace: false, ..limits.clone() }
    };
    let mut nearly = None;
    let mut start = None;
    let mut open = "";
    // Half of the time is for what follows; where nothing follows, the rest is for the solver too.
    for share in [0.5, 1.0] {
        let mut how = Solve::new().limits(left(share));
        if let Some(point) = &start {
            how = how.warm::<AnyPoint>(point);
        }
        let answer = match how.run(&problem) {
            Ok(answer) => answer,
            Err(e) => return Existence::Unknown { why: e.to_string() },
        };
        match &answer.status {
            Status::Infeasible(proof) => {
                return Existence::NoSolution { proof: proof.clone() };
            }
            Status::NearlyInfeasible { certificate, change } => {
                let (certificate, change) = (certificate.clone(), *change);
                nearly = Some(Existence::NearlyNoSolution { certificate, change });
            }
            _ if answer.verdict.measure.passes(ENOUGH) => {
                let relative = answer.verdict.measure.relative;
                nearly = Some(Existence::NearlySolved { relative });
            }
            _ => {}
        }
        let near = exactly(&problem, Some(&unknowns(&answer.point)));
        let cases = |_| if start.is_none() { exactly(&problem, None) } else { Err(open) };
        match near.or_else(cases) {
            Ok(decided) => return decided,
            Err(why) => open = why,
        }
        if answer.status != Status::Limit(Limit::Time) {
            break;
        }
        start = Some(answer.point);
    }
    match (nearly, limits.reached(begun)) {
        (Some(nearly), _) => nearly,
        (None, Some(limit)) => criterion::late(limit),
        (None, None) => Existence::Unknown {
            why: format!("no solver found a solution, none proved that there is none, and {open}"),
        },
    }
}

/// What the solver is asked for, and what is called a solution up to rounding.
const ENOUGH: f64 = 1e-8;

/// Where every q has a solution.
fn by_class(problem: &Complementarity, known: Option<Classes>) -> Option<Existence> {
    let every = |because: String| Some(Existence::EveryQ { because });
    let class_of = |m: &Matrix, wanted: &[Class]| {
        let classes = known.unwrap_or_else(|| classes(m));
        wanted.iter().copied().find(|&class| classes.is(class))
    };
    match problem {
        Complementarity::Lcp(p) => {
            let class = class_of(&p.M, &[Class::P, Class::StrictlyCopositive])?;
            every(format!("M is {class}, and then every q has a solution"))
        }
        Complementarity::Box(p) => {
            if p.lower.iter().chain(&p.upper).all(|b| b.is_finite()) {
                return every("all bounds are finite, and then every q has a solution".into());
            }
            let class = class_of(&p.M, &[Class::P])?;
            every(format!("M is {class}, and then every q has a solution between any bounds"))
        }
        // An affine F is defined, and continuous, everywhere.
        Complementarity::Vi(p) if p.set.is_compact() && field::linear(&*p.F).is_some() => {
            every("F is affine and the set bounded, and then there is a solution".into())
        }
        _ => None,
    }
}

/// The unknowns of a point, in the order of the problem in exact numbers.
fn unknowns(point: &AnyPoint) -> Vec<f64> {
    match point {
        AnyPoint::Lcp(point) => point.z.clone(),
        AnyPoint::Hlcp(point) => [&point.x[..], &point.s].concat(),
        AnyPoint::Local(_) | AnyPoint::Global(_) => vec![],
    }
}

/// What the problem in fractions says, among the cases that a point proposes, or of few pairs among all.
///
/// Errors: why it says nothing.
fn exactly(problem: &AnyProblem, point: Option<&[f64]>) -> Result<Existence, &'static str> {
    if problem.unknowns() > ROWS {
        return Err("there are too many unknowns for fractions");
    }
    let system = problem.cones().ok_or("the entries of its matrix are not known")?;
    if point.is_none() && system.pairs.len() > PAIRS {
        return Err("there are too many cases to enumerate");
    }
    let mut search = match point {
        Some(point) => ExactCones::near(WORK, system.clone(), point),
        None => ExactCones::within(WORK, system.clone()),
    };
    while !search.is_cut_short() {
        match search.advance() {
            None => {}
            Some(Found::Solution(t)) => {
                let solved = system.complete && system.solved_by(&t);
                return solved
                    .then(|| Existence::Solved {
                        representable: is_representable(problem, &system, &t),
                        coefficients: ExactVector(t),
                    })
                    .ok_or("a relaxation of it has a solution");
            }
            // That there is none where a point is says nothing of the others.
            Some(Found::Nothing(_)) if point.is_some() => return Err("there is none near a point"),
            Some(Found::Nothing(vectors)) => {
                return match problem.evidence(&Certificate::Separating { vectors }) {
                    Evidence::Proved(proof) => Ok(Existence::NoSolution { proof }),
                    _ => Err("the proof by its cases could not be verified"),
                };
            }
        }
    }
    Err("the enumeration of its cases was cut short")
}
