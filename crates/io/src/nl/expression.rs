//! Expressions in prefix notation, read without recursion: chains may be as long as a file.

use nonsmooth_problem::field::{Binary, Graph, Id, Nary, Node, Piecewise};

use super::input::Input;
use super::operators::{Operator, operator};
use crate::IoError;

/// The graph under way: what a file has defined so far.
#[derive(Debug)]
pub(super) struct Builder {
    pub(super) graph: Graph,
    /// The nodes of the variables that were met.
    variables: Vec<Option<Id>>,
    /// Defined variables, by their number less that of the variables.
    pub(super) defined: Vec<Option<Id>>,
    /// Names of external functions, for messages.
    pub(super) functions: Vec<(usize, String)>,
}

/// An operator that waits for its arguments.
struct Frame {
    of: Waiting,
    /// Where its arguments begin.
    from: usize,
    /// How many are to come.
    left: usize,
}

enum Waiting {
    For(Operator),
    Piecewise(Piecewise),
    /// A call of an external function, in what is passed by.
    Call,
}

const PART: &str = "a number (n, s, l), a variable (v) or an operator (o)";

impl Builder {
    pub(super) fn new(variables: usize, defined: usize) -> Self {
        Self {
            graph: Graph::new(variables),
            variables: vec![None; variables],
            defined: vec![None; defined],
            functions: vec![],
        }
    }

    /// `v<k>`, which must be there.
    fn named(&mut self, input: &Input, k: i64, what: &str) -> Result<Id, IoError> {
        let n = self.variables.len();
        let found = usize::try_from(k).ok();
        if let Some(j) = found.filter(|&j| j < n) {
            let graph = &mut self.graph;
            return Ok(*self.variables[j].get_or_insert_with(|| graph.variable(j)));
        }
        let defined = found.and_then(|k| self.defined.get(k - n));
        match defined {
            Some(Some(id)) => Ok(*id),
            Some(None) => {
                let expected = format!("a segment V{k} before its use");
                Err(input.wrong(what, &expected, format!("`v{k}` without it")))
            }
            None => {
                let count = n + self.defined.len();
                let expected = format!("a variable below {count}, of which {n} are no definitions");
                Err(input.wrong(what, &expected, format!("`v{k}`")))
            }
        }
    }

    /// The next expression. What is `ignored` may call external functions.
    ///
    /// Errors: an unknown operator, variable or letter; a call; the end of the file.
    pub(super) fn expression(
        &mut self,
        input: &mut Input,
        what: &str,
        ignored: bool,
    ) -> Result<Id, IoError> {
        let mut operands: Vec<Id> = vec![];
        let mut frames: Vec<Frame> = vec![];
        loop {
            match input.letter(what, PART)? {
                b'n' => {
                    let x = input.finite(what)?;
                    operands.push(self.graph.constant(x));
                }
                b's' => {
                    let k = input.short(what)?;
                    operands.push(self.graph.constant(k as f64));
                }
                b'l' => {
                    let k = input.whole(what)?;
                    operands.push(self.graph.constant(k as f64));
                }
                b'v' => {
                    let k = input.whole(what)?;
                    operands.push(self.named(input, k, what)?);
                }
                b'o' => {
                    let (of, left) = self.operator(input, what)?;
                    frames.push(Frame { of, from: operands.len(), left });
                    continue;
                }
                b'f' => {
                    let (k, left) = (input.whole(what)?, input.count(usize::MAX, what)?);
                    if !ignored {
                        let name = self.functions.iter().find(|f| i64::try_from(f.0) == Ok(k));
                        let name = name.map_or(String::new(), |(_, name)| format!(" `{name}`"));
                        let found = format!("a call of the external function{name}");
                        return Err(input.wrong(what, "functions that AMPL has itself", found));
                    }
                    frames.push(Frame { of: Waiting::Call, from: operands.len(), left });
                    if left > 0 {
                        continue;
                    }
                }
                b'h' if ignored => {
                    input.skip_string()?;
                    operands.push(self.graph.constant(0.0));
                }
                b'h' => return Err(input.wrong(what, PART, "a string")),
                other => return Err(input.wrong(what, PART, input.found(other))),
            }
            // What is complete is an argument of what waits for it.
            loop {
                let Some(frame) = frames.last_mut() else {
                    return Ok(operands.remove(0));
                };
                frame.left = frame.left.saturating_sub(1);
                if frame.left > 0 {
                    break;
                }
                let Some(Frame { of, from, .. }) = frames.pop() else { break };
                let arguments = operands.split_off(from);
                operands.push(self.made(of, arguments));
            }
        }
    }

    /// An operator and how many arguments it waits for.
    fn operator(&mut self, input: &mut Input, what: &str) -> Result<(Waiting, usize), IoError> {
        let number = input.whole(what)?;
        let Some(of) = operator(number) else {
            let expected = "an operator of AMPL's table, from 0 to 80";
            return Err(input.wrong(what, expected, format!("`o{number}`")));
        };
        let arguments = match of {
            Operator::Unary(_) | Operator::Square => 1,
            Operator::Binary(_) => 2,
            Operator::If => 3,
            Operator::Nary(_) => {
                input.record(what, "the number of arguments")?;
                self.some(input, what)?
            }
            Operator::Piecewise => {
                input.record(what, "the number of slopes")?;
                let count = self.some(input, what)?;
                let (mut slopes, mut breaks) = (vec![], vec![]);
                for k in 0..2 * count - 1 {
                    const EXPECTED: &str = "a slope or a breakpoint (n, s, l)";
                    let x = match input.letter(what, EXPECTED)? {
                        b'n' => input.finite(what)?,
                        b's' => input.short(what)? as f64,
                        b'l' => input.whole(what)? as f64,
                        other => return Err(input.wrong(what, EXPECTED, input.found(other))),
                    };
                    if k % 2 == 0 { slopes.push(x) } else { breaks.push(x) }
                }
                let made = Piecewise::new(slopes, breaks);
                let expected = "slopes with ascending breakpoints between them";
                let made = made.map_err(|found| input.wrong(what, expected, found))?;
                return Ok((Waiting::Piecewise(made), 1));
            }
        };
        Ok((Waiting::For(of), arguments))
    }

    /// A number of arguments, of which there must be one.
    fn some(&self, input: &mut Input, what: &str) -> Result<usize, IoError> {
        match input.count(usize::MAX, what)? {
            0 => Err(input.wrong(what, "at least one argument", "0")),
            n => Ok(n),
        }
    }

    fn made(&mut self, of: Waiting, arguments: Vec<Id>) -> Id {
        let graph = &mut self.graph;
        match (of, &arguments[..]) {
            (Waiting::For(Operator::Unary(op)), &[a]) => graph.unary(op, a),
            (Waiting::For(Operator::Square), &[a]) => {
                let two = graph.constant(2.0);
                graph.binary(Binary::Pow, a, two)
            }
            (Waiting::For(Operator::Binary(op)), &[a, b]) => graph.binary(op, a, b),
            (Waiting::For(Operator::If), &[a, b, c]) => graph.add(Node::If([a, b, c])),
            (Waiting::For(Operator::Nary(Nary::Sum)), _) => graph.sum(arguments),
            (Waiting::For(Operator::Nary(op)), _) => graph.add(Node::Nary(op, arguments)),
            (Waiting::Piecewise(piece), &[a]) => graph.add(Node::Piecewise(piece, a)),
            // A call in what is passed by; other numbers of arguments do not occur.
            _ => graph.constant(0.0),
        }
    }

    /// `expression + Σ c_j x_j`.
    pub(super) fn with_linear(&mut self, expression: Id, terms: Vec<(usize, f64)>) -> Id {
        if terms.is_empty() {
            return expression;
        }
        let linear = self.graph.add(Node::Linear(terms));
        match self.graph.node(expression) {
            Node::Constant(x) if *x == 0.0 => linear,
            _ => self.graph.binary(Binary::Add, expression, linear),
        }
    }
}
