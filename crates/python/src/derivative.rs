//! Derivatives of solutions.

use nonsmooth_analysis::derivative::{Change, Derivative as Inner};
use nonsmooth_linalg::Matrix;
use nonsmooth_problem::Problem as _;
use nonsmooth_solve::{Limits, derivative_within};
use numpy::PyArray1;
use pyo3::prelude::*;
use pyo3::types::PyDict;
use std::sync::Arc;
use std::time::Instant;

use crate::function::Watcher;
use crate::problem::{Problem, point};
use crate::wait::{TICK, ask};
use crate::{expected, mistake, numbers};

/// The derivative of a solution with respect to the data; `nonsmooth.derivative` has the words.
#[pyclass(frozen, module = "nonsmooth._nonsmooth")]
pub struct Derivative(Inner);

type Array<'py> = Bound<'py, PyArray1<f64>>;

/// A change of a part, as it is given.
enum Given {
    Vector(Vec<f64>),
    Matrix(Matrix),
}

#[pymethods]
impl Derivative {
    /// That of a solution of a problem, as the judge accepts it at a tolerance.
    #[new]
    fn new(
        py: Python<'_>,
        problem: &Bound<'_, Problem>,
        answer: &Bound<'_, PyAny>,
        tolerance: f64,
        time_limit: Option<f64>,
    ) -> PyResult<Self> {
        if !(tolerance > 0.0 && tolerance <= 1.0) {
            return Err(expected("tol", "a number in (0, 1]", tolerance));
        }
        if let Some(t) = time_limit.filter(|t| t.is_nan() || *t < 0.0) {
            return Err(expected("time_limit", "a number of seconds of at least 0", t));
        }
        let problem = problem.get();
        let file = problem.file();
        let point = point(&file.problem, "answer", answer)?;
        file.problem.validate_point(&point).map_err(mistake)?;
        // F may be a function of Python, and a factorisation may take long.
        let watcher = Arc::new(Watcher::of(py, file.problem.unknowns())?);
        let cancel = Some(watcher.stop.clone());
        let limits = Limits { tolerance, time_limit, cancel, ..Limits::default() };
        let made = problem.watched(py, &watcher, || {
            let mut asked = Instant::now();
            let tick = || {
                if asked.elapsed() >= TICK {
                    asked = Instant::now();
                    ask(&watcher, |_| Ok(false));
                }
            };
            derivative_within(&file.problem, &point, &limits, tick)
        })?;
        made.map(Self).map_err(mistake)
    }

    /// Pairs or contacts at the border of two pieces.
    #[getter]
    fn degenerate(&self) -> usize {
        self.0.degenerate
    }

    /// The parts of the solution with their lengths.
    #[getter]
    fn solution(&self) -> Vec<(&'static str, usize)> {
        self.0.solution().collect()
    }

    /// The letters of the data with their shapes.
    #[getter]
    fn data(&self) -> Vec<(&'static str, Vec<usize>)> {
        let vectors = self.0.vectors().map(|(letter, n)| (letter, vec![n]));
        vectors.chain(self.0.matrices().map(|(letter, shape)| (letter, shape.to_vec()))).collect()
    }

    /// How the parts of the solution change with one part of the data.
    fn forward<'py>(
        &self,
        py: Python<'py>,
        letter: &str,
        direction: &Bound<'py, PyAny>,
    ) -> PyResult<Bound<'py, PyDict>> {
        let place = format!("d{letter}");
        let given = match self.0.matrices().any(|m| m.0 == letter) {
            true => Given::Matrix(numbers::matrix(&place, direction)?),
            false => Given::Vector(numbers::by_contact(&place, direction)?.0),
        };
        let change = match &given {
            Given::Vector(d) => Change::Vector(d),
            Given::Matrix(d) => Change::Matrix(d),
        };
        let moved = py.detach(|| self.0.forward(&[(letter, change)])).map_err(mistake)?;
        let all = PyDict::new(py);
        for (name, change) in moved.parts {
            all.set_item(name, PyArray1::from_vec(py, change))?;
        }
        Ok(all)
    }

    /// The gradients with respect to the vectors, and the pairs (a, b) of `Σ a bᵀ` with respect to the matrices, of a function whose gradients with respect to parts of
    /// the solution are given.
    fn backward<'py>(
        &self,
        py: Python<'py>,
        gradients: &Bound<'py, PyDict>,
    ) -> PyResult<(Bound<'py, PyDict>, Bound<'py, PyDict>)> {
        let mut given: Vec<(String, Vec<f64>)> = vec![];
        for (name, gradient) in gradients {
            let name: String = name.extract()?;
            let gradient = numbers::by_contact(&name, &gradient)?.0;
            given.push((name, gradient));
        }
        let given: Vec<_> = given.iter().map(|(name, g)| (&name[..], &g[..])).collect();
        let gradient = py.detach(|| self.0.backward(&given)).map_err(mistake)?;
        let (vectors, matrices) = (PyDict::new(py), PyDict::new(py));
        for (letter, gradient) in gradient.vectors {
            vectors.set_item(letter, PyArray1::from_vec(py, gradient))?;
        }
        for (letter, pairs) in gradient.matrices {
            let pairs: Vec<(Array<'py>, Array<'py>)> = pairs
                .into_iter()
                .map(|[a, b]| (PyArray1::from_vec(py, a), PyArray1::from_vec(py, b)))
                .collect();
            matrices.set_item(letter, pairs)?;
        }
        Ok((vectors, matrices))
    }
}
