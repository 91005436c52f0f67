//! `nonsmooth info`.

mod contact;
mod linear;

use std::path::PathBuf;
use std::time::Instant;

use nonsmooth_io::Content;
use nonsmooth_problem::with_friction;
use nonsmooth_solve::diagnose::spectrum;
use nonsmooth_solve::{Limits, existence, guard};

use crate::report::{number, row};
use crate::{Exit, files, interrupt, output};

/// Describe the problems in files: sizes, structure, friction or the matrix's signs and symmetry, and what is stored besides.
///
/// The contact density is c = D nc / n, the components of the contact impulses over the degrees of freedom:
/// above 1 the impulses need not be unique (hyperstatic), and iterative solvers slow down.
///
/// Of the matrix of a linear complementarity problem: in which classes it surely is or is not, with a witness, and which
/// solvers are therefore sure to end in a solution.
#[derive(Debug, clap::Args)]
#[command(after_help = EXAMPLES)]
pub struct Args {
    /// Files of contact problems (FCLIB's HDF5) or of linear complementarity problems (TOML, Matrix Market, Siconos' text)
    #[arg(required = true, value_name = "FILE")]
    files: Vec<PathBuf>,
    /// Contact: compute the singular values of W: its rank, rank ratio and condition number. Time grows with the third
    /// power of the rows of W: a second or so for 1000
    #[arg(long)]
    spectrum: bool,
    /// The most rows for which the spectrum is computed
    #[arg(long, value_name = "ROWS", default_value = "2000", value_parser = files::whole, requires = "spectrum")]
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
            Ok(Content::Friction(content)) => content,
            Ok(Content::Linear(content)) => {
                let (path, copy) = (file.to_path_buf(), content.clone());
                let left = files::left(&limits, begun);
                let facts = match guard::run(&left, || {}, move |_| linear::facts(&path, &copy)) {
                    Ok(facts) => facts?,
                    Err(limit) => return late(limit),
                };
                output::print(&if args.json {
                    format!("{}\n", facts.json(&content))
                } else {
                    facts.text(file, &content)
                });
                return Ok(Exit::Solved);
            }
            Err(limit) => return late(limit),
        };
        let (path, copy) = (file.to_path_buf(), content.clone());
        let left = files::left(&limits, begun);
        let facts = guard::run(
            &left,
            || {},
            move |_| with_friction!(&copy.problem, p => contact::facts(&path, p, &copy)),
        );
        let mut facts = match facts {
            Ok(facts) => facts?,
            Err(limit) => return late(limit),
        };
        if args.spectrum {
            let left = files::left(&limits, begun);
            facts.spectrum = Some(spectrum(&content.problem, args.spectrum_limit, &left));
        }
        if facts.singular.is_none() {
            facts.existence = if args.existence {
                let left = files::left(&limits, begun);
                let time_limit = Some(left.time_limit.unwrap_or(EXISTENCE_SECONDS));
                Some(existence::of(&content.problem, &Limits { time_limit, ..left }))
            } else {
                facts.is_small().then(|| existence::glance(&content.problem))
            };
        }
        output::print(&if args.json {
            format!("{}\n", facts.json(&content))
        } else {
            facts.text(file, &content)
        });
        Ok(Exit::Solved)
    }))
}

/// The time for the existence of a solution.
const EXISTENCE_SECONDS: f64 = 60.0;
/// The tolerance at which a stored solution is judged.
const JUDGED_AT: f64 = 1e-8;

fn symmetry(asymmetry: f64) -> String {
    match asymmetry {
        0.0 => "symmetric".into(),
        a => format!("asymmetry {}", number(a)),
    }
}

/// What the author of a file says.
fn texts(text: &mut String, title: &Option<String>, description: &Option<String>) {
    for (label, said) in [("title", title), ("about", description)] {
        if let Some(said) = said.as_deref().map(str::trim).filter(|s| !s.is_empty()) {
            row(text, label, said.replace('\n', "\n             "));
        }
    }
}
