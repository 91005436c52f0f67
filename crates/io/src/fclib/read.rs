//! Reading.

use std::path::Path;

use nonsmooth_linalg::{Bsr, Csc};
use nonsmooth_problem::check::Law;
use nonsmooth_problem::{
    Bounds, Friction, FrictionGlobal, FrictionLocal, GlobalPoint, LocalPoint, ProblemError,
    RollingData, RowsGlobal, RowsLocal,
};

use super::{DRAWING, Sizes, check_vector, group, invalid};
use crate::error::one_line;
use crate::folder::{Folder, Used, fault, open};
use crate::hdf5::{Dataset, Link, Object, Type};
use crate::{Info, IoError, ProblemFile, StoredPoint};

/// Reads a file.
pub(super) fn parse(path: &Path, bytes: &[u8]) -> Result<ProblemFile, IoError> {
    let data = open(path, bytes)?;
    let root = Folder::root(path, &data)?;
    let problem = valid(&root)?;
    let info = info(&root.need(&group(&problem)[1..])?)?;
    let sizes = Sizes::of(&problem);
    let solution = root.folder("solution")?.map(|g| point(&g, sizes)).transpose()?;
    let ours = root.folder(DRAWING.0)?.map(|g| g.text(DRAWING.1)).transpose()?;
    let drawing = ours.flatten();
    let mut file = ProblemFile { info, solution, drawing, ..ProblemFile::new(problem) };
    if let Some(guesses) = root.folder("guesses")? {
        let number = guesses.int("number_of_guesses")?;
        if number < 0 {
            return Err(guesses.error("number_of_guesses", "a number of at least 0", number));
        }
        for k in 1..=number {
            file.guesses.push(point(&guesses.need(&k.to_string())?, sizes)?);
        }
    }
    Ok(file)
}

/// The problem of a file.
pub(super) fn problem(path: &Path, bytes: &[u8]) -> Result<Friction, IoError> {
    let data = open(path, bytes)?;
    valid(&Folder::root(path, &data)?)
}

/// The one problem of a file.
fn valid(root: &Folder) -> Result<Friction, IoError> {
    let problem = stated(root)?;
    problem.validate().map_err(invalid(root.file, group(&problem)))?;
    Ok(problem)
}

/// As [`valid`], not validated as a whole.
fn stated(root: &Folder) -> Result<Friction, IoError> {
    const NAMES: [&str; 4] =
        ["fclib_local", "fclib_global", "fclib_local_rolling", "fclib_global_rolling"];
    let mut groups = vec![];
    for name in NAMES {
        groups.extend(root.folder(name)?.map(|group| (name, group)));
    }
    match &groups[..] {
        [("fclib_local", g)] => Ok(match g.spacedim(&[2, 3])? {
            2 => Friction::Local2(local(g)?),
            _ => Friction::Local3(local(g)?),
        }),
        [("fclib_global", g)] => Ok(match g.spacedim(&[2, 3])? {
            2 => Friction::Global2(global(g)?),
            _ => Friction::Global3(global(g)?),
        }),
        [("fclib_local_rolling", g)] => {
            g.spacedim(&[5])?;
            Ok(Friction::RollingLocal(local(g)?))
        }
        [(_, g)] => {
            g.spacedim(&[5])?;
            Ok(Friction::RollingGlobal(global(g)?))
        }
        [(one, _), (other, _), ..] => {
            let found = format!("both /{one} and /{other}");
            Err(IoError::Root { file: root.file.into(), found: one_line(found) })
        }
        [] => {
            let others = root.groups();
            let has = |name: &str| others.iter().any(|group| group == name);
            let found = match others.is_empty() {
                true => "no group".into(),
                false if ["frames", "scene", "steps"].into_iter().all(has) => {
                    "a trajectory, which `nonsmooth play` reads".into()
                }
                false => format!("only /{}", others.join(", /")),
            };
            Err(IoError::Root { file: root.file.into(), found: one_line(found) })
        }
    }
}

#[allow(non_snake_case)]
fn local<const D: usize, L: Law<D>>(g: &Folder) -> Result<FrictionLocal<D, L>, IoError> {
    let vectors = g.need("vectors")?;
    let mu = g.mu(&vectors, "s")?;
    let m = D * mu.len();
    let contacts = format!("{D} for each entry of vectors/mu");
    let W = g.matrix("W", (m, m), &contacts)?;
    let q = vectors.vector("q", m, &contacts)?;
    let stated = vectors.stated_bounds()?;
    let bilateral = match (g.folder("V")?, g.folder("R")?, vectors.has("s")?) {
        (None, None, false) if stated.is_empty() => None,
        (Some(_), Some(_), true) => {
            let s = vectors.reals("s", None)?;
            let p = s.len();
            let V = g.matrix("V", (m, p), &format!("{contacts}, by the entries of vectors/s"))?;
            let R = g.matrix("R", (p, p), "the entries of vectors/s")?;
            Some(RowsLocal { V, R, s, bounds: vectors.bounds(p)? })
        }
        (V, R, s) => {
            let parts = [("V", V.is_some()), ("R", R.is_some()), ("vectors/s", s)];
            return Err(g.incomplete(&[&parts[..], &stated].concat()));
        }
    };
    let mu_r = L::Rolling::of(vectors.rolling(L::DISKS)?);
    Ok(FrictionLocal { W: Bsr::from_csc(&W), q, mu, mu_r, rows: bilateral })
}

#[allow(non_snake_case)]
fn global<const D: usize, L: Law<D>>(g: &Folder) -> Result<FrictionGlobal<D, L>, IoError> {
    let vectors = g.need("vectors")?;
    let mu = g.mu(&vectors, "b")?;
    let m = D * mu.len();
    let f = vectors.reals("f", None)?;
    let n = f.len();
    let contacts = format!("{D} for each entry of vectors/mu");
    let rows = |name| g.need(name).and_then(|matrix| matrix.int("m")).ok();
    // Where M and H agree it is f that is wrong.
    if let Some(m) = rows("M").filter(|m| rows("H") == Some(*m) && *m != n as i64) {
        let expected = format!("{m} entries (the rows of M and H)");
        return Err(vectors.error("f", expected, format!("{n} entries")));
    }
    let M = g.matrix("M", (n, n), "the entries of vectors/f")?;
    let H = g.matrix("H", (n, m), &format!("the entries of vectors/f, by {contacts}"))?;
    let w = vectors.vector("w", m, &contacts)?;
    let stated = vectors.stated_bounds()?;
    let bilateral = match (g.folder("G")?, vectors.has("b")?) {
        (None, false) if stated.is_empty() => None,
        (Some(_), true) => {
            let b = vectors.reals("b", None)?;
            let why = "the entries of vectors/f, by the entries of vectors/b";
            let (G, bounds) = (g.matrix("G", (n, b.len()), why)?, vectors.bounds(b.len())?);
            Some(RowsGlobal { G, b, bounds })
        }
        (G, b) => {
            let parts = [("G", G.is_some()), ("vectors/b", b)];
            return Err(g.incomplete(&[&parts[..], &stated].concat()));
        }
    };
    let mu_r = L::Rolling::of(vectors.rolling(L::DISKS)?);
    Ok(FrictionGlobal { M, H, f, w, mu, mu_r, rows: bilateral })
}

fn info(problem: &Folder) -> Result<Info, IoError> {
    let Some(g) = problem.folder("info")? else {
        return Ok(Info::default());
    };
    let count = |name: &str| -> Result<Option<usize>, IoError> {
        let fault = |e| fault(g.file, &g.path, e);
        let found = g.data.attribute(g.group.address, name).map_err(fault)?;
        // FCLIB has a C int here; what is none is not known.
        let one =
            |d: &Dataset| matches!(d.kind, Type::Int { .. }) && d.shape.iter().all(|n| *n == 1);
        let Some(found) = found.filter(one) else { return Ok(None) };
        let value = g.data.ints(&found).map_err(fault)?.first().copied();
        Ok(value.and_then(|n| u32::try_from(i32::try_from(n).ok()?).ok()).map(|n| n as usize))
    };
    Ok(Info {
        title: g.text("title")?,
        description: g.text("description")?,
        math_info: g.text("math_info")?,
        dofs: count("numberOfDegreeOfFreedom")?,
        involved_ds: count("numberOfInvolvedDS")?,
        names: vec![],
    })
}

fn point(g: &Folder, sizes: Sizes) -> Result<StoredPoint, IoError> {
    let part = |(name, len, meaning)| match len {
        None => Ok(None),
        // Writers differ on whether a part without entries is there.
        Some(0) if !g.has(name)? => Ok(None),
        Some(len) => Ok(Some(g.vector(name, len, meaning)?).filter(|x| !x.is_empty())),
    };
    let [v, u, r, l] = sizes.parts().map(part);
    let (v, u, r, lambda) = (v?, u?, r?.unwrap_or_default(), l?.unwrap_or_default());
    let point = match sizes.v {
        None => LocalPoint { r, lambda }.into(),
        Some(_) => GlobalPoint { v: v.unwrap_or_default(), r, lambda }.into(),
    };
    Ok(StoredPoint { point, partner: Some(u.unwrap_or_default()), statuses: vec![] })
}

/// What FCLIB has of its own.
impl Folder<'_, '_> {
    /// The names of the groups in it, for people.
    fn groups(&self) -> Vec<String> {
        let is_group = |link: &Link| match link {
            Link::Hard(address) => matches!(self.data.object(*address), Ok(Object::Group(_))),
            Link::Soft(_) | Link::External => false,
        };
        let groups = self.group.links.iter().filter(|(_, link)| is_group(link));
        groups.map(|(name, _)| String::from_utf8_lossy(name).into_owned()).collect()
    }

    fn vector(&self, name: &str, len: usize, meaning: &str) -> Result<Vec<f64>, IoError> {
        let x = self.reals(name, None)?;
        check_vector(self.file, &self.place(name), &x, len, meaning)?;
        Ok(x)
    }

    /// What the impulses of p scalar rows may be: our own addition to FCLIB. Without it all are free. Whether bounds cross the problem itself looks.
    fn bounds(&self, p: usize) -> Result<Bounds, IoError> {
        let side = |name: &str| {
            let dataset = self.dataset(name)?;
            let x = self.data.reals(&dataset).map_err(self.fault(name))?;
            match x.len() == p {
                true => Ok(x),
                false => {
                    let expected = format!("{p} entries (scalar rows)");
                    Err(self.error(name, expected, format!("{} entries", x.len())))
                }
            }
        };
        match (self.has("lower")?, self.has("upper")?) {
            (false, false) => Ok(Bounds::default()),
            (true, true) => Ok(Bounds { lower: side("lower")?, upper: side("upper")? }),
            (lower, upper) => Err(self.incomplete(&[("lower", lower), ("upper", upper)])),
        }
    }

    /// The bounds that are there, as parts of the problem, see [`incomplete`](Self::incomplete).
    fn stated_bounds(&self) -> Result<Vec<(&'static str, bool)>, IoError> {
        let mut stated = vec![];
        for (name, part) in [("lower", "vectors/lower"), ("upper", "vectors/upper")] {
            if self.has(name)? {
                stated.push((part, true));
            }
        }
        Ok(stated)
    }

    fn spacedim(&self, known: &[i64]) -> Result<i64, IoError> {
        match self.int("spacedim")? {
            d if known.contains(&d) => Ok(d),
            // Planar rolling friction has a normal, a tangent and an angle.
            3 => Err(self.error("spacedim", "5 (rolling friction in the plane is not known)", 3)),
            d => {
                let names: Vec<_> = known.iter().map(i64::to_string).collect();
                Err(self.error("spacedim", names.join(" or "), d))
            }
        }
    }

    /// The coefficients of rolling friction, of a law that has any; their number the problem looks at itself.
    fn rolling(&self, disks: usize) -> Result<Vec<f64>, IoError> {
        if disks > 1 { self.reals("mu_r", None) } else { Ok(vec![]) }
    }

    /// `mu`, checked first: all other sizes follow from its length. Scalar rows, which the vector `rows` is of, are a problem without contacts too: that of a mechanism whose joints alone act.
    fn mu(&self, vectors: &Folder, rows: &str) -> Result<Vec<f64>, IoError> {
        let mu = vectors.reals("mu", None)?;
        if mu.is_empty() && !vectors.has(rows)? {
            let problem = ProblemError::Empty { place: "mu".into() };
            return Err(invalid(self.file, &self.path)(problem));
        }
        Ok(mu)
    }

    /// Some of these parts are there and some are not.
    fn incomplete(&self, parts: &[(&str, bool)]) -> IoError {
        let names = |present: bool| {
            let of = parts.iter().filter(|p| p.1 == present).map(|p| self.place(p.0));
            of.collect::<Vec<_>>().join(" and ")
        };
        let expected = format!("it beside {} (bilateral constraints)", names(true));
        IoError::data(self.file, names(false), expected, "nothing of that name")
    }

    /// A matrix of the given shape, in any of FCLIB's storages.
    fn matrix(&self, name: &str, shape: (usize, usize), why: &str) -> Result<Csc, IoError> {
        let g = self.need(name)?;
        let (m, n, nz) = (g.int("m")?, g.int("n")?, g.int("nz")?);
        let (rows, columns) = shape;
        // Before anything is allocated by them.
        if (usize::try_from(m), usize::try_from(n)) != (Ok(rows), Ok(columns)) {
            let expected = format!("{rows} × {columns} ({why})");
            return Err(self.error(name, expected, format!("{m} × {n}")));
        }
        // Arrays may have room beyond the last entry, whose content means nothing.
        let (p, i, x) = match nz {
            -1 | -2 => {
                let (what, count, bound) =
                    if nz == -1 { ("row", columns, rows) } else { ("column", rows, columns) };
                let pointers = g.pointers(count)?;
                let why = format!("p[{count}]");
                let used = Some(Used { entries: pointers[count] as u64, why: &why, room: None });
                let (i, x) = (g.ints("i", used)?, g.reals("x", used)?);
                let minor = g.indices("i", what, &i, bound)?;
                // Not before i and x are known to be as long.
                let runs = pointers.windows(2).enumerate();
                let major = runs.flat_map(|(k, w)| (w[0]..w[1]).map(move |_| k)).collect();
                if nz == -1 { (major, minor, x) } else { (minor, major, x) }
            }
            nz if nz >= 0 => {
                // More than nz without the room for it are entries that nz forgets.
                let room = g.int("nzmax").unwrap_or(nz);
                let used = Some(Used { entries: nz as u64, why: "nz", room: Some(room) });
                let (p, i, x) = (g.ints("p", used)?, g.ints("i", used)?, g.reals("x", used)?);
                (g.indices("p", "column", &p, columns)?, g.indices("i", "row", &i, rows)?, x)
            }
            _ => {
                let expected = "a number of triplets, -1 (columns) or -2 (rows)";
                return Err(g.error("nz", expected, nz));
            }
        };
        let entries = i.iter().zip(&p).zip(&x).map(|((&i, &p), &x)| (i, p, x));
        Csc::from_triplets(rows, columns, entries).map_err(|e| self.error(name, "a matrix", e))
    }

    /// Indices checked to lie below `bound`.
    fn indices(
        &self,
        name: &str,
        what: &str,
        indices: &[i64],
        bound: usize,
    ) -> Result<Vec<usize>, IoError> {
        let check = |(k, &index): (usize, &i64)| {
            usize::try_from(index).ok().filter(|&index| index < bound).ok_or_else(|| {
                let expected = format!("a {what} index of at least 0 and below {bound}");
                self.error(format_args!("{name}[{k}]"), expected, index)
            })
        };
        indices.iter().enumerate().map(check).collect()
    }

    /// The compressed pointers `p`, checked: they start at 0 and never fall.
    fn pointers(&self, count: usize) -> Result<Vec<i64>, IoError> {
        let p = self.ints("p", None)?;
        if p.len() != count + 1 {
            let expected = format!("{} pointers (one more than columns or rows)", count + 1);
            return Err(self.error("p", expected, format!("{} entries", p.len())));
        }
        if p[0] != 0 {
            return Err(self.error("p[0]", "0", p[0]));
        }
        if let Some(k) = p.windows(2).position(|w| w[1] < w[0]) {
            let place = format!("p[{}]", k + 1);
            return Err(self.error(place, format!("at least {} (p[{k}])", p[k]), p[k + 1]));
        }
        Ok(p)
    }
}
