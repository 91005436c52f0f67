//! F and its Jacobian by functions of Python.
//!
//! The library calls them from the thread that solves, which holds Python's lock meanwhile, in the context (`contextvars`) in which the solve was asked for. An exception ends
//! that solve, in which nothing is called any more, and is raised where it was called; but where F is only asked whether it is defined ([`is_tentative`]) it is the answer that it is
//! not. Cost of a call: that of the function, and two copies of n numbers.

use std::cell::RefCell;
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};

use nonsmooth_linalg::{Csc, Matrix};
use nonsmooth_problem::field::{Closures, Differences, Field, Pattern, is_tentative};
use numpy::PyArray1;
use pyo3::exceptions::PyException;
use pyo3::prelude::*;

use crate::{expected, mistake, numbers};

/// Who is told of an exception: the solves that are under way.
#[derive(Default)]
pub struct Faults(Mutex<Vec<Arc<Watcher>>>);

/// A solve that may have to end because a function failed.
#[derive(Default)]
pub struct Watcher {
    /// Set where it has to.
    pub stop: Arc<AtomicBool>,
    fault: Mutex<Option<PyErr>>,
    /// Whether it was a function of the user's that failed: then none is called any more.
    failed: AtomicBool,
    /// In which the functions run on another thread.
    context: Option<Py<PyAny>>,
}

thread_local! {
    /// The solve that this thread is at work for.
    static SOLVE: RefCell<Option<Arc<Watcher>>> = const { RefCell::new(None) };
}

/// What a thread that panicked left is whole all the same: it is written in one go.
fn locked<T>(mutex: &Mutex<T>) -> MutexGuard<'_, T> {
    mutex.lock().unwrap_or_else(PoisonError::into_inner)
}

impl Watcher {
    /// Of a solve on another thread, for the present context.
    pub fn elsewhere(py: Python<'_>) -> PyResult<Self> {
        let context = py.import("contextvars")?.call_method0("copy_context")?.unbind();
        Ok(Self { context: Some(context), ..Self::default() })
    }

    /// Does a task of this solve: what its functions raise is told to it alone.
    pub fn at_work<T>(self: &Arc<Self>, task: impl FnOnce() -> T) -> T {
        /// A solve within a function of another solve is done.
        struct Before(Option<Arc<Watcher>>);
        impl Drop for Before {
            fn drop(&mut self) {
                SOLVE.with_borrow_mut(|now| *now = self.0.take());
            }
        }
        let _before = Before(SOLVE.with_borrow_mut(|now| now.replace(self.clone())));
        task()
    }

    /// Ends the solve with an exception; the first one counts.
    pub fn fail(&self, fault: PyErr) {
        locked(&self.fault).get_or_insert(fault);
        self.stop.store(true, Ordering::Relaxed);
    }

    /// The exception that ended the solve.
    pub fn fault(&self) -> Option<PyErr> {
        locked(&self.fault).take()
    }
}

/// A watcher that is told as long as this lives.
pub struct Watching<'a>(&'a Faults, Arc<Watcher>);

impl Drop for Watching<'_> {
    fn drop(&mut self) {
        locked(&self.0.0).retain(|watcher| !Arc::ptr_eq(watcher, &self.1));
    }
}

impl Faults {
    /// Tells this solve too, for as long as what is returned lives.
    pub fn watch(&self, watcher: &Arc<Watcher>) -> Watching<'_> {
        locked(&self.0).push(watcher.clone());
        Watching(self, watcher.clone())
    }

    /// The solve that asks now; all where that is not known, as on threads of the library's own.
    fn asking(&self) -> Vec<Arc<Watcher>> {
        let mine = SOLVE.with_borrow(Clone::clone);
        let all = locked(&self.0);
        match mine.filter(|mine| all.iter().any(|one| Arc::ptr_eq(one, mine))) {
            Some(mine) => vec![mine],
            None => all.clone(),
        }
    }
}

/// A function of Python: what it gives goes into a slice, which is NaN where it raises.
struct Call {
    function: Py<PyAny>,
    faults: Arc<Faults>,
}

impl Call {
    fn new(function: &Bound<'_, PyAny>, faults: &Arc<Faults>) -> Self {
        Self { function: function.clone().unbind(), faults: faults.clone() }
    }

    fn write(
        &self,
        x: &[f64],
        out: &mut [f64],
        read: impl Fn(&Bound<'_, PyAny>, &mut [f64]) -> PyResult<()>,
    ) {
        let asking = self.faults.asking();
        if !asking.is_empty() && asking.iter().all(|one| one.failed.load(Ordering::Relaxed)) {
            return out.fill(f64::NAN);
        }
        let context = match &asking[..] {
            [one] => one.context.as_ref(),
            _ => None,
        };
        // Without an interpreter, which is being shut down, nothing is defined.
        let done = Python::try_attach(|py| {
            let (function, x) = (self.function.bind(py), PyArray1::from_slice(py, x));
            let found = match context {
                // A copy, since a context is entered by one thread at a time.
                Some(context) => {
                    let copy = context.bind(py).call_method0("copy");
                    copy.and_then(|copy| copy.call_method1("run", (function, x)))
                }
                None => function.call1((x,)),
            };
            let done = found.and_then(|found| read(&found, out));
            done.map_err(|fault| {
                // Ctrl-C is no exception of the function's.
                if !(is_tentative() && fault.is_instance_of::<PyException>(py)) {
                    for one in &asking {
                        one.failed.store(true, Ordering::Relaxed);
                        one.fail(fault.clone_ref(py));
                    }
                }
            })
            .is_ok()
        });
        if done != Some(true) {
            out.fill(f64::NAN);
        }
    }
}

/// n values.
fn values(found: &Bound<'_, PyAny>, out: &mut [f64]) -> PyResult<()> {
    let all = numbers::vector("F(x)", found)?;
    if all.len() != out.len() {
        return Err(expected("F(x)", &format!("{} values", out.len()), all.len()));
    }
    out.copy_from_slice(&all);
    Ok(())
}

/// A matrix with a row and a column for each of n variables.
fn square(place: &str, found: &Bound<'_, PyAny>, n: usize) -> PyResult<Matrix> {
    let matrix = numbers::matrix(place, found)?;
    if (matrix.nrows(), matrix.ncols()) == (n, n) {
        return Ok(matrix);
    }
    let found = format!("{} × {}", matrix.nrows(), matrix.ncols());
    Err(expected(place, &format!("{n} × {n} (entries of x)"), found))
}

const JACOBIAN: &str = "jac(x)";

/// The entries of a Jacobian at the places of a pattern; all others are zero.
fn entries(found: &Bound<'_, PyAny>, pattern: &Pattern, out: &mut [f64]) -> PyResult<()> {
    let matrix = square(JACOBIAN, found, pattern.rows())?;
    out.fill(0.0);
    let mut outside = None;
    matrix.for_each(|i, j, x| match pattern.row(i).binary_search(&j) {
        Ok(k) => out[pattern.range(i).start + k] += x,
        Err(_) if x == 0.0 => {}
        Err(_) => {
            outside.get_or_insert((i, j, x));
        }
    });
    match outside {
        Some((i, j, x)) => {
            Err(expected(&format!("{JACOBIAN}[{i}, {j}]"), "zero, as the pattern says", x))
        }
        None => Ok(()),
    }
}

/// The places of a matrix's entries that are stored, or not zero.
fn places(matrix: &Matrix) -> PyResult<Pattern> {
    let csc: Csc = matrix.to_csc().ok_or_else(|| expected("pattern", "a matrix", "products"))?;
    // By columns of the transpose: by rows.
    let rows = csc.transpose();
    let pattern = Pattern::new((0..rows.ncols()).map(|i| rows.column(i).0.iter().copied()));
    pattern.validate().map_err(mistake)?;
    Ok(pattern)
}

/// F by a function, with a Jacobian by another or by differences; x is where a pattern that nobody says is looked for.
pub fn field(
    function: &Bound<'_, PyAny>,
    jacobian: Option<&Bound<'_, PyAny>>,
    pattern: Option<&Bound<'_, PyAny>>,
    x: &[f64],
    faults: &Arc<Faults>,
) -> PyResult<Arc<dyn Field>> {
    let watcher = Arc::new(Watcher::default());
    let _watching = faults.watch(&watcher);
    let call = Call::new(function, faults);
    // A function that is of no use at the start says so before a solver meets it.
    call.write(x, &mut vec![0.0; x.len()], values);
    if let Some(fault) = watcher.fault() {
        return Err(fault);
    }
    let value = move |x: &[f64], f: &mut [f64]| call.write(x, f, values);
    let pattern = match (pattern, jacobian) {
        (Some(given), _) => Some(places(&square("pattern", given, x.len())?)?),
        (None, Some(jacobian)) => {
            let there = jacobian.call1((PyArray1::from_slice(jacobian.py(), x),))?;
            let matrix = square(JACOBIAN, &there, x.len())?;
            Some(match numbers::Sparse::of(JACOBIAN, &there)? {
                Some(_) => places(&matrix)?,
                None => Pattern::dense(x.len()),
            })
        }
        (None, None) => None,
    };
    let field: Arc<dyn Field> = match (jacobian, pattern) {
        (Some(jacobian), Some(pattern)) => {
            let jac = Call::new(jacobian, faults);
            let along = pattern.clone();
            let jac = move |x: &[f64], j: &mut [f64]| {
                jac.write(x, j, |found, out| entries(found, &along, out));
            };
            // One that is of no use at the start says so at once, too.
            jac(x, &mut vec![0.0; pattern.len()]);
            Arc::new(Closures::new(pattern, value, jac).map_err(mistake)?)
        }
        (None, Some(pattern)) => Arc::new(Differences::new(pattern, value).map_err(mistake)?),
        (_, None) => Arc::new(Differences::probed(x, value).map_err(mistake)?),
    };
    match watcher.fault() {
        Some(fault) => Err(fault),
        None => Ok(field),
    }
}
