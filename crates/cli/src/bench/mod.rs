//! `nonsmooth bench`: the commands on measured runs.

mod report;

use crate::Exit;

/// Measure solvers, and report on what was measured.
#[derive(Debug, clap::Args)]
pub struct Args {
    #[command(subcommand)]
    command: Command,
}

#[derive(Debug, clap::Subcommand)]
enum Command {
    Report(report::Args),
}

/// Runs the command.
pub fn run(args: &Args) -> Result<Exit, String> {
    match &args.command {
        Command::Report(args) => report::run(args),
    }
}
