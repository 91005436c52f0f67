//! Convex sets in our own TOML: one, or an array of them, each in variables of its own.
//!
//! ```toml
//! set = { ball = { centre = [0, 0], radius = 1 } }         # or box, polyhedron, second_order_cone
//! [[set]]                                                  # a product
//! from = "x1"                                              # perhaps: the first and the last of its variables
//! to = "x3"
//! second_order_cone = {}
//! ```

use std::fmt::Write;

use nonsmooth_linalg::{Csc, Matrix};
use nonsmooth_problem::{ProblemError, Set};
use serde::Deserialize;
use serde::de::{self, Deserializer, MapAccess, SeqAccess, Visitor};

use super::toml::{Given, line, list, matrix_of, quoted, vector, wrong};

/// What stands at the key of a set.
#[derive(Debug)]
pub(super) enum Stated {
    One(Box<Part>),
    Product(Vec<Part>),
}

/// One set: its variables, and exactly one of its sorts.
#[derive(Debug, Default, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub(super) struct Part {
    from: Option<String>,
    to: Option<String>,
    #[serde(rename = "box")]
    bounds: Option<Bounds>,
    polyhedron: Option<Polyhedron>,
    ball: Option<Ball>,
    second_order_cone: Option<Cone>,
}

#[derive(Debug, Default, Deserialize)]
#[serde(deny_unknown_fields, default)]
struct Bounds {
    lower: Option<Vec<f64>>,
    upper: Option<Vec<f64>>,
}

#[derive(Debug, Default, Deserialize)]
#[serde(deny_unknown_fields, default)]
#[allow(non_snake_case)]
struct Polyhedron {
    A: Option<Given>,
    b: Vec<f64>,
    C: Option<Given>,
    d: Vec<f64>,
    lower: Option<Vec<f64>>,
    upper: Option<Vec<f64>>,
}

#[derive(Debug, Deserialize)]
#[serde(deny_unknown_fields)]
struct Ball {
    centre: Option<Vec<f64>>,
    radius: f64,
}

#[derive(Debug, Default, Deserialize)]
#[serde(deny_unknown_fields, default)]
struct Cone {
    dimension: Option<usize>,
}

impl<'de> Deserialize<'de> for Stated {
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        struct Either;
        impl<'de> Visitor<'de> for Either {
            type Value = Stated;

            fn expecting(&self, f: &mut std::fmt::Formatter) -> std::fmt::Result {
                f.write_str("a set: a table with box, polyhedron, ball or second_order_cone, or an array of such")
            }

            fn visit_seq<A: SeqAccess<'de>>(self, all: A) -> Result<Stated, A::Error> {
                let all = de::value::SeqAccessDeserializer::new(all);
                Vec::deserialize(all).map(Stated::Product)
            }

            fn visit_map<A: MapAccess<'de>>(self, all: A) -> Result<Stated, A::Error> {
                let all = de::value::MapAccessDeserializer::new(all);
                Part::deserialize(all).map(|part| Stated::One(part.into()))
            }
        }
        deserializer.deserialize_any(Either)
    }
}

/// A sort of sets with its data, before its variables are counted.
// One a set: its size does not matter.
#[allow(clippy::large_enum_variant)]
enum Sort {
    Box([Option<Vec<f64>>; 2]),
    Polyhedron([(Option<Matrix>, Vec<f64>); 2], [Option<Vec<f64>>; 2]),
    Ball(Option<Vec<f64>>, f64),
    Cone(Option<usize>),
}

impl Sort {
    fn name(&self) -> &'static str {
        match self {
            Self::Box(_) => "box",
            Self::Polyhedron(..) => "polyhedron",
            Self::Ball(..) => "ball",
            Self::Cone(_) => "second_order_cone",
        }
    }

    /// The number of variables, where the data say it.
    fn dim(&self) -> Option<usize> {
        let of = |x: &Option<Vec<f64>>| x.as_ref().map(Vec::len);
        match self {
            Self::Box([lower, upper]) => of(lower).or(of(upper)),
            Self::Polyhedron(rows, [lower, upper]) => {
                let columns = rows.iter().find_map(|(m, _)| Some(m.as_ref()?.ncols()));
                columns.or(of(lower)).or(of(upper))
            }
            Self::Ball(centre, _) => of(centre),
            Self::Cone(dimension) => *dimension,
        }
    }

    /// The set, in n variables.
    fn set(self, n: usize) -> Result<Set, ProblemError> {
        let infinite = |sign: f64| vec![sign * f64::INFINITY; n];
        Ok(match self {
            // As of a complementarity problem.
            Self::Box([lower, upper]) => Set::Box {
                lower: lower.unwrap_or_else(|| vec![0.0; n]),
                upper: upper.unwrap_or_else(|| infinite(1.0)),
            },
            Self::Polyhedron([(a, mut b), (c, d)], [lower, upper]) => {
                let lower = lower.unwrap_or_else(|| infinite(-1.0));
                let upper = upper.unwrap_or_else(|| infinite(1.0));
                for (name, m) in [("A", &a), ("C", &c)] {
                    if let Some(m) = m
                        && m.ncols() != n
                    {
                        return Err(wrong(name, format!("{n} columns"), m.ncols()));
                    }
                }
                let mut rows = triplets(a.as_ref());
                let mut m = a.map_or(0, |a| a.nrows());
                let all = [("lower", &lower, -1.0), ("upper", &upper, 1.0)];
                for (name, bounds, sign) in all {
                    if bounds.len() != n {
                        return Err(wrong(name, format!("{n} entries"), bounds.len()));
                    }
                    for (j, x) in bounds.iter().map(|x| sign * x).enumerate() {
                        if x.is_nan() || x == f64::NEG_INFINITY {
                            let expected = format!("a number or {}", sign * f64::INFINITY);
                            return Err(wrong(format!("{name}[{j}]"), expected, bounds[j]));
                        }
                        if x.is_finite() {
                            rows.push((m, j, sign));
                            b.push(x);
                            m += 1;
                        }
                    }
                }
                let equalities = c.as_ref().map_or(0, Matrix::nrows);
                Set::Polyhedron {
                    A: Csc::from_triplets(m, n, rows.into_iter())?,
                    b,
                    C: Csc::from_triplets(equalities, n, triplets(c.as_ref()).into_iter())?,
                    d,
                }
            }
            Self::Ball(centre, radius) => {
                Set::Ball { centre: centre.unwrap_or_else(|| vec![0.0; n]), radius }
            }
            Self::Cone(_) => Set::SecondOrderCone { dimension: n },
        })
    }
}

/// The entries of a matrix; of rows, those that are not zero.
fn triplets(m: Option<&Matrix>) -> Vec<(usize, usize, f64)> {
    let mut all: Vec<(usize, usize, f64)> = vec![];
    match m {
        Some(Matrix::Sparse(m)) => m.triplets().for_each(|entry| all.push(entry)),
        Some(m) => {
            m.for_each(|i, j, x| {
                if x != 0.0 {
                    all.push((i, j, x));
                }
            });
        }
        None => {}
    }
    all
}

impl Part {
    /// The only sort that is stated; `room`: the most rows or columns of a matrix.
    fn sort(&mut self, at: &str, room: usize) -> Result<Sort, ProblemError> {
        let within = |sort: &str, e: ProblemError| e.within(&format!("{at}.{sort}"));
        let mut all = vec![];
        if let Some(Bounds { lower, upper }) = self.bounds.take() {
            all.push(Sort::Box([lower, upper]));
        }
        if let Some(polyhedron) = self.polyhedron.take() {
            let matrix = |name: &str, given: Option<Given>, right: Vec<f64>| {
                let given = given.map(|given| matrix_of(name, given, room)).transpose();
                given.map(|m| (m, right)).map_err(|e| within("polyhedron", e))
            };
            let rows = [
                matrix("A", polyhedron.A, polyhedron.b)?,
                matrix("C", polyhedron.C, polyhedron.d)?,
            ];
            for ((m, right), [m_name, name]) in rows.iter().zip([["A", "b"], ["C", "d"]]) {
                let count = m.as_ref().map_or(0, Matrix::nrows);
                if right.len() != count {
                    let expected = format!("{count} entries (rows of {m_name})");
                    return Err(within("polyhedron", wrong(name, expected, right.len())));
                }
            }
            all.push(Sort::Polyhedron(rows, [polyhedron.lower, polyhedron.upper]));
        }
        if let Some(Ball { centre, radius }) = self.ball.take() {
            all.push(Sort::Ball(centre, radius));
        }
        if let Some(Cone { dimension }) = self.second_order_cone.take() {
            all.push(Sort::Cone(dimension));
        }
        let found: Vec<_> = all.iter().map(Sort::name).collect();
        let found = if found.is_empty() { "none".into() } else { found.join(" and ") };
        let expected = "one of box, polyhedron, ball, second_order_cone; several sets are an array";
        match (all.pop(), all.is_empty()) {
            (Some(sort), true) => Ok(sort),
            _ => Err(wrong(at, expected, found)),
        }
    }
}

/// The set of the n variables with these names, or `x1`, …, `xn`. `at` is its key, `room` the most rows or columns of a matrix.
///
/// Where no part says which are its variables, they follow each other and are all; else those of no part are free.
pub(super) fn read(
    stated: Stated,
    at: &str,
    n: usize,
    names: &[String],
    room: usize,
) -> Result<Set, ProblemError> {
    let (one, parts) = match stated {
        Stated::One(part) => (true, vec![*part]),
        Stated::Product(parts) => (false, parts),
    };
    let placed = parts.iter().any(|part| part.from.is_some() || part.to.is_some());
    let mut sets: Vec<(usize, String, Set)> = vec![];
    let mut next = 0;
    for (k, mut part) in parts.into_iter().enumerate() {
        let at = if one { at.to_owned() } else { format!("{at}[{k}]") };
        let sort = part.sort(&at, room)?;
        let variable = |key: &str, name: &Option<String>| match name {
            Some(name) => {
                index(name, n, names).map(Some).map_err(|e| e.within(&format!("{at}.{key}")))
            }
            None => Ok(None),
        };
        let (from, to) = (variable("from", &part.from)?, variable("to", &part.to)?);
        if let (Some(first), Some(last)) = (from, to)
            && last < first
        {
            let expected = format!("`{}` or one behind it", named(first, names));
            return Err(wrong(format!("{at}.to"), expected, format!("`{}`", named(last, names))));
        }
        let inside = format!("{at}.{}", sort.name());
        let own = sort.dim();
        let first = match (from, to, own) {
            (Some(first), ..) => first,
            (None, Some(last), Some(own)) => (last + 1).saturating_sub(own),
            (None, ..) => next,
        };
        let count = match (to, own) {
            (Some(last), _) => (last + 1).saturating_sub(first),
            (None, Some(own)) => own,
            (None, None) => n.saturating_sub(first),
        };
        let most = n.saturating_sub(first);
        if count == 0 || count > most || own.is_some_and(|own| own != count) {
            let expected = match to {
                Some(_) => format!("{count} variables, as from and to say"),
                None if most == 0 => format!("some of the {n} variables to be left for it"),
                None => format!("1 to {most} of the {n} variables"),
            };
            return Err(wrong(inside, expected, own.unwrap_or(count)));
        }
        let set = sort.set(count).map_err(|e| e.within(&inside))?;
        set.validate().map_err(|e| e.within(&inside))?;
        next = first + count;
        sets.push((first, at, set));
    }
    sets.sort_by_key(|set| set.0);
    let mut product = vec![];
    let mut next = 0;
    let free = |count: usize| Set::Box {
        lower: vec![f64::NEG_INFINITY; count],
        upper: vec![f64::INFINITY; count],
    };
    for (first, at, set) in sets {
        if first < next {
            let expected = "variables of no other part";
            return Err(wrong(at, expected, named(first, names)));
        }
        if first > next {
            product.push(free(first - next));
        }
        next = first + set.dim();
        product.push(set);
    }
    if next < n && !placed {
        return Err(wrong(at, format!("a set of all {n} variables"), next));
    }
    if next < n {
        product.push(free(n - next));
    }
    match product.pop() {
        Some(only) if one && product.is_empty() => Ok(only),
        last => Ok(Set::Product(product.into_iter().chain(last).collect())),
    }
}

/// The name of variable i.
fn named(i: usize, names: &[String]) -> String {
    names.get(i).cloned().unwrap_or_else(|| format!("x{}", i + 1))
}

fn index(name: &str, n: usize, names: &[String]) -> Result<usize, ProblemError> {
    let found = match names {
        [] => name.strip_prefix('x').and_then(|k| k.parse::<usize>().ok()?.checked_sub(1)),
        names => names.iter().position(|known| known == name),
    };
    let listed = || match n {
        0..=6 => (0..n).map(|i| named(i, names)).collect::<Vec<_>>().join(", "),
        _ => format!("{}, ..., {}", named(0, names), named(n - 1, names)),
    };
    let refused = || wrong("", format!("a variable ({})", listed()), format!("`{name}`"));
    found.filter(|i| *i < n).ok_or_else(refused)
}

/// The tables of a set, whose variables have these names or none.
pub(super) fn write(out: &mut String, key: &str, set: &Set, names: &[String]) {
    for (first, part) in set.parts() {
        if let Set::Product(_) = set {
            line(out, &format!("\n[[{key}]]"));
            for (end, i) in [("from", first), ("to", first + part.dim() - 1)] {
                line(out, &format!("{end} = {}", quoted(&named(i, names))));
            }
        } else {
            line(out, "");
        }
        match part {
            Set::Box { lower, upper } => {
                line(out, &format!("[{key}.box]"));
                vector(out, "lower", lower);
                vector(out, "upper", upper);
            }
            Set::Polyhedron { A, b, C, d } => {
                line(out, &format!("[{key}.polyhedron]"));
                for (m, m_name, right, name) in [(A, "A", b, "b"), (C, "C", d, "d")] {
                    if m.nrows() > 0 {
                        rows(out, m_name, m);
                        vector(out, name, right);
                    }
                }
            }
            Set::Ball { centre, radius } => {
                line(out, &format!("[{key}.ball]"));
                vector(out, "centre", centre);
                line(out, &format!("radius = {}", super::Digits(*radius)));
            }
            Set::SecondOrderCone { dimension } => {
                line(out, &format!("[{key}.second_order_cone]"));
                line(out, &format!("dimension = {dimension}"));
            }
            Set::Product(_) => {}
        }
    }
}

/// A matrix by its rows where that is short and says all, else by its entries.
fn rows(out: &mut String, name: &str, m: &Csc) {
    const SHORT: usize = 400;
    let zeros = m.triplets().any(|(_, _, x)| x == 0.0);
    if m.nrows() * m.ncols() <= SHORT && !zeros {
        let mut dense = vec![vec![0.0; m.ncols()]; m.nrows()];
        m.triplets().for_each(|(i, j, x)| dense[i][j] = x);
        line(out, &format!("{name} = ["));
        dense.iter().for_each(|row| line(out, &format!("  {},", list(row))));
        return line(out, "]");
    }
    let mut entries = String::new();
    for (i, j, x) in m.triplets() {
        // Writing to a String cannot fail.
        let _ = write!(entries, "[{i}, {j}, {}], ", super::Digits(x));
    }
    let shape = format!("shape = [{}, {}]", m.nrows(), m.ncols());
    line(out, &format!("{name} = {{ {shape}, entries = [{}] }}", entries.trim_end_matches(", ")));
}
