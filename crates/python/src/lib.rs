//! The Python package `nonsmooth`: this crate is its module `_nonsmooth`, which `python/nonsmooth` clothes in types and words of Python.
//!
//! Nothing is decided here. Problems are stated by their parts, solved by the registry's names and judged as everywhere; what a kind has is asked of the kind.
//! The module is behind the feature `extension`, which maturin asks for, so that the workspace builds without a Python.
//!
//! Three rules keep the interpreter whole: no lock of Rust is held while Python runs, Python is let go of while Rust computes, and an
//! exception of a function of the user's ends the solve and is raised where it was called.
#![cfg(feature = "extension")]

mod contact;
mod derivative;
mod function;
mod numbers;
mod parts;
mod problem;
mod registry;
mod runs;
mod simulate;
mod solve;
mod wait;

use pyo3::prelude::*;

#[global_allocator]
static ALLOCATOR: nonsmooth_linalg::LargePages = nonsmooth_linalg::LargePages;

pyo3::create_exception!(
    _nonsmooth,
    Error,
    pyo3::exceptions::PyValueError,
    "A mistake of the caller, in one sentence: the place, what was expected there and what was found."
);

/// How deep sets and values of settings may be within each other: one that is a part of itself has no end.
const DEEPEST: usize = 64;

/// A mistake in the words of the library.
fn mistake(error: impl ToString) -> PyErr {
    Error::new_err(error.to_string())
}

/// A mistake in the form that all of them have.
fn expected(place: &str, expected: &str, found: impl std::fmt::Display) -> PyErr {
    mistake(format!("{place}: expected {expected}, found {found}"))
}

/// The compiled part of `nonsmooth`.
#[pymodule]
mod _nonsmooth {
    #[pymodule_export]
    use super::Error;
    #[pymodule_export]
    use crate::derivative::Derivative;
    #[pymodule_export]
    use crate::numbers::reals;
    #[pymodule_export]
    use crate::problem::{Problem, kinds};
    #[pymodule_export]
    use crate::registry::{check, offers};
    #[pymodule_export]
    use crate::runs::Runs;
    #[pymodule_export]
    use crate::simulate::{Run, Simulation, Step, draw, read_scene};
    #[pymodule_export]
    use crate::solve::{Answer, Progress, solve};

    #[pymodule_export]
    const VERSION: &str = env!("CARGO_PKG_VERSION");
}
