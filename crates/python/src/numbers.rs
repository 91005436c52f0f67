//! Numbers of Python as vectors and matrices: numpy's arrays, what numpy makes arrays of, and the sparse matrices of scipy.
//!
//! The library owns its data, so values are copied once, straight from the buffers that they are in: columns and blocks in order as they are, rows into columns or blocks in one
//! pass. Only other types than float64 and arrays that are not contiguous are converted before; entries by places, in disorder or twice, and columns for a matrix by blocks, are sorted
//! in between.

use nonsmooth_linalg::{Bsr, Csc, Dense, Matrix, MatrixError, budget};
use numpy::{
    Element, PyArrayDyn, PyArrayMethods, PyReadonlyArrayDyn, PyUntypedArray, PyUntypedArrayMethods,
};
use pyo3::prelude::*;
use pyo3::sync::PyOnceLock;
use pyo3::types::{PyFloat, PyList, PyTuple};

use crate::{DEEPEST, expected, mistake};

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
    if let Ok(array) = given.cast_exact::<PyArrayDyn<T>>()
        && is_plain(array)
    {
        return Ok(array.clone());
    }
    let py = given.py();
    if is_masked(given, DEEPEST)? {
        return Err(expected(
            place,
            what,
            "a masked array (filled() says what stands for what is masked)",
        ));
    }
    let refused = |e: PyErr| expected(place, what, first_line(&e.value(py).to_string()));
    let any = numpy(py, "asarray")?.call1((given,)).map_err(refused)?;
    let any = any.cast_into::<PyUntypedArray>()?;
    let kind: String = any.dtype().getattr("kind")?.extract()?;
    let empty = any.len() == 0 && kind == "f";
    if !kinds.contains(&kind) && !empty {
        return Err(expected(place, what, any.dtype().str()?));
    }
    let made = numpy(py, "require")?.call1((&any, T::get_dtype(py), "CA"))?;
    Ok(made.cast_into::<PyArrayDyn<T>>()?)
}

/// Whether the entries lie one after the other, where the processor likes them to.
fn is_plain<T: Element>(array: &Bound<'_, PyArrayDyn<T>>) -> bool {
    array.is_c_contiguous() && array.data().is_aligned()
}

/// Whether something is masked: an array of numpy's `ma`, or one of the items of a list.
fn is_masked(given: &Bound<'_, PyAny>, left: usize) -> PyResult<bool> {
    static MASKED: PyOnceLock<Py<PyAny>> = PyOnceLock::new();
    if given.is_exact_instance_of::<PyFloat>() || given.cast_exact::<PyUntypedArray>().is_ok() {
        return Ok(false);
    }
    let Some(left) = left.checked_sub(1) else { return Ok(false) };
    if let Ok(list) = given.cast::<PyList>() {
        return any_masked(list.iter(), left);
    }
    if let Ok(tuple) = given.cast::<PyTuple>() {
        return any_masked(tuple.iter(), left);
    }
    let py = given.py();
    let class = || Ok::<_, PyErr>(numpy(py, "ma")?.getattr("MaskedArray")?.unbind());
    given.is_instance(MASKED.get_or_try_init(py, class)?.bind(py))
}

fn any_masked<'py>(
    mut items: impl Iterator<Item = Bound<'py, PyAny>>,
    left: usize,
) -> PyResult<bool> {
    items.try_fold(false, |found, item| Ok(found || is_masked(&item, left)?))
}

/// Whether something is an array of complex numbers, or what numpy makes one of.
pub fn is_complex(given: &Bound<'_, PyAny>) -> bool {
    let found = numpy(given.py(), "iscomplexobj").and_then(|f| f.call1((given,))?.is_truthy());
    found.unwrap_or(false)
}

/// The first line of a text.
pub fn first_line(text: &str) -> String {
    text.lines().next().unwrap_or_default().to_owned()
}

/// An array of real numbers, nothing of which is masked.
#[pyfunction]
pub fn reals<'py>(place: &str, given: &Bound<'py, PyAny>) -> PyResult<Bound<'py, PyArrayDyn<f64>>> {
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

/// A vector with D entries a contact (a single column is one), or an array with a row for each contact; and D where it shows.
pub fn by_contact(place: &str, given: &Bound<'_, PyAny>) -> PyResult<(Vec<f64>, Option<usize>)> {
    let array = reals(place, given)?;
    match array.shape() {
        [_] | [_, 1] => Ok((copied(&array)?, None)),
        [_, d] => Ok((copied(&array)?, Some(*d))),
        other => {
            let what = "an array of one dimension, or with a row for each contact";
            Err(expected(place, what, shape(other)))
        }
    }
}

/// As [`by_contact`], of contacts with d components each.
pub fn of_contacts(place: &str, given: &Bound<'_, PyAny>, d: usize) -> PyResult<Vec<f64>> {
    match by_contact(place, given)? {
        (_, Some(columns)) if columns != d => {
            let what = format!("a row of {d} components for each contact");
            Err(expected(place, &what, format!("rows of {columns}")))
        }
        (all, _) => Ok(all),
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

/// Indices: numbers from 0 on. Those of scipy, of 32 or 64 bits, are converted in one pass.
fn indices(place: &str, given: &Bound<'_, PyAny>) -> PyResult<Vec<usize>> {
    fn whole<T: Element + Copy + Into<i64>>(
        place: &str,
        array: &Bound<'_, PyArrayDyn<T>>,
    ) -> PyResult<Vec<usize>> {
        let index = |i: &T| {
            let i: i64 = (*i).into();
            usize::try_from(i).map_err(|_| expected(place, "indices of at least 0", i))
        };
        let array = array.try_readonly().map_err(mistake)?;
        array.as_slice().map_err(mistake)?.iter().map(index).collect()
    }
    if let Ok(short) = given.cast::<PyArrayDyn<i32>>()
        && is_plain(short)
    {
        return whole(place, short);
    }
    whole(place, &array::<i64>(place, given, "iu", "an array of indices")?)
}

/// A sparse matrix of scipy by its arrays, whose values are still Python's.
pub struct Sparse<'py> {
    rows: usize,
    columns: usize,
    by: By,
    values: PyReadonlyArrayDyn<'py, f64>,
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

/// Bytes that are asked about before they are taken.
const LARGE: f64 = 1e8;

/// Whether the indices of each line ascend, below a limit.
fn ascends(starts: &[usize], indices: &[usize], limit: usize) -> bool {
    starts.windows(2).all(|w| {
        let line = &indices[w[0]..w[1]];
        line.windows(2).all(|w| w[0] < w[1]) && line.last().is_none_or(|&i| i < limit)
    })
}

impl<'py> Sparse<'py> {
    /// The matrix, if it is a sparse one.
    pub fn of(place: &str, given: &Bound<'py, PyAny>) -> PyResult<Option<Self>> {
        let Ok(format) = given.getattr("format").and_then(|f| f.extract::<String>()) else {
            return Ok(None);
        };
        let part = |name: &str| given.getattr(name);
        let Ok((rows, columns)) = part("shape").and_then(|s| s.extract::<(usize, usize)>()) else {
            return Err(expected(place, "a matrix", "a sparse array of another dimension"));
        };
        // Pointers to so many columns are made before anything else is seen of it.
        let pointers = 16.0 * (rows as f64 + columns as f64);
        if pointers > LARGE && !budget::fits(pointers) {
            return Err(expected(
                place,
                "a matrix that fits in memory",
                format!("{rows} × {columns}"),
            ));
        }
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
        let values = reals(place, &part("data")?)?.try_readonly().map_err(mistake)?;
        let sparse = Self { rows, columns, by, values };
        sparse.validate(place)?;
        Ok(Some(sparse))
    }

    /// The values, line after line.
    fn values(&self) -> PyResult<&[f64]> {
        self.values.as_slice().map_err(mistake)
    }

    /// The arrays fit each other; that indices are inside the matrix is checked where it is made.
    fn validate(&self, place: &str) -> PyResult<()> {
        let found = self.values()?.len();
        let (starts, lines, entries, size) = match &self.by {
            By::Places { rows, columns } => {
                return match rows.len() == columns.len() && rows.len() == found {
                    true => Ok(()),
                    false => Err(expected(place, "as many rows and columns as values", {
                        format!("{}, {} and {found}", rows.len(), columns.len())
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
        if starts.len() != lines + 1 || starts[0] != 0 || !ascend || starts[lines] > entries {
            let what = "pointers that ascend from 0 to the number of entries";
            return Err(expected(&format!("{place}.indptr"), what, "others"));
        }
        match entries * size == found {
            true => Ok(()),
            false => {
                let what = format!("{} values", entries * size);
                Err(expected(&format!("{place}.data"), &what, found))
            }
        }
    }

    /// By compressed columns; what stands at one place is added. Columns in order are copied as they are, rows in order are put into columns in one pass.
    pub fn csc(self, place: &str) -> PyResult<Csc> {
        let (m, n) = (self.rows, self.columns);
        let wrong = |e: MatrixError| mistake(format!("{place}: {e}"));
        if let By::Columns { starts, rows } = &self.by
            && ascends(starts, rows, m)
        {
            let values = self.values()?[..starts[n]].to_vec();
            let By::Columns { starts, mut rows } = self.by else { unreachable!("as was seen") };
            rows.truncate(starts[n]);
            return Csc::from_vecs(m, n, starts, rows, values).map_err(wrong);
        }
        if let By::Rows { starts, columns, block: [1, 1] } = &self.by
            && ascends(starts, columns, n)
        {
            return by_columns(m, n, starts, columns, self.values()?).map_err(wrong);
        }
        let values = self.values()?;
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
        made.map_err(wrong)
    }

    /// By D×D blocks, of blocks in order or of rows, in one pass; `None` of what is stored otherwise.
    fn blocks<const D: usize>(&self, place: &str) -> PyResult<Option<Bsr<D>>> {
        let By::Rows { starts, columns, block } = &self.by else { return Ok(None) };
        let (n, values) = (self.columns / D, self.values()?);
        if *block == [1, 1] {
            return by_blocks(self.columns, starts, columns, values, place).map(Some);
        }
        if *block != [D, D] || !ascends(starts, columns, n) {
            return Ok(None);
        }
        let (blocks, _) = values.as_chunks::<D>().0.as_chunks::<D>();
        let mut out = Bsr::from_rows(n, &[]);
        for line in starts.windows(2) {
            (line[0]..line[1]).for_each(|k| out.push(columns[k], blocks[k]));
            out.end_row();
        }
        Ok(Some(out))
    }
}

/// A matrix by rows, in order and inside, by columns.
fn by_columns(
    m: usize,
    n: usize,
    starts: &[usize],
    columns: &[usize],
    values: &[f64],
) -> Result<Csc, MatrixError> {
    let mut pointers = vec![0; n + 1];
    columns[..starts[m]].iter().for_each(|j| pointers[j + 1] += 1);
    (0..n).for_each(|j| pointers[j + 1] += pointers[j]);
    let (mut rows, mut all) = (vec![0; starts[m]], vec![0.0; starts[m]]);
    let mut next = pointers.clone();
    for i in 0..m {
        for k in starts[i]..starts[i + 1] {
            let to = &mut next[columns[k]];
            (rows[*to], all[*to]) = (i, values[k]);
            *to += 1;
        }
    }
    Csc::from_vecs(m, n, pointers, rows, all)
}

/// A matrix by rows, in any order, by blocks. Its shape is one of whole blocks.
fn by_blocks<const D: usize>(
    n: usize,
    starts: &[usize],
    columns: &[usize],
    values: &[f64],
    place: &str,
) -> PyResult<Bsr<D>> {
    let mut out = Bsr::from_rows(n / D, &[]);
    let mut line: Vec<(usize, [[f64; D]; D])> = vec![];
    // Where the block of a column is in the line that is gathered.
    let mut places = vec![usize::MAX; n / D];
    for first in (0..starts.len() - 1).step_by(D) {
        for a in 0..D {
            for k in starts[first + a]..starts[first + a + 1] {
                let j = columns[k];
                let Some(at) = places.get_mut(j / D) else {
                    let what = format!("columns below {n}");
                    return Err(expected(&format!("{place}.indices[{k}]"), &what, j));
                };
                if *at == usize::MAX {
                    *at = line.len();
                    line.push((j / D, [[0.0; D]; D]));
                }
                line[*at].1[a][j % D] += values[k];
            }
        }
        line.iter().for_each(|(j, _)| places[*j] = usize::MAX);
        line.sort_unstable_by_key(|(j, _)| *j);
        line.drain(..).for_each(|(j, block)| out.push(j, block));
        out.end_row();
    }
    Ok(out)
}

/// All entries of a matrix by blocks; those of zeros are left out.
fn dense_blocks<const D: usize>(n: usize, values: &[f64]) -> Bsr<D> {
    let mut out = Bsr::from_rows(n / D, &[]);
    for line in values.chunks_exact(D * n.max(1)) {
        for j in 0..n / D {
            let block: [[f64; D]; D] =
                std::array::from_fn(|a| std::array::from_fn(|b| line[a * n + j * D + b]));
            if block.iter().flatten().any(|x| *x != 0.0) {
                out.push(j, block);
            }
        }
        out.end_row();
    }
    out
}

/// An array of two dimensions.
fn matrix_array<'py>(
    place: &str,
    given: &Bound<'py, PyAny>,
) -> PyResult<Bound<'py, PyArrayDyn<f64>>> {
    let array = reals(place, given)?;
    match array.ndim() {
        2 => Ok(array),
        _ => Err(expected(place, "a matrix", shape(array.shape()))),
    }
}

/// All entries of a matrix.
fn dense(place: &str, given: &Bound<'_, PyAny>) -> PyResult<Dense> {
    let array = matrix_array(place, given)?;
    let &[m, n] = array.shape() else { unreachable!("two dimensions") };
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
    let whole = |m: usize, n: usize| match m.is_multiple_of(D) && n.is_multiple_of(D) {
        true => Ok(()),
        false => {
            let what = format!("rows and columns by {D} for each contact");
            Err(expected(place, &what, format!("{m} × {n}")))
        }
    };
    if let Some(sparse) = Sparse::of(place, given)? {
        whole(sparse.rows, sparse.columns)?;
        return match sparse.blocks(place)? {
            Some(blocks) => Ok(blocks),
            None => Ok(Bsr::from_csc(&sparse.csc(place)?)),
        };
    }
    let array = matrix_array(place, given)?;
    let &[m, n] = array.shape() else { unreachable!("two dimensions") };
    whole(m, n)?;
    let array = array.try_readonly().map_err(mistake)?;
    Ok(dense_blocks(n, array.as_slice().map_err(mistake)?))
}
