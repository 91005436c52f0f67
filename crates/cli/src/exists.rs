//! `nonsmooth exists`.

use std::path::{Path, PathBuf};
use std::time::Instant;

use nonsmooth_problem::AnyProblem;
use nonsmooth_problem::check::{Certificate, Existence, Impulses};
use nonsmooth_solve::{Limits, existence};
use serde_json::{Value, json};

use crate::report::{self, Object, row};
use crate::{Exit, files, interrupt, output};

/// Decide whether problems have a solution, with a verified certificate.
///
/// What is called proved holds in exact arithmetic on the stored data; what holds up to rounding only is called nearly proved, and
/// ends like what is not known.
/// Of contacts: a solution exists if some motion keeps every contact inside the dual cone K* = {mu |u_T| <= u_N}. If none does, that
/// is certified by impulses in K that feel no motion; the problem may then still have a solution. Normal impulses that
/// feel no motion prove that it has none, whatever the friction. Problems of a few contacts in the plane, or without friction, are
/// decided completely.
/// Of complementarity problems: the class of M (a P-matrix has one solution for every q), a solution in fractions where a solver found one, or a
/// verified proof that there is none; few pairs are enumerated in exact arithmetic.
#[derive(Debug, clap::Args)]
#[command(after_help = EXAMPLES)]
pub struct Args {
    #[arg(required = true, value_name = "FILE", help = files::help("Files with one problem each", |_| true))]
    files: Vec<PathBuf>,
    /// At most this many seconds for each file
    #[arg(long, value_name = "SECONDS", default_value = "60", allow_hyphen_values = true)]
    time_limit: f64,
    /// Memory that one factorisation may take, as 500M or 4G [default: what the machine has free]
    #[arg(long, value_name = "SIZE", value_parser = files::size)]
    memory_limit: Option<u64>,
    /// Write the certificate as JSON: the motion, or impulses and multipliers
    #[arg(long, value_name = "OUT")]
    certificate: Option<PathBuf>,
    /// Print one line of JSON for each file in place of the report
    #[arg(long)]
    json: bool,
}

const EXAMPLES: &str = "\
Examples:
  nonsmooth exists wall.hdf5
  nonsmooth exists game.toml
  nonsmooth exists problems/*.hdf5 --json
  nonsmooth exists wall.hdf5 --certificate motion.json

Exit codes: 0 proved for all; 1 not known, nearly proved, or no solution; 2 a mistake in a file or an option.";

/// Runs the command.
pub fn run(args: &Args) -> Result<Exit, String> {
    let time_limit = files::time_limit(Some(args.time_limit))?;
    let targets = match &args.certificate {
        Some(to) => {
            Some(files::targets("--certificate", to, &args.files, Some("certificate.json"))?)
        }
        None => None,
    };
    let written = targets.iter().flatten().map(|path| ("--certificate", path.as_path()));
    files::apart(args.files.iter().map(PathBuf::as_path), written)?;
    for path in targets.iter().flatten() {
        files::ends_in("--certificate", path, &["json"])?;
        output::results_are_filed();
    }
    let limits = Limits {
        time_limit,
        cancel: Some(interrupt::flag()),
        memory_limit: args.memory_limit,
        ..Limits::default()
    };
    Ok(files::each(&args.files, args.json, |k, file| {
        let start = Instant::now();
        let content = match files::read_within(file, &limits)? {
            Ok(content) => content,
            Err(limit) => return Ok(files::late(file, args.json, limit, files::WHILE_READ)),
        };
        let problem = &content.problem;
        let existence = existence::of(problem, &limits.left(start));
        let seconds = start.elapsed().as_secs_f64();
        let contacts = match problem {
            AnyProblem::Friction(contacts) => contacts.contacts(),
            AnyProblem::Complementarity(_) => 0,
        };
        let sizes = report::problem_json(file, problem);
        output::print(&if args.json {
            format!("{}\n", json(sizes.clone(), &existence, contacts, seconds))
        } else {
            text(file, &report::problem_text(problem), &existence, contacts, seconds)
        });
        let bare = matches!(existence, Existence::EveryQ { .. } | Existence::Unknown { .. });
        if bare && targets.is_some() {
            // A file without one would be none that `check` takes.
            output::remark(&format!(
                "{}: no certificate is written: {}\n",
                file.display(),
                match existence {
                    Existence::Unknown { .. } => "nothing is decided",
                    _ => "a theorem and the entries of the problem are all that decides",
                }
            ));
        } else if let Some(path) = targets.as_ref().map(|t| &t[k]) {
            let mut all = sizes;
            all.extend(report::fields(json!(existence)));
            files::write_text("--certificate", path, &format!("{}\n", json!(all)))?;
        }
        Ok(Exit::solved(existence.is_proved()))
    }))
}

/// The verdict and what it rests on, without the certificate itself.
pub fn fields(existence: &Existence, contacts: usize) -> Object {
    let pressed = |ray: &Impulses| ray.pressed(contacts);
    report::fields(match existence {
        Existence::Proved { margin, .. } => {
            json!({"verdict": existence.name(), "margin": margin})
        }
        Existence::Solved { representable, .. } => {
            json!({"verdict": existence.name(), "representable": representable})
        }
        Existence::EveryQ { because } => json!({"verdict": existence.name(), "because": because}),
        Existence::NearlySolved { relative } => {
            json!({"verdict": existence.name(), "relative": relative})
        }
        Existence::NearlyProved { margin, shift, .. } => {
            json!({"verdict": existence.name(), "margin": margin, "shift": shift})
        }
        Existence::Weak { ray } | Existence::CriterionRefuted { ray } => {
            json!({"verdict": existence.name(), "pressed_contacts": pressed(ray)})
        }
        Existence::NoSolution { proof } => {
            // A complementarity problem has no contacts to press.
            match proof.certificate().impulses().map(pressed) {
                Some(pressed) => {
                    json!({"verdict": existence.name(), "pressed_contacts": pressed})
                }
                None => json!({"verdict": existence.name()}),
            }
        }
        Existence::NearlyNoSolution { certificate, change } => {
            match certificate.impulses().map(pressed) {
                Some(pressed) => {
                    json!({"verdict": existence.name(), "pressed_contacts": pressed, "change": change})
                }
                None => json!({"verdict": existence.name(), "change": change}),
            }
        }
        Existence::Unknown { why } => json!({"verdict": existence.name(), "why": why}),
    })
}

fn json(mut all: Object, existence: &Existence, contacts: usize, seconds: f64) -> Value {
    all.extend(fields(existence, contacts));
    all.insert("message".into(), json!(existence.to_string()));
    all.insert("seconds".into(), json!(seconds));
    Value::Object(all)
}

fn text(file: &Path, size: &str, existence: &Existence, contacts: usize, seconds: f64) -> String {
    let mut text = format!("{}: existence of a solution {existence}\n", file.display());
    row(&mut text, "problem", size);
    let exactly = "in exact arithmetic";
    let nearly = "up to rounding";
    let of_motion = |unknowns: usize| format!("a motion of {unknowns} unknowns");
    let rests = match existence {
        Existence::Proved { motion, .. } => Some((of_motion(motion.0.len()), exactly)),
        Existence::Solved { .. } => Some(("a solution in fractions".into(), exactly)),
        Existence::EveryQ { .. } => {
            Some(("a theorem and the entries of the problem".into(), exactly))
        }
        Existence::NearlySolved { .. } => Some(("a solution in doubles".into(), nearly)),
        Existence::NearlyProved { motion, .. } => Some((of_motion(motion.len()), nearly)),
        Existence::Weak { ray } | Existence::CriterionRefuted { ray } => {
            Some((squeezed(ray, contacts), nearly))
        }
        Existence::NoSolution { proof } => Some((
            match proof.certificate().impulses() {
                Some(impulses) => squeezed(impulses, contacts),
                None => report::count(proof.vectors(), "separating vector"),
            },
            exactly,
        )),
        Existence::NearlyNoSolution { certificate, .. } => match certificate {
            Certificate::Impulses(impulses) => Some((squeezed(impulses, contacts), nearly)),
            Certificate::Separating { vectors } => {
                Some((report::count(vectors.len(), "separating vector"), nearly))
            }
            _ => None,
        },
        Existence::Unknown { .. } => None,
    };
    if let Some((rests, how)) = rests {
        row(&mut text, "rests on", format!("{rests}, verified {how}"));
    }
    row(&mut text, "time", format!("{seconds:.3} s"));
    text
}

/// Where a ray has impulses.
fn squeezed(ray: &Impulses, contacts: usize) -> String {
    let pressed = report::count(ray.pressed(contacts).len(), "contact");
    let constraints = match ray.lambda.iter().filter(|l| **l != 0.0).count() {
        0 => String::new(),
        n => format!(" and {}", report::count(n, "bilateral row")),
    };
    format!("impulses at {pressed}{constraints}")
}
