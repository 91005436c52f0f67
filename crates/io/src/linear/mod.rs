//! Complementarity problems as text: LCP, MLCP, horizontal, box-constrained and nonlinear; and variational inequalities.
//!
//! [`toml`] is our own format, with solution and texts (docs/formats.md); [`market`] is Matrix Market, `NAME.mtx` with `NAME_q.mtx` beside.

pub mod market;
mod set;
pub mod toml;

use std::path::Path;

use nonsmooth_problem::{AnyProblem, Complementarity, Problem, Stated, with_complementarity};

use crate::{IoError, ProblemFile};

/// The problem of a file, valid like the points beside it.
fn check<'a>(path: &Path, file: &'a ProblemFile) -> Result<&'a Complementarity, IoError> {
    let AnyProblem::Complementarity(problem) = &file.problem else {
        let found = file.problem.kind().name();
        return Err(IoError::data(path, "the problem", "one of complementarity", found));
    };
    with_complementarity!(problem, p => p.validate()).map_err(IoError::problem(path))?;
    let (names, variables) =
        (file.info.names.len(), with_complementarity!(problem, p => p.variables()));
    if names != 0 && names != variables {
        let expected = format!("none, or one for each of the {variables} variables");
        return Err(IoError::data(path, "names", expected, names));
    }
    if !file.guesses.is_empty() {
        let expected = "none, as the format has no place for them";
        return Err(IoError::data(path, "guesses", expected, file.guesses.len()));
    }
    let Some(stored) = &file.solution else { return Ok(problem) };
    file.problem.validate_point(&stored.point).map_err(IoError::problem(path))?;
    let pairs = with_complementarity!(problem, p => Stated::pairs(p));
    let Some(w) = &stored.partner else { return Ok(problem) };
    let name = format!("solution.{}", with_complementarity!(problem, p => partner(p)));
    if w.len() != pairs {
        let (expected, found) = (format!("{pairs} entries (pairs)"), w.len());
        return Err(IoError::data(path, name, expected, format!("{found} entries")));
    }
    match w.iter().position(|x| !x.is_finite()) {
        Some(k) => Err(IoError::data(path, format!("{name}[{k}]"), "a finite number", w[k])),
        None => Ok(problem),
    }
}

fn partner<P: Stated>(_: &P) -> &'static str {
    P::PARTNER
}

/// A number with as many digits as tell it from all others.
struct Digits(f64);

impl std::fmt::Display for Digits {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        // `{:?}` is the shortest text that reads back as the same bits; of infinities it is `inf`.
        write!(f, "{:?}", self.0)
    }
}
