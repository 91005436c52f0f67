//! Expressions as a graph: what is shared is stated once, and an argument stands before what uses it.

use super::operator::{Binary, Nary, Unary};

/// A node of a [`Graph`].
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, PartialOrd, Ord)]
pub struct Id(pub(super) u32);

impl Id {
    /// Its place among the [`nodes`](Graph::nodes).
    pub fn index(self) -> usize {
        self.0 as usize
    }
}

/// What a node is.
#[derive(Debug, Clone, PartialEq)]
pub enum Node {
    /// A number.
    Constant(f64),
    /// x_i.
    Variable(usize),
    /// Of one node.
    Unary(Unary, Id),
    /// Of two nodes.
    Binary(Binary, Id, Id),
    /// Of any number of nodes.
    Nary(Nary, Vec<Id>),
    /// `Σ c_i x_i` over variables i.
    Linear(Vec<(usize, f64)>),
    /// The second where the first is not zero, else the third.
    If([Id; 3]),
    /// A piecewise linear function of a node that is 0 at 0.
    Piecewise(Piecewise, Id),
}

/// A continuous piecewise linear function f of a number with f(0) = 0, by its slopes and, ascending, the points between them.
#[derive(Debug, Clone, PartialEq)]
pub struct Piecewise {
    pub(super) slopes: Vec<f64>,
    pub(super) breaks: Vec<f64>,
}

impl Piecewise {
    /// A function of these slopes, one more than points.
    ///
    /// Errors: the message says what is wrong with the numbers.
    pub fn new(slopes: Vec<f64>, breaks: Vec<f64>) -> Result<Self, String> {
        if slopes.len() != breaks.len() + 1 {
            return Err(format!(
                "expected one slope more than breakpoints, found {} and {}",
                slopes.len(),
                breaks.len()
            ));
        }
        if !slopes.iter().chain(&breaks).all(|x| x.is_finite()) {
            return Err("expected finite slopes and breakpoints".into());
        }
        match breaks.windows(2).find(|w| w[0] > w[1]) {
            Some(w) => {
                Err(format!("expected ascending breakpoints, found {} after {}", w[1], w[0]))
            }
            None => Ok(Self { slopes, breaks }),
        }
    }

    /// The slopes.
    pub fn slopes(&self) -> &[f64] {
        &self.slopes
    }

    /// The points between them.
    pub fn breaks(&self) -> &[f64] {
        &self.breaks
    }

    /// The value at x, and the slope: at a point between two, the left one right of 0 and the right one left of it.
    pub(super) fn at(&self, x: f64) -> (f64, f64) {
        // From 0 towards x over the points between.
        let (mut at, mut value) = (0.0, 0.0);
        if x >= 0.0 {
            let mut k = self.breaks.partition_point(|b| *b <= 0.0);
            while k < self.breaks.len() && self.breaks[k] < x {
                value += self.slopes[k] * (self.breaks[k] - at);
                at = self.breaks[k];
                k += 1;
            }
            (value + self.slopes[k] * (x - at), self.slopes[k])
        } else {
            let mut k = self.breaks.partition_point(|b| *b < 0.0);
            while k > 0 && self.breaks[k - 1] > x {
                value += self.slopes[k] * (self.breaks[k - 1] - at);
                at = self.breaks[k - 1];
                k -= 1;
            }
            (value + self.slopes[k] * (x - at), self.slopes[k])
        }
    }
}

/// Expressions of n variables that may share parts.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Graph {
    pub(super) variables: usize,
    pub(super) nodes: Vec<Node>,
}

impl Graph {
    /// No expressions yet, of so many variables.
    pub fn new(variables: usize) -> Self {
        Self { variables, nodes: vec![] }
    }

    /// The number of variables.
    pub fn variables(&self) -> usize {
        self.variables
    }

    /// The nodes, arguments before what uses them.
    pub fn nodes(&self) -> &[Node] {
        &self.nodes
    }

    /// A node.
    ///
    /// # Panics
    ///
    /// Where the graph has none of this name.
    pub fn node(&self, id: Id) -> &Node {
        &self.nodes[id.0 as usize]
    }

    /// Adds a node.
    ///
    /// # Panics
    ///
    /// Where an argument is not in the graph yet, or a variable is beyond their number.
    pub fn add(&mut self, node: Node) -> Id {
        let id = Id(u32::try_from(self.nodes.len()).expect("fewer than 2^32 nodes"));
        let known = |a: &Id| assert!(a.0 < id.0, "an argument stands before what uses it");
        let variable = |i: usize| assert!(i < self.variables, "a variable of the graph");
        match &node {
            Node::Constant(_) => {}
            Node::Variable(i) => variable(*i),
            Node::Unary(_, a) | Node::Piecewise(_, a) => known(a),
            Node::Binary(_, a, b) => [a, b].into_iter().for_each(known),
            Node::Nary(_, all) => all.iter().for_each(known),
            Node::If(all) => all.iter().for_each(known),
            Node::Linear(terms) => terms.iter().for_each(|t| variable(t.0)),
        }
        self.nodes.push(node);
        id
    }

    /// A number.
    pub fn constant(&mut self, x: f64) -> Id {
        self.add(Node::Constant(x))
    }

    /// x_i.
    pub fn variable(&mut self, i: usize) -> Id {
        self.add(Node::Variable(i))
    }

    /// An operation on one node.
    pub fn unary(&mut self, op: Unary, a: Id) -> Id {
        self.add(Node::Unary(op, a))
    }

    /// An operation on two nodes.
    pub fn binary(&mut self, op: Binary, a: Id, b: Id) -> Id {
        self.add(Node::Binary(op, a, b))
    }

    /// The sum; of one node, itself.
    pub fn sum(&mut self, all: Vec<Id>) -> Id {
        match all[..] {
            [] => self.constant(0.0),
            [one] => one,
            [a, b] => self.binary(Binary::Add, a, b),
            _ => self.add(Node::Nary(Nary::Sum, all)),
        }
    }

    /// Whether two expressions, of this graph and of another, are the same.
    pub fn same(&self, a: Id, other: &Self, b: Id) -> bool {
        // What was found equal already is not compared again.
        let mut seen = std::collections::HashSet::new();
        let mut left = vec![(a, b)];
        while let Some((a, b)) = left.pop() {
            if !seen.insert((a, b)) {
                continue;
            }
            let (x, y) = (self.node(a), other.node(b));
            let alike = match (x, y) {
                (Node::Unary(p, _), Node::Unary(q, _)) => p == q,
                (Node::Binary(p, ..), Node::Binary(q, ..)) => p == q,
                (Node::Nary(p, a), Node::Nary(q, b)) => p == q && a.len() == b.len(),
                (Node::Piecewise(p, _), Node::Piecewise(q, _)) => p == q,
                (Node::If(_), Node::If(_)) => true,
                _ => x == y,
            };
            if !alike {
                return false;
            }
            left.extend(x.arguments().zip(y.arguments()));
        }
        true
    }
}

impl Node {
    /// The nodes that it uses.
    pub fn arguments(&self) -> impl DoubleEndedIterator<Item = Id> + '_ {
        let (few, many): ([Option<Id>; 2], &[Id]) = match self {
            Self::Constant(_) | Self::Variable(_) | Self::Linear(_) => ([None; 2], &[]),
            Self::Unary(_, a) | Self::Piecewise(_, a) => ([Some(*a), None], &[]),
            Self::Binary(_, a, b) => ([Some(*a), Some(*b)], &[]),
            Self::Nary(_, all) => ([None; 2], all),
            Self::If(all) => ([None; 2], all),
        };
        few.into_iter().flatten().chain(many.iter().copied())
    }
}
