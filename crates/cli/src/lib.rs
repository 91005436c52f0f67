//! The command line of `nonsmooth`: arguments, progress, pictures and exit codes; all numerics live below.
//!
//! One file per command, and small shared parts: `kinds` (what is said of each kind of problem),
//! `files` (input and output files), `report` (verdicts as text and JSON), `output` (the two streams),
//! `progress`, `interrupt` and `plot`. `ampl` is the program as AMPL calls it. The library is for the two programs `nonsmooth` and `nonsmooth-ampl` alone.

mod ampl;
mod answer;
mod bench;
mod certificate;
mod check;
mod completions;
mod convert;
mod diagnose;
mod draw;
mod enumerate;
mod exists;
mod files;
mod generate;
mod info;
mod interrupt;
mod jacobian;
mod json;
mod kinds;
mod list;
mod multistart;
mod output;
mod plot;
mod progress;
mod report;
mod simulate;
mod solve;

use std::process::ExitCode;

use clap::{CommandFactory, Parser, Subcommand};
use nonsmooth_io::listed;
use nonsmooth_problem::Kind;

/// What a command came to; the worst of several files counts.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
pub(crate) enum Exit {
    /// Everything asked for was done, every problem is solved.
    Solved = 0,
    /// A numerical outcome other than solved.
    NotSolved = 1,
    /// The caller's mistake: a bad file, option, solver or setting.
    Mistake = 2,
}

impl Exit {
    /// `Solved` if `solved`, else `NotSolved`.
    pub(crate) fn solved(solved: bool) -> Self {
        if solved { Self::Solved } else { Self::NotSolved }
    }
}

/// Solve, check, describe and generate frictional contact problems and complementarity problems.
#[derive(Debug, Parser)]
#[command(name = "nonsmooth", version, after_help = examples())]
struct Cli {
    #[command(subcommand)]
    command: Command,
}

fn examples() -> String {
    let (contact, pairs) =
        (listed(|kind| !kind.is_complementarity()), listed(Kind::is_complementarity));
    format!(
        "\
Examples:
  nonsmooth gen wall --set rows=8 --out wall.hdf5    a problem to begin with
  nonsmooth info wall.hdf5                           what it is
  nonsmooth exists wall.hdf5                         whether a solution exists, with a certificate
  nonsmooth diagnose wall.hdf5                       what makes it hard, and what to try
  nonsmooth solve wall.hdf5 --out solved.hdf5        solve it and keep the solution
  nonsmooth check solved.hdf5                        have the solution judged again
  nonsmooth solve rectifier.toml --trace pivots.json a complementarity problem, and what the method did
  nonsmooth convert solved.hdf5 contacts.csv         the solution as a table, or a problem in another format
  nonsmooth draw solved.hdf5                         its bodies with the impulses, or matrices and friction cones
  nonsmooth simulate wall --end 0.5 --html wall.html bodies in motion, as a page that plays
  nonsmooth list                                     the solvers and their settings
  nonsmooth bench run problems/ --out runs.jsonl     compare solvers on folders of problems

Contact problems, local (W, q, mu) or global (M, H, f, w, mu), in 2D or 3D, are {contact}.
Complementarity problems (LCP, mixed, horizontal, with bounds, nonlinear) and variational inequalities are {pairs}.

Exit codes: 0 solved; 1 not solved; 2 a mistake in a file or an option; 130 Ctrl-C pressed twice."
    )
}

#[derive(Debug, Subcommand)]
enum Command {
    Solve(solve::Args),
    Check(check::Args),
    Info(info::Args),
    Exists(exists::Args),
    Diagnose(diagnose::Args),
    List(list::Args),
    Gen(generate::Args),
    Convert(convert::Args),
    Draw(draw::Args),
    Simulate(simulate::Args),
    Play(simulate::PlayArgs),
    Bench(bench::Args),
    Completions(completions::Args),
}

/// The program `nonsmooth`: one of its commands, or, with `-AMPL` among the arguments, what AMPL asks for.
pub fn program() -> ExitCode {
    if ampl::calls(&arguments()) {
        return program_for_ampl();
    }
    let cli = match Cli::try_parse() {
        Ok(cli) => cli,
        Err(e) if e.to_string().starts_with("error: ") => {
            output::error(&one_line(&e.to_string(), &arguments()));
            return ExitCode::from(Exit::Mistake as u8);
        }
        // Help and version are answers, not mistakes; without any argument the help is the answer.
        Err(answer) => {
            output::printed(answer.print());
            return ExitCode::from(u8::try_from(answer.exit_code()).unwrap_or(u8::MAX));
        }
    };
    let done = match cli.command {
        Command::Solve(args) => solve::run(&args),
        Command::Check(args) => check::run(&args),
        Command::Info(args) => info::run(&args),
        Command::Exists(args) => exists::run(&args),
        Command::Diagnose(args) => diagnose::run(&args),
        Command::List(args) => list::run(&args),
        Command::Gen(args) => generate::run(&args),
        Command::Convert(args) => convert::run(&args),
        Command::Draw(args) => draw::run(&args),
        Command::Simulate(args) => simulate::run(&args),
        Command::Play(args) => simulate::play(&args),
        Command::Bench(args) => bench::run(&args),
        Command::Completions(args) => Ok(completions::run(&args, Cli::command())),
    };
    let exit = done.unwrap_or_else(|mistake| {
        output::error(&mistake);
        Exit::Mistake
    });
    ExitCode::from(exit as u8)
}

/// The program `nonsmooth-ampl`, a solver for AMPL.
pub fn program_for_ampl() -> ExitCode {
    let exit = ampl::run(&arguments()).unwrap_or_else(|mistake| {
        output::error(&mistake);
        Exit::Mistake
    });
    ExitCode::from(exit as u8)
}

/// The name by which the program was called, and its arguments.
fn arguments() -> Vec<String> {
    std::env::args_os().map(|word| word.to_string_lossy().into_owned()).collect()
}

/// A usage error of these words as one line: its paragraphs up to the usage text, joined.
fn one_line(message: &str, words: &[String]) -> String {
    let lines = message.trim_start_matches("error: ").lines().map(str::trim);
    let said = lines
        .take_while(|l| !l.starts_with("Usage:") && !l.starts_with("For more information"))
        .filter(|l| !l.is_empty());
    said.fold(String::new(), |text, line| match line {
        line if text.is_empty() => line.into(),
        tip if tip.starts_with("tip:") => {
            format!("{text}; {}", joined(tip, words).as_deref().unwrap_or(tip))
        }
        line => format!("{text} {line}"),
    })
}

/// The tip for the value of an option that is taken for options, as it begins with `-`. After `--` it would be none of that option.
fn joined(tip: &str, words: &[String]) -> Option<String> {
    // Of `-x.hdf5` it names `-x`.
    let begins = tip.strip_prefix("tip: to pass '")?.split('\'').next()?;
    let program = Cli::command();
    let command =
        words.iter().skip(1).fold(&program, |c, word| c.find_subcommand(word).unwrap_or(c));
    let takes_value = |option: &str| {
        let is =
            |a: &&clap::Arg| a.get_long().is_some() && a.get_long() == option.strip_prefix("--");
        let mistaken =
            |a: &clap::Arg| a.get_action().takes_values() && !a.is_allow_hyphen_values_set();
        command.get_arguments().find(is).is_some_and(mistaken)
    };
    let pair = words.windows(2).find(|w| w[1].starts_with(begins) && takes_value(&w[0]))?;
    let (option, value) = (&pair[0], &pair[1]);
    Some(format!("tip: to pass '{value}' as the value of '{option}', use '{option}={value}'"))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn usage_errors_are_one_line() {
        let message = |arguments: &str| {
            let all = ["nonsmooth"].into_iter().chain(arguments.split_whitespace());
            let words: Vec<String> = all.map(String::from).collect();
            one_line(&Cli::try_parse_from(&words).unwrap_err().to_string(), &words)
        };
        assert_eq!(
            message("solve"),
            "the following required arguments were not provided: <FILE>..."
        );
        assert_eq!(
            message("solve x --tool 3"),
            "unexpected argument '--tool' found; tip: a similar argument exists: '--tol'"
        );
        let abc = "invalid value 'abc' for '--tol <TOL>': invalid float literal";
        assert_eq!(message("solve x --tol abc"), abc);
        // A value that begins with a dash is joined to its option; a name of a file comes after `--`.
        assert_eq!(
            message("gen wall --out -x.hdf5"),
            "unexpected argument '-x' found; tip: to pass '-x.hdf5' as the value of '--out', use '--out=-x.hdf5'"
        );
        assert!(Cli::try_parse_from(["nonsmooth", "gen", "wall", "--out=-x.hdf5"]).is_ok());
        for (c, words) in [("-x", "solve --json -x.hdf5"), ("-1", "solve a --tol -1 -1.hdf5")] {
            let tip = format!("tip: to pass '{c}' as a value, use '-- {c}'");
            assert_eq!(message(words), format!("unexpected argument '{c}' found; {tip}"));
        }
    }
}
