//! Writing.

use std::borrow::Cow;
use std::io::{Seek, SeekFrom, Write};
use std::ops::Range;
use std::path::Path;

use hdf5_pure::{AttrValue, Error, File, FileBuilder, FormatError, LibVer};
use nonsmooth_linalg::Csc;
use nonsmooth_problem::check::Law;
use nonsmooth_problem::{
    AnyPoint, AnyProblem, Bounds, Friction, FrictionGlobal, FrictionLocal, Problem, RollingData,
};

use super::{DRAWING, SOLUTION, Sizes, check_vector, group, guarded, invalid, read};
use crate::folder::{Out, failed, fault, open};
use crate::format::bytes as bytes_of;
use crate::hdf5::{Dataset, Group, Link, Object, Type};
use crate::replace::{WRITABLE, check_target, replace};
use crate::{Info, IoError, ProblemFile, StoredPoint};

pub(super) fn write(path: &Path, file: &ProblemFile) -> Result<(), IoError> {
    let file = build(path, file)?;
    replace(path, |temporary| file.write(temporary).map_err(|e| failed(path, e)))
}

pub(super) fn to_bytes(path: &Path, file: &ProblemFile) -> Result<Vec<u8>, IoError> {
    build(path, file)?.finish().map_err(|e| failed(path, e))
}

fn build(path: &Path, content: &ProblemFile) -> Result<FileBuilder, IoError> {
    let problem = content.contacts(path)?;
    let root = group(problem);
    problem.validate().map_err(invalid(path, root))?;
    let mut file = FileBuilder::new();
    // The oldest format that the builder knows, for the sake of old readers.
    file.with_libver_bounds(LibVer::V18, LibVer::V18);
    let mut top = |name: &str, fill: &dyn Fn(&mut Out) -> Result<(), IoError>| {
        let group = file.create_group(&name[1..]);
        let mut g = Out { file: path, path: name.into(), group };
        fill(&mut g)?;
        file.add_group(g.group.finish());
        Ok::<(), IoError>(())
    };
    top(root, &|g| {
        match problem {
            Friction::Local2(p) => local(g, p)?,
            Friction::Local3(p) => local(g, p)?,
            Friction::RollingLocal(p) => local(g, p)?,
            Friction::Global2(p) => global(g, p)?,
            Friction::Global3(p) => global(g, p)?,
            Friction::RollingGlobal(p) => global(g, p)?,
        }
        g.child("info", |g| info(g, &content.info))
    })?;
    if let Some(solution) = &content.solution {
        top(SOLUTION, &|g| point(g, solution, problem))?;
    }
    if !content.guesses.is_empty() {
        top("/guesses", &|g| {
            g.int("number_of_guesses", content.guesses.len())?;
            let mut guesses = content.guesses.iter().enumerate();
            guesses.try_for_each(|(k, x)| g.child(&(k + 1).to_string(), |g| point(g, x, problem)))
        })?;
    }
    if let Some(drawing) = &content.drawing {
        top(&format!("/{}", DRAWING.0), &|g| g.text(DRAWING.1, drawing))?;
    }
    Ok(file)
}

pub(super) fn write_solution(path: &Path, solution: &StoredPoint) -> Result<(), IoError> {
    // First of all: to read a pipe may never end.
    check_target(path)?;
    let bytes = bytes_of(path)?;
    let parts = stored_parts(path, SOLUTION, solution, &read::problem(path, &bytes)?)?;
    let places = places(path, &bytes, &parts)?;
    let links = root_links(path, &bytes)?;
    drop(bytes);
    replace(path, |temporary| {
        std::fs::copy(path, temporary).map_err(|e| IoError::os(path, WRITABLE, e))?;
        if let Some(places) = places {
            return overwrite(temporary, &places).map_err(|e| IoError::os(path, WRITABLE, e));
        }
        guarded(path, || edit(path, temporary, &parts))?;
        // The library that edits knows no soft links, and must not lose them.
        let links_now = root_links(path, &bytes_of(temporary)?)?;
        match links == links_now {
            true => Ok(()),
            false => Err(soft_links(path, "/")),
        }
    })
}

fn soft_links(path: &Path, place: &str) -> IoError {
    let what = "writing a solution into a group with soft links";
    IoError::Unsupported { file: path.into(), place: place.into(), what }
}

/// The names in the root group but for the solution, with whether each is an object of this file.
fn root_links(path: &Path, bytes: &[u8]) -> Result<Vec<(Vec<u8>, bool)>, IoError> {
    let root = open(path, bytes)?.root().map_err(|e| fault(path, "/", e))?;
    let others = root.links.iter().filter(|(name, _)| **name != b"solution");
    Ok(others.map(|(name, link)| (name.to_vec(), matches!(link, Link::Hard(_)))).collect())
}

/// New values and where in the file they belong.
type Places<'x> = Vec<(Range<usize>, &'x [f64])>;

/// Where the values of a `/solution` that is there can be replaced where they stand, so that the file does not grow; `None`: nowhere.
fn places<'x>(path: &Path, bytes: &[u8], parts: &'x [Part]) -> Result<Option<Places<'x>>, IoError> {
    let file = open(path, bytes)?;
    let root = file.root().map_err(|e| fault(path, "/", e))?;
    if matches!(root.links.get(&b"solution"[..]), Some(Link::Soft(_) | Link::External)) {
        return Err(soft_links(path, SOLUTION));
    }
    // What is damaged is replaced as a whole.
    let Ok(Some(Object::Group(group))) = file.find(&root, "solution") else { return Ok(None) };
    let plain = |group: &Group| {
        group.references == 1
            && group.links.len() == parts.len()
            && group.links.values().all(|link| matches!(link, Link::Hard(_)))
    };
    if !plain(&group) {
        return Ok(None);
    }
    let place = |d: &Dataset, x: &[f64]| -> Option<Range<usize>> {
        let double = matches!(
            d.kind,
            Type::Real { big: false, sign: 63, exponent: (52, 11), mantissa: (0, 52), .. }
        );
        let fits = d.references == 1 && double && d.shape[..] == [x.len() as u64];
        fits.then(|| if x.is_empty() { Some(0..0) } else { file.place(d) }).flatten()
    };
    let mut places: Places = vec![];
    for (name, x) in parts {
        let Ok(Some(Object::Dataset(d))) = file.find(&group, name) else { return Ok(None) };
        match place(&d, x) {
            Some(range)
                if places.iter().all(|(p, _)| p.end <= range.start || range.end <= p.start) =>
            {
                places.push((range, x));
            }
            _ => return Ok(None),
        }
    }
    Ok(Some(places))
}

fn overwrite(file: &Path, places: &Places) -> std::io::Result<()> {
    let mut file = std::fs::OpenOptions::new().write(true).open(file)?;
    for (range, x) in places {
        file.seek(SeekFrom::Start(range.start as u64))?;
        let bytes: Vec<u8> = x.iter().flat_map(|x| x.to_le_bytes()).collect();
        file.write_all(&bytes)?;
    }
    Ok(())
}

/// Replaces `/solution` in the file `temporary`, which is to become `path`.
fn edit(path: &Path, temporary: &Path, parts: &[Part]) -> Result<(), IoError> {
    let fail = |e| failed(path, e);
    let file = File::open_rw(temporary).map_err(fail)?;
    let root = file.root();
    match root.group("solution") {
        Err(Error::Format(FormatError::PathNotFound(_))) => {}
        Ok(_) | Err(Error::NotAGroup(_)) => root.delete("solution").map_err(fail)?,
        Err(e) => return Err(lookup(path, SOLUTION, e)),
    }
    // An old root group with a soft link, which cannot be listed, would be spoilt by the change.
    root.groups().map_err(|e| lookup(path, "/", e))?;
    root.create_group_with("solution", |g| {
        for (name, x) in parts {
            g.create_dataset(name, |d| {
                d.with_f64_data(x);
            });
        }
    })
    .map_err(fail)?;
    file.commit().map_err(fail)?;
    drop(root);
    file.close().map_err(fail)
}

/// The error of looking up the name at `place` in a group.
fn lookup(file: &Path, place: &str, e: Error) -> IoError {
    match e {
        // Groups of the old format keep no address for a soft link, and the library takes that for one.
        Error::Format(FormatError::UnexpectedEof { expected: usize::MAX, .. }) => {
            soft_links(file, place)
        }
        e => IoError::hdf5(file, place, e),
    }
}

/// A failure of the HDF5 writer: nearly always the system's.
fn local<const D: usize, L: Law<D>>(
    g: &mut Out,
    problem: &FrictionLocal<D, L>,
) -> Result<(), IoError> {
    g.int("spacedim", D)?;
    g.matrix("W", &problem.W.to_csc())?;
    if let Some(b) = &problem.rows {
        g.matrix("V", &b.V)?;
        g.matrix("R", &b.R)?;
    }
    g.child("vectors", |g| {
        g.reals("q", &problem.q);
        g.reals("mu", &problem.mu);
        if L::DISKS > 1 {
            g.reals("mu_r", problem.mu_r.values());
        }
        if let Some(b) = &problem.rows {
            g.reals("s", &b.s);
            g.bounds(&b.bounds);
        }
        Ok(())
    })
}

fn global<const D: usize, L: Law<D>>(
    g: &mut Out,
    problem: &FrictionGlobal<D, L>,
) -> Result<(), IoError> {
    g.int("spacedim", D)?;
    g.matrix("M", &problem.M)?;
    g.matrix("H", &problem.H)?;
    if let Some(b) = &problem.rows {
        g.matrix("G", &b.G)?;
    }
    g.child("vectors", |g| {
        g.reals("f", &problem.f);
        g.reals("w", &problem.w);
        g.reals("mu", &problem.mu);
        if L::DISKS > 1 {
            g.reals("mu_r", problem.mu_r.values());
        }
        if let Some(b) = &problem.rows {
            g.reals("b", &b.b);
            g.bounds(&b.bounds);
        }
        Ok(())
    })
}

fn info(g: &mut Out, info: &Info) -> Result<(), IoError> {
    let texts = [
        ("title", &info.title),
        ("description", &info.description),
        ("math_info", &info.math_info),
    ];
    for (name, text) in texts {
        if let Some(text) = text {
            g.text(name, text)?;
        }
    }
    let counts = [("numberOfDegreeOfFreedom", info.dofs), ("numberOfInvolvedDS", info.involved_ds)];
    for (name, count) in counts {
        if let Some(count) = count {
            let count = g.as_int(format_args!("@{name}"), count)?;
            g.group.set_attr(name, AttrValue::I32Array(vec![count]));
        }
    }
    Ok(())
}

fn point(g: &mut Out, point: &StoredPoint, problem: &Friction) -> Result<(), IoError> {
    for (name, x) in stored_parts(g.file, &g.path, point, problem)? {
        g.reals(name, &x);
    }
    Ok(())
}

/// A part of a point: its name and values.
type Part<'a> = (&'static str, Cow<'a, [f64]>);

/// The parts of a point that FCLIB stores, checked against the problem.
fn stored_parts<'a>(
    file: &Path,
    place: &str,
    stored: &'a StoredPoint,
    problem: &Friction,
) -> Result<Vec<Part<'a>>, IoError> {
    let (v, r, lambda) = match &stored.point {
        AnyPoint::Local(p) => (&[][..], &p.r, &p.lambda),
        AnyPoint::Global(p) => (&p.v[..], &p.r, &p.lambda),
        _ => {
            return Err(IoError::data(file, place, "a point of contacts", "one of another kind"));
        }
    };
    let parts = Sizes::of(problem).parts();
    let check = |(name, len, meaning): (&str, Option<usize>, _), x: &[f64]| {
        check_vector(file, &format!("{place}/{name}"), x, len.unwrap_or(0), meaning)
    };
    for (part, x) in [(parts[0], v), (parts[2], r), (parts[3], lambda)] {
        check(part, x)?;
    }
    let u = match &stored.partner {
        Some(u) => Cow::from(u),
        None => {
            let problem = AnyProblem::from(problem.clone());
            problem.validate_point(&stored.point).map_err(IoError::problem(file))?;
            problem.partner(&stored.point).into()
        }
    };
    check(parts[1], &u)?;
    let all = parts.into_iter().zip([v.into(), u, r.into(), lambda.into()]);
    Ok(all.filter(|(part, _)| part.1.is_some()).map(|(part, x)| (part.0, x)).collect())
}

/// What FCLIB has of its own.
impl Out<'_> {
    /// The bounds of scalar rows, where there are any.
    fn bounds(&mut self, bounds: &Bounds) {
        if !bounds.are_free() {
            self.reals("lower", &bounds.lower);
            self.reals("upper", &bounds.upper);
        }
    }

    /// Triplets, column by column: row `i`, column `p`.
    fn matrix(&mut self, name: &str, a: &Csc) -> Result<(), IoError> {
        self.child(name, |g| {
            for (name, x) in
                [("nzmax", a.nnz()), ("m", a.nrows()), ("n", a.ncols()), ("nz", a.nnz())]
            {
                g.int(name, x)?;
            }
            // Indices lie below m and n, which fit.
            let column = |j: usize| std::iter::repeat_n(j as i32, a.column(j).0.len());
            let p: Vec<i32> = (0..a.ncols()).flat_map(column).collect();
            let i: Vec<i32> = a.row_idx().iter().map(|&i| i as i32).collect();
            g.group.create_dataset("p").with_i32_data(&p);
            g.group.create_dataset("i").with_i32_data(&i);
            g.reals("x", a.values());
            Ok(())
        })
    }
}
