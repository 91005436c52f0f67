//! `nonsmooth bench figures`.

use std::collections::BTreeSet;
use std::path::{Path, PathBuf};

use nonsmooth_bench::figures::figures;
use nonsmooth_bench::page;
use nonsmooth_bench::profile::Selection;
use nonsmooth_bench::record::SIZES;
use nonsmooth_bench::runs::Runs;
use nonsmooth_bench::tables::{
    self, By, summary, summary_page, summary_table, unsolved, unsolved_table,
};

use super::Joined;
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
    /// The tolerance of the profiles and tables; left out: the tightest that every solver was run at
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
    let Joined { runs, exit, .. } = super::read(&args.runs)?;
    let Some(tolerance) = tol.or_else(|| runs.common_tolerance()) else {
        return Err("expected runs, found none in any file".into());
    };
    let kinds: Vec<&str> = runs.kinds().into_iter().map(|(kind, _)| kind).collect();
    known("--kind", &args.kind, kinds.iter().copied())?;
    known("--solver", &args.solver, runs.runs.iter().map(|run| run.solver.as_str()))?;
    known("--family", &args.family, runs.runs.iter().map(|run| run.family.as_str()))?;
    let of = |kind: &str| Selection {
        families: args.family.clone(),
        sizes: sizes.clone(),
        solvers: args.solver.clone(),
        ..Selection::at(kind, tolerance)
    };
    let asked = |kind: &str| args.kind.is_empty() || args.kind.iter().any(|k| k == kind);
    let chosen = kinds.into_iter().filter(|kind| asked(kind)).map(of).filter(|selection| {
        runs.runs.iter().any(|r| r.tolerance == tolerance && selection.takes(r))
    });
    let chosen: Vec<Selection> = chosen.collect();
    if chosen.is_empty() {
        return Err(format!(
            "expected runs that are selected at tolerance {tolerance:e}, found none"
        ));
    }
    let mut folders: Vec<PathBuf> = vec![];
    for selection in &chosen {
        let folder = match chosen.as_slice() {
            [_] => args.out.clone(),
            _ => {
                let mut names = page::names(page::slug(&selection.kind)).map(|n| args.out.join(n));
                names.find(|name| !folders.contains(name)).unwrap_or_default()
            }
        };
        write(&runs, selection, &folder)?;
        folders.push(folder);
    }
    write_text(&args.out, "runs.csv", &tables::runs_table(&runs).csv())?;
    Ok(exit)
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

/// Writes the figures and the tables of a selection into a folder.
fn write(runs: &Runs, selection: &Selection, folder: &Path) -> Result<(), String> {
    files::folder("--out", folder)?;
    for figure in figures(runs, selection)? {
        write_text(folder, &format!("{}.svg", figure.name), &figure.svg)?;
        write_text(folder, &format!("{}.csv", figure.name), &figure.csv)?;
    }
    for (name, by) in [("all", By::All), ("family", By::Family), ("size", By::Size)] {
        let rows = summary(runs, selection, by);
        write_text(folder, &format!("summary-{name}.csv"), &summary_table(&rows).csv())?;
        write_text(folder, &format!("summary-{name}.md"), &summary_page(&rows).markdown())?;
    }
    let nobody = unsolved_table(&unsolved(runs, selection));
    write_text(folder, "unsolved.csv", &nobody.csv())?;
    write_text(folder, "unsolved.md", &nobody.markdown())
}

fn write_text(folder: &Path, name: &str, text: &str) -> Result<(), String> {
    let path = folder.join(name);
    files::write_text("--out", &path, text)?;
    output::print(&format!("{}\n", path.display()));
    Ok(())
}
