//! Texts of words between blanks, with the line of each for messages.

use std::borrow::Cow;
use std::path::Path;

use crate::IoError;

/// A text, word by word.
#[derive(Debug, Clone)]
pub(crate) struct Tokens<'a> {
    file: &'a Path,
    rest: &'a str,
    line: usize,
}

impl<'a> Tokens<'a> {
    pub(crate) fn new(file: &'a Path, text: &'a str) -> Self {
        Self { file, rest: text.strip_prefix('\u{feff}').unwrap_or(text), line: 1 }
    }

    /// Bytes that are left: more numbers than half of them cannot follow.
    pub(crate) fn left(&self) -> usize {
        self.rest.len()
    }

    /// The next word; `None` at the end.
    pub(crate) fn word(&mut self) -> Option<&'a str> {
        let start = self.rest.find(|c: char| !c.is_whitespace()).unwrap_or(self.rest.len());
        self.line += self.rest[..start].matches('\n').count();
        let rest = &self.rest[start..];
        let end = rest.find(char::is_whitespace).unwrap_or(rest.len());
        self.rest = &rest[end..];
        (end > 0).then(|| &rest[..end])
    }

    /// The rest of the line.
    pub(crate) fn line(&mut self) -> &'a str {
        let end = self.rest.find('\n').unwrap_or(self.rest.len());
        let line = &self.rest[..end];
        self.rest = &self.rest[end..];
        line
    }

    /// A mistake at the last word.
    pub(crate) fn wrong(&self, what: &str, expected: &str, found: Option<&str>) -> IoError {
        let found = match found {
            Some(word) => format!("`{}`", word.chars().take(40).collect::<String>()),
            None => "the end of the file".into(),
        };
        IoError::data(self.file, format!("line {}, {what}", self.line), expected, found)
    }

    /// The next word as a number. `what` it is, for messages.
    pub(crate) fn real(&mut self, what: impl Fn() -> String) -> Result<f64, IoError> {
        let word = self.word();
        let number = word.and_then(|w| w.parse().ok());
        number.ok_or_else(|| self.wrong(&what(), "a number", word))
    }

    /// The next word as a whole number that must be one of some.
    pub(crate) fn one_of(
        &mut self,
        what: &str,
        expected: &str,
        fits: impl Fn(usize) -> bool,
    ) -> Result<usize, IoError> {
        let word = self.word();
        let number = word.and_then(|w| w.parse().ok()).filter(|&n| fits(n));
        number.ok_or_else(|| self.wrong(what, expected, word))
    }

    /// A number of things that must follow, each at least a letter and a blank: no more than can be in the rest of the text.
    pub(crate) fn count(&mut self, what: &str) -> Result<usize, IoError> {
        let most = self.left() / 2 + 1;
        let expected = format!("a whole number of at most {most}, for which the file has room");
        self.one_of(what, &expected, |n| n <= most)
    }

    /// The next `n` words as numbers, called `name[0]`, `name[1]`, ...
    pub(crate) fn reals(&mut self, name: &str, n: usize) -> Result<Vec<f64>, IoError> {
        let mut all = Vec::with_capacity(n.min(self.left() / 2 + 1));
        for k in 0..n {
            all.push(self.real(|| format!("{name}[{k}]"))?);
        }
        Ok(all)
    }
}

/// The text in the bytes of a file. What is no number ends a problem's data in Siconos' files: remarks may be in any encoding.
pub(crate) fn text(bytes: &[u8]) -> Cow<'_, str> {
    String::from_utf8_lossy(bytes)
}
