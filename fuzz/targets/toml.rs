//! Linear complementarity problems in TOML.
#![no_main]

use std::path::Path;

use libfuzzer_sys::fuzz_target;
use nonsmooth_io::Format;
use nonsmooth_io::linear::toml::Toml;

fuzz_target!(|data: &[u8]| {
    let name = Path::new("fuzz.toml");
    match Toml.parse(name, data) {
        Ok(content) => {
            let bytes = Toml.to_bytes(name, &content).expect("what is read can be written");
            let again = Toml.parse(name, &bytes).expect("what is written can be read");
            assert!(content == again, "{content:?}\n{again:?}");
        }
        Err(e) => assert!(!e.to_string().contains('\n'), "{e}"),
    }
});
