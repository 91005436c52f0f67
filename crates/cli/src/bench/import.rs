//! `nonsmooth bench import`.

use std::path::PathBuf;

use nonsmooth_bench::campaign;
use nonsmooth_bench::foreign::{self, Measure, Source};

use crate::{Exit, files, output};

/// Turn another program's measurements into a runs file.
///
/// FILE is a table, CSV with a header or JSON (an array of objects, or one on each line), with the columns problem, solver,
/// tol, seconds, error (or status where there is no error), and perhaps iters, factorisations, nc, family, kind and
/// others: docs/benchmark-format.md says all. A row is solved if its error is at most its tolerance, whatever its
/// status says. Solvers are named `SOLVER (PROGRAM)`, and reports mark them as foreign.
#[derive(Debug, clap::Args)]
#[command(after_help = EXAMPLES)]
pub struct Args {
    /// The table: .json or .jsonl, else CSV
    #[arg(value_name = "FILE")]
    file: PathBuf,
    /// The program that was measured, perhaps with its version
    #[arg(long, value_name = "NAME")]
    program: String,
    /// The machine that it was measured on, in a few words
    #[arg(long, value_name = "TEXT")]
    machine: String,
    /// The runs file to write: a new one, or one that an import wrote before
    #[arg(long, value_name = "RUNS")]
    out: PathBuf,
    /// Join problems by file name with those of a runs file or of a folder
    #[arg(long, value_name = "RUNS|FOLDER")]
    problems: Option<PathBuf>,
    /// Which residual the column `error` holds; left out: one of the program's own
    #[arg(long, value_name = "MEASURE")]
    error: Option<Error>,
}

#[derive(Debug, Clone, Copy, clap::ValueEnum)]
enum Error {
    /// Siconos' error
    #[value(alias = "peer")]
    Siconos,
    /// The literature's: the natural map over the norm of q
    #[value(alias = "paper")]
    Literature,
    /// The one that decides here
    Relative,
}

const EXAMPLES: &str = "\
Example:
  nonsmooth bench import siconos.csv --program Siconos --machine '2-core EPYC' --error siconos \\
      --problems runs.jsonl --out siconos.jsonl

Exit codes: 0 every row was read; 2 some were not, or a mistake.";

/// Runs the command.
pub fn run(args: &Args) -> Result<Exit, String> {
    for (option, text) in [("--program", &args.program), ("--machine", &args.machine)] {
        if text.trim().is_empty() {
            return Err(format!("{option}: expected a name, found nothing"));
        }
    }
    files::writable("--out", &args.out)?;
    super::apart(std::iter::once(&args.file).chain(&args.problems), [args.out.as_path()])?;
    files::ends_in("--out", &args.out, &["jsonl"])?;
    // An import can be made again, a campaign cannot.
    if !foreign::is_import(&args.out) {
        campaign::unused(&args.out)?;
    }
    let measure = args.error.map(|e| match e {
        Error::Siconos => Measure::Siconos,
        Error::Literature => Measure::Literature,
        Error::Relative => Measure::Relative,
    });
    let source = Source { program: args.program.clone(), machine: args.machine.clone(), measure };
    let known = match &args.problems {
        Some(place) => foreign::problems(place).map_err(|e| format!("--problems {e}"))?,
        None => vec![],
    };
    let imported = foreign::import(&args.file, &source, &known).map_err(|e| e.to_string())?;
    files::write_text("--out", &args.out, &imported.text())?;
    for mistake in &imported.mistakes {
        output::error(mistake);
    }
    for note in &imported.notes {
        output::print(&format!("{}: {note}\n", args.file.display()));
    }
    Ok(if imported.mistakes.is_empty() { Exit::Solved } else { Exit::Mistake })
}
