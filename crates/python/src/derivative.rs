//! Derivatives of solutions.

use nonsmooth_analysis::derivative::{Change, Derivative as Inner};
use nonsmooth_problem::{AnyPoint, AnyProblem, Complementarity, Friction, Problem as _};
use numpy::PyArray1;
use pyo3::prelude::*;

use crate::problem::{Problem, point};
use crate::{expected, mistake, numbers};

/// The derivative of a solution with respect to the data; `nonsmooth.derivative` has the words.
#[pyclass(frozen, module = "nonsmooth._nonsmooth")]
pub struct Derivative(Inner);

type Array<'py> = Bound<'py, PyArray1<f64>>;

#[pymethods]
impl Derivative {
    /// That of a solution of a problem, as the judge accepts it at a tolerance.
    #[new]
    fn new(
        py: Python<'_>,
        problem: &Bound<'_, Problem>,
        answer: &Bound<'_, PyAny>,
        tolerance: f64,
    ) -> PyResult<Self> {
        let file = problem.get().file();
        let point = point(&file.problem, answer)?;
        file.problem.validate_point(&point).map_err(mistake)?;
        let made = py.detach(|| match (&file.problem, &point) {
            (AnyProblem::Complementarity(Complementarity::Lcp(p)), AnyPoint::Lcp(point)) => {
                Some(Inner::of_lcp(p, point, tolerance))
            }
            (AnyProblem::Friction(Friction::Local2(p)), AnyPoint::Local(point)) => {
                Some(Inner::of_local(p, point, tolerance))
            }
            (AnyProblem::Friction(Friction::Local3(p)), AnyPoint::Local(point)) => {
                Some(Inner::of_local(p, point, tolerance))
            }
            _ => None,
        });
        match made {
            Some(made) => made.map(Self).map_err(mistake),
            None => {
                let what = "a linear complementarity problem or a local one of contacts";
                Err(expected("derivative", what, file.problem.kind().name()))
            }
        }
    }

    /// Pairs or contacts at the border of two pieces.
    #[getter]
    fn degenerate(&self) -> usize {
        self.0.degenerate
    }

    /// x: z or r.
    fn point<'py>(&self, py: Python<'py>) -> Array<'py> {
        PyArray1::from_slice(py, self.0.point())
    }

    /// dx and dy of a change of q, of the matrix, of mu.
    #[pyo3(signature = (vector=None, matrix=None, mu=None))]
    fn forward<'py>(
        &self,
        py: Python<'py>,
        vector: Option<&Bound<'py, PyAny>>,
        matrix: Option<&Bound<'py, PyAny>>,
        mu: Option<&Bound<'py, PyAny>>,
    ) -> PyResult<(Array<'py>, Array<'py>)> {
        let n = self.0.point().len();
        let vector = vector.map(|v| of_length("dq", v, n)).transpose()?;
        let matrix = matrix.map(|m| numbers::matrix("dM", m)).transpose()?;
        if let Some(m) = matrix.as_ref().filter(|m| (m.nrows(), m.ncols()) != (n, n)) {
            let found = format!("{} × {}", m.nrows(), m.ncols());
            return Err(expected("dM", &format!("{n} × {n}"), found));
        }
        let mu = mu.map(|mu| of_length("dmu", mu, self.0.contacts())).transpose()?;
        let change =
            Change { vector: vector.as_deref(), matrix: matrix.as_ref(), mu: mu.as_deref() };
        let (dx, dy) = self.0.forward(&change);
        Ok((PyArray1::from_vec(py, dx), PyArray1::from_vec(py, dy)))
    }

    /// The gradients with respect to q and mu of a function with these gradients with respect to x and y.
    fn backward<'py>(
        &self,
        py: Python<'py>,
        x: &Bound<'py, PyAny>,
        y: &Bound<'py, PyAny>,
    ) -> PyResult<(Array<'py>, Array<'py>)> {
        let n = self.0.point().len();
        let gradient = self.0.backward(&of_length("x", x, n)?, &of_length("y", y, n)?);
        Ok((PyArray1::from_vec(py, gradient.vector), PyArray1::from_vec(py, gradient.mu)))
    }
}

fn of_length(place: &str, given: &Bound<'_, PyAny>, n: usize) -> PyResult<Vec<f64>> {
    let all = numbers::vector(place, given)?;
    match all.len() == n {
        true => Ok(all),
        false => Err(expected(place, &format!("{n} entries"), all.len())),
    }
}
