//! FCLIB's HDF5 files.
#![no_main]

use libfuzzer_sys::fuzz_target;
use nonsmooth_io::fclib;

fuzz_target!(|data: &[u8]| {
    let content = match fclib::read_bytes("fuzz.hdf5", data) {
        Ok(content) => content,
        Err(e) => {
            assert!(!e.to_string().contains('\n'), "{e}");
            return;
        }
    };
    content.problem.validate().expect("what is read is valid");
    // Compressed files can be large, and to write them tells nothing more.
    if content.problem.contacts() > 1000 || content.guesses.len() > 20 {
        return;
    }
    let bytes = fclib::to_bytes("fuzz.hdf5", &content).expect("what is read can be written");
    let again = fclib::read_bytes("fuzz.hdf5", &bytes).expect("what is written can be read");
    assert!(content == again, "{content:?}\n{again:?}");
});
