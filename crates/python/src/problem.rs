//! Problems of any kind.

use std::path::PathBuf;
use std::sync::{Arc, Mutex, PoisonError, RwLock};

use nonsmooth_io::{ProblemFile, StoredPoint};
use nonsmooth_linalg::{Csc, Matrix};
use nonsmooth_problem::check::{Judged as _, VerdictOf};
use nonsmooth_problem::{
    AnyPoint, AnyProblem, Complementarity, Kind, Mcp, Mlcp, OfAny, OfAnyPoint, Part, Problem as _,
    ProblemError, Shape, Stated, Vi, each_kind, with_complementarity, with_friction,
};
use nonsmooth_solve::{Kept, Limits};
use pyo3::prelude::*;
use pyo3::types::{PyDict, PyList};
use pyo3::{PyTraverseError, PyVisit};

use crate::function::{self, Faults, Functions, Watcher};
use crate::parts::{Given, Shown, put};
use crate::{contact, expected, mistake, numbers};

/// A problem of any kind, with what a file says of it.
#[pyclass(frozen, module = "nonsmooth._nonsmooth")]
pub struct Problem {
    file: RwLock<Arc<ProblemFile>>,
    /// The session of the last solve; a solve takes it out and brings it back.
    kept: Mutex<Kept>,
    /// Where exceptions of its functions go.
    pub faults: Arc<Faults>,
    /// Its functions of Python, for the garbage collector.
    functions: Option<Py<Functions>>,
}

impl Problem {
    /// Of a file, without functions of Python.
    pub fn new(file: ProblemFile) -> Self {
        Self {
            file: RwLock::new(Arc::new(file)),
            kept: Mutex::default(),
            faults: Arc::default(),
            functions: None,
        }
    }

    /// What the garbage collector knows of its functions, for who keeps the problem.
    pub fn functions(&self, py: Python<'_>) -> Option<Py<Functions>> {
        self.functions.as_ref().map(|functions| functions.clone_ref(py))
    }

    /// The problem as it is now; who has it keeps it, whatever becomes of this.
    pub fn file(&self) -> Arc<ProblemFile> {
        self.file.read().unwrap_or_else(PoisonError::into_inner).clone()
    }

    /// The session that is kept, for one solve.
    pub fn take_kept(&self) -> Kept {
        std::mem::take(&mut *self.kept.lock().unwrap_or_else(PoisonError::into_inner))
    }

    /// Brings it back.
    pub fn put_kept(&self, kept: Kept) {
        *self.kept.lock().unwrap_or_else(PoisonError::into_inner) = kept;
    }

    /// Does what may call its functions, with Python let go of: what they raise is raised here, and ends nothing else.
    pub fn watched<T: Send>(
        &self,
        py: Python<'_>,
        watcher: &Arc<Watcher>,
        task: impl FnOnce() -> T + Send,
    ) -> PyResult<T> {
        let watching = self.faults.watch(watcher);
        let done = py.detach(|| watcher.at_work(task));
        drop(watching);
        watcher.fault().map_or(Ok(done), Err)
    }

    /// The judge's word on a point.
    fn judged(
        &self,
        py: Python<'_>,
        problem: &AnyProblem,
        point: &AnyPoint,
        tolerance: f64,
    ) -> PyResult<VerdictOf<AnyProblem>> {
        self.watched(py, &Arc::default(), || problem.judge(point, tolerance))?.map_err(mistake)
    }

    /// As [`point`]; velocities that are not given follow from the impulses.
    fn whole_point(
        &self,
        problem: &AnyProblem,
        place: &str,
        given: &Bound<'_, PyAny>,
    ) -> PyResult<AnyPoint> {
        fn follow<P: nonsmooth_problem::Problem<Point: OfAnyPoint>>(
            problem: &P,
            point: &mut AnyPoint,
        ) -> Result<(), ProblemError> {
            if let Some(point) = P::Point::of_mut(point) {
                problem.validate_point(point)?;
                let mut gauge = problem.gauge()?;
                problem.measure(point, &mut gauge);
                problem.follow_impulses(point, &mut gauge);
            }
            Ok(())
        }
        let mut point = self::point(problem, place, given)?;
        let whole = given.cast::<crate::solve::Answer>().is_ok()
            || given.cast::<PyDict>().is_ok_and(|parts| parts.contains("v").unwrap_or(false));
        if let (AnyProblem::Friction(contacts), false) = (problem, whole) {
            let follow = || with_friction!(contacts, p => follow(p, &mut point));
            self.watched(given.py(), &Arc::default(), follow)?.map_err(mistake)?;
        }
        Ok(point)
    }
}

/// What Python knows of a kind before there is a problem of it.
#[derive(Clone, Copy)]
struct Known {
    kind: Kind,
    statement: &'static str,
    parts: &'static [(&'static str, Shape)],
    solution: &'static [&'static str],
    make: fn(&mut Given<'_, '_>) -> Result<AnyProblem, nonsmooth_problem::ProblemError>,
}

fn known() -> impl Iterator<Item = Known> {
    let all = each_kind!(P in Complementarity => Known {
        kind: P::KIND,
        statement: P::STATEMENT,
        parts: P::PARTS,
        solution: P::SOLUTION,
        make: |given| P::from_parts(given).map(Into::into),
    });
    all.into_iter()
}

fn letters(parts: &'static [(&'static str, Shape)]) -> Vec<&'static str> {
    parts.iter().map(|(name, _)| *name).collect()
}

/// The kinds that are stated by parts: name, statement, parts with what they are, parts of a solution.
#[pyfunction]
pub fn kinds(py: Python<'_>) -> PyResult<Bound<'_, PyList>> {
    let all = PyList::empty(py);
    for Known { kind, statement, parts, solution, .. } in known() {
        let shape = |shape: Shape| match shape {
            Shape::Matrix => "matrix",
            Shape::Vector => "vector",
            Shape::Count => "count",
            Shape::Expressions => "function",
            Shape::Set => "set",
        };
        let parts: Vec<_> = parts.iter().map(|(name, part)| (*name, shape(*part))).collect();
        let one = PyDict::new(py);
        one.set_item("kind", kind.name())?;
        one.set_item("statement", statement)?;
        one.set_item("parts", parts)?;
        one.set_item("solution", solution.to_vec())?;
        all.append(one)?;
    }
    Ok(all)
}

/// The problem of a kind by its parts, and its functions of Python.
fn stated(
    kind: &str,
    parts: &Bound<'_, PyDict>,
    faults: &Arc<Faults>,
) -> PyResult<(AnyProblem, Option<Functions>)> {
    let known = known().find(|known| known.kind.name() == kind);
    let Some(Known { kind, parts: letters_of, make, .. }) = known else {
        return Err(expected("kind", "a kind of problem that is stated by parts", kind));
    };
    let all = letters(letters_of);
    let mut given = Given::new(parts);
    match given.get("F")? {
        Some(f) if f.is_callable() => by_function(kind, parts, &f, &all, faults),
        _ => {
            let problem = make(&mut given);
            Ok((given.made(problem, &all)?, None))
        }
    }
}

/// A problem whose F is a function of Python.
fn by_function(
    kind: Kind,
    parts: &Bound<'_, PyDict>,
    f: &Bound<'_, PyAny>,
    letters: &[&'static str],
    faults: &Arc<Faults>,
) -> PyResult<(AnyProblem, Option<Functions>)> {
    let mut given = Given::new(parts);
    given.get("F")?;
    let start = match given.get("start")? {
        Some(start) => numbers::vector("x0", &start)?,
        None => return Err(expected("x0", "where to begin, as F is a function", "nothing")),
    };
    let (jacobian, pattern) = (given.get("jac")?, given.get("pattern")?);
    let n = start.len();
    if let Some(k) = start.iter().position(|x| !x.is_finite()) {
        return Err(expected(&format!("x0[{k}]"), "a finite number", start[k]));
    }
    if n == 0 {
        return Err(expected("x0", "at least one variable", "none"));
    }
    if let Some(jacobian) = jacobian.as_ref().filter(|jacobian| !jacobian.is_callable()) {
        return Err(expected("jac", "a function", crate::parts::type_name(jacobian)));
    }
    let (field, functions) =
        function::field(f, jacobian.as_ref(), pattern.as_ref(), &start, faults)?;
    let mut all = letters.to_vec();
    all.extend(["jac", "pattern"]);
    let problem = match kind {
        Kind::Vi => {
            let set = crate::parts::set("set", &given.need("set")?)?;
            given.made(Vi::of(field, set, start), &all)?.into()
        }
        _ => {
            let lower = given.vector_or("lower", n, 0.0)?;
            let upper = given.vector_or("upper", n, f64::INFINITY)?;
            given.made(Mcp::of(field, lower, upper, start), &all)?.into()
        }
    };
    Ok((problem, Some(functions)))
}

/// The parts of a problem that have something to show.
fn shown(problem: &AnyProblem) -> Vec<(&'static str, Shown<'_>)> {
    match problem {
        AnyProblem::Friction(friction) => contact::shown(friction),
        AnyProblem::Complementarity(stated) => {
            let parts = with_complementarity!(stated, p => p.parts());
            let shown = |(name, part)| Some((name, Shown::of(part)?));
            parts.into_iter().filter_map(shown).collect()
        }
    }
}

/// The same problem with other parts; a function of Python stays as it is.
fn changed(problem: &AnyProblem, parts: &Bound<'_, PyDict>) -> PyResult<AnyProblem> {
    fn rebuilt<P: Stated>(
        _: &P,
        old: &[(&'static str, Part<'_>)],
        parts: &Bound<'_, PyDict>,
    ) -> PyResult<P> {
        let mut given = Given::over(parts, old);
        let made = P::from_parts(&mut given);
        given.made(made, &letters(P::PARTS))
    }
    match problem {
        AnyProblem::Friction(friction) => {
            let mut other = friction.clone();
            contact::change(&mut other, parts)?;
            Ok(other.into())
        }
        AnyProblem::Complementarity(Complementarity::Mcp(p)) if p.F.expressions().is_none() => {
            let (mut given, mut other) = (Given::new(parts), p.clone());
            put(&mut given, "lower", &mut other.lower)?;
            put(&mut given, "upper", &mut other.upper)?;
            put(&mut given, "start", &mut other.start)?;
            let valid = other.validate();
            given.made(valid, &["lower", "upper", "start"])?;
            Ok(other.into())
        }
        AnyProblem::Complementarity(Complementarity::Vi(p)) if p.F.expressions().is_none() => {
            let (mut given, mut other) = (Given::new(parts), p.clone());
            put(&mut given, "start", &mut other.start)?;
            if let Some(set) = given.get("set")? {
                other.set = crate::parts::set("set", &set)?;
            }
            let valid = other.validate();
            given.made(valid, &["set", "start"])?;
            Ok(other.into())
        }
        AnyProblem::Complementarity(Complementarity::Mlcp(p)) if is_by_blocks(parts) => {
            let (matrices, (a, b)) = (blocks(p), p.q.split_at(p.equalities));
            let mut old = vec![("a", Part::Vector(a)), ("b", Part::Vector(b))];
            old.extend(matrices.iter().map(|(name, block)| (*name, Part::Matrix(block))));
            rebuilt(p, &old, parts).map(Into::into)
        }
        AnyProblem::Complementarity(stated) => {
            with_complementarity!(stated, p => rebuilt(p, &p.parts(), parts).map(Into::into))
        }
    }
}

/// Whether blocks of a mixed problem are given.
fn is_by_blocks(parts: &Bound<'_, PyDict>) -> bool {
    let given = Given::new(parts);
    ["A", "B", "C", "D", "a", "b"].iter().any(|name| given.is_given(name))
}

/// The blocks of the matrix of a mixed problem, sparse ones of a sparse matrix, in one pass.
fn blocks(p: &Mlcp) -> Vec<(&'static str, Matrix)> {
    let Matrix::Sparse(whole) = &p.M else {
        return p.blocks().into_iter().map(|(name, block)| (name, block.into())).collect();
    };
    let (rows, columns, pairs) = (p.equalities, p.free, p.pairs());
    let mut entries = [const { vec![] }; 4];
    for (i, j, x) in whole.triplets() {
        let (below, beyond) = (i >= rows, j >= columns);
        let block = 2 * usize::from(below) + usize::from(beyond);
        entries[block].push((i - rows * usize::from(below), j - columns * usize::from(beyond), x));
    }
    let shapes =
        [("A", rows, columns), ("C", rows, pairs), ("D", pairs, columns), ("B", pairs, pairs)];
    let made = shapes.into_iter().zip(entries).filter_map(|((name, m, n), entries)| {
        Some((name, Csc::from_triplets(m, n, entries.into_iter()).ok()?.into()))
    });
    made.collect()
}

#[pymethods]
impl Problem {
    /// A problem of a kind that is stated by parts.
    #[staticmethod]
    fn stated(py: Python<'_>, kind: &str, parts: &Bound<'_, PyDict>) -> PyResult<Self> {
        let faults = Arc::new(Faults::default());
        let (problem, functions) = stated(kind, parts, &faults)?;
        let functions = functions.map(|functions| Py::new(py, functions)).transpose()?;
        Ok(Self { faults, functions, ..Self::new(ProblemFile::new(problem)) })
    }

    fn __traverse__(&self, visit: PyVisit<'_>) -> Result<(), PyTraverseError> {
        visit.call(&self.functions)
    }

    /// A problem of contacts.
    #[staticmethod]
    #[pyo3(signature = (parts, dimension=None))]
    fn friction(parts: &Bound<'_, PyDict>, dimension: Option<usize>) -> PyResult<Self> {
        Ok(Self::new(ProblemFile::new(contact::made(parts, dimension)?)))
    }

    /// The problem in a file of any format.
    #[staticmethod]
    fn read(py: Python<'_>, path: PathBuf) -> PyResult<Self> {
        let file = py.detach(|| ProblemFile::read(path)).map_err(mistake)?;
        Ok(Self::new(file))
    }

    /// Writes the problem, with a solution if there is one, in the format of the extension.
    #[pyo3(signature = (path, answer=None))]
    fn save(
        &self,
        py: Python<'_>,
        path: PathBuf,
        answer: Option<&Bound<'_, PyAny>>,
    ) -> PyResult<()> {
        let now = self.file();
        let mut file = (*now).clone();
        if let Some(given) = answer {
            let point = self.whole_point(&file.problem, "answer", given)?;
            file.problem.validate_point(&point).map_err(mistake)?;
            // The judge's word is on the problem that was solved: after an update, or of another problem, it is another.
            let solved = given.cast::<crate::solve::Answer>().ok().map(|answer| answer.get());
            let verdict = match solved.filter(|answer| Arc::ptr_eq(&answer.file, &now)) {
                Some(answer) => answer.answer.verdict.clone(),
                None => self.judged(py, &file.problem, &point, Limits::default().tolerance)?,
            };
            let stored = StoredPoint::new(&file.problem, point, verdict.velocity);
            file.solution = Some(StoredPoint { statuses: verdict.statuses, ..stored });
        }
        self.watched(py, &Arc::default(), || file.write(path))?.map_err(mistake)
    }

    /// Puts other parts in the place of those that are there. The session that is kept goes on.
    fn update(&self, parts: &Bound<'_, PyDict>) -> PyResult<()> {
        let old = self.file();
        let problem = changed(&old.problem, parts)?;
        let ProblemFile { info, drawing, .. } = &*old;
        let mut file = ProblemFile {
            info: info.clone(),
            drawing: drawing.clone(),
            ..ProblemFile::new(problem)
        };
        // Names are those of all variables.
        if file.problem.unknowns() != old.problem.unknowns() {
            file.info.names.clear();
        }
        *self.file.write().unwrap_or_else(PoisonError::into_inner) = Arc::new(file);
        Ok(())
    }

    /// The kind's name.
    #[getter]
    fn kind(&self) -> &'static str {
        self.file().problem.kind().name()
    }

    /// The number of scalar unknowns.
    #[getter]
    fn unknowns(&self) -> usize {
        self.file().problem.unknowns()
    }

    /// The number of contacts, or of pairs where there are no contacts.
    #[getter]
    fn pairs(&self) -> usize {
        match &self.file().problem {
            AnyProblem::Friction(friction) => friction.contacts(),
            AnyProblem::Complementarity(stated) => with_complementarity!(stated, p => p.pairs()),
        }
    }

    /// The number of contacts; `None` where there are no contacts but pairs.
    #[getter]
    fn contacts(&self) -> Option<usize> {
        match &self.file().problem {
            AnyProblem::Friction(friction) => Some(friction.contacts()),
            AnyProblem::Complementarity(_) => None,
        }
    }

    /// The components of a contact; 1 of pairs.
    #[getter]
    fn dimension(&self) -> usize {
        self.file().problem.kind().dimension()
    }

    /// The title in the file.
    #[getter]
    fn title(&self) -> Option<String> {
        self.file().info.title.clone()
    }

    /// The names of the variables.
    #[getter]
    fn names(&self) -> Vec<String> {
        self.file().info.names.clone()
    }

    /// The size in words.
    #[getter]
    fn size(&self) -> String {
        match &self.file().problem {
            AnyProblem::Friction(p) => nonsmooth_problem::plural(p.contacts(), "contact"),
            AnyProblem::Complementarity(stated) => with_complementarity!(stated, p => p.size()),
        }
    }

    /// The names of the parts.
    fn letters(&self) -> Vec<&'static str> {
        shown(&self.file().problem).into_iter().map(|(name, _)| name).collect()
    }

    /// A part by its name: an array, a number, texts, or the arrays of a sparse matrix; `None` where there is none.
    fn part<'py>(&self, py: Python<'py>, name: &str) -> PyResult<Option<Bound<'py, PyAny>>> {
        let file = self.file();
        let part = shown(&file.problem).into_iter().find(|(letter, _)| *letter == name);
        part.map(|(_, part)| part.into_python(py)).transpose()
    }

    /// The parts of the solution that the file has.
    fn solution<'py>(&self, py: Python<'py>) -> PyResult<Option<Bound<'py, PyDict>>> {
        let file = self.file();
        let Some(stored) = &file.solution else { return Ok(None) };
        let partner = match &stored.partner {
            Some(partner) => partner.clone(),
            None => self.watched(py, &Arc::default(), || file.problem.partner(&stored.point))?,
        };
        crate::solve::arrays(py, file.problem.point_parts(&stored.point, &partner)).map(Some)
    }

    /// Another problem, as this is now: to change one leaves the other as it is. A function of Python is the same.
    fn copy(&self, py: Python<'_>) -> Self {
        Self {
            file: RwLock::new(self.file()),
            kept: Mutex::default(),
            faults: self.faults.clone(),
            functions: self.functions(py),
        }
    }

    /// The residuals of a point, by the judge.
    fn judge<'py>(
        &self,
        py: Python<'py>,
        point: &Bound<'py, PyAny>,
        tolerance: f64,
    ) -> PyResult<Bound<'py, PyAny>> {
        let file = self.file();
        let point = self.whole_point(&file.problem, "point", point)?;
        Limits { tolerance, ..Limits::default() }.validate().map_err(mistake)?;
        let verdict = self.judged(py, &file.problem, &point, tolerance)?;
        Ok(pythonize::pythonize(py, &verdict)?)
    }
}

/// A point of the problem: of an answer, of its parts by their names, or of the array that it is made of: z or x, of contacts the impulses r.
pub fn point(problem: &AnyProblem, place: &str, given: &Bound<'_, PyAny>) -> PyResult<AnyPoint> {
    fn by_parts<P: Stated>(_: &P, parts: &Bound<'_, PyDict>) -> PyResult<AnyPoint> {
        let point = P::point_from_parts(|name| match parts.get_item(name)? {
            Some(given) => numbers::vector(name, &given),
            None => Err(expected(name, "this part of a point", "nothing")),
        })?;
        Ok(point.into())
    }
    if let Ok(answer) = given.cast::<crate::solve::Answer>() {
        let answer = answer.get();
        // Arrays of contacts of another dimension may be as long.
        if let (AnyProblem::Friction(ours), AnyProblem::Friction(theirs)) =
            (problem, &answer.file.problem)
            && ours.kind().dimension() != theirs.kind().dimension()
        {
            let what = format!("an answer to a problem {}", ours.kind().name());
            return Err(expected(place, &what, format!("one to {}", theirs.kind().name())));
        }
        return Ok(answer.answer.point.clone());
    }
    fn solution_of<P: Stated>(_: &P) -> &'static [&'static str] {
        P::SOLUTION
    }
    let mut origin = problem.origin();
    let parts = given.cast::<PyDict>().ok();
    let part = |name: &str, into: &mut Vec<f64>| -> PyResult<()> {
        let found = match parts {
            Some(parts) => parts.get_item(name)?,
            None => Some(given.clone()).filter(|_| name == "r"),
        };
        if let Some(found) = found {
            let place = if parts.is_some() { name } else { place };
            *into = match name {
                "r" => numbers::of_contacts(place, &found, problem.kind().dimension())?,
                _ => numbers::vector(place, &found)?,
            };
        }
        Ok(())
    };
    if let Some(parts) = parts {
        let known = match (problem, &origin) {
            // u follows from r.
            (_, AnyPoint::Local(_)) => vec!["r", "u", "l"],
            (_, AnyPoint::Global(_)) => vec!["r", "u", "v", "l"],
            (AnyProblem::Complementarity(stated), _) => {
                with_complementarity!(stated, p => solution_of(p)).to_vec()
            }
            (AnyProblem::Friction(_), _) => vec![],
        };
        for key in parts.keys() {
            let key = key.str()?.to_string();
            if !known.contains(&key.as_str()) {
                let what = format!("the parts {} of a point", known.join(", "));
                return Err(expected(place, &what, key));
            }
        }
        if matches!(problem, AnyProblem::Friction(_)) && !parts.contains("r")? {
            return Err(expected("r", "this part of a point", "nothing"));
        }
    }
    match (problem, &mut origin) {
        (_, AnyPoint::Local(point)) => {
            part("r", &mut point.r)?;
            part("l", &mut point.lambda)?;
        }
        (_, AnyPoint::Global(point)) => {
            part("r", &mut point.r)?;
            part("v", &mut point.v)?;
            part("l", &mut point.lambda)?;
        }
        (AnyProblem::Complementarity(stated), point) => match parts {
            Some(parts) => *point = with_complementarity!(stated, p => by_parts(p, parts))?,
            None => {
                let all = numbers::vector(place, given)?;
                if all.len() != problem.unknowns() {
                    let what = format!("{} numbers", problem.unknowns());
                    return Err(expected(place, &what, all.len()));
                }
                *point = problem.assembled(&all);
            }
        },
        (AnyProblem::Friction(_), _) => {}
    }
    Ok(origin)
}
