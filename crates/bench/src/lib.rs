//! Measurements of the solvers: what a sweep costs against streaming W once, and what a solver solves.
//!
//! Timings are ratios against a baseline measured in the same run; see `examples/`.

pub mod compare;
pub mod draw;
pub mod figures;
pub mod foreign;
pub mod profile;
pub mod record;
pub mod runs;
pub mod tables;

use std::path::{Path, PathBuf};

/// All `.hdf5` files under the given files and folders, sorted.
pub fn problem_files(roots: &[PathBuf]) -> std::io::Result<Vec<PathBuf>> {
    fn walk(path: &Path, found: &mut Vec<PathBuf>) -> std::io::Result<()> {
        if path.is_dir() {
            for entry in std::fs::read_dir(path)? {
                walk(&entry?.path(), found)?;
            }
        } else if path.extension().is_some_and(|e| e == "hdf5") {
            found.push(path.to_owned());
        }
        Ok(())
    }
    let mut found = Vec::new();
    for root in roots {
        walk(root, &mut found)?;
    }
    found.sort();
    Ok(found)
}

/// `1 run`, `2 runs`.
fn plural(n: usize, what: &str) -> String {
    format!("{n} {what}{}", if n == 1 { "" } else { "s" })
}
