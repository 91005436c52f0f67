//! `nonsmooth bench figures`.

use std::collections::BTreeSet;
use std::path::{Path, PathBuf};

use nonsmooth_bench::campaign::Label;
use nonsmooth_bench::figures::figures;
use nonsmooth_bench::page;
use nonsmooth_bench::profile::Selection;
use nonsmooth_bench::record::SIZES;
use nonsmooth_bench::runs::Runs;
use nonsmooth_bench::tables::{
    self, By, summary, summary_page, summary_table, unsolved, unsolved_table,
};

use super::Joined;
use crate::report::row;
use crate::{Exit, files, output};

/// Draw the figures of a campaign for papers, and write its tables.
///
/// Writes into a folder: performance profiles by time, iterations and factorisations, data profiles, success against tolerance and
/// residual against time, each as SVG and as CSV of its data; tables of what is solved, overall, by family and by
/// size, and of what nobody solves, each as CSV and as Markdown; and all runs as runs.csv. Kinds of problem are never
/// counted together: of several, each has a folder of its name.
#[derive(Debug, clap::Args)]
#[command(after_help = EXAMPLES)]
pub struct Args {
    /// Runs files; they are joined
    #[arg(required = true, value_name = "RUNS")]
    runs: Vec<PathBuf>,
    /// The folder to write into
    #[arg(long, value_name = "FOLDER")]
    out: PathBuf,
    /// The tolerance of the profiles and tables; left out: for each kind of problem, the tightest that every solver of
    /// the runs that are selected was run at
    #[arg(long, value_name = "TOL", allow_hyphen_values = true)]
    tol: Option<f64>,
    /// Only these families
    #[arg(long, value_name = "FAMILY", value_delimiter = ',')]
    family: Vec<String>,
    /// Only these classes of size: 1-10, 11-100, 101-1000, `over 1000`
    #[arg(long, value_name = "SIZE", value_delimiter = ',')]
    size: Vec<String>,
    /// Only these kinds of problem
    #[arg(long, value_name = "KIND", value_delimiter = ',')]
    kind: Vec<String>,
    /// Only this solver; give it again for each
    #[arg(long, value_name = "SOLVER")]
    solver: Vec<String>,
}

const EXAMPLES: &str = "\
Examples:
  nonsmooth bench figures runs.jsonl --out figures --tol 1e-8
  nonsmooth bench figures runs.jsonl siconos.jsonl --out figures --family arch,wall

Exit codes: 0 written; 2 a mistake in a file or an option.";

/// Runs the command.
pub fn run(args: &Args) -> Result<Exit, String> {
    let size = |name: &String| {
        let found = SIZES.into_iter().find(|s| s.name == name);
        found.ok_or_else(|| {
            let all = SIZES.map(|s| s.name).join(", ");
            format!("--size: expected one of {all}, found {name}")
        })
    };
    let sizes = args.size.iter().map(size).collect::<Result<Vec<_>, _>>()?;
    let tol = args.tol.map(files::tolerance).transpose()?;
    let Joined { runs, mut remarks, exit, .. } = super::read(&args.runs)?;
    if runs.runs.is_empty() {
        return Err("expected runs, found none in any file".into());
    }
    let kinds: Vec<&str> = runs.kinds().into_iter().map(|(kind, _)| kind).collect();
    known("--kind", &args.kind, kinds.iter().copied())?;
    let solvers = solvers(&runs, &args.solver);
    known("--solver", &solvers, runs.runs.iter().map(|run| run.solver.as_str()))?;
    known("--family", &args.family, runs.runs.iter().map(|run| run.family.as_str()))?;
    let asked = |kind: &str| args.kind.is_empty() || args.kind.iter().any(|k| k == kind);
    let mut chosen: Vec<Selection> = vec![];
    for kind in kinds.into_iter().filter(|kind| asked(kind)) {
        let mut selection = Selection {
            families: args.family.clone(),
            sizes: sizes.clone(),
            solvers: solvers.clone(),
            ..Selection::at(kind, tol.unwrap_or_default())
        };
        let name = named(kind);
        let Some(common) = selection.common_tolerance(&runs) else {
            // The other filters leave nothing of a kind: worth a word where it was asked for.
            remarks.extend((!args.kind.is_empty()).then(|| format!("{name}: no run is selected")));
            continue;
        };
        selection.tolerance = tol.unwrap_or(common);
        let at = selection.tolerance;
        let mut there = runs.runs.iter().filter(|r| r.tolerance == at && selection.takes(r));
        if there.next().is_none() {
            remarks.push(format!("{name}: no run at {at:e}, left out"));
            continue;
        }
        let without = selection.without_runs(&runs).join(", ");
        remarks.extend(
            (!without.is_empty()).then(|| format!("{name}: no run at {at:e} of {without}")),
        );
        chosen.push(selection);
    }
    if chosen.is_empty() {
        let at = tol.map_or_else(String::new, |tol| format!(" at tolerance {tol:e}"));
        return Err(format!("expected runs that are selected{at}, found none"));
    }
    let mut folders: Vec<PathBuf> = vec![];
    let mut texts: Vec<(PathBuf, String)> = vec![];
    for selection in &chosen {
        let folder = match chosen.as_slice() {
            [_] => args.out.clone(),
            _ => {
                let mut names = page::names(page::slug(&selection.kind)).map(|n| args.out.join(n));
                names.find(|name| !folders.contains(name)).unwrap_or_default()
            }
        };
        texts.extend(drawn(&runs, selection, &folder)?);
        folders.push(folder);
    }
    texts.push((args.out.join("runs.csv"), tables::runs_table(&runs).csv()));
    super::apart(&args.runs, texts.iter().map(|(path, _)| path.as_path()))?;
    output::results_are_filed();
    for folder in &folders {
        files::folder("--out", folder)?;
    }
    for (path, text) in &texts {
        files::write_text("--out", path, text)?;
        output::print(&format!("{}\n", path.display()));
    }
    let mut text = String::new();
    if chosen.iter().any(|selection| selection.tolerance != chosen[0].tolerance) {
        for Selection { kind, tolerance, .. } in &chosen {
            row(&mut text, "tolerance", format!("{tolerance:e} for {}", named(kind)));
        }
    }
    output::print(&(text + &super::limits(&remarks)));
    Ok(exit)
}

/// A kind in a sentence. Other programs' kinds may hold anything; a message is one line.
fn named(kind: &str) -> String {
    if kind.is_empty() { "an unknown kind".into() } else { kind.replace(char::is_control, " ") }
}

/// The labels asked for as the runs have them: ours have one spelling, those of foreign programs any.
fn solvers(runs: &Runs, asked: &[String]) -> Vec<String> {
    let there = |label: &String| runs.runs.iter().any(|run| run.solver == *label);
    let label = |text: &String| if there(text) { text.clone() } else { Label::canonical(text) };
    asked.iter().map(label).collect()
}

/// Refuses a name that no run has.
fn known<'a>(
    option: &str,
    asked: &[String],
    there: impl Iterator<Item = &'a str>,
) -> Result<(), String> {
    let there: BTreeSet<&str> = there.collect();
    match asked.iter().find(|name| !there.contains(name.as_str())) {
        None => Ok(()),
        Some(name) => {
            let there: Vec<&str> = there.into_iter().collect();
            let there = there.join(", ");
            Err(format!("{option}: expected one that the runs have, {there}; found {name}"))
        }
    }
}

/// The figures and the tables of a selection, by their places in a folder.
fn drawn(
    runs: &Runs,
    selection: &Selection,
    folder: &Path,
) -> Result<Vec<(PathBuf, String)>, String> {
    let mut texts = vec![];
    let mut add = |name: String, text: String| texts.push((folder.join(name), text));
    for figure in figures(runs, selection)? {
        figure.files().into_iter().for_each(|(name, text)| add(name, text.into()));
    }
    for (name, by) in [("all", By::All), ("family", By::Family), ("size", By::Size)] {
        let rows = summary(runs, selection, by);
        add(format!("summary-{name}.csv"), summary_table(&rows).csv());
        add(format!("summary-{name}.md"), summary_page(&rows).markdown());
    }
    let nobody = unsolved_table(&unsolved(runs, selection));
    add("unsolved.csv".into(), nobody.csv());
    add("unsolved.md".into(), nobody.markdown());
    Ok(texts)
}
