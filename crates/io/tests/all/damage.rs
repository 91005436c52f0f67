//! Damaged files: an error of one line, never a panic and never an allocation by a size that is not there.

use std::path::Path;

use nonsmooth_io::Format;
use nonsmooth_io::fclib::{self, Fclib};
use proptest::strategy::{Strategy, ValueTree};
use proptest::test_runner::TestRunner;

/// Reads bytes as a file, and writes the solution that it holds, or zeros; the message of the error, if any.
fn read(path: &Path, bytes: &[u8]) -> Option<String> {
    std::fs::write(path, bytes).unwrap();
    let result = Fclib.read(path).and_then(|content| {
        let (v, m, p) = crate::common::sizes(&content.problem);
        let zeros = |n: usize| vec![0.0; n];
        let point = crate::common::stored(v.map(zeros), zeros(m), zeros(m), zeros(p));
        fclib::write_solution(path, &content.solution.unwrap_or(point))
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
    let content = crate::common::content().prop_filter("small", |c| c.guesses.len() == 3);
    Fclib.write(&path, &content.new_tree(&mut runner).unwrap().current()).unwrap();
    let mut files = vec![
        std::fs::read(path).unwrap(),
        std::fs::read(crate::common::global_tree().save(folder.path())).unwrap(),
        // Into these the solution is not written where an old one stands.
        std::fs::read(crate::common::bilateral_tree().save(folder.path())).unwrap(),
    ];
    match std::env::var_os("NONSMOOTH_CORPUS") {
        Some(corpus) => {
            let small = "generated/column/column-2-i000071-8-5.hdf5";
            files.push(std::fs::read(Path::new(&corpus).join(small)).unwrap());
        }
        None => crate::common::skipped(
            "NONSMOOTH_CORPUS is not set: no file by the C library is damaged",
        ),
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
    let rounds = std::env::var("NONSMOOTH_FLIPS").map_or(500, |n| n.parse().unwrap());
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

/// Says in place of a number that it is another, wherever it stands in 64 bits.
fn claim(bytes: &[u8], is: u64, claimed: u64) -> Vec<u8> {
    let mut bytes = bytes.to_vec();
    for k in 0..bytes.len() - 8 {
        if bytes[k..k + 8] == is.to_le_bytes() {
            bytes[k..k + 8].copy_from_slice(&claimed.to_le_bytes());
        }
    }
    bytes
}

#[test]
fn sizes_that_a_file_cannot_hold_are_refused() {
    // Old headers, which have no checksums: one dataset of 77 entries, then told that it has more.
    const MAKE: &str = r#"
import sys, h5py, numpy as np
with h5py.File(sys.argv[1], 'w', libver=('earliest', 'v108')) as f:
    g = f.create_group('fclib_local')
    g['spacedim'] = np.array([2], 'i4')
    options = dict(chunks=(77,), compression='gzip', maxshape=(None,)) if sys.argv[2] == 'chunks' else {}
    g.create_dataset('vectors/mu', data=np.zeros(77), **options)
"#;
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("claims.hdf5");
    for kind in ["plain", "chunks"] {
        let made =
            std::process::Command::new("python3").args(["-c", MAKE]).arg(&path).arg(kind).output();
        if !made.is_ok_and(|o| o.status.success()) {
            crate::common::skipped("python3 with h5py is not here");
            return;
        }
        let bytes = std::fs::read(&path).unwrap();
        for claimed in [1 << 60, 1 << 40, 1 << 33, u64::MAX - 1] {
            let bytes = claim(&bytes, 77, claimed);
            let message = Fclib.parse(Path::new("x"), &bytes).unwrap_err().to_string();
            let expected = format!("data that fit in the {} bytes of the file", bytes.len());
            let found = format!("shape [{claimed}] of 8 bytes each");
            let place = "x: /fclib_local/vectors/mu";
            assert_eq!(message, format!("{place}: expected {expected}, found {found}"), "{kind}");
        }
    }
}
