//! Two campaigns side by side: what got slower, less accurate or unsolved.
//!
//! Runs are paired by problem, solver and tolerance. Of a pair
//!
//! - the *outcome* is compared always: solved or not and, where both are not, the residual reached;
//! - the *iterations* are listed where they differ: without a clock in between, a difference has a cause;
//! - the *time* is compared where both are solved and both campaigns ran on one machine under one plan.
//!
//! A single pair is slower when the ratio of the fastest times, new over old, exceeds both the limit asked for
//! and the noise: the larger of the two runs' slowest over fastest repeat. A run that was timed once has no
//! spread; the largest spread of nine tenths of the repeated runs stands in. A solver is slower when the 95 % interval of its geometric
//! mean ratio lies above the limit (Student's t on the logarithms of the ratios).

use std::collections::{BTreeMap, BTreeSet, HashMap, HashSet};

use serde::Serialize;
use statrs::distribution::{Binomial, ContinuousCDF, DiscreteCDF, StudentsT};

use crate::plural;
use crate::record::{Campaign, Ending, Key, Run};
use crate::runs::Runs;
use crate::tables::significant;

/// A residual changed by this factor counts as another accuracy.
const ACCURACY: f64 = 10.0;

/// How two campaigns are compared.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Options {
    /// Whether times are left out.
    pub outcomes: bool,
    /// The ratio of times, new over old and above 1, beyond which a run or a solver counts as slower.
    pub slower: f64,
}

impl Default for Options {
    fn default() -> Self {
        Self { outcomes: false, slower: 1.1 }
    }
}

/// Which run.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Pair {
    /// The problem.
    pub problem: String,
    /// The solver.
    pub solver: String,
    /// The tolerance.
    pub tolerance: f64,
}

/// A run that ended otherwise.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Outcome {
    /// Which run.
    #[serde(flatten)]
    pub pair: Pair,
    /// How it ended before.
    pub old: Ending,
    /// How it ends now.
    pub new: Ending,
}

/// A number that changed.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Change {
    /// Which run.
    #[serde(flatten)]
    pub pair: Pair,
    /// Before.
    pub old: f64,
    /// Now. JSON has `null` where nothing is reached any more.
    pub new: f64,
}

/// A time that changed by more than the noise.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Timing {
    /// Which run.
    #[serde(flatten)]
    pub pair: Pair,
    /// Fastest solve before, s.
    pub old: f64,
    /// Fastest solve now, s.
    pub new: f64,
    /// New over old.
    pub ratio: f64,
    /// The noise of the pair: slowest over fastest repeat.
    pub noise: f64,
}

/// The times of one solver on one kind of problem, over the pairs that are solved in both.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Pace {
    /// The solver.
    pub solver: String,
    /// The kind: the same name is another method in each.
    pub kind: String,
    /// Pairs.
    pub pairs: usize,
    /// The geometric mean of new over old.
    pub ratio: f64,
    /// Its 95 % interval; none for a single pair.
    pub interval: Option<(f64, f64)>,
    /// Pairs in which the new run was faster, and slower.
    pub faster: usize,
    /// See `faster`.
    pub slower: usize,
    /// Whether it is slower as a whole: all of the interval lies beyond the limit.
    pub worse: bool,
    /// The sign test: the probability of signs at least as uneven if neither were faster.
    pub sign_test: f64,
}

/// What differs.
#[derive(Debug, Clone, PartialEq, Default, Serialize)]
pub struct Comparison {
    /// Whether anything is worse: a run newly unsolved or less accurate, a run or a solver slower.
    pub worse: bool,
    /// Pairs compared.
    pub pairs: usize,
    /// Pairs whose times are compared.
    pub timed: usize,
    /// Runs of the old campaign that the new one lacks.
    pub missing: usize,
    /// Runs of the new campaign that the old one lacks.
    pub additional: usize,
    /// What limits the comparison.
    pub warnings: Vec<String>,
    /// Solved before and not any more, or by a proof that there is no solution where there was one.
    pub newly_unsolved: Vec<Outcome>,
    /// Not solved before, or by a proof that there is no solution where there is one now.
    pub newly_solved: Vec<Outcome>,
    /// Not solved in either, for another reason.
    pub other_failure: Vec<Outcome>,
    /// Not solved in either, and the residual reached is at least ten times larger.
    pub less_accurate: Vec<Change>,
    /// Not solved in either, and the residual reached is at most a tenth.
    pub more_accurate: Vec<Change>,
    /// Solved in both, with another number of iterations.
    pub iterations: Vec<Change>,
    /// Slower beyond the limit and the noise, the worst first.
    pub slower: Vec<Timing>,
    /// Faster beyond the limit and the noise, the best first.
    pub faster: Vec<Timing>,
    /// The times by solver and kind.
    pub solvers: Vec<Pace>,
    /// Solvers that are slower as a whole on a kind of problem.
    pub slower_solvers: Vec<String>,
}

/// Compares two campaigns.
pub fn compare(old: &Runs, new: &Runs, options: &Options) -> Comparison {
    let before: HashMap<Key, &Run> = old.runs.iter().map(|r| (r.key(), r)).collect();
    let mut now: Vec<(Key, &Run)> = new.runs.iter().map(|r| (r.key(), r)).collect();
    now.sort_by(|a, b| a.0.cmp(&b.0));
    let mut all = Comparison::default();
    let mut times: BTreeMap<(&str, &str), Vec<f64>> = BTreeMap::new();
    let mut reasons: BTreeMap<String, usize> = BTreeMap::new();
    let stand_in = usual_spread(old, new);
    let kept: HashSet<&Key> = now.iter().map(|(key, _)| key).collect();
    all.missing = before.keys().filter(|key| !kept.contains(key)).count();
    for (key, b) in &now {
        let Some(&a) = before.get(key) else {
            all.additional += 1;
            continue;
        };
        if !a.digest.is_empty() && !b.digest.is_empty() && a.digest != b.digest {
            *reasons
                .entry("another problem under the same name: not compared".into())
                .or_default() += 1;
            continue;
        }
        all.pairs += 1;
        outcome(&mut all, a, b);
        if options.outcomes || !(a.solved() && b.solved()) {
            continue;
        }
        if let Some(reason) = unlike(old.campaign(a), new.campaign(b)) {
            *reasons.entry(format!("{reason}: times are not compared")).or_default() += 1;
            continue;
        }
        if let (Some(x), Some(y)) = (positive(a.seconds), positive(b.seconds)) {
            all.timed += 1;
            times.entry((&b.solver, &b.kind)).or_default().push((y / x).ln());
            let spread = |r: &Run| spread(r).unwrap_or(stand_in);
            let (ratio, noise) = (y / x, spread(a).max(spread(b)));
            let bound = options.slower.max(noise);
            let timing = || Timing { pair: pair(b), old: x, new: y, ratio, noise };
            if ratio > bound {
                all.slower.push(timing());
            } else if ratio < 1.0 / bound {
                all.faster.push(timing());
            }
        }
    }
    for (which, runs) in [("old", old), ("new", new)] {
        let remarks = runs.unfinished().into_iter().chain(runs.missing_parts());
        all.warnings.extend(remarks.map(|remark| format!("the {which} campaign: {remark}")));
    }
    let warning = |(reason, n): (String, usize)| format!("{reason} ({})", plural(n, "pair"));
    all.warnings.extend(reasons.into_iter().map(warning));
    all.slower.sort_by(|a, b| b.ratio.total_cmp(&a.ratio));
    all.faster.sort_by(|a, b| a.ratio.total_cmp(&b.ratio));
    all.solvers =
        times.into_iter().map(|((s, kind), logs)| pace(s, kind, &logs, options.slower)).collect();
    let slower = all.solvers.iter().filter(|p| p.worse);
    all.slower_solvers = slower.map(|p| p.solver.clone()).collect();
    all.slower_solvers.dedup();
    if all.missing > 0 {
        let n = plural(all.missing, "run");
        all.warnings.push(format!(
            "{n} of the old campaign missing in the new one: nothing is known of them"
        ));
    }
    all.worse = !(all.newly_unsolved.is_empty()
        && all.less_accurate.is_empty()
        && all.slower.is_empty()
        && all.slower_solvers.is_empty());
    all
}

fn pair(run: &Run) -> Pair {
    let Run { problem, solver, tolerance, .. } = run;
    Pair { problem: problem.clone(), solver: solver.clone(), tolerance: *tolerance }
}

fn positive(seconds: Option<f64>) -> Option<f64> {
    seconds.filter(|s| *s > 0.0 && s.is_finite())
}

/// What does not need a clock.
fn outcome(all: &mut Comparison, a: &Run, b: &Run) {
    let ended = || Outcome { pair: pair(b), old: a.ending, new: b.ending };
    match (a.solved(), b.solved()) {
        // A proof excludes exact solutions, not those within the tolerance: neither need be wrong, but a solution that went is a loss.
        (true, true) if a.ending != b.ending => match b.ending {
            Ending::Solved => all.newly_solved.push(ended()),
            _ => all.newly_unsolved.push(ended()),
        },
        (true, false) => all.newly_unsolved.push(ended()),
        (false, true) => all.newly_solved.push(ended()),
        (true, true) => {
            if let (Some(old), Some(new)) = (a.iterations, b.iterations)
                && old != new
            {
                all.iterations.push(Change { pair: pair(b), old: old as f64, new: new as f64 });
            }
        }
        (false, false) => {
            if a.ending != b.ending {
                all.other_failure.push(ended());
            }
            let reached = |r: &Run| r.residuals.reached.unwrap_or(f64::INFINITY);
            let change = Change { pair: pair(b), old: reached(a), new: reached(b) };
            if change.new > change.old && change.new >= ACCURACY * change.old {
                all.less_accurate.push(change);
            } else if change.new < change.old && change.old >= ACCURACY * change.new {
                all.more_accurate.push(change);
            }
        }
    }
}

/// Why times of two campaigns cannot be compared.
fn unlike(old: Option<&Campaign>, new: Option<&Campaign>) -> Option<&'static str> {
    let (Some(old), Some(new)) = (old, new) else { return Some("a run without its campaign") };
    let conditions = |c: &Campaign| {
        c.plan
            .as_ref()
            .map(|p| (p.time_limit, p.memory_limit, p.repeats, p.repeat_below, p.trace, p.jobs))
    };
    match () {
        () if old.machine != new.machine => Some("different machines"),
        () if conditions(old) != conditions(new) => Some("different plans"),
        () => None,
    }
}

/// Slowest over fastest repeat; none for a run that was timed once.
fn spread(run: &Run) -> Option<f64> {
    let (fastest, slowest) = (positive(run.seconds)?, positive(run.seconds_max)?);
    (run.repeats > 1).then(|| (slowest / fastest).max(1.0))
}

/// The least spread that nine tenths of the repeated runs keep within; 1 where none was repeated.
fn usual_spread(old: &Runs, new: &Runs) -> f64 {
    let mut all: Vec<f64> = old.runs.iter().chain(&new.runs).filter_map(spread).collect();
    all.sort_by(f64::total_cmp);
    let rank = (9 * all.len()).div_ceil(10);
    rank.checked_sub(1).map_or(1.0, |last| all[last])
}

/// The mean of the logarithms with its interval, and the sign test.
fn pace(solver: &str, kind: &str, logs: &[f64], limit: f64) -> Pace {
    let n = logs.len() as f64;
    let mean = logs.iter().sum::<f64>() / n;
    let variance = logs.iter().map(|l| (l - mean).powi(2)).sum::<f64>() / (n - 1.0);
    let interval = (logs.len() > 1).then(|| {
        let t = StudentsT::new(0.0, 1.0, n - 1.0).expect("n > 1").inverse_cdf(0.975);
        let half = t * (variance / n).sqrt();
        ((mean - half).exp(), (mean + half).exp())
    });
    let faster = logs.iter().filter(|l| **l < 0.0).count();
    let slower = logs.iter().filter(|l| **l > 0.0).count();
    let signs = Binomial::new(0.5, (faster + slower) as u64).expect("one half is a probability");
    let sign_test = (2.0 * signs.cdf(faster.min(slower) as u64)).min(1.0);
    Pace {
        solver: solver.into(),
        kind: kind.into(),
        pairs: logs.len(),
        ratio: mean.exp(),
        worse: interval.is_some_and(|(low, _)| low > limit),
        interval,
        faster,
        slower,
        sign_test,
    }
}

impl Comparison {
    /// A report to be read.
    pub fn text(&self) -> String {
        let mut text = String::new();
        for warning in &self.warnings {
            text += &format!("warning: {warning}\n");
        }
        let count = plural(self.pairs, "pair");
        text += &format!("{count} compared, the times of {}", self.timed);
        text += &format!("; {} missing, {} additional\n", self.missing, self.additional);
        fn at(p: &Pair) -> String {
            // Names may hold anything; a pair is one line.
            format!("{}  {}  {:e}", p.problem, p.solver, p.tolerance).replace(char::is_control, " ")
        }
        let mut list = |title: &str, lines: Vec<String>| {
            if !lines.is_empty() {
                text += &format!("\n{title} ({}):\n", lines.len());
                lines.iter().for_each(|l| text += &format!("  {l}\n"));
            }
        };
        let outcomes = |all: &[Outcome]| {
            let line =
                |o: &Outcome| format!("{}: {} -> {}", at(&o.pair), o.old.name(), o.new.name());
            all.iter().map(line).collect::<Vec<_>>()
        };
        let changes = |all: &[Change]| {
            let line = |c: &Change| {
                let (old, new) = (significant(c.old), significant(c.new));
                format!("{}: {old} -> {new}", at(&c.pair))
            };
            all.iter().map(line).collect::<Vec<_>>()
        };
        let whole = |c: &Change| format!("{}: {} -> {}", at(&c.pair), c.old, c.new);
        let timings = |all: &[Timing]| {
            let line = |t: &Timing| {
                let (old, new) = (significant(t.old), significant(t.new));
                let Timing { pair, ratio, noise, .. } = t;
                format!("{}: {old} s -> {new} s, ratio {ratio:.2}, noise {noise:.2}", at(pair))
            };
            all.iter().map(line).collect::<Vec<_>>()
        };
        list("newly unsolved", outcomes(&self.newly_unsolved));
        list("less accurate", changes(&self.less_accurate));
        list("slower", timings(&self.slower));
        list("newly solved", outcomes(&self.newly_solved));
        list("more accurate", changes(&self.more_accurate));
        list("faster", timings(&self.faster));
        list("other failure", outcomes(&self.other_failure));
        list("other iterations", self.iterations.iter().map(whole).collect());
        let several = self.solvers.iter().any(|p| p.kind != self.solvers[0].kind);
        let pace = |p: &Pace| {
            let interval = p.interval.map_or("one pair only".into(), |(low, high)| {
                format!("95 % interval {low:.3} to {high:.3}")
            });
            let Pace { solver, kind, pairs, ratio, faster, slower, sign_test, .. } = p;
            let mark = if p.worse { "  slower" } else { "" };
            let on = match several && !kind.is_empty() {
                true => format!(" on {kind}").replace(char::is_control, " "),
                false => String::new(),
            };
            format!(
                "{solver}{on}: {ratio:.3}, {interval}, {}: {faster} faster, {slower} slower (sign test {sign_test:.2}){mark}",
                plural(*pairs, "pair")
            )
        };
        list(
            "time by solver, geometric mean of new over old",
            self.solvers.iter().map(pace).collect(),
        );
        let worse: BTreeSet<&str> = [
            ("newly unsolved", self.newly_unsolved.is_empty()),
            ("less accurate", self.less_accurate.is_empty()),
            ("slower", self.slower.is_empty() && self.slower_solvers.is_empty()),
        ]
        .into_iter()
        .filter_map(|(what, none)| (!none).then_some(what))
        .collect();
        text += &match self.worse {
            true => format!("\nworse: {}\n", worse.into_iter().collect::<Vec<_>>().join(", ")),
            false => "\nnothing worse\n".into(),
        };
        text
    }
}
