//! Who solves how much, and how fast: performance profiles, data profiles, and success against tolerance.
//!
//! Everything here is counted over a [`Selection`] of the runs, which is of one kind of problem: kinds are never pooled,
//! because a name such as `psor` is another method in each. The solvers are those that take a problem of the kind. P is the
//! set of the selected problems on which at least one of them was run (for [`Costs`]: at its tolerance); problems that
//! nobody was run on are not in P. `P_s` is P without the problems that s refuses, and all shares of s are shares of
//! `P_s`: a method that does not apply has not failed (so the curve of one that refuses much can lie above the best's). A pair without a run counts as not solved, and
//! [`Costs::missing`] says how many there are. A problem that nobody solves stays in P, so a curve ends at the share that
//! its solver solves. *The best* is the best of all selected solvers.
//!
//! References: DolanMore2002 (performance profiles), MoreWild2009 (data profiles), GouldScott2016 (what a profile of more than two
//! solvers does not say).

use std::collections::{BTreeMap, BTreeSet, HashMap, HashSet};

use nonsmooth_problem::Kind;

use crate::record::{Ending, Run, SIZES, Size};
use crate::runs::Runs;

/// The name of the solver that does on each problem what the best of the selection does on it.
pub const VIRTUAL_BEST: &str = "virtual best";

/// What a solve costs.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Cost {
    /// Wall clock of the fastest solve, s.
    Seconds,
    /// Iterations. Those of different methods differ in price.
    Iterations,
    /// Factorisations of matrices that grow with the problem.
    Factorisations,
}

impl Cost {
    /// Every cost.
    pub const ALL: [Cost; 3] = [Cost::Seconds, Cost::Iterations, Cost::Factorisations];

    /// The name in files, such as `seconds`.
    pub fn name(self) -> &'static str {
        match self {
            Cost::Seconds => "seconds",
            Cost::Iterations => "iterations",
            Cost::Factorisations => "factorisations",
        }
    }

    /// The least cost that counts, so that ratios exist: 1 ns, one iteration, one factorisation. Smaller ones are
    /// raised to it.
    pub fn floor(self) -> f64 {
        match self {
            Cost::Seconds => 1e-9,
            Cost::Iterations | Cost::Factorisations => 1.0,
        }
    }

    /// What a run cost, at least [`floor`](Self::floor); none where it is not known.
    pub fn of(self, run: &Run) -> Option<f64> {
        let cost = match self {
            Cost::Seconds => run.seconds,
            Cost::Iterations => run.iterations.map(|k| k as f64),
            Cost::Factorisations => run.factorisations.map(|k| k as f64),
        };
        cost.filter(|c| c.is_finite()).map(|c| c.max(self.floor()))
    }
}

/// Which runs are looked at: those of one kind of problem. An empty list stands for all.
#[derive(Debug, Clone, PartialEq)]
pub struct Selection {
    /// The kind of problem.
    pub kind: String,
    /// The relative residual that the runs were to reach.
    pub tolerance: f64,
    /// Families of problems.
    pub families: Vec<String>,
    /// Classes of size.
    pub sizes: Vec<Size>,
    /// Labels of solvers.
    pub solvers: Vec<String>,
}

impl Selection {
    /// All problems of a kind and all solvers at one tolerance.
    pub fn at(kind: &str, tolerance: f64) -> Self {
        Self { kind: kind.into(), tolerance, families: vec![], sizes: vec![], solvers: vec![] }
    }

    /// What the size of a problem of the kind counts.
    pub fn counted(&self) -> &'static str {
        match Kind::ALL.iter().find(|kind| kind.name() == self.kind) {
            Some(Kind::Vi) => "variables",
            Some(kind) if kind.is_complementarity() => "pairs",
            _ => "contacts",
        }
    }

    /// Whether a run belongs to it, whatever its tolerance.
    pub fn takes(&self, run: &Run) -> bool {
        fn one<T: PartialEq<U>, U: ?Sized>(list: &[T], item: &U) -> bool {
            list.is_empty() || list.iter().any(|l| l == item)
        }
        self.kind == run.kind
            && one(&self.families, run.family.as_str())
            && one(&self.solvers, run.solver.as_str())
            && one(&self.sizes, &Size::of(run.contacts))
    }

    /// The tightest tolerance that every solver of the runs that it [`takes`](Self::takes) was run at, else the one with
    /// the most of them; none where it takes none.
    pub fn common_tolerance(&self, runs: &Runs) -> Option<f64> {
        runs.common_tolerance(|run| self.takes(run))
    }

    /// The labels of the solvers that have runs which it takes, refusals aside, and none of them at its tolerance.
    pub fn without_runs<'a>(&self, runs: &'a Runs) -> Vec<&'a str> {
        let (mut there, mut at) = (BTreeSet::new(), HashSet::new());
        for run in runs.runs.iter().filter(|r| self.takes(r) && r.ending != Ending::Refused) {
            there.insert(run.solver.as_str());
            if run.tolerance == self.tolerance {
                at.insert(run.solver.as_str());
            }
        }
        there.into_iter().filter(|solver| !at.contains(solver)).collect()
    }

    /// The runs at its tolerance of the selected [`solvers`](Self::solvers).
    pub(crate) fn taken<'a>(&self, runs: &'a Runs, solvers: &[&str]) -> Vec<&'a Run> {
        let solvers: HashSet<&str> = solvers.iter().copied().collect();
        let at = |r: &&Run| {
            r.tolerance == self.tolerance && self.takes(r) && solvers.contains(r.solver.as_str())
        };
        runs.runs.iter().filter(at).collect()
    }

    /// The labels of the selected solvers that take a problem of the kind, in the order in which the runs name them.
    pub fn solvers<'a>(&self, runs: &'a Runs) -> Vec<&'a str> {
        self.parted(runs).0
    }

    /// The labels of the selected solvers that refuse every problem of the kind.
    pub fn refusing<'a>(&self, runs: &'a Runs) -> Vec<&'a str> {
        self.parted(runs).1
    }

    fn parted<'a>(&self, runs: &'a Runs) -> (Vec<&'a str>, Vec<&'a str>) {
        let (mut there, mut take) = (HashSet::new(), HashSet::new());
        for run in runs.runs.iter().filter(|r| r.kind == self.kind) {
            there.insert(run.solver.as_str());
            if run.ending != Ending::Refused {
                take.insert(run.solver.as_str());
            }
        }
        let selected = |s: &&str| self.solvers.is_empty() || self.solvers.iter().any(|l| l == s);
        let all = runs.solvers().into_iter().filter(|s| there.contains(s)).filter(selected);
        all.partition(|s| take.contains(s))
    }

    /// The selected solvers, and those left out of a figure of residuals: they solve, and tell nothing of what it shows.
    fn telling<'a>(
        &self,
        runs: &'a Runs,
        known: impl Fn(&Run) -> bool,
    ) -> (Vec<&'a str>, Vec<String>) {
        let (mut solve, mut tell) = (HashSet::new(), HashSet::new());
        for run in runs.runs.iter().filter(|r| self.takes(r)) {
            if run.solved() {
                solve.insert(run.solver.as_str());
            }
            if known(run) {
                tell.insert(run.solver.as_str());
            }
        }
        let silent = |s: &&str| solve.contains(s) && !tell.contains(s);
        let (silent, telling): (Vec<&str>, Vec<&str>) =
            self.solvers(runs).into_iter().partition(silent);
        (telling, silent.into_iter().map(String::from).collect())
    }
}

/// What every solver of a selection needed for every problem.
#[derive(Debug, Clone, PartialEq)]
pub struct Costs {
    /// Labels of solvers; the rows.
    pub solvers: Vec<String>,
    /// The problems P; the columns.
    pub problems: Vec<String>,
    /// `t[s][p]`: the cost of a solved run, +∞ of any other.
    pub t: Vec<Vec<f64>>,
    /// For each solver, problems of P that it refuses.
    pub refused: Vec<usize>,
    /// Problems of P that every solver that was run refuses.
    pub refused_by_all: usize,
    /// For each solver, pairs with problems of P that were not run. They count as not solved.
    pub missing: Vec<usize>,
    /// For each solver, solved runs whose cost is not known. They count as not solved here.
    pub unknown: Vec<usize>,
}

impl Costs {
    /// The costs of the selected runs at the tolerance of the selection.
    pub fn of(runs: &Runs, selection: &Selection, cost: Cost) -> Self {
        let solvers = selection.solvers(runs);
        Self::over(&solvers, &selection.taken(runs, &solvers), cost)
    }

    /// The costs of runs at one tolerance, all of them of the given solvers.
    pub(crate) fn over(solvers: &[&str], taken: &[&Run], cost: Cost) -> Self {
        let index: HashMap<&str, usize> =
            solvers.iter().enumerate().map(|(s, &label)| (label, s)).collect();
        let problems: BTreeSet<&str> = taken.iter().map(|r| r.problem.as_str()).collect();
        let column: HashMap<&str, usize> =
            problems.iter().enumerate().map(|(p, &n)| (n, p)).collect();
        let mut t = vec![vec![f64::INFINITY; problems.len()]; solvers.len()];
        let mut missing = vec![problems.len(); solvers.len()];
        let (mut unknown, mut refused) = (vec![0; solvers.len()], vec![0; solvers.len()]);
        let mut applies = vec![false; problems.len()];
        for run in taken {
            let (s, p) = (index[run.solver.as_str()], column[run.problem.as_str()]);
            missing[s] -= 1;
            if run.ending == Ending::Refused {
                refused[s] += 1;
                continue;
            }
            applies[p] = true;
            if run.solved() {
                match cost.of(run) {
                    Some(c) => t[s][p] = c,
                    None => unknown[s] += 1,
                }
            }
        }
        Self {
            solvers: solvers.iter().map(|s| s.to_string()).collect(),
            problems: problems.into_iter().map(String::from).collect(),
            t,
            refused,
            refused_by_all: applies.iter().filter(|a| !**a).count(),
            missing,
            unknown,
        }
    }

    /// Without the solvers that solve and do not count this cost, which would seem to fail; and their labels.
    pub fn counted(mut self) -> (Self, Vec<String>) {
        let silent = |s: usize| self.unknown[s] > 0 && self.t[s].iter().all(|t| t.is_infinite());
        let keep: Vec<bool> = (0..self.solvers.len()).map(|s| !silent(s)).collect();
        fn kept<T>(all: &mut Vec<T>, keep: &[bool]) -> Vec<T> {
            let mut flags = keep.iter();
            all.extract_if(.., |_| !flags.next().copied().unwrap_or(true)).collect()
        }
        let left_out = kept(&mut self.solvers, &keep);
        kept(&mut self.t, &keep);
        for counts in [&mut self.refused, &mut self.missing, &mut self.unknown] {
            kept(counts, &keep);
        }
        (self, left_out)
    }

    /// `|P_s|`: the problems that a solver does not refuse.
    pub fn applicable(&self, solver: usize) -> usize {
        self.problems.len() - self.refused[solver]
    }

    /// The problems that at least one solver does not refuse.
    pub fn applicable_to_any(&self) -> usize {
        self.problems.len() - self.refused_by_all
    }

    /// The virtual best: `min_s t_ps` for each problem, +∞ where nobody solves it.
    pub fn best(&self) -> Vec<f64> {
        let column = |p: usize| self.t.iter().map(|row| row[p]).fold(f64::INFINITY, f64::min);
        (0..self.problems.len()).map(column).collect()
    }

    /// The ratios `r_ps = t_ps / min_s t_ps`, rows by solver; +∞ where the solver does not solve the problem.
    pub fn ratios(&self) -> Vec<Vec<f64>> {
        let best = self.best();
        let ratio = |(&t, &b): (&f64, &f64)| if t < f64::INFINITY { t / b } else { t };
        self.t.iter().map(|row| row.iter().zip(&best).map(ratio).collect()).collect()
    }
}

/// A share of problems, or another quantity, as a step function that is continuous from the right.
#[derive(Debug, Clone, PartialEq)]
pub struct Curve {
    /// The solver's label, or [`VIRTUAL_BEST`].
    pub solver: String,
    /// `(x, y)`: the value is y from x on, up to the next x. Strictly ascending in x; before the first it is `before`.
    pub steps: Vec<(f64, f64)>,
    /// The value before the first step.
    pub before: f64,
}

impl Curve {
    /// The value at x.
    pub fn at(&self, x: f64) -> f64 {
        let k = self.steps.partition_point(|step| step.0 <= x);
        if k == 0 { self.before } else { self.steps[k - 1].1 }
    }

    /// The value in the end.
    pub fn last(&self) -> f64 {
        self.steps.last().map_or(self.before, |step| step.1)
    }

    /// `x ↦ |{k : values_k ≤ x}| / n`.
    fn share(solver: &str, mut values: Vec<f64>, n: usize) -> Self {
        values.retain(|v| *v < f64::INFINITY);
        values.sort_by(f64::total_cmp);
        let mut steps: Vec<(f64, f64)> = vec![];
        for (k, &x) in values.iter().enumerate() {
            let y = (k + 1) as f64 / n as f64;
            match steps.last_mut() {
                Some(last) if last.0 == x => last.1 = y,
                _ => steps.push((x, y)),
            }
        }
        Self { solver: solver.into(), steps, before: 0.0 }
    }
}

/// Performance profiles (DolanMore2002): `ρ_s(τ) = |{p ∈ P_s : r_ps ≤ τ}| / |P_s|` with `r_ps = t_ps / min_s t_ps`, for τ ≥ 1.
///
/// `ρ_s(1)` is the share of problems on which s is the fastest (ties count for each), the last value the share that s
/// solves. With more than two solvers a profile shows how far each is from the best of the set and
/// does not rank them: without the best, the order of the others can change (GouldScott2016).
pub fn performance(costs: &Costs) -> Vec<Curve> {
    let rows = costs.solvers.iter().zip(costs.ratios()).enumerate();
    rows.map(|(s, (solver, ratios))| Curve::share(solver, ratios, costs.applicable(s))).collect()
}

/// The performance profile of the virtual best: from τ = 1 on the share of problems that anybody solves.
pub fn performance_of_best(costs: &Costs) -> Curve {
    let ones = costs.best().into_iter().map(|b| if b < f64::INFINITY { 1.0 } else { b });
    Curve::share(VIRTUAL_BEST, ones.collect(), costs.applicable_to_any())
}

/// The best residual that every solver had on every problem of P as time went on, over its runs at any
/// tolerance: at the points of their traces, and at their ends. From a proof on that there is no solution it is 0.
///
/// A run ends at its own tolerance, so what lies below is known only if a run was to go there. A foreign program's
/// residual is its own error.
#[derive(Debug, Clone, PartialEq)]
pub struct Progress {
    /// Labels of solvers.
    pub solvers: Vec<String>,
    /// Labels of solvers that solve and tell no residuals or times: they are left out.
    pub left_out: Vec<String>,
    /// The problems P: those of the selection with a run of any of the solvers at any tolerance.
    pub problems: Vec<String>,
    /// For each solver `|P_s|`: the problems that it does not refuse.
    pub applicable: Vec<usize>,
    /// The problems that at least one solver does not refuse.
    pub applicable_to_any: usize,
    /// `steps[s][p]`: pairs (seconds, best residual so far), ascending in time and strictly descending in residual.
    pub steps: Vec<Vec<Vec<(f64, f64)>>>,
}

impl Progress {
    /// The progress of the selected runs.
    pub fn of(runs: &Runs, selection: &Selection) -> Self {
        let end = |run: &Run| run.seconds.zip(run.reached());
        let (solvers, left_out) = selection.telling(runs, |run| end(run).is_some());
        let pairs = pairs(runs, selection, &solvers);
        let points = |pair: &Vec<&Run>| {
            let tried = || pair.iter().filter(|run| run.ending != Ending::Refused);
            let traced = tried().flat_map(|run| run.trace.iter().map(|p| (p.1, p.2)));
            running_best(traced.chain(tried().filter_map(|run| end(run))).collect())
        };
        let steps = |s: usize| pairs.values().map(|row| points(&row[s])).collect();
        Self {
            left_out,
            problems: pairs.keys().map(|&p| p.into()).collect(),
            applicable: applicable(pairs.values(), solvers.len()),
            applicable_to_any: pairs.values().filter(|row| !row.iter().all(refused)).count(),
            steps: (0..solvers.len()).map(steps).collect(),
            solvers: solvers.into_iter().map(String::from).collect(),
        }
    }

    /// The virtual best: on each problem the best residual that any solver had by then.
    pub fn best(&self) -> Self {
        let column = |p: usize| {
            running_best(self.steps.iter().flat_map(|row| row[p].iter().copied()).collect())
        };
        Self {
            solvers: vec![VIRTUAL_BEST.into()],
            left_out: vec![],
            problems: self.problems.clone(),
            applicable: vec![self.applicable_to_any],
            applicable_to_any: self.applicable_to_any,
            steps: vec![(0..self.problems.len()).map(column).collect()],
        }
    }

    /// Data profiles: `d_s(t) = |{p ∈ P_s : s has a residual of at most ε on p within t seconds}| / |P_s|`.
    ///
    /// MoreWild2009 counts evaluations of a function in units of the dimension, and asks for a part of the best
    /// decrease known; here the cost is time and the goal is a residual.
    pub fn data_profile(&self, epsilon: f64) -> Vec<Curve> {
        let reached = |steps: &Vec<(f64, f64)>| {
            // Residuals fall along the steps.
            let k = steps.partition_point(|step| step.1 > epsilon);
            steps.get(k).map_or(f64::INFINITY, |step| step.0)
        };
        let rows = self.solvers.iter().zip(&self.steps).zip(&self.applicable);
        rows.map(|((s, row), n)| Curve::share(s, row.iter().map(reached).collect(), *n)).collect()
    }

    /// The residual within which the given part of `P_s` is, as a function of time: the smallest e such that
    /// `|{p ∈ P_s : best residual by t ≤ e}| ≥ part |P_s|`; +∞ while there is none. `part` lies in (0, 1]: 0.5 gives the
    /// (lower) median.
    pub fn quantile(&self, part: f64) -> Vec<Curve> {
        let rows = self.solvers.iter().zip(&self.steps).zip(&self.applicable);
        rows.map(|((solver, row), &n)| {
            // What it refuses has no events and stays at the end, beyond the rank.
            let rank = ((part * n as f64).ceil() as usize).clamp(1, n.max(1)) - 1;
            let mut events: Vec<(f64, usize, f64)> = vec![];
            for (p, steps) in row.iter().enumerate() {
                events.extend(steps.iter().map(|&(t, residual)| (t, p, residual)));
            }
            events.sort_by(|a, b| a.0.total_cmp(&b.0));
            let mut now = vec![f64::INFINITY; row.len()];
            let mut sorted = now.clone();
            let mut curve = Curve { solver: solver.clone(), steps: vec![], before: f64::INFINITY };
            for (t, p, residual) in events {
                let old = sorted.partition_point(|v| *v < now[p]);
                sorted.remove(old);
                sorted.insert(sorted.partition_point(|v| *v < residual), residual);
                now[p] = residual;
                let value = sorted[rank];
                let same_time = curve.steps.last().is_some_and(|step| step.0 == t);
                if same_time {
                    curve.steps.pop();
                }
                if value != curve.last() {
                    curve.steps.push((t, value));
                }
            }
            curve
        })
        .collect()
    }
}

/// The runs of every solver on every problem of the selection, at any tolerance.
fn pairs<'a>(
    runs: &'a Runs,
    selection: &Selection,
    solvers: &[&str],
) -> BTreeMap<&'a str, Vec<Vec<&'a Run>>> {
    let index: HashMap<&str, usize> = solvers.iter().enumerate().map(|(s, &l)| (l, s)).collect();
    let mut all: BTreeMap<&str, Vec<Vec<&Run>>> = BTreeMap::new();
    for run in runs.runs.iter().filter(|r| selection.takes(r)) {
        if let Some(&s) = index.get(run.solver.as_str()) {
            all.entry(&run.problem).or_insert_with(|| vec![vec![]; solvers.len()])[s].push(run);
        }
    }
    all
}

/// Whether a solver refuses a problem; also where it was not run, which says nothing against the others' refusals.
fn refused(pair: &Vec<&Run>) -> bool {
    pair.iter().all(|run| run.ending == Ending::Refused)
}

/// For each solver, of the problems those that it was not run on or does not refuse.
fn applicable<'a>(
    rows: impl Iterator<Item = &'a Vec<Vec<&'a Run>>> + Clone,
    solvers: usize,
) -> Vec<usize> {
    let takes = |s: usize, row: &[Vec<&Run>]| row[s].is_empty() || !refused(&row[s]);
    (0..solvers).map(|s| rows.clone().filter(|row| takes(s, row)).count()).collect()
}

/// The points that are better than all before, in the order of time.
fn running_best(mut points: Vec<(f64, f64)>) -> Vec<(f64, f64)> {
    points.retain(|(t, residual)| t.is_finite() && *residual >= 0.0 && residual.is_finite());
    points.sort_by(|a, b| a.0.total_cmp(&b.0).then(a.1.total_cmp(&b.1)));
    let mut best = f64::INFINITY;
    points.retain(|&(_, residual)| {
        let better = residual < best;
        best = best.min(residual);
        better
    });
    points
}

/// The tolerances of [`success`], the largest first: one for each decade from 1e-3 to 1e-14.
pub const DECADES: [f64; 12] =
    [1e-3, 1e-4, 1e-5, 1e-6, 1e-7, 1e-8, 1e-9, 1e-10, 1e-11, 1e-12, 1e-13, 1e-14];

/// What is reached of the problems of one class of size.
#[derive(Debug, Clone, PartialEq)]
pub struct Success {
    /// The class; none for all sizes together.
    pub size: Option<Size>,
    /// Its problems, |P|.
    pub problems: usize,
    /// For each solver that takes one of them, and then the [`VIRTUAL_BEST`], the share of its problems for each of
    /// [`DECADES`].
    pub shares: Vec<(String, [f64; DECADES.len()])>,
}

/// The share of problems solved against the tolerance, `|{p ∈ P_s : e_ps ≤ ε}| / |P_s|` for ε of [`DECADES`], for all sizes
/// and then for each class of size that has problems; and the solvers left out, which solve and tell no residuals.
/// `e_ps` is the smallest residual that s reached on p in any run, 0 for a proof that there is no solution.
///
/// A run stops at its own tolerance: the shares below the tightest tolerance of the campaign are lower bounds. So a
/// campaign for this figure has to ask for a tight one. A foreign program's residual is its own error.
pub fn success(runs: &Runs, selection: &Selection) -> (Vec<Success>, Vec<String>) {
    let (solvers, left_out) = selection.telling(runs, |run| run.reached().is_some());
    let all = pairs(runs, selection, &solvers);
    let size_of = |row: &[Vec<&Run>]| row.iter().flatten().next().map(|r| Size::of(r.contacts));
    let reached =
        |pair: &[&Run]| pair.iter().filter_map(|run| run.reached()).fold(f64::INFINITY, f64::min);
    let of = |size: Option<Size>| {
        let rows: Vec<&Vec<Vec<&Run>>> =
            all.values().filter(|row| size.is_none() || size_of(row) == size).collect();
        let share = |e: &dyn Fn(&[Vec<&Run>]) -> f64, n: usize| {
            let residuals: Vec<f64> = rows.iter().map(|row| e(row)).collect();
            DECADES.map(|eps| residuals.iter().filter(|e| **e <= eps).count() as f64 / n as f64)
        };
        let counts = applicable(rows.iter().copied(), solvers.len());
        let taken = solvers.iter().zip(counts).enumerate().filter(|(_, (_, n))| *n > 0);
        let mut shares: Vec<_> =
            taken.map(|(s, (&l, n))| (l.into(), share(&|row| reached(&row[s]), n))).collect();
        let any = rows.iter().filter(|row| !row.iter().all(refused)).count();
        if any > 0 {
            let best = |row: &[Vec<&Run>]| {
                row.iter().map(|pair| reached(pair)).fold(f64::INFINITY, f64::min)
            };
            shares.push((VIRTUAL_BEST.into(), share(&best, any)));
        }
        Success { size, problems: rows.len(), shares }
    };
    let classes = [None].into_iter().chain(SIZES.map(Some));
    (classes.map(of).filter(|s| s.problems > 0).collect(), left_out)
}
