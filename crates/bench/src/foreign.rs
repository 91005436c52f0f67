//! Measurements of other programs, read from an open format (docs/benchmark-format.md): a table as CSV or JSON.
//!
//! They become runs of a campaign that is marked as foreign, so they join ours as further solvers whose labels name
//! the program. Their times and errors are that program's own word. What counts as solved is decided here:
//! the error is finite and at most the tolerance, whatever the status says, as some programs report success on wrong answers.

use std::collections::{BTreeMap, HashMap, HashSet};
use std::path::{Path, PathBuf};

use nonsmooth_io::FORMATS;

use crate::campaign::{Input, describe, inputs};
use crate::plural;
use crate::record::{Campaign, Ending, FORMAT, Machine, Problem, Residuals, Run, VERSION};
use crate::runs::{Runs, RunsError};

/// The family of problems that are none of those known.
pub const UNMATCHED: &str = "unmatched";

/// Why a table cannot be used at all. One line each.
#[derive(Debug, thiserror::Error)]
pub enum ForeignError {
    /// The system refuses.
    #[error("{}: {cause}", file.display())]
    Io {
        /// The file or folder.
        file: PathBuf,
        /// What the system says.
        cause: std::io::Error,
    },
    /// It is no table of this format.
    #[error("{}: expected {expected}, found {found}", file.display())]
    Table {
        /// The file.
        file: PathBuf,
        /// What has to be there.
        expected: String,
        /// What is there.
        found: String,
    },
    /// The problems to join with cannot be read.
    #[error(transparent)]
    Runs(#[from] RunsError),
}

/// Which residual a program's error is (`nonsmooth_problem::check::Measure` has the formulas).
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Measure {
    /// The relative residual, which decides for us.
    Relative,
    /// The natural map over ‖q‖.
    Literature,
    /// Siconos' error: the same over max(‖q‖, ‖r‖, ‖u‖).
    Siconos,
}

/// Whose measurements they are.
#[derive(Debug, Clone, PartialEq)]
pub struct Source {
    /// The program; labels of solvers end with it.
    pub program: String,
    /// All there is to say of the machine.
    pub machine: String,
    /// What its errors are; none for a definition of its own.
    pub measure: Option<Measure>,
}

/// A table that was read.
#[derive(Debug, Clone, PartialEq)]
pub struct Imported {
    /// Its campaign, problems and runs.
    pub runs: Runs,
    /// What one should know of it, a line each.
    pub notes: Vec<String>,
    /// Rows that were skipped, a line each that names file, place, what was expected and what was found.
    pub mistakes: Vec<String>,
}

impl Imported {
    /// The text of the runs file.
    pub fn text(&self) -> String {
        self.runs.clone().text()
    }
}

/// The problems of a runs file, or of the files below a folder; of a file that cannot be read, the name alone.
pub fn problems(place: &Path) -> Result<Vec<Problem>, ForeignError> {
    if !place.is_dir() {
        return Ok(Runs::read(place)?.problems.into_values().collect());
    }
    let (inputs, _) = inputs(&[place.into()]);
    let described = inputs.into_iter().map(|Input { path, name, family, .. }| {
        let problem =
            describe(&path).unwrap_or_else(|e| Problem { error: Some(e), ..<_>::default() });
        Problem { name, family, ..problem }
    });
    Ok(described.collect())
}

/// Reads a table: JSON where the name ends in `.json` or `.jsonl`, else CSV. Problems are joined by name with `known`.
///
/// Errors: a file that cannot be read, is no table, or lacks a column that every table has. A mistake in a row is
/// listed in [`Imported::mistakes`], and the row skipped.
pub fn import(file: &Path, source: &Source, known: &[Problem]) -> Result<Imported, ForeignError> {
    let bytes =
        std::fs::read(file).map_err(|cause| ForeignError::Io { file: file.into(), cause })?;
    let extension = file.extension().unwrap_or_default().to_ascii_lowercase();
    let table = match extension == "json" || extension == "jsonl" {
        true => json_table(file, &bytes)?,
        false => csv_table(file, &bytes)?,
    };
    let own = table.has("error");
    if !own && !table.has("status") {
        return Err(ForeignError::Table {
            file: file.into(),
            expected: "a column `error` or `status`".into(),
            found: format!("the columns {}", table.columns.join(", ")),
        });
    }
    Ok(Reader::new(file, source, known, own).read(table))
}

/// Names and texts; numbers are still texts. `place` is the line, or the entry of an array.
struct Table {
    columns: Vec<String>,
    rows: Vec<(String, Result<Cells, String>)>,
}

/// The names of columns that stand for another.
const ALIASES: [(&str, &str); 3] =
    [("tol", "tolerance"), ("iters", "iterations"), ("nc", "contacts")];

/// The columns that are read.
const USED: [&str; 16] = [
    "problem",
    "solver",
    "tolerance",
    "seconds",
    "error",
    "status",
    "iterations",
    "factorisations",
    "contacts",
    "family",
    "kind",
    "seconds_median",
    "seconds_max",
    "repeats",
    "cpu_seconds",
    "peak_memory",
];

fn canonical(column: &str) -> String {
    let column = column.trim().trim_start_matches('\u{feff}').to_lowercase();
    let alias = ALIASES.iter().find(|(alias, _)| *alias == column);
    alias.map_or(column, |(_, name)| (*name).into())
}

impl Table {
    fn has(&self, column: &str) -> bool {
        self.columns.iter().any(|c| c == column)
    }

    /// Checks the columns that every table has.
    fn checked(self, file: &Path) -> Result<Self, ForeignError> {
        let missing =
            ["problem", "solver", "tolerance", "seconds"].into_iter().find(|c| !self.has(c));
        match missing {
            None => Ok(self),
            Some(column) => Err(ForeignError::Table {
                file: file.into(),
                expected: format!("a column `{column}`"),
                found: match self.columns.is_empty() {
                    true => "no columns".into(),
                    false => format!("the columns {}", self.columns.join(", ")),
                },
            }),
        }
    }
}

fn csv_table(file: &Path, bytes: &[u8]) -> Result<Table, ForeignError> {
    let mut reader =
        csv::ReaderBuilder::new().flexible(true).trim(csv::Trim::All).from_reader(bytes);
    let header = reader.headers().map_err(|e| ForeignError::Table {
        file: file.into(),
        expected: "a header of CSV".into(),
        found: e.to_string(),
    })?;
    let columns: Vec<String> = header.iter().map(canonical).collect();
    let twice = |c: &&&str| columns.iter().filter(|column| column == *c).count() > 1;
    if let Some(column) = USED.iter().find(twice) {
        return Err(ForeignError::Table {
            file: file.into(),
            expected: format!("one column `{column}`"),
            found: "several".into(),
        });
    }
    let mut rows = vec![];
    for record in reader.byte_records() {
        // From memory, byte records cannot fail.
        let Ok(record) = record else { break };
        // Where lines end with CR LF the reader stands before the LF of the line before.
        let before = |p: &csv::Position| bytes.get(p.byte() as usize) == Some(&b'\n');
        let line = record.position().map_or(0, |p| p.line() + u64::from(before(p)));
        let cells: Vec<_> =
            record.iter().map(|c| String::from_utf8_lossy(c).into_owned()).collect();
        let row = if cells.len() == columns.len() {
            Ok(Cells(columns.iter().cloned().zip(cells).collect()))
        } else {
            Err(format!("expected {} fields, found {}", columns.len(), cells.len()))
        };
        rows.push((format!("line {line}"), row));
    }
    Table { columns, rows }.checked(file)
}

fn json_table(file: &Path, bytes: &[u8]) -> Result<Table, ForeignError> {
    use serde_json::Value;
    let text = String::from_utf8_lossy(bytes);
    let text = text.trim_start_matches('\u{feff}');
    let values: Vec<(String, Result<Value, serde_json::Error>)> =
        if text.trim_start().starts_with('[') {
            let all: Vec<Value> = serde_json::from_str(text).map_err(|e| ForeignError::Table {
                file: file.into(),
                expected: "an array of objects, or a line for each".into(),
                found: e.to_string(),
            })?;
            (1..).zip(all).map(|(k, v)| (format!("entry {k}"), Ok(v))).collect()
        } else {
            let lines = (1..).zip(text.lines()).filter(|(_, l)| !l.trim().is_empty());
            lines.map(|(k, l)| (format!("line {k}"), serde_json::from_str(l))).collect()
        };
    let mut columns: Vec<String> = vec![];
    let mut rows = vec![];
    for (place, value) in values {
        let row = match value {
            Ok(Value::Object(fields)) => {
                let text = |value: Value| match value {
                    Value::Null => String::new(),
                    Value::String(text) => text,
                    other => other.to_string(),
                };
                let (mut row, mut twice) = (HashMap::new(), None);
                for (name, value) in fields {
                    let column = canonical(&name);
                    if !columns.contains(&column) {
                        columns.push(column.clone());
                    }
                    if row.insert(column.clone(), text(value)).is_some() {
                        twice = USED.into_iter().find(|used| *used == column).or(twice);
                    }
                }
                match twice {
                    None => Ok(Cells(row)),
                    Some(column) => Err(format!("expected one column `{column}`, found several")),
                }
            }
            Ok(_) => Err("expected an object, found another value".into()),
            Err(e) => Err(format!("expected an object, found {e}")),
        };
        rows.push((place, row));
    }
    columns.sort();
    Table { columns, rows }.checked(file)
}

/// Whether a file is one that [`Imported::text`] makes, and nothing else.
pub fn is_import(file: &Path) -> bool {
    Runs::read(file)
        .is_ok_and(|runs| matches!(runs.campaigns[..], [Campaign { foreign: true, .. }]))
}

/// A name without folders and without the extensions of problem files: `a/b.hdf5.dat` is `b`.
fn stem(name: &str) -> &str {
    let mut name = name.rsplit(['/', '\\']).next().unwrap_or(name);
    let abouts = || FORMATS.iter().map(|f| f.about()).filter(|about| about.holds_problems);
    let extensions = abouts().flat_map(|about| about.extensions);
    while let Some(shorter) =
        extensions.clone().find_map(|e| name.strip_suffix(e)?.strip_suffix('.'))
    {
        name = shorter;
    }
    name
}

struct Reader<'a> {
    file: &'a Path,
    source: &'a Source,
    known: HashMap<&'a str, Vec<&'a Problem>>,
    /// Whether the table has the program's own error.
    has_error: bool,
    id: String,
    runs: Runs,
    seen: HashSet<crate::record::Key>,
    mistakes: Vec<String>,
    matched: HashSet<String>,
    unmatched: HashSet<String>,
    ambiguous: HashSet<String>,
    false_claims: usize,
}

/// How many of the known problems have the name and the size of a row's.
enum Joined {
    None,
    One,
    Several,
}

impl<'a> Reader<'a> {
    fn new(file: &'a Path, source: &'a Source, all: &'a [Problem], has_error: bool) -> Self {
        let mut known: HashMap<&str, Vec<&Problem>> = HashMap::new();
        for problem in all {
            known.entry(stem(&problem.name)).or_default().push(problem);
        }
        let name = file.file_stem().unwrap_or_default().to_string_lossy();
        let id = format!("foreign: {}, {name}, {}", source.program, source.machine);
        let campaign = Campaign {
            format: FORMAT.into(),
            version: VERSION,
            id: id.clone(),
            program: source.program.clone(),
            foreign: true,
            started: None,
            machine: Machine { cpu: source.machine.clone(), ..Machine::default() },
            plan: None,
        };
        Self {
            file,
            source,
            known,
            has_error,
            id,
            runs: Runs { campaigns: vec![campaign], ..Runs::default() },
            seen: HashSet::new(),
            mistakes: vec![],
            matched: HashSet::new(),
            unmatched: HashSet::new(),
            ambiguous: HashSet::new(),
            false_claims: 0,
        }
    }

    fn read(mut self, table: Table) -> Imported {
        let total = table.rows.len();
        for (place, row) in table.rows {
            let done = row.and_then(|cells| self.row(&cells));
            if let Err(mistake) = done {
                self.mistakes.push(format!("{}, {place}: {mistake}", self.file.display()));
            }
        }
        let silent = self.drop_idle_counts();
        let mut notes = vec![];
        notes.push(format!(
            "{} of {} read; {} matched, {} not",
            self.runs.runs.len(),
            plural(total, "row"),
            plural(self.matched.len(), "problem"),
            self.unmatched.len()
        ));
        if !self.ambiguous.is_empty() {
            notes.push(format!(
                "several known problems have the name of {}: not matched",
                plural(self.ambiguous.len(), "problem")
            ));
        }
        if !self.has_error {
            notes.push("no column `error`: what is solved is the program's own word".into());
            if total > 0 && !self.runs.runs.iter().any(Run::solved) {
                notes.push("no row has the status `0` or `solved`: none counts as solved".into());
            }
        }
        if self.false_claims > 0 {
            notes.push(format!(
                "success claimed with an error above the tolerance in {}: not solved",
                plural(self.false_claims, "row")
            ));
        }
        if !silent.is_empty() {
            notes.push(format!(
                "iterations never above 0, taken as not known: {}",
                silent.join(", ")
            ));
        }
        Imported { runs: self.runs, notes, mistakes: self.mistakes }
    }

    fn row(&mut self, cells: &Cells) -> Result<(), String> {
        let tolerance = cells.required("tolerance")?;
        if !(tolerance > 0.0 && tolerance.is_finite()) {
            return Err(format!("tolerance: expected a positive number, found {tolerance}"));
        }
        let name = cells.text("problem")?;
        let solver = cells.text("solver")?;
        let seconds = cells.size("seconds")?;
        let error = cells.size("error")?;
        let contacts = cells.whole("contacts")?;
        let (problem, joined) = self.problem(name, contacts.unwrap_or(0) as usize, cells);
        let status = cells.get("status");
        let (ending, message) = ending(status, self.has_error.then_some(error), tolerance);
        let false_claim = self.has_error && ending != Ending::Solved && claims(status);
        let mut residuals = Residuals { reached: error, ..Residuals::default() };
        match self.source.measure {
            None => {}
            Some(Measure::Relative) => residuals.relative = error,
            Some(Measure::Literature) => residuals.literature = error,
            Some(Measure::Siconos) => residuals.siconos = error,
        }
        let run = Run {
            campaign: self.id.clone(),
            problem: problem.name.clone(),
            digest: problem.digest.clone(),
            family: problem.family.clone(),
            kind: problem.kind.clone(),
            contacts: problem.contacts,
            solver: format!("{solver} ({})", self.source.program),
            tolerance,
            ending,
            message,
            iterations: cells.count("iterations")?,
            factorisations: cells.count("factorisations")?,
            seconds,
            seconds_median: cells.size("seconds_median")?,
            seconds_max: cells.size("seconds_max")?,
            repeats: cells.whole("repeats")?.map_or(0, |n| u32::try_from(n).unwrap_or(u32::MAX)),
            cpu_seconds: cells.size("cpu_seconds")?,
            peak_memory: cells.whole("peak_memory")?,
            loaded_memory: None,
            residuals,
            trace: vec![],
        };
        if !self.seen.insert(run.key()) {
            return Err(format!(
                "expected one row for {name}, {solver} and tolerance {tolerance:e}, found another before"
            ));
        }
        // What is told counts the rows that are kept.
        self.false_claims += usize::from(false_claim);
        match joined {
            Joined::One => drop(self.matched.insert(problem.name.clone())),
            Joined::None => drop(self.unmatched.insert(problem.name.clone())),
            Joined::Several => {
                self.unmatched.insert(problem.name.clone());
                self.ambiguous.insert(name.into());
            }
        }
        self.runs.problems.entry(problem.name.clone()).or_insert(problem);
        self.runs.runs.push(run);
        Ok(())
    }

    /// The known problem of that name and size, else one of our making.
    fn problem(&self, name: &str, contacts: usize, cells: &Cells) -> (Problem, Joined) {
        let fits = |p: &&&Problem| contacts == 0 || p.contacts == 0 || p.contacts == contacts;
        let namesakes =
            self.known.get(stem(name)).map_or(vec![], |all| all.iter().filter(fits).collect());
        let joined = match namesakes[..] {
            [&only] => return (only.clone(), Joined::One),
            [] => Joined::None,
            _ => Joined::Several,
        };
        let family = cells.get("family").unwrap_or(UNMATCHED).to_owned();
        let problem = Problem {
            name: format!("{family}/{}", stem(name)),
            family,
            kind: cells.get("kind").unwrap_or_default().into(),
            contacts,
            ..Problem::default()
        };
        (problem, joined)
    }

    /// Takes away the iterations of solvers that never report one; returns those solvers.
    fn drop_idle_counts(&mut self) -> Vec<String> {
        let mut most: BTreeMap<String, Option<u64>> = BTreeMap::new();
        for run in &self.runs.runs {
            let most = most.entry(run.solver.clone()).or_default();
            *most = (*most).max(run.iterations);
        }
        let silent: Vec<String> =
            most.into_iter().filter(|(_, most)| *most == Some(0)).map(|(s, _)| s).collect();
        for run in self.runs.runs.iter_mut().filter(|r| silent.contains(&r.solver)) {
            run.iterations = None;
        }
        silent
    }
}

/// Whether a status says that the solver succeeded.
fn claims(status: Option<&str>) -> bool {
    status.is_some_and(|s| s == "0" || s.eq_ignore_ascii_case("solved"))
}

/// How a row ended. `error`: the program's own, where the table has that column.
fn ending(
    status: Option<&str>,
    error: Option<Option<f64>>,
    tolerance: f64,
) -> (Ending, Option<String>) {
    let solved = match error {
        Some(error) => error.is_some_and(|e| e <= tolerance),
        None => claims(status),
    };
    if solved {
        return (Ending::Solved, None);
    }
    let status = status.unwrap_or_default();
    let named = Ending::ALL.into_iter().find(|e| *e != Ending::Solved && e.name() == status);
    let ending = match status {
        s if s.starts_with("timeout") => Ending::TimeLimit,
        s if s.starts_with("signal") || s.starts_with("exit") => Ending::Crashed,
        _ => named.unwrap_or(Ending::Failed),
    };
    let said = if status.is_empty() { String::new() } else { format!("status {status}") };
    let wrong = match error {
        Some(Some(e)) => format!("error {e:e}"),
        Some(None) => "no finite error".into(),
        None => String::new(),
    };
    let parts: Vec<String> = [said, wrong].into_iter().filter(|t| !t.is_empty()).collect();
    (ending, (!parts.is_empty()).then(|| parts.join(", ")))
}

/// The cells of a row by the names of their columns.
struct Cells(HashMap<String, String>);

impl Cells {
    /// The text of a cell, unless it is empty.
    fn get(&self, column: &str) -> Option<&str> {
        self.0.get(column).map(|c| c.trim()).filter(|c| !c.is_empty())
    }

    fn text(&self, column: &str) -> Result<&str, String> {
        self.get(column).ok_or_else(|| format!("{column}: expected a name, found nothing"))
    }

    fn required(&self, column: &str) -> Result<f64, String> {
        self.number(column)?.ok_or_else(|| format!("{column}: expected a number, found nothing"))
    }

    fn number(&self, column: &str) -> Result<Option<f64>, String> {
        let parse =
            |c: &str| c.parse().map_err(|_| format!("{column}: expected a number, found {c:?}"));
        self.get(column).map(parse).transpose()
    }

    /// A number of at least 0; none where it is not finite.
    fn size(&self, column: &str) -> Result<Option<f64>, String> {
        match self.number(column)? {
            Some(x) if x < 0.0 => {
                Err(format!("{column}: expected a number of at least 0, found {x}"))
            }
            x => Ok(x.filter(|x| x.is_finite())),
        }
    }

    /// A whole number; none where it is negative, as programs write what they do not know.
    fn count(&self, column: &str) -> Result<Option<u64>, String> {
        match self.number(column)? {
            Some(x) if x < 0.0 || x.is_nan() => Ok(None),
            Some(x) if x.fract() != 0.0 || x > 9e15 => {
                Err(format!("{column}: expected a whole number, found {x}"))
            }
            x => Ok(x.map(|x| x as u64)),
        }
    }

    /// A whole number of at least 0.
    fn whole(&self, column: &str) -> Result<Option<u64>, String> {
        match self.number(column)? {
            Some(x) if x < 0.0 => {
                Err(format!("{column}: expected a whole number of at least 0, found {x}"))
            }
            _ => self.count(column),
        }
    }
}
