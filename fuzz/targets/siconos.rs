//! Siconos' text files. Their names matter where an LCP and a relay problem look alike.
#![no_main]

use libfuzzer_sys::fuzz_target;
use nonsmooth_io::linear::{siconos, toml};

fuzz_target!(|data: &[u8]| {
    let text = String::from_utf8_lossy(data);
    for name in ["lcp.dat", "relay.dat", "fuzz.dat"] {
        match siconos::parse(name, &text) {
            Ok(content) => {
                let text =
                    toml::to_text("fuzz.toml", &content).expect("what is read can be written");
                let again = toml::parse("fuzz.toml", &text).expect("what is written can be read");
                assert!(content == again, "{content:?}\n{again:?}");
            }
            Err(e) => assert!(!e.to_string().contains('\n'), "{e}"),
        }
    }
});
