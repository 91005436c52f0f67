//! The text files of Siconos' test data: LCP, MLCP and relay (box LCP). Words between blanks; lines mean nothing.
//!
//! ```text
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
//! A relay file and an LCP file that is followed by two vectors look alike. Bounds below zero, or `lcp` or `relay` in the name of the file, tell them
//! apart; without these the file is refused.

use std::path::Path;

use nonsmooth_linalg::{Csc, Dense, Matrix};
use nonsmooth_problem::{BoxLcp, Complementarity, Kind, Lcp, Mlcp};

use super::text;
use super::tokens::Tokens;
use crate::format::About;
use crate::{Format, IoError, ProblemFile};

/// The format: read, not written.
///
/// Errors: a file that is none of the three, by the line at which it ceases to be the most likely; one that may be two of them.
#[derive(Debug, Clone, Copy)]
pub struct Siconos;

impl Format for Siconos {
    fn about(&self) -> &'static About {
        const ABOUT: About = About {
            name: "Siconos' text",
            extensions: &["dat"],
            owns_extensions: false,
            reads: &[Kind::Lcp, Kind::Mlcp, Kind::BoxLcp],
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
    type Reader = fn(&mut Tokens, &Path) -> Result<Complementarity, IoError>;
    let kinds: [(&str, Reader); 3] =
        [("an MLCP", mixed), ("an MLCP of the old format", mixed_old), ("an LCP", lcp)];
    let mut found: Vec<(&str, Complementarity)> = vec![];
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

/// An LCP, or a relay problem, which goes on with bounds.
fn lcp(t: &mut Tokens, path: &Path) -> Result<Complementarity, IoError> {
    let n = t.count("the size n")?;
    let m = matrix(t, n, n)?;
    let q = t.reals("q", n)?;
    let lcp =
        || Lcp::new(m.clone(), q.clone()).map(Complementarity::Lcp).map_err(IoError::problem(path));
    let mut rest = t.clone();
    let bounds = (rest.reals("l", n), rest.reals("u", n));
    let (Ok(lower), Ok(upper)) = bounds else { return lcp() };
    let fits = rest.word().is_none() && lower.iter().zip(&upper).all(|(l, u)| l <= u);
    let name = path.file_stem().unwrap_or_default().to_string_lossy().to_lowercase();
    let relay = || {
        let bounded = BoxLcp::new(m.clone(), q.clone(), lower.clone(), upper.clone());
        bounded.map(Complementarity::Box).map_err(IoError::problem(path))
    };
    match (name.contains("relay"), name.contains("lcp")) {
        _ if !fits => lcp(),
        (true, false) => relay(),
        (false, true) => lcp(),
        // No variable of an LCP is negative.
        _ if lower.iter().any(|&l| l < 0.0) => relay(),
        _ => Err(IoError::data(
            path,
            "the numbers after q",
            "`lcp` or `relay` in the name of the file, to say whether they are remarks or bounds",
            "neither",
        )),
    }
}

/// An MLCP of the new format.
fn mixed(t: &mut Tokens, path: &Path) -> Result<Complementarity, IoError> {
    let flag = |n: usize| n <= 1;
    let whole = t.one_of("isStorageType1", "0 or 1", flag)?;
    let parts = t.one_of("isStorageType2", "0 or 1", flag)?;
    if whole + parts == 0 {
        return Err(t.wrong(
            "isStorageType2",
            "a problem stored as M, as A, B, C, D, or as both",
            Some("0"),
        ));
    }
    let n = t.count("the number n of equalities")?;
    let m = t.count("the number m of pairs")?;
    let as_whole = match whole == 1 {
        true => Some(stored_whole(t, n, m)?),
        false => None,
    };
    let as_parts = match parts == 1 {
        true => Some(stored_parts(t, n, n, m)?),
        false => None,
    };
    if let (Some((m1, q1)), Some((m2, q2))) = (&as_whole, &as_parts) {
        let dense = m1.to_dense();
        let differ = (0..n + m)
            .find(|&i| q1[i] != q2[i] || dense.as_ref().is_some_and(|d| d.row(i) != m2.row(i)));
        if let Some(i) = differ {
            return Err(IoError::data(
                path,
                format!("row {i}"),
                "the same data in M, q and in A, B, C, D, a, b",
                "other data",
            ));
        }
    }
    let (matrix, q) = match (as_whole, as_parts) {
        (Some(whole), _) => whole,
        (None, Some((m, q))) => (m.into(), q),
        (None, None) => unreachable!("one of the two is stored"),
    };
    Mlcp::new(matrix, q, n).map(Complementarity::Mlcp).map_err(IoError::problem(path))
}

/// M and q with their blocks, brought into our order: equalities first.
fn stored_whole(t: &mut Tokens, n: usize, m: usize) -> Result<(Matrix, Vec<f64>), IoError> {
    let size = n + m;
    let mut ends = vec![t.one_of("blocksRows[0]", "0, where the first block begins", |n| n == 0)?];
    while ends[ends.len() - 1] < size {
        let last = ends[ends.len() - 1];
        let expected = format!("the end of a block, from {} to {size}", last + 1);
        let what = format!("blocksRows[{}]", ends.len());
        ends.push(t.one_of(&what, &expected, |e| last < e && e <= size)?);
    }
    let mut equality = Vec::with_capacity(size);
    for (k, block) in ends.windows(2).enumerate() {
        let what = format!("blocksIsComp[{k}]");
        let pairs = t.one_of(&what, "0 (equalities) or 1 (pairs)", |n| n <= 1)?;
        equality.resize(block[1], pairs == 0);
    }
    let equalities = equality.iter().filter(|e| **e).count();
    if equalities != n {
        let expected = format!("blocks with {n} equalities");
        return Err(t.wrong("blocksIsComp", &expected, Some(&format!("{equalities} equalities"))));
    }
    let matrix = matrix(t, size, size)?;
    let q = t.reals("q", size)?;
    // Equalities may stand anywhere; ours come first.
    let order: Vec<usize> =
        (0..size).filter(|&i| equality[i]).chain((0..size).filter(|&i| !equality[i])).collect();
    if order.is_sorted() {
        return Ok((matrix, q));
    }
    let mut place = vec![0; size];
    order.iter().enumerate().for_each(|(to, &from)| place[from] = to);
    let permuted = match &matrix {
        Matrix::Sparse(a) => {
            let entries = a.triplets().map(|(i, j, x)| (place[i], place[j], x));
            Csc::from_triplets(size, size, entries).map(Matrix::from).unwrap_or(matrix)
        }
        _ => match matrix.to_dense() {
            Some(a) => Dense::from_fn(size, size, |i, j| a[(order[i], order[j])]).into(),
            None => matrix,
        },
    };
    Ok((permuted, order.iter().map(|&i| q[i]).collect()))
}

/// A, B, C, D, a, b by rows, as one matrix and vector. `p` equalities, `n` free variables, `m` pairs.
fn stored_parts(
    t: &mut Tokens,
    p: usize,
    n: usize,
    m: usize,
) -> Result<(Dense, Vec<f64>), IoError> {
    let needed = (p + m).checked_mul(n + m).filter(|&k| k <= t.left() / 2 + 1);
    if needed.is_none() {
        let expected = format!("a file with {p} equalities, {n} free variables and {m} pairs");
        return Err(t.wrong("A, B, C, D", &expected, None));
    }
    let mut whole = Dense::zeros(p + m, n + m);
    for (name, i0, j0, rows, columns) in
        [("A", 0, 0, p, n), ("B", p, n, m, m), ("C", 0, n, p, m), ("D", p, 0, m, n)]
    {
        for i in 0..rows {
            for j in 0..columns {
                whole[(i0 + i, j0 + j)] = t.real(|| format!("{name}[{i}, {j}]"))?;
            }
        }
    }
    let mut q = t.reals("a", p)?;
    q.extend(t.reals("b", m)?);
    Ok((whole, q))
}

/// An MLCP of the old format, which may have more equalities than free variables.
fn mixed_old(t: &mut Tokens, path: &Path) -> Result<Complementarity, IoError> {
    let n = t.count("the number n of free variables")?;
    // Without pairs it would be an equation, and many a damaged LCP would look like one.
    let most = t.left() / 2 + 1;
    let m = t.one_of("the number m of pairs", "at least 1", |m| (1..=most).contains(&m))?;
    let expected = format!("a number of rows of at least n + m = {}", n + m);
    let most = t.left() / 2 + 1;
    let rows = t.one_of("the number of rows", &expected, |r| n + m <= r && r <= most)?;
    let p = rows - m;
    let (matrix, q) = stored_parts(t, p, n, m)?;
    // Nothing else tells this format from the others.
    if let Some(word) = t.word() {
        return Err(t.wrong("after b", "the end of the file", Some(word)));
    }
    Mlcp::rectangular(matrix, q, p, n).map(Complementarity::Mlcp).map_err(IoError::problem(path))
}

/// A matrix, which must be `rows` × `columns`.
fn matrix(t: &mut Tokens, rows: usize, columns: usize) -> Result<Matrix, IoError> {
    let kinds = "0 (dense), 1 (blocks) or 2 (sparse)";
    let storage = t.one_of("the storage of M", kinds, |s| s <= 2)?;
    sizes(t, rows, columns)?;
    match storage {
        0 => {
            sizes(t, rows, columns)?;
            dense(t, rows, columns).map(Matrix::from)
        }
        1 => blocks(t, rows, columns).map(Matrix::from),
        _ => sparse(t, rows, columns).map(Matrix::from),
    }
}

fn sizes(t: &mut Tokens, rows: usize, columns: usize) -> Result<(), IoError> {
    for (what, size) in [("the rows of M", rows), ("the columns of M", columns)] {
        t.one_of(what, &size.to_string(), |n| n == size)?;
    }
    Ok(())
}

/// By columns, whatever the lines of the file suggest.
fn dense(t: &mut Tokens, rows: usize, columns: usize) -> Result<Dense, IoError> {
    if rows.checked_mul(columns).is_none_or(|k| k > t.left() / 2 + 1) {
        let expected = format!("a file with {rows} × {columns} entries");
        return Err(t.wrong("M", &expected, None));
    }
    let mut m = Dense::zeros(rows, columns);
    for j in 0..columns {
        for i in 0..rows {
            m[(i, j)] = t.real(|| format!("M[{i}, {j}]"))?;
        }
    }
    Ok(m)
}

/// Blocks by rows of blocks. A zero inside a block is an entry.
fn blocks(t: &mut Tokens, rows: usize, columns: usize) -> Result<Csc, IoError> {
    let count = t.count("the number of blocks")?;
    let across = [t.count("the rows of blocks")?, t.count("the columns of blocks")?];
    let mut ends = [vec![0], vec![0]];
    for (k, (name, size)) in [("rows", rows), ("columns", columns)].into_iter().enumerate() {
        for b in 0..across[k] {
            let last = ends[k][b];
            let what = format!("the end of block {b} of {name}");
            let end = match b + 1 == across[k] {
                true => t.one_of(&what, &size.to_string(), |e| e == size && e > last),
                false => t.one_of(&what, &format!("from {} to {size}", last + 1), |e| {
                    last < e && e <= size
                }),
            };
            ends[k].push(end?);
        }
        if across[k] == 0 {
            return Err(t.wrong(&format!("the {name} of blocks"), "at least 1", Some("0")));
        }
    }
    let expected = format!("{}, one more than the rows of blocks", across[0] + 1);
    t.one_of("filled1", &expected, |n| n == across[0] + 1)?;
    t.one_of("filled2", &format!("{count}, the number of blocks"), |n| n == count)?;
    let mut pointers = vec![];
    for k in 0..=across[0] {
        let least = pointers.last().copied().unwrap_or(0);
        let what = format!("index1_data[{k}]");
        let expected = format!("from {least} to {count}");
        pointers.push(t.one_of(&what, &expected, |p| least <= p && p <= count)?);
    }
    if (pointers[0], pointers[across[0]]) != (0, count) {
        let expected = format!("pointers from 0 to {count}");
        return Err(t.wrong("index1_data", &expected, Some("others")));
    }
    let mut at = vec![];
    for k in 0..count {
        let expected = format!("a column of blocks below {}", across[1]);
        at.push(t.one_of(&format!("index2_data[{k}]"), &expected, |c| c < across[1])?);
    }
    let mut entries = vec![];
    for (row, range) in pointers.windows(2).enumerate() {
        for k in range[0]..range[1] {
            t.one_of("the number of a block", &k.to_string(), |n| n == k)?;
            for j in ends[1][at[k]]..ends[1][at[k] + 1] {
                for i in ends[0][row]..ends[0][row + 1] {
                    entries.push((i, j, t.real(|| format!("M[{i}, {j}]"))?));
                }
            }
        }
    }
    assembled(t, rows, columns, &entries)
}

/// The words of `CSparse`'s print of a matrix: `triplet: 2-by-2, nzmax: 3 nnz: 3` and `i j : x`, or `2-by-2, nzmax: 3 nnz: 3, 1-norm: 5` and
/// `col j : locations p to q` and `i : x`.
fn sparse(t: &mut Tokens, rows: usize, columns: usize) -> Result<Csc, IoError> {
    /// Where the matrix comes from; half of a symmetric one and compressed rows are left.
    const KNOWN: [usize; 2] = [1, 3];
    t.one_of("the origin of a sparse M", "1 (triplets) or 3 (compressed columns)", |o| {
        KNOWN.contains(&o)
    })?;
    let name = t.word();
    if name != Some("CSparse") {
        return Err(t.wrong("a sparse M", "`CSparse Version ...`", name));
    }
    t.line();
    let mut word = t.word();
    let triplets = word == Some("triplet:");
    if triplets {
        word = t.word();
    }
    let shape = format!("{rows}-by-{columns},");
    if word != Some(&shape) {
        return Err(t.wrong("a sparse M", &format!("`{shape}`"), word));
    }
    let mut nnz = None;
    for expected in ["nzmax:", "nnz:"] {
        let word = t.word();
        if word != Some(expected) {
            return Err(t.wrong("a sparse M", &format!("`{expected}`"), word));
        }
        let word = t.word();
        let number = word.and_then(|w| w.trim_end_matches(',').parse::<usize>().ok());
        let fits = number.filter(|&n| expected == "nzmax:" || n <= t.left() / 2 + 1);
        nnz = Some(fits.ok_or_else(|| t.wrong(expected, "a number of entries", word))?);
    }
    t.line();
    let nnz = nnz.unwrap_or_default();
    let mut entries = vec![];
    let colon = |t: &mut Tokens| match t.word() {
        Some(":") => Ok(()),
        other => Err(t.wrong("a sparse M", "`:`", other)),
    };
    let index = |t: &mut Tokens, what: &str, size: usize| {
        t.one_of(what, &format!("an index below {size}"), |k| k < size)
    };
    if triplets {
        for _ in 0..nnz {
            let i = index(t, "a row of M", rows)?;
            let j = index(t, "a column of M", columns)?;
            colon(t)?;
            entries.push((i, j, t.real(|| format!("M[{i}, {j}]"))?));
        }
    } else {
        for j in 0..columns {
            // `col j : locations p to q`; q of an empty column is p − 1, −1 in the first.
            let head: Vec<_> = (0..7).filter_map(|_| t.word()).collect();
            let numbers = match head[..] {
                ["col", k, ":", "locations", p, "to", q] if k.parse() == Ok(j) => {
                    p.parse().ok().zip(q.parse().ok())
                }
                _ => None,
            };
            let Some((p, q)) = numbers.filter(|&(p, q): &(i64, i64)| {
                p == entries.len() as i64 && q >= p - 1 && q < nnz as i64
            }) else {
                let expected = format!("`col {j} : locations {} to ...`", entries.len());
                return Err(t.wrong("a sparse M", &expected, Some(&head.join(" "))));
            };
            for _ in p..=q {
                let i = index(t, "a row of M", rows)?;
                colon(t)?;
                entries.push((i, j, t.real(|| format!("M[{i}, {j}]"))?));
            }
        }
    }
    assembled(t, rows, columns, &entries)
}

fn assembled(
    t: &Tokens,
    rows: usize,
    columns: usize,
    entries: &[(usize, usize, f64)],
) -> Result<Csc, IoError> {
    let made = Csc::from_triplets(rows, columns, entries.iter().copied());
    made.map_err(|e| t.wrong("M", "entries inside it", Some(&e.to_string())))
}
