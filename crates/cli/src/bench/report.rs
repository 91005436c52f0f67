//! `nonsmooth bench report`.

use std::path::PathBuf;

use nonsmooth_bench::report::{Options, html};

use super::Joined;
use crate::report::count;
use crate::{Exit, files, output};

/// Make the HTML report of measured runs.
///
/// One file that works from disk, without a network: profiles, tables and every run, by kind of problem, tolerance, and
/// family or size; solvers can be hidden. Several files of runs are joined; of a run that is in more than one, the first counts.
#[derive(Debug, clap::Args)]
#[command(after_help = EXAMPLES)]
pub struct Args {
    /// Files of runs, as a campaign or an import writes them
    #[arg(required = true, value_name = "RUNS")]
    files: Vec<PathBuf>,
    /// The file to write
    #[arg(long, value_name = "FILE")]
    out: PathBuf,
    /// The heading of the page
    #[arg(long, value_name = "TEXT")]
    title: Option<String>,
}

const EXAMPLES: &str = "\
Examples:
  nonsmooth bench report runs.jsonl --out report.html
  nonsmooth bench report ours.jsonl siconos.jsonl --out report.html --title \"Ours and Siconos'\"

Exit codes: 0 all files are in the report; 2 a file at fault (the report is of the others), or none left.";

/// Runs the command.
pub fn run(args: &Args) -> Result<Exit, String> {
    super::apart(&args.files, [args.out.as_path()])?;
    files::writable("--out", &args.out)?;
    files::ends_in("--out", &args.out, &["html", "htm"])?;
    let Joined { runs: all, twice, remarks, exit } = super::read(&args.files)?;
    let options = args.title.clone().map_or_else(Options::default, |title| Options { title });
    let page = html(&all, &options);
    files::write_text("--out", &args.out, &page)?;
    let mut text = format!(
        "{}: {} of {}, {:.1} MB",
        args.out.display(),
        count(all.runs.len(), "run"),
        count(all.solvers().len(), "solver"),
        page.len() as f64 / 1e6
    );
    if twice > 0 {
        text += &format!(" ({} in several files: the first counts)", count(twice, "run"));
    }
    output::print(&format!("{text}\n{}", super::limits(&remarks)));
    Ok(exit)
}
