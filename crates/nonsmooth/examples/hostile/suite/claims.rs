//! Every solver on a hostile problem, and every claim tested.

use std::collections::BTreeMap;
use std::panic::{AssertUnwindSafe, catch_unwind};

use cpu_time::ThreadTime;
use nonsmooth::{Limits, Session};
use nonsmooth_solve::{existence, registry};

use super::cases::{Case, Made};
use super::draft::{Rng, Truth};

/// What a claim came to, by kind, by solver, by status.
pub type Counts = BTreeMap<(&'static str, String), BTreeMap<&'static str, u64>>;

/// A claim that is not true, or an end that is none.
#[derive(Debug, Clone)]
pub struct Lie {
    pub kind: &'static str,
    pub seed: u64,
    pub index: u64,
    pub solver: String,
    /// `solved none`, `solved residual`, `infeasible`, `proved`, `panic`, …
    pub claim: &'static str,
    pub why: String,
    pub recipe: String,
    /// The number of unknowns.
    pub size: usize,
}

/// The limits of a hostile solve.
#[derive(Debug, Clone, Copy)]
pub struct Effort {
    /// Steps of a solver that is named.
    pub steps: usize,
    /// Steps of the solver that is used when none is named.
    pub default_steps: usize,
    /// Seconds.
    pub seconds: f64,
}

/// What has been found out so far.
#[derive(Debug, Clone, Default)]
pub struct Tally {
    pub counts: Counts,
    pub lies: Vec<Lie>,
    pub solves: u64,
    pub problems: u64,
    /// Problems decided by enumeration, by kind and truth: asked of the default solver, left undecided.
    pub undecided: BTreeMap<(&'static str, &'static str), (u64, u64)>,
    /// Which these are.
    pub open: Vec<(&'static str, u64, String)>,
    /// Seconds in each solver.
    pub seconds: BTreeMap<(&'static str, String), f64>,
}

impl Tally {
    pub fn add(&mut self, other: Tally) {
        for (key, by_status) in other.counts {
            let mine = self.counts.entry(key).or_default();
            by_status.into_iter().for_each(|(status, n)| *mine.entry(status).or_default() += n);
        }
        for (key, (asked, left)) in other.undecided {
            let mine = self.undecided.entry(key).or_default();
            *mine = (mine.0 + asked, mine.1 + left);
        }
        for (key, seconds) in other.seconds {
            *self.seconds.entry(key).or_default() += seconds;
        }
        self.open.extend(other.open);
        self.lies.extend(other.lies);
        self.solves += other.solves;
        self.problems += other.problems;
    }

    fn count(&mut self, kind: &'static str, solver: &str, status: &'static str) {
        let by_status = self.counts.entry((kind, solver.to_owned())).or_default();
        *by_status.entry(status).or_default() += 1;
    }
}

/// The solvers of one kind, kept from problem to problem as a program that solves many would.
pub struct Attack<P: Made> {
    sessions: Vec<(String, Kept<P>)>,
}

/// A session, once it was asked for, and while it has not panicked.
type Kept<P> = Option<Box<dyn Session<P>>>;

/// The tolerances that are asked for.
const TOLERANCES: [f64; 6] = [1e-8, 1e-8, 1e-8, 1e-4, 1e-6, 1e-11];

impl<P: Made> Attack<P>
where
    P::Point: std::fmt::Debug,
{
    pub fn new() -> Self {
        let names = registry::solver_names::<P>();
        Self { sessions: names.into_iter().map(|name| (name, None)).collect() }
    }

    /// Asks all solvers, and the judge directly, about the problem of this seed and index. `doing` is told what is being done.
    /// Limits of time are compared with processor time, which a busy machine does not change.
    pub fn run(&mut self, seed: u64, index: u64, effort: &Effort, doing: &dyn Fn(&str)) -> Tally {
        let mut tally = Tally { problems: 1, ..Tally::default() };
        doing("the generator");
        let kind = P::NAME;
        let case = match catch_unwind(|| P::case(seed, index)) {
            Ok(case) => case,
            Err(panic) => {
                tally.lies.push(Lie {
                    kind,
                    seed,
                    index,
                    solver: "(generator)".into(),
                    claim: "panic",
                    why: message(&*panic),
                    recipe: String::new(),
                    size: 0,
                });
                return tally;
            }
        };
        let tolerance = Rng::of(seed, 99, index).pick(&TOLERANCES);
        let lie = |solver: &str, claim, why: String| Lie {
            kind,
            seed,
            index,
            solver: solver.to_owned(),
            claim,
            why,
            recipe: case.recipe.clone(),
            size: case.problem.unknowns(),
        };
        let mut best = None;
        for (name, kept) in &mut self.sessions {
            doing(name);
            let default = name == registry::DEFAULT;
            let limits = Limits {
                tolerance,
                max_iterations: if default { effort.default_steps } else { effort.steps },
                time_limit: Some(effort.seconds),
                ..Limits::default()
            };
            let mut point = case.problem.origin();
            let begun = ThreadTime::now();
            let solved = catch_unwind(AssertUnwindSafe(|| {
                let mut session = match kept.take() {
                    Some(session) => session,
                    None => registry::session::<P>(name, &Default::default())?,
                };
                let outcome = session.solve(&case.problem, &mut point, &limits, &mut |_| {});
                *kept = Some(session);
                outcome
            }));
            let seconds = begun.elapsed().as_secs_f64();
            *tally.seconds.entry((kind, name.clone())).or_default() += seconds;
            tally.solves += 1;
            if seconds > 1.1 * effort.seconds + 0.2 {
                tally.lies.push(lie(name, "late", format!("{seconds:.2} s")));
            }
            let outcome = match solved {
                Ok(Ok(outcome)) => outcome,
                Ok(Err(e)) => {
                    let refused = if e.is_inapplicable() { "inapplicable" } else { "refused" };
                    tally.count(kind, name, refused);
                    continue;
                }
                Err(panic) => {
                    *kept = None;
                    tally.count(kind, name, "panic");
                    tally.lies.push(lie(name, "panic", message(&*panic)));
                    continue;
                }
            };
            let status = outcome.status.name();
            tally.count(kind, name, status);
            let decided = ["solved", "infeasible"].contains(&status);
            if default && case.small && case.truth != Truth::Unknown {
                let truth = if case.truth == Truth::Solvable { "solvable" } else { "unsolvable" };
                let (asked, left) = tally.undecided.entry((kind, truth)).or_default();
                *asked += 1;
                *left += u64::from(!decided);
                if !decided {
                    let recipe = format!("{truth}  {}  {}", case.recipe, outcome.status);
                    tally.open.push((kind, index, recipe));
                }
            }
            let numbers = P::numbers(&point);
            let finite = numbers.iter().all(|x| x.is_finite());
            if !finite {
                tally.lies.push(lie(name, "not finite", format!("{status}: {numbers:?}")));
                continue;
            }
            if status == "solved" {
                if let Some((claim, why)) = refuted(&case, &point, tolerance) {
                    match claim {
                        "near" => tally.count(kind, name, "near"),
                        _ => tally.lies.push(lie(name, claim, why)),
                    }
                } else if best.is_none() {
                    best = Some(numbers);
                }
            } else if status == "infeasible" && case.truth == Truth::Solvable {
                tally.lies.push(lie(name, "infeasible", format!("{}", outcome.status)));
            }
        }
        doing("the judge");
        self.judge(&case, best, tolerance, seed, index, &lie, &mut tally);
        doing("existence");
        exists(&case, effort, &lie, &mut tally);
        tally
    }

    /// Shows the judge points near solutions, and far away.
    #[allow(clippy::too_many_arguments)]
    fn judge(
        &self,
        case: &Case<P>,
        best: Option<Vec<f64>>,
        tolerance: f64,
        seed: u64,
        index: u64,
        lie: &dyn Fn(&str, &'static str, String) -> Lie,
        tally: &mut Tally,
    ) {
        let kind = P::NAME;
        let mut rng = Rng::of(seed, 77, index);
        let base = best.unwrap_or_else(|| P::numbers(&case.problem.origin()));
        for _ in 0..4 {
            let mut numbers = base.clone();
            let size = 2.0_f64.powi(rng.int(-60, 60));
            match rng.below(3) {
                0 => numbers.iter_mut().for_each(|x| *x *= 1.0 + tolerance * 4.0 * rng.real()),
                1 => numbers.iter_mut().for_each(|x| *x = size * rng.whole(0, 2)),
                _ => {
                    let k = rng.below(numbers.len());
                    numbers[k] += size * rng.real();
                }
            }
            let point = case.problem.point(&numbers);
            let verdict = catch_unwind(AssertUnwindSafe(|| case.problem.judge(&point, tolerance)));
            tally.solves += 1;
            match verdict {
                Ok(Ok(verdict)) if verdict.solved => {
                    tally.count(kind, "(judge)", "solved");
                    if let Some((claim, why)) = refuted(case, &point, tolerance) {
                        match claim {
                            "near" => tally.count(kind, "(judge)", "near"),
                            _ => {
                                let said = verdict.measure.merit();
                                let why = format!("{why}, judged {said:.2e} at {numbers:?}");
                                tally.lies.push(lie("(judge)", claim, why));
                            }
                        }
                    }
                }
                Ok(Ok(_)) => tally.count(kind, "(judge)", "not solved"),
                Ok(Err(_)) => tally.count(kind, "(judge)", "refused"),
                Err(panic) => tally.lies.push(lie("(judge)", "panic", message(&*panic))),
            }
        }
    }
}

/// Asks whether a solution exists.
fn exists<P: Made>(
    case: &Case<P>,
    effort: &Effort,
    lie: &dyn Fn(&str, &'static str, String) -> Lie,
    tally: &mut Tally,
) {
    let Some(friction) = case.problem.contacts() else { return };
    let kind = P::NAME;
    let limits = Limits { time_limit: Some(effort.seconds), ..Limits::default() };
    let begun = ThreadTime::now();
    let answer = catch_unwind(AssertUnwindSafe(|| existence::of_contacts(&friction, &limits)));
    let seconds = begun.elapsed().as_secs_f64();
    *tally.seconds.entry((kind, "(exists)".into())).or_default() += seconds;
    tally.solves += 1;
    if seconds > 1.1 * effort.seconds + 0.2 {
        tally.lies.push(lie("(exists)", "late", format!("{seconds:.2} s")));
    }
    match answer {
        Ok(existence) => {
            let name = existence.name();
            tally.count(kind, "(exists)", name);
            let wrong = match name {
                "proved" if case.truth == Truth::Unsolvable => Some("proved"),
                "no_solution" if case.truth == Truth::Solvable => Some("no solution"),
                _ => None,
            };
            if let Some(claim) = wrong {
                tally.lies.push(lie("(exists)", claim, existence.to_string()));
            }
        }
        Err(panic) => tally.lies.push(lie("(exists)", "panic", message(&*panic))),
    }
}

/// Why a point that is called solved is no solution, if it is none; `near` where it may be one of a problem that the tolerance does not tell from
/// this one.
fn refuted<P: Made>(
    case: &Case<P>,
    point: &P::Point,
    tolerance: f64,
) -> Option<(&'static str, String)> {
    let error = case.problem.error(point);
    let residual = error.is_nan() || error > tolerance * (1.0 + 1e-6);
    let why = || {
        let largest = P::numbers(point).iter().fold(0.0_f64, |m, x| m.max(x.abs()));
        format!("exact {error:.2e}, asked {tolerance:e}, largest number {largest:.1e}")
    };
    // A residual is relative to the whole problem, whose numbers are up to a hundred times those that were changed.
    let fine = case.fine < 100.0 * if case.apart { tolerance.sqrt() } else { tolerance };
    match case.truth {
        Truth::Unsolvable
            if fine && (!residual || case.problem.error_as_given(point) <= tolerance) =>
        {
            Some(("near", why()))
        }
        Truth::Unsolvable => Some(("solved none", why())),
        _ if residual && fine && case.problem.error_as_given(point) <= tolerance => {
            Some(("near", why()))
        }
        _ if residual => Some(("solved residual", why())),
        _ => None,
    }
}

/// What a panic says.
fn message(panic: &(dyn std::any::Any + Send)) -> String {
    let text = panic.downcast_ref::<String>().cloned();
    text.or_else(|| panic.downcast_ref::<&str>().map(|&s| s.to_owned()))
        .unwrap_or_else(|| "a panic".into())
}
