//! Frictional contact, local and global.

use std::path::Path;

use nonsmooth_linalg::{Bsr, Csc, Matrix};
use nonsmooth_problem::{Friction, FrictionGlobal, FrictionLocal};

use super::matrix::matrix;
use crate::IoError;
use crate::tokens::Tokens;

/// The components of a contact with rolling friction.
const ROLLING: usize = 5;

/// A problem of contacts. What distinguishes a global one is its second matrix, which begins with whole numbers where a local one has q.
pub(super) fn friction(t: &mut Tokens, path: &Path) -> Result<Friction, IoError> {
    let expected = "2 or 3 (5 of rolling friction)";
    let d = t.one_of("the dimension", expected, |d| [2, 3, ROLLING].contains(&d))?;
    let most = t.left() / 2 + 1;
    let nc = t.one_of("the number of contacts", "at least 1", |nc| (1..=most).contains(&nc))?;
    let mut local = t.clone();
    let mut global = t.clone();
    let first = whole(&mut global, d, nc, path);
    let second = match first {
        // Whoever reads a global problem as a local one finds numbers as well, so the other way first.
        Ok(problem) => {
            *t = global;
            return Ok(problem);
        }
        Err(e) => (e, reduced(&mut local, d, nc, path)),
    };
    match second {
        // Of a damaged global problem a local one may be read too, whose q is the head of H.
        (e, Ok(_)) if goes_on(&local) && second_matrix(t, d * nc) => {
            *t = global;
            Err(e)
        }
        (_, Ok(problem)) => {
            *t = local;
            Ok(problem)
        }
        // The mistake that was made later in the file is that of the kind that fits better.
        (e, Err(_)) if global.left() < local.left() => {
            *t = global;
            Err(e)
        }
        (_, Err(e)) => {
            *t = local;
            Err(e)
        }
    }
}

/// Whether numbers follow.
fn goes_on(t: &Tokens) -> bool {
    t.clone().real(String::new).is_ok()
}

/// Whether the head of another matrix with a column for each of the `m` rows of contacts follows the first one.
fn second_matrix(t: &Tokens, m: usize) -> bool {
    let mut ahead = t.clone();
    let head = |t: &mut Tokens| -> Result<(), IoError> {
        let n = size(t, "M")?;
        matrix(t, "M", n, n)?;
        t.one_of("", "", |storage| storage <= 2)?;
        t.one_of("", "", |rows| rows == n)?;
        t.one_of("", "", |columns| columns == m).map(|_| ())
    };
    head(&mut ahead).is_ok()
}

/// `M v = H r + q`, `u = Hᵀ v + b`.
#[allow(non_snake_case)]
fn whole(t: &mut Tokens, d: usize, nc: usize, path: &Path) -> Result<Friction, IoError> {
    let n = size(t, "M")?;
    let M = compressed(matrix(t, "M", n, n)?);
    let H = compressed(matrix(t, "H", n, d * nc)?);
    let (f, w, mu) = (t.reals("q", n)?, t.reals("b", d * nc)?, t.reals("mu", nc)?);
    let made = match d {
        2 => FrictionGlobal::new(M, H, f, w, mu).map(Friction::Global2),
        3 => FrictionGlobal::new(M, H, f, w, mu).map(Friction::Global3),
        _ => {
            let mu_r = t.reals("mu_r", nc)?;
            FrictionGlobal::rolling(M, H, f, w, mu, mu_r).map(Friction::RollingGlobal)
        }
    };
    made.map_err(IoError::problem(path))
}

/// `u = W r + q`; W is called M in Siconos.
#[allow(non_snake_case)]
fn reduced(t: &mut Tokens, d: usize, nc: usize, path: &Path) -> Result<Friction, IoError> {
    let W = compressed(matrix(t, "W", d * nc, d * nc)?);
    let (q, mu) = (t.reals("q", d * nc)?, t.reals("mu", nc)?);
    let made = match d {
        2 => FrictionLocal::new(Bsr::from_csc(&W), q, mu).map(Friction::Local2),
        3 => FrictionLocal::new(Bsr::from_csc(&W), q, mu).map(Friction::Local3),
        _ => {
            let mu_r = t.reals("mu_r", nc)?;
            FrictionLocal::rolling(Bsr::from_csc(&W), q, mu, mu_r).map(Friction::RollingLocal)
        }
    };
    made.map_err(IoError::problem(path))
}

/// The rows of the matrix that follows.
fn size(t: &Tokens, name: &str) -> Result<usize, IoError> {
    let mut ahead = t.clone();
    ahead.word();
    ahead.count(&format!("the rows of {name}"))
}

fn compressed(matrix: Matrix) -> Csc {
    // A matrix that was read from numbers has entries.
    matrix.to_csc().unwrap_or_else(|| Csc::zeros(matrix.nrows(), matrix.ncols()))
}
