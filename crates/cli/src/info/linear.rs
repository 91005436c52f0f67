//! What `nonsmooth info` says of linear complementarity problems.

use nonsmooth_analysis::{Classes, Effort, Finding};
use nonsmooth_linalg::Matrix;
use nonsmooth_problem::{Complementarity, Stated, with_complementarity};
use nonsmooth_solve::guarantees::{Guarantee, guaranteed};
use serde_json::{Value, json};

use super::symmetry;
use crate::report::{self, Object, count, number, row};

/// What there is to say of a problem.
pub(super) struct Facts {
    matrices: Vec<(&'static str, Entries)>,
    q: Right,
    /// What is known of M; of problems that have no other.
    classes: Option<Classes>,
    /// The solvers that are sure to work; of an LCP.
    guaranteed: Vec<Guarantee>,
    /// Whether z = 0 solves the problem; of an LCP.
    trivial: bool,
}

/// What the entries of a matrix say at a glance.
pub(super) struct Entries {
    rows: usize,
    columns: usize,
    dense: bool,
    /// Entries that are not zero.
    nonzeros: usize,
    /// `max |a_ij − a_ji| / max |a_ij|`; of square matrices.
    asymmetry: Option<f64>,
    /// Entries on the diagonal: positive, zero, negative.
    diagonal: [usize; 3],
    /// Entries off the diagonal: positive, negative.
    off: [usize; 2],
    /// The largest moduli of the rows, from the least to the largest; zero rows left out.
    scale: Option<(f64, f64)>,
    zero_rows: usize,
}

/// What q says at a glance.
struct Right {
    negative: usize,
    zero: usize,
    norm: f64,
}

impl Facts {
    pub(super) fn of(problem: &Complementarity) -> Self {
        let (matrices, blocks, classified, q) = with_complementarity!(problem, p => {
            (p.matrices(), p.blocks(), p.classified(), p.right())
        });
        let mut matrices: Vec<_> = matrices.into_iter().map(|(n, m)| (n, Entries::of(m))).collect();
        matrices.extend(blocks.into_iter().map(|(name, block)| (name, Entries::of(&block.into()))));
        let classes = classified.map(classes);
        let is_lcp = matches!(problem, Complementarity::Lcp(_));
        let negative = q.iter().filter(|q| **q < 0.0).count();
        Self {
            guaranteed: classes.as_ref().filter(|_| is_lcp).map_or(vec![], guaranteed),
            classes,
            matrices,
            q: Right {
                negative,
                zero: q.iter().filter(|q| **q == 0.0).count(),
                norm: nonsmooth_linalg::norm(q),
            },
            trivial: is_lcp && negative == 0,
        }
    }
}

/// What the entries, a few factorisations, and of small matrices exact tests say of M.
pub(super) fn classes(m: &Matrix) -> Classes {
    /// Rows above which more than a factorisation or two takes long.
    const MANY: usize = 2000;
    match m.nrows() {
        0..=MANY => Classes::of(m, Effort::default()),
        _ => Classes::quick(m),
    }
}

/// Classes in three lines: those that M is in, is not in, and those of which nothing is known.
pub(super) fn classes_text(text: &mut String, classes: &Classes) {
    let (mut is, mut is_not, mut unknown) = (vec![], vec![], vec![]);
    for (class, finding) in classes.iter() {
        match finding {
            Finding::Proven { .. } => is.push(class.to_string()),
            Finding::Refuted { witness, .. } => is_not.push(format!("{class} ({witness})")),
            Finding::Unknown { why } => unknown.push(format!("{class} ({why})")),
        }
    }
    for (label, all) in [("M is", is), ("M is not", is_not), ("unknown", unknown)] {
        if !all.is_empty() {
            row(text, label, all.join(", "));
        }
    }
}

impl Entries {
    pub(super) fn of(m: &Matrix) -> Self {
        let (rows, columns) = (m.nrows(), m.ncols());
        let mut diagonal = [0, rows.min(columns), 0];
        let mut off = [0; 2];
        let (mut nonzeros, mut largest) = (0, vec![0.0_f64; rows]);
        m.for_each(|i, j, x| {
            largest[i] = largest[i].max(x.abs());
            nonzeros += usize::from(x != 0.0);
            match (i == j, x > 0.0) {
                _ if x == 0.0 => {}
                (true, positive) => {
                    diagonal[1] -= 1;
                    diagonal[if positive { 0 } else { 2 }] += 1;
                }
                (false, positive) => off[usize::from(!positive)] += 1,
            }
        });
        let there = || largest.iter().copied().filter(|x| *x > 0.0);
        Self {
            rows,
            columns,
            dense: matches!(m, Matrix::Dense(_)),
            nonzeros,
            asymmetry: (rows == columns && rows > 0).then(|| m.asymmetry()).flatten(),
            diagonal,
            off,
            scale: (nonzeros > 0)
                .then(|| (there().fold(f64::INFINITY, f64::min), there().fold(0.0, f64::max))),
            zero_rows: rows - there().count(),
        }
    }

    fn density(&self) -> f64 {
        self.nonzeros as f64 / (self.rows * self.columns).max(1) as f64
    }

    /// The signs in a few words; a Z-matrix has no positive entry off its diagonal.
    fn signs(&self) -> String {
        let [positive, zero, negative] = self.diagonal;
        let diagonal = match self.diagonal {
            [_, 0, 0] => "positive diagonal".into(),
            [0, _, 0] => "zero diagonal".into(),
            _ => {
                let each = [(positive, "positive"), (zero, "zero"), (negative, "negative")];
                let some: Vec<_> = each.iter().filter(|e| e.0 > 0).collect();
                let some: Vec<_> = some.iter().map(|(n, what)| format!("{n} {what}")).collect();
                format!("diagonal {}", some.join(", "))
            }
        };
        let off = match self.off {
            [0, 0] => "nothing off it",
            [0, _] => "no positive entry off it (Z)",
            [_, 0] => "no negative entry off it",
            _ => "both signs off it",
        };
        format!("{diagonal}, {off}")
    }

    pub(super) fn json(&self) -> Value {
        let [positive, zero, negative] = self.diagonal;
        json!({
            "rows": self.rows,
            "columns": self.columns,
            "storage": if self.dense { "dense" } else { "sparse" },
            "nonzeros": self.nonzeros,
            "density": self.density(),
            "asymmetry": self.asymmetry,
            "diagonal": {"positive": positive, "zero": zero, "negative": negative},
            "off_diagonal": {"positive": self.off[0], "negative": self.off[1]},
            "row_scale": self.scale.map(|(min, max)| json!({"min": min, "max": max})),
            "zero_rows": self.zero_rows,
        })
    }

    pub(super) fn text(&self) -> String {
        let Self { rows, columns, .. } = self;
        let stored = if self.dense { "dense" } else { "sparse" };
        if rows * columns == 0 || self.nonzeros == 0 {
            return format!("{rows} x {columns}, zero");
        }
        let density = match 100.0 * self.density() {
            d if d >= 10.0 => format!("{d:.0} %"),
            d => format!("{d:.2} %"),
        };
        let mut text = format!(
            "{rows} x {columns}, {stored}, {} ({density})",
            count(self.nonzeros, "nonzero")
        );
        if let Some(asymmetry) = self.asymmetry {
            text += &format!(", {}, {}", symmetry(asymmetry), self.signs());
        }
        if let Some((min, max)) = self.scale.filter(|(min, max)| max > min) {
            text += &format!(", rows from {} to {}", number(min), number(max));
        }
        if self.zero_rows > 0 {
            text += &format!(", {}", count(self.zero_rows, "zero row"));
        }
        text
    }
}

impl Facts {
    /// As JSON.
    pub(super) fn json(&self) -> Object {
        let matrices: Object =
            self.matrices.iter().map(|(name, m)| ((*name).to_owned(), m.json())).collect();
        report::fields(json!({
            "matrices": matrices,
            "q": {"negative": self.q.negative, "zero": self.q.zero, "norm": self.q.norm},
            "classes": self.classes,
            "guaranteed": self.guaranteed,
        }))
    }

    /// As text.
    pub(super) fn text(&self, text: &mut String) {
        for (name, m) in &self.matrices {
            row(text, name, m.text());
        }
        if let Some(classes) = &self.classes {
            classes_text(text, classes);
        }
        for (k, guarantee) in self.guaranteed.iter().enumerate() {
            row(text, if k == 0 { "sure" } else { "" }, guarantee);
        }
        let Right { negative, zero, norm } = self.q;
        let trivial = if self.trivial { "; z = 0 solves it" } else { "" };
        let q = format!("{negative} negative, {zero} zero, norm {}{trivial}", number(norm));
        row(text, "q", q);
    }
}
