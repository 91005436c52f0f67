//! Matrices as Siconos prints them: dense, by blocks or sparse.

use nonsmooth_linalg::{Csc, Dense, Matrix};

use crate::IoError;
use crate::tokens::Tokens;

/// A matrix, which must be `rows` × `columns`.
pub(super) fn matrix(
    t: &mut Tokens,
    name: &str,
    rows: usize,
    columns: usize,
) -> Result<Matrix, IoError> {
    let kinds = "0 (dense), 1 (blocks) or 2 (sparse)";
    let storage = t.one_of(&format!("the storage of {name}"), kinds, |s| s <= 2)?;
    sizes(t, name, rows, columns)?;
    match storage {
        0 => {
            sizes(t, name, rows, columns)?;
            dense(t, name, rows, columns).map(Matrix::from)
        }
        1 => blocks(t, name, rows, columns).map(Matrix::from),
        _ => sparse(t, name, rows, columns).map(Matrix::from),
    }
}

fn sizes(t: &mut Tokens, name: &str, rows: usize, columns: usize) -> Result<(), IoError> {
    for (what, size) in [("rows", rows), ("columns", columns)] {
        t.one_of(&format!("the {what} of {name}"), &size.to_string(), |n| n == size)?;
    }
    Ok(())
}

/// By columns, whatever the lines of the file suggest.
fn dense(t: &mut Tokens, name: &str, rows: usize, columns: usize) -> Result<Dense, IoError> {
    if rows.checked_mul(columns).is_none_or(|k| k > t.left() / 2 + 1) {
        let expected = format!("a file with {rows} × {columns} entries");
        return Err(t.wrong(name, &expected, None));
    }
    let mut m = Dense::zeros(rows, columns);
    for j in 0..columns {
        for i in 0..rows {
            m[(i, j)] = t.real(|| format!("{name}[{i}, {j}]"))?;
        }
    }
    Ok(m)
}

/// Blocks by rows of blocks. A zero inside a block is an entry.
fn blocks(t: &mut Tokens, name: &str, rows: usize, columns: usize) -> Result<Csc, IoError> {
    let count = t.count("the number of blocks")?;
    let across = [t.count("the rows of blocks")?, t.count("the columns of blocks")?];
    let mut ends = [vec![0], vec![0]];
    for (k, (lines, size)) in [("rows", rows), ("columns", columns)].into_iter().enumerate() {
        for b in 0..across[k] {
            let last = ends[k][b];
            let what = format!("the end of block {b} of {lines}");
            let end = match b + 1 == across[k] {
                true => t.one_of(&what, &size.to_string(), |e| e == size && e > last),
                false => t.one_of(&what, &format!("from {} to {size}", last + 1), |e| {
                    last < e && e <= size
                }),
            };
            ends[k].push(end?);
        }
        if across[k] == 0 {
            return Err(t.wrong(&format!("the {lines} of blocks"), "at least 1", Some("0")));
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
                    entries.push((i, j, t.real(|| format!("{name}[{i}, {j}]"))?));
                }
            }
        }
    }
    assembled(t, name, rows, columns, &entries)
}

/// The words of `CSparse`'s print of a matrix: `triplet: 2-by-2, nzmax: 3 nnz: 3` and `i j : x`, or `2-by-2, nzmax: 3 nnz: 3, 1-norm: 5` and
/// `col j : locations p to q` and `i : x`.
fn sparse(t: &mut Tokens, name: &str, rows: usize, columns: usize) -> Result<Csc, IoError> {
    /// Where the matrix comes from; half of a symmetric one and compressed rows are left.
    const KNOWN: [usize; 2] = [1, 3];
    let sparse = format!("a sparse {name}");
    t.one_of(
        &format!("the origin of a sparse {name}"),
        "1 (triplets) or 3 (compressed columns)",
        |o| KNOWN.contains(&o),
    )?;
    let first = t.word();
    if first != Some("CSparse") {
        return Err(t.wrong(&sparse, "`CSparse Version ...`", first));
    }
    t.line();
    let mut word = t.word();
    let triplets = word == Some("triplet:");
    if triplets {
        word = t.word();
    }
    let shape = format!("{rows}-by-{columns},");
    if word != Some(&shape) {
        return Err(t.wrong(&sparse, &format!("`{shape}`"), word));
    }
    let mut nnz = None;
    for expected in ["nzmax:", "nnz:"] {
        let word = t.word();
        if word != Some(expected) {
            return Err(t.wrong(&sparse, &format!("`{expected}`"), word));
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
        other => Err(t.wrong(&sparse, "`:`", other)),
    };
    let index = |t: &mut Tokens, what: &str, size: usize| {
        t.one_of(what, &format!("an index below {size}"), |k| k < size)
    };
    if triplets {
        for _ in 0..nnz {
            let i = index(t, &format!("a row of {name}"), rows)?;
            let j = index(t, &format!("a column of {name}"), columns)?;
            colon(t)?;
            entries.push((i, j, t.real(|| format!("{name}[{i}, {j}]"))?));
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
                return Err(t.wrong(&sparse, &expected, Some(&head.join(" "))));
            };
            for _ in p..=q {
                let i = index(t, &format!("a row of {name}"), rows)?;
                colon(t)?;
                entries.push((i, j, t.real(|| format!("{name}[{i}, {j}]"))?));
            }
        }
    }
    assembled(t, name, rows, columns, &entries)
}

fn assembled(
    t: &Tokens,
    name: &str,
    rows: usize,
    columns: usize,
    entries: &[(usize, usize, f64)],
) -> Result<Csc, IoError> {
    let made = Csc::from_triplets(rows, columns, entries.iter().copied());
    made.map_err(|e| t.wrong(name, "entries inside it", Some(&e.to_string())))
}
