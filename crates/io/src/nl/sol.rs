//! Solutions as AMPL reads them, and their values read again.

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

/// The form of a solution, which need not be that of its model: a binary one begins with a length below 2²⁴, so with a zero at one end of four bytes.
fn form(echo: &Echo, bytes: &[u8]) -> Form {
    match (bytes, echo.form) {
        ([0, _, _, 0, ..], Form::BigEndian) => Form::BigEndian,
        ([_, _, _, 0, ..], _) => Form::LittleEndian,
        ([0, ..], _) => Form::BigEndian,
        _ => Form::Text,
    }
}

/// The values in the solution of a model that says this of itself; `None`: it has none, or answers another model.
pub(super) fn values(echo: &Echo, bytes: &[u8]) -> Option<Vec<f64>> {
    let fits = |sizes: &[i64]| {
        let sizes: &[i64; 4] = sizes.try_into().ok()?;
        let own = sizes[0] == echo.rows as i64 && sizes[2] == echo.variables as i64;
        (own && sizes[3] == sizes[2]).then(|| usize::try_from(sizes[1]).ok()).flatten()
    };
    let options = echo.options.len();
    let x: Vec<f64> = match form(echo, bytes) {
        Form::Text => {
            let text = std::str::from_utf8(bytes).ok()?;
            let mut lines = text.lines().map(str::trim).skip_while(|line| *line != "Options");
            let sizes: Option<Vec<i64>> =
                lines.by_ref().skip(2 + options).take(4).map(|line| line.parse().ok()).collect();
            let before = fits(&sizes?)? + usize::from(echo.tolerance.is_some());
            lines
                .skip(before)
                .take(echo.variables)
                .map(|line| line.parse().ok())
                .collect::<Option<_>>()?
        }
        form => {
            let whole = |bytes: &[u8]| {
                let bytes: [u8; 4] = bytes.try_into().ok()?;
                Some(match form {
                    Form::LittleEndian => i32::from_le_bytes(bytes),
                    _ => i32::from_be_bytes(bytes),
                })
            };
            let mut rest = bytes;
            let mut record = |more: usize| {
                let length = usize::try_from(whole(rest.get(..4)?)?).ok()?;
                let record = rest.get(4..4usize.checked_add(length)?)?;
                rest = rest.get(length.checked_add(8 + more)?..)?;
                Some(record)
            };
            // The message, and an empty record behind it.
            while !record(0)?.is_empty() {}
            let numbers = record(8 * usize::from(echo.tolerance.is_some()))?;
            let numbers: Option<Vec<i64>> = numbers
                .strip_prefix(b"Options")?
                .chunks(4)
                .map(|b| whole(b).map(i64::from))
                .collect();
            fits(numbers?.get(1 + options..)?)?;
            record(0)?;
            let number = |bytes: &[u8]| {
                let bytes = bytes.try_into().ok()?;
                Some(match form {
                    Form::LittleEndian => f64::from_le_bytes(bytes),
                    _ => f64::from_be_bytes(bytes),
                })
            };
            record(0)?.chunks(8).map(number).collect::<Option<_>>()?
        }
    };
    (x.len() == echo.variables && x.iter().all(|x| x.is_finite())).then_some(x)
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
