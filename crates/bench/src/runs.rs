//! Files of runs: reading them, joining several, and what is wrong with them.

use std::collections::{BTreeMap, BTreeSet, HashMap, HashSet};
use std::path::{Path, PathBuf};

use crate::campaign::{Label, Registry};
use crate::plural;
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
    /// Reads a file. A last line that is torn is passed over; labels of solvers are in their one spelling
    /// ([`Label::canonical`]), but for those of foreign programs.
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
                Line::Campaign(mut campaign) => {
                    check(file, &campaign)?;
                    let own = campaign.plan.as_mut().filter(|_| !campaign.foreign);
                    own.into_iter()
                        .flat_map(|plan| &mut plan.solvers)
                        .for_each(|label| *label = Label::canonical(label));
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
                    let foreign = |run: &Run| all.campaign(run).is_some_and(|c| c.foreign);
                    if run.ending == Ending::Infeasible && foreign(&run) {
                        run.ending = Ending::NearlyInfeasible;
                    }
                    if run.solver.contains(':') && !foreign(&run) {
                        run.solver = Label::canonical(&run.solver);
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

    /// What keeps the runs of a file from being all that were planned: a last line that was torn, runs that were not made.
    pub fn unfinished(&self) -> Vec<String> {
        let torn = self.torn.then(|| "the last line is torn, and left out".into());
        let (missing, planned) = self.missing();
        let runs = plural(planned, "run");
        let missing = (missing > 0).then(|| format!("missing {missing} of {runs} of the plan"));
        torn.into_iter().chain(missing).collect()
    }

    /// Of the runs that the plans come to, those that are missing, and all.
    ///
    /// A problem belongs to the campaigns that have runs on it, one without a run to each. A solver is run on the kinds that
    /// it takes by the registry, or that it has runs on.
    fn missing(&self) -> (usize, usize) {
        let (mut there, mut on, mut takes) = (HashSet::new(), HashSet::new(), HashSet::new());
        for run in &self.runs {
            there.insert((run.problem.as_str(), run.solver.as_str(), run.tolerance.to_bits()));
            on.insert((run.problem.as_str(), Some(run.campaign.as_str())));
            on.insert((run.problem.as_str(), None));
            takes.insert((run.solver.as_str(), run.kind.as_str()));
        }
        let mut kinds = HashMap::new();
        let mut planned = HashSet::new();
        for campaign in &self.campaigns {
            let Some(plan) = &campaign.plan else { continue };
            for solver in &plan.solvers {
                let kinds = kinds.entry(solver.as_str()).or_insert_with(|| {
                    Label::parse(solver).and_then(|l| l.kinds(&Registry)).unwrap_or_default()
                });
                let takes = |kind: &str| {
                    takes.contains(&(solver, kind)) || kinds.iter().any(|k| k.name() == kind)
                };
                let problems = self.problems.values().filter(|p| p.error.is_none());
                let own = problems.filter(|p| {
                    let campaign = Some(campaign.id.as_str());
                    on.contains(&(&p.name, campaign)) || !on.contains(&(&p.name, None))
                });
                for problem in own.filter(|p| takes(&p.kind)) {
                    let name = problem.name.as_str();
                    let bits = plan.tolerances.iter().map(|t| t.to_bits());
                    planned.extend(bits.map(|bits| (name, solver.as_str(), bits)));
                }
            }
        }
        (planned.difference(&there).count(), planned.len())
    }

    fn plans(&self) -> Vec<&Plan> {
        self.campaigns.iter().filter_map(|c| c.plan.as_ref()).collect()
    }

    /// The parts of a campaign of parts that are missing.
    pub fn missing_parts(&self) -> Vec<String> {
        let mut remarks = vec![];
        let shards = self.plans().into_iter().filter_map(|p| p.shard).filter(|s| s.1 > 0);
        let parts: BTreeSet<(usize, usize)> = shards.map(|(i, n)| (n, i)).collect();
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
        remarks
    }

    /// What keeps the runs from being measured alike.
    pub fn differing_plans(&self) -> Vec<String> {
        let mut remarks = vec![];
        for two in self.plans().windows(2) {
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

    /// Of the runs that are wanted, the tightest tolerance that every solver was run at, else the one with the most runs. Kinds of problem are not
    /// counted together, and may have tolerances of their own: see [`Selection::common_tolerance`](crate::profile::Selection::common_tolerance).
    pub(crate) fn common_tolerance(&self, wanted: impl Fn(&Run) -> bool) -> Option<f64> {
        let runs: Vec<&Run> = self.runs.iter().filter(|r| wanted(r)).collect();
        let solvers = |runs: &[&Run]| runs.iter().map(|r| &r.solver).collect::<HashSet<_>>().len();
        let at = |tolerance: f64| -> Vec<&Run> {
            runs.iter().copied().filter(|r| r.tolerance == tolerance).collect()
        };
        let tolerances = self.tolerances_where(&wanted);
        let all = solvers(&runs);
        let common = tolerances.iter().rev().copied().find(|t| solvers(&at(*t)) == all);
        common.or_else(|| tolerances.into_iter().max_by_key(|t| at(*t).len()))
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
