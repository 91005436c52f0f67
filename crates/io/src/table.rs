//! A solution as a table, and the files of such tables: comma-separated values.
//!
//! ```text
//! friction            contact,status,r_n,r_t,u_n,u_t             in space r_t1,r_t2 and u_t1,u_t2, with rolling friction also r_r1,r_r2 and u_r1,u_r2
//! LCP, box LCP        variable,status,z,w
//! MLCP                variable,status,value,w                    u[0], ... then v[0], ...; only v has a w
//! horizontal LCP      pair,x,s
//! MCP                 variable,status,x,F
//! VI                  variable,x,F
//! ```
//!
//! `name` follows the first column where the file of the problem names its variables; `status` is there where the judge was asked; of horizontal LCP and VI
//! it speaks of equations and sets besides, so they have none. Rows are counted from 0. Numbers have as many digits as tell them from all
//! others. Velocities of bodies and multipliers of scalar rows are in no such table.

use std::borrow::Cow;
use std::path::Path;

use nonsmooth_problem::check::{Motion, RowStatus, SetStatus};
use nonsmooth_problem::{
    AnyPoint, AnyProblem, AnyStatus, Complementarity, Kind, Mlcp, Problem, Stated,
    with_complementarity,
};

use crate::format::About;
use crate::{Format, IoError, ProblemFile, StoredPoint};

/// What stands in a column.
#[derive(Debug, Clone, PartialEq)]
pub enum Column {
    /// Words.
    Text(Vec<String>),
    /// Numbers; `None`: the row has none.
    Numbers(Vec<Option<f64>>),
}

/// A solution, a row for each contact or variable.
#[derive(Debug, Clone, PartialEq)]
pub struct Table {
    /// The columns with their names, all as long as the first.
    pub columns: Vec<(&'static str, Column)>,
}

impl Table {
    /// The table of a point of the problem; `names` of the variables may be missing, and so may the statuses of the point.
    ///
    /// Errors: a point that is not one of the problem, as [`Problem::validate_point`] says.
    pub fn new(
        problem: &AnyProblem,
        stored: &StoredPoint,
        names: &[String],
    ) -> Result<Self, nonsmooth_problem::ProblemError> {
        problem.validate_point(&stored.point)?;
        let partner = match &stored.partner {
            Some(partner) => Cow::Borrowed(&partner[..]),
            None => {
                let all = problem.partner(&stored.point);
                Cow::Owned(
                    StoredPoint::new(problem, stored.point.clone(), all)
                        .partner
                        .unwrap_or_default(),
                )
            }
        };
        let mut columns = match (&stored.point, problem) {
            (AnyPoint::Local(point), _) => contacts(problem.kind(), &point.r, &partner),
            (AnyPoint::Global(point), _) => contacts(problem.kind(), &point.r, &partner),
            (AnyPoint::Lcp(point), AnyProblem::Complementarity(Complementarity::Mlcp(p))) => {
                mixed(p, &point.z, &partner)
            }
            (point, AnyProblem::Complementarity(linear)) => {
                with_complementarity!(linear, p => parts(p, point, &partner))
            }
            (_, AnyProblem::Friction(_)) => vec![],
        };
        let mut table = Self { columns: vec![] };
        let first = columns.remove(0);
        let rows = first.1.len();
        table.columns.push(first);
        if names.len() == rows {
            table.columns.push(("name", Column::Text(names.to_vec())));
        }
        if let Some(statuses) = statuses(problem, &stored.statuses, rows) {
            table.columns.push(("status", Column::Text(statuses)));
        }
        table.columns.extend(columns);
        Ok(table)
    }

    /// The number of rows.
    pub fn len(&self) -> usize {
        self.columns.first().map_or(0, |(_, column)| column.len())
    }

    /// Whether there is no row.
    pub fn is_empty(&self) -> bool {
        self.len() == 0
    }

    /// The column of a name, if the table has it.
    pub fn column(&self, name: &str) -> Option<&Column> {
        self.columns.iter().find(|column| column.0 == name).map(|column| &column.1)
    }

    /// The text of a file of comma-separated values, with a line of names.
    pub fn csv(&self) -> String {
        let names: Vec<_> = self.columns.iter().map(|(name, _)| *name).collect();
        let mut text = names.join(",") + "\n";
        for row in 0..self.len() {
            let cells: Vec<_> = self.columns.iter().map(|(_, column)| column.csv(row)).collect();
            text += &(cells.join(",") + "\n");
        }
        text
    }
}

impl Column {
    fn len(&self) -> usize {
        match self {
            Self::Text(all) => all.len(),
            Self::Numbers(all) => all.len(),
        }
    }

    /// A cell as it stands in a file.
    fn csv(&self, row: usize) -> String {
        match self {
            Self::Numbers(all) => {
                all.get(row).copied().flatten().map_or_else(String::new, |x| format!("{x:?}"))
            }
            Self::Text(all) => match all.get(row) {
                // RFC 4180.
                Some(text) if text.contains([',', '"', '\n', '\r']) => {
                    format!("\"{}\"", text.replace('"', "\"\""))
                }
                Some(text) => text.clone(),
                None => String::new(),
            },
        }
    }
}

fn counted(name: &'static str, rows: usize) -> (&'static str, Column) {
    (name, Column::Text((0..rows).map(|k| k.to_string()).collect()))
}

fn numbers(name: &'static str, x: &[f64]) -> (&'static str, Column) {
    (name, Column::Numbers(x.iter().copied().map(Some).collect()))
}

/// A row for each pair, a column for each part of the point.
fn parts<P: Stated>(problem: &P, point: &AnyPoint, w: &[f64]) -> Vec<(&'static str, Column)> {
    let parts = problem.parts_of(point, Some(w));
    let columns = parts.iter().map(|(name, x)| numbers(name, x));
    std::iter::once(counted(P::ROW, problem.pairs())).chain(columns).collect()
}

/// Impulses and relative velocities, components side by side.
fn contacts(kind: Kind, r: &[f64], u: &[f64]) -> Vec<(&'static str, Column)> {
    const PLANE: [&[&str]; 2] = [&["r_n", "r_t"], &["u_n", "u_t"]];
    const SPACE: [&[&str]; 2] = [&["r_n", "r_t1", "r_t2"], &["u_n", "u_t1", "u_t2"]];
    let d = kind.dimension();
    const ROLLING: [&[&str]; 2] =
        [&["r_n", "r_t1", "r_t2", "r_r1", "r_r2"], &["u_n", "u_t1", "u_t2", "u_r1", "u_r2"]];
    let names = match d {
        2 => PLANE,
        5 => ROLLING,
        _ => SPACE,
    };
    let mut columns = vec![counted("contact", r.len() / d)];
    for (names, x) in names.into_iter().zip([r, u]) {
        for (k, name) in names.iter().enumerate() {
            let component = x.iter().skip(k).step_by(d).copied().map(Some).collect();
            columns.push((name, Column::Numbers(component)));
        }
    }
    columns
}

/// Free variables and then those of pairs, which alone have a w.
fn mixed(problem: &Mlcp, z: &[f64], w: &[f64]) -> Vec<(&'static str, Column)> {
    let (free, pairs) = (problem.free, problem.pairs());
    let names = (0..free).map(|k| format!("u[{k}]")).chain((0..pairs).map(|k| format!("v[{k}]")));
    let w = std::iter::repeat_n(None, free).chain(w.iter().copied().map(Some));
    vec![
        ("variable", Column::Text(names.collect())),
        numbers("value", z),
        ("w", Column::Numbers(w.collect())),
    ]
}

/// What each row of the table does; `None` where nobody asked the judge.
fn statuses(problem: &AnyProblem, statuses: &[AnyStatus], rows: usize) -> Option<Vec<String>> {
    if let AnyProblem::Complementarity(Complementarity::Vi(_)) = problem {
        // Of constraints, not of variables.
        return None;
    }
    let mut words: Vec<String> = statuses.iter().map(|s| word(s).into()).collect();
    if let AnyProblem::Complementarity(Complementarity::Mlcp(p)) = problem {
        // The judge speaks of rows, equalities first; the table of variables, free ones first.
        words.drain(..p.equalities.min(words.len()));
        words.splice(..0, std::iter::repeat_n("free".into(), p.free));
    }
    (words.len() == rows).then_some(words)
}

/// What a contact or a row does, in a word.
fn word(status: &AnyStatus) -> &'static str {
    match status {
        AnyStatus::Contact(contact) => match contact.status {
            Motion::Open => "open",
            Motion::Slip if contact.rolls => "slip and roll",
            Motion::Stick if contact.rolls => "roll",
            Motion::Stick if contact.at_limit => "stick at limit",
            Motion::Stick => "stick",
            Motion::Slip => "slip",
        },
        AnyStatus::Row(RowStatus::Inside) => "inside",
        AnyStatus::Row(RowStatus::Lower) => "lower",
        AnyStatus::Row(RowStatus::Upper) => "upper",
        AnyStatus::Row(RowStatus::Equality) => "equality",
        AnyStatus::Set(SetStatus::Inside) => "inside",
        AnyStatus::Set(SetStatus::Border) => "border",
        AnyStatus::Set(SetStatus::Apex) => "apex",
    }
}

/// The format of tables: written, and the solution alone.
///
/// Errors of writing: a file without a solution, or with one that does not fit. Of reading: always, as there is no problem in it.
#[derive(Debug, Clone, Copy)]
pub struct Csv;

impl Format for Csv {
    fn about(&self) -> &'static About {
        const ABOUT: About = About {
            name: "a table of the solution",
            extensions: &["csv"],
            holds_problems: false,
            writes: Kind::ALL,
            ..About::TEXT
        };
        &ABOUT
    }

    fn begins(&self, _: &[u8]) -> bool {
        false
    }

    fn parse(&self, name: &Path, _: &[u8]) -> Result<ProblemFile, IoError> {
        Err(IoError::data(name, "the file", "a problem", "a table, which holds a solution alone"))
    }

    fn to_bytes(&self, name: &Path, file: &ProblemFile) -> Result<Vec<u8>, IoError> {
        let Some(solution) = &file.solution else {
            return Err(IoError::data(
                name,
                "the solution",
                "one, as a table holds nothing else",
                "none",
            ));
        };
        let table = Table::new(&file.problem, solution, &file.info.names);
        Ok(table.map_err(IoError::problem(name))?.csv().into_bytes())
    }
}
