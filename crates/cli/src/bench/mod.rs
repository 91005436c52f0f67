//! `nonsmooth bench`: campaigns and what is made of them.

mod compare;
mod figures;
mod import;
mod merge;
mod run;
mod traits;

use nonsmooth_bench::campaign;
use nonsmooth_bench::runs::Runs;

use crate::{Exit, output};

/// Compare solvers: run campaigns, and make profiles, tables and reports of them.
#[derive(Debug, clap::Args)]
#[command(after_help = EXAMPLES)]
pub struct Args {
    #[command(subcommand)]
    command: Command,
}

const EXAMPLES: &str = "\
Examples:
  nonsmooth bench run problems/ --out runs.jsonl              all solvers, 1e-4 and 1e-8, 10 s each
  nonsmooth bench run problems/ --out runs.jsonl --resume     go on where it was ended
  nonsmooth bench report runs.jsonl --out report.html         profiles, tables, all runs
  nonsmooth bench compare old.jsonl new.jsonl                 what got slower or unsolved";

#[derive(Debug, clap::Subcommand)]
enum Command {
    Run(run::Args),
    Merge(merge::Args),
    Import(import::Args),
    Figures(figures::Args),
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
        Command::Import(args) => import::run(args),
        Command::Figures(args) => figures::run(args),
        Command::Compare(args) => compare::run(args),
        Command::Traits(args) => traits::run(args),
        Command::Worker => campaign::serve(&campaign::Registry).map(|()| Exit::Solved),
    }
}

/// The content of files of runs, those that cannot be used left out with a message. Second: what the mistakes come to.
///
/// Errors: no file can be used.
fn read(files: &[std::path::PathBuf]) -> Result<(Runs, Exit), String> {
    let mut all = Runs::default();
    let mut exit = Exit::Solved;
    let mut mistake = |message: &str| {
        output::error(message);
        exit = Exit::Mistake;
    };
    for file in files {
        match Runs::read(file) {
            Err(e) => mistake(&e.to_string()),
            Ok(runs) => {
                let joined = all.join(runs);
                for name in joined.conflicts {
                    let file = file.display();
                    mistake(&format!(
                        "{file}: {name}: expected the file that the other runs were made on, found another of that name; its runs are left out"
                    ));
                }
                if joined.twice > 0 {
                    let (file, n) = (file.display(), joined.twice);
                    mistake(&format!("{file}: {n} of its runs are there already and left out"));
                }
            }
        }
    }
    if all.campaigns.is_empty() {
        return Err("expected a file of runs that can be used, found none".into());
    }
    Ok((all, exit))
}
