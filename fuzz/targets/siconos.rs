//! Siconos' text files. Their names matter where an LCP and a relay problem look alike.
#![no_main]

use std::path::Path;

use libfuzzer_sys::fuzz_target;
use nonsmooth_io::Format;
use nonsmooth_io::linear::siconos::Siconos;
use nonsmooth_io::linear::toml::Toml;

fuzz_target!(|data: &[u8]| {
    let name = Path::new("fuzz.toml");
    for file in ["lcp.dat", "relay.dat", "fuzz.dat"] {
        match Siconos.parse(Path::new(file), data) {
            Ok(content) => {
                let bytes = Toml.to_bytes(name, &content).expect("what is read can be written");
                let again = Toml.parse(name, &bytes).expect("what is written can be read");
                assert!(content == again, "{content:?}\n{again:?}");
            }
            Err(e) => assert!(!e.to_string().contains('\n'), "{e}"),
        }
    }
});
