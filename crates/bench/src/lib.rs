//! Measurements of the solvers: what a sweep costs against streaming W once, and what a solver solves.
//!
//! Timings are ratios against a baseline measured in the same run; see `examples/`.

pub mod record;
pub mod report;
pub mod runs;

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
