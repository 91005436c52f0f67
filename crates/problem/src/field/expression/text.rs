//! Expressions as text: infix, as people write them.
//!
//! ```text
//! operators    ||   &&   < <= == >= > !=   + -   * /   - ! (before a number)   ^        from the loosest to the tightest; ^ from the right
//! functions    abs sqrt exp log ln log10 sin cos tan asin acos atan sinh cosh tanh asinh acosh atanh logistic floor ceil
//!              atan2(y, x) pow(a, b) signpow(a, b) mod(a, b) div(a, b) less(a, b) round(a, d) trunc(a, d) precision(a, d) iff(a, b)
//!              min max sum count numberof all any alldiff somesame            of any number of arguments
//!              if(condition, a, b)   piecewise(x, slope, point, slope, …)
//! constants    pi e                                                            where no variable has the name
//! names        letters, digits, _ and inner dots, with a subscript `q[1,2]`; others between backticks
//! ```
//!
//! Neither reading nor writing recurs. What is written twice is one node of the graph.

use std::borrow::Cow;
use std::collections::HashMap;

use super::graph::{Graph, Id, Node, Piecewise};
use super::operator::{Binary, Nary, Unary};
use super::{Expressions, Field};
use crate::ProblemError;

/// Functions of one number by name; of two names the first is written.
const UNARY: [(&str, Unary); 21] = [
    ("abs", Unary::Abs),
    ("sqrt", Unary::Sqrt),
    ("exp", Unary::Exp),
    ("log", Unary::Log),
    ("ln", Unary::Log),
    ("log10", Unary::Log10),
    ("sin", Unary::Sin),
    ("cos", Unary::Cos),
    ("tan", Unary::Tan),
    ("asin", Unary::Asin),
    ("acos", Unary::Acos),
    ("atan", Unary::Atan),
    ("sinh", Unary::Sinh),
    ("cosh", Unary::Cosh),
    ("tanh", Unary::Tanh),
    ("asinh", Unary::Asinh),
    ("acosh", Unary::Acosh),
    ("atanh", Unary::Atanh),
    ("logistic", Unary::Logistic),
    ("floor", Unary::Floor),
    ("ceil", Unary::Ceil),
];

/// Functions of two numbers by name.
const BINARY: [(&str, Binary); 10] = [
    ("atan2", Binary::Atan2),
    ("pow", Binary::Pow),
    ("signpow", Binary::SignPow),
    ("mod", Binary::Rem),
    ("div", Binary::IntDiv),
    ("less", Binary::Less),
    ("round", Binary::Round),
    ("trunc", Binary::Trunc),
    ("precision", Binary::Precision),
    ("iff", Binary::Iff),
];

/// Functions of any number of numbers by name.
const NARY: [(&str, Nary); 9] = [
    ("min", Nary::Min),
    ("max", Nary::Max),
    ("sum", Nary::Sum),
    ("count", Nary::Count),
    ("numberof", Nary::NumberOf),
    ("all", Nary::All),
    ("any", Nary::Any),
    ("alldiff", Nary::AllDiff),
    ("somesame", Nary::SomeSame),
];

/// Operators between two numbers, and how tightly they bind; of symbols one of which begins another, the longer first.
const INFIX: [(&str, Binary, u8); 13] = [
    ("||", Binary::Or, 1),
    ("&&", Binary::And, 2),
    ("<=", Binary::Le, COMPARISON),
    (">=", Binary::Ge, COMPARISON),
    ("==", Binary::Eq, COMPARISON),
    ("!=", Binary::Ne, COMPARISON),
    ("<", Binary::Lt, COMPARISON),
    (">", Binary::Gt, COMPARISON),
    ("+", Binary::Add, 4),
    ("-", Binary::Sub, 4),
    ("*", Binary::Mul, 5),
    ("/", Binary::Div, 5),
    ("^", Binary::Pow, POWER),
];

/// Two comparisons in a row need parentheses.
const COMPARISON: u8 = 3;
const PREFIX: u8 = 6;
const POWER: u8 = 7;
const ATOM: u8 = 8;

/// The most bytes of text that are written for a problem: what rows share is written as often as it is used.
const MOST: usize = 1 << 26;

/// What a name before a parenthesis means.
#[derive(Debug, Clone, Copy)]
enum Function {
    Unary(Unary),
    Binary(Binary),
    Nary(Nary),
    If,
    Piecewise,
}

impl Function {
    fn all() -> impl Iterator<Item = (&'static str, Self)> {
        let unary = UNARY.into_iter().map(|(name, op)| (name, Self::Unary(op)));
        let binary = BINARY.into_iter().map(|(name, op)| (name, Self::Binary(op)));
        let nary = NARY.into_iter().map(|(name, op)| (name, Self::Nary(op)));
        unary.chain(binary).chain(nary).chain([("if", Self::If), ("piecewise", Self::Piecewise)])
    }

    /// The numbers of arguments that it takes, in words, and whether it takes so many.
    fn takes(self, count: usize) -> (&'static str, bool) {
        match self {
            Self::Unary(_) => ("one argument", count == 1),
            Self::Binary(_) => ("two arguments", count == 2),
            Self::Nary(_) => ("at least one argument", count >= 1),
            Self::If => ("three arguments: a condition and two values", count == 3),
            Self::Piecewise => {
                ("x, a slope, and a point and a slope each", count >= 2 && count.is_multiple_of(2))
            }
        }
    }
}

/// A piece of text.
#[derive(Debug, Clone, PartialEq)]
enum Token<'a> {
    Number(f64),
    Name(Cow<'a, str>),
    Symbol(&'static str),
    End,
}

/// What stands between operands that are not used yet.
#[derive(Debug, Clone, Copy)]
enum Waiting {
    Plus,
    Unary(Unary),
    Infix(Binary, u8),
    Open,
    /// With the place of its name, and the operands before its arguments.
    Call(Function, usize, usize),
}

/// A row's text while it is read.
struct Reader<'a> {
    row: usize,
    text: &'a str,
    /// Where in the text the reader is, and where the last token begins.
    at: usize,
    begins: usize,
}

impl<'a> Reader<'a> {
    /// An error at a byte of the text.
    fn error(
        &self,
        at: usize,
        expected: impl Into<String>,
        found: impl Into<String>,
    ) -> ProblemError {
        let column = 1 + self.text[..at].chars().count();
        let place = format!("F[{}], column {column}", self.row);
        ProblemError::Value { place, expected: expected.into(), found: found.into() }
    }

    /// An error at the last token.
    fn unexpected(&self, expected: impl Into<String>) -> ProblemError {
        let found = match &self.text[self.begins..self.at] {
            "" => "the end".into(),
            token => format!("`{token}`"),
        };
        self.error(self.begins, expected, found)
    }

    /// Takes characters as long as they are such.
    fn take(&mut self, is: impl Fn(char) -> bool) {
        let rest = &self.text[self.at..];
        self.at += rest.find(|c| !is(c)).unwrap_or(rest.len());
    }

    fn follows(&self, what: impl FnMut(char) -> bool) -> bool {
        self.text[self.at..].starts_with(what)
    }

    fn token(&mut self) -> Result<Token<'a>, ProblemError> {
        self.take(char::is_whitespace);
        self.begins = self.at;
        let rest = &self.text[self.at..];
        let Some(first) = rest.chars().next() else { return Ok(Token::End) };
        if first.is_ascii_digit() || first == '.' {
            return self.number();
        }
        if is_letter(first) {
            return self.name();
        }
        if first == '`' {
            return self.quoted();
        }
        let symbols = INFIX.iter().map(|op| op.0).chain(["!", "(", ")", ","]);
        match symbols.into_iter().find(|s| rest.starts_with(s)) {
            Some(symbol) => {
                self.at += symbol.len();
                Ok(Token::Symbol(symbol))
            }
            None => {
                self.at += first.len_utf8();
                Err(self.unexpected("a number, a name, an operator or a parenthesis"))
            }
        }
    }

    fn number(&mut self) -> Result<Token<'a>, ProblemError> {
        let digit = |c: char| c.is_ascii_digit();
        self.take(digit);
        if self.follows(|c| c == '.') {
            self.at += 1;
            self.take(digit);
        }
        let mantissa = self.at;
        if self.follows(|c| matches!(c, 'e' | 'E')) {
            self.at += 1;
            if self.follows(|c| matches!(c, '+' | '-')) {
                self.at += 1;
            }
            // Without digits it is no exponent.
            if self.follows(digit) { self.take(digit) } else { self.at = mantissa }
        }
        match self.text[self.begins..self.at].parse::<f64>() {
            Ok(x) if x.is_finite() => Ok(Token::Number(x)),
            _ => Err(self.unexpected("a finite number")),
        }
    }

    fn name(&mut self) -> Result<Token<'a>, ProblemError> {
        self.at = self.begins + plain_name(&self.text[self.begins..]);
        if self.follows(|c| c == '[') {
            return Err(self.error(self.at, "a `]` that closes this", "none"));
        }
        Ok(Token::Name(self.text[self.begins..self.at].into()))
    }

    /// A name between backticks; two of them stand for one in the name.
    fn quoted(&mut self) -> Result<Token<'a>, ProblemError> {
        let mut name = String::new();
        loop {
            let rest = &self.text[self.at + 1..];
            let Some(length) = rest.find('`') else {
                return Err(self.error(self.begins, "a second ` that closes this", "none"));
            };
            name.push_str(&rest[..length]);
            self.at += length + 2;
            if !self.follows(|c| c == '`') {
                return Ok(Token::Name(name.into()));
            }
            name.push('`');
        }
    }
}

/// Whether a name may begin with it.
fn is_letter(c: char) -> bool {
    c.is_alphabetic() || c == '_'
}

/// The bytes of the name, with its subscript, with which a text begins that begins with a letter.
fn plain_name(text: &str) -> usize {
    let mut end = 0;
    loop {
        let rest = &text[end..];
        let of_name = |c: char| c.is_alphanumeric() || c == '_';
        end += rest.find(|c| !of_name(c)).unwrap_or(rest.len());
        // A dot between parts of a name, and a subscript.
        let rest = &text[end..];
        let mut next = rest.chars();
        match next.next() {
            Some('.') if next.next().is_some_and(is_letter) => end += 1,
            Some('[') => match rest.find(']') {
                Some(length) => end += length + 1,
                None => return end,
            },
            _ => return end,
        }
    }
}

/// A graph in which what is the same is one node.
struct Builder {
    graph: Graph,
    known: HashMap<Key, Id>,
}

/// What tells nodes apart.
#[derive(PartialEq, Eq, Hash)]
enum Key {
    Constant(u64),
    Variable(usize),
    Unary(Unary, Id),
    Binary(Binary, Id, Id),
    Nary(Nary, Vec<Id>),
    If([Id; 3]),
    Piecewise(Vec<u64>, Id),
}

impl Builder {
    fn add(&mut self, node: Node) -> Id {
        let key = match &node {
            Node::Constant(x) => Key::Constant(x.to_bits()),
            Node::Variable(i) => Key::Variable(*i),
            Node::Unary(op, a) => Key::Unary(*op, *a),
            Node::Binary(op, a, b) => Key::Binary(*op, *a, *b),
            Node::Nary(op, all) => Key::Nary(*op, all.clone()),
            Node::If(all) => Key::If(*all),
            Node::Piecewise(piece, a) => {
                let numbers = piece.slopes.iter().chain(&piece.breaks);
                Key::Piecewise(numbers.map(|x| x.to_bits()).collect(), *a)
            }
            Node::Linear(_) => return self.graph.add(node),
        };
        *self.known.entry(key).or_insert_with(|| self.graph.add(node))
    }

    fn number(&self, a: Id) -> Option<f64> {
        match self.graph.node(a) {
            Node::Constant(x) => Some(*x),
            _ => None,
        }
    }

    fn unary(&mut self, op: Unary, a: Id) -> Id {
        match (op, self.number(a)) {
            (Unary::Neg, Some(x)) => self.add(Node::Constant(-x)),
            _ => self.add(Node::Unary(op, a)),
        }
    }

    fn binary(&mut self, op: Binary, a: Id, b: Id) -> Id {
        match (op, self.number(b)) {
            (Binary::Pow, Some(2.0)) => self.add(Node::Unary(Unary::Square, a)),
            _ => self.add(Node::Binary(op, a, b)),
        }
    }

    fn call(&mut self, function: Function, all: &[Id]) -> Result<Id, String> {
        Ok(match (function, all) {
            (Function::Unary(op), &[a]) => self.unary(op, a),
            (Function::Binary(op), &[a, b]) => self.binary(op, a, b),
            (Function::Nary(Nary::Sum), &[first, ref others @ ..]) => {
                others.iter().fold(first, |sum, &a| self.binary(Binary::Add, sum, a))
            }
            (Function::Nary(op), _) => self.add(Node::Nary(op, all.into())),
            (Function::If, &[c, a, b]) => self.add(Node::If([c, a, b])),
            (Function::Piecewise, &[x, ref numbers @ ..]) => {
                let numbers: Option<Vec<f64>> = numbers.iter().map(|&a| self.number(a)).collect();
                let numbers = numbers.ok_or("expected numbers after x, found an expression")?;
                let of = |first| numbers.iter().skip(first).step_by(2).copied().collect();
                let piece = Piecewise::new(of(0), of(1))?;
                self.add(Node::Piecewise(piece, x))
            }
            _ => return Err("another number of arguments".into()),
        })
    }
}

/// The names of n variables: those given, or `x1, …, xn`.
fn names_of(names: &[String], n: usize) -> Cow<'_, [String]> {
    match names {
        [] => (1..=n).map(|i| format!("x{i}")).collect::<Vec<_>>().into(),
        _ => names.into(),
    }
}

/// Which variable has a name.
///
/// Errors: a name that is empty or another's.
fn numbered(names: &[String]) -> Result<HashMap<&str, usize>, ProblemError> {
    let mut variables = HashMap::with_capacity(names.len());
    for (i, name) in names.iter().enumerate() {
        if name.is_empty() {
            return Err(ProblemError::value(format!("names[{i}]"), "a name", "none"));
        }
        if let Some(j) = variables.insert(name.as_str(), i) {
            let found = format!("`{name}`, as names[{j}]");
            return Err(ProblemError::value(format!("names[{i}]"), "a name of its own", found));
        }
    }
    Ok(variables)
}

/// Names as a message shows them.
fn shown(names: &[String]) -> String {
    match names {
        [first, .., last] if names.len() > 8 => format!("{first}, …, {last}"),
        _ => names.join(", "),
    }
}

/// A row, read.
struct Rows<'a> {
    builder: Builder,
    variables: HashMap<&'a str, usize>,
    names: &'a [String],
    operands: Vec<Id>,
    waiting: Vec<Waiting>,
}

impl Rows<'_> {
    /// Uses the operators that bind at least as tightly.
    fn reduce(&mut self, level: u8) {
        while let Some(&waiting) = self.waiting.last() {
            let binds = match waiting {
                Waiting::Plus | Waiting::Unary(_) => PREFIX,
                Waiting::Infix(_, level) => level,
                Waiting::Open | Waiting::Call(..) => return,
            };
            if binds < level {
                return;
            }
            self.waiting.pop();
            match (waiting, self.operands.pop()) {
                (Waiting::Unary(op), Some(a)) => self.operands.push(self.builder.unary(op, a)),
                (Waiting::Infix(op, _), Some(b)) => {
                    let a = self.operands.pop().expect("an operand before an infix operator");
                    self.operands.push(self.builder.binary(op, a, b));
                }
                (_, a) => self.operands.extend(a),
            }
        }
    }

    fn named(&mut self, name: &str, reader: &Reader) -> Result<Id, ProblemError> {
        if let Some(&i) = self.variables.get(name) {
            return Ok(self.builder.add(Node::Variable(i)));
        }
        match name {
            "pi" => Ok(self.builder.add(Node::Constant(std::f64::consts::PI))),
            "e" => Ok(self.builder.add(Node::Constant(std::f64::consts::E))),
            _ => Err(reader.unexpected(format!("a variable ({})", shown(self.names)))),
        }
    }

    fn row(&mut self, row: usize, text: &str) -> Result<Id, ProblemError> {
        let mut reader = Reader { row, text, at: 0, begins: 0 };
        self.operands.clear();
        self.waiting.clear();
        // Between operands: what comes next is an operand, or an operator.
        let mut operand = true;
        loop {
            let token = reader.token()?;
            if operand {
                operand = false;
                match token {
                    Token::Number(x) => {
                        let number = self.builder.add(Node::Constant(x));
                        self.operands.push(number);
                    }
                    Token::Name(name) => {
                        let (begins, ends) = (reader.begins, reader.at);
                        reader.take(char::is_whitespace);
                        if reader.follows(|c| c == '(') {
                            let Some((_, function)) = Function::all().find(|f| f.0 == name) else {
                                let all: Vec<_> = Function::all().map(|f| f.0).collect();
                                let expected = format!("a function ({})", all.join(", "));
                                return Err(reader.error(begins, expected, format!("`{name}`")));
                            };
                            reader.at += 1;
                            let call = Waiting::Call(function, begins, self.operands.len());
                            self.waiting.push(call);
                            operand = true;
                        } else {
                            reader.at = ends;
                            let variable = self.named(&name, &reader)?;
                            self.operands.push(variable);
                        }
                    }
                    Token::Symbol(symbol @ ("(" | "-" | "!" | "+")) => {
                        self.waiting.push(match symbol {
                            "(" => Waiting::Open,
                            "-" => Waiting::Unary(Unary::Neg),
                            "!" => Waiting::Unary(Unary::Not),
                            _ => Waiting::Plus,
                        });
                        operand = true;
                    }
                    _ => return Err(reader.unexpected("a number, a name, a function or `(`")),
                }
                continue;
            }
            if let Token::Symbol(symbol) = token
                && let Some(&(_, op, level)) = INFIX.iter().find(|op| op.0 == symbol)
            {
                // A power is used after those to its right; comparisons do not follow each other.
                self.reduce(level + u8::from(matches!(level, POWER | COMPARISON)));
                if level == COMPARISON
                    && matches!(self.waiting.last(), Some(Waiting::Infix(_, COMPARISON)))
                {
                    return Err(reader.unexpected("parentheses around one of two comparisons"));
                }
                self.waiting.push(Waiting::Infix(op, level));
                operand = true;
                continue;
            }
            self.reduce(0);
            match (token, self.waiting.last().copied()) {
                (Token::End, None) => return Ok(self.operands[0]),
                (Token::Symbol(","), Some(Waiting::Call(..))) => operand = true,
                (Token::Symbol(")"), Some(Waiting::Open)) => {
                    self.waiting.pop();
                }
                (Token::Symbol(")"), Some(Waiting::Call(function, begins, before))) => {
                    self.waiting.pop();
                    let arguments = self.operands.split_off(before);
                    let (expected, right) = function.takes(arguments.len());
                    if !right {
                        let name = &text[begins..begins + plain_name(&text[begins..])];
                        let expected = format!("{expected} of `{name}`");
                        return Err(reader.error(begins, expected, arguments.len().to_string()));
                    }
                    let made = self.builder.call(function, &arguments).map_err(|said| {
                        reader.error(begins, "slopes with ascending points between them", said)
                    })?;
                    self.operands.push(made);
                }
                (_, Some(Waiting::Call(..))) => {
                    return Err(reader.unexpected("an operator, `,` or `)`"));
                }
                (_, Some(_)) => return Err(reader.unexpected("an operator or `)`")),
                (_, None) => return Err(reader.unexpected("an operator or the end")),
            }
        }
    }
}

impl Expressions {
    /// Of one text for each row, in as many variables, with these names or `x1, …, xn`. Cost: the length of the texts.
    ///
    /// Errors: what cannot be read, by row and column; a name that is empty or another's; another number of names than rows.
    pub fn parse(texts: &[String], names: &[String]) -> Result<Self, ProblemError> {
        let n = texts.len();
        if !names.is_empty() && names.len() != n {
            let expected = format!("{} expressions, as there are as many names", names.len());
            return Err(ProblemError::shape("F", expected, n.to_string()));
        }
        let names = names_of(names, n);
        let variables = numbered(&names)?;
        let builder = Builder { graph: Graph::new(n), known: HashMap::new() };
        let (operands, waiting) = (vec![], vec![]);
        let mut rows = Rows { builder, variables, names: &names, operands, waiting };
        let read = texts.iter().enumerate().map(|(i, text)| rows.row(i, text));
        let read = read.collect::<Result<Vec<_>, _>>()?;
        Self::new(rows.builder.graph, read)
    }

    /// A text for each row, with these names of variables or `x1, …, xn`: [`parse`](Self::parse) makes of it what has the same values bit for bit. What
    /// rows share is written as often as they use it.
    ///
    /// Errors: another number of names than variables, a name that is empty or another's; texts of more than 64 MiB.
    pub fn texts(&self, names: &[String]) -> Result<Vec<String>, ProblemError> {
        let n = self.dim();
        if !names.is_empty() && names.len() != n {
            let found = names.len().to_string();
            return Err(ProblemError::shape("names", format!("{n}, one for each variable"), found));
        }
        numbered(names)?;
        let names: Vec<_> = names_of(names, n).iter().map(|name| written(name)).collect();
        let mut left = MOST;
        let text = |(i, &row)| {
            let text = self.text(row, &names, left).ok_or_else(|| {
                let expected = format!("at most {} MiB of text", MOST >> 20);
                ProblemError::value(format!("F[{i}]"), expected, "more, as it shares many parts")
            })?;
            left -= text.len();
            Ok(text)
        };
        self.rows().iter().enumerate().map(text).collect()
    }

    /// The text of a node, if it is no longer than so many bytes.
    fn text(&self, root: Id, names: &[String], most: usize) -> Option<String> {
        let mut out = String::new();
        let mut left = vec![Piece::Node(root, 0)];
        while let Some(piece) = left.pop() {
            match piece {
                Piece::Text(text) => out.push_str(text),
                Piece::Node(id, least) => {
                    let from = left.len();
                    let node = self.graph().node(id);
                    let loose = level(node) < least;
                    left.extend(loose.then_some(Piece::Text("(")));
                    pieces(node, &mut left);
                    left.extend(loose.then_some(Piece::Text(")")));
                    left[from..].reverse();
                }
                Piece::Number(x) => out.push_str(&number(x)),
                Piece::Variable(i) => out.push_str(&names[i]),
            }
            if out.len() > most {
                return None;
            }
        }
        Some(out)
    }
}

/// What is still to be written.
#[derive(Debug, Clone, Copy)]
enum Piece {
    Text(&'static str),
    Number(f64),
    Variable(usize),
    /// In parentheses where it binds less tightly.
    Node(Id, u8),
}

/// A name as it stands in a text.
fn written(name: &str) -> String {
    match name.starts_with(is_letter) && plain_name(name) == name.len() {
        true => name.into(),
        false => format!("`{}`", name.replace('`', "``")),
    }
}

/// With as many digits as tell it from all others.
fn number(x: f64) -> String {
    let text = format!("{x:?}");
    match text.strip_suffix(".0") {
        Some(whole) => whole.into(),
        None => text,
    }
}

/// The value of an operation on no numbers.
fn of_none(op: Nary) -> Node {
    Node::Constant(op.of(std::iter::empty()))
}

/// How tightly what is written of a node binds.
fn level(node: &Node) -> u8 {
    let infix = |op: Binary| INFIX.iter().find(|of| of.1 == op).map_or(ATOM, |of| of.2);
    match node {
        Node::Constant(x) if !x.is_finite() => infix(Binary::Div),
        Node::Constant(x) if x.is_sign_negative() => PREFIX,
        Node::Unary(Unary::Neg | Unary::Not, _) => PREFIX,
        Node::Unary(Unary::Square, _) => POWER,
        Node::Binary(op, ..) => infix(*op),
        Node::Nary(op, all) if all.is_empty() => level(&of_none(*op)),
        Node::Nary(Nary::Sum, all) if all.len() > 1 => infix(Binary::Add),
        Node::Linear(terms) => match terms[..] {
            [] => ATOM,
            [_] => infix(Binary::Mul),
            _ => infix(Binary::Add),
        },
        _ => ATOM,
    }
}

/// What a node is written of, in this order.
fn pieces(node: &Node, out: &mut Vec<Piece>) {
    use Piece::{Number, Text, Variable};
    let function = |out: &mut Vec<Piece>, name, all: &[Id]| {
        out.extend([Text(name), Text("(")]);
        for (k, a) in all.iter().enumerate() {
            out.extend((k > 0).then_some(Text(", ")));
            out.push(Piece::Node(*a, 0));
        }
        out.push(Text(")"));
    };
    match node {
        Node::Constant(x) if x.is_nan() => out.push(Text("0/0")),
        Node::Constant(f64::INFINITY) => out.push(Text("1/0")),
        Node::Constant(f64::NEG_INFINITY) => out.push(Text("-1/0")),
        Node::Constant(x) => out.push(Number(*x)),
        Node::Variable(i) => out.push(Variable(*i)),
        Node::Unary(Unary::Neg, a) => out.extend([Text("-"), Piece::Node(*a, PREFIX)]),
        Node::Unary(Unary::Not, a) => out.extend([Text("!"), Piece::Node(*a, PREFIX)]),
        Node::Unary(Unary::Square, a) => out.extend([Piece::Node(*a, ATOM), Text("^2")]),
        Node::Unary(op, a) => {
            let name = UNARY.iter().find(|of| of.1 == *op).map_or("", |of| of.0);
            function(out, name, &[*a]);
        }
        Node::Binary(op, a, b) => match INFIX.iter().find(|of| of.1 == *op) {
            Some(&(symbol, _, level)) => {
                let (left, right) = match level {
                    POWER => (ATOM, PREFIX),
                    COMPARISON => (level + 1, level + 1),
                    _ => (level, level + 1),
                };
                let spaced = !matches!(op, Binary::Mul | Binary::Div | Binary::Pow);
                let space = spaced.then_some(Text(" "));
                out.push(Piece::Node(*a, left));
                out.extend(space);
                out.push(Text(symbol));
                out.extend(space);
                out.push(Piece::Node(*b, right));
            }
            None => {
                let name = BINARY.iter().find(|of| of.1 == *op).map_or("", |of| of.0);
                function(out, name, &[*a, *b]);
            }
        },
        Node::Nary(op, all) if all.is_empty() => pieces(&of_none(*op), out),
        Node::Nary(Nary::Sum, all) if all.len() > 1 => {
            for (k, a) in all.iter().enumerate() {
                out.extend((k > 0).then_some(Text(" + ")));
                out.push(Piece::Node(*a, if k > 0 { 5 } else { 4 }));
            }
        }
        Node::Nary(op, all) => {
            let name = NARY.iter().find(|of| of.1 == *op).map_or("", |of| of.0);
            function(out, name, all);
        }
        Node::Linear(terms) => {
            out.extend(terms.is_empty().then_some(Number(0.0)));
            for (k, &(i, c)) in terms.iter().enumerate() {
                let (sign, c) = match k {
                    0 => (None, c),
                    _ if c.is_sign_negative() => (Some(" - "), -c),
                    _ => (Some(" + "), c),
                };
                out.extend(sign.map(Text));
                out.extend((c != 1.0).then_some([Number(c), Text("*")]).into_iter().flatten());
                out.push(Variable(i));
            }
        }
        Node::If(all) => function(out, "if", all),
        Node::Piecewise(piece, a) => {
            out.extend([Text("piecewise("), Piece::Node(*a, 0)]);
            for (k, slope) in piece.slopes.iter().enumerate() {
                let point = k.checked_sub(1).map(|k| [Text(", "), Number(piece.breaks[k])]);
                out.extend(point.into_iter().flatten());
                out.extend([Text(", "), Number(*slope)]);
            }
            out.push(Text(")"));
        }
    }
}

#[cfg(test)]
mod tests;
