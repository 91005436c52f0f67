//! The items of a file: numbers, letters, names, whether they stand as text or as binary numbers of either order of bytes.

use std::path::Path;

use crate::IoError;

/// How the segments of a file, and of the solution that answers it, are written.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Form {
    /// As text.
    Text,
    /// As binary numbers, the lowest byte first.
    LittleEndian,
    /// As binary numbers, the highest byte first.
    BigEndian,
}

/// A file, item by item. What it says of its own size is never believed: every item takes at least a byte of what is there.
#[derive(Debug)]
pub(super) struct Input<'a> {
    file: &'a Path,
    bytes: &'a [u8],
    at: usize,
    pub(super) form: Form,
    /// The number of the line in hand, from 1.
    line: usize,
    /// What is left of it.
    rest: &'a [u8],
    /// Where the last binary item began.
    item: usize,
}

impl<'a> Input<'a> {
    /// At the header, which is text in all forms.
    pub(super) fn new(file: &'a Path, bytes: &'a [u8]) -> Self {
        Self { file, bytes, at: 0, form: Form::Text, line: 0, rest: &[], item: 0 }
    }

    /// Bytes of the whole file.
    pub(super) fn size(&self) -> usize {
        self.bytes.len()
    }

    /// Where the last item stands, for [`place`](Self::place).
    pub(super) fn mark(&self) -> usize {
        if self.form == Form::Text { self.line } else { self.item }
    }

    /// A mark in words.
    pub(super) fn place(form: Form, mark: usize) -> String {
        format!("{} {mark}", if form == Form::Text { "line" } else { "byte" })
    }

    /// A mistake at the last item.
    pub(super) fn wrong(
        &self,
        what: &str,
        expected: &str,
        found: impl std::fmt::Display,
    ) -> IoError {
        let place = Self::place(self.form, self.mark());
        IoError::data(self.file, format!("{place}, {what}"), expected, found)
    }

    /// The next line without its end; `None` at the end of the file.
    fn whole_line(&mut self) -> Option<&'a [u8]> {
        let left = &self.bytes[self.at..];
        if left.is_empty() {
            return None;
        }
        let end = left.iter().position(|&b| b == b'\n');
        self.at += end.map_or(left.len(), |end| end + 1);
        self.line += 1;
        Some(&left[..end.unwrap_or(left.len())])
    }

    /// The next line of the header, without and with its remark.
    pub(super) fn header(&mut self, what: &str) -> Result<&'a [u8], IoError> {
        let Some(line) = self.whole_line() else {
            self.line += 1;
            return Err(self.wrong(what, "ten lines of header", END));
        };
        self.rest = without_remark(line);
        Ok(line)
    }

    /// Goes on to the next line that is not empty, of a text. False at the end of the file.
    fn next_line(&mut self) -> bool {
        while let Some(line) = self.whole_line() {
            self.rest = without_remark(line).trim_ascii();
            if !self.rest.is_empty() {
                return true;
            }
        }
        self.rest = &[];
        false
    }

    /// Begins what stands on a line of its own, in a text.
    pub(super) fn record(&mut self, what: &str, expected: &str) -> Result<(), IoError> {
        match self.form == Form::Text && !self.next_line() {
            true => Err(self.wrong(what, expected, END)),
            false => Ok(()),
        }
    }

    /// The letter that begins a segment; `None` at the end of the file.
    pub(super) fn segment(&mut self) -> Option<u8> {
        match self.form {
            Form::Text => self.next_line().then(|| self.first_letter()),
            _ => self.binary().map(|[letter]| letter),
        }
    }

    /// Passes by the letter of the header.
    pub(super) fn skip_letter(&mut self) {
        self.rest = self.rest.get(1..).unwrap_or_default();
    }

    /// The letter that begins a part of an expression.
    pub(super) fn letter(&mut self, what: &str, expected: &str) -> Result<u8, IoError> {
        self.segment().ok_or_else(|| self.wrong(what, expected, END))
    }

    fn first_letter(&mut self) -> u8 {
        let letter = self.rest[0];
        self.rest = &self.rest[1..];
        letter
    }

    /// The next N bytes, if there are so many.
    fn binary<const N: usize>(&mut self) -> Option<[u8; N]> {
        self.item = self.at;
        let found = self.bytes.get(self.at..)?.first_chunk::<N>()?;
        self.at += N;
        Some(*found)
    }

    /// As [`binary`](Self::binary), the highest byte first.
    fn ordered<const N: usize>(&mut self) -> Option<[u8; N]> {
        let mut found = self.binary::<N>()?;
        if self.form == Form::LittleEndian {
            found.reverse();
        }
        Some(found)
    }

    /// The next word of the line in hand.
    fn word(&mut self) -> Option<&'a [u8]> {
        let line = self.rest.trim_ascii_start();
        let end = line.iter().position(u8::is_ascii_whitespace).unwrap_or(line.len());
        self.rest = &line[end..];
        (end > 0).then(|| &line[..end])
    }

    /// Whether the line in hand has no further word.
    pub(super) fn is_line_over(&self) -> bool {
        self.rest.trim_ascii().is_empty()
    }

    fn parsed<T: std::str::FromStr>(&mut self, what: &str, expected: &str) -> Result<T, IoError> {
        let Some(word) = self.word() else {
            return Err(self.wrong(what, expected, "the end of the line"));
        };
        let number = std::str::from_utf8(word).ok().and_then(|word| word.parse().ok());
        number.ok_or_else(|| self.wrong(what, expected, quoted(word)))
    }

    fn or_end<T>(&self, found: Option<T>, what: &str, expected: &str) -> Result<T, IoError> {
        found.ok_or_else(|| self.wrong(what, expected, END))
    }

    /// The next whole number.
    pub(super) fn whole(&mut self, what: &str) -> Result<i64, IoError> {
        const EXPECTED: &str = "a whole number";
        if self.form == Form::Text {
            return self.parsed(what, EXPECTED);
        }
        let found = self.ordered().map(|b| i64::from(i32::from_be_bytes(b)));
        self.or_end(found, what, EXPECTED)
    }

    /// The next whole number of two bytes, where it is binary.
    pub(super) fn short(&mut self, what: &str) -> Result<i64, IoError> {
        if self.form == Form::Text {
            return self.whole(what);
        }
        let found = self.ordered().map(|b| i64::from(i16::from_be_bytes(b)));
        self.or_end(found, what, "a whole number")
    }

    /// The next number; it may be infinite.
    pub(super) fn real(&mut self, what: &str) -> Result<f64, IoError> {
        const EXPECTED: &str = "a number";
        let found = match self.form {
            Form::Text => self.parsed(what, EXPECTED)?,
            _ => {
                let found = self.ordered().map(f64::from_be_bytes);
                self.or_end(found, what, EXPECTED)?
            }
        };
        match f64::is_nan(found) {
            true => Err(self.wrong(what, EXPECTED, found)),
            false => Ok(found),
        }
    }

    /// The next number, which must be finite.
    pub(super) fn finite(&mut self, what: &str) -> Result<f64, IoError> {
        let found = self.real(what)?;
        match found.is_finite() {
            true => Ok(found),
            false => Err(self.wrong(what, "a finite number", found)),
        }
    }

    /// The next whole number, which must be one of `0..end`.
    pub(super) fn below(&mut self, end: usize, what: &str) -> Result<usize, IoError> {
        let found = self.whole(what)?;
        let fits = usize::try_from(found).ok().filter(|&n| n < end);
        fits.ok_or_else(|| {
            let expected = match end {
                0 => "none, as there are none".into(),
                usize::MAX => "a whole number from 0 on".into(),
                1 => "0".into(),
                _ => format!("a whole number from 0 to {}", end - 1),
            };
            self.wrong(what, &expected, found)
        })
    }

    /// A number of things that follow, of which there cannot be more than `most`, nor more than bytes that are left.
    pub(super) fn count(&mut self, most: usize, what: &str) -> Result<usize, IoError> {
        let found = self.whole(what)?;
        let room = self.bytes.len() - self.at;
        let fits = usize::try_from(found).ok().filter(|&n| n <= most.min(room));
        fits.ok_or_else(|| {
            let expected = match most <= room {
                true => format!("a number from 0 to {most}"),
                false => format!("a number from 0 to {room}, for which the file has room"),
            };
            self.wrong(what, &expected, found)
        })
    }

    /// The code of a row of `r` or `b`: a word of a text, else a byte.
    pub(super) fn code(&mut self, what: &str) -> Result<i64, IoError> {
        const EXPECTED: &str = "a code from 0 to 5";
        if self.form == Form::Text {
            return self.parsed(what, EXPECTED);
        }
        let found: Option<[u8; 1]> = self.binary();
        let [digit] = self.or_end(found, what, EXPECTED)?;
        match digit.is_ascii_digit() {
            true => Ok(i64::from(digit - b'0')),
            false => Err(self.wrong(what, EXPECTED, quoted(&[digit]))),
        }
    }

    /// A name: a word of a text, else counted bytes.
    pub(super) fn name(&mut self, what: &str) -> Result<String, IoError> {
        if self.form == Form::Text {
            let word = self.word();
            return Ok(String::from_utf8_lossy(word.unwrap_or_default()).into_owned());
        }
        let length = self.count(usize::MAX, what)?;
        let name = &self.bytes[self.at..self.at + length];
        self.at += length;
        Ok(String::from_utf8_lossy(name).into_owned())
    }

    /// Passes by a string of an expression, whose letter was read: its length, and in a text a colon, its characters and the end of the line.
    pub(super) fn skip_string(&mut self) -> Result<(), IoError> {
        const WHAT: &str = "a string";
        if self.form != Form::Text {
            return self.name(WHAT).map(drop);
        }
        let colon = self.rest.iter().position(|&b| b == b':').unwrap_or(self.rest.len());
        let length = std::str::from_utf8(&self.rest[..colon]).ok().and_then(|n| n.parse().ok());
        // The characters may hold ends of lines and what looks like a remark: back to the colon.
        let line_start = self.bytes[..self.at - 1].iter().rposition(|&b| b == b'\n');
        let line = line_start.map_or(0, |k| k + 1);
        let colon = self.bytes[line..].iter().position(|&b| b == b':').map(|k| line + k + 1);
        let end = match (length, colon) {
            (Some(length), Some(colon)) => colon.checked_add(length),
            _ => None,
        };
        let Some(end) = end.filter(|&end| end >= line && end <= self.bytes.len()) else {
            return Err(self.wrong(
                WHAT,
                "`h`, the length, `:` and as many characters",
                quoted(self.rest),
            ));
        };
        if end > self.at {
            self.line += self.bytes[self.at..end].iter().filter(|&&b| b == b'\n').count();
            self.at = end;
            self.whole_line();
        }
        self.rest = &[];
        Ok(())
    }

    /// A letter that was read, with what follows it in its line, for a message.
    pub(super) fn found(&self, letter: u8) -> String {
        match self.form {
            Form::Text => {
                let mut line = vec![letter];
                line.extend_from_slice(self.rest);
                quoted(&line)
            }
            _ => quoted(&[letter]),
        }
    }
}

const END: &str = "the end of the file";

fn without_remark(line: &[u8]) -> &[u8] {
    let end = line.iter().position(|&b| b == b'#').unwrap_or(line.len());
    &line[..end]
}

/// What was found, in a message.
pub(super) fn quoted(bytes: &[u8]) -> String {
    let text = String::from_utf8_lossy(bytes);
    let plain = |c: char| if c.is_control() { ' ' } else { c };
    format!("`{}`", text.trim_end().chars().map(plain).take(40).collect::<String>())
}
