//! The text files of Siconos: frictional contact, local and global, LCP, MLCP and relay (box LCP). Words between blanks; lines mean nothing.
//!
//! ```text
//! local   d  nc  W (MATRIX)  q (d·nc)  mu (nc)              d = 2 or 3 components of nc contacts
//! global  d  nc  M (MATRIX)  H (MATRIX)  q (n)  b (d·nc)  mu (nc)
//! LCP     n  MATRIX  q (n)                         anything after is ignored (remarks, solutions)
//! relay   n  MATRIX  q (n)  l (n)  u (n)
//! MLCP    S1 S2 n m                                n equalities and free variables, m pairs
//!         if S1: 0 … n+m (ends of blocks)  0|1 (equality | pairs) for each block  MATRIX  q (n+m)
//!         if S2: A (n × n) B (m × m) C (n × m) D (m × n) a (n) b (m), by rows
//!         old:   n m ROWS  A B C D a b, by rows, ROWS − m equalities
//! MATRIX  0 rows columns  rows columns             dense, by COLUMNS: a line of the file is a column of M
//!         1 rows columns                           blocks: their number; rows and columns of blocks; where each row of
//!                                                  blocks ends, where each column does; lengths of and then the
//!                                                  pointers to rows of blocks and their columns; then each block: its
//!                                                  number and its entries by columns
//!         2 rows columns                           sparse, as CSparse prints it: triplets or columns
//! ```
//!
//! A global problem has a second matrix, which begins with whole numbers, where a local one has q. In both, anything after mu is ignored.
//!
//! A relay file and an LCP file that is followed by two vectors look alike. Bounds below zero, or `lcp` or `relay` in the name of the file, tell them
//! apart; without these the file is refused.

mod friction;
mod linear;
mod matrix;
mod mechanics;
mod scene;

use std::path::Path;

use nonsmooth_problem::{AnyProblem, Kind};

use crate::format::About;
use crate::tokens::{Tokens, text};
use crate::{Format, IoError, ProblemFile};

pub use mechanics::write_histories;
pub use scene::{
    MechanicsContactor, MechanicsForm, MechanicsJoint, MechanicsLaw, MechanicsObject,
    MechanicsScene, MechanicsShape,
};

/// The format: read, not written.
///
/// Errors: a file that is none of these, by the line at which it ceases to be the most likely; one that may be two of them.
#[derive(Debug, Clone, Copy)]
pub struct Siconos;

impl Format for Siconos {
    fn about(&self) -> &'static About {
        const ABOUT: About = About {
            name: "Siconos' text",
            extensions: &["dat"],
            owns_extensions: false,
            reads: &[
                Kind::FrictionLocal2d,
                Kind::FrictionLocal3d,
                Kind::FrictionGlobal2d,
                Kind::FrictionGlobal3d,
                Kind::RollingLocal3d,
                Kind::RollingGlobal3d,
                Kind::Lcp,
                Kind::Mlcp,
                Kind::BoxLcp,
            ],
            keeps_solutions: false,
            ..About::TEXT
        };
        &ABOUT
    }

    /// With a number.
    fn begins(&self, bytes: &[u8]) -> bool {
        text(bytes).split_whitespace().next().is_some_and(|word| word.parse::<f64>().is_ok())
    }

    fn parse(&self, name: &Path, bytes: &[u8]) -> Result<ProblemFile, IoError> {
        parse(name, &text(bytes))
    }

    fn to_bytes(&self, name: &Path, _: &ProblemFile) -> Result<Vec<u8>, IoError> {
        Err(IoError::data(name, "the format", "one that is written", self.about().name))
    }
}

/// Reads the text of a file; where the name in `path` has `lcp` or `relay` it says which of these the file is.
fn parse(path: &Path, text: &str) -> Result<ProblemFile, IoError> {
    type Reader = fn(&mut Tokens, &Path) -> Result<AnyProblem, IoError>;
    let kinds: [(&str, Reader); 4] = [
        ("a problem of contacts", |t, path| friction::friction(t, path).map(Into::into)),
        ("an MLCP", |t, path| linear::mixed(t, path).map(Into::into)),
        ("an MLCP of the old format", |t, path| linear::mixed_old(t, path).map(Into::into)),
        ("an LCP", |t, path| linear::lcp(t, path).map(Into::into)),
    ];
    let mut found: Vec<(&str, AnyProblem)> = vec![];
    // The mistake that was made last in the file: of the kind that fits best, the most frequent one among equals.
    let mut nearest: Option<(usize, IoError)> = None;
    for (name, reader) in kinds {
        let mut tokens = Tokens::new(path, text);
        match reader(&mut tokens, path) {
            Ok(problem) => found.push((name, problem)),
            Err(e) => {
                let left = tokens.left();
                if nearest.as_ref().is_none_or(|n| left <= n.0) {
                    nearest = Some((left, e));
                }
            }
        }
    }
    match (found.len(), nearest) {
        (0, Some((_, e))) => Err(e),
        (0 | 1, _) => found.pop().map(|(_, problem)| ProblemFile::new(problem)).ok_or_else(|| {
            IoError::Unknown { file: path.into(), found: "none of Siconos' problems" }
        }),
        _ => {
            let names: Vec<_> = found.iter().map(|f| f.0).collect();
            let found = format!("one that reads as {}", names.join(" and as "));
            Err(IoError::data(path, "the content", "one problem of Siconos", found))
        }
    }
}
