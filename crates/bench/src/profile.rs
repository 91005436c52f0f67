//! Who solves how much, and how fast: performance profiles, data profiles, and success against tolerance.
//!
//! Everything here is counted over a [`Selection`] of the runs. P is the set of its problems on which at least one of its solvers
//! was run (for [`Costs`]: at its tolerance). A pair of P and solver without a run counts as not solved, and
//! [`Costs::missing`] says how many there are; problems that nobody was run on are not in P. A problem that nobody
//! solves stays in P, so a curve ends at the share that its solver solves of all.
//!
//! References: DolanMore2002 (performance profiles), MoreWild2009 (data profiles), GouldScott2016 (what a profile of more than two
//! solvers does not say).

use std::collections::{BTreeMap, BTreeSet, HashMap};

use crate::record::{Run, SIZES, Size};
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

/// Which runs are looked at. An empty list stands for all.
#[derive(Debug, Clone, PartialEq)]
pub struct Selection {
    /// The relative residual that the runs were to reach.
    pub tolerance: f64,
    /// Families of problems.
    pub families: Vec<String>,
    /// Classes of size.
    pub sizes: Vec<Size>,
    /// Kinds of problem.
    pub kinds: Vec<String>,
    /// Labels of solvers.
    pub solvers: Vec<String>,
}

impl Selection {
    /// All problems and all solvers at one tolerance.
    pub fn at(tolerance: f64) -> Self {
        Self { tolerance, families: vec![], sizes: vec![], kinds: vec![], solvers: vec![] }
    }

    /// Whether a run belongs to it, whatever its tolerance.
    pub fn takes(&self, run: &Run) -> bool {
        fn one<T: PartialEq<U>, U: ?Sized>(list: &[T], item: &U) -> bool {
            list.is_empty() || list.iter().any(|l| l == item)
        }
        one(&self.families, run.family.as_str())
            && one(&self.kinds, run.kind.as_str())
            && one(&self.solvers, run.solver.as_str())
            && one(&self.sizes, &Size::of(run.contacts))
    }

    /// The selected runs at its tolerance.
    pub(crate) fn taken<'a>(&self, runs: &'a Runs) -> Vec<&'a Run> {
        let at = |r: &&Run| r.tolerance == self.tolerance && self.takes(r);
        runs.runs.iter().filter(at).collect()
    }

    /// The labels of the selected solvers, in the order in which the runs name them.
    pub fn solvers<'a>(&self, runs: &'a Runs) -> Vec<&'a str> {
        let all = runs.solvers().into_iter();
        all.filter(|&s| self.solvers.is_empty() || self.solvers.iter().any(|l| l == s)).collect()
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
    /// For each solver, pairs with problems of P that were not run. They count as not solved.
    pub missing: Vec<usize>,
    /// For each solver, solved runs whose cost is not known. They count as not solved here.
    pub unknown: Vec<usize>,
}

impl Costs {
    /// The costs of the selected runs at the tolerance of the selection.
    pub fn of(runs: &Runs, selection: &Selection, cost: Cost) -> Self {
        Self::over(&selection.solvers(runs), &selection.taken(runs), cost)
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
        let mut unknown = vec![0; solvers.len()];
        for run in taken {
            let s = index[run.solver.as_str()];
            missing[s] -= 1;
            if run.solved() {
                match cost.of(run) {
                    Some(c) => t[s][column[run.problem.as_str()]] = c,
                    None => unknown[s] += 1,
                }
            }
        }
        Self {
            solvers: solvers.iter().map(|s| s.to_string()).collect(),
            problems: problems.into_iter().map(String::from).collect(),
            t,
            missing,
            unknown,
        }
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

/// Performance profiles (DolanMore2002): `ρ_s(τ) = |{p ∈ P : r_ps ≤ τ}| / |P|` with `r_ps = t_ps / min_s t_ps`, for τ ≥ 1.
///
/// `ρ_s(1)` is the share of problems on which s is the fastest (ties count for each), the last value the share that s
/// solves. With more than two solvers a profile shows how far each is from the best of the set and
/// does not rank them: without the best, the order of the others can change (GouldScott2016).
pub fn performance(costs: &Costs) -> Vec<Curve> {
    let n = costs.problems.len();
    let rows = costs.solvers.iter().zip(costs.ratios());
    rows.map(|(solver, ratios)| Curve::share(solver, ratios, n)).collect()
}

/// The performance profile of the virtual best: from τ = 1 on the share of problems that anybody solves.
pub fn performance_of_best(costs: &Costs) -> Curve {
    let ones = costs.best().into_iter().map(|b| if b < f64::INFINITY { 1.0 } else { b });
    Curve::share(VIRTUAL_BEST, ones.collect(), costs.problems.len())
}

/// The best residual that every solver had on every problem of P as time went on, over its runs at any
/// tolerance: at the points of their traces, and at their ends.
///
/// A run ends at its own tolerance, so what lies below is known only if a run was to go there. A foreign program's
/// residual is its own error.
#[derive(Debug, Clone, PartialEq)]
pub struct Progress {
    /// Labels of solvers.
    pub solvers: Vec<String>,
    /// The problems P: those of the selection with a run of any of the solvers at any tolerance.
    pub problems: Vec<String>,
    /// `steps[s][p]`: pairs (seconds, best residual so far), ascending in time and strictly descending in residual.
    pub steps: Vec<Vec<Vec<(f64, f64)>>>,
}

impl Progress {
    /// The progress of the selected runs.
    pub fn of(runs: &Runs, selection: &Selection) -> Self {
        let solvers = selection.solvers(runs);
        let index: HashMap<&str, usize> =
            solvers.iter().enumerate().map(|(s, &label)| (label, s)).collect();
        let mut points: BTreeMap<&str, Vec<Vec<(f64, f64)>>> = BTreeMap::new();
        for run in runs.runs.iter().filter(|r| selection.takes(r)) {
            let row = points.entry(&run.problem).or_insert_with(|| vec![vec![]; solvers.len()]);
            let pair = &mut row[index[run.solver.as_str()]];
            pair.extend(run.trace.iter().map(|&(_, seconds, residual)| (seconds, residual)));
            pair.extend(run.seconds.zip(run.residuals.reached));
        }
        let problems = points.keys().map(|&p| p.into()).collect();
        let mut steps = vec![vec![]; solvers.len()];
        for row in points.into_values() {
            for (steps, pair) in steps.iter_mut().zip(row) {
                steps.push(running_best(pair));
            }
        }
        Self { solvers: solvers.into_iter().map(String::from).collect(), problems, steps }
    }

    /// The virtual best: on each problem the best residual that any solver had by then.
    pub fn best(&self) -> Self {
        let column = |p: usize| {
            running_best(self.steps.iter().flat_map(|row| row[p].iter().copied()).collect())
        };
        Self {
            solvers: vec![VIRTUAL_BEST.into()],
            problems: self.problems.clone(),
            steps: vec![(0..self.problems.len()).map(column).collect()],
        }
    }

    /// Data profiles: `d_s(t) = |{p ∈ P : s has a residual of at most ε on p within t seconds}| / |P|`.
    ///
    /// MoreWild2009 counts evaluations of a function in units of the dimension, and asks for a part of the best
    /// decrease known; here the cost is time and the goal is a residual.
    pub fn data_profile(&self, epsilon: f64) -> Vec<Curve> {
        let reached = |steps: &Vec<(f64, f64)>| {
            // Residuals fall along the steps.
            let k = steps.partition_point(|step| step.1 > epsilon);
            steps.get(k).map_or(f64::INFINITY, |step| step.0)
        };
        let rows = self.solvers.iter().zip(&self.steps);
        let n = self.problems.len();
        rows.map(|(s, row)| Curve::share(s, row.iter().map(reached).collect(), n)).collect()
    }

    /// The residual within which the given part of P is, as a function of time: the smallest e such that
    /// `|{p ∈ P : best residual by t ≤ e}| ≥ part |P|`; +∞ while there is none. `part` lies in (0, 1]: 0.5 gives the
    /// (lower) median.
    pub fn quantile(&self, part: f64) -> Vec<Curve> {
        let n = self.problems.len();
        let rank = ((part * n as f64).ceil() as usize).clamp(1, n.max(1)) - 1;
        let rows = self.solvers.iter().zip(&self.steps);
        rows.map(|(solver, row)| {
            let mut events: Vec<(f64, usize, f64)> = vec![];
            for (p, steps) in row.iter().enumerate() {
                events.extend(steps.iter().map(|&(t, residual)| (t, p, residual)));
            }
            events.sort_by(|a, b| a.0.total_cmp(&b.0));
            let mut now = vec![f64::INFINITY; n];
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
    /// For each solver, and then the [`VIRTUAL_BEST`], the share of its problems for each of [`DECADES`].
    pub shares: Vec<(String, [f64; DECADES.len()])>,
}

/// The share of problems solved against the tolerance, `|{p ∈ P : e_ps ≤ ε}| / |P|` for ε of [`DECADES`], for all sizes
/// and then for each class of size that has problems. `e_ps` is the smallest residual that s reached on p in any run.
///
/// A run stops at its own tolerance: the shares below the tightest tolerance of the campaign are lower bounds. So a
/// campaign for this figure has to ask for a tight one. A foreign program's residual is its own error.
pub fn success(runs: &Runs, selection: &Selection) -> Vec<Success> {
    let solvers = selection.solvers(runs);
    let index: HashMap<&str, usize> = solvers.iter().enumerate().map(|(s, &l)| (l, s)).collect();
    let mut reached: BTreeMap<&str, (Size, Vec<f64>)> = BTreeMap::new();
    for run in runs.runs.iter().filter(|r| selection.takes(r)) {
        let fresh = || (Size::of(run.contacts), vec![f64::INFINITY; solvers.len()]);
        let row = &mut reached.entry(&run.problem).or_insert_with(fresh).1;
        let best = &mut row[index[run.solver.as_str()]];
        *best = best.min(run.residuals.reached.unwrap_or(f64::INFINITY));
    }
    let of = |size: Option<Size>| {
        let rows = reached.values().filter(|(s, _)| size.is_none_or(|size| *s == size));
        let rows: Vec<&Vec<f64>> = rows.map(|(_, row)| row).collect();
        let share = |e: &dyn Fn(&[f64]) -> f64| {
            let count = |eps: f64| rows.iter().filter(|row| e(row) <= eps).count();
            DECADES.map(|eps| count(eps) as f64 / rows.len() as f64)
        };
        let mut shares: Vec<_> =
            solvers.iter().enumerate().map(|(s, &l)| (l.into(), share(&|row| row[s]))).collect();
        let best = |row: &[f64]| row.iter().copied().fold(f64::INFINITY, f64::min);
        shares.push((VIRTUAL_BEST.into(), share(&best)));
        Success { size, problems: rows.len(), shares }
    };
    let classes = [None].into_iter().chain(SIZES.map(Some));
    classes.map(of).filter(|s| s.problems > 0).collect()
}
