//! FCLIB's HDF5 files.
#![no_main]

use std::path::Path;

use libfuzzer_sys::fuzz_target;
use nonsmooth_io::Format;
use nonsmooth_io::fclib::Fclib;
use nonsmooth_problem::{AnyProblem, with_problem};

fuzz_target!(|data: &[u8]| {
    let name = Path::new("fuzz.hdf5");
    let content = match Fclib.parse(name, data) {
        Ok(content) => content,
        Err(e) => {
            assert!(!e.to_string().contains('\n'), "{e}");
            return;
        }
    };
    with_problem!(&content.problem, p => p.validate()).expect("what is read is valid");
    // Compressed files can be large, and to write them tells nothing more.
    let AnyProblem::Friction(problem) = &content.problem else { panic!("no contacts") };
    if problem.contacts() > 1000 || content.guesses.len() > 20 {
        return;
    }
    let bytes = Fclib.to_bytes(name, &content).expect("what is read can be written");
    let again = Fclib.parse(name, &bytes).expect("what is written can be read");
    assert!(content == again, "{content:?}\n{again:?}");
});
