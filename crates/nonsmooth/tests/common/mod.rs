//! What the tests of the whole house share.
#![allow(dead_code)]

use std::io::Write;
use std::path::{Path, PathBuf};

/// Says that a test, or a part of it, did not run; past the capture of the output of tests.
pub fn skipped(why: &str) {
    let line = format!("SKIPPED: {why}\n");
    std::io::stderr().write_all(line.as_bytes()).unwrap();
}

/// The HDF5 files under folders of the corpus that `NONSMOOTH_CORPUS` names, sorted; none, said visibly, where it is
/// not set.
pub fn corpus_files(folders: &[&str]) -> Vec<PathBuf> {
    let Some(corpus) = std::env::var_os("NONSMOOTH_CORPUS") else {
        skipped("NONSMOOTH_CORPUS is not set");
        return vec![];
    };
    fn walk(folder: &Path, found: &mut Vec<PathBuf>) {
        for entry in std::fs::read_dir(folder).unwrap() {
            let path = entry.unwrap().path();
            if path.is_dir() {
                walk(&path, found);
            } else if path.extension().is_some_and(|e| e == "hdf5") {
                found.push(path);
            }
        }
    }
    let mut found = vec![];
    folders.iter().for_each(|folder| walk(&Path::new(&corpus).join(folder), &mut found));
    found.sort();
    assert!(!found.is_empty(), "the corpus at {} holds no files", Path::new(&corpus).display());
    found
}
