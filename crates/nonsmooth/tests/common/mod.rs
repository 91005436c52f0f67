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
    let corpus = Path::new(&corpus);
    let roots: Vec<_> = folders.iter().map(|folder| corpus.join(folder)).collect();
    let (found, mistakes) = nonsmooth_bench::campaign::inputs(&roots);
    assert!(mistakes.is_empty(), "the corpus at {}: {mistakes:?}", corpus.display());
    let mut files: Vec<_> = found.into_iter().map(|input| input.path).collect();
    files.sort();
    files
}
