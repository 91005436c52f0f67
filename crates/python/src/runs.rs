//! Runs of solvers on problems: the lines of their files, and profiles.

use std::path::{Path, PathBuf};

use nonsmooth_bench::profile::{self, Cost, Costs, Selection};
use nonsmooth_bench::runs::Runs as Inner;
use pyo3::prelude::*;
use pythonize::pythonize;

use crate::{expected, mistake};

/// What a file of runs holds; `nonsmooth.Runs` has the words.
#[pyclass(frozen, module = "nonsmooth._nonsmooth")]
pub struct Runs(Inner);

/// A step function: a solver, its steps, and the number of problems that it takes.
type Curve = (String, Vec<(f64, f64)>);

#[pymethods]
impl Runs {
    /// Of the lines of a file.
    #[staticmethod]
    fn parse(text: &str) -> PyResult<Self> {
        Inner::parse(Path::new("runs"), text).map(Self).map_err(mistake)
    }

    /// Of a file.
    #[staticmethod]
    fn read(py: Python<'_>, path: PathBuf) -> PyResult<Self> {
        py.detach(|| Inner::read(&path)).map(Self).map_err(mistake)
    }

    /// The lines of a file.
    fn text(&self) -> String {
        self.0.clone().text()
    }

    /// The runs, a dictionary each.
    fn runs<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyAny>> {
        Ok(pythonize(py, &self.0.runs)?)
    }

    /// The kinds of problem, each with the number of its runs.
    fn kinds(&self) -> Vec<(String, usize)> {
        self.0.kinds().into_iter().map(|(kind, n)| (kind.to_owned(), n)).collect()
    }

    /// The tolerance that all solvers were run at on the problems of a kind, else that of most runs; none without runs.
    fn tolerance(&self, kind: &str) -> Option<f64> {
        Selection::at(kind, f64::NAN).common_tolerance(&self.0)
    }

    /// Performance profiles on the problems of a kind at a tolerance.
    fn profile(&self, kind: &str, tolerance: f64, cost: &str) -> PyResult<Vec<Curve>> {
        let Some(cost) = Cost::ALL.into_iter().find(|c| c.name() == cost) else {
            let known = Cost::ALL.map(Cost::name).join(", ");
            return Err(expected("cost", &format!("one of {known}"), cost));
        };
        let there = self.0.tolerances_of(kind);
        if !there.contains(&tolerance) {
            let there: Vec<_> = there.iter().rev().map(|t| format!("{t:e}")).collect();
            let what = format!("a tolerance of the runs ({})", there.join(", "));
            return Err(expected("tol", &what, format!("{tolerance:e}")));
        }
        // A solver that does not count this cost would seem to fail.
        let (costs, _) = Costs::of(&self.0, &Selection::at(kind, tolerance), cost).counted();
        let curves = profile::performance(&costs);
        Ok(curves.into_iter().map(|curve| (curve.solver, curve.steps)).collect())
    }
}
