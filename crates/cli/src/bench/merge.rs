//! `nonsmooth bench merge`.

use std::path::PathBuf;

use nonsmooth_bench::campaign;

use super::Joined;
use crate::report::{count, row};
use crate::{Exit, files, output};

/// Join the parts of a campaign, or several campaigns, into one file of runs.
///
/// Of a run that is in several files the first counts. Files that cannot be used, among them those of another version of
/// the format, are named and left out.
#[derive(Debug, clap::Args)]
#[command(after_help = EXAMPLES)]
pub struct Args {
    /// Files of runs
    #[arg(required = true, value_name = "RUNS.jsonl")]
    files: Vec<PathBuf>,
    /// The file to write, a new one
    #[arg(long, value_name = "ALL.jsonl")]
    out: PathBuf,
}

const EXAMPLES: &str = "\
Examples:
  nonsmooth bench merge part*.jsonl --out runs.jsonl

Exit codes: 0 joined; 1 joined, but parts or runs are missing, a line is torn, or plans differ; 2 some file at fault, the
others joined.";

/// Runs the command.
pub fn run(args: &Args) -> Result<Exit, String> {
    super::apart(&args.files, [args.out.as_path()])?;
    files::ends_in("--out", &args.out, &["jsonl"])?;
    files::writable("--out", &args.out)?;
    campaign::unused(&args.out)?;
    let Joined { runs, twice, mut remarks, mut exit } = super::read(&args.files)?;
    let mut text = format!(
        "{}: {}, {} of {}\n",
        args.out.display(),
        count(runs.campaigns.len(), "campaign"),
        count(runs.runs.len(), "run"),
        count(runs.problems.len(), "problem")
    );
    if twice > 0 {
        row(&mut text, "twice", format!("{}: the first counts", count(twice, "run")));
    }
    remarks.extend(runs.differing_plans());
    text += &super::limits(&remarks);
    exit = exit.max(Exit::solved(remarks.is_empty()));
    files::write_text("--out", &args.out, &runs.text())?;
    output::print(&text);
    Ok(exit)
}
