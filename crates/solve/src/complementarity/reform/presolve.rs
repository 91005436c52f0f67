//! MCP → MCP: variables that are known, or that an equation defines, are put where they are used; rows that say nothing go.
//!
//! | what | becomes |
//! | --- | --- |
//! | `l_i = u_i` | the number; F_i is free and goes |
//! | `F_i > 0` on the whole box, `l_i` finite | `x_i = l_i`; F_i goes. Likewise `F_i < 0` and u_i. A variable that is known makes the box smaller |
//! | twins i and k: `F_i = a F_k`, `a ≠ 0`, and F depends on x_i and x_k through `x_k + c x_i` only | x_i is a number, and F_i goes, in the cases below |
//! | a free variable b with an equation `c b + G(x) = 0`, c a number, that one other row at most uses, or others use linearly and without the Jacobian getting more entries | `−G(x)/c` there; b and the equation go |
//!
//! **Theorem.** Every solution of what is left, with the numbers and values put in, solves the problem; and the problem has a solution where what is left has one. *Sign*: a solution with `x_i > l_i` has `F_i ≤ 0`, and there is
//! none. `F_i` is asked to be defined on the whole box, for nobody looks at it any more. *Twins*: with (x_i, x_k) a solution has `(v, x_k + c (x_i − v))`, at which F is the same, and which solves the problem where
//!
//! - x_k is free: then `F_k = F_i = 0`, and v may be any number in `[l_i, u_i]`;
//! - l_i and l_k are the only bounds, `a > 0`, `c ≥ 0`: `v = l_i`. The new x_k is above l_k only where one of the two was above its bound, and then `F_k = 0`. Likewise with u_i and u_k.
//!
//! Without the condition on the variables this would be wrong: of `x_1 + x_2 = 1`, `2 x_1 + 2 x_2 = 2`, `x_2 = 5`, all of three free variables, no number for x_1 is the right one beforehand.
//! *Equation*: b is free, so its row and the equation may change places, and the equation has one solution b for each of the rest.
//!
//! The sign is proved by interval arithmetic, twins in rational arithmetic. An equation is the row of a free variable, and any equation may define any free variable. So files that state `b = F(x)`, `0 ≤ x ⟂ b ≥ 0` (Pyomo's) become
//! `0 ≤ x ⟂ F(x) ≥ 0`. The way back is exact but for the rounding of `−G(x)/c`.
//!
//! Needs F by expressions. References: FerrisMunson2001 (preprocessing of complementarity problems). Cost: O(operations of F) for each variable that goes, and a few evaluations of F.

use std::collections::{HashMap, HashSet};

use nonsmooth_problem::field::{
    Binary, Evaluator, Expressions, Field, Graph, Id, Nary, Node, Twins, Unary,
};
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
    const SUMMARY: &'static str = "MCP to MCP: variables that are known or that an equation defines are put where they are used, rows that say nothing go";
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
    known: Vec<(usize, f64)>,
    defined: Vec<Defined>,
    /// Of the first problem, with room for x and F.
    field: Box<dyn Evaluator>,
    f: Vec<f64>,
}

/// How many variables go, with a row each, and why.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub struct Counts {
    /// Bounds that are equal.
    pub fixed: usize,
    /// A row's sign on the box.
    pub held: usize,
    /// A twin.
    pub twins: usize,
    /// An equation.
    pub defined: usize,
}

/// What the presolve takes away from a problem: nothing where F is not known by expressions.
pub fn counts(problem: &Mcp) -> Counts {
    problem.F.expressions().map(|f| Plan::of(problem, f).counts).unwrap_or_default()
}

/// What a presolve finds.
struct Plan {
    /// Variables that are numbers, ascending.
    known: Vec<(usize, f64)>,
    defined: Vec<Defined>,
    counts: Counts,
}

impl Plan {
    fn of(problem: &Mcp, f: &Expressions) -> Self {
        let mut value: Vec<Option<f64>> = (0..problem.dim())
            .map(|i| (problem.lower[i] == problem.upper[i]).then_some(problem.lower[i]))
            .collect();
        let known = |value: &[Option<f64>]| value.iter().flatten().count();
        let fixed = known(&value);
        held(problem, f, &mut value);
        let held = known(&value) - fixed;
        twins(problem, f, &mut value);
        let twins = known(&value) - fixed - held;
        let defined = defined(problem, f, &value);
        let counts = Counts { fixed, held, twins, defined: defined.len() };
        let known = value.into_iter().enumerate().filter_map(|(i, x)| Some((i, x?))).collect();
        Self { known, defined, counts }
    }

    fn len(&self) -> usize {
        self.known.len() + self.defined.len()
    }
}

/// Whether there is anything to do.
pub fn reduces(problem: &Mcp) -> bool {
    problem.F.expressions().is_some_and(|f| Plan::of(problem, f).len() > 0)
}

/// Rounds of bounds.
const ROUNDS: usize = 10;

/// Variables that a row's sign on the box holds at a bound.
fn held(problem: &Mcp, f: &Expressions, value: &mut [Option<f64>]) {
    let (mut lower, mut upper) = (problem.lower.clone(), problem.upper.clone());
    for _ in 0..ROUNDS {
        let Some(ranges) = f.ranges(&lower, &upper) else { return };
        let mut found = false;
        for (i, range) in ranges.iter().enumerate().filter(|(_, r)| r.total) {
            let bound = match () {
                () if value[i].is_some() => continue,
                () if range.low > 0.0 => problem.lower[i],
                () if range.high < 0.0 => problem.upper[i],
                () => continue,
            };
            if bound.is_finite() {
                (value[i], lower[i], upper[i], found) = (Some(bound), bound, bound, true);
            }
        }
        if !found {
            return;
        }
    }
}

/// Rows whose Jacobians at the start are multiples of each other to this relative rounding may be so.
const ALIKE: f64 = 1e-9;

/// Variables that their twins make needless.
fn twins(problem: &Mcp, f: &Expressions, value: &mut [Option<f64>]) {
    let n = problem.dim();
    let start: Vec<f64> = (0..n).map(|i| problem.project(i, problem.start[i])).collect();
    let pattern = f.pattern();
    let (mut values, mut jacobian) = (vec![0.0; n], vec![0.0; pattern.len()]);
    if !f.evaluator().jacobian(&start, &mut values, &mut jacobian) {
        return;
    }
    // Two sums with weights without any pattern: their quotient is the same of rows that are multiples.
    let weight = |j: usize, turn: f64| 1.0 + ((j as f64 + 1.0) * turn).fract();
    let mut alike: Vec<(f64, usize)> = vec![];
    for i in (0..n).filter(|&i| value[i].is_none()) {
        let sum = |turn: f64| {
            let terms = pattern.row(i).iter().zip(&jacobian[pattern.range(i)]);
            terms.map(|(&j, a)| weight(j, turn) * a).sum::<f64>()
        };
        let quotient = sum(0.618_033_988_749_894_9) / sum(0.414_213_562_373_095_1);
        if quotient.is_finite() {
            alike.push((quotient, i));
        }
    }
    alike.sort_by(|a, b| a.0.total_cmp(&b.0));
    let near = |a: f64, b: f64| (a - b).abs() <= ALIKE * a.abs();
    let pairs: Vec<(usize, usize)> = alike
        .windows(2)
        .filter(|w| near(w[0].0, w[1].0) && pattern.row(w[0].1) == pattern.row(w[1].1))
        .flat_map(|w| [(w[0].1, w[1].1), (w[1].1, w[0].1)])
        .collect();
    if pairs.is_empty() {
        return;
    }
    // Who stays because of another.
    let mut stays = vec![false; n];
    for Twins { row: i, of: k, rows, columns } in f.twins(&pairs).unwrap_or_default() {
        if stays[i] || value[i].is_some() || value[k].is_some() {
            continue;
        }
        let bounds = |i: usize| [problem.lower[i], problem.upper[i]];
        let finite = |i: usize| bounds(i).map(f64::is_finite);
        let agree = rows > 0.0 && columns >= 0.0 && finite(i) == finite(k);
        let at = match finite(k) {
            [false, false] => start[i],
            [true, false] if agree => problem.lower[i],
            [false, true] if agree => problem.upper[i],
            _ => continue,
        };
        (value[i], stays[k]) = (Some(at), true);
    }
}

/// The free variables that go with the equations that define them; `value`: those that are known, whose rows are gone.
fn defined(problem: &Mcp, f: &Expressions, value: &[Option<f64>]) -> Vec<Defined> {
    let n = problem.dim();
    let open = |i: usize| value[i].is_none();
    let free =
        |i: usize| open(i) && problem.lower[i].is_infinite() && problem.upper[i].is_infinite();
    let pattern = f.pattern();
    let mut users = vec![vec![]; n];
    for (i, j) in pattern.places().filter(|&(i, j)| open(i) && open(j)) {
        users[j].push(i);
    }
    let entries: Vec<usize> =
        (0..n).map(|i| pattern.row(i).iter().filter(|j| open(**j)).count()).collect();
    // Rows that define something, and rows and variables that a definition uses: these stay.
    let (mut gone, mut used) = (HashSet::new(), HashSet::new());
    let mut out = vec![];
    for b in (0..n).filter(|&b| free(b)) {
        if used.contains(&b) {
            continue;
        }
        let all = &users[b];
        let linear = |i: &usize| coefficient(f.graph(), f.rows()[*i], b).is_some();
        // The entries that come, and those that go.
        let sparse = |r: usize| (all.len() - 1) * (entries[r] - 1) < all.len() + entries[r];
        let apt = |&r: &usize| {
            free(r)
                && !gone.contains(&r)
                && !out_of_order(pattern.row(r), &out)
                && (all.len() <= 2 || sparse(r))
        };
        let found = all.iter().copied().filter(apt).find_map(|r| {
            let coefficient = coefficient(f.graph(), f.rows()[r], b)?;
            Some(Defined { variable: b, row: r, coefficient })
        });
        if let Some(one) = found.filter(|_| all.len() <= 2 || all.iter().all(linear)) {
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
        let Plan { mut known, mut defined, .. } = Plan::of(problem, f);
        if known.len() + defined.len() == n && defined.pop().is_none() {
            // Something has to be left to be solved.
            let Some(k) = known.iter().rposition(|&(i, _)| problem.lower[i] < problem.upper[i])
            else {
                return Ok(whole(problem));
            };
            known.remove(k);
        }
        // Which row each variable has, and which variable each row: where an equation goes that is not the row of the variable that goes with it, the two change places.
        let mut rows: Vec<usize> = (0..n).collect();
        let mut holders = rows.clone();
        let mut goes = vec![false; n];
        known.iter().for_each(|&(i, _)| goes[i] = true);
        for one in &defined {
            let (holder, other) = (holders[one.row], rows[one.variable]);
            rows.swap(holder, one.variable);
            (holders[one.row], holders[other]) = (one.variable, holder);
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
        for &(i, x) in &known {
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
        Ok((reduced, Memo { kept, known, defined, field, f: vec![0.0; n] }))
    }

    fn lower(&self, _: &Mcp, point: &LcpPoint, memo: &Memo, reduced: &mut LcpPoint) {
        reduced.z.clear();
        reduced.z.extend(memo.kept.iter().map(|&i| point.z[i]));
    }

    fn lift(&self, _: &Mcp, reduced: &LcpPoint, memo: &mut Memo, point: &mut LcpPoint) {
        memo.kept.iter().zip(&reduced.z).for_each(|(&i, x)| point.z[i] = *x);
        memo.known.iter().for_each(|&(i, x)| point.z[i] = x);
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
    let (kept, known, defined) = ((0..n).collect(), vec![], vec![]);
    (problem.clone(), Memo { kept, known, defined, field, f: vec![0.0; n] })
}
