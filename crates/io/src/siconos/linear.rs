//! LCP, MLCP and relay problems.

use std::path::Path;

use nonsmooth_linalg::{Csc, Dense, Matrix};
use nonsmooth_problem::{BoxLcp, Complementarity, Lcp, Mlcp};

use super::matrix::matrix;
use crate::IoError;
use crate::tokens::Tokens;

/// An LCP, or a relay problem, which goes on with bounds.
pub(super) fn lcp(t: &mut Tokens, path: &Path) -> Result<Complementarity, IoError> {
    let n = t.count("the size n")?;
    let m = matrix(t, "M", n, n)?;
    let q = t.reals("q", n)?;
    let lcp =
        || Lcp::new(m.clone(), q.clone()).map(Complementarity::Lcp).map_err(IoError::problem(path));
    let name = path.file_stem().unwrap_or_default().to_string_lossy().to_lowercase();
    let named = (name.contains("relay"), name.contains("lcp"));
    let relay = |lower: &[f64], upper: &[f64]| {
        let bounded = BoxLcp::new(m.clone(), q.clone(), lower.into(), upper.into());
        bounded.map(Complementarity::Box).map_err(IoError::problem(path))
    };
    if named == (true, false) {
        let (lower, upper) = (t.reals("l", n)?, t.reals("u", n)?);
        return match t.word() {
            Some(word) => Err(t.wrong("after u", "the end of the file", Some(word))),
            None => relay(&lower, &upper),
        };
    }
    let mut rest = t.clone();
    let bounds = (rest.reals("l", n), rest.reals("u", n));
    let (Ok(lower), Ok(upper)) = bounds else { return lcp() };
    let fits = rest.word().is_none() && lower.iter().zip(&upper).all(|(l, u)| l <= u);
    match named {
        _ if !fits => lcp(),
        (false, true) => lcp(),
        // No variable of an LCP is negative.
        _ if lower.iter().any(|&l| l < 0.0) => relay(&lower, &upper),
        _ => Err(IoError::data(
            path,
            "the numbers after q",
            "`lcp` or `relay` in the name of the file, to say whether they are remarks or bounds",
            "neither",
        )),
    }
}

/// An MLCP of the new format.
pub(super) fn mixed(t: &mut Tokens, path: &Path) -> Result<Complementarity, IoError> {
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
    square(t, n, m)?;
    let matrix = matrix(t, "M", size, size)?;
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

/// M must have a row for each equality and each pair: where another shape is stated, what that means.
fn square(t: &mut Tokens, n: usize, m: usize) -> Result<(), IoError> {
    let mut ahead = t.clone();
    let mut number = || ahead.word().and_then(|word| word.parse::<usize>().ok());
    let (_, rows, columns) = (number(), number(), number());
    match (rows, columns) {
        (Some(rows), Some(columns)) if (rows, columns) != (n + m, n + m) => {
            *t = ahead;
            let size = n + m;
            let expected = format!(
                "{size} × {size}, as the file states n = {n} (equalities, and as many free variables), m = {m} (pairs) and blocks that end at {size} (more equalities than free variables can only be stated as `n m ROWS A B C D a b`)"
            );
            Err(t.wrong("the shape of M", &expected, Some(&format!("{rows} × {columns}"))))
        }
        _ => Ok(()),
    }
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
pub(super) fn mixed_old(t: &mut Tokens, path: &Path) -> Result<Complementarity, IoError> {
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
