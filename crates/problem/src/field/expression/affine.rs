//! Which expressions are affine, and their coefficients: a row `Σ_j a_j x_j + b`, with whether a and b are those stated but for no rounding.

use super::graph::{Graph, Id, Node};
use super::operator::{Binary, Nary, Unary};

/// Rows `A x + b`.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Affine {
    /// Entries of A: row, column, value; more than one of a place are to be added.
    pub entries: Vec<(usize, usize, f64)>,
    /// b
    pub constants: Vec<f64>,
    /// Whether no number was rounded.
    pub exact: bool,
}

/// A number with whether it is exact.
#[derive(Clone, Copy)]
struct Known {
    value: f64,
    exact: bool,
}

impl Known {
    fn of(value: f64) -> Self {
        Self { value, exact: true }
    }

    fn add(self, other: Self) -> Self {
        let value = self.value + other.value;
        let shadow = value - self.value;
        let error = (self.value - (value - shadow)) + (other.value - shadow);
        Self { value, exact: self.exact && other.exact && error == 0.0 }
    }

    fn mul(self, other: Self) -> Self {
        let value = self.value * other.value;
        let error = self.value.mul_add(other.value, -value);
        // Below this a product loses digits that the error does not show.
        let small = value.abs() < 1e-280 && self.value != 0.0 && other.value != 0.0;
        Self { value, exact: self.exact && other.exact && error == 0.0 && !small }
    }

    fn div(self, other: Self) -> Self {
        let value = self.value / other.value;
        let error = (-value).mul_add(other.value, self.value);
        let small = value.abs() < 1e-280 && self.value != 0.0;
        Self { value, exact: self.exact && other.exact && error == 0.0 && !small }
    }

    fn neg(self) -> Self {
        Self { value: -self.value, ..self }
    }
}

/// Of each node whether it is affine, and where it is a number, that number; of others, their value at 0.
struct Node0 {
    /// 0 a number, 1 affine, 2 neither.
    degree: u8,
    at_zero: Known,
}

fn degrees(graph: &Graph) -> Vec<Node0> {
    let mut out: Vec<Node0> = Vec::with_capacity(graph.nodes.len());
    for node in &graph.nodes {
        let at = |a: &Id| &out[a.0 as usize];
        let inexact = Known { value: f64::NAN, exact: false };
        let of = |degree, at_zero| Node0 { degree, at_zero };
        let next = match node {
            Node::Constant(x) => of(0, Known::of(*x)),
            Node::Variable(_) | Node::Linear(_) => of(1, Known::of(0.0)),
            Node::Unary(Unary::Neg, a) => of(at(a).degree, at(a).at_zero.neg()),
            Node::Binary(op, a, b) => {
                let (a, b) = (at(a), at(b));
                match op {
                    Binary::Add => of(a.degree.max(b.degree), a.at_zero.add(b.at_zero)),
                    Binary::Sub => of(a.degree.max(b.degree), a.at_zero.add(b.at_zero.neg())),
                    Binary::Mul if a.degree == 0 || b.degree == 0 => {
                        of(a.degree.max(b.degree), a.at_zero.mul(b.at_zero))
                    }
                    Binary::Div if b.degree == 0 => of(a.degree, a.at_zero.div(b.at_zero)),
                    _ if a.degree == 0 && b.degree == 0 => {
                        let value = op.of(a.at_zero.value, b.at_zero.value);
                        of(0, Known { value, exact: false })
                    }
                    Binary::Pow if b.degree == 0 && b.at_zero.value == 1.0 => {
                        of(a.degree, a.at_zero)
                    }
                    _ => of(2, inexact),
                }
            }
            Node::Nary(Nary::Sum, all) => {
                let degree = all.iter().map(|a| at(a).degree).max().unwrap_or(0);
                let sum = all.iter().fold(Known::of(0.0), |sum, a| sum.add(at(a).at_zero));
                of(degree, sum)
            }
            Node::If([c, a, b]) if at(c).degree == 0 => {
                let chosen = if at(c).at_zero.value != 0.0 { at(a) } else { at(b) };
                of(chosen.degree, chosen.at_zero)
            }
            Node::Unary(op, a) if at(a).degree == 0 => {
                of(0, Known { value: op.of(at(a).at_zero.value), exact: false })
            }
            Node::Nary(op, all) if all.iter().all(|a| at(a).degree == 0) => {
                let value = op.of(all.iter().map(|a| at(a).at_zero.value));
                of(0, Known { value, exact: false })
            }
            Node::Piecewise(piece, a) if at(a).degree == 0 => {
                of(0, Known { value: piece.at(at(a).at_zero.value).0, exact: false })
            }
            _ => of(2, inexact),
        };
        out.push(next);
    }
    out
}

/// Of each node its number, where it is one that no operation has rounded.
pub(super) fn constants(graph: &Graph) -> Vec<Option<f64>> {
    let number = |d: &Node0| {
        (d.degree == 0 && d.at_zero.exact && d.at_zero.value.is_finite()).then_some(d.at_zero.value)
    };
    degrees(graph).iter().map(number).collect()
}

/// Which rows are affine.
pub(crate) fn affine_rows(graph: &Graph, rows: &[Id]) -> Vec<bool> {
    let degrees = degrees(graph);
    rows.iter().map(|row| degrees[row.0 as usize].degree < 2).collect()
}

/// The rows as `A x + b`, where all are so. Cost: the nodes of the rows, a shared one as often as rows use it.
pub(crate) fn affine(graph: &Graph, rows: &[Id]) -> Option<Affine> {
    let degrees = degrees(graph);
    if rows.iter().any(|row| degrees[row.0 as usize].degree > 1) {
        return None;
    }
    let mut out = Affine { exact: true, ..Affine::default() };
    let mut at = std::collections::BTreeMap::new();
    let mut coefficients: std::collections::BTreeMap<usize, Known> = Default::default();
    for (i, row) in rows.iter().enumerate() {
        let constant = degrees[row.0 as usize].at_zero;
        out.exact &= constant.exact && constant.value.is_finite();
        out.constants.push(constant.value);
        coefficients.clear();
        at.insert(row.0, Known::of(1.0));
        // Users before arguments: from the largest number down.
        while let Some((k, slope)) = at.pop_last() {
            let mut to = |a: &Id, slope: Known| {
                if degrees[a.0 as usize].degree > 0 {
                    let sum = at.entry(a.0).or_insert(Known::of(0.0));
                    *sum = sum.add(slope);
                }
            };
            let mut add = |j: usize, slope: Known| {
                let sum = coefficients.entry(j).or_insert(Known::of(0.0));
                *sum = sum.add(slope);
            };
            let number = |a: &Id| degrees[a.0 as usize].at_zero;
            match &graph.nodes[k as usize] {
                Node::Variable(j) => add(*j, slope),
                Node::Linear(terms) => {
                    terms.iter().for_each(|&(j, c)| add(j, slope.mul(Known::of(c))));
                }
                Node::Unary(_, a) => to(a, slope.neg()),
                Node::Binary(Binary::Add, a, b) => [a, b].into_iter().for_each(|a| to(a, slope)),
                Node::Binary(Binary::Sub, a, b) => {
                    to(a, slope);
                    to(b, slope.neg());
                }
                Node::Binary(Binary::Mul, a, b) => {
                    to(a, slope.mul(number(b)));
                    to(b, slope.mul(number(a)));
                }
                Node::Binary(Binary::Div, a, b) => to(a, slope.div(number(b))),
                Node::Binary(_, a, _) => to(a, slope),
                Node::Nary(_, all) => all.iter().for_each(|a| to(a, slope)),
                Node::If([c, a, b]) => to(if number(c).value != 0.0 { a } else { b }, slope),
                Node::Constant(_) | Node::Piecewise(..) => {}
            }
        }
        for (&j, c) in &coefficients {
            out.exact &= c.exact && c.value.is_finite();
            out.entries.push((i, j, c.value));
        }
    }
    Some(out)
}
