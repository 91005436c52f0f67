//! Frictional contact problems by their parts: FCLIB's letters, those of the local form or those of the global one.

use std::borrow::Cow;

use nonsmooth_linalg::{Bsr, Csc};
use nonsmooth_problem::check::Law;
use nonsmooth_problem::{
    AnyProblem, Bounds, Friction, FrictionGlobal, FrictionLocal, OfAny, Problem, RollingData,
    RollingGlobal, RollingLocal, RowsGlobal, RowsLocal, with_friction,
};
use pyo3::prelude::*;
use pyo3::types::PyDict;

use crate::numbers::{self, Scalar, by_contact, of_contacts};
use crate::parts::{Given, Shown, put};
use crate::{expected, mistake};

/// The letters of the local form.
const LOCAL: &[&str] = &["W", "q", "mu", "V", "R", "s", "lower", "upper"];
/// The letters of the global form.
const GLOBAL: &[&str] = &["M", "H", "f", "w", "mu", "G", "b", "lower", "upper"];

/// The same with rolling friction.
const ROLLING_LOCAL: &[&str] = &["W", "q", "mu", "mu_r", "V", "R", "s", "lower", "upper"];
const ROLLING_GLOBAL: &[&str] = &["M", "H", "f", "w", "mu", "mu_r", "G", "b", "lower", "upper"];

/// The components of a contact where nothing says how many there are.
const USUAL: usize = 3;

/// A problem of contacts.
pub trait Contact: OfAny {
    /// Its letters.
    const LETTERS: &'static [&'static str];

    /// The problem of its parts, not yet validated.
    fn of(given: &mut Given<'_, '_>) -> PyResult<Self>;

    /// Puts the parts that are given in the place of those that are there.
    fn change(&mut self, given: &mut Given<'_, '_>) -> PyResult<()>;

    /// The parts.
    fn shown(&self) -> Vec<(&'static str, Shown<'_>)>;

    /// Checks shapes and values.
    fn checked(&self) -> PyResult<()>;
}

/// A problem of what is given by letters: of the local form where W is among them.
pub fn made(parts: &Bound<'_, PyDict>, dimension: Option<usize>) -> PyResult<AnyProblem> {
    let mut given = Given::new(parts);
    let is_local = given.is_given("W") || given.is_given("q") || given.is_given("R");
    if is_local && given.is_given("M") {
        return Err(expected("Friction", "W, q and mu, or M, H, f, w and mu", "letters of both"));
    }
    if given.is_given("mu_r") {
        // Five components a contact, whatever the arrays seem to be.
        return match is_local {
            true => stated::<RollingLocal>(parts),
            false => stated::<RollingGlobal>(parts),
        };
    }
    let place = if is_local { "q" } else { "w" };
    let (size, rows) = match given.get(place)? {
        Some(free) => by_contact(place, &free).map(|(all, columns)| (Some(all.len()), columns))?,
        None => (None, None),
    };
    let contacts = match given.get("mu")? {
        Some(mu) => match numbers::scalar_or_vector("mu", &mu)? {
            Scalar::One(_) => None,
            Scalar::Each(all) => Some(all.len()),
        },
        None => None,
    };
    let by_size = contacts.filter(|&n| n > 0).and_then(|n| Some(size? / n));
    let known = dimension.or(rows).or(by_size);
    if let (None, Some(n)) = (known, size)
        && !n.is_multiple_of(USUAL)
        && n.is_multiple_of(2)
    {
        let what = "3 components for each contact, or dimension=2 for 2 of them";
        return Err(expected(place, what, format!("{n} components")));
    }
    match (is_local, known.unwrap_or(USUAL)) {
        (true, 2) => stated::<FrictionLocal<2>>(parts),
        (true, 3) => stated::<FrictionLocal<3>>(parts),
        (false, 2) => stated::<FrictionGlobal<2>>(parts),
        (false, 3) => stated::<FrictionGlobal<3>>(parts),
        _ => Err(expected(place, "2 or 3 components for each contact of mu", {
            format!("{} components of {} contacts", size.unwrap_or(0), contacts.unwrap_or(0))
        })),
    }
}

fn stated<P: Contact>(parts: &Bound<'_, PyDict>) -> PyResult<AnyProblem> {
    let mut given = Given::new(parts);
    let problem = P::of(&mut given)?;
    given.finish(P::LETTERS)?;
    problem.checked()?;
    Ok(problem.into())
}

/// Puts other parts into a problem, which is of no more use where they are refused.
pub fn change(problem: &mut Friction, parts: &Bound<'_, PyDict>) -> PyResult<()> {
    fn change<P: Contact>(problem: &mut P, parts: &Bound<'_, PyDict>) -> PyResult<()> {
        let mut given = Given::new(parts);
        problem.change(&mut given)?;
        given.finish(P::LETTERS)?;
        problem.checked()
    }
    with_friction!(problem, p => change(p, parts))
}

/// The parts of a problem.
pub fn shown(problem: &Friction) -> Vec<(&'static str, Shown<'_>)> {
    with_friction!(problem, p => p.shown())
}

/// mu, one for each of so many contacts.
fn mu(given: &mut Given<'_, '_>, contacts: usize) -> PyResult<Vec<f64>> {
    coefficients("mu", given, contacts)
}

/// The coefficients of that name, one for each of so many contacts.
fn coefficients(
    name: &'static str,
    given: &mut Given<'_, '_>,
    contacts: usize,
) -> PyResult<Vec<f64>> {
    match given.get(name)? {
        Some(mu) => Ok(match numbers::scalar_or_vector(name, &mu)? {
            Scalar::One(mu) => vec![mu; contacts],
            Scalar::Each(all) => all,
        }),
        None if contacts == 0 => Ok(vec![]),
        None => Err(expected(name, "this part", "nothing")),
    }
}

/// Those of rolling friction, of a law that has them.
fn mu_r<L: Law<D>, const D: usize>(
    given: &mut Given<'_, '_>,
    contacts: usize,
) -> PyResult<L::Rolling> {
    let values = match L::DISKS {
        1 => vec![],
        _ => coefficients("mu_r", given, contacts)?,
    };
    Ok(L::Rolling::of(values))
}

fn put_mu_r<L: Law<D>, const D: usize>(
    given: &mut Given<'_, '_>,
    contacts: usize,
    into: &mut L::Rolling,
) -> PyResult<()> {
    if L::DISKS > 1 && given.is_given("mu_r") {
        *into = mu_r::<L, D>(given, contacts)?;
    }
    Ok(())
}

fn bounds(given: &mut Given<'_, '_>, rows: usize) -> PyResult<Bounds> {
    if !given.is_given("lower") && !given.is_given("upper") {
        return Ok(Bounds::default());
    }
    Ok(Bounds {
        lower: given.vector_or("lower", rows, f64::NEG_INFINITY)?,
        upper: given.vector_or("upper", rows, f64::INFINITY)?,
    })
}

/// As [`put`], of n bounds, for which one number may stand.
fn put_bound(
    given: &mut Given<'_, '_>,
    name: &'static str,
    n: usize,
    into: &mut Vec<f64>,
) -> PyResult<()> {
    if given.is_given(name) {
        *into = given.vector_or(name, n, 0.0)?;
    }
    Ok(())
}

/// As [`put`], of a vector by contacts with D components each.
fn put_by_contact<const D: usize>(
    given: &mut Given<'_, '_>,
    name: &'static str,
    into: &mut Vec<f64>,
) -> PyResult<()> {
    if let Some(other) = given.get(name)? {
        *into = of_contacts(name, &other, D)?;
    }
    Ok(())
}

fn put_mu(given: &mut Given<'_, '_>, into: &mut Vec<f64>) -> PyResult<()> {
    let contacts = into.len();
    if given.is_given("mu") {
        *into = mu(given, contacts)?;
    }
    Ok(())
}

fn put_bounds(given: &mut Given<'_, '_>, rows: usize, into: &mut Bounds) -> PyResult<()> {
    if given.is_given("lower") || given.is_given("upper") {
        let [lower, upper] = [f64::NEG_INFINITY, f64::INFINITY];
        let mut old = std::mem::take(into);
        if old.lower.is_empty() {
            old = Bounds { lower: vec![lower; rows], upper: vec![upper; rows] };
        }
        put_bound(given, "lower", rows, &mut old.lower)?;
        put_bound(given, "upper", rows, &mut old.upper)?;
        *into = old;
    }
    Ok(())
}

/// Refuses matrices of scalar rows without the vector that goes with them.
fn without_rows(given: &Given<'_, '_>, vector: &str, letters: &[&str]) -> PyResult<()> {
    match letters.iter().find(|letter| given.is_given(letter)) {
        Some(letter) => Err(expected(vector, &format!("this part beside {letter}"), "nothing")),
        None => Ok(()),
    }
}

fn no_rows(given: &Given<'_, '_>, letters: &[&str]) -> PyResult<()> {
    match letters.iter().find(|letter| given.is_given(letter)) {
        Some(letter) => Err(expected(letter, "a problem with scalar rows", "one without any")),
        None => Ok(()),
    }
}

impl<const D: usize, L: Law<D>> Contact for FrictionLocal<D, L>
where
    Self: OfAny + Problem,
{
    const LETTERS: &'static [&'static str] = if L::DISKS > 1 { ROLLING_LOCAL } else { LOCAL };

    fn of(given: &mut Given<'_, '_>) -> PyResult<Self> {
        let q = match given.get("q")? {
            Some(q) => of_contacts("q", &q, D)?,
            None if given.is_given("W") => return Err(expected("q", "this part", "nothing")),
            None => vec![],
        };
        let mu = mu(given, q.len() / D)?;
        let w = match given.get("W")? {
            Some(w) => numbers::bsr::<D>("W", &w)?,
            None => Bsr::from_rows(0, &[]),
        };
        let rows = match given.get("s")? {
            None => {
                without_rows(given, "s", &["V", "R"])?;
                no_rows(given, &["lower", "upper"])?;
                None
            }
            Some(s) => {
                let s = numbers::vector("s", &s)?;
                let v = match given.get("V")? {
                    Some(v) => numbers::csc("V", &v)?,
                    None => Csc::zeros(q.len(), s.len()),
                };
                let r = numbers::csc("R", &given.need("R")?)?;
                let bounds = bounds(given, s.len())?;
                Some(RowsLocal { V: v, R: r, s, bounds })
            }
        };
        let mu_r = mu_r::<L, D>(given, mu.len())?;
        Ok(Self { W: w, q, mu, mu_r, rows })
    }

    fn change(&mut self, given: &mut Given<'_, '_>) -> PyResult<()> {
        put_by_contact::<D>(given, "q", &mut self.q)?;
        put_mu(given, &mut self.mu)?;
        put_mu_r::<L, D>(given, self.mu.len(), &mut self.mu_r)?;
        if let Some(w) = given.get("W")? {
            self.W = numbers::bsr::<D>("W", &w)?;
        }
        let Some(rows) = &mut self.rows else {
            return no_rows(given, &["V", "R", "s", "lower", "upper"]);
        };
        put(given, "s", &mut rows.s)?;
        if let Some(v) = given.get("V")? {
            rows.V = numbers::csc("V", &v)?;
        }
        if let Some(r) = given.get("R")? {
            rows.R = numbers::csc("R", &r)?;
        }
        put_bounds(given, rows.s.len(), &mut rows.bounds)
    }

    fn shown(&self) -> Vec<(&'static str, Shown<'_>)> {
        let mut all = vec![
            ("W", Shown::blocks(&self.W)),
            ("q", Shown::Vector(&self.q)),
            ("mu", Shown::Vector(&self.mu)),
        ];
        if L::DISKS > 1 {
            all.push(("mu_r", Shown::Vector(self.mu_r.values())));
        }
        if let Some(rows) = &self.rows {
            all.push(("V", Shown::Sparse(Cow::Borrowed(&rows.V))));
            all.push(("R", Shown::Sparse(Cow::Borrowed(&rows.R))));
            all.push(("s", Shown::Vector(&rows.s)));
            all.extend(shown_bounds(&rows.bounds));
        }
        all
    }

    fn checked(&self) -> PyResult<()> {
        self.validate().map_err(mistake)
    }
}

fn shown_bounds(bounds: &Bounds) -> impl Iterator<Item = (&'static str, Shown<'_>)> {
    let both = [("lower", &bounds.lower), ("upper", &bounds.upper)];
    both.into_iter().filter(|(_, x)| !x.is_empty()).map(|(name, x)| (name, Shown::Vector(x)))
}

impl<const D: usize, L: Law<D>> Contact for FrictionGlobal<D, L>
where
    Self: OfAny + Problem,
{
    const LETTERS: &'static [&'static str] = if L::DISKS > 1 { ROLLING_GLOBAL } else { GLOBAL };

    fn of(given: &mut Given<'_, '_>) -> PyResult<Self> {
        let m = numbers::csc("M", &given.need("M")?)?;
        let f = given.need_vector("f")?;
        let w = match given.get("w")? {
            Some(w) => of_contacts("w", &w, D)?,
            None if given.is_given("H") || given.is_given("mu") => {
                return Err(expected("w", "this part", "nothing"));
            }
            None => vec![],
        };
        let mu = mu(given, w.len() / D)?;
        let h = match given.get("H")? {
            Some(h) => numbers::csc("H", &h)?,
            None => Csc::zeros(f.len(), 0),
        };
        let rows = match given.get("b")? {
            None => {
                without_rows(given, "b", &["G"])?;
                no_rows(given, &["lower", "upper"])?;
                None
            }
            Some(b) => {
                let b = numbers::vector("b", &b)?;
                let g = numbers::csc("G", &given.need("G")?)?;
                let bounds = bounds(given, b.len())?;
                Some(RowsGlobal { G: g, b, bounds })
            }
        };
        let mu_r = mu_r::<L, D>(given, mu.len())?;
        Ok(Self { M: m, H: h, f, w, mu, mu_r, rows })
    }

    fn change(&mut self, given: &mut Given<'_, '_>) -> PyResult<()> {
        put(given, "f", &mut self.f)?;
        put_by_contact::<D>(given, "w", &mut self.w)?;
        put_mu(given, &mut self.mu)?;
        put_mu_r::<L, D>(given, self.mu.len(), &mut self.mu_r)?;
        if let Some(m) = given.get("M")? {
            self.M = numbers::csc("M", &m)?;
        }
        if let Some(h) = given.get("H")? {
            self.H = numbers::csc("H", &h)?;
        }
        let Some(rows) = &mut self.rows else {
            return no_rows(given, &["G", "b", "lower", "upper"]);
        };
        put(given, "b", &mut rows.b)?;
        if let Some(g) = given.get("G")? {
            rows.G = numbers::csc("G", &g)?;
        }
        put_bounds(given, rows.b.len(), &mut rows.bounds)
    }

    fn shown(&self) -> Vec<(&'static str, Shown<'_>)> {
        let sparse = |matrix| Shown::Sparse(Cow::Borrowed(matrix));
        let mut all = vec![
            ("M", sparse(&self.M)),
            ("H", sparse(&self.H)),
            ("f", Shown::Vector(&self.f)),
            ("w", Shown::Vector(&self.w)),
            ("mu", Shown::Vector(&self.mu)),
        ];
        if L::DISKS > 1 {
            all.push(("mu_r", Shown::Vector(self.mu_r.values())));
        }
        if let Some(rows) = &self.rows {
            all.push(("G", sparse(&rows.G)));
            all.push(("b", Shown::Vector(&rows.b)));
            all.extend(shown_bounds(&rows.bounds));
        }
        all
    }

    fn checked(&self) -> PyResult<()> {
        self.validate().map_err(mistake)
    }
}
