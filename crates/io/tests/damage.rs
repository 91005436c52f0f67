//! Damaged files: an error of one line, never a panic and never an allocation by a size that is not there.

mod common;

use std::path::Path;

use nonsmooth_io::fclib;
use proptest::strategy::{Strategy, ValueTree};
use proptest::test_runner::TestRunner;

/// Reads bytes as a file, and writes the solution that it holds, if any; the message of the error, if any.
fn read(path: &Path, bytes: &[u8]) -> Option<String> {
    std::fs::write(path, bytes).unwrap();
    let result = fclib::read(path).and_then(|content| match content.solution {
        Some(solution) => fclib::write_solution(path, &solution),
        None => Ok(()),
    });
    let message = result.err()?.to_string();
    assert!(!message.contains('\n') && message.starts_with(path.to_str().unwrap()), "{message}");
    assert!(!message.contains("stopped the HDF5 editor"), "a panic inside: {message}");
    Some(message)
}

/// Files to damage: one that this crate wrote, made by hand, and one by the C library if there is a corpus.
fn originals() -> Vec<Vec<u8>> {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("written.hdf5");
    let mut runner = TestRunner::deterministic();
    let content = common::content().prop_filter("small", |c| c.guesses.len() == 3);
    fclib::write(&path, &content.new_tree(&mut runner).unwrap().current()).unwrap();
    let mut files = vec![
        std::fs::read(path).unwrap(),
        std::fs::read(common::global_tree().save(folder.path())).unwrap(),
    ];
    match std::env::var_os("NONSMOOTH_CORPUS") {
        Some(corpus) => {
            let small = "generated/column/column-2-i000071-8-5.hdf5";
            files.push(std::fs::read(Path::new(&corpus).join(small)).unwrap());
        }
        None => common::skipped("NONSMOOTH_CORPUS is not set: no file by the C library is damaged"),
    }
    files
}

#[test]
fn truncated_files_are_refused() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("truncated.hdf5");
    for bytes in originals() {
        assert_eq!(read(&path, &bytes), None);
        for length in (0..bytes.len()).step_by(7).chain(bytes.len() - 1..bytes.len()) {
            let message = read(&path, &bytes[..length]);
            assert!(message.is_some(), "{length} bytes of {} were read", bytes.len());
        }
    }
}

#[test]
fn flipped_bytes_never_panic() {
    let rounds = std::env::var("NONSMOOTH_FLIPS").map_or(2000, |n| n.parse().unwrap());
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("flipped.hdf5");
    let mut runner = TestRunner::deterministic();
    let mut any = |n: usize| (0..n).new_tree(&mut runner).unwrap().current();
    for bytes in originals() {
        for _ in 0..rounds {
            let mut damaged = bytes.clone();
            for _ in 0..=any(3) {
                // Mostly the few values that sizes and addresses hold in damaged files.
                let byte = [0, 1, 0x7f, 0x80, 0xff, any(256) as u8][any(6)];
                damaged[any(bytes.len())] = byte;
            }
            read(&path, &damaged);
        }
    }
}
