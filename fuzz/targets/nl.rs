//! AMPL's models, text and binary.
#![no_main]

use std::path::Path;

use libfuzzer_sys::fuzz_target;
use nonsmooth_io::Format;
use nonsmooth_io::nl::Nl;

fuzz_target!(|data: &[u8]| {
    let name = Path::new("fuzz.nl");
    match Nl.parse(name, data) {
        Ok(content) => {
            let bytes = Nl.to_bytes(name, &content).expect("what is read can be written");
            let again = Nl.parse(name, &bytes).expect("what is written can be read");
            assert!(content == again, "{content:?}\n{again:?}");
        }
        Err(e) => assert!(!e.to_string().contains('\n'), "{e}"),
    }
});
