//! Models as text.

use std::collections::BTreeMap;
use std::fmt::Write;
use std::path::Path;

use nonsmooth_problem::Mcp;
use nonsmooth_problem::field::{Binary, Expressions, Field, Graph, Id, Nary, Node, Unary};

use super::operators::{Operator, number};
use crate::error::one_line;
use crate::{Info, IoError};

/// What is written of a graph: which nodes are defined variables, and what of a sum is its linear part.
struct Writer<'a> {
    graph: &'a Graph,
    /// The numbers of defined variables.
    defined: BTreeMap<Id, usize>,
    /// How often each node is used.
    uses: BTreeMap<Id, usize>,
    out: String,
}

/// What is left to write of an expression.
enum Left {
    Node(Id),
    /// The number 2.
    Two,
}

/// The text of a problem. What rows share becomes a defined variable, so the text is as long as the graph is large; it is read again as the same expressions.
///
/// Errors: a function that is no expressions; a number in them that is not finite; an operation on no arguments.
pub(super) fn text(file: &Path, problem: &Mcp, info: &Info) -> Result<String, IoError> {
    let Some(f) = problem.F.expressions() else {
        let found = problem.F.source();
        return Err(IoError::data(file, "F", "a function by expressions", found));
    };
    let wrong = |expected: &str, found: String| IoError::data(file, "F", expected, found);
    let mut writer = Writer::new(f);
    for &id in writer.uses.keys() {
        writer.check(id).map_err(|(expected, found)| wrong(expected, found))?;
    }
    let mut nonlinear = vec![false; f.dim()];
    writer.definitions();
    for (i, &row) in f.rows().iter().enumerate() {
        let (rest, _) = writer.row(row);
        nonlinear[i] = rest.is_some_and(|id| !matches!(f.graph().node(id), Node::Constant(_)));
        writer.line(&format!("C{i}"));
        writer.expression_or_zero(rest);
    }
    let start: Vec<_> =
        problem.start.iter().enumerate().filter(|(_, x)| x.to_bits() != 0).collect();
    if !start.is_empty() {
        writer.line(&format!("x{}", start.len()));
        start.iter().for_each(|(j, x)| writer.line(&format!("{j} {x:?}")));
    }
    let bounds = || problem.lower.iter().zip(&problem.upper).map(|(&l, &u)| (l, u));
    let free = |(l, u): (f64, f64)| l == f64::NEG_INFINITY && u == f64::INFINITY;
    writer.line("r");
    for (j, (l, u)) in bounds().enumerate() {
        let flags = u8::from(l.is_finite()) + 2 * u8::from(u.is_finite());
        // Equations are paired with the free variables in their order, which is that of the rows.
        let row = if free((l, u)) { "4 0".into() } else { format!("5 {flags} {}", j + 1) };
        writer.line(&row);
    }
    writer.line("b");
    for (l, u) in bounds() {
        let bound = match (l.is_finite(), u.is_finite()) {
            (true, true) if l == u => format!("4 {l:?}"),
            (true, true) => format!("0 {l:?} {u:?}"),
            (false, true) => format!("1 {u:?}"),
            (true, false) => format!("2 {l:?}"),
            (false, false) => "3".into(),
        };
        writer.line(&bound);
    }
    let n = f.dim();
    let pattern = f.pattern();
    let mut columns = vec![0; n];
    pattern.places().for_each(|(_, j)| columns[j] += 1);
    writer.line(&format!("k{}", n - 1));
    let mut sum = 0;
    for count in &columns[..n - 1] {
        sum += count;
        writer.line(&sum.to_string());
    }
    for (i, &row) in f.rows().iter().enumerate() {
        let (_, terms) = writer.row(row);
        let coefficient: BTreeMap<_, _> = terms.iter().copied().collect();
        if !pattern.row(i).is_empty() {
            writer.line(&format!("J{i} {}", pattern.row(i).len()));
        }
        for j in pattern.row(i) {
            writer.line(&format!("{j} {:?}", coefficient.get(j).unwrap_or(&0.0)));
        }
    }

    let count = |of: &dyn Fn(usize, (f64, f64)) -> bool| {
        bounds().enumerate().filter(|&(i, b)| of(i, b)).count()
    };
    // All rows, and variables, up to the last nonlinear one count as nonlinear.
    let last = nonlinear.iter().rposition(|x| *x).map_or(0, |i| i + 1);
    let of_last = (0..last).filter_map(|i| pattern.row(i).last()).max().map_or(0, |j| j + 1);
    let equations = count(&|_, b| free(b));
    let pairs = [count(&|i, b| i >= last && !free(b)), count(&|i, b| i < last && !free(b))];
    let two = count(&|_, (l, u)| l.is_finite() && u.is_finite());
    let nonzero = count(&|_, (l, _)| l.is_finite() && l != 0.0);
    let title = info
        .title
        .as_ref()
        .map_or("a complementarity problem".into(), |title| format!("problem {}", one_line(title)));
    let longest = info.names.iter().map(String::len).max().unwrap_or(0);
    let header = format!(
        "g3 1 1 0\t# {title}
 {n} {n} 0 0 {equations}\t# vars, constraints, objectives, ranges, eqns
 {last} 0 {} {} {two} {nonzero}\t# nonlinear constrs, objs; ccons: lin, nonlin, nd, nzlb
 0 0\t# network constraints: nonlinear, linear
 {of_last} 0 0\t# nonlinear vars in constraints, objectives, both
 0 0 0 1\t# linear network variables; functions; arith, flags
 0 0 0 0 0\t# discrete variables: binary, integer, nonlinear (b,c,o)
 {} 0\t# nonzeros in Jacobian, obj. gradient
 0 {longest}\t# max name lengths: constraints, variables
 0 {} 0 0 0\t# common exprs: b,c,o,c1,o1
",
        pairs[0],
        pairs[1],
        pattern.len(),
        writer.defined.len(),
    );
    Ok(header + &writer.out)
}

impl<'a> Writer<'a> {
    /// Of what the rows use, what is to be a defined variable.
    fn new(f: &'a Expressions) -> Self {
        let graph = f.graph();
        let mut uses = BTreeMap::new();
        let mut left = f.rows().to_vec();
        while let Some(id) = left.pop() {
            let count = uses.entry(id).or_insert(0);
            *count += 1;
            if *count == 1 {
                left.extend(graph.node(id).arguments());
            }
        }
        let mut writer = Self { graph, defined: BTreeMap::new(), uses, out: String::new() };
        // What is linear has a place in a row, and in a definition, only.
        let mut placed = std::collections::BTreeSet::new();
        let mut defined: Vec<Id> = vec![];
        for &row in f.rows() {
            if writer.uses[&row] == 1 {
                placed.extend(writer.linear_of(row).filter(|id| writer.is_plain(*id)));
            }
        }
        for (&id, &count) in &writer.uses {
            match graph.node(id) {
                Node::Constant(_) | Node::Variable(_) => {}
                Node::Linear(terms) => {
                    if !terms.is_empty() && !placed.contains(&id) {
                        defined.push(id);
                    }
                }
                node => {
                    if count > 1 {
                        defined.push(id);
                    }
                    if let Node::Piecewise(_, a) = node
                        && !matches!(graph.node(*a), Node::Variable(_))
                    {
                        defined.push(*a);
                    }
                }
            }
        }
        defined.sort_unstable();
        defined.dedup();
        let n = graph.variables();
        writer.defined = defined.into_iter().enumerate().map(|(k, id)| (id, n + k)).collect();
        writer
    }

    /// The node of the linear part of `id`, if it is that or a sum with it.
    fn linear_of(&self, id: Id) -> Option<Id> {
        let is_linear = |id: &Id| matches!(self.graph.node(*id), Node::Linear(_));
        let is_zero = |id: &Id| matches!(self.graph.node(*id), Node::Constant(x) if *x == 0.0);
        match self.graph.node(id) {
            Node::Linear(_) => Some(id),
            Node::Binary(Binary::Add, a, b) if is_linear(b) && !is_zero(a) => Some(*b),
            _ => None,
        }
    }

    /// Whether a linear node is read from the list of a row as it is: used once, ascending, without zeros.
    fn is_plain(&self, id: Id) -> bool {
        let Node::Linear(terms) = self.graph.node(id) else { return false };
        self.uses[&id] == 1
            && !terms.is_empty()
            && terms.iter().all(|t| t.1 != 0.0)
            && terms.windows(2).all(|w| w[0].0 < w[1].0)
    }

    /// What a row is without its linear part, and that.
    fn row(&self, row: Id) -> (Option<Id>, &'a [(usize, f64)]) {
        let graph = self.graph;
        let linear = self
            .linear_of(row)
            .filter(|id| !self.defined.contains_key(id) && !self.defined.contains_key(&row));
        match (linear.map(|id| graph.node(id)), graph.node(row)) {
            (Some(Node::Linear(terms)), Node::Binary(_, a, _)) => (Some(*a), terms),
            (Some(Node::Linear(terms)), _) => (None, terms),
            _ => (Some(row), &[]),
        }
    }

    fn line(&mut self, text: &str) {
        self.out.push_str(text);
        self.out.push('\n');
    }

    /// Whether a node can be written.
    fn check(&self, id: Id) -> Result<(), (&'static str, String)> {
        let finite = |x: f64| match x.is_finite() {
            true => Ok(()),
            false => Err(("finite numbers", format!("{x}"))),
        };
        match self.graph.node(id) {
            Node::Constant(x) => finite(*x),
            Node::Linear(terms) => terms.iter().try_for_each(|t| finite(t.1)),
            Node::Nary(op, all) if all.is_empty() && *op != Nary::Sum => {
                Err(("operations on something", format!("{op:?} of nothing")))
            }
            _ => Ok(()),
        }
    }

    /// The segments V, arguments first.
    fn definitions(&mut self) {
        let all: Vec<_> = self.defined.iter().map(|(&id, &k)| (id, k)).collect();
        for (id, k) in all {
            match self.graph.node(id) {
                Node::Linear(terms) => {
                    let mut terms = terms.clone();
                    if terms.len() > self.graph.variables() {
                        let mut sums = BTreeMap::new();
                        terms.iter().for_each(|(j, c)| *sums.entry(*j).or_insert(0.0) += c);
                        terms = sums.into_iter().collect();
                    }
                    self.line(&format!("V{k} {} 0", terms.len()));
                    terms.iter().for_each(|(j, c)| self.line(&format!("{j} {c:?}")));
                    self.line("n0");
                }
                _ => {
                    self.line(&format!("V{k} 0 0"));
                    self.expression(id);
                }
            }
        }
    }

    fn expression_or_zero(&mut self, id: Option<Id>) {
        match id {
            Some(id) if self.defined.contains_key(&id) => {
                self.line(&format!("v{}", self.defined[&id]));
            }
            Some(id) => self.expression(id),
            None => self.line("n0"),
        }
    }

    /// An expression; what it uses that is defined stands as a variable, but not itself.
    fn expression(&mut self, root: Id) {
        let mut left = vec![Left::Node(root)];
        while let Some(next) = left.pop() {
            let Left::Node(id) = next else {
                self.line("n2.0");
                continue;
            };
            if let Some(k) = self.defined.get(&id).filter(|_| id != root) {
                let _ = writeln!(self.out, "v{k}");
                continue;
            }
            let node = self.graph.node(id);
            let operator = match node {
                Node::Constant(x) => {
                    let _ = writeln!(self.out, "n{x:?}");
                    continue;
                }
                Node::Variable(j) => {
                    let _ = writeln!(self.out, "v{j}");
                    continue;
                }
                // Others are defined variables.
                Node::Linear(_) => {
                    self.line("n0");
                    continue;
                }
                Node::Nary(Nary::Sum, all) if all.is_empty() => {
                    self.line("n0");
                    continue;
                }
                Node::Nary(Nary::Sum, all) if all.len() == 1 => {
                    left.push(Left::Node(all[0]));
                    continue;
                }
                Node::Nary(Nary::Sum, all) if all.len() == 2 => Operator::Binary(Binary::Add),
                // AMPL's own number of the square is not for files.
                Node::Unary(Unary::Square, _) => Operator::Binary(Binary::Pow),
                Node::Unary(op, _) => Operator::Unary(*op),
                Node::Binary(op, ..) => Operator::Binary(*op),
                Node::Nary(op, _) => Operator::Nary(*op),
                Node::If(_) => Operator::If,
                Node::Piecewise(..) => Operator::Piecewise,
            };
            // Every operator has a number, which a test sees to.
            let _ = writeln!(self.out, "o{}", number(operator).unwrap_or_default());
            match (operator, node) {
                (Operator::Nary(_), Node::Nary(_, all)) => {
                    let _ = writeln!(self.out, "{}", all.len());
                }
                (_, Node::Piecewise(piece, _)) => {
                    let _ = writeln!(self.out, "{}", piece.slopes().len());
                    for (k, slope) in piece.slopes().iter().enumerate() {
                        let _ = writeln!(self.out, "n{slope:?}");
                        if let Some(point) = piece.breaks().get(k) {
                            let _ = writeln!(self.out, "n{point:?}");
                        }
                    }
                }
                _ => {}
            }
            if let Node::Unary(Unary::Square, _) = node {
                left.push(Left::Two);
            }
            left.extend(node.arguments().rev().map(Left::Node));
        }
    }
}
