//! The registry as Python sees it: classes of settings, their help and their stubs are made of this.

use nonsmooth_problem::{OfAny, each_kind};
use nonsmooth_solve::SolveError;
use nonsmooth_solve::registry::{self, About, Prefix, Registered};
use nonsmooth_solve::settings::SettingsMap;
use pyo3::prelude::*;
use pyo3::types::{PyDict, PyList, PyTuple};
use pythonize::{depythonize, pythonize};
use serde_json::{Value, json};

use crate::{DEEPEST, expected, mistake};

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
    let mut settings = SettingsMap::new();
    for (key, value) in given.cast::<PyDict>()? {
        let key: String = key.extract()?;
        let set = setting(&value, DEEPEST);
        let set = set.map_err(|found| expected(&key, "a value of a setting", found))?;
        settings.insert(key, set);
    }
    Ok(settings)
}

/// The value of a setting, or what it is that is none.
fn setting(given: &Bound<'_, PyAny>, left: usize) -> Result<Value, String> {
    let Some(left) = left.checked_sub(1) else { return Err("one that is too deep".into()) };
    if let Ok(list) = given.cast::<PyList>() {
        return list.iter().map(|one| setting(&one, left)).collect();
    }
    if let Ok(tuple) = given.cast::<PyTuple>() {
        return tuple.iter().map(|one| setting(&one, left)).collect();
    }
    if let Ok(all) = given.cast::<PyDict>() {
        let one = |(key, value): (Bound<'_, PyAny>, Bound<'_, PyAny>)| {
            let key: String = key.extract().map_err(|_| format!("the name {key}"))?;
            Ok((key, setting(&value, left)?))
        };
        return all.iter().map(one).collect::<Result<_, _>>().map(Value::Object);
    }
    let value: Value = depythonize(given).map_err(|_| given.to_string())?;
    // Numbers that are none have no other form.
    if value.is_null() && !given.is_none() { Err(given.to_string()) } else { Ok(value) }
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
