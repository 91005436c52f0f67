//! `nonsmooth bench traits`.

use std::path::{Path, PathBuf};

use nonsmooth_bench::campaign::inputs;
use nonsmooth_bench::traits_table::{Described, describe, published, table};

use crate::report::count;
use crate::{Exit, files, output};

/// Tabulate families of problems by their traits, beside the families published for FCLIB.
///
/// A family is a folder. For each: degrees of freedom n, contacts nc, contact density c = 3 nc / n, rank ratio (rows of W
/// over its rank), condition number of W over the singular values that are not rounding, and the mean asymmetry of W.
#[derive(Debug, clap::Args)]
#[command(after_help = EXAMPLES)]
pub struct Args {
    /// Folders with FCLIB files, or files
    #[arg(required = true, value_name = "FOLDER")]
    problems: Vec<PathBuf>,
    /// No spectrum (rank ratio, condition, asymmetry) of problems whose matrix has more rows: it is dense, and its cost
    /// grows with the third power
    #[arg(long, value_name = "M", default_value = "1000", value_parser = files::whole, allow_hyphen_values = true)]
    spectrum_limit: usize,
    /// Print a table of Markdown
    #[arg(long, conflicts_with = "csv")]
    markdown: bool,
    /// Print CSV
    #[arg(long)]
    csv: bool,
}

const EXAMPLES: &str = "\
Examples:
  nonsmooth bench traits problems/
  nonsmooth bench traits problems/ --markdown --spectrum-limit 3000";

/// Runs the command.
pub fn run(args: &Args) -> Result<Exit, String> {
    let (described, exit) = describe_all(&args.problems, args.spectrum_limit)?;
    let table = table(&described, &published());
    output::print(&if args.csv {
        table.csv().map_err(|e| e.to_string())?
    } else if args.markdown {
        table.markdown()
    } else {
        table.text()
    });
    Ok(exit)
}

/// Describes all problems below folders; those that cannot be read are left out with a message. Second: what the mistakes
/// come to.
///
/// Errors: no problem can be read.
pub fn describe_all(
    folders: &[PathBuf],
    spectrum_limit: usize,
) -> Result<(Vec<Described>, Exit), String> {
    let (inputs, mistakes) = inputs(folders);
    let mut exit = Exit::Solved;
    let mut mistake = |message: &str| {
        output::error(message);
        exit = Exit::Mistake;
    };
    mistakes.iter().for_each(|m| mistake(m));
    let mut described = vec![];
    // Complementarity problems have other traits: `nonsmooth info` says which.
    let mut others = 0;
    let without = |path: &Path| {
        path.extension().is_some_and(|e| ["toml", "mtx", "nl"].iter().any(|l| e == *l))
    };
    for input in &inputs {
        if without(&input.path) {
            others += 1;
            continue;
        }
        match describe(&input.path, spectrum_limit) {
            Ok(problem) => described.push(problem),
            Err(e) if e.is_of_another_kind() => others += 1,
            Err(e) => mistake(&e.to_string()),
        }
    }
    if described.is_empty() {
        return Err(match others {
            0 => "expected contact problems that can be read, found none".into(),
            n => {
                format!("expected contact problems, found {} without contacts", count(n, "problem"))
            }
        });
    }
    Ok((described, exit))
}
