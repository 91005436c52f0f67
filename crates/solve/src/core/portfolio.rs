//! Several solvers, one after the other, as one session.

use std::borrow::Cow;
use std::collections::VecDeque;
use std::time::Instant;

use nonsmooth_problem::Problem;
use nonsmooth_problem::check::Measure;

use crate::core::drive::is_hopeless;
use crate::core::meter::Meter;
use crate::core::register::{self, Registered};
use crate::core::settings::SettingsMap;
use crate::core::status::{MODEST, is_final};
use crate::core::trace::Trace;
use crate::core::visits::{History, fallen_back, or_start};
use crate::{Limit, Limits, Observer, Outcome, Progress, Sample, Session, SolveError, Status};

/// A solver of a plan.
#[derive(Debug, Clone, PartialEq)]
pub struct Candidate {
    /// The name in the registry.
    pub name: Cow<'static, str>,
    /// What departs from its defaults.
    pub settings: SettingsMap,
    /// At most this many iterations, before the next one has its turn.
    pub iterations: usize,
    /// Why it is tried, in words that follow its name.
    pub because: String,
    /// Whether it begins where the solve began, not at the best point so far.
    pub anew: bool,
}

/// Who makes the plan for a problem, stage by stage; an empty one ends it.
type Planner<P> = Box<dyn Fn(&P, usize) -> Vec<Candidate> + Send>;

/// A session, with the name and the settings of its solver.
type Made<P> = (Cow<'static, str>, SettingsMap, Box<dyn Session<P>>);

/// A session that runs the solvers of a plan until one solves the problem or proves that it has no solution. Each starts from the best point that the ones before
/// it have found.
pub struct Portfolio<P: Registered> {
    plan: Planner<P>,
    /// What was made for earlier problems, by name and settings.
    sessions: Vec<Made<P>>,
    /// The judge's, which goes from one candidate to the next.
    gauge: Option<Box<P::Gauge>>,
    history: History,
    account: Vec<String>,
    trace: Trace,
}

/// The method whose word is final where it has one.
pub(crate) const DECIDES: &str = "enumeration_exact";

/// What is said at the end of a plan.
const NONE: Status =
    Status::Stalled(Cow::Borrowed("none of the methods tried solves it; see the account"));

impl<P: Registered> Portfolio<P> {
    /// A session that follows `plan`.
    pub fn new(plan: impl Fn(&P, usize) -> Vec<Candidate> + Send + 'static) -> Self {
        Self {
            plan: Box::new(plan),
            sessions: vec![],
            gauge: None,
            history: History::new(),
            account: vec![],
            trace: Trace::None,
        }
    }

    /// The place of the candidate's session.
    fn session(&mut self, candidate: &Candidate) -> Result<usize, SolveError> {
        let same = |(name, settings, _): &(Cow<str>, SettingsMap, _)| {
            *name == candidate.name && *settings == candidate.settings
        };
        if let Some(k) = self.sessions.iter().position(same) {
            return Ok(k);
        }
        let session = register::bare::<P>(&candidate.name, &candidate.settings)?;
        self.sessions.push((candidate.name.clone(), candidate.settings.clone(), session));
        Ok(self.sessions.len() - 1)
    }
}

const UNTIMED: usize = 4;
/// Stages in the face of a proof: what needs no look at the problem, and the plan by its class and structure; and where it holds up to rounding only.
const PROVED: usize = 2;
const NEARLY: usize = 3;

/// The setting that tells starts of one method apart.
pub(crate) const SEED: &str = "seed";

/// The candidates of a plan one by one; the next stage is planned when those of one have failed.
///
/// Without a limit on time nobody says how much patience there is: no more than [`UNTIMED`] stages.
#[derive(Default)]
struct Stages {
    stage: usize,
    open: VecDeque<Candidate>,
    tried: Vec<Tried>,
    /// Stages since the last new candidate.
    barren: usize,
    /// Stages at most, where something says that there is no solution.
    last: Option<usize>,
}

/// A candidate that has had its turn.
struct Tried {
    candidate: Candidate,
    /// From which of the best points it began, counted as [`Tally::bests`] does.
    from: usize,
    /// It ended by itself, not at its limit: more iterations from there would change nothing.
    ended: bool,
}

/// Stages without a new candidate after which a plan is over.
const BARREN: usize = 3;

impl Stages {
    /// No more than so many stages from now on.
    fn close(&mut self, last: usize) {
        self.last = Some(self.last.map_or(last, |before| before.min(last)));
    }

    /// `bests`: how many best points there were so far.
    fn next<P>(
        &mut self,
        problem: &P,
        plan: &Planner<P>,
        limits: &Limits,
        bests: usize,
    ) -> Option<Candidate> {
        let untimed = if limits.time_limit.is_some() { usize::MAX } else { UNTIMED };
        let most = self.last.unwrap_or(untimed);
        loop {
            while let Some(candidate) = self.open.pop_front() {
                let from = if candidate.anew { 0 } else { bests };
                // What was tried with as much patience, or from the same point to its end, would do the same again.
                let again = |Tried { candidate: t, from: before, ended }: &Tried| {
                    (&t.name, &t.settings) == (&candidate.name, &candidate.settings)
                        && (t.iterations >= candidate.iterations || *ended && *before == from)
                };
                if !self.tried.iter().any(again) {
                    self.tried.push(Tried { candidate: candidate.clone(), from, ended: false });
                    self.barren = 0;
                    return Some(candidate);
                }
            }
            // A plan that has nothing new to say for several stages has nothing more to say.
            if self.stage >= most || self.barren > BARREN {
                return None;
            }
            self.barren += 1;
            self.open = plan(problem, self.stage).into();
            if self.open.is_empty() && self.stage > 0 {
                return None;
            }
            self.stage += 1;
        }
    }

    /// Takes note of how the candidate that had its turn last has ended.
    fn ended(&mut self, status: &Status) {
        if let Some(last) = self.tried.last_mut() {
            last.ended = !matches!(status, Status::Limit(_));
        }
    }
}

/// What has been done, and found, so far.
struct Tally<P: Problem> {
    meter: Meter,
    iterations: usize,
    factorisations: u64,
    best: Option<(P::Point, Measure)>,
    /// Points that were the best one for a time.
    bests: usize,
}

impl<P: Problem> Tally<P> {
    fn take(&mut self, point: P::Point, outcome: &Outcome) {
        self.iterations += outcome.iterations;
        self.factorisations += outcome.factorisations;
        // What is solved is what was found, though another point may have a smaller merit: `own` is no part of it.
        let solved = outcome.status == Status::Solved;
        let better = |(_, best): &(P::Point, Measure)| outcome.measure.is_better_than(best);
        if solved || self.best.as_ref().is_none_or(better) {
            self.best = Some((point, outcome.measure));
            self.bests += 1;
        }
    }

    /// What is left of the limits for a candidate.
    fn left(&self, limits: &Limits, iterations: usize) -> Limits {
        let seconds = self.meter.seconds();
        Limits {
            max_iterations: limits.max_iterations.saturating_sub(self.iterations).min(iterations),
            time_limit: limits.time_limit.map(|t| (t - seconds).max(0.0)),
            ..limits.clone()
        }
    }

    /// The caller's own limit ended the solve, not the candidate's.
    fn is_over(&self, limits: &Limits, status: &Status) -> bool {
        match status {
            Status::Limit(Limit::Iterations) => self.iterations >= limits.max_iterations,
            Status::Limit(Limit::Time | Limit::Cancelled) => true,
            _ => false,
        }
    }
}

/// Sees a candidate's solve as a part of the whole.
struct Part<'a, P: Problem> {
    observer: &'a mut dyn Observer<P>,
    iterations: usize,
    seconds: f64,
    /// The merit of the best point so far.
    merit: f64,
}

impl<P: Problem> Observer<P> for Part<'_, P> {
    fn step(&mut self, progress: &Progress) {
        self.observer.step(&later(progress, self.iterations, self.seconds));
    }

    fn keeps_best(&self) -> bool {
        self.observer.keeps_best()
    }

    fn best(&mut self, point: &P::Point, measure: &Measure) {
        if measure.merit() < self.merit {
            self.merit = measure.merit();
            self.observer.best(point, measure);
        }
    }
}

impl<P: Registered> Session<P> for Portfolio<P> {
    fn observe(
        &mut self,
        problem: &P,
        point: &mut P::Point,
        limits: &Limits,
        observer: &mut dyn Observer<P>,
    ) -> Result<Outcome, SolveError> {
        let begun = Instant::now();
        limits.validate()?;
        problem.validate_point(point)?;
        self.history.clear();
        self.account.clear();
        self.trace = Trace::None;
        let scope = limits.budget(begun).enter();
        // As in every session, the judge's own preparation is not part of the solve's time.
        let mut gauge = match self.gauge.take() {
            Some(mut gauge) => {
                problem.regauge(&mut gauge)?;
                gauge
            }
            None => Box::new(problem.gauge()?),
        };
        let meter = Meter::start(begun, limits);
        let mut tally =
            Tally::<P> { meter, iterations: 0, factorisations: 0, best: None, bests: 0 };
        if observer.keeps_best() {
            // The plan asks for the classes of the matrix, which may take all the time there is.
            observer.best(point, &problem.measure(point, &mut gauge));
        }
        self.gauge = Some(gauge);
        let mut status = Status::Stalled("no method applies to this problem".into());
        let (mut nearly, mut proof) = (None, None);
        let mut stages = Stages::default();
        while let Some(candidate) = stages.next(problem, &self.plan, limits, tally.bests) {
            if let Some(limit) = limits.reached(tally.meter.begun) {
                status = Status::Limit(limit);
                break;
            }
            let k = match self.session(&candidate) {
                Ok(k) => k,
                Err(e) => {
                    self.account.push(inapplicable(&candidate, &e));
                    stages.ended(&NONE);
                    continue;
                }
            };
            let best = tally.best.as_ref().filter(|_| !candidate.anew);
            let mut trial = best.map_or_else(|| point.clone(), |b| b.0.clone());
            let (before, begun) = (tally.iterations, tally.meter.seconds());
            let most = if proof.is_none() {
                candidate.iterations
            } else {
                candidate.iterations.min(MODEST)
            };
            let left = tally.left(limits, most);
            let session = &mut self.sessions[k].2;
            let merit = tally.best.as_ref().map_or(f64::INFINITY, |b| b.1.merit());
            let mut part = Part { observer, iterations: before, seconds: begun, merit };
            if let Some(gauge) = self.gauge.take() {
                session.lend(gauge);
            }
            let tried = session.observe(problem, &mut trial, &left, &mut part);
            self.gauge = session.reclaim();
            let outcome = match tried {
                Ok(outcome) => outcome,
                Err(e) => {
                    // In a problem that is in order, what is at fault is made by the method.
                    if !e.is_inapplicable() {
                        problem.validate()?;
                    }
                    self.account.push(inapplicable(&candidate, &e));
                    stages.ended(&NONE);
                    continue;
                }
            };
            for s in session.history() {
                let (iteration, seconds) = (before + s.iteration, begun + s.seconds);
                self.history.note(Sample { iteration, seconds, relative: s.relative }, false);
            }
            self.trace = session.trace();
            self.account.push(sentence(&candidate, &outcome));
            self.account.extend(session.account().into_iter().map(|line| format!("  {line}")));
            // No other problem asks for the same start once more.
            if candidate.settings.contains_key(SEED) {
                self.sessions.swap_remove(k);
            }
            tally.take(trial, &outcome);
            stages.ended(&outcome.status);
            if let Status::Infeasible(found) = &outcome.status
                && !is_final(found, limits.tolerance)
            {
                proof.get_or_insert_with(|| found.clone());
                stages.close(PROVED);
                status = NONE;
                continue;
            }
            let decided = matches!(outcome.status, Status::Solved | Status::Infeasible(_));
            if decided || tally.is_over(limits, &outcome.status) {
                status = outcome.status;
                break;
            }
            if candidate.name == DECIDES && matches!(outcome.status, Status::Stalled(_)) {
                // There is a solution, and doubles do not hold it.
                status = outcome.status;
                break;
            }
            status = match outcome.status {
                ray @ Status::NoConclusion(_) => ray,
                near @ Status::NearlyInfeasible { .. } => {
                    nearly = Some(near);
                    stages.close(NEARLY);
                    NONE
                }
                _ => NONE,
            };
        }
        drop(scope);
        // What is nearly so is more than a limit, or a ray without a conclusion; what is decided stays.
        let open = match status {
            Status::Limit(limit) => limit != Limit::Cancelled,
            _ => status == NONE || matches!(status, Status::NoConclusion(_)),
        };
        if let (Some(near), true) = (nearly, open) {
            status = near;
        }
        if let (Some(proof), true) = (proof, status != Status::Solved) {
            status = Status::Infeasible(proof);
        }
        let measure = match tally.best {
            Some((mut best, measure)) => {
                let measure = match &mut self.gauge {
                    // Where no candidate that began there has kept it: one that began elsewhere, or that has solved another problem.
                    Some(gauge) if status != Status::Solved => {
                        let late = matches!(status, Status::Limit(Limit::Time | Limit::Cancelled));
                        let closely = !(late && is_hopeless(problem, &measure, limits));
                        let how = (limits.tolerance, closely);
                        or_start(problem, point, &mut best, gauge, measure, how)
                    }
                    _ => measure,
                };
                P::copy_point(&best, point);
                measure
            }
            None => {
                let measure = match &mut self.gauge {
                    Some(gauge) => fallen_back(problem, point, gauge),
                    None => fallen_back(problem, point, &mut problem.gauge()?),
                };
                // No time was left for anything: the start may be a solution.
                if measure.passes(limits.tolerance) && matches!(status, Status::Limit(_)) {
                    status = Status::Solved;
                }
                measure
            }
        };
        let outcome = tally.meter.outcome(status, measure, tally.iterations);
        Ok(Outcome { factorisations: tally.factorisations, ..outcome })
    }

    fn history(&self) -> &[Sample] {
        self.history.samples()
    }

    fn trace(&self) -> Trace {
        self.trace.clone()
    }

    fn account(&self) -> Vec<String> {
        shortened(&self.account)
    }

    fn gauge(&mut self) -> Option<&mut P::Gauge> {
        self.gauge.as_deref_mut()
    }
}

/// What a watcher sees, with what was done before added.
fn later(p: &Progress, iterations: usize, seconds: f64) -> Progress {
    let judged = Sample {
        iteration: p.judged.iteration + iterations,
        seconds: p.judged.seconds + seconds,
        relative: p.judged.relative,
    };
    Progress {
        judged,
        best: p.best,
        iteration: p.iteration + iterations,
        seconds: p.seconds + seconds,
    }
}

/// An account in which candidates one after the other that differ by their seed alone are told by the first and the last.
fn shortened(account: &[String]) -> Vec<String> {
    let heads = (0..account.len()).filter(|&i| !account[i].starts_with(' '));
    let heads: Vec<usize> = heads.chain([account.len()]).collect();
    // A head up to its seed, and why it was tried.
    let told = |i: usize| {
        let (before, after) = account[i].split_once(" seed=")?;
        let (_, because) = after.split_once(' ')?;
        Some((before, because.split_once("):").map(|b| b.0)))
    };
    let mut out = vec![];
    let mut k = 0;
    while k + 1 < heads.len() {
        let same = |&j: &usize| {
            j + 1 < heads.len() && told(heads[j]).is_some() && told(heads[j]) == told(heads[k])
        };
        let last = (k..).take_while(same).last().unwrap_or(k);
        out.extend_from_slice(&account[heads[k]..heads[k + 1]]);
        if last > k + 1 {
            out.push(format!("... {} more such starts", last - k - 1));
        }
        if last > k {
            out.extend_from_slice(&account[heads[last]..heads[last + 1]]);
        }
        k = last + 1;
    }
    // What stands before the first candidate.
    let first = heads[0];
    account[..first].iter().cloned().chain(out).collect()
}

/// Why a candidate did nothing, for the account.
fn inapplicable(candidate: &Candidate, error: &SolveError) -> String {
    format!("{} does not apply: {error}", candidate.name)
}

/// What a candidate did, for the account.
fn sentence(candidate: &Candidate, outcome: &Outcome) -> String {
    let Candidate { name, settings, because, .. } = candidate;
    let settings: String = settings
        .iter()
        .map(|(key, value)| {
            format!(" {key}={}", value.as_str().map_or_else(|| value.to_string(), str::to_owned))
        })
        .collect();
    let ended = match &outcome.status {
        Status::Stalled(why) => why.to_string(),
        other => other.to_string(),
    };
    format!("{name}{settings} ({because}): {ended} after {} iterations", outcome.iterations)
}

#[cfg(test)]
mod tests {
    use super::shortened;

    #[test]
    fn starts_that_differ_by_their_seed_are_told_once() {
        let start = |seed: usize| {
            let head = format!(
                "semismooth restarts=false seed={seed} (from another start): no after 1 iterations"
            );
            [head, format!("  steps {seed}")]
        };
        let mut account = vec!["path (first): no after 2 iterations".to_owned(), "  steps".into()];
        account.extend((1..=20).flat_map(start));
        account.push("proxi (then): no after 3 iterations".into());
        let short = shortened(&account);
        assert_eq!(short.len(), 2 + 2 + 1 + 2 + 1, "{short:#?}");
        assert_eq!(short[4], "... 18 more such starts");
        assert_eq!(short[5], start(20)[0]);
        // Few are told one by one, and so is what has no seed.
        assert_eq!(shortened(&account[..6]), account[..6]);
        assert!(shortened(&[]).is_empty());
        assert_eq!(shortened(&["F is affine".into()]), ["F is affine"]);
    }
}
