//! Siconos' text files. Their names matter where an LCP and a relay problem look alike.
#![no_main]

use std::path::Path;

use libfuzzer_sys::fuzz_target;
use nonsmooth_io::fclib::Fclib;
use nonsmooth_io::linear::toml::Toml;
use nonsmooth_io::siconos::Siconos;
use nonsmooth_io::{Format, ProblemFile};

fuzz_target!(|data: &[u8]| {
    let name = Path::new("fuzz");
    for file in ["lcp.dat", "relay.dat", "fuzz.dat"] {
        match Siconos.parse(Path::new(file), data) {
            Ok(content) => {
                // Contacts have no place in TOML.
                let bytes = Toml.to_bytes(name, &content).or_else(|_| Fclib.to_bytes(name, &content));
                let again = ProblemFile::parse(name, &bytes.expect("what is read can be written")).expect("what is written can be read");
                assert!(content == again, "{content:?}\n{again:?}");
            }
            Err(e) => assert!(!e.to_string().contains('\n'), "{e}"),
        }
    }
});
