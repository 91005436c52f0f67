//! `nonsmooth bench page`.

use std::path::PathBuf;

use nonsmooth_bench::page::{DOCUMENTS, page};
use nonsmooth_bench::traits_table::{published, table};

use super::{Joined, traits};
use crate::report::count;
use crate::{Exit, files, output};

/// Write the page of a comparison: sentences, tables and figures, in Markdown.
///
/// Everything on it is made from the runs: who solves most, who is the fastest where, and what nobody solves, for each
/// kind of problem and each tolerance. docs/benchmarks.md of this project is such a page.
#[derive(Debug, clap::Args)]
#[command(after_help = EXAMPLES)]
pub struct Args {
    /// Files of runs
    #[arg(required = true, value_name = "RUNS.jsonl")]
    runs: Vec<PathBuf>,
    /// The page to write; its figures go into a folder of its name beside it
    #[arg(long, value_name = "PAGE.md")]
    out: PathBuf,
    /// The problems: adds a table of their families, beside those published for FCLIB
    #[arg(long, value_name = "FOLDER")]
    problems: Vec<PathBuf>,
    /// No spectrum of problems whose matrix has more rows
    #[arg(long, value_name = "M", default_value = "1000", value_parser = files::whole, allow_hyphen_values = true)]
    spectrum_limit: usize,
    /// The command that makes the page again, to be named on it
    #[arg(long, value_name = "TEXT", default_value = "nonsmooth bench page")]
    command: String,
}

const EXAMPLES: &str = "\
Example:
  nonsmooth bench page runs.jsonl --problems problems/ --out comparison.md

Exit codes: 0 written; 2 a mistake in a file or an option.";

/// Runs the command.
pub fn run(args: &Args) -> Result<Exit, String> {
    let out = args.out.display();
    if args.out.extension().is_none() {
        return Err(format!(
            "--out {out}: expected a name such as comparison.md, whose figures go into `comparison`, found none to part"
        ));
    }
    super::apart(&args.runs, [args.out.as_path()])?;
    files::writable("--out", &args.out)?;
    files::ends_in("--out", &args.out, &["md"])?;
    let Joined { runs, remarks, mut exit, .. } = super::read(&args.runs)?;
    let described = match args.problems.as_slice() {
        [] => None,
        folders => {
            let (described, worst) = traits::describe_all(folders, args.spectrum_limit)?;
            exit = exit.max(worst);
            Some(table(&described, &published()))
        }
    };
    let name = args.out.file_stem().unwrap_or_default().to_string_lossy().into_owned();
    // The pages of this project stand beside the documents that they refer to.
    let there = |name: &str| args.out.with_file_name(format!("{name}.md")).is_file();
    let beside = DOCUMENTS.into_iter().all(there);
    let made = page(&runs, described.as_ref(), &name, &args.command, beside)?;
    let folder = args.out.with_file_name(&name);
    let drawn = made.figures.iter().flat_map(|figure| figure.files());
    let drawn: Vec<_> = drawn.map(|(name, text)| (folder.join(name), text)).collect();
    super::apart(&args.runs, drawn.iter().map(|(path, _)| path.as_path()))?;
    files::folder("--out", &folder)?;
    for (path, text) in &drawn {
        files::write_text("--out", path, text)?;
    }
    files::write_text("--out", &args.out, &made.markdown)?;
    let figures = count(made.figures.len(), "figure");
    let limits = super::limits(&remarks);
    output::print(&format!("{}: {figures} in {}\n{limits}", args.out.display(), folder.display()));
    Ok(exit)
}
