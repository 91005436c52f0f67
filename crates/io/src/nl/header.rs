//! The ten lines of text that begin every file.

use super::input::{Form, Input, quoted};
use crate::IoError;
use crate::error::one_line;

/// What the header says, as far as anything depends on it.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct Header {
    pub(super) title: Option<String>,
    pub(super) echo: Echo,
    pub(super) objectives: usize,
    pub(super) defined: usize,
    /// Of the Jacobian, zeros that stand for nonlinear terms included.
    pub(super) entries: usize,
}

/// What a solution repeats of the file that it answers.
#[derive(Debug, Clone, PartialEq)]
pub struct Echo {
    /// How the file is written.
    pub form: Form,
    /// The options of its first line.
    pub options: Vec<i64>,
    /// The tolerance that follows them where the second is 3.
    pub tolerance: Option<f64>,
    /// The number of variables.
    pub variables: usize,
    /// The number of rows.
    pub rows: usize,
}

/// What each line holds, for messages.
const LINES: [&str; 10] = [
    "header (format and options)",
    "header (variables, rows, objectives)",
    "header (nonlinear and complementary rows)",
    "header (network rows)",
    "header (nonlinear variables)",
    "header (functions, arithmetic, flags)",
    "header (discrete variables)",
    "header (entries of the Jacobian)",
    "header (lengths of names)",
    "header (defined variables)",
];

/// Reads the header and learns from it how the rest is written.
///
/// Errors: another format; what no MCP has: discrete variables, logical constraints; counts for which the file has no room.
pub(super) fn header(input: &mut Input) -> Result<Header, IoError> {
    let first = input.header(LINES[0])?;
    let binary = match first.first() {
        Some(b'g') => false,
        Some(b'b') => true,
        Some(b'z' | b'h') => {
            let found = format!("{}, an old binary format", quoted(&first[..1]));
            return Err(input.wrong(
                LINES[0],
                "a file in format `g` (text) or `b` (binary)",
                found,
            ));
        }
        _ => return Err(input.wrong(LINES[0], "`g` (text) or `b` (binary)", quoted(first))),
    };
    let remark = first.iter().position(|&b| b == b'#').map(|k| &first[k + 1..]);
    let title = remark.and_then(|r| r.trim_ascii().strip_prefix(b"problem "));
    let title = title.map(|t| one_line(String::from_utf8_lossy(t)).trim().to_owned());
    let (options, tolerance) = options(input)?;

    let sizes = line(input, 1)?;
    let [variables, rows, objectives] = [sizes[0], sizes[1], sizes[2]];
    if sizes[5] > 0 {
        let found = format!("{} of them", sizes[5]);
        return Err(input.wrong(LINES[1], "no logical constraints", found));
    }
    let room = input.size();
    if let Some(k) = [variables, rows, objectives].iter().position(|&n| n > room) {
        let what = ["variables", "rows", "objectives"][k];
        let expected = format!("at most {room} {what}, for which the file has room");
        return Err(input.wrong(LINES[1], &expected, sizes[k]));
    }
    for k in 2..5 {
        line(input, k)?;
    }
    let arithmetic = line(input, 5)?[2];
    let form = match (binary, arithmetic) {
        (false, _) => Form::Text,
        (true, 1) => Form::LittleEndian,
        (true, 2) => Form::BigEndian,
        (true, other) => {
            let expected = "IEEE arithmetic, 1 (little-endian) or 2 (big-endian)";
            return Err(input.wrong(LINES[5], expected, other));
        }
    };
    let discrete = line(input, 6)?;
    if let Some(n) = discrete.iter().max().filter(|&&n| n > 0) {
        let found = format!("{n} of them");
        return Err(input.wrong(LINES[6], "no binary or integer variables", found));
    }
    let entries = line(input, 7)?[0];
    line(input, 8)?;
    let parts = line(input, 9)?;
    let defined = parts.iter().fold(0usize, |sum, &n| sum.saturating_add(n));
    if defined > room {
        let expected = format!("at most {room} defined variables, for which the file has room");
        return Err(input.wrong(LINES[9], &expected, defined));
    }
    input.form = form;
    let echo = Echo { form, options, tolerance, variables, rows };
    Ok(Header { title: title.filter(|t| !t.is_empty()), echo, objectives, defined, entries })
}

/// The options of the first line, which begin after its letter.
fn options(input: &mut Input) -> Result<(Vec<i64>, Option<f64>), IoError> {
    const MOST: usize = 9;
    input.skip_letter();
    if input.is_line_over() {
        return Ok((vec![], None));
    }
    let count = input.below(MOST + 1, LINES[0])?;
    let options: Vec<_> = (0..count).map(|_| input.whole(LINES[0])).collect::<Result<_, _>>()?;
    let tolerance = match options.get(1) {
        Some(3) if !input.is_line_over() => Some(input.finite(LINES[0])?),
        _ => None,
    };
    Ok((options, tolerance))
}

/// The numbers of line `k` (from 0): what is missing is 0, what is beyond six is not ours.
fn line(input: &mut Input, k: usize) -> Result<[usize; 6], IoError> {
    input.header(LINES[k])?;
    let mut numbers = [0; 6];
    for number in &mut numbers {
        if input.is_line_over() {
            break;
        }
        *number = input.below(usize::MAX, LINES[k])?;
    }
    Ok(numbers)
}
