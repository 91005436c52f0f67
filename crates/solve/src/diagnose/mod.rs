//! What makes a problem hard, in sentences: each with its numbers, what follows from them, and the solvers that suit,
//! named by the registry and put to the test.

mod complementarity;
mod contact;

use std::time::Instant;

use nonsmooth_problem::check::{Existence, Judged};
use nonsmooth_problem::{AnyProblem, OfAny, with_problem};
use serde::Serialize;

use crate::core::guard;
use crate::core::register::{Registered, Solves};
use crate::registry;
use crate::{Limit, Limits, Solve, Status};

pub use contact::spectrum;

/// One thing worth knowing of a problem.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Finding {
    /// What it is about, in a word.
    pub about: &'static str,
    /// The numbers.
    pub says: String,
    /// What follows for solvers; empty where nothing does.
    pub means: String,
    /// Whether it makes the problem hard.
    pub hard: bool,
    /// Solvers that suit, by the registry.
    pub suits: Vec<&'static str>,
}

/// What was found, and what to try.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Diagnosis {
    /// One entry a topic.
    pub findings: Vec<Finding>,
    /// Solvers to try: those that solved the problem on trial, the fastest first.
    pub suits: Vec<&'static str>,
    /// What came of every solver that the findings suggest.
    pub trials: Vec<Trial>,
}

/// A short solve of the problem itself, so that nothing is advised that does not help.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Trial {
    /// The solver.
    pub solver: &'static str,
    /// How it ended.
    pub status: &'static str,
    /// The relative residual that it reached, by the judge.
    pub relative: f64,
    /// Iterations.
    pub iterations: usize,
    /// Wall clock.
    pub seconds: f64,
}

/// How much a diagnosis may cost.
#[derive(Debug, Clone)]
pub struct Effort {
    /// The most rows for which the singular values of W, or of a matrix of a complementarity problem, are computed.
    pub spectrum_limit: usize,
    /// Limits of it all: half of the time for singular values, most of the rest for the question of existence, what is then left for trials of solvers.
    /// Their tolerance is that of the trials.
    pub limits: Limits,
}

/// Explains a problem. `dofs` are the degrees of freedom that a local contact problem was condensed from, if known.
///
/// Errors: the limit that came before there was anything to say.
pub fn diagnose(
    problem: &AnyProblem,
    dofs: Option<usize>,
    effort: &Effort,
) -> Result<Diagnosis, Limit> {
    let copy = (problem.clone(), effort.spectrum_limit);
    guard::run(
        &effort.limits,
        || {},
        move |limits| {
            let (problem, rows) = copy;
            let begun = Instant::now();
            let scope = limits.budget(begun).enter();
            let half = || part(limits, begun, 0.5);
            let most = || part(limits, begun, 0.8);
            let (findings, existence) = match &problem {
                AnyProblem::Friction(contacts) => {
                    contact::findings(contacts, dofs, rows, half, most)
                }
                AnyProblem::Complementarity(linear) => {
                    complementarity::findings(linear, rows, most)
                }
            };
            let mut found = Diagnosis::new(findings, &existence);
            with_problem!(&problem, p => found.put_to_the_test(p, &most()));
            match limits.reached(begun) {
                Some(limit) if scope.raised() => Err(limit),
                _ => Ok(found),
            }
        },
    )
    .and_then(|found| found)
}

/// A trial is no longer than this, in seconds; so many solvers are tried, and so many of those that solved the problem are advised besides the default.
const TRIAL: f64 = 2.0;
const TRIED: usize = 8;
const ADVISED: usize = 3;

impl Diagnosis {
    /// With the solvers that the findings suggest, those of the hard ones first; none where no solver can succeed.
    fn new(findings: Vec<Finding>, existence: &Existence) -> Self {
        let mut suits: Vec<&'static str> = vec![];
        if !matches!(existence, Existence::NoSolution { .. }) {
            let (hard, easy): (Vec<&Finding>, Vec<_>) = findings.iter().partition(|f| f.hard);
            for name in hard.into_iter().chain(easy).flat_map(|f| &f.suits) {
                if !suits.contains(name) {
                    suits.push(name);
                }
            }
        }
        Self { findings, suits, trials: vec![] }
    }

    /// Tries what the findings suggest, each for a part of the time, and keeps what solves the problem.
    fn put_to_the_test<P: Registered + Judged<Status: 'static> + OfAny>(
        &mut self,
        problem: &P,
        limits: &Limits,
    ) {
        let mut tried = std::mem::take(&mut self.suits);
        tried.truncate(TRIED);
        let each = limits.time_limit.map_or(TRIAL, |t| t / tried.len().max(1) as f64);
        let limits = Limits { time_limit: Some(each.min(TRIAL)), ..limits.clone() };
        for solver in tried {
            // One that does not apply is no advice.
            let Ok(answer) = Solve::new().solver(solver).limits(limits.clone()).run(problem) else {
                continue;
            };
            self.trials.push(Trial {
                solver,
                status: answer.status.name(),
                relative: answer.verdict.measure.relative,
                iterations: answer.iterations,
                seconds: answer.seconds,
            });
        }
        self.trials.sort_by(|a, b| a.seconds.total_cmp(&b.seconds));
        let solved = self.trials.iter().filter(|t| t.status == Status::Solved.name());
        let solved: Vec<_> = solved.map(|t| t.solver).collect();
        let advised =
            solved.iter().enumerate().filter(|(k, s)| *k < ADVISED || **s == registry::DEFAULT);
        self.suits = advised.map(|(_, solver)| *solver).collect();
    }
}

/// Trials of solvers in place of one that refused the problem take no longer than this together, in seconds, and name so many at most.
const INSTEAD: f64 = 1.0;
const MOST_INSTEAD: usize = 3;

/// Solvers that solve the problem where `refused` does not apply: the same method behind a prefix, others of its family, `auto`; each was tried, for a quarter
/// of a second at most.
pub fn instead<P: Registered + Judged<Status: 'static> + OfAny>(
    problem: &P,
    refused: &str,
    limits: &Limits,
) -> Vec<String> {
    let (method, family) = method::<P>(refused);
    let behind = registry::composed_names::<P>();
    let behind = behind.into_iter().filter(|n| n.rsplit('/').next() == Some(method));
    let kin = registry::abouts::<P>().into_iter();
    let kin = kin.filter(|a| Some(a.family) == family && a.solves == Solves::Law);
    let candidates =
        behind.chain(kin.map(|a| a.name.to_owned())).chain([registry::DEFAULT.to_owned()]);
    solving(problem, candidates, refused, limits)
}

/// Solvers that solve the problem where `failed` did not: the default, and the first of each other family; each was tried, as by [`instead`].
pub fn others<P: Registered + Judged<Status: 'static> + OfAny>(
    problem: &P,
    failed: &str,
    limits: &Limits,
) -> Vec<String> {
    let others = one_of_each::<P>(method::<P>(failed).1);
    solving(problem, others.into_iter().map(str::to_owned), failed, limits)
}

/// The method that a name ends with, and its family.
fn method<P: Registered>(name: &str) -> (&str, Option<&'static str>) {
    let method = name.rsplit('/').next().unwrap_or(name);
    let about = registry::abouts::<P>().into_iter().find(|a| a.name == method);
    (method, about.map(|a| a.family))
}

/// The default, and the first solver of each family but one.
fn one_of_each<P: Registered>(but: Option<&str>) -> Vec<&'static str> {
    let mut families: Vec<_> = but.into_iter().collect();
    let mut names = vec![registry::DEFAULT];
    for about in registry::abouts::<P>() {
        if about.solves == Solves::Law && !families.contains(&about.family) {
            families.push(about.family);
            if !names.contains(&about.name) {
                names.push(about.name);
            }
        }
    }
    names
}

/// Which of the candidates solve the problem on a short trial.
fn solving<P: Registered + Judged<Status: 'static> + OfAny>(
    problem: &P,
    candidates: impl Iterator<Item = String>,
    but: &str,
    limits: &Limits,
) -> Vec<String> {
    let begun = Instant::now();
    let total = limits.time_limit.unwrap_or(INSTEAD).min(INSTEAD);
    let mut solving: Vec<String> = vec![];
    for name in candidates.filter(|name| name != but) {
        let left = total - begun.elapsed().as_secs_f64();
        if left <= 0.0 || solving.len() >= MOST_INSTEAD {
            break;
        }
        // The caller's iterations are of another method.
        let max_iterations = Limits::default().max_iterations;
        let time_limit = Some(left.min(0.25 * INSTEAD));
        let limits = Limits { time_limit, max_iterations, trace: false, ..limits.clone() };
        let answer = Solve::new().solver(&name).limits(limits).run(problem);
        if answer.is_ok_and(|a| a.is_solved()) && !solving.contains(&name) {
            solving.push(name);
        }
    }
    solving
}

/// A share of what is left of the time.
fn part(limits: &Limits, begun: Instant, share: f64) -> Limits {
    let spent = begun.elapsed().as_secs_f64();
    let time_limit = limits.time_limit.map(|t| share * (t - spent).max(0.0));
    Limits { time_limit, ..limits.clone() }
}

fn easy(about: &'static str, says: String, means: &str) -> Finding {
    Finding { about, says, means: means.into(), hard: false, suits: vec![] }
}

fn hard(about: &'static str, says: String, means: &str, suits: Vec<&'static str>) -> Finding {
    Finding { about, says, means: means.into(), hard: true, suits }
}
