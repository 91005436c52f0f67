//! `nonsmooth bench`: campaigns of measurements.

mod compare;
mod figures;
mod import;

use clap::Subcommand;
use nonsmooth_bench::runs::Runs;

use crate::Exit;

/// Measure solvers, and look at what was measured.
#[derive(Debug, clap::Args)]
pub struct Args {
    #[command(subcommand)]
    command: Command,
}

#[derive(Debug, Subcommand)]
enum Command {
    Compare(compare::Args),
    Figures(figures::Args),
    Import(import::Args),
}

/// Runs the command.
pub fn run(args: &Args) -> Result<Exit, String> {
    match &args.command {
        Command::Compare(args) => compare::run(args),
        Command::Figures(args) => figures::run(args),
        Command::Import(args) => import::run(args),
    }
}

/// The runs of all files that can be read, joined, and whether one could not: its mistake is reported.
fn joined(files: &[std::path::PathBuf]) -> (Runs, Exit) {
    let (mut all, mut exit) = (Runs::default(), Exit::Solved);
    for file in files {
        match Runs::read(file) {
            Ok(runs) => drop(all.join(runs)),
            Err(mistake) => {
                crate::output::error(&mistake.to_string());
                exit = Exit::Mistake;
            }
        }
    }
    (all, exit)
}
