//! Linear complementarity problems as text: LCP, MLCP, horizontal and box-constrained.
//!
//! [`toml`] is our own format, with solution and texts (docs/formats.md); [`market`] is Matrix Market, `NAME.mtx` with `NAME_q.mtx` beside.

pub mod market;
pub mod toml;

use std::path::Path;

use nonsmooth_problem::{AnyPoint, AnyProblem, Complementarity, Problem, with_complementarity};

use crate::{IoError, ProblemFile};

/// The problem of a file, valid like the points beside it.
fn check<'a>(path: &Path, file: &'a ProblemFile) -> Result<&'a Complementarity, IoError> {
    let AnyProblem::Complementarity(problem) = &file.problem else {
        let found = file.problem.kind().name();
        return Err(IoError::data(path, "the problem", "one of linear complementarity", found));
    };
    with_complementarity!(problem, p => p.validate()).map_err(IoError::problem(path))?;
    let (names, variables) = (file.info.names.len(), variables(problem));
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
    let pairs = match problem {
        Complementarity::Lcp(p) => p.dim(),
        Complementarity::Mlcp(p) => p.pairs(),
        Complementarity::Hlcp(p) => p.dim(),
        Complementarity::Box(p) => p.dim(),
    };
    let Some(w) = &stored.partner else { return Ok(problem) };
    if w.len() != pairs {
        let (expected, found) = (format!("{pairs} entries (pairs)"), w.len());
        return Err(IoError::data(path, "solution.w", expected, format!("{found} entries")));
    }
    match w.iter().position(|x| !x.is_finite()) {
        Some(k) => Err(IoError::data(path, format!("solution.w[{k}]"), "a finite number", w[k])),
        None => Ok(problem),
    }
}

/// How many variables have a name: the pairs of a horizontal problem.
fn variables(problem: &Complementarity) -> usize {
    match problem {
        Complementarity::Lcp(p) => p.dim(),
        Complementarity::Mlcp(p) => p.free + p.pairs(),
        Complementarity::Hlcp(p) => p.dim(),
        Complementarity::Box(p) => p.dim(),
    }
}

/// z of a checked point, x of a horizontal problem's.
fn unknowns(point: &AnyPoint) -> &[f64] {
    match point {
        AnyPoint::Lcp(point) => &point.z,
        AnyPoint::Hlcp(point) => &point.x,
        AnyPoint::Local(_) | AnyPoint::Global(_) => &[],
    }
}

/// A number with as many digits as tell it from all others.
struct Digits(f64);

impl std::fmt::Display for Digits {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        // `{:?}` is the shortest text that reads back as the same bits; of infinities it is `inf`.
        write!(f, "{:?}", self.0)
    }
}
