//! F and its Jacobian by functions of Python.
//!
//! The library calls them from the thread that solves, which holds Python's lock meanwhile, in the context (`contextvars`) in which the solve was asked for. An exception ends
//! that solve, in which nothing is called any more, and is raised where it was called; but where F is only asked whether it is defined ([`is_tentative`]) it is the answer that it is
//! not, unless it says nothing of x ([`Fault`]). Cost of a call: that of the function, and two copies of n numbers.

use std::cell::RefCell;
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};

use nonsmooth_linalg::{Csc, Matrix};
use nonsmooth_problem::field::{Closures, Differences, Field, Pattern, is_tentative};
use nonsmooth_solve::guard;
use numpy::PyArray1;
use pyo3::exceptions::{PyException, PyMemoryError, PyNameError, PyRecursionError};
use pyo3::prelude::*;
use pyo3::{PyTraverseError, PyVisit};

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
    undefined: Mutex<Undefined>,
    /// In which the functions run on another thread.
    context: Option<Py<PyAny>>,
}

/// Exceptions that were taken for a point where F is not defined.
#[derive(Default)]
struct Undefined {
    count: usize,
    first: String,
}

thread_local! {
    /// The solve that this thread is at work for.
    static SOLVE: RefCell<Option<Arc<Watcher>>> = const { RefCell::new(None) };
}

/// What a thread that panicked left is whole all the same: it is written in one go.
pub fn locked<T>(mutex: &Mutex<T>) -> MutexGuard<'_, T> {
    mutex.lock().unwrap_or_else(PoisonError::into_inner)
}

impl Watcher {
    /// Of a problem of so many unknowns: a large one is solved on another thread, for which the present context is kept.
    pub fn of(py: Python<'_>, unknowns: usize) -> PyResult<Self> {
        if unknowns <= guard::SMALL {
            return Ok(Self::default());
        }
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

    /// Keeps in mind that F is not defined somewhere, by what it raised.
    fn note(&self, fault: &PyErr) {
        let count = {
            let mut undefined = locked(&self.undefined);
            undefined.count += 1;
            undefined.count
        };
        if count == 1 {
            // Python runs here.
            let said = numbers::first_line(&fault.to_string());
            locked(&self.undefined).first = said;
        }
    }

    /// What was taken for points where F is not defined, in a sentence.
    pub fn undefined(&self) -> Option<String> {
        let Undefined { count, first } = &*locked(&self.undefined);
        let points = nonsmooth_problem::plural(*count, "point");
        (*count > 0).then(|| {
            format!("F or jac raised at {points} that were tried, as outside of its domain; first {first}")
        })
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

    /// The solve that asks now. On threads of the library's own it is not known: all that are on other threads.
    fn asking(&self) -> Vec<Arc<Watcher>> {
        let mine = SOLVE.with_borrow(Clone::clone);
        let all = locked(&self.0);
        if let Some(mine) = mine.filter(|mine| all.iter().any(|one| Arc::ptr_eq(one, mine))) {
            return vec![mine];
        }
        let elsewhere: Vec<_> = all.iter().filter(|one| one.context.is_some()).cloned().collect();
        if elsewhere.is_empty() { all.clone() } else { elsewhere }
    }
}

/// A function of Python, until the garbage collector takes it.
type Slot = Arc<Mutex<Option<Py<PyAny>>>>;

/// The functions of a problem as the garbage collector sees them: one that refers to the object that holds the problem would keep both for ever.
///
/// Calls hold them too, out of its sight; so it is told of each of them here alone. Whoever of Python's objects holds calls holds this.
#[pyclass(frozen, module = "nonsmooth._nonsmooth")]
pub struct Functions(Vec<Slot>);

#[pymethods]
impl Functions {
    fn __traverse__(&self, visit: PyVisit<'_>) -> Result<(), PyTraverseError> {
        let mut functions = self.0.iter().filter_map(|slot| slot.try_lock().ok());
        functions.try_for_each(|function| visit.call(&*function))
    }

    fn __clear__(&self) {
        let taken: Vec<_> = self.0.iter().map(|slot| locked(slot).take()).collect();
        drop(taken);
    }
}

/// Why a function gave no values.
struct Fault {
    error: PyErr,
    /// Whether it says nothing of x: the solve ends with it even where F is only asked whether it is defined.
    everywhere: bool,
}

impl Fault {
    /// By an exception of the function. Ctrl-C, memory and names say nothing of x.
    fn raised(py: Python<'_>, error: PyErr) -> Self {
        let everywhere = !error.is_instance_of::<PyException>(py)
            || error.is_instance_of::<PyMemoryError>(py)
            || error.is_instance_of::<PyRecursionError>(py)
            || error.is_instance_of::<PyNameError>(py);
        Self { error, everywhere }
    }
}

/// What is given in a wrong form says nothing of x.
impl From<PyErr> for Fault {
    fn from(error: PyErr) -> Self {
        Self { error, everywhere: true }
    }
}

/// A function of Python: what it gives goes into a slice, which is NaN where it raises.
struct Call {
    function: Slot,
    faults: Arc<Faults>,
}

impl Call {
    fn new(function: &Bound<'_, PyAny>, faults: &Arc<Faults>) -> Self {
        let slot = Mutex::new(Some(function.clone().unbind()));
        Self { function: Arc::new(slot), faults: faults.clone() }
    }

    fn write(
        &self,
        x: &[f64],
        out: &mut [f64],
        read: impl Fn(&Bound<'_, PyAny>, &mut [f64]) -> Result<(), Fault>,
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
            let function = locked(&self.function).as_ref().map(|f| f.clone_ref(py));
            let Some(function) = function else { return false };
            let given = PyArray1::from_slice(py, x);
            let found = match context {
                // A copy, since a context is entered by one thread at a time.
                Some(context) => {
                    let copy = context.bind(py).call_method0("copy");
                    copy.and_then(|copy| copy.call_method1("run", (function, given)))
                }
                None => function.bind(py).call1((given,)),
            };
            let done = found.map_err(|error| Fault::raised(py, error));
            let Err(Fault { error, everywhere }) = done.and_then(|found| read(&found, out)) else {
                return true;
            };
            // NaN is put in for a pattern, not tried: nothing that comes of it is wrong.
            let said = !everywhere || x.iter().any(|x| x.is_nan());
            if is_tentative() && said && error.is_instance_of::<PyException>(py) {
                asking.iter().for_each(|one| one.note(&error));
            } else {
                for one in &asking {
                    one.failed.store(true, Ordering::Relaxed);
                    one.fail(error.clone_ref(py));
                }
            }
            false
        });
        if done != Some(true) {
            out.fill(f64::NAN);
        }
    }
}

/// n values.
fn values(found: &Bound<'_, PyAny>, out: &mut [f64]) -> Result<(), Fault> {
    let all = numbers::vector("F(x)", found).map_err(|error| {
        // The root of a negative number may be complex.
        Fault { error, everywhere: !numbers::is_complex(found) }
    })?;
    if all.len() != out.len() {
        return Err(expected("F(x)", &format!("{} values", out.len()), all.len()).into());
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
fn entries(found: &Bound<'_, PyAny>, pattern: &Pattern, out: &mut [f64]) -> Result<(), Fault> {
    let matrix = square(JACOBIAN, found, pattern.rows())
        .map_err(|error| Fault { error, everywhere: !numbers::is_complex(found) })?;
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
            let what = "zero, as the pattern says";
            // Beyond the domain zero times infinity is not zero.
            Err(Fault {
                error: expected(&format!("{JACOBIAN}[{i}, {j}]"), what, x),
                everywhere: false,
            })
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

/// F by a function, with a Jacobian by another or by differences, and what the garbage collector knows of them; x is where a pattern that nobody says is looked for.
pub fn field(
    function: &Bound<'_, PyAny>,
    jacobian: Option<&Bound<'_, PyAny>>,
    pattern: Option<&Bound<'_, PyAny>>,
    x: &[f64],
    faults: &Arc<Faults>,
) -> PyResult<(Arc<dyn Field>, Functions)> {
    let watcher = Arc::new(Watcher::default());
    let _watching = faults.watch(&watcher);
    let call = Call::new(function, faults);
    let mut functions = Functions(vec![call.function.clone()]);
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
            functions.0.push(jac.function.clone());
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
        None => Ok((field, functions)),
    }
}
