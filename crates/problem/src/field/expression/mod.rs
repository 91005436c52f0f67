//! F by expressions: values, exact sparse Jacobians, what is affine, and the size of a row's terms.

mod affine;
mod graph;
mod operator;
mod range;
mod tape;
mod terms;
mod text;

use std::sync::Arc;

use nonsmooth_linalg::Doubled;

pub use affine::Affine;
pub use graph::{Graph, Id, Node, Piecewise};
pub use operator::{Binary, Nary, Unary};
pub use range::Range;
pub use terms::Twins;
pub(crate) use terms::{Combination, Term};

use super::{Evaluator, Field, Pattern};
use crate::ProblemError;
use operator::Sized;
use tape::{Memory, Tape};

/// `F: ℝⁿ → ℝⁿ` by expressions.
#[derive(Debug, Clone)]
pub struct Expressions {
    graph: Graph,
    rows: Vec<Id>,
    tape: Arc<Tape>,
    pattern: Pattern,
}

impl Expressions {
    /// As many rows as the graph has variables.
    ///
    /// Errors: no rows, or another number of them; the limit of time that is in force for the thread.
    pub fn new(graph: Graph, rows: Vec<Id>) -> Result<Self, ProblemError> {
        let n = graph.variables();
        if n == 0 || rows.len() != n {
            return Err(ProblemError::shape(
                "F",
                format!("{} expressions (variables, at least one)", n.max(1)),
                rows.len().to_string(),
            ));
        }
        let late = || {
            let found = "the end of the time before it was compiled".into();
            ProblemError::Singular { place: "F".into(), found }
        };
        let tape = Arc::new(Tape::new(&graph, &rows).ok_or_else(late)?);
        let of_row = |i| tape.pattern(i).iter().map(|&j| j as usize);
        let pattern = Pattern::new((0..n).map(of_row));
        Ok(Self { graph, rows, tape, pattern })
    }

    /// What the rows are made of.
    pub fn graph(&self) -> &Graph {
        &self.graph
    }

    /// The expression of each row.
    pub fn rows(&self) -> &[Id] {
        &self.rows
    }

    /// Which rows are affine.
    pub fn affine_rows(&self) -> Vec<bool> {
        affine::affine_rows(&self.graph, &self.rows)
    }

    /// F as `A x + b`, where it is affine.
    pub fn affine(&self) -> Option<Affine> {
        affine::affine(&self.graph, &self.rows)
    }

    /// Bounds of each row's values over the box `[lower, upper]`, rounded outwards, where the row is defined; `None` where the limit of time that is in force for the thread
    /// comes first. Cost: a dozen operations a node.
    ///
    /// # Panics
    ///
    /// Where there are fewer bounds than variables.
    pub fn ranges(&self, lower: &[f64], upper: &[f64]) -> Option<Vec<Range>> {
        let nodes = self.graph.ranges(lower, upper)?;
        Some(self.rows.iter().map(|row| nodes[row.index()]).collect())
    }

    /// The chosen rows, taken apart; see [`terms::combinations`].
    pub(crate) fn combinations(&self, chosen: &[usize]) -> Option<Vec<Combination>> {
        terms::combinations(&self.graph, &self.rows, chosen)
    }

    /// Any nodes, likewise.
    pub(crate) fn taken_apart(&self, nodes: &[Id]) -> Option<Vec<Combination>> {
        let all: Vec<usize> = (0..nodes.len()).collect();
        terms::combinations(&self.graph, nodes, &all)
    }

    /// Which of these pairs of rows and variables are twins, see [`Twins`], as their terms show in exact arithmetic; those that are, in their order. `None` where the limit of time that is in
    /// force for the thread comes first. Cost: the nodes of all rows, an operation on rational numbers for each.
    pub fn twins(&self, pairs: &[(usize, usize)]) -> Option<Vec<Twins>> {
        let all: Vec<usize> = (0..self.rows.len()).collect();
        Some(terms::twins(&self.graph, &self.combinations(&all)?, pairs))
    }

    /// The number of operations of one evaluation.
    pub fn operations(&self) -> usize {
        self.tape.operations()
    }

    /// Whether the other has the same expressions.
    pub fn same(&self, other: &Self) -> bool {
        self.rows.len() == other.rows.len()
            && self.rows.iter().zip(&other.rows).all(|(&a, &b)| self.graph.same(a, &other.graph, b))
    }
}

impl Field for Expressions {
    fn dim(&self) -> usize {
        self.rows.len()
    }

    fn pattern(&self) -> &Pattern {
        &self.pattern
    }

    fn evaluator(&self) -> Box<dyn Evaluator> {
        Box::new(Running {
            tape: self.tape.clone(),
            plain: Memory::default(),
            doubled: Memory::default(),
            sized: Memory::default(),
        })
    }

    fn source(&self) -> String {
        "expressions with exact derivatives".into()
    }

    fn expressions(&self) -> Option<&Expressions> {
        Some(self)
    }
}

/// A tape with its memory.
struct Running {
    tape: Arc<Tape>,
    plain: Memory<f64>,
    doubled: Memory<Doubled>,
    sized: Memory<Sized>,
}

impl Evaluator for Running {
    fn value(&mut self, x: &[f64], f: &mut [f64]) -> bool {
        let mut defined = true;
        self.tape.values(x.iter().copied(), &mut self.plain, |i, value: f64| {
            defined &= value.is_finite();
            f[i] = value;
        });
        defined
    }

    fn jacobian(&mut self, x: &[f64], f: &mut [f64], jacobian: &mut [f64]) -> bool {
        self.value(x, f)
            && self.tape.slopes(&mut self.plain, jacobian)
            && jacobian.iter().all(|x| x.is_finite())
    }

    fn precisely(&mut self, x: &[f64], f: &mut [f64]) -> bool {
        let mut defined = true;
        let x = x.iter().map(|x| Doubled::from(*x));
        self.tape.values(x, &mut self.doubled, |i, value: Doubled| {
            f[i] = value.parts().0;
            defined &= f[i].is_finite();
        });
        defined
    }

    fn sizes(&mut self, x: &[f64], sizes: &mut [f64]) -> bool {
        let x = x.iter().map(|x| Sized { value: *x, size: x.abs() });
        self.tape.values(x, &mut self.sized, |i, value: Sized| sizes[i] = value.size);
        true
    }
}

#[cfg(test)]
mod tests;
