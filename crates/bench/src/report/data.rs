//! The data of a page: its views, and the runs as columns of numbers and of indices into tables of texts, so that 20 000
//! of them stay small.

use std::collections::{BTreeMap, BTreeSet, HashMap};

use serde::Serialize;

use super::views;
use crate::profile::DECADES;
use crate::record::{Ending, Problem, Run, SIZES, Size};
use crate::runs::Runs;

/// Points of traces in a page, about; what a run gets of them lies between the bounds of [`EVEN`].
const TRACE_POINTS: usize = 200_000;
/// The fewest and the most evenly spaced points of a trace.
const EVEN: (usize, usize) = (4, 24);

/// What the script of the page reads. The order of the tables is that of their indices.
#[derive(Debug, Serialize)]
pub struct Data<'a> {
    solvers: Vec<Solver<'a>>,
    families: Vec<&'a str>,
    sizes: [&'static str; SIZES.len()],
    endings: Vec<&'static str>,
    tolerances: Vec<f64>,
    /// The residuals of the figure of success.
    decades: [f64; DECADES.len()],
    kinds: Vec<views::Kind<'a>>,
    messages: Vec<&'a str>,
    problems: Problems<'a>,
    /// Name and error of each problem that could not be read.
    unreadable: Vec<(&'a str, &'a str)>,
    runs: Columns,
    /// By index of the run.
    traces: BTreeMap<usize, Trace>,
}

/// Seconds, and the residuals at them.
type Trace = (Vec<f64>, Vec<f64>);

#[derive(Debug, Serialize)]
struct Solver<'a> {
    label: &'a str,
    foreign: bool,
    machines: BTreeSet<&'a str>,
}

/// The problems that have runs.
#[derive(Debug, Default, Serialize)]
struct Problems<'a> {
    name: Vec<&'a str>,
    family: Vec<usize>,
    kind: Vec<usize>,
    size: Vec<usize>,
    contacts: Vec<usize>,
    unknowns: Vec<usize>,
    #[serde(skip_serializing_if = "unknown")]
    dofs: Vec<Option<usize>>,
    #[serde(skip_serializing_if = "unknown")]
    density: Vec<Option<f64>>,
    #[serde(skip_serializing_if = "unknown")]
    asymmetry: Vec<Option<f64>>,
    #[serde(skip_serializing_if = "unknown")]
    mu_min: Vec<Option<f64>>,
    #[serde(skip_serializing_if = "unknown")]
    mu_max: Vec<Option<f64>>,
}

#[derive(Debug, Default, Serialize)]
struct Columns {
    problem: Vec<usize>,
    solver: Vec<usize>,
    tolerance: Vec<usize>,
    ending: Vec<usize>,
    #[serde(skip_serializing_if = "unknown")]
    message: Vec<Option<usize>>,
    #[serde(skip_serializing_if = "unknown")]
    iterations: Vec<Option<u64>>,
    #[serde(skip_serializing_if = "unknown")]
    factorisations: Vec<Option<u64>>,
    #[serde(skip_serializing_if = "unknown")]
    seconds: Vec<Option<f64>>,
    #[serde(skip_serializing_if = "unknown")]
    reached: Vec<Option<f64>>,
    #[serde(skip_serializing_if = "unknown")]
    peak_memory: Vec<Option<u64>>,
}

/// Whether a column says nothing.
fn unknown<T>(column: &[Option<T>]) -> bool {
    column.iter().all(Option::is_none)
}

/// A table of texts, each once, in the order of their first appearance.
#[derive(Debug, Default)]
struct Texts<'a> {
    all: Vec<&'a str>,
    index: HashMap<&'a str, usize>,
}

impl<'a> Texts<'a> {
    fn index(&mut self, text: &'a str) -> usize {
        *self.index.entry(text).or_insert_with(|| {
            self.all.push(text);
            self.all.len() - 1
        })
    }
}

impl<'a> Data<'a> {
    /// The data of all runs.
    pub fn of(all: &'a Runs) -> Self {
        let campaigns: HashMap<&str, _> =
            all.campaigns.iter().map(|c| (c.id.as_str(), c)).collect();
        let tolerances = all.tolerances();
        let tolerance: HashMap<u64, usize> =
            tolerances.iter().enumerate().map(|(k, t)| (t.to_bits(), k)).collect();
        let (mut names, mut labels) = (Texts::default(), Texts::default());
        let mut families = Texts::default();
        let kinds: Vec<&str> = all.kinds().into_iter().map(|(kind, _)| kind).collect();
        let mut messages = Texts::default();
        let mut problems = Problems::default();
        let blank = |label| Solver { label, foreign: false, machines: BTreeSet::new() };
        let mut solvers: Vec<Solver> = all.solvers().into_iter().map(blank).collect();
        for solver in &solvers {
            labels.index(solver.label);
        }
        let mut runs = Columns::default();
        for run in &all.runs {
            let problem = names.index(&run.problem);
            // Runs of one problem may name several, of which views know all.
            let family = families.index(&run.family);
            if problem == problems.name.len() {
                problems.family.push(family);
                problems.kind.push(kinds.iter().position(|k| *k == run.kind).unwrap_or_default());
                problems.push(run, all.problems.get(&run.problem));
            }
            let solver = labels.index(&run.solver);
            if let Some(campaign) = campaigns.get(run.campaign.as_str()) {
                solvers[solver].foreign |= campaign.foreign;
                solvers[solver].machines.insert(&campaign.machine.cpu);
            }
            runs.problem.push(problem);
            runs.solver.push(solver);
            runs.tolerance.push(tolerance[&run.tolerance.to_bits()]);
            runs.ending.push(Ending::ALL.iter().position(|&e| e == run.ending).unwrap_or_default());
            runs.message.push(run.message.as_deref().map(|m| messages.index(m)));
            runs.iterations.push(run.iterations);
            runs.factorisations.push(run.factorisations);
            runs.seconds.push(run.seconds);
            runs.reached.push(run.residuals.reached);
            runs.peak_memory.push(run.peak_memory);
        }
        let error = |p: &'a Problem| p.error.as_ref().map(|e| (p.name.as_str(), e.as_str()));
        let names =
            views::Names { solvers: labels.index, problems: names.index, families: families.index };
        Self {
            solvers,
            families: families.all,
            sizes: SIZES.map(|s| s.name),
            endings: Ending::ALL.iter().map(|e| e.name()).collect(),
            tolerances,
            decades: DECADES,
            kinds: views::views(all, &names),
            messages: messages.all,
            problems,
            unreadable: all.problems.values().filter_map(error).collect(),
            runs,
            traces: traces(&all.runs),
        }
    }
}

impl<'a> Problems<'a> {
    fn push(&mut self, run: &'a Run, known: Option<&'a Problem>) {
        self.name.push(&run.problem);
        let size = Size::of(run.contacts);
        self.size.push(SIZES.iter().position(|s| *s == size).unwrap_or_default());
        self.contacts.push(run.contacts);
        self.unknowns.push(known.map_or(0, |p| p.unknowns));
        self.dofs.push(known.and_then(|p| p.dofs));
        self.density.push(known.and_then(|p| p.density).map(rounded));
        self.asymmetry.push(known.and_then(|p| p.asymmetry).map(rounded));
        self.mu_min.push(known.and_then(|p| p.mu_min).map(rounded));
        self.mu_max.push(known.and_then(|p| p.mu_max).map(rounded));
    }
}

fn traces(runs: &[Run]) -> BTreeMap<usize, Trace> {
    let traced = runs.iter().filter(|r| !r.trace.is_empty()).count().max(1);
    let even = (TRACE_POINTS / traced).clamp(EVEN.0, EVEN.1);
    let columns = |run: &Run| {
        let kept = thinned(&run.trace, even);
        let points = || kept.iter().map(|&k| run.trace[k]);
        (points().map(|p| rounded(p.1)).collect(), points().map(|p| rounded_up(p.2)).collect())
    };
    let traced = runs.iter().enumerate().filter(|(_, r)| !r.trace.is_empty());
    traced.map(|(k, run)| (k, columns(run))).collect()
}

/// The points of a trace that a page keeps: the first, the last, `even` spaced evenly, and the first one below each
/// power of ten. So the time at which a residual of 10⁻ᵏ is reached is the same as in the whole trace.
fn thinned(trace: &[(u64, f64, f64)], even: usize) -> BTreeSet<usize> {
    let last = trace.len() - 1;
    let mut kept: BTreeSet<usize> = (0..even).map(|k| k * last / (even - 1)).collect();
    let mut decades =
        (-17..=0).rev().map(|k| format!("1e{k}").parse().unwrap_or(f64::NAN)).peekable();
    for (k, &(_, _, residual)) in trace.iter().enumerate() {
        while decades.next_if(|&decade: &f64| residual <= decade).is_some() {
            kept.insert(k);
        }
    }
    kept
}

/// Four digits.
pub(super) fn rounded(value: f64) -> f64 {
    format!("{value:.3e}").parse().unwrap_or(value)
}

/// Four digits and not less than `value`: what is above a power of ten stays above it.
fn rounded_up(value: f64) -> f64 {
    let near = rounded(value);
    match near < value {
        true => rounded(near + 10f64.powf(value.abs().log10().floor() - 3.0)),
        false => near,
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_thinned_trace_reaches_each_power_of_ten_at_the_same_point() {
        // Falls by 3 % a step with a bump at every seventh.
        let trace: Vec<(u64, f64, f64)> = (0..1200)
            .map(|k| {
                let bump = if k % 7 == 0 { 5.0 } else { 1.0 };
                (k, 0.01 * k as f64, bump * 0.97f64.powi(k as i32))
            })
            .collect();
        for even in [2, 4, 24] {
            let kept = thinned(&trace, even);
            assert!(kept.len() <= even + 18 && kept.contains(&0) && kept.contains(&1199));
            for decade in [1e-1, 1e-5, 1e-8, 1e-12, 1e-14] {
                let whole = trace.iter().position(|p| p.2 <= decade);
                let thin = kept.iter().copied().find(|&k| rounded_up(trace[k].2) <= decade);
                assert_eq!(thin, whole, "{decade}");
            }
        }
        assert_eq!(thinned(&trace[..1], 4).len(), 1);
    }

    #[test]
    fn rounding_up_keeps_the_side_of_a_power_of_ten() {
        assert_eq!(rounded_up(1e-8), 1e-8);
        assert_eq!(rounded_up(9.99999e-9), 1e-8);
        assert_eq!(rounded_up(1.00001e-8), 1.001e-8);
        assert_eq!(rounded_up(0.0), 0.0);
    }
}
