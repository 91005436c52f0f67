//! Which row belongs to which variable, and what becomes of rows and bounds that belong to none.

use std::path::Path;

use nonsmooth_problem::Mcp;
use nonsmooth_problem::field::{Binary, Expressions, Graph, Id};

use super::header::Echo;
use super::input::Input;
use super::read::{Condition, Contents};
use super::{Model, Names, Options};
use crate::IoError;

/// Why a file was not read as an MCP.
#[derive(Debug, thiserror::Error)]
#[error("{error}")]
pub struct Refusal {
    /// What is wrong, and where.
    pub error: Box<IoError>,
    /// What a solution may tell AMPL, with the number of the reason; `None` where the file itself is at fault.
    pub answer: Option<Box<(Echo, u16)>>,
}

impl From<IoError> for Refusal {
    fn from(error: IoError) -> Self {
        Self { error: Box::new(error), answer: None }
    }
}

/// The numbers of refusals, after the driver of the solver PATH.
pub(super) const BOUNDS_CROSS: u16 = 200;
pub(super) const MISSTATED: u16 = 501;
pub(super) const NOT_SQUARE: u16 = 504;
pub(super) const SIDE_INEQUALITY: u16 = 505;

/// A row for each unknown, with its bounds and start.
struct Square {
    graph: Graph,
    rows: Vec<Id>,
    bounds: Vec<[f64; 2]>,
    start: Vec<f64>,
}

impl Square {
    /// A further unknown, complementary to a row.
    fn push(&mut self, row: Id, bounds: [f64; 2]) {
        self.rows.push(row);
        self.bounds.push(bounds);
        self.start.push(0.0);
    }

    /// `row − x`, or the row itself of x = 0.
    fn less(&mut self, row: Id, x: f64) -> Id {
        if x == 0.0 {
            return row;
        }
        let x = self.graph.constant(x);
        self.graph.binary(Binary::Sub, row, x)
    }
}

const BELOW: [f64; 2] = [f64::NEG_INFINITY, 0.0];
const ABOVE: [f64; 2] = [0.0, f64::INFINITY];

/// The MCP of a file.
///
/// A row of code 5 belongs to the variable that it names; the k-th equation to the k-th variable that no row names. Bounds of such a variable, and inequalities, are
/// *side inequalities*: conditions without a variable. They are refused, or become rows with multipliers of their own that nothing else contains:
/// `c − l ≥ 0 ⟂ y ≥ 0`, `c − u ≤ 0 ⟂ y ≤ 0`; of two bounds, `c − y = 0` for a free v and `v ⟂ l ≤ y ≤ u`.
///
/// Errors: two rows that name one variable; crossing bounds; not as many equations as variables that no row names; side inequalities.
pub(super) fn model(
    file: &Path,
    contents: Contents,
    names: Names,
    options: &Options,
) -> Result<Model, Refusal> {
    let Contents { title, echo, graph, rows, conditions, bounds, start } = contents;
    let refused = |result, place: String, expected: &str, found: String| Refusal {
        error: Box::new(IoError::data(file, place, expected, found)),
        answer: Some(Box::new((echo.clone(), result))),
    };
    let at = |mark, what: String| format!("{}, {what}", Input::place(echo.form, mark));
    let row_name = |i: usize| format!("row {i}{}", named(&names.rows, i));
    let variable_name = |j: usize| format!("variable {j}{}", named(&names.variables, j));
    let bounds_of = |j: usize| match bounds[j].0 {
        Some(mark) => at(mark, variable_name(j)),
        None => format!("the file of bounds, {}", variable_name(j)),
    };
    let n = echo.variables;

    for (j, &(_, [l, u])) in bounds.iter().enumerate() {
        if l > u {
            let found = format!("{l:?} and {u:?}");
            let place = bounds_of(j);
            return Err(refused(BOUNDS_CROSS, place, "bounds that do not cross", found));
        }
    }
    // The row that each variable belongs to.
    let mut row_of: Vec<Option<usize>> = vec![None; n];
    let mut remarks = vec![];
    let mut equations = vec![];
    let mut inequalities = vec![];
    for (i, &(mark, condition)) in conditions.iter().enumerate() {
        match condition {
            Condition::Complements(j, stated) => {
                if let Some(other) = row_of[j] {
                    let first = at(conditions[other].0, row_name(other));
                    let found = format!("{}, which {first} names", variable_name(j));
                    let place = at(mark, row_name(i));
                    return Err(refused(MISSTATED, place, "a variable of its own", found));
                }
                row_of[j] = Some(i);
                if bounds[j].0.is_some() && stated != bounds[j].1.map(f64::is_finite) {
                    let place = at(mark, row_name(i));
                    let name = variable_name(j);
                    remarks.push(format!(
                        "{place}: the row tells of other bounds of {name} than segment b has, which hold"
                    ));
                }
            }
            Condition::Between(l, u) if l > u => {
                let found = format!("{l:?} and {u:?}");
                let place = at(mark, row_name(i));
                return Err(refused(BOUNDS_CROSS, place, "bounds that do not cross", found));
            }
            Condition::Between(l, u) if l == u => equations.push((i, l)),
            Condition::Between(l, u) if l.is_infinite() && u.is_infinite() => {}
            Condition::Between(l, u) => inequalities.push((i, [l, u])),
        }
    }
    let unnamed: Vec<usize> = (0..n).filter(|&j| row_of[j].is_none()).collect();
    let allowed = options.side_inequalities;
    if let (Some(&(i, [l, u])), false) = (inequalities.first(), allowed) {
        let place = at(conditions[i].0, row_name(i));
        let found = format!("the inequality {l:?} <= c(x) <= {u:?} (sideineq=1 allows it)");
        let expected = "an equation, or a row that is complementary to a variable";
        return Err(refused(SIDE_INEQUALITY, place, expected, found));
    }
    if n == 0 || unnamed.len() != equations.len() {
        let found = format!("{} of {} for {} of {n}", equations.len(), rows.len(), unnamed.len());
        let place = "the rows".to_owned();
        let expected = "as many equations as variables that no row is complementary to";
        return Err(refused(NOT_SQUARE, place, expected, found));
    }
    let sided = |j: &usize| bounds[*j].1.iter().any(|b| b.is_finite());
    if let (Some(&j), false) = (unnamed.iter().find(|j| sided(j)), allowed) {
        let [l, u] = bounds[j].1;
        let found = format!("the bounds {l:?} and {u:?} (sideineq=1 allows them)");
        let expected = "a free variable, as no row is complementary to it";
        let place = bounds_of(j);
        return Err(refused(SIDE_INEQUALITY, place, expected, found));
    }

    let two = |[l, u]: [f64; 2]| l.is_finite() && u.is_finite();
    let of_rows: usize = inequalities.iter().map(|(_, b)| 1 + usize::from(two(*b))).sum();
    let of_bounds = |j: &usize| bounds[*j].1.iter().filter(|b| b.is_finite()).count();
    let more = of_rows + unnamed.iter().map(of_bounds).sum::<usize>();
    let mut square = Square {
        graph: if more == 0 { graph } else { widened(&graph, n + more) },
        rows: vec![],
        bounds: bounds.iter().map(|b| b.1).collect(),
        start,
    };
    let mut of_equations = equations.iter();
    for j in 0..n {
        let row = match (row_of[j], of_equations.len()) {
            (Some(i), _) => rows[i],
            (None, _) => {
                square.bounds[j] = [f64::NEG_INFINITY, f64::INFINITY];
                // There are as many as such variables.
                of_equations.next().map_or(rows[0], |&(i, x)| square.less(rows[i], x))
            }
        };
        square.rows.push(row);
    }
    for j in unnamed {
        let [l, u] = bounds[j].1;
        let x = square.graph.variable(j);
        if l.is_finite() {
            let row = square.less(x, l);
            square.push(row, ABOVE);
        }
        if u.is_finite() {
            let row = square.less(x, u);
            square.push(row, BELOW);
        }
    }
    for (i, [l, u]) in inequalities {
        match [l.is_finite(), u.is_finite()] {
            [true, true] => {
                let (v, y) = (square.rows.len(), square.rows.len() + 1);
                let [v, y] = [v, y].map(|k| square.graph.variable(k));
                let row = square.graph.binary(Binary::Sub, rows[i], y);
                square.push(row, [f64::NEG_INFINITY, f64::INFINITY]);
                square.push(v, [l, u]);
            }
            [true, false] => {
                let row = square.less(rows[i], l);
                square.push(row, ABOVE);
            }
            _ => {
                let row = square.less(rows[i], u);
                square.push(row, BELOW);
            }
        }
    }

    let invalid = |problem| Refusal {
        error: Box::new(IoError::problem(file)(problem)),
        answer: Some(Box::new((echo.clone(), MISSTATED))),
    };
    let f = Expressions::new(square.graph, square.rows).map_err(invalid)?;
    let (lower, upper) = square.bounds.iter().map(|[l, u]| (*l, *u)).unzip();
    let problem = Mcp::new(f, lower, upper, square.start).map_err(invalid)?;
    let mut variables = names.variables;
    if !variables.is_empty() {
        variables.extend((n..problem.dim()).map(|k| format!("side[{}]", k - n)));
    }
    Ok(Model { problem, title, names: variables, echo, remarks })
}

/// The same expressions of more variables.
fn widened(graph: &Graph, variables: usize) -> Graph {
    let mut wide = Graph::new(variables);
    // Nodes are numbered as they are added.
    for node in graph.nodes() {
        wide.add(node.clone());
    }
    wide
}

fn named(names: &[String], k: usize) -> String {
    names.get(k).map_or(String::new(), |name| format!(" (`{name}`)"))
}
