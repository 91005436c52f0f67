//! Numbers of Python as vectors and matrices: numpy's arrays, what numpy makes arrays of, and the sparse matrices of scipy.
//!
//! The library owns its data, so values are copied once, straight from the buffers that they are in; only other types than float64 and arrays that are not
//! contiguous are converted before. Cost: one pass over what is given.

use nonsmooth_linalg::{Bsr, Csc, Dense, Matrix};
use numpy::{Element, PyArrayDyn, PyArrayMethods, PyUntypedArray, PyUntypedArrayMethods};
use pyo3::prelude::*;
use pyo3::sync::PyOnceLock;

use crate::{expected, mistake};

fn numpy<'py>(py: Python<'py>, name: &str) -> PyResult<Bound<'py, PyAny>> {
    static NUMPY: PyOnceLock<Py<PyModule>> = PyOnceLock::new();
    let module = NUMPY.get_or_try_init(py, || Ok::<_, PyErr>(py.import("numpy")?.unbind()))?;
    module.bind(py).getattr(name)
}

/// A contiguous array of this type that equals what is given, which is itself where it is one.
fn array<'py, T: Element>(
    place: &str,
    given: &Bound<'py, PyAny>,
    kinds: &str,
    what: &str,
) -> PyResult<Bound<'py, PyArrayDyn<T>>> {
    if let Ok(array) = given.cast::<PyArrayDyn<T>>()
        && array.is_c_contiguous()
    {
        return Ok(array.clone());
    }
    let py = given.py();
    let refused = |e: PyErr| expected(place, what, first_line(&e.value(py).to_string()));
    let any = numpy(py, "asarray")?.call1((given,)).map_err(refused)?;
    let any = any.cast_into::<PyUntypedArray>()?;
    let kind: String = any.dtype().getattr("kind")?.extract()?;
    let empty = any.len() == 0 && kind == "f";
    if !kinds.contains(&kind) && !empty {
        return Err(expected(place, what, any.dtype().str()?));
    }
    let made = numpy(py, "ascontiguousarray")?.call1((&any, T::get_dtype(py)))?;
    // Scalars become arrays of one entry there; they are none.
    let made = if any.ndim() == 0 { made.call_method1("reshape", ((),))? } else { made };
    Ok(made.cast_into::<PyArrayDyn<T>>()?)
}

fn first_line(text: &str) -> String {
    text.lines().next().unwrap_or_default().to_owned()
}

fn reals<'py>(place: &str, given: &Bound<'py, PyAny>) -> PyResult<Bound<'py, PyArrayDyn<f64>>> {
    array(place, given, "fiub", "an array of real numbers")
}

/// The numbers of an array, whatever its shape, row after row.
fn copied<T: Element + Clone>(array: &Bound<'_, PyArrayDyn<T>>) -> PyResult<Vec<T>> {
    let array = array.try_readonly().map_err(mistake)?;
    Ok(array.as_slice().map_err(mistake)?.to_vec())
}

fn shape(shape: &[usize]) -> String {
    match shape {
        [] => "a number".into(),
        [n] => format!("an array of {n}"),
        _ => format!(
            "an array of {}",
            shape.iter().map(usize::to_string).collect::<Vec<_>>().join(" × ")
        ),
    }
}

/// A vector.
pub fn vector(place: &str, given: &Bound<'_, PyAny>) -> PyResult<Vec<f64>> {
    let array = reals(place, given)?;
    match array.ndim() {
        1 => copied(&array),
        _ => Err(expected(place, "an array of one dimension", shape(array.shape()))),
    }
}

/// A vector with D entries a contact, or an array with a row for each contact; and D where it shows.
pub fn by_contact(place: &str, given: &Bound<'_, PyAny>) -> PyResult<(Vec<f64>, Option<usize>)> {
    let array = reals(place, given)?;
    match array.shape() {
        [_] => Ok((copied(&array)?, None)),
        [_, d] => Ok((copied(&array)?, Some(*d))),
        other => {
            let what = "an array of one dimension, or with a row for each contact";
            Err(expected(place, what, shape(other)))
        }
    }
}

/// A number, or a vector.
pub enum Scalar {
    /// One number for all.
    One(f64),
    /// One each.
    Each(Vec<f64>),
}

/// A number or a vector.
pub fn scalar_or_vector(place: &str, given: &Bound<'_, PyAny>) -> PyResult<Scalar> {
    let array = reals(place, given)?;
    match array.ndim() {
        0 => Ok(Scalar::One(copied(&array)?[0])),
        1 => Ok(Scalar::Each(copied(&array)?)),
        _ => Err(expected(place, "a number or an array of one dimension", shape(array.shape()))),
    }
}

/// Indices: numbers from 0 on.
fn indices(place: &str, given: &Bound<'_, PyAny>) -> PyResult<Vec<usize>> {
    let array = array::<i64>(place, given, "iu", "an array of indices")?;
    let all = copied(&array)?;
    let index =
        |i: i64| usize::try_from(i).map_err(|_| expected(place, "indices of at least 0", i));
    all.into_iter().map(index).collect()
}

/// A sparse matrix of scipy by its arrays.
pub struct Sparse {
    rows: usize,
    columns: usize,
    by: By,
    values: Vec<f64>,
}

/// How entries are stored.
enum By {
    /// Pointers and columns, in blocks of so many rows and columns.
    Rows {
        starts: Vec<usize>,
        columns: Vec<usize>,
        block: [usize; 2],
    },
    Columns {
        starts: Vec<usize>,
        rows: Vec<usize>,
    },
    Places {
        rows: Vec<usize>,
        columns: Vec<usize>,
    },
}

impl Sparse {
    /// The matrix, if it is a sparse one.
    pub fn of(place: &str, given: &Bound<'_, PyAny>) -> PyResult<Option<Self>> {
        let Ok(format) = given.getattr("format").and_then(|f| f.extract::<String>()) else {
            return Ok(None);
        };
        let part = |name: &str| given.getattr(name);
        let Ok((rows, columns)) = part("shape").and_then(|s| s.extract::<(usize, usize)>()) else {
            return Err(expected(place, "a matrix", "a sparse array of another dimension"));
        };
        let place_of = |name: &str| format!("{place}.{name}");
        let numbers = |name: &str| indices(&place_of(name), &part(name)?);
        let by = match format.as_str() {
            "csr" => {
                By::Rows { starts: numbers("indptr")?, columns: numbers("indices")?, block: [1, 1] }
            }
            "bsr" => {
                let (r, c) = part("blocksize")?.extract()?;
                let (starts, columns) = (numbers("indptr")?, numbers("indices")?);
                By::Rows { starts, columns, block: [r, c] }
            }
            "csc" => By::Columns { starts: numbers("indptr")?, rows: numbers("indices")? },
            "coo" => By::Places { rows: numbers("row")?, columns: numbers("col")? },
            _ => return Self::of(place, &given.call_method0("tocsc")?),
        };
        let values = copied(&reals(place, &part("data")?)?)?;
        let sparse = Self { rows, columns, by, values };
        sparse.validate(place)?;
        Ok(Some(sparse))
    }

    /// The arrays fit each other; that indices are inside the matrix is checked where it is made.
    fn validate(&self, place: &str) -> PyResult<()> {
        let (starts, lines, entries, size) = match &self.by {
            By::Places { rows, columns } => {
                return match rows.len() == columns.len() && rows.len() == self.values.len() {
                    true => Ok(()),
                    false => Err(expected(place, "as many rows and columns as values", {
                        format!("{}, {} and {}", rows.len(), columns.len(), self.values.len())
                    })),
                };
            }
            By::Rows { starts, columns, block: [r, c] } => {
                if *r == 0 || *c == 0 {
                    return Err(expected(place, "blocks with entries", "empty ones"));
                }
                (starts, self.rows / r, columns.len(), r * c)
            }
            By::Columns { starts, rows } => (starts, self.columns, rows.len(), 1),
        };
        let ascend = starts.windows(2).all(|w| w[0] <= w[1]);
        if starts.len() != lines + 1 || !ascend || starts[lines] > entries {
            let what = "pointers that ascend from 0 to the number of entries";
            return Err(expected(&format!("{place}.indptr"), what, "others"));
        }
        match entries * size == self.values.len() {
            true => Ok(()),
            false => Err(expected(
                &format!("{place}.data"),
                &format!("{} values", entries * size),
                self.values.len(),
            )),
        }
    }

    /// By compressed columns; what stands at one place is added.
    pub fn csc(&self, place: &str) -> PyResult<Csc> {
        let (m, n, values) = (self.rows, self.columns, &self.values);
        let made = match &self.by {
            By::Places { rows, columns } => Csc::from_triplets(
                m,
                n,
                rows.iter().zip(columns).zip(values).map(|((&i, &j), &x)| (i, j, x)),
            ),
            By::Columns { starts, rows } => Csc::from_triplets(
                m,
                n,
                (0..n)
                    .flat_map(|j| (starts[j]..starts[j + 1]).map(move |k| (rows[k], j, values[k]))),
            ),
            By::Rows { starts, columns, block: [r, c] } => Csc::from_triplets(
                m,
                n,
                (0..starts.len() - 1).flat_map(|i| {
                    (starts[i]..starts[i + 1]).flat_map(move |k| {
                        (0..r * c).map(move |e| {
                            (i * r + e / c, columns[k] * c + e % c, values[k * r * c + e])
                        })
                    })
                }),
            ),
        };
        made.map_err(|e| mistake(format!("{place}: {e}")))
    }

    /// By D×D blocks, where that is how it is stored, in order.
    fn blocks<const D: usize>(&self) -> Option<Bsr<D>> {
        let By::Rows { starts, columns, block } = &self.by else { return None };
        let (nr, nc) = (starts.len() - 1, self.columns / D);
        let ascends = |i: usize| {
            let row = &columns[starts[i]..starts[i + 1]];
            row.windows(2).all(|w| w[0] < w[1]) && row.last().is_none_or(|&j| j < nc)
        };
        if *block != [D, D] || !self.columns.is_multiple_of(D) || !(0..nr).all(ascends) {
            return None;
        }
        let mut out = Bsr::from_rows(nc, &[]);
        for i in 0..nr {
            for k in starts[i]..starts[i + 1] {
                let at = k * D * D;
                out.push(
                    columns[k],
                    std::array::from_fn(|a| std::array::from_fn(|b| self.values[at + a * D + b])),
                );
            }
            out.end_row();
        }
        Some(out)
    }
}

/// All entries of a matrix.
fn dense(place: &str, given: &Bound<'_, PyAny>) -> PyResult<Dense> {
    let array = reals(place, given)?;
    let &[m, n] = array.shape() else {
        return Err(expected(place, "a matrix", shape(array.shape())));
    };
    let array = array.try_readonly().map_err(mistake)?;
    let mut out = Dense::zeros(m, n);
    out.values_mut().copy_from_slice(array.as_slice().map_err(mistake)?);
    Ok(out)
}

/// A matrix: sparse where scipy's is, else with all entries.
pub fn matrix(place: &str, given: &Bound<'_, PyAny>) -> PyResult<Matrix> {
    match Sparse::of(place, given)? {
        Some(sparse) => Ok(sparse.csc(place)?.into()),
        None => Ok(dense(place, given)?.into()),
    }
}

/// A sparse matrix, of whatever is given; of all entries those that are not zero.
pub fn csc(place: &str, given: &Bound<'_, PyAny>) -> PyResult<Csc> {
    match Sparse::of(place, given)? {
        Some(sparse) => sparse.csc(place),
        None => Ok(dense(place, given)?.to_csc()),
    }
}

/// A matrix by blocks.
pub fn bsr<const D: usize>(place: &str, given: &Bound<'_, PyAny>) -> PyResult<Bsr<D>> {
    let sparse = Sparse::of(place, given)?;
    if let Some(blocks) = sparse.as_ref().and_then(Sparse::blocks) {
        return Ok(blocks);
    }
    let csc = match sparse {
        Some(sparse) => sparse.csc(place)?,
        None => dense(place, given)?.to_csc(),
    };
    if !csc.nrows().is_multiple_of(D) || !csc.ncols().is_multiple_of(D) {
        let what = format!("rows and columns by {D} for each contact");
        return Err(expected(place, &what, format!("{} × {}", csc.nrows(), csc.ncols())));
    }
    Ok(Bsr::from_csc(&csc))
}
