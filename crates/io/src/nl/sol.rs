//! Solutions as AMPL reads them.

use std::path::Path;

use super::header::Echo;
use super::input::Form;
use crate::IoError;
use crate::format::put;

/// What a solver answers to a model: a text, a point, and how it ended.
#[derive(Debug, Clone, PartialEq)]
pub struct Solution<'a> {
    /// What the file of the model says of itself.
    pub echo: &'a Echo,
    /// What users read; it may have several lines.
    pub message: &'a str,
    /// The values of the variables, or none of them.
    pub x: &'a [f64],
    /// How it ended: 0 to 99 solved, from 200 on infeasible, from 400 on stopped by a limit, from 500 on failed.
    pub result: u16,
}

impl Solution<'_> {
    /// The bytes of the file, in the form of the model's. There are no dual values.
    pub fn to_bytes(&self) -> Vec<u8> {
        match self.echo.form {
            Form::Text => self.text().into_bytes(),
            form => Records { out: vec![], form }.of(self),
        }
    }

    /// Writes the file, in place of one that is there.
    ///
    /// Errors: what the system refuses.
    pub fn write(&self, path: &Path) -> Result<(), IoError> {
        put(path, &self.to_bytes())
    }

    /// The count of the options, two more where a tolerance follows.
    fn options(&self) -> Vec<i64> {
        let Echo { options, tolerance, .. } = self.echo;
        let more = if tolerance.is_some() { 2 } else { 0 };
        std::iter::once(options.len() as i64 + more).chain(options.iter().copied()).collect()
    }

    /// Rows, dual values, variables, values.
    fn sizes(&self) -> [i64; 4] {
        let Echo { rows, variables, .. } = *self.echo;
        [rows as i64, 0, variables as i64, self.x.len() as i64]
    }

    fn text(&self) -> String {
        // An empty line ends the message.
        let lines = self.message.trim_end().lines().map(|l| if l.is_empty() { " " } else { l });
        let mut out: Vec<String> = lines.map(Into::into).collect();
        out.push(String::new());
        if !self.echo.options.is_empty() {
            out.push("Options".into());
            out.extend(self.options().iter().chain(&self.sizes()).map(i64::to_string));
            out.extend(self.echo.tolerance.map(|x| format!("{x:?}")));
        }
        out.extend(self.x.iter().map(|x| format!("{x:?}")));
        out.push(format!("objno 0 {}", self.result));
        out.join("\n") + "\n"
    }
}

/// Records between their lengths.
struct Records {
    out: Vec<u8>,
    form: Form,
}

impl Records {
    fn number<const N: usize>(&self, mut bytes: [u8; N]) -> [u8; N] {
        if self.form == Form::LittleEndian {
            bytes.reverse();
        }
        bytes
    }

    fn whole(&self, x: i64) -> [u8; 4] {
        // Options and sizes are of this width in the model.
        self.number((x as i32).to_be_bytes())
    }

    fn real(&self, x: f64) -> [u8; 8] {
        self.number(x.to_be_bytes())
    }

    /// A record; `outside` its stated length stands what AMPL does not count.
    fn record(&mut self, bytes: &[u8], outside: &[u8]) {
        let length = self.whole(bytes.len() as i64);
        for part in [&length[..], bytes, outside, &length] {
            self.out.extend_from_slice(part);
        }
    }

    fn of(mut self, solution: &Solution) -> Vec<u8> {
        self.record(b"binary", &[]);
        let message = solution.message.trim_end();
        if !message.is_empty() {
            self.record(message.as_bytes(), &[]);
        }
        self.record(&[], &[]);
        if !solution.echo.options.is_empty() {
            let numbers = solution.options().into_iter().chain(solution.sizes());
            let numbers: Vec<u8> = numbers.flat_map(|x| self.whole(x)).collect();
            let tolerance = solution.echo.tolerance.map(|x| self.real(x));
            let outside: &[u8] = tolerance.as_ref().map_or(&[], |bytes| bytes);
            self.record(&[b"Options", &numbers[..]].concat(), outside);
        }
        self.record(&[], &[]);
        let x: Vec<u8> = solution.x.iter().flat_map(|&x| self.real(x)).collect();
        self.record(&x, &[]);
        let end: Vec<u8> =
            [0, i64::from(solution.result)].iter().flat_map(|&k| self.whole(k)).collect();
        self.record(&end, &[]);
        self.out
    }
}
