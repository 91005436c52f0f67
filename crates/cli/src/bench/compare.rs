//! `nonsmooth bench compare`.

use std::path::PathBuf;

use nonsmooth_bench::compare::{Options, compare};
use nonsmooth_bench::runs::Runs;

use crate::{Exit, output};

/// Say what got slower, less accurate or unsolved from one campaign to another.
///
/// Runs are paired by problem, solver and tolerance. Times are compared where both campaigns ran on one machine under one
/// plan: the ratio of the fastest solves, reported where it exceeds --slower and the spread of the repeats, and the
/// geometric mean for each solver with its 95 % interval and a sign test.
#[derive(Debug, clap::Args)]
#[command(after_help = EXAMPLES)]
pub struct Args {
    /// The runs to compare with
    #[arg(value_name = "OLD")]
    old: PathBuf,
    /// The runs to judge
    #[arg(value_name = "NEW")]
    new: PathBuf,
    /// Leave times out: for machines that are not quiet, or not the same
    #[arg(long)]
    outcomes: bool,
    /// The ratio of times, new over old, from which on a run or a solver counts as slower
    #[arg(long, value_name = "RATIO", default_value = "1.1", allow_hyphen_values = true)]
    slower: f64,
    /// Print one object of JSON in place of the report
    #[arg(long)]
    json: bool,
}

const EXAMPLES: &str = "\
Examples:
  nonsmooth bench compare before.jsonl after.jsonl
  nonsmooth bench compare before.jsonl after.jsonl --outcomes --json

Exit codes: 0 nothing is worse; 1 something is; 2 a mistake in a file or an option.";

/// Runs the command.
pub fn run(args: &Args) -> Result<Exit, String> {
    let slower = args.slower;
    if !(slower >= 1.0 && slower.is_finite()) {
        return Err(format!("--slower: expected a number of at least 1, found {slower}"));
    }
    let read = |file| Runs::read(file).map_err(|e| e.to_string());
    let (old, new) = (read(&args.old)?, read(&args.new)?);
    let options = Options { outcomes: args.outcomes, slower };
    let comparison = compare(&old, &new, &options);
    if comparison.pairs == 0 {
        let (old, new) = (args.old.display(), args.new.display());
        let why = comparison.warnings.iter().map(|w| format!("; {w}")).collect::<String>();
        return Err(format!("{new}: expected runs that are also in {old}, found none{why}"));
    }
    if args.json {
        output::print(&format!("{}\n", serde_json::json!(comparison)));
    } else {
        output::print(&comparison.text());
    }
    Ok(Exit::solved(!comparison.worse))
}
