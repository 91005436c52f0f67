//! `nonsmooth diagnose`.

use std::path::{Path, PathBuf};
use std::time::Instant;

use nonsmooth_solve::Limits;
use nonsmooth_solve::diagnose::{Diagnosis, Effort, Trial, diagnose};
use serde_json::json;

use crate::report::{self, row};
use crate::{Exit, files, interrupt, output};

/// Explain what makes problems hard, and what to try.
///
/// Of contacts: size, hyperstaticity, conditioning, asymmetry, mass ratio, impact, friction, duplicate contacts, independent groups,
/// redundant constraints and the existence of a solution. Of complementarity problems: size, the class of M and what it promises, rank, scale and existence.
/// Each with its numbers and what follows from them for solvers; every solver that they suggest is tried before it is advised.
#[derive(Debug, clap::Args)]
#[command(after_help = EXAMPLES)]
pub struct Args {
    #[arg(required = true, value_name = "FILE", help = files::help("Files with one problem each", |_| true))]
    files: Vec<PathBuf>,
    /// The most rows of W (or of M) for which rank and condition number are computed
    #[arg(long, value_name = "ROWS", default_value = "1500", value_parser = files::whole, allow_hyphen_values = true)]
    spectrum_limit: usize,
    /// At most this many seconds for each file, half of them for rank and condition number
    #[arg(long, value_name = "SECONDS", default_value = "20", allow_hyphen_values = true)]
    time_limit: f64,
    /// Memory that one factorisation may take, as 500M or 4G [default: what the machine has free]
    #[arg(long, value_name = "SIZE", value_parser = files::size)]
    memory_limit: Option<u64>,
    /// Print one line of JSON for each file
    #[arg(long)]
    json: bool,
}

const EXAMPLES: &str = "\
Examples:
  nonsmooth diagnose wall.hdf5
  nonsmooth diagnose string.toml
  nonsmooth diagnose *.hdf5 --json";

/// Runs the command.
pub fn run(args: &Args) -> Result<Exit, String> {
    let time_limit = files::time_limit(Some(args.time_limit))?;
    let limits = Limits {
        time_limit,
        cancel: Some(interrupt::flag()),
        memory_limit: args.memory_limit,
        ..Limits::default()
    };
    Ok(files::each(&args.files, args.json, |_, file| {
        let begun = Instant::now();
        let content = match files::read_within(file, &limits)? {
            Ok(content) => content,
            Err(limit) => return Ok(files::late(file, args.json, limit, files::WHILE_READ)),
        };
        let left = limits.left(begun);
        let effort = Effort { spectrum_limit: args.spectrum_limit, limits: left };
        let diagnosis = match diagnose(&content.problem, content.info.dofs, &effort) {
            Ok(diagnosis) => diagnosis,
            Err(limit) => {
                return Ok(files::late(
                    file,
                    args.json,
                    limit,
                    "before the problem was understood",
                ));
            }
        };
        output::print(&if args.json {
            let mut all = report::problem_json(file, &content.problem);
            all.extend(report::fields(json!(diagnosis)));
            format!("{}\n", json!(all))
        } else {
            text(file, &diagnosis)
        });
        Ok(Exit::Solved)
    }))
}

fn text(file: &Path, diagnosis: &Diagnosis) -> String {
    let hard: Vec<_> = diagnosis.findings.iter().filter(|f| f.hard).map(|f| f.about).collect();
    let hard = match hard[..] {
        [] => "nothing that makes it hard".into(),
        _ => format!("hard by its {}", hard.join(", ")),
    };
    let mut text = format!("{}: {hard}\n", file.display());
    for finding in &diagnosis.findings {
        let mark = if finding.hard { "! " } else { "" };
        row(&mut text, finding.about, format!("{mark}{}.", finding.says));
        if !finding.means.is_empty() {
            row(&mut text, "", &finding.means);
        }
    }
    for (k, trial) in diagnosis.trials.iter().enumerate() {
        let Trial { solver, status, relative, iterations, seconds } = trial;
        let label = if k == 0 { "tried" } else { "" };
        let steps = report::count(*iterations, "iteration");
        let came = format!("{status}, relative {relative:.1e} after {steps} in {seconds:.3} s");
        row(&mut text, label, format!("{solver}: {came}"));
    }
    match &diagnosis.suits[..] {
        [] if diagnosis.trials.is_empty() => {}
        [] => row(&mut text, "try", "more time: none of these solved it on trial"),
        suits => {
            let tries: Vec<_> = suits.iter().map(|s| format!("--solver {s}")).collect();
            row(&mut text, "try", tries.join(", or "));
        }
    }
    text
}
