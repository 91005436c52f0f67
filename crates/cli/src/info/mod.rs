//! `nonsmooth info`.

mod contact;
mod linear;
mod nonlinear;

use std::path::{Path, PathBuf};
use std::time::Instant;

use nonsmooth_io::{ProblemFile, StoredPoint};
use nonsmooth_problem::check::Judged;
use nonsmooth_problem::{AnyProblem, Complementarity, ProblemError, Stated, with_complementarity};
use nonsmooth_solve::{Limits, guard};
use serde_json::{Value, json};

use crate::kinds::AnyVerdict;
use crate::report::{self, fields, number, row};
use crate::{Exit, files, interrupt, output};

/// Describe the problems in files: sizes, structure, friction or the matrix's signs and symmetry, and what is stored besides.
///
/// The contact density is c = D nc / n, the components of the contact impulses over the degrees of freedom:
/// above 1 the impulses need not be unique (hyperstatic), and iterative solvers slow down.
///
/// Of the matrix of a linear complementarity problem: in which classes it surely is or is not, with a witness, and which
/// solvers are therefore sure to end in a solution.
///
/// Of a nonlinear one: where F and its Jacobian come from, which rows are affine, and whether F is monotone: of an affine one from the classes of its matrix, of
/// others by sampled pairs of points, which may refute it but do not prove it.
#[derive(Debug, clap::Args)]
#[command(after_help = EXAMPLES)]
pub struct Args {
    #[arg(required = true, value_name = "FILE", help = files::help("Files with one problem each", |_| true))]
    files: Vec<PathBuf>,
    /// Contact: compute the singular values of W: its rank, rank ratio and condition number. Time grows with the third
    /// power of the rows of W: a second or so for 1000
    #[arg(long)]
    spectrum: bool,
    /// The most rows for which the spectrum is computed
    #[arg(long, value_name = "ROWS", default_value = "2000", value_parser = files::whole, requires = "spectrum", allow_hyphen_values = true)]
    spectrum_limit: usize,
    /// Contact: decide whether a solution exists, as `nonsmooth exists` does. Without this, a short search
    /// proves it for most problems of up to 2000 contacts
    #[arg(long)]
    existence: bool,
    /// At most this many seconds for each file [default: 60 for the existence of a solution, none for the rest]
    #[arg(long, value_name = "S", allow_hyphen_values = true)]
    time_limit: Option<f64>,
    /// Print one line of JSON for each file
    #[arg(long)]
    json: bool,
}

const EXAMPLES: &str = "\
Examples:
  nonsmooth info wall.hdf5
  nonsmooth info wall.hdf5 --spectrum --existence
  nonsmooth info *.hdf5 --json";

/// Runs the command.
pub fn run(args: &Args) -> Result<Exit, String> {
    let time_limit = files::time_limit(args.time_limit)?;
    let long = args.existence || args.spectrum || time_limit.is_some();
    // Where all is quick, Ctrl-C simply ends the program.
    let cancel = long.then(interrupt::flag);
    let limits = Limits { time_limit, cancel, ..Limits::default() };
    Ok(files::each(&args.files, args.json, |_, file| {
        let begun = Instant::now();
        let late =
            |limit| Ok(files::late(file, args.json, limit, "before the problem was described"));
        let content = match files::read_within(file, &limits)? {
            Ok(content) => content,
            Err(limit) => return late(limit),
        };
        let copy = content.clone();
        let left = || limits.left(begun);
        let facts = match guard::run(&left(), || {}, move |_| Facts::of(&copy)) {
            Ok(facts) => facts,
            Err(limit) => return late(limit),
        };
        let mut facts = facts.map_err(|e| format!("{}: {e}", file.display()))?;
        if let (Details::Contact(facts), AnyProblem::Friction(problem)) =
            (&mut facts.details, &content.problem)
        {
            facts.search(problem, args, left);
        }
        output::print(&match args.json {
            true => format!("{}\n", facts.json(file, &content)),
            false => facts.text(file, &content),
        });
        Ok(Exit::Solved)
    }))
}

/// What there is to say of a file.
struct Facts {
    details: Details,
    solution: Option<AnyVerdict>,
}

/// What there is to say of the problem, by class.
// One a file: its size does not matter.
#[allow(clippy::large_enum_variant)]
enum Details {
    Contact(contact::Facts),
    Linear(linear::Facts),
    Nonlinear(nonlinear::Facts),
}

impl Facts {
    /// Everything but the spectrum and the existence of a solution.
    fn of(content: &ProblemFile) -> Result<Self, ProblemError> {
        let judge = |stored: &StoredPoint| content.problem.judge(&stored.point, JUDGED_AT);
        let solution = match content.solution.as_ref().map(judge).transpose() {
            // Said of M.
            Err(ProblemError::Singular { .. }) => None,
            judged => judged?,
        };
        let details = match &content.problem {
            AnyProblem::Friction(p) => Details::Contact(contact::Facts::of(p, content.info.dofs)),
            AnyProblem::Complementarity(Complementarity::Vi(p)) => {
                Details::Nonlinear(nonlinear::Facts::of_inequality(p))
            }
            AnyProblem::Complementarity(p) => match with_complementarity!(p, p => p.nonlinear()) {
                Some(p) => Details::Nonlinear(nonlinear::Facts::of(p)),
                None => Details::Linear(linear::Facts::of(p)),
            },
        };
        Ok(Self { details, solution })
    }

    fn json(&self, file: &Path, content: &ProblemFile) -> Value {
        let mut all = report::problem_json(file, &content.problem);
        let ProblemFile { info, guesses, .. } = content;
        all.extend(fields(json!({"title": info.title, "description": info.description})));
        match &self.details {
            Details::Contact(facts) => {
                all.extend(facts.json());
                all.insert("guesses".into(), json!(guesses.len()));
            }
            Details::Linear(facts) => all.extend(facts.json()),
            Details::Nonlinear(facts) => all.extend(facts.json()),
        }
        let judged = |v: &AnyVerdict| report::verdict_json(v, JUDGED_AT, v.worst.len());
        all.insert("solution".into(), json!(self.solution.as_ref().map(judged)));
        Value::Object(all)
    }

    fn text(&self, file: &Path, content: &ProblemFile) -> String {
        let ProblemFile { problem, info, guesses, .. } = content;
        let mut text = format!("{}: {}\n", file.display(), report::problem_text(problem));
        for (label, said) in [("title", &info.title), ("about", &info.description)] {
            if let Some(said) = said.as_deref().map(str::trim).filter(|s| !s.is_empty()) {
                row(&mut text, label, said.replace('\n', "\n             "));
            }
        }
        match &self.details {
            Details::Contact(facts) => facts.text(&mut text),
            Details::Linear(facts) => facts.text(&mut text),
            Details::Nonlinear(facts) => facts.text(&mut text),
        }
        if !guesses.is_empty() {
            row(&mut text, "guesses", guesses.len());
        }
        match &self.solution {
            None if content.solution.is_some() => {
                row(&mut text, "solution", "stored, but M is singular: it cannot be judged");
            }
            None => row(&mut text, "solution", "none stored"),
            Some(verdict) => {
                let passes = if verdict.solved { "passes" } else { "does not pass" };
                row(&mut text, "solution", format!("stored, {passes} at {JUDGED_AT:e}"));
                report::verdict_text(&mut text, content, verdict, JUDGED_AT, 0);
            }
        }
        text
    }
}

/// The tolerance at which a stored solution is judged.
const JUDGED_AT: f64 = 1e-8;

fn symmetry(asymmetry: f64) -> String {
    match asymmetry {
        0.0 => "symmetric".into(),
        a => format!("asymmetry {}", number(a)),
    }
}
