//! What a page shows, counted once: the figures and tables of each kind of problem, group of its problems, and tolerance.
//!
//! The script of the page chooses one of these views and draws it; hiding a solver hides its curves and rows and changes
//! no number, since the best is that of all solvers of the kind. Curves stand on a logarithmic grid of
//! [`GRID`] points a decade, rounded up, as differences: two characters a step instead of a dozen.

use std::collections::{BTreeMap, HashMap};

use serde::Serialize;

use super::data::rounded;
use crate::profile::{
    Cost, Costs, Curve, DECADES, Progress, Selection, VIRTUAL_BEST, performance,
    performance_of_best, success,
};
use crate::record::{SIZES, Size};
use crate::runs::Runs;
use crate::tables::{self, By, summary, unsolved};

/// Points of the grid of a decade: neighbours differ by 0.23 %, which no picture shows.
const GRID: f64 = 1000.0;
/// Residuals below count as this.
const LEAST: f64 = 1e-17;

/// The indices by which a page refers to its texts.
#[derive(Debug)]
pub struct Names<'a> {
    /// Of the labels of solvers.
    pub solvers: HashMap<&'a str, usize>,
    /// Of the names of problems.
    pub problems: HashMap<&'a str, usize>,
    /// Of the families.
    pub families: HashMap<&'a str, usize>,
}

impl Names<'_> {
    /// The index of a solver; -1 for the virtual best.
    fn solver(&self, label: &str) -> isize {
        if label == VIRTUAL_BEST { -1 } else { self.solvers[label] as isize }
    }

    fn all<S: AsRef<str>>(&self, labels: &[S]) -> Vec<isize> {
        labels.iter().map(|l| self.solver(l.as_ref())).collect()
    }
}

/// A kind of problem.
#[derive(Debug, Serialize)]
pub struct Kind<'a> {
    name: &'a str,
    /// What the size of a problem counts: contacts, pairs or variables.
    counted: &'static str,
    /// Those that take a problem of the kind.
    solvers: Vec<isize>,
    /// Those that were asked to and refuse all.
    refusing: Vec<isize>,
    /// Indices of the tolerances with runs.
    tolerances: Vec<usize>,
    /// The residuals of the data profiles.
    epsilons: Vec<f64>,
    groups: Vec<Group>,
}

/// Problems of a kind that are looked at together: all, a family, a class of size.
#[derive(Debug, Serialize)]
struct Group {
    /// The index of the family.
    #[serde(skip_serializing_if = "Option::is_none")]
    family: Option<usize>,
    /// The index of the class of size.
    #[serde(skip_serializing_if = "Option::is_none")]
    size: Option<usize>,
    /// Problems with a run at any tolerance.
    problems: usize,
    /// A data profile for each residual of [`epsilons`].
    data: Vec<Drawn>,
    /// The median residual against time.
    residual: Drawn,
    success: Vec<Success>,
    success_left_out: Vec<isize>,
    /// By index into the tolerances of the kind.
    at: Vec<At>,
}

/// What depends on the tolerance.
#[derive(Debug, Serialize)]
struct At {
    /// Problems with a run at this tolerance.
    problems: usize,
    profiles: BTreeMap<&'static str, Drawn>,
    rows: Vec<Row>,
    /// Family by family, with the rows of its solvers.
    families: Vec<(usize, Vec<Row>)>,
    /// Problem, and who came closest with which residual.
    unsolved: Vec<(usize, Option<(isize, f64)>)>,
}

/// The curves of a figure.
#[derive(Debug, Serialize)]
struct Drawn {
    /// Solvers that solve and do not tell what the figure shows.
    left_out: Vec<isize>,
    curves: Vec<Steps>,
}

/// A step function. Each number is the difference from the one before, on the grid.
#[derive(Debug, Serialize)]
struct Steps {
    solver: isize,
    x: Vec<i64>,
    /// The values; left out of shares, which rise by one of `of` problems at each x.
    #[serde(skip_serializing_if = "Option::is_none")]
    y: Option<Vec<i64>>,
    #[serde(skip_serializing_if = "Option::is_none")]
    of: Option<usize>,
}

/// Shares for each of [`DECADES`], in a class of size.
#[derive(Debug, Serialize)]
struct Success {
    size: &'static str,
    problems: usize,
    shares: Vec<(isize, Vec<f64>)>,
}

/// A row of a summary.
#[derive(Debug, Serialize)]
struct Row {
    solver: isize,
    problems: usize,
    solved: usize,
    refused: usize,
    fastest: usize,
    missing: usize,
    #[serde(skip_serializing_if = "Option::is_none")]
    ratio: Option<f64>,
    seconds: f64,
    /// Absent in tables by family, and of the virtual best.
    #[serde(skip_serializing_if = "Option::is_none")]
    endings: Option<Vec<usize>>,
}

/// The residuals of the data profiles: those of the figure of success, and the tolerances.
fn epsilons(runs: &Runs) -> Vec<f64> {
    let mut all = [DECADES.as_slice(), &runs.tolerances()].concat();
    all.sort_by(|a, b| b.total_cmp(a));
    all.dedup();
    all
}

/// The views of all kinds, that with the most problems first.
pub fn views<'a>(runs: &'a Runs, names: &Names) -> Vec<Kind<'a>> {
    runs.kinds().into_iter().map(|(kind, _)| of_kind(runs, names, kind)).collect()
}

fn of_kind<'a>(runs: &'a Runs, names: &Names, kind: &'a str) -> Kind<'a> {
    // Runs of other kinds are looked at no more.
    let mine = runs.runs.iter().filter(|r| r.kind == kind).cloned().collect();
    let mine = Runs { campaigns: runs.campaigns.clone(), runs: mine, ..Runs::default() };
    let tolerances = mine.tolerances();
    let whole = Selection::at(kind, 0.0);
    let mut families: Vec<&str> = mine.runs.iter().map(|r| r.family.as_str()).collect();
    families.sort_unstable();
    families.dedup();
    let sizes = SIZES.map(|s| mine.runs.iter().any(|r| Size::of(r.contacts) == s).then_some(s));
    let sizes: Vec<Size> = sizes.into_iter().flatten().collect();
    let group = |selection: &Selection| of_group(&mine, names, selection, &tolerances);
    let mut groups = vec![group(&whole)];
    // A family or a class that is alone is all there is.
    if families.len() > 1 {
        groups.extend(families.iter().map(|&f| Group {
            family: Some(names.families[f]),
            ..group(&Selection { families: vec![f.into()], ..whole.clone() })
        }));
    }
    if sizes.len() > 1 {
        groups.extend(sizes.iter().map(|&size| Group {
            size: SIZES.iter().position(|s| *s == size),
            ..group(&Selection { sizes: vec![size], ..whole.clone() })
        }));
    }
    let all = runs.tolerances();
    Kind {
        name: kind,
        counted: whole.counted(),
        solvers: names.all(&whole.solvers(&mine)),
        refusing: names.all(&whole.refusing(&mine)),
        epsilons: epsilons(&mine),
        tolerances: tolerances.iter().filter_map(|t| all.iter().position(|a| a == t)).collect(),
        groups,
    }
}

fn of_group(runs: &Runs, names: &Names, selection: &Selection, tolerances: &[f64]) -> Group {
    let progress = Progress::of(runs, selection);
    let best = progress.best();
    let left_out = || names.all(&progress.left_out);
    let data = |epsilon: f64| {
        let curves = progress.data_profile(epsilon).into_iter().zip(&progress.applicable);
        let best = best.data_profile(epsilon).remove(0);
        Drawn {
            left_out: left_out(),
            curves: shares(names, curves, best, &progress.applicable_to_any),
        }
    };
    let medians = progress.quantile(0.5);
    let residual = medians.iter().filter(|c| !c.steps.is_empty()).map(|c| Steps::values(names, c));
    let (classes, success_left_out) = success(runs, selection);
    let several = classes.len() > 2;
    Group {
        family: None,
        size: None,
        problems: progress.problems.len(),
        data: epsilons(runs).into_iter().map(data).collect(),
        residual: Drawn { left_out: left_out(), curves: residual.collect() },
        success: classes
            .into_iter()
            .filter(|class| several || class.size.is_some())
            .map(|class| Success {
                size: class.size.map_or("all", |s| s.name),
                problems: class.problems,
                shares: alone(class.shares)
                    .map(|(s, shares)| (names.solver(&s), shares.map(rounded).to_vec()))
                    .collect(),
            })
            .collect(),
        success_left_out: names.all(&success_left_out),
        at: tolerances
            .iter()
            .map(|&tolerance| at(runs, names, &Selection { tolerance, ..selection.clone() }))
            .collect(),
    }
}

fn at(runs: &Runs, names: &Names, selection: &Selection) -> At {
    let profile = |cost: Cost| {
        let (costs, left_out) = Costs::of(runs, selection, cost).counted();
        let of: Vec<usize> = (0..costs.solvers.len()).map(|s| costs.applicable(s)).collect();
        let curves = performance(&costs).into_iter().zip(&of);
        let best = performance_of_best(&costs);
        let curves = shares(names, curves, best, &costs.applicable_to_any());
        (cost.name(), Drawn { left_out: names.all(&left_out), curves })
    };
    let rows = summary(runs, selection, By::All);
    let by_family = summary(runs, selection, By::Family);
    let families = by_family.chunk_by(|a, b| a.group == b.group).map(|rows| {
        let row = |r: &tables::Row| Row { endings: None, ..Row::of(names, r) };
        let solvers = rows.iter().filter(|r| r.solver != VIRTUAL_BEST);
        (names.families[rows[0].group.as_str()], solvers.map(row).collect())
    });
    let unsolved = unsolved(runs, selection).into_iter().map(|u| {
        let closest = u.closest.map(|(solver, residual)| (names.solver(&solver), residual));
        (names.problems[u.problem.as_str()], closest)
    });
    At {
        problems: rows.first().map_or(0, |r| r.problems),
        profiles: Cost::ALL.map(profile).into_iter().collect(),
        rows: rows.iter().map(|r| Row::of(names, r)).collect(),
        families: families.collect(),
        unsolved: unsolved.collect(),
    }
}

/// Without the virtual best of a single solver.
fn alone(mut all: Vec<(String, [f64; 12])>) -> impl Iterator<Item = (String, [f64; 12])> {
    if all.len() == 2 {
        all.pop();
    }
    all.into_iter()
}

/// Curves of shares with the numbers of problems that they are shares of; the best last, unless it is that of one.
fn shares<'a>(
    names: &Names,
    curves: impl Iterator<Item = (Curve, &'a usize)>,
    best: Curve,
    of_best: &'a usize,
) -> Vec<Steps> {
    let mut all: Vec<(Curve, &usize)> = curves.filter(|(_, of)| **of > 0).collect();
    if all.len() > 1 {
        all.push((best, of_best));
    }
    all.into_iter().map(|(curve, of)| Steps::shares(names, &curve, *of)).collect()
}

/// Neighbours' differences.
fn differences(values: impl Iterator<Item = f64>) -> Vec<i64> {
    let mut before = 0;
    values
        .map(|v| {
            let now = (GRID * v.log10()).ceil() as i64;
            now - std::mem::replace(&mut before, now)
        })
        .collect()
}

impl Steps {
    /// Of a curve that counts problems: each rise by one stands for itself, so heights need no numbers.
    fn shares(names: &Names, curve: &Curve, of: usize) -> Self {
        let mut counted = 0;
        let rises = curve.steps.iter().flat_map(|&(x, share)| {
            let count = (share * of as f64).round() as usize;
            std::iter::repeat_n(x, count - std::mem::replace(&mut counted, count))
        });
        let x = differences(rises.map(|x| x.max(Cost::Seconds.floor())));
        Self { solver: names.solver(&curve.solver), x, y: None, of: Some(of) }
    }

    /// Of a curve of residuals against time.
    fn values(names: &Names, curve: &Curve) -> Self {
        let times = curve.steps.iter().map(|step| step.0.max(Cost::Seconds.floor()));
        let residuals = curve.steps.iter().map(|step| step.1.max(LEAST));
        let (x, y) = (differences(times), differences(residuals));
        Self { solver: names.solver(&curve.solver), x, y: Some(y), of: None }
    }
}

impl Row {
    fn of(names: &Names, row: &tables::Row) -> Self {
        Self {
            solver: names.solver(&row.solver),
            problems: row.problems,
            solved: row.solved,
            refused: row.refused,
            fastest: row.fastest,
            missing: row.missing,
            ratio: row.ratio_median.map(rounded),
            seconds: rounded(row.seconds),
            endings: row.endings.map(|e| e.to_vec()),
        }
    }
}
