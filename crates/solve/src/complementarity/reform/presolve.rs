//! MCP → MCP: variables that are known, or that an equation defines, are put where they are used.
//!
//! | what | becomes |
//! | --- | --- |
//! | `l_i = u_i` | the number; F_i is free and goes |
//! | a free variable b with an equation `c b + G(x) = 0`, c a number, that one other row at most uses | `−G(x)/c` there; b and the equation go |
//!
//! An equation is the row of a free variable, and any equation may define any free variable. So files that state `b = F(x)`, `0 ≤ x ⟂ b ≥ 0` (Pyomo's) become
//! `0 ≤ x ⟂ F(x) ≥ 0`. The way back is exact but for the rounding of `−G(x)/c`.
//!
//! Needs F by expressions. References: FerrisMunson2001 (preprocessing of complementarity problems). Cost: O(operations of F) for each variable that goes.

use std::collections::{HashMap, HashSet};

use nonsmooth_problem::field::{Binary, Evaluator, Expressions, Graph, Id, Nary, Node, Unary};
use nonsmooth_problem::{Kind, LcpPoint, Mcp};

use crate::core::reformulation::Reformulation;
use crate::core::register::Composed;
use crate::core::settings::NoSettings;
use crate::{Boxed, SolveError, Via};

/// The prefix, without settings.
#[derive(Debug, Clone, Copy, Default)]
pub struct Presolve;

impl Composed<Mcp> for Presolve {
    type To = Mcp;
    type Settings = NoSettings;
    const NAME: &'static str = "presolve";
    const SUMMARY: &'static str = "MCP to MCP: fixed variables and those that an equation defines are put where they are used";
    const FROM: &'static [Kind] = &[Kind::Mcp];
    const CITES: &'static [&'static str] = &["FerrisMunson2001"];

    fn compose(_: NoSettings, solver: Boxed<Self::To>) -> Boxed<Mcp> {
        Boxed::new(Via { reformulation: Presolve, solver })
    }
}

/// A variable that an equation defines.
#[derive(Debug, Clone, Copy, PartialEq)]
struct Defined {
    variable: usize,
    /// The row of the equation.
    row: usize,
    /// c
    coefficient: f64,
}

/// What goes, and how it comes back.
pub struct Memo {
    /// The variables that are left, in their order.
    kept: Vec<usize>,
    fixed: Vec<(usize, f64)>,
    defined: Vec<Defined>,
    /// Of the first problem, with room for x and F.
    field: Box<dyn Evaluator>,
    f: Vec<f64>,
}

/// Whether there is anything to do.
pub fn reduces(problem: &Mcp) -> bool {
    let fixed = problem.lower.iter().zip(&problem.upper).any(|(l, u)| l == u);
    problem.F.expressions().is_some_and(|f| fixed || !defined(problem, f).is_empty())
}

/// The free variables that go with the equations that define them.
fn defined(problem: &Mcp, f: &Expressions) -> Vec<Defined> {
    let n = problem.dim();
    let free = |i: usize| problem.lower[i].is_infinite() && problem.upper[i].is_infinite();
    let pattern = nonsmooth_problem::field::Field::pattern(f);
    let mut users = vec![vec![]; n];
    for (i, j) in pattern.places() {
        // More than two need not be known.
        if users[j].len() < 3 {
            users[j].push(i);
        }
    }
    // Rows that define something, and rows and variables that a definition uses: these stay.
    let (mut gone, mut used) = (HashSet::new(), HashSet::new());
    let mut out = vec![];
    for b in (0..n).filter(|&b| free(b) && users[b].len() <= 2) {
        if used.contains(&b) {
            continue;
        }
        let apt = |&r: &usize| free(r) && !gone.contains(&r) && !out_of_order(pattern.row(r), &out);
        let found = users[b].iter().copied().filter(apt).find_map(|r| {
            let coefficient = coefficient(f.graph(), f.rows()[r], b)?;
            Some(Defined { variable: b, row: r, coefficient })
        });
        if let Some(one) = found {
            gone.insert(one.row);
            used.extend(pattern.row(one.row).iter().copied().filter(|&j| j != b));
            out.push(one);
        }
    }
    out
}

/// Whether a row uses a variable that goes.
fn out_of_order(row: &[usize], gone: &[Defined]) -> bool {
    // Definitions are few a row: a look at each variable would cost more.
    match gone.len() {
        0 => false,
        _ => row.iter().any(|j| gone.binary_search_by_key(j, |d| d.variable).is_ok()),
    }
}

/// c, if the expression is `c x_b + G` with c a number that is not zero and G without x_b.
fn coefficient(graph: &Graph, root: Id, b: usize) -> Option<f64> {
    let uses = users(graph, root, b);
    let mut sum = 0.0;
    let mut left = vec![(root, 1.0)];
    while let Some((id, c)) = left.pop() {
        if !uses.contains(&id) {
            continue;
        }
        let number = |a: &Id| match graph.node(*a) {
            Node::Constant(x) => Some(*x),
            _ => None,
        };
        match graph.node(id) {
            Node::Variable(_) => sum += c,
            Node::Linear(terms) => {
                sum += c * terms.iter().filter(|t| t.0 == b).map(|t| t.1).sum::<f64>();
            }
            Node::Unary(Unary::Neg, a) => left.push((*a, -c)),
            Node::Binary(Binary::Add, x, y) => left.extend([(*x, c), (*y, c)]),
            Node::Binary(Binary::Sub, x, y) => left.extend([(*x, c), (*y, -c)]),
            Node::Binary(Binary::Mul, x, y) => match (number(x), number(y)) {
                (Some(k), _) => left.push((*y, k * c)),
                (_, Some(k)) => left.push((*x, k * c)),
                _ => return None,
            },
            Node::Nary(Nary::Sum, all) => left.extend(all.iter().map(|a| (*a, c))),
            _ => return None,
        }
    }
    (sum != 0.0 && sum.is_finite()).then_some(sum)
}

/// The nodes of an expression in which x_b is.
fn users(graph: &Graph, root: Id, b: usize) -> HashSet<Id> {
    let mut seen = HashSet::new();
    let mut order = vec![];
    let mut left = vec![root];
    while let Some(id) = left.pop() {
        if seen.insert(id) {
            order.push(id);
            left.extend(graph.node(id).arguments());
        }
    }
    // Arguments have smaller numbers.
    order.sort_unstable();
    let mut uses = HashSet::new();
    for id in order {
        let node = graph.node(id);
        let own = match node {
            Node::Variable(j) => *j == b,
            Node::Linear(terms) => terms.iter().any(|t| t.0 == b),
            _ => node.arguments().any(|a| uses.contains(&a)),
        };
        if own {
            uses.insert(id);
        }
    }
    uses
}

/// What stands for a variable in the copy.
#[derive(Clone, Copy)]
enum Stands {
    Variable(usize),
    Node(Id),
}

/// Copies expressions with what stands for their variables.
struct Copier<'a> {
    from: &'a Graph,
    to: Graph,
    stands: Vec<Stands>,
    /// The copy of each node, where there is one that is kept.
    done: Vec<Option<Id>>,
    /// The last copy that met each node.
    seen: Vec<u32>,
    copies: u32,
}

impl Copier<'_> {
    /// The copy of an expression. `apart`: nodes whose copies are not kept, because a variable stands for something else in them for the moment.
    fn copy(&mut self, root: Id, apart: &HashSet<Id>) -> Id {
        let mut order = vec![];
        let mut left = vec![root];
        let is_apart = |id: Id| !apart.is_empty() && apart.contains(&id);
        // The copies that are not kept.
        let mut here: HashMap<Id, Id> = HashMap::new();
        self.copies += 1;
        while let Some(id) = left.pop() {
            let known = !is_apart(id) && self.done[id.index()].is_some();
            if !known && std::mem::replace(&mut self.seen[id.index()], self.copies) != self.copies {
                order.push(id);
                left.extend(self.from.node(id).arguments());
            }
        }
        order.sort_unstable();
        for id in order {
            let at = |a: &Id| match here.get(a).copied().or(self.done[a.index()]) {
                Some(copy) => copy,
                None => unreachable!("arguments come first"),
            };
            let node = match self.from.node(id) {
                Node::Constant(x) => Node::Constant(*x),
                Node::Variable(j) => match self.stands[*j] {
                    Stands::Variable(k) => Node::Variable(k),
                    Stands::Node(copy) => {
                        // It may stand for something else in the next expression.
                        here.insert(id, copy);
                        continue;
                    }
                },
                Node::Unary(op, a) => Node::Unary(*op, at(a)),
                Node::Binary(op, a, b) => Node::Binary(*op, at(a), at(b)),
                Node::Nary(op, all) => Node::Nary(*op, all.iter().map(at).collect()),
                Node::If(all) => Node::If([at(&all[0]), at(&all[1]), at(&all[2])]),
                Node::Piecewise(piece, a) => Node::Piecewise(piece.clone(), at(a)),
                Node::Linear(terms) => {
                    let copy = self.linear(terms);
                    self.keep(id, copy, is_apart(id), &mut here);
                    continue;
                }
            };
            let copy = self.to.add(node);
            self.keep(id, copy, is_apart(id), &mut here);
        }
        here.get(&root).copied().or(self.done[root.index()]).expect("the root was copied")
    }

    fn keep(&mut self, id: Id, copy: Id, apart: bool, here: &mut HashMap<Id, Id>) {
        match apart {
            true => drop(here.insert(id, copy)),
            false => self.done[id.index()] = Some(copy),
        }
    }

    fn linear(&mut self, terms: &[(usize, f64)]) -> Id {
        let (mut variables, mut others) = (vec![], vec![]);
        for &(j, c) in terms {
            match self.stands[j] {
                Stands::Variable(k) => variables.push((k, c)),
                Stands::Node(id) => others.push((id, c)),
            }
        }
        if others.is_empty() {
            return self.to.add(Node::Linear(variables));
        }
        let mut all = vec![];
        if !variables.is_empty() {
            all.push(self.to.add(Node::Linear(variables)));
        }
        for (id, c) in others {
            if c == 1.0 {
                all.push(id);
            } else {
                let c = self.to.constant(c);
                all.push(self.to.binary(Binary::Mul, c, id));
            }
        }
        self.to.sum(all)
    }
}

impl Reformulation<Mcp> for Presolve {
    type To = Mcp;
    type Memo = Memo;

    fn reduce(&self, problem: &Mcp) -> Result<(Mcp, Memo), SolveError> {
        let Some(f) = problem.F.expressions() else {
            return Err(SolveError::needs("F by expressions", problem.F.source()));
        };
        let n = problem.dim();
        let mut defined = defined(problem, f);
        let fixed: Vec<_> = (0..n)
            .filter(|&i| problem.lower[i] == problem.upper[i])
            .map(|i| (i, problem.lower[i]))
            .collect();
        if fixed.len() + defined.len() == n {
            // Something has to be left to be solved.
            match defined.pop() {
                Some(_) => {}
                None => return Ok(whole(problem)),
            }
        }
        // Which row each variable has: where an equation goes that is not the row of the variable that goes with it, the two change places.
        let mut rows: Vec<usize> = (0..n).collect();
        let mut goes = vec![false; n];
        for &(i, _) in &fixed {
            goes[i] = true;
        }
        for one in &defined {
            let holder = rows.iter().position(|&r| r == one.row).unwrap_or(one.variable);
            rows.swap(holder, one.variable);
            goes[one.variable] = true;
        }
        let kept: Vec<usize> = (0..n).filter(|&i| !goes[i]).collect();
        let mut copier = Copier {
            from: f.graph(),
            to: Graph::new(kept.len()),
            stands: vec![Stands::Variable(0); n],
            done: vec![None; f.graph().nodes().len()],
            seen: vec![0; f.graph().nodes().len()],
            copies: 0,
        };
        for (k, &i) in kept.iter().enumerate() {
            copier.stands[i] = Stands::Variable(k);
        }
        for &(i, x) in &fixed {
            copier.stands[i] = Stands::Node(copier.to.constant(x));
        }
        let zero = copier.to.constant(0.0);
        for one in &defined {
            let root = f.rows()[one.row];
            let apart = users(f.graph(), root, one.variable);
            copier.stands[one.variable] = Stands::Node(zero);
            let rest = copier.copy(root, &apart);
            let divisor = copier.to.constant(-one.coefficient);
            let value = match one.coefficient {
                -1.0 => rest,
                1.0 => copier.to.unary(Unary::Neg, rest),
                _ => copier.to.binary(Binary::Div, rest, divisor),
            };
            copier.stands[one.variable] = Stands::Node(value);
        }
        let nothing = HashSet::new();
        let copies = kept.iter().map(|&i| copier.copy(f.rows()[rows[i]], &nothing)).collect();
        let of = |x: &[f64]| kept.iter().map(|&i| x[i]).collect::<Vec<_>>();
        let reduced = Mcp::new(
            Expressions::new(copier.to, copies)?,
            of(&problem.lower),
            of(&problem.upper),
            of(&problem.start),
        )?;
        let field = problem.F.evaluator();
        Ok((reduced, Memo { kept, fixed, defined, field, f: vec![0.0; n] }))
    }

    fn lower(&self, _: &Mcp, point: &LcpPoint, memo: &Memo, reduced: &mut LcpPoint) {
        reduced.z.clear();
        reduced.z.extend(memo.kept.iter().map(|&i| point.z[i]));
    }

    fn lift(&self, _: &Mcp, reduced: &LcpPoint, memo: &mut Memo, point: &mut LcpPoint) {
        memo.kept.iter().zip(&reduced.z).for_each(|(&i, x)| point.z[i] = *x);
        memo.fixed.iter().for_each(|&(i, x)| point.z[i] = x);
        if memo.defined.is_empty() {
            return;
        }
        memo.defined.iter().for_each(|one| point.z[one.variable] = 0.0);
        // Rows that need a variable that is still zero may have no value; those of definitions have.
        let _ = memo.field.value(&point.z, &mut memo.f);
        for one in &memo.defined {
            let x = -memo.f[one.row] / one.coefficient;
            point.z[one.variable] = if x.is_finite() { x } else { 0.0 };
        }
    }
}

/// The problem as it is.
fn whole(problem: &Mcp) -> (Mcp, Memo) {
    let n = problem.dim();
    let field = problem.F.evaluator();
    let (kept, fixed, defined) = ((0..n).collect(), vec![], vec![]);
    (problem.clone(), Memo { kept, fixed, defined, field, f: vec![0.0; n] })
}
