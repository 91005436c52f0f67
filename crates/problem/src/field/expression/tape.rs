//! Expressions as straight code: values by one run through it, exact sparse Jacobians by a run backwards through each row.
//!
//! ```text
//! unit       what only one row, or one shared node, uses: its code is contiguous
//! values     v_k = op(v_a, v_b)                       once for all
//! slopes     of a unit: backwards to variables (A) and to shared nodes (B); ∇D_k of shared nodes first, then
//! Jacobian   ∇row = A + Σ_k B_k ∇D_k
//! sums       Σ c_k v_k is one operation, sums and differences inside it included
//! ```
//!
//! Cost of values: one operation a node. Of the Jacobian: two more a node, and for each use of a shared node the variables that it depends on.

use std::ops::Range;

use nonsmooth_linalg::budget::{self, Pace};

use super::graph::{Graph, Id, Node, Piecewise};
use super::operator::{Binary, Nary, Number, Unary, slopes2};

/// One operation; its value goes to the place of its own number.
#[derive(Debug, Clone, Copy)]
enum Code {
    Unary(Unary, u32),
    Binary(Binary, u32, u32),
    /// Places in the list of arguments.
    Nary(Nary, u32, u32),
    /// Places in the list of terms.
    Linear(u32, u32),
    If([u32; 3]),
    Piecewise(u32, u32),
}

/// What one row, or one shared node, has for itself.
#[derive(Debug, Clone)]
struct Unit {
    /// Its code.
    code: Range<u32>,
    /// The place of its value.
    root: u32,
    /// The shared nodes that it uses, by their numbers among the units.
    shared: Range<u32>,
    /// Its variables, in the list of patterns.
    pattern: Range<u32>,
}

/// Expressions, compiled.
#[derive(Debug, Clone)]
pub(crate) struct Tape {
    variables: usize,
    /// The places after those of the variables.
    constants: Vec<f64>,
    code: Vec<Code>,
    arguments: Vec<u32>,
    terms: Vec<(u32, f64)>,
    pieces: Vec<Piecewise>,
    /// Shared nodes first, an argument before what uses it; then one for each row.
    units: Vec<Unit>,
    rows: usize,
    shared: Vec<u32>,
    patterns: Vec<u32>,
}

/// Places for values and slopes.
#[derive(Debug, Clone, Default)]
pub(crate) struct Memory<T> {
    values: Vec<T>,
    slopes: Vec<f64>,
    /// The gradients of shared nodes, as the patterns of the units.
    gradients: Vec<f64>,
}

/// Operations that an operation or a term takes to compile, or so.
const EACH: f64 = 30.0;
/// Units between two looks at the clock.
const UNITS: usize = 512;

/// To whom a node belongs.
#[derive(Clone, Copy, PartialEq)]
enum Owner {
    Nobody,
    Row(u32),
    Shared(u32),
}

impl Tape {
    /// The rows, as code. `None` where the time is over before.
    pub(crate) fn new(graph: &Graph, rows: &[Id]) -> Option<Self> {
        let n = graph.variables;
        let owners = owners(graph, rows);
        let inlined = inlined(graph, rows);
        let is_code = |k: usize| {
            !inlined[k] && !matches!(graph.nodes[k], Node::Constant(_) | Node::Variable(_))
        };
        // Shared nodes in their order, then rows.
        let mut unit_of_shared = vec![u32::MAX; graph.nodes.len()];
        let mut roots = vec![];
        for (k, owner) in owners.iter().enumerate() {
            if *owner == Owner::Shared(k as u32) && is_code(k) {
                unit_of_shared[k] = roots.len() as u32;
                roots.push(k);
            }
        }
        let shared = roots.len();
        let unit_of = |k: usize| match owners[k] {
            Owner::Nobody => None,
            Owner::Row(i) => Some(shared + i as usize),
            Owner::Shared(d) => Some(unit_of_shared[d as usize] as usize),
        };
        let mut members: Vec<Vec<u32>> = vec![vec![]; shared + rows.len()];
        for k in (0..graph.nodes.len()).filter(|&k| is_code(k)) {
            if let Some(unit) = unit_of(k) {
                members[unit].push(k as u32);
            }
        }
        // Places: variables, constants, code.
        let mut place = vec![u32::MAX; graph.nodes.len()];
        let mut constants = vec![];
        for (k, node) in graph.nodes.iter().enumerate() {
            match node {
                Node::Variable(i) => place[k] = *i as u32,
                Node::Constant(x) if owners[k] != Owner::Nobody => {
                    place[k] = (n + constants.len()) as u32;
                    constants.push(*x);
                }
                _ => {}
            }
        }
        let first = (n + constants.len()) as u32;
        let order = members.iter().flatten();
        order.enumerate().for_each(|(at, &k)| place[k as usize] = first + at as u32);
        let mut tape = Self {
            variables: n,
            constants,
            code: vec![],
            arguments: vec![],
            terms: vec![],
            pieces: vec![],
            units: vec![],
            rows: rows.len(),
            shared: vec![],
            patterns: vec![],
        };
        let mut seen = vec![usize::MAX; n + shared];
        let mut terms = vec![];
        let mut pace = Pace::default();
        for (u, members) in members.iter().enumerate() {
            let before = tape.terms.len();
            let code = tape.code.len() as u32..(tape.code.len() + members.len()) as u32;
            let (mut pattern, mut used) = (vec![], vec![]);
            let mut sees_variable = |i: usize, pattern: &mut Vec<u32>| {
                if std::mem::replace(&mut seen[i], u) != u {
                    pattern.push(i as u32);
                }
            };
            let mut shares = vec![];
            let mut sees = |k: usize, pattern: &mut Vec<u32>| match &graph.nodes[k] {
                Node::Constant(_) => {}
                Node::Variable(i) => sees_variable(*i, pattern),
                _ => shares.push(unit_of_shared[k]),
            };
            for &k in members {
                let k = k as usize;
                let node = &graph.nodes[k];
                if combination(graph, k, &inlined, &mut terms) {
                    let from = tape.terms.len() as u32;
                    for &(operand, c) in &terms {
                        let at = match operand {
                            Operand::Node(a) => {
                                sees(a, &mut pattern);
                                place[a]
                            }
                            Operand::Variable(i) => i as u32,
                        };
                        tape.terms.push((at, c));
                    }
                    tape.code.push(Code::Linear(from, tape.terms.len() as u32));
                } else {
                    node.arguments().for_each(|a| sees(a.0 as usize, &mut pattern));
                    tape.translate(node, &place);
                }
            }
            let root = match u.checked_sub(shared) {
                Some(i) => {
                    sees(rows[i].0 as usize, &mut pattern);
                    rows[i].0
                }
                None => roots[u] as u32,
            };
            // The variables of linear forms, and those of what is used.
            let at = code.start as usize;
            for code in &tape.code[at..] {
                if let Code::Linear(from, to) = *code {
                    let terms = tape.terms[from as usize..to as usize].iter();
                    let variables = terms.map(|term| term.0 as usize).filter(|&i| i < n);
                    variables.for_each(|i| sees_variable(i, &mut pattern));
                }
            }
            for d in shares.into_iter().filter(|&d| d != u32::MAX && d as usize != u) {
                if std::mem::replace(&mut seen[n + d as usize], u) != u {
                    used.push(d);
                }
            }
            for &d in &used {
                for at in tape.units[d as usize].pattern.clone() {
                    let i = tape.patterns[at as usize];
                    if std::mem::replace(&mut seen[i as usize], u) != u {
                        pattern.push(i);
                    }
                }
            }
            pattern.sort_unstable();
            let from = |list: &Vec<u32>| list.len() as u32;
            let (of_shared, of_patterns) = (from(&tape.shared), from(&tape.patterns));
            tape.shared.extend(used);
            tape.patterns.extend(pattern);
            tape.units.push(Unit {
                code,
                root: place[root as usize],
                shared: of_shared..from(&tape.shared),
                pattern: of_patterns..from(&tape.patterns),
            });
            let made = members.len() + tape.terms.len() - before;
            if pace.over(EACH * made as f64) {
                return None;
            }
        }
        Some(tape)
    }

    fn translate(&mut self, node: &Node, place: &[u32]) {
        let at = |a: &Id| place[a.0 as usize];
        let code = match node {
            Node::Unary(op, a) => Code::Unary(*op, at(a)),
            Node::Binary(op, a, b) => Code::Binary(*op, at(a), at(b)),
            Node::Nary(op, all) => {
                let from = self.arguments.len() as u32;
                self.arguments.extend(all.iter().map(at));
                Code::Nary(*op, from, self.arguments.len() as u32)
            }
            Node::If([a, b, c]) => Code::If([at(a), at(b), at(c)]),
            Node::Piecewise(piece, a) => {
                self.pieces.push(piece.clone());
                Code::Piecewise(self.pieces.len() as u32 - 1, at(a))
            }
            Node::Linear(_) => unreachable!("a combination"),
            Node::Constant(_) | Node::Variable(_) => unreachable!("no code"),
        };
        self.code.push(code);
    }

    /// The variables on which row i depends, ascending.
    pub(crate) fn pattern(&self, i: usize) -> &[u32] {
        let unit = &self.units[self.units.len() - self.rows + i];
        &self.patterns[unit.pattern.start as usize..unit.pattern.end as usize]
    }

    /// The number of operations of one evaluation.
    pub(crate) fn operations(&self) -> usize {
        self.code.len() + self.terms.len() + self.arguments.len()
    }

    fn first(&self) -> usize {
        self.variables + self.constants.len()
    }

    /// The values of all rows at x.
    pub(super) fn values<T: Number>(
        &self,
        x: impl IntoIterator<Item = T>,
        memory: &mut Memory<T>,
        mut row: impl FnMut(usize, T),
    ) {
        let values = &mut memory.values;
        let first = self.first();
        if values.len() != first + self.code.len() {
            values.clear();
            values.extend(std::iter::repeat_n(T::known(0.0), self.variables));
            values.extend(self.constants.iter().map(|c| T::known(*c)));
            values.resize(first + self.code.len(), T::known(0.0));
        }
        values.iter_mut().zip(x).for_each(|(v, x)| *v = x);
        for (k, code) in self.code.iter().enumerate() {
            values[first + k] = match *code {
                Code::Unary(op, a) => op.of(values[a as usize]),
                Code::Binary(op, a, b) => op.of(values[a as usize], values[b as usize]),
                Code::Linear(from, to) => {
                    let terms = self.terms[from as usize..to as usize].iter();
                    let terms = terms.map(|&(i, c)| T::known(c).mul(values[i as usize]));
                    terms.reduce(T::add).unwrap_or(T::known(0.0))
                }
                Code::Nary(op, from, to) => {
                    let all = &self.arguments[from as usize..to as usize];
                    op.of(all.iter().map(|&a| values[a as usize]))
                }
                Code::If([a, b, c]) => {
                    let condition = values[a as usize].value();
                    match condition {
                        _ if condition.is_nan() => T::known(f64::NAN),
                        0.0 => values[c as usize],
                        _ => values[b as usize],
                    }
                }
                Code::Piecewise(k, a) => {
                    let a = values[a as usize];
                    let (value, slope) = self.pieces[k as usize].at(a.value());
                    a.smooth(value, slope)
                }
            };
        }
        let units = &self.units[self.units.len() - self.rows..];
        units.iter().enumerate().for_each(|(i, unit)| row(i, values[unit.root as usize]));
    }

    /// The Jacobian at the point of the last [`values`](Self::values), row after row along the patterns. False where the time is over.
    pub(super) fn slopes(&self, memory: &mut Memory<f64>, jacobian: &mut [f64]) -> bool {
        let Memory { values, slopes, gradients } = memory;
        slopes.resize(values.len(), 0.0);
        let shared = self.units.len() - self.rows;
        let of_shared = self.units[..shared].last().map_or(0, |u| u.pattern.end as usize);
        gradients.resize(of_shared, 0.0);
        for (u, unit) in self.units.iter().enumerate() {
            if u % UNITS == UNITS - 1 && budget::over() {
                return false;
            }
            let pattern = &self.patterns[unit.pattern.start as usize..unit.pattern.end as usize];
            let used = &self.shared[unit.shared.start as usize..unit.shared.end as usize];
            pattern.iter().for_each(|&i| slopes[i as usize] = 0.0);
            used.iter().for_each(|&d| slopes[self.units[d as usize].root as usize] = 0.0);
            let first = self.first() as u32;
            let own = (first + unit.code.start) as usize..(first + unit.code.end) as usize;
            slopes[own].fill(0.0);
            slopes[unit.root as usize] = 1.0;
            for k in unit.code.clone().rev() {
                self.backwards(k as usize, values, slopes);
            }
            for &d in used {
                let unit = &self.units[d as usize];
                let c = slopes[unit.root as usize];
                if c != 0.0 {
                    for at in unit.pattern.start as usize..unit.pattern.end as usize {
                        slopes[self.patterns[at] as usize] += c * gradients[at];
                    }
                }
            }
            let at = unit.pattern.start as usize;
            let out = match u < shared {
                true => &mut gradients[at..at + pattern.len()],
                false => &mut jacobian[at - of_shared..at - of_shared + pattern.len()],
            };
            out.iter_mut().zip(pattern).for_each(|(out, &i)| *out = slopes[i as usize]);
        }
        true
    }

    /// Hands the slope of an operation on to its arguments.
    #[inline]
    fn backwards(&self, k: usize, values: &[f64], slopes: &mut [f64]) {
        let at = self.first() + k;
        let (value, slope) = (values[at], slopes[at]);
        if slope == 0.0 {
            return;
        }
        match self.code[k] {
            Code::Unary(op, a) => {
                slopes[a as usize] += slope * op.slope(values[a as usize], value);
            }
            Code::Binary(op, a, b) => {
                let (a, b) = (a as usize, b as usize);
                let [in_a, in_b] = slopes2(op, values[a], values[b], value);
                slopes[a] += slope * in_a;
                slopes[b] += slope * in_b;
            }
            Code::Linear(from, to) => {
                for &(i, c) in &self.terms[from as usize..to as usize] {
                    slopes[i as usize] += slope * c;
                }
            }
            Code::Nary(op, from, to) => {
                let all = &self.arguments[from as usize..to as usize];
                match op {
                    Nary::Sum => all.iter().for_each(|&a| slopes[a as usize] += slope),
                    Nary::Min | Nary::Max => {
                        if let Some(k) = op.chosen(all.iter().map(|&a| values[a as usize])) {
                            slopes[all[k] as usize] += slope;
                        }
                    }
                    _ => {}
                }
            }
            Code::If([a, b, c]) => {
                let chosen = if values[a as usize] != 0.0 { b } else { c };
                slopes[chosen as usize] += slope;
            }
            Code::Piecewise(k, a) => {
                slopes[a as usize] += slope * self.pieces[k as usize].at(values[a as usize]).1;
            }
        }
    }
}

/// What a sum is of.
#[derive(Debug, Clone, Copy)]
enum Operand {
    Variable(usize),
    Node(usize),
}

/// The summands of a sum, a difference, a negation, a linear form or a multiple, as (node, factor); none of other nodes.
fn summands(graph: &Graph, k: usize) -> Option<Vec<(Operand, f64)>> {
    let of = |a: Id, c: f64| (Operand::Node(a.0 as usize), c);
    let constant = |a: Id| match graph.nodes[a.0 as usize] {
        Node::Constant(c) => Some(c),
        _ => None,
    };
    Some(match &graph.nodes[k] {
        Node::Unary(Unary::Neg, a) => vec![of(*a, -1.0)],
        Node::Binary(Binary::Add, a, b) => vec![of(*a, 1.0), of(*b, 1.0)],
        Node::Binary(Binary::Sub, a, b) => vec![of(*a, 1.0), of(*b, -1.0)],
        Node::Binary(Binary::Mul, a, b) => match (constant(*a), constant(*b)) {
            (Some(c), None) => vec![of(*b, c)],
            (None, Some(c)) => vec![of(*a, c)],
            _ => return None,
        },
        Node::Nary(Nary::Sum, all) => all.iter().map(|a| of(*a, 1.0)).collect(),
        Node::Linear(terms) => terms.iter().map(|&(i, c)| (Operand::Variable(i), c)).collect(),
        _ => return None,
    })
}

/// Which nodes are sums themselves and used by one sum alone, so that their summands become its own: multiples anywhere, others where they come first, so that all is
/// added in the same order and no bit of the result changes. Only behind factors of 1 and −1: others would be rounded where they are multiplied, which doubled
/// precision would see.
fn inlined(graph: &Graph, rows: &[Id]) -> Vec<bool> {
    let mut uses = vec![0_u8; graph.nodes.len()];
    let mut used = |a: Id| uses[a.0 as usize] = uses[a.0 as usize].saturating_add(1);
    rows.iter().copied().for_each(&mut used);
    graph.nodes.iter().for_each(|node| node.arguments().for_each(&mut used));
    let mut inlined = vec![false; graph.nodes.len()];
    // How many summands a node has with those that become its own: none, one, more.
    let mut counts = vec![0_u8; graph.nodes.len()];
    for k in 0..graph.nodes.len() {
        for (at, (operand, c)) in summands(graph, k).unwrap_or_default().into_iter().enumerate() {
            let mut count = 1;
            if let Operand::Node(a) = operand
                && uses[a] == 1
                && (counts[a] == 1 && c.abs() == 1.0 || counts[a] > 1 && at == 0 && c == 1.0)
            {
                inlined[a] = true;
                count = counts[a];
            }
            counts[k] = (counts[k] + count).min(2);
        }
    }
    inlined
}

/// The summands of a sum with those of the sums in it, from left to right. False for what is no sum, and for one operation on two nodes, which is as good.
fn combination(graph: &Graph, k: usize, inlined: &[bool], terms: &mut Vec<(Operand, f64)>) -> bool {
    let Some(mut left) = summands(graph, k) else { return false };
    let is_inlined = |operand: &Operand| matches!(operand, Operand::Node(a) if inlined[*a]);
    let plain = matches!(graph.nodes[k], Node::Unary(..) | Node::Binary(..));
    if plain && !left.iter().any(|(operand, _)| is_inlined(operand)) {
        return false;
    }
    terms.clear();
    left.reverse();
    while let Some((operand, c)) = left.pop() {
        match operand {
            Operand::Node(a) if inlined[a] => {
                let inner = summands(graph, a).unwrap_or_default();
                left.extend(inner.into_iter().rev().map(|(operand, d)| (operand, c * d)));
            }
            _ => terms.push((operand, c)),
        }
    }
    true
}

/// To which row each node belongs, if to one alone; a node that several use belongs to itself.
fn owners(graph: &Graph, rows: &[Id]) -> Vec<Owner> {
    let mut owners = vec![Owner::Nobody; graph.nodes.len()];
    let claim = |owners: &mut Vec<Owner>, k: usize, by: Owner| {
        owners[k] = match owners[k] {
            Owner::Nobody => by,
            same if same == by => by,
            _ => Owner::Shared(k as u32),
        };
    };
    for (i, row) in rows.iter().enumerate() {
        claim(&mut owners, row.0 as usize, Owner::Row(i as u32));
    }
    for k in (0..graph.nodes.len()).rev() {
        if owners[k] == Owner::Nobody {
            continue;
        }
        for a in graph.nodes[k].arguments() {
            let by = owners[k];
            claim(&mut owners, a.0 as usize, by);
        }
    }
    owners
}
