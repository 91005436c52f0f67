//! The segments of a file.

use std::path::Path;

use nonsmooth_problem::field::{Graph, Id};

use super::expression::Builder;
use super::header::{Echo, Header, header};
use super::input::Input;
use crate::IoError;
use crate::format::bytes;

/// What a row of the file asks for.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) enum Condition {
    /// `l ≤ c(x) ≤ u`, of infinite bounds nothing.
    Between(f64, f64),
    /// The row is complementary to this variable, which according to the row has a finite lower bound, upper bound.
    Complements(usize, [bool; 2]),
}

/// What stands in a file, each row and variable with the mark of its bounds, which those of another file do not have.
#[derive(Debug)]
pub(super) struct Contents {
    pub(super) title: Option<String>,
    pub(super) echo: Echo,
    pub(super) graph: Graph,
    /// The expression of each row.
    pub(super) rows: Vec<Id>,
    pub(super) conditions: Vec<(usize, Condition)>,
    pub(super) bounds: Vec<(Option<usize>, [f64; 2])>,
    pub(super) start: Vec<f64>,
}

/// What has been read of the segments.
struct Reader<'a> {
    input: Input<'a>,
    header: Header,
    builder: Builder,
    /// Nonlinear and linear parts of the rows.
    expressions: Vec<Option<Id>>,
    linear: Vec<Option<Vec<(usize, f64)>>>,
    conditions: Option<Vec<(usize, Condition)>>,
    bounds: Option<Vec<(Option<usize>, [f64; 2])>>,
    start: Option<Vec<f64>>,
    /// From where on bounds are infinite.
    infinity: f64,
}

const LETTERS: &str = "the letter of a segment (F S V C L O x d r b k K J G)";

/// Reads the bytes of a file. Cost: proportional to their number, whatever they say.
///
/// Errors: whatever is not as the format says, by line or byte.
pub(super) fn contents(file: &Path, bytes: &[u8], infinity: f64) -> Result<Contents, IoError> {
    let mut input = Input::new(file, bytes);
    let header = header(&mut input)?;
    let Echo { variables: n, rows: m, .. } = header.echo;
    let mut reader = Reader {
        builder: Builder::new(n, header.defined),
        input,
        header,
        expressions: vec![None; m],
        linear: vec![None; m],
        conditions: None,
        bounds: None,
        start: None,
        infinity,
    };
    while let Some(letter) = reader.input.segment() {
        reader.segment(letter)?;
    }
    reader.done()
}

/// Bounds of which those from `infinity` on are infinite. Errors: what is expected, and what is not that.
fn possible(given: [f64; 2], infinity: f64) -> Result<[f64; 2], (String, f64)> {
    let [l, u] = given.map(|x| if x.abs() >= infinity { x.signum() * f64::INFINITY } else { x });
    let impossible = if l == f64::INFINITY { Some(l) } else { None };
    match impossible.or((u == f64::NEG_INFINITY).then_some(u)) {
        Some(x) => {
            Err((format!("a lower bound below {infinity:?}, an upper one above -{infinity:?}"), x))
        }
        None => Ok([l, u]),
    }
}

impl Contents {
    /// Puts bounds from a file of triples `variable lower upper`, variables counted from 0, in place of those of the model.
    ///
    /// Errors: what the system refuses; what is no such triple.
    pub(super) fn rebound(&mut self, file: &Path, infinity: f64) -> Result<(), IoError> {
        let bytes = bytes(file)?;
        let text = String::from_utf8_lossy(&bytes);
        let words: Vec<_> = text.split_whitespace().collect();
        let real = |word: &str| word.parse::<f64>().ok().filter(|x| !x.is_nan());
        for (k, triple) in words.chunks(3).enumerate() {
            let place = format!("triple {}", k + 1);
            let read = match triple {
                [j, l, u] => j.parse().ok().zip(real(l).zip(real(u))),
                _ => None,
            };
            let known = read.filter(|&(j, _): &(usize, _)| j < self.bounds.len());
            let Some((j, (l, u))) = known else {
                let n = self.bounds.len();
                let expected = format!("a variable below {n}, a lower and an upper bound");
                let found = format!("`{}`", triple.join(" "));
                return Err(IoError::data(file, place, expected, found));
            };
            let given = possible([l, u], infinity)
                .map_err(|(expected, found)| IoError::data(file, place, expected, found))?;
            self.bounds[j] = (None, given);
        }
        Ok(())
    }
}

impl Reader<'_> {
    fn segment(&mut self, letter: u8) -> Result<(), IoError> {
        let Echo { variables: n, rows: m, .. } = self.header.echo;
        match letter {
            b'F' => self.function(),
            b'S' => self.suffix(),
            b'V' => self.definition(),
            b'C' => {
                let i = self.input.below(m, "the row of a segment C")?;
                let what = format!("segment C{i}");
                self.first_of(&what, self.expressions[i].is_some())?;
                self.expressions[i] =
                    Some(self.builder.expression(&mut self.input, &what, false)?);
                Ok(())
            }
            b'L' => Err(self.input.wrong("segment L", "no logical constraints", "one")),
            b'O' => {
                self.input.below(self.header.objectives, "the objective of a segment O")?;
                self.input.whole("the sense of a segment O")?;
                self.builder.expression(&mut self.input, "segment O", true).map(drop)
            }
            b'G' => {
                self.input.below(self.header.objectives, "the objective of a segment G")?;
                self.pairs(n, "segment G").map(drop)
            }
            b'x' => {
                self.first_of("segment x", self.start.is_some())?;
                let mut start = vec![0.0; n];
                self.pairs(n, "segment x")?.into_iter().for_each(|(j, x)| start[j] = x);
                self.start = Some(start);
                Ok(())
            }
            b'd' => self.pairs(m, "segment d").map(drop),
            b'r' => {
                self.first_of("segment r", self.conditions.is_some())?;
                let all = (0..m).map(|i| self.condition(i)).collect::<Result<_, _>>()?;
                self.conditions = Some(all);
                Ok(())
            }
            b'b' => {
                self.first_of("segment b", self.bounds.is_some())?;
                let all = (0..n).map(|j| self.variable(j)).collect::<Result<_, _>>()?;
                self.bounds = Some(all);
                Ok(())
            }
            b'k' | b'K' => {
                let count = self.input.count(n, "the number of columns of a segment k")?;
                for _ in 0..count {
                    self.input.record("segment k", "a number of entries")?;
                    self.input.whole("segment k")?;
                }
                Ok(())
            }
            b'J' => {
                let i = self.input.below(m, "the row of a segment J")?;
                let what = format!("segment J{i}");
                self.first_of(&what, self.linear[i].is_some())?;
                self.linear[i] = Some(self.pairs(n, &what)?);
                Ok(())
            }
            other => {
                let found = self.input.found(other);
                Err(self.input.wrong("a segment", LETTERS, found))
            }
        }
    }

    /// Refuses a second segment of one name.
    fn first_of(&self, what: &str, there: bool) -> Result<(), IoError> {
        match there {
            true => Err(self.input.wrong(what, "one of this name", "a second one")),
            false => Ok(()),
        }
    }

    /// Pairs of a number below `n` and a value, after their count.
    fn pairs(&mut self, n: usize, what: &str) -> Result<Vec<(usize, f64)>, IoError> {
        let count = self.input.count(n, what)?;
        let mut pairs = vec![];
        for _ in 0..count {
            self.input.record(what, "a number and a value")?;
            pairs.push((self.input.below(n, what)?, self.input.finite(what)?));
        }
        Ok(pairs)
    }

    fn function(&mut self) -> Result<(), IoError> {
        const WHAT: &str = "segment F";
        let k = self.input.below(usize::MAX, WHAT)?;
        self.input.whole(WHAT)?;
        self.input.whole(WHAT)?;
        let name = self.input.name(WHAT)?;
        self.builder.functions.push((k, name));
        Ok(())
    }

    fn suffix(&mut self) -> Result<(), IoError> {
        const WHAT: &str = "segment S";
        /// The bit of kinds whose values are no whole numbers.
        const REAL: i64 = 4;
        let kind = self.input.whole(WHAT)?;
        let count = self.input.count(usize::MAX, WHAT)?;
        self.input.name(WHAT)?;
        for _ in 0..count {
            self.input.record(WHAT, "a number and a value")?;
            self.input.whole(WHAT)?;
            match kind & REAL {
                0 => self.input.whole(WHAT).map(drop)?,
                _ => self.input.real(WHAT).map(drop)?,
            }
        }
        Ok(())
    }

    /// A defined variable: `Σ c_j x_j` and an expression.
    fn definition(&mut self) -> Result<(), IoError> {
        let Echo { variables: n, .. } = self.header.echo;
        let all = n + self.header.defined;
        let k = self.input.below(all, "the number of a segment V")?;
        let what = format!("segment V{k}");
        let Some(at) = k.checked_sub(n) else {
            let expected = format!("a number from {n} on, behind the variables");
            return Err(self.input.wrong(&what, &expected, k));
        };
        self.first_of(&what, self.builder.defined[at].is_some())?;
        let count = self.input.count(n, &what)?;
        self.input.whole(&what)?;
        let mut terms = vec![];
        for _ in 0..count {
            self.input.record(&what, "a variable and a coefficient")?;
            terms.push((self.input.below(n, &what)?, self.input.finite(&what)?));
        }
        let expression = self.builder.expression(&mut self.input, &what, false)?;
        self.builder.defined[at] = Some(self.builder.with_linear(expression, terms));
        Ok(())
    }

    fn condition(&mut self, i: usize) -> Result<(usize, Condition), IoError> {
        let what = format!("segment r, row {i}");
        self.input.record(&what, "the bounds of a row")?;
        let mark = self.input.mark();
        let code = self.input.code(&what)?;
        if code != 5 {
            let [l, u] = self.interval(code, &what, "a code from 0 to 5")?;
            return Ok((mark, Condition::Between(l, u)));
        }
        let flags = self.input.below(4, &format!("{what}, the bounds of its variable"))?;
        let n = self.header.echo.variables as i64;
        let j = self.input.whole(&what)?;
        if !(1..=n).contains(&j) {
            let expected = format!("a variable from 1 to {n}, counted from 1");
            return Err(self.input.wrong(&what, &expected, j));
        }
        let flags = [flags & 1 != 0, flags & 2 != 0];
        Ok((mark, Condition::Complements(j as usize - 1, flags)))
    }

    fn variable(&mut self, j: usize) -> Result<(Option<usize>, [f64; 2]), IoError> {
        let what = format!("segment b, variable {j}");
        self.input.record(&what, "the bounds of a variable")?;
        let mark = self.input.mark();
        let code = self.input.code(&what)?;
        Ok((Some(mark), self.interval(code, &what, "a code from 0 to 4")?))
    }

    /// The bounds that follow a code.
    fn interval(&mut self, code: i64, what: &str, expected: &str) -> Result<[f64; 2], IoError> {
        let mut real = || self.input.real(what);
        let given = match code {
            0 => [real()?, real()?],
            1 => [f64::NEG_INFINITY, real()?],
            2 => [real()?, f64::INFINITY],
            3 => [f64::NEG_INFINITY, f64::INFINITY],
            4 => [real()?; 2],
            other => return Err(self.input.wrong(what, expected, other)),
        };
        possible(given, self.infinity)
            .map_err(|(expected, found)| self.input.wrong(what, &expected, found))
    }

    /// The rows from their parts.
    fn done(self) -> Result<Contents, IoError> {
        let Self { input, header, mut builder, expressions, linear, .. } = self;
        let Echo { variables: n, .. } = header.echo;
        let missing = |letter: &str, of: &str| {
            input.wrong(
                "the segments",
                &format!("a segment {letter} with the bounds of the {of}"),
                "none",
            )
        };
        let conditions = self.conditions.ok_or_else(|| missing("r", "rows"))?;
        let bounds = self.bounds.ok_or_else(|| missing("b", "variables"))?;
        let entries = linear.iter().flatten().map(Vec::len).sum::<usize>();
        if entries < header.entries {
            let expected = format!("{} entries, as the header says", header.entries);
            return Err(input.wrong("the segments J", &expected, entries));
        }
        let rows = expressions.into_iter().zip(linear).map(|(expression, terms)| {
            let expression = expression.unwrap_or_else(|| builder.graph.constant(0.0));
            // Zeros say where the nonlinear part has variables, which is known from itself.
            let mut terms = terms.unwrap_or_default();
            terms.retain(|term| term.1 != 0.0);
            terms.sort_by_key(|term| term.0);
            builder.with_linear(expression, terms)
        });
        let rows = rows.collect();
        Ok(Contents {
            title: header.title,
            echo: header.echo,
            graph: builder.graph,
            rows,
            conditions,
            bounds,
            start: self.start.unwrap_or_else(|| vec![0.0; n]),
        })
    }
}
