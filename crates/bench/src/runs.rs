//! Files of runs: reading them, joining several, and what is wrong with them.

use std::collections::{BTreeMap, BTreeSet, HashSet};
use std::path::{Path, PathBuf};

use crate::record::{Campaign, Ending, FORMAT, Line, Plan, Problem, Run, VERSION};

/// Why a file of runs cannot be used. One line each.
#[derive(Debug, thiserror::Error)]
pub enum RunsError {
    /// The system refuses.
    #[error("{}: {cause}", file.display())]
    Io {
        /// The file.
        file: PathBuf,
        /// What the system says.
        cause: std::io::Error,
    },
    /// A line that is none of the format's.
    #[error("{}, line {line}: expected a line of {FORMAT}, found {found}", file.display())]
    Line {
        /// The file.
        file: PathBuf,
        /// The line, counted from 1.
        line: usize,
        /// What is wrong with it.
        found: String,
    },
    /// A file of another version.
    #[error("{}: expected version {VERSION} of {FORMAT}, found version {found}; it was written by {program}", file.display())]
    Version {
        /// The file.
        file: PathBuf,
        /// Its version.
        found: u64,
        /// Who wrote it.
        program: String,
    },
    /// Nothing in it.
    #[error("{}: expected runs, found none", file.display())]
    Empty {
        /// The file.
        file: PathBuf,
    },
}

/// Parts that are missing are named, up to so many.
const NAMED: usize = 20;

/// What came of joining two files.
#[derive(Debug, Clone, PartialEq, Eq, Default)]
pub struct Joined {
    /// Runs that were in both; the first stays.
    pub twice: usize,
    /// Problems whose files differ; the runs of the second are left out.
    pub conflicts: Vec<String>,
}

/// The content of one or more files.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Runs {
    /// The campaigns.
    pub campaigns: Vec<Campaign>,
    /// The problems by name, those that cannot be read included.
    pub problems: BTreeMap<String, Problem>,
    /// The runs, each [`Run::key`] once.
    pub runs: Vec<Run>,
    /// Whether the last line of a file was torn: written while the power or the program went.
    pub torn: bool,
}

impl Runs {
    /// Reads a file. A last line that is torn is passed over.
    ///
    /// Errors: a file that cannot be read, that is of another format or version, that has a line that is neither the
    /// last nor of the format, or that holds no campaign.
    pub fn read(file: &Path) -> Result<Self, RunsError> {
        let text =
            std::fs::read(file).map_err(|cause| RunsError::Io { file: file.into(), cause })?;
        Self::parse(file, &String::from_utf8_lossy(&text))
    }

    /// Reads the text of a file; `file` is its name in messages.
    pub fn parse(file: &Path, text: &str) -> Result<Self, RunsError> {
        let mut all = Self::default();
        let mut seen = HashSet::new();
        // Some editors begin a text with a mark of its encoding.
        let text = text.strip_prefix('\u{feff}').unwrap_or(text);
        let lines: Vec<&str> = text.split_inclusive('\n').collect();
        for (k, line) in lines.iter().enumerate().filter(|(_, l)| !l.trim().is_empty()) {
            let parsed = match serde_json::from_str::<Line>(line) {
                // Every line is written with its end, so one without is torn even if it reads well.
                _ if k > 0 && !line.ends_with('\n') => {
                    all.torn = true;
                    break;
                }
                Ok(parsed) => parsed,
                Err(e) => return Err(refusal(file, k, line, &e)),
            };
            match parsed {
                Line::Campaign(campaign) => {
                    check(file, &campaign)?;
                    all.campaigns.push(campaign);
                }
                _ if all.campaigns.is_empty() => {
                    let found = "a run before any campaign".into();
                    return Err(RunsError::Line { file: file.into(), line: k + 1, found });
                }
                Line::Problem(problem) => {
                    all.problems.insert(problem.name.clone(), problem);
                }
                Line::Run(mut run) => {
                    if let Some(found) = out_of_range(&run) {
                        return Err(RunsError::Line { file: file.into(), line: k + 1, found });
                    }
                    // No judge has seen a foreign program's proof.
                    let foreign = || all.campaign(&run).is_some_and(|c| c.foreign);
                    if run.ending == Ending::Infeasible && foreign() {
                        run.ending = Ending::NearlyInfeasible;
                    }
                    if seen.insert(run.key()) {
                        all.runs.push(*run);
                    }
                }
            }
        }
        if all.campaigns.is_empty() {
            return Err(RunsError::Empty { file: file.into() });
        }
        Ok(all)
    }

    /// Takes in the content of another file. Of a run that is in both, the first stays; of a problem whose file is not the
    /// same in both, the runs of the first do.
    pub fn join(&mut self, other: Runs) -> Joined {
        let mut joined = Joined::default();
        self.torn |= other.torn;
        let known: HashSet<_> = self.campaigns.iter().map(|c| c.id.clone()).collect();
        self.campaigns.extend(other.campaigns.into_iter().filter(|c| !known.contains(&c.id)));
        for (name, problem) in other.problems {
            let differs = |old: &Problem| {
                !old.digest.is_empty() && !problem.digest.is_empty() && old.digest != problem.digest
            };
            match self.problems.get(&name) {
                Some(old) if differs(old) => joined.conflicts.push(name),
                // Where one machine could read it, it is known.
                Some(old) if old.error.is_none() => {}
                _ => drop(self.problems.insert(name, problem)),
            }
        }
        let mut seen: HashSet<_> = self.runs.iter().map(Run::key).collect();
        for run in other.runs {
            if joined.conflicts.contains(&run.problem) {
                continue;
            }
            match seen.insert(run.key()) {
                true => self.runs.push(run),
                false => joined.twice += 1,
            }
        }
        joined
    }

    /// What keeps these runs from being one whole campaign: parts that are missing, plans that differ.
    pub fn remarks(&self) -> Vec<String> {
        let plans: Vec<&Plan> = self.campaigns.iter().filter_map(|c| c.plan.as_ref()).collect();
        let mut remarks = vec![];
        let parts: BTreeSet<(usize, usize)> =
            plans.iter().filter_map(|p| p.shard).filter(|s| s.1 > 0).map(|(i, n)| (n, i)).collect();
        let wholes: BTreeSet<usize> = parts.iter().map(|p| p.0).collect();
        for n in wholes {
            let there = parts.range((n, 1)..=(n, n)).count();
            let missing = (1..=n).filter(|&i| !parts.contains(&(n, i)));
            let named: Vec<_> = missing.take(NAMED).map(|i| format!("{i}/{n}")).collect();
            let more = match n - there - named.len() {
                0 => String::new(),
                more => format!(" and {more} more"),
            };
            if !named.is_empty() {
                remarks.push(format!("missing parts {}{more}", named.join(", ")));
            }
        }
        for two in plans.windows(2) {
            let unsharded = |plan: &Plan| Plan { shard: None, ..plan.clone() };
            if let Some(differs) = unsharded(two[0]).difference(&unsharded(two[1])) {
                remarks.push(format!("plans differ: {differs}"));
            }
        }
        remarks.dedup();
        remarks
    }

    /// The labels of the solvers that have runs, in the order of the plans, then of their first runs.
    pub fn solvers(&self) -> Vec<&str> {
        let mut left: HashSet<&str> = self.runs.iter().map(|r| r.solver.as_str()).collect();
        let planned =
            self.campaigns.iter().filter_map(|c| c.plan.as_ref()).flat_map(|p| &p.solvers);
        let named = planned.map(String::as_str).chain(self.runs.iter().map(|r| r.solver.as_str()));
        named.filter(|s| left.remove(s)).collect()
    }

    /// The kinds of problem with the number of problems that have runs, the most first.
    pub fn kinds(&self) -> Vec<(&str, usize)> {
        let mut all: BTreeMap<&str, BTreeSet<&str>> = BTreeMap::new();
        for run in &self.runs {
            all.entry(&run.kind).or_default().insert(&run.problem);
        }
        let mut kinds: Vec<_> = all.into_iter().map(|(kind, of)| (kind, of.len())).collect();
        kinds.sort_by_key(|(_, n)| std::cmp::Reverse(*n));
        kinds
    }

    /// The tolerances, the largest first.
    pub fn tolerances(&self) -> Vec<f64> {
        self.tolerances_where(|_| true)
    }

    /// The tolerances that a kind of problem has runs at, the largest first.
    pub fn tolerances_of(&self, kind: &str) -> Vec<f64> {
        self.tolerances_where(|run| run.kind == kind)
    }

    fn tolerances_where(&self, wanted: impl Fn(&Run) -> bool) -> Vec<f64> {
        let mut all: Vec<f64> =
            self.runs.iter().filter(|r| wanted(r)).map(|r| r.tolerance).collect();
        all.sort_by(|a, b| b.total_cmp(a));
        all.dedup();
        all
    }

    /// The tightest tolerance that every solver was run at, else the one with the most runs.
    pub fn common_tolerance(&self) -> Option<f64> {
        let solvers = self.solvers().len();
        let at = |tolerance: f64| self.runs.iter().filter(move |r| r.tolerance == tolerance);
        let all = |t: &f64| at(*t).map(|r| &r.solver).collect::<HashSet<_>>().len() == solvers;
        let tolerances = self.tolerances();
        let common = tolerances.iter().rev().copied().find(all);
        common.or_else(|| tolerances.into_iter().max_by_key(|t| at(*t).count()))
    }

    /// The campaign that a run belongs to.
    pub fn campaign(&self, run: &Run) -> Option<&Campaign> {
        self.campaigns.iter().find(|c| c.id == run.campaign)
    }

    /// The text of a file of this content.
    pub fn text(self) -> String {
        let text = |line| serde_json::to_string(&line).expect("a line is plain data") + "\n";
        self.lines().map(text).collect()
    }

    /// The lines that a file of this content has.
    fn lines(self) -> impl Iterator<Item = Line> {
        let campaigns = self.campaigns.into_iter().map(Line::Campaign);
        let problems = self.problems.into_values().map(Line::Problem);
        campaigns.chain(problems).chain(self.runs.into_iter().map(|r| Line::Run(Box::new(r))))
    }
}

/// A number of a run that cannot be, in words.
fn out_of_range(run: &Run) -> Option<String> {
    let Run { tolerance, seconds, seconds_median, seconds_max, cpu_seconds, residuals, .. } = run;
    if *tolerance <= 0.0 {
        return Some(format!("a tolerance of {tolerance:e}"));
    }
    let sizes = [
        ("seconds", seconds),
        ("seconds_median", seconds_median),
        ("seconds_max", seconds_max),
        ("cpu_seconds", cpu_seconds),
        ("a residual", &residuals.reached),
    ];
    let negative = |(what, x): (&str, &Option<f64>)| {
        x.filter(|x| *x < 0.0).map(|x| format!("{what} of {x:e}"))
    };
    sizes.into_iter().find_map(negative)
}

fn check(file: &Path, campaign: &Campaign) -> Result<(), RunsError> {
    if campaign.format != FORMAT {
        let found = format!("the format {:?}", campaign.format);
        return Err(RunsError::Line { file: file.into(), line: 1, found });
    }
    if campaign.version != VERSION {
        return Err(RunsError::Version {
            file: file.into(),
            found: campaign.version.into(),
            program: one_line(&campaign.program),
        });
    }
    Ok(())
}

/// A line that does not read: of another version, or of nothing that is known.
fn refusal(file: &Path, k: usize, line: &str, error: &serde_json::Error) -> RunsError {
    let value: serde_json::Value = serde_json::from_str(line).unwrap_or_default();
    match value["version"].as_u64() {
        Some(found) if value["format"] == FORMAT && found != u64::from(VERSION) => {
            let program = one_line(value["program"].as_str().unwrap_or("an unknown program"));
            RunsError::Version { file: file.into(), found, program }
        }
        _ => {
            RunsError::Line { file: file.into(), line: k + 1, found: one_line(&error.to_string()) }
        }
    }
}

/// Texts from a file may hold anything; a message is one line.
fn one_line(text: &str) -> String {
    text.replace(char::is_control, " ")
}
