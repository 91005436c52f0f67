//! Rows as sums of variables, of terms that are not linear, and a number, in exact arithmetic.

use std::collections::{BTreeMap, HashMap};

use nonsmooth_linalg::budget::Pace;

use super::affine::constants;
use super::graph::{Graph, Id, Node};
use super::operator::{Binary, Nary, Unary};
use crate::check::Exact;
use crate::check::proof::exact;

/// What a [`Combination`] adds up.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
pub(crate) enum Term {
    /// x_j.
    Variable(usize),
    /// An expression that is not taken apart; equal ones are the same.
    Node(Id),
}

/// `Σ c_t t + b`.
#[derive(Debug, Clone, PartialEq, Default)]
pub(crate) struct Combination {
    /// Coefficients, none of them zero.
    pub(crate) terms: BTreeMap<Term, Exact>,
    /// b
    pub(crate) constant: Exact,
}

impl Combination {
    fn add(&mut self, term: Term, c: Exact) {
        let sum = self.terms.entry(term).or_insert(Exact::ZERO);
        *sum += c;
        if sum.is_zero() {
            self.terms.remove(&term);
        }
    }

    /// c with `self = c · other`, rounded, where there is one that is not zero.
    pub(crate) fn multiple(&self, other: &Self) -> Option<f64> {
        let (a, b) = (self.terms.first_key_value()?, other.terms.first_key_value()?);
        if a.0 != b.0 || self.terms.len() != other.terms.len() {
            return None;
        }
        let c = a.1 / b.1;
        let same = self.terms.iter().zip(&other.terms).all(|(x, y)| x.0 == y.0 && *x.1 == &c * y.1);
        (same && self.constant == &c * &other.constant).then(|| crate::check::rounded(&c))
    }
}

/// Of each node the first one that is the same expression.
fn firsts(graph: &Graph) -> Vec<u32> {
    let mut known: HashMap<(u32, Vec<u64>), u32> = HashMap::new();
    let mut out: Vec<u32> = Vec::with_capacity(graph.nodes.len());
    for (k, node) in graph.nodes.iter().enumerate() {
        let of = |a: &Id| u64::from(out[a.index()]);
        let all = |all: &[Id]| all.iter().map(of).collect::<Vec<_>>();
        let key = match node {
            Node::Constant(x) => (0, vec![x.to_bits()]),
            Node::Variable(j) => (1, vec![*j as u64]),
            Node::Linear(terms) => {
                (2, terms.iter().flat_map(|(j, c)| [*j as u64, c.to_bits()]).collect())
            }
            Node::If(three) => (3, all(three)),
            Node::Piecewise(piece, a) => {
                let numbers = piece.slopes().iter().chain(piece.breaks()).map(|x| x.to_bits());
                (4, [of(a)].into_iter().chain(numbers).collect())
            }
            Node::Unary(op, a) => (100 + *op as u32, vec![of(a)]),
            Node::Binary(op, a, b) => {
                let (mut a, mut b) = (of(a), of(b));
                if matches!(op, Binary::Add | Binary::Mul) && a > b {
                    (a, b) = (b, a);
                }
                (200 + *op as u32, vec![a, b])
            }
            Node::Nary(op, arguments) => (300 + *op as u32, all(arguments)),
        };
        out.push(*known.entry(key).or_insert(k as u32));
    }
    out
}

/// The chosen rows, taken apart along sums, and products with numbers. `None` where the time is over before.
///
/// Cost: the nodes, and of each row its own, a shared one as often as rows use it; an operation on rational numbers for each.
pub(crate) fn combinations(
    graph: &Graph,
    rows: &[Id],
    chosen: &[usize],
) -> Option<Vec<Combination>> {
    let constants = constants(graph);
    let firsts = firsts(graph);
    let number = |a: &Id| constants[a.index()];
    let mut pace = Pace::default();
    let mut out = Vec::with_capacity(chosen.len());
    let mut left: BTreeMap<u32, Exact> = BTreeMap::new();
    for &i in chosen {
        let mut sum = Combination::default();
        left.clear();
        left.insert(rows[i].0, Exact::ONE);
        // Users before arguments: from the largest number down.
        while let Some((k, c)) = left.pop_last() {
            if pace.over(500.0) {
                return None;
            }
            if c.is_zero() {
                continue;
            }
            if let Some(x) = constants[k as usize] {
                sum.constant += c * exact(x);
                continue;
            }
            let mut to = |a: &Id, c: Exact| *left.entry(a.0).or_insert(Exact::ZERO) += c;
            match &graph.nodes[k as usize] {
                Node::Variable(j) => sum.add(Term::Variable(*j), c),
                Node::Linear(terms) => {
                    terms.iter().for_each(|&(j, x)| sum.add(Term::Variable(j), &c * exact(x)));
                }
                Node::Unary(Unary::Neg, a) => to(a, -c),
                Node::Binary(Binary::Add, a, b) => {
                    to(a, c.clone());
                    to(b, c);
                }
                Node::Binary(Binary::Sub, a, b) => {
                    to(a, c.clone());
                    to(b, -c);
                }
                Node::Binary(Binary::Mul, a, b) if number(a).is_some() || number(b).is_some() => {
                    match number(a) {
                        Some(x) => to(b, c * exact(x)),
                        None => to(a, c * exact(number(b).unwrap_or(0.0))),
                    }
                }
                Node::Binary(Binary::Div, a, b) if number(b).is_some_and(|x| x != 0.0) => {
                    to(a, c / exact(number(b).unwrap_or(1.0)));
                }
                Node::Nary(Nary::Sum, all) => all.iter().for_each(|a| to(a, c.clone())),
                _ => sum.add(Term::Node(Id(firsts[k as usize])), c),
            }
        }
        out.push(sum);
    }
    Some(out)
}

/// Two rows that are multiples of each other, `F_i = a F_k` with `a ≠ 0`, of two variables on which all of F depends through `x_k + c x_i` only (`c = 0`: not on x_i at all).
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Twins {
    /// i
    pub row: usize,
    /// k
    pub of: usize,
    /// a, rounded; its sign is exact.
    pub rows: f64,
    /// c, likewise.
    pub columns: f64,
}

/// Those of the pairs (i, k) that are twins. A variable in a term that is not linear has none.
pub(crate) fn twins(graph: &Graph, rows: &[Combination], pairs: &[(usize, usize)]) -> Vec<Twins> {
    let n = graph.variables;
    let mut inside = vec![false; n];
    let mut left: Vec<Id> = vec![];
    let mut columns: Vec<Vec<(usize, &Exact)>> = vec![vec![]; n];
    for (i, row) in rows.iter().enumerate() {
        for (term, c) in &row.terms {
            match term {
                Term::Variable(j) => columns[*j].push((i, c)),
                Term::Node(node) => left.push(*node),
            }
        }
    }
    let mut seen = vec![false; graph.nodes.len()];
    while let Some(id) = left.pop() {
        if std::mem::replace(&mut seen[id.index()], true) {
            continue;
        }
        match graph.node(id) {
            Node::Variable(j) => inside[*j] = true,
            Node::Linear(terms) => terms.iter().for_each(|t| inside[t.0] = true),
            node => left.extend(node.arguments()),
        }
    }
    let ratio = |i: usize, k: usize| {
        let (a, b) = (&columns[i], &columns[k]);
        if inside[i] || inside[k] || b.is_empty() {
            return None;
        }
        if a.is_empty() {
            return Some(0.0);
        }
        let c = a[0].1 / b[0].1;
        let same =
            a.len() == b.len() && a.iter().zip(b).all(|(x, y)| x.0 == y.0 && *x.1 == &c * y.1);
        same.then(|| crate::check::rounded(&c))
    };
    let twin = |&(row, of): &(usize, usize)| {
        let multiple = rows[row].multiple(&rows[of])?;
        Some(Twins { row, of, rows: multiple, columns: ratio(row, of)? })
    };
    pairs.iter().filter_map(twin).collect()
}

#[cfg(test)]
mod tests {
    use super::super::Expressions;
    use super::*;

    fn expressions(rows: &[&str]) -> Expressions {
        let rows: Vec<_> = rows.iter().map(ToString::to_string).collect();
        Expressions::parse(&rows, &[]).unwrap()
    }

    #[test]
    fn rows_are_taken_apart_exactly() {
        let f = expressions(&["3*(x1 - 0.1*x2) + 2*exp(x1) - (exp(x1) + x1)/3 + 7 - 0.3", "x2"]);
        let row = &f.combinations(&[0]).unwrap()[0];
        let third = |x: i32| Exact::from(x) / Exact::from(3);
        assert_eq!(row.terms[&Term::Variable(0)], third(8));
        assert_eq!(row.terms[&Term::Variable(1)], -Exact::from(3) * exact(0.1));
        let nodes: Vec<_> = row.terms.iter().filter(|t| matches!(t.0, Term::Node(_))).collect();
        assert_eq!(nodes.len(), 1, "one exponential, however often it is written");
        assert_eq!(*nodes[0].1, third(5));
        // What cancels is gone, also between terms that are not linear.
        let f = expressions(&["x1*x2 + x2 - x2*x1 - x2", "x2"]);
        assert_eq!(f.combinations(&[0]).unwrap()[0], Combination::default());
    }

    #[test]
    fn twins_are_exact() {
        let of = |rows: &[&str], pair| expressions(rows).twins(&[pair]).unwrap();
        let equal = ["x3^2 - x1 - 2*x2", "2*x3^2 - 2*x1 - 4*x2", "x1 + 2*x2 + x3"];
        let found = of(&equal, (0, 1));
        assert_eq!(found, [Twins { row: 0, of: 1, rows: 0.5, columns: 0.5 }]);
        assert_eq!(of(&equal, (1, 0))[0].columns, 2.0);
        // By the last bit.
        let nearly = ["x3^2 - x1 - 2*x2", "2*x3^2 - 2*x1 - 4.000000000000001*x2", "x1 + 2*x2 + x3"];
        assert!(of(&nearly, (0, 1)).is_empty());
        let column = ["x3^2 - x1 - 2*x2", "2*x3^2 - 2*x1 - 4*x2", "x1 + 3*x2 + x3"];
        assert!(of(&column, (0, 1)).is_empty());
        let inside = ["x3^2 - x1 - 2*x2", "2*x3^2 - 2*x1 - 4*x2", "exp(x1 + 2*x2) + x3"];
        assert!(of(&inside, (0, 1)).is_empty());
        let absent = ["x2 + exp(x3)", "2*x2 + 2*exp(x3)", "x3 + x2"];
        assert_eq!(of(&absent, (0, 1)), [Twins { row: 0, of: 1, rows: 0.5, columns: 0.0 }]);
        assert!(of(&absent, (1, 0)).is_empty(), "F depends on x2");
    }
}
