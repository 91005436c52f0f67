//! `nonsmooth check --certificate`: a certificate from its file, verified from the problem's data.

use std::path::{Path, PathBuf};

use nonsmooth_problem::check::{Certificate, Evidence, ExactVector, Kinematic, Monotone, Proof};
use nonsmooth_problem::{AnyProblem, Problem, with_friction};
use serde_json::{Value, json};

use crate::{Exit, files, output, report};

/// What a certificate says that it is.
enum Claim {
    /// That there is no solution.
    None(Value),
    /// That there is one, because of this motion.
    Motion(ExactVector),
    /// That there is one: the coefficients of the problem's columns.
    Solution(ExactVector),
}

/// What it turned out to be.
struct Found {
    name: &'static str,
    says: String,
    proved: bool,
}

/// Verifies the certificate for each of the problems.
pub fn check(problems: &[PathBuf], path: &Path, as_json: bool) -> Result<Exit, String> {
    let claim = read(path)?;
    let claim = &claim;
    Ok(files::each(problems, as_json, |_, file| {
        let problem = &files::read(file)?.problem;
        let found = match (claim, problem) {
            (Claim::None(value), _) => refutes(problem, value, path)?,
            (Claim::Solution(t), _) => solves(problem, t),
            (Claim::Motion(motion), AnyProblem::Friction(p)) => {
                with_friction!(p, p => moves(p, motion))
            }
            (Claim::Motion(_), _) => nothing("a motion is no certificate for this kind of problem"),
        };
        let Found { name, says, proved } = found;
        if as_json {
            let mut all = report::problem_json(file, problem);
            all.extend(report::fields(json!({
                "certificate": path.to_string_lossy(), "evidence": name, "message": says,
            })));
            output::print(&format!("{}\n", json!(all)));
        } else {
            let mut text = format!("{}: {says}\n", file.display());
            report::row(&mut text, "problem", report::problem_text(problem));
            report::row(&mut text, "evidence", format!("{} ({name})", path.display()));
            output::print(&text);
        }
        Ok(Exit::solved(proved))
    }))
}

/// The claim in a file: what `solve` or `exists` wrote, or what stands there under `certificate`.
fn read(path: &Path) -> Result<Claim, String> {
    let mistake = |what: String| format!("--certificate {}: {what}", path.display());
    let bytes = std::fs::read(path).map_err(|e| mistake(e.to_string()))?;
    let all: Value = serde_json::from_slice(&bytes)
        .map_err(|e| mistake(format!("expected a certificate in JSON, found {e}")))?;
    let vector = |value: &Value| {
        serde_json::from_value::<ExactVector>(value.clone())
            .map_err(|e| mistake(format!("a vector of fractions: {e}")))
    };
    if let Some(motion) = all.get("motion") {
        // What is only nearly proved is written in doubles.
        return match motion.get(0).is_some_and(Value::is_number) {
            true => {
                Err(mistake("expected a proof, found a motion that holds up to rounding".into()))
            }
            false => vector(motion).map(Claim::Motion),
        };
    }
    if let Some(t) = all.get("coefficients") {
        return vector(t).map(Claim::Solution);
    }
    let inner = all.get("certificate").or_else(|| all.get("proof").filter(|p| p.is_object()));
    let claimed = inner.unwrap_or(&all);
    if claimed.get("proof").is_none_or(|p| !p.is_string()) {
        let expected =
            "expected a certificate: an object with \"proof\", \"motion\" or \"coefficients\"";
        return Err(mistake(format!("{expected}, found none of them")));
    }
    Ok(Claim::None(claimed.clone()))
}

fn nothing(why: &str) -> Found {
    Found { name: "nothing", says: format!("the certificate proves nothing: {why}"), proved: false }
}

fn proved(what: &str) -> Found {
    Found { name: "proved", says: format!("{what}, proved in exact arithmetic"), proved: true }
}

fn refutes(problem: &AnyProblem, claimed: &Value, path: &Path) -> Result<Found, String> {
    let mistake = |e: String| format!("--certificate {}: {e}", path.display());
    let certificate = match claimed.get("exact") {
        // The vectors that were verified once are verified again.
        Some(exact) => {
            let Some(system) = problem.cones() else {
                return Ok(nothing("the problem's matrix is known by its products only"));
            };
            Proof::claimed(exact, system.rhs.len()).map_err(mistake)?
        }
        None => Some(
            serde_json::from_value::<Certificate>(claimed.clone())
                .map_err(|e| mistake(e.to_string()))?,
        ),
    };
    let Some(certificate) = certificate else {
        return Ok(nothing("it does not have the problem's shape"));
    };
    Ok(match problem.evidence(&certificate) {
        Evidence::Proved(proof) => proved(&format!("no solution: {proof}")),
        Evidence::Nearly { change } => Found {
            name: "nearly",
            says: format!(
                "no solution up to rounding only: a relative change of the data by {change:.0e} would prove it"
            ),
            proved: false,
        },
        Evidence::Nothing => nothing("it does not hold for this problem"),
    })
}

fn moves<P: Kinematic<D>, const D: usize>(problem: &P, motion: &ExactVector) -> Found {
    match (problem.kinematics().exact_margin(motion), problem.monotone()) {
        (Some(_), Monotone::Proved { .. }) => {
            proved("a solution exists: the motion keeps all contacts in the dual cone")
        }
        (Some(_), _) => nothing("the motion is right, but the dynamics are not proved monotone"),
        (None, _) => nothing("the motion does not keep all contacts in the dual cone"),
    }
}

fn solves(problem: &AnyProblem, t: &ExactVector) -> Found {
    match problem.cones().is_some_and(|s| s.complete && s.solved_by(&t.0)) {
        true => proved("a solution exists: it is given"),
        false => nothing("it is no solution of this problem"),
    }
}
