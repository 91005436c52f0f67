//! What `nonsmooth info` says of nonlinear complementarity problems and variational inequalities.

use nonsmooth_analysis::{Apart, Class, Classes, Finding, Sampled};
use nonsmooth_problem::field::{self, Field};
use nonsmooth_problem::{LcpPoint, Mcp, Problem, Set, Vi};
use serde_json::{Value, json};

use super::linear::{Entries, classes, classes_text};
use crate::report::{self, Object, count, number, row};

/// What there is to say of a problem.
pub(super) struct Facts {
    domain: Domain,
    source: String,
    rows: usize,
    /// Of expressions: operations of an evaluation, and affine rows.
    expressions: Option<[usize; 2]>,
    /// Entries of the Jacobian: all, the fewest and the most of a row, on the diagonal.
    entries: [usize; 4],
    /// The natural residual at the start, where F is defined there.
    residual: Option<f64>,
    /// `F(x) = M x + q`, where all rows are affine.
    affine: Option<Affine>,
    /// Of others.
    sampled: Option<Sampled>,
}

/// Where x may be.
enum Domain {
    Box(Bounds),
    /// The parts of a set, one by one.
    Set(Vec<SetPart>),
}

/// A part of a set: a sort with its numbers, of each by name how many it has.
struct SetPart {
    sort: &'static str,
    first: usize,
    dimension: usize,
    numbers: Vec<(&'static str, usize)>,
}

/// Variables by their bounds.
struct Bounds {
    lower: usize,
    upper: usize,
    both: usize,
    free: usize,
    fixed: usize,
}

struct Affine {
    matrix: Entries,
    classes: Classes,
    /// Whether M and q have the coefficients without any rounding.
    exact: bool,
}

/// Parts of a set that are listed.
const PARTS: usize = 6;

/// Pairs of points on which monotonicity is tried.
const PAIRS: usize = 100;

impl Bounds {
    fn of(lower: &[f64], upper: &[f64]) -> Self {
        let mut out = Self { lower: 0, upper: 0, both: 0, free: 0, fixed: 0 };
        for (&l, &u) in lower.iter().zip(upper) {
            *match (l.is_finite(), u.is_finite()) {
                _ if l == u => &mut out.fixed,
                (true, true) => &mut out.both,
                (true, false) => &mut out.lower,
                (false, true) => &mut out.upper,
                (false, false) => &mut out.free,
            } += 1;
        }
        out
    }

    fn all(&self) -> [(usize, &'static str, &'static str); 5] {
        [
            (self.lower, "lower", "with a lower bound"),
            (self.upper, "upper", "with an upper bound"),
            (self.both, "both", "between two bounds"),
            (self.free, "free", "free"),
            (self.fixed, "fixed", "fixed"),
        ]
    }

    fn text(&self) -> String {
        let some: Vec<_> = self.all().into_iter().filter(|b| b.0 > 0).collect();
        let some: Vec<_> = some.iter().map(|(n, _, what)| format!("{n} {what}")).collect();
        some.join(", ")
    }
}

impl SetPart {
    fn of((first, set): (usize, &Set)) -> Self {
        let (sort, numbers) = match set {
            Set::Box { lower, upper } => {
                let all = Bounds::of(lower, upper).all();
                ("box", all.map(|(n, name, _)| (name, n)).into())
            }
            Set::Polyhedron { A, C, .. } => {
                ("polyhedron", vec![("inequalities", A.nrows()), ("equalities", C.nrows())])
            }
            Set::Ball { .. } => ("ball", vec![]),
            Set::SecondOrderCone { .. } => ("second_order_cone", vec![]),
            Set::Product(_) => ("product", vec![]),
        };
        Self { sort, first, dimension: set.dim(), numbers }
    }

    fn text(&self) -> String {
        let some = self.numbers.iter().filter(|(_, n)| *n > 0);
        let words = |name: &str| match name {
            "lower" | "upper" => {
                format!("with {} {name} bound", if name == "upper" { "an" } else { "a" })
            }
            "both" => "between two bounds".into(),
            other => other.to_owned(),
        };
        let some: Vec<_> = some.map(|(name, n)| format!(", {n} {}", words(name))).collect();
        let sort = self.sort.replace("second_order", "second-order").replace('_', " ");
        format!("{sort} in {}{}", count(self.dimension, "variable"), some.concat())
    }

    fn json(&self) -> Value {
        let mut all = json!({"sort": self.sort, "first": self.first, "dimension": self.dimension});
        if let Some(all) = all.as_object_mut() {
            all.extend(self.numbers.iter().map(|(name, n)| ((*name).to_owned(), json!(n))));
        }
        all
    }
}

impl Facts {
    pub(super) fn of(problem: &Mcp) -> Self {
        let domain = Domain::Box(Bounds::of(&problem.lower, &problem.upper));
        let facts = Self::with(problem, &*problem.F, domain);
        let sampled = facts.affine.is_none().then(|| Sampled::of(problem, PAIRS, 0));
        Self { sampled, ..facts }
    }

    /// Nothing is sampled: a pair of points apart from the set says nothing.
    pub(super) fn of_inequality(problem: &Vi) -> Self {
        let parts = problem.set.parts().into_iter().map(SetPart::of).collect();
        Self::with(problem, &*problem.F, Domain::Set(parts))
    }

    fn with<P: Problem<Point = LcpPoint>>(problem: &P, field: &dyn Field, domain: Domain) -> Self {
        let (n, pattern) = (field.dim(), field.pattern());
        let per_row = || (0..n).map(|i| pattern.row(i).len());
        let diagonal = (0..n).filter(|i| pattern.row(*i).binary_search(i).is_ok());
        let expressions = field.expressions();
        let affine = field::linear(field).map(|(m, _, exact)| {
            let m = m.into();
            Affine { matrix: Entries::of(&m), classes: classes(&m), exact }
        });
        let start = problem.origin();
        let measured = problem.gauge().map(|mut gauge| problem.measure(&start, &mut gauge));
        let defined = field.evaluator().value(&start.z, &mut vec![0.0; n]);
        Self {
            domain,
            source: field.source(),
            rows: n,
            expressions: expressions
                .map(|f| [f.operations(), f.affine_rows().iter().filter(|a| **a).count()]),
            entries: [
                pattern.len(),
                per_row().min().unwrap_or(0),
                per_row().max().unwrap_or(0),
                diagonal.count(),
            ],
            residual: measured.ok().filter(|_| defined).map(|m| m.absolute),
            sampled: None,
            affine,
        }
    }

    /// As JSON.
    pub(super) fn json(&self) -> Object {
        let domain = match &self.domain {
            Domain::Box(bounds) => {
                let all = bounds.all().into_iter();
                let all: Object = all.map(|(n, name, _)| (name.into(), json!(n))).collect();
                json!({"bounds": all})
            }
            Domain::Set(parts) => {
                json!({"set": parts.iter().map(SetPart::json).collect::<Vec<_>>()})
            }
        };
        let [entries, least, most, diagonal] = self.entries;
        let affine = self
            .affine
            .as_ref()
            .map(|a| json!({"exact": a.exact, "M": a.matrix.json(), "classes": a.classes}));
        let mut all = report::fields(domain);
        all.extend(report::fields(json!({
            "source": self.source,
            "operations": self.expressions.map(|e| e[0]),
            "affine_rows": self.expressions.map(|e| e[1]),
            "jacobian": {
                "entries": entries,
                "entries_per_row": {"min": least, "max": most},
                "diagonal": diagonal,
            },
            "residual_at_start": self.residual,
            "affine": affine,
            "monotone": self.answer(Class::PositiveSemidefinite, |s| &s.not_monotone),
            "p0": self.answer(Class::P0, |s| &s.not_p0),
            "sampled": self.sampled,
        })));
        all
    }

    /// Yes or no where it is proved, else null.
    fn answer(&self, class: Class, refuted: impl Fn(&Sampled) -> &Option<Apart>) -> Value {
        let of = |a: &Affine| match a.classes.get(class) {
            _ if !a.exact => Value::Null,
            Finding::Proven { .. } => true.into(),
            Finding::Refuted { .. } => false.into(),
            Finding::Unknown { .. } => Value::Null,
        };
        match (&self.affine, &self.sampled) {
            (Some(affine), _) => of(affine),
            (None, Some(sampled)) if refuted(sampled).is_some() => false.into(),
            _ => Value::Null,
        }
    }

    /// As text.
    pub(super) fn text(&self, text: &mut String) {
        match &self.domain {
            Domain::Box(bounds) => row(text, "bounds", bounds.text()),
            Domain::Set(parts) => {
                for (k, part) in parts.iter().take(PARTS).enumerate() {
                    row(text, if k == 0 { "set" } else { "" }, part.text());
                }
                if parts.len() > PARTS {
                    row(text, "", format!("and {} others", parts.len() - PARTS));
                }
                if parts.iter().all(|part| part.sort == "box") {
                    row(text, "", "over a box it is a mixed complementarity problem (mcp)");
                }
            }
        }
        let mut f = self.source.clone();
        if let Some([operations, affine]) = self.expressions {
            let operations = count(operations, "operation");
            f += &format!(", {operations}; affine: {affine} of {}", count(self.rows, "row"));
        }
        row(text, "F", f);
        let [entries, least, most, diagonal] = self.entries;
        let entry = if entries == 1 { "entry" } else { "entries" };
        let jacobian =
            format!("{entries} {entry}, {least} to {most} a row, {diagonal} on the diagonal");
        row(text, "Jacobian", jacobian);
        let start = match self.residual {
            Some(residual) => format!("natural residual {}", number(residual)),
            None => "F is not defined there".into(),
        };
        row(text, "start", start);
        if let Some(Affine { matrix, classes, exact }) = &self.affine {
            let rounded = if *exact { "" } else { ", coefficients rounded" };
            row(text, "affine", format!("F(x) = M x + q{rounded}"));
            row(text, "M", matrix.text());
            classes_text(text, classes);
        }
        let Some(Sampled { pairs, undefined, not_monotone, not_p0 }) = &self.sampled else {
            return;
        };
        let outside = match undefined {
            0 => String::new(),
            n => format!("; F is not defined at {n} others"),
        };
        let of_pairs = format!("on {}{outside}", count(*pairs, "sampled pair"));
        let monotone = match (not_monotone, pairs) {
            (Some(apart), _) => format!("not monotone: a pair of points shows it{}", shown(apart)),
            (None, 0) => "unknown: F is defined at no sampled pair of points".into(),
            (None, _) => format!("monotone {of_pairs}, which proves nothing"),
        };
        row(text, "monotone", monotone);
        match not_p0 {
            Some(apart) => {
                row(text, "P0", format!("no: a pair of points shows it{}", shown(apart)))
            }
            None if *pairs > 0 => row(text, "P0", of_pairs),
            None => {}
        }
    }
}

/// A pair of short points.
fn shown(Apart { x, y }: &Apart) -> String {
    const SHORT: usize = 4;
    let list = |x: &[f64]| x.iter().map(|x| format!("{x:.6}")).collect::<Vec<_>>().join(", ");
    match x.len() {
        0..=SHORT => format!(", ({}) and ({})", list(x), list(y)),
        _ => String::new(),
    }
}
