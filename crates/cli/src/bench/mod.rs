//! `nonsmooth bench`: campaigns and what is made of them.

mod compare;
mod figures;
mod import;
mod merge;
mod page;
mod report;
mod run;
mod traits;

use std::path::{Path, PathBuf};

use nonsmooth_bench::campaign;
use nonsmooth_bench::runs::Runs;

use crate::report::row;
use crate::{Exit, files, output};

/// Compare solvers: run campaigns, and make profiles, tables and reports of them.
#[derive(Debug, clap::Args)]
#[command(after_help = EXAMPLES)]
pub struct Args {
    #[command(subcommand)]
    command: Command,
}

const EXAMPLES: &str = "\
Examples:
  nonsmooth bench run problems/ --out runs.jsonl              the solvers that apply, 1e-4 and 1e-8, 10 s each
  nonsmooth bench run problems/ --out runs.jsonl --resume     go on where it was ended
  nonsmooth bench report runs.jsonl --out report.html         profiles, tables, all runs
  nonsmooth bench compare old.jsonl new.jsonl                 what got slower or unsolved";

#[derive(Debug, clap::Subcommand)]
enum Command {
    Run(run::Args),
    Merge(merge::Args),
    Report(report::Args),
    Import(import::Args),
    Figures(figures::Args),
    Page(page::Args),
    Compare(compare::Args),
    Traits(traits::Args),
    /// Do one run for a campaign, which writes it to the standard input
    #[command(hide = true)]
    Worker,
}

/// The arguments that make this program a worker.
const WORKER: [&str; 2] = ["bench", "worker"];

/// Runs the command.
pub fn run(args: &Args) -> Result<Exit, String> {
    match &args.command {
        Command::Run(args) => run::run(args),
        Command::Merge(args) => merge::run(args),
        Command::Report(args) => report::run(args),
        Command::Import(args) => import::run(args),
        Command::Figures(args) => figures::run(args),
        Command::Page(args) => page::run(args),
        Command::Compare(args) => compare::run(args),
        Command::Traits(args) => traits::run(args),
        Command::Worker => campaign::serve(&campaign::Registry).map(|()| Exit::Solved),
    }
}

/// The content of files of runs, joined.
struct Joined {
    runs: Runs,
    /// Runs that are in more than one file; the first counts.
    twice: usize,
    /// What keeps the runs from being all that were planned, a line each.
    remarks: Vec<String>,
    /// What the mistakes come to.
    exit: Exit,
}

/// What `--out` leads to are files of their own.
fn apart<'a, 'b>(
    read: impl IntoIterator<Item = &'a PathBuf>,
    out: impl IntoIterator<Item = &'b Path>,
) -> Result<(), String> {
    let written = out.into_iter().map(|path| ("--out", path));
    files::apart(read.into_iter().map(PathBuf::as_path), written)
}

/// Reads files of runs; those that cannot be used are left out with a message.
///
/// Errors: no file can be used.
fn read(files: &[PathBuf]) -> Result<Joined, String> {
    let mut all = Joined { runs: Runs::default(), twice: 0, remarks: vec![], exit: Exit::Solved };
    for file in files {
        let mut mistake = |message: &str| {
            output::error(message);
            all.exit = Exit::Mistake;
        };
        match Runs::read(file) {
            Err(e) => mistake(&e.to_string()),
            Ok(runs) => {
                let said = |remark| format!("{}: {remark}", file.display());
                all.remarks.extend(runs.unfinished().into_iter().map(said));
                let joined = all.runs.join(runs);
                all.twice += joined.twice;
                for name in joined.conflicts {
                    let file = file.display();
                    mistake(&format!(
                        "{file}: {name}: expected the problem of the other runs, found another of that name; its runs are left out"
                    ));
                }
            }
        }
    }
    if all.runs.campaigns.is_empty() {
        return Err("expected a file of runs that can be used, found none".into());
    }
    all.remarks.extend(all.runs.missing_parts());
    Ok(all)
}

/// The last lines of a command's word: what limits what it has made.
fn limits(remarks: &[String]) -> String {
    let mut text = String::new();
    remarks.iter().for_each(|remark| row(&mut text, "but", remark));
    text
}
