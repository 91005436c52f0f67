//! Linear complementarity problems in Matrix Market: M, q, l, u and z, with a byte 1 between the files.
#![no_main]

use std::path::Path;

use libfuzzer_sys::fuzz_target;
use nonsmooth_io::Format;
use nonsmooth_io::linear::market;
use nonsmooth_io::linear::toml::Toml;

fuzz_target!(|data: &[u8]| {
    let name = Path::new("fuzz.toml");
    let text = String::from_utf8_lossy(data);
    let mut files = text.split('\u{1}');
    let matrix = files.next().unwrap_or_default();
    let parts = [(); 4].map(|()| files.next().filter(|part| !part.is_empty()));
    match market::parse("fuzz.mtx", matrix, parts) {
        Ok(content) => {
            let bytes = Toml.to_bytes(name, &content).expect("what is read can be written");
            let again = Toml.parse(name, &bytes).expect("what is written can be read");
            assert!(content == again, "{content:?}\n{again:?}");
        }
        Err(e) => assert!(!e.to_string().contains('\n'), "{e}"),
    }
});
