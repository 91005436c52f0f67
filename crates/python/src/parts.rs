//! The parts of problems: those that a user gives by their letters, and those that a problem shows.

use std::borrow::Cow;

use nonsmooth_linalg::{Bsr, Csc, Dense, Matrix};
use nonsmooth_problem::field::Expressions;
use nonsmooth_problem::{Part, Parts, ProblemError, Set};
use numpy::{PyArray1, PyArrayMethods, ToPyArray};
use pyo3::prelude::*;
use pyo3::types::{PyDict, PyList};

use crate::{DEEPEST, expected, mistake, numbers};

/// What a user gives, by letters. `None` is as if it were not given. Each part is taken once.
pub struct Given<'a, 'py> {
    all: &'a Bound<'py, PyDict>,
    /// What stands in for what is not given: parts of the problem that is changed.
    old: &'a [(&'static str, Part<'a>)],
    taken: Vec<&'static str>,
    /// The first exception, which a [`ProblemError`] stands for.
    fault: Option<PyErr>,
}

impl<'a, 'py> Given<'a, 'py> {
    /// What is in a dictionary.
    pub fn new(all: &'a Bound<'py, PyDict>) -> Self {
        Self { all, old: &[], taken: vec![], fault: None }
    }

    /// What is in a dictionary, else what was there.
    pub fn over(all: &'a Bound<'py, PyDict>, old: &'a [(&'static str, Part<'a>)]) -> Self {
        Self { all, old, taken: vec![], fault: None }
    }

    /// What is given by this name.
    pub fn get(&mut self, name: &'static str) -> PyResult<Option<Bound<'py, PyAny>>> {
        self.taken.push(name);
        Ok(self.all.get_item(name)?.filter(|given| !given.is_none()))
    }

    /// What is given by this name, which must be.
    pub fn need(&mut self, name: &'static str) -> PyResult<Bound<'py, PyAny>> {
        self.get(name)?.ok_or_else(|| missing(name))
    }

    /// A vector, which must be given.
    pub fn need_vector(&mut self, name: &'static str) -> PyResult<Vec<f64>> {
        numbers::vector(name, &self.need(name)?)
    }

    /// A vector, or the same number so many times.
    pub fn vector_or(&mut self, name: &'static str, n: usize, default: f64) -> PyResult<Vec<f64>> {
        match self.get(name)? {
            None => Ok(vec![default; n]),
            Some(given) => Ok(match numbers::scalar_or_vector(name, &given)? {
                numbers::Scalar::One(x) => vec![x; n],
                numbers::Scalar::Each(all) => all,
            }),
        }
    }

    /// Whether a part is given.
    pub fn is_given(&self, name: &str) -> bool {
        matches!(self.all.get_item(name), Ok(Some(given)) if !given.is_none())
    }

    /// The problem that was made of the parts, if all of them were of use.
    pub fn made<P>(
        mut self,
        problem: Result<P, ProblemError>,
        all: &[&'static str],
    ) -> PyResult<P> {
        if let Some(fault) = self.fault.take() {
            return Err(fault);
        }
        let problem = problem.map_err(mistake)?;
        self.finish(all)?;
        Ok(problem)
    }

    /// Refuses what nobody has asked for.
    pub fn finish(&self, all: &[&'static str]) -> PyResult<()> {
        for (name, given) in self.all {
            let name: String = name.extract()?;
            if !given.is_none() && !self.taken.iter().any(|taken| *taken == name) {
                let meant = nonsmooth_solve::spelling::meant(&name, all.iter().copied());
                let what = format!("one of the parts {}{meant}", all.join(", "));
                return Err(expected(
                    &name,
                    &what,
                    "another keyword, or one that does not go with the others",
                ));
            }
        }
        Ok(())
    }

    /// A part by what makes it of what is given; an exception is kept.
    fn part<T>(
        &mut self,
        name: &'static str,
        make: impl FnOnce(&Bound<'py, PyAny>) -> PyResult<T>,
        old: impl FnOnce(&Part<'a>) -> Option<T>,
    ) -> Result<T, ProblemError> {
        let made = match self.get(name) {
            Ok(Some(given)) => make(&given),
            Ok(None) => {
                let there = self.old.iter().find(|(letter, _)| *letter == name);
                there.and_then(|(_, part)| old(part)).ok_or_else(|| missing(name))
            }
            Err(fault) => Err(fault),
        };
        made.map_err(|fault| {
            self.fault.get_or_insert(fault);
            ProblemError::Shape {
                place: name.into(),
                expected: "a part".into(),
                found: "none".into(),
            }
        })
    }
}

/// Puts a vector that is given in the place of another.
pub fn put(given: &mut Given<'_, '_>, name: &'static str, into: &mut Vec<f64>) -> PyResult<()> {
    if let Some(new) = given.get(name)? {
        *into = numbers::vector(name, &new)?;
    }
    Ok(())
}

fn missing(name: &str) -> PyErr {
    expected(name, "this part", "nothing")
}

impl<'a> Parts for Given<'a, '_> {
    fn has(&self, name: &str) -> bool {
        self.is_given(name) || self.old.iter().any(|(letter, _)| *letter == name)
    }

    fn matrix(&mut self, name: &'static str) -> Result<Matrix, ProblemError> {
        let old = |part: &Part<'a>| match part {
            Part::Matrix(matrix) => Some((*matrix).clone()),
            _ => None,
        };
        self.part(name, |given| numbers::matrix(name, given), old)
    }

    fn vector(&mut self, name: &'static str) -> Result<Vec<f64>, ProblemError> {
        let old = |part: &Part<'a>| match part {
            Part::Vector(vector) => Some(vector.to_vec()),
            _ => None,
        };
        self.part(name, |given| numbers::vector(name, given), old)
    }

    fn count(&mut self, name: &'static str) -> Result<usize, ProblemError> {
        let count = |given: &Bound<'_, PyAny>| {
            given.extract().map_err(|_| expected(name, WHOLE, shown_as(given)))
        };
        let old = |part: &Part<'a>| match part {
            Part::Count(count) => Some(*count),
            _ => None,
        };
        self.part(name, count, old)
    }

    fn expressions(&mut self, name: &'static str) -> Result<Expressions, ProblemError> {
        let read = |given: &Bound<'_, PyAny>| {
            let texts: Vec<String> = given.extract().map_err(|_| no_expressions(name, given))?;
            Expressions::parse(&texts, &[]).map_err(mistake)
        };
        let old = |part: &Part<'a>| match part {
            Part::Expressions(expressions) => Some((*expressions).clone()),
            _ => None,
        };
        self.part(name, read, old)
    }

    fn set(&mut self, name: &'static str, _variables: usize) -> Result<Set, ProblemError> {
        let old = |part: &Part<'a>| match part {
            Part::Set(set) => Some((*set).clone()),
            _ => None,
        };
        self.part(name, |given| set(name, given), old)
    }
}

const WHOLE: &str = "a whole number of at least 0";

/// An object as Python shows it, in a line.
fn shown_as(given: &Bound<'_, PyAny>) -> String {
    numbers::first_line(&given.repr().map_or_else(|e| e.to_string(), |r| r.to_string()))
}

/// Why something is no list of expressions: the first entry that is none, if it is a list.
fn no_expressions(name: &str, given: &Bound<'_, PyAny>) -> PyErr {
    let entries = given.cast::<PyList>().ok().into_iter().flatten();
    match entries.enumerate().find(|(_, entry)| entry.extract::<String>().is_err()) {
        Some((k, entry)) => expected(&format!("{name}[{k}]"), "an expression", shown_as(&entry)),
        None => expected(name, "a function, or a list of expressions", type_name(given)),
    }
}

/// The name of an object's type.
pub fn type_name(given: &Bound<'_, PyAny>) -> String {
    given.get_type().name().map_or_else(|_| "an object".into(), |name| name.to_string())
}

/// A set as `_parts()` of the classes of sets states it: a dictionary with its `kind` and its parts.
pub fn set(place: &str, given: &Bound<'_, PyAny>) -> PyResult<Set> {
    set_within(place, given, DEEPEST)
}

fn set_within(place: &str, given: &Bound<'_, PyAny>, left: usize) -> PyResult<Set> {
    let refused = || {
        let what = "a set (Box, Polyhedron, Ball, SecondOrderCone or Product)";
        expected(place, what, type_name(given))
    };
    if !given.hasattr("_parts")? {
        return Err(refused());
    }
    let parts = given.call_method0("_parts")?;
    let parts = parts.cast::<PyDict>().map_err(|_| refused())?;
    let kind: String = parts.get_item("kind")?.ok_or_else(refused)?.extract()?;
    let part = |name: &str| parts.get_item(name)?.ok_or_else(refused);
    let at = |name: &str| format!("{place}.{name}");
    let vector = |name: &str| numbers::vector(&at(name), &part(name)?);
    let matrix = |name: &str| numbers::csc(&at(name), &part(name)?);
    let set = match kind.as_str() {
        "box" => Set::Box { lower: vector("lower")?, upper: vector("upper")? },
        "polyhedron" => {
            let a = matrix("A")?;
            let c = match part("C")? {
                none if none.is_none() => Csc::zeros(0, a.ncols()),
                given => numbers::csc(&at("C"), &given)?,
            };
            Set::Polyhedron { A: a, b: vector("b")?, C: c, d: vector("d")? }
        }
        "ball" => {
            let (centre, radius) = (vector("centre")?, part("radius")?);
            let read = |_| expected(&at("radius"), "a number", shown_as(&radius));
            Set::Ball { centre, radius: radius.extract().map_err(read)? }
        }
        "second_order_cone" => {
            let dimension = part("dimension")?;
            let read = |_| expected(&at("dimension"), WHOLE, shown_as(&dimension));
            Set::SecondOrderCone { dimension: dimension.extract().map_err(read)? }
        }
        "product" => {
            let left = left.checked_sub(1).ok_or_else(|| {
                let what = format!("products at most {DEEPEST} deep");
                expected("set", &what, "a deeper one")
            })?;
            let given = part("sets")?;
            let inner = given
                .try_iter()
                .map_err(|_| expected(&at("sets"), "a list of sets", type_name(&given)))?;
            let each = |(k, one): (usize, PyResult<Bound<'_, PyAny>>)| {
                set_within(&format!("{place}[{k}]"), &one?, left)
            };
            Set::Product(inner.enumerate().map(each).collect::<PyResult<_>>()?)
        }
        _ => return Err(refused()),
    };
    set.validate().map_err(|e| mistake(e.within(place)))?;
    Ok(set)
}

/// A part of a problem as Python sees it: arrays, of sparse matrices those of compressed columns.
pub enum Shown<'a> {
    Dense(&'a Dense),
    Sparse(Cow<'a, Csc>),
    Vector(&'a [f64]),
    Count(usize),
    Texts(Vec<String>),
}

impl<'a> Shown<'a> {
    /// The part, where it has numbers or texts to show.
    pub fn of(part: Part<'a>) -> Option<Self> {
        Some(match part {
            Part::Matrix(Matrix::Dense(dense)) => Self::Dense(dense),
            Part::Matrix(Matrix::Sparse(csc)) => Self::Sparse(Cow::Borrowed(csc)),
            Part::Vector(vector) => Self::Vector(vector),
            Part::Count(count) => Self::Count(count),
            Part::Expressions(f) => Self::Texts(f.texts(&[]).ok()?),
            Part::Matrix(Matrix::Operator(_)) | Part::Set(_) => return None,
        })
    }

    /// A matrix by blocks.
    pub fn blocks<const D: usize>(blocks: &Bsr<D>) -> Self {
        Self::Sparse(Cow::Owned(blocks.to_csc()))
    }

    /// An array; what is made for this is moved. Of a sparse matrix a dictionary of the arguments of `scipy.sparse.csc_array`.
    pub fn into_python<'py>(self, py: Python<'py>) -> PyResult<Bound<'py, PyAny>> {
        Ok(match self {
            Self::Dense(dense) => {
                let all = dense.values().to_pyarray(py);
                all.reshape([dense.nrows(), dense.ncols()])?.into_any()
            }
            Self::Vector(vector) => PyArray1::from_slice(py, vector).into_any(),
            Self::Count(count) => count.into_pyobject(py)?.into_any(),
            Self::Texts(texts) => PyList::new(py, texts)?.into_any(),
            Self::Sparse(csc) => {
                let parts = PyDict::new(py);
                parts.set_item("shape", (csc.nrows(), csc.ncols()))?;
                // Collected in the memory that they are in.
                let whole = |all: Vec<usize>| {
                    PyArray1::from_vec(py, all.into_iter().map(|i| i as i64).collect())
                };
                let (pointers, rows, values) = csc.into_owned().into_vecs();
                parts.set_item("data", PyArray1::from_vec(py, values))?;
                parts.set_item("indices", whole(rows))?;
                parts.set_item("indptr", whole(pointers))?;
                parts.into_any()
            }
        })
    }
}
