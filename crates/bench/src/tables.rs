//! Tables of a campaign: who solves what, how fast, and why not; as CSV and as Markdown.

use std::collections::{BTreeMap, HashMap, HashSet};

use crate::profile::{Cost, Costs, Selection, VIRTUAL_BEST};
use crate::record::{Ending, Run, Size};
use crate::runs::Runs;

/// By what the problems of a table are put into groups.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum By {
    /// All together.
    All,
    /// By family.
    Family,
    /// By class of size.
    Size,
}

/// What a solver did on a group of problems, at one tolerance. Times are those of the fastest solve, s.
#[derive(Debug, Clone, PartialEq)]
pub struct Row {
    /// The family, the class of size, or `all`.
    pub group: String,
    /// The solver's label, or [`VIRTUAL_BEST`].
    pub solver: String,
    /// Problems of the group on which at least one solver of the selection was run.
    pub problems: usize,
    /// Those that the solver solved.
    pub solved: usize,
    /// Problems that the solver refuses; of the virtual best, that every solver refuses. No share counts them.
    pub refused: usize,
    /// Those on which it was the fastest; ties count for each.
    pub fastest: usize,
    /// The median of its time over the best time, on the problems that it solved.
    pub ratio_median: Option<f64>,
    /// The geometric mean of the same.
    pub ratio_mean: Option<f64>,
    /// The time of all its runs together, those that failed included; of the virtual best, of the solved.
    pub seconds: f64,
    /// How its runs ended, in the order of [`Ending::ALL`]; none for the virtual best.
    pub endings: Option<[usize; Ending::ALL.len()]>,
    /// Problems that it was not run on. They count as not solved.
    pub missing: usize,
}

impl Row {
    /// The share of problems solved, of those that it does not refuse; none where it refuses all.
    pub fn solved_share(&self) -> Option<f64> {
        self.share(self.solved)
    }

    /// The share of problems on which it was the fastest, of the same.
    pub fn fastest_share(&self) -> Option<f64> {
        self.share(self.fastest)
    }

    /// The problems that it does not refuse.
    pub fn taken(&self) -> usize {
        self.problems - self.refused
    }

    fn share(&self, part: usize) -> Option<f64> {
        let of = self.taken();
        (of > 0).then(|| part as f64 / of as f64)
    }
}

/// A row for each solver of the selection and one for the virtual best, for each group that has problems.
pub fn summary(runs: &Runs, selection: &Selection, by: By) -> Vec<Row> {
    let solvers = selection.solvers(runs);
    let mut groups: BTreeMap<(usize, &str), Vec<&Run>> = BTreeMap::new();
    for run in selection.taken(runs, &solvers) {
        let group = match by {
            By::All => (0, "all"),
            By::Family => (0, run.family.as_str()),
            By::Size => {
                let size = Size::of(run.contacts);
                (size.least, size.name)
            }
        };
        groups.entry(group).or_default().push(run);
    }
    groups.into_iter().flat_map(|((_, group), runs)| of_group(&solvers, group, &runs)).collect()
}

/// The rows of a group of runs at one tolerance.
fn of_group(solvers: &[&str], group: &str, runs: &[&Run]) -> Vec<Row> {
    let costs = Costs::over(solvers, runs, Cost::Seconds);
    let mut ended: HashMap<&str, ([usize; Ending::ALL.len()], f64)> = HashMap::new();
    // By the endings: a solved run whose time is not known is solved.
    let mut solved: HashMap<&str, HashSet<&str>> = HashMap::new();
    for run in runs.iter().filter(|r| r.solved()) {
        solved.entry(&run.solver).or_default().insert(&run.problem);
    }
    let by_any: HashSet<&str> = solved.values().flatten().copied().collect();
    for run in runs {
        let (endings, seconds) = ended.entry(&run.solver).or_default();
        endings[Ending::ALL.iter().position(|e| *e == run.ending).unwrap_or(0)] += 1;
        *seconds += run.seconds.unwrap_or(0.0);
    }
    let mut rows: Vec<Row> = vec![];
    for ((s, solver), ratios) in costs.solvers.iter().enumerate().zip(costs.ratios()) {
        let (endings, seconds) = ended.remove(solver.as_str()).unwrap_or_default();
        let mut ratios: Vec<f64> = ratios.into_iter().filter(|r| r.is_finite()).collect();
        ratios.sort_by(f64::total_cmp);
        rows.push(Row {
            group: group.into(),
            solver: solver.clone(),
            problems: costs.problems.len(),
            solved: solved.get(solver.as_str()).map_or(0, |problems| problems.len()),
            refused: costs.refused[s],
            fastest: ratios.iter().filter(|r| **r <= 1.0).count(),
            ratio_median: median(&ratios),
            ratio_mean: geometric_mean(&ratios),
            seconds,
            endings: Some(endings),
            missing: costs.missing[s],
        });
    }
    let best = costs.best();
    let timed: Vec<f64> = best.into_iter().filter(|b| b.is_finite()).collect();
    rows.push(Row {
        group: group.into(),
        solver: VIRTUAL_BEST.into(),
        problems: costs.problems.len(),
        solved: by_any.len(),
        refused: costs.refused_by_all,
        fastest: timed.len(),
        ratio_median: (!timed.is_empty()).then_some(1.0),
        ratio_mean: (!timed.is_empty()).then_some(1.0),
        seconds: timed.iter().sum(),
        endings: None,
        missing: 0,
    });
    rows
}

/// The median of numbers in ascending order; of an even number the mean of the two in the middle.
pub(crate) fn median(sorted: &[f64]) -> Option<f64> {
    let n = sorted.len();
    (n > 0).then(|| 0.5 * (sorted[(n - 1) / 2] + sorted[n / 2]))
}

fn geometric_mean(all: &[f64]) -> Option<f64> {
    let sum: f64 = all.iter().map(|r| r.ln()).sum();
    (!all.is_empty()).then(|| (sum / all.len() as f64).exp())
}

/// The factors of the least time within which a solver of BillupsDirkseFerris1997 is *very competitive*, and *competitive*.
pub const COMPETITIVE: [f64; 2] = [4.0 / 3.0, 2.0];

/// For each solver of the selection: problems that it does not refuse, those solved, and those solved in `T ≤ 4/3 T_min` and `T ≤ 2 T_min`, with T_min the least time of the selected solvers.
///
/// References: BillupsDirkseFerris1997.
pub fn competitive(runs: &Runs, selection: &Selection) -> Table {
    let costs = Costs::of(runs, selection, Cost::Seconds);
    let head = ["solver", "problems", "solved", "T ≤ 4/3 T_min", "T ≤ 2 T_min"];
    // The rows of the solvers, before that of the virtual best.
    let rows = summary(runs, selection, By::All).into_iter().zip(costs.ratios());
    let rows = rows.map(|(row, ratios)| {
        let within = |factor: f64| ratios.iter().filter(|r| **r <= factor).count();
        let [very, fairly] = COMPETITIVE.map(within);
        let counts = [row.taken(), row.solved, very, fairly];
        std::iter::once(row.solver).chain(counts.map(|n| n.to_string())).collect()
    });
    Table { head: head.map(String::from).into(), rows: rows.collect() }
}

/// A problem that no solver of the selection solves.
#[derive(Debug, Clone, PartialEq)]
pub struct Unsolved {
    /// Its name.
    pub problem: String,
    /// Its family.
    pub family: String,
    /// Its kind.
    pub kind: String,
    /// Its contacts.
    pub contacts: usize,
    /// The solver that came closest, with the residual it reached.
    pub closest: Option<(String, f64)>,
    /// How the runs ended, with the number of each.
    pub endings: BTreeMap<Ending, usize>,
}

/// The problems on which solvers were run at the tolerance of the selection and that none solved, but for those that all of them refuse.
pub fn unsolved(runs: &Runs, selection: &Selection) -> Vec<Unsolved> {
    let mut all: BTreeMap<&str, Vec<&Run>> = BTreeMap::new();
    for run in selection.taken(runs, &selection.solvers(runs)) {
        all.entry(&run.problem).or_default().push(run);
    }
    let none = all.into_iter().filter(|(_, runs)| {
        runs.iter().any(|r| r.ending != Ending::Refused) && !runs.iter().any(|r| r.solved())
    });
    none.map(|(problem, runs)| {
        let reached = runs.iter().filter_map(|r| Some((&r.solver, r.residuals.reached?)));
        let closest = reached.min_by(|a, b| a.1.total_cmp(&b.1));
        let mut endings = BTreeMap::new();
        for run in &runs {
            *endings.entry(run.ending).or_default() += 1;
        }
        Unsolved {
            problem: problem.into(),
            family: runs[0].family.clone(),
            kind: runs[0].kind.clone(),
            contacts: runs[0].contacts,
            closest: closest.map(|(solver, residual)| (solver.clone(), residual)),
            endings,
        }
    })
    .collect()
}

/// A text from the runs on a line of Markdown: nothing in it becomes an element of HTML or ends the line.
pub(crate) fn markdown_text(text: &str) -> String {
    text.replace(char::is_control, " ").replace('<', "&lt;")
}

/// A table of texts, for CSV and Markdown alike.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Table {
    /// The names of the columns.
    pub head: Vec<String>,
    /// The rows, each as long as the head.
    pub rows: Vec<Vec<String>>,
}

impl Table {
    /// As CSV with a header (RFC 4180, lines that end with `\n`).
    pub fn csv(&self) -> String {
        let mut writer = csv::Writer::from_writer(vec![]);
        for row in std::iter::once(&self.head).chain(&self.rows) {
            writer.write_record(row).expect("rows are as long as the head");
        }
        let bytes = writer.into_inner().expect("memory takes all");
        String::from_utf8(bytes).expect("texts stay texts")
    }

    /// As a Markdown table, numbers to the right.
    pub fn markdown(&self) -> String {
        let line = |cells: &[String]| {
            let safe = |c: &String| markdown_text(c).replace('|', "\\|");
            format!("| {} |\n", cells.iter().map(safe).collect::<Vec<_>>().join(" | "))
        };
        let number = |k: usize| {
            let mut cells =
                self.rows.iter().map(|r| r[k].trim_end_matches('%')).filter(|c| !c.is_empty());
            cells.clone().count() > 0 && cells.all(|c| c.parse::<f64>().is_ok())
        };
        let mut text = line(&self.head);
        let rule = |k| if number(k) { "--:".into() } else { "---".into() };
        text += &line(&(0..self.head.len()).map(rule).collect::<Vec<_>>());
        for row in &self.rows {
            text += &line(row);
        }
        text
    }
}

/// The rows of a summary with every number in full, for CSV.
pub fn summary_table(rows: &[Row]) -> Table {
    let mut head: Vec<String> = [
        "group",
        "solver",
        "problems",
        "solved",
        "solved_share",
        "fastest",
        "fastest_share",
        "ratio_median",
        "ratio_geometric_mean",
        "seconds",
    ]
    .map(String::from)
    .into();
    let causes = Ending::ALL.into_iter().skip(1);
    head.extend(causes.map(|e| e.name().into()));
    head.push("missing".into());
    let rows = rows.iter().map(|row| {
        let mut cells = vec![
            row.group.clone(),
            row.solver.clone(),
            row.problems.to_string(),
            row.solved.to_string(),
            number(row.solved_share()),
            row.fastest.to_string(),
            number(row.fastest_share()),
            number(row.ratio_median),
            number(row.ratio_mean),
            number(Some(row.seconds)),
        ];
        let cause = |k: usize| row.endings.map_or(String::new(), |e| e[k].to_string());
        cells.extend((1..Ending::ALL.len()).map(cause));
        cells.push(row.missing.to_string());
        cells
    });
    Table { rows: rows.collect(), head }
}

/// The rows of a summary to be read: shares in per cent, ratios with three digits, and only the causes that occur.
pub fn summary_page(rows: &[Row]) -> Table {
    let causes: Vec<usize> = (1..Ending::ALL.len())
        .filter(|&k| rows.iter().any(|r| r.endings.is_some_and(|e| e[k] > 0)))
        .collect();
    let groups = rows.iter().any(|r| r.group != "all");
    let missing = rows.iter().any(|r| r.missing > 0);
    let mut head: Vec<String> = vec![];
    head.extend(groups.then(|| "group".into()));
    let fixed = [
        "solver",
        "problems",
        "solved",
        "solved %",
        "fastest %",
        "median ratio",
        "geometric mean",
        "seconds",
    ];
    head.extend(fixed.map(String::from));
    head.extend(causes.iter().map(|&k| Ending::ALL[k].name().replace('_', " ")));
    head.extend(missing.then(|| "not run".into()));
    let rows = rows.iter().map(|row| {
        let share = |x: Option<f64>| x.map_or(String::new(), |x| format!("{:.1}", 100.0 * x));
        let ratio = |x: Option<f64>| x.map_or(String::new(), significant);
        let mut cells = vec![];
        cells.extend(groups.then(|| row.group.clone()));
        cells.extend([
            row.solver.clone(),
            row.problems.to_string(),
            row.solved.to_string(),
            share(row.solved_share()),
            share(row.fastest_share()),
            ratio(row.ratio_median),
            ratio(row.ratio_mean),
            significant(row.seconds),
        ]);
        let cause = |&k: &usize| row.endings.map_or(String::new(), |e| e[k].to_string());
        cells.extend(causes.iter().map(cause));
        cells.extend(missing.then(|| row.missing.to_string()));
        cells
    });
    Table { rows: rows.collect(), head }
}

/// The problems that nobody solves.
pub fn unsolved_table(all: &[Unsolved]) -> Table {
    let head = ["problem", "family", "kind", "contacts", "closest", "reached", "endings"];
    let rows = all.iter().map(|u| {
        let (closest, reached) = u.closest.clone().unzip();
        let endings = u.endings.iter().map(|(e, n)| format!("{n} {}", e.name()));
        vec![
            u.problem.clone(),
            u.family.clone(),
            u.kind.clone(),
            u.contacts.to_string(),
            closest.unwrap_or_default(),
            number(reached),
            endings.collect::<Vec<_>>().join(", "),
        ]
    });
    Table { head: head.map(String::from).into(), rows: rows.collect() }
}

/// All runs, one a row, with every field but the trace.
pub fn runs_table(runs: &Runs) -> Table {
    let head = [
        "campaign",
        "foreign",
        "problem",
        "family",
        "kind",
        "contacts",
        "digest",
        "solver",
        "tolerance",
        "ending",
        "message",
        "iterations",
        "factorisations",
        "seconds",
        "seconds_median",
        "seconds_max",
        "repeats",
        "cpu_seconds",
        "peak_memory",
        "loaded_memory",
        "reached",
        "relative",
        "absolute",
        "literature",
        "siconos",
        "primal",
        "dual",
        "complementarity",
        "dynamics",
        "bilateral",
    ];
    let foreign: HashMap<&str, bool> =
        runs.campaigns.iter().map(|c| (c.id.as_str(), c.foreign)).collect();
    let whole = |x: Option<u64>| x.map_or(String::new(), |x| x.to_string());
    let rows = runs.runs.iter().map(|r| {
        let e = &r.residuals;
        let is_foreign = foreign.get(r.campaign.as_str()).copied().unwrap_or(false);
        let mut cells = vec![
            r.campaign.clone(),
            is_foreign.to_string(),
            r.problem.clone(),
            r.family.clone(),
            r.kind.clone(),
            r.contacts.to_string(),
            r.digest.clone(),
            r.solver.clone(),
            number(Some(r.tolerance)),
            r.ending.name().into(),
            r.message.clone().unwrap_or_default(),
            whole(r.iterations),
            whole(r.factorisations),
            number(r.seconds),
            number(r.seconds_median),
            number(r.seconds_max),
            r.repeats.to_string(),
            number(r.cpu_seconds),
            whole(r.peak_memory),
            whole(r.loaded_memory),
        ];
        cells.extend([e.reached, e.relative, e.absolute, e.literature, e.siconos].map(number));
        cells.extend([e.primal, e.dual, e.complementarity, e.dynamics, e.bilateral].map(number));
        cells
    });
    Table { head: head.map(String::from).into(), rows: rows.collect() }
}

/// A number that reads back as it is, in the shorter of the two notations; nothing where it is not known.
pub(crate) fn number(x: Option<f64>) -> String {
    x.map_or(String::new(), |x| {
        // Zero has no sign.
        let x = x + 0.0;
        let (plain, scientific) = (format!("{x}"), format!("{x:e}"));
        if scientific.len() < plain.len() { scientific } else { plain }
    })
}

/// Three significant digits.
pub(crate) fn significant(x: f64) -> String {
    if x == 0.0 || !x.is_finite() {
        return format!("{}", x + 0.0);
    }
    let digits = x.abs().log10().floor();
    match digits {
        d if !(-3.0..6.0).contains(&d) => format!("{x:.2e}"),
        d => format!("{x:.*}", (2.0 - d).max(0.0) as usize),
    }
}
