//! What the families' tests share: small algebra, the Laplacian of obstacle problems, Siconos' files.

use std::vec::IntoIter;

use nonsmooth_linalg::{Csc, Dense};
use nonsmooth_problem::{Lcp, Mlcp};

pub fn times(a: &Dense, b: &Dense) -> Dense {
    Dense::from_fn(a.nrows(), b.ncols(), |i, j| (0..a.ncols()).map(|k| a[(i, k)] * b[(k, j)]).sum())
}

pub fn transposed(a: &Dense) -> Dense {
    Dense::from_fn(a.ncols(), a.nrows(), |i, j| a[(j, i)])
}

/// `M z + q`.
pub fn w_of(problem: &Lcp, z: &[f64]) -> Vec<f64> {
    let mut w = vec![0.0; z.len()];
    problem.M.mul(z, &mut w);
    w.iter_mut().zip(&problem.q).for_each(|(w, q)| *w += q);
    w
}

/// The five-point Laplacian on k × k inner points of the unit square, times h².
pub fn laplacian(k: usize) -> Csc {
    let at = |i: usize, j: usize| i * k + j;
    let entries = (0..k * k).flat_map(|p| {
        let (i, j) = (p / k, p % k);
        let mut near = vec![(p, p, 4.0)];
        if i > 0 {
            near.push((p, at(i - 1, j), -1.0));
        }
        if i + 1 < k {
            near.push((p, at(i + 1, j), -1.0));
        }
        if j > 0 {
            near.push((p, at(i, j - 1), -1.0));
        }
        if j + 1 < k {
            near.push((p, at(i, j + 1), -1.0));
        }
        near
    });
    Csc::from_triplets(k * k, k * k, entries).unwrap()
}

/// Names and texts of the files of a folder of the corpus, by name.
pub fn corpus(folder: &str) -> Option<Vec<(String, String)>> {
    let Some(root) = std::env::var_os("NONSMOOTH_CORPUS") else {
        eprintln!("SKIPPED: NONSMOOTH_CORPUS is not set");
        return None;
    };
    let folder = std::path::Path::new(&root).join(folder);
    let mut files: Vec<_> = std::fs::read_dir(folder)
        .expect("a folder")
        .filter_map(|entry| {
            let path = entry.ok()?.path();
            let name = path.file_name()?.to_string_lossy().into_owned();
            Some((name, std::fs::read_to_string(path).ok()?))
        })
        .collect();
    files.sort();
    Some(files)
}

/// Numbers of a file of Siconos, in order.
struct Tokens(IntoIter<f64>);

impl Tokens {
    fn new(text: &str) -> Self {
        let numbers: Vec<f64> = text.split_whitespace().map_while(|t| t.parse().ok()).collect();
        Self(numbers.into_iter())
    }

    fn number(&mut self) -> f64 {
        self.0.next().expect("a number")
    }

    fn index(&mut self) -> usize {
        self.number() as usize
    }

    fn vector(&mut self, n: usize) -> Vec<f64> {
        (0..n).map(|_| self.number()).collect()
    }

    /// The dense matrix of a file: by columns. `None` of another storage.
    fn dense(&mut self) -> Option<Dense> {
        if self.index() != 0 {
            return None;
        }
        let _ = self.vector(2);
        let (rows, columns) = (self.index(), self.index());
        let values = self.vector(rows * columns);
        Some(Dense::from_fn(rows, columns, |i, j| values[j * rows + i]))
    }
}

/// n, M, q; `None` of a matrix that is not stored dense.
pub fn siconos_lcp(text: &str) -> Option<Lcp> {
    let mut tokens = Tokens::new(text);
    let n = tokens.index();
    let m = tokens.dense()?;
    Some(Lcp::new(m, tokens.vector(n)).expect("a problem"))
}

/// Two flags, n, m, the blocks of rows, M, q; `None` of a matrix that is not stored dense, or not square.
pub fn siconos_mlcp(text: &str) -> Option<Mlcp> {
    let mut tokens = Tokens::new(text);
    let _ = tokens.vector(2);
    let (free, pairs) = (tokens.index(), tokens.index());
    let _ = tokens.vector(5);
    let m = tokens.dense().filter(|m| m.nrows() == m.ncols())?;
    Some(Mlcp::new(m, tokens.vector(free + pairs), free).expect("a problem"))
}
