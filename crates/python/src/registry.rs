//! The registry as Python sees it: classes of settings, their help and their stubs are made of this.

use nonsmooth_problem::{OfAny, each_kind};
use nonsmooth_solve::SolveError;
use nonsmooth_solve::registry::{self, About, Prefix, Registered};
use nonsmooth_solve::settings::SettingsMap;
use pyo3::prelude::*;
use pythonize::{depythonize, pythonize};
use serde_json::{Value, json};

use crate::mistake;

fn offer<P: Registered + OfAny>() -> Value {
    let abouts: Vec<&About> = registry::abouts::<P>();
    let prefixes: Vec<&Prefix> = registry::prefixes::<P>();
    json!({
        "kind": P::KIND.name(),
        "solvers": abouts,
        "prefixes": prefixes,
        "names": registry::solver_names::<P>(),
    })
}

/// For each kind of problem the solvers, what may stand before their names, and all names that are listed.
#[pyfunction]
pub fn offers(py: Python<'_>) -> PyResult<Bound<'_, PyAny>> {
    let all = each_kind!(P => offer::<P>());
    Ok(pythonize(py, &all)?)
}

/// Settings from a dictionary.
pub fn settings(given: &Bound<'_, PyAny>) -> PyResult<SettingsMap> {
    depythonize(given)
        .map_err(|e| mistake(format!("settings: expected names with values, found: {e}")))
}

/// Refuses settings that no kind of problem has for the solver of this name, or that are out of range.
#[pyfunction]
pub fn check(solver: &str, given: &Bound<'_, PyAny>) -> PyResult<()> {
    fn tried<P: Registered>(solver: &str, settings: &SettingsMap) -> Result<(), SolveError> {
        registry::session::<P>(solver, settings).map(drop)
    }
    let settings = settings(given)?;
    let all = each_kind!(P => tried::<P>(solver, &settings));
    if all.iter().any(Result::is_ok) {
        return Ok(());
    }
    let errors: Vec<_> = all.into_iter().filter_map(Result::err).collect();
    // What is nearest to the cause: a setting, a name that is like one, any unknown name.
    let nearness = |e: &&SolveError| match e {
        SolveError::UnknownSolver { meant, .. } if meant.is_empty() => 2,
        SolveError::UnknownSolver { .. } => 1,
        _ => 0,
    };
    errors.iter().min_by_key(nearness).map_or(Ok(()), |e| Err(mistake(e)))
}
