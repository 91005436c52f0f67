//! The command line of `nonsmooth`: arguments, progress, pictures and exit codes; all numerics live below.
//!
//! One file per command, and small shared parts: [`kinds`] (what a command needs of a kind of problem),
//! [`files`] (input and output files), [`report`] (verdicts as text and JSON), [`output`] (the two streams),
//! [`progress`], [`interrupt`] and [`plot`].

mod check;
mod files;
mod generate;
mod info;
mod interrupt;
mod kinds;
mod list;
mod output;
mod plot;
mod progress;
mod report;
mod solve;

use std::process::ExitCode;

use clap::{Parser, Subcommand};

/// What a command came to; the worst of several files counts.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
pub enum Exit {
    /// Everything asked for was done, every problem is solved.
    Solved = 0,
    /// A numerical outcome other than solved.
    NotSolved = 1,
    /// The caller's mistake: a bad file, option, solver or setting.
    Mistake = 2,
}

impl Exit {
    /// `Solved` if `solved`, else `NotSolved`.
    pub fn solved(solved: bool) -> Self {
        if solved { Self::Solved } else { Self::NotSolved }
    }
}

/// Solve, check, describe and generate frictional contact problems.
#[derive(Debug, Parser)]
#[command(name = "nonsmooth", version, after_help = EXAMPLES)]
struct Cli {
    #[command(subcommand)]
    command: Command,
}

const EXAMPLES: &str = "\
Examples:
  nonsmooth gen wall --set rows=8 --out wall.hdf5    a problem to begin with
  nonsmooth info wall.hdf5                           what it is
  nonsmooth solve wall.hdf5 --out solved.hdf5        solve it and keep the solution
  nonsmooth check solved.hdf5                        have the solution judged again
  nonsmooth list                                     the solvers and their settings

Files are FCLIB's HDF5 files of local (W, q, mu) or global (M, H, f, w, mu) problems, in 2D or 3D.

Exit codes: 0 solved; 1 not solved; 2 a mistake in a file or an option; 130 Ctrl-C pressed twice.";

#[derive(Debug, Subcommand)]
enum Command {
    Solve(solve::Args),
    Check(check::Args),
    Info(info::Args),
    List(list::Args),
    Gen(generate::Args),
}

fn main() -> ExitCode {
    let done = match Cli::parse().command {
        Command::Solve(args) => solve::run(&args),
        Command::Check(args) => check::run(&args),
        Command::Info(args) => info::run(&args),
        Command::List(args) => list::run(&args),
        Command::Gen(args) => generate::run(&args),
    };
    let exit = done.unwrap_or_else(|mistake| {
        output::error(&mistake);
        Exit::Mistake
    });
    ExitCode::from(exit as u8)
}
