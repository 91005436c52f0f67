//! Solving: who waits, who computes, who is asked meanwhile, and what comes out.
//!
//! A small problem is solved on the thread that asks, a large one on another (each step of it may take long), while the thread that asks waits. Either way
//! Python is let go of, and the thread that asks looks every [`TICK`] whether Ctrl-C was pressed, and runs the user's callback, so that what Python has
//! by threads (warnings, plots, a debugger) is what the user expects.

use std::sync::Arc;
use std::time::Instant;

use nonsmooth_io::table::{Column, Table};
use nonsmooth_io::{ProblemFile, StoredPoint};
use nonsmooth_problem::{AnyProblem, Problem as _};
use nonsmooth_solve::{Kept, Limit, Limits, Solve, SolveError, Status, guard};
use numpy::{PyArray1, PyArray2, PyArrayMethods};
use pyo3::exceptions::PyKeyboardInterrupt;
use pyo3::prelude::*;
use pyo3::types::{PyDict, PyList};
use pyo3::{PyTraverseError, PyVisit};
use pythonize::pythonize;

use crate::function::{Functions, Watcher};
use crate::problem::{Problem, point};
use crate::wait::{TICK, ask, elsewhere};
use crate::{mistake, registry};

type Solved = Result<nonsmooth_solve::Answer<AnyProblem>, SolveError>;

/// How far a solve is.
#[pyclass(frozen, get_all, module = "nonsmooth._nonsmooth")]
pub struct Progress {
    /// Steps done so far.
    iteration: usize,
    /// Seconds since the start.
    seconds: f64,
    /// The relative residual at the last visit of the judge.
    residual: f64,
    /// The smallest residual so far.
    best: f64,
}

#[pymethods]
impl Progress {
    fn __repr__(&self) -> String {
        let Self { iteration, seconds, residual, .. } = self;
        format!("Progress(iteration={iteration}, residual={residual:e}, seconds={seconds:.3})")
    }
}

/// What the callback says of how far a solve is; true ends it.
fn called(
    py: Python<'_>,
    callback: Option<&Py<PyAny>>,
    news: Option<&nonsmooth_solve::Progress>,
) -> PyResult<bool> {
    let (Some(callback), Some(news)) = (callback, news) else { return Ok(false) };
    let progress = Progress {
        iteration: news.iteration,
        seconds: news.seconds,
        residual: news.judged.relative,
        best: news.best,
    };
    callback.bind(py).call1((progress,))?.is_truthy()
}

/// On the thread that asks, with Python let go of.
fn here(
    how: &Solve,
    problem: &AnyProblem,
    kept: &mut Kept,
    watcher: &Arc<Watcher>,
    callback: Option<&Py<PyAny>>,
) -> Solved {
    let mut looked = Instant::now();
    watcher.at_work(|| {
        how.again(problem, kept, &mut |progress| {
            if callback.is_some() || looked.elapsed() >= TICK {
                ask(watcher, |py| called(py, callback, Some(progress)));
                looked = Instant::now();
            }
        })
    })
}

/// On another thread, while the one that asks waits, with Python let go of.
fn there(
    how: Solve,
    file: Arc<ProblemFile>,
    mut kept: Kept,
    watcher: &Watcher,
    callback: Option<&Py<PyAny>>,
) -> (Solved, Kept) {
    let told = callback.is_some();
    let hear = |news: Option<nonsmooth_solve::Progress>| {
        ask(watcher, |py| called(py, callback, news.as_ref()));
    };
    elsewhere(hear, move |say| {
        let solved = how.again(&file.problem, &mut kept, &mut |progress| {
            if told {
                say(*progress);
            }
        });
        (solved, kept)
    })
}

/// Solves a problem. The arguments are those of `nonsmooth.solve`, which has the words.
#[pyfunction]
#[pyo3(signature = (problem, solver, settings, tol, time_limit, max_iter, threads, warm_start, callback))]
#[allow(clippy::too_many_arguments)]
pub fn solve(
    py: Python<'_>,
    problem: &Bound<'_, Problem>,
    solver: &str,
    settings: Option<&Bound<'_, PyAny>>,
    tol: f64,
    time_limit: Option<f64>,
    max_iter: Option<usize>,
    threads: usize,
    warm_start: Option<&Bound<'_, PyAny>>,
    callback: Option<Py<PyAny>>,
) -> PyResult<Answer> {
    let problem = problem.get();
    let file = problem.file();
    let small = file.problem.unknowns() <= guard::SMALL;
    let watcher = Arc::new(Watcher::of(py, file.problem.unknowns())?);
    // As the command line has it: a limit on time is the only one where there is one.
    let most = if time_limit.is_some() { usize::MAX } else { Limits::default().max_iterations };
    let limits = Limits {
        tolerance: tol,
        time_limit,
        max_iterations: max_iter.unwrap_or(most),
        threads,
        cancel: Some(watcher.stop.clone()),
        ..Limits::default()
    };
    let mut how = Solve::new().solver(solver).limits(limits);
    if let Some(given) = settings {
        how = how.settings(registry::settings(given)?);
    }
    if let Some(start) = warm_start {
        how = how.warm(&point(&file.problem, "warm_start", start)?);
    }
    let mut kept = problem.take_kept();
    let watching = problem.faults.watch(&watcher);
    let (solved, kept) = py.detach(|| match small {
        true => {
            let solved = here(&how, &file.problem, &mut kept, &watcher, callback.as_ref());
            (solved, kept)
        }
        false => there(how, file.clone(), kept, &watcher, callback.as_ref()),
    });
    drop(watching);
    problem.put_kept(kept);
    let functions = problem.functions(py);
    let made = |answer| Answer { answer, file, functions, tolerance: tol };
    if let Some(fault) = watcher.fault() {
        // What Ctrl-C ended is not lost.
        if let (true, Ok(answer)) = (fault.is_instance_of::<PyKeyboardInterrupt>(py), solved) {
            fault.value(py).setattr("answer", Bound::new(py, made(answer))?)?;
        }
        return Err(fault);
    }
    let mut answer = solved.map_err(mistake)?;
    if !answer.is_solved() {
        answer.account.extend(watcher.undefined());
    }
    // A signal that came in the last moment.
    if answer.status == Status::Limit(Limit::Cancelled) {
        py.check_signals()?;
    }
    Ok(made(answer))
}

/// What came of a solve; `nonsmooth.Answer` has the words.
#[pyclass(frozen, module = "nonsmooth._nonsmooth")]
pub struct Answer {
    /// What came of it.
    pub answer: nonsmooth_solve::Answer<AnyProblem>,
    /// The problem that it was.
    pub file: Arc<ProblemFile>,
    /// Its functions of Python, for the garbage collector.
    functions: Option<Py<Functions>>,
    /// What the judge was asked for.
    tolerance: f64,
}

/// Arrays by their names.
pub fn arrays<'py>(
    py: Python<'py>,
    parts: Vec<(&'static str, &[f64])>,
) -> PyResult<Bound<'py, PyDict>> {
    let all = PyDict::new(py);
    for (name, x) in parts {
        all.set_item(name, PyArray1::from_slice(py, x))?;
    }
    Ok(all)
}

#[pymethods]
impl Answer {
    fn __traverse__(&self, visit: PyVisit<'_>) -> Result<(), PyTraverseError> {
        visit.call(&self.functions)
    }

    /// The status by its short name.
    #[getter]
    fn status(&self) -> &'static str {
        self.answer.status.name()
    }

    /// The status in a sentence.
    #[getter]
    fn message(&self) -> String {
        self.answer.status.to_string()
    }

    /// Whether the judge accepts the point.
    #[getter]
    fn solved(&self) -> bool {
        self.answer.is_solved()
    }

    /// Steps done.
    #[getter]
    fn iterations(&self) -> usize {
        self.answer.iterations
    }

    /// Matrices factorised.
    #[getter]
    fn factorisations(&self) -> u64 {
        self.answer.factorisations
    }

    /// Wall clock of the solve.
    #[getter]
    fn seconds(&self) -> f64 {
        self.answer.seconds
    }

    /// The relative residual.
    #[getter]
    fn residual(&self) -> f64 {
        self.answer.verdict.measure.relative
    }

    /// What else than the relative residual is beyond its limit, with its value. Of a relative residual that is, primal and dual are only parts.
    #[getter]
    fn failing(&self) -> Vec<(&'static str, f64)> {
        let (_, others) = self.answer.verdict.measure.failing_beside(self.tolerance);
        others.into_iter().map(|f| (f.what, f.value)).collect()
    }

    /// The kind of the problem.
    #[getter]
    fn kind(&self) -> &'static str {
        self.file.problem.kind().name()
    }

    /// What the solver says that it did.
    #[getter]
    fn account(&self) -> Vec<String> {
        self.answer.account.clone()
    }

    /// The parts of the point by name.
    fn parts<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyDict>> {
        let nonsmooth_solve::Answer { point, verdict, .. } = &self.answer;
        let (problem, whole) = (&self.file.problem, &verdict.velocity);
        // Equalities have no w.
        let kept = match problem {
            AnyProblem::Friction(_) => None,
            _ => StoredPoint::new(problem, point.clone(), whole.clone()).partner,
        };
        arrays(py, problem.point_parts(point, kept.as_deref().unwrap_or(whole)))
    }

    /// All residuals by name.
    fn residuals<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyAny>> {
        Ok(pythonize(py, &self.answer.verdict.measure)?)
    }

    /// How many contacts or rows do what.
    fn counts<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyAny>> {
        Ok(pythonize(py, &self.answer.verdict.counts)?)
    }

    /// Contacts or rows with the largest residuals.
    fn worst(&self) -> Vec<(usize, f64)> {
        self.answer.verdict.worst.clone()
    }

    /// The visits of the judge: iteration, seconds, residual.
    fn history<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyArray2<f64>>> {
        let rows = self.answer.history.iter();
        let all = rows.flat_map(|s| [s.iteration as f64, s.seconds, s.relative]);
        PyArray1::from_iter(py, all).reshape([self.answer.history.len(), 3])
    }

    /// What a status rests on that says that there is no solution.
    fn certificate<'py>(&self, py: Python<'py>) -> PyResult<Option<Bound<'py, PyAny>>> {
        if let Status::Infeasible(proof) = &self.answer.status {
            // With the fractions that were verified.
            return Ok(Some(pythonize(py, proof)?));
        }
        let certificate = self.answer.certificate();
        certificate.map(|all| Ok(pythonize(py, all)?)).transpose()
    }

    /// The columns of the table of the solution: names with arrays or lists.
    fn table<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyDict>> {
        let nonsmooth_solve::Answer { point, verdict, .. } = &self.answer;
        let problem = &self.file.problem;
        let stored = StoredPoint::new(problem, point.clone(), verdict.velocity.clone());
        let stored = StoredPoint { statuses: verdict.statuses.clone(), ..stored };
        let table = Table::new(problem, &stored, &self.file.info.names).map_err(mistake)?;
        let columns = PyDict::new(py);
        for (name, column) in &table.columns {
            match column {
                Column::Text(words) => columns.set_item(name, PyList::new(py, words)?)?,
                Column::Numbers(all) => {
                    let all = all.iter().map(|x| x.unwrap_or(f64::NAN));
                    columns.set_item(name, PyArray1::from_iter(py, all))?;
                }
            }
        }
        if let AnyProblem::Friction(friction) = problem {
            columns.set_item("mu", PyArray1::from_slice(py, friction.mu()))?;
        }
        Ok(columns)
    }
}
